"""Every study of tests/validation runs on a tiny count."""

import json
import subprocess
import sys

import pytest
from click.testing import CliRunner

from tests.validation.__main__ import main, studies
from tests.validation.blind import baseline

TINY = {
    "answer-grades": "--seed 3 --cases 1 --workers 1",
    "blind-test": "--seed 3 --cases 1 --cells modal-none --workers 1",
    "corrected-models": "--seed 4 --cases 1 --histories 0",
    "critical-speeds": "--seed 42 --models 4",
    "disturbed-steps": "--seed 7 --tyres 2 --workers 1",
    "hands-on-the-bar": "--seed 5 --draws 60",
    "hostile": "--seed 910005 --cases 1",
    "limit-cycles": "--seed 6 --models 2",
    "measured-bicycles": "--seed 3 --bicycles 1 --many 24 --workers 1",
    "mode-names": "--seed 5 --bicycles 1 --models 2",
    "pull-shapes": "--seed 7 --draws 1 --workers 1",
    "published-front-figures": "--seed 5 --frames 6 --fresh 3",
    "repeats": "--seed 5 --campaigns 20",
    "standing": "--seed 3 --fronts 1 --holds 0 --sways 1 --workers 1",
    "rig-coverage": "--seed 99 --campaigns 1 --jobs 1",
    "ride-forces": "--seed 3 --rides 1 --duration 180",
    "ride-wobble": "--seed 3 --rides 1 --restless 0 --none 0 --duration 80 --workers 1",
    "seated-taps": "--seed 5 --cases 1 --workers 1",
    "seated-rider": "--seed 2 --tables 1 --rides 0 --none 0 --workers 1",
}
SLOW = {"benchmark", "credit", "damaged-inputs", "every-bicycle", "field-cases", "foreign-rig", "free-decays"}
SLOW |= {"joint-diagnosis", "readings", "unmodelled-torque", "search-optimum", "sensitivity-mpmath", "sensor-faults"}
SLOW |= {"hostile-values", "independent-derivation", "ridden", "ride-spectra", "sweep-scale", "under-a-rider"}
SLOW |= {"standing-friction"}
SLOW |= {"real-rides"}  # its own test is test_real_rides
SLOW |= {"what-riders-report"}  # its own test is test_what_riders_report


def test_all_studies_are_listed():
    """In a process of its own, which has no paths but those it finds."""
    said = subprocess.run([sys.executable, "-m", "tests.validation"], capture_output=True, text=True).stderr
    assert all(name in said for name in studies())
    assert {*TINY, *SLOW} == set(studies())


@pytest.mark.parametrize("name", TINY)
def test_a_study_runs(name, tmp_path, monkeypatch):
    monkeypatch.setattr(baseline, "TABLE", {})  # the rival is tried in test_blind_cells
    found = CliRunner().invoke(main, [name, *TINY[name].split(), "--out", str(tmp_path)], catch_exceptions=False)
    assert found.exit_code == 0, found.output
    result = json.loads((tmp_path / f"{name.replace('-', '_')}.json").read_text())
    assert result
    assert not result.get("errors", result.get("unexplained"))
    assert not any(cell.get("errors") for cell in result.get("cells", {}).values())


@pytest.mark.parametrize("arguments", [["critical-speed"], ["repeats"], ["repeats", "--seed", "-1"],
                                       ["critical-speeds", "--seed", "1", "--models", "0"]])  # fmt: skip
def test_a_wrong_name_or_count_is_refused(arguments):
    assert CliRunner().invoke(main, arguments).exit_code == 2
