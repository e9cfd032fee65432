"""Whole curves and models of .tir files against the equations of the books, written out here apart from velotyre."""

import math

import numpy as np
import pytest

from tests.shared.formula_tyres import UNITS
from tests.shared.refusals import refuses
from tyre import InputError
from tyre.laws import parse_tir

# made up, of the size of a bicycle's tyre; every coefficient of 6.1 that lateral force and aligning moment have, no
# shifts
MF61 = {
    "UNLOADED_RADIUS": 0.34, "LATERAL_STIFFNESS": 55000,
    "FITTYP": 61, "NOMPRES": 4e5, "PRESMIN": 2e5, "PRESMAX": 7e5, "FZMIN": 100, "FZMAX": 900, "FNOMIN": 400,
    "LMUY": 0.95, "LKY": 1.05, "LTR": 1.1, "LKYC": 0.9, "LKZC": 1.2, "PCY1": 1.3, "PDY1": 0.9, "PDY2": -0.1,
    "PDY3": 1, "PEY1": -0.5, "PEY2": 0.1, "PEY3": 0.05, "PEY4": 0.1, "PEY5": 0.2, "PKY1": -20, "PKY2": 1.6,
    "PKY3": 0.4, "PKY4": 2.1, "PKY5": 0.3, "PKY6": -0.9, "PKY7": -0.15, "PVY3": -0.6, "PVY4": -0.1, "PPY1": 0.15,
    "PPY2": 0.4, "PPY3": -0.05, "PPY4": 0.02, "PPY5": -0.1, "QBZ1": 9, "QBZ2": -1, "QBZ4": 0.1, "QBZ5": -0.1,
    "QBZ9": 18, "QBZ10": 0.1, "QCZ1": 1.2, "QDZ1": 0.05, "QDZ2": -0.01, "QDZ3": 0.1, "QDZ8": -0.012, "QDZ9": -0.002,
    "QDZ10": 0.003, "QEZ1": -1.5, "QEZ4": 0.1, "QEZ5": -0.2, "QHZ3": 0.02, "PPZ1": 0.3, "PPZ2": 0.2,
}  # fmt: skip
OLD = {"FITTYP": 5, "UNLOADED_RADIUS": 0.336, "INFLPRES": 5e5, "FNOMIN": 450, "PKY1": -17, "PKY2": 1.8}


def tyre(values, *, text="", **choice):
    lines = [f"{name} = {value!r} $ {name.lower()}" for name, value in values.items()]
    found = parse_tir(UNITS + text + "[MODEL]\n" + "\n".join(lines) + "\n", source="a.tir")
    return type(found)(found.file, **choice)


def curve(bx, c, e):
    return c * math.atan(bx - e * (bx - math.atan(bx)))


def mf61_by_hand(slip, camber, fz, p, *, software=True):
    """Pacejka (2012), 4.E19 to 4.E49, in ISO axes: lateral force and aligning moment."""
    k = dict.fromkeys(("LCY", "LEY", "LHY", "LVY", "LRES", "LFZO"), 1.0) | MF61
    dfz, dpi, ga, al = fz / 400 - 1, p / 4e5 - 1, math.sin(camber), math.tan(slip)

    def force(g):
        kya = k["PKY1"] * 400 * (1 + k["PPY1"] * dpi) * (1 - k["PKY3"] * abs(g)) * k["LKY"]
        kya *= math.sin(k["PKY4"] * math.atan(fz / 400 / ((k["PKY2"] + k["PKY5"] * g * g) * (1 + k["PPY2"] * dpi))))
        sv = fz * (k["PVY3"] + k["PVY4"] * dfz) * g * k["LKYC"] * k["LMUY"]
        kyg = fz * (k["PKY6"] + k["PKY7"] * dfz) * (1 + k["PPY5"] * dpi) * k["LKYC"]
        sh = (kyg * g - sv) / kya
        mu = (k["PDY1"] + k["PDY2"] * dfz) * (1 + k["PPY3"] * dpi + k["PPY4"] * dpi**2) * (1 - k["PDY3"] * g * g)
        d = mu * k["LMUY"] * fz
        sign = math.copysign(1, al + sh) if al + sh else 0
        e = (k["PEY1"] + k["PEY2"] * dfz) * (1 + k["PEY5"] * g * g - (k["PEY3"] + k["PEY4"] * g) * sign)
        b = kya / (k["PCY1"] * d)
        return d * math.sin(curve(b * (al + sh), k["PCY1"], min(e, 1))) + sv, b, al + sh + sv / kya

    whole, b, ar = force(ga)
    at, ratio = al + k["QHZ3"] * ga, k["LKY"] / k["LMUY"]
    bt = (k["QBZ1"] + k["QBZ2"] * dfz) * (1 + k["QBZ4"] * ga + k["QBZ5"] * abs(ga)) * ratio
    dt = fz * (k["QDZ1"] + k["QDZ2"] * dfz) * (1 - k["PPZ1"] * dpi) * (1 + k["QDZ3"] * ga) * 0.34 / 400 * k["LTR"]
    et = k["QEZ1"] * (1 + (k["QEZ4"] + k["QEZ5"] * ga) * 2 / math.pi * math.atan(bt * k["QCZ1"] * at))
    trail = dt * math.cos(curve(bt * at, k["QCZ1"], min(et, 1))) * math.cos(slip)
    by_camber = (k["QDZ8"] + k["QDZ9"] * dfz) * (1 + k["PPZ2"] * dpi) + k["QDZ10"] * abs(ga)
    dr = fz * 0.34 * by_camber * ga * k["LKZC"] * k["LMUY"] * math.cos(slip)
    br = k["QBZ9"] * ratio + k["QBZ10"] * b * k["PCY1"]
    return whole, -trail * (force(0.0)[0] if software else whole) + dr * math.cos(math.atan(br * ar))


