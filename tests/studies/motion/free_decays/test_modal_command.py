"""What `velotyre modal` prints and draws is true of its numbers: repeats, drift, start, a second motion; pictures."""

import csv

import numpy as np
import pytest

from bicycle.identification import identify, read_run
from studies.cli import main
from studies.motion import drift_words, judge_decays, notes_of, second_words
from tests.validation.decay_generator import Cell, make
from tyre.ground import InputError, with_sd


def write(path, run, names=None):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", *(names or run.channels)])
        rows = zip(run.time, *run.channels.values(), strict=True)
        writer.writerows([[f"{x:.6g}" for x in row] for row in rows])


@pytest.fixture(scope="module")
def decays():
    """Six decays at two speeds whose real part scatters by 0.25 1/s from run to run, 0.01 by each alone."""
    rng = np.random.default_rng(4)
    found = []
    for speed in (4.0, 6.0):
        for off in (-0.25, 0.0, 0.25):
            root = complex(-0.3 * speed + 0.5 + off, 4.5)
            made = make(Cell(noise=0.02), rng, root=root, speed=speed * (1 + 0.004 * off))
            found.append(("weave", identify(made.run, thorough=False)))
    return found


def test_repeats_within_five_per_cent_widen_the_sd_and_it_is_said(decays):
    found = judge_decays(decays)
    assert [each.repeats for each in found] == [3] * 6
    assert all(each.widened for each in found)
    assert all(0.2 < each.decay.sd[0] < 0.5 for each in found)
    assert "the sd of 6 of 6 rows is widened" in " ".join(notes_of(found))
    note = list(notes_of(judge_decays(decays[::3])))[-1]
    assert note.startswith("no run has a repeat within 5 % of its speed")


def test_a_refusal_stands_by_the_run_alone(decays):
    """Repeats may widen an sd beyond what a run alone is refused for; the run is not blamed for it."""
    found = judge_decays([*decays[:3], ("weave", identify(make(Cell(), np.random.default_rng(1)).run, last_s=0.3))])
    assert [bool(each.rejected) for each in found] == [False, False, False, True]
    assert found[3].repeats == 0


def test_words_of_drift_and_of_a_second_motion(decays):
    decay = decays[0][1]
    assert sum(decay.estimate.drifts.values()) == pytest.approx(1)
    assert decay.drift in drift_words(decay)
    assert second_words(complex(-15, 3)) == "a transient that dies within 0.2 s"
    assert second_words(complex(-1, 4 * np.pi)).startswith("a second oscillation of 2 Hz (real part -1 1/s")


def test_two_modes_pictures_and_a_table(tmp_path, capsys):
    made = make(Cell(second=0.4, offset=0.1, noise=0.05), np.random.default_rng(3))
    write(tmp_path / "two.csv", made.run)
    common = [f"{tmp_path / 'two.csv'}@5", "--figures", str(tmp_path / "pictures")]
    main(["modal", *common, "--modes", "weave,wobble", "--out", str(tmp_path / "t.csv")])
    shown = capsys.readouterr()
    assert "two.csv (wobble)" in shown.out
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    assert [row["mode"] for row in rows] == ["weave", "wobble"]
    for row, truth in zip(rows, made.roots, strict=True):
        for part, expected in (("real_1_s", truth.real), ("imag_rad_s", truth.imag)):
            sd = float(row[part.replace("_1", "_sd_1").replace("_rad", "_sd_rad")])
            assert abs(float(row[part]) - expected) < 4 * sd
    assert {p.name for p in (tmp_path / "pictures").iterdir()} == {"two_5.png", "two_5.svg", "modal.manifest.json"}
    assert "a second oscillation of" not in shown.err
    main(["modal", common[0]])
    assert "a second oscillation of" in capsys.readouterr().err
    svg = (tmp_path / "pictures" / "two_5.svg").read_text()
    assert svg.startswith("<?xml")


def test_recordings_of_one_name_in_several_folders_are_told_apart(tmp_path, capsys, no_pictures, refused):
    """As `velotyre simulate` writes them, one folder a ride."""
    for place, ride in enumerate(("first", "second")):
        (tmp_path / ride).mkdir()
        write(tmp_path / ride / "recording.csv", make(Cell(noise=0.02), np.random.default_rng(place)).run)
    files = [str(tmp_path / ride / "recording.csv") for ride in ("first", "second")]
    pictures = tmp_path / "pictures"
    main(["modal", *(f"{file}@5" for file in files), "--to", "1e3", "--figures", str(pictures)])
    shown = capsys.readouterr()
    for ride in ("first", "second"):
        assert f"{ride}/recording.csv  " in shown.out
        assert f"note: {ride}/recording.csv: the window from 0 s to 1000 s reaches beyond" in shown.err
        assert (pictures / f"{ride}_recording_5.png").is_file()
    for again in (files[0], str(tmp_path / "copy.csv")):
        (tmp_path / "copy.csv").write_bytes((tmp_path / "first" / "recording.csv").read_bytes())
        assert "the same recording as" in refused("modal", f"{files[0]}@5", f"{again}@5")


