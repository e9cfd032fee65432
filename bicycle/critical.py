"""Critical speeds: where a root of the model crosses the imaginary axis, found without a speed grid.

With A(v) = sum v^k A_k, a real root is zero where det A(v) = 0, and a pair is imaginary where the bialternate sum
2 A(v) (.) I, whose eigenvalues are the sums of two eigenvalues of A, is singular (Guckenheimer, Myers & Sturmfels 1997,
SIAM J. Numer. Anal. 34, 1-21). Both are generalised eigenvalue problems of a companion pencil in v. Newton with
d(lambda)/dv sharpens what they give. The roots tracked for the names then prove them complete: unstable roots are
counted between the crossings, and where a root turns back near the axis within a step, it is looked at. Where the count
does not add up (large or singular pencils lose digits), the missing ones are found by bisection. Names come from few
tracked speeds where more would not change them, from all otherwise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bicycle.bialternate import bialternate_sum, singular_speeds
from bicycle.completeness import NOISE, Crossing, dips, unexplained
from bicycle.computable import check_trackable
from bicycle.linear_model import LinearModel
from bicycle.matching import eigen
from bicycle.mode_names import speed_unit
from bicycle.tracker import Tracker
from bicycle.tracking import Array, Complex, Stretch
from tyre.errors import InputError

NEARLY_REAL = 1e-3  # candidates with a relative imaginary part below this are tried: near-double crossings are noisy
MOST_STEPS = 30  # of Newton
LAST_STEP = 1e-9  # of the speed: after a step below this the next would be rounding
ROUNDING = 1e-7  # of the speed: a step below this that does not halve is rounding
REST = 1e-7  # of sqrt(g w): closer to rest is rest, where undamped pairs lie on the axis


@dataclass(frozen=True)
class CriticalSpeed:
    """A speed at which a mode changes its stability.

    Attributes
    ----------
    speed : float
        m/s.
    kind : str
        ``oscillatory`` (a pair crosses the imaginary axis) or ``real`` (a real root crosses zero).
    mode : str
        Name as in :func:`bicycle.modes.modes`.
    frequency : float
        Of the crossing pair, rad/s; 0 for a real root.
    direction : str
        What happens to that root as the speed grows: ``stabilising`` or ``destabilising``.
    """

    speed: float
    kind: str
    mode: str
    frequency: float
    direction: str


def critical_speeds(model: LinearModel, max_speed: float = 60.0) -> tuple[CriticalSpeed, ...]:
    """All speeds 0 < v <= max_speed at which a root crosses the imaginary axis, by speed.

    A root that only touches the axis is not listed. Where the equations switch at a speed, a root that jumps across
    the axis there is listed at that speed, with kind and frequency of the root above it.

    Parameters
    ----------
    model : LinearModel
    max_speed : float
        m/s.

    Raises
    ------
    InputError
        ``max_speed`` is not a positive finite number or too high to be tracked, or the model is too stiff.
    """
    if not (np.isfinite(max_speed) and max_speed > 0):
        raise InputError(f"max_speed = {max_speed!r} m/s is not allowed; give a finite speed > 0 m/s")
    check_trackable(model, np.array([max_speed]), "max_speed")
    rest = REST * speed_unit(model)
    switches = [piece.lower for piece in model.ranges if 0 < piece.lower <= max_speed]
    ranges = [
        (coefficients, max(piece.lower, rest), min(piece.upper, max_speed))
        for piece, coefficients in zip(model.ranges, model.coefficients, strict=True)
    ]
    found = [_polished(*part, _candidates(*part)) if part[1] < part[2] else [] for part in ranges]
    while True:
        lowest = min([speed for crossings in found for speed, _, _ in crossings] + switches + [max_speed])
        tracker = Tracker.over(model, lowest, max_speed, sparse=True)
        found = [
            _completed(*part, crossings, tracker.within(number)) if part[1] < part[2] else []
            for number, (part, crossings) in enumerate(zip(ranges, found, strict=True))
        ]
        every = [crossing for crossings in found for crossing in crossings]
        if not every or min(every)[0] >= tracker.stretches[0].speeds[0]:
            break
    if not tracker.sure(np.array([speed for speed, _, _ in every])):
        tracker = Tracker.over(model, lowest, max_speed)
    return tuple(sorted(_named(tracker, every) + _jumps(tracker, max_speed), key=lambda c: (c.speed, c.frequency)))


def _named(tracker: Tracker, crossings: Sequence[Crossing]) -> list[CriticalSpeed]:
    if not crossings:
        return []
    speeds, frequencies, _ = np.array(crossings).T
    ordered = tracker.ordered(speeds)
    branches = np.abs(ordered - 1j * frequencies[:, None]).argmin(1)
    index, labels = tracker.labels(speeds, ordered)
    return [
        _critical_speed(*crossing, labels[case][branch])
        for crossing, case, branch in zip(crossings, index, branches, strict=True)
    ]


def _critical_speed(speed: float, frequency: float, sign: int, mode: str) -> CriticalSpeed:
    kind = "oscillatory" if frequency else "real"
    return CriticalSpeed(speed, kind, mode, frequency, "destabilising" if sign > 0 else "stabilising")


def _jumps(tracker: Tracker, max_speed: float) -> list[CriticalSpeed]:
    found = []
    for below, above in pairwise(tracker.stretches):
        before, after, speed = below.values[-1], above.values[0], float(above.speeds[0])
        was, is_ = (x.real > NOISE * np.abs(x).max() for x in (before, after))
        for i in np.flatnonzero((was != is_) & (after.imag >= 0)):
            if speed <= max_speed:
                sign = 1 if is_[i] else -1
                _, labels = tracker.labels(np.array([speed]), before[None, :])
                found.append(_critical_speed(speed, float(after[i].imag), sign, labels[0][i]))
    return found


def _completed(
    coefficients: Mapping[int, Array], low: float, high: float, found: list[Crossing], tracked: Stretch | None
) -> list[Crossing]:
    """What was found, and what the roots at the tracked speeds tell is missing."""
    missing = dips(tracked, low, high) if tracked else np.empty(0)
    if missing.size:
        found = _polished(coefficients, low, high, np.concatenate([[c[0] for c in found], missing]))
    for _ in range(3):
        missing = unexplained(coefficients, found, low, high, tracked)
        if not missing.size:
            break
        found = _polished(coefficients, low, high, np.concatenate([[c[0] for c in found], missing]))
    return found


def _candidates(coefficients: Mapping[int, Array], low: float, high: float) -> Array:
    sums = {power: bialternate_sum(matrix) for power, matrix in coefficients.items()}
    roots = np.concatenate([singular_speeds(coefficients), singular_speeds(sums)])
    near = np.abs(roots.imag) <= NEARLY_REAL * np.abs(roots)
    speeds = roots[near].real
    return np.sort(speeds[(speeds > low * (1 - 1e-3)) & (speeds < high * (1 + 1e-3))])


def _polished(coefficients: Mapping[int, Array], low: float, high: float, candidates: Array) -> list[Crossing]:
    """Newton from every candidate and every root that may be the crossing one; each crossing once, touches left out."""
    if not len(candidates):
        return []
    values, slopes, _, _ = eigen(coefficients, candidates)
    size = np.abs(values).max(1, keepdims=True)
    step = np.abs(values.real) / np.maximum(np.abs(slopes.real), 1e-300)
    near = (values.imag >= 0) & ((step <= 0.05 * candidates[:, None]) | (np.abs(values.real) < 1e-6 * size))
    k, i = np.nonzero(near)
    found = _newton(coefficients, candidates[k], values[k], slopes[k], values[k, i]) if k.size else []
    result: list[Crossing] = []
    for speed, root, slope in sorted(found, key=lambda f: (f[0], abs(f[1].imag))):
        frequency = abs(root.imag)
        if not low < speed <= high or any(
            abs(speed - s) <= 1e-9 * speed and abs(frequency - f) <= 1e-6 * (frequency + 1) for s, f, _ in result
        ):
            continue
        result.append((speed, frequency, 1 if slope > 0 else -1))
    return result


def _newton(
    coefficients: Mapping[int, Array], speeds: Array, values: Complex, slopes: Complex, roots: Complex
) -> list[tuple[float, complex, float]]:
    """Solve Re lambda(v) = 0 along the roots given; (speed, root, slope) of those that converge.

    ``values`` and ``slopes`` (m, n) are those at ``speeds``.
    """
    v, expected, still = speeds.copy(), roots.copy(), np.zeros(len(speeds), bool)
    last = np.full(len(speeds), np.inf)
    for _ in range(MOST_STEPS):
        at = np.abs(values - expected[:, None]).argmin(1)[:, None]
        root = np.take_along_axis(values, at, 1)[:, 0]
        derivative = np.take_along_axis(slopes, at, 1)[:, 0]
        slope = derivative.real
        size = np.abs(values).max(1)
        moved = np.where(np.abs(slope) * v > NOISE * size, -root.real / np.where(slope == 0, 1, slope), np.inf)
        step = np.abs(moved) / v
        still |= (step <= ROUNDING) & (step > last / 2)  # as near as rounding lets it come
        if still.all():
            break
        moved = np.where(np.isfinite(moved) & ~still, np.clip(moved, -0.1 * v, 0.1 * v), 0.0)
        v, expected = v + moved, root + derivative * moved
        if (step <= LAST_STEP).all():
            root = np.where(root.imag == 0, expected.real, expected)
            break
        last = step
        values, slopes, _, _ = eigen(coefficients, v)
    good = np.abs(root.real) <= NOISE * np.abs(values).max(1)
    good &= (np.abs(slope) * v > NOISE * np.abs(values).max(1)) & (np.abs(v - speeds) <= 0.2 * speeds)
    return [(float(v[k]), complex(root[k]), float(slope[k])) for k in np.flatnonzero(good)]
