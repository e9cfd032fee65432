"""TYDEX 1.3: layout of the manual, units, factors and offsets, what becomes of a file that is read and written."""

from dataclasses import replace

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tyre.fits import read_recording, write_tydex
from tyre.formats import read_signals
from tyre.recordings import Condition, LateralStiffnessTest, RigRun


def entry(name, description, unit, *rest):
    """A table line in the columns of the manual: name 1-10, description 11-40, unit 41-50, then fields of ten."""
    return f"{name:<10}{description:<30}{unit:<10}" + "".join(f"{field:<10}" for field in rest) + "\n"


# Written by hand after Unrau & Zamow (1997): comment lines, an unused channel, a blank line, a factor, NOTAVAIL.
SWEEP = (
    "! produced by hand\n**HEADER\n"
    + entry("RELEASE", "Release of TYDEX-Format", "", "1.3")
    + entry("MEASID", "Measurement ID", "", "M 17")
    + "**COMMENTS\nold tyre, 2000 km\n\n**CONSTANTS\n! name     meaning\n"
    + entry("IDENTITY", "Identity of the tyre", "", "Corsa 26")
    + entry("FNOMIN", "Nominal load", "kN", "0.4")
    + entry("INFLPRES", "Inflation pressure", "kPa", "550")
    + entry("TRCKSURF", "Surface of track", "", "flat belt, sandpaper")
    + entry("AMBITEMP", "Ambient temperature", "deg C", "NOTAVAIL")
    + "**MEASURCHANNELS\n"
    + entry("MEASNUMB", "Measuring point number", "-", "1", "0", "0")
    + entry("RUNTIME", "Running time", "ms", "1", "0", "0")
    + entry("SLIPANGL", "Slip angle", "deg", "1", "0", "0")
    + entry("FYW", "Lateral force", "N", "-2.0", "0", "3.0")
    + entry("FZW", "Vertical force", "kN", "0.001", "5", "0")
    + entry("MZW", "Aligning moment", "Nm", "1", "0", "0")
    + entry("LONGVEL", "Speed", "km/h", "1", "0", "0")
    + "\n**MEASURDATA\n"
    + " 1   0    -1.0  -50.0  395.0  -1.5   9.0\n"
    + " 2   100   0.0    0.0  396.0   0.0   9.0\n"
    + " 3   200   1.0  NOTAVAIL  394.0   1.5   9.0\n"
    + "**END\n"
)
PULL = (
    "**HEADER\n"
    + entry("RELEASE", "Release of TYDEX-Format", "", "1.3")
    + "**CONSTANTS\n"
    + entry("IDENTITY", "Identity of the tyre", "", "T")
    + entry("FZW", "Load", "N", "400")
    + entry("NOMPRES", "Pressure", "psi", "80")
    + entry("TRCKSURF", "Surface of track", "", "flat")
    + "**MEASURCHANNELS\n"
    + entry("FYW", "Lateral force", "N", "1", "0", "0")
    + entry("LATDISPW", "Lateral displacement", "mm", "1", "0", "0")
    + "**MEASURDATA\n 0 0\n -50 -1.0\n -100 -2.0\n**END"
)


@pytest.fixture
def tdx(tmp_path):
    def write(text, name="run"):
        path = tmp_path / f"{name}.tdx"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.fixture
def run():
    t = np.arange(300) / 200.0
    slip = np.deg2rad(4.0) * np.sin(np.pi * t)
    return RigRun(
        Condition("Test tyre", 400.0, 5.5e5, "drum", 1.3, "lab rim", 9.3 / 3.6, 22.0), "SAE", t, slip, 6300.0 * slip,
        400.0 + np.cos(t), aligning_moment=-110.0 * slip, speed=np.full_like(t, 2.6), temperature=22.0 + t,
        synthetic=True,
    )  # fmt: skip


