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
    """Draw a chart and the frequency (Hz) along its boundaries; ``contours`` of an output go into a CSV too."""
    waves = any(not curve.real for curve in chart.curves)
    frequency_below = _along_first(chart)
    with drawing(target, width=WIDTH, height=7.6 if frequency_below and waves else 6.2) as canvas:
        frequency_axes = None
        if not waves:
            axes = canvas.subplots()
        elif frequency_below:
            axes, frequency_axes = canvas.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (2.6, 1)})
        else:
            axes, frequency_axes = canvas.subplots(1, 2, sharey=True, gridspec_kw={"width_ratios": (2.6, 1)})
        _regions(axes, chart)
        _hatch_extrapolated(axes, chart)
        if contours is not None:
            _contours(axes, chart, contours, target)
        for boundary in chart.boundaries:
            if chart.uncertain and boundary.band_is_narrow:
                _band(axes, chart, boundary)
            _curve(axes, frequency_axes, chart, boundary, frequency_below=frequency_below)
        _marks(axes, chart)
        _axes(axes, frequency_axes, chart, frequency_below=frequency_below)
        _legend(canvas, axes, chart)
        canvas.suptitle(title, x=0.01, ha="left", fontsize=11)


def _along_first(chart: StabilityChart) -> bool:
    """True if the frequencies are best drawn along the first axis: boundaries run across more of it."""
    waves = [boundary.curve.shares for boundary in chart.boundaries if not boundary.curve.real]
    spread = np.sum([np.ptp(shares, axis=0) for shares in waves], axis=0) if waves else np.array([1.0, 0.0])
    return bool(spread[0] >= 0.5 * spread[1])


def _regions(axes: Any, chart: StabilityChart) -> None:
    """Shade by the number of unstable roots."""
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


def _hatch_extrapolated(axes: Any, chart: StabilityChart) -> None:
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
    """Draw contour lines of an output and write its values on the grid as CSV."""
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


def _band(axes: Any, chart: StabilityChart, boundary: NamedBoundary) -> None:
    """Shade what is nearer to a boundary than 1.96 standard deviations of its nearest point."""
    share, distance = band_of(boundary.curve.shares, boundary.spread[:, 2])
    spans, colour = chart.plane.spans, mode_look(boundary.names[0] or "other").colour
    axes.contourf(
        spans[0].at(share),
        spans[1].at(share),
        distance.T,
        levels=[0, 1],
        colors=[colour],
        alpha=0.25,
        zorder=1,
        antialiased=True,
    )


def _curve(
    axes: Any, frequency_axes: Any, chart: StabilityChart, boundary: NamedBoundary, *, frequency_below: bool
) -> None:
    """Draw a boundary, thick where it limits what is stable, and its frequency in the axes below or at the side."""
    for name, limit, points, hertz in boundary.pieces(chart.plane):
        style = mode_look(name or "other")
        line = {"color": style.colour, "linestyle": style.bare or style.line, "linewidth": 2.2 if limit else 1.2}
        axes.plot(*points.T, zorder=3, solid_capstyle="round", **line)
        if not boundary.curve.real and frequency_axes is not None:
            position = points[:, 0 if frequency_below else 1]
            frequency_axes.plot(
                *((position, hertz) if frequency_below else (hertz, position)), solid_capstyle="round", **line
            )


def _marks(axes: Any, chart: StabilityChart) -> None:
    """Draw the model and measured conditions as points, or as lines where they have one coordinate."""
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.75}
    small: dict[str, Any] = {"fontsize": 7.5, "color": "0.25", "zorder": 7, "bbox": box}
    for mark in chart.marks:
        is_model = mark.kind == MODEL
        upright, level = np.isnan(mark.y), np.isnan(mark.x)
        style: dict[str, Any] = {"color": "black" if is_model else GREY, "zorder": 8 if is_model else 6}
        style |= {"linewidth": 1.0, "linestyle": ":"} if upright or level else {"markeredgecolor": "white"}
        words = "" if is_model else mark.label
        if upright and not level:
            axes.axvline(mark.x, **style)
            axes.text(
                mark.x, 0.985, words, rotation=90, ha="right", va="top", transform=axes.get_xaxis_transform(), **small
            )
        elif level and not upright:
            axes.axhline(mark.y, **style)
            axes.text(0.985, mark.y, words, ha="right", va="bottom", transform=axes.get_yaxis_transform(), **small)
        elif not level:
            axes.plot(mark.x, mark.y, _marker(mark.kind), markersize=11 if is_model else 8, **style)
    named = [mark for mark in chart.marks if mark.kind != MODEL and not np.isnan(mark.x + mark.y)]
    if len(named) > 14:  # words beside so many points would cover each other
        return
    places: list[Array] = []
    for mark in named:
        place = np.array([span.share(x) for span, x in zip(chart.plane.spans, (mark.x, mark.y), strict=True)])
        to_the_left = place[0] > 0.75
        crowded = any((np.abs(place - neighbour) < (0.16, 0.045)).all() for neighbour in places)
        places.append(place)
        axes.annotate(
            mark.label,
            (mark.x, mark.y),
            (-6 if to_the_left else 6, -12 if crowded else 5),
            textcoords="offset points",
            ha="right" if to_the_left else "left",
            **small,
        )


