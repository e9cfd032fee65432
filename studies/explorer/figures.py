"""Draw the figures of a state along speed and at one speed, each a plotly dict with its table in ``layout.meta``."""

import colorsys
import logging
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from html import escape
from textwrap import wrap
from typing import Any

import numpy as np

from bicycle.model.default_sd import EXACT
from bicycle.model.eigen import angular_frequency, frequency_hz, oscillating
from bicycle.stability.critical import CriticalSpeed
from bicycle.stability.mode_figure import mode_look, mode_words
from bicycle.stability.named_modes import UNITS, Modes
from studies.explorer.models import AtSpeed, Computed
from studies.model_space.lasting_motions import Trace
from studies.model_space.ranking import Ranking
from tyre.ground.errors import InputError, extrapolated

MARKERS = {
    "o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down", "P": "cross", "X": "x",
    "*": "star", "H": "hexagon", "h": "hexagon2", "<": "triangle-left", ">": "triangle-right", "8": "octagon",
    "p": "pentagon", "d": "diamond-tall",
}  # fmt: skip
LINE_WIDTH = 2.0  # pixels; the house's lines are counted in widths
HEIGHTS = {  # height of each figure, pixels
    "modes": 580, "critical": 240, "locus": 460, "damping": 400, "sensitivity": 520, "amplitude": 400, "chart": 520,
}  # fmt: skip

TITLE_LETTERS, SUBTITLE_LETTERS = 46, 56  # of a line: what a telephone (390 px) shows without cutting it

FAILED = "not computed: the terminal of velotyre explore shows the cause"
Figure = dict[str, Any]


@dataclass(frozen=True)
class Palette:
    """Colours of the page around the series."""

    dark: bool  # True: light on dark ground
    text: str  # CSS colour of letters, as are the others
    grid: str  # of grid lines
    line: str  # of axes, marks and rims
    unstable: str  # of shading


LIGHT = Palette(False, "#1b1f24", "#dfe3e8", "#57606a", "rgba(200,70,47,0.13)")
DARK = Palette(True, "#e6e9ed", "#3a414b", "#aab2bd", "rgba(240,120,95,0.20)")
PALETTES = {"light": LIGHT, "dark": DARK}


def colour_on(colour: str, palette: Palette) -> str:
    """Lighten a colour ``#rrggbb`` so that it is seen on dark ground."""
    if not palette.dark:
        return colour
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    hue, lightness, saturation = colorsys.rgb_to_hls(red, green, blue)
    lighter = colorsys.hls_to_rgb(hue, max(lightness, 0.62), saturation)
    return "#" + "".join(f"{round(255 * part):02x}" for part in lighter)


def series(mode: str, palette: Palette, *, pinned: bool = False) -> dict[str, Any]:
    """Choose line, marker and opacity of a mode, as keys of a plotly trace; thin and pale if ``pinned``."""
    look = mode_look(mode)
    colour = colour_on(look.colour, palette)
    dash = "solid" if isinstance(look.line, str) else ",".join(f"{LINE_WIDTH * length:g}px" for length in look.line[1])
    return {
        "line": {"color": colour, "dash": dash, "width": 1.2 if pinned else LINE_WIDTH},
        "marker": {"color": colour, "symbol": MARKERS.get(look.marker, "circle"), "size": 7},
        "opacity": 0.55 if pinned else 1.0,
    }