def test_a_refused_run_is_drawn_with_its_reason(tmp_path, capsys):
    write(tmp_path / "short.csv", make(Cell(), np.random.default_rng(5)).run)
    main(["modal", f"{tmp_path / 'short.csv'}@5", "--to", "0.3", "--figures", str(tmp_path / "pictures")])
    assert "no run could be used" in capsys.readouterr().err
    assert (tmp_path / "pictures" / "short_5.png").stat().st_size > 10_000


def test_lean_rate_is_roll_rate(tmp_path):
    """What `velotyre simulate` writes is read; two columns of one quantity are refused."""
    run = make(Cell(), np.random.default_rng(6)).run
    write(tmp_path / "a.csv", run, ["lean_rate_rad_s", "steer_rate_rad_s"])
    read = read_run(tmp_path / "a.csv", 5.0)
    assert set(read.channels) == {"roll_rate_rad_s", "steer_rate_rad_s"}
    assert read.channels["roll_rate_rad_s"] == pytest.approx(run.channels["roll_rate_rad_s"], rel=1e-5)
    write(tmp_path / "b.csv", run, ["lean_rate_rad_s", "roll_rate_rad_s"])
    with pytest.raises(InputError, match="lean_rate_rad_s and roll_rate_rad_s are the same quantity; keep one column"):
        read_run(tmp_path / "b.csv", 5.0)


def test_runs_of_other_channels_do_not_share_a_table(tmp_path, refused):
    run = make(Cell(noise=0.02), np.random.default_rng(7)).run
    write(tmp_path / "both.csv", run)
    del run.channels["steer_rate_rad_s"]
    write(tmp_path / "one.csv", run)
    runs = f"{tmp_path / 'both.csv'}@5", f"{tmp_path / 'one.csv'}@6"
    words = refused("modal", *runs, "--out", tmp_path / "t.csv")
    assert "only some of the runs have steer_over_lean; give runs with the same channels" in words
    assert not (tmp_path / "t.csv").exists()


@pytest.mark.parametrize("begin", [0.0, 5.0])
@pytest.mark.parametrize(("window", "note"), [
    ((), ""),
    (("--from", "0.2", "--to", "4"), ""),
    (("--to", "99"), "the window from 0 s to 99 s reaches beyond the recording, 0 to 5.99 s"),
    (("--from", "-3"), "the window from -3 s to inf s reaches beyond the recording, 0 to "),
    (("--from", "7"), "0 samples between 7 and inf s; at least 20 are needed"),
])  # fmt: skip
def test_windows_count_from_the_first_sample_whatever_the_clock_begins_with(begin, window, note, tmp_path, capsys):
    """A recording of 5.99 s of exp(-0.5 t) cos(4.5 t), t from its first sample."""
    rng, t = np.random.default_rng(4), np.arange(600) / 100
    waves = [np.exp(-0.5 * t) * np.cos(4.5 * t + phase) + 0.01 * rng.standard_normal(600) for phase in (0.0, 1.0)]
    lines = [f"{begin + a:.2f},{b:.5f},{c:.5f}" for a, b, c in zip(t, *waves, strict=True)]
    (tmp_path / "run.csv").write_text("\n".join(["time_s,roll_rate_rad_s,steer_rad", *lines, ""]), encoding="utf-8")
    try:
        main(["modal", f"{tmp_path / 'run.csv'}@5", *window])
    except SystemExit:
        assert window == ("--from", "7")
    shown = capsys.readouterr().err
    assert note in shown
    clock = "; --from and --to count from the first sample, which is at 5 s by the clock of the recording"
    assert (clock in shown) == bool(begin and note)


@pytest.mark.parametrize(("value", "sd", "shown"), [
    (-1.05231, 0.0312, "-1.052 ± 0.031"), (0.46812, 0.00031, "0.46812 ± 0.00031"), (4.4, 2.0, "4.400 ± 2.000"),
    (-0.1, 9.96e-5, "-0.100000 ± 0.000100"), (1.0, float("nan"), "1.000 ± nan"), (1.0, 0.0, "1.000 ± 0.000"),
])  # fmt: skip
def test_an_sd_is_shown_with_two_digits_however_small(value, sd, shown):
    assert with_sd(value, sd) == shown


