"""Frequency responses from recordings: of known filters, and of the published benchmark bicycle (synthetic)."""

import re

import numpy as np
import pytest
from published_bicycle import M, gains, held, state_matrix
from scipy.linalg import solve_continuous_are
from scipy.signal import coherence, csd, welch

from bicycle.identification import line_response, lines_of, read_forced, spectral_response, weights
from tyre.formats import ChannelMap
from tyre.ground import InputError


def controller(speed):
    """Steer torque over the states that holds the bicycle up."""
    push = np.concatenate([[0, 0], np.linalg.solve(M, [0, 1.0])])[:, None]
    return (push.T @ solve_continuous_are(state_matrix(speed), push, np.diag([10, 10, 1, 1]), [[0.3]]))[0]


def errors(found, true):
    e = (found.gain - true) / found.sd
    return np.concatenate([e.real, e.imag])


def test_standard_deviations_hold_without_a_controller():
    """White input and white noise through a filter of known response: 95 % intervals hold 95 % of the numbers."""
    rng, every = np.random.default_rng(2), []
    for _ in range(30):
        u = rng.standard_normal(6000)
        y = 0.5 * u + np.roll(u, 1) + 0.7 * rng.standard_normal(6000)
        found = spectral_response([u], [y], 0.01, segment_s=3.0, highest_hz=20.0)
        every.append(errors(found, 0.5 + np.exp(-2j * np.pi * found.frequency_hz * 0.01)))
    z = np.concatenate(every)
    assert np.mean(np.abs(z) < 1.96) == pytest.approx(0.95, abs=0.015)
    assert np.mean(z**2) == pytest.approx(1, abs=0.12)


@pytest.mark.parametrize(("spacing", "seconds", "noise"), [(0.2, 60.5, 0.5), (0.1, 47.3, 0.003), (0.05, 81.0, 0.05)])
def test_a_multisine_is_read_at_its_lines_whatever_the_record_holds_of_its_period(spacing, seconds, noise):
    """The exact steady state behind a slow pole; between the lines of the input there is nothing to be read."""
    rng, hertz, z = np.random.default_rng(5), np.arange(0.2, 3.001, spacing), []
    t, gain = np.arange(0, seconds, 0.02), 2 / (1 + 2j * np.pi * hertz * 0.4)
    for _ in range(6):
        waves = np.exp(1j * (2 * np.pi * np.outer(t, hertz) + rng.uniform(0, 2 * np.pi, len(hertz))))
        u, y = waves.real.sum(1), (waves @ gain).real + noise * rng.standard_normal(t.size)
        found = spectral_response([u], [y], 0.02, segment_s=10.0, highest_hz=3.0)
        assert found.lines == len(hertz)
        assert found.frequency_hz == pytest.approx(hertz, abs=1e-4)
        z.append(errors(found, 2 / (1 + 2j * np.pi * found.frequency_hz * 0.4)))
    assert np.mean(np.abs(np.concatenate(z)) < 1.96) == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize(("share", "lines"), [(0.0475, [1.37]), (0.0525, [])])
def test_up_to_a_twentieth_of_the_power_may_lie_outside_of_the_lines(share, lines):
    t, v = np.arange(6000) * 0.01, weights(6000)
    sine, noise = np.sin(2 * np.pi * 1.37 * t), np.random.default_rng(1).standard_normal(6000)
    noise *= np.sqrt(share / (1 - share) * (v @ sine**2) / (v @ noise**2))
    assert lines_of(sine + noise, 0.01) == pytest.approx(lines, abs=1e-3)


@pytest.mark.parametrize(("share", "lines"), [(0.97, [1.37]), (1.03, [1.37, 3.9])])
def test_a_line_beside_one_a_hundred_times_as_strong_is_found_down_to_a_ten_thousandth_of_the_power(share, lines):
    least = 1e-4  # of the power: fainter lines are not looked for
    t, v = np.arange(6000) * 0.01, weights(6000)
    strong, faint = (np.sin(2 * np.pi * hertz * t) for hertz in (1.37, 3.9))
    faint *= np.sqrt(share * least / (1 - share * least) * (v @ strong**2) / (v @ faint**2))
    assert lines_of(strong + faint, 0.01) == pytest.approx(lines, abs=1e-4)