def figure(name: str, data: list[Any], palette: Palette, *, title: str, below: str = "", **more: Any) -> Figure:
    """Make the figure ``name`` in the layout that all share, a line ``below`` the title, and further keys of plotly."""
    axis = {"gridcolor": palette.grid, "zerolinecolor": palette.line, "linecolor": palette.grid, "automargin": True}
    lines, lines_below = wrap(title, TITLE_LETTERS), wrap(below, SUBTITLE_LETTERS)
    heading: dict[str, Any] = {
        "text": "<br>".join(lines),
        "font": {"size": 14},
        "x": 0,
        "xref": "container",
        "y": 0.985,
        "yref": "container",
        "yanchor": "top",
        "pad": {"l": 8, "t": 6},
    }
    if below:
        heading["subtitle"] = {"text": "<br>".join(lines_below), "font": {"size": 12}}
    margin = dict(more.pop("margin", {"l": 60, "r": 12, "b": 48}))
    margin["t"] = 48 + 18 * max(0, len(lines) - 1) + (8 + 16 * len(lines_below) if below else 0)
    layout: dict[str, Any] = {
        "height": HEIGHTS[name],
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": palette.text, "size": 13, "family": "system-ui, sans-serif"},
        "title": heading,
        "margin": margin,
        "uirevision": "same",
        "hoverlabel": {"font": {"size": 13}},
        "legend": {"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom", "x": 0, "font": {"size": 12}},
    } | more
    layout |= {key: axis | changes for key, changes in layout.items() if key.startswith(("xaxis", "yaxis"))}
    return {"data": data, "layout": layout}


ONCE, FIXED = {"automargin": False, "ticklabeloverflow": "allow"}, {"l": 76, "r": 20, "b": 48}
"""Axes whose numbers are short: a margin that the browser fits to them makes it draw every axis twice,
and numbers that it looks for beyond the figure make it lay out the page again for each."""
CLEAR = ONCE | {"automargin": "height"}  # of an axis with a legend below it, whose rows depend on the width of the page


def halving(growth: float) -> str:
    """Write the time (s) in which a motion halves or doubles by its ``growth``, 1/s."""
    if growth == 0 or math.isnan(growth):
        return "constant amplitude"
    return f"{'doubles' if growth > 0 else 'halves'} in {math.log(2) / abs(growth):.3g} s"


def modes_figure(model: Computed, pinned: Mapping[str, Computed], palette: Palette) -> Figure:
    """Draw real part (1/s) above and frequency (Hz) below along speed, by mode; pinned models as thin lines."""
    data: list[Any] = []
    for label, drawn in {"": model, **pinned}.items():
        data += _curves(drawn.named, palette, label)
    slow, fast, critical = _range(model)
    low, high = _real_range([model, *pinned.values()])
    line = {"type": "line", "xref": "x", "yref": "paper", "y0": 0, "y1": 1,
            "line": {"color": palette.line, "width": 1, "dash": "dot"}}  # fmt: skip
    shade = _shade(palette) | {"xref": "paper", "x0": 0, "x1": 1, "yref": "y", "y0": 0, "y1": high}
    shapes = [shade, *(line | {"x0": c.speed, "x1": c.speed} for c in critical)]
    extrapolation = "; tyre values extrapolated" if extrapolated(model.notes) else ""
    return figure(
        "modes",
        data,
        palette,
        title="Modes along speed (shaded: unstable)",
        shapes=shapes,
        hovermode="closest",
        margin=FIXED,
        meta=modes_table(model.named),
        xaxis={"title": {"text": f"Speed, m/s{extrapolation}"}, "range": [slow, fast], "anchor": "y2"} | CLEAR,
        yaxis={"title": {"text": "Real part, 1/s"}, "domain": [0.53, 1.0], "range": [low, high]} | ONCE,
        yaxis2={
            "title": {"text": "Frequency, Hz"},
            "domain": [0.0, 0.47],
            "range": [0, slow_hertz([model, *pinned.values()])],
        }
        | ONCE,
    )


SLOW_HZ = 15.0  # what oscillates faster, such as a wheel on its tyre, is left out of an axis at first


def slow_hertz(models: Sequence[Computed]) -> float:
    """Choose the end of an axis of frequencies (Hz) that holds the slow oscillations of all models."""
    highest = []
    for model in models:
        for name in model.named.names:
            hertz = model.named.frequency(name)
            if np.isfinite(hertz).any():
                highest.append(np.nanmax(hertz))
    return 1.1 * float(max([hertz for hertz in highest if hertz <= SLOW_HZ], default=max(highest, default=1.0)) or 1.0)


