"""CSV tables: strict ones, loggers' files, cells with checks of their own, and writing without formulas."""

import csv
import io

import numpy as np
import pandas as pd
import pytest

from tests.shared.refusals import refuses
from tyre.ground import InputError, csv_text, escape_formula, number, read_cells, read_columns


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "t.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def test_numbers_words_and_lines(file):
    path = file('# who, when\na_m, what,b_s\n\n1, "x, #1",2e1 # seen\n3,y,4\n')
    columns = read_columns(path, numbers=("a_m", "b_s", "c"), texts=("what",), needed=("a_m",))
    assert {name: x.tolist() for name, x in columns.numbers.items()} == {"a_m": [1, 3], "b_s": [20, 4]}
    assert (columns.texts, columns.lines) == ({"what": ["x, #1", "y"]}, (4, 5))


def test_cells_with_checks_of_their_own(file):
    checks = {"load_N": number(above=0), "dof": number(above=0, endless=True)}
    assert read_columns(file("load_N,dof\n1,inf\n"), numbers=checks, needed=()).numbers["dof"] == [np.inf]
    for text, words in (
        ("load_N\n1\n-2\n", "t.csv, line 3: load_N = -2 must be a finite number above 0"),
        ("load_N\nx\n", "t.csv, line 2: load_N = 'x' must be a finite number above 0"),
        ("load_N,dof\n1,\n", "t.csv, line 2: dof = '' must be a finite number above 0"),
    ):
        refuses(words, read_columns, file(text), numbers=checks, needed=())


@pytest.mark.parametrize("cell", ["1_0", "３００", "٣", "1e1_0", "３e1"])
def test_numbers_are_spelt_in_plain_digits(file, cell):
    """Python would read each of them as a number."""
    assert float(cell) > 0
    with pytest.raises(InputError, match="t.csv, line 2: load_N = .* must be a finite number above 0"):
        read_columns(file(f"load_N\n{cell}\n"), numbers={"load_N": number(above=0)}, needed=())


def test_a_last_row_without_a_line_end_may_be_a_cut_number(file):
    for text in ("a,b\n1,12.3", "a,b\r\n1,12.3", "# made up\na,b\n1,2\n1,12.3"):
        with pytest.raises(InputError, match=r"t.csv, line \d: the last row ends with '1,12.3' and no line end"):
            read_columns(file(text), numbers=("a", "b"), needed=())
    for text in ("a,b\n1,12.3\n", "a,b\n1,12.3\n  ", "a,b\n1,12.3 # whole", "a,b\n1,12.3\n# whole"):
        assert read_columns(file(text), numbers=("a", "b"), needed=()).numbers["b"] == [12.3]
    cut = "1 cell where the header has 2 columns; was the file cut off"
    for text, words in (("a,b\n1", cut), ("a,b", "no rows"), ("a,b\n1,inf\n", "b = 'inf' is not a finite number")):
        refuses(words, read_columns, file(text), numbers=("a", "b"), needed=())
    with pytest.raises(InputError, match="no line end, so the file may be cut off inside a number; complete the row"):
        read_cells(file("a;b\n1;2,5\n2;2,"), kind="recording", example="a", logged=True)


LOGGED = 'time;"force"\n0;1,5\n1;NA\n'


def test_a_loggers_file_is_read_fast_and_slow_alike(file):
    """Decimal commas, missing values, bytes that are no UTF-8; the slow way serves where a row stops the fast one."""
    fast = read_cells(file(LOGGED), kind="recording", example="time", logged=True)
    assert fast.header == ["time", "force"]
    slow = read_cells(file(LOGGED.encode() + b"2;2,5 \n\n"), kind="recording", example="time", logged=True)
    for cells, last in ((fast, []), (slow, [2.5])):
        time, force = cells.numbers([0, 1], missing=("", "NA"))
        np.testing.assert_array_equal(force, [1.5, np.nan, *last])
        assert len(time) == len(force)
    words = read_cells(file(b"a,b\n1,caf\xe9\n"), kind="recording", example="a", logged=True)
    assert words.numbers([0], missing=("",))[0] == [1.0]
    assert words.column(1) == ["café"]


@pytest.mark.parametrize(("text", "words"), [
    ("a,b\n1,2\n1,2,3\n", "line 3: 3 cells where the header has 2 columns; name every column, separate by commas"),
    ("a,b\n1,2\n1\n", "line 3: 1 cell where the header has 2 columns; was the file cut off"),
    ("a,b\n1,2\n1,1_0\n", "line 3: b = '1_0' is not a number"),
    ("a,b\n1,2\n1,x\n", "line 3: b = 'x' is not a number"),
    ("", "no CSV; the first line must name the columns: a, b"),
    ("a\0", "no CSV; the first line must name the columns: a, b"),
])  # fmt: skip
def test_what_a_logger_cannot_have_written(file, text, words):
    with pytest.raises(InputError, match=words):
        read_cells(file(text), kind="recording", example="a, b", logged=True).numbers([0, 1], missing=("",))


@pytest.mark.parametrize("text", ["=1+1", "+cmd", "-x", "@SUM(A1)", "\t=1", '=HYPERLINK("http://a")', "--5"])
def test_text_that_is_a_formula_is_quoted(text):
    assert escape_formula(text) == f"'{text}"
    table = pd.DataFrame({"tyre": [text, "Tyre1"], "load_N": [-400.0, 400.0]})
    rows = list(csv.reader(io.StringIO(csv_text(table), newline="")))
    assert rows == [["tyre", "load_N"], [f"'{text}", "-400.0"], ["Tyre1", "400.0"]]


@pytest.mark.parametrize("gap", [0.5, np.nan])  # the second in the slower way
def test_numbers_are_written_as_pandas_does(gap):
    values = np.random.default_rng(0).standard_normal((50, 2)) * 10.0 ** np.arange(-25, 25)[:, None]
    table = pd.DataFrame({'a,"b': [gap, -0.0, np.inf, -np.inf, *values[4:, 0]], "100 %": values[:, 1]})
    for number_format in ("%.12g", "%.3f"):
        expected = table.to_csv(index=False, lineterminator="\n", float_format=number_format)
        assert csv_text(table, number_format=number_format) == expected


def test_other_columns_may_be_allowed(file):
    path = file("a,note\n1,hm\n")
    assert read_columns(path, numbers=("a",), needed=("a",), others=True).numbers["a"] == [1.0]
    with pytest.raises(InputError, match="the column b is missing; there are a, note"):
        read_columns(path, numbers=("b",), needed=("b",), others=True)
    with pytest.raises(InputError, match="unknown column 'note'; known: a; units are in the column names"):
        read_columns(path, numbers=("a",), needed=("a",))
