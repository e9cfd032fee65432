"""Several recordings and folders: what is alike is said once, and a pull uses the load that stands in its file."""

import re

import numpy as np
import pytest

from studies.cli import main
from studies.look import drafts, look

pytestmark = pytest.mark.usefixtures("no_pictures")


def ride(path, seed, *, dropout=False):
    """A decay at 50 Hz with its speed."""
    rng, time = np.random.default_rng(seed), np.arange(300) / 50
    wave = np.where(time < 1, 0, 0.5 * np.exp(-0.8 * (time - 1)) * np.cos(4.5 * (time - 1)))
    roll, speed = wave + rng.normal(0, 0.004, 300), 5 + rng.normal(0, 0.02, 300)
    speed[100:105] = 0 if dropout else speed[100:105]
    rows = (f"{t:.3f},{x:.5f},{v:.3f}" for t, x, v in zip(time, roll, speed, strict=True))
    path.write_text("\n".join(["time (s),roll rate (rad/s),speed (m/s)", *rows, ""]))


def test_six_alike_are_told_in_few_lines_and_a_folder_is_taken(tmp_path, capsys):
    for k in range(6):
        ride(tmp_path / f"run{k}.csv", k, dropout=k == 4)
    (tmp_path / "notes.md").write_text("no recording")
    (tmp_path / "words.txt").write_text("no table of numbers\n")
    main(["look", str(tmp_path), "--out", str(tmp_path / "out")])
    told = capsys.readouterr()
    lines = told.out.splitlines()
    assert len(lines) < 30
    assert told.out.count("no channel recognised as lateral force or plate displacement") == 1
    assert "6 files with the channels time = time [s], roll_rate = roll rate [rad/s]" in told.out
    assert sum("free decay (modal): 0.7" in line for line in lines) == 6
    assert sum("  next: velotyre modal" in line for line in lines) == 6
    assert "run4.csv, speed: 1 dropout to 0, 5 samples, the first from sample 101" in told.out
    assert "note: " in told.err
    assert "words.txt" in told.err
    assert len(list((tmp_path / "out").glob("*.decays.toml"))) == 6


def test_a_folder_without_recordings_is_refused(tmp_path, capsys):
    (tmp_path / "notes.md").write_text("no recording")
    with pytest.raises(SystemExit):
        main(["look", str(tmp_path)])
    assert "no file in this folder ends like a recording" in capsys.readouterr().err


def test_a_pull_takes_the_load_that_was_read(tmp_path):
    x = np.concatenate([np.linspace(0, 6, 60), np.linspace(6, 0, 60)])
    force, load = 90 * x + np.random.default_rng(1).normal(0, 1, 120), 402 + np.random.default_rng(2).normal(0, 1, 120)
    rows = (f"{a:.3f},{0.0},{f:.2f},{z:.2f}" for a, f, z in zip(x, force, load, strict=True))
    path = tmp_path / "p.csv"
    path.write_text("\n".join(["plate [mm],rim [mm],Fy [N],Fz [N]", *rows, ""]))
    found = look(path)
    (pull,) = (use for use in found.uses if use.name == "lateral stiffness test")
    assert "load" not in pull.provided
    (draft,) = drafts(found, tmp_path)
    (line,) = (line for line in draft.text.splitlines() if line.startswith("load_N"))
    value, _, remark = line.removeprefix("load_N = ").partition("  # ")
    assert re.fullmatch(r"CHECK: the declared vertical load in N; the median of the file is 40[12]\.?\d*", remark)
    assert float(value) == 402  # a round value, as that of a slip sweep
    assert "rate_hz" not in draft.text
