"""Every complaint about a measurement file, by its words."""

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from studies.diagnosis import find_candidates, nuisances, read_measurement
from tyre.ground import InputError

MODAL = 'kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "t.csv"\n'
HEAD = "speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s"
ROWS = ["4.0,weave,0.1,3.1,0.05,0.05", "5.0,weave,-0.7,4.4,0.05,0.05", "6.0,weave,-1.5,5.6,0.05,0.05"]
RUN_HEAD = "time_s,roll_rate_rad_s,steer_rad"
HISTORY = (
    'kind = "histories"\nbicycle = "benchmark"\n[histories]\n[[histories.runs]]\nfile = "a.csv"\nspeed_m_s = 4.8\n'
)


def modal(tmp_path, *, toml=MODAL, head=HEAD, rows=ROWS):
    (tmp_path / "m.toml").write_text(toml)
    (tmp_path / "t.csv").write_text("\n".join([head, *rows]) + "\n")
    return tmp_path / "m.toml"


def histories(tmp_path, *, toml=HISTORY, head=RUN_HEAD, rows=None):
    (tmp_path / "m.toml").write_text(toml)
    rows = rows or [f"{0.01 * k:.2f},{0.01 * (k % 7)},{0.002 * k}" for k in range(50)]
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("\n".join([head, *rows]) + "\n")
    return tmp_path / "m.toml"


@pytest.mark.parametrize(("toml", "words"), [
    ("kind = [", "not a TOML file"),
    (MODAL + "[surprise]\n", "unknown key 'surprise'"),
    (MODAL + "[uncertainty.nonsense]\n", r"\[uncertainty.nonsense\] is empty; write the 1-sigma of its parameters"),
    (MODAL.replace('"modal"', '"model"'), "kind = 'model' is not allowed"),
    ('bicycle = "benchmark"\n', "kind is missing; write kind = one of 'bench', "),
    ('kind = "modal"\nbicycle = "benchmark"\n', r"the table \[modal\] is missing"),
    (MODAL + "[histories]\n", r"the table \[histories\] does not belong here"),
    (MODAL.replace('bicycle = "benchmark"\n', ""), "the key 'bicycle' is missing"),
    (MODAL + "[effects.steer_sprig]\n", "unknown effect 'steer_sprig'; did you mean 'steer_spring'"),
    (MODAL + "[candidates.pneumatic_trail]\ntrial = 1\n", "unknown parameter 'trial'; did you mean 'trail'"),
    (MODAL + "[candidates]\nsteer_spring = 1\n", r"write \[candidates.steer_spring\]"),
    (MODAL.replace("table =", "tabel ="), "unknown key 'tabel'"),
    (MODAL.replace('table = "t.csv"', ""), r'\[modal\]: no table; write table = "FILE.csv"'),
    (MODAL.replace('"t.csv"', "3"), r"\[modal\]: table = 3 must be a path in quotes"),
    (MODAL.replace("t.csv", "."), "is a folder; give files: .*csv"),
    ("description = 3\n" + MODAL, "description = 3 must be words in quotes"),
    (MODAL + "[uncertainty]\nlamb = 1\n", "m.toml: .uncertainty.: unknown parameter 'lamb'; did you mean 'lam'"),
    (MODAL + "[uncertainty]\nIHxx = 5e-324\n", ".uncertainty.: IHxx = 4.94066e-324 is below .*a billionth of its"),
    (MODAL + "[uncertainty]\nc = 1e-13\n", ".uncertainty.: c = 1e-13 is below 8e-11, a billionth of its value"),
    (MODAL + "[uncertainty.steer_damper]\ndamping = 1\n", "unknown parameter 'steer_damper.damping'"),
    (MODAL + "[candidates.steer_damper]\ndamping = -1\n", "damping = -1 N m s/rad is outside"),
    (
        MODAL + "[effects.steer_damper]\ndamping = 1\n[candidates.steer_damper]\ndamping = 1\n",
        r"\[candidates.steer_damper\]: the base model contains it already",
    ),
    (MODAL.replace("t.csv", "u.csv"), "u.csv: no such table"),
    ("uncertainty = 3\n" + MODAL, r"must be a table: write \[uncertainty\]"),
])  # fmt: skip
def test_measurement_file(tmp_path, toml, words):
    with pytest.raises(InputError, match=words):
        read_measurement(modal(tmp_path, toml=toml))


