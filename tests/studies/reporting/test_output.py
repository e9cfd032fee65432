"""Speeds from text, tables on the screen, CSV and JSON to a file or to standard output, versions, figures."""

import io
import json
import math
import time
from importlib.metadata import version

import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from bicycle import Model, load_bicycle
from studies.reporting import (
    check_targets,
    count_seconds,
    drawing,
    legend_columns,
    made_by,
    parse_speeds,
    print_critical,
    print_table,
    version_of,
    write_csv,
    write_json,
)
from tests.shared.refusals import refuses
from tyre.ground import InputError


def test_both_ends_of_a_speed_range_are_included():
    assert parse_speeds("0:1:0.25").tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert parse_speeds("0:1:0.3").tolist() == [0.0, 0.3, 0.6, 0.9, 1.0]
    assert parse_speeds("5:5:1").tolist() == [5.0]


@pytest.mark.parametrize("text", ["", "fast", "0:10", "1,,2"])
def test_what_is_no_list_of_speeds(text):
    refuses(r"speeds '.*': give start:stop:step, for example 0:20:0.5, or a list such as", parse_speeds, text)


@pytest.mark.parametrize("text", ["0:10:0", "5:0:1", "0:10:-1"])
def test_ranges_that_lead_nowhere(text):
    refuses(rf"speeds '{text}': the step must be positive and stop >= start", parse_speeds, text)


def test_tables_have_four_digits_and_dashes(capsys):
    print_table([["weave", 4.292382536, None]], ["mode", "speed m/s", "note"])
    head, rule, row = capsys.readouterr().out.splitlines()
    assert head.split() == ["mode", "speed", "m/s", "note"]
    assert set(rule) <= {"-", " "}
    assert row.split() == ["weave", "4.292", "-"]


def test_csv_has_all_digits_and_json_no_infinity(tmp_path, capsys):
    table = pd.DataFrame({"speed_m_s": [1 / 3]})
    write_csv(table, tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_bytes() == b"speed_m_s\n0.3333333333333333\n"
    write_csv(table, "-")
    write_json({"a": [1.5]}, "-")
    shown = capsys.readouterr().out
    assert shown.startswith("speed_m_s\n0.3333333333333333\n")
    assert json.loads(shown.partition("{")[1] + shown.partition("{")[2]) == {"a": [1.5]}
    refuses("nothing is written: a came out as inf", write_json, {"a": float("inf")}, "-")
    refuses("is no file name; give a file, or - for standard output", write_json, {}, "")


def test_what_never_becomes_unstable_is_said(capsys, monkeypatch):
    monkeypatch.setattr("studies.reporting.analysis.unstable_modes", lambda model, speed: ())  # no packaged bicycle is
    models = {name: Model(load_bicycle("benchmark")).linear_model() for name in ("", "a")}
    print_critical({"": ()}, models, max_speed=3.0)
    assert capsys.readouterr().out == ("no critical speed up to 3 m/s: stable throughout\n")
    print_critical({"a": ()}, models, max_speed=3.0)
    assert capsys.readouterr().out.splitlines()[-1].endswith("not unstable throughout")


@pytest.mark.parametrize(("target", "write", "form"), [
    ("t.xlsx", lambda target: write_csv(pd.DataFrame({"a": [1.0]}), target), "CSV; give a name that ends in .csv"),
    ("t.JSON", lambda target: write_csv(pd.DataFrame({"a": [1.0]}), target), "CSV; give a name that ends in .csv"),
    ("t.csv", lambda target: write_json({"a": 1.0}, target), "JSON; give a name that ends in .json"),
    ("t.parquet", lambda target: check_targets(csv=None, out=target), "CSV; give a name that ends in .csv"),
    ("t.csv", lambda target: check_targets(json=target), "JSON; give a name that ends in .json"),
])  # fmt: skip
def test_a_name_of_another_format_is_refused(target, write, form, tmp_path):
    refuses(f"{target}: what is written is {form}", write, str(tmp_path / target))
    assert not list(tmp_path.iterdir())
    check_targets(csv=str(tmp_path / "t.txt"), json=str(tmp_path / "t"))  # a name that says no other format


@pytest.mark.parametrize(("content", "name"), [
    ({"a": math.nan}, "a came out as nan"),
    ({"a": {"b": [1.0, (2.0, math.inf)]}}, "a.b[1][1] came out as inf"),
    ({"a": [{"b": -math.inf}]}, "a[0].b came out as -inf"),
])  # fmt: skip
def test_what_is_no_number_is_refused_by_its_name(content, name, tmp_path):
    with pytest.raises(InputError) as found:
        write_json(content, str(tmp_path / "a.json"))
    assert str(found.value).startswith(f"nothing is written: {name}, which is no result")
    assert list(tmp_path.iterdir()) == []


def test_the_version_is_the_installed_one():
    assert made_by() == f"\n\nMade by velotyre {version('velotyre')}.\n"
    assert version_of("numpy") == version("numpy")


def test_a_command_that_takes_long_counts_its_seconds_on_a_terminal(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    for screen, shows in ((Terminal(), True), (io.StringIO(), False)):
        monkeypatch.setattr("sys.stderr", screen)
        with count_seconds(after=0.05, interval=0.02):
            time.sleep(0.2)
        assert ("velotyre: 0 s" in screen.getvalue()) == shows
        assert screen.getvalue().endswith("\r\x1b[K" if shows else "")
    monkeypatch.setattr("sys.stderr", quick := Terminal())
    with count_seconds(after=5.0):
        pass
    assert quick.getvalue() == ""


LABELS = ["wobble", "weave", "capsize", "stable", "1 unstable root", "2 unstable roots", "3 unstable roots",
          "4 unstable roots", "thin: unstable on both sides", "95 % band, first order", "the model"]  # fmt: skip


def test_a_legend_of_many_labels_stays_within_its_figure():
    for width in (5.0, 7.0, 9.6, 14.0):
        columns = legend_columns(LABELS, width=width)
        figure = Figure(figsize=(width, 6))
        axes = figure.add_subplot()
        lines = [axes.plot([], [], label=label)[0] for label in LABELS]
        legend = figure.legend(handles=lines, loc="lower center", ncols=columns, fontsize=8.5)
        figure.draw_without_rendering()
        assert legend.get_window_extent().width <= width * figure.dpi
        assert columns > 1


def test_a_figure_is_laid_out_once_for_all_formats(tmp_path, monkeypatch):
    laid_out, of_matplotlib = [], ConstrainedLayoutEngine.execute

    def execute(engine, figure):
        laid_out.append(figure)
        return of_matplotlib(engine, figure)

    saved, of_figure = [], Figure.savefig

    def savefig(figure, *given, **named):
        of_figure(figure, *given, **named)
        saved.append(len(laid_out))

    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", execute)
    monkeypatch.setattr(Figure, "savefig", savefig)
    with drawing(tmp_path / "one", width=4, height=3) as canvas:
        canvas.subplots().plot([1, 2])
    first, second = saved
    assert first == second > 0
    assert {file.name for file in tmp_path.iterdir()} == {"one.png", "one.svg"}
