"""Recordings of a rig reduced to the numbers of a fit, with their noise, nuisances and candidates.

The noise of a sweep is white plus AR(1), whose constants come (by restricted maximum likelihood) from the residual of a
Magic Formula with everything free that a single recording can show; so they do not depend on the missing effect.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from studies.diagnosis.rig_reference import Curve
from studies.inference.kind import Candidates
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.fits.lateral_stiffness import fit_lateral_stiffness
from tyre.fits.slip_sweep import SlipSweepFit, fit_slip_sweep
from tyre.fits.sweep_curve import Blocks, interpolate_slip, lagged_magic_formula
from tyre.ground.arrays import Array
from tyre.ground.units import PASCAL_PER_BAR
from tyre.measured.properties import Calibration
from tyre.recordings.noise import AR1Noise, estimate_noise
from tyre.recordings.recording import Condition, LateralStiffnessTest, RigRun
from tyre.rig.effect import Recorded, RigParameter, Term, needs_pull, needs_sweep

SWEEP_TERMS = (
    "cornering_stiffness", "peak", "shape", "curvature", "shift", "lag", "play", "offset", "drift", "delay", "warming",
    "asymmetry", "gain_by_sign",
)  # fmt: skip
"""Terms of the force of a sweep, in the units of the recording (its own scales included)."""


@dataclass(frozen=True, eq=False)
class Reduced:
    """Recording reduced to the numbers of a fit."""

    name: str  # of the recording, as its file is called
    condition: Condition  # tyre, load, pressure and track

    @property
    def label(self) -> str:
        """Condition in words."""
        return condition_label(self.condition)


@dataclass(frozen=True, eq=False)
class SweepBlocks(Reduced):
    """Block means of one slip sweep."""

    time: Array  # (n,), s
    slip: Array  # (n,), rad
    force: Array  # (n,), N
    direction: Array  # (n,), sign of d(slip)/dt
    branch: NDArray[np.int64]  # (n,), number of the up or down branch, from 0
    slip_time: Array  # (m,), s, also where the blocks are not compared
    slip_history: Array  # (m,), rad
    speed: float | None  # rolling speed, m/s
    rate: float  # mean size of d(slip)/dt, rad/s
    noise: AR1Noise  # N^2 and s
    common: Array | None = None  # errors common to all blocks (n, k), 1 sd, N, of predicted recordings

    @cached_property
    def clock(self) -> Array:
        """Time from -1/2 to 1/2 over the recording."""
        low, high = self.slip_time[0], self.slip_time[-1]
        return np.asarray((self.time - low) / (high - low) - 0.5)

    @cached_property
    def _history(self) -> Any:
        return interpolate_slip(self.slip_time, self.slip_history)

    @cached_property
    def _factor(self) -> Array:
        """Cholesky factor (n, n), N, of the covariance of the blocks, with what they have in common."""
        covariance = self.noise.covariance(self.time)
        if self.common is not None:
            covariance = covariance + self.common @ self.common.T
        return np.asarray(np.linalg.cholesky(covariance), float)

    def whiten(self, rows: Array) -> Array:
        """Innovations in units of their sd, of ``rows`` (n,) or (n, p), N."""
        return np.asarray(solve_triangular(self._factor, rows, lower=True, check_finite=False))

    def lateral_force(self, terms: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Lateral force (n,), N, for ``terms`` (13,), see ``SWEEP_TERMS``; with ``slopes`` its derivatives (n, 13)."""
        c, peak, shape, curvature, shift, lag, play, offset, drift, delay, warming, asymmetry, by_sign = terms

        def curve(later: float = 0.0) -> tuple[Array, Array]:
            return lagged_magic_formula(
                time=self.time - delay + later,
                history=self._history,
                direction=self.direction,
                cornering_stiffness=c,
                peak=peak,
                shape=shape,
                curvature=curvature,
                horizontal_shift=shift,
                lag=lag,
                hysteresis=play,
            )

        force, part = curve()
        sign = np.sign(force)
        gain = 1.0 + warming * self.clock + by_sign / 2 * sign
        total = gain * force + offset + drift * self.clock + asymmetry * self.slip**2
        if not slopes:
            return total, np.empty((len(total), 0))
        h = 0.5 * float(np.median(np.diff(self.slip_time)))
        by_delay = -(curve(h)[0] - curve(-h)[0]) / (2 * h)
        other_slopes = (
            np.ones_like(force),
            self.clock,
            gain * by_delay,
            force * self.clock,
            self.slip**2,
            sign * force / 2,
        )
        return total, np.stack([*(gain * part), *other_slopes], 1)


