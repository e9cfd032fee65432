"""Pacejka-89: formula against its own derivative and hand computation, ranges, sanity checks, file format."""

import json
import math
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import loadmat, savemat

from tests.shared.refusals import refuses
from tyre import InputError, read_tyre
from tyre.formats import child
from tyre.laws import Pacejka89, check_coefficients, read_pacejka89

# A made-up but sound tyre: no shifts, no camber, 100 N/deg at the load of the largest slope.
LATERAL = (1.3, 0.0, 1000.0, 100.0, 0.5, 0.0, 0.0, -1.0, 0.05, 0.0, 0.0, 5.0, 0.0, 0.0)
ALIGNING = (2.2, 0.0, 10.0, 0.0, -4.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
FIT = Pacejka89("made-up", 4e5, 1000.0, LATERAL, ALIGNING)


def test_lateral_force_by_hand():
    # 500 N: BCD = 100 sin(2 atan(0.5/0.5)) = 100 N/deg, D = 500 N, B = 100 / (1.3 * 500) per deg, E = -1
    b = 100.0 / 650.0
    x = 2.0 * b
    expected = 500.0 * np.sin(1.3 * np.arctan(x + (x - np.arctan(x))))
    assert FIT.lateral_force(slip_angle=np.deg2rad(2.0), load=500.0) == pytest.approx(expected, rel=1e-13)
    held = FIT.linear(load=500.0)
    assert held["cornering_stiffness"] == pytest.approx(100.0 * 180.0 / np.pi, rel=1e-13)
    assert held["pneumatic_trail"] == pytest.approx(0.02, rel=1e-13)
    # camber: shift of 0.05 deg per deg at 100 N/deg, and 5 N/deg per kN
    assert held["camber_stiffness"] == pytest.approx((100.0 * 0.05 + 2.5) * 180.0 / np.pi, rel=1e-13)


def test_slip_in_radians_is_the_same_formula():
    deg = np.pi / 180.0
    lateral = list(LATERAL)
    lateral[3] /= deg  # N/deg -> N/rad
    lateral[8] *= deg  # shift of slip
    rad = replace(FIT, lateral_force_coefficients=tuple(lateral), slip_unit="rad")
    slip = np.linspace(-0.1, 0.1, 7)
    np.testing.assert_allclose(
        rad.lateral_force(slip_angle=slip, load=400.0, camber=0.1),
        FIT.lateral_force(slip_angle=slip, load=400.0, camber=0.1),
    )
    one, other = (fit.linear(load=400.0)["cornering_stiffness"] for fit in (rad, FIT))
    assert one == pytest.approx(other)


@pytest.mark.parametrize("load", [0.0, -100.0, 1001.0, np.nan])
def test_loads_beyond_the_fit_are_refused(load):
    refuses("is outside of the fit, which holds above 0 and up to 1000 N", FIT.lateral_force, slip_angle=0.0, load=load)


def coefficients(position, value, which=LATERAL):
    return tuple(value if index == position else number for index, number in enumerate(which))


@pytest.mark.parametrize(("change", "message"), [
    ({"lateral_force_coefficients": coefficients(3, 8000.0)}, "cornering stiffness at 200 N is 5517 N/deg"),
    ({"lateral_force_coefficients": coefficients(3, -100.0)}, "cornering stiffness at 200 N is -68.97 N/deg"),
    ({"lateral_force_coefficients": coefficients(13, 900.0)}, "its sign must follow the slip"),
    ({"lateral_force_coefficients": coefficients(2, 1600.0, coefficients(0, 2.0))}, "times the load, allowed is 1.5"),
    ({"aligning_moment_coefficients": coefficients(4, 4.0, ALIGNING)}, "pneumatic trail at 200 N is -11.6 mm"),
])  # fmt: skip
def test_unsound_coefficients_are_refused(change, message):
    check_coefficients(FIT)
    refuses(message, check_coefficients, replace(FIT, **change))


def test_curves_beyond_the_pressures_are_refused():
    tyre = read_pacejka89("schwalbe_energizer_plus_28x1.75")
    assert float(tyre.aligning_moment(slip_angle=0.01, load=400.0, pressure=5e5)) < 0.0
    with pytest.raises(InputError, match="pressure 5.5 bar is outside of the fitted 3 to 5 bar"):
        tyre.lateral_force(slip_angle=0.0, load=400.0, pressure=5.5e5)


@pytest.mark.parametrize("camber", [-0.06, 0.0, 0.11])
@pytest.mark.parametrize("slip", [-0.05, 0.0, 0.03])
def test_the_moment_of_a_leaning_tyre_by_the_formula(slip, camber):
    """Bakker, Pacejka & Lidner (1989), SAE 890087, eqs. of M_z with camber, written out; load in kN, angles in deg."""
    c = (2.3, -1.1, 6.5, -0.8, -3.2, 0.12, 0.031, 0.07, -0.24, -2.1, 0.023, 0.041, -0.06, 0.21, -0.017, 0.29, 0.4, -0.9)
    fit, fz, x, g = replace(FIT, aligning_moment_coefficients=c), 0.45, np.degrees(slip), np.degrees(camber)
    d = c[1] * fz**2 + c[2] * fz
    b = (c[3] * fz**2 + c[4] * fz) * (1 - c[6] * abs(g)) * np.exp(-c[5] * fz) / (c[0] * d)
    e = (c[7] * fz**2 + c[8] * fz + c[9]) * (1 - c[10] * abs(g))
    x = x + c[11] * g + c[12] * fz + c[13]
    phi = (1 - e) * x + e / b * np.arctan(b * x)
    moment = d * np.sin(c[0] * np.arctan(b * phi)) + (c[14] * fz**2 + c[15] * fz) * g + c[16] * fz + c[17]
    assert fit.aligning_moment(slip_angle=slip, load=450.0, camber=camber) == pytest.approx(moment, rel=1e-12)


def test_a_coefficient_that_is_no_number_is_refused():
    for value in (np.nan, np.inf, -2e12):
        with pytest.raises(InputError, match=r"a3 = .* must be a number up to 1e\+12 in size"):
            replace(FIT, lateral_force_coefficients=(*LATERAL[:3], value, *LATERAL[4:]))


def test_a_pressure_that_no_float_holds_is_refused(tmp_path):
    (tmp_path / "a.json").write_text('{"set": [{"pressure_bar": 1' + 400 * "0" + "}]}")
    with pytest.raises(InputError, match="a.json: "):
        read_tyre(tmp_path / "a.json")


def test_coefficients_that_make_no_number_are_refused_without_a_warning():
    with pytest.raises(InputError, match="the fit is not usable"):
        check_coefficients(replace(FIT, lateral_force_coefficients=(*LATERAL[:4], 0.0, *LATERAL[5:])))


SETS = read_pacejka89("schwalbe_energizer_plus_28x1.75").sets
FY, MZ = (list(one) for one in (SETS[0].lateral_force_coefficients, SETS[0].aligning_moment_coefficients or ()))
OLDER = json.loads((Path(__file__).parents[2] / "published" / "data" / "schwalbe_t03_older_fits.json").read_text())[
    "sets"
]
# N/rad at 300, 400, 500, 600 N, evaluated apart from velotyre for the three sets (300, 400, 500 kPa)
SLOPES = {3e5: (4870, 5878, 6549, 6937), 4e5: (4419, 5848, 7235, 8565), 5e5: (4563, 5403, 5901, 6134)}
LOADS = (300.0, 400.0, 500.0, 600.0)


def slopes_of(tyre, pressure):
    return tyre.linear(load=np.array(LOADS), pressure=np.full(4, pressure))["cornering_stiffness"]


def put(tmp_path, name, content):
    path = tmp_path / name
    if isinstance(content, str):
        path.write_text(content, encoding="utf-8")
    elif path.suffix == ".mat":
        savemat(path, content)
    elif path.suffix == ".json":
        path.write_text(json.dumps(content))
    else:
        path.write_text(yaml.safe_dump(content))
    return path


ROLES = {"OptParameterMF_Fy": FY, "OptParameterMF_Mz": MZ}
NAMED = {f"a{n}": value for n, value in enumerate(FY)} | {f"c{n}": value for n, value in enumerate(MZ)}
ONE = [
    ("OptParameterMF_T03R01_camber0_p300.mat", {"OptParameterMF": {k: np.array(v) for k, v in ROLES.items()}}, True),
    ("flat.mat", {k: np.array([v]) for k, v in ROLES.items()} | {"pressure_kPa": 300.0, "slip_unit": "deg"}, True),
    ("write.yaml", ROLES | {"pressure_kPa": 300}, True),
    ("nested.yml", {"SchwalbeT03_300kPa": {"Fy_coef": FY, "Mz_coef": MZ, "pressure_kPa": 300}}, True),
    ("bare_p300.json", FY, False),
    ("psi.json", {"lateral_force": FY, "pressure_psi": 43.511321319062764}, False),
    ("named.json", NAMED | {"pressure_bar": 3}, True),
    ("split.json", {"a111": FY[11], "a112": 0} | {k.upper(): v for k, v in NAMED.items() if k != "a11"}
     | {"pressure_bar": 3}, True),
    ("row_p300.yaml", {role: [values] for role, values in ROLES.items()}, True),
    ("column_p300.yaml", {role: [[value] for value in values] for role, values in ROLES.items()}, True),
    ("java_p300.yaml", f"Fy: {[f'{x:.17E}' for x in FY]}\nMz: [{', '.join(f'{x:.17E}' for x in MZ)}]\n"
     .replace("E+0", "E").replace("'", ""), True),
    ("workspace_p300.mat", {k: np.array(v)[:, None] for k, v in ROLES.items()} | {"data": {"Fy": np.ones(50)}}, True),
    ("named.toml", "".join(f"{k} = {v!r}\n" for k, v in NAMED.items()) + "pressure_kPa = 300\n", True),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "moment"), ONE, ids=[name for name, *_ in ONE])
