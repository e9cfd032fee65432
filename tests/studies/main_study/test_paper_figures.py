"""Redraws of the paper's figures show the printed values and say which tables they come from."""

from contextlib import contextmanager

import numpy as np
import pytest
from matplotlib.figure import Figure

from studies.main_study import paper_figures
from studies.main_study.paper_figures import FIGURES, TABLES, draw_over_load, draw_step_response, step_condition
from tyre import TyreMap


@pytest.fixture
def canvas(monkeypatch):
    figure = Figure()

    @contextmanager
    def drawing(target, *, width, height):
        yield figure

    monkeypatch.setattr(paper_figures, "drawing", drawing)
    return figure


def lines(figure) -> dict[str, np.ndarray]:
    """Label -> points of each curve."""
    (axes,) = figure.axes
    return {c.get_label(): c.lines[0].get_xydata() for c in axes.containers}


def test_figures_and_their_tables():
    tables = {figure.number: figure.tables for figure in FIGURES}
    assert tables == {
        5: [2, 4, 6, 8], 6: [4, 5, 8, 9], 9: [2, 3], 10: [2, 4], 11: [4, 5], 12: [6, 7], 13: [6, 8], 14: [8, 9]
    }  # fmt: skip


def test_relaxation_length_figure_shows_the_table_with_3_mm(canvas, tmp_path):
    draw_over_load(next(figure for figure in FIGURES if figure.number == 13), tmp_path / "f")
    found = lines(canvas)
    assert found["Tyre1 flat, 3.5 bar"][:, 1] == pytest.approx([134.0, 141.5, 140.9])  # Table 6
    assert found["Tyre2 flat, 5.5 bar"][:, 1] == pytest.approx([121.1, 81.7, 82.1])  # Table 8
    assert found["Tyre1 flat, 3.5 bar"][:, 0] == pytest.approx([340, 400, 490])
    assert found["Tyre2 flat, 5.5 bar"][:, 0] == pytest.approx([342, 402, 492])
    for container in canvas.axes[0].containers:
        (bars,) = container.lines[2]
        assert [np.ptp(s[:, 1]) / 2 for s in bars.get_segments()] == pytest.approx(3 * [3.0], abs=0.2)
    assert canvas.get_supxlabel().startswith("Redrawn from Tables 6 and 8 of Dell'Orto")


def test_lateral_stiffness_is_cornering_stiffness_over_relaxation_length(canvas, tmp_path):
    draw_over_load(next(figure for figure in FIGURES if figure.number == 6), tmp_path / "f")
    printed = np.degrees([103.6, 111.5, 120.0]) / [187.3, 192.2, 198.5]  # Tables 5 and 9, 3.5 bar: N/rad over mm
    assert lines(canvas)["Tyre3 flat, 3.5 bar"][:, 1] == pytest.approx(printed)
    assert "cornering stiffness over relaxation length" in canvas.get_supxlabel()


def test_step_response_reaches_63_percent_after_one_relaxation_length(canvas, tmp_path):
    draw_step_response(tmp_path / "f")
    axes = canvas.axes[0]
    marks = [line.get_xydata()[0] for line in axes.lines if len(line.get_xydata()) == 1]
    speed = 9.3 / 3.6
    times = np.array([106.0, 81.7, 115.5]) / speed  # Tables 6, 8, 9 at 400 N, 5.5 bar: mm over m/s = ms
    assert np.array(marks) == pytest.approx(np.column_stack([times, np.full(3, 0.632121)]), abs=1e-5)
    for curve, mark in zip([line for line in axes.lines if len(line.get_xydata()) > 100], marks, strict=True):
        assert np.interp(mark[0], *curve.get_xydata().T) == pytest.approx(mark[1], abs=1e-3)


def test_step_condition_is_a_row_of_the_table():
    assert step_condition(TyreMap.load("Tyre3").table, 490.0, 7.5) == pytest.approx(0.1633)
    assert len(TABLES) == 4


def test_saved_figures_do_not_differ_between_runs(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        draw_over_load(FIGURES[0], tmp_path / folder / "f")
    for suffix in ("png", "svg"):
        assert (tmp_path / "a" / f"f.{suffix}").read_bytes() == (tmp_path / "b" / f"f.{suffix}").read_bytes()