def test_values_units_factors_offsets_and_axes(tdx):
    run = read_recording(tdx(SWEEP))
    np.testing.assert_allclose(run.time, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(run.slip_angle, np.deg2rad([-1.0, 0.0, 1.0]))  # ISO slip has the sign of adapted SAE
    # measured -50, 0 -> (m + 0) * -2 + 3 = 103, 3 N to the left, hence negative to the right
    np.testing.assert_allclose(run.lateral_force[:2], [-103.0, -3.0])
    assert np.isnan(run.lateral_force[2])
    np.testing.assert_allclose(run.vertical_load, [400.0, 401.0, 399.0])  # (m + 5) / 1000 kN
    np.testing.assert_allclose(run.aligning_moment, [1.5, 0.0, -1.5])  # about z up -> about z down
    np.testing.assert_allclose(run.speed, 2.5)
    assert run.axes == "ISO"
    assert run.condition == Condition("Corsa 26", 400.0, 550e3, "flat", speed=2.5)


def test_what_was_assumed_or_left_out_is_said(tdx):
    notes = " | ".join(read_recording(tdx(SWEEP)).notes)
    assert "speed of the condition is the median of its channel" in notes
    assert "channels not used: MEASNUMB" in notes
    assert "FZW: offset of the measured value added before the conversion factor" in notes


def test_a_file_with_displacement_and_no_sweep_is_a_lateral_stiffness_test(tdx):
    test = read_recording(tdx(PULL))
    assert isinstance(test, LateralStiffnessTest)
    np.testing.assert_allclose(test.lateral_force, [0.0, 50.0, 100.0])
    np.testing.assert_allclose(test.plate_displacement, [0.0, 1e-3, 2e-3])
    np.testing.assert_array_equal(test.rim_displacement, 0.0)
    assert test.condition.pressure == pytest.approx(80 * 6894.757293168)
    assert any("the rim is taken as rigid" in note for note in test.notes)


def test_condition_falls_back_to_medians(tdx):
    text = SWEEP.replace("FNOMIN  ", "FNOMAX  ").replace("IDENTITY", "IDENTITX").replace("TRCKSURF", "TRCKSURX")
    text = text.replace("INFLPRES", "INFLPREX").replace("MEASNUMB", "INFLPRES").replace("-         1", "bar       2")
    run = read_recording(tdx(text))
    assert run.condition.load == pytest.approx(400.0)
    assert run.condition.pressure == pytest.approx(4e5)  # measured 1, 2, 3 times 2 bar
    assert run.condition.tyre == "M 17"
    notes = " | ".join(run.notes)
    for words in ("vertical load of the condition is the median", "called 'M 17'", "taken as flat", "pressure of the"):
        assert words in notes


def test_a_nominal_load_is_that_of_the_test_up_to_a_quarter_from_the_measured(tdx):
    """Measured are 400 N, which is 0.76 or 0.74 of the nominal load."""
    for share, taken in ((0.76, True), (0.74, False), (1.24, True), (1.26, False)):
        nominal = 400.0 / share
        line = entry("FNOMIN", "Nominal load", "N", f"{nominal:.4f}")
        load = read_recording(tdx(SWEEP.replace(entry("FNOMIN", "Nominal load", "kN", "0.4"), line))).condition.load
        assert load == pytest.approx(nominal if taken else 400.0, abs=1e-3)


def test_h_axes_stand_in(tdx):
    run = read_recording(tdx(SWEEP.replace("FYW ", "FYH ").replace("MZW ", "MZH ")))
    assert run.lateral_force[0] == -103.0
    assert "FYH (H-axes) replaces FYW (W-axes)" in run.notes


def test_a_writer_that_missed_the_columns_is_understood(tdx):
    line = "FNOMIN    Nominal load of this particular long test   kN   0.4\n"
    run = read_recording(tdx(SWEEP.replace(entry("FNOMIN", "Nominal load", "kN", "0.4"), line)))
    assert run.condition.load == pytest.approx(400.0)


def test_numbers_that_touch_in_fields_of_ten_are_read(tdx):
    rows = "    0.0000    0.0000\n-50.000000-1.0000000\n-100.00000-2.0000000\n"
    test = read_recording(tdx(PULL.replace(" 0 0\n -50 -1.0\n -100 -2.0\n", rows)))
    np.testing.assert_allclose(test.lateral_force, [0.0, 50.0, 100.0])


def test_decimal_commas_are_read_where_all_of_the_data_has_them(tdx):
    comma = SWEEP.partition("**MEASURCHANNELS")
    text = comma[0].replace("0.4 ", "0,4 ") + comma[1] + comma[2].replace(".", ",")
    run, point = read_recording(tdx(text)), read_recording(tdx(SWEEP, "b"))
    for name in ("time", "slip_angle", "lateral_force", "vertical_load", "speed"):
        np.testing.assert_array_equal(getattr(run, name), getattr(point, name))
    assert run.condition == point.condition


def test_latin_1_is_read(tdx):
    assert read_recording(tdx(SWEEP.replace("Corsa 26", "Größe 26").encode("latin-1"))).condition.tyre == "Größe 26"


def test_round_trip_is_exact_to_the_printed_digits(tmp_path, run):
    run.lateral_force[5] = np.nan
    write_tydex(run, tmp_path / "a.tdx")
    back = read_recording(tmp_path / "a.tdx")
    write_tydex(back, tmp_path / "b.tdx")
    again = (tmp_path / "b.tdx").read_text()
    assert again.replace("ID                          b", "ID                          a") == (
        (tmp_path / "a.tdx").read_text()
    )
    np.testing.assert_allclose(back.lateral_force, run.lateral_force, atol=5.1e-5)  # 4 decimals of a newton
    np.testing.assert_allclose(back.slip_angle, run.slip_angle, atol=np.deg2rad(5.1e-7))
    np.testing.assert_allclose(back.speed, run.speed, atol=1e-6)
    np.testing.assert_allclose(back.temperature, run.temperature, atol=1e-5)
    assert back.synthetic
    assert back.condition == replace(run.condition, speed=back.condition.speed)
    assert back.condition.speed == pytest.approx(9.3 / 3.6, rel=1e-12)


def test_kind_and_pull_round_trip(tmp_path, run):
    write_tydex(replace(run, kind="slip_step", synthetic=False), tmp_path / "a.tdx")
    assert read_recording(tmp_path / "a.tdx").kind == "slip_step"
    x = np.linspace(0.0, 2e-3, 9)
    test = LateralStiffnessTest(
        Condition("T", 400.0, 5.5e5, "flat"), "ISO", 5e4 * x, 1.2 * x, 0.2 * x, time=np.arange(9.0)
    )
    write_tydex(test, tmp_path / "p.tdx")
    back = read_recording(tmp_path / "p.tdx")
    np.testing.assert_allclose(back.tyre_deflection, x, atol=1e-9)
    np.testing.assert_allclose(back.lateral_force, test.lateral_force, atol=1e-4)
    np.testing.assert_array_equal(back.time, test.time)
    assert not back.synthetic


@pytest.mark.parametrize(("change", "message"), [
    (lambda s: s.replace("**END", ""), r"keyword \*\*END is missing; the file seems to be cut off"),
    (lambda s: s.replace("**HEADER", ""), r"keyword \*\*HEADER is missing"),
    (lambda s: s.replace("**CONSTANTS", "**CONSTANT"), r"\*\*CONSTANT is unknown.*did you mean \*\*CONSTANTS"),
    (lambda s: s.replace("**COMMENTS", "**HEADER"), r"keyword \*\*HEADER stands 2 times"),
    (lambda s: s.replace("**MEASURDATA", "**MEASURDATA 5"), "announces 5 rows and holds 3"),
    (lambda s: s.replace("   1.5   9.0\n", "\n"), "has 5 values for 7 channels; was the file cut off"),
    (lambda s: s.replace("9.0\n 2 ", "9.0 2\n"), "row '1   0 .* 2' .* has 8 values for 7 channels"),
    (lambda s: s.replace("1.5", "1,5"), "not made of numbers with decimal points"),
    (lambda s: s.replace("LONGVEL  ", "RUNTIME  "), "channel RUNTIME is listed twice"),
    (lambda s: s.replace("INFLPRES", "IDENTITY"), "IDENTITY is listed twice"),
    (lambda s: s.replace("deg       1", "grad      1"), "channel SLIPANGL: unit 'grad' is not a unit of angle"),
    (lambda s: s.replace("kPa       ", "          "), "constant INFLPRES: no unit of pressure is given"),
    (lambda s: s.replace("-2.0      ", "x         "), "conversion factor of FYW is 'x', not a number"),
    (lambda s: s.replace("-2.0      ", "0         "), "conversion factor of FYW is 0"),
    (lambda s: s.replace("550  ", "5,5  "), "constant INFLPRES: '5,5' is not a number with a decimal point"),
    (lambda s: s.replace("SLIPANGL", "SLIPANGX"), "channel SLIPANGL is missing .found: MEASNUMB"),
    (lambda s: s.replace("INFLPRES", "INFLPREX"), "no pressure .constant INFLPRES or NOMPRES. and no such channel"),
    (lambda s: s.replace("flat belt", "drum"), "measured on a drum, but constant DRUMRAD"),
    (lambda s: s.split(" 1   0")[0] + "**END", "holds no rows"),
    (lambda s: s.replace("SLIPANGL ", "SLIPANGLE_MEAN "),
     "name 'SLIPANGLE_MEAN' is longer than its field of 10 columns; shorten it, or put a blank"),
    (lambda s: s.replace("**MEASURCHANNELS\n", "**MEASURCHANNELS\n FYX alone\n"), "the line of FYX keeps to no"),
    (lambda s: s.replace("-2.0      0         3.0", "-2.0 0 3 1"), "channel FYW has 4 numbers after its unit"),
])  # fmt: skip
def test_malformed_files_are_refused_with_the_place(tdx, change, message):
    text = change(SWEEP)
    assert text != SWEEP
    refuses(message, read_recording, tdx(text))


def test_what_the_format_cannot_hold_is_refused(tmp_path, run):
    run.lateral_force[3] = 1e8
    refuses("FYW reaches 1e.08, too wide for its field", write_tydex, run, tmp_path / "a.tdx")
    refuses(r"must end in \.tdx", write_tydex, run, tmp_path / "a.txt")
    refuses("none.tdx: (cannot be read|no such)", read_recording, tmp_path / "none.tdx")


def test_channels_in_their_own_units_and_a_file_without_any(tdx):
    found = read_signals(tdx(SWEEP)).signals
    assert (found["FYW"].unit, found["FZW"].unit) == ("N", "kN")
    np.testing.assert_array_equal(found["MEASNUMB"].values, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(found["FZW"].values, [0.4, 0.401, 0.399])
    refuses("holds no channels", read_signals, tdx("**HEADER\n**MEASURDATA\n1 2\n**END"))
