"""Every complaint about a measurement file, by its words."""

import pytest

from studies.cli import main
from studies.missing_effect import read_measurement
from studies.missing_effect.motion.nuisances import nuisances
from tyre.errors import InputError

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


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        ("kind = [", "not a TOML file"),
        (MODAL + "[surprise]\n", "unknown key 'surprise'"),
        (MODAL.replace('"modal"', '"model"'), "kind = 'model' is not allowed"),
        ('bicycle = "benchmark"\n', "kind = None is not allowed"),
        ('kind = "modal"\nbicycle = "benchmark"\n', r"the table \[modal\] is missing"),
        (MODAL + "[histories]\n", r"the table \[histories\] does not belong here"),
        (MODAL.replace('bicycle = "benchmark"\n', ""), "the key 'bicycle' is missing"),
        (MODAL + "[effects.steer_sprig]\n", "unknown effect 'steer_sprig'; did you mean 'steer_spring'"),
        (MODAL + "[candidates.pneumatic_trail]\ntrial = 1\n", "unknown parameter 'trial'; did you mean 'trail'"),
        (MODAL + "[candidates]\nsteer_spring = 1\n", r"write \[candidates.steer_spring\]"),
        (MODAL.replace("table =", "tabel ="), "unknown key 'tabel'"),
        (MODAL.replace('table = "t.csv"', ""), r'\[modal\]: table = "FILE.csv" is missing'),
        (MODAL.replace("t.csv", "u.csv"), "u.csv: no such table"),
        ("uncertainty = 3\n" + MODAL, r"must be a table: write \[uncertainty\]"),
    ],
)
def test_measurement_file(tmp_path, toml, words):
    with pytest.raises(InputError, match=words):
        read_measurement(modal(tmp_path, toml=toml))


@pytest.mark.parametrize(
    ("head", "rows", "words"),
    [
        (HEAD + ",speed_kmh", [r + ",3" for r in ROWS], "unknown column 'speed_kmh'.*units are in the column names"),
        (HEAD.replace("imag_rad_s,", "", 1), ROWS, "rows have more cells than the header has columns"),
        (HEAD.rsplit(",", 3)[0], [r.rsplit(",", 3)[0] for r in ROWS], "the column imag_rad_s is missing"),
        (HEAD + ",real_1_s", [r + ",3" for r in ROWS], "the column real_1_s is given twice"),
        (HEAD, [], "the table has no rows"),
        (HEAD, ROWS[:1], "1 point.s. cannot be diagnosed; give at least three"),
        (HEAD, [*ROWS, "7,weave,nan,5,0.1,0.1"], "line 5: real_1_s = 'nan' is not a finite number"),
        (HEAD, [*ROWS, "7,weave,,5,0.1,0.1"], "line 5: real_1_s = '' is not a finite number"),
        (HEAD, [*ROWS, "7,weve,0,5,0.1,0.1"], "unknown mode 'weve'; did you mean 'weave'"),
        (HEAD, [*ROWS, "72,weave,0,5,0.1,0.1"], "speed_m_s = 72 is outside 0 .. 60 m/s; is it in km/h"),
        (HEAD, [*ROWS, "0,weave,0,5,0.1,0.1"], "speed_m_s = 0 is outside"),
        (HEAD, [*ROWS, "7,weave,0,-5,0.1,0.1"], "give the one with imag_rad_s >= 0"),
        (HEAD, [*ROWS, "7,weave,0,500,0.1,0.1"], "in rad/s and not in Hz"),
        (HEAD, [*ROWS, "7,weave,0,5,0,0.1"], "real_sd_1_s = 0 must be positive: no measurement is free of noise"),
        (HEAD, [*ROWS, ROWS[1]], "line 5: the same run as line 3 .equal speed, mode and eigenvalue.; keep one"),
        (HEAD + ",steer_over_lean_re", [r + ",3" for r in ROWS], "a ratio needs both columns steer_over_lean_re and"),
    ],
)  # fmt: skip
def test_modal_table(tmp_path, head, rows, words):
    with pytest.raises(InputError, match=words):
        read_measurement(modal(tmp_path, head=head, rows=rows))


def test_missing_standard_deviations_fall_back_and_say_so(tmp_path):
    head = "speed_m_s,mode,real_1_s,imag_rad_s"
    found = read_measurement(modal(tmp_path, head=head, rows=[r.rsplit(",", 2)[0] for r in ROWS]))
    assert found.points[1].sd[0] == pytest.approx(0.03 * abs(-0.7 + 4.4j))
    assert "real_sd_1_s is missing and there are no repeats: 3% of |eigenvalue| is assumed" in found.notes
    repeats = [f"5.0,weave,{-0.7 + 0.1 * (-1) ** k},{4.4 + 0.01 * k}" for k in range(6)]
    found = read_measurement(modal(tmp_path, head=head, rows=repeats))
    assert found.points[0].sd[0] == pytest.approx(0.1 * (6 / 5) ** 0.5)
    assert any("the scatter of 5 repeats, 0.11, is used" in note for note in found.notes)


