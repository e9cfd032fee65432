"""Tables that a spreadsheet opens without running what is in them."""

import csv
import io

import numpy as np
import pandas as pd
import pytest

from tyre.base.csv_text import csv_text, harmless, write_csv


@pytest.mark.parametrize("text", ["=1+1", "+cmd", "-x", "@SUM(A1)", "\t=1", '=HYPERLINK("http://a")', "--5"])
def test_text_that_is_a_formula_is_quoted(text):
    assert harmless(text) == f"'{text}"
    table = pd.DataFrame({"tyre": [text, "Tyre1"], "load_N": [-400.0, 400.0]})
    rows = list(csv.reader(io.StringIO(csv_text(table), newline="")))
    assert rows == [["tyre", "load_N"], [f"'{text}", "-400.0"], ["Tyre1", "400.0"]]


@pytest.mark.parametrize("cell", ["-3.5", "+1e-3", "Tyre-1", "a=b", "", -3.5, None, "-inf"])
def test_numbers_and_plain_text_stay(cell):
    assert harmless(cell) is cell


def test_a_column_name_is_quoted_too(tmp_path):
    write_csv(tmp_path / "t.csv", pd.DataFrame({"=A": [1.0], "b": [None]}))
    assert (tmp_path / "t.csv").read_text() == "'=A,b\n1.0,\n"


def test_the_table_itself_is_not_changed():
    table = pd.DataFrame({"tyre": ["=1"], "x": [0.123456789]})
    assert csv_text(table, number_format="%.3g") == "tyre,x\n'=1,0.123\n"
    assert table.tyre.to_list() == ["=1"]


@pytest.mark.parametrize("gap", [0.5, np.nan])  # the second in the slower way
def test_numbers_are_written_as_pandas_does(gap):
    values = np.random.default_rng(0).standard_normal((50, 2)) * 10.0 ** np.arange(-25, 25)[:, None]
    table = pd.DataFrame({'a,"b': [gap, -0.0, np.inf, -np.inf, *values[4:, 0]], "100 %": values[:, 1]})
    for number_format in ("%.12g", "%.3f"):
        expected = table.to_csv(index=False, lineterminator="\n", float_format=number_format)
        assert csv_text(table, number_format=number_format) == expected