@pytest.mark.parametrize("convention", ["software", "book"])
def test_curves_of_mf61_by_hand_and_their_slopes(convention):
    rng, found = np.random.default_rng(3), tyre(MF61, camber_moment=convention)
    for _ in range(40):
        slip, camber, fz, p = rng.uniform([-0.2, -0.5, 150, 2.2e5], [0.2, 0.5, 850, 6.8e5]).tolist()
        force, moment = mf61_by_hand(slip, camber, fz, p, software=convention == "software")
        at = {"slip_angle": slip, "camber": camber, "load": fz, "pressure": p}
        assert found.lateral_force(**at) == pytest.approx(-force, rel=1e-12)
        assert found.aligning_moment(**at) == pytest.approx(-moment, rel=1e-11, abs=1e-12)
        here, h, at = found.at(load=fz, pressure=p), 1e-6, {"load": fz, "pressure": p}
        for name, angle, expected in (
            ("lateral_force", "slip_angle", here.cornering_stiffness),
            ("lateral_force", "camber", here.camber_stiffness),
            ("aligning_moment", "slip_angle", -here.aligning_stiffness),
            ("aligning_moment", "camber", here.twisting_stiffness - here.pneumatic_trail * here.camber_stiffness),
        ):
            up, down = (float(getattr(found, name)(**{"slip_angle": 0.0, angle: x}, **at)) for x in (h, -h))
            assert (up - down) / (2 * h) == pytest.approx(expected, rel=1e-5)


def test_curve_of_mf52_by_hand():
    """Pacejka (2006), 4.E19 to 4.E49, in ISO axes, with shifts."""
    k = OLD | {"PCY1": 1.4, "PDY1": 1.05, "PDY2": -0.2, "PDY3": 0.5, "PEY1": -0.8, "PEY2": 0.3, "PEY3": 0.1,
               "PKY3": 0.2, "PHY1": 0.002, "PHY3": 0.03, "PVY1": 0.01, "PVY3": -0.3, "QBZ1": 8.0, "QBZ9": 12.0,
               "QCZ1": 1.1, "QDZ1": 0.05, "QDZ8": -0.02, "QHZ1": -0.001, "QEZ1": -1.0}  # fmt: skip
    slip, g, fz = 0.04, -0.15, 380.0
    dfz = fz / 450 - 1
    kya = -17 * 450 * math.sin(2 * math.atan(fz / (1.8 * 450))) * (1 - 0.2 * abs(g))
    sh, sv = 0.002 + 0.03 * g, fz * (0.01 - 0.3 * g)
    d = (1.05 - 0.2 * dfz) * (1 - 0.5 * g * g) * fz
    e = (-0.8 + 0.3 * dfz) * (1 - 0.1)
    force = d * math.sin(curve(kya / (1.4 * d) * (slip + sh), 1.4, e)) + sv
    at = slip - 0.001
    trail = fz * 0.05 * 0.336 / 450 * math.cos(curve(8.0 * at, 1.1, -1.0)) * math.cos(slip)
    residual = fz * 0.336 * -0.02 * g * math.cos(math.atan(12.0 * (slip + sh + sv / kya))) * math.cos(slip)
    found, where = tyre(k), {"slip_angle": slip, "camber": g, "load": fz, "pressure": 5e5}
    assert found.lateral_force(**where) == pytest.approx(-force, rel=1e-12)
    assert found.aligning_moment(**where) == pytest.approx(-(residual - trail * force), rel=1e-12)


