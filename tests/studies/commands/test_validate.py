"""``velotyre validate``: finds its modules; a small fixed run of the rig coverage study."""

import json
import sys
from importlib import import_module
from pathlib import Path

import click
import pytest

from studies.cli import main
from studies.commands.validate import ValidationGroup


def test_validations_are_found_and_described(capsys):
    main(["validate", "--help"])
    assert "rig-coverage" in capsys.readouterr().out
    main(["validate", "rig-coverage", "--help"])
    printed = capsys.readouterr().out
    assert "--seed" in printed
    assert "--campaigns" in printed
    assert "SYNTHETIC" in printed


def test_unknown_validation_ends_in_one_line(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["validate", "critical-speed"])
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert "unknown validation 'critical-speed'; did you mean 'critical-speeds'? known: batches" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["critical-speeds", "--seed", "-1"], "-1 is not in the range x>=0"),
        (["critical-speeds", "--seed", "1", "--models", "0"], "0 is not in the range x>=1"),
        (["residual-torque", "--seed", "1", "--histories", "-1"], "-1 is not in the range x>=0"),
        (["batches", "--seed", "1", "--minutes", "-5"], "-5 is not in the range x>=0"),
        (["mutation", "--seed", "1", "--longest", "0"], "0.0 is not in the range x>0"),
    ],
)
def test_counts_that_are_none_are_refused(arguments, words, capsys, tmp_path):
    with pytest.raises(SystemExit) as stop:
        main(["validate", *arguments, "--out", str(tmp_path)])
    assert stop.value.code == 2
    assert words in capsys.readouterr().err


def test_any_module_becomes_a_command(tmp_path, monkeypatch, capsys):
    package = tmp_path / "made_up_validations"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "two_words.py").write_text(
        '"""Adds."""\n\n\ndef run(*, out, seed, factor=2.0, loud=False):\n'
        '    return {"sum": seed * factor, "loud": loud}\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    group = ValidationGroup("made_up_validations", name="validate")
    assert group.list_commands(click.Context(group)) == ["two-words"]
    arguments = ["two_words", "--seed", "3", "--factor", "1.5", "--loud", "--out", str(tmp_path / "o"), "--json", "-"]
    group.main(arguments, standalone_mode=False)
    assert json.loads(capsys.readouterr().out) == {"sum": 4.5, "loud": True}
    assert json.loads((tmp_path / "o" / "two_words.json").read_text())["sum"] == 4.5
    sys.modules.pop("made_up_validations.two_words")


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    out = tmp_path_factory.mktemp("coverage")
    return import_module("studies.validations.rig_coverage").run(out=out, seed=99, campaigns=6, jobs=1)


def test_small_coverage_study(small):
    # 12 cases at 95 %: fewer than 9 held has a probability of 2 in 10 000
    assert small["coverage"]["cornering_stiffness"]["cases"] == 12
    for name in ("cornering_stiffness", "lateral_stiffness", "relaxation_length"):
        assert small["coverage"][name]["held"] >= 9
    # targets of bias, widened by four standard errors of so few cases
    error = small["error"]
    for name, target in (("cornering_stiffness", 0.3), ("lateral_stiffness", 0.5)):
        assert abs(error[name]["mean_percent"]) < target + 4 * error[name]["standard_error_percent"]


def test_lag_correction_removes_a_bias(small):
    without = small["without_lag_correction"]
    change = without["change_by_correction"]
    assert change["mean_percent"] > 3 * change["standard_error_percent"] > 0
    force = without["force_at_zero_slip_one_branch_N"]
    assert force["without"] > 3 * force["with"]


def test_intervals_hold_the_truth_with_few_repeats(tmp_path, monkeypatch):
    repeats = import_module("studies.validations.repeats")
    monkeypatch.setattr(repeats, "SCATTERS", ("as stated", 1.0))  # of the others nothing is claimed
    found = repeats.run(out=tmp_path, seed=5, campaigns=400)["share_percent"]
    assert list(found) == ["as stated", "1.0"]
    for shares in found.values():  # 95 +- 2 %, widened by three standard errors of so few
        for share in shares.values():
            assert 93.0 - 3.3 < share <= 99.5


def test_committed_repeats_meet_their_targets():
    path = Path(__file__).parents[3] / "data" / "validation" / "repeats.json"
    result = json.loads(path.read_text())
    assert (result["synthetic"], result["campaigns"]) == (True, 4000)
    for scatter in ("as stated", "1.0"):
        for pairs in ("1", "3", "30"):
            assert 93.0 <= result["share_percent"][scatter][pairs] <= 97.0


def test_committed_faults_of_sensors_meet_their_targets():
    path = Path(__file__).parents[3] / "data" / "validation" / "sensor_faults.json"
    result = json.loads(path.read_text())
    assert (result["synthetic"], result["sound_sweeps"]) == (True, 400)
    alarms = result["false_alarms_percent"]
    assert max(alarms["flattening"], alarms["gain"]) <= 2.0
    steep = result["found"]["side_force flattens from 70% of its range on"]
    assert min(steep["10%"]["flattening_percent"], steep["20%"]["flattening_percent"]) >= 75.0


def test_committed_result_meets_its_targets():
    path = Path(__file__).parents[3] / "data" / "validation" / "rig_coverage.json"
    result = json.loads(path.read_text())
    assert result["synthetic"] is True
    assert result["campaigns"] == 500
    for name in ("cornering_stiffness", "lateral_stiffness"):
        assert 92.0 <= result["coverage"][name]["share_percent"] <= 98.0
    assert abs(result["error"]["cornering_stiffness"]["mean_percent"]) < 0.3
    assert abs(result["error"]["lateral_stiffness"]["mean_percent"]) < 0.5
