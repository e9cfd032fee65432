"""Recordings of a rig reduced to what a fit compares: block means of sweeps, readings of pulls, and their noise.

The noise of a sweep is white plus AR(1), whose constants come (by restricted maximum likelihood) from the
residual of a Magic Formula with everything free that a single recording can show; so they do not depend on what is
missing from the base model. It is whitened by the Cholesky factor of its covariance: the whitened residuals are
innovations in the order of time.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.signal import savgol_filter

from tyre.base.arrays import Array
from tyre.base.units import PASCAL_PER_BAR
from tyre.fits.noise_in_time import AR1Noise, estimate_noise
from tyre.fits.pull_test import fit_pull_test
from tyre.fits.slip_sweep import SlipSweepFit, fit_slip_sweep
from tyre.fits.sweep_branches import Blocks
from tyre.fits.sweep_curve import lagged_magic_formula
from tyre.recordings.recording import Condition, PullTest, RigRun

SMOOTHED = 15  # blocks of 0.1 deg of the slip angle
MOST_BLOCKS = 240  # of a sweep; of longer ones every second, third ... block is compared
SWEEP_TERMS = (
    "cornering_stiffness", "peak", "shape", "curvature", "shift", "lag", "play", "offset", "drift", "delay", "warming",
    "asymmetry", "gain_by_sign",
)  # fmt: skip
"""What the force of a sweep depends on, in the units of the recording (its own scales included)."""


@dataclass(frozen=True, eq=False)
class SweepBlocks:
    """Block means of one slip sweep.

    Attributes
    ----------
    name : str
    condition : Condition
    time, slip, force : ndarray, shape (n,)
        s, rad, N.
    direction : ndarray, shape (n,)
        Sign of d(slip)/dt.
    branch : ndarray of int, shape (n,)
        Its number.
    slip_time, slip_history : ndarray, shape (m,)
        s, rad; also where the blocks are not compared.
    speed : float, optional
        Rolling speed, m/s.
    rate : float
        Mean size of d(slip)/dt, rad/s.
    noise : AR1Noise
        N^2 and s.
    common : ndarray, shape (n, k), optional
        Errors common to all blocks, 1 sd, N; of predicted recordings.
    """

    name: str
    condition: Condition
    time: Array
    slip: Array
    force: Array
    direction: Array
    branch: NDArray[np.int64]
    slip_time: Array
    slip_history: Array
    speed: float | None
    rate: float
    noise: AR1Noise
    common: Array | None = None

    @property
    def label(self) -> str:
        """Condition in words."""
        return condition_label(self.condition)

    @cached_property
    def clock(self) -> Array:
        """Time from -1/2 to 1/2 over the recording."""
        low, high = self.slip_time[0], self.slip_time[-1]
        return np.asarray((self.time - low) / (high - low) - 0.5)

    @cached_property
    def _factor(self) -> Array:
        covariance = self.noise.covariance(self.time)
        if self.common is not None:
            covariance = covariance + self.common @ self.common.T
        return np.asarray(np.linalg.cholesky(covariance), float)

    def whiten(self, rows: Array) -> Array:
        """Innovations in units of their sd, of ``rows`` (n,) or (n, p), N."""
        return np.asarray(solve_triangular(self._factor, rows, lower=True, check_finite=False))

    def computed(self, terms: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Side force (n,), N, for ``terms`` (13,), see ``SWEEP_TERMS``; with ``slopes`` its derivatives (n, 13)."""
        c, peak, shape, curvature, shift, lag, play, offset, drift, delay, warming, asymmetry, by_sign = terms

        def curve(later: float = 0.0) -> tuple[Array, Array]:
            return lagged_magic_formula(
                time=self.time - delay + later, slip_time=self.slip_time, slip=self.slip_history,
                direction=self.direction, cornering_stiffness=c, peak=peak, shape=shape, curvature=curvature,
                horizontal_shift=shift, lag=lag, hysteresis=play,
            )  # fmt: skip

        force, part = curve()
        sign = np.sign(force)
        gain = 1.0 + warming * self.clock + by_sign / 2 * sign
        total = gain * force + offset + drift * self.clock + asymmetry * self.slip**2
        if not slopes:
            return total, np.empty((len(total), 0))
        h = 0.5 * float(np.median(np.diff(self.slip_time)))
        by_delay = -(curve(h)[0] - curve(-h)[0]) / (2 * h)
        one = np.ones_like(force)
        columns = [
            *(gain * part), one, self.clock, gain * by_delay, force * self.clock, self.slip**2,
            sign * force / 2,
        ]  # fmt: skip
        return total, np.stack(columns, 1)


