"""The unmodelled torque as coefficients over speed, with their uncertainty."""

from pathlib import Path

import numpy as np

from studies.diagnosis.residual import STATES, TORQUES, Residual
from studies.reporting.plotting import drawing, look

CAPTION = (
    "Unmodelled torque, as a torque proportional to each state, over the measured speeds, with 95 % bands; thin "
    "lines: terms held at zero, with their uncertainty."
)


def draw_torque(torque: Residual, target: Path) -> bool:
    """Draw a residual ``torque`` into the file ``target`` without ending."""
    speeds = np.linspace(*torque.scale.ends, 121)
    mean, sd = torque.gains_at(speeds)
    low, high = mean - 1.96 * sd, mean + 1.96 * sd
    with drawing(target, width=8.5, height=6.0) as figure:
        axes = figure.subplots(2, 2)
        for i, name in enumerate(TORQUES):
            for k, state in enumerate(STATES):
                axis, style = axes[k // 2, i], {**look(k).plot, "marker": ""}
                if torque.degrees.get((name, state)):
                    axis.fill_between(speeds, low[:, i, k], high[:, i, k], color=look(k).colour, alpha=0.2, linewidth=0)
                    axis.plot(speeds, mean[:, i, k], label=state.replace("_", " "), **style)
                else:
                    thin = {**style, "linewidth": 0.5}
                    axis.plot(speeds, low[:, i, k], label=f"{state.replace('_', ' ')}, held at zero: 95 %", **thin)
                    axis.plot(speeds, high[:, i, k], **thin)
            for k, unit in enumerate(("torque per angle, N m/rad", "torque per rate, N m s/rad")):
                axes[k, i].axhline(0, color="k", linewidth=0.8)
                axes[k, i].set(xlabel="speed, m/s", ylabel=unit, xlim=(speeds[0], speeds[-1]))
            axes[0, i].set(title=f"{name} torque")
        for axis in axes.flat:
            if axis.get_legend_handles_labels()[0]:
                axis.legend(fontsize=8, frameon=True, framealpha=0.9, edgecolor="none")  # lines cross the text else
    return True
