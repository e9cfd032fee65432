"""The benchmark of answers: its rivals on responses of a line, its scorer and its table; SYNTHETIC."""

import json

import numpy as np
import pytest
from scipy.special import ndtr

from tests.validation import benchmark
from tests.validation.benchmark import read_answers, scored, table
from tests.validation.blind.rivals import at, evidence, nested, process, sparse
from tyre.ground import InputError

RNG = np.random.default_rng(4)
SPEEDS = np.linspace(3.0, 8.0, 15)
SHAPES = {"steer_damper": np.repeat(np.sin(SPEEDS), 2), "steer_spring": np.repeat(np.cos(0.7 * SPEEDS), 2)}


def seen(truth):
    """Residuals of the stated bicycle, their responses to two effects, linear in their sizes, and their rows."""
    y = sum((20 * x * SHAPES[name] for name, x in truth.items()), RNG.standard_normal(30))
    grid = np.linspace(0, 4, 9)
    known = {name: (grid, [y - 20 * grid[:, None] * shape]) for name, shape in SHAPES.items()}
    return y, {name: 20 * shape for name, shape in SHAPES.items()}, known, [("weave", v) for v in SPEEDS]


@pytest.mark.parametrize(("truth", "answer"), [({}, []), ({"steer_damper": 1.3}, ["steer_damper"])])
def test_rivals_name_what_is_clear(truth, answer):
    y, columns, known, rows = seen(truth)
    for found in (sparse(y, columns, known), process(y, columns, rows), nested(y, known, np.random.default_rng(1))):
        assert found["class"] == answer
        assert found["verdict"] == ("named" if answer else "none")


def test_sparse_regression_finds_two_and_a_process_what_is_like_none():
    y, columns, known, rows = seen({"steer_damper": 1.0, "steer_spring": 2.0})
    assert sparse(y, columns, known)["class"] == ["steer_damper+steer_spring"]
    other = 30 * np.repeat((SPEEDS - 5.5) ** 2 / 6 - 0.4, 2) + RNG.standard_normal(30)
    assert process(other, columns, rows)["verdict"] == "unknown"


@pytest.mark.parametrize("size", [1, 2, 3])
def test_nested_sampling_against_the_integral(size):
    """Normal of sd 0.05 about the middle of the cube: its integral is a product of error functions."""
    found = [
        evidence(lambda u: -float(((u - 0.5) ** 2).sum()) / (2 * 0.05**2), size, np.random.default_rng(seed))
        for seed in range(4)
    ]
    exact = size * np.log((2 * ndtr(10.0) - 1) * 0.05 * np.sqrt(2 * np.pi))
    assert np.mean(found) == pytest.approx(exact, abs=0.4)


def test_a_response_is_linear_between_its_sizes():
    grid = np.array([0.5, 1.0, 2.0])
    response = grid, [np.outer(grid, [1.0, 0.0]), np.array([[1.0, 5.0], [1.0, 6.0], [1.0, 8.0]])]
    np.testing.assert_allclose(at(response, np.array([1.5, 1.5])), [1.5, 7.0])


def test_answers_of_others_are_scored(tmp_path):
    truths = {
        "modal-one_1": {"effects": {"steer_damper": {"damping": 1.0}}}, "modal-none_1": {"effects": {}},
        "modal-outside_1": {"effects": {"rotor": {}}},
    }  # fmt: skip
    file = tmp_path / "mine.json"
    file.write_text(json.dumps({"modal-one_1": {"verdict": "class", "class": ["steer_spring", "steer_damper"]},
                                "modal-outside_1": {"verdict": "named", "class": ["steer_spring"]}}))  # fmt: skip
    found = scored(read_answers(file), truths)
    assert found["modal-one"]["right"]["hits"] == 1
    assert found["modal-none"]["any_name"]["hits"] == 0
    assert found["modal-outside"]["named_or_class_wrong"]["hits"] == 1
    assert "| mine | 0/1, 0-79 %" in " ".join(table({"mine": found}).split())


@pytest.mark.parametrize(("text", "error"), [
    ("[1]", "must be an object"), ("{", "no answers as JSON"),
    ('{"modal-one_2": {"verdict": "none"}}', "unknown case 'modal-one_2'; did you mean 'modal-one_1'"),
    ('{"modal-one_1": "none"}', "must be an object with a verdict"),
])  # fmt: skip
def test_answers_that_cannot_be_scored_are_refused(tmp_path, text, error):
    file = tmp_path / "mine.json"
    file.write_text(text)
    with pytest.raises(InputError, match=error):
        scored(read_answers(file), {"modal-one_1": {"effects": {}}})


def test_cases_and_table_are_written(tmp_path, monkeypatch):
    """All but the search and the rivals, which the blind test and the tests above ask."""
    answer = {"verdict": "none", "class": [], "effects": [], "held_out_gap": {"nominal": None, "final": None}}
    row = {"cell": "modal-none", "seed": 5, "truth": {"effects": {}, "noise": 1.0}, "verdict": answer, "baseline": None}
    monkeypatch.setattr(benchmark, "blind_test", lambda *_, **__: [row])
    monkeypatch.setattr(benchmark, "asked", lambda *_: {"sparse regression": answer})
    found = benchmark.run(out=tmp_path, seed=5, cases=1)
    assert (found["cases"], found["errors"]) == (1, [])
    assert (tmp_path / "cases" / "modal-none_5" / "MEASUREMENT.toml").exists()
    assert set(json.loads((tmp_path / "cases" / "truths.json").read_text())) == {"modal-none_5"}
    assert "| velotyre " in (tmp_path / "benchmark.md").read_text()
