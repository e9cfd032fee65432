"""The bands of a stability chart as shapes for the browser: what ``velotyre chart`` shades, with a dotted edge."""

from typing import Any

import numpy as np

from bicycle.modal.looks import mode_look
from studies.explorer.looks import Palette, colour_on
from studies.stability_charts.band import BAND, CELLS, band_of
from studies.stability_charts.chart import NamedBoundary, StabilityChart
from tyre.base.arrays import Array

NAME = "95 % band, first order (dotted edge)"
FAINT = 0.25  # of the colour of the mode
DIGITS = 6
HAIR = 1.5e-3
"""Of the axes: a band whose half width is nowhere more is hidden by the line of its boundary."""

NARROW = 3 / CELLS
"""Of the axes: up to here the band is drawn along the normals of its boundary, for cells would miss it."""


def bands(chart: StabilityChart, palette: Palette) -> list[dict[str, Any]]:
    """A filled trace for each boundary whose band means something; none where nothing is uncertain.

    Parameters
    ----------
    chart : StabilityChart
    palette : Palette
    """
    found: list[dict[str, Any]] = []
    for one in chart.boundaries if chart.uncertain else ():
        if not one.band_is_told or _widest(one) < HAIR:
            continue
        x, y = _joined(_ribbon(chart, one) if _widest(one) < NARROW else _rims(chart, one))
        colour = colour_on(mode_look(one.names.names[0] or "other").colour, palette)
        red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
        found.append({
            "type": "scatter", "mode": "lines", "name": NAME, "legendgroup": "band", "showlegend": not found,
            "x": x, "y": y, "fill": "toself", "fillcolor": f"rgba({red},{green},{blue},{FAINT})", "hoverinfo": "skip",
            "line": {"color": colour, "dash": "dot", "width": 1},
        })  # fmt: skip
    return found


def hidden(chart: StabilityChart) -> list[str]:
    """What must be said of bands that are narrower than a line.

    Parameters
    ----------
    chart : StabilityChart
    """
    return [
        f"boundary {number}: its band is narrower than its line; the table has its standard deviations"
        for number, one in enumerate(chart.boundaries, 1)
        if chart.uncertain and _widest(one) < HAIR
    ]


def _widest(one: NamedBoundary) -> float:
    return float(BAND * one.spread[:, 2].max())


def _rims(chart: StabilityChart, one: NamedBoundary) -> list[Array]:
    """Rims (k, 2) of what lies in the band, in the units of the axes; holes are turned the other way."""
    from matplotlib.figure import Figure

    share, away = band_of(one.curve.shares, one.spread[:, 2])
    first, second = chart.plane.spans
    drawn = Figure().subplots().contourf(first.at(share), second.at(share), away.T, levels=[-1, 1])
    return [np.asarray(rim) for path in drawn.get_paths() for rim in path.to_polygons()]


def _ribbon(chart: StabilityChart, one: NamedBoundary) -> list[Array]:
    """The boundary moved by the half width to both sides."""
    half = BAND * one.spread[:, 2:] * one.curve.normals
    ahead, behind = one.curve.shares + half, one.curve.shares - half
    if one.curve.closed:
        return [chart.plane.x(np.clip(side, 0, 1)) for side in (ahead, behind[::-1])]
    return [chart.plane.x(np.clip(np.vstack([ahead, behind[::-1]]), 0, 1))]


def _joined(rims: list[Array]) -> tuple[list[float | None], list[float | None]]:
    """Closed rims one after the other, None between them."""
    across: list[float | None] = []
    upwards: list[float | None] = []
    for rim in rims:
        for place, values in ((across, rim[:, 0]), (upwards, rim[:, 1])):
            place += [*([None] if place else []), *(float(f"{value:.{DIGITS}g}") for value in (*values, values[0]))]
    return across, upwards
