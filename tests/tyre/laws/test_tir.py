"""Tyre property files: equations against hand computation, units, round trips, refusals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.shared.formula_tyres import tir_text
from tests.shared.refusals import refuses
from tyre.laws import Coefficients, fit_mf52, fit_mf61, parse_tir, read_tir, write_tir

# Made up for the test, of the size of a small racing tyre.
MF61 = tir_text({
    "FITTYP": 61, "NOMPRES": 97000, "FNOMIN": 2750, "FZMIN": 200, "FZMAX": 1600, "PRESMIN": 55000, "PRESMAX": 97000,
    "LATERAL_STIFFNESS": 100000, "PCFY1": 0.2, "PCFY2": -0.1, "PCFY3": 0.5, "PKY1": -19.0, "PKY2": 1.6, "PKY4": 2,
    "PPY1": 0.14, "PPY2": 0.9,
}).replace("= 61", "= 61 $ version") + "[SHAPE]\n{radial width}\n1.0 0.0\n1.0 0.4\n"  # fmt: skip
MF52 = """$ PAC2002
! : TYRE : Twenty-eight
! : SURFACE : drum
[UNITS]
LENGTH = 'mm'
FORCE = 'kn'
ANGLE = 'radian'
PRESSURE = 'bar'
[MODEL]
PROPERTY_FILE_FORMAT = 'PAC2002'
[DIMENSION]
UNLOADED_RADIUS = 336 $ R0
WIDTH =
[OPERATING_CONDITIONS]
INFLPRES = 5.5
[VERTICAL]
FNOMIN = 0.5
[SCALING_COEFFICIENTS]
LSGAL = 1.1
LKY = 0.9
[LATERAL_COEFFICIENTS]
PKY1 = -16.0
PKY2 = 1.2
PKY3 = 0.3
PTY1 = 0.4
PTY2 = 1.5
"""


def test_mf61_by_hand():
    found = parse_tir(MF61, source="a.tir").at(load=800.0, pressure=80e3)
    dpi, fz = (80e3 - 97e3) / 97e3, 800.0 / 2750.0
    # Pacejka (2012), eq. 4.E25 without camber: PKY1 Fz0 (1 + PPY1 dpi) sin{2 atan[Fz / (PKY2 (1 + PPY2 dpi) Fz0)]}
    stiffness = 19.0 * 2750.0 * (1 + 0.14 * dpi) * math.sin(2 * math.atan(fz / (1.6 * (1 + 0.9 * dpi))))
    dfz = fz - 1.0
    lateral = 1e5 * (1 + 0.2 * dfz - 0.1 * dfz**2) * (1 + 0.5 * dpi)
    assert (found.cornering_stiffness, found.lateral_stiffness) == pytest.approx((stiffness, lateral), rel=1e-13)
    assert found.relaxation_length == pytest.approx(stiffness / lateral, rel=1e-13)
    assert found.origin == "interpolated"
    assert not found.covariance.any()  # the format holds none, and none is assumed here
    assert any("states no uncertainty" in note for note in found.notes)


def test_mf52_by_hand_in_millimetres_and_kilonewtons():
    found = parse_tir(MF52, source="a.tir").at(load=400.0, pressure=5.5e5)
    stiffness = 0.9 * 16.0 * 500.0 * math.sin(2 * math.atan(400.0 / (1.2 * 500.0)))
    # sigma_alpha = PTY1 sin{2 atan[Fz / (PTY2 Fz0)]} R0 LSGAL, in metres
    sigma = 0.4 * math.sin(2 * math.atan(400.0 / (1.5 * 500.0))) * 0.336 * 1.1
    assert (found.cornering_stiffness, found.relaxation_length) == pytest.approx((stiffness, sigma), rel=1e-13)
    assert found.lateral_stiffness == pytest.approx(stiffness / sigma, rel=1e-13)
    assert (found.tyre, found.surface) == ("Twenty-eight", "drum")


def test_consistent_units_without_a_pressure_unit():
    # newton and millimetre: pressure in N/mm^2 = MPa, stiffness in N/mm
    text = MF61.replace("'meter'", "'mm'").replace("= 97000", "= 0.097").replace("= 55000", "= 0.055")
    text = text.replace("= 100000", "= 100")
    a = parse_tir(text, source="a.tir").at(load=800.0, pressure=80e3)
    b = parse_tir(MF61, source="a.tir").at(load=800.0, pressure=80e3)
    assert (a.cornering_stiffness, a.relaxation_length) == pytest.approx((b.cornering_stiffness, b.relaxation_length))
    assert a.inside


def test_old_files_without_relaxation_coefficients_fall_back_on_lateral_stiffness():
    text = MF52.replace("PTY1 = 0.4\n", "").replace("PTY2 = 1.5\n", "LATERAL_STIFFNESS = 0.05\n")
    found = parse_tir(text, source="a.tir").at(load=400.0, pressure=5.5e5)
    assert found.lateral_stiffness == pytest.approx(5e4)  # 0.05 kN/mm
    assert any("LATERAL_STIFFNESS gives the relaxation length" in note for note in found.notes)


LOAD, PRESSURE = (grid.ravel() for grid in np.meshgrid([340.0, 400.0, 490.0], [3.5e5, 5.5e5, 7.5e5]))


@settings(max_examples=30)
@given(
    pky1=st.floats(8.0, 30.0), pky2=st.floats(0.7, 2.5), ppy1=st.floats(-0.3, 0.3), ppy2=st.floats(-0.4, 0.4),
    lateral=st.floats(2e4, 2e5), pcfy1=st.floats(-0.3, 0.3), pcfy3=st.floats(-0.2, 0.8),
)  # fmt: skip
def test_fit_finds_the_stiffnesses_it_was_made_from(pky1, pky2, ppy1, ppy2, lateral, pcfy1, pcfy3):
    dpi, fz = PRESSURE / 5.5e5 - 1.0, LOAD / 415.0
    c = pky1 * 415.0 * (1 + ppy1 * dpi) * np.sin(2 * np.arctan(fz / (pky2 * (1 + ppy2 * dpi))))
    k = lateral * (1 + pcfy1 * (fz - 1)) * (1 + pcfy3 * dpi)
    model = fit_mf61(load=LOAD, pressure=PRESSURE, cornering_stiffness=c, lateral_stiffness=k)
    np.testing.assert_allclose(model.cornering_stiffness(load=LOAD, pressure=PRESSURE), c, rtol=1e-6)
    np.testing.assert_allclose(model.lateral_stiffness(load=LOAD, pressure=PRESSURE), k, rtol=1e-8)
    assert model["PKY1"] < 0.0


def test_mf61_round_trip(tmp_path):
    values = {"FNOMIN": 415.0, "NOMPRES": 5.5e5, "PKY1": -15.8, "PKY2": 1.25, "PPY1": 0.08, "PPY2": 0.3, "PCFY1": 0.17,
              "LATERAL_STIFFNESS": 5.4e4, "PCFY2": 0.03, "PCFY3": 0.6}  # fmt: skip
    model = Coefficients(values, "6.1", load_range=(340.0, 490.0), pressure_range=(3.5e5, 7.5e5))
    write_tir(model, tmp_path / "a.tir", tyre="T", surface="drum", unloaded_radius=0.336, notes=("synthetic",))
    back = read_tir(tmp_path / "a.tir")
    assert {name: back.coefficients[name] for name in values} == values
    assert (back.load_range, back.pressure_range) == (model.load_range, model.pressure_range)
    assert "! synthetic\n" in back.file.text
    assert (back.surface, back.file.sections["MODEL"]["FITTYP"]) == ("drum", 61)


def test_mf52_one_file_per_pressure(tmp_path):
    load, c, k = np.array([340.0, 400.0, 490.0]), np.array([6000.0, 6400.0, 6600.0]), np.array([5e4, 5.1e4, 5.2e4])
    model = fit_mf52(load=load, pressure=5.5e5, cornering_stiffness=c, lateral_stiffness=k, unloaded_radius=0.336)
    np.testing.assert_allclose(model.cornering_stiffness(load=load, pressure=5.5e5), c, rtol=0.01)
    np.testing.assert_allclose(model.lateral_stiffness(load=load, pressure=5.5e5), k, rtol=0.01)
    write_tir(model, tmp_path / "a.tir", tyre="T", surface="flat")
    back = read_tir(tmp_path / "a.tir")
    assert back.coefficients.old
    assert {name: back.coefficients[name] for name in model.values} == model.values
    refuses(r"holds one pressure, here 5\.5 bar; 3\.5 bar needs a file of its own", back.at, load=400.0, pressure=3.5e5)


def test_one_condition_is_enough_for_a_fit():
    model = fit_mf61(load=[400.0], pressure=[5e5], cornering_stiffness=[6000.0], lateral_stiffness=[5e4])
    assert model.cornering_stiffness(load=400.0, pressure=5e5) == pytest.approx(6000.0)
    assert model.lateral_stiffness(load=400.0, pressure=5e5) == pytest.approx(5e4)
    assert [model[name] for name in ("PPY1", "PPY2", "PCFY1", "PCFY2", "PCFY3")] == [0.0] * 5
    old = fit_mf52(
        load=[400.0], pressure=5e5, cornering_stiffness=[6000.0], lateral_stiffness=[5e4], unloaded_radius=0.3
    )
    assert old.lateral_stiffness(load=400.0, pressure=5e5) == pytest.approx(5e4)


@pytest.mark.parametrize(("text", "message"), [
    (MF61.replace("PKY1", "PKYY1"), "PKY1 is missing; did you mean 'PKYY1'"),
    (MF61.replace("-19.0", "abc"), "PKY1 is 'abc', not a number"),
    (MF61.replace("-19.0", "9" * 400), r"PKY1 is .99+\.\.\., not a number"),
    (MF61.replace("1.6", "-1"), "PKY2 = -1 must be positive"),
    (MF61.replace("1.6", "1e-308"), "PKY2 = 1e-308 must be positive, 1e-12 to 1e"),
    (MF61.replace("PKY2 =", "PKY6 = -1e308\nPKY2 ="), r"PKY6 = -1e\+308 must be a number up to 1e\+12 in size"),
    (MF61.replace("61 $", "70 $"), r"FITTYP or PROPERTY_FILE_FORMAT = 70.0 is neither MF-Tyre 5.2"),
    (MF61.replace("'newton'", "'stone'"), r"\[UNITS\] FORCE: unit 'stone' is not a unit of force"),
    (MF61.replace("'radians'", "'degrees'"), "ANGLE = 'degrees'; only coefficients in radians"),
    (MF61.replace("97000", "97"), "NOMPRES is 97 Pa, tyres have"),
    (MF61.replace("PPY2", "PPY1"), "line 21: PPY1 is given twice in its section"),
    (MF61.replace("[UNITS]\n", ""), "line 1: .* comes before the first .SECTION."),
    (MF61 + "= nonsense here\n", "'= nonsense here' is no section, assignment"),
    (MF61.replace("0.5", "50"), "the coefficients give a lateral stiffness of .* which is not physical; stay nearer"),
    ("", "has no .SECTION."),
])  # fmt: skip
def test_malformed_files_are_refused(text, message):
    refuses(message, lambda: parse_tir(text, source="a.tir").at(load=800.0, pressure=55e3))


def test_wrong_calls_are_refused(tmp_path):
    model = parse_tir(MF61, source="a.tir").coefficients
    words = {"tyre": "T", "surface": "flat", "unloaded_radius": 0.3}
    refuses(r"must end in \.tir", write_tir, model, tmp_path / "a.txt", **words)
    refuses("unloaded radius .* is needed", write_tir, model, tmp_path / "a.tir", tyre="T", surface="flat")
    wrong = parse_tir(MF61.replace("= -19", "= 19"), source="a.tir").coefficients
    refuses("must be negative in the ISO signs", write_tir, wrong, tmp_path / "a.tir", **words)
    refuses("cannot be read", read_tir, tmp_path / "none.tir")