def test_every_form_gives_the_same_slopes(tmp_path, name, content, moment):
    found = read_tyre(put(tmp_path, name, content))
    assert found.pressures.tolist() == pytest.approx([3e5], rel=1e-14)
    np.testing.assert_allclose(slopes_of(found, found.pressures[0]), SLOPES[3e5], atol=0.51)
    assert found.sets[0].lateral_force_coefficients == tuple(FY)
    assert found.sets[0].aligning_moment_coefficients == (tuple(MZ) if moment else None)


@pytest.mark.parametrize("ending", ["json", "yaml"])
def test_sets_at_several_pressures(tmp_path, ending):
    content = {"tyre": "T", "load_max_N": 1000, "surface": "flat", "slip_unit": "deg", "sets": [
        {"pressure_kPa": p, "Fy": list(s.lateral_force_coefficients), "Mz": list(s.aligning_moment_coefficients)}
        for p, s in zip([300, 400, 500], SETS, strict=True)
    ]}  # fmt: skip
    found = read_tyre(put(tmp_path, f"t.{ending}", content))
    for pressure, slopes in SLOPES.items():
        np.testing.assert_allclose(slopes_of(found, pressure), slopes, atol=0.51)
    assert (found.tyre, found.load_range) == ("T", (0.0, 1000.0))


