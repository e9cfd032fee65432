"""``velotyre modal --ride``: a row of wobble from ordinary riding, and what it says of weave."""

import numpy as np
import pytest
from scipy.signal import lfilter

from studies.cli import main


def write_ride(path, pole):
    """A roll rate of slow noise, and a steer rate of an oscillator with a ``pole`` (1/s) under white noise."""
    rng = np.random.default_rng(3)
    time = np.arange(0, 120, 0.01)
    root = np.exp(pole * 0.01)
    steer = lfilter([1], [1, -2 * root.real, abs(root) ** 2], rng.normal(0, 0.01, time.size))
    roll = lfilter([1], [1, -0.97], rng.normal(0, 0.01, time.size)) + 0.01 * steer
    rows = np.column_stack([time, np.full(time.size, 9.0), roll, steer]).tolist()
    lines = ["time_s,speed_m_s,roll_rate_rad_s,steer_rate_rad_s"]
    lines += [",".join(f"{x:.6g}" for x in row) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_row_of_wobble_goes_to_the_table(tmp_path, capsys):
    pole = complex(-2, 40)
    file, table = write_ride(tmp_path / "ride.csv", pole), tmp_path / "wobble.csv"
    main(["modal", str(file), "--ride", "--out", str(table)])
    said = capsys.readouterr()
    assert "weave is not estimated from a ride without an impulse" in said.err
    assert "ok" in said.out
    assert "6.3" in said.out
    row = np.genfromtxt(table, delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert str(row["mode"]) == "wobble"
    assert abs(row["real_1_s"] - pole.real) < 3 * row["real_sd_1_s"]
    assert abs(row["imag_rad_s"] - pole.imag) < 3 * row["imag_sd_rad_s"]


def test_without_wobble_no_table_is_written(tmp_path, refused):
    file, table = write_ride(tmp_path / "ride.csv", complex(-25, 40)), tmp_path / "wobble.csv"
    assert "no speed has a row of wobble" in refused("modal", f"{file}@9", "--ride", "--out", table)
    assert not table.exists()


@pytest.mark.parametrize("options", [["--mode", "wobble"], ["--from", "2"], ["--drift", "none"]])
def test_options_of_free_decays_are_refused(options, refused):
    assert f"{options[0]} is an option of free decays" in refused("modal", "ride.csv", "--ride", *options)
