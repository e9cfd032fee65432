"""Text tables of laboratories: delimiters, decimal signs, header lines, units, encodings, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.shared.refusals import refuses
from tyre.formats import ChannelMap, Reading, contents, read_signals
from tyre.ground import InputError


@pytest.fixture
def file(tmp_path):
    def write(text, name="a.csv", encoding="utf-8"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return path

    return write


def read(path, **reading):
    return read_signals(path, map=None) if not reading else _told(path, reading)


def _told(path, reading):
    found = contents(path, reading=Reading(**reading))
    return {signal.name: signal for signal in found.load([column.name for column in found.columns], None)}


@pytest.mark.parametrize("text", [
    "t,f\n0,1.5\n1,-2.5\n", "t;f\n0;1,5\n1;-2,5\n", "t;f\n0;1.5\n1;-2.5\n", "t\tf\r\n0\t1.5\r\n1\t-2.5\r\n",
    "t\tf\n0\t1,5\n1\t-2,5\n", "t|f\n0|1.5\n1|-2.5\n", "t f\n 0   1.5\n 1  -2.5\n", "t   f\n0   1,5\n1   -2,5\n",
    '"t","f"\n"0","1.5"\n"1","-2.5"\n', "t;f;\n0;1,5;\n1;-2,5;\n", "# t, f\n0, 1.5\n1, -2.5\n",
    "t,f\n\n0,1.5\n\n1,-2.5\n", "Date: 3.4.2026\nOperator,Smith,Jones\n\nt,f\n0,1.5\n1,-2.5\n", "t,f\r0,1.5\r1,-2.5\r",
    "Title,\n\nt,f\n0,1.5\n1,-2.5\n", "\ufefft,f\n0,1.50e0\n1,-25E-1\n",
])  # fmt: skip
def test_two_columns_in_many_layouts(file, text):
    found = read(file(text))
    np.testing.assert_array_equal(found["t"].values, [0, 1])
    np.testing.assert_array_equal(found["f"].values, [1.5, -2.5])


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16", "utf-8-sig"])
def test_encodings(file, encoding):
    found = read(file("Zeit;Kraft längs\nms;µm\n0;1,5\n1;2,5\n", encoding=encoding))
    np.testing.assert_array_equal(found["Kraft längs"].values, [1.5, 2.5])
    assert found["Kraft längs"].unit == "µm"
    assert any("Windows-1252" in note for note in found.notes) == (encoding == "cp1252")


def test_names_of_several_lines_and_a_line_of_units(file):
    found = read(file("IMU,IMU,Rig\ngyro_x,acc_y,Fy\ndeg/s,g,kN\n1,2,3\n4,5,6\n"))
    assert {name: signal.unit for name, signal in found.signals.items()} == {
        "IMU.gyro_x": "deg/s", "IMU.acc_y": "g", "Rig.Fy": "kN",
    }  # fmt: skip
    np.testing.assert_array_equal(found["gyro_x"].values, [1, 4])
    np.testing.assert_array_equal(found["Rig.Fy [kN]"].values, [3, 6])


def test_a_title_padded_by_a_spreadsheet_is_no_name(file):
    found = read(file("Run 7;;;\nt;f;g;h\ns;;N;\n0;1;2;3\n1;2;3;4\n"))
    assert [(s.name, s.unit) for s in found.signals.values()] == [("t", "s"), ("f", ""), ("g", "N"), ("h", "")]
    assert found.notes == ("lines above the names of the columns that were passed over: 1",)


def test_units_in_brackets(file):
    found = read(file("Fy [N],a (m/s²),T [-],slip (left),\n1,2,3,4,5\n2,3,4,5,6\n"))
    assert {name: signal.unit for name, signal in found.signals.items()} == {
        "Fy": "N", "a": "m/s²", "T": "-", "slip (left)": "", "column 5": "",
    }  # fmt: skip


def test_lines_that_are_told(file):
    path = file("1,2,3\nt,f,g\n7,8,9\ns,N,N\n0,1,2\n1,2,3\n")
    found = read(path, names_line=2, units_line=4, first_line=5)
    assert [(signal.name, signal.unit) for signal in found.values()] == [("t", "s"), ("f", "N"), ("g", "N")]
    np.testing.assert_array_equal(found["f"].values, [1, 2])


def test_missing_samples_are_nan(file):
    found = read(file("t;f\n0;1,5\n1;\n2;NaN\n3;NA\n4;-\n5;2\n"))
    np.testing.assert_array_equal(found["f"].values, [1.5, np.nan, np.nan, np.nan, np.nan, 2])


def test_dates_become_seconds(file):
    lines = [f"2026-03-01T12:00:0{second}.250,{second}" for second in range(5)]
    found = read(file("time,f\n" + "\n".join(lines) + "\n"))
    np.testing.assert_array_equal(found["time"].values, [0, 1, 2, 3, 4])
    assert found["time"].unit == "datetime"
    with pytest.raises(InputError, match="line 90: time = '2026-13-01T00:00:00' is not a date and time"):
        read(file("time,f\n" + "2026-03-01T12:00:00,1\n" * 88 + "2026-13-01T00:00:00,1\n"))


def test_unmapped_columns_may_hold_anything(file):
    path = file('t,note,f\n0,ok,1\n1,"a, b",2\n2,,3\n3,x,4\n')
    found = read_signals(path, map=ChannelMap().with_channels(["time=t s", "f=f N"]))
    np.testing.assert_array_equal(found["f"].values, [1, 2, 3, 4])
    assert set(found.signals) == {"t", "f"}


def test_the_last_line_without_an_end_is_left_out_and_said(file):
    found = read(file("t,f\n0,100\n1,200\n2,30"))
    np.testing.assert_array_equal(found["f"].values, [100, 200])
    assert found.notes == ("line 4, the last one, has no line end and may be cut off: rejected",)


@pytest.mark.parametrize(("text", "words"), [
    ("t,f\n0,1\n1,x\n2,3\n3,4\n", "line 3: f = 'x' is not a finite number"),
    ("t,f\n0,1\n1,inf\n2,3\n3,4\n", "line 3: f = 'inf' is not a finite number"),
    ("t,f\n0,1\n1,1_0\n2,3\n3,4\n", "line 3: f = '1_0' is not a finite number"),
    ("t,f\n0,1\n1,３\n2,3\n3,4\n", "line 3: f = '３' is not a finite number"),
    ("t,f\n0,1\n1\n2,3\n3,4\n", r"line 3: 1 cells where others have 2; was the file cut off\?"),
    ("t,f\n0,1\n1,2,3\n2,3\n3,4\n", "line 3: 3 cells where others have 2; is the delimiter inside"),
    (
        "t,f,g\n0,1,2\n1,2,3,4\n2,3\n3,4,5\n4,5,6\n",
        "line 3: 4 cells where others have 3",
    ),  # as many as there should be
    ("t,f\n0,x\n1,2\n2,3\n3,4\n4,5\n", "line 2: names of columns were expected above the samples, it holds '0'"),
    (
        "t;f\n0;1,5\n1;1.234\n2;2,5\n3;3,5\n",
        "line 3: f = '1.234' has a decimal point in a table with decimal commas",
    ),
    ("names\n0,1\n1,2\n", "line 1: 1 cells above samples of 2 columns; no names of columns were found"),
    ("", "the file is empty"), ("\n\n", "the file is empty"),
    ("hello\nworld\n", "no table of numbers was found in its lines"),
    (b"t,f\n0,1\0\n", "no text table"),
    ("t,f\n0,1", "has names of columns but no samples"),
])  # fmt: skip
def test_what_is_refused(file, text, words):
    refuses(words, read, file(text))


@pytest.mark.parametrize(("reading", "words"), [
    ({"names_line": 3, "first_line": 2}, "names_line = 3 must be above the samples"),
    ({"names_line": 1, "first_line": 3, "units_line": 2}, "line 2: 1 units where there are 2 columns"),
    ({"names_line": 2, "first_line": 3}, "1 names of columns where the samples have 2 columns"),
])  # fmt: skip
def test_lines_that_are_told_wrong(file, reading, words):
    path = file("t,f\ns\n0,1\n1,2\n2,3\n3,4\n")
    refuses(words, contents, path, reading=Reading(**reading))


def test_files_that_are_no_files(tmp_path):
    refuses("no such recording", contents, tmp_path / "a.csv")
    (tmp_path / "b.csv").mkdir()
    refuses("is a folder; give files: ", contents, tmp_path / "b.csv")
    refuses(r"recordings end in \.csv, .*, not in '\.docx'", contents, tmp_path / "a.docx")


@settings(max_examples=40)
@given(
    rows=st.lists(st.tuples(*[st.floats(-1e9, 1e9, allow_subnormal=False) for _ in range(3)]), min_size=2, max_size=40),
    delimiter=st.sampled_from([";", "\t", "|"]), decimal=st.sampled_from(".,"), units=st.booleans(),
)  # fmt: skip
def test_every_number_is_read_as_it_was_written(tmp_path_factory, rows, delimiter, decimal, units):
    path = tmp_path_factory.mktemp("h") / "a.csv"
    text = delimiter.join(["alpha", "beta", "gamma"]) + "\n" + (delimiter.join(["s", "N", "deg"]) + "\n") * units
    text += "".join(delimiter.join(repr(x).replace(".", decimal) for x in row) + "\n" for row in rows)
    path.write_text(text)
    found = read_signals(path)
    for name, column in zip(("alpha", "beta", "gamma"), zip(*rows, strict=True), strict=True):
        np.testing.assert_array_equal(found[name].values, column)
    assert found["beta"].unit == ("N" if units else "")


def test_large_files_are_read_in_blocks(file, monkeypatch):
    """Four blocks: the lines that lie across their ends are whole."""
    monkeypatch.setattr("tyre.formats.csv.BLOCK", 1 << 16)
    count = 20_000
    text = "t;f\nms;N\n" + "".join(f"{k};{k / 10}\n" for k in range(count)).replace(".", ",")
    assert len(text) > 3 << 16
    found = read(file(text))
    np.testing.assert_array_equal(found["f"].values, np.arange(count) / 10)
    assert found["f"].unit == "N"
    torn = read(file(text.replace("19900;1990,0", "19900;x")))
    assert torn["f"].values.size == count - 1
    assert "treated as missing samples: 1, the first line 19903: f = 'x' is not" in torn.notes[0]


def test_a_delimiter_at_the_end_of_each_line_is_no_column(file):
    """It must not make blanks, with a comma for a decimal sign at the end of each number, the better delimiter."""
    found = read(file("t, f,\n0, 1,\n1, 2,\n2, 5,\n"))
    assert set(found.signals) == {"t", "f"}
    np.testing.assert_array_equal(found["f"].values, [1, 2, 5])


DAMAGE = {
    "zeros": b"\0" * 40, "a zero in a number": b"4.4,0.9\x0000,0.3", "a zero at the end": b"4.4,0.94,-0.88\0",
    "no UTF-8": b"\xff\xfe\xfd\x80,\x81\x82", "a degree sign of Windows": b"4.4\xb00,0.94,0.3",
    "a line end": b"4.4\r0,0.94,0.3", "a quote": b'4.4,"0.94,0.3', "another mark": b"4;4;4;4;4",
    "lines of Unicode": "4.4\u2028\x85\x1c0,0.9,0.3".encode(), "too many cells": b"1,2,3,4,5,6",
    "infinity": b"inf,0.1,0.2", "too large": b"4.4,1e999,0.3", "another base": b"0x1F,0.1,0.2",
    "other digits": "٤.٤,0.9,0.3".encode(), "words": b"ERROR,SENSOR,LOST", "two points": b"4.40.2,0.94,-0.3",
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGE)
def test_one_damaged_line_in_200_counts_as_missing_whatever_it_holds(file, damage):
    """The lines around it, their units and their numbers stay."""
    rows = [f"{0.02 * k:.6f},{0.001 * k + 0.5:.6f},{-0.002 * k:.6f}".encode() for k in range(200)]
    for at in (2, 120, 198):
        lines = [*rows[:at], DAMAGE[damage], *rows[at + 1 :]]
        found = read(file(b"\n".join(["t (s),roll rate (°/s),a (m/s²)".encode(), *lines, b""])))
        there = np.delete(np.arange(200), at)
        np.testing.assert_array_equal(found["t"].values, np.round(0.02 * there, 6))
        np.testing.assert_array_equal(found["roll rate"].values, np.round(0.001 * there + 0.5, 6))
        assert [s.unit for s in found.signals.values()] == ["s", "°/s", "m/s²"]
        assert any(f"treated as missing samples: 1, the first line {at + 2}" in note for note in found.notes)
    refuses("line 4|zero bytes", read, file(b"\n".join([b"t,f,g", *rows[:2], DAMAGE[damage], *rows[3:150], b""])))


@pytest.mark.parametrize(("head", "names", "units"), [
    ("# made by bench\nt[s] x[N] y[m]", "t x y", "s N m"), ("t x y\n# sensor in deg/s", "t x y", "  "),
    ("t x y\n# s N mm", "t x y", "s N mm"), ("# t x y\n# s N mm", "t x y", "s N mm"),
    ("# t x y\ns N mm", "t x y", "s N mm"),
    ("# a log of 3 runs\n# t x y", "t x y", "  "), ("// t x y", "t x y", "  "),
    ("% one two three\n// four five six\nt x y\ns N mm", "t x y", "s N mm"),
    ("t x y\n# a remark, of more words than columns", "t x y", "  "), ("t x y\n# a remark\ns N mm", "t x y", "s N mm"),
])  # fmt: skip
def test_a_comment_is_no_part_of_names_or_units(file, head, names, units):
    found = read(file(f"{head}\n0 1.5 2\n1 2.5 3\n"))
    assert [s.name for s in found.signals.values()] == names.split(" ")
    assert [s.unit for s in found.signals.values()] == units.split(" ")


@pytest.mark.parametrize(("head", "rates"), [
    ("// Sample rate: 100 Hz", [100]), ("// Update Rate: 100.0Hz", [100]), ("Sampling Frequency [Hz];0,25", [0.25]),
    ("sampling rate = 1 kHz", [1000]), ("Abtastrate: 100 Hz", [100]), ("fs = 200", [200]),
    ("Sample interval (ms): 20", [50]),
    ("Data rate: 115200 baud", []), ("Filter frequency: 20 Hz", []), ("update rate: 5", []), ("Sample no 12", []),
    ("sample rate 100 Hz\nGPS update rate 5 Hz\nSample rate: 100", [100, 5]),
])  # fmt: skip
def test_rates_that_a_header_states(file, head, rates):
    assert list(contents(file(f"{head}\nt;f\n0;1,5\n1;2,5\n")).rates) == pytest.approx(rates)
