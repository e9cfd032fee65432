"""What `look` says of files that can be used for nothing, of faults, and of files that cannot be read."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from studies.cli import main
from studies.look import USES, Event, drafts, look, print_look, write_drafts
from tyre.formats import FORMATS
from tyre.ground import InputError


def table(path, names, rows):
    path.write_text("\n".join([names, *(",".join(map(str, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


def said(capsys, *arguments):
    main(["look", *map(str, arguments)])
    return capsys.readouterr().out


def motion(tmp_path):
    return table(tmp_path / "a.csv", "Time [s],gyro_x [deg/s]", [(k / 100, k % 9) for k in range(40)])


def test_times_that_the_logger_rounded_do_not_change_the_rate(tmp_path):
    """120 samples a second, written to a tenth of a millisecond: the median of the steps is 0.0083 s."""
    rows = [(f"{k / 120:.4f}", np.sin(k / 7)) for k in range(600)]
    found = look(table(tmp_path / "a.csv", "Time [s],gyro_x [deg/s]", rows)).as_json()
    (gyro,) = (one for one in found["channels"] if one["name"].startswith("gyro_x"))
    assert gyro["rate_hz"] == pytest.approx(120.0, rel=1e-4)


@pytest.mark.parametrize(("count", "names", "row", "words"), [
    (600, "t [s],slip angle [deg],lateral force [N],vertical load [kg],speed [km/h]",
     lambda k: (k / 100, np.sin(k / 90), 50 * np.sin(k / 90), 40, 20),
     ["vertical load [kg]: kg is a mass, kgf a force"]),
    (300, "Time [s],gyro_x [deg/s],Trq_A [Nm],state", lambda k: (k / 100, np.sin(k / 7), k % 3, k % 30), [
        "no channel recognised as steer torque",
        'map steer_torque = {column = "...", unit = "N m"} (in a unit of moment: Trq_A)',
        "(no free column has a unit of angle or force; without a known unit: state)",
        "frequency response: no\n  why: no channel recognised as steer torque",
        "diagnose can use runs after an impulse as free motion",
    ]),
    (100, "gyro_x [deg/s],x [mm]", lambda k: (k % 9, k % 4), [
        "time: no column could be the time", "or time = {rate_hz = ...}"]),
    (300, "Time [s],gyro_x [deg/s],steer torque [Nm]", lambda k: (k / 100, np.sin(k / 7), 2), [
        "steer_torque is constant: nothing drives"]),
    (100, "t [s],gyro_x [deg/s]", lambda k: (k / 100 if k < 50 else (k - 10) / 100, k % 9), [
        "time: time runs back at 1 samples, first at sample 51", "free decay (modal), replay (histories)"]),
    (300, "Time [s],gyro_x [deg/s],note", lambda k: (k / 100, np.sin(k / 7), "bump" if k == 7 else "ok"), [
        "note: not numeric, rejected (line "]),
    # units at the ends of the names, and an angle whose name is that of the steering
    (600, "t_s,steer_enc_deg,Fside_kgf,Fnorm_kgf", lambda k: (k / 100, np.sin(k / 90), np.sin(k / 90), 40 + k % 3), [
        "(in a unit of force: Fside_kgf, Fnorm_kgf; no free column has a unit of angle; steer_enc_deg is taken as "
        "steer)"]),
    # thirteen samples a period at 20 Hz: the mean and six harmonics
    (1201, "time_s,roll_rate_rad_s,steer_torque_N_m", lambda k: (k / 20, (k * 7) % 11 - 5, (k * 5) % 13 - 6), [
        "a steer torque of 6 lines"]),
])  # fmt: skip
def test_what_is_lacking_or_odd_is_told(tmp_path, capsys, count, names, row, words):
    shown = said(capsys, table(tmp_path / "a.csv", names, map(row, range(count))))
    assert [word for word in words if word not in shown] == []


def test_nothing_to_fit_never_stands_alone(tmp_path):
    found = look(table(tmp_path / "a.csv", "t [s],U1 [V],U2 [V]", [(k, k % 7, k % 5) for k in range(50)]))
    assert [use.name for use in found.uses] == list(USES)
    for use in found.uses:
        assert not use.usable
        assert use.reasons
        assert use.remedies


def test_columns_without_units_are_asked_for(tmp_path, capsys, no_pictures):
    path = table(tmp_path / "a.csv", "time,roll rate,steer torque", [(k / 100, k % 9, k % 7) for k in range(100)])
    shown = said(capsys, path, "--out", tmp_path / "d")
    assert "time: the file states no unit of time; taken as s: 100 Hz" in shown
    assert "unknown unit of roll rate (roll rate), steer torque (steer torque)" in shown
    assert "2 places to fill in" in shown
    draft = (tmp_path / "d" / "a.channels.toml").read_text(encoding="utf-8")
    assert 'roll_rate = {column = "roll rate", unit = "?"}  # FILL IN the unit' in draft
    assert 'time = {column = "time", unit = "s"}  # CHECK' in draft


@pytest.mark.parametrize(("step", "unit"), [(0.005, "s"), (20, "ms"), (1, "?")])
def test_a_unit_of_time_is_only_guessed_where_it_is_plausible(tmp_path, step, unit):
    found = look(table(tmp_path / "a.csv", "time,gyro_x [deg/s]", [(k * step, k % 9) for k in range(100)]))
    assert found.opened.clock.unit == unit
    if unit == "?":
        assert "its unit cannot be guessed" in found.opened.clock_notes[0]


def test_oddities_of_channels(tmp_path, capsys):
    t = np.arange(0, 20, 0.01)
    lean = 5 * np.sin(t)
    rows = zip(t, lean, -5 * np.cos(t), 0 * t, 9.8 + 0 * t + 0.01 * (np.arange(t.size) % 5), strict=True)
    shown = said(capsys, table(tmp_path / "a.csv", "t [s],lean [deg],roll rate [deg/s],U,az [m/s^2]", rows))
    assert "roll rate: runs against the change of lean (lean): one of the two needs sign = -1" in shown
    assert "U: constant 0: dead, or not connected?" in shown
    assert "az: shows gravity: its axis points up" in shown


def test_drafts_are_not_overwritten(tmp_path, capsys, no_pictures):
    path = table(tmp_path / "a.csv", "t [s],U1 [V]", [(k, k % 7) for k in range(50)])
    said(capsys, path, "--out", tmp_path / "d")
    mine = tmp_path / "d" / "a.channels.toml"
    made = drafts(look(path), tmp_path / "d")
    write_drafts(made, tmp_path / "d", force=False)  # a draft that nobody changed: what a stopped command left
    for changed in ("mine", mine.read_text(encoding="utf-8") + "\n"):
        mine.write_text(changed, encoding="utf-8")
        with pytest.raises(InputError, match="there already and not overwritten; take another --out, or --force"):
            write_drafts(made, tmp_path / "d", force=False)
        assert mine.read_text(encoding="utf-8") == changed
    said(capsys, path, "--out", tmp_path / "d", "--force")
    assert mine.read_text(encoding="utf-8") == made[0].text


def test_files_that_cannot_be_read(tmp_path, refused):
    assert "no such recording" in refused("look", tmp_path / "none.csv")
    (tmp_path / "a.xyz").write_text("1")
    assert "recordings end in .csv" in refused("look", tmp_path / "a.xyz")
    (tmp_path / "words.csv").write_text("a,b\nno,yes\n" * 9)
    assert "words.csv" in refused("look", tmp_path / "words.csv")
    path = motion(tmp_path)
    path.with_suffix(".toml").write_text("tyre = ", encoding="utf-8")
    assert "the sidecar is no TOML" in refused("look", path)
    (tmp_path / "out").write_text("")
    assert "is a file; give a folder" in refused("look", path, "--out", tmp_path / "out")


def test_one_bad_file_does_not_hide_the_others(tmp_path, capsys):
    path = motion(tmp_path)
    with pytest.raises(SystemExit):
        main(["look", str(path), str(tmp_path / "none.csv")])
    shown = capsys.readouterr()
    assert "gyro_x" in shown.out
    assert "none.csv: no such recording" in shown.err


def test_json_holds_the_same(tmp_path, capsys):
    (file,) = json.loads(said(capsys, motion(tmp_path), "--json", "-"))["files"]
    assert [use["name"] for use in file["uses"]] == list(USES)
    assert {c["name"]: c["taken_as"] for c in file["channels"]} == {"Time": "time", "gyro_x": "roll_rate"}


def test_events_are_said_with_what_is_left_out(tmp_path, capsys):
    found = look(motion(tmp_path))
    events = (Event("", 1, 9, 9), Event("a", 1, 9, 7, {"that lack x": 2}), Event("", 1, 9, 5, start_s=1, end_s=2))
    print_look(replace(found, uses=(replace(found.uses[0], events=events),)), {})
    shown = capsys.readouterr().out
    assert "\n  samples 1-9, all 9\n  a: samples 1-9, 7 of 9; rejected: 2 that lack x\n" in shown
    assert "\n  samples 1-9 (1 to 2 s), resampled to 5\n" in shown


def test_numbers_without_end_are_counted_as_missing(tmp_path, capsys):
    """No format but text says that a number must be finite; a warning of an ``inf - inf`` fails here."""
    parquet, arrow = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("pyarrow")
    nptdms = pytest.importorskip("nptdms")
    time, endless = np.arange(200) / 100, np.where(np.arange(200) % 2, np.inf, -np.inf)
    parquet.write_table(arrow.table({"time": time, "roll rate": endless}), tmp_path / "a.parquet")
    parquet.write_table(arrow.table({"time": endless, "roll rate": time}), tmp_path / "b.parquet")
    with nptdms.TdmsWriter(tmp_path / "c.tdms") as file:
        properties = {"unit_string": "rad/s", "wf_increment": math.inf}
        file.write_segment([nptdms.ChannelObject("run", "roll rate", time, properties=properties)])
    for name in "ab":
        assert "200 (200 missing)" in said(capsys, tmp_path / f"{name}.parquet")
    assert "time is missing in 200 of 200 samples" in said(capsys, tmp_path / "c.tdms")


@pytest.mark.filterwarnings("ignore:.*unclosed file:ResourceWarning")  # a library leaves a damaged file open
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("ending", FORMATS)
def test_damaged_files_of_every_format_are_refused_in_words(tmp_path, ending):
    path = tmp_path / f"a{ending}"
    path.write_bytes(bytes(range(1, 256)) * 4)
    with pytest.raises(InputError, match="a\\" + ending):
        look(path)


@pytest.mark.parametrize("force", [2.225073858507203e-309, 1e-300, 1e-12])
def test_a_force_of_almost_nothing_is_read_without_a_warning(tmp_path, force):
    """Ten to the power of the digits of the smallest numbers is no number."""
    found = look(table(tmp_path / "a.csv", "slip [deg],Fy [N]", [(k % 9 - 4, force) for k in range(40)]))
    curve = next(use for use in found.uses if use.name == "steady curve")
    assert "lateral force does not follow the slip" in " ".join(curve.reasons)


CELL = st.one_of(st.floats(-1e6, 1e6), st.sampled_from(["", "NaN", 0, 1, "x"]))
NAMES = ["t [s]", "gyro_x [deg/s]", "Fy [N]", "Fz [N]", "slip [deg]", "steer torque [Nm]", "way [mm]", "U", "v [km/h]"]


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), names=st.lists(st.sampled_from(NAMES), min_size=1, max_size=6, unique=True))
def test_no_table_makes_it_crash(tmp_path, data, names):
    rows = data.draw(st.lists(st.tuples(*[CELL] * len(names)), min_size=1, max_size=40))
    if data.draw(st.booleans()):
        names = ["clock [s]", *names]
        rows = [(k / 50, *row) for k, row in enumerate(rows)]
    path = table(tmp_path / "a.csv", ",".join(names), rows)
    try:
        found = look(path)
    except InputError as error:
        message = str(error)
        found = None
    if found is None:
        assert "a.csv" in message
        return
    json.dumps(found.as_json(), allow_nan=False)
    assert all(use.usable or (use.reasons and use.remedies) for use in found.uses)
    assert all(draft.text for draft in drafts(found, tmp_path))


@pytest.mark.parametrize(("seconds", "words"), [
    (60, ("frequency response: usable; specify the forward speed", "10.5 independent segments of 10 s",
          "--input steer_torque --output roll_rate --out responses.csv")),
    (24, ("independent segments of 6 s", "--output roll_rate --segment 6 --out responses.csv")),
    (4, ("frequency response: no", "4 s are too short; 8 s or more are needed", "record longer, or use replay")),
])  # fmt: skip
def test_a_forced_run_that_is_long_enough_gives_a_frequency_response(tmp_path, capsys, seconds, words):
    torque = np.random.default_rng(4).normal(size=20 * seconds + 1).round(3)
    lines = [(k / 20, (k * 7) % 11 - 5, x) for k, x in enumerate(torque)]
    path = table(tmp_path / "a.csv", "time_s,roll_rate_rad_s,steer_torque_N_m", lines)
    shown = said(capsys, path)
    for word in words:
        assert word in shown


def test_recordings_of_one_name_have_drafts_of_their_own(tmp_path, capsys, no_pictures):
    """As `velotyre simulate` writes them, one folder a ride; and two formats of one log."""
    rows = "".join(f"{0.01 * k:.2f},{np.exp(-0.02 * k) * np.sin(0.05 * k):.6f}\n" for k in range(300))
    files = [tmp_path / name for name in ("a/recording.csv", "b/recording.csv", "b/log.csv", "b/log.txt")]
    for file in files:
        file.parent.mkdir(exist_ok=True)
        file.write_text("time_s,roll_rate_rad_s\n" + rows)
    main(["look", *map(str, files), "--out", str(tmp_path / "drafts")])
    assert "already" not in capsys.readouterr().err
    written = {path.name for path in (tmp_path / "drafts").glob("*.channels.toml")}
    assert written == {f"{stem}.channels.toml" for stem in ("a_recording", "b_recording", "log_csv", "log_txt")}
    assert (tmp_path / "drafts" / "a_recording.look.png").is_file()


def test_the_draft_of_all_candidates_keeps_what_was_recognised(tmp_path):
    rows = [(k / 10, k / 10, k / 100, 3 * k, 40 + 0.01 * (k % 7), 80 + 0.01 * (k % 5)) for k in range(40)]
    found = look(table(tmp_path / "push.csv", "t_s,plate_mm,rim_mm,Fside_kgf,Fnorm_kgf,infl_psi", rows))
    (draft,) = drafts(found, tmp_path)
    for line in (
        'plate_displacement = {column = "plate_mm", unit = "mm"}',
        'rim_displacement = {column = "rim_mm", unit = "mm"}',
        '# lateral_force or vertical_load = {column = "Fside_kgf", unit = "kgf"}',
        'pressure = {column = "infl_psi", unit = "psi"}',
    ):
        assert line in draft.text
