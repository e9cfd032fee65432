"""House style of every figure: sizes, colours and lines that survive greyscale, and saving as PNG and SVG.

Figures are made without pyplot, so that nothing depends on a display or on global state.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.stability.mode_figure import EXTRAPOLATED, LOOKS, UNSTABLE, Look, mode_look, mode_marker, mode_words
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import replacing

if TYPE_CHECKING:
    from bicycle.model.state_space import LinearModel

__all__ = [
    "EXTRAPOLATED", "GREY", "LOOKS", "STYLE", "UNSTABLE", "Look", "check_picture", "draw_picture",
    "drawing", "hatch_extrapolated", "legend_columns", "look", "mode_look", "mode_marker", "mode_words", "picture",
    "plain_text", "settle",
]  # fmt: skip

GREY = "0.45"
STYLE: Mapping[str, Any] = MappingProxyType({
    "axes.axisbelow": True, "axes.grid": True, "axes.spines.right": False, "axes.spines.top": False,
    "axes.titlelocation": "left", "axes.titlesize": 10, "axes.titleweight": "bold", "figure.dpi": 100,
    "font.size": 9.5, "grid.color": "0.88", "grid.linewidth": 0.6, "hatch.linewidth": 0.6, "legend.frameon": False,
    "legend.fontsize": 8.5, "lines.linewidth": 1.6, "lines.markersize": 5, "savefig.dpi": 160,
    "svg.hashsalt": "velotyre",
})  # fmt: skip


def look(number: int) -> Look:
    """Look of series number ``number``; after eight they repeat."""
    return LOOKS[number % len(LOOKS)]


def legend_columns(labels: Sequence[str], *, width: float) -> int:
    """Number of columns of a legend with ``labels`` that fit under a figure of a ``width`` in inches."""
    room = [0.068 * len(label) + 0.6 for label in labels]
    for columns in range(len(labels), 1, -1):
        rows, longer = divmod(len(labels), columns)  # a legend is filled column by column, the first ones longer
        ends = np.cumsum([rows + (k < longer) for k in range(columns)]).tolist()
        if sum(max(room[a:b]) for a, b in zip([0, *ends[:-1]], ends, strict=True)) < width:
            return columns
    return 1


@contextmanager
def drawing(target: Path, *, width: float, height: float) -> Iterator[Any]:
    """Give an empty figure in the house style; save it as ``target`` .png and .svg at the end of the block."""
    with _figure(width, height) as figure:
        yield figure
        settle(figure)
        for suffix, stamp in (("png", "Software"), ("svg", "Date")):
            # a name may hold a dot (weave_at_5.5), which with_suffix would take for an ending
            with replacing(target.with_name(f"{target.name}.{suffix}")) as part:
                figure.savefig(part, metadata={stamp: None})


def check_picture(target: str) -> None:
    """Refuse a ``target`` that is no picture before anything is computed."""
    if Path(target).suffix.lower() not in (".png", ".svg", ".pdf"):
        raise InputError(f"--plot {target}: the ending must be one of .png, .svg, .pdf")


def draw_picture(model: "LinearModel", speeds: Array, target: str, *, title: str) -> None:
    """Draw the modes of a model over the range of ``speeds`` (m/s) into ``target``, finely enough for smooth lines."""
    from bicycle.stability.mode_figure import draw_modes
    from bicycle.stability.named_modes import modes

    if np.ptp(speeds) > 0:
        speeds = np.union1d(speeds, np.linspace(speeds.min(), speeds.max(), 241))
    with picture(target) as figure:
        frequency, _ = draw_modes(modes(model, speeds), figure.subplots(2, 1, sharex=True))
        frequency.set_title(title)


@contextmanager
def picture(target: str, *, width: float = 7.5, height: float = 6.5) -> Iterator[Any]:
    """Give an empty figure in the house style; save it as the file ``target`` at the end of the block."""
    with _figure(width, height) as figure:
        yield figure
        settle(figure)
        try:
            with replacing(target) as part:
                figure.savefig(part)
        except OSError as error:
            raise InputError(f"{target}: cannot write the picture: {error.strerror}") from error


@contextmanager
def _figure(width: float, height: float) -> Iterator[Any]:
    import matplotlib
    from matplotlib.figure import Figure

    style: Any = dict(STYLE)
    with matplotlib.rc_context(style):
        yield Figure(figsize=(width, height), layout="constrained")


def settle(figure: Any) -> None:
    """Make a finished ``figure`` ready to be saved: texts that are no formulas, and its layout, found once."""
    import matplotlib

    plain_text(figure)
    dpi = matplotlib.rcParams["savefig.dpi"]
    figure.dpi = figure.dpi if dpi == "figure" else dpi
    figure.get_layout_engine().execute(figure)
    figure.set_layout_engine(None)


def plain_text(artist: Any) -> None:
    """Let no text of a figure (``artist``) be a formula but the ticks of its axes: a name may hold a $."""
    from matplotlib.axis import Axis
    from matplotlib.text import Text

    # children of an axis but its ticks, which would all be made to be passed over
    for part in (artist.label, artist.offsetText) if isinstance(artist, Axis) else artist.get_children():
        if isinstance(part, Text):
            part.set_parse_math(False)
        else:
            plain_text(part)


def hatch_extrapolated(axes: Any, *, extrapolated: bool) -> None:
    """Hatch the background of ``axes`` if their content rests on ``extrapolated`` tyre values."""
    if extrapolated:
        axes.patch.set(**EXTRAPOLATED)