@pytest.mark.parametrize(("head", "rows", "words"), [
    (HEAD + ",speed_kmh", [r + ",3" for r in ROWS], "the columns speed_m_s and speed_kmh give the same; keep one"),
    (HEAD.replace("real_sd_1_s,", ""), ROWS, "line 2: 6 cells where the header has 5 columns"),
    (HEAD, [*ROWS, "7,weave,0,5,0.1"], "line 5: 5 cells where the header has 6 columns"),
    (HEAD, [*ROWS, "7,weave,0,5,0,1,0,1"], "line 5: 8 cells.*write numbers with a point"),
    (HEAD, ["# note, with commas", "", *ROWS, "7,weave,x,5,0.1,0.1"], "line 7: real_1_s = 'x' must be a finite"),
    (HEAD, [*ROWS, ",,,,,"], "line 5: speed_m_s = '' must be a finite number"),
    (HEAD, [*ROWS, "7,weave,1_0,5,0.1,0.1"], "line 5: real_1_s = '1_0' must be a finite number"),
    (HEAD, [*ROWS, '7,"weave,0,5,0.1,0.1'], "line 5: not CSV .unexpected end of data.; see the quotation marks"),
    (HEAD.replace(",", ";"), [r.replace(",", ";") for r in ROWS], "columns are separated by commas here"),
    (HEAD.replace(",", "\t"), [r.replace(",", "\t") for r in ROWS], "columns are separated by commas here"),
    (HEAD + ",", [r + "," for r in ROWS], "column 7 has no name"),
    ("", [], "the file is empty; the first line must name the columns: speed_m_s, mode, ..."),
    ("speed_m_s,mode", ["5,weave"], "the column real_1_s or imag_rad_s is missing; give decay"),
    (HEAD + ",real_1_s", [r + ",3" for r in ROWS], "the column real_1_s is given twice"),
    (HEAD, [], "the table has no rows"),
    (HEAD, [*ROWS, "7,weave,nan,5,0.1,0.1"], "line 5: real_1_s = nan must be a finite number"),
    (HEAD, [*ROWS, "7,weave,,,0.1,0.1"], "line 5: neither real_1_s nor imag_rad_s is given; take the row out"),
    (HEAD, [*ROWS, "7,weve,0,5,0.1,0.1"], "unknown mode 'weve'; did you mean 'weave'"),
    (HEAD, [*ROWS, "72,weave,0,5,0.1,0.1"], "speed_m_s = 72 is outside 0 .. 60 m/s; is it in km/h"),
    (HEAD, [*ROWS, "0,weave,0,5,0.1,0.1"], "speed_m_s = 0 is outside"),
    (HEAD, [*ROWS, "7,weave,0,-5,0.1,0.1"], "give the root with imag_rad_s >= 0"),
    (HEAD, [*ROWS, "7,weave,0,500,0.1,0.1"], "in rad/s and not in Hz"),
    (HEAD, [*ROWS, "7,weave,0,5,0,0.1"], "real_sd_1_s = 0 must be 1e-05 or more, .*no measurement is free"),
    (HEAD, [*ROWS, "7,weave,-1,5,0.1,1e308"], r"imag_sd_rad_s = 1e\+308 must be .* 1e\+12 or less"),
    (HEAD, [*ROWS, ROWS[1]], "line 5: the same run as line 3; keep one"),
    (HEAD + ",steer_over_lean_re", [r + ",3" for r in ROWS], "a ratio needs both columns steer_over_lean_re and"),
    (HEAD + ",yaw_over_lean_re,yaw_over_lean_im", [r + ",3e6,0" for r in ROWS], "over_lean_re = 3000000 must"),
])  # fmt: skip
def test_modal_table(tmp_path, head, rows, words):
    with pytest.raises(InputError, match=words):
        read_measurement(modal(tmp_path, head=head, rows=rows))