def root_locus(model: Computed, palette: Palette) -> Figure:
    """Draw eigenvalues in the complex plane (upper half; 1/s, rad/s), coloured by speed, marker by mode."""
    named = model.named
    data: list[dict[str, Any]] = []
    for name in named.names:
        at, column = np.nonzero(~np.isnan(named.branches[name]))
        values = named.branches[name][at, column]
        if not values.size:
            continue
        look = series(name, palette)
        bar = {"title": {"text": "Speed, m/s", "side": "right"}, "thickness": 12} if not data else None
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": mode_words(name),
                "legendgroup": name,  # without groups all entries get the width of the longest
                "x": values.real.tolist(),
                "y": values.imag.tolist(),
                "customdata": named.speeds[at].tolist(),
                "marker": {
                    "symbol": look["marker"]["symbol"],
                    "size": 7,
                    "color": named.speeds[at].tolist(),
                    "showscale": not data,
                    "colorscale": "Viridis",
                    "colorbar": bar,
                    "cmin": float(named.speeds.min()),
                    "cmax": float(named.speeds.max()),
                    "line": {"width": 0.6, "color": palette.line},
                },
                "hovertemplate": f"<b>{escape(mode_words(name))}</b><br>%{{customdata:.3g}} m/s: %{{x:.4g}} + "
                "%{y:.4g}i 1/s<extra></extra>",
            }
        )
    low, high = _real_range([model])
    shade = _shade(palette) | {"xref": "x", "x0": 0, "x1": high, "yref": "paper", "y0": 0, "y1": 1}
    return figure(
        "locus",
        data,
        palette,
        title="Root locus in speed (shaded: unstable)",
        shapes=[shade],
        margin=FIXED,
        xaxis={"title": {"text": "Real part, 1/s"}, "range": [low, high]} | CLEAR,
        meta=modes_table(named),
        yaxis={"title": {"text": "Imaginary part, rad/s"}, "range": [0, float(angular_frequency(slow_hertz([model])))]}
        | ONCE,
    )


def critical_strip(model: Computed, palette: Palette) -> Figure:
    """Draw critical speeds (m/s) on one line per mode: where it becomes stable and where unstable."""
    slow, fast, critical = _range(model)
    data = [
        {
            "type": "scatter",
            "mode": "markers+text",
            "x": [c.speed],
            "y": [mode_words(c.mode)],
            "showlegend": False,
            "text": [f"{c.speed:.2f}"],
            "textposition": "top center",
            "name": mode_words(c.mode),
            "cliponaxis": False,
            "marker": series(c.mode, palette)["marker"]
            | {
                "size": 13,
                "symbol": "triangle-right" if c.destabilising else "triangle-left-open",
            },
            "hovertemplate": f"{escape(critical_words(c))}<extra></extra>",
        }
        for c in critical
    ]
    rows = [[c.speed, c.mode, c.kind, c.frequency_hz, c.direction] for c in model.critical]
    none = "no critical speed in this range" if not critical else "filled: unstable above; open: stable above"
    return figure(
        "critical",
        data or [{"type": "scatter", "mode": "markers", "x": [], "y": [], "showlegend": False}],
        palette,
        title="Critical speeds",
        below=none,
        xaxis={"title": {"text": "Speed, m/s"}, "range": [slow, fast]},
        yaxis={"type": "category"},
        meta={"columns": ["speed m/s", "mode", "kind", "frequency Hz", "with increasing speed"], "rows": rows},
    )


CRITICAL = "{speed:.4f} m/s: {mode} becomes {change} ({how})"


def critical_words(critical: CriticalSpeed) -> str:
    """Describe a critical speed in one line."""
    how = f"{critical.frequency_hz:.3g} Hz" if critical.oscillatory else "not oscillatory"
    change = "unstable" if critical.destabilising else "stable"
    return CRITICAL.format(speed=critical.speed, mode=mode_words(critical.mode), change=change, how=how)


