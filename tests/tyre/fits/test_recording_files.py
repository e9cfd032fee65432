"""CSV recordings with sidecar: units, axes, what is refused and in which words."""

from dataclasses import replace

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tyre.fits import read_recording, write_csv
from tyre.recordings import Condition, LateralStiffnessTest, RigRun

SIDECAR = """
tyre = "Test tyre"
load_N = 400
pressure_bar = 5.5
surface = "flat"
axes = "adapted SAE"
"""
SWEEP = """time_s,slip_angle_deg,lateral_force_N,vertical_load_N
0.0,-1.0,-110.0,400.0
0.1,0.0,0.0,401.0
0.2,1.0,110.0,399.0
"""
PULL = """lateral_force_N,plate_displacement_mm,rim_displacement_mm
0,0,0
50,1.0,0.1
100,2.0,0.2
"""


@pytest.fixture
def folder(tmp_path):
    def write(table, sidecar=SIDECAR, name="run"):
        (tmp_path / f"{name}.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
        (tmp_path / f"{name}.toml").write_text(sidecar)
        return tmp_path / f"{name}.csv"

    return write


@pytest.fixture
def sweep():
    t = np.arange(400) / 200.0
    slip = np.deg2rad(4.0) * np.sin(np.pi * t)
    return RigRun(
        Condition("Test tyre", 400.0, 5.5e5, "drum", 1.3, "lab rim", 9.3 / 3.6, 22.0, np.deg2rad(2.0)), "adapted SAE",
        t, slip, 6300.0 * slip, 400.0 + np.cos(t), aligning_moment=-110.0 * slip, speed=np.full_like(t, 2.6),
        inclination=np.full_like(t, np.deg2rad(2.0)), temperature=22.0 + t, synthetic=True,
        notes=("synthetic, for a test",),
    )  # fmt: skip


def test_sweep_in_si(folder):
    run = read_recording(folder(SWEEP))
    assert isinstance(run, RigRun)
    assert run.kind == "slip_sweep"
    np.testing.assert_allclose(run.slip_angle, [-np.pi / 180, 0.0, np.pi / 180], rtol=1e-15)
    np.testing.assert_array_equal(run.lateral_force, [-110.0, 0.0, 110.0])
    assert run.condition.pressure == pytest.approx(5.5e5)
    assert run.source.name == "run.csv"


def test_units_of_columns_and_keys(folder):
    table = "time_ms,slip_angle_rad,lateral_force_kN,vertical_load_lbf,aligning_moment_Nmm,speed_m_s,temperature_K\n"
    table += "0,0.01,0.1,100,1000,2.5,300\n100,0.02,0.2,100,2000,2.5,300\n"
    sidecar = SIDECAR.replace("load_N = 400", "load_kN = 0.4").replace("pressure_bar = 5.5", "pressure_psi = 80")
    run = read_recording(folder(table, sidecar + 'speed_m_s = 2.5\ntemperature_K = 300\ncamber_rad = 0.1\nrim = "x"\n'))
    # 1 lbf = 4.4482216152605 N, 1 psi = 6894.757293168 Pa (NIST SP 811, appendix B)
    np.testing.assert_allclose(run.vertical_load, 444.82216152605, rtol=1e-13)
    np.testing.assert_allclose(run.aligning_moment, [1.0, 2.0])
    np.testing.assert_allclose(run.time, [0.0, 0.1])
    np.testing.assert_allclose(run.lateral_force, [100.0, 200.0])
    np.testing.assert_allclose(run.temperature, 26.85)
    assert run.condition.load == pytest.approx(400.0)
    assert run.condition.pressure == pytest.approx(80 * 6894.757293168, rel=1e-12)
    assert run.condition.temperature == pytest.approx(26.85)
    assert (run.condition.speed, run.condition.camber, run.condition.rim) == (2.5, 0.1, "x")


# One physical state in three conventions: slip that pushes the tyre to the right, leaning right, trail positive.
@pytest.mark.parametrize(("axes", "slip", "force", "load", "moment", "camber"), [
    ("adapted SAE", 1.0, 110.0, 400.0, -2.0, 5.0), ("ISO", 1.0, -110.0, 400.0, 2.0, 5.0),
    ("SAE", -1.0, 110.0, -400.0, -2.0, 5.0),
    ("SAE", -1.0, 110.0, 400.0, -2.0, 5.0),  # a load cell that prints the load as positive
])  # fmt: skip
def test_axes_are_turned(folder, axes, slip, force, load, moment, camber):
    names = "time_s,slip_angle_deg,lateral_force_N,vertical_load_N,aligning_moment_Nm,inclination_deg\n"
    rows = "".join(f"{t},{slip},{force},{load},{moment},{camber}\n" for t in (0, 1))
    run = read_recording(folder(names + rows, SIDECAR.replace("adapted SAE", axes)))
    assert run.slip_angle[0] == pytest.approx(np.deg2rad(1.0))
    assert run.lateral_force[0] == 110.0
    assert run.vertical_load[0] == 400.0
    assert run.aligning_moment[0] == -2.0
    assert run.inclination[0] == pytest.approx(np.deg2rad(5.0))
    assert run.axes == axes


@pytest.mark.parametrize("axes", ["ISO", "SAE", "adapted SAE"])
def test_round_trip(tmp_path, sweep, axes):
    sweep.lateral_force[7:9] = np.nan
    write_csv(replace(sweep, axes=axes, kind="slip_step"), tmp_path / "a.csv")
    back = read_recording(tmp_path / "a.csv")
    for name in ("time", "slip_angle", "lateral_force", "vertical_load", "aligning_moment", "speed", "temperature"):
        np.testing.assert_allclose(getattr(back, name), getattr(sweep, name), rtol=1e-11, atol=1e-14)
    assert back.synthetic
    assert back.kind == "slip_step"
    assert back.notes == sweep.notes
    for name in ("tyre", "load", "surface", "drum_radius", "rim", "temperature"):
        assert getattr(back.condition, name) == getattr(sweep.condition, name)
    assert back.condition.camber == pytest.approx(sweep.condition.camber)
    assert back.condition.speed == pytest.approx(sweep.condition.speed)


def test_a_file_that_is_read_and_written_twice_is_the_same(tmp_path, sweep):
    write_csv(sweep, tmp_path / "a.csv")
    write_csv(read_recording(tmp_path / "a.csv"), tmp_path / "b.csv")
    for suffix in (".csv", ".toml"):
        assert (tmp_path / f"a{suffix}").read_text() == (tmp_path / f"b{suffix}").read_text()


def test_pull_round_trip_in_iso(tmp_path):
    x = np.linspace(0.0, 2e-3, 9)
    test = LateralStiffnessTest(Condition("T", 400.0, 5.5e5, "flat"), "ISO", 5e4 * x, 1.2 * x, 0.2 * x)
    write_csv(test, tmp_path / "p.csv")
    assert (tmp_path / "p.csv").read_text().splitlines()[-1].startswith("-100,-2.4,")
    np.testing.assert_allclose(read_recording(tmp_path / "p.csv").tyre_deflection, x, atol=1e-15)


def test_decimal_commas_between_semicolons_are_read(folder):
    run = read_recording(folder(SWEEP.replace(",", ";").replace(".", ",")))
    np.testing.assert_array_equal(run.lateral_force, [-110.0, 0.0, 110.0])
    np.testing.assert_allclose(np.rad2deg(run.slip_angle), [-1.0, 0.0, 1.0])


def test_bom_blank_lines_and_missing_samples(folder):
    table = "\ufeff" + SWEEP.replace("0.0,0.0,401.0", "NOTAVAIL,,401.0") + "\n"
    run = read_recording(folder(table.replace("\n", "\r\n")))
    assert np.isnan(run.slip_angle[1])
    assert np.isnan(run.lateral_force[1])
    assert len(run.time) == 3


@pytest.mark.parametrize(("change", "message"), [
    (lambda s: s[:-8], "line 4: 3 cells where the header has 4 columns; was the file cut off"),
    (lambda s: s.replace("1.0,110.0", "1,0,110,0"), "decimal commas need semicolons"),
    (lambda s: s.replace("lateral_force_N", "lateral_force_kg"), "'kg' is not a unit of force .*known: n, newton"),
    (lambda s: s.replace("lateral_force_N", "lateral_force"), "'lateral_force': no unit of force is given"),
    (lambda s: s.replace("slip_angle_deg", "slip_angel_deg"), "did you mean 'slip_angle' with its unit"),
    (lambda s: s.replace("vertical_load_N", "lateral_force_kN"), "lateral_force is in two columns.*keep one"),
    (lambda s: s.replace("vertical_load_N", "height_m"), "column vertical_load_N is missing"),
    (lambda s: s.splitlines()[0] + "\n", "no rows; was the file cut off"),
    (lambda s: "\n".join(s.splitlines()[:2]) + "\n", "has 1 of the 2 or more samples that are needed"),
    (lambda s: s.replace("401.0", "inf"), "vertical_load is infinite in sample 2"),
    (lambda s: s.replace("400.0", "-400").replace("401.0", "-401").replace("399.0", "-399"), "axes = 'SAE'"),
    (lambda s: s.replace("-110.0", "").replace("110.0", "").replace(",0.0,401", ",,401"), "no valid sample at all"),
    (lambda s: "", "the first line must name the columns: time_s, slip_angle_deg"),
    (lambda s: "a,b\n1,2\n", "no known column name"), (lambda s: b"\xff\xfe\n1", "not text in UTF-8"),
])  # fmt: skip
def test_malformed_tables_are_refused_with_the_place(folder, change, message):
    refuses(message, read_recording, folder(change(SWEEP)))


@pytest.mark.parametrize(("change", "message"), [
    (lambda s: s.replace('axes = "adapted SAE"', ""), "key 'axes' is missing .*no default"),
    (lambda s: s.replace("adapted SAE", "adapted sae"), "'adapted sae' is not one of.*did you mean 'adapted SAE'"),
    (lambda s: s.replace("tyre =", "tire ="), "unknown key 'tire'; did you mean 'tyre'"),
    (lambda s: s.replace("load_N", "load_kilos"), "'kilos' is not a unit of force"),
    (lambda s: s.replace("400", "'400'"), "load_N = '400' must be a number"),
    (lambda s: s + "load_kN = 0.4", "load is given twice"),
    (lambda s: s.replace("pressure_bar", "pressure_kPa"), "pressure is 0.055 bar, allowed are 0.2 to 20 bar"),
    (lambda s: s.replace("flat", "road"), "surface = 'road' is neither 'flat' nor 'drum'"),
    (lambda s: s.replace("flat", "drum"), "a drum needs its radius"),
    (lambda s: s + "drum_radius_m = 1.3", "a flat track must not have one"),
    (lambda s: s + "synthetic = 1", "synthetic = 1 must be true or false"),
    (lambda s: s + "kind = 'sweep'", "kind = 'sweep' is not one of slip_sweep"),
    (lambda s: s + "kind = 'lateral_stiffness'", "declares kind = 'lateral_stiffness', the columns are"),
    (lambda s: s + "note = [1]", "note = .1. must be text or a list of texts"),
    (lambda s: s.replace("Test tyre", " "), "tyre is empty"),
    (lambda s: s + "[[[", "not a TOML file"),
])  # fmt: skip
def test_malformed_sidecars_are_refused_by_key(folder, change, message):
    refuses(message, read_recording, folder(SWEEP, change(SIDECAR)))


def test_missing_files_are_named(tmp_path):
    refuses(r"none\.csv: no such recording", read_recording, tmp_path / "none.csv")
    (tmp_path / "lone.csv").write_text(SWEEP)
    refuses(r"lone\.toml: the sidecar is missing; write one with tyre", read_recording, tmp_path / "lone.csv")
    (tmp_path / "lone.toml").mkdir()
    refuses(r"lone\.toml: cannot be read", read_recording, tmp_path / "lone.csv")
    refuses("recordings end in", read_recording, tmp_path / "run.docx")


def test_every_row_of_a_long_recording_is_read(folder):
    row = "{:.3f},{:.4f},{:.2f},{:.2f}\n"
    lines = "".join(row.format(i / 200, i % 80 / 10 - 4, i % 80 * 10 - 400, 400 + i % 7) for i in range(1000))
    path = folder(SWEEP.splitlines()[0] + "\n" + lines * 60)
    run = read_recording(path)
    assert len(run.lateral_force) == 60_000