def test_a_table_too_long_to_be_fitted(tmp_path):
    rows = [f"{4 + 1e-4 * k:.4f},weave,-1,{4 + 1e-4 * k:.4f},0.1,0.1" for k in range(5001)]
    with pytest.raises(InputError, match="t.csv: 5001 rows are more than 5000; average the runs at each speed"):
        read_measurement(modal(tmp_path, rows=rows))


def test_columns_that_are_not_used_are_listed(tmp_path):
    found = read_measurement(modal(tmp_path, head=HEAD + ",speed_min_m_s", rows=[r + ",1" for r in ROWS]))
    assert "speed_min_m_s: read, but not used" in found.notes
    head = HEAD + ",steer_over_lean_re,steer_over_lean_im"
    found = read_measurement(modal(tmp_path, head=head, rows=[r + ",1,0.5" for r in ROWS]))
    assert found.points[0].ratios == {"steer_over_lean": (1 + 0.5j, 0.05)}
    assert "a shape ratio without sd: 0.05 is assumed for both parts" in found.notes


def test_missing_standard_deviations_fall_back_and_say_so(tmp_path):
    head = "speed_m_s,mode,real_1_s,imag_rad_s"
    found = read_measurement(modal(tmp_path, head=head, rows=[r.rsplit(",", 2)[0] for r in ROWS]))
    assert found.points[1].sd[0] == pytest.approx(0.03 * abs(-0.7 + 4.4j))
    assert "real_sd_1_s is missing and there are no repeats: 3% of |eigenvalue| is assumed" in found.notes
    repeats = [f"5.0,weave,{-0.7 + 0.1 * (-1) ** k},{4.4 + 0.01 * k}" for k in range(6)]
    found = read_measurement(modal(tmp_path, head=head, rows=repeats))
    t = 2.571 / 1.96  # Student's t of five degrees of freedom over the normal quantile
    assert found.points[0].sd[0] == pytest.approx(t * 0.1 * (6 / 5) ** 0.5, rel=1e-3)
    assert any("the scatter of repeats (5 degrees of freedom) is used, 0.144" in note for note in found.notes)


def test_repeats_that_scatter_more_than_stated_widen_the_noise(tmp_path):
    rows = [f"5.0,weave,{-0.7 + 0.3 * (-1) ** k},{4.4 + 0.01 * k},0.05,0.05" for k in range(6)]
    found = read_measurement(modal(tmp_path, rows=rows))
    t = 2.571 / 1.96
    assert found.points[0].sd[0] == pytest.approx(t * 0.3 * (6 / 5) ** 0.5, rel=1e-3)
    assert "repeats scatter more than real_sd_1_s says: 6 of 6 rows are widened, to 0.431" in found.notes
    assert found.points[0].sd[1] == 0.05


def test_sound_tables_are_not_widened(tmp_path):
    """Neighbours in speed of a root that bends are no repeats of one thing; 1 % of sound tables may look like that."""
    rng = np.random.default_rng(31)
    widened = 0
    for _ in range(60):
        rows = []
        for speed in np.sort(rng.uniform(4, 12, 14)):
            root = complex(
                -14 + 0.25 * (speed - 7) ** 2 - 0.9 * np.sin(speed), 45 - 2.5 * speed + 8 * np.cos(speed / 2)
            )
            sd = 0.03 + 0.01 * abs(root)
            real, imaginary = root.real + sd * rng.standard_normal(), root.imag + sd * rng.standard_normal()
            rows.append(f"{speed:.3f},wobble,{real:.6g},{imaginary:.6g},{sd:.6g},{sd:.6g}")
        notes = read_measurement(modal(tmp_path, rows=rows)).notes
        widened += any("widened" in note for note in notes)
    assert widened <= 4  # more than 4 of 60 at 2 % (two parts) has a probability of 1 %


