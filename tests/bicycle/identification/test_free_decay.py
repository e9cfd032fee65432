"""Free decays with known eigenvalue: found within its errors, and unusable windows are refused in words."""

import csv

import numpy as np
import pytest

from bicycle.identification.free_decay import identify
from bicycle.identification.recording import Run
from studies.cli import main

ROOT = complex(-0.7, 4.4)


def decay(rng, *, duration=4.0, colour=0.8, sd=0.02, slow=0.0):
    """Synthetic; ``slow`` is the amplitude of a capsize mode that dies out with 0.8 1/s, in that of weave."""
    t = np.arange(0, duration, 0.01)
    wave = np.exp(ROOT * t)
    channels = {"roll_rate_rad_s": 0.5 * wave.real, "steer_rate_rad_s": (0.5 * (1.2 - 0.9j) * wave).real}
    for name, x in channels.items():
        x = x + slow * 0.5 * np.exp(-0.8 * t)
        noise = np.zeros_like(t)
        for k in range(1, len(t)):
            noise[k] = colour * noise[k - 1] + sd * np.sqrt(1 - colour**2) * rng.standard_normal()
        channels[name] = x + noise + 0.01
    return Run("r.csv", 4.8, t, channels, {})


@pytest.mark.parametrize(("slow", "duration"), [(0.0, 4.0), (0.3, 4.0), (0.3, 2.3)])
def test_errors_are_honest_under_coloured_noise_and_drift(slow, duration):
    """The scatter of 60 estimates is what each says of itself, down to 1.6 cycles and with a slow mode beside weave.

    Errors for white noise would be a third of the scatter; with an offset in place of the parabola 1 to 1.6 sd of bias.
    """
    rng = np.random.default_rng(2)
    found = [identify(decay(rng, slow=slow, duration=duration), start_hz=0.7) for _ in range(60)]
    errors = np.array([[(f.eigenvalue - ROOT).real / f.sd[0], (f.eigenvalue - ROOT).imag / f.sd[1]] for f in found])
    assert np.abs(errors.mean(0)).max() < 0.5
    assert 0.75 < errors.std() < 1.25
    assert (np.abs(errors) < 1.96).mean() > 0.88
    assert not any(f.rejected for f in found)


def test_ratios_of_channels():
    found = identify(decay(np.random.default_rng(5), sd=0.002))
    value, sd = found.ratios["steer_over_lean"]
    assert abs(value - (1.2 - 0.9j)) < 4 * sd
    assert not found.rejected


def test_windows_that_tell_too_little_are_rejected():
    rng = np.random.default_rng(3)
    short = identify(decay(rng), last_s=1.9)
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


def test_a_run_that_is_rejected_is_shown_and_kept_out_of_the_table(tmp_path, capsys):
    rng = np.random.default_rng(6)
    write(tmp_path / "long.csv", decay(rng))
    write(tmp_path / "short.csv", decay(rng, duration=1.5))
    main(["modal", f"{tmp_path / 'long.csv'}@4.6", f"{tmp_path / 'short.csv'}@5", "--out", str(tmp_path / "t.csv")])
    assert "cycles in the window are too few (at least 1.5)" in capsys.readouterr().out
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    assert [row["speed_m_s"] for row in rows] == ["4.6"]


def test_a_fast_oscillation_is_found_too():
    """18 Hz, near the fastest that is fitted: the search begins within its bounds."""
    t = np.arange(0, 1.0, 0.005)
    wave = np.exp((-3 + 2j * np.pi * 18) * t).real + 0.01 * np.random.default_rng(7).standard_normal(len(t))
    found = identify(Run("f.csv", 4.8, t, {"steer_rate_rad_s": wave}, {}))
    assert found.eigenvalue == pytest.approx(complex(-3, 2 * np.pi * 18), abs=0.3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{a}"], "give a file and its speed in m/s"),
        (["{a}@300"], "give a file and its speed in m/s"),
        (["{a}@4", "--mode", "weeve"], "unknown mode 'weeve'; did you mean 'weave'"),
        (["{a}@4", "--from", "3.95"], "samples between 3.95 and inf s; at least 20"),
        (["{a}@4", "--start-hz", "0"], "start_hz = 0 is outside 0.016 .. 32 Hz"),
        (["{b}@4", "--from", "2"], "roll_rate_rad_s is constant between 2 and inf s; leave it out"),
        (["{a}@4", "--to", "0.5", "--out", "{t}"], "no run could be used"),
    ],
)
def test_bad_input(tmp_path, capsys, arguments, words):
    run = decay(np.random.default_rng(1))
    write(tmp_path / "a.csv", run)
    run.channels["roll_rate_rad_s"][200:] = 0.01
    write(tmp_path / "b.csv", run)
    files = {name: tmp_path / f"{name}.csv" for name in "abt"}
    with pytest.raises(SystemExit) as stop:
        main(["modal", *(x.format(**files) for x in arguments)])
    assert stop.value.code == 2
    assert not files["t"].exists()
    assert words in capsys.readouterr().err
