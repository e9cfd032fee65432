"""Sensors that flatten towards the end of their range, or have two gains."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import least_squares

from tyre.arrays import Array
from tyre.noise import correlated_covariance
from tyre.sweep_curve import (
    HIGH,
    LAG_NODES,
    LAG_WEIGHTS,
    LOW,
    NAMES,
    SweepModel,
    SweepSolution,
    solve_least_squares,
    solve_sweep,
)

_READING = {"side_force": "force", "slip_angle": "slip", "gain": "force"}  # of the blocks


@dataclass(frozen=True)
class Limits:
    """Limits of the verdict; measured rates of false alarms stand in data/validation/sensor_faults.json."""

    onsets: tuple[float, ...] = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)  # tried, of the largest reading
    gained: float = 6.0  # least fall of the sum of squares, in units of its mean, that is worth a closer look
    fewest: int = 8  # blocks beyond an onset
    p_flat: float = 5e-4  # significance of a flattening
    p_sign: float = 1e-3  # significance of two gains
    least_flat: float = 0.03  # least flattening that is told, of the largest reading
    least_sign: float = 0.005  # least difference of gains that is told


LIMITS = Limits()


@dataclass(frozen=True)
class Flattening:
    """A channel that reads too little beyond an onset."""

    channel: str  # ``side_force`` or ``slip_angle``
    onset: float  # size of the reading at which it begins, N or rad
    largest: float  # largest reading, N or rad
    share: float  # by how much the largest reading is low, relative


@dataclass(frozen=True)
class GainBySign:
    """Gain of the force cell to the right less that to the left, relative, and its standard deviation."""

    difference: float
    sd: float


def find_fault(model: SweepModel, solution: SweepSolution) -> "Flattening | GainBySign | None":
    """Return the fault of a sensor in a fitted sweep, if any is significant: the one that fits best."""
    # directions in which the fitted force can change, the last towards a brush, and the part of the force left over
    scaled = np.array([solution.values[name] for name in NAMES]) / model.units
    residual, jacobian = model.residuals(scaled)
    brush = _brush_fit(model, solution) - (residual + model.blocks.force[model.blocks.settled])
    columns, left = np.column_stack([jacobian[:, model.free], brush]), -residual
    steepness = jacobian[:, NAMES.index("horizontal_shift")]
    before = _added(columns, brush, left)[1]
    found: list[tuple[float, Flattening | GainBySign]] = []
    for channel, effect in (("side_force", -1.0), ("slip_angle", steepness)):
        reading = getattr(model.blocks, _READING[channel])[model.blocks.settled]
        largest = float(np.max(np.abs(reading)))
        onsets = [q for q in LIMITS.onsets if np.count_nonzero(np.abs(reading) > q * largest) >= LIMITS.fewest]
        tried = [(_added(columns, effect * largest * _bend(reading / largest, q), left), q) for q in onsets]
        rising = [(float(rest @ rest), q) for (size, rest), q in tried if size > 0.0]
        if not rising or before @ before - min(rising)[0] < LIMITS.gained * min(rising)[0] / len(reading):
            continue  # nothing to be gained, even if the noise were white
        best = min(rising)[1]
        fits = [_bent_fit(model, solution, brush, channel, q) for q in onsets if abs(q - best) < 0.11]
        cost, deviations, dof, share, onset = min(fits)
        if channel == "slip_angle" and not _slows(model, onset * largest, share):
            continue
        if share > LIMITS.least_flat and stats.t.sf(deviations, dof) < LIMITS.p_flat:
            found.append((cost, Flattening(channel, onset * largest, largest, share)))
    force = model.blocks.force[model.blocks.settled]
    if min(np.count_nonzero(force > 0), np.count_nonzero(force < 0)) >= LIMITS.fewest:
        cost, deviations, dof, size, _ = _bent_fit(model, solution, brush, "gain", 0.0)
        if abs(size) > LIMITS.least_sign and 2.0 * stats.t.sf(abs(deviations), dof) < LIMITS.p_sign:
            found.append((cost, GainBySign(size, size / deviations)))
    return min(found, key=lambda one: one[0])[1] if found else None


def _bent_fit(
    model: SweepModel, solution: SweepSolution, brush: Array, channel: str, onset: float
) -> tuple[float, float, float, float, float]:
    """Fit a sweep whose channel flattens beyond an onset, or whose force cell has two gains (``gain``)."""
    blocks, used = model.blocks, model.blocks.settled
    start = np.array([solution.values[name] for name in NAMES]) / model.units
    largest = float(np.max(np.abs(getattr(blocks, _READING[channel])[used])))

    def parts(z: Array) -> tuple[Array, Array]:
        """Residuals (m,) and their derivatives (m, p + 2) by the curve, the way towards a brush and the share."""
        scaled, share, there = model.expanded(z[:-2]), z[-1], model
        if channel == "slip_angle":
            missing = largest * _bend(blocks.slip / largest, onset)
            there = replace(model, blocks=replace(blocks, slip=blocks.slip + share * missing))
        residual, jacobian = there.residuals(scaled)
        columns = np.column_stack([jacobian[:, model.free], brush])
        force = residual + blocks.force[used] + z[-2] * brush
        if channel == "slip_angle":
            by_share = jacobian[:, NAMES.index("horizontal_shift")] * missing[used]
        elif channel == "gain":
            by_share = np.abs(force) / 2.0
            columns *= (1.0 + share * np.sign(force) / 2.0)[:, None]
            force = force + share * by_share
        else:
            by_share = -largest * _bend(force / largest, onset)
            slope = 2.0 * np.clip(np.abs(force / largest) - onset, 0.0, None) / (1.0 - onset) ** 2  # of the bend
            columns *= (1.0 - share * slope)[:, None]
            force = force + share * by_share
        return force - blocks.force[used], np.column_stack([columns, by_share])

    low, high = np.append(LOW[model.free], [-5.0, -1.0]), np.append(HIGH[model.free], [5.0, 1.0])
    begin = np.clip(np.append(start[model.free], [0.0, 0.01]), low + 1e-6, high - 1e-6)
    fitted = solve_least_squares(
        lambda z: parts(z)[0], begin, jacobian=lambda z: parts(z)[1], bounds=(low, high), tolerance=1e-6
    )
    residual, columns = parts(fitted.x)
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    covariance, dof = correlated_covariance(columns / scale, residual)
    sd = float(np.sqrt(covariance[-1, -1])) / float(scale[-1])
    size = float(fitted.x[-1])
    if channel == "side_force":
        true = np.abs((residual + blocks.force[used] - size * columns[:, -1]) / largest)
        missing = size * np.abs(_bend(true, onset))
        share = float(missing[np.argmax(true)] / true.max())
    else:
        share = size / (1.0 + size) if channel == "slip_angle" else size
    return float(residual @ residual), size / sd, dof, share, onset


def without_faults(model: SweepModel, solution: SweepSolution) -> tuple[SweepModel, SweepSolution, list[str]]:
    """Return a fitted sweep without the samples of a faulty sensor, and the notes on it."""
    fault = find_fault(model, solution)
    if fault is None:
        return model, solution, []
    if isinstance(fault, GainBySign):
        more, less = ("right", "left") if fault.difference > 0 else ("left", "right")
        return model, solution, [
            f"the force cell seems to have a larger gain to the {more} than to the {less}, by at least "
            f"about {100 * abs(fault.difference):.1f} %; the cornering stiffness is that of their mean"
        ]  # fmt: skip
    unit, factor = ("N", 1.0) if fault.channel == "side_force" else ("deg", 180.0 / np.pi)
    text = (
        f"a sensor flattens, most likely that of {fault.channel}: beyond +-{factor * fault.onset:.3g} {unit} it reads "
        f"too little, at least {100 * fault.share:.0f} % at its largest, {factor * fault.largest:.3g} {unit}"
    )
    blocks = model.blocks
    reading = blocks.force if fault.channel == "side_force" else blocks.slip
    inner = replace(model, blocks=replace(blocks, settled=blocks.settled & (np.abs(reading) <= fault.onset)))
    if inner.blocks.settled.sum() < 2 * model.free.sum():
        return model, solution, [f"{text}; too little is left without these samples, so they are used: C is in doubt"]
    better = solve_sweep(inner)
    change = solution.values["cornering_stiffness"] / better.values["cornering_stiffness"] - 1.0
    than = f"{100 * abs(change):.1f} % {'higher' if change > 0 else 'lower'}"
    return inner, better, [f"{text}; samples beyond are not used, with them C would be {than}"]


def _slows(model: SweepModel, onset: float, share: float) -> bool:
    """Tell if the recorded slip is slower beyond an ``onset`` (rad), as it must be if a ``share`` is missing."""
    blocks = model.blocks
    same = np.diff(blocks.branch) == 0
    pace = np.abs(np.diff(blocks.slip) / np.diff(blocks.time))[same]
    middle = np.abs(blocks.slip[1:] + blocks.slip[:-1])[same] / 2.0
    if not (middle > onset).any() or not (middle <= onset).any():
        return False
    return bool(np.median(pace[middle > onset]) < (1.0 - share) * np.median(pace[middle <= onset]))


def _bend(reading: Array, onset: float) -> Array:
    """Missing part of a reading from -1 to 1: nothing up to the onset, 1 at the end."""
    return np.asarray(np.sign(reading) * (np.clip(np.abs(reading) - onset, 0.0, None) / (1.0 - onset)) ** 2)


def _brush_fit(model: SweepModel, solution: SweepSolution) -> Array:
    """The force (m,), N, of the brush nearest to the sweep, with the shifts, drift, lag and hysteresis of the fit.

    F = D (1 - (1 - C |tan x| / (3 D))^3) up to full sliding, then D (Pacejka, *Tire and Vehicle Dynamics*, 3rd ed.,
    section 3.2).
    """
    blocks, used, v = model.blocks, model.blocks.settled, solution.values
    past = blocks.time[used][:, None] - v["lag"] * LAG_NODES
    slip = np.interp(past, blocks.time, blocks.slip) @ LAG_WEIGHTS + v["horizontal_shift"]
    slip -= v["hysteresis"] * np.sign(blocks.rate[used])
    measured = blocks.force[used]
    clock = (blocks.time[used] - blocks.time[used].mean()) / np.ptp(blocks.time)
    unit = float(np.max(np.abs(measured)))

    def force(z: Array) -> Array:
        peak = z[1] * unit
        sliding = np.minimum(z[0] * v["cornering_stiffness"] * np.abs(np.tan(slip)) / (3.0 * peak), 1.0)
        brush = np.sign(slip) * peak * (1.0 - (1.0 - sliding) ** 3)
        return np.asarray(brush + v["vertical_shift"] + v["drift"] * clock)

    search: Any = least_squares
    limits = ([0.3, 0.7], [3.0, 6.0])
    found = search(lambda z: force(z) - measured, [1.0, 1.1], bounds=limits, x_scale=[0.1, 0.1], max_nfev=30)
    return force(found.x)


def _added(columns: Array, further: Array, left: Array) -> tuple[float, Array]:
    """Size of a further column in the part left over, and the remainder (m,)."""
    both = np.column_stack([columns, further])
    scale = np.linalg.norm(both, axis=0)
    sizes = np.linalg.lstsq(both / np.maximum(scale, 1e-300), left, rcond=1e-10)[0] / np.maximum(scale, 1e-300)
    return float(sizes[-1]), left - both @ sizes
