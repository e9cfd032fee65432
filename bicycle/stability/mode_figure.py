"""Look of each named mode, the same in every figure, and modes along speed as a picture; matplotlib comes later."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from bicycle.model.eigen import frequency_hz, oscillating
from bicycle.stability.naming import known_modes, packaged_modes
from tyre.ground.errors import extrapolated

UNSTABLE = "#f6dedb"  # background of what is unstable
EXTRAPOLATED: Mapping[str, Any] = MappingProxyType({"hatch": "//", "edgecolor": "0.82"})
"""Background of what rests on extrapolated tyre values."""


class Look(NamedTuple):
    """Colour, line style and marker of one series; the colours differ in lightness too."""

    colour: str  # hexadecimal
    line: Any  # line style of matplotlib: its sign, or offset and dashes in points
    marker: str  # of matplotlib
    bare: Any = None  # line style where no markers are drawn; None: the same

    @property
    def plot(self) -> dict[str, Any]:
        """Keywords of ``Axes.plot``."""
        return {"color": self.colour, "linestyle": self.line, "marker": self.marker}


LOOKS = (
    Look("#123a6b", "-", "o"),
    Look("#5f9ed1", (0, (5, 2)), "s"),
    Look("#c8462f", (0, (5, 1.5, 1, 1.5)), "^"),
    Look("#e5a823", (0, (1, 1.2)), "D"),
    Look("#3b7d4f", (0, (3, 1, 1, 1, 1, 1)), "v"),
    Look("#8f6bb0", (0, (7, 2)), "P", (0, (9, 2, 3, 2))),
    Look("#6b6b6b", (0, (2, 2)), "X"),
    Look("#000000", "-", "*"),
)
OTHER_MARKERS = ("*", "<", ">", "p", "h", "d")  # modes without a name
COLOURS = ("#a83f7b", "#2f9c95", "#7a5230", "#9aa62e", "#d98c6a")  # modes that declare no look: other than LOOKS
MARKERS = ("H", "<", "8", ">", "p", "h", "d")
DAMPED = 40.0  # 1/s: what decays faster is over within a few hundredths of a second and left out of the picture
ROOM = 1.08
LINES = ((0, (4, 1, 1, 1)), (0, (8, 1.5)), (0, (2, 1)), (0, (6, 1, 2, 1)))


def mode_look(name: str) -> Look:
    """The look of a named mode, the same in all figures; a joint name has the look of its first mode."""
    first = name.split("+")[0]
    number = first.removeprefix("other_")
    if number.isdigit():
        return LOOKS[-1]._replace(marker=OTHER_MARKERS[(int(number) - 1) % len(OTHER_MARKERS)])
    mode = packaged_modes().get(first) or known_modes().get(first)
    if mode is not None and mode.look is not None:
        return LOOKS[mode.look % len(LOOKS)]
    if first == "other":
        return LOOKS[-1]
    digest = crc32(first.encode())
    colour, marker, line = (digest // by % len(of) for by, of in ((1, COLOURS), (5, MARKERS), (35, LINES)))
    return Look(COLOURS[colour], LINES[line], MARKERS[marker])


def mode_marker(name: str) -> dict[str, Any]:
    """Marker keywords of a mode: filled; under a joint name in the colours of the other modes it may be."""
    colour, *further_colours = (mode_look(part).colour for part in name.split("+"))
    return {
        "marker": mode_look(name).marker,
        "markerfacecolor": further_colours[0] if further_colours else colour,
        "markeredgecolor": further_colours[-1] if len(further_colours) > 1 else colour,
        "markeredgewidth": 1.4 if further_colours else 0.8,
    }


def mode_words(name: str) -> str:
    """A mode's name as a figure writes it; a joint name: its parts cannot be distinguished."""
    return " or ".join(part.replace("_", " ") for part in name.split("+"))


def draw_modes(found: Any, axes: Any = None) -> tuple[Any, Any]:
    """Frequency (Hz, damped) above, real part (1/s) below; pale background and pale bands where a mode is unstable,
    hatched where the model rests on tyre values beyond the measured ones."""
    if axes is None:
        from matplotlib import pyplot

        _, axes = pyplot.subplots(2, 1, sharex=True, figsize=(7.0, 6.0), layout="constrained")
    frequency, real = axes
    order = np.argsort(found.speeds, kind="stable")
    speeds = found.speeds[order]
    exchanges = [event for event in found.events if event.kind == "exchange"]
    for name in found.names:
        # a line ends where the mode exchanges character with another: behind it another root has the name
        gaps = np.array([event.speed for event in exchanges if set(event.modes) & set(name.split("+"))])
        places = np.searchsorted(speeds, gaps)
        values = np.insert(found.branches[name][order], places, np.nan, axis=0)
        _draw(frequency, real, name, np.insert(speeds, places, gaps), values)
    _limits(frequency, real, np.concatenate([values.ravel() for values in found.branches.values()]))
    low, high = real.get_ylim()
    real.axhspan(0, high, color=UNSTABLE, zorder=0, linewidth=0)
    frequency.set(ylabel="Frequency, Hz (pale: unstable)")
    is_extrapolated = extrapolated(found.model.warnings)
    hatched = "; hatched: tyre values extrapolated" if is_extrapolated else ""
    real.set(ylabel="Real part, 1/s (shaded: unstable)", xlabel=f"Speed, m/s{hatched}")
    if speeds[-1] > speeds[0]:
        real.set_xlim(speeds[0], speeds[-1])
        frequency.set_xlim(speeds[0], speeds[-1])
    for part in (frequency, real):
        part.patch.set(**(EXTRAPOLATED if is_extrapolated else {}))
        part.grid(True, color="0.88", linewidth=0.6)
        part.set_axisbelow(True)
    handles, labels = real.get_legend_handles_labels()
    hidden = {mode_words(name) for name in found.names if np.nanmax(found.branches[name].real, initial=-np.inf) < low}
    labels = [f"{label} (out of view)" if label in hidden else label for label in labels]
    frequency.legend(handles, labels, frameon=False, fontsize="small", ncols=3, loc="best")
    return frequency, real


def _draw(frequency: Any, real: Any, name: str, speeds: Any, values: Any) -> None:
    marker_step = max(1, len(speeds) // 12)
    style = {"color": mode_look(name).colour, "linewidth": 1.5, "markersize": 4.5, **mode_marker(name)}
    label: str | None = mode_words(name)
    for branch in values.T:
        if np.isnan(branch.real).all():
            continue
        real.plot(speeds, branch.real, markevery=marker_step, label=label, **style)
        label = None
        hertz = frequency_hz(oscillating(branch))
        frequency.plot(speeds, np.where(branch.real > 0, hertz, np.nan), color=UNSTABLE, linewidth=7, zorder=1)
        frequency.plot(speeds, hertz, markevery=marker_step, **style)


def _limits(frequency: Any, real: Any, values: Any) -> None:
    """Show every unstable root and the slower stable ones; frequencies of what is shown."""
    finite = values[~np.isnan(values)]
    low = max(float(finite.real.min()), -DAMPED)
    high = max(float(finite.real.max()), -0.15 * low, 1.0)
    real.set_ylim(ROOM * min(low, -1.0), ROOM * high)
    slow = finite.imag[finite.real >= low]
    frequency.set_ylim(0, ROOM * max(float(frequency_hz(1j * slow.max())), 0.5))
