"""The residual torque as a map over state and speed, its parts with their intervals, and over amplitude."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.missing_effect.residual.amplitude import Amplitude
from studies.missing_effect.residual.kept import Kept
from studies.missing_effect.residual.seen import SIZE
from studies.missing_effect.residual.terms import STATES, TORQUES
from studies.reporting.plotting import GREY, drawing, look
from tyre.base.arrays import Array

SPEEDS = 121
CAPTION = (
    "What could not be named, as a torque at the root mean square of each state in the motion seen "
    f"(lean and steer together {SIZE:g} rad), over the measured speeds. Above: a map, white is none. Below: the same "
    "with 95 % bands; thin lines: terms held at zero, with what the data leave open."
)
WITH_AMPLITUDE = " Last: equivalent damping of the steering in pieces of the runs, and with dry friction fitted."


def caption(kept: Kept) -> str:
    """Of the figure of what was ``kept``."""
    return CAPTION + (WITH_AMPLITUDE if kept.amplitude is not None else "")


def draw_torque(kept: Kept, target: Path) -> bool:
    """Draw what was ``kept`` into the file ``target`` without ending; False where nothing was fitted."""
    residual, motion = kept.residual, kept.motion
    if residual is None or motion is None:
        return False
    scale = residual.scale
    speeds = np.linspace(scale.middle - scale.span, scale.middle + scale.span, SPEEDS)
    torque, sd = (part * motion.rms for part in residual.gains_at(speeds))
    rows = 2 if kept.amplitude is None else 3
    with drawing(target, width=8.5, height=3.0 + 3.0 * (rows - 1)) as figure:
        grid = figure.add_gridspec(rows, 2, height_ratios=[0.7] + [1.0] * (rows - 1))
        for k, name in enumerate(TORQUES):
            _map(figure, figure.add_subplot(grid[0, k]), speeds, torque[:, k], name)
            chosen = [bool(residual.degrees.get((name, state))) for state in STATES]
            axis = figure.add_subplot(grid[1, k])
            _curves(axis, speeds, (torque[:, k], sd[:, k]), chosen)
            axis.set(xlabel="speed, m/s", ylabel=f"{name} torque, N m")
        if kept.amplitude is not None:
            _amplitude(figure.add_subplot(grid[2, :]), kept.amplitude)
        from matplotlib.lines import Line2D

        handles = [Line2D([], [], **{**look(k).plot, "marker": ""}) for k in range(len(STATES))]
        states = [f"from {state.replace('_', ' ')}" for state in STATES]
        figure.legend(handles, states, loc="outside upper center", ncols=len(STATES))
    return True


def _map(figure: Any, axis: Any, speeds: Array, torque: Array, name: str) -> None:
    axis.set(title=f"{name} torque", xlabel="speed, m/s", xlim=(speeds[0], speeds[-1]))
    axis.set_yticks(range(len(STATES)), [state.replace("_", " ") for state in STATES])
    axis.set_ylim(len(STATES) - 0.5, -0.5)
    axis.grid(visible=False)
    largest = float(np.abs(torque).max())
    if not largest:
        axis.text(0.5, 0.5, "held at zero", transform=axis.transAxes, ha="center", va="center", color=GREY)
        return
    image = axis.pcolormesh(
        speeds, np.arange(len(STATES)), torque.T, cmap="RdBu_r", vmin=-largest, vmax=largest, shading="nearest"
    )
    figure.colorbar(image, ax=axis, label="N m")


def _curves(axis: Any, speeds: Array, found: tuple[Array, Array], chosen: list[bool]) -> None:
    torque, sd = found
    axis.axhline(0, color="k", linewidth=0.8)
    for k, here in enumerate(chosen):
        style = {**look(k).plot, "marker": ""}
        low, high = torque[:, k] - 1.96 * sd[:, k], torque[:, k] + 1.96 * sd[:, k]
        if here:
            axis.fill_between(speeds, low, high, color=look(k).colour, alpha=0.2, linewidth=0)
            axis.plot(speeds, torque[:, k], **style)
        else:
            axis.plot(speeds, low, **{**style, "linewidth": 0.5})
            axis.plot(speeds, high, **{**style, "linewidth": 0.5})
    axis.set_xlim(speeds[0], speeds[-1])


def _amplitude(axis: Any, found: Amplitude) -> None:
    axis.errorbar(
        found.rate, found.damping, 1.96 * found.sd, fmt="o", color="k", ecolor=GREY, markersize=3, elinewidth=0.8,
        label="pieces of the runs, 95 %",
    )  # fmt: skip
    rate = np.linspace(found.rate.min(), found.rate.max(), SPEEDS)
    words = f"{found.viscous[0]:.2g} N m s/rad and dry friction of {found.dry[0]:.2g} ± {found.dry[1]:.2g} N m"
    axis.plot(rate, found.viscous[0] + 4 * found.dry[0] / (np.pi * rate), **{**look(4).plot, "marker": ""}, label=words)
    axis.set(xlabel="amplitude of the steer rate, rad/s", ylabel="damping, N m s/rad")
    axis.legend(fontsize=7)
