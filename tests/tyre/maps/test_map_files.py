"""Reading and writing tyre tables: units, derived stiffness, sharing, round trip, and what is said about bad files."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.shared.refusals import refuses
from tyre import InputError, MeasuredTable, TyreMap
from tyre.maps import read_folder, read_table, read_tyre, write_table
from tyre.measured import common_lateral_stiffness, read_plain_table

CSV = """load_N,pressure_bar,cornering_stiffness_N_per_deg,relaxation_length_mm
300,4,90.0,100.0
500,4,110.0,120.0
"""
TOML = 'tyre = "mine"\nsurface = "flat"\nsource = "my lab"\n'


def put(folder: Path, csv_text: str = CSV, toml_text: str = TOML, name: str = "mine") -> Path:
    (folder / f"{name}.csv").write_text(csv_text)
    (folder / f"{name}.toml").write_text(toml_text)
    return folder / f"{name}.csv"


def test_units_and_derived_lateral_stiffness(tmp_path: Path) -> None:
    table = read_table(put(tmp_path, toml_text=TOML + "relaxation_length_sd_mm = 3\n"))
    np.testing.assert_allclose(table.load, [300, 500])
    np.testing.assert_allclose(table.pressure, [4e5, 4e5])
    # 90 N/deg = 5156.62 N/rad; over 0.1 m = 51566.2 N/m; 3 mm of 100 mm = 3 %
    assert table.cornering_stiffness[0] == pytest.approx(5156.6202, rel=1e-7)
    assert table.lateral_stiffness[0] == pytest.approx(51566.202, rel=1e-7)
    assert table.lateral_stiffness_sd[0] == pytest.approx(0.03 * 51566.202, rel=1e-7)
    assert table.cornering_stiffness_sd is None


def test_round_trip(tmp_path: Path) -> None:
    table = MeasuredTable(
        tyre="T", surface="drum", load=np.array([333.3, 444.4]), pressure=np.array([3.1e5, 3.1e5]),
        cornering_stiffness=np.array([5000.1, 6000.2]), cornering_stiffness_sd=np.array([50.5, 60.25]),
        lateral_stiffness=np.array([50001.0, 60002.0]), lateral_stiffness_sd=np.array([1001.0, 1202.0]),
        lateral_stiffness_shared_over=("load",), resolution=(5.7, 1e-4), source="a lab", description="a tyre",
        notes=("one", "two"), synthetic=True, drum_diameter=2.6, width=0.026,
    )  # fmt: skip
    write_table(table, tmp_path / "T.csv")
    back = read_table(tmp_path / "T.csv")
    for name in ("load", "pressure", "cornering_stiffness", "cornering_stiffness_sd", "lateral_stiffness"):
        np.testing.assert_allclose(getattr(back, name), getattr(table, name), rtol=1e-14)
    np.testing.assert_allclose(back.lateral_stiffness_sd, table.lateral_stiffness_sd, rtol=1e-14)
    assert back.resolution == pytest.approx(table.resolution, rel=1e-14)
    for name in ("tyre", "surface", "lateral_stiffness_shared_over", "source", "description", "notes", "synthetic"):
        assert getattr(back, name) == getattr(table, name)
    assert (back.drum_diameter, back.width) == pytest.approx((2.6, 0.026), rel=1e-14)


SHARED = (
    'lateral_stiffness_shared_over = ["load"]\n'
    "[resolution]\ncornering_stiffness_N_per_deg = 0.1\nrelaxation_length_mm = 0.1\n"
)


def test_shared_stiffness_has_a_common_interval(tmp_path: Path) -> None:
    text = CSV.replace("110.0,120.0", "108.0,120.0")  # 90/100 = 108/120
    common = common_lateral_stiffness([read_table(put(tmp_path, csv_text=text, toml_text=TOML + SHARED))])
    ((low, high),) = common.values()
    assert low < np.degrees(0.9) * 1e3 < high
    # the tighter of the two conditions: (108 -+ 0.05) N/deg over (120 +- 0.05) mm
    assert high - low == pytest.approx(2 * np.degrees(0.9) * 1e3 * (0.05 / 108 + 0.05 / 120), rel=1e-3)


def test_packaged_tables_share_as_declared() -> None:
    tables = read_folder()
    assert sum(2 * table.load.size for table in tables) == 72
    common = common_lateral_stiffness(tables)
    assert sorted(common) == [(3.5e5,), (5.5e5,), (7.5e5,)]


def test_shared_stiffness_that_disagrees_is_refused(tmp_path: Path) -> None:
    table = read_table(put(tmp_path, toml_text=TOML + SHARED))
    with pytest.raises(InputError, match=r"mine on flat, 500 N at 4 bar: the lateral stiffness, 52\.52 N/mm, differs"):
        common_lateral_stiffness([table])


@pytest.mark.parametrize(("csv_text", "message"), [
    ("", "the file is empty; the first line must name the columns: load_N, pressure_bar"),
    (CSV.replace("load_N", "load_n"), "unknown column 'load_n'; did you mean 'load_N'"),
    (CSV.replace("pressure_bar", "load_N"), "the column load_N is given twice"),
    (CSV.replace(",relaxation_length_mm", "").replace(",100.0", "").replace(",120.0", ""), "give one of the col"),
    (CSV.replace("110.0", "11o.0"), "line 3: cornering_stiffness_N_per_deg = '11o.0' must be finite and > 0"),
    (CSV.replace("110.0", "nan"), "line 3: cornering_stiffness_N_per_deg = nan must be finite and > 0"),
    (CSV.replace("110.0", "5e-324"), "cornering_stiffness_N_per_deg = 5e-324 must be finite and > 0, from 1e-12"),
    (CSV.replace("500,4", "300,4"), "300 N at 4 bar appears twice"),
])  # fmt: skip
def test_bad_csv(tmp_path: Path, csv_text: str, message: str) -> None:
    refuses(message, read_table, put(tmp_path, csv_text=csv_text))


@pytest.mark.parametrize(("toml_text", "message"), [
    ("tyre = ", "mine.toml: not a TOML file"),
    (TOML + "notez = []\n", "unknown key 'notez'; did you mean 'notes'"),
    (TOML + 'synthetic = "no"\n', "synthetic = 'no' must be true or false"),
    (TOML + "width_mm = -26\n", "width_mm = -26 must be finite and > 0"),
    (TOML + "relaxation_length_sd_mm = true\n", "relaxation_length_sd_mm = True must be finite and > 0"),
    (TOML.replace('source = "my lab"', ""), "key 'source' is missing"),
    (TOML + "notes = [1]\n", r"notes = \[1\] must be a list of texts in quotes"),
    (TOML + "[resolution]\nrelaxation_length_m = 0.1\n", "unknown key of resolution: 'relaxation_length_m'; did"),
    (TOML + "[resolution]\nrelaxation_length_mm = 0\n", "resolution.relaxation_length_mm = 0 must be finite and >"),
    (TOML + "[resolution]\nrelaxation_length_mm = 0.1\n", "resolution: give both"),
    (TOML.replace("flat", "road"), "mine on road: surface is 'road'; allowed are 'flat', 'drum'"),
    (TOML + 'lateral_stiffness_shared_over = ["loads"]\n', "lateral_stiffness_shared_over has 'loads'; allowed"),
])  # fmt: skip
def test_bad_sidecar(tmp_path: Path, toml_text: str, message: str) -> None:
    refuses(message, read_table, put(tmp_path, toml_text=toml_text))


def test_contradicting_standard_deviations(tmp_path: Path) -> None:
    with_sd = CSV.replace("relaxation_length_mm", "relaxation_length_mm,relaxation_length_sd_mm")
    with_sd = with_sd.replace("100.0", "100.0,3").replace("120.0", "120.0,3")
    with pytest.raises(InputError, match="relaxation_length_sd_mm is in the table and in its sidecar; keep one"):
        read_table(put(tmp_path, with_sd, TOML + "relaxation_length_sd_mm = 3\n"))
    both = with_sd.replace("relaxation_length_sd_mm", "relaxation_length_sd_mm,lateral_stiffness_sd_N_per_mm")
    both = both.replace(".0,3", ".0,3,1")
    refuses("standard deviations of relaxation length and lateral stiffness; keep one", read_table, put(tmp_path, both))
    stiffness = CSV.replace("relaxation_length_mm", "lateral_stiffness_N_per_mm")
    with pytest.raises(InputError, match="but the column relaxation_length_mm is not"):
        read_table(put(tmp_path, stiffness, TOML + "relaxation_length_sd_mm = 3\n"))


def test_missing_files_and_wrong_endings(tmp_path: Path) -> None:
    refuses("no such tyre table", read_table, tmp_path / "nothing.csv")
    refuses("give the path of either", read_table, tmp_path / "nothing.xlsx")
    put(tmp_path).with_suffix(".toml").unlink()
    assert read_table(tmp_path / "mine.csv").notes == (
        "mine.csv has no sidecar mine.toml; taken is tyre = 'mine' and surface = 'flat'",
    )
    refuses("no such folder of tyre tables", read_folder, tmp_path / "nowhere")
    refuses(r"is written as \.csv", write_table, read_folder()[0], tmp_path / "x.toml")


def test_arrays_must_fit_and_be_positive() -> None:
    columns = {"load": [300.0, 400.0], "pressure": [4e5, 4e5], "cornering_stiffness": [5e3, 6e3],
               "lateral_stiffness": [5e4, 5e4], "lateral_stiffness_sd": [1e3, 1e3]}  # fmt: skip
    good = {"tyre": "T", "surface": "flat", **{name: np.array(values) for name, values in columns.items()}}
    for name, values, words in (
        ("lateral_stiffness", [5e4], r"has shape \(1,\); every column needs the shape of load"),
        ("lateral_stiffness_sd", [1e3, -1.0], "of condition 2 is -1; it must be finite and >= 0"),
        ("load", [0.0, 400.0], "of condition 1 is 0; it must be finite and > 0"),
    ):
        refuses(f"{name} {words}", MeasuredTable, **(good | {name: np.array(values)}))
    with pytest.raises(ValueError, match="read-only"):
        MeasuredTable(**good).load[0] = 1.0


def test_names_of_columns_that_are_no_csv_are_refused(tmp_path):
    (tmp_path / "t.csv").write_text('"' + "a " * 70_000 + "\n1\n")
    refuses(r"the names of the columns are not CSV \(field larger than field limit", read_table, tmp_path / "t.csv")
    (tmp_path / "t.csv").write_text("# tyre: A\n" + "a" * 2_000 + "\n1\n")
    refuses("names of the columns: 'a{20}'... has 2,000 characters", read_table, tmp_path / "t.csv")


OWN = "load_N,pressure_bar,cornering_stiffness_N_per_deg,lateral_stiffness_N_per_mm\n340,3.5,90,45\n490,3.5,110,45\n"
LBF, PSI = 4.4482216152605, 6894.757293168  # N, Pa (NIST SP 811, appendix B.8)
C1, C2 = 90 * 180 / math.pi, 110 * 180 / math.pi  # N/rad of 90 and 110 N/deg


def put_plain(tmp_path, text, name="mine.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / name


@pytest.mark.parametrize("text", [
    OWN,
    OWN.replace("mm\n", "mm  # of the lateral stiffness test\n").replace("load_N", '"load_N"'),
    "Fz [N],p [bar],C [N/deg],K [N/mm]\n340,3.5,90,45\n490,3.5,110,45\n",
    "Fz [kN];p [kPa];C [N/deg];K [N/mm]\n0,340;350;90,0;45\n0,490;350;110;45\n",
    f"vertical_load_lbf,p_psi,C_alpha_kN_per_rad,K_y_N_per_m\n{340 / LBF!r},{3.5e5 / PSI!r},{C1 / 1e3!r},45000\n"
    f"{490 / LBF!r},{3.5e5 / PSI!r},{C2 / 1e3!r},45e3\n",
    f"load_N,pressure_bar,C (N/rad),relaxation_length_m\n340,3.5,{C1!r},{C1 / 45e3!r}\n"
    f"490,3.5,{C2!r},{C2 / 45e3!r}\n",
    f"load_N,pressure_bar,C [N/deg],K [N/mm],sigma [mm]\n340,3.5,90,45,{np.degrees(90) / 45:.0f}\n490,3.5,110,45,140\n",
])  # fmt: skip
def test_one_table_in_many_units(tmp_path, text):
    found = read_table(put_plain(tmp_path, text))
    np.testing.assert_allclose(found.load, [340, 490], rtol=1e-9)
    np.testing.assert_allclose(found.pressure, [3.5e5, 3.5e5], rtol=1e-9)
    np.testing.assert_allclose(found.cornering_stiffness, np.degrees([90, 110]), rtol=1e-9)
    np.testing.assert_allclose(found.lateral_stiffness, [45e3, 45e3], rtol=1e-9)


BASE = "load_N,pressure_bar,C [N/deg]{head}\n340,3.5,90{first}\n490,3.5,110{second}\n"


@pytest.mark.parametrize(("head", "first", "second"), [
    (",C_sd [N/deg],K [N/mm],K_sd [N/mm]", ",1.8,45,0.9", ",2.2,45,0.9"),
    (",sd(C) [%],K [N/mm],sd K [kN/m]", ",2,45,0.9", ",2.0 %,45,0.9"),
    (",u(C) [%],K [N/mm]", ",2,45 ± 0.9", ",2,45(0.9)"),
    (",C_std_N_per_deg,K [N/mm],K_sd [%]", ",1.8,45,2", ",2.2,45,2"),
])  # fmt: skip
def test_standard_deviations(tmp_path, head, first, second):
    found = read_table(put_plain(tmp_path, BASE.format(head=head, first=first, second=second)))
    assert found.cornering_stiffness_sd is not None
    np.testing.assert_allclose(found.cornering_stiffness_sd, np.degrees([1.8, 2.2]), rtol=1e-12)
    np.testing.assert_allclose(found.lateral_stiffness_sd, [900, 900], rtol=1e-12)


def test_the_one_with_a_standard_deviation_is_taken_of_two_that_agree(tmp_path):
    text = BASE.format(head=",K [N/mm],sigma [mm],sigma_sd [mm]", first=",45,114.6,3", second=",45,140.1,3")
    found = read_table(put_plain(tmp_path, text))
    np.testing.assert_allclose(found.lateral_stiffness_sd / found.lateral_stiffness, [3 / 114.6, 3 / 140.1], rtol=1e-9)


def test_without_a_sidecar_comments_say_what_it_is_or_it_is_told(tmp_path):
    head = "# tyre: Road 28\n# surface = drum\n# source: a rig\n"
    found = read_table(put_plain(tmp_path, head + OWN))
    assert (found.tyre, found.surface, found.source, found.notes) == ("Road 28", "drum", "a rig", ())
    assert found.surface_stated
    assert found.lateral_stiffness_sd is None
    here = TyreMap.from_file(put_plain(tmp_path, OWN)).at(load=400, pressure=3.5e5)
    assert not here.surface_stated
    said = here.notes
    assert "mine.csv has no sidecar mine.toml; taken is tyre = 'mine' and surface = 'flat'" in said
    refuses("surface is 'ice'; allowed are 'flat', 'drum'", read_table, put_plain(tmp_path, "# surface: ice\n" + OWN))


SEVERAL = (
    "tyre,Load (N),Inflation (bar),Cornering stiffness (N/deg),Lateral stiffness (N/mm),Camber stiffness (N/deg),"
    "Camber [deg],Comment\n"
    "A,400,4,97,60,6.5,0,ok\nA,400,4,95,60,,4,leant\nA,500,4,110,62,8.1,0,\nB,400,4,120,75,7.0,0,\nB,500,4,132,77,8.4,0,\n"
)  # SYNTHETIC


def test_one_tyre_of_several_with_its_camber_stiffness_and_columns_of_no_use(tmp_path):
    path = put_plain(tmp_path, SEVERAL)
    refuses("mine.csv: holds the tyres A, B; choose one, as mine.csv#A", read_tyre, path)
    refuses("mine.csv: no tyre 'C'; there are A, B", read_tyre, f"{path}#C")
    first, second = read_tyre(f"{path}#A"), read_tyre(f"{path}#B")
    assert (first.tyre, second.tyre) == ("A", "B")
    here = first.at(load=400, pressure=4e5)
    assert here.camber_stiffness == pytest.approx(372.4, abs=0.05)  # 6.5 N/deg
    assert here.cornering_stiffness == pytest.approx(np.degrees(97))
    assert second.at(load=500, pressure=4e5).camber_stiffness == pytest.approx(np.degrees(8.4))
    assert "columns of mine.csv that are not used: Comment" in here.notes
    assert "mine.csv: rows of a leaning wheel (Camber [deg] not 0) are not used: 1" in here.notes
    assert "mine.csv has no sidecar mine.toml; taken is surface = 'flat'" in here.notes
    first.to_file(tmp_path / "again.csv")
    again = read_tyre(tmp_path / "again.csv").at(load=450, pressure=4e5)
    assert again.camber_stiffness == pytest.approx(first.at(load=450, pressure=4e5).camber_stiffness)


def test_a_negative_camber_stiffness_of_a_table_is_told(tmp_path):
    path = put_plain(tmp_path, SEVERAL.replace(",6.5,", ",-6.5,"))
    (note,) = [note for note in read_tyre(f"{path}#A").notes if "negative" in note]
    assert note.startswith("camber stiffness is negative, -372.4 N/rad at 400 N: no effect takes it")


def test_columns_that_choose_rows_are_refused_where_they_leave_none(tmp_path):
    refuses(r"mine\.csv: no column states which rows are of the tyre 'A'; name it tyre", read_tyre,
            f"{put_plain(tmp_path, OWN)}#A")  # fmt: skip
    text = "load_N,pressure_bar,C [N/deg],K [N/mm],{}\n340,3.5,90,45,{}\n490,3.5,110,45,{}\n"
    for name, first, second, words in (
        ("camber", "2", "2", r"column 'camber' is 0 in no row; stiffnesses are those of an upright wheel"),
        ("surface", "flat", "drum", "holds the surfaces flat, drum; write a table for each"),
        ("tyre", "A", "", "column 'tyre' is empty in a row; fill it in all rows"),
        ("stiffness_correlation", "0", "0", r"is read only where all columns have names of velotyre; take out C \["),
    ):
        refuses(words, read_table, put_plain(tmp_path, text.format(name, first, second)))
    assert read_table(put_plain(tmp_path, text.format("surface", "drum", "drum"))).surface == "drum"


def test_a_standard_deviation_of_the_camber_stiffness_goes_into_the_covariance(tmp_path):
    text = "load_N,pressure_bar,C [N/deg],K [N/mm],C_gamma [N/deg],C_gamma_sd [N/deg]\n340,3.5,90,45,6,0.3\n"
    text += "490,3.5,110,45,8,0.5\n"
    found = read_tyre(put_plain(tmp_path, text)).jointly([(490.0, 3.5e5)])
    assert found.joint.sd["camber_stiffness.0"] == pytest.approx(np.degrees(0.5))


def test_a_deviation_that_nobody_stated_is_not_a_number_in_the_table(tmp_path):
    """0 elsewhere means stated as exact."""
    found = TyreMap.from_file(put_plain(tmp_path, OWN))
    names = [f"{name}_sd" for name in ("cornering_stiffness", "lateral_stiffness", "relaxation_length")]
    for name in names:
        column = next(one for one in found.table if one.startswith(name))
        assert found.table[column].isna().all()
        assert (found.assuming(0.03).table[column] > 0).all()
    exact = OWN.replace("\n", ",0\n").replace(",0\n", ",K_sd [N/mm]\n", 1)
    stated = TyreMap.from_file(put_plain(tmp_path, exact)).table
    assert (stated["lateral_stiffness_sd_N_per_mm"] == 0).all()
    assert stated["cornering_stiffness_sd_N_per_deg"].isna().all()


LEAD = "load_N,pressure_bar,C [N/deg]"


@pytest.mark.parametrize(("text", "words"), [
    ("load_N,pressure_bar,C,K [N/mm]\n1,1,1,1\n", r"column 'C': no unit; write it in brackets, C \[N/deg\]"),
    ("load_N,pressure_bar,C [N/mm],K [N/mm]\n1,1,1,1\n", r"'N/mm' is no unit of what is given in N/deg; write for"),
    ("load_N,pressure_bar,C [N/foo],K [N/mm]\n1,1,1,1\n", r"'N/foo' is not a unit that is known; write for exam"),
    ("load_N,pressure_bar,C [%],K [N/mm]\n1,1,1,1\n", r"only a standard deviation is given in per cent"),
    ("load_kN,preasure_bar,C [N/deg]\n1,1,1\n", r"unknown column 'preasure_bar'; did you mean 'pressure_bar'"),
    (f"{LEAD},K [N/mm]\n340,3.5,x,45\n", r"line 2, column 'C \[N/deg\]': cornering_stiffness = 'x' is not a"),
    (f"{LEAD},K [N/mm]\n340,3.5,5 kN/rad,45\n340,3.5,5 m,45\n", r"line 3, column .*'m' is no unit of"),
    (f"{LEAD},K [N/mm],sigma [mm]\n340,3.5,90,45,114\n490,3.5,110,45,190\n",
     r"line 3: relaxation length 190 mm, but cornering over lateral stiffness is 140\.1 mm; correct"),
    (f"{LEAD},C_sd [N/deg],K [N/mm]\n340,3.5,90(2),2,45\n", r"two columns give cornering_stiffness_sd"),
    (f"{LEAD},C_sd [N/deg],K [N/mm]\n340,3.5,90,2(1),45\n", r"a standard deviation has none of its own; give"),
    (f"{LEAD},K [N/mm]\n340,3.5,90(2),45\n490,3.5,110,45\n", r"line 3: cornering_stiffness_sd_N_per_deg is there"),
    (f"{LEAD},trail_sd [%],K [N/mm]\n340,3.5,90,2,45\n", r"a standard deviation of pneumatic_trail, but no"),
    (f"{LEAD},c_alpha [N/deg],K [N/mm]\n340,3.5,90,90,45\n", "two columns give cornering_stiffness_N_per_deg"),
    ("C [N/deg],K [N/mm]\n90,45\n", r"the column load_N, pressure_bar is missing"),
    (f"{LEAD}\n340,3.5,90\n", r"give one of the columns 'relaxation_length_mm', 'lateral_stiffness_N_per_mm'"),
    (f"{LEAD},K [N/mm]\n1e-308,3.5,90,45\n", r"line 2: load_N = 1e-308 must be finite and > 0, from 1e-12"),
    (f"{LEAD},K [N/mm]\n340,3.5,-90,45\n", r"line 2: cornering_stiffness_N_per_deg = -90 must be finite and > 0"),
])  # fmt: skip
def test_plain_tables_that_are_refused(tmp_path, text, words):
    refuses(words, read_table, put_plain(tmp_path, text))


UNITS = [("N/deg", 1.0), ("N/rad", 180 / np.pi), ("kN/rad", 0.18 / np.pi)]


@settings(max_examples=30)
@given(stiffness=st.floats(20, 300), unit=st.sampled_from(UNITS))
def test_any_stiffness_in_any_unit(tmp_path_factory, stiffness, unit):
    text = f"load_N,pressure_bar,C [{unit[0]}],K [N/mm]\n340,3.5,{stiffness * unit[1]!r},45\n"
    found = read_plain_table(put_plain(tmp_path_factory.mktemp("t"), text)).columns
    np.testing.assert_allclose(found["cornering_stiffness_N_per_deg"], [stiffness], rtol=1e-12)
