"""Tyre tables of others: columns under common names, with units of their own."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tyre import TyreMap
from tyre.base.errors import InputError
from tyre.maps.named_columns import read_named_columns
from tyre.maps.table_io import read_table

OWN = "load_N,pressure_bar,cornering_stiffness_N_per_deg,lateral_stiffness_N_per_mm\n340,3.5,90,45\n490,3.5,110,45\n"
LBF, PSI = 4.4482216152605, 6894.757293168  # N, Pa (NIST SP 811, appendix B.8)
C1, C2 = 90 * 180 / math.pi, 110 * 180 / math.pi  # N/rad of 90 and 110 N/deg


def put(tmp_path, text, name="mine.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / name


@pytest.mark.parametrize("text", [
    OWN,
    OWN.replace("mm\n", "mm  # of the pull test\n").replace("load_N", '"load_N"'),
    "Fz [N],p [bar],C [N/deg],K [N/mm]\n340,3.5,90,45\n490,3.5,110,45\n",
    "Fz [kN];p [kPa];C [N/deg];K [N/mm]\n0,340;350;90,0;45\n0,490;350;110;45\n",
    f"vertical_load_lbf,p_psi,C_alpha_kN_per_rad,K_y_N_per_m\n{340 / LBF!r},{3.5e5 / PSI!r},{C1 / 1e3!r},45000\n"
    f"{490 / LBF!r},{3.5e5 / PSI!r},{C2 / 1e3!r},45e3\n",
    f"load_N,pressure_bar,C (N/rad),relaxation_length_m\n340,3.5,{C1!r},{C1 / 45e3!r}\n"
    f"490,3.5,{C2!r},{C2 / 45e3!r}\n",
    f"load_N,pressure_bar,C [N/deg],K [N/mm],sigma [mm]\n340,3.5,90,45,{np.degrees(90) / 45:.0f}\n490,3.5,110,45,140\n",
])  # fmt: skip
def test_one_table_in_many_units(tmp_path, text):
    found = read_table(put(tmp_path, text))
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
    found = read_table(put(tmp_path, BASE.format(head=head, first=first, second=second)))
    assert found.cornering_stiffness_sd is not None
    np.testing.assert_allclose(found.cornering_stiffness_sd, np.degrees([1.8, 2.2]), rtol=1e-12)
    np.testing.assert_allclose(found.lateral_stiffness_sd, [900, 900], rtol=1e-12)


def test_the_one_with_a_standard_deviation_is_taken_of_two_that_agree(tmp_path):
    text = BASE.format(head=",K [N/mm],sigma [mm],sigma_sd [mm]", first=",45,114.6,3", second=",45,140.1,3")
    found = read_table(put(tmp_path, text))
    np.testing.assert_allclose(found.lateral_stiffness_sd / found.lateral_stiffness, [3 / 114.6, 3 / 140.1], rtol=1e-9)


def test_without_a_sidecar_comments_say_what_it_is_or_it_is_told(tmp_path):
    head = "# tyre: Road 28\n# surface = drum\n# source: a rig\n"
    found = read_table(put(tmp_path, head + OWN))
    assert (found.tyre, found.surface, found.source, found.notes) == ("Road 28", "drum", "a rig", ())
    said = TyreMap.from_file(put(tmp_path, OWN)).at(load=400, pressure=3.5e5).notes
    assert "mine.csv has no sidecar mine.toml; taken is tyre = 'mine' and surface = 'flat'" in said
    with pytest.raises(InputError, match="surface is 'ice'; allowed are 'flat', 'drum'"):
        read_table(put(tmp_path, "# surface: ice\n" + OWN))


HEAD = "load_N,pressure_bar,C [N/deg]"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("load_N,pressure_bar,C,K [N/mm]\n1,1,1,1\n", r"column 'C': no unit; write it in brackets, C \[N/deg\]"),
        ("load_N,pressure_bar,C [N/mm],K [N/mm]\n1,1,1,1\n", r"'N/mm' is no unit of what is given in N/deg; write for"),
        ("load_N,pressure_bar,C [N/foo],K [N/mm]\n1,1,1,1\n", r"'N/foo' is not a unit that is known; write for exam"),
        ("load_N,pressure_bar,C [%],K [N/mm]\n1,1,1,1\n", r"only a standard deviation is given in per cent"),
        ("load_kN,preasure_bar,C [N/deg]\n1,1,1\n", r"unknown column 'preasure_bar'; did you mean 'pressure_bar'"),
        (f"{HEAD},K [N/mm]\n340,3.5,x,45\n", r"line 2, column 'C \[N/deg\]': cornering_stiffness = 'x' is not a"),
        (f"{HEAD},K [N/mm]\n340,3.5,5 kN/rad,45\n340,3.5,5 m,45\n", r"line 3, column .*'m' is no unit of"),
        (f"{HEAD},K [N/mm],sigma [mm]\n340,3.5,90,45,114\n490,3.5,110,45,190\n",
         r"line 3: relaxation length 190 mm, but cornering over lateral stiffness is 140\.1 mm; correct"),
        (f"{HEAD},C_sd [N/deg],K [N/mm]\n340,3.5,90(2),2,45\n", r"two columns give cornering_stiffness_sd"),
        (f"{HEAD},C_sd [N/deg],K [N/mm]\n340,3.5,90,2(1),45\n", r"a standard deviation has none of its own; give"),
        (f"{HEAD},K [N/mm]\n340,3.5,90(2),45\n490,3.5,110,45\n", r"line 3: cornering_stiffness_sd_N_per_deg is there"),
        (f"{HEAD},trail_sd [%],K [N/mm]\n340,3.5,90,2,45\n", r"a standard deviation of pneumatic_trail, but no"),
        (f"{HEAD},c_alpha [N/deg],K [N/mm]\n340,3.5,90,90,45\n", "two columns give cornering_stiffness_N_per_deg"),
        ("C [N/deg],K [N/mm]\n90,45\n", r"the column load_N, pressure_bar is missing"),
        (f"{HEAD}\n340,3.5,90\n", r"give one of the columns 'relaxation_length_mm', 'lateral_stiffness_N_per_mm'"),
        (f"{HEAD},K [N/mm]\n1e-308,3.5,90,45\n", r"row 1: load_N = 1e-308 must be finite and > 0, from 1e-12"),
        (f"{HEAD},K [N/mm]\n340,3.5,-90,45\n", r"row 1: cornering_stiffness_N_per_deg = -90 must be finite and > 0"),
    ],
)  # fmt: skip
def test_refused(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read_table(put(tmp_path, text))


@given(
    stiffness=st.floats(20, 300),
    unit=st.sampled_from([("N/deg", 1.0), ("N/rad", 180 / np.pi), ("kN/rad", 0.18 / np.pi)]),
)
def test_any_stiffness_in_any_unit(tmp_path_factory, stiffness, unit):
    text = f"load_N,pressure_bar,C [{unit[0]}],K [N/mm]\n340,3.5,{stiffness * unit[1]!r},45\n"
    found = read_named_columns(put(tmp_path_factory.mktemp("t"), text))
    np.testing.assert_allclose(found["cornering_stiffness_N_per_deg"], [stiffness], rtol=1e-12)