def test_what_is_not_stated_is_told(tmp_path):
    found = read_tyre(put(tmp_path, "T03_p300.json", FY))
    assert (found.tyre, found.surface, found.sets[0].pressure) == ("T03_p300", "flat", 3e5)
    assert [key for key in ("load_max_N", "slip_unit", "surface") if not any(key in note for note in found.notes)] == []
    mat = put(tmp_path, "w_p300.mat", {"OptParameterMF_Fy": np.array(FY), "sse_Fy": 3.0, "S": {"camber": 0.0}})
    assert read_tyre(mat).notes[0] == "not used of w_p300.mat: S, sse_Fy"


def test_notes_of_the_file_are_kept(tmp_path):
    said = {"Fy": FY, "pressure_bar": 3, "surface": "flat", "slip_unit": "deg", "load_max_N": 900}
    assert read_tyre(put(tmp_path, "n.json", said | {"note": "synthetic"})).synthetic
    assert read_tyre(put(tmp_path, "m.yaml", said | {"note": ["one", "two"]})).notes == ("one", "two")


def older(**what):
    return next(e["coefficients"] for e in OLDER if all(e[key] == value for key, value in what.items()))


def test_slip_in_radians(tmp_path):
    coefficients = older(slip_unit="rad", quantity="lateral_force")
    found = read_tyre(put(tmp_path, "b_p300.json", {"Fy": coefficients, "slip_unit": "rad"}))
    # an older fit of the same measurements: its slope at 400 N is that of the later one, 5878 N/rad, to a tenth
    assert found.at(load=400.0, pressure=3e5).cornering_stiffness == pytest.approx(5878, rel=0.1)
    with pytest.raises(InputError, match="with slip in rad it would be one: write slip_unit = rad"):
        read_tyre(put(tmp_path, "u_p300.json", coefficients))


