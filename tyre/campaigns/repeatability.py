"""How well a recording repeats: the scatter of repeats over a whole campaign, weighed against the stated floor."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tyre.campaigns.summary import RecordingSummary
from tyre.estimate import REPEATABILITY_DOF, weighed_scatter


@dataclass(frozen=True)
class Repeatability:
    """Relative standard deviation of one recording about its condition's mean, pooled over a campaign.

    Attributes
    ----------
    sd, dof : float
        Relative standard deviation, and the degrees of freedom behind it.
    measured : bool
        Whether any condition has repeats; without, ``sd`` is the stated floor.
    conditions : int
        Conditions with repeats.
    repeats : float
        Degrees of freedom that the repeats bring.
    scatter : float
        Standard deviation of the repeats alone; nan without.
    refuted : bool
        They scatter significantly more than the floor (p < 0.05), which then does not count.
    """

    sd: float
    dof: float
    measured: bool
    conditions: int
    repeats: float = 0.0
    scatter: float = np.nan
    refuted: bool = False


def pooled_repeatability(groups: Sequence[Sequence[RecordingSummary]], *, floor: float) -> Repeatability:
    """Pool the relative scatter of repeats over conditions, and weigh it against the stated floor.

    As :func:`tyre.estimate.weighed_scatter`; what the residuals of the fits say of their noise counts as stated.

    Parameters
    ----------
    groups : sequence of sequences of RecordingSummary
        Repeats of one quantity, one group per condition.
    floor : float
        Stated relative standard deviation of one recording.

    Returns
    -------
    Repeatability
    """
    repeated = [np.array([item.value for item in group]) for group in groups if len(group) > 1]
    dof = float(sum(len(values) - 1 for values in repeated))
    if dof == 0.0:
        return Repeatability(floor, REPEATABILITY_DOF, measured=False, conditions=0)
    squares = sum(float(np.sum((values / values.mean() - 1.0) ** 2)) for values in repeated)
    fitted = [(item.fit_sd / item.value) ** 2 for group in groups for item in group]
    sd, weighed = weighed_scatter(float(np.sqrt(floor**2 + np.median(fitted))), squares, dof)
    return Repeatability(
        sd, weighed, True, len(repeated), repeats=dof, scatter=float(np.sqrt(squares / dof)), refuted=weighed == dof
    )
