"""The stability chart of a state: boundaries over two of its numbers, as ``velotyre chart`` finds them."""

import base64
import io
from functools import lru_cache
from html import escape
from threading import Lock
from typing import Any

import numpy as np

from bicycle.modal.looks import mode_words
from studies.explorer.along_speed import Figure
from studies.explorer.chart_band import bands, hidden
from studies.explorer.looks import HEIGHTS, Palette, layout, series
from studies.explorer.models import model_content
from studies.explorer.state import State, parse_state
from studies.explorer.tyre_files import TYRES
from studies.model_axes.axis import SPEED
from studies.stability_charts.chart import StabilityChart, stability_chart
from studies.stability_charts.plane import Plane, Span, split_range
from studies.stability_charts.words import checked, title
from tyre.base.arrays import Array
from tyre.base.errors import InputError

KEPT = 8
FINE = 260  # cells of the shading along each axis
SHADES = {False: (246, 222, 219), True: (92, 46, 40)}  # of what is unstable, on light and on dark ground
HATCH = {False: (206, 206, 206), True: (80, 88, 98)}
THIN, THICK = 1.0, 2.4  # pixels
_one_at_a_time = Lock()


def chart_of(state: State) -> StabilityChart:
    """The chart of a state over its axes ``x`` and ``y``; kept, so that asking again is free.

    Parameters
    ----------
    state : State

    Raises
    ------
    InputError
        No axes, axes or ranges that the model does not allow.
    """
    if not state.x or not state.y:
        raise InputError("stability chart: choose what stands along both axes")
    at = None if SPEED in (split_range(state.x)[0], split_range(state.y)[0]) else state.at
    key = State(state.model, state.name, state.rider, state.posture, x=state.x, y=state.y).address
    with _one_at_a_time:
        return _chart(key, at)


def chart_figure(chart: StabilityChart, palette: Palette) -> Figure:
    """Boundaries by mode, shaded where something is unstable; pointing at one tells the frequency.

    Parameters
    ----------
    chart : StabilityChart
    palette : Palette

    Returns
    -------
    dict
        A plotly figure.
    """
    first, second = chart.plane.spans
    data, named = [], set()
    for number, one in enumerate(chart.boundaries, 1):
        points, hertz = chart.plane.x(one.curve.shares), one.frequency
        names, limit = list(one.names.names), one.beside == 0
        if one.curve.closed:
            points, hertz = np.vstack([points, points[:1]]), np.r_[hertz, hertz[:1]]
            names, limit = [*names, names[0]], np.r_[limit, limit[:1]]
        for name, inside, part in _pieces(names, limit):
            words = mode_words(name) if name else "mode unknown"
            style = series(name or "other", palette)
            data.append({
                "type": "scatter", "mode": "lines", "name": escape(words), "legendgroup": words,
                "showlegend": words not in named, "x": points[part, 0].tolist(), "y": points[part, 1].tolist(),
                "customdata": [[hz, "oscillates" if hz else "does not oscillate"] for hz in hertz[part].tolist()],
                "line": style["line"] | {"width": THICK if inside else THIN},
                "hovertemplate": f"<b>{escape(words)}</b>, boundary {number}<br>{escape(first.axis.key)} %{{x:.4g}}, "
                                 f"{escape(second.axis.key)} %{{y:.4g}}<br>frequency %{{customdata[0]:.4g}} Hz "
                                 "(%{customdata[1]})<extra></extra>",
            })  # fmt: skip
            named.add(words)
    return {
        "data": [*bands(chart, palette), *data, *_marks(chart, palette)],
        "layout": layout(
            palette, title=escape(title(chart)), height=HEIGHTS["chart"], hovermode="closest",
            xaxis=_axis(first), yaxis=_axis(second), images=[_shading(chart, palette)], meta=chart_table(chart),
        ),
    }  # fmt: skip


def chart_table(chart: StabilityChart) -> dict[str, Any]:
    """Every point of the boundaries.

    Parameters
    ----------
    chart : StabilityChart
    """
    frame = chart.frame()
    axes = [span.axis.column for span in chart.plane.spans]
    columns = ["boundary", "mode", *axes, "frequency_Hz", "unstable_roots_on_the_stable_side"]
    columns += [f"sd_{axis}" for axis in axes if f"sd_{axis}" in frame]
    shown = frame.reindex(columns=columns)
    rows = [
        [None if isinstance(cell, float) and not np.isfinite(cell) else cell for cell in row]
        for row in shown.astype(object).to_numpy().tolist()
    ]
    return {"columns": [name.replace("_", " ") for name in columns], "rows": rows}


