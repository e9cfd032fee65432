"""The study of damaged inputs: the committed result, a small run, and what it must find."""

import json
import random
from pathlib import Path

import numpy as np
import pytest

from studies.validations import damaged_inputs
from studies.validations._input_bytes import BYTES
from studies.validations._input_cells import CELLS
from studies.validations._input_damage import damaged
from studies.validations._input_examples import Example, one
from studies.validations._input_numbers import not_finite
from studies.validations._input_readers import READERS, Reader
from studies.validations._input_text import TEXT
from studies.validations._input_trees import TREE
from studies.validations.damaged_inputs import OUTCOMES, run
from tyre.base.errors import InputError

COMMITTED = Path(__file__).parents[3] / "data" / "validation" / "damaged_inputs.json"


def test_the_committed_result():
    result = json.loads(COMMITTED.read_text())
    assert set(result["by_reader"]) == {reader.name for reader in READERS}
    for counts in result["by_reader"].values():
        assert list(counts) == list(OUTCOMES)
        assert counts["read"] > 0
        assert counts["refused"] > 0
    assert result["inputs"] == sum(sum(counts.values()) for counts in result["by_reader"].values())
    found = sum(result["total"][outcome] for outcome in OUTCOMES[2:])
    assert found == sum(result["distinct_failures"].values()) == len(result["failures"])


def test_a_small_run_repeats_one_of_its_inputs(tmp_path):
    result = run(out=tmp_path, seed=3, inputs=20)
    assert result["inputs"] == sum(result["total"].values()) == 20
    assert result["failures"] == []
    assert all(result["met"].values())
    again = run(out=tmp_path, seed=3, inputs=1, first=17)
    assert again["inputs"] == 1
    assert (tmp_path / "damaged_inputs.csv").read_text().splitlines()[0].startswith("input,reader,example")


@pytest.mark.parametrize(
    ("does", "outcome"),
    [
        (lambda text: 1.0, "read"), (lambda text: 1 / 0, "traceback"), (lambda text: int("x"), "traceback"),
        (lambda text: {"a": [float("nan")]}, "silent NaN"), (lambda text: Path("/none").read_bytes(), "refused"),
    ],
)  # fmt: skip
def test_what_a_reader_does_is_told_apart(tmp_path, does, outcome):
    example = one("a.txt", b"5")
    reader = Reader("r", 1.0, lambda path, example: does(path.read_bytes()) if path.read_bytes() != b"5" else 0, list)
    ready = damaged_inputs._prepared(reader, [example], tmp_path)["a.txt"]
    assert damaged_inputs._outcome(reader, ready, "a.txt", b"6")[0] == outcome
    assert (ready.folder / "a.txt").read_bytes() == b"5"


def test_a_refusal_is_no_failure_and_a_usual_nan_is_none(tmp_path):
    def read(path: Path, example: Example) -> dict[str, float]:
        if path.read_bytes() == b"bad":
            raise InputError("bad")
        return {"a": float("nan")}

    reader = Reader("r", 1.0, read, list)
    ready = damaged_inputs._prepared(reader, [one("a.txt", b"5")], tmp_path)["a.txt"]
    assert damaged_inputs._outcome(reader, ready, "a.txt", b"bad") == ("refused", "")
    assert damaged_inputs._outcome(reader, ready, "a.txt", b"6") == ("read", "")


def test_where_something_is_not_finite():
    found = {"a": [1.0, np.inf], "b": {"c": np.array([np.nan])}, "d": (1, "nan", None, 2j), "e": complex("nan")}
    assert not_finite(found) == {"[a]", "[b][c]", "[e]"}


@pytest.mark.parametrize("way", dict.fromkeys((*TREE, *TEXT, *BYTES, *CELLS)), ids=lambda way: way.__name__)
def test_every_damage_changes_something_and_repeats(way):
    table, tree = b"a,b\n1,2.5\n3,4\n", b'a = 1.5\nb = "x"\n[c]\nd = [1, 2]\n'
    content = tree if way in TREE else table
    made = [way(content, random.Random(k)) for k in range(20)]
    assert any(one != content for one in made)
    assert made == [way(content, random.Random(k)) for k in range(20)]


def test_damage_of_what_is_damaged_already_goes_on():
    for k in range(50):
        content, what = damaged(b"\xff\xfe", "a.toml", random.Random(k))
        assert isinstance(content, bytes)
        assert what
