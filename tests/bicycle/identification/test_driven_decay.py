"""Free decays that something keeps driving, in windows of many cycles too, and what telling it changes. SYNTHETIC."""

import numpy as np
import pytest

from bicycle.identification.free_decay import identify
from bicycle.identification.window_start import PARTS
from studies.cli import main
from studies.validations._decay_generator import Cell, make

MANY = Cell(cycles=(15, 25), damping=(0.005, 0.03), driven=0.1, noise=0.05)
FAINT = Cell(driven=0.03, noise=0.05)


def write(path, run):
    rows = zip(run.time, *run.channels.values(), strict=True)
    lines = [",".join(f"{x:.6g}" for x in row) for row in rows]
    path.write_text("\n".join([",".join(["time_s", *run.channels]), *lines]) + "\n")


@pytest.mark.parametrize("seed", range(4))
def test_many_cycles_that_the_ground_drives(seed):
    """Errors were ten to twenty sd where driving was not weighed in so many samples."""
    made = make(MANY, np.random.default_rng(seed))
    found = identify(made.run, thorough=False)
    assert len(found.estimate.window.time) > 240
    assert found.estimate.driven > 0.99
    error = found.eigenvalue - made.roots[0]
    assert abs(error.real) < 4 * found.sd[0]
    assert abs(error.imag) < 4 * found.sd[1]
    told = identify(made.run, driven=False, thorough=False)
    assert max(told.sd) < 0.5 * max(found.sd)


def test_who_says_that_nothing_drives_gets_smaller_doubts_and_who_says_that_something_does_gets_larger_ones():
    made = make(Cell(noise=0.05), np.random.default_rng(1))
    no, weighed, yes = (identify(made.run, driven=driven, thorough=False) for driven in (False, None, True))
    assert no.estimate.driven is None
    assert 0 < weighed.estimate.driven < 0.5
    assert yes.estimate.driven == pytest.approx(1)
    assert max(no.sd) < 1.05 * max(weighed.sd)
    assert max(weighed.sd) < max(yes.sd)


def test_the_terminal_says_where_it_is_open_and_what_it_would_change(tmp_path, capsys):
    """The numbers of the note are those of --driven yes."""
    made = make(FAINT, np.random.default_rng([7, 1]))
    write(tmp_path / "ride.csv", made.run)
    main(["modal", f"{tmp_path / 'ride.csv'}@5.5", "--out", str(tmp_path / "open.csv")])
    (note,) = [line for line in capsys.readouterr().err.splitlines() if "rough road" in line]
    assert note.startswith("note: ride.csv: whether something, such as a rough road, keeps driving the motion is open")
    assert "say --driven yes or no where you know" in note
    sd = {}
    for told in ("yes", "no"):
        main(["modal", f"{tmp_path / 'ride.csv'}@5.5", "--driven", told, "--out", str(tmp_path / f"{told}.csv")])
        assert "rough road" not in capsys.readouterr().err
        sd[told] = read(tmp_path / f"{told}.csv")
    sd["open"] = read(tmp_path / "open.csv")
    for part, unit in zip(range(len(PARTS)), ("1/s", "rad/s"), strict=True):
        assert f"{sd['yes'][part]:.2g} {unit}" in note
        assert f"{sd['open'][part]:.2g}" in note.partition("instead of")[2]
        assert sd["no"][part] < sd["yes"][part]


def read(path):
    heads, row = path.read_text().splitlines()
    values = dict(zip(heads.split(","), row.split(","), strict=True))
    return float(values["real_sd_1_s"]), float(values["imag_sd_rad_s"])


def test_a_break_is_said_with_its_time_and_channel(tmp_path, capsys):
    made = make(Cell(noise=0.02, cycles=(3.5, 3.5)), np.random.default_rng(3), root=complex(-0.4, 5.0))
    step = 0.2 * np.ptp(made.run.channels["steer_rate_rad_s"]) * (made.run.time > 2)
    made.run.channels["steer_rate_rad_s"] = made.run.channels["steer_rate_rad_s"] + step
    write(tmp_path / "ride.csv", made.run)
    main(["modal", f"{tmp_path / 'ride.csv'}@5"])
    shown = capsys.readouterr()
    assert "steer_rate_rad_s jumps at about 2" in shown.err
    assert "sd of its noise), as after a second kick, a step of the sensor or a spike" in shown.err
