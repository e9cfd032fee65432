"""Figures of a recording for the browser: panels of curves as plotly dicts, for light and dark, with their table."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np

from studies.explorer.looks import LINE_WIDTH, MARKERS, PALETTES, Palette, colour_on, dashes, layout
from studies.reporting.plotting import look

HEIGHT, HEAD = 210, 110  # pixels of a row of panels, and of title and legend
GAP = 62  # pixels between rows
MOST_ROWS = 400  # of a table behind a figure
MEASURED = -1
"""In place of a number of a series: what was measured."""


@dataclass(frozen=True)
class Curve:
    """One curve of a panel.

    Attributes
    ----------
    name : str
        Of the legend; the same in all panels.
    number : int
        Of the house's looks, or :data:`MEASURED`.
    x, y : sequence of float, shape (n,)
    drawn : str
        ``lines``, ``markers`` or ``lines+markers``.
    error : sequence of float, shape (n,)
        Half a bar of error, in the unit of ``y``; empty for none.
    """

    name: str
    number: int
    x: Sequence[float]
    y: Sequence[float]
    drawn: str = "lines"
    error: Sequence[float] = ()


@dataclass(frozen=True)
class Panel:
    """One pair of axes.

    Attributes
    ----------
    title, x_words, y_words : str
        Above it, and of its axes with their units.
    curves : sequence of Curve
    bands : sequence of tuple of float, shape (2,)
        Stretches of the abscissa that are shaded.
    level : tuple of float, shape (2,), optional
        A stretch of the ordinate that is shaded.
    ticks : tuple of str
        Names of the abscissae 0, 1, ...
    logarithmic : bool
        The ordinate.
    """

    title: str
    x_words: str
    y_words: str
    curves: Sequence[Curve]
    bands: Sequence[tuple[float, float]] = field(default_factory=tuple)
    level: tuple[float, float] | None = None
    ticks: tuple[str, ...] = ()
    logarithmic: bool = False


def entry(
    name: str, words: str, title: str, panels: Sequence[Panel], *, columns: int = 2, note: str = ""
) -> dict[str, Any]:
    """A figure of panels for the page, on light and on dark ground.

    Parameters
    ----------
    name : str
        For its place on the page.
    words : str
        What it is called.
    title : str
        Above it.
    panels : sequence of Panel
    columns : int, optional
        In which the panels stand, a number.
    note : str, optional
        A caption.
    """
    return {
        "name": name, "words": words, "note": note, "table": table(panels), "data": _data(panels),
        "styles": {theme: _styles(panels, palette) for theme, palette in PALETTES.items()},
        "layouts": {
            theme: {"wide": _layout(title, panels, palette, min(columns, len(panels))),
                    "narrow": _layout(title, panels, palette, 1)}
            for theme, palette in PALETTES.items()
        },
    }  # fmt: skip


def _layout(title: str, panels: Sequence[Panel], palette: Palette, columns: int) -> dict[str, Any]:
    """Axes of the panels in some columns, with bands and titles."""
    rows = -(-len(panels) // columns)
    height = HEAD + rows * (HEIGHT + GAP)
    axes: dict[str, Any] = {}
    shapes: list[dict[str, Any]] = []
    notes: list[dict[str, Any]] = []
    for place, panel in enumerate(panels):
        end = "" if not place else str(place + 1)
        row, column = divmod(place, columns)
        left, right = column / columns + 0.045 * (column > 0), (column + 1) / columns - 0.03 * (column < columns - 1)
        top = 1 - row * (HEIGHT + GAP) / (rows * (HEIGHT + GAP) - GAP)
        bottom = max(top - HEIGHT / (rows * (HEIGHT + GAP) - GAP), 0.0)
        axes[f"xaxis{end}"] = {
            "domain": [left, right],
            "anchor": f"y{end}",
            "title": {"text": escape(panel.x_words), "standoff": 4},
        }
        axes[f"yaxis{end}"] = {
            "domain": [bottom, top],
            "anchor": f"x{end}",
            "title": {"text": escape(panel.y_words), "standoff": 4},
        }
        if panel.logarithmic:
            axes[f"yaxis{end}"]["type"] = "log"
        if panel.ticks:
            axes[f"xaxis{end}"] |= {
                "tickvals": list(range(len(panel.ticks))),
                "ticktext": [escape(one) for one in panel.ticks],
            }
        notes.append(
            {"text": f"<b>{escape(panel.title)}</b>", "x": left, "y": top, "xref": "paper", "yref": "paper",
             "xanchor": "left", "yanchor": "bottom", "showarrow": False, "font": {"size": 12}}
        )  # fmt: skip
        shapes += [_band(end, band, palette, upright=True) for band in panel.bands]
        shapes += [_band(end, panel.level, palette, upright=False)] if panel.level else []
    made = layout(
        palette, title=escape(title), height=height, shapes=shapes, annotations=notes, hovermode="closest", **axes
    )
    made["margin"] |= {"t": 66}
    made["legend"] = {"orientation": "h", "y": 0, "yref": "container", "yanchor": "bottom", "x": 0}
    made["margin"]["b"] = 84
    return made


def table(panels: Sequence[Panel]) -> dict[str, Any]:
    """Every number of the panels, or some of them, evenly, where they are too many for a page.

    Parameters
    ----------
    panels : sequence of Panel

    Returns
    -------
    dict
        ``columns``, ``rows``, and ``note`` where numbers are left out.
    """
    count = sum(len(curve.x) for panel in panels for curve in panel.curves)
    every = max(1, -(-count // MOST_ROWS))
    rows = [
        [panel.title, curve.name, panel.ticks[int(x)] if panel.ticks and x is not None else x, y]
        for panel in panels for curve in panel.curves
        for x, y in list(zip(_plain(curve.x), _plain(curve.y), strict=True))[::every]
    ]  # fmt: skip
    words = {panel.x_words for panel in panels}
    found: dict[str, Any] = {
        "columns": ["panel", "curve", words.pop() if len(words) == 1 else "abscissa", "value"],
        "rows": rows,
    }
    return found | ({"note": f"one in {every} of {count} points; the files have all"} if every > 1 else {})


def _data(panels: Sequence[Panel]) -> list[dict[str, Any]]:
    """Traces without their looks."""
    found, named = [], set()
    for place, panel in enumerate(panels):
        end = "" if not place else str(place + 1)
        for curve in panel.curves:
            found.append({
                "type": "scatter", "mode": curve.drawn, "name": escape(curve.name), "legendgroup": curve.name,
                "showlegend": curve.name not in named, "x": _plain(curve.x), "y": _plain(curve.y),
                "xaxis": f"x{end}", "yaxis": f"y{end}",
                **({"error_y": {"type": "data", "array": _plain(curve.error), "thickness": 1, "width": 2}}
                   if len(curve.error) else {}),
            })  # fmt: skip
            named.add(curve.name)
    return found


def _styles(panels: Sequence[Panel], palette: Palette) -> list[dict[str, Any]]:
    """Looks of the traces, in their order."""
    found = []
    for curve in (curve for panel in panels for curve in panel.curves):
        colour, dash, symbol, size = palette.line, "solid", "circle", 4
        if curve.number != MEASURED:
            style = look(curve.number)
            colour, size = colour_on(style.colour, palette), 6
            dash, symbol = dashes(style), MARKERS.get(style.marker, "circle")
        found.append({
            "line": {"color": colour, "dash": dash, "width": LINE_WIDTH},
            "marker": {"color": colour, "symbol": symbol, "size": size},
        })  # fmt: skip
    return found


def _band(end: str, band: tuple[float, float], palette: Palette, *, upright: bool) -> dict[str, Any]:
    colour = "rgba(229,168,35,0.18)" if upright else ("rgba(255,255,255,0.08)" if palette.dark else "rgba(0,0,0,0.07)")
    common = {"type": "rect", "line": {"width": 0}, "fillcolor": colour, "layer": "below"}
    if upright:
        return common | {"xref": f"x{end}", "x0": band[0], "x1": band[1], "yref": f"y{end} domain", "y0": 0, "y1": 1}
    return common | {"xref": f"x{end} domain", "x0": 0, "x1": 1, "yref": f"y{end}", "y0": band[0], "y1": band[1]}


def _plain(values: Sequence[float]) -> list[float | None]:
    """Numbers for JSON: what is none is a gap."""
    array = np.asarray(values, dtype=float)
    return [value if ok else None for value, ok in zip(array.tolist(), np.isfinite(array).tolist(), strict=True)]
