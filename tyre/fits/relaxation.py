"""Relaxation length by three routes: C/K, slip steps, slip sweeps at two rates; and whether the routes agree."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tyre.estimate import REPEATABILITY_DOF, Calibration, Estimate, combine_uncertainties, weighed_scatter
from tyre.fits.slip_step import SlipStepFit


def relaxation_from_stiffness(
    *,
    cornering_stiffness: tuple[float, float, float],
    lateral_stiffness: tuple[float, float, float],
    calibration: Calibration | None = None,
    shared_load_cell: bool = True,
) -> tuple[Estimate, NDArray[np.float64]]:
    """Relaxation length C_Fy / K_y with the covariance of all three (Dell'Orto et al., eq. 3).

    Parameters
    ----------
    cornering_stiffness, lateral_stiffness : (value, sd, dof)
        C_Fy in N/rad and K_y in N/m; sd and degrees of freedom of the scatter alone, without calibration.
    calibration : Calibration, optional
        Force, slip and displacement gains, added here.
    shared_load_cell : bool
        True where one load cell measured both side forces: its gain cancels in the ratio.

    Returns
    -------
    length : Estimate
        m.
    covariance : ndarray, shape (3, 3)
        Of (C_Fy, K_y, length), calibration included; first order.
    """
    calibration = calibration or Calibration()
    c, c_sd, c_dof = cornering_stiffness
    k, k_sd, k_dof = lateral_stiffness
    length = c / k
    force = calibration.force
    shared = force**2 if shared_load_cell else 0.0
    relative = np.array(
        [
            [(c_sd / c) ** 2 + calibration.slip**2 + force**2, shared],
            [shared, (k_sd / k) ** 2 + calibration.displacement**2 + force**2],
        ]
    )
    # d(ln C, ln K, ln length) = rows of this matrix times d(ln C, ln K)
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, -1.0]])
    scale = np.array([c, k, length])
    covariance = rows @ relative @ rows.T * np.outer(scale, scale)
    certificate = calibration.slip**2 + calibration.displacement**2 + 2.0 * (force**2 - shared)
    _, dof = combine_uncertainties([(c_sd / c, c_dof), (k_sd / k, k_dof), (float(np.sqrt(certificate)), np.inf)])
    return Estimate(length, float(np.sqrt(covariance[2, 2])), dof), covariance


class BranchGap(Protocol):
    """What a fitted sweep tells of its branch gap: mean rate (rad/s), speed (m/s), half gap and its sd (rad)."""

    @property
    def rate(self) -> float: ...

    @property
    def speed(self) -> float | None: ...

    @property
    def half_gap(self) -> float: ...

    @property
    def half_gap_sd(self) -> float: ...


def relaxation_from_two_rates(sweeps: Sequence[BranchGap]) -> Estimate | None:
    """Relaxation length from the branch gap of sweeps at two rates or more.

    Half the slip distance between the branches is h = h0 + |d(slip)/dt| length / v: its growth with the rate is the
    lag, while h0 (friction of the steering, play) does not depend on the rate. A constant delay between the force and
    slip channels of the rig reads as lag: delay times speed must be taken off if it is known.

    Parameters
    ----------
    sweeps : sequence of SlipSweepFit (or anything with its branch gap)
        Of one tyre at one condition and one speed.

    Returns
    -------
    Estimate or None
        m; None where rates differ by less than half or the speed is unknown.
    """
    usable = [sweep for sweep in sweeps if sweep.speed is not None and sweep.half_gap_sd > 0.0]
    if len(usable) < 2:
        return None
    pace = np.array([sweep.rate / sweep.speed for sweep in usable if sweep.speed is not None])
    if pace.max() < 1.5 * pace.min():
        return None
    gap = np.array([sweep.half_gap for sweep in usable])
    weight = 1.0 / np.array([sweep.half_gap_sd for sweep in usable])
    design = np.column_stack([np.ones_like(pace), pace])
    bread = np.linalg.inv((design * weight[:, None] ** 2).T @ design)
    values = bread @ (design * weight[:, None] ** 2).T @ gap
    chi2 = float(np.sum(((gap - design @ values) * weight) ** 2))
    dof = len(usable) - 2
    # Scatter beyond the sweeps' own uncertainty widens the result; scatter below it does not narrow it.
    inflation = max(1.0, np.sqrt(chi2 / dof)) if dof else 1.0
    return Estimate(float(values[1]), float(np.sqrt(bread[1, 1])) * inflation, float(dof) if dof else np.inf)


def mean_of_steps(steps: Sequence[SlipStepFit], *, repeatability: float = 0.01) -> Estimate | None:
    """Mean relaxation length of repeated slip steps, their scatter weighed against the stated repeatability.

    Parameters
    ----------
    steps : sequence of SlipStepFit
        Of one tyre at one condition.
    repeatability : float
        Relative standard deviation of one step.

    Returns
    -------
    Estimate or None
        m; None without steps.
    """
    if not steps:
        return None
    values = np.array([step.relaxation_length.value for step in steps])
    mean = float(values.mean())
    if values.size == 1:
        first = steps[0].relaxation_length
        sd, dof = combine_uncertainties([(first.sd, first.dof), (repeatability * mean, REPEATABILITY_DOF)])
        return Estimate(mean, sd, dof)
    own = float(np.sqrt(np.mean([step.relaxation_length.sd**2 for step in steps])))
    squares, repeats = float(np.sum((values - mean) ** 2)), float(values.size - 1)
    sd, dof = weighed_scatter(float(np.hypot(repeatability * mean, own)), squares, repeats)
    return Estimate(mean, max(sd, own) / np.sqrt(values.size), dof)


@dataclass(frozen=True)
class Agreement:
    """Whether routes to the relaxation length agree: chi^2 about their weighted mean, its degrees of freedom and p."""

    routes: dict[str, Estimate]
    mean: float
    chi2: float
    dof: int
    p_value: float

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        names = ", ".join(f"{name} {1e3 * e.value:.1f} +- {1e3 * e.sd:.1f} mm" for name, e in self.routes.items())
        verdict = "agree" if self.p_value >= 0.05 else "disagree"
        return f"{names}: {verdict} (chi^2 = {self.chi2:.2f}, {self.dof} dof, p = {self.p_value:.3f})"


def agreement(routes: Mapping[str, Estimate]) -> Agreement | None:
    """Test whether independent routes give one relaxation length.

    Parameters
    ----------
    routes : mapping of str to Estimate
        Taken as independent; C/K and the sweeps share C only to second order.

    Returns
    -------
    Agreement or None
        None for fewer than two routes.
    """
    if len(routes) < 2:
        return None
    value = np.array([e.value for e in routes.values()])
    # a standard deviation from few repeats is widened to the normal one with the same 95 % interval
    sd = np.array([(e.ci95[1] - e.value) / stats.norm.ppf(0.975) for e in routes.values()])
    weight = 1.0 / sd**2
    mean = float(weight @ value / weight.sum())
    chi2 = float(np.sum(((value - mean) / sd) ** 2))
    dof = value.size - 1
    return Agreement(dict(routes), mean, chi2, dof, float(stats.chi2.sf(chi2, dof)))