@lru_cache(maxsize=8)
def modes_table(named: Modes) -> dict[str, Any]:
    """Tabulate a row per speed, mode and root, every digit, and when the motion halves or doubles."""
    frame = named.to_dataframe()
    headings = {"speed_m_s": "speed", "real_1_s": "real part", "imaginary_rad_s": "imaginary part"}
    headings |= {"frequency_Hz": "frequency", "damping_ratio": "damping ratio"}
    columns = [f"{headings.get(name, name)} {'' if unit == '1' else unit}".strip() for name, unit in UNITS.items()]
    rows = [[*json_cells(row), halving(row[2])] for row in frame.itertuples(index=False, name=None)]
    return {"columns": [*columns, "time"], "rows": rows}


def json_cells(cells: Iterable[Any]) -> list[Any]:
    """Make values JSON-ready: None in place of a float that is not finite."""
    return [None if isinstance(cell, float) and not math.isfinite(cell) else cell for cell in cells]


def _curves(named: Modes, palette: Palette, label: str) -> Iterator[dict[str, Any]]:
    """Yield for each root of each mode its real part (1/s) and, if it oscillates, its frequency (Hz) along speed."""
    speeds = named.speeds.tolist()
    marks = max(2, len(speeds) // max(1, len(speeds) // 12))  # along a curve
    for name in named.names:
        style = series(name, palette, pinned=bool(label))
        words = mode_words(name)
        called = f"{words}, {label}" if label else words
        ratio = named.damping_ratio(name)
        for column, values in enumerate(named.branches[name].T):
            if np.isnan(values).all():
                continue
            hertz = np.abs(frequency_hz(oscillating(values)))
            hover = [_hover(called, *row) for row in zip(speeds, values, hertz, ratio, strict=True)]
            shared = {
                "type": "scatter",
                "mode": "lines" if label else "lines+markers",
                "x": speeds,
                "name": escape(called),
                "text": hover,
                "hovertemplate": "%{text}<extra></extra>",
                "legendgroup": called,
                "line": style["line"],
                "opacity": style["opacity"],
                "marker": style["marker"] | {"maxdisplayed": marks},
            }
            meta = {"mode": name, "pin": label}
            yield shared | {"y": json_cells(values.real.tolist()), "showlegend": column == 0, "meta": meta}
            if not np.isnan(hertz).all():
                yield shared | {"y": json_cells(hertz.tolist()), "yaxis": "y2", "showlegend": False}


def _hover(words: str, speed: float, root: complex, hertz: float, ratio: float) -> str:
    """Describe one root (1/s) at a ``speed`` (m/s) with its frequency (Hz) and damping ratio, NaN if it has none."""
    if np.isnan(root):
        return ""
    how = f"{hertz:.4g} Hz" if not math.isnan(hertz) else "not oscillatory"
    damping = f", damping ratio {ratio:.4g}" if not math.isnan(ratio) else ""
    return f"<b>{escape(words)}</b> at {speed:.3g} m/s<br>{how}{damping}<br>{halving(root.real)}"


def _real_range(models: Sequence[Computed]) -> tuple[float, float]:
    """Choose a range (1/s) with every unstable root and the stable ones that decay slower than 20 1/s."""
    branches = [values for model in models for values in model.named.branches.values()]
    real = np.concatenate([values.real.ravel() for values in branches])
    low = max(float(np.nanmin(real)), -20.0)
    return 1.08 * min(low, -1.0), 1.08 * max(float(np.nanmax(real)), -0.15 * low, 1.0)


def _range(model: Computed) -> tuple[float, float, list[CriticalSpeed]]:
    """Find the slowest and fastest speed, m/s, and the critical speeds between them."""
    slow, fast = float(model.named.speeds.min()), float(model.named.speeds.max())
    return slow, fast, [c for c in model.critical if slow <= c.speed <= fast]


def _shade(palette: Palette) -> dict[str, Any]:
    """Make the rectangle behind what is unstable, without its ends."""
    return {"type": "rect", "line": {"width": 0}, "fillcolor": palette.unstable, "layer": "below"}


def figure_or_words(name: str, make: Callable[[], Figure], palette: Palette) -> Figure:
    """Make a figure; where its numbers are refused, an empty one with the reason in words."""
    try:
        return make()
    except InputError as error:
        message = str(error)
    except Exception:
        logging.getLogger(__name__).exception("no figure")
        message = FAILED
    words = {"text": "<br>".join(wrap(escape(message), 60)), "showarrow": False, "align": "left"}
    words |= {"xref": "paper", "yref": "paper", "x": 0, "y": 0.9}
    none, meta = {"visible": False}, {"columns": ["message"], "rows": [[message]]}
    return figure(name, [], palette, title="", annotations=[words], xaxis=none, yaxis=none, meta=meta)


def damping_figure(at: AtSpeed, palette: Palette) -> Figure:
    """Draw the damping ratio of each oscillation with one sd as band; all roots are in the table."""
    speed = float(at.named.speeds[0])
    rows: list[list[Any]] = []
    data: list[dict[str, Any]] = []
    labels: list[tuple[str, float, str]] = []  # name, where its error bar ends, text
    for name, values in at.named.branches.items():
        ratio = float(at.named.damping_ratio(name)[0])
        hertz = float(at.named.frequency(name)[0])
        sd = at.sd[name]
        rows += [
            [*json_cells([name, root.real, root.imag, abs(hertz), ratio, sd]), halving(root.real)]
            for root in values[0][~np.isnan(values[0])].tolist()
        ]
        if values[0, 0].imag > 0:
            words = "<br>".join(mode_words(name).rsplit(" ", 1))  # short lines stay level on a narrow page
            has_sd = not math.isnan(sd)
            labels.append((words, ratio + math.copysign(sd if has_sd else 0.0, ratio), ratio_text(ratio, sd)))
            band = {"type": "data", "array": json_cells([sd]), "color": palette.text, "thickness": 2, "visible": has_sd}
            data.append(
                {
                    "type": "bar",
                    "x": [words],
                    "y": [ratio],
                    "showlegend": False,
                    "name": escape(mode_words(name)),
                    "width": [0.5],
                    "marker": {"color": series(name, palette)["line"]["color"]},
                    "error_y": band,
                    "hovertemplate": f"{escape(mode_words(name))}: damping ratio %{{y:.5g}}<extra></extra>",
                }
            )
    low, high = (choose((0.0, *(end for _, end, _ in labels))) for choose in (min, max))
    span = high - low or 1.0
    data.append(
        {
            "type": "scatter",
            "mode": "text",
            "x": [words for words, _, _ in labels],
            "y": [end + math.copysign(0.02 * span, end) for _, end, _ in labels],  # clear of the cap of the bar
            "text": [label for _, _, label in labels],
            "textposition": ["top center" if end >= 0 else "bottom center" for _, end, _ in labels],
            "textfont": {"size": 12, "color": palette.text},
            "cliponaxis": False,
            "showlegend": False,
            "hoverinfo": "skip",
        }
    )
    columns = [
        "mode",
        "real part 1/s",
        "imaginary part rad/s",
        "frequency Hz",
        "damping ratio",
        "standard uncertainty",
        "time",
    ]
    stated = "error bars: one stated standard uncertainty"
    subtitle = stated if at.uncertain else "no error bars: no uncertainty is stated"
    return figure(
        "damping",
        data,
        palette,
        title=f"Damping of the oscillatory modes at {speed:.4g} m/s",
        below=subtitle,
        yaxis={
            "title": {"text": "Damping ratio (below 0: grows)"},
            "range": [low - LABEL_SHARE * span if low < 0 else 0.0, high + LABEL_SHARE * span],
        },
        xaxis={"type": "category", "tickangle": 0},
        meta={"columns": columns, "rows": rows},
    )


LABEL_SHARE = 0.18  # of the axis: the height of a label of two lines beyond the longest bar


def ratio_text(ratio: float, sd: float) -> str:
    """Write a damping ratio with its standard uncertainty on a second line, to the digit that is uncertain."""
    if math.isnan(sd) or sd <= 0:
        return f"{ratio:.3g}"
    digits = max(0, -math.floor(math.log10(sd)))
    if digits > 5:
        return f"{ratio:.5f}<br>± {sd:.0e}"
    return f"{ratio:.{digits}f}<br>± {sd:.{digits}f}"


def sensitivity_figure(ranking: Ranking, palette: Palette) -> Figure:
    """Draw the change of a mode's growth rate (1/s) for one sd of each parameter, the largest above."""
    top = [change for change in ranking.changes if change.origin != EXACT][:12][::-1]  # the table has all
    colour = series(ranking.mode, palette)["line"]["color"]
    rows = [
        [c.parameter, c.value, c.unit, c.sd, c.origin, c.growth, c.frequency if ranking.eigenvalue.imag else None]
        for c in ranking.changes
    ]
    columns = ["parameter", "value", "unit", "standard uncertainty", "its origin", "growth 1/s", "frequency Hz"]
    words = escape(mode_words(ranking.mode))
    names = [_shorten(c.parameter) for c in top]
    bars = {
        "type": "bar",
        "orientation": "h",
        "x": [c.growth for c in top],
        "showlegend": False,
        "y": [_in_two_lines(name) for name in names],
        "customdata": names,
        "marker": {"color": colour, "pattern": {"shape": ["/" if c.growth > 0 else "" for c in top]}},
        "text": [f"+{c.sd:.2g} {c.unit if c.unit != '1' else ''} ({c.origin})" for c in top],
        "hovertemplate": "%{customdata}: %{x:.3g} 1/s for %{text}<extra></extra>",
        "textposition": "none",
    }
    return figure(
        "sensitivity",
        [bars],
        palette,
        title=f"Sensitivity of {words} at {ranking.speed:.4g} m/s",
        below="for +1 standard uncertainty; hatched: destabilising",
        xaxis={"title": {"text": "Δ growth rate, 1/s"}},
        yaxis={"type": "category"},
        meta={"columns": columns, "rows": rows},
    )


def amplitude_figure(traces: Sequence[Trace], fast: float, palette: Palette) -> Figure:
    """Draw the steer amplitude (deg) of limit cycles over speed, on tyres that saturate; dotted where unstable."""
    columns = ["mode", "speed m/s", "steer amplitude deg", "frequency Hz", "stable"]
    data: list[dict[str, Any]] = []
    rows: list[list[Any]] = []
    for trace in traces:
        lasting = np.where(trace.lasting | (trace.amplitude == 0), trace.amplitude, np.nan)
        rows += map(list, zip([trace.mode] * len(trace.stable), *trace[1:4], trace.stable, strict=True))
        for y, dash, in_legend in ((trace.amplitude, "dot", False), (lasting, "solid", True)):
            look = series(trace.mode, palette)["line"] | {"dash": dash} | ({} if in_legend else {"width": 1})
            data.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": trace.speed.tolist(),
                    "line": look,
                    "showlegend": in_legend,
                    "y": [None if np.isnan(at) else at for at in y.tolist()],
                    "name": mode_words(trace.mode),
                    "hovertemplate": "%{y:.3g}° at %{x:.3g} m/s",
                }
            )
    return figure(
        "amplitude",
        data,
        palette,
        title="Limit cycles over speed" if traces else f"No limit cycle up to {fast:g} m/s",
        below="peak factor 0.8 or the tyre's curves; dotted: unstable",
        xaxis={"title": {"text": "Speed, m/s"}, "range": [0, fast]},
        yaxis={"title": {"text": "Steer amplitude, °"}, "rangemode": "tozero"},
        meta={"columns": columns, "rows": rows},
    )


def _in_two_lines(name: str) -> str:
    """Break a long name where its parts meet, so that the bars keep their room on a narrow page."""
    ends = [k + 1 for k, letter in enumerate(name) if letter in "._"]
    if len(name) <= 20 or not ends:
        return name
    middle = min(ends, key=lambda end: abs(end - len(name) / 2))
    return f"{name[:middle]}<br>{name[middle:]}"


def _shorten(parameter: str) -> str:
    """Leave out the effect of a parameter if it has the same name."""
    parts = parameter.split(".")
    return ".".join(parts[1:]) if len(parts) > 1 and parts[0] == parts[1] else parameter
