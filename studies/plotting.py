"""The house style of every figure: sizes, colours and lines that survive greyscale, and saving as PNG and SVG.

Figures are made without pyplot, so that nothing depends on a display or on global state.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

FORMATS = ("png", "svg")
GREY = "0.45"
UNSTABLE = "#f6dedb"  # background of what is unstable
EXTRAPOLATED: Mapping[str, Any] = MappingProxyType({"hatch": "//", "edgecolor": "0.82"})
STYLE: Mapping[str, Any] = MappingProxyType(
    {
        "axes.axisbelow": True,
        "axes.grid": True,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlelocation": "left",
        "axes.titlesize": 10,
        "axes.titleweight": "bold",
        "figure.dpi": 100,
        "font.size": 9.5,
        "grid.color": "0.88",
        "grid.linewidth": 0.6,
        "hatch.linewidth": 0.6,
        "legend.frameon": False,
        "legend.fontsize": 8.5,
        "lines.linewidth": 1.6,
        "lines.markersize": 5,
        "savefig.dpi": 160,
        "svg.hashsalt": "velotyre",
    }
)


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


def look(number: int) -> Look:
    """The look of the n-th series; after eight they repeat."""
    return LOOKS[number % len(LOOKS)]


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


def legend_columns(labels: Sequence[str], *, width: float) -> int:
    """How many columns of a legend under a figure of some width (inches) fit."""
    room = [0.068 * len(label) + 0.6 for label in labels]
    for columns in range(len(labels), 1, -1):
        rows = -(-len(labels) // columns)  # a legend is filled column by column
        if sum(max(room[start : start + rows]) for start in range(0, len(room), rows)) < width:
            return columns
    return 1


@contextmanager
def drawing(target: Path, *, width: float, height: float) -> Iterator[Any]:
    """Give an empty figure (inches) in the house style; save it as ``target`` .png and .svg at the end of the block."""
    import matplotlib
    from matplotlib.figure import Figure

    style: Any = dict(STYLE)
    with matplotlib.rc_context(style):
        figure = Figure(figsize=(width, height), layout="constrained")
        yield figure
        for suffix in FORMATS:
            metadata = {"Date": None} if suffix == "svg" else {"Software": None}
            figure.savefig(target.with_suffix(f".{suffix}"), metadata=metadata)


def pressure_shade(number: int, count: int) -> str:
    """Grey from light (lowest pressure) to black (highest)."""
    return f"{0.7 * (1 - number / max(count - 1, 1)):.3f}"


def hatch_extrapolated(axes: Any, extrapolated: bool) -> None:
    """Hatch the background of axes whose content rests on extrapolated tyre values."""
    if extrapolated:
        axes.patch.set(**EXTRAPOLATED)


def extrapolated_note(extrapolated: bool) -> str:
    """What the title of a figure with such axes says."""
    return "; hatched: tyre values extrapolated" if extrapolated else ""
