"""A stability chart as a figure: shaded regions, boundaries by mode, bands, marks, frequency along boundaries."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bicycle.stability.mode_figure import mode_look, mode_words
from studies.chart.chart import NamedBoundary, StabilityChart, band_of, contour_values
from studies.chart.plane import LOAD, MODEL, PRESSURE, TYRE, lattice
from studies.model_space.outputs import Output
from studies.reporting.output import write_csv
from studies.reporting.plotting import EXTRAPOLATED, GREY, drawing, legend_columns
from tyre.ground.arrays import Array

SHADES = ("#ffffff", "#f6dedb", "#ecc4be", "#dfa49c", "#cd857b", "#b8685e")
MORE = f"{len(SHADES) - 1} or more"
WIDTH = 9.6  # inches
MARKERS = {MODEL: "P", PRESSURE: "o", LOAD: "s", TYRE: "D"}


def draw_chart(chart: StabilityChart, target: Path, *, title: str, contours: Output | None = None) -> None:
    """Draw a chart with the frequency along its boundaries beside it."""
    waves, below = any(not curve.real for curve in chart.curves), _along_first(chart)
    with drawing(target, width=WIDTH, height=7.6 if below and waves else 6.2) as canvas:
        beside = None
        if not waves:
            axes = canvas.subplots()
        elif below:
            axes, beside = canvas.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (2.6, 1)})
        else:
            axes, beside = canvas.subplots(1, 2, sharey=True, gridspec_kw={"width_ratios": (2.6, 1)})
        _regions(axes, chart)
        _hatched(axes, chart)
        if contours is not None:
            _contours(axes, chart, contours, target)
        for one in chart.boundaries:
            if chart.uncertain and one.band_is_told:
                _band(axes, chart, one)
            _curve(axes, beside, chart, one, below)
        _marks(axes, chart)
        _axes(axes, beside, chart, below)
        _legend(canvas, axes, chart)
        canvas.suptitle(title, x=0.01, ha="left", fontsize=11)


def _along_first(chart: StabilityChart) -> bool:
    """True if the frequencies are best told along the first axis: boundaries run across more of it."""
    waves = [one.curve.shares for one in chart.boundaries if not one.curve.real]
    spread = np.sum([np.ptp(shares, axis=0) for shares in waves], axis=0) if waves else np.array([1.0, 0.0])
    return bool(spread[0] >= 0.5 * spread[1])


def _regions(axes: Any, chart: StabilityChart) -> None:
    edges = np.linspace(0, 1, 700 + 1)  # cells of the shading along each axis
    middle = (edges[1:] + edges[:-1]) / 2
    counts = np.clip(chart.regions(np.r_[0, middle], np.r_[0, middle])[1:, 1:], 0, len(SHADES) - 1)
    spans = chart.plane.spans
    axes.pcolormesh(
        spans[0].at(edges),
        spans[1].at(edges),
        counts.T,
        cmap=ListedColormap(SHADES),
        norm=BoundaryNorm(np.arange(len(SHADES) + 1) - 0.5, len(SHADES)),
        rasterized=True,
        zorder=0,
    )


def _hatched(axes: Any, chart: StabilityChart) -> None:
    """Hatch where the tyre is extrapolated."""
    share, spans = np.linspace(0, 1, 201), chart.plane.spans
    outside = ~chart.plane.space.inside(chart.plane.x(lattice(share, share))).reshape(201, 201)
    if outside.any():
        drawn = axes.contourf(
            spans[0].at(share),
            spans[1].at(share),
            outside.T.astype(float),
            levels=[0.5, 1.5],
            colors="none",
            hatches=[EXTRAPOLATED["hatch"]],
            zorder=0.6,
        )
        drawn.set_edgecolor("0.72")
        drawn.set_linewidth(0)


def _contours(axes: Any, chart: StabilityChart, output: Output, target: Path) -> None:
    share, values = contour_values(chart.plane, output)
    first, second = chart.plane.spans
    table = {
        first.axis.column: np.repeat(first.at(share), len(share)),
        second.axis.column: np.tile(second.at(share), len(share)),
        output.name: values.ravel(),
    }
    write_csv(pd.DataFrame(table), target.with_name(f"{target.name}_{output.name}.csv"))
    if np.isfinite(values).any() and np.nanmin(values) < np.nanmax(values):
        lines = axes.contour(
            first.at(share), second.at(share), values.T, levels=8, colors="0.4", linewidths=0.7, zorder=2
        )
        axes.clabel(lines, fontsize=7)
    axes.plot([], [], color="0.4", linewidth=0.7, label=output.title)


def _band(axes: Any, chart: StabilityChart, one: NamedBoundary) -> None:
    """Shade what is nearer to a boundary than 1.96 standard deviations of its nearest point."""
    share, inside = band_of(one.curve.shares, one.spread[:, 2])
    spans, colour = chart.plane.spans, mode_look(one.names[0] or "other").colour
    axes.contourf(
        spans[0].at(share),
        spans[1].at(share),
        inside.T,
        levels=[0, 1],
        colors=[colour],
        alpha=0.25,
        zorder=1,
        antialiased=True,
    )


def _curve(axes: Any, beside: Any, chart: StabilityChart, one: NamedBoundary, below: bool) -> None:  # noqa: FBT001
    for name, limit, points, hertz in one.pieces(chart.plane):
        style = mode_look(name or "other")
        line = {"color": style.colour, "linestyle": style.bare or style.line, "linewidth": 2.2 if limit else 1.2}
        axes.plot(*points.T, zorder=3, solid_capstyle="round", **line)
        if not one.curve.real and beside is not None:
            along = points[:, 0 if below else 1]
            beside.plot(*((along, hertz) if below else (hertz, along)), solid_capstyle="round", **line)


def _marks(axes: Any, chart: StabilityChart) -> None:
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.75}
    small: dict[str, Any] = {"fontsize": 7.5, "color": "0.25", "zorder": 7, "bbox": box}
    for mark in chart.marks:
        own, upright, level = mark.kind == MODEL, np.isnan(mark.y), np.isnan(mark.x)
        style: dict[str, Any] = {"color": "black" if own else GREY, "zorder": 8 if own else 6}
        style |= {"linewidth": 1.0, "linestyle": ":"} if upright or level else {"markeredgecolor": "white"}
        words = "" if own else mark.label
        if upright and not level:
            axes.axvline(mark.x, **style)
            axes.text(
                mark.x, 0.985, words, rotation=90, ha="right", va="top", transform=axes.get_xaxis_transform(), **small
            )
        elif level and not upright:
            axes.axhline(mark.y, **style)
            axes.text(0.985, mark.y, words, ha="right", va="bottom", transform=axes.get_yaxis_transform(), **small)
        elif not level:
            axes.plot(mark.x, mark.y, _marker(mark.kind), markersize=11 if own else 8, **style)
    named = [mark for mark in chart.marks if mark.kind != MODEL and not np.isnan(mark.x + mark.y)]
    if len(named) > 14:  # words beside so many points would cover each other
        return
    taken: list[Array] = []
    for mark in named:
        place = np.array([span.share(x) for span, x in zip(chart.plane.spans, (mark.x, mark.y), strict=True)])
        left, crowded = place[0] > 0.75, any((np.abs(place - other) < (0.16, 0.045)).all() for other in taken)
        taken.append(place)
        axes.annotate(
            mark.label,
            (mark.x, mark.y),
            (-6 if left else 6, -12 if crowded else 5),
            textcoords="offset points",
            ha="right" if left else "left",
            **small,
        )


def _marker(kind: str) -> str:
    return next(marker for name, marker in MARKERS.items() if kind.startswith(name))


def _axes(axes: Any, beside: Any, chart: StabilityChart, below: bool) -> None:  # noqa: FBT001
    first, second = chart.plane.spans
    axes.set(
        xlim=(first.low, first.high),
        ylim=(second.low, second.high),
        ylabel=second.axis.title,
        xscale="log" if first.log else "linear",
        yscale="log" if second.log else "linear",
    )
    axes.grid(visible=False)
    highest = 1.1 * max((float(one.frequency.max()) for one in chart.boundaries), default=1.0)
    if beside is None or not below:
        axes.set_xlabel(first.axis.title)
    if beside is not None and below:
        beside.set(xlabel=first.axis.title, ylabel="Frequency, Hz", ylim=(0, highest))
    elif beside is not None:
        beside.set(xlabel="Frequency, Hz", xlim=(0, highest))


def _legend(canvas: Any, axes: Any, chart: StabilityChart) -> None:
    handles: list[Any] = list(axes.get_legend_handles_labels()[0])
    for name in dict.fromkeys(name for one in chart.boundaries for name in one.distinct):
        style = mode_look(name or "other")
        handles.append(
            Line2D(
                [],
                [],
                color=style.colour,
                linestyle=style.bare or style.line,
                linewidth=2.0,
                label=mode_words(name) if name else "mode unknown",
            )
        )
    for count in np.unique(np.clip(chart.check.told, 0, len(SHADES) - 1)).tolist():
        words = "stable" if count == 0 else MORE if count == len(SHADES) - 1 else f"{count}"
        label = words if count == 0 else f"{words} unstable {'root' if count == 1 else 'roots'}"
        handles.append(Patch(facecolor=SHADES[count], edgecolor="0.6", linewidth=0.5, label=label))
    if any((one.beside != 0).any() for one in chart.boundaries):
        handles.append(Line2D([], [], color="0.3", linewidth=1.2, label="thin: unstable on both sides"))
    if chart.uncertain and any(one.band_is_told for one in chart.boundaries):
        handles.append(Patch(facecolor="0.45", alpha=0.3, label="95 % band, first order"))
    handles += [
        Line2D(
            [],
            [],
            color="black" if kind == MODEL else GREY,
            marker=_marker(kind),
            linestyle="none",
            label="the model" if kind == MODEL else kind,
        )
        for kind in dict.fromkeys(mark.kind for mark in chart.marks if not np.isnan(mark.x + mark.y))
    ]
    if any(mark.kind == MODEL and np.isnan(mark.x + mark.y) for mark in chart.marks):
        handles.append(Line2D([], [], color="black", linestyle=":", linewidth=1.0, label="the model"))
    if not chart.plane.space.inside(chart.plane.x(lattice(*[np.linspace(0, 1, 21)] * 2))).all():
        handles.append(
            Patch(
                facecolor="none", edgecolor="0.72", hatch=EXTRAPOLATED["hatch"], linewidth=0, label="tyre extrapolated"
            )
        )
    columns = legend_columns([handle.get_label() for handle in handles], width=WIDTH)
    canvas.legend(handles=handles, loc="outside lower center", ncols=columns)
