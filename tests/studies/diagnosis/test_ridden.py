"""Causes that real rides have, in rides of an independent simulator: sized, and told from physics."""

import numpy as np
import pytest
from published_bicycle import BASE, FINE, TILT, TRAIL
from published_bicycle import ride as published
from scipy.signal import lfilter
from small_library import among

from bicycle import Model, load_bicycle
from bicycle.identification import Run
from studies.diagnosis import Histories, read_measurement, riding
from studies.inference import Joint, Part, fit
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
    kind = measurement.prepare()
    null = fit(kind)
    kind = kind.estimate_noise(null)
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
        assert not found.effects_too_small()
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
    (gusts,) = (effect for effect in found.verdict.effects if effect.identifier == "side_gusts")
    assert gusts.units["side_force_rms"] == "N"
    size, sd = gusts.parameters["side_force_rms"]
    assert 4 * sd < size < 20 * sd


@pytest.mark.parametrize("cause", ["pedalling", "steering", "side_gusts"])
def test_a_torque_that_nobody_recorded_has_a_true_size_and_frequency(cause):
    """Published equations; a lateral force at the mass centre leans by its height and steers by its place and trail."""
    rng, runs, square, keep = np.random.default_rng(1), [], [], np.exp(-FINE / 2 / 0.3)
    key, unit, steer, lean = {
        "pedalling": ("lean_torque_rms", "N m", 0.01, 3.0),
        "steering": ("steer_torque_rms", "N m", 0.2, 0.0),
        "side_gusts": ("side_force_rms", "N", 8 * 0.3 * TRAIL * np.cos(TILT) / BASE, 8 * 0.9),
    }[cause]
    for speed in (4.6, 5.2, 5.8, 6.4):
        pushed = np.sin(2 * np.pi * 1.43 * np.arange(6003) * FINE / 2 + rng.uniform(0, 6))
        if cause == "side_gusts":
            pushed = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(9003))[3000:]
        torques = [lambda t, u=size * pushed: u[np.rint(2 * t / FINE).astype(int)] for size in (steer, lean)]
        time, x = published(speed, 3.0, torques[0], lean_torque=torques[1])
        seen = {"roll_rate_rad_s": x[::20, 2], "steer_rad": x[::20, 1]}
        seen = {name: y + NOISE[name] / 5 * rng.standard_normal(len(y)) for name, y in seen.items()}
        runs.append(Run(f"{speed}", speed, time[::20], seen, {}))
        square.append(np.mean(pushed[:6001:2] ** 2))
    kind = Histories(name="own", model=Model(load_bicycle("benchmark")), runs=tuple(runs)).prepare()
    torque = next(c for c in kind.candidates if c.identifier == cause.replace("steering", "pedalling"))
    kind = kind.estimate_noise(fit(kind, (torque,)))
    theta = fit(kind, (torque,)).theta
    told = kind.marginalised_sizes((torque,), theta, torque.identifier)
    value, sd, of = told[key]
    true = {"pedalling": 3.0, "steering": 0.2, "side_gusts": 8.0}[cause] * np.sqrt(np.mean(square))
    assert of == unit
    assert abs(value - true) < 2 * sd < 0.15 * true
    hertz, sd, of = told["corner_frequency" if cause == "side_gusts" else "frequency"]
    assert of == "Hz"
    assert abs(hertz - (1 / (2 * np.pi * 0.3) if cause == "side_gusts" else 1.43)) < 2 * sd
    assert sd < (0.3 if cause == "side_gusts" else 0.02)
    assert len(told) == 2
    part = Part("a", kind, own=frozenset({torque.identifier}))
    whole = Joint((part,)), (part.candidate(torque),)
    assert whole[0].marginalised_sizes(whole[1], theta, f"a/{torque.identifier}") == told
    assert not whole[0].marginalised_sizes(whole[1], theta, "steer_damper")


@pytest.mark.parametrize(("gain", "leans"), [(1.0, True), (0.95, False)])
def test_a_yaw_gyro_that_leans_with_the_frame_is_no_wrong_gain(gain, leans):
    """No contact slips sideways: yaw rate = (v steer + trail d(steer)/dt) cos(tilt) / wheelbase."""
    rng, runs = np.random.default_rng(1), []
    for speed in (4.6, 5.2, 5.8, 6.4):
        time, x = published(speed, 3.0, lambda t: 0.0, lean_rate=0.7)
        yaw = gain * (speed * x[:, 1] + TRAIL * x[:, 3]) * np.cos(TILT) / BASE * (np.cos(x[:, 0]) if leans else 1.0)
        seen = {"roll_rate_rad_s": x[::20, 2], "steer_rad": x[::20, 1], "yaw_rate_rad_s": yaw[::20]}
        seen = {name: y + 0.2 * NOISE[name] * rng.standard_normal(len(y)) for name, y in seen.items()}
        runs.append(Run(f"{speed}", speed, time[::20], seen, {}))
    kind = Histories(name="own", model=Model(load_bicycle("benchmark")), runs=tuple(runs)).prepare()
    wrong, leaning = (c for c in kind.candidates if c.identifier in ("yaw_rate_scale", "yaw_gyro_leans"))
    alone = [fit(kind, (c,)).log_evidence for c in (wrong, leaning)]
    assert (alone[1] > alone[0] + 10) == leans
    base = (leaning,) * leans
    both = fit(kind, (*base, wrong))
    assert (both.log_evidence > fit(kind, base).log_evidence + 3) == (gain < 1)
    assert abs(np.expm1(both.theta[-1]) - (gain - 1)) < 3 * np.sqrt(both.covariance[-1, -1]) < 0.01


def test_a_box_is_turned_by_yaw_then_pitch_then_roll():
    """Against the rotation matrix of scipy."""
    from scipy.spatial.transform import Rotation

    roll, pitch, yaw = 0.1, -0.2, 0.3
    assert turned(roll, pitch, yaw) == pytest.approx(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix())


def test_a_process_of_swaying_has_its_size_and_corner_frequency():
    """Of a correlation exp(-(t / 0.4 s)^2 / 2) half of the power density is left at sqrt(2 ln 2) / (2 pi 0.4 s)."""
    rng, noise, size, time = np.random.default_rng(1), 0.5, 5.0, np.arange(0.0, 10.0, 0.02)
    spread, axes = np.linalg.eigh(np.exp(-(((time[:, None] - time) / 0.4) ** 2) / 2))
    courses = size * (axes * np.sqrt(np.maximum(spread, 0.0)) @ rng.standard_normal((len(time), 4))).T
    own = riding.basis_courses("rider_sway", time, None)
    columns = np.repeat(np.hstack([own, 0 * own])[None] / noise, 4, axis=0)
    residual = (courses + noise * rng.standard_normal(courses.shape)) / noise
    told = riding.posterior_sizes("rider_sway", [time] * 4, residual, columns, np.geomspace(0.5, 50.0, 25))
    value, sd, unit = told["lean_torque_rms"]
    assert (value, unit) == (pytest.approx(np.sqrt(np.mean(courses**2)), rel=0.01), "N m")
    hertz, sd, unit = told["corner_frequency"]
    assert unit == "Hz"
    assert abs(hertz - np.sqrt(2 * np.log(2)) / (2 * np.pi * 0.4)) < 2 * sd < 0.2
