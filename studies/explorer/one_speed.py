"""Figures at the chosen speed: damping of each mode with its uncertainty, and what moves the chosen mode most."""

import math
from collections.abc import Callable
from html import escape
from textwrap import wrap

import numpy as np

from bicycle.default_sd import EXACT
from bicycle.modal.looks import mode_words
from studies.explorer.along_speed import Figure, halving
from studies.explorer.computed import AtSpeed
from studies.explorer.looks import HEIGHTS, Palette, layout, series
from studies.sensitivity.ranking import Ranking
from tyre.base.errors import InputError

TOP = 12  # bars; the table has all
LINE = 20  # letters beside a bar


def figure_or_words(name: str, made: Callable[[], Figure], palette: Palette) -> Figure:
    """A figure, or the words in which the library refuses its numbers in its place.

    Parameters
    ----------
    name : str
        Of the figure, for its height.
    made : callable
        Gives the figure.
    palette : Palette

    Returns
    -------
    dict
        A plotly figure.
    """
    try:
        return made()
    except InputError as error:
        words = "<br>".join(wrap(escape(str(error)), 60))
        said = {"text": words, "showarrow": False, "xref": "paper", "yref": "paper", "x": 0, "y": 0.9, "align": "left"}
        none = {"visible": False}
        shown = layout(palette, title="", height=HEIGHTS[name], annotations=[said], xaxis=none, yaxis=none)
        return {"data": [], "layout": shown | {"meta": {"columns": ["message"], "rows": [[str(error)]]}}}


def damping_figure(at: AtSpeed, palette: Palette) -> Figure:
    """Damping ratio of each oscillation with one sd as band; what does not oscillate is in the table.

    Parameters
    ----------
    at : AtSpeed
    palette : Palette

    Returns
    -------
    dict
        A plotly figure.
    """
    speed, rows, bars = float(at.named.speeds[0]), [], []
    for name, values in at.named.branches.items():
        ratio, hertz = float(at.named.damping_ratio(name)[0]), float(at.named.frequency(name)[0])
        for root in values[0][~np.isnan(values[0])].tolist():
            sd = at.sd[name] if at.uncertain else math.nan
            cells = [name, root.real, root.imag, abs(hertz), ratio, sd]
            rows.append([None if isinstance(cell, float) and math.isnan(cell) else cell for cell in cells])
            rows[-1].append(halving(root.real))
        if values[0, 0].imag > 0:
            bars.append((name, ratio, at.sd[name] if at.uncertain else math.nan))
    said = "band: 1 sd of what is stated" if at.uncertain else "no sd is stated, so no band"
    data = [
        {
            "type": "bar", "x": [mode_words(name)], "y": [ratio], "showlegend": False, "name": escape(mode_words(name)),
            "marker": {"color": series(name, palette)["line"]["color"]}, "width": [0.5],
            "error_y": {
                "type": "data", "array": [0.0 if math.isnan(sd) else sd], "color": palette.text, "thickness": 2,
                "visible": not math.isnan(sd),
            },
            "text": [f"{ratio:.3g}" + ("" if math.isnan(sd) else f" ± {sd:.1g}")], "textposition": "inside",
            "insidetextanchor": "middle", "textangle": 0,
            "hovertemplate": f"{escape(mode_words(name))}: damping ratio %{{y:.5g}}<extra></extra>",
        }
        for name, ratio, sd in bars
    ]  # fmt: skip
    return {
        "data": data,
        "layout": layout(
            palette, title=f"Damping of the oscillations at {speed:.4g} m/s", below=said,
            height=HEIGHTS["damping"],
            yaxis={"title": {"text": "Damping ratio (below 0: grows)"}}, xaxis={"type": "category"},
            meta={
                "columns": [
                    "mode", "real part 1/s", "imaginary part rad/s", "frequency Hz", "damping ratio", "sd of it",
                    "time",
                ],
                "rows": rows,
            },
        ),
    }  # fmt: skip


def sensitivity_figure(found: Ranking, palette: Palette) -> Figure:
    """Change of the growth rate of the chosen mode for one sd of each parameter, the largest above.

    Parameters
    ----------
    found : Ranking
    palette : Palette

    Returns
    -------
    dict
        A plotly figure.
    """
    top = [change for change in found.changes if change.origin != EXACT][:TOP][::-1]
    colour = series(found.mode, palette)["line"]["color"]
    rows = [
        [c.parameter, c.value, c.unit, c.sd, c.origin, c.growth, c.frequency if found.eigenvalue.imag else None]
        for c in found.changes
    ]
    words, names = escape(mode_words(found.mode)), [_short(c.parameter) for c in top]
    return {
        "data": [
            {
                "type": "bar", "orientation": "h", "x": [c.growth for c in top], "showlegend": False,
                "y": [_in_two_lines(name) for name in names], "customdata": names,
                "marker": {"color": colour, "pattern": {"shape": ["/" if c.growth > 0 else "" for c in top]}},
                "text": [f"sd {c.sd:.2g} {c.unit if c.unit != '1' else ''} ({c.origin})" for c in top],
                "hovertemplate": "%{customdata}: %{x:.3g} 1/s for %{text}<extra></extra>", "textposition": "none",
            }
        ],
        "layout": layout(
            palette, title=f"What moves {words} at {found.speed:.4g} m/s",
            below="change for +1 sd of each; hatched: towards unstable",
            height=HEIGHTS["sensitivity"], xaxis={"title": {"text": "Real part, 1/s"}},
            yaxis={"type": "category"},
            meta={
                "columns": ["parameter", "value", "unit", "sd", "sd from", "growth 1/s", "frequency Hz"], "rows": rows,
            },
        ),
    }  # fmt: skip


def _in_two_lines(name: str) -> str:
    """A long name broken where its parts meet, so that the bars keep their room on a narrow page."""
    ends = [k + 1 for k, letter in enumerate(name) if letter in "._"]
    if len(name) <= LINE or not ends:
        return name
    middle = min(ends, key=lambda end: abs(end - len(name) / 2))
    return f"{name[:middle]}<br>{name[middle:]}"


def _short(parameter: str) -> str:
    """The name of a parameter without its effect where that says it twice."""
    parts = parameter.split(".")
    return ".".join(parts[1:]) if len(parts) > 1 and parts[0] == parts[1] else parameter
