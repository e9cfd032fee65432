"""The look of each named mode, the same in every figure: colours and lines that survive greyscale."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

UNSTABLE = "#f6dedb"  # background of what is unstable
EXTRAPOLATED: Mapping[str, Any] = MappingProxyType({"hatch": "//", "edgecolor": "0.82"})
"""Background of what rests on extrapolated tyre values."""


class Look(NamedTuple):
    """Colour, line style and marker of one series; the colours differ in lightness too."""

    colour: str
    line: Any
    marker: str

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
    Look("#8f6bb0", (0, (7, 2)), "P"),
    Look("#6b6b6b", (0, (2, 2)), "X"),
    Look("#000000", "-", "*"),
)
MODE_LOOKS: Mapping[str, Look] = MappingProxyType(
    {
        name: LOOKS[number]
        for number, name in enumerate(
            ("weave", "front_compliance", "wobble", "capsize", "castering", "rear_tyre", "rider")
        )
    }
)
OTHER_MARKERS = ("*", "<", ">", "p", "h", "d")  # modes beyond those with a name


def mode_look(name: str) -> Look:
    """The look of a named mode, the same in all figures; a joint name has the look of its first mode.

    Modes ``other_1``, ``other_2``, ... differ by marker.
    """
    first = name.split("+")[0]
    if first in MODE_LOOKS:
        return MODE_LOOKS[first]
    number = first.rpartition("_")[2]
    return LOOKS[-1]._replace(marker=OTHER_MARKERS[(int(number) - 1 if number.isdigit() else 0) % len(OTHER_MARKERS)])


def mode_marker(name: str) -> dict[str, Any]:
    """Marker keywords of a mode: filled; under a joint name in the colours of the other modes it may be."""
    own, *others = (mode_look(part).colour for part in name.split("+"))
    return {
        "marker": mode_look(name).marker, "markerfacecolor": others[0] if others else own,
        "markeredgecolor": others[-1] if len(others) > 1 else own, "markeredgewidth": 1.4 if others else 0.8,
    }  # fmt: skip


def mode_words(name: str) -> str:
    """A mode's name as a figure writes it; a joint name says that its parts are no longer told apart."""
    return " or ".join(part.replace("_", " ") for part in name.split("+"))
