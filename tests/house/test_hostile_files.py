"""Small valid files that ask for much are refused in words within a second of processor time."""

import re
import time

import pytest

from bicycle import load_bicycle
from tests.shared.refusals import refuses
from tyre import read_tyre
from tyre.formats import contents, read_sheet


def read_as_sheet(path):
    return read_sheet(path, kind="bicycles")


WIDE = ",".join(f"c{k}" for k in range(100_000)) + "\n" + "1," * 99_999 + "1\n"
WORDS = "time,a\n" + "".join(f"{k},{'1' * 100_000}\n" for k in range(3))
TEXTS = {
    "wide": (WIDE, r"line 1: 2?[0-9]{2},[0-9]{3} characters in a line, at most 200,000 are read|688,889 characters"),
    "many cells": ("," * 150_000 + "\n1\n", "line 1: 150,001 cells in a line, at most 10,000 are read; remove"),
    "long words": (WORDS, "line 2: '1{20}'... has 100,000 characters, at most 1,000 are read of a number or a word"),
    "one line": ("1," * 1_500_000 + "1\n", "line 1: .* characters in a line, at most 200,000 are read; is it a table"),
    "one cell": (
        "time,a\n0,1" + ",111" * 40_000 + "\n1,2\n",
        "line 2: 40,002 cells in a line|in a line, at most 200,000",
    ),
}


@pytest.mark.parametrize("reader", [contents, read_as_sheet, read_tyre, load_bicycle])
@pytest.mark.parametrize("name", TEXTS)
def test_a_text_table_of_huge_lines(tmp_path, name, reader):
    text, words = TEXTS[name]
    (path := tmp_path / "a.csv").write_text(text)
    start = time.process_time()
    refuses(words, reader, path)
    assert time.process_time() - start < 1.0


def test_a_table_of_more_columns_than_people_make(tmp_path):
    header = ",".join(f"c{k}" for k in range(1_001))
    (path := tmp_path / "a.csv").write_text(f"{header}\n{'1,' * 1_000}1\n")
    refuses("holds 1,001 columns; a table of bicycles has at most 1,000", read_as_sheet, path)


def aliases(levels=20):
    """Each mapping names the one above three times: 3^20 entries in some lines."""
    lines = ["a0: &a0 {x: 1, y: 1}"]
    for n in range(1, levels):
        lines.append(f"a{n}: &a{n} {{x: *a{n - 1}, y: *a{n - 1}, z: *a{n - 1}}}")
    return "\n".join(lines)


YAMLS = {
    "aliases": (aliases(), "more than 50 deep, or hold 1000000 things|tables, more than 5 deep"),
    "itself": ("&a\nx: *a\n", "more than 5 deep|more than 50 deep"),
    "deep": ("a: " + "[" * 1_000 + "]" * 1_000, "not a YAML file: maximum recursion depth exceeded"),
    "deep mappings": ("".join(" " * k + "k:\n" for k in range(1_000)), "not a YAML file: maximum recursion depth"),
    "aliases in a list": ("bodies: &a [*a, *a]\n", "recursive|more than 50 deep|unknown key"),
    "digits": ("w: " + "1" * 5_000, "has 5000 characters; give fewer digits|unknown key 'w'|not a YAML file: Exceeds"),
    "digits in a list": ("parameters: [" + "1" * 5_000 + "]", "parameters: Exceeds the limit|not a YAML file: Exceeds"),
}


@pytest.mark.parametrize("reader", [read_tyre, load_bicycle])
@pytest.mark.parametrize("name", YAMLS)
def test_a_yaml_file_that_means_more_than_it_says(tmp_path, name, reader):
    text, words = YAMLS[name]
    (path := tmp_path / "a_p300.yml").write_text(text)
    start = time.process_time()
    refuses(words, reader, path)
    assert time.process_time() - start < 3.0  # a million things are looked at


@pytest.mark.parametrize(("name", "text"), [
    ("a.txt", "w = {}\n"), ("a.json", '{{"w": {}}}'), ("a.toml", "w = {}\n"),
    ("a.csv", "load_N,pressure_bar,C [N/deg],K [N/mm]\n{},2,3,4\n"),
    ("a.tir", "[A]\nFNOMIN = {}\nPKY1 = 1\nPKY2 = 2\n"),
])  # fmt: skip
def test_a_number_of_five_thousand_digits(tmp_path, name, text):
    (path := tmp_path / name).write_text(text.format("1" * 5_000))
    refuses(
        "digits|characters|not a number", load_bicycle if name.endswith(("txt", "json", "toml")) else read_tyre, path
    )


def test_a_message_about_a_huge_line_is_short(tmp_path):
    (path := tmp_path / "a.txt").write_text(re.sub("[:=]", " ", WIDE))
    with pytest.raises(Exception, match="is no 'key : value'") as caught:
        load_bicycle(path)
    assert len(str(caught.value)) < 300