@dataclass(frozen=True, eq=False)
class PullReadings(Reduced):
    """One lateral stiffness test."""

    displacement: Array  # (n,), m
    force: Array  # N
    clock: Array  # time from -1/2 to 1/2 over the recording
    sd: float  # of the white noise of the force, N


def condition_label(condition: Condition) -> str:
    """Load, pressure and surface of a ``condition``, in words."""
    return f"{condition.load:g} N, {condition.pressure / PASCAL_PER_BAR:g} bar, {condition.surface}"


def reduce_sweep(name: str, run: RigRun) -> tuple[SweepBlocks, tuple[str, ...]]:
    """Block means of a sweep with their noise, and notes on it."""
    fitted = fit_slip_sweep(run)
    blocks, used = fitted.blocks, np.flatnonzero(fitted.blocks.settled)
    stride = -(-len(used) // 240)  # of longer sweeps every second, third ... block is compared
    compared = used[::stride]
    notes = [f"{name}: {fault}" for fault in fitted.sensor_faults]
    if stride > 1:
        notes.append(
            f"{name}: one block of {stride} is compared ({len(compared)} of {len(used)}); neighbours are redundant"
        )
    slip = _smooth(blocks)
    return SweepBlocks(
        name,
        run.condition,
        blocks.time[compared],
        slip[compared],
        blocks.force[compared],
        np.sign(blocks.rate[compared]),
        blocks.branch[compared],
        blocks.time,
        slip,
        blocks.speed,
        fitted.rate,
        _noise(fitted, slip, compared),
    ), tuple(notes)


def _smooth(blocks: Blocks) -> Array:
    """Slip with its sensor noise averaged by a moving parabola within each branch."""
    slip = blocks.slip.copy()
    for number in np.unique(blocks.branch):
        in_branch = blocks.branch == number
        window = min(15, int(in_branch.sum()) - 1 + int(in_branch.sum()) % 2)
        if window > 3:
            slip[in_branch] = scipy.signal.savgol_filter(slip[in_branch], window, 2)
    return slip


def _noise(fitted: SlipSweepFit, slip: Array, compared: NDArray[np.intp]) -> AR1Noise:
    """Noise of the compared blocks, from the residual of the fit with everything free."""
    blocks, p = fitted.blocks, fitted.parameters
    clock = (blocks.time[compared] - 0.5 * (blocks.time[0] + blocks.time[-1])) / (blocks.time[-1] - blocks.time[0])
    direction = np.sign(blocks.rate[compared])
    force, part = lagged_magic_formula(
        time=blocks.time[compared],
        history=interpolate_slip(blocks.time, slip),
        direction=direction,
        cornering_stiffness=fitted.curve_slope,
        **{key: p[key] for key in ("peak", "shape", "curvature", "horizontal_shift", "lag", "hysteresis")},
    )
    both_ways = len(np.unique(direction)) > 1
    columns = [*(part if both_ways else part[:5]), np.ones_like(clock), clock]
    basis, size, _ = np.linalg.svd(np.stack([c / max(float(np.abs(c).max()), 1e-300) for c in columns], 1), False)
    basis = basis[:, size > 1e-6 * size[0]]
    residual = blocks.force[compared] - force - p["vertical_shift"] - p["drift"] * clock
    residual -= basis @ (basis.T @ residual)
    floor = (1e-4 * float(np.abs(blocks.force).max())) ** 2  # rounding of a file without noise
    return estimate_noise(blocks.time[compared], residual, basis, floor)


def reduce_pull(name: str, test: LateralStiffnessTest, *, plate: bool) -> PullReadings:
    """Readings of a lateral stiffness test over the tyre's own displacement, or over that of the plate."""
    fitted = fit_lateral_stiffness(test)
    good = np.isfinite(test.lateral_force) & np.isfinite(test.tyre_deflection)
    displacement = (test.plate_displacement if plate else test.tyre_deflection)[good]
    rounding = fitted.lateral_stiffness.value * fitted.resolution / np.sqrt(6.0)
    clock = np.linspace(-0.5, 0.5, len(displacement)) if test.time is None else test.time[good]
    clock = (clock - clock[0]) / (clock[-1] - clock[0]) - 0.5
    return PullReadings(
        name,
        test.condition,
        displacement,
        test.lateral_force[good],
        clock,
        max(fitted.residual_sd, rounding, 1e-4 * float(np.abs(test.lateral_force[good]).max())),
    )


# ---- terms, nuisances and candidates ----

DRIFT, ZERO = 3.0, 1.0  # N over a recording, N of the force cell


def _asymmetry(terms: Any, *, gain: Any) -> None:  # functions of a module, not lambdas: workers get them by name
    terms.add(asymmetry=gain)


def _bend(terms: Any, **share: Any) -> None:
    terms.add(bend=next(iter(share.values())))


PHENOMENOLOGICAL = (
    Term(
        "lateral force from slip squared",
        "lateral force that grows with slip squared",
        (RigParameter("gain", "N/rad^2", (-4000.0, 4000.0)),),
        sweep=_asymmetry,
        needs=needs_sweep,
    ),
    Term(
        "lateral stiffness not constant",
        "lateral stiffness that changes with displacement",
        (RigParameter("share at the end", "1", (-0.2, 0.2)),),
        pull=_bend,
        needs=needs_pull,
    ),
)
"""Empirical terms."""


def rig_nuisances(
    sweeps: Sequence[SweepBlocks], pulls: Sequence[PullReadings], curves: Mapping[str, Curve], c: Calibration
) -> tuple[UncertainParameter, ...]:
    """Tyre parameters with the reference's uncertainty, scatter of one recording, drifts, certified calibration."""
    sd: dict[str, tuple[float, str]] = {}
    for label in dict.fromkeys(s.label for s in sweeps):
        value, value_sd = curves[label].cornering_stiffness or (1.0, 0.0)
        sd[f"cornering stiffness, {label}"] = value_sd / value, "1"
        sd[f"peak, {label}"] = 0.1, "1"  # of the curve: 4 deg of slip do not tell peak, shape, curvature one by one
    for label in dict.fromkeys(p.label for p in pulls):
        value, value_sd = curves[label].lateral_stiffness or (1.0, 0.0)
        sd[f"lateral stiffness, {label}"] = value_sd / value, "1"
    if sweeps:
        sd |= {"shape": (0.15, "1"), "curvature": (0.5, "1"), "load gain": (0.005, "1")}
        sd |= {"slip gain": (c.slip, "1"), "slip zero": (1e-4, "rad")}
    sd["force gain"] = c.force, "1"
    for name in (*(s.name for s in sweeps), *(p.name for p in pulls)):
        sd[f"repeatability, {name}"] = c.repeatability, "1"
        sd[f"drift, {name}"], sd[f"zero, {name}"] = (DRIFT, "N"), (ZERO, "N")
        if any(p.name == name for p in pulls):
            sd[f"bend, {name}"] = 0.02, "1"  # departure from a straight line at the largest displacement
    if pulls:
        sd["displacement gain"] = c.displacement, "1"
    return tuple(
        UncertainParameter(key, unit, {key: 1.0}, 0.0, scale) for key, (scale, unit) in sd.items() if scale > 0
    )


def rig_candidates(terms: Sequence[Term], recorded: Recorded) -> tuple[Candidates, dict[str, str]]:
    """Rig effects among ``terms`` that may be missing, and why others cannot be tried."""
    reasons = {term.identifier: why for term in terms if (why := term.needs(recorded))}
    candidates = tuple(
        Candidate(
            term.identifier, tuple(_unknown_of(term, p, recorded) for p in term.parameters), signature=term.signature
        )
        for term in terms
        if term.identifier not in reasons
    )
    return candidates, reasons


def _unknown_of(term: Term, p: RigParameter, recorded: Recorded) -> UncertainParameter:
    """The unknown of a parameter with the prior of its declaration."""
    sets, (low, high) = {term.key(p): 1.0}, p.typical
    if p.name in recorded.known:
        value, sd = recorded.known[p.name]
        return UncertainParameter(p.name, p.unit, sets, value, sd, p.bounds[0])
    if p.size:
        scale = 0.5 * max(abs(low), abs(high))
        return UncertainParameter(p.name, p.unit, sets, 0.0, scale, *p.bounds, size=True, least=p.least)
    return UncertainParameter(p.name, p.unit, sets, 0.5 * math.log(low * high), math.log(high / low) / 4, power=0)
