"""Figures of the gap between measurement and models: residuals, and measured values with what the models say."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.inference.forward import Rows
from studies.inference.judge import Judgement
from studies.missing_effect.interface import Figure
from studies.missing_effect.reporting.words import titles
from studies.reporting.plotting import GREY, drawing, look

MOST_SERIES = 8  # panels; of more, the residuals are summed by channel
CROWDED = 10  # rows at one place, more are samples of recordings: the same
MOST_LETTERS = 40  # of the names of the conditions below one panel


def residuals(judgement: Judgement) -> dict[str, NDArray[np.float64]]:
    """Whitened residuals (n,) of the models of a ``judgement`` that differ, by what they are called."""
    every = {
        "nominal": judgement.nominal, "nuisance_only": judgement.hypotheses.null.residual,
        "final": judgement.final.residual,
    }  # fmt: skip
    return {title: every[model] for model, title in titles(judgement).items()}


def panels(figure: Any, count: int) -> Any:
    """A number ``count`` of axes in two columns of a matplotlib ``figure``."""
    columns = 1 if count == 1 else 2
    axes = figure.subplots(-(-count // columns), columns, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.remove()
    return axes[:count]


def legend_above(figure: Any, axis: Any, *, columns: int) -> None:
    """One legend for a whole ``figure``, of the curves of one ``axis``, in a number ``columns`` of columns."""
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=columns)


def shown_series(judgement: Judgement) -> list[str]:
    """The series of a ``judgement`` whose residuals are shown one by one; empty where they are summed by channel."""
    rows = judgement.forward.rows
    names = list(dict.fromkeys(rows.series))
    series = np.array(rows.series)
    samples = max(int(np.unique(rows.abscissa[series == name], return_counts=True)[1].max()) for name in names)
    if rows.one_axis and (len(names) > MOST_SERIES or samples > CROWDED):
        return []
    if not rows.condition and not rows.one_axis:  # recordings: those with the largest gap
        names = sorted(names, key=lambda name: -float((judgement.nominal[series == name] ** 2).mean()))[:MOST_SERIES]
    return names


def rms_by_channel(judgement: Judgement) -> dict[str, tuple[list[float], dict[str, list[float]]]]:
    """Channel -> places on the abscissa, and the rms there of what each model of a ``judgement`` leaves."""
    rows, found = judgement.forward.rows, {}
    channel = rows.channels
    for name in dict.fromkeys(channel.tolist()):
        places = np.unique(rows.abscissa[channel == name]).tolist()
        here = [(channel == name) & (rows.abscissa == x) for x in places]
        rms = {
            title: [float(np.sqrt((gap[inside] ** 2).mean())) for inside in here]
            for title, gap in residuals(judgement).items()
        }
        found[name] = (places, rms)
    return found


def draw_gap(judgement: Judgement, target: Path) -> bool:
    """Residuals of each series of a ``judgement``, into the file ``target`` without ending."""
    rows = judgement.forward.rows
    names, series = shown_series(judgement), np.array(rows.series)
    if not names:
        return _gap_by_channel(judgement, target)
    with drawing(target, width=8, height=1.2 + 2.3 * -(-len(names) // 2)) as figure:
        for axis, name in zip(panels(figure, len(names)), names, strict=True):
            here = series == name
            axis.axhspan(-2, 2, color="0.92", zorder=0)
            for k, (title, gap) in enumerate(residuals(judgement).items()):
                style = {**look(k).plot, "linestyle": "none", "markersize": 4}
                axis.plot(rows.abscissa[here], gap[here], label=title, **style)
            axis.set(title=name, ylabel="gap / sd")
            _label_abscissa(axis, rows, name)
        legend_above(figure, axis, columns=3)
    return True


def _gap_by_channel(judgement: Judgement, target: Path) -> bool:
    """Root mean square of the residuals of each channel over speed: for histories, with too many samples to show."""
    rows, found = judgement.forward.rows, rms_by_channel(judgement)
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    with drawing(target, width=8, height=1.2 + 2.3 * -(-len(found) // 2)) as figure:
        for axis, (name, (places, values)) in zip(panels(figure, len(found)), found.items(), strict=True):
            axis.axhline(1, color="k", linestyle=":", linewidth=1)
            for k, (title, rms) in enumerate(values.items()):
                axis.plot(places, rms, label=title, **look(k).plot)
            axis.set(title=name, xlabel=rows.axis, ylabel="rms gap / sd", yscale="log")
            axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0)))
            axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.yaxis.set_minor_formatter(NullFormatter())
        legend_above(figure, axis, columns=3)
    return True


def draw_before_after(judgement: Judgement, target: Path) -> bool:
    """Measured values with 95 % intervals and the models, of a forward model with ``measured`` values and their sd.

    Parameters
    ----------
    judgement : Judgement
    target : Path
        The file without its ending.
    """
    rows = judgement.forward.rows
    names, series = list(dict.fromkeys(rows.series)), np.array(rows.series)
    measured, sd = judgement.forward.measured  # type: ignore[attr-defined]
    with drawing(target, width=8, height=1.2 + 2.5 * -(-len(names) // 2)) as figure:
        for axis, name in zip(panels(figure, len(names)), names, strict=True):
            here = np.flatnonzero(series == name)
            here = here[np.argsort(rows.abscissa[here])]
            axis.errorbar(
                rows.abscissa[here], measured[here], 1.96 * sd[here], fmt="o", color="k", ecolor=GREY, markersize=3,
                elinewidth=0.8, label="measured, 95 %",
            )  # fmt: skip
            for k, (title, gap) in enumerate(residuals(judgement).items()):
                computed = measured[here] - sd[here] * gap[here]
                style = {"linestyle": "none", "markersize": 4} if rows.condition else {"marker": ""}
                axis.plot(rows.abscissa[here], computed, **{**look(k).plot, **style}, label=title)
            axis.set(title=rows.show(name).channel, ylabel=rows.show(name).quantity)
            _label_abscissa(axis, rows, name)
        legend_above(figure, axis, columns=4)
    return True


def _label_abscissa(axis: Any, rows: Rows, series: str) -> None:
    if not rows.condition:
        axis.set_xlabel(rows.show(series).axis or rows.axis)
        return
    crowded = sum(map(len, rows.condition)) > MOST_LETTERS
    turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
    axis.set_xticks(range(len(rows.condition)), rows.condition, fontsize=8, **turned)
    axis.set_xlim(-0.5, len(rows.condition) - 0.5)
    axis.grid(visible=False, axis="x")


CAPTION = (
    "Where the gap is: (measured − computed) / sd. Noise alone stays within the grey band (±2); where a panel has the "
    "root mean square of many samples in its place, near the dotted line (1)."
)
GAP: Figure = (draw_gap, CAPTION)
BEFORE_AFTER: Figure = (draw_before_after, "Measured values with 95 % intervals, and the models.")
