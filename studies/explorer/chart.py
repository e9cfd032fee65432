"""Draw the stability chart of a state: boundaries over two of its numbers, as ``velotyre chart`` finds them."""

import base64
import io
from collections.abc import Iterable
from functools import lru_cache
from html import escape
from threading import Lock
from typing import Any

import numpy as np

from bicycle.stability.mode_figure import mode_look, mode_words
from studies.chart.chart import BAND, NamedBoundary, StabilityChart, describe_check, stability_chart, title
from studies.chart.plane import MODEL, Plane, Span, lattice, split_range
from studies.explorer.figures import Figure, Palette, colour_on, figure, json_cells, series
from studies.explorer.models import model_content, model_of
from studies.explorer.state import State, parse_state
from studies.explorer.tyre_files import TYRES
from studies.model_space.axes import OF_THE_TYRE, SPEED, axis_keys, axis_of, typical_range
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError


def axis_options(state: State) -> list[dict[str, Any]]:
    """List the possible axes of the chart of a state: key, words with the unit, usual range."""
    model = model_of(state)
    options = [{"key": SPEED, "words": "speed, m/s", "low": f"{state.slow:g}", "high": f"{state.fast:g}"}]
    tyres = any("tyre" in table for table in state.content.get("effects", {}).values())
    options += [
        {"key": key, "words": f"{key.split('_')[0]} of the tyres, {unit}", "low": "", "high": ""}
        for key, unit in OF_THE_TYRE.items()
        if tyres
    ]
    for key in axis_keys(model):
        try:
            axis = axis_of(model, key)
            low, high = typical_range(model, axis)
        except InputError:  # one that follows another
            continue
        unit = "" if axis.unit == "1" else f", {axis.unit}"
        words = f"{key.replace('_', ' ').replace('.', ': ', 1)}{unit}"
        options.append({"key": key, "words": words, "low": f"{low:.6g}", "high": f"{high:.6g}"})
    return options


def chart_axes(state: State) -> list[dict[str, Any]]:
    """Describe both axes of the chart: ``name``, ``words``, ``options``, ``chosen``, ``low``, ``high``, ``log``."""
    try:
        options = axis_options(state)
    except InputError:  # the page shows the message
        return []
    axes: list[dict[str, Any]] = []
    for name, words, usual, axis_text in (("x", "Horizontal axis", 0, state.x), ("y", "Vertical axis", 1, state.y)):
        key, equals, ends = axis_text.partition("=")
        chosen = next((option for option in options if option["key"] == key), options[usual])
        range_text = ends if equals and chosen["key"] == key else ""
        low, _, high = range_text.removesuffix(":log").partition(":")
        axes.append(
            {
                "name": name,
                "words": words,
                "options": options,
                "chosen": chosen["key"],
                "low": low or chosen["low"],
                "high": high or chosen["high"],
                "log": range_text.endswith(":log"),
            }
        )
    return axes


BAND_NAME = "95 % band, first order (dotted edge)"
FAINT = 0.25  # of the colour of the mode
HAIR = 1.5e-3  # of the axes: a band whose half width is nowhere more is hidden by the line of its boundary


def bands(chart: StabilityChart, palette: Palette) -> list[dict[str, Any]]:
    """Make a filled trace for each boundary whose band is narrow; none where nothing is uncertain."""
    if not chart.uncertain:
        return []
    traces: list[dict[str, Any]] = []
    for boundary in chart.boundaries:
        if not boundary.band_is_narrow or _largest_half_width(boundary) < HAIR:
            continue
        rims = _join_rims(_ribbon(chart, boundary))
        x, y = (_round_or_none(coordinates) for coordinates in zip(*rims, strict=True))
        colour = colour_on(mode_look(boundary.names[0] or "other").colour, palette)
        red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": BAND_NAME,
                "legendgroup": "band",
                "showlegend": not traces,
                "x": x,
                "y": y,
                "fill": "toself",
                "fillcolor": f"rgba({red},{green},{blue},{FAINT})",
                "hoverinfo": "skip",
                "line": {"color": colour, "dash": "dot", "width": 1},
            }
        )
    return traces


def _join_rims(rims: list[Array]) -> list[list[float | None]]:
    """Join closed rims (k, 2) into one line of points, with a gap of None between two."""
    points: list[list[float | None]] = []
    for rim in rims:
        if points:
            points.append([None, None])
        points += [*rim.tolist(), rim[0].tolist()]
    return points


