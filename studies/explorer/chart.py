"""Draw the stability chart of a state: boundaries over two of its numbers, as ``velotyre chart`` finds them."""

import base64
import io
from functools import lru_cache
from html import escape
from threading import Lock
from typing import Any

import numpy as np

from bicycle.stability.mode_figure import mode_look, mode_words
from studies.chart.chart import BAND, NamedBoundary, StabilityChart, describe_check, stability_chart, title
from studies.chart.plane import Plane, Span, lattice, split_range
from studies.explorer.figures import Figure, Palette, colour_on, figure, json_cells, series
from studies.explorer.models import model_content, model_of
from studies.explorer.state import State, parse_state
from studies.explorer.tyre_files import TYRES
from studies.model_space.axes import OF_THE_TYRE, SPEED, axis_keys, axis_of, typical_range
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError


def axis_options(state: State) -> list[dict[str, Any]]:
    """List what can stand along an axis of the chart of a state: key, words with the unit, usual range."""
    model = model_of(state)
    found = [{"key": SPEED, "words": "speed, m/s", "low": f"{state.slow:g}", "high": f"{state.fast:g}"}]
    tyres = any("tyre" in table for table in state.content.get("effects", {}).values())
    found += [
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
        found.append({"key": key, "words": words, "low": f"{low:.6g}", "high": f"{high:.6g}"})
    return found


def chart_axes(state: State) -> list[dict[str, Any]]:
    """The two axes of the stability chart: ``name``, ``words``, ``options``, ``low``, ``high`` and ``log``."""
    try:
        options = axis_options(state)
    except InputError:  # the message stands beside the figures
        return []
    found: list[dict[str, Any]] = []
    for name, words, usual, given in (("x", "Across", 0, state.x), ("y", "Upwards", 1, state.y)):
        key, equals, ends = given.partition("=")
        chosen = next((one for one in options if one["key"] == key), options[usual])
        taken = ends if equals and chosen["key"] == key else ""
        low, _, high = taken.removesuffix(":log").partition(":")
        found.append(
            {
                "name": name,
                "words": words,
                "options": options,
                "chosen": chosen["key"],
                "low": low or chosen["low"],
                "high": high or chosen["high"],
                "log": taken.endswith(":log"),
            }
        )
    return found


BAND_NAME = "95 % band, first order (dotted edge)"
FAINT = 0.25  # of the colour of the mode
HAIR = 1.5e-3  # of the axes: a band whose half width is nowhere more is hidden by the line of its boundary


def bands(chart: StabilityChart, palette: Palette) -> list[dict[str, Any]]:
    """A filled trace for each boundary whose band means something; none where nothing is uncertain."""
    if not chart.uncertain:
        return []
    found: list[dict[str, Any]] = []
    for one in chart.boundaries:
        if not one.band_is_narrow or _largest_half_width(one) < HAIR:
            continue
        # closed rims one after the other, None between them
        rims = [point for rim in _ribbon(chart, one) for point in ([None, None], *rim.tolist(), rim[0].tolist())][1:]
        x, y = ([None if at is None else float(f"{at:.6g}") for at in along] for along in zip(*rims, strict=True))
        colour = colour_on(mode_look(one.names[0] or "other").colour, palette)
        red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
        found.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": BAND_NAME,
                "legendgroup": "band",
                "showlegend": not found,
                "x": x,
                "y": y,
                "fill": "toself",
                "fillcolor": f"rgba({red},{green},{blue},{FAINT})",
                "hoverinfo": "skip",
                "line": {"color": colour, "dash": "dot", "width": 1},
            }
        )
    return found


def note_hidden_bands(chart: StabilityChart) -> list[str]:
    """Note the bands that are narrower than a line."""
    return [
        f"boundary {number}: its band is narrower than its line; the table has its standard deviations"
        for number, one in enumerate(chart.boundaries, 1)
        if chart.uncertain and _largest_half_width(one) < HAIR
    ]


def _largest_half_width(one: NamedBoundary) -> float:
    return float(BAND * one.spread[:, 2].max())


def _ribbon(chart: StabilityChart, one: NamedBoundary) -> list[Array]:
    """Rims (k, 2) of a band: its boundary moved by the half width to both sides, in the units of the axes."""
    half = BAND * one.spread[:, 2:] * one.curve.normals
    sides = [one.curve.shares + half, (one.curve.shares - half)[::-1]]
    return [chart.plane.x(np.clip(rim, 0, 1)) for rim in (sides if one.curve.closed else [np.vstack(sides)])]


