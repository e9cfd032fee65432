"""SYNTHETIC fronts, made by own rigid-body and beam programs outside velotyre, with their right values.

All are of the packaged bicycle ``pista``; places are m above the hub along the steer axis.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.model import build_model, read_model, standard_deviations
from bicycle.parameters import hinge_at
from studies.cli import main
from tyre.ground import read_toml

CASES = Path(__file__).parent / "front_cases"
KEYS = ("front_compliance.stiffness", "front_compliance.joint_z", "front_compliance.damping")


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Record and model file of each case, by name."""
    folder = tmp_path_factory.mktemp("fronts")
    found = {}
    for case in sorted(CASES.iterdir()):
        record, model = folder / f"{case.name}.json", folder / f"{case.name}.toml"
        writes = [] if case.name == "frame_not_clamped" else ["--out", str(model)]
        main(["front-frame", str(case / "standing.toml"), "--json", str(record), *writes])
        found[case.name] = json.loads(record.read_text()), model
    return found


def within(model_file, key, truth, tolerance):
    """The value is right within a ``tolerance`` and its 95 % interval holds the truth; the standard uncertainty."""
    model = read_model(model_file)
    sd = standard_deviations(model, assume=False)[key].sd
    assert model.parameters[key] == pytest.approx(truth, abs=tolerance)
    assert abs(model.parameters[key] - truth) <= 1.96 * sd
    return sd


def test_deflections_at_home(measured):
    record, model = measured["static_home"]
    assert within(model, KEYS[0], 3800.0, 0.04 * 3800.0) < 0.1 * 3800.0 / 1.96
    assert within(model, KEYS[1], -0.643, 0.015) < 0.03 / 1.96
    assert not record["damping_measured"]
    assert "damping" not in read_toml(model, "model file")["effects"]["front_compliance"]
    assert standard_deviations(read_model(model))[KEYS[2]].origin == "assumed"


def test_taps_at_hub_and_stem(measured):
    record, model = measured["tap_two_sensors"]
    within(model, KEYS[0], 4200.0, 0.04 * 4200.0)
    within(model, KEYS[1], -0.614, 0.010)
    within(model, KEYS[2], 1.61, 0.05 * 1.61)
    assert record["hold_checked"] == "no"


def test_taps_with_an_added_mass(measured):
    _, model = measured["tap_added_mass"]
    within(model, KEYS[0], 2600.0, 0.08 * 2600.0)
    within(model, KEYS[1], hinge_at(load_bicycle("pista").values, 0.36)[1], 0.040)
    within(model, KEYS[2], 4.90, 0.10 * 4.90)


def test_a_frame_in_a_workstand_is_not_taken_for_a_clamped_one(measured):
    """Roll and yaw 1500 N m/rad, 30 N/mm; the front has 5200 N m/rad."""
    record, _ = measured["frame_not_clamped"]
    assert record["outcome"] == "not_held"
    assert "effects" not in record
    assert record["hypotheses"]["one hinge"]["p"] < 1e-6
    assert record["hypotheses"]["two joints"]["p"] < 1e-6


TRUE_FRONT = ((17410.0, 11.08, 1.16), (4279.0, 2.72, 0.1))


def front_tables(bicycle, front, fork):
    (stiffness, damping, height), (fork_stiffness, fork_damping, length) = front, fork
    joint_x, joint_z = hinge_at(bicycle.values, height)
    hinge = {"stiffness": stiffness, "damping": damping, "joint_x": joint_x, "joint_z": joint_z}
    return {
        "front_compliance": hinge,
        "fork_bending": {"stiffness": fork_stiffness, "damping": fork_damping, "length": length},
    }


def wobble(bicycle, fronts, bar, *, hands):
    """Lowest damping ratio of wobble from 3 to 20 m/s, and the speed (m/s) at which it becomes unstable."""
    loads = dict(zip(("rear", "front"), bicycle.static_loads, strict=True))
    effects = {
        **fronts,
        "relaxation_length": {"tyre": "Tyre1", "pressure_bar": bar},
        "camber_thrust": {"camber_stiffness": {wheel: 0.685 * load for wheel, load in loads.items()}},
        "pneumatic_trail": {"trail": 0.019},
        "twisting_torque": {"twisting_stiffness": 5.4},
        **({"rider_arms": {}} if hands else {}),
    }
    model = build_model({"bicycle": bicycle.name, "effects": effects, "allow_unusual": True}).linear_model()
    speeds = np.arange(0.5, 20.01, 0.1)
    lowest, onset = math.inf, None
    for speed, roots in zip(speeds, np.linalg.eigvals(model.state_matrix(speeds)), strict=True):
        hertz = np.abs(roots.imag) / (2 * math.pi)
        growth = (roots.real / np.abs(roots))[(hertz > 3) & (hertz < 15)].max()
        lowest = min(lowest, -growth) if speed >= 3 else lowest
        onset = speed if onset is None and growth > 0 else onset
    return lowest, onset


@pytest.mark.parametrize("bar", [3.5, 7.5])
def test_a_front_that_sways_wobbles_as_its_true_joints_do(measured, bar):
    record, model = measured["real_front"]
    assert record["outcome"] == "two_joints"
    covariance = record["covariance"]
    assert {"front_compliance.stiffness", "fork_bending.stiffness"} <= set(covariance["parameters"])
    ridden = load_bicycle("pista_charlie_drops")
    found = read_toml(model, "model file")["effects"]
    truth = front_tables(ridden, *TRUE_FRONT)
    one_hinge = {"front_compliance": front_tables(ridden, (15858.0, 10.09, 1.123), TRUE_FRONT[1])["front_compliance"]}
    off, off_true = (wobble(ridden, fronts, bar, hands=False) for fronts in (found, truth))
    on, on_true, on_one = (wobble(ridden, fronts, bar, hands=True) for fronts in (found, truth, one_hinge))
    assert off[0] == pytest.approx(off_true[0], abs=0.012)
    assert on[0] == pytest.approx(on_true[0], abs=0.012)
    assert on[1] == pytest.approx(on_true[1], abs=0.4)
    assert on_one[1] is None  # what one hinge through hub and stem would say
