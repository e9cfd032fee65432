"""Pacejka-89 coefficients in the files of other projects."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import savemat

from tyre import read_tyre
from tyre.base.errors import InputError
from tyre.magic_formula.pacejka89_file import read_pacejka89

SETS = read_pacejka89("schwalbe_energizer_plus_28x1.75").sets
FY, MZ = (list(one) for one in (SETS[0].side_force_coefficients, SETS[0].aligning_moment_coefficients or ()))
OLDER = json.loads((Path(__file__).parents[2] / "published" / "data" / "schwalbe_t03_older_fits.json").read_text())[
    "sets"
]
# N/rad at 300, 400, 500, 600 N, evaluated apart from velotyre for the three sets (300, 400, 500 kPa)
SLOPES = {3e5: (4870, 5878, 6549, 6937), 4e5: (4419, 5848, 7235, 8565), 5e5: (4563, 5403, 5901, 6134)}
LOADS = (300.0, 400.0, 500.0, 600.0)


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


def lines(numbers, mark="\n"):
    return mark.join(map(repr, numbers))


def row(numbers):
    return ",".join(map(repr, numbers))


ROLES = {"OptParameterMF_Fy": FY, "OptParameterMF_Mz": MZ}
HEAD = ",".join(["pressure_kPa", *(f"a{n}" for n in range(14)), *(f"c{n}" for n in range(18))])
ONE = [
    ("plain_p300.txt", lines(FY), False),
    ("both_p300.txt", lines(FY + MZ, ", "), True),
    ("said.txt", f"# pressure_bar: 3\n# tyre = T\n{lines(FY)}", False),
    ("paste.txt", f"pressure_kPa = 300\nFy_coef = [\n{lines(FY, ',  # deg'+chr(10))}]\nMz_coef = [{row(MZ)}]", True),
    ("line_p300.csv", row(FY), False),
    ("column_p300.csv", lines(FY), False),
    ("row.csv", f"{HEAD}\n300,{row(FY)},{row(MZ)}\n", True),
    ("OptParameterMF_T03R01_camber0_p300.mat", {"OptParameterMF": {k: np.array(v) for k, v in ROLES.items()}}, True),
    ("flat.mat", {k: np.array([v]) for k, v in ROLES.items()} | {"pressure_kPa": 300.0, "slip_unit": "deg"}, True),
    ("write.yaml", ROLES | {"pressure_kPa": 300}, True),
    ("nested.yml", {"SchwalbeT03_300kPa": {"Fy_coef": FY, "Mz_coef": MZ, "pressure_kPa": 300}}, True),
    ("bare_p300.json", FY, False),
    ("psi.json", {"side_force": FY, "pressure_psi": 43.511321319062764}, False),
    ("kind.json", [{"kind": "opt_Pac_fy", "label": "T 300 kPa", "n": 14, "coef": FY},
                   {"kind": "opt_Pac_Mz", "label": "T 300 kPa", "n": 18, "coef": MZ}], True),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "moment"), ONE, ids=[name for name, *_ in ONE])
def test_every_form_gives_the_same_slopes(tmp_path, name, content, moment):
    found = read_tyre(put(tmp_path, name, content))
    assert found.pressures.tolist() == pytest.approx([3e5], rel=1e-14)
    slopes = found.linear(load=np.array(LOADS), pressure=np.full(4, found.pressures[0]))["cornering_stiffness"]
    np.testing.assert_allclose(slopes, SLOPES[3e5], atol=0.51)
    assert found.sets[0].side_force_coefficients == tuple(FY)
    assert found.sets[0].aligning_moment_coefficients == (tuple(MZ) if moment else None)


@pytest.mark.parametrize("ending", ["json", "yaml", "csv"])
def test_sets_at_several_pressures(tmp_path, ending):
    kpa = [300, 400, 500]
    if ending == "csv":
        values = [
            f"{p},{row(s.side_force_coefficients)},{row(s.aligning_moment_coefficients)}"
            for p, s in zip(kpa, SETS, strict=True)
        ]
        content = "\n".join([HEAD, *values])
    else:
        content = {"tyre": "T", "load_max_N": 1000, "surface": "flat", "slip_unit": "deg", "sets": [
            {"label": f"{p} kPa", "Fy": list(s.side_force_coefficients), "Mz": list(s.aligning_moment_coefficients)}
            for p, s in zip(kpa, SETS, strict=True)
        ]}  # fmt: skip
    found = read_tyre(put(tmp_path, f"t.{ending}", content))
    for pressure, slopes in SLOPES.items():
        np.testing.assert_allclose(found.cornering_stiffness(load=LOADS, pressure=pressure), slopes, atol=0.51)
    if ending != "csv":
        assert (found.tyre, found.notes, found.load_range) == ("T", (), (0.0, 1000.0))


def test_what_is_not_stated_is_taken_from_names_and_said(tmp_path):
    said = read_tyre(put(tmp_path, "T03_p300.json", FY)).notes
    assert said == (
        "its pressure of 300 kPa is read from the name T03_p300",
        "the file states no largest load (load_max_N)",
        "the file states no unit of slip (slip_unit); degrees are taken, as Magic-Formula-89 has them",
        "the file states no surface; flat is taken",
    )
    label = "MF Coefficients (14 par): Tyre T03, Pressure 300 kPa. For input in deg. Upper Limit Fz: 850 N"
    found = read_tyre(put(tmp_path, "l.json", {"label": label, "Fy": FY, "surface": "drum"}))
    assert (found.notes, found.load_range, found.surface) == ((), (0.0, 850.0), "drum")
    mat = put(tmp_path, "w_p300.mat", {"OptParameterMF_Fy": np.array(FY), "sse_Fy": 3.0, "S": {"camber": 0.0}})
    assert read_tyre(mat).notes[0] == "not used of w_p300.mat: S, sse_Fy"


def test_notes_of_the_file_are_kept(tmp_path):
    said = {"Fy": FY, "pressure_bar": 3, "surface": "flat", "slip_unit": "deg", "load_max_N": 900}
    assert read_tyre(put(tmp_path, "n.json", said | {"note": "synthetic"})).synthetic
    assert read_tyre(put(tmp_path, "m.yaml", said | {"note": ["one", "two"]})).notes == ("one", "two")


@pytest.mark.parametrize(("name", "extra"), [
    ("a_p300.json", {"label": "values from Opt Par_rad"}), ("OptPar_rad_p300.json", {}),
    ("b_p300.json", {"slip_unit": "rad"}),
])  # fmt: skip
def test_radians_by_label_name_or_key(tmp_path, name, extra):
    coefficients = next(e["coefficients"] for e in OLDER if e["slip_unit"] == "rad" and e["quantity"] == "side_force")
    found = read_tyre(put(tmp_path, name, {"Fy": coefficients} | extra))
    assert found.sets[0].slip_unit == "rad"
    # an older fit of the same measurements: its slope at 400 N is that of the later one, 5878 N/rad, to a tenth
    assert found.cornering_stiffness(load=400.0, pressure=3e5) == pytest.approx(5878, rel=0.1)


def test_odd_coefficients_are_said(tmp_path):
    coefficients = next(
        e["coefficients"] for e in OLDER if e["label"] == "values from OptPar_deg" and len(e["coefficients"]) == 14
    )
    notes = read_tyre(put(tmp_path, "o_p300.json", {"label": "values from OptPar_deg", "Fy": coefficients})).notes
    # C is its first number; D(0.4 kN) = (3896.99 0.4^2 + 3964.31 0.4) N
    assert "values from OptPar_deg: C = 0.2963 (usual 0.5 to 4), D = 5.523 times the load at 400 N" in " ".join(notes)


def test_an_aborted_fit_is_refused_with_the_reason(tmp_path):
    old = next(e for e in OLDER if "still need refinements" in e["label"])
    content = {"label": old["label"], "Fy": old["coefficients"], "pressure_kPa": 300}
    with pytest.raises(InputError, match=r"its authors say 'need refinement' of this fit: .*2729 N/deg, a tyre has 6"):
        read_tyre(put(tmp_path, "a.json", content))
    with pytest.raises(InputError, match="cornering stiffness at 200 N is 2729 N/deg"):
        read_tyre(put(tmp_path, "b.json", content | {"label": "trial"}))
    with pytest.raises(InputError, match="its authors say 'not converged' of this fit; take a finished one"):
        read_tyre(put(tmp_path, "c.json", {"label": "not converged", "Fy": FY, "pressure_kPa": 300}))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.json", FY, r"no pressure is stated; write pressure_kPa = 300, or name it in the label \('300 kPa'\)"),
        ("a_p300.json", FY[:-1], "the list has 13 coefficients; a side force has 14"),
        ("a_p300.json", {"Fy": MZ}, "the side force has 18 coefficients; a side force has 14"),
        ("a_p300.json", MZ, "the aligning moment '' has no side force of the same label before it"),
        ("a_p300.json", {"Fx": FY}, "unknown key 'fx'"),
        ("a_p300.json", {"Fy": FY, "slip_unit": "grad"}, "slip_unit = 'grad' is neither 'deg' nor 'rad'"),
        ("a_p300.json", {"Fy": FY, "surface": "ice"}, "surface = 'ice' must be 'flat' or 'drum'"),
        ("a_p300.json", {"Fy": FY, "pressure_kPa": -1}, "pressure_kpa = -1 must be a positive number"),
        ("a_p300.json", {"Fy": [*FY[:-1], "x"]}, "fy must be a list of finite numbers"),
        ("a_p300.json", 3, "3 is no list of coefficients"),
        ("a_p300.json", {}, "no coefficients found; give 14 numbers"),
        ("a_p300.json", "{", "not a JSON file"),
        ("a_p300.json", "[" * 100_000, "not a JSON file"),
        ("a_p300.yaml", "[" * 5_000, "not a YAML file"),
        ("a_p300.yaml", "a: [", "not a YAML file"),
        ("a_p300.mat", "text", "not a MATLAB file"),
        ("a_p300.txt", "1.0\nx\n", r"line 2: unknown key 'x'"),
        ("a_p300.txt", "1.0, 2.0 x\n", r"line 1: 'x' is not a number"),
        ("a.csv", f"{HEAD}\n300,{row(FY)},{row([*MZ[:-1], 0])[:-1]}y\n", r"line 2, column 'c17': 'y' is not a number"),
        ("a.csv", "a0,a2\n1,2\n", "the column a1 is missing before a2"),
        ("a.json", [{"label": f"{n} 300 kPa", "Fy": FY} for n in "ab"], "'a 300 kPa' and 'b 300 kPa' are of one"),
        ("a.json", [{"label": f"{p} kPa", "tyre": str(p), "Fy": FY} for p in (300, 400)], "several values of tyre"),
        ("a.json", [{"label": "300 kPa", "Fy": FY, "lateral_stiffness_N_per_mm": 50}, {"label": "400 kPa", "Fy": FY}],
         "lateral_stiffness_N_per_mm is given for some of the sets"),
    ],
)  # fmt: skip
def test_refused(tmp_path, name, content, words):
    with pytest.raises(InputError, match=words):
        read_tyre(put(tmp_path, name, content))


def test_a_set_in_the_other_unit_is_told(tmp_path):
    coefficients = next(e["coefficients"] for e in OLDER if e["slip_unit"] == "rad" and e["quantity"] == "side_force")
    with pytest.raises(InputError, match="with slip in rad it would be one: write slip_unit = rad"):
        read_tyre(put(tmp_path, "u_p300.json", coefficients))


def test_missing_file_and_version_7_3(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"none\.mat: no such file of Pacejka-89 coefficients"):
        read_tyre(tmp_path / "none.mat")
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "new_p300.mat"
    with h5py.File(path, "w", userblock_size=512) as file:  # as save -v7.3 writes it
        file.create_dataset("OptParameterMF/OptParameterMF_Fy", data=np.array([FY]).T)
        file.create_dataset("pressure_kPa", data=[[300.0]])
        file.create_dataset("slip_unit", data=np.array([[ord(letter)] for letter in "deg"], dtype=np.uint16))
        file["slip_unit"].attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#")
    raw = bytearray(path.read_bytes())
    raw[:128] = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    path.write_bytes(raw)
    found = read_tyre(path)
    np.testing.assert_allclose(found.cornering_stiffness(load=LOADS, pressure=3e5), SLOPES[3e5], atol=0.51)
    assert found.notes == ("the file states no largest load (load_max_N)", "the file states no surface; flat is taken")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r"saved as version 7\.3; h5py is not installed; .*, or save it with -v7"):
        read_tyre(path)


def test_a_lateral_stiffness_beside_gives_a_relaxation_length(tmp_path):
    found = read_tyre(put(tmp_path, "k.yaml", {"Fy": FY, "pressure_bar": 3, "lateral_stiffness_N_per_mm": 50}))
    assert found.at(load=400, pressure=3e5).relaxation_length == pytest.approx(5878 / 50e3, abs=1e-5)