def test_a_break_is_said_with_its_time_and_channel(tmp_path, capsys):
    made = make(Cell(noise=0.02, cycles=(3.5, 3.5)), np.random.default_rng(3), root=complex(-0.4, 5.0))
    step = 0.2 * np.ptp(made.run.channels["steer_rate_rad_s"]) * (made.run.time > 2)
    made.run.channels["steer_rate_rad_s"] = made.run.channels["steer_rate_rad_s"] + step
    write(tmp_path / "ride.csv", made.run)
    main(["modal", f"{tmp_path / 'ride.csv'}@5"])
    shown = capsys.readouterr()
    assert "steer_rate_rad_s jumps at about 2" in shown.err
    assert "sd of its noise), as after a second impulse, a step of the sensor or a spike" in shown.err


def test_what_the_ground_drives_for_many_cycles_is_said_to_be_no_noise(tmp_path, capsys):
    """The noise model holds that of sensors alone: an sd that is too small is not given without a word."""
    driven = Cell(cycles=(15, 25), damping=(0.005, 0.03), driven=0.1, noise=0.05)
    write(tmp_path / "road.csv", make(driven, np.random.default_rng(1)).run)
    main(["modal", f"{tmp_path / 'road.csv'}@5"])
    shown = capsys.readouterr()
    assert "road.csv: the residuals are not noise (p " in shown.err or "the residuals are not noise" in shown.out


def other_columns(path):
    """A decay of 5 s at 50 Hz under the names of another laboratory."""
    time, rng = np.arange(250) / 50, np.random.default_rng(7)
    wave = 0.4 * np.exp(-0.6 * time) * np.cos(4.2 * time) + rng.normal(0, 0.004, 250)
    rows = [f"{t:.3f},{x:.6f}" for t, x in zip(time, wave, strict=True)]
    path.write_text("\n".join(["t [s],Pitch [rad/s]", *rows, ""]))
    return path


def test_a_bicycle_that_stands_has_frequency_and_damping_too(tmp_path, capsys):
    path = other_columns(tmp_path / "a.csv")
    channels = ["--channel", "time=t", "--channel", "roll_rate=Pitch"]
    main(["modal", f"{path}@0", *channels, "--out", str(tmp_path / "t.csv")])
    assert "at 0 m/s, a bicycle that stands or hangs" in capsys.readouterr().err
    (row,) = csv.DictReader((tmp_path / "t.csv").read_text().splitlines())
    assert float(row["real_1_s"]) == pytest.approx(-0.6, abs=0.05)
    assert float(row["imag_rad_s"]) == pytest.approx(4.2, abs=0.05)
    with pytest.raises(SystemExit):
        main(["frequency-response", f"{path}@0", "--input", "steer_torque", "--output", "roll_rate", *channels])
    assert "the speed must be above 0; only `velotyre modal`" in capsys.readouterr().err


def test_a_channel_that_is_no_motion_of_a_bicycle_is_refused_in_one_true_line(tmp_path, capsys):
    path = other_columns(tmp_path / "a.csv")
    for name, words in (
        ("pitch_rate", "is no motion or torque of a bicycle"),
        ("rol_rate", "did you mean 'roll_rate'"),
    ):
        with pytest.raises(SystemExit):
            main(["modal", f"{path}@5", "--channel", "time=t", "--channel", f"{name}=Pitch"])
        told = capsys.readouterr().err
        assert words in told
        assert told.count("\n") == 1


@pytest.mark.parametrize(("hertz", "options", "noted"), [
    (6.0, [], True), (6.0, ["--mode", "wobble"], False), (6.0, ["--mode", "weave"], False), (3.0, [], False),
])  # fmt: skip
def test_weave_in_the_band_of_wobble_is_noted_unless_the_name_was_given(tmp_path, capsys, hertz, options, noted):
    time, rng = np.arange(0, 3, 0.01), np.random.default_rng(1)
    roll_rate = np.exp(-0.9 * time) * np.cos(2 * np.pi * hertz * time) + rng.normal(0, 0.01, time.size)
    np.savetxt(tmp_path / "a.csv", np.c_[time, roll_rate], delimiter=",", header="time_s,roll_rate_rad_s", comments="")
    main(["modal", f"{tmp_path / 'a.csv'}@6.94", *options, "--out", str(tmp_path / "modal.csv")])
    note = "note: called weave at 4 Hz or more, the band of wobble: 1 of 1 rows, up to 6 Hz; --mode wobble names a"
    assert (note in capsys.readouterr().err) is noted
    mode = options[-1] if options else "weave"
    assert (tmp_path / "modal.csv").read_text().splitlines()[1].startswith(f"6.94,{mode},")
