"""Tyre forces of a ride: the smoother against dense matrices, what the command prints and writes, what is refused."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import velotyre as vt
from bicycle.identification import Run, read_ride
from studies.cli import main
from studies.diagnosis import spectra_of_rides
from studies.inference import fit
from studies.rides import LINEAR_SHARE, Record, thinned

TYRE = vt.RelaxationLength(cornering_stiffness={"rear": 8000.0, "front": 4000.0}, relaxation_length=0.1)
MODEL = """bicycle = "benchmark"
[effects.relaxation_length]
cornering_stiffness = { rear = 8000.0, front = 4000.0 }
relaxation_length = 0.1
"""
STEP, SPEED = 0.02, 5.0


def shaken(seed, seconds):
    """A stable benchmark bicycle at 5 m/s under white steer and lean torques: its time and three rates."""
    system = vt.Model("benchmark", TYRE).linear_model().to_control(SPEED)
    chosen = system[["lean_rate", "yaw_rate", "steer_rate"], ["steer_torque", "lean_torque"]]
    dynamics, inputs = np.asarray(chosen.A), np.asarray(chosen.B)
    once = expm(STEP * dynamics)
    held = np.linalg.solve(dynamics - 1e-9 * np.eye(len(once)), (once - np.eye(len(once))) @ inputs)
    rng = np.random.default_rng(seed)
    torques = rng.standard_normal((round(seconds / STEP), 2)) * [0.3, 3.0]
    states = np.zeros((len(torques), len(once)))
    for k in range(1, len(torques)):
        states[k] = once @ states[k - 1] + held @ torques[k - 1]
    return STEP * np.arange(len(torques)), states @ np.asarray(chosen.C).T + rng.normal(0, 0.001, (len(torques), 3))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ride")
    time, rates = shaken(6201, 60.0)
    table = pd.DataFrame(rates, columns=["roll_rate_rad_s", "yaw_rate_rad_s", "steer_rate_rad_s"])
    table.insert(0, "time_s", time)
    table.round(6).to_csv(folder / "ride.csv", index=False)
    (folder / "model.toml").write_text(MODEL)
    return folder


@pytest.fixture(scope="module")
def forces(folder):
    return vt.ride_forces(folder / "model.toml", (folder / "ride.csv", SPEED), steering="nobody", grip=0.7)


def test_forces_print_two_lines_with_the_largest_of_each_wheel(forces):
    largest = np.max([np.abs(segment.force).max(1) for segment in forces.segments], axis=0)
    first, second = str(forces).splitlines()
    assert first == f"<RideForces of {', '.join(segment.name for segment in forces.segments)}"
    assert f"largest lateral force {largest[0]:.3g} N rear, {largest[1]:.3g} N front" in second


def test_linear_range_is_that_of_a_brush_tyre():
    slip = brentq(lambda x: 1 - x / 3 + x**2 / 27 - 0.9, 0, 1)  # C alpha over grip and load
    assert 0.9 * slip == pytest.approx(LINEAR_SHARE, abs=0.001)


def test_a_record_is_solved_as_by_its_dense_covariance():
    hertz = np.linspace(0, 5, 400)
    spectra = np.zeros((400, 2, 2), complex)
    spectra[:, 0, 0] = 1 / (1 + hertz**2) + 0.01
    spectra[:, 1, 1] = 0.5 / (1 + hertz**4) + 0.02
    spectra[:, 0, 1] = 0.3j * hertz / (1 + hertz**2) ** 2
    spectra[:, 1, 0] = spectra[:, 0, 1].conj()
    record = Record(hertz, spectra, 40, 0.1)
    right = np.random.default_rng(6202).standard_normal((3, 2, 40))
    units = np.eye(80).reshape(80, 2, 40)
    # columns of A from the spectra by a plain sum over frequencies
    bins = np.fft.fftfreq(record.length, 0.1)
    full = np.array([[np.interp(np.abs(bins), hertz, spectra[:, a, b].real) for b in range(2)] for a in range(2)])
    odd = np.array([[np.interp(np.abs(bins), hertz, spectra[:, a, b].imag) for b in range(2)] for a in range(2)])
    turned = full + 1j * np.sign(bins) * odd
    waves = np.exp(2j * np.pi * np.outer(bins, 0.1 * np.arange(40)))
    dense = np.einsum("abf,fm,fn->ambn", turned, waves, waves.conj(), optimize=True).real / record.length
    dense = dense.reshape(len(units), -1)
    solved = record.solve(right, 1e-9)
    assert solved.reshape(3, -1) == pytest.approx(np.linalg.solve(dense, right.reshape(3, -1).T).T, rel=1e-5, abs=1e-6)


def test_shapes_shares_and_bands(forces):
    (segment,) = forces.segments
    assert segment.force.shape == segment.slip.shape == (2, 3000)
    rear, front = vt.load_bicycle("benchmark").static_loads
    strength = 0.7 * np.array([[rear], [front]])
    assert forces.share(segment) == pytest.approx(np.abs(segment.force) / strength)
    assert not forces.grip_assumed
    # the band is wider at the ends, where nothing was recorded beyond
    assert (segment.force_sd[:, [0, -1]] > segment.force_sd[:, [1500]]).all()
    # slow forces are those of the tyre law: F = C alpha
    slow = np.ones(50) / 50
    force = np.array([np.convolve(f, slow, "valid") for f in segment.force])
    slip = np.array([np.convolve(s, slow, "valid") for s in segment.slip])
    slope = (force * slip).sum(1) / (slip**2).sum(1)
    assert slope == pytest.approx([8000, 4000], rel=0.25)


def test_a_recorded_steer_torque_of_a_rider_is_used(folder, forces):
    table = pd.read_csv(folder / "ride.csv")
    table["steer_torque_N_m"] = 0.3 * np.random.default_rng(6201).standard_normal((len(table), 2))[:, 0]  # as applied
    table[:1100].to_csv(folder / "torque.csv", index=False)
    found = vt.ride_forces(folder / "model.toml", (folder / "torque.csv", SPEED), steering="rider", grip=0.7)
    known, blind = found.segments[0].force[1, 100:1000], forces.segments[0].force[1, 100:1000]
    assert np.sqrt(((known - blind) ** 2).mean()) < 0.5 * np.sqrt((blind**2).mean())


def test_a_motor_is_taken_out_without_an_option_that_does_not_exist(folder):
    table = pd.read_csv(folder / "ride.csv")[:1100]
    table["steer_torque_N_m"] = np.random.default_rng(6203).standard_normal(len(table))
    table.to_csv(folder / "motor.csv", index=False)
    (folder / "motor.toml").write_text(MODEL + "[effects.steer_assist]\ngain = 2.0\n")
    found = vt.ride_forces(folder / "motor.toml", (folder / "motor.csv", SPEED), steering="rider")
    (note,) = [note for note in found.notes if "steer_assist" in note]
    assert note.endswith("as the recorded steer torque is assumed to include it")


def test_a_fast_recording_is_thinned_without_aliases():
    time = np.arange(0, 20, 1 / 2000)
    motion = 0.2 + np.sin(2 * np.pi * 3 * time)
    run = Run("fast", 5.0, time, {"roll_rate_rad_s": motion + np.sin(2 * np.pi * 98 * time)}, {})
    slow = thinned(run)
    assert np.diff(slow.time) == pytest.approx(0.01)
    assert slow.channels["roll_rate_rad_s"][50:-50] == pytest.approx(motion[::20][50:-50], abs=0.01)
    assert thinned(slow) is slow


def test_a_copied_channel_is_refused(folder):
    table = pd.read_csv(folder / "ride.csv")
    table["steer_rate_rad_s"] = -2 * table.roll_rate_rad_s + 0.1
    table.to_csv(folder / "copied.csv", index=False)
    with pytest.raises(vt.InputError, match="Hz roll_rate_rad_s, steer_rate_rad_s hold the same motion"):
        vt.ride_forces(vt.Model("benchmark", TYRE), (folder / "copied.csv", SPEED))


def test_a_dead_steer_torque_is_not_used_and_a_silent_channel_is_refused(folder):
    table = pd.read_csv(folder / "ride.csv").assign(steer_torque_N_m=0.0)
    table.to_csv(folder / "dead.csv", index=False)
    found = spectra_of_rides([read_ride(folder / "dead.csv", SPEED)], ridden=True)
    assert "steer_torque_N_m" not in found.rides.spectra[0].channels
    assert "steer_torque_N_m is not used: it is constant at one speed or more" in found.notes
    table.assign(steer_torque_N_m=1e-200 * table.steer_rate_rad_s).to_csv(folder / "silent.csv", index=False)
    with pytest.raises(vt.InputError, match="steer_torque_N_m shows nothing at 0"):
        spectra_of_rides([read_ride(folder / "silent.csv", SPEED)], steering="rider", ridden=True)


def test_a_ride_given_twice_is_refused(folder, capsys):
    ride = (folder / "ride.csv", SPEED)
    with pytest.raises(vt.InputError, match="the same recording as ride.csv; keep one"):
        vt.ride_forces(vt.Model("benchmark", TYRE), [ride, ride])
    with pytest.raises(SystemExit):
        main(["modal", "--ride", *[f"{folder / 'ride.csv'}@{SPEED}"] * 2])
    assert "keep one, or it counts twice" in capsys.readouterr().err


def test_command_writes_table_and_figure(printed, folder):
    out = folder / "out"
    options = ("--model", folder / "model.toml", "--steering", "nobody", "--grip", "0.7")
    said = printed("forces", f"{folder / 'ride.csv'}@{SPEED}", *options, "--out", out)
    assert "Largest lateral forces" in said
    assert "the grip of 0.7 is given" in said
    assert (out / "forces.png").is_file()
    table = pd.read_csv(out / "forces.csv")
    assert len(table) == 3000
    assert {"time_s", "rear_lateral_force_N", "front_slip_angle_deg_sd", "rear_grip_share"} <= set(table)


def test_bands_are_wider_by_the_root_of_the_misfit_where_the_model_does_not_fit(folder, monkeypatch):
    """The residuals of a fit are made twice as large after it; the forces stay."""
    model = vt.Model("benchmark", TYRE)
    asked = {"steering": "nobody"}
    plain = vt.ride_forces(model, (folder / "ride.csv", SPEED), **asked)

    def poor_fit(*args, **options):
        final = fit(*args, **options)
        return replace(final, objective=4 * final.objective)

    monkeypatch.setattr("studies.rides.estimate.fit", poor_fit)
    wide = vt.ride_forces(model, (folder / "ride.csv", SPEED), **asked)
    assert plain.widened == 1
    assert wide.widened == pytest.approx(2, rel=0.1)
    np.testing.assert_allclose(wide.segments[0].force, plain.segments[0].force)
    np.testing.assert_allclose(wide.segments[0].force_sd, wide.widened * plain.segments[0].force_sd)


def test_numbers_of_a_model_that_does_not_fit_are_not_offered(printed, folder):
    """A steering with a damper of 30 N m s/rad, of which the ride has none."""
    (folder / "damped.toml").write_text(MODEL + "[effects.steer_damper]\ndamping = 30.0\n")
    said = printed(
        "forces", f"{folder / 'ride.csv'}@{SPEED}", "--model", folder / "damped.toml", "--steering", "nobody"
    )
    assert re.search(r"The bands are \d+\.\d\d times wider, by its root, because", said)
    misfit = float(re.search(r"shifted parameters is (\S+) per", said)[1])
    assert float(re.search(r"are (\S+) times wider", said)[1]) == pytest.approx(misfit**0.5, rel=0.01)
    assert "neither bands nor fitted parameters can be trusted" in said
    assert "Parameters that the ride has narrowed" not in said


@pytest.mark.parametrize(
    ("model", "options", "words"),
    [
        ("benchmark", {}, "roll without slip"),
        (vt.Model("benchmark", TYRE), {"grip": -1.0}, "grip = -1 must be above 0"),
        (vt.Model("benchmark", TYRE), {"steering": "ghost"}, "steering = 'ghost' is not allowed"),
    ],
)
def test_what_is_refused(folder, model, options, words):
    with pytest.raises(vt.InputError, match=words):
        vt.ride_forces(model, (folder / "ride.csv", SPEED), **options)


def test_no_ride_is_refused():
    with pytest.raises(vt.InputError, match="no ride"):
        vt.ride_forces(vt.Model("benchmark", TYRE), [])


def test_turns_are_kept_on_request(tmp_path):
    time = np.arange(0, 60, 0.02)
    rng = np.random.default_rng(6203)
    rates = rng.normal(0, 0.02, (len(time), 2))
    rates[(time > 25) & (time < 35), 1] += 0.4
    table = np.column_stack([time, rates])
    file = tmp_path / "turn.csv"
    np.savetxt(file, table, fmt="%.5f", delimiter=",", header="time_s,roll_rate_rad_s,yaw_rate_rad_s", comments="")
    assert len(read_ride(file, 5.0).segments) == 2
    assert len(read_ride(file, 5.0, keep_turns=True).segments) == 1


@pytest.mark.parametrize(
    ("seconds", "lowest"), [((300.0,), 0.03), ((30.0,), 0.2), ((300.0, 60.0), 0.15)], ids=["long", "short", "both"]
)
def test_spectra_begin_at_nine_periods_of_the_longest_segment(tmp_path, monkeypatch, seconds, lowest):
    """Slow forces are the largest; which input made them is a guess below the lowest frequency of the spectra."""
    columns = "time_s,roll_rate_rad_s,yaw_rate_rad_s,steer_rate_rad_s"
    files = []
    for k, duration in enumerate(seconds):  # each at a speed of its own
        time, rates = shaken(6202, duration)
        files.append((tmp_path / f"ride_{k}.csv", SPEED + k))
        np.savetxt(files[-1][0], np.column_stack([time, rates]), "%.6f", ",", header=columns, comments="")
    asked = []

    def stop(rides, *, lowest_hz, **how):
        asked.append(lowest_hz)
        raise vt.InputError("enough")

    monkeypatch.setattr("studies.rides.estimate.spectra_of_rides", stop)
    with pytest.raises(vt.InputError, match="enough"):
        vt.ride_forces(vt.Model("benchmark", TYRE), files)
    assert asked == [pytest.approx(lowest, rel=0.01)]