def test_repeats_at_about_one_speed_and_one_kick_far_off(tmp_path):
    """A kick that is far off widens itself and not the other rows."""
    rows = [f"{5 + 0.02 * k},weave,{-0.7 + 0.05 * (-1) ** k},{4.4 + 0.01 * k},0.05,0.05" for k in range(12)]
    assert all(point.sd[0] == pytest.approx(0.05) for point in read_measurement(modal(tmp_path, rows=rows)).points)
    rows[4] = rows[4].replace("-0.6", "-2.6")
    found = read_measurement(modal(tmp_path, rows=rows))
    sds = [point.sd[0] for point in found.points]
    assert sds[4] > 1.5
    assert max(sds[:4] + sds[5:]) < 0.1
    assert any("the weave at 5.08 m/s is outside the scatter of its repeats; it alone" in n for n in found.notes)


def test_a_real_mode_has_no_frequency_that_is_counted_or_drawn(tmp_path):
    """Nobody measured it: an sd of it would be made up, and exact zeros would make any fit look better."""
    rows = [f"{speed},capsize,{real},0" for speed in (4, 5, 6) for real in (-0.2, -0.25, -0.31)]
    rows += [f"{speed},weave,-0.5,3.{speed}" for speed in (4, 5, 6)]
    found = read_measurement(modal(tmp_path, head="speed_m_s,mode,real_1_s,imag_rad_s", rows=rows))
    assert "9 roots are real: they have no frequency that could be off, so it is not counted" in found.notes
    assert any(note.startswith("real_sd_1_s is missing: the scatter of repeats (6 degrees") for note in found.notes)
    sds = {p.mode: p.sd[1] for p in found.points}
    assert sds == {"capsize": 0.0, "weave": pytest.approx(0.03 * abs(-0.5 + 3.6j))}
    assert set(found.rows.series) == {"capsize, real", "weave, real", "weave, imaginary"}
    assert len(found.data[0]) == 9 + 2 * 3
    assert (found.data[1] > 0).all()


def test_a_stated_sd_of_the_frequency_of_a_real_mode_is_kept(tmp_path):
    """Who states it says that the root could have been seen to oscillate."""
    rows = [f"{speed},capsize,-0.2,0,0.02,0.05" for speed in (4, 5, 6)]
    found = read_measurement(modal(tmp_path, rows=rows))
    assert set(found.rows.series) == {"capsize, real", "capsize, imaginary"}


@pytest.mark.parametrize(("toml", "head", "words"), [
    (HISTORY + "pace = 3\n", RUN_HEAD, "unknown key 'pace'"),
    (HISTORY.replace("4.8", "48000"), RUN_HEAD, "speed_m_s = 48000 is outside"),
    (HISTORY.replace("speed_m_s = 4.8\n", ""), RUN_HEAD, "a.csv: no speed_m_s; give the forward speed in m/s"),
    (HISTORY.replace("4.8", '"4.8"'), RUN_HEAD, "speed_m_s = '4.8' is outside 0 .. 60 m/s; is it in km/h, or in q"),
    (HISTORY + "group = 1.5\n", RUN_HEAD, "group = 1.5 must be a name in quotes"),
    (HISTORY.replace('file = "a.csv"\n', ""), RUN_HEAD, 'give one of file = "RUN.csv" and files'),
    (HISTORY.replace('"a.csv"', "1"), RUN_HEAD, "file = 1 must be a path in quotes"),
    (HISTORY.replace("[histories]", "[histories]\ndrop_s = 1"), RUN_HEAD, "unknown key 'drop_s'"),
    (HISTORY.split("[[")[0] + "runs = [1]\n", RUN_HEAD, "must be tables with file and speed_m_s"),
    (HISTORY.replace("[histories]", "[histories]\nnoise_sd = 1"), RUN_HEAD, "noise_sd = 1 must be a table"),
    (HISTORY, "time_s,lateral_acceleration_m_s2,steer_torque_N_m", "the place of the sensor is not known; add one"),
    (HISTORY.replace("[histories]", "[histories]\ndrop_first_s = -1"), RUN_HEAD, "drop_first_s = -1 must be"),
    (HISTORY.replace("[histories]", "[histories]\ndrop_first_s = 0.4"), RUN_HEAD, "samples after drop_first_s"),
    (HISTORY.split("[[")[0], RUN_HEAD, "no runs; write"),
    (
        HISTORY + '[[histories.runs]]\nfile = "b.csv"\nspeed_m_s = 5\n',
        RUN_HEAD,
        "b.csv: the same recording as a.csv",
    ),
    (HISTORY + "[histories.noise_sd]\nsteer_rad = 0\n", RUN_HEAD, "steer_rad = 0 must be positive"),
    (
        HISTORY + "[histories.noise_sd]\nsteer_rad = 1e-12\n",
        RUN_HEAD,
        "steer_rad = 1e-12 is below a millionth of what",
    ),
    (HISTORY + "[histories.noise_sd]\nyaw = 1\n", RUN_HEAD, "unknown channel 'yaw'"),
    (HISTORY, "time_s,roll_rate_deg_s,steer_rad", "unknown column 'roll_rate_deg_s'"),
    (HISTORY, "t,roll_rate_rad_s,steer_rad", "unknown column 't'"),
    (HISTORY, "time_s,steer_torque_N_m,lean_torque_N_m", "no motion was recorded"),
])  # fmt: skip
def test_history_files(tmp_path, toml, head, words):
    with pytest.raises(InputError, match=words):
        read_measurement(histories(tmp_path, toml=toml, head=head))