def test_shifts_are_told_where_they_matter():
    """C at zero slip of a curve shifted by 0.01: its slope there, by differences."""
    values = OLD | {"PCY1": 1.4, "PDY1": 1.0, "PEY1": -1.0}
    steps = [
        math.sin(curve(17 * math.sin(2 * math.atan(1 / 1.8)) / 1.4 * (0.01 + h), 1.4, -1.0)) for h in (1e-6, -1e-6)
    ]
    change = (steps[0] - steps[1]) / 2e-6 / (17 * math.sin(2 * math.atan(1 / 1.8))) - 1
    (told,) = (note for note in tyre(values | {"PHY1": 0.01}).notes if "shifts" in note)
    assert told == f"its shifts of the curve are left out; with them cornering stiffness {100 * change:+.1f} %"
    assert not any("shifts" in note for note in tyre(values | {"PHY1": 1e-4}).notes)


# 120/70 ZR17 of Pacejka (2006), table 11.1 in part
MOTORCYCLE = {"FNOMIN": 1475, "PCY1": 0.9, "PCY2": 0.8, "PDY1": 1.3, "PKY1": 26.601, "PKY2": 1.0167, "PKY3": 1.4989,
              "PKY6": 0.77, "PKY7": 0.1, "PEY5": -2.0}  # fmt: skip


@pytest.mark.parametrize("name", [{}, {"FITTYP": 52}, {"PROPERTY_FILE_FORMAT": "PAC_MC"}, {"FITTYP": "MF-MCTyre"}])
def test_a_motorcycle_tyre_has_its_own_law_under_any_name(name):
    """K = pKy1 Fz0 sin[pKy2 atan(Fz / (pKy3 Fz0))]: 22095 N/rad, where 5.2 has 39231; camber inside the formula."""
    found = tyre(name | MOTORCYCLE)
    assert found.at(load=1475.0, pressure=math.nan).cornering_stiffness == pytest.approx(22095, abs=2)
    slip, g, fz = -0.05, 0.4, 1200.0
    k = 26.601 * 1475 * math.sin(1.0167 * math.atan(fz / (1.4989 * 1475)))
    d, kg = 1.3 * fz, (0.77 + 0.1 * (fz / 1475 - 1)) * fz
    force = d * math.sin(curve(k / (0.9 * d) * slip, 0.9, 0.0) + curve(kg / (0.8 * d) * g, 0.8, -2.0))
    assert found.lateral_force(slip_angle=slip, camber=g, load=fz, pressure=math.nan) == pytest.approx(force, rel=1e-12)
    assert found.at(load=fz, pressure=math.nan).camber_stiffness == pytest.approx(kg, rel=1e-12)


def test_a_camber_stiffness_of_the_other_sign_than_the_slip_is_told_when_listed():
    """PKY1 in ISO signs, PKY6 in those of the book: at 1475 N 0.77 * 1475 N/rad out of the lean."""
    found = tyre(MOTORCYCLE | {"PKY1": -26.601})
    words = "camber stiffness is negative, -1136 N/rad at 1475 N: no effect takes it; is its sign in the source"
    assert any(note.startswith(words) for note in found.notes)
    assert not any("negative" in note for note in tyre(MOTORCYCLE).notes)
    both = tyre(MOTORCYCLE | {"PKY1": -26.601, "PKY6": -0.77, "PKY7": -0.1})
    assert not any("negative" in note for note in both.notes)
    assert both.at(load=1475.0, pressure=math.nan).camber_stiffness == pytest.approx(0.77 * 1475)


def test_pac2002_over_pressure():
    """Form of the data of Project Chrono (IP, IP_NOM, PPY1, PPY2); C at 450 N by its formula, ChPac02Tire.cpp."""
    pressures = {"IP": 4e5, "IP_NOM": 5e5, "PPY1": 0.5, "PPY2": 0.3}
    values = OLD | {"FITTYP": "PAC2002", "PTY1": 0.6, "PTY2": 2.0} | pressures
    del values["INFLPRES"]
    found = tyre(values)
    for bar, stiffness in ((3, 5525.2), (4, 6031.5), (5, 6495.3), (6, 6919.9)):
        assert found.at(load=450.0, pressure=bar * 1e5).cornering_stiffness == pytest.approx(stiffness, abs=0.06)
    assert found.pressures.tolist() == [4e5, 5e5]
    assert found.default_pressure is None
    del values["IP_NOM"]  # without a nominal pressure the terms say nothing
    assert any("not used of the file: PPY1, PPY2" in note for note in tyre(values).notes)


WRAPPED = """[OPERATING_CONDITIONS]
NOMPRES = 500000 $Nominal pressure -NEVER
MODIFY THIS PARAMETER
[SHAPE]
{radial width}
1.0 0.0
"""
SMALL = {"PROPERTY_FILE_FORMAT": "PAC2002", "UNLOADED_RADIUS": 0.3, "FNOMIN": 500, "PKY1": -14, "PKY2": 2.0,
         "PTY1": 0.4, "PTY2": 2.0}  # fmt: skip


