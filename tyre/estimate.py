"""A measured value with its standard uncertainty, degrees of freedom and 95 % interval (GUM)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Estimate:
    """One value, its standard uncertainty and the effective degrees of freedom behind that uncertainty.

    The 95 % interval is ``value -+ t(0.975, dof) sd``: few repeats give a wide one (GUM, JCGM 100:2008, annex G).
    """

    value: float
    sd: float
    dof: float = np.inf

    @property
    def ci95(self) -> tuple[float, float]:
        """Lower and upper end of the 95 % interval."""
        from scipy import stats  # costs more than the rest of `import tyre`

        half = float(stats.t.ppf(0.975, self.dof)) * self.sd
        return self.value - half, self.value + half

    def covers(self, truth: float) -> bool:
        """Whether the 95 % interval holds a value.

        Parameters
        ----------
        truth : float
            In the unit of ``value``.
        """
        low, high = self.ci95
        return low <= truth <= high

    def scaled(self, factor: float) -> "Estimate":
        """The same in another unit.

        Parameters
        ----------
        factor : float
            Of the value; the standard deviation follows.
        """
        return Estimate(factor * self.value, abs(factor) * self.sd, self.dof)

    def as_json(self) -> dict[str, object]:
        """``{"value", "sd", "ci95": [lo, hi]}``."""
        return {"value": self.value, "sd": self.sd, "ci95": list(self.ci95)}


def combine_uncertainties(parts: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Root sum of squares of independent parts, with the Welch-Satterthwaite degrees of freedom.

    Parameters
    ----------
    parts : sequence of (sd, dof)
        Standard uncertainties in the same unit; ``inf`` for a part known from a certificate.

    Returns
    -------
    sd, dof : float
        dof = sd^4 / sum(sd_i^4 / dof_i) (JCGM 100:2008, eq. G.2b); never below 1.
    """
    total = float(np.sqrt(sum(sd**2 for sd, _ in parts)))
    spent = sum(sd**4 / dof for sd, dof in parts if np.isfinite(dof))
    return total, (np.inf if spent == 0.0 else max(1.0, total**4 / spent))


REPEATABILITY_DOF = 8.0
"""Degrees of freedom of a stated repeatability: of an sd reliable to 25 %, (1/2) 0.25^-2 (JCGM 100:2008, G.4.2)."""


def weighed_scatter(stated: float, squares: float, repeats: float) -> tuple[float, float]:
    """Standard deviation of one recording from what is stated and from repeats, with its degrees of freedom.

    sd^2 = (nu0 s0^2 + nu s^2) / (nu0 + nu), for the stated s0 that counts nu0 = :data:`REPEATABILITY_DOF` and the
    scatter s of repeats with nu degrees of freedom: the scaled inverse chi^2 prior after the data (Gelman et al.,
    *Bayesian Data Analysis*, 3rd ed., section 2.6). Repeats that refute the stated one (F test, p < 0.05) stand alone.

    Parameters
    ----------
    stated : float
        s0, relative or in the unit of the recording.
    squares : float
        Sum of squared deviations of repeats from their mean, nu s^2, in the unit of s0 squared.
    repeats : float
        Degrees of freedom nu of the repeats, a number > 0.

    Returns
    -------
    sd, dof : float
        dof is nu0 + nu, or nu where the stated one is refuted.
    """
    from scipy import stats

    if stated == 0.0 or stats.f.sf(squares / repeats / stated**2, repeats, REPEATABILITY_DOF) < 0.05:
        return float(np.sqrt(squares / repeats)), repeats
    dof = REPEATABILITY_DOF + repeats
    return float(np.sqrt((REPEATABILITY_DOF * stated**2 + squares) / dof)), dof


@dataclass(frozen=True)
class Calibration:
    """What the rig's certificates leave open: relative standard uncertainties common to a whole campaign.

    They do not average out over repeats, so every interval contains them. ``force`` is the gain of the side-force
    cell, ``slip`` that of the slip-angle sensor, ``displacement`` that of the dial gauges. ``repeatability`` is
    the relative standard deviation assumed for one recording (tyre remounted, warm or cold) where a campaign holds
    no repeats to measure it: a stated floor, so that one sweep never claims the precision of its residuals. It counts
    as :data:`REPEATABILITY_DOF` repeats do, so that few repeats are weighed against it and many replace it.
    """

    force: float = 0.003
    slip: float = 0.003
    displacement: float = 0.002
    repeatability: float = 0.01

    def __post_init__(self) -> None:
        from tyre.base.errors import InputError

        for name in ("force", "slip", "displacement", "repeatability"):
            value = getattr(self, name)
            if not 0.0 <= value < 0.5:
                raise InputError(
                    f"calibration: {name} = {value:g} must be a relative standard uncertainty from 0 to 0.5"
                )
