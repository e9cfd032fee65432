"""How many columns of a legend fit under a figure, as matplotlib fills them: by column, the first ones longer."""

from matplotlib.figure import Figure

from studies.reporting.plotting import legend_columns

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