def test_odd_coefficients_are_told(tmp_path):
    coefficients = older(label="values from OptPar_deg", quantity="lateral_force")
    notes = read_tyre(put(tmp_path, "o_p300.json", {"Fy": coefficients})).notes
    # C is its first number; D(0.4 kN) = (3896.99 0.4^2 + 3964.31 0.4) N
    assert "C = 0.2963 (usual 0.5 to 4), D = 5.523 times the load at 400 N" in " ".join(notes)


def test_an_aborted_fit_is_refused(tmp_path):
    old = next(e for e in OLDER if "still need refinements" in e["label"])
    with pytest.raises(InputError, match="cornering stiffness at 200 N is 2729 N/deg"):
        read_tyre(put(tmp_path, "b.json", {"Fy": old["coefficients"], "pressure_kPa": 300}))


@pytest.mark.parametrize(("name", "content", "words"), [
    ("a.json", FY, "no pressure; write pressure_kPa = 300"),
    ("a_p300.json", FY[:-1], "must be a list of 14 numbers"),
    ("a_p300.json", {"Fy": MZ}, "lateral_force = .* must be a list of 14 numbers"),
    ("a_p300.json", {"Fy": FY, "Mz": FY}, "aligning_moment = .* must be a list of 18 numbers"),
    ("a_p300.json", {"Fx": FY}, "unknown key 'Fx'"),
    ("a_p300.json", {"Name": "x", "Lateral Coefficients": {"a0": 1.3}}, "is of a tyre file of Chrono, which states no"),
    ("a_p300.json", {k: v for k, v in NAMED.items() if k != "a9"}, "a_p300.json: a9 is missing; give a0 to a13"),
    ("a_p300.json", NAMED | {"a14": 1}, "unknown key 'a14'; known: a0 to a13"),
    ("a_p300.json", NAMED | {"a111": 1, "a112": 2}, "a11 and a111 are both given; keep a111 with a112, or a11 alone"),
    ("a_p300.json", {k: v for k, v in NAMED.items() if k != "a11"} | {"a112": 2}, "a11 is missing"),
    ("a_p300.json", {"Fy": FY, "slip_unit": "grad"}, "slip_unit = 'grad' is neither 'deg' nor 'rad'"),
    ("a_p300.json", {"Fy": FY, "surface": "ice"}, "surface = 'ice' must be 'flat' or 'drum'"),
    ("a_p300.json", {"Fy": FY, "pressure_kPa": -1}, "pressure_kPa = -1.* must be a finite number above 0"),
    ("a_p300.json", {"Fy": [*FY[:-1], "x"]}, "must be a list of 14 numbers"),
    ("a_p300.json", 3, "must be a table"), ("a_p300.json", {}, "no coefficients found"),
    ("a_p300.json", "{", "not a JSON file"), ("a_p300.json", "[" * 100_000, "not a JSON file"),
    ("a_p300.yaml", "[" * 5_000, "not a YAML file"),
    ("a_p300.json", f'{{"Fy": {"[" * 900}{"]" * 900}}}', "lists or tables are more than 50 deep"),
    ("a_p300.yaml", "Fy: &a [1, *a]", "lists or tables are more than 50 deep"),
    ("a_p300.yaml", "a: [", "not a YAML file"), ("a_p300.mat", "text", "cannot be read as .mat"),
    ("a.json", {"set": [{"pressure_kPa": 300, "Fy": FY}] * 2}, "two sets have one pressure_kPa"),
    ("a.json",
     {"set": [{"pressure_kPa": 300, "Fy": FY, "lateral_stiffness_N_per_mm": 50}, {"pressure_kPa": 400, "Fy": FY}]},
     "lateral_stiffness_N_per_mm is missing in"),
])  # fmt: skip
def test_files_that_are_refused(tmp_path, name, content, words):
    refuses(words, read_tyre, put(tmp_path, name, content))


