"""The curve of a slip sweep: its model, its coefficients and their covariance."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from tyre.ground.errors import InputError
from tyre.laws import magic_formula as lateral_force
from tyre.recordings.noise import correlated_covariance
from tyre.recordings.recording import Channel, RigRun
from tyre.recordings.signal_quality import noise_level

# two-point Gauss-Laguerre rule: the mean over an exponentially fading past, exact for a cubic history
LAG_NODES = np.array([2.0 - np.sqrt(2.0), 2.0 + np.sqrt(2.0)])
LAG_WEIGHTS = np.array([2.0 + np.sqrt(2.0), 2.0 - np.sqrt(2.0)]) / 4.0

# parameters of a fitted sweep that `lagged_magic_formula` takes beside the cornering stiffness
CURVE = ("peak", "shape", "curvature", "horizontal_shift", "lag", "hysteresis")


def magic_formula(
    *, slip: Channel, cornering_stiffness: float, peak: float, shape: float, curvature: float
) -> tuple[Channel, NDArray[np.float64]]:
    """Magic Formula in terms of its slope at zero, with derivatives.

    That of :mod:`tyre.laws.magic_formula` with B = cornering_stiffness / (C D), in newtons (Dell'Orto et al.,
    eqs. 4 and 5).
    """
    u = cornering_stiffness / (shape * peak) * slip
    curve = lateral_force.magic_formula_derivatives(u, shape_factor=shape, curvature_factor=curvature)
    derivatives = [
        curve.by_slip * cornering_stiffness / shape,
        curve.by_slip * slip / shape,
        curve.value - curve.by_slip * u,
        peak * (curve.by_shape - curve.by_slip * u / shape),
        peak * curve.by_curvature,
    ]
    return peak * curve.value, np.stack(derivatives)


def lagged_magic_formula(
    *,
    time: Channel,
    history: Any,
    direction: Channel,
    cornering_stiffness: float,
    peak: float,
    shape: float,
    curvature: float,
    horizontal_shift: float,
    lag: float,
    hysteresis: float,
) -> tuple[Channel, NDArray[np.float64]]:
    """Lateral force on the steady curve at a slip that lags, (lag) dx/dt + x = slip (Pacejka 2012, ch. 7).

    ``history`` is the recorded slip of :func:`interpolate_slip`.
    """
    lagged, by_lag = lagged_slip(time, history, lag=lag)
    x = lagged + horizontal_shift - hysteresis * direction
    force, part = magic_formula(
        slip=x, cornering_stiffness=cornering_stiffness, peak=peak, shape=shape, curvature=curvature
    )
    return force, np.stack([*part[1:], part[0], part[0] * by_lag, -part[0] * direction])


def brush_force(*, slip: Channel, cornering_stiffness: float, peak: float) -> tuple[Channel, NDArray[np.float64]]:
    """Lateral force (n,), N, of a brush, with derivatives (3, n) by slip, cornering stiffness (N/rad) and peak (N).

    F = D (1 - (1 - C |tan x| / (3 D))^3) up to full sliding, then D (Pacejka, *Tire and Vehicle Dynamics*, 3rd ed.,
    section 3.2). Its slope falls in proportion to |x| from zero slip on; no Magic Formula has a slope with such a kink.
    """
    tangent = np.abs(np.tan(slip))
    direction = np.sign(slip)
    sliding = np.minimum(cornering_stiffness * tangent / (3.0 * peak), 1.0)
    adhering = (1.0 - sliding) ** 2
    value = direction * peak * (1.0 - (1.0 - sliding) ** 3)
    derivatives = [
        cornering_stiffness * adhering * (1.0 + tangent**2),
        direction * tangent * adhering,
        value / peak - direction * 3.0 * sliding * adhering,
    ]
    return value, np.stack(derivatives)


def interpolate_slip(time: Channel, slip: Channel) -> Any:
    """A curve through the recorded ``slip`` (n,), rad, over ``time`` (n,), s: cubics that meet in slip and pace.

    Straight pieces have no derivative where they meet, and a search for the lag stops there.
    """
    return scipy.interpolate.CubicHermiteSpline(time, slip, np.gradient(slip, time))


def lagged_slip(time: Channel, history: Any, *, lag: float) -> tuple[Channel, Channel]:
    """Slip (n,), rad, that follows ``history`` with a ``lag``, s, at ``time`` (n,), s, and its slope over the lag."""
    past = time[:, None] - lag * LAG_NODES
    within = np.clip(past, history.x[0], history.x[-1])  # outside the recording the slip is taken as at rest
    pace = np.where(within == past, history(within, 1), 0.0)
    return history(within) @ LAG_WEIGHTS, -pace @ (LAG_WEIGHTS * LAG_NODES)


@dataclass(frozen=True)
class Blocks:
    """Block means along a sweep."""

    time: Channel  # (m,), s; with a recorded speed, travelled distance over mean speed
    slip: Channel  # (m,), rad
    force: Channel  # (m,), N, lateral force
    moment: Channel | None  # (m,), N m, aligning moment; None if not recorded
    heavier: Channel  # load over its mean less one, as far as it stands out of the noise of the load cell
    branch: NDArray[np.int64]  # (m,), number of the stretch between two reversals, from 0
    rate: Channel  # (m,), rad/s, d(slip)/dt of the branch
    settled: NDArray[np.bool_]  # (m,), rolled more than 0.5 m since the reversal: only these are fitted
    speed: float | None  # m/s, mean; None if neither recorded nor stated
    missing: int  # samples without lateral force
    first: NDArray[np.int64]  # (m,), first sample of each block
    size: NDArray[np.int64]  # (m,), samples of each block, those without lateral force included
    points: bool = False  # settled points, few and far apart

    @cached_property
    def history(self) -> Any:
        """Slip over time between the blocks as well."""
        return interpolate_slip(self.time, self.slip)


def slip_reversals(run: RigRun) -> NDArray[np.int64]:
    """Sample numbers where the slip angle turns round, with the first and the last sample."""
    where = str(run.source or run.condition.tyre)
    if run.time.size < 20:
        raise InputError(f"{where}: {run.time.size} samples are too few for a slip sweep; at least 20 are needed")
    if not np.all(np.diff(run.time) > 0.0):
        raise InputError(f"{where}: time does not increase from sample to sample; sort the recording or cut it")
    slip = _fill_gaps(run.slip_angle, run.time, f"{where}: slip_angle")
    span = float(np.ptp(slip))
    if span < np.deg2rad(1.0):
        raise InputError(f"{where}: the slip angle spans {np.rad2deg(span):.2f} deg; a sweep of at least 1 deg is due")
    # light smoothing, so that sensor noise at a turning point does not move it by more than a few samples
    width = max(1, slip.size // 2000) * 2 + 1
    smooth = np.convolve(np.pad(slip, width // 2, mode="edge"), np.full(width, 1.0 / width), mode="valid")
    turns = [scipy.signal.find_peaks(sign * smooth, prominence=0.25 * span)[0] for sign in (1.0, -1.0)]
    return np.unique(np.concatenate([[0], *turns, [slip.size]]))


def block_means(run: RigRun) -> Blocks:
    """Average a sweep over blocks of 0.1 deg of slip, branch by branch; one without half of its force is left out."""
    where = str(run.source or run.condition.tyre)
    edges = slip_reversals(run)
    slip = _fill_gaps(run.slip_angle, run.time, f"{where}: slip_angle")
    valid = np.isfinite(run.lateral_force)
    if valid.mean() < 0.8:
        raise InputError(f"{where}: {100.0 * (1.0 - valid.mean()):.0f} % of the lateral force is missing; 20 % may be")
    clock, speed = _clock(run)
    starts, branch, rate = [], [], []
    for number, (low, high) in enumerate(itertools.pairwise(edges)):
        change = slip[high - 1] - slip[low]
        # the lateral force is straight within 0.1 deg
        count = int(np.clip(round(abs(change) / np.deg2rad(0.1)), 1, high - low))
        starts.append(low + (np.arange(count) * (high - low)) // count)
        branch.append(np.full(count, number))
        rate.append(np.full(count, _slope(run.time[low:high], slip[low:high])))
    first = np.concatenate(starts)
    owner = np.concatenate(branch)
    size = np.diff(np.append(first, slip.size))
    weight = valid.astype(float)
    usable = np.add.reduceat(weight, first) >= 0.5 * size

    def mean(channel: Channel, weight: Channel = weight) -> Channel:
        total = np.add.reduceat(np.where(weight > 0.0, channel, 0.0), first)
        return (total / np.maximum(np.add.reduceat(weight, first), 1.0))[usable]

    moment = None
    if run.aligning_moment is not None and np.isfinite(run.aligning_moment).mean() > 0.8:
        moment = mean(run.aligning_moment, weight * np.isfinite(run.aligning_moment))
    travelled = (clock[first] - clock[edges[:-1]][owner]) * (speed if speed is not None else 1.0)
    return Blocks(
        time=mean(clock),
        slip=mean(slip),
        force=mean(run.lateral_force),
        moment=moment,
        heavier=load_wander(run.vertical_load, mean(run.vertical_load), size[usable]),
        branch=owner[usable],
        rate=np.concatenate(rate)[usable],
        settled=travelled[usable] > 0.5,  # m: the lag of a bicycle tyre is over
        speed=speed,
        missing=int(np.sum(~valid)),
        first=first[usable],
        size=size[usable],
    )


FEWEST_POINTS = 12  # of a steady curve, which has six coefficients


def point_blocks(run: RigRun) -> Blocks:
    """Take each settled point of a steady table, in the order of its slip, as a block without lag."""
    where = str(run.source or run.condition.tyre)
    count = run.slip_angle.size
    if count < FEWEST_POINTS:
        raise InputError(f"{where}: {count} points are too few for a steady curve; at least {FEWEST_POINTS} are needed")
    if not run.slip_angle.min() < 0.0 < run.slip_angle.max():
        raise InputError(f"{where}: the points do not cross zero slip; the slope there cannot be measured")
    moment = run.aligning_moment
    nothing = np.zeros(count)
    return Blocks(
        time=run.time,
        slip=run.slip_angle,
        force=run.lateral_force,
        moment=moment if moment is not None and np.isfinite(moment).mean() > 0.8 else None,
        heavier=run.vertical_load / run.vertical_load.mean() - 1.0,
        branch=np.zeros(count, int),
        rate=nothing,
        settled=np.ones(count, bool),
        speed=None,
        missing=0,
        first=np.arange(count),
        size=np.ones(count, int),
        points=True,
    )


def load_wander(load: Channel, means: Channel, size: NDArray[np.int64]) -> Channel:
    """Wander of the load in block means (relative), shrunk by the share of its variance that is white noise."""
    load = load[np.isfinite(load)]
    if not load.size:
        return np.zeros(means.size)
    off = np.nan_to_num(means / load.mean() - 1.0)
    noise = noise_level(load) / load.mean()
    return off * max(0.0, 1.0 - float(np.mean(noise**2 / size)) / max(float(np.mean(off**2)), 1e-300))


def samples_used(run: RigRun, blocks: Blocks) -> NDArray[np.bool_]:
    """Mark the samples of a sweep that the fitted block means contain: settled ones with a lateral force."""
    used = np.zeros(run.time.size, bool)
    for first, size in zip(blocks.first[blocks.settled], blocks.size[blocks.settled], strict=True):
        used[first : first + size] = True
    return used & np.isfinite(run.lateral_force)


def _clock(run: RigRun) -> tuple[Channel, float | None]:
    """Time, or travelled distance over mean speed where the speed was recorded; and the mean speed, m/s."""
    if run.speed is None or not np.isfinite(run.speed).any():
        return run.time, run.condition.speed
    speed = _fill_gaps(run.speed, run.time, str(run.source or run.condition.tyre))
    mean = float(np.mean(speed))
    if mean <= 0.0:
        where = run.source or run.condition.tyre
        raise InputError(f"{where}: mean speed {mean:.3g} m/s; a rolling tyre needs a speed above 0")
    if np.ptp(speed) < 1e-3 * mean:
        return run.time, mean
    steps = np.diff(run.time) * 0.5 * (speed[1:] + speed[:-1])
    return run.time[0] + np.concatenate([[0.0], np.cumsum(steps)]) / mean, mean


def _fill_gaps(channel: Channel, time: Channel, where: str) -> Channel:
    """Interpolate missing samples of a ``channel`` (n,) over ``time`` (n,); more than a fifth missing is refused."""
    valid = np.isfinite(channel)
    if valid.all():
        return channel
    if valid.mean() < 0.8:
        raise InputError(f"{where}: {100.0 * (1.0 - valid.mean()):.0f} % of the channel is missing; allowed are 20 %")
    return np.interp(time, time[valid], channel[valid])


def _slope(x: Channel, y: Channel) -> float:
    """Slope dy/dx of the straight line through points (n,); 0 if all have one x."""
    x = x - x.mean()
    spread = float(x @ x)
    return float(x @ (y - y.mean())) / spread if spread > 0.0 else 0.0


# fitted numbers and their bounds; forces and the stiffness in units of a first look at the sweep
BOUNDS = {
    "cornering_stiffness": (0.2, 5.0),  # of the slope near zero slip
    "peak": (0.7, 6.0),  # of the largest force
    "shape": (0.5, 2.5),
    "curvature": (-10.0, 1.0),
    "horizontal_shift": (-0.05, 0.05),  # rad
    "lag": (-0.3, 1.5),  # s
    "hysteresis": (-0.02, 0.02),  # rad
    "vertical_shift": (-5.0, 5.0),  # of the largest force
    "drift": (-5.0, 5.0),  # likewise, over the recording
    "brush_share": (-1.0, 2.0),  # of a brush with the same slope and peak; the rest is the Magic Formula
}
NAMES = tuple(BOUNDS)
LOW, HIGH = (np.array([limits[end] for limits in BOUNDS.values()]) for end in (0, 1))


@dataclass(frozen=True)
class SweepModel:
    """Lateral force of the settled blocks of a sweep as a function of the scaled parameters ``NAMES``."""

    blocks: Blocks  # all of the sweep; the settled ones are fitted
    free: NDArray[np.bool_]  # (10,), True for a fitted parameter; the others stay at ``start``
    start: Channel  # (10,), scaled parameters
    stiffness: float  # unit of the cornering stiffness, N/rad
    force_scale: float  # unit of the forces, N

    @property
    def units(self) -> Channel:
        """Physical over scaled parameters, shape (10,)."""
        units = dict.fromkeys(NAMES, 1.0) | {"cornering_stiffness": self.stiffness}
        units |= dict.fromkeys(("peak", "vertical_shift", "drift"), self.force_scale)
        return np.array(list(units.values()))

    def expand(self, values: Channel) -> Channel:
        """All ten scaled parameters."""
        full = self.start.copy()
        full[self.free] = values
        return full

    def residuals(self, scaled: Channel) -> tuple[Channel, NDArray[np.float64]]:
        """Computed minus measured lateral force (m,), N, of settled blocks; derivatives (m, 10) by ``scaled``."""
        blocks, used = self.blocks, self.blocks.settled
        named = dict(zip(NAMES, scaled, strict=True))
        middle = 0.5 * (blocks.time[0] + blocks.time[-1])
        clock = (blocks.time[used] - middle) / (blocks.time[-1] - blocks.time[0])
        force, part = lagged_magic_formula(
            time=blocks.time[used],
            history=blocks.history,
            direction=np.sign(blocks.rate[used]),
            cornering_stiffness=named["cornering_stiffness"] * self.stiffness,
            peak=named["peak"] * self.force_scale,
            **{name: named[name] for name in ("shape", "curvature", "horizontal_shift", "lag", "hysteresis")},
        )
        by_share = np.zeros_like(clock)
        if named["brush_share"] or self.free[NAMES.index("brush_share")]:
            force, part, by_share = self._with_brush(force, part, named)
        part[0] *= self.stiffness
        part[1] *= self.force_scale
        # a wandering load would bend the curve by chance, which lowers its slope in the mean of many sweeps
        force, part = force * (1.0 + blocks.heavier[used]), part * (1.0 + blocks.heavier[used])
        by_offset, by_drift = np.full_like(clock, self.force_scale), self.force_scale * clock
        by_share = by_share * (1.0 + blocks.heavier[used])
        jacobian = np.column_stack([*part, by_offset, by_drift, by_share])
        zero = self.force_scale * (named["vertical_shift"] + named["drift"] * clock)
        return force + zero - blocks.force[used], jacobian

    def _with_brush(
        self, force: Channel, part: NDArray[np.float64], named: dict[str, float]
    ) -> tuple[Channel, NDArray[np.float64], Channel]:
        """Mix a force (m,), N, of the Magic Formula and its derivatives (7, m) with a brush; and that by the share."""
        blocks, used, share = self.blocks, self.blocks.settled, named["brush_share"]
        direction = np.sign(blocks.rate[used])
        lagged, by_lag = lagged_slip(blocks.time[used], blocks.history, lag=named["lag"])
        brush, by = brush_force(
            slip=lagged + named["horizontal_shift"] - named["hysteresis"] * direction,
            cornering_stiffness=named["cornering_stiffness"] * self.stiffness,
            peak=named["peak"] * self.force_scale,
        )
        by_slip, by_stiffness, by_peak = by
        nothing = np.zeros_like(by_slip)  # a brush has neither shape nor curvature
        by_brush = [by_stiffness, by_peak, nothing, nothing, by_slip, by_slip * by_lag, -by_slip * direction]
        return force + share * (brush - force), part + share * (np.stack(by_brush) - part), brush - force


def sweep_model(
    blocks: Blocks, *, lag_correction: bool, relaxation_length: float | None, notes: list[str], where: str
) -> SweepModel:
    """Return the model of a sweep; parameters that its blocks can determine are free."""
    free = _free_parameters(blocks, relaxation_length, notes, where, lag_correction=lag_correction)
    if blocks.settled.sum() < 2 * free.sum():
        raise InputError(
            f"{where}: only {blocks.settled.sum()} tenths of a degree of slip are left after the lag has settled; "
            "sweep more slowly, further or more often"
        )
    slope, level = _line_near_zero(blocks, where)
    force_scale = float(np.max(np.abs(blocks.force - level)))
    start = dict.fromkeys(NAMES, 0.0) | {"cornering_stiffness": 1.05, "peak": 1.2, "shape": 1.3}
    start["vertical_shift"] = level / force_scale
    if relaxation_length is not None and blocks.speed is not None:
        start["lag"] = relaxation_length / blocks.speed
    elif free[NAMES.index("lag")]:
        start["lag"] = 0.1 / (blocks.speed or 2.5)  # a usual length and speed
    within = np.clip(np.array(list(start.values())), LOW + 1e-6, HIGH - 1e-6)
    return SweepModel(blocks, free, within, slope, force_scale)


def _free_parameters(
    blocks: Blocks, relaxation_length: float | None, notes: list[str], where: str, *, lag_correction: bool
) -> NDArray[np.bool_]:
    first = np.unique(blocks.branch, return_index=True)[1]
    rates = blocks.rate[first][np.unique(blocks.branch[blocks.settled])]
    both_ways = bool((rates > 0.0).any() and (rates < 0.0).any())
    pace = np.abs(rates)
    if relaxation_length is not None and blocks.speed is None:
        raise InputError(f"{where}: a known relaxation length needs the speed; give speed_km_h in the sidecar")
    if not both_ways and relaxation_length is None and lag_correction:
        notes.append("only one direction of sweep: lag and offset Sh are not separable; the lag is not removed")
    free = dict.fromkeys(NAMES, True)
    free["lag"] = lag_correction and both_ways and relaxation_length is None
    # rates in one recording that differ by half tell lag from hysteresis, which does not depend on the rate
    free["hysteresis"] = bool(lag_correction and both_ways and pace.max() > 1.5 * pace.min())
    free["drift"] = both_ways and rates.size >= 3
    free["brush_share"] = False
    return np.array(list(free.values()))


def _line_near_zero(blocks: Blocks, where: str) -> tuple[float, float]:
    """Slope (N/rad) and force (N) of a straight line through the blocks near zero slip."""
    near_zero = np.abs(blocks.slip) < max(np.deg2rad(1.5), 0.25 * float(np.abs(blocks.slip).max()))
    if blocks.points and near_zero.sum() < 5:
        near_zero = np.argsort(np.abs(blocks.slip), kind="stable")[:5]
    elif near_zero.sum() < 5:
        raise InputError(f"{where}: the sweep does not cross zero slip; its slope there cannot be measured")
    slope, level = np.polyfit(blocks.slip[near_zero], blocks.force[near_zero], 1)
    if slope <= 0.0:
        raise InputError(
            f"{where}: the lateral force falls with slip ({np.deg2rad(slope):.3g} N/deg after conversion from "
            "the declared axes); check axes = ISO / SAE / adapted SAE"
        )
    return float(slope), level


_MARGIN = 3.0  # standard deviations, beyond which the robust loss grows linearly


@dataclass(frozen=True)
class SweepSolution:
    """Fitted parameters of a slip sweep."""

    values: dict[str, float]  # SI units, by ``NAMES``
    sd: dict[str, float]  # nan if a value rests on a bound, 0 if it is not fitted
    covariance: NDArray[np.float64]  # (10, 10), SI units; zero for a parameter that is not fitted or rests on a bound
    dof: float  # degrees of freedom behind the covariance
    residuals: Channel  # (m,), computed minus measured lateral force of the settled blocks, N
    settled: bool  # false where the search stopped before it converged
    numbers: int  # fitted parameters

    def sd_of_sum(self, **weights: float) -> float:
        """Standard deviation of a weighted sum of parameters (SI)."""
        row = np.array([weights.get(name, 0.0) for name in NAMES])
        return float(np.sqrt(row @ self.covariance @ row))


def solve_sweep(model: SweepModel) -> SweepSolution:
    """Fit a sweep: first by plain least squares, then with a soft L1 loss at three standard deviations of that."""
    sigma = 1.0

    def parts(values: Channel) -> tuple[Channel, NDArray[np.float64]]:
        residual, jacobian = model.residuals(model.expand(values))
        return residual / sigma, jacobian[:, model.free] / sigma

    limits = (LOW[model.free], HIGH[model.free])
    first = solve_least_squares(parts, model.start[model.free], bounds=limits, tolerance=1e-7)
    sigma = max(1.4826 * float(np.median(np.abs(first.fun))), 1e-9 * model.force_scale)
    solution = solve_least_squares(parts, first.x, bounds=limits, loss="soft_l1", margin=_MARGIN)
    best = settle_least_squares(parts, solution.x, limits=limits, margin=_MARGIN)
    scaled = model.expand(best)
    covariance, resting, dof = _covariance(best, parts(best), model.free, limits)
    covariance *= np.outer(model.units, model.units)
    sd = np.sqrt(np.diag(covariance))
    sd[resting] = np.nan
    return SweepSolution(
        values=dict(zip(NAMES, (scaled * model.units).tolist(), strict=True)),
        sd=dict(zip(NAMES, sd.tolist(), strict=True)),
        covariance=covariance,
        dof=dof,
        residuals=model.residuals(scaled)[0],
        settled=solution.status != 0,
        numbers=int(model.free.sum()),
    )


def with_brush(model: SweepModel, *, pure: bool) -> SweepModel:
    """Give the model of a sweep a brush with a fitted share, or make it a brush alone (``pure``)."""
    free = dict(zip(NAMES, model.free.tolist(), strict=True)) | {"brush_share": not pure}
    if pure:
        free |= {"shape": False, "curvature": False}
    start = model.start.copy()
    start[NAMES.index("brush_share")] = 1.0 if pure else 0.5
    return replace(model, free=np.array(list(free.values())), start=start)


def law_weights(residuals: Sequence[Channel], numbers: Sequence[int]) -> Channel:
    """Probabilities of several laws by their likelihood, from their residuals (m,) and counts of fitted numbers.

    Schwarz, *Ann. Stat.* 6 (1978) 461. Neighbouring blocks share slow errors: the lag-one correlation of the
    residuals of the best law reduces the number of independent blocks. Spikes are residuals beyond three standard
    deviations.
    """
    spread = min(1.4826 * float(np.median(np.abs(residual))) for residual in residuals)
    margin = _MARGIN * max(spread, 1e-150)
    robust = [residual * np.sqrt(_soft_l1_weight(residual, margin)) for residual in residuals]
    powers = np.array([max(float(residual @ residual), 1e-300) for residual in robust])
    best = robust[int(np.argmin(powers))]
    rho = float(np.clip(best[1:] @ best[:-1] / powers.min(), 0.0, 0.95))
    independent = best.size * (1.0 - rho) / (1.0 + rho)
    evidence = -independent * np.log(powers / powers.min()) - np.array(numbers) * np.log(best.size)
    weights = np.exp(0.5 * (evidence - evidence.max()))
    return np.asarray(weights / weights.sum())


def solve_least_squares(
    parts: Callable[[Channel], tuple[Channel, NDArray[np.float64]]],
    start: Channel,
    *,
    bounds: tuple[Any, Any] = (-np.inf, np.inf),
    loss: Any = "linear",
    margin: float = 1.0,
    tolerance: float = 1e-14,
) -> Any:
    """Minimise a sum of squares, or of a robust ``loss``; ``parts`` gives residuals (m,) and derivatives (m, p)."""
    evaluations: dict[bytes, Any] = {}  # scipy asks for both at one point

    def at(values: Channel) -> Any:
        if (key := values.tobytes()) not in evaluations:
            evaluations.clear()
            evaluations[key] = parts(values)
        return evaluations[key]

    return scipy.optimize.least_squares(
        lambda z: at(z)[0],
        start,
        jac=lambda z: at(z)[1],
        bounds=bounds,
        loss=loss,
        f_scale=margin,
        x_scale="jac",
        max_nfev=400,
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance,
    )


def settle_least_squares(
    parts: Callable[[Channel], tuple[Channel, NDArray[np.float64]]],
    start: Channel,
    *,
    limits: tuple[Channel, Channel],
    margin: float,
) -> Channel:
    """Go from ``start``, near a minimum, to where the derivatives of the soft L1 loss beyond a ``margin`` vanish.

    A search that compares costs stops where their rounding hides the rest of the way: along a narrow valley up to 1e-6
    of a parameter, which the degrees of freedom feel. A parameter on a bound stays there.
    """
    low, high = limits
    inner = ~_on_bound(start, limits)
    lengths = np.linalg.norm(parts(start)[1][:, inner], axis=0)  # of the columns: the parameters become alike
    settled = start.copy()

    def derivatives(scaled: Channel) -> Channel:
        settled[inner] = scaled / lengths
        residual, jacobian = parts(settled)
        return np.asarray(jacobian[:, inner].T @ (_soft_l1_weight(residual, margin) * residual) / lengths)

    search: Any = scipy.optimize.root
    settled[inner] = search(derivatives, start[inner] * lengths, options={"xtol": 1e-13}).x / lengths
    stayed = np.abs(settled - start) < 1e-4 * (high - low)
    return settled if np.all(stayed & (low <= settled) & (settled <= high)) else start


def _on_bound(values: Channel, limits: tuple[Channel, Channel]) -> NDArray[np.bool_]:
    low, high = limits
    return np.asarray(np.minimum(values - low, high - values) < 1e-6 * (high - low))


def _soft_l1_weight(residual: Channel, margin: float) -> Channel:
    """Derivative of the soft L1 loss by half the square of a residual: 1 well below the margin."""
    return np.asarray(1.0 / np.sqrt(1.0 + (residual / margin) ** 2))


def _covariance(
    values: Channel,
    parts: tuple[Channel, NDArray[np.float64]],
    free: NDArray[np.bool_],
    limits: tuple[Channel, Channel],
) -> tuple[NDArray[np.float64], NDArray[np.intp], float]:
    """Covariance (10, 10) of the scaled parameters, the numbers of those at a bound, and the degrees of freedom."""
    residual, jacobian = parts
    at_bound = _on_bound(values, limits)
    inner = np.flatnonzero(~at_bound)
    weight = _soft_l1_weight(residual, _MARGIN)
    curved = weight[:, None] ** 1.5 * jacobian[:, inner]  # its square is the curvature of the loss
    small, dof = correlated_covariance(curved, weight * residual)
    full = np.zeros((len(NAMES), len(NAMES)))
    fitted = np.flatnonzero(free)
    full[np.ix_(fitted[inner], fitted[inner])] = small
    return full, fitted[at_bound], dof
