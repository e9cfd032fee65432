"""Tables of bicycles, one a row."""

import math

import pandas as pd
import pytest

from bicycle import load_bicycle
from bicycle.files import read_bicycles
from bicycle.parameters import UNITS
from tyre.ground import InputError

NAMES = ("pista", "benchmark", "kooijman2008")


def frame(**columns):
    rows = [{"name": name} | {key: load_bicycle(name)[key] for key in UNITS} for name in NAMES]
    return pd.DataFrame(rows).assign(**columns)


def table(tmp_path, data, name="many.csv"):
    path = tmp_path / name
    {"csv": data.to_csv, "xlsx": data.to_excel, "parquet": data.to_parquet}[name.rsplit(".")[-1]](path, index=False)
    return path


@pytest.mark.parametrize("name", ["many.csv", "many.xlsx", "many.parquet"])
def test_every_format_gives_the_same_bicycles(tmp_path, name):
    data = frame(w_sd=[0.002, None, 0.0], description=["steel", "", ""], source="mine", IByy=[1.3, None, None])
    found = read_bicycles(table(tmp_path, data, name))
    assert [one.name for one in found] == list(NAMES)
    for one in found:
        assert {key: one[key] for key in UNITS} == {key: load_bicycle(one.name)[key] for key in UNITS}
    assert [dict(one.sd) for one in found] == [{"w": 0.002}, {}, {"w": 0.0}]
    assert [one.description for one in found] == ["steel", "", ""]
    assert [one.source for one in found] == ["mine"] * 3
    assert found[0].values["IByy"] == 1.3


@pytest.mark.parametrize(("columns", "factor"), [
    (("w [mm]", "w_sd [mm]"), 1000), (("w_mm", "w_sd_mm"), 1000), (("w (cm)", "w_sd"), 100), (("w", "w_sd"), 1),
])  # fmt: skip
def test_units_of_columns(tmp_path, columns, factor):
    data = frame(w_sd=[0.5, 0.25, 0.125]).rename(columns={"w": columns[0], "w_sd": columns[1]})
    data[list(columns)] *= factor
    found = read_bicycles(table(tmp_path, data))
    assert [one["w"] for one in found] == pytest.approx([load_bicycle(name)["w"] for name in NAMES], rel=1e-15)
    assert [one.sd["w"] for one in found] == [0.5, 0.25, 0.125]


def test_cells_in_the_notations_of_measurements(tmp_path):
    data = frame(lam=["15.8(2) deg", "0.3 ± 0.01", "0.3"])
    first, second, third = read_bicycles(table(tmp_path, data))
    assert first.sd == {"lam": pytest.approx(math.radians(0.2), rel=1e-14)}
    assert (second.sd, third.sd) == ({"lam": 0.01}, {})


def test_one_of_a_table(tmp_path):
    path = table(tmp_path, frame())
    assert load_bicycle(f"{path}#benchmark").values == {key: load_bicycle("benchmark")[key] for key in UNITS}
    only = table(tmp_path, frame()[1:2], "one.csv")
    assert load_bicycle(only).name == "benchmark"
    with pytest.raises(InputError, match=r"has 3 bicycles \(pista, benchmark, .*\); name one of them: many\.csv#pista"):
        load_bicycle(path)
    with pytest.raises(InputError, match=r"many\.csv: unknown bicycle 'pisto'; did you mean 'pista'"):
        load_bicycle(f"{path}#pisto")


@pytest.mark.parametrize(("changes", "words"), [
    ({"w": ["1,0", 1.0, 1.0]}, r"line 2 \(pista\), column 'w': w = '1,0' has a decimal comma"),
    ({"w": [1.0, None, 1.0]}, r"line 3 \(benchmark\), column 'w': the cell is empty; every bicycle needs w \(m\)"),
    ({"w": [1.0, 1.02, 1020]}, r"line 4 \(kooijman2008\): w = 1020 m is far outside .* \(millimetres\?\)"),
    ({"mB": [9.0, -85.0, 9.0]}, r"line 3 \(benchmark\): bicycle 'benchmark': mB = -85 kg must not be negative"),
    ({"name": ["a", "b", "a"]}, r"line 4, column 'name': 'a' is there already; give each its own name"),
    ({"name": ["a", None, "c"]}, r"line 3, column 'name': '' must be a name without '#'"),
    ({"name": ["a", "b#1", "c"]}, r"line 3, column 'name': 'b#1' must be a name without '#'"),
    ({"wheels": 2}, r"unknown column 'wheels'; .*; KEY_sd is a standard deviation"),
    ({"Ibxx": 2}, r"unknown column 'Ibxx'; did you mean 'IBxx'"),
    ({"w_mm": 1000}, r"two columns are of w; keep one"),
    ({"c_sd [kg]": 1}, r"column 'c_sd \[kg\]': 'kg' is no unit of what is given in m"),
    ({"source [m]": "x"}, r"the column 'source \[m\]' has no unit"),
    ({"w_sd": ["wide", 0, 0]}, r"line 2 \(pista\), column 'w_sd': w = 'wide' is not a finite number"),
    ({"w_sd": [0, 3, 0]}, r"line 3 \(benchmark\): the standard deviation of w is 3 m, more than"),
    ({"allow_unusual": "maybe"}, r"line 2: allow_unusual = 'maybe' must be true or false"),
])  # fmt: skip
def test_what_is_refused_names_row_and_column(tmp_path, changes, words):
    with pytest.raises(InputError, match=rf"many\.csv.*{words}"):
        read_bicycles(table(tmp_path, frame(**changes)))


def test_missing_columns_and_unusual_rows(tmp_path):
    with pytest.raises(InputError, match="the column lam, zH is missing; a row needs a name and every parameter"):
        read_bicycles(table(tmp_path, frame().drop(columns=["lam", "zH"])))
    long = frame(allow_unusual=[False, True, False])
    long.loc[1, "c"] = 7.0
    assert read_bicycles(table(tmp_path, long))[1]["c"] == 7.0
