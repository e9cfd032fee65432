"""Mode shapes as phasor figures: who moves how much and how early in a mode."""

from pathlib import Path
from typing import Any

import numpy as np

from bicycle.eigenvalues.oscillation import damping_ratio, frequency_hz
from bicycle.modal.named_modes import Modes
from studies.reporting.plotting import drawing, look

LABELS = {"lean": "lean", "steer": "steer", "yaw": "yaw", "lateral": "lateral, m per rad"}
PER_ROW = 4
LONG = 1.005
FAINT = 0.005  # of the radius: a smaller phasor is listed, not drawn


def draw_mode_shapes(found: Modes, target: Path, *, names: tuple[str, ...] | None = None, number: int = 0) -> Path:
    """One polar panel per mode at ``found.speeds[number]``: lean, steer, yaw and further joints (rad), lateral (m).

    The largest angle has length 1, lean has phase 0; an arrow ahead of another (anticlockwise) comes first in time. A
    lateral motion longer than 1 m per rad is drawn shortened, its length stands in the legend.

    Parameters
    ----------
    found : Modes
    target : Path
    names : tuple of str, optional
        Modes to draw; by default all that exist.
    number : int, optional
        Index of the speed.
    """
    present = [name for name in names or found.names if not np.isnan(found.branch(name)[number, 0])]
    rows = -(-len(present) // PER_ROW)
    columns = min(len(present), PER_ROW)
    with drawing(target, width=max(3.4 * columns, 4.6), height=4.7 * rows + 0.4) as canvas:
        for place, name in enumerate(present, 1):
            _panel(canvas.add_subplot(rows, columns, place, projection="polar"), found, name, number)
        canvas.suptitle(f"Mode shapes at {found.speeds[number]:g} m/s", x=0.01, ha="left")
    return target


def _panel(axes: Any, found: Modes, name: str, number: int) -> None:
    shape, root = found.shape(name), found.branch(name)[number, 0]
    for k, component in enumerate(shape.components):
        label = LABELS.get(component, component.replace("_", " "))
        length, phase = float(shape.magnitude[component][number]), float(shape.phase[component][number])
        style, end = look(k), min(length, 1.0)
        said = f"{label}: {length:.2g}, {round(np.degrees(phase))}°"
        if end < FAINT or not np.isfinite(length):
            axes.plot([], [], color=style.colour, linestyle=style.line, marker=style.marker, label=said)
            continue
        width = max(2.6 - 0.4 * k, 1.0)
        shortened = {"markerfacecolor": "white", "markeredgewidth": 1.5} if length > LONG else {}
        axes.plot(
            [phase, phase], [0, end], color=style.colour, linestyle=style.line, linewidth=width, zorder=3,
            marker=style.marker, markevery=[1], label=said + (" (shortened)" if length > LONG else ""), **shortened,
        )  # fmt: skip
    axes.set(rlim=(0, 1.08), rticks=(0.5, 1.0), yticklabels=[])
    axes.set_thetagrids(range(0, 360, 45))
    axes.tick_params(labelsize=8, pad=0)
    axes.spines["polar"].set_color("0.8")
    axes.set_title(f"{name.replace('_', ' ')}\n{describe(root)}", loc="center", pad=12)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), handlelength=2.4)


def describe(root: complex) -> str:
    """Frequency and damping ratio of a pair, time constant of a real ``root`` (1/s)."""
    if root.imag:
        return f"{abs(frequency_hz(root)):.2f} Hz, damping ratio {damping_ratio(root):.3f}"
    if root.real == 0:
        return "neutral"
    return f"{'grows' if root.real > 0 else 'decays'} by e in {1 / abs(root.real):.2g} s"
