"""Hostile values end in one line or in numbers, and what is worse is found."""

import warnings

import click
import numpy as np
import pytest

from bicycle.identification import spectral_response
from studies.cli import main
from tests.validation.hostile_values import attacked, outcome
from tyre.ground import InputError


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("kind", ["-modes", "-critical", "-chart", "seat", "model", "effect steer_damper"])
def test_hostile_values_are_refused_or_computed(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ends = attacked(kind, seed=7, inputs=12, seconds=0.3)
    assert sum(ends[end] for end in ("numbers", "checked", "refused")) > 0
    assert not [said for said in ends if said not in ("numbers", "checked", "refused")]


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(("action", "words"), [
    (lambda: 1 / 0, "ZeroDivisionError: division by zero"),
    (lambda: warnings.warn("odd", RuntimeWarning, stacklevel=1), "warning: odd"),
    (lambda: click.echo("speed nan"), "NaN in what is shown"),
    (lambda: click.get_current_context().exit(), "RuntimeError"),
])  # fmt: skip
def test_what_is_wrong_is_a_failure(action, words):
    end, said = outcome(action)
    assert end == "failed"
    assert said.startswith(words)


def test_what_is_right_is_none(capsys):
    assert outcome(lambda: main(["bicycles", "pista"])) == ("numbers", "")
    end, said = outcome(lambda: main(["modes", "benchmark", "--max-speed", "nan"]))
    assert (end, said) == (
        "refused",
        "velotyre: Invalid value for '--max-speed': nan: give a number above 0 up to 1000 m/s",
    )
    assert capsys.readouterr().out == ""


def test_a_valid_text_that_is_refused_ends_the_study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # without the tables that the file names
    (tmp_path / "measured").mkdir()
    with pytest.raises(InputError, match="measurement kooijman2008: its valid text ends refused"):
        attacked("measurement kooijman2008", seed=1, inputs=1, seconds=1)


def test_a_folder_for_a_file_is_refused_before_it_is_searched(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = "chart benchmark --x speed=1:10 --y c=0.02:0.12 --out chart --json ."
    end, said = outcome(lambda: main(line.split()))
    assert (end, said) == ("refused", "velotyre: --json .: is a folder; give a file")


def test_segments_far_longer_than_the_recording_take_no_memory():
    x = np.random.default_rng(1).standard_normal(400)
    with pytest.raises(InputError, match=r"4 s hold 0\.0 independent segments of 1e\+15 s"):
        spectral_response([x], [x], 0.01, segment_s=1e15)