def _round_or_none(coordinates: Iterable[float | None]) -> list[float | None]:
    """Round coordinates to six digits; the gaps stay None."""
    return [None if x is None else float(f"{x:.6g}") for x in coordinates]


def note_hidden_bands(chart: StabilityChart) -> list[str]:
    """Note the bands that are narrower than a line."""
    return [
        f"boundary {number}: its band is narrower than its line; the table gives the standard uncertainties"
        for number, boundary in enumerate(chart.boundaries, 1)
        if chart.uncertain and _largest_half_width(boundary) < HAIR
    ]


def _largest_half_width(boundary: NamedBoundary) -> float:
    """Largest half width of a 95 % band, in shares of the axes."""
    return float(BAND * boundary.spread[:, 2].max())


def _ribbon(chart: StabilityChart, boundary: NamedBoundary) -> list[Array]:
    """Rims (k, 2) of a band: its boundary moved by the half width to both sides, in the units of the axes."""
    half = BAND * boundary.spread[:, 2:] * boundary.curve.normals
    sides = [boundary.curve.shares + half, (boundary.curve.shares - half)[::-1]]
    return [chart.plane.x(np.clip(rim, 0, 1)) for rim in (sides if boundary.curve.closed else [np.vstack(sides)])]


FINE = 260  # cells of the shading along each axis
SHADES = {False: (246, 222, 219), True: (92, 46, 40)}  # of what is unstable, on light and on dark ground
HATCH = {False: (206, 206, 206), True: (80, 88, 98)}
_one_at_a_time = Lock()


def chart_of(state: State) -> StabilityChart:
    """Compute the chart of a state over its axes ``x`` and ``y``, or take it from those computed last."""
    if not state.x or not state.y:
        raise InputError("stability chart: choose both axes")
    at = None if SPEED in (split_range(state.x)[0], split_range(state.y)[0]) else state.at
    key = State(state.model, state.name, state.rider, state.posture, x=state.x, y=state.y).address
    with _one_at_a_time:
        return _chart(key, at)


def chart_figure(chart: StabilityChart, palette: Palette) -> Figure:
    """Draw boundaries by mode, shaded where something is unstable; pointing at one shows the frequency, Hz."""
    first, second = chart.plane.spans
    data, named = [], set()
    for number, boundary in enumerate(chart.boundaries, 1):
        for name, limit, points, hertz in boundary.pieces(chart.plane):
            words = mode_words(name) if name else "mode unknown"
            data.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": escape(words),
                    "legendgroup": words,
                    "showlegend": words not in named,
                    "x": points[:, 0].tolist(),
                    "y": points[:, 1].tolist(),
                    "customdata": [[hz, "oscillatory" if hz else "not oscillatory"] for hz in hertz.tolist()],
                    "line": series(name or "other", palette)["line"] | {"width": 2.4 if limit else 1.0},
                    "hovertemplate": (
                        f"<b>{escape(words)}</b>, boundary {number}<br>"
                        f"{escape(first.axis.key)} %{{x:.4g}}, {escape(second.axis.key)} %{{y:.4g}}<br>"
                        "frequency %{customdata[0]:.4g} Hz (%{customdata[1]})<extra></extra>"
                    ),
                }
            )
            named.add(words)
    return figure(
        "chart",
        [*bands(chart, palette), *data, *_marks(chart, palette)],
        palette,
        title=escape(title(chart)),
        hovermode="closest",
        xaxis=_axis(first),
        yaxis=_axis(second),
        images=[_shading(chart, palette)],
        meta=chart_table(chart),
    )


def chart_table(chart: StabilityChart) -> dict[str, Any]:
    """Tabulate every point of the boundaries."""
    frame = chart.frame()
    axes = [span.axis.column for span in chart.plane.spans]
    columns = ["boundary", "mode", *axes, "frequency_Hz", "unstable_roots_on_the_stable_side"]
    columns += [f"sd_{axis}" for axis in axes if f"sd_{axis}" in frame]
    rows = [json_cells(row) for row in frame.reindex(columns=columns).astype(object).to_numpy().tolist()]
    return {"columns": [name.replace("_", " ") for name in columns], "rows": rows}