def test_missing_file_and_version_7_3(tmp_path):
    refuses(r"none\.mat: no such file of Pacejka-89 coefficients", read_tyre, tmp_path / "none.mat")
    path = tmp_path / "new_p300.mat"  # the header of a file that save -v7.3 writes
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(512))
    refuses(r"saved as version 7\.3; save it with -v7", read_tyre, path)


def test_a_matlab_file_is_read_apart_and_a_bomb_refused_by_its_size(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "scipy.io.loadmat", lambda *_, **__: pytest.fail("read here") if child.apart() else loadmat(*_, **__)
    )
    path = tmp_path / "a_p300.mat"
    savemat(path, {"Fy": FY, "tyre": "x"})
    assert read_tyre(path).tyre == "x"
    path.write_bytes(path.read_bytes().replace(struct.pack("<ii", 1, 14), struct.pack("<ii", 1, 110_000_000)))
    refuses("110,000,00. numbers, at most [0-9,]* of 10,000 channels are read at once", read_tyre, path)


def test_a_lateral_stiffness_beside_gives_a_relaxation_length(tmp_path):
    found = read_tyre(put(tmp_path, "k.yaml", {"Fy": FY, "pressure_bar": 3, "lateral_stiffness_N_per_mm": 50}))
    assert found.at(load=400, pressure=3e5).relaxation_length == pytest.approx(5878 / 50e3, abs=1e-5)


def test_a_camber_force_with_the_square_of_the_load(tmp_path):
    """Sv = (a111 Fz + a112 Fz^2) gamma, Sh = a8 gamma: slope of the force over camber at 0.4 kN by hand."""
    named = {"a0": 1.35, "a1": 0, "a2": 1050, "a3": 98, "a4": 0.65, "a5": 0, "a6": 0, "a7": -1, "a8": 0.04, "a9": 0}
    named |= {"a10": 0, "a111": 1.5, "a112": 0.2, "a12": 0, "a13": 0}
    found = read_tyre(put(tmp_path, "a_p350.json", named))
    slope = 98 * math.sin(2 * math.atan(0.4 / 0.65))  # N/deg
    here = found.at(load=400, pressure=3.5e5)
    assert here.cornering_stiffness == pytest.approx(math.degrees(slope))
    assert here.camber_stiffness == pytest.approx(math.degrees(slope * 0.04 + 1.5 * 0.4 + 0.2 * 0.16))
    camber = math.radians(3)
    force = 1050 * 0.4 * math.sin(1.35 * math.atan(bent(slope / (1.35 * 1050 * 0.4) * 0.04 * 3)))
    force += (1.5 * 0.4 + 0.2 * 0.16) * 3
    assert found.lateral_force(slip_angle=0, load=400, pressure=3.5e5, camber=camber) == pytest.approx(force)
    assert "a112 = 0.2 is taken: camber force with the square of the load" in here.notes


def bent(slip):
    """B X - E (B X - atan B X) with E = -1."""
    return slip + (slip - math.atan(slip))
