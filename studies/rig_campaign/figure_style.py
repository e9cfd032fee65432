"""What the figures of a campaign have in common: colours, an empty figure, the title, the curve of a sweep."""

from typing import TYPE_CHECKING

from tyre.campaigns.condition import ConditionResult
from tyre.campaigns.summary import RecordingSummary
from tyre.fits.sweep_curve import magic_formula
from tyre.recordings.recording import Channel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#08306b", "#c0392b", "#e8a33d", "#2a7f62", "#7d5ba6", "#555555")  # dark to light, told apart in grey
MARKERS = ("o", "s", "^", "D", "v", "P")
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))


def empty_figure(
    rows: int, columns: int, *, width: float, height: float, sharex: bool = False, sharey: bool = False
) -> "tuple[Figure, list[Axes]]":
    """A figure without a window and its panels in one list.

    Parameters
    ----------
    rows, columns : int
    width, height : float
        inch.
    sharex, sharey : bool
        As of pyplot.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, list(axes.flat)


def titled(figure: "Figure", text: str, what: ConditionResult | RecordingSummary) -> "Figure":
    """The figure with a title that says where its data are synthetic.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    text : str
        Title.
    what : ConditionResult or RecordingSummary
        What is shown.
    """
    figure.suptitle(f"{text}\nSYNTHETIC: from the rig simulator, not measured" if what.synthetic else text, fontsize=10)
    return figure


def sweep_curve(summary: RecordingSummary, slip: Channel, *, offsets: bool = True) -> Channel:
    """Fitted steady side force of one sweep.

    Parameters
    ----------
    summary : RecordingSummary
        Of a slip sweep.
    slip : ndarray, shape (n,)
        rad.
    offsets : bool
        With Sh and Sv, or through the origin.

    Returns
    -------
    ndarray, shape (n,)
        N.
    """
    details = summary.details
    force, _ = magic_formula(
        slip=slip + (details["Sh_rad"] if offsets else 0.0),
        cornering_stiffness=summary.value,
        peak=details["peak_N"],
        shape=details["shape"],
        curvature=details["curvature"],
    )
    return force + (details["Sv_N"] if offsets else 0.0)
