"""Rides of the published benchmark whose steer angle is prescribed, simulated by nothing of velotyre (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from published_bicycle import ride

from bicycle.identification import STEER_TORQUE, Run
from studies.diagnosis import SteerSpline, read_measurement
from studies.inference import fit, preflight

NOISE = {"roll_rate_rad_s": 0.004, "steer_rad": 0.002, "steer_torque_N_m": 0.05}
SMALL = {"roll_rate_rad_s": 0.004, "steer_rad": 0.001, "steer_torque_N_m": 0.02}
FILE = """
kind = "replay"
bicycle = "benchmark"
[uncertainty]
lam = 0.003
c = 0.002
[histories]
input = "steer_rad"
"""


def torque(t):
    return 2.0 * np.sin(2 * np.pi * 0.9 * t) + 1.0 * np.sin(2 * np.pi * 2.3 * t + 1)


def read(folder, *, friction=0.0, late=0.0, with_torque=True, more="", first=100, seed=0, noise=NOISE, stated=1.0):
    """Two rides at 100 Hz; the steer angle may be recorded ``late`` (s), and its noise ``stated`` so many times."""
    text = FILE + more
    for speed in (5.0, 7.0):
        time, x = ride(speed, 2.5, torque, friction=friction)
        rng = np.random.default_rng([int(speed), seed] if seed else int(speed))
        shift = round(late / 1e-3)
        steer = np.concatenate([np.full(shift, x[0, 1]), x[: len(x) - shift, 1]])
        columns = [time, x[:, 2], steer, *([torque(time)] if with_torque else [])]
        table = np.column_stack(columns)[first::10]  # what was before the record is in the steer angle
        for column, sd in enumerate(list(noise.values())[: len(columns) - 1], 1):
            table[:, column] += sd * rng.standard_normal(len(table))
        head = "time_s,roll_rate_rad_s,steer_rad" + ",steer_torque_N_m" * with_torque
        np.savetxt(folder / f"ride{speed}.csv", table, delimiter=",", comments="", header=head)
        text += f'[[histories.runs]]\nfile = "ride{speed}.csv"\nspeed_m_s = {speed}\n'
    noise = {name: sd for name, sd in noise.items() if with_torque or "torque" not in name}
    noise["steer_rad"] *= stated
    text += "[histories.noise_sd]\n" + "".join(f"{name} = {sd}\n" for name, sd in noise.items())
    (folder / "MEASUREMENT.toml").write_text(text)
    return read_measurement(folder / "MEASUREMENT.toml")


def test_lean_and_torque_follow_from_the_steer_angle_and_its_noise_is_not_taken_for_motion(tmp_path):
    """chi^2 of the true model is that of noise: within five of its standard deviations, sqrt(2 n)."""
    measurement = read(tmp_path)
    forward = measurement.prepare()
    assert set(forward.noise) == {"roll_rate_rad_s", "steer_torque_N_m"}
    nominal = forward.nominal
    residual, _ = forward.residual((), nominal, slopes=False)
    n = len(residual)
    assert residual @ residual == pytest.approx(n, abs=5 * np.sqrt(2 * n))
    for left, run in zip(forward.residual_signals((), nominal), forward.runs, strict=True):
        for column, name in enumerate(forward.noise):
            assert np.std(left[:, column]) < 0.1 * np.std(run.channels[name]), name
    assert any("steer_rad is prescribed: smoothed by a spline" in note for note in forward.notes)


@pytest.mark.parametrize("stated", [1.0, 3.0])
def test_what_smoothing_takes_from_the_angle_is_not_left_to_the_torque(tmp_path, stated):
    """Rides into which the torque sets in as they begin, by fine sensors: chi^2 of the true model is not above that of
    noise. A noise of the steer angle that is stated too large may make it smaller.
    """
    chi2, n = 0.0, 0
    for seed in (1, 2, 3):
        forward = read(tmp_path, first=0, seed=seed, noise=SMALL, stated=stated).prepare()
        nominal = forward.nominal
        residual, _ = forward.residual((), nominal, slopes=False)
        torques = residual[["torque" in series for series in forward.rows.series]]
        assert np.abs(torques).max() < 5
        chi2, n = chi2 + torques @ torques, n + len(torques)
    assert 0.7 * n < chi2 < n + 3 * np.sqrt(2 * n)


@pytest.mark.parametrize("more", [lambda t: 1.5 * (t > 1.503), lambda t: 3.0 * ((t > 1.2) & (t < 1.3))])
def test_a_torque_that_jumps_within_a_run_is_followed(tmp_path, more, monkeypatch):
    """By fine sensors a step of 1.5 N m gave a chi^2 of 12 a number, a push of 3 N m for 0.1 s one of 80."""
    monkeypatch.setitem(globals(), "torque", lambda t, before=torque: before(t) + more(t))
    forward = read(tmp_path, noise=dict(SMALL)).prepare()
    residual, _ = forward.residual((), forward.nominal, slopes=False)
    of_torque = np.array(["torque" in series for series in forward.rows.series])
    for left in (residual[of_torque], residual[~of_torque]):
        assert 0.7 * len(left) < left @ left < len(left) + 3 * np.sqrt(2 * len(left))


@pytest.mark.parametrize("name", ["rider_lean", "steer_spring"])
def test_an_effect_that_is_not_there_does_not_make_the_rides_more_probable(tmp_path, name):
    forward = read(tmp_path, first=0, noise=SMALL, stated=1.5).prepare()
    candidate = next(c for c in forward.candidates if c.identifier == name)
    assert fit(forward, (candidate,)).log_evidence < fit(forward).log_evidence


def test_derivatives_agree_with_differences_of_the_residual_also_where_a_run_is_shorter(tmp_path):
    forward = read(tmp_path, friction=0.2).prepare()
    first, second = forward.runs
    cut = {name: signal[:-37] for name, signal in second.channels.items()}
    angle = {"steer_rad": second.inputs["steer_rad"][:-37]}
    second = replace(second, time=second.time[:-37], channels=cut, inputs=angle)
    forward = replace(forward, runs=(first, second))
    candidates = {c.identifier: c for c in forward.candidates}
    for name in ("steer_delay", "steer_scale", "roll_rate_lowpass", "steer_friction", "steer_damper", "speed_scale"):
        joined = (candidates[name],)
        theta = np.concatenate([[u.centre for u in forward.nuisances], candidates[name].starts[1]])
        residual, jacobian = forward.residual(joined, theta)
        assert len(residual) == 2 * (len(first.time) + len(second.time)) == len(jacobian)
        h = np.zeros_like(theta)
        h[-1] = 1e-3 * candidates[name].unknowns[0].scale
        plus, minus = (forward.residual(joined, theta + sign * h, slopes=False)[0] for sign in (1, -1))
        numeric = (plus - minus) / (2 * h[-1])
        # starts follow the coordinate in the residual and stand still in its derivative: what they explain is left out
        assert jacobian[:, -1] @ numeric == pytest.approx(numeric @ numeric, rel=0.05), name


def test_dry_friction_shows_in_the_torque_that_is_needed(tmp_path):
    forward = read(tmp_path, friction=0.2).prepare()
    candidates = {c.identifier: c for c in forward.candidates}
    found = fit(forward, (candidates["steer_friction"],))
    assert found.theta[-1] == pytest.approx(0.2, abs=4 * np.sqrt(found.covariance[-1, -1]))
    assert np.sqrt(found.covariance[-1, -1]) < 0.02
    assert found.log_evidence > fit(forward).log_evidence + 20
    yaw = next(p for p in forward.propose_measurements() if "yaw_rate" in p.what)
    value, slope = yaw.predict_white(found.candidates, found.theta)
    assert value.shape == (sum(len(run.time) for run in forward.runs),)
    assert not slope[:, -1].any()  # the angle being what it is, friction moves nothing
    assert not any(p.what.startswith("steer_rad") for p in forward.propose_measurements())


@pytest.mark.parametrize(("channel", "factor", "reading"), [
    ("roll_rate_rad_s", -1.0, "roll_rate_rad_s of the opposite sign"),
    (STEER_TORQUE, 1 / 9.80665, f"{STEER_TORQUE} in kgf m"),
])  # fmt: skip
def test_a_channel_in_another_unit_or_of_the_other_sign_is_told(tmp_path, channel, factor, reading):
    measurement = read(tmp_path)
    assert preflight(measurement.prepare()) is None
    runs = (
        replace(run, channels={**run.channels, channel: factor * run.channels[channel]}) for run in measurement.runs
    )
    assert reading in preflight(replace(measurement, runs=tuple(runs)).prepare()).readings


def test_what_acts_on_the_steering_alone_is_not_seen_without_the_torque(tmp_path):
    forward = read(tmp_path, with_torque=False).prepare()
    damper = next(c for c in forward.candidates if c.identifier == "steer_damper")
    theta = np.array([*(u.centre for u in forward.nuisances), 0.5])
    _, jacobian = forward.residual((damper,), theta)
    assert np.abs(jacobian[:, -1]).max() < 1e-6 * np.abs(jacobian).max()
    assert "the steer angle is prescribed" in forward.refused["steer_friction"]


def test_a_steer_angle_that_was_recorded_late_is_found(tmp_path):
    """20 ms: the true angle is ahead of its record."""
    forward = read(tmp_path, late=0.02).prepare()
    delay = next(c for c in forward.candidates if c.identifier == "steer_delay")
    found = fit(forward, (delay,))
    assert found.theta[-1] == pytest.approx(0.02, abs=max(0.002, 4 * np.sqrt(found.covariance[-1, -1])))


@pytest.mark.parametrize("samples", [40, 101])
def test_a_spline_that_no_noise_allows_has_at_most_half_as_many_coefficients_as_there_are_samples(samples):
    time = 0.01 * np.arange(samples)
    rough = np.random.default_rng(1).normal(size=samples)
    run = Run("a", 5.0, time, {"roll_rate_rad_s": rough}, {"steer_rad": rough})
    assert len(SteerSpline.of_run(run, 1e-9).coefficients) == samples // 2


def test_the_spline_is_as_uncertain_as_it_says(tmp_path):
    """Angle and two derivatives against the true ones, in sd, inside the record: chi^2 a number of 1 within a half."""
    measurement = read(tmp_path)
    squares = []
    for run in measurement.prepare().runs:
        spline = SteerSpline.of_run(run, NOISE["steer_rad"])
        time, x = ride(run.speed, 2.5, torque)
        angle = np.interp(run.time, time, x[:, 1])
        rate = np.interp(run.time, time, x[:, 3])
        acceleration = np.interp(run.time, time, np.gradient(x[:, 3], time))
        found, uncertain = spline.at()
        sd = np.linalg.norm(uncertain, axis=-1)
        for order, true in enumerate((angle, rate, acceleration)):
            squares.append(np.mean(((found[:, order] - true) / sd[:, order])[10:-10] ** 2))
    assert np.mean(squares) == pytest.approx(1, abs=0.5)
