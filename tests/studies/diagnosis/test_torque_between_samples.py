"""How recorded torques go from sample to sample, against rides of the published benchmark made elsewhere."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.diagnosis import doubts, read_measurement
from studies.inference import fit
from tests.shared.published_bicycle import ride
from tyre.ground import InputError

STEP, EVERY = 0.02, 20  # s; of the samples at 1 kHz
SD = {"lean_rate_rad_s": 1e-3, "steer_rad": 2e-4}


def measured(folder, between, *, stated=""):
    """Two doublets of the benchmark in the upright of a record at 50 Hz, its torque ``between`` samples as told."""
    rng = np.random.default_rng(1)
    lines = ['kind = "histories"', 'bicycle = "benchmark"', "[histories]"]
    lines += [f'torque_between_samples = "{stated}"'] if stated else []
    for k, speed in enumerate((4.8, 6.2)):
        at = np.arange(151) * STEP
        torque = np.select([(at > 0.19) & (at < 0.41), (at > 0.39) & (at < 0.61)], [1.5, -1.5], 0.0) * (1 - 1.8 * k)
        told = {
            "linear": lambda t, at=at, torque=torque: np.interp(t, at, torque),
            "held": lambda t, torque=torque: torque[(t / STEP + 1e-6).astype(int)],
        }[between]
        time, states = ride(speed, at[-1], told)
        time, states = time[::EVERY], states[::EVERY]
        columns = {"lean_rate_rad_s": states[:, 2], "steer_rad": states[:, 1]}
        noisy = [x + SD[name] * rng.standard_normal(len(x)) for name, x in columns.items()]
        table = np.column_stack([time, *noisy, torque])
        header = ",".join(["time_s", *columns, "steer_torque_N_m"])
        np.savetxt(folder / f"{k}.csv", table, delimiter=",", header=header, comments="", fmt="%.8g")
        lines += ["[[histories.runs]]", f'file = "{k}.csv"', f"speed_m_s = {speed}"]
    (folder / "MEASUREMENT.toml").write_text("\n".join(lines) + "\n")
    return read_measurement(folder / "MEASUREMENT.toml")


def judged(measurement):
    forward = measurement.prepare()
    forward = forward.estimate_noise(fit(forward))
    found = fit(forward)
    nominal, _ = forward.residual((), forward.nominal)
    return SimpleNamespace(
        kind=forward, final=found, nominal=nominal, hypotheses=SimpleNamespace(null=found),
        verdict=SimpleNamespace(verdict="none", equivalent=()),
    )  # fmt: skip


def said(measurement):
    return [one for one in doubts(judged(measurement)) if "torque_between_samples" in one]


def test_a_torque_that_repeats_and_was_linear_is_doubted_and_can_be_stated(tmp_path):
    measurement = measured(tmp_path, "linear")
    assert measurement.prepare().taken_as_held
    found = judged(measurement)
    (told,) = said(measurement)
    assert told.startswith("steer_torque_N_m: most samples repeat the one before, so it is treated as held from sample")
    assert f"instead of {found.final.chi2:.5g}. State torque_between_samples" in told
    stated = measured(tmp_path, "linear", stated="linear")
    assert not stated.prepare().taken_as_held
    assert said(stated) == []
    forward = stated.prepare()
    nominal = forward.nominal
    residual = forward.residual_signals((), nominal)
    wrong = measured(tmp_path, "linear", stated="held").prepare().residual_signals((), nominal)
    for good, poor in zip(residual, wrong, strict=True):
        assert good.std(0) == pytest.approx(list(SD.values()), rel=0.25)  # the noise that was put in
        assert (poor.std(0) > 2 * np.array(list(SD.values()))).all()


def test_a_torque_that_was_held_is_not_doubted(tmp_path):
    measurement = measured(tmp_path, "held")
    assert measurement.prepare().taken_as_held
    assert said(measurement) == []


def test_it_is_asked_of_what_fits_alone(tmp_path):
    """Half a sample imitates part of what is missing: without a name and without a torque nothing is said."""
    found = judged(measured(tmp_path, "linear"))
    found.verdict = SimpleNamespace(verdict="unknown", equivalent=())
    assert not any("torque_between_samples" in one for one in doubts(found))
    (told,) = (one for one in doubts(found, found.final) if "torque_between_samples" in one)
    assert "with parameters only and the unmodelled torque is " in told


def test_who_states_held_is_believed(tmp_path):
    assert said(measured(tmp_path, "linear", stated="held")) == []


def test_other_words_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"torque_between_samples = 'constant' is not allowed; write 'held' or 'lin"):
        measured(tmp_path, "held", stated="constant")