@pytest.mark.parametrize(("row", "words"), [
    ("0.90,0,0", "line 52: time_s steps by 0.41 s where 0.01 s is usual; resample"),
    ("0.90,0,0", r"resample to even steps: \[resampling\] leaves gaps of more than 5 steps open, so cut"),
    ("0.51,0,0", r"line 52: .* steps: in a channel map, write \[resampling\] with rate_hz = 100 \(linear"),
    ("0.50,0,45", r"line 52: steer_rad = 45 is too large \(up to 1.6\); is it in degrees"),
    ("0.49,0,0", "line 52: time_s = 0.49 does not rise from 0.49; put the samples in the order of time"),
    ("0.50,x,0", "line 52: roll_rate_rad_s = 'x' is not a finite number"),
])  # fmt: skip
def test_history_rows(tmp_path, row, words):
    rows = [f"{0.01 * k:.2f},{0.01 * (k % 7)},{0.002 * k}" for k in range(50)]
    with pytest.raises(InputError, match=words):
        read_measurement(histories(tmp_path, rows=[*rows, row]))


def test_other_units_of_time_and_torque(tmp_path):
    """5 Hz is slow but honest (0.2 s, with the rounding of its differences); steps of 10 are not seconds."""
    slow = [f"{0.2 * k!r},{0.01 * (k % 7)},{0.002 * k}" for k in range(50)]
    assert len(read_measurement(histories(tmp_path, rows=slow)).runs[0].time) == 50
    with pytest.raises(InputError, match="time_s steps by 10 s, too long to see a mode .up to 0.4 s.; is it in ms"):
        read_measurement(histories(tmp_path, rows=[f"{10 * k},{0.01 * (k % 7)},{0.002 * k}" for k in range(50)]))
    head = "time_s,roll_rate_rad_s,steer_torque_N_m"
    rows = [f"{0.01 * k:.2f},{0.01 * (k % 7)},{100 * k}" for k in range(50)]
    with pytest.raises(InputError, match="line 51: steer_torque_N_m = 4900 is too large .up to 1000.; is it in N mm"):
        read_measurement(histories(tmp_path, head=head, rows=rows))


def test_runs_need_the_same_channels(tmp_path):
    toml = HISTORY + '[[histories.runs]]\nfile = "c.csv"\nspeed_m_s = 5\n'
    file = histories(tmp_path, toml=toml)
    rows = [f"{0.01 * k:.2f},{0.01 * (k % 7)}" for k in range(50)]
    (tmp_path / "c.csv").write_text("\n".join(["time_s,roll_rate_rad_s", *rows]) + "\n")
    with pytest.raises(InputError, match="c.csv: has other columns than a.csv; all runs need the same channels"):
        read_measurement(file)


