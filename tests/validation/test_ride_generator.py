"""The generator of rides against mechanics, statistics and the package's own equations."""

from functools import cache

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from bicycle.identification import read_run
from tests.validation import ride_bounds
from tests.validation.ride_bicycle import OUTSIDE, draw_bicycle
from tests.validation.ride_generator import (
    Course,
    Sensors,
    draw_legs,
    ride,
    spectrum,
    write_ride,
)

SPEEDS = (5.0, 9.0)


@cache
def legs():
    return draw_legs(np.random.default_rng(1), SPEEDS, self_stable=True)


def test_tyres_and_side_force_accelerate_the_mass_centre():
    """The rows of the outputs, and the momentum that a simulated ride gains."""
    leg = legs()[-1]
    taken = ride(leg, np.random.default_rng(2), duration=2, step=2e-4)
    true, mass = taken.truth, leg.bicycle.motion(leg.speed).mass
    force = true["rear_lateral_force"] + true["front_lateral_force"] + true["side_force"]
    np.testing.assert_allclose(mass * true["mass_centre_acceleration"], force, atol=1e-9 * mass)
    change = force / mass - leg.speed * true["yaw_rate"]
    gained = np.concatenate([[0], np.cumsum((change[1:] + change[:-1]) / 2 * 2e-4)])
    moved = true["mass_centre_velocity"] - true["mass_centre_velocity"][0]
    np.testing.assert_allclose(gained, moved, atol=2e-3 * np.abs(moved).max())


def test_tyres_relax_as_they_should():
    """Length / v dF/dt + F = C alpha, in time."""
    leg, step = legs()[-1], 2e-4
    taken, values = ride(leg, np.random.default_rng(3), duration=1, step=step), leg.bicycle.values
    for wheel in ("rear", "front"):
        stiffness, length = (
            values[f"relaxation_length.{key}.{wheel}"] for key in ("cornering_stiffness", "relaxation_length")
        )
        force = taken.truth[f"{wheel}_lateral_force"]
        renewed = length / leg.speed * np.gradient(force, step) + force
        wanted = stiffness * taken.truth[f"{wheel}_slip_angle"]
        np.testing.assert_allclose(renewed[2:-2], wanted[2:-2], atol=2e-3 * np.abs(wanted).max())


def test_periodograms_scatter_about_the_spectrum():
    """Whitened by the spectrum, a long ride has unit power in every band, and nothing across channels."""
    leg, rng = legs()[1], np.random.default_rng(4)
    sensors = Sensors(channels=("roll_rate", "yaw_rate", "steer_rate", "lateral_acceleration"), fork_box=True)
    taken = ride(leg, rng, sensors=sensors, duration=600)
    signals = np.array([taken.recorded[channel] for channel in sensors.channels])
    window = np.hanning(signals.shape[1])
    window /= np.sqrt((window**2).mean())
    powers = np.fft.rfft(window * signals).T[20:-1:2] / np.sqrt(signals.shape[1])
    omega = 2 * np.pi * np.fft.rfftfreq(signals.shape[1], 0.01)[20:-1:2]
    true = spectrum(leg.loop, sensors, leg.bicycle.values["lam"], omega)
    white = np.linalg.solve(np.linalg.cholesky(true), powers[..., None])[..., 0]
    for band in np.array_split(white, 12):
        coherence = band.T @ band.conj() / len(band)
        scatter = 1.3 / np.sqrt(len(band))  # of a Hann window's neighbours but one: correlated by 1/6
        assert np.abs(coherence - np.eye(4)).max() < 4.5 * scatter


@pytest.mark.parametrize("speed", SPEEDS)
def test_inputs_and_outputs_have_the_signs_of_the_package(speed):
    """The same bicycle by the package's equations: eigenvalues and columns of the inputs that it shares."""
    bicycle = draw_bicycle(np.random.default_rng(5), spread=0)
    nominal = load_bicycle("benchmark")
    effects = [effect_class(name)(**table) for name, table in bicycle.stated_effects().items()]
    linear = Model(nominal, effects).linear_model()
    push_at = (nominal["xB"], nominal["zB"])
    motion = type(bicycle)(bicycle.base, bicycle.values, bicycle.stated, bicycle.declared, push_at=push_at).motion(
        speed
    )
    matrix, columns = linear.matrices_at(speed)[:2]
    order = [linear.states.index(name) for name in motion.states]
    np.testing.assert_allclose(motion.matrix, matrix[np.ix_(order, order)], atol=1e-8 * np.abs(matrix).max())
    for k, name in ((0, "steer_torque"), (1, "lean_torque"), (2, "lateral_push")):
        column = columns[order, linear.inputs.index(name)]
        np.testing.assert_allclose(motion.inputs[:, k], column, atol=1e-9 * np.abs(column).max())