@dataclass(frozen=True, eq=False)
class PullReadings:
    """One static pull.

    Attributes
    ----------
    name : str
    condition : Condition
    displacement, force : ndarray, shape (n,)
        m, N.
    clock : ndarray, shape (n,)
        Time from -1/2 to 1/2 over the recording.
    sd : float
        Of the white noise of the force, N.
    """

    name: str
    condition: Condition
    displacement: Array
    force: Array
    clock: Array
    sd: float

    @property
    def label(self) -> str:
        """Condition in words."""
        return condition_label(self.condition)


def condition_label(condition: Condition) -> str:
    """Load, pressure and surface of a ``condition``, in words."""
    return f"{condition.load:g} N, {condition.pressure / PASCAL_PER_BAR:g} bar, {condition.surface}"


def reduce_sweep(name: str, run: RigRun) -> tuple[SweepBlocks, tuple[str, ...]]:
    """Block means of a sweep with their noise, and what must be said of it.

    Parameters
    ----------
    name : str
        Of the recording.
    run : RigRun

    Raises
    ------
    InputError
        As `fit_slip_sweep`.
    """
    found = fit_slip_sweep(run)
    blocks, used = found.blocks, np.flatnonzero(found.blocks.settled)
    every = -(-len(used) // MOST_BLOCKS)
    kept = used[::every]
    notes: tuple[str, ...] = ()
    if every > 1:
        notes = (f"{name}: one block of {every} is compared ({len(kept)} of {len(used)}); neighbours tell the same",)
    slip = _smooth(blocks)
    return SweepBlocks(
        name, run.condition, blocks.time[kept], slip[kept], blocks.force[kept], np.sign(blocks.rate[kept]),
        blocks.branch[kept], blocks.time, slip, blocks.speed, found.rate, _noise(found, slip, kept),
    ), notes  # fmt: skip


def _smooth(blocks: Blocks) -> Array:
    """Slip with its sensor noise averaged by a moving parabola within each branch.

    Noise of the slip angle would be smoothed by a lag and by nothing else, and so look like one.
    """
    slip = blocks.slip.copy()
    for number in np.unique(blocks.branch):
        here = blocks.branch == number
        window = min(SMOOTHED, int(here.sum()) - 1 + int(here.sum()) % 2)
        if window > 3:
            slip[here] = savgol_filter(slip[here], window, 2)
    return slip


def _noise(found: SlipSweepFit, slip: Array, kept: NDArray[np.intp]) -> AR1Noise:
    """Noise of the compared blocks, from the residual of the fit with everything free."""
    blocks, p = found.blocks, found.parameters
    clock = (blocks.time[kept] - 0.5 * (blocks.time[0] + blocks.time[-1])) / (blocks.time[-1] - blocks.time[0])
    direction = np.sign(blocks.rate[kept])
    force, part = lagged_magic_formula(
        time=blocks.time[kept], slip_time=blocks.time, slip=slip, direction=direction,
        cornering_stiffness=found.cornering_stiffness.value,
        **{key: p[key] for key in ("peak", "shape", "curvature", "horizontal_shift", "lag", "hysteresis")},
    )  # fmt: skip
    both = len(np.unique(direction)) > 1
    columns = [*(part if both else part[:5]), np.ones_like(clock), clock]
    left, size, _ = np.linalg.svd(np.stack([c / max(float(np.abs(c).max()), 1e-300) for c in columns], 1), False)
    left = left[:, size > 1e-6 * size[0]]
    residual = blocks.force[kept] - force - p["vertical_shift"] - p["drift"] * clock
    residual -= left @ (left.T @ residual)
    floor = (1e-4 * float(np.abs(blocks.force).max())) ** 2  # rounding of a file without noise
    return estimate_noise(blocks.time[kept], residual, left, floor)


def reduce_pull(name: str, test: PullTest, *, plate: bool) -> PullReadings:
    """Readings of a pull over the tyre's own displacement, or over that of the plate.

    Parameters
    ----------
    name : str
        Of the recording.
    test : PullTest
    plate : bool
        Take the displacement of the plate.

    Raises
    ------
    InputError
        As `fit_pull_test`.
    """
    found = fit_pull_test(test)
    good = np.isfinite(test.side_force) & np.isfinite(test.tyre_deflection)
    displacement = (test.plate_displacement if plate else test.tyre_deflection)[good]
    rounding = found.lateral_stiffness.value * found.resolution / np.sqrt(6.0)
    count = len(displacement)
    clock = np.linspace(-0.5, 0.5, count) if test.time is None else test.time[good]
    clock = (clock - clock[0]) / (clock[-1] - clock[0]) - 0.5
    return PullReadings(
        name, test.condition, displacement, test.side_force[good], clock,
        max(found.residual_sd, rounding, 1e-4 * float(np.abs(test.side_force[good]).max())),
    )  # fmt: skip