def _marker(kind: str) -> str:
    """Choose the marker of a kind of mark, which begins with its name."""
    return next(marker for name, marker in MARKERS.items() if kind.startswith(name))


def _axes(axes: Any, frequency_axes: Any, chart: StabilityChart, *, frequency_below: bool) -> None:
    """Set ranges, scales and titles of the chart and of the frequencies, Hz, below it or at its side."""
    first, second = chart.plane.spans
    axes.set(
        xlim=(first.low, first.high),
        ylim=(second.low, second.high),
        ylabel=second.axis.title,
        xscale="log" if first.log else "linear",
        yscale="log" if second.log else "linear",
    )
    axes.grid(visible=False)
    highest = 1.1 * max((float(boundary.frequency.max()) for boundary in chart.boundaries), default=1.0)
    if frequency_axes is None or not frequency_below:
        axes.set_xlabel(first.axis.title)
    if frequency_axes is not None and frequency_below:
        frequency_axes.set(xlabel=first.axis.title, ylabel="Frequency, Hz", ylim=(0, highest))
    elif frequency_axes is not None:
        frequency_axes.set(xlabel="Frequency, Hz", xlim=(0, highest))


def _legend(canvas: Any, axes: Any, chart: StabilityChart) -> None:
    """Explain lines, shades, bands and marks below the figure."""
    handles = [
        *axes.get_legend_handles_labels()[0],
        *_mode_handles(chart),
        *_region_handles(chart),
        *_band_handles(chart),
        *_mark_handles(chart),
    ]
    columns = legend_columns([handle.get_label() for handle in handles], width=WIDTH)
    canvas.legend(handles=handles, loc="outside lower center", ncols=columns)


def _mode_handles(chart: StabilityChart) -> list[Any]:
    """Legend of the lines: one for each name of a mode."""
    handles = []
    for name in dict.fromkeys(name for boundary in chart.boundaries for name in boundary.distinct):
        style = mode_look(name or "other")
        label = mode_words(name) if name else "mode unknown"
        line = style.bare or style.line
        handles.append(Line2D([], [], color=style.colour, linestyle=line, linewidth=2.0, label=label))
    return handles


def _region_handles(chart: StabilityChart) -> list[Any]:
    """Legend of the shades: numbers of unstable roots."""
    handles = []
    for count in np.unique(np.clip(chart.check.predicted, 0, len(SHADES) - 1)).tolist():
        words = "stable" if count == 0 else MORE if count == len(SHADES) - 1 else f"{count}"
        label = words if count == 0 else f"{words} unstable {'root' if count == 1 else 'roots'}"
        handles.append(Patch(facecolor=SHADES[count], edgecolor="0.6", linewidth=0.5, label=label))
    return handles


def _band_handles(chart: StabilityChart) -> list[Any]:
    """Legend of thin lines and of bands, if there are some."""
    handles: list[Any] = []
    if any((boundary.roots_on_stable_side != 0).any() for boundary in chart.boundaries):
        handles.append(Line2D([], [], color="0.3", linewidth=1.2, label="thin: unstable on both sides"))
    if chart.uncertain and any(boundary.band_is_narrow for boundary in chart.boundaries):
        handles.append(Patch(facecolor="0.45", alpha=0.3, label="95 % band, first order"))
    return handles


def _mark_handles(chart: StabilityChart) -> list[Any]:
    """Legend of the marks, and of hatching where the tyre is extrapolated."""
    handles: list[Any] = []
    for kind in dict.fromkeys(mark.kind for mark in chart.marks if not np.isnan(mark.x + mark.y)):
        colour, label = ("black", "the model") if kind == MODEL else (GREY, kind)
        handles.append(Line2D([], [], color=colour, marker=_marker(kind), linestyle="none", label=label))
    if any(mark.kind == MODEL and np.isnan(mark.x + mark.y) for mark in chart.marks):
        handles.append(Line2D([], [], color="black", linestyle=":", linewidth=1.0, label="the model"))
    if not chart.plane.space.inside(chart.plane.x(lattice(*[np.linspace(0, 1, 21)] * 2))).all():
        hatch = EXTRAPOLATED["hatch"]
        handles.append(Patch(facecolor="none", edgecolor="0.72", hatch=hatch, linewidth=0, label="tyre extrapolated"))
    return handles
