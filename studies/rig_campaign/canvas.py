"""What the figures of a campaign share: looks that are told apart in grey, an empty figure, fitted curves."""

from typing import TYPE_CHECKING

import numpy as np

from tyre.campaigns.condition import ConditionResult
from tyre.campaigns.recording import points_of
from tyre.campaigns.summary import RecordingSummary
from tyre.fits.estimate import Estimate
from tyre.fits.sweep_curve import magic_formula
from tyre.recordings.recording import Channel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#08306b", "#c0392b", "#e8a33d", "#2a7f62", "#7d5ba6", "#555555")  # dark to light, told apart in grey
MARKERS = ("o", "s", "^", "D", "v", "P")
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))


def blank(
    rows: int, columns: int, *, width: float, height: float, sharex: bool = False, sharey: bool = False
) -> "tuple[Figure, list[Axes]]":
    """An empty figure of a number of ``rows`` by ``columns`` of axes; ``width`` and ``height`` in inches (no SI unit).

    ``sharex`` and ``sharey`` as in matplotlib.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, list(axes.flat)


def titled(figure: "Figure", text: str, what: ConditionResult | RecordingSummary | Estimate) -> "Figure":
    """The figure under a title ``text``, marked as synthetic where ``what`` it shows is."""
    synthetic = getattr(what, "synthetic", False)
    figure.suptitle(f"{text}\nSYNTHETIC: from the rig simulator, not measured" if synthetic else text, fontsize=10)
    return figure


def fitted_curve(summary: RecordingSummary, slip: Channel, *, offsets: bool = True) -> Channel:
    """Steady side force (N) of a fitted sweep at ``slip`` (n,), rad, with the fitted shifts if ``offsets``."""
    details = summary.details
    force, _ = magic_formula(
        slip=slip + (details["Sh_rad"] if offsets else 0.0),
        cornering_stiffness=summary.value,
        peak=details["peak_N"],
        shape=details["shape"],
        curvature=details["curvature"],
    )
    return force + (details["Sv_N"] if offsets else 0.0)


def mean_curve(condition: ConditionResult, slip: Channel) -> Channel:
    """Mean of the fitted curves of a condition at ``slip`` (n,), rad, without shifts, N."""
    return np.mean([fitted_curve(item, slip, offsets=False) for item in condition.sweeps], axis=0)


def reach(summary: RecordingSummary) -> float:
    """Largest slip of a sweep, deg."""
    points = points_of(summary)
    return float(np.rad2deg(np.max(np.abs(points["slip_rad"])))) + 0.1 if points else 4.0
