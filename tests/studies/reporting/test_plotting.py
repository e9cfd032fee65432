"""Figures: columns of a legend as matplotlib fills them (the first ones longer), one layout for all formats."""

from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from studies.reporting.plotting import drawing, legend_columns

LABELS = ["wobble", "weave", "capsize", "stable", "1 unstable root", "2 unstable roots", "3 unstable roots",
          "4 unstable roots", "thin: unstable on both sides", "95 % band, first order", "the model"]  # fmt: skip


def test_a_legend_of_many_labels_stays_within_its_figure():
    for width in (5.0, 7.0, 9.6, 14.0):
        columns = legend_columns(LABELS, width=width)
        figure = Figure(figsize=(width, 6))
        lines = [figure.add_subplot().plot([], [], label=label)[0] for label in LABELS]
        legend = figure.legend(handles=lines, loc="lower center", ncols=columns, fontsize=8.5)
        figure.draw_without_rendering()
        assert legend.get_window_extent().width <= width * figure.dpi
        assert columns > 1


def test_few_labels_stand_in_one_row():
    assert legend_columns(["a", "b"], width=8.0) == 2


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