FINE = 260  # cells of the shading along each axis
SHADES = {False: (246, 222, 219), True: (92, 46, 40)}  # of what is unstable, on light and on dark ground
HATCH = {False: (206, 206, 206), True: (80, 88, 98)}
_one_at_a_time = Lock()


def chart_of(state: State) -> StabilityChart:
    """The chart of a state over its axes ``x`` and ``y``; kept, so that asking again is free."""
    if not state.x or not state.y:
        raise InputError("stability chart: choose what stands along both axes")
    at = None if SPEED in (split_range(state.x)[0], split_range(state.y)[0]) else state.at
    key = State(state.model, state.name, state.rider, state.posture, x=state.x, y=state.y).address
    with _one_at_a_time:
        return _chart(key, at)


def chart_figure(chart: StabilityChart, palette: Palette) -> Figure:
    """Boundaries by mode, shaded where something is unstable; pointing at one tells the frequency."""
    first, second = chart.plane.spans
    data, named = [], set()
    for number, one in enumerate(chart.boundaries, 1):
        for name, limit, points, hertz in one.pieces(chart.plane):
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
                    "customdata": [[hz, "oscillates" if hz else "does not oscillate"] for hz in hertz.tolist()],
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
    """Every point of the boundaries."""
    frame = chart.frame()
    axes = [span.axis.column for span in chart.plane.spans]
    columns = ["boundary", "mode", *axes, "frequency_Hz", "unstable_roots_on_the_stable_side"]
    columns += [f"sd_{axis}" for axis in axes if f"sd_{axis}" in frame]
    rows = [json_cells(row) for row in frame.reindex(columns=columns).astype(object).to_numpy().tolist()]
    return {"columns": [name.replace("_", " ") for name in columns], "rows": rows}


def chart_notes(chart: StabilityChart) -> list[str]:
    """Note how to read a chart, how it was checked, and what is doubtful."""
    said = ["shaded: something is unstable"]
    said += (
        ["thin lines: unstable on both sides"]
        if any((one.roots_on_stable_side != 0).any() for one in chart.boundaries)
        else []
    )
    said += ["hatched: the tyre is extrapolated"] if _outside(chart).any() else []
    return [
        *said,
        *(line.partition("; --sd")[0] for line in describe_check(chart)),
        *note_hidden_bands(chart),
        *chart.doubts,
    ]


def chart_csv(state: State) -> str:
    """A row per point of a boundary, as ``velotyre chart`` writes it."""
    return str(chart_of(state).frame().to_csv(index=False, lineterminator="\n"))


@lru_cache(maxsize=8)
def _chart(address: str, at: float | None) -> StabilityChart:
    state = parse_state(address)
    with TYRES.by_name():
        return stability_chart(Plane.of(model_content(state), state.x, state.y, speed=at))


def _marks(chart: StabilityChart, palette: Palette) -> list[dict[str, Any]]:
    first, second = chart.plane.spans
    found, named = [], set()
    for mark in chart.marks:
        lines = bool(np.isnan(mark.x) or np.isnan(mark.y))
        x = [first.low, first.high] if np.isnan(mark.x) else [mark.x] * (1 + lines)
        y = [second.low, second.high] if np.isnan(mark.y) else [mark.y] * (1 + lines)
        found.append(
            {
                "type": "scatter",
                "mode": "lines" if lines else "markers",
                "x": x,
                "y": y,
                "name": escape(mark.kind),
                "legendgroup": mark.kind,
                "showlegend": mark.kind not in named,
                "line": {"color": palette.line, "dash": "dot"},
                "marker": {"color": palette.text, "symbol": "cross" if mark.kind == "model" else "circle", "size": 10},
                "hovertemplate": f"{escape(mark.label)}<extra></extra>",
            }
        )
        named.add(mark.kind)
    return found


def _axis(span: Span) -> dict[str, Any]:
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
    found = io.BytesIO()
    imsave(found, np.ascontiguousarray(picture.transpose(1, 0, 2)[::-1]), format="png")
    source = f"data:image/png;base64,{base64.b64encode(found.getvalue()).decode('ascii')}"
    place = {"xref": "x domain", "yref": "y domain", "x": 0, "y": 1, "sizex": 1, "sizey": 1}
    return {"source": source, "sizing": "stretch", "layer": "below"} | place


def _outside(chart: StabilityChart) -> Any:
    """Cells (:data:`FINE`, :data:`FINE`) in which the tyre is extrapolated."""
    middle: Array = (np.arange(FINE) + 0.5) / FINE
    return ~chart.plane.space.inside(chart.plane.x(lattice(middle, middle))).reshape(FINE, FINE)