def chart_notes(chart: StabilityChart) -> list[str]:
    """Note how to read a chart, how it was checked, and what is doubtful."""
    notes = ["shaded: at least one mode is unstable"]
    if any((boundary.roots_on_stable_side != 0).any() for boundary in chart.boundaries):
        notes.append("thin lines: another mode is unstable on both sides")
    if _outside(chart).any():
        notes.append("hatched: tyre values are extrapolated")
    return [
        *notes,
        *(line.partition("; --sd")[0] for line in describe_check(chart)),
        *note_hidden_bands(chart),
        *chart.doubts,
    ]


def chart_csv(state: State) -> str:
    """Write a row per point of a boundary, as ``velotyre chart`` does."""
    return str(chart_of(state).frame().to_csv(index=False, lineterminator="\n"))


@lru_cache(maxsize=8)
def _chart(address: str, at: float | None) -> StabilityChart:
    """Compute the chart of an address at the speed ``at``, m/s; None: the speed is an axis."""
    state = parse_state(address)
    with TYRES.by_name():
        return stability_chart(Plane.of(model_content(state), state.x, state.y, speed=at))


def _marks(chart: StabilityChart, palette: Palette) -> list[dict[str, Any]]:
    """Make a trace for each mark: a point, or a line where it has one coordinate."""
    first, second = chart.plane.spans
    traces = []
    named = set()
    for mark in sorted(chart.marks, key=lambda mark: mark.kind == MODEL):  # the model last: on what was measured
        lines = bool(np.isnan(mark.x) or np.isnan(mark.y))
        x = [first.low, first.high] if np.isnan(mark.x) else [mark.x, mark.x] if lines else [mark.x]
        y = [second.low, second.high] if np.isnan(mark.y) else [mark.y, mark.y] if lines else [mark.y]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines" if lines else "markers",
                "x": x,
                "y": y,
                "name": escape(mark.kind),
                "legendgroup": mark.kind,
                "showlegend": mark.kind not in named,
                **_mark_look(mark.kind, palette),
                "hovertemplate": f"{escape(mark.label)}<extra></extra>",
            }
        )
        named.add(mark.kind)
    return traces


def _mark_look(kind: str, palette: Palette) -> dict[str, Any]:
    """Choose line and marker of a mark: thick and filled of the model, dotted and open of what was measured."""
    if kind == MODEL:
        line = {"color": palette.text, "dash": "longdashdot", "width": 2.4}
        return {"line": line, "marker": {"color": palette.text, "symbol": "cross", "size": 11}}
    line = {"color": palette.line, "dash": "dot", "width": 1.2}
    return {"line": line, "marker": {"color": palette.line, "symbol": "circle-open", "size": 9}}


def _axis(span: Span) -> dict[str, Any]:
    """Title, scale and range of an axis, as keys of plotly."""
    unit = "" if span.axis.unit == "1" else f", {span.axis.unit}"
    ends = [span.low, span.high]
    return {
        "title": {"text": escape(f"{span.axis.said}{unit}")},
        "type": "log" if span.log else "linear",
        "showgrid": False,
        "zeroline": False,
        "range": np.log10(ends).tolist() if span.log else ends,
    }


def _shading(chart: StabilityChart, palette: Palette) -> dict[str, Any]:
    """Draw behind the curves: coloured where something is unstable, hatched where the tyre is extrapolated."""
    from matplotlib.image import imsave

    middle: Array = (np.arange(FINE) + 0.5) / FINE
    counts = chart.regions(np.r_[0, middle], np.r_[0, middle])[1:, 1:]
    picture = np.zeros((FINE, FINE, 4), dtype=np.uint8)
    picture[counts > 0] = (*SHADES[palette.dark], 255)
    picture[_outside(chart) & (np.add.outer(np.arange(FINE), np.arange(FINE)) % 9 < 1)] = (*HATCH[palette.dark], 255)
    png = io.BytesIO()
    imsave(png, np.ascontiguousarray(picture.transpose(1, 0, 2)[::-1]), format="png")
    source = f"data:image/png;base64,{base64.b64encode(png.getvalue()).decode('ascii')}"
    place = {"xref": "x domain", "yref": "y domain", "x": 0, "y": 1, "sizex": 1, "sizey": 1}
    return {"source": source, "sizing": "stretch", "layer": "below"} | place


def _outside(chart: StabilityChart) -> Any:
    """Cells (:data:`FINE`, :data:`FINE`) in which the tyre is extrapolated."""
    middle: Array = (np.arange(FINE) + 0.5) / FINE
    return ~chart.plane.space.inside(chart.plane.x(lattice(middle, middle))).reshape(FINE, FINE)
