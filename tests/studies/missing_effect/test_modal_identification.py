"""Free decays with known eigenvalue: found within its errors, and unusable windows are refused in words."""

import csv

import numpy as np
import pytest

from studies.cli import main
from studies.missing_effect.motion.history_table import Run
from studies.missing_effect.motion.modal_identification import identify

ROOT = complex(-0.7, 4.4)


def decay(rng, *, duration=4.0, colour=0.8, sd=0.02):
    t = np.arange(0, duration, 0.01)
    wave = np.exp(ROOT * t)
    channels = {"roll_rate_rad_s": 0.5 * wave.real, "steer_rate_rad_s": (0.5 * (1.2 - 0.9j) * wave).real}
    for name, x in channels.items():
        noise = np.zeros_like(t)
        for k in range(1, len(t)):
            noise[k] = colour * noise[k - 1] + sd * np.sqrt(1 - colour**2) * rng.standard_normal()
        channels[name] = x + noise + 0.01
    return Run("r.csv", 4.8, t, channels, {})


def test_errors_are_honest_under_coloured_noise():
    """200 decays: the scatter of the estimates is what each says of itself (white-noise errors would be half of it)."""
    rng = np.random.default_rng(2)
    found = [identify(decay(rng), start_hz=0.7) for _ in range(60)]
    errors = np.array([[(f.eigenvalue - ROOT).real / f.sd[0], (f.eigenvalue - ROOT).imag / f.sd[1]] for f in found])
    assert np.abs(errors.mean(0)).max() < 0.5
    assert 0.75 < errors.std() < 1.35


def test_ratios_of_channels():
    found = identify(decay(np.random.default_rng(5), sd=0.002))
    value, sd = found.ratios["steer_over_lean"]
    assert abs(value - (1.2 - 0.9j)) < 4 * sd
    assert not found.rejected


def test_windows_that_tell_too_little_are_rejected():
    rng = np.random.default_rng(3)
    short = identify(decay(rng), last_s=0.9)
    assert "cycles in the window are too few" in short.rejected
    noise = decay(rng)
    noise = Run("n.csv", 4.8, noise.time, {"roll_rate_rad_s": rng.normal(0, 0.1, len(noise.time))}, {})
    assert "not one decaying oscillation" in identify(noise).rejected


def write(path, run):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", *run.channels])
        writer.writerows(zip(run.time, *run.channels.values(), strict=True))


def test_the_command_writes_a_table_that_diagnose_reads(tmp_path, capsys):
    rng = np.random.default_rng(4)
    for name in "abc":
        write(tmp_path / f"{name}.csv", decay(rng))
    runs = [f"{tmp_path / name}.csv@{speed}" for name, speed in zip("abc", (4.6, 4.8, 5.0), strict=True)]
    main(["modal", *runs, "--out", str(tmp_path / "t.csv")])
    assert capsys.readouterr().out.count("ok") == 3
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    assert float(rows[1]["imag_rad_s"]) == pytest.approx(4.4, abs=0.1)
    (tmp_path / "m.toml").write_text('kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "t.csv"\n')
    from studies.missing_effect import read_measurement

    assert len(read_measurement(tmp_path / "m.toml").points) == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{a}"], "give a file and its speed in m/s"),
        (["{a}@300"], "give a file and its speed in m/s"),
        (["{a}@4", "--mode", "weeve"], "unknown mode 'weeve'; did you mean 'weave'"),
        (["{a}@4", "--from", "3.95"], "samples between 3.95 and inf s; at least 20"),
        (["{a}@4", "--to", "0.5", "--out", "{t}"], "no run could be used"),
    ],
)
def test_bad_input(tmp_path, capsys, arguments, words):
    write(tmp_path / "a.csv", decay(np.random.default_rng(1)))
    with pytest.raises(SystemExit) as stop:
        main(["modal", *(x.format(a=tmp_path / "a.csv", t=tmp_path / "t.csv") for x in arguments)])
    assert stop.value.code == 2
    assert words in capsys.readouterr().err
