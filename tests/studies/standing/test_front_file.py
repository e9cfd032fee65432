"""``velotyre front-frame FILE``: what it prints, what it writes, and what it refuses."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from front_frame_command import refuse, run

from bicycle.model import read_model
from studies.diagnosis import read_measurement
from tyre.ground import read_toml

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "measurements" / "standing"


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(EXAMPLE, tmp_path / "standing"))


def test_the_example_prints_the_joint_and_what_was_checked(folder, capsys):
    """Made with 3500 N m/rad, 7 N m s/rad and a hinge at 0.31 m."""
    shown = run(capsys, folder / "MEASUREMENT.toml")
    lines = shown.splitlines()
    assert lines[0] == "One hinge explains the readings."
    assert "stiffness 3493 ± 26 N m/rad" in lines[1]
    assert "The frame was read and was held" in shown


def test_the_model_holds_numbers_and_their_covariance(folder, tmp_path, capsys):
    target = tmp_path / "mine.toml"
    shown = run(capsys, folder / "MEASUREMENT.toml", "--out", target)
    assert shown.splitlines()[-1] == f"{target}: next: velotyre run {target}"
    model = read_model(target)
    names = ["front_compliance.stiffness", "front_compliance.joint_z"]
    covariance = model.covariance.among(names)
    assert model.parameters[names[0]] == pytest.approx(3500.0, rel=0.02)
    assert np.sqrt(covariance[0, 0]) == pytest.approx(26.0, rel=0.05)
    assert covariance[0, 1] != 0
    assert "assumed" not in read_toml(target, "model file")["description"].lower()


def test_the_damping_of_an_empty_frame_does_not_go_under_a_rider_who_is_fixed(folder, tmp_path, capsys):
    target = tmp_path / "ridden.toml"
    shown = run(capsys, folder / "MEASUREMENT.toml", "--bicycle", "pista_charlie_drops", "--out", target)
    assert "It is that of a frame without a rider and is not written" in shown
    content = read_toml(target, "model file")
    assert "damping" not in content["effects"]["front_compliance"]
    assert "front_compliance.damping" not in content["covariance"]["parameters"]


def test_one_sensor_says_that_the_height_is_assumed(folder, capsys):
    (folder / "taps.csv").write_text("frequency_Hz,frequency_sd_Hz\n16.52,0.02\n")
    text = (folder / "MEASUREMENT.toml").read_text().replace('deflections = "readings.csv"\n', "")
    (folder / "one.toml").write_text(text)
    shown = run(capsys, folder / "one.toml")
    assert "The readings leave the height of the hinge open: 0.35 ± 0.1 m above the hub is assumed." in shown
    assert "Damping was not measured" in shown
    assert "Not checked: whether the frame was held" in shown


def test_what_cannot_be_written_is_refused(folder, tmp_path, capsys):
    file, target = folder / "MEASUREMENT.toml", tmp_path / "mine.toml"
    target.write_text("")
    assert "exists; give --force to overwrite it or another name" in refuse(capsys, file, "--out", target)
    assert "the ending '.csv' is not known; write a .toml file" in refuse(capsys, file, "--out", tmp_path / "mine.csv")
    rows = (folder / "readings.csv").read_text().replace("frame,-0.06", "frame,0.90")
    (folder / "readings.csv").write_text(rows)
    said = refuse(capsys, file, "--out", target, "--force")
    assert "is not written: the readings give no numbers" in said
    other = folder.parent / "other.toml"
    other.write_text('kind = "modal"\nbicycle = "pista"\n[modal]\ntable = "x.csv"\n')
    (folder.parent / "x.csv").write_text("speed_m_s,mode,real_1_s,imag_rad_s\n4,weave,-1,4\n5,weave,-2,5\n")
    assert "a front frame is measured by kind = 'standing'" in refuse(capsys, other)


def test_the_kind_is_one_of_diagnose(folder):
    measurement = read_measurement(folder / "MEASUREMENT.toml").prepare()
    names = {candidate.identifier for candidate in measurement.candidates}
    assert {"front_compliance", "fork_bending", "support"} <= names
    assert not {"relaxation_length", "rider_arms", "steer_damper"} & names
