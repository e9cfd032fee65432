"""All channels of a recording as one picture, with the stretches that can be used."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.look.look import Look
from studies.reporting.plotting import GREY, drawing
from tyre.base.arrays import Array

POINTS = 1200  # of a line; beyond, the lowest and the highest of each part are drawn
MOST = 60
LABEL = 40
COLOURS = {
    "slip sweep": "#5f9ed1", "step (relaxation)": "#3b7d4f", "pull test": "#5f9ed1", "free decay (modal)": "#e5a823",
    "replay (histories)": "#8f6bb0",
}  # fmt: skip


def draw(found: Look, target: Path) -> Path:
    """Draw what was ``found`` into ``target`` .png and .svg."""
    names = [column.name for column in found.opened.signals.columns]
    clock = found.opened.clock
    names = [name for name in names if clock is None or name != clock.column.name or len(names) == 1]
    left_out, names = names[MOST:], names[:MOST]
    columns = 1 if len(names) <= 8 else 2 if len(names) <= 20 else 3
    rows = -(-len(names) // columns)
    marked = spans(found)
    with drawing(
        target, width=(9.0, 13.0, 16.0)[columns - 1], height=1.2 + rows * (1.5 if rows <= 8 else 1.15)
    ) as figure:
        axes = figure.subplots(rows, columns, squeeze=False, sharex=True)
        taken = found.channels
        for place, name in enumerate(names):
            panel = axes[place % rows][place // rows]
            _panel(panel, found, name, taken.get(name, ""), place)
            for use, start, end, event in marked:
                panel.axvspan(start, end, color=COLOURS[use], alpha=0.18, linewidth=0)
                if place == 0:
                    panel.annotate(
                        event, (start, 1), xycoords=("data", "axes fraction"), xytext=(2, -2), fontsize=7, va="top",
                        textcoords="offset points",
                    )  # fmt: skip
        for empty in range(len(names), rows * columns):
            axes[empty % rows][empty // rows].set_axis_off()
        timed = any(found.is_timed(name) for name in names)
        for column in range(columns):
            last = min(rows, max(len(names) - column * rows, 1)) - 1
            if last == rows - 1:
                axes[last][column].set_xlabel("time in s" if timed else "sample")
            axes[last][column].tick_params(labelbottom=True)
        more = f"; {len(left_out)} more channels are not drawn" if left_out else ""
        figure.suptitle(f"{found.opened.path.name}{more}", x=0.01, ha="left", fontweight="bold")
        _legend(figure, marked)
    return target.with_name(f"{target.name}.png")


def spans(found: Look) -> list[tuple[str, float, float, str]]:
    """Use, start and end in s (or samples), name; only uses that take less than the whole recording are marked."""
    marked = []
    for use in found.uses:
        for event in use.events:
            if use.name in COLOURS and (event.end_s > event.start_s) and (use.windows or event.name):
                marked.append((use.name, event.start_s, event.end_s, event.name))
    return marked


def _panel(axes: Any, found: Look, name: str, taken: str, place: int) -> None:
    signal = found.opened.signals.signals[name]
    time, values = found.opened.time_of(name), np.where(np.isinf(signal.values), np.nan, signal.values)
    if abs(time[0]) > 1e6:
        time = time - time[0]
    x, y = thinned(time, values)
    dead = found.opened.quality[name].dead
    axes.plot(x, y, color=GREY if dead else "#123a6b", linewidth=0.9)
    for first, last in _gaps(time, values):
        axes.axvspan(first, last, color="#c8462f", alpha=0.25, linewidth=0)
    label = name if len(name) <= LABEL else f"...{name[3 - LABEL :]}"
    words = f"{label} in {signal.unit}" if signal.unit.strip("-[] ") else label
    words += f"  =  {taken}" if taken else ""
    words += "  (constant)" if dead and np.isfinite(y).any() else "  (no valid sample)" if dead else ""
    axes.set_title(_plain(words), fontsize=8.5, fontweight="bold" if taken else "normal")
    axes.tick_params(labelsize=7.5)
    axes.locator_params(axis="y", nbins=4)


def _plain(text: str) -> str:
    return text.replace("$", r"\$")


def thinned(time: Array, values: Array) -> tuple[Array, Array]:
    """A line of few points that looks the same: the extremes of each part of ``time`` and ``values``, shape (n,)."""
    count = values.size
    if count <= 2 * POINTS:
        return time, values
    size = count // POINTS
    whole = count // size * size
    parts = values[:whole].reshape(-1, size)
    empty = np.asarray(np.isnan(parts).all(axis=1))
    filled = np.where(empty[:, None], 0.0, parts)
    low, high = np.nanmin(filled, axis=1), np.nanmax(filled, axis=1)
    low[empty], high[empty] = np.nan, np.nan
    middle = time[:whole].reshape(-1, size)[:, size // 2]
    return np.repeat(middle, 2), np.column_stack([low, high]).reshape(-1)


def _gaps(time: Array, values: Array) -> list[tuple[float, float]]:
    """Stretches without samples, at most 200 of them."""
    missing = np.concatenate([[0], ~np.isfinite(values), [0]]).astype(np.int8)
    edges = np.flatnonzero(np.diff(missing)).tolist()
    ends = zip(edges[::2][:200], edges[1::2][:200], strict=True)
    return [(float(time[first]), float(time[min(last, time.size - 1)])) for first, last in ends]


def _legend(figure: Any, spans: list[tuple[str, float, float, str]]) -> None:
    from matplotlib.patches import Patch

    uses = list(dict.fromkeys(use for use, *_ in spans))
    if uses:
        patches = [Patch(color=COLOURS[use], alpha=0.35, label=f"usable: {use}") for use in uses]
        figure.legend(handles=patches, loc="outside lower left", ncols=len(uses))
