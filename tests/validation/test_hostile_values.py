"""Hostile values end in one line or in numbers, and what is worse is found."""

import warnings

import click
import pytest

from studies.cli import main
from tests.validation.hostile_values import attacked, outcome


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("kind", ["-modes", "-critical", "-chart", "seat", "model", "effect steer_damper"])
def test_hostile_values_are_refused_or_computed(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ends = attacked(kind, seed=7, inputs=12, seconds=0.3)
    assert sum(ends[end] for end in ("numbers", "checked", "refused")) > 0
    assert not [said for said in ends if said not in ("numbers", "checked", "refused")]


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(
    ("action", "words"),
    [
        (lambda: 1 / 0, "ZeroDivisionError: division by zero"),
        (lambda: warnings.warn("odd", RuntimeWarning, stacklevel=1), "warning: odd"),
        (lambda: click.echo("speed nan"), "NaN in what is shown"),
        (lambda: click.get_current_context().exit(), "RuntimeError"),
    ],
)
def test_what_is_wrong_is_a_failure(action, words):
    end, said = outcome(action)
    assert end == "failed"
    assert said.startswith(words)


def test_what_is_right_is_none(capsys):
    assert outcome(lambda: main(["bicycles", "pista"])) == ("numbers", "")
    end, said = outcome(lambda: main(["modes", "benchmark", "--max-speed", "nan"]))
    assert (end, said) == (
        "refused",
        "velotyre: Invalid value for '--max-speed': nan: give a number above 0 up to 1000",
    )
    assert capsys.readouterr().out == ""
