"""Modes along speed as a picture: frequency and growth, one colour per mode. matplotlib is imported when it is used."""

from typing import Any

import numpy as np

from bicycle.eigenvalues.oscillation import frequency_hz, oscillating
from bicycle.modal.looks import EXTRAPOLATED, UNSTABLE, mode_look, mode_marker, mode_words
from tyre.base.notes import extrapolated

DAMPED = 40.0  # 1/s: what decays faster is over within a few hundredths of a second and left out of the picture
ROOM = 1.08
MARKS = 12  # markers along a line


def draw_modes(found: Any, axes: Any = None) -> tuple[Any, Any]:
    """Frequency (Hz, damped) above, real part (1/s) below; pale background and pale bands where a mode is unstable,
    hatched where the model rests on tyre values beyond the measured ones. What decays faster than 40 1/s lies below
    the picture; the legend says so of a mode of which nothing is seen.

    Parameters
    ----------
    found : bicycle.modal.named_modes.Modes
    axes : two matplotlib axes, optional
        Upper and lower; a new figure of ``matplotlib.pyplot`` when not given.

    Returns
    -------
    frequency, real : matplotlib.axes.Axes
    """
    if axes is None:
        from matplotlib import pyplot

        _, axes = pyplot.subplots(2, 1, sharex=True, figsize=(7.0, 6.0), layout="constrained")
    frequency, real = axes
    order = np.argsort(found.speeds, kind="stable")
    speeds = found.speeds[order]
    for name in found.names:
        _draw(frequency, real, name, speeds, found.branches[name][order])
    _limits(frequency, real, np.concatenate([values.ravel() for values in found.branches.values()]))
    low, high = real.get_ylim()
    real.axhspan(0, high, color=UNSTABLE, zorder=0, linewidth=0)
    frequency.set(ylabel="Frequency, Hz (pale: unstable)")
    beyond = extrapolated(found.model.warnings)
    hatched = "; hatched: tyre values extrapolated" if beyond else ""
    real.set(ylabel="Real part, 1/s (shaded: unstable)", xlabel=f"Speed, m/s{hatched}")
    if speeds[-1] > speeds[0]:
        real.set_xlim(speeds[0], speeds[-1])
        frequency.set_xlim(speeds[0], speeds[-1])
    for part in (frequency, real):
        part.patch.set(**(EXTRAPOLATED if beyond else {}))
        part.grid(True, color="0.88", linewidth=0.6)
        part.set_axisbelow(True)
    handles, labels = real.get_legend_handles_labels()
    hidden = {mode_words(name) for name in found.names if np.nanmax(found.branches[name].real, initial=-np.inf) < low}
    labels = [f"{label} (out of view)" if label in hidden else label for label in labels]
    frequency.legend(handles, labels, frameon=False, fontsize="small", ncols=3, loc="best")
    return frequency, real


def _draw(frequency: Any, real: Any, name: str, speeds: Any, values: Any) -> None:
    every = max(1, len(speeds) // MARKS)
    style = {"color": mode_look(name).colour, "linewidth": 1.5, "markersize": 4.5, **mode_marker(name)}
    label: str | None = mode_words(name)
    for branch in values.T:
        if np.isnan(branch.real).all():
            continue
        real.plot(speeds, branch.real, markevery=every, label=label, **style)
        label = None
        hertz = frequency_hz(oscillating(branch))
        frequency.plot(speeds, np.where(branch.real > 0, hertz, np.nan), color=UNSTABLE, linewidth=7, zorder=1)
        frequency.plot(speeds, hertz, markevery=every, **style)


def _limits(frequency: Any, real: Any, values: Any) -> None:
    """Show every unstable root and the slower stable ones; frequencies of what is shown."""
    there = values[~np.isnan(values)]
    low = max(float(there.real.min()), -DAMPED)
    high = max(float(there.real.max()), -0.15 * low, 1.0)
    real.set_ylim(ROOM * min(low, -1.0), ROOM * high)
    slow = there.imag[there.real >= low]
    frequency.set_ylim(0, ROOM * max(float(frequency_hz(1j * slow.max())), 0.5))
