"""The look of each named mode, the same in every figure: colours and lines that survive greyscale."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple
from zlib import crc32

from bicycle.modal.known_modes import known_modes, packaged_modes

UNSTABLE = "#f6dedb"  # background of what is unstable
EXTRAPOLATED: Mapping[str, Any] = MappingProxyType({"hatch": "//", "edgecolor": "0.82"})
"""Background of what rests on extrapolated tyre values."""


class Look(NamedTuple):
    """Colour, line style and marker of one series; the colours differ in lightness too.

    ``bare`` is the line where no marker helps to tell it from others, ``line`` unless it is given.
    """

    colour: str
    line: Any
    marker: str
    bare: Any = None

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
LINES = ((0, (4, 1, 1, 1)), (0, (8, 1.5)), (0, (2, 1)), (0, (6, 1, 2, 1)))


def mode_look(name: str) -> Look:
    """The look of a named mode, the same in all figures; a joint name has the look of its first mode.

    Modes ``other_1``, ``other_2``, ... differ by marker. A mode that declares no look has one that follows from its
    name, so that it is the same in every figure whatever other effects there are.

    Parameters
    ----------
    name : str
        As in :func:`bicycle.modal.named_modes.modes`.

    Returns
    -------
    Look
    """
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
    """Marker keywords of a mode: filled; under a joint name in the colours of the other modes it may be.

    Parameters
    ----------
    name : str
    """
    own, *others = (mode_look(part).colour for part in name.split("+"))
    return {
        "marker": mode_look(name).marker, "markerfacecolor": others[0] if others else own,
        "markeredgecolor": others[-1] if len(others) > 1 else own, "markeredgewidth": 1.4 if others else 0.8,
    }  # fmt: skip


def mode_words(name: str) -> str:
    """A mode's name as a figure writes it; a joint name says that its parts are no longer told apart.

    Parameters
    ----------
    name : str
    """
    return " or ".join(part.replace("_", " ") for part in name.split("+"))