def chart_notes(chart: StabilityChart) -> list[str]:
    """How to read it, how it was checked, and what is doubtful.

    Parameters
    ----------
    chart : StabilityChart
    """
    said = ["shaded: something is unstable"]
    said += ["thin lines: unstable on both sides"] if any((one.beside != 0).any() for one in chart.boundaries) else []
    said += ["hatched: the tyre is extrapolated"] if _outside(chart).any() else []
    return [*said, *(line.partition("; --sd")[0] for line in checked(chart)), *hidden(chart), *chart.doubts]


def chart_csv(state: State) -> str:
    """A row per point of a boundary, as ``velotyre chart`` writes it.

    Parameters
    ----------
    state : State
    """
    return str(chart_of(state).frame().to_csv(index=False, lineterminator="\n"))


@lru_cache(maxsize=KEPT)
def _chart(address: str, at: float | None) -> StabilityChart:
    state = parse_state(address)
    with TYRES.by_name():
        return stability_chart(Plane.of(model_content(state), state.x, state.y, speed=at))


def _pieces(names: list[str], limit: Any) -> list[tuple[str, bool, slice]]:
    """Stretches of one mode that are the limit of what is stable, or are not."""
    found, start = [], 0
    for k in range(1, len(names)):
        if k == len(names) - 1 or (names[k], limit[k]) != (names[start], limit[start]):
            found.append((names[start], bool(limit[start]), slice(start, k + 1)))
            start = k
    return found


def _marks(chart: StabilityChart, palette: Palette) -> list[dict[str, Any]]:
    first, second = chart.plane.spans
    found, named = [], set()
    for mark in chart.marks:
        lines = bool(np.isnan(mark.x) or np.isnan(mark.y))
        x = [first.low, first.high] if np.isnan(mark.x) else [mark.x] * (1 + lines)
        y = [second.low, second.high] if np.isnan(mark.y) else [mark.y] * (1 + lines)
        found.append({
            "type": "scatter", "mode": "lines" if lines else "markers", "x": x, "y": y, "name": escape(mark.kind),
            "legendgroup": mark.kind, "showlegend": mark.kind not in named,
            "line": {"color": palette.line, "dash": "dot"},
            "marker": {"color": palette.text, "symbol": "cross" if mark.kind == "model" else "circle", "size": 10},
            "hovertemplate": f"{escape(mark.label)}<extra></extra>",
        })  # fmt: skip
        named.add(mark.kind)
    return found


def _axis(span: Span) -> dict[str, Any]:
    unit = "" if span.axis.unit == "1" else f", {span.axis.unit}"
    words = f"{span.axis.said}{unit}"
    ends = [span.low, span.high]
    return {
        "title": {"text": escape(words)}, "type": "log" if span.log else "linear", "showgrid": False, "zeroline": False,
        "range": np.log10(ends).tolist() if span.log else ends,
    }  # fmt: skip


def _shading(chart: StabilityChart, palette: Palette) -> dict[str, Any]:
    """A picture behind the curves: coloured where something is unstable, hatched where the tyre is extrapolated."""
    edges = np.linspace(0, 1, FINE + 1)
    middle: Array = (edges[1:] + edges[:-1]) / 2
    counts = chart.regions(np.r_[0, middle], np.r_[0, middle])[1:, 1:]
    picture = np.zeros((FINE, FINE, 4), dtype=np.uint8)
    picture[counts > 0] = (*SHADES[palette.dark], 255)
    place = np.add.outer(np.arange(FINE), np.arange(FINE))
    picture[_outside(chart) & (place % 9 < 1)] = (*HATCH[palette.dark], 255)
    return {
        "source": f"data:image/png;base64,{_png(picture.transpose(1, 0, 2)[::-1])}", "xref": "x domain",
        "yref": "y domain", "x": 0, "y": 1, "sizex": 1, "sizey": 1, "sizing": "stretch", "layer": "below",
    }  # fmt: skip


def _outside(chart: StabilityChart) -> Any:
    """Cells (:data:`FINE`, :data:`FINE`) in which the tyre is extrapolated."""
    middle = (np.arange(FINE) + 0.5) / FINE
    grid = np.stack(np.meshgrid(middle, middle, indexing="ij"), -1).reshape(-1, 2)
    return ~chart.plane.space.inside(chart.plane.x(grid)).reshape(FINE, FINE)


def _png(picture: Any) -> str:
    from matplotlib.image import imsave

    found = io.BytesIO()
    imsave(found, np.ascontiguousarray(picture), format="png")
    return base64.b64encode(found.getvalue()).decode("ascii")