def test_files_that_others_write():
    """Wrapped comments, no pressure, zeros that were not fitted; 14 * 500 sin(2 atan 1/2) = 5600 N/rad at 500 N."""
    said = tyre(SMALL, text="! : COMMENT : Infl. pressure (Pa) 190000\n")
    assert "the file states no pressure; a comment states 'Infl. pressure (Pa) 190000'" in said.notes
    assert "the file states no pressure" in tyre(SMALL).notes
    wrapped = tyre(SMALL, text=WRAPPED)
    assert wrapped.at(load=500.0, pressure=5e5).cornering_stiffness == pytest.approx(5600.0, rel=1e-12)
    assert any("line 7 'MODIFY THIS PARAMETER'" in note for note in wrapped.notes)
    rest = {key: value for key, value in SMALL.items() if key not in ("PKY1", "PTY1")}
    fortran = tyre(
        rest, text="[LATERAL]\nPKY1 = -1.4D+01\nPTY1 = 4.0d-1 $ of R0\n[SHAPE]\n{radial width}\n 1.D0 0.4D+0\n"
    )
    assert fortran.at(load=500.0, pressure=5e5).cornering_stiffness == pytest.approx(5600.0, rel=1e-12)
    assert not any("passed over" in note for note in fortran.notes)
    free = tyre(SMALL)
    assert (free.pressures.size, math.isnan(free.default_pressure)) == (0, True)
    for pressure in (free.default_pressure, 3e5):
        here = free.at(load=500.0, pressure=pressure)
        assert here.cornering_stiffness == pytest.approx(5600.0, rel=1e-12)
        assert here.relaxation_length == pytest.approx(0.4 * 0.8 * 0.3, rel=1e-12)
    assert wrapped.default_pressure == 5e5
    assert wrapped.at(load=500.0).pressure == 5e5
    refuses("give a pressure .Pa., 100-900 N and 2-7 bar for which a on flat", tyre(MF61).at, load=500.0)
    zero = tyre(OLD | {"PTY1": 0.0, "PTY2": 0.0}).at(load=450.0, pressure=5e5)
    assert zero.cornering_stiffness == pytest.approx(6495.3, abs=0.06)
    assert math.isnan(zero.relaxation_length)


def test_a_number_that_the_law_of_a_file_does_not_use_may_be_missing():
    """6.1 without a term of pressure needs no nominal pressure, the slope of a motorcycle tyre no PCY2."""
    without = {key: value for key, value in MF61.items() if key[:2] != "PP" and key not in ("NOMPRES", "PCFY3")}
    here = tyre(without).at(load=450.0, pressure=5e5)
    stiffness = 20 * 400 * math.sin(2.1 * math.atan(450 / 400 / 1.6)) * 1.05
    assert here.cornering_stiffness == pytest.approx(stiffness, rel=1e-12)
    assert here.lateral_stiffness == pytest.approx(55000, rel=1e-12)
    refuses("NOMPRES is missing", tyre, without | {"PPY1": 0.2})
    slope = {key: value for key, value in MOTORCYCLE.items() if key != "PCY2"} | {"PROPERTY_FILE_FORMAT": "PAC_MC"}
    assert tyre(slope).at(load=1475.0, pressure=math.nan).cornering_stiffness == pytest.approx(22095, abs=2)
    refuses("holds no curve of the lateral force .PCY1, PDY1, PCY2., only its slope", tyre(slope).lateral_force,
            slip_angle=0.1, load=1200.0, pressure=math.nan)  # fmt: skip


@pytest.mark.parametrize(("values", "words"), [
    (MF61 | {"PCY2": 0.8}, "PCY2 is of a motorcycle tyre, FITTYP = 61 is not; correct one"),
    (OLD | {"PKY6": -0.9}, r"PKY6 is no coefficient of MF-Tyre 5\.2 \(5\.0\); write FITTYP = 61"),
    ({"FITTYP": "PAC_MC"} | OLD | {"FITTYP": "PAC_MC"}, "PKY3 is missing"),
])  # fmt: skip
def test_models_that_contradict_their_coefficients(values, words):
    refuses(words, tyre, values)


def test_what_is_not_held_or_not_known_is_refused():
    with pytest.raises(
        InputError, match=r"a\.tir: it holds no curve of the lateral force \(PCY1, PDY1\), only its slope"
    ):
        tyre(OLD).lateral_force(slip_angle=0.1, load=400.0, pressure=5e5)
    with pytest.raises(InputError, match=r"a\.tir: it holds no aligning moment"):
        tyre(MOTORCYCLE).aligning_moment(slip_angle=0.1, load=400.0, pressure=5e5)
    refuses("camber_moment = 'sae' must be 'software' or 'book'", tyre, MF61, camber_moment="sae")
    told = tyre(MF61 | {"QSX3": 0.1, "PTY1": 2.0}).notes
    assert any("not used of the file: QSX3, PTY1" in note for note in told)