def test_the_sd_of_a_line_is_that_of_white_noise_widened_as_students_t_is():
    """Under a Hann window a number of one line has the variance 2 * 1.5 s^2 / k; t of 16 numbers has 16 / 14.

    The sum of squares of 16 numbers has the relative sd sqrt(2 / 16); neighbours two bins apart share a little.
    """
    rng, k, s, hertz = np.random.default_rng(1), 1000, 0.5, np.arange(2.0, 46.0, 2.0)
    angle, variance, error = 2 * np.pi * np.outer(np.arange(k) * 0.01, hertz), [], []
    for _ in range(40):
        u = np.cos(angle + rng.uniform(0, 2 * np.pi, len(hertz))).sum(1)
        found = line_response(hertz, u, 2 * u + s * rng.standard_normal(k), 0.01)
        variance.append(found.variance)
        error.append(found.gain - 2)
    white = 2 * 1.5 * s**2 / k
    assert np.mean(variance) == pytest.approx(white * 16 / 14, rel=0.06)
    assert np.mean(np.abs(error) ** 2) / 2 == pytest.approx(white, rel=0.1)
    assert np.std(variance) / np.mean(variance) == pytest.approx(np.sqrt(2 / 16), rel=0.15)


@pytest.mark.parametrize(("sd", "known"), [(0.05, True), (0.2, False)])
def test_a_line_of_the_input_is_used_if_its_own_sd_is_below_a_tenth(sd, known):
    sine, rng = np.sin(2 * np.pi * np.arange(6000) * 0.01), np.random.default_rng(1)
    for _ in range(4):
        given = sine + sd / np.sqrt(2 * 1.5 / 6000) * rng.standard_normal(6000)
        assert line_response(np.array([1.0]), given, sine, 0.01).moved.tolist() == [known]


def test_recordings_of_lines_and_of_noise_are_not_mixed():
    t, noise = np.arange(0, 60, 0.01), np.random.default_rng(4).standard_normal((2, 6000))
    sine, rest = np.sin(2 * np.pi * t), 0.01 * noise[0]
    with pytest.raises(InputError, match="the input of recording 1 is made of lines, that of recording 2 is not; give"):
        spectral_response([sine, noise[1]], [sine + rest, noise[1]], 0.01, segment_s=5.0, highest_hz=5.0)
    with pytest.raises(InputError, match="made of lines from 1 to 1 Hz, none of them up to 0.5 Hz; take a higher"):
        spectral_response([sine], [sine + rest], 0.01, segment_s=5.0, highest_hz=0.5)


def test_a_pulse_train_counts_the_segments_that_hold_it():
    """The input moves in one tenth of the record only; noise is everywhere: the sd still hold."""
    rng, z = np.random.default_rng(3), []
    for _ in range(20):
        u = np.zeros(8000)
        u[3000:3800] = rng.standard_normal(800)
        found = spectral_response([u], [u + 0.1 * rng.standard_normal(8000)], 0.01, segment_s=4.0, highest_hz=20.0)
        z.append(errors(found, 1.0))
    assert np.mean(np.abs(np.concatenate(z)) < 1.96) == pytest.approx(0.95, abs=0.03)


def test_a_reference_removes_what_the_controller_answers():
    """At 3.5 m/s the bicycle falls by itself: the direct ratio is biased there, the one with a reference is not."""
    direct, joint = [], []
    for seed in range(4):
        time, x, torque, reference = held(3.5, 100.0, seed=seed, noise=0.02, feedback=controller(3.5))
        for references, into in ((None, direct), ([reference], joint)):
            found = spectral_response(
                [torque], [x[:, 2]], time[1], segment_s=10.0, references=references, highest_hz=2.0
            )  # fmt: skip
            into.append(errors(found, gains(3.5, found.frequency_hz)["roll_rate"]))
            into.append(found.left_out)
    z = np.concatenate(joint[::2])
    assert np.mean(np.abs(z) < 1.96) > 0.88
    assert np.mean(z**2) < 1.6
    assert np.mean(np.concatenate(direct[::2]) ** 2) > 3 * np.mean(z**2)
    assert direct[1::2] == [0, 0, 0, 0]


def test_without_smoothing_it_is_the_estimate_of_scipy():
    """Where the true response does not bend, both are the same but for noise; coherence is that of scipy."""
    rng = np.random.default_rng(5)
    u = rng.standard_normal(20000)
    y = 2 * u + 1e-6 * rng.standard_normal(20000)
    found = spectral_response([u], [y], 0.01, segment_s=5.0, highest_hz=10.0)
    settings = {"fs": 100.0, "nperseg": 500, "detrend": "linear"}
    f, cross = csd(u, y, **settings)
    ratio = cross / welch(u, **settings)[1]
    np.testing.assert_allclose(found.gain, np.interp(found.frequency_hz, f, ratio.real), atol=1e-5)
    y = u + rng.standard_normal(20000)
    found = spectral_response([u], [y], 0.01, segment_s=5.0, highest_hz=10.0)
    np.testing.assert_allclose(
        found.coherence, np.interp(found.frequency_hz, f, coherence(u, y, **settings)[1]), rtol=1e-9
    )