def test_a_torque_that_never_moves_is_said(tmp_path):
    head = "time_s,roll_rate_rad_s,steer_torque_N_m"
    rows = [f"{0.01 * k:.2f},{0.01 * (k % 7)},0" for k in range(50)]
    said = "a.csv: steer_torque_N_m is 0 in all samples: it stayed the same during the run, or the channel is dead"
    assert said in read_measurement(histories(tmp_path, head=head, rows=rows)).notes
    rows[-1] = rows[-1][:-1] + "1"
    assert not any(
        "in all samples" in note for note in read_measurement(histories(tmp_path, head=head, rows=rows)).notes
    )


def test_a_dead_channel_and_a_short_record(tmp_path):
    with pytest.raises(InputError, match="steer_rad is constant .0.: a dead channel"):
        read_measurement(histories(tmp_path, rows=[f"{0.01 * k:.2f},{0.01 * (k % 7)},0" for k in range(50)]))
    with pytest.raises(InputError, match="12 samples are too few"):
        read_measurement(histories(tmp_path, rows=[f"{0.01 * k:.2f},{0.01 * (k % 7)},{k}" for k in range(12)]))


@pytest.mark.parametrize(("given", "words"), [
    ({"IByx": 1.0}, "unknown parameter 'IByx'"),
    ({"lam": -1.0}, "lam = -1.0 must be a standard deviation >= 0"),
    ({"IByy": 1.0}, "IByy does not affect lateral motion; remove it"),
    ({"w": 3.0}, "w = 3 is more than 0.5 m; is it in mm"),
    ({"lam": 1.0}, "lam = 1 is more than 0.3 rad; is it in degrees"),
])  # fmt: skip
def test_uncertainty(tmp_path, given, words):
    with pytest.raises(InputError, match=words):
        nuisances(read_measurement(modal(tmp_path)).model, given)


def test_zero_uncertainty_fixes_a_parameter_and_defaults_are_said(tmp_path):
    model = read_measurement(modal(tmp_path)).model
    unknowns, notes = nuisances(model, {"lam": 0.0, "IBxx": 0.05})
    assert "lam" not in {u.name for u in unknowns}
    assert next(u.scale for u in unknowns if u.name == "IBxx") == 0.05
    assert "no uncertainty given for w, c" in notes[0]


@pytest.mark.parametrize(("bicycle", "effects", "name", "words"), [
    ("benchmark", [], "camber_thrust", "needs a tyre force, which no_slip does not give"),
    ("benchmark", ["relaxation_length"], "side_slip", "relaxation_length of the base model replaces it already"),
    ("browser", [], "rider_arms", "no rider: mB = 9.86 kg is less than 30 kg"),
    ("benchmark", [], "steer_spring", "excluded by request"),
])  # fmt: skip
def test_what_cannot_be_tried_is_listed_with_the_reason(bicycle, effects, name, words):
    tyre = {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}
    model = Model(load_bicycle(bicycle), tuple(effect_class(e)(**tyre) for e in effects))
    found, refused = find_candidates(model, {}, ("steer_spring",))
    assert words in refused[name]
    assert name not in {c.identifier for c in found}


@pytest.mark.parametrize(("arguments", "words"), [
    (["nothing.toml"], "nothing.toml: no such measurement file"),
    (["m.toml", "--out", "t.csv"], "--out t.csv is a file; give a folder"),
    (["m.toml", "--json", "no/v.json"], "--json no/v.json: no such folder; make it first"),
    (
        ["m.toml", "--without", "steer_dampr"],
        "--without: unknown effect 'steer_dampr'; did you mean 'steer_damper'",
    ),
    (["bad.toml", "--json", "v.json"], "bad.toml: unknown key 'surprise'"),
])  # fmt: skip
def test_the_command_reports_in_one_line_and_leaves_nothing_behind(tmp_path, refused, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    modal(tmp_path)
    (tmp_path / "bad.toml").write_text("surprise = 1\n" + MODAL)
    before = sorted(tmp_path.iterdir())
    shown = refused("diagnose", *(["--out", "out"] if "--out" not in arguments else []), *arguments).strip()
    assert words in shown
    assert shown.startswith("velotyre: ")
    assert "\n" not in shown
    assert sorted(tmp_path.iterdir()) == before
