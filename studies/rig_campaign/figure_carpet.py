"""Carpet plot of a tyre: side force over slip and load."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.rig_campaign.figure_style import COLOURS, DASHES, empty_figure, sweep_curve, titled
from tyre.campaigns.condition import ConditionResult
from tyre.campaigns.recording import points_of
from tyre.campaigns.summary import RecordingSummary
from tyre.recordings.recording import Channel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LOAD_SHIFT = 1.5  # deg by which the carpet moves per load
_SLIPS = (0.0, 1.0, 2.0, 3.0, 4.0)


def carpet(conditions: Sequence[ConditionResult]) -> "Figure":
    """Carpet plot of one tyre on one surface: side force over slip and load, one panel per pressure.

    Parameters
    ----------
    conditions : sequence of ConditionResult
        With slip sweeps.

    Returns
    -------
    matplotlib.figure.Figure
    """
    pressures = sorted({c.pressure for c in conditions})
    loads = sorted({c.load for c in conditions})
    figure, axes = empty_figure(1, len(pressures), width=max(6.4, 2.9 * len(pressures)), height=4.2, sharey=True)
    reach = min(4.0, max(_reach(item) for c in conditions for item in c.sweeps))
    slips = np.array([slip for slip in _SLIPS if slip <= reach + 1e-6])
    fine = np.deg2rad(np.linspace(0.0, slips[-1], 60))
    top = 0.0
    for panel, pressure in zip(axes, pressures, strict=True):
        nodes = []
        for number, load in enumerate(loads):
            here = [c for c in conditions if c.load == load and c.pressure == pressure]
            if not here:
                continue
            shift = _LOAD_SHIFT * number
            colour, dash = COLOURS[number % 6], DASHES[number % 6]
            force = _mean_curve(here[0], fine)
            panel.plot(np.rad2deg(fine) + shift, force, color=colour, ls=dash, lw=1.8, label=f"{load:g} N")
            nodes.append((slips + shift, _mean_curve(here[0], np.deg2rad(slips))))
            top = max(top, float(force.max()))
        for index, slip in enumerate(slips):
            line = np.array([(x[index], y[index]) for x, y in nodes])
            panel.plot(line[:, 0], line[:, 1], color="0.45", lw=0.8, marker=".", ms=4)
            if slip > 0.0:
                label: dict[str, Any] = {
                    "xytext": (4, -3),
                    "textcoords": "offset points",
                    "fontsize": 7.5,
                    "color": "0.25",
                }
                panel.annotate(f"{slip:g}°", line[-1], **label)
        panel.set_title(f"{pressure / 1e5:g} bar", fontsize=10)
        panel.set_xlim(-0.3, slips[-1] + _LOAD_SHIFT * (len(loads) - 1) + 0.9)
        panel.set_xticks([])
        panel.set_xlabel("slip angle, shifted by load")
    axes[0].set_ylabel("side force without offsets (N)")
    axes[0].set_ylim(0.0, 1.12 * top)
    axes[0].legend(title="vertical load", loc="upper left", fontsize=8)
    first = conditions[0]
    return titled(figure, f"{first.tyre}, {first.surface}: side force over slip (grey: constant slip) and load", first)


def _mean_curve(condition: ConditionResult, slip: Channel) -> Channel:
    return np.mean([sweep_curve(item, slip, offsets=False) for item in condition.sweeps], axis=0)


def _reach(summary: RecordingSummary) -> float:
    points = points_of(summary)
    return float(np.rad2deg(np.max(np.abs(points["slip_rad"])))) + 0.1 if points else 4.0