def test_several_recordings_are_averaged_and_a_dead_line_is_left_out():
    rng = np.random.default_rng(6)
    inputs = [rng.standard_normal(2000), rng.standard_normal(1500), rng.standard_normal(50)]
    outputs = [u + 0.1 * rng.standard_normal(len(u)) for u in inputs]
    found = spectral_response(inputs, outputs, 0.01, segment_s=2.0, highest_hz=5.0)
    assert found.averages == pytest.approx(19 / 1.053 + 14 / 1.052, rel=0.01)  # 50 samples hold no segment
    noise = [rng.standard_normal(len(u)) for u in inputs]
    left = spectral_response(inputs, outputs, 0.01, segment_s=2.0, references=noise, highest_hz=5.0)
    assert left.left_out + len(left.gain) == len(found.gain)
    assert left.left_out >= len(found.gain) - 1


@pytest.mark.parametrize(("segment", "highest", "words"), [
    (8.0, 5.0, "20 s hold 3.8 independent segments of 8 s; at least 5 are needed: take shorter segments"),
    (2.0, 1.2, "segments of 2 s show 1 frequencies up to 1.2 Hz; take longer segments or a higher limit"),
    (0.01, 5.0, "segments of 0.01 s hold 1 samples of 0.01 s; at least 16 are needed: take segments of 0.16 s or"),
    (2.0, 51.0, "51 Hz is above 50 Hz, half the sample rate, and cannot be seen; take a lower limit"),
])  # fmt: skip
def test_records_that_say_too_little(segment, highest, words):
    u = np.random.default_rng(7).standard_normal(2000)
    with pytest.raises(InputError, match=re.escape(words)):
        spectral_response([u], [u], 0.01, segment_s=segment, highest_hz=highest)


HEAD = "time_s,roll_rate_rad_s,steer_torque_N_m,push"


def written(folder, *, head=HEAD, rows=None):
    rng = np.random.default_rng(8)
    table = (
        rows
        if rows is not None
        else np.column_stack([np.arange(60) * 0.1, *rng.standard_normal((head.count(","), 60))])
    )
    np.savetxt(folder / "r.csv", table, delimiter=",", header=head, comments="")
    return folder / "r.csv"


def test_forced_runs_are_read_with_a_reference_and_a_force(tmp_path):
    (run,) = read_forced(written(tmp_path), 5.0, reference="push")
    assert set(run.inputs) == {"steer_torque_N_m", "push"}
    (run,) = read_forced(
        written(tmp_path, head=HEAD.replace("push", "lateral_push_N")), 5.0, reference="steer_torque_N_m"
    )
    assert set(run.inputs) == {"steer_torque_N_m", "lateral_push_N"}
    names = {"time": ("time_s", "s"), "roll_rate": ("roll_rate_rad_s", "deg/s"), "lateral_push": ("push", "kN"),
             "command": ("steer_torque_N_m", "V")}  # fmt: skip
    table = {name: {"column": column, "unit": unit} for name, (column, unit) in names.items() if unit != "V"}
    table["command"] = {"column": "steer_torque_N_m", "unit": "N mm"}
    (mapped,) = read_forced(
        written(tmp_path), 5.0, reference="command",
        channel_map=ChannelMap.from_table({"channels": table}, tmp_path, where="m"),
    )  # fmt: skip
    assert set(mapped.inputs) == {"lateral_push_N", "command"}
    (plain,) = read_forced(written(tmp_path), 5.0, reference="push")
    np.testing.assert_allclose(mapped.inputs["lateral_push_N"], 1e3 * plain.inputs["push"])


def test_forced_runs_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="unknown column 'push'.*a reference is named with --instrument"):
        read_forced(written(tmp_path), 5.0)
    with pytest.raises(InputError, match=r"--instrument pull: there is no such column; it has time_s, .*, push$"):
        read_forced(written(tmp_path), 5.0, reference="pull")
    rows = np.column_stack([np.arange(60) * 0.1, *np.random.default_rng(1).standard_normal((2, 60)), np.ones(60)])
    with pytest.raises(InputError, match=r"push is constant \(1\): it moves nothing"):
        read_forced(written(tmp_path, rows=rows), 5.0, reference="push")
    mapped = {
        "channels": {
            "time": {"column": "time_s", "unit": "s"},
            "roll_rate": {"column": "roll_rate_rad_s", "unit": "rad/s"},
        }
    }
    with pytest.raises(InputError, match="no channel 'push'; map it with a unit, any"):
        read_forced(
            written(tmp_path), 5.0, reference="push", channel_map=ChannelMap.from_table(mapped, tmp_path, where="m")
        )
    with pytest.raises(InputError, match="r.mat"):
        read_forced(tmp_path / "r.mat", 5.0)
