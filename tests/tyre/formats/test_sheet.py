"""Tables from CSV, workbooks and Parquet."""

import pandas as pd
import pytest

from tests.shared.refusals import refuses
from tyre.formats import read_sheet, split_unit
from tyre.ground import InputError


def csv(tmp_path, text):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    return tmp_path / "t.csv"


@pytest.mark.parametrize("text", [
    "name,w [m]\n# said\none,1.5\n\ntwo,2\n", "name;w [m]\none;1,5\ntwo;2\n", "\ufeffname\tw [m]\none\t1,5\ntwo\t2\n",
])  # fmt: skip
def test_commas_semicolons_and_tabs(tmp_path, text):
    sheet = read_sheet(csv(tmp_path, text), kind="bicycles")
    assert sheet.header == ("name", "w [m]")
    assert [cells for _, cells in sheet.rows] == [("one", "1.5"), ("two", "2")]
    assert sheet.rows[-1][0] == f"line {len(text.splitlines())}"


@pytest.mark.parametrize("ending", ["xlsx", "parquet"])
def test_workbook_and_parquet(tmp_path, ending):
    frame, path = pd.DataFrame({"name": ["one ", "two"], "w": [2.0, None]}), tmp_path / f"t.{ending}"
    frame.to_excel(path, index=False) if ending == "xlsx" else frame.to_parquet(path)
    sheet = read_sheet(path, kind="bicycles")
    assert sheet.header == ("name", "w")
    first = 2 if ending == "xlsx" else 1  # of a workbook the row of the names counts
    assert sheet.rows == ((f"row {first}", ("one", 2)), (f"row {first + 1}", ("two", "")))


def test_the_sheet_of_that_name_is_taken_where_there_are_several(tmp_path):
    path = tmp_path / "t.xlsx"
    for name in ("bicycles", "others"):
        with pd.ExcelWriter(path) as book:
            pd.DataFrame({"x": [1]}).to_excel(book, sheet_name="notes", index=False)
            pd.DataFrame({"name": ["a"]}).to_excel(book, sheet_name=name, index=False)
        if name == "bicycles":
            assert read_sheet(path, kind="bicycles").header == ("name",)
        else:
            with pytest.raises(InputError, match=r"several sheets have data \(notes, others\); name .* 'bicycles'"):
                read_sheet(path, kind="bicycles")


@pytest.mark.parametrize(("text", "words"), [
    ("", "the table of bicycles has no rows"),
    ("name,w\n", "the table of bicycles has no rows below the one that names the columns"),
    ("name,\na,1\n", "column 2 has no name"),
    ("w,w\n1,2\n", "the column 'w' is given twice; keep one"),
    ("name,w\na,1,2\n", "line 2: 3 cells where the header has 2 columns"),
    ('name,w\n"a,1\n', "line 2: not CSV"),
])  # fmt: skip
def test_refused_csv(tmp_path, text, words):
    refuses(words, read_sheet, csv(tmp_path, text), kind="bicycles")


def test_refused_files(tmp_path):
    refuses(r"none\.csv: no such table of bicycles", read_sheet, tmp_path / "none.csv", kind="bicycles")
    (tmp_path / "latin.csv").write_bytes(b"name,w\n\xe9,1\n")
    refuses("not text in UTF-8", read_sheet, tmp_path / "latin.csv", kind="bicycles")
    for name, words in (("t.xlsx", r"cannot be read as \.xlsx"), ("t.parquet", r"cannot be read as \.parquet")):
        (tmp_path / name).write_text("name,w\n")
        refuses(words, read_sheet, tmp_path / name, kind="bicycles")


def test_units_in_brackets():
    assert split_unit("lam [deg]") == ("lam", "deg")
    assert split_unit(" K (N/mm) ") == ("K", "N/mm")
    assert split_unit("sd(K) [N/mm]") == ("sd(K)", "N/mm")
    assert split_unit("w") == ("w", "")