def test_repeats_that_scatter_more_than_stated_widen_the_noise(tmp_path):
    rows = [f"5.0,weave,{-0.7 + 0.3 * (-1) ** k},{4.4 + 0.01 * k},0.05,0.05" for k in range(6)]
    found = read_measurement(modal(tmp_path, rows=rows))
    assert found.points[0].sd[0] == pytest.approx(0.3 * (6 / 5) ** 0.5)
    assert any("repeats scatter more than real_sd_1_s says" in note for note in found.notes)


@pytest.mark.parametrize(
    ("toml", "head", "words"),
    [
        (HISTORY + "pace = 3\n", RUN_HEAD, "unknown key 'pace'"),
        (HISTORY.replace("4.8", "48000"), RUN_HEAD, "speed_m_s = 48000 is outside"),
        (HISTORY.replace('file = "a.csv"\n', ""), RUN_HEAD, 'file = "RUN.csv" is missing'),
        (HISTORY.replace("[histories]", "[histories]\ndrop_first_s = -1"), RUN_HEAD, "drop_first_s = -1 must be"),
        (HISTORY.replace("[histories]", "[histories]\ndrop_first_s = 0.4"), RUN_HEAD, "samples after drop_first_s"),
        (HISTORY.split("[[")[0], RUN_HEAD, "no runs; write"),
        (
            HISTORY + '[[histories.runs]]\nfile = "b.csv"\nspeed_m_s = 5\n',
            RUN_HEAD,
            "b.csv: the same recording as a.csv",
        ),
        (HISTORY + "[histories.noise_sd]\nsteer_rad = 0\n", RUN_HEAD, "steer_rad = 0 must be positive"),
        (HISTORY + "[histories.noise_sd]\nyaw = 1\n", RUN_HEAD, "unknown channel 'yaw'"),
        (HISTORY, "time_s,roll_rate_deg_s,steer_rad", "unknown column 'roll_rate_deg_s'"),
        (HISTORY, "t,roll_rate_rad_s,steer_rad", "unknown column 't'"),
        (HISTORY, "time_s,steer_torque_N_m,lean_torque_N_m", "no motion was recorded"),
    ],
)
def test_history_files(tmp_path, toml, head, words):
    with pytest.raises(InputError, match=words):
        read_measurement(histories(tmp_path, toml=toml, head=head))


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("0.90,0,0", "line 52: time_s steps by 0.41 s where 0.01 s is usual; resample"),
        ("0.50,0,45", "line 52: steer_rad = 45 is too large; is it in degrees"),
        ("0.50,x,0", "line 52: roll_rate_rad_s = 'x' is not a finite number"),
    ],
)
def test_history_rows(tmp_path, row, words):
    rows = [f"{0.01 * k:.2f},{0.01 * (k % 7)},{0.002 * k}" for k in range(50)]
    with pytest.raises(InputError, match=words):
        read_measurement(histories(tmp_path, rows=[*rows, row]))


def test_a_dead_channel_and_a_short_record(tmp_path):
    with pytest.raises(InputError, match="steer_rad is constant .0.: a dead channel"):
        read_measurement(histories(tmp_path, rows=[f"{0.01 * k:.2f},{0.01 * (k % 7)},0" for k in range(50)]))
    with pytest.raises(InputError, match="12 samples are too few"):
        read_measurement(histories(tmp_path, rows=[f"{0.01 * k:.2f},{0.01 * (k % 7)},{k}" for k in range(12)]))


@pytest.mark.parametrize(
    ("given", "words"),
    [({"IByx": 1.0}, "unknown parameter 'IByx'"), ({"lam": -1.0}, "lam = -1.0 must be a standard deviation >= 0")],
)
def test_uncertainty(tmp_path, given, words):
    with pytest.raises(InputError, match=words):
        nuisances(read_measurement(modal(tmp_path)).model, given)


def test_zero_uncertainty_fixes_a_parameter_and_defaults_are_said(tmp_path):
    model = read_measurement(modal(tmp_path)).model
    unknowns, notes = nuisances(model, {"lam": 0.0, "IBxx": 0.05})
    assert "lam" not in {u.name for u in unknowns}
    assert next(u.scale for u in unknowns if u.name == "IBxx") == 0.05
    assert "no uncertainty given for w, c" in notes[0]


def test_the_command_reports_in_one_line(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["diagnose", str(tmp_path / "nothing.toml")])
    assert stop.value.code == 2
    assert "nothing.toml: no such measurement file" in capsys.readouterr().err
