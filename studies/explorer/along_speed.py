"""Figures along speed: modes, root locus, critical speeds. Each is a plotly dict; its table is ``layout.meta``."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from html import escape
from typing import Any

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.eigenvalues.oscillation import frequency_hz, oscillating
from bicycle.modal.looks import mode_words
from bicycle.modal.named_modes import UNITS, Modes
from studies.explorer.computed import Computed
from studies.explorer.looks import HEIGHTS, Palette, layout, series
from tyre.base.arrays import Complex
from tyre.base.notes import extrapolated

DAMPED = 40.0  # 1/s: what decays faster is over at once; the picture begins above it, the table has it
MARKS = 12  # markers along a curve
ONCE, FIXED = {"automargin": False, "ticklabeloverflow": "allow"}, {"l": 76, "r": 12, "t": 48, "b": 48}
"""Of axes whose numbers are short: a margin that the browser fits to them makes it draw every axis twice,
and numbers that it looks for beyond the figure make it lay the page out anew for each."""

Figure = dict[str, Any]


def halving(growth: float) -> str:
    """In what time a motion halves or doubles, in words.

    Parameters
    ----------
    growth : float
        Real part of an eigenvalue, 1/s.
    """
    if growth == 0 or math.isnan(growth):
        return "neither grows nor decays"
    return f"{'doubles' if growth > 0 else 'halves'} in {math.log(2) / abs(growth):.3g} s"


def modes_figure(now: Computed, pinned: Mapping[str, Computed], palette: Palette) -> Figure:
    """Real part above and frequency below along speed, by name, with what is pinned as thin lines.

    Parameters
    ----------
    now : Computed
    pinned : mapping of str to Computed
        By label.
    palette : Palette

    Returns
    -------
    dict
        A plotly figure.
    """
    data = [*_curves(now.named, palette, "")]
    for label, one in pinned.items():
        data += _curves(one.named, palette, label)
    slow, fast = float(now.named.speeds.min()), float(now.named.speeds.max())
    inside = [c for c in now.critical if slow <= c.speed <= fast]
    low, high = _real_range([now, *pinned.values()])
    shapes: list[dict[str, Any]] = [
        {
            "type": "rect", "xref": "paper", "x0": 0, "x1": 1, "yref": "y", "y0": 0, "y1": high, "line": {"width": 0},
            "fillcolor": palette.unstable, "layer": "below",
        },
        *(_upright(c.speed, palette) for c in inside),
    ]  # fmt: skip
    beyond = "; tyre values extrapolated" if extrapolated(now.notes) else ""
    return {
        "data": data,
        "layout": layout(
            palette, title="Modes along speed (shaded: unstable)", height=HEIGHTS["modes"], shapes=shapes,
            hovermode="closest",
            margin=FIXED,
            xaxis={"title": {"text": f"Speed, m/s{beyond}"}, "range": [slow, fast], "anchor": "y2"} | ONCE,
            yaxis={"title": {"text": "Real part, 1/s"}, "domain": [0.53, 1.0], "range": [low, high]} | ONCE,
            yaxis2={"title": {"text": "Frequency, Hz"}, "domain": [0.0, 0.47], "rangemode": "tozero"} | ONCE,
            meta=modes_table(now.named),
        ),
    }  # fmt: skip


def root_locus(now: Computed, palette: Palette) -> Figure:
    """Eigenvalues in the complex plane (upper half), coloured by speed, marker by mode.

    Parameters
    ----------
    now : Computed
    palette : Palette

    Returns
    -------
    dict
        A plotly figure.
    """
    named, first = now.named, True
    data = []
    for name in named.names:
        at, values = _roots(named.branches[name])
        if not values.size:
            continue
        look = series(name, palette)
        bar = {"title": {"text": "Speed, m/s", "side": "right"}, "thickness": 12} if first else None
        data.append({
            "type": "scatter", "mode": "markers", "name": mode_words(name), "x": values.real.tolist(),
            "y": values.imag.tolist(), "customdata": named.speeds[at].tolist(),
            "marker": {
                "symbol": look["marker"]["symbol"], "size": 7, "color": named.speeds[at].tolist(), "showscale": first,
                "colorscale": "Viridis", "cmin": float(named.speeds.min()), "cmax": float(named.speeds.max()),
                "line": {"width": 0.6, "color": palette.line}, "colorbar": bar,
            },
            "hovertemplate": f"<b>{escape(mode_words(name))}</b><br>%{{customdata:.3g}} m/s: %{{x:.4g}} + "
                             "%{y:.4g}i 1/s<extra></extra>",
        })  # fmt: skip
        first = False
    low, high = _real_range([now])
    shade = {
        "type": "rect", "xref": "x", "x0": 0, "x1": high, "yref": "paper", "y0": 0, "y1": 1, "line": {"width": 0},
        "fillcolor": palette.unstable, "layer": "below",
    }  # fmt: skip
    return {
        "data": data,
        "layout": layout(
            palette, title="Root locus in speed (shaded: unstable)", height=HEIGHTS["locus"], shapes=[shade],
            margin=FIXED, xaxis={"title": {"text": "Real part, 1/s"}, "range": [low, high]} | ONCE,
            yaxis={"title": {"text": "Imaginary part, rad/s"}, "rangemode": "tozero"} | ONCE, meta=modes_table(named),
        ),
    }  # fmt: skip


def critical_strip(now: Computed, palette: Palette) -> Figure:
    """Critical speeds by name on one line per mode: where it becomes stable and where unstable.

    Parameters
    ----------
    now : Computed
    palette : Palette

    Returns
    -------
    dict
        A plotly figure.
    """
    slow, fast = float(now.named.speeds.min()), float(now.named.speeds.max())
    inside = [c for c in now.critical if slow <= c.speed <= fast]
    data = [
        {
            "type": "scatter", "mode": "markers+text", "x": [c.speed], "y": [mode_words(c.mode)], "showlegend": False,
            "text": [f"{c.speed:.2f}"], "textposition": "top center", "name": mode_words(c.mode), "cliponaxis": False,
            "marker": series(c.mode, palette)["marker"] | {
                "size": 13, "symbol": "triangle-right" if c.destabilising else "triangle-left-open",
            },
            "hovertemplate": f"{escape(critical_words(c))}<extra></extra>",
        }
        for c in inside
    ]  # fmt: skip
    rows = [[c.speed, c.mode, c.kind, c.frequency_hz, c.direction] for c in now.critical]
    none = "no critical speed within the range" if not inside else "filled: unstable above; open: stable above"
    return {
        "data": data or [{"type": "scatter", "mode": "markers", "x": [], "y": [], "showlegend": False}],
        "layout": layout(
            palette, title="Critical speeds", below=none, height=HEIGHTS["critical"],
            xaxis={"title": {"text": "Speed, m/s"}, "range": [slow, fast]}, yaxis={"type": "category"},
            meta={"columns": ["speed m/s", "mode", "kind", "frequency Hz", "as speed grows"], "rows": rows},
        ),
    }  # fmt: skip


def critical_words(critical: CriticalSpeed) -> str:
    """One line on a critical speed.

    Parameters
    ----------
    critical : CriticalSpeed
    """
    how = f"oscillation at {critical.frequency_hz:.3g} Hz" if critical.oscillatory else "without oscillation"
    change = "unstable" if critical.destabilising else "stable"
    return f"{critical.speed:.4f} m/s: {mode_words(critical.mode)} becomes {change} ({how})"


@lru_cache(maxsize=8)
def modes_table(named: Modes) -> dict[str, Any]:
    """The table behind a figure: a row per speed, mode and root, every digit, and when the motion halves or doubles.

    Parameters
    ----------
    named : Modes

    Returns
    -------
    dict
        ``columns`` and ``rows``.
    """
    frame = named.to_dataframe()
    columns = [f"{name} {unit}".strip() for name, unit in _units()]
    rows = [
        [None if isinstance(cell, float) and math.isnan(cell) else cell for cell in row] + [halving(row[2])]
        for row in frame.itertuples(index=False, name=None)
    ]
    return {"columns": [*columns, "time"], "rows": rows}


def _units() -> Sequence[tuple[str, str]]:
    shown = {"speed_m_s": "speed", "real_1_s": "real part", "imaginary_rad_s": "imaginary part"}
    shown |= {"frequency_Hz": "frequency", "damping_ratio": "damping ratio"}
    return [(shown.get(name, name), "" if unit == "1" else unit) for name, unit in UNITS.items()]


def _curves(named: Modes, palette: Palette, label: str) -> Iterator[dict[str, Any]]:
    every = max(1, len(named.speeds) // MARKS)
    speeds = named.speeds.tolist()
    for name in named.names:
        style, words = series(name, palette, pinned=bool(label)), mode_words(name)
        called = f"{words}, {label}" if label else words
        ratio = named.damping_ratio(name)
        for column, values in enumerate(named.branches[name].T):
            there = ~np.isnan(values)
            if not there.any():
                continue
            hertz = np.abs(frequency_hz(oscillating(values)))
            hover = [_hover(called, *row) for row in zip(speeds, values, hertz, ratio, strict=True)]
            shared = {
                "type": "scatter", "mode": "lines" if label else "lines+markers", "x": speeds, "name": escape(called),
                "text": hover, "hovertemplate": "%{text}<extra></extra>", "legendgroup": called, "line": style["line"],
                "opacity": style["opacity"],
                "marker": style["marker"] | {"maxdisplayed": max(2, len(speeds) // every)},
            }  # fmt: skip
            yield shared | {"y": _listed(values.real), "showlegend": column == 0, "meta": {"mode": name, "pin": label}}
            if not np.isnan(hertz).all():
                yield shared | {"y": _listed(hertz), "yaxis": "y2", "showlegend": False}


def _hover(words: str, speed: float, root: complex, hertz: float, ratio: float) -> str:
    if np.isnan(root):
        return ""
    how = f"{hertz:.4g} Hz" if not math.isnan(hertz) else "no oscillation"
    damping = f", damping ratio {ratio:.4g}" if not math.isnan(ratio) else ""
    return f"<b>{escape(words)}</b> at {speed:.3g} m/s<br>{how}{damping}<br>{halving(root.real)}"


def _listed(values: Any) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values.tolist()]


def _roots(values: Complex) -> tuple[Any, Complex]:
    at, column = np.nonzero(~np.isnan(values))
    return at, values[at, column]


def _real_range(every: Sequence[Computed]) -> tuple[float, float]:
    """Every unstable root and the slower stable ones."""
    real = np.concatenate([values.real.ravel() for one in every for values in one.named.branches.values()])
    low = max(float(np.nanmin(real)), -DAMPED)
    return 1.08 * min(low, -1.0), 1.08 * max(float(np.nanmax(real)), -0.15 * low, 1.0)


def _upright(speed: float, palette: Palette) -> dict[str, Any]:
    line = {"color": palette.line, "width": 1, "dash": "dot"}
    return {"type": "line", "xref": "x", "x0": speed, "x1": speed, "yref": "paper", "y0": 0, "y1": 1, "line": line}
