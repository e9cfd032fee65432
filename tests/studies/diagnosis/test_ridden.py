"""Causes that real rides have, in rides of an independent simulator: sized, and told from physics."""

import numpy as np
import pytest
from small_library import among

from studies.diagnosis import read_measurement
from studies.inference import fit
from tests.validation.ridden import ANSWERS, NOISE, judged, make, turned

RIDE = {"rotated": "imu_rotation", "coast_down": "coast_down", "clock": "imu_clock", "pedalling": "pedalling",
        "sway": "rider_sway", "gusts": "side_gusts"}  # fmt: skip


def ride(folder, cause, seed, *hidden):
    truth = make(folder, cause, hidden, np.random.default_rng(seed), twice=1)
    return truth["cause"], read_measurement(folder / "MEASUREMENT.toml")


def evidence(kind, null, name):
    candidate = next(c for c in kind.candidates if c.identifier == name)
    found = fit(kind, (candidate,), starts=[np.concatenate([null.theta, candidate.starts[0]])])
    return found, found.log_evidence - null.log_evidence


@pytest.mark.parametrize("cause", ANSWERS)
def test_a_cause_of_the_ride_explains_it_better_than_physics_does(tmp_path, cause):
    truth, measurement = ride(tmp_path, cause, 4)
    kind = measurement.ready()
    null = fit(kind)
    kind = kind.refined(null)
    null = fit(kind, starts=[null.theta])
    if cause == "none":
        assert max(evidence(kind, null, name)[1] for name in RIDE.values()) < 3
        return
    found, gain = evidence(kind, null, RIDE[cause])
    assert gain > 20
    assert gain > evidence(kind, null, "steer_damper")[1] + 20
    sizes = {"rotated": truth["rotated_deg"][1] * np.pi / 180, "coast_down": truth["deceleration"],
             "clock": truth["late"]}  # fmt: skip
    if cause in sizes:
        assert not found.negligible()
        column = found.effect_columns.start
        assert abs(found.theta[column] - sizes[cause]) < 4 * np.sqrt(found.covariance[column, column])


def test_gusts_are_named_where_nothing_else_explains(tmp_path):
    """The noise of the sensors is known: else the gusts count as noise."""
    make(tmp_path, "gusts", (), np.random.default_rng(4), twice=1)
    with (tmp_path / "MEASUREMENT.toml").open("a") as file:
        file.write("\n[histories.noise_sd]\n" + "".join(f"{name} = {sd}\n" for name, sd in NOISE.items()))
    measurement = read_measurement(tmp_path / "MEASUREMENT.toml")
    found = among(measurement, ("side_gusts", "steer_damper", "imu_rotation"))
    score = judged(found.verdict, "gusts", ())
    assert score["cause_named"]
    assert score["no_false_physics"]
    assert found.verdict.titles["side_gusts"] == "gusts or a rough road"


def test_a_box_is_turned_by_yaw_then_pitch_then_roll():
    """Against the rotation matrix of scipy."""
    from scipy.spatial.transform import Rotation

    roll, pitch, yaw = 0.1, -0.2, 0.3
    assert turned(roll, pitch, yaw) == pytest.approx(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix())