def test_a_seed_makes_the_same_ride(tmp_path):
    texts = []
    for name in ("one.csv", "other.csv"):
        rng = np.random.default_rng(6)
        taken = ride(draw_legs(rng, (6.0,))[0], rng, duration=5)
        write_ride(tmp_path / name, taken)
        texts.append((tmp_path / name).read_text())
    assert texts[0] == texts[1]
    run = read_run(tmp_path / "one.csv", 6.0)
    assert set(run.channels) == {"roll_rate_rad_s", "yaw_rate_rad_s", "steer_rate_rad_s"}
    assert run.step == pytest.approx(0.01)


def test_a_ride_may_drift_turn_and_pause():
    leg = legs()[1]
    taken = ride(leg, np.random.default_rng(7), duration=120, course=Course(drift=0.02, turns=1, pauses=1))
    assert 0.005 < np.std(taken.speed[taken.steady]) / leg.speed < 0.04
    assert taken.speed.min() == 0
    assert 0.2 < np.mean(taken.steady) < 0.9
    assert all(np.isfinite(signal).all() for signal in taken.recorded.values())


def test_sensors_err_as_they_are_told():
    time = np.arange(0, 2, 0.01)
    true = {"roll_rate": np.sin(3 * time), "yaw_rate": np.cos(2 * time), "steer_rate": np.sin(5 * time)}
    silent = dict.fromkeys(true, 0.0)
    rng = np.random.default_rng(8)
    nosed = Sensors(noise=silent, box=(0, 0.1, 0), gain={"steer_rate": 1.1}, delay={"steer_rate": 0.02})
    seen = nosed.read(time, true, 0.3, rng)
    # a box with its nose up by 0.1 rad sees yaw to the right as roll to the left
    np.testing.assert_allclose(seen["roll_rate"], np.cos(0.1) * true["roll_rate"] - np.sin(0.1) * true["yaw_rate"])
    np.testing.assert_allclose(seen["steer_rate"][2:], 1.1 * true["steer_rate"][:-2], atol=1e-6)


@pytest.mark.parametrize("outside", OUTSIDE)
def test_what_is_outside_the_library_changes_the_motion(outside):
    rng = np.random.default_rng(9)
    bicycle = draw_bicycle(rng, outside=outside)
    bare = type(bicycle)(bicycle.base, bicycle.values, bicycle.stated, bicycle.declared)
    growths = [max(np.linalg.eigvals(one.motion(6.0).matrix).imag) for one in (bicycle, bare)]
    roots = [np.sort_complex(np.linalg.eigvals(one.motion(6.0).matrix)) for one in (bicycle, bare)]
    assert len(roots[0]) >= len(roots[1])
    assert len(roots[0]) > len(roots[1]) or np.abs(roots[0] - roots[1]).max() > 0.01
    assert np.isfinite(growths).all()


def test_hidden_effects_are_not_in_the_file():
    bicycle = draw_bicycle(np.random.default_rng(10), compliance="hidden", damper="hidden", tyre_sd=0.15)
    assert set(bicycle.stated_effects()) == {"relaxation_length"}
    assert {"front_compliance.stiffness", "steer_damper.damping"} <= set(bicycle.values)
    off = [bicycle.values[key] / bicycle.stated[key] for key in ride_bounds.TYRES]
    assert 0.01 < np.abs(np.array(off) - 1).max() < 0.6


def test_bounds_of_noise_alone_are_those_of_white_noise():
    """The sd of white noise has the relative bound 1 / sqrt(2 N), of the frequencies that are used."""
    leg = legs()[0]
    loud = Sensors(channels=("roll_rate",), noise={"roll_rate": 1e3})
    place = ride_bounds._of_noise("roll_rate", 1e3)
    information = ride_bounds._fisher(leg, loud, [place], 300, ride_bounds._frequencies(leg, 0.05, 800))[0, 0]
    assert information * 1e6 == pytest.approx(2 * 30000 * (1 - 0.05 / 50), rel=0.01)


def test_bounds_shrink_with_every_channel():
    leg, asked = legs()[:1], ride_bounds.TYRES[:1]
    bare, more = Sensors(), Sensors(channels=("roll_rate", "yaw_rate", "steer_rate", "steer_torque"))
    least, larger = (
        ride_bounds.bounds(leg, asked=asked, sensors=sensors, count=40)[asked[0]] for sensors in (more, bare)
    )
    assert 0 < least < larger < 0.1 * leg[0].bicycle.values[asked[0]]
