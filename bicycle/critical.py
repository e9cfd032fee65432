"""Critical speeds: where a root of the model crosses the imaginary axis, found without a speed grid.

With A(v) = sum v^k A_k, a real root is zero where det A(v) = 0, and a pair is imaginary where the bialternate sum
2 A(v) (.) I, whose eigenvalues are the sums of two eigenvalues of A, is singular (Guckenheimer, Myers & Sturmfels 1997,
SIAM J. Numer. Anal. 34, 1-21). Both are generalised eigenvalue problems of a companion pencil in v. Newton with
d(lambda)/dv sharpens what they give, and a count of the unstable roots between the crossings proves them complete:
where it does not add up (large or singular pencils lose digits), the missing ones are found by bisection.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bicycle.bialternate import bialternate_sum, singular_speeds
from bicycle.computable import check_trackable
from bicycle.linear_model import LinearModel
from bicycle.tracker import Tracker
from bicycle.tracking import Array, Complex, eigen, laurent
from tyre.errors import InputError

NEARLY_REAL = 1e-3  # candidates with a relative imaginary part below this are tried: near-double crossings are noisy
COUNT_NODES = 600  # of the check
REST = 1e-7  # of sqrt(g w): closer to rest is rest, where undamped pairs lie on the axis
NOISE = 1e-9  # of the largest root: a root smaller than this is zero


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


Crossing = tuple[float, float, int]  # speed, frequency, +1 destabilising or -1 stabilising


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
    rest = REST * float(np.sqrt(model.parameters["g"] * model.parameters["w"]))
    found: list[Crossing] = []
    for piece, coefficients in zip(model.ranges, model.coefficients, strict=True):
        low, high = max(piece.lower, rest), min(piece.upper, max_speed)
        if low < high:
            found += _crossings(coefficients, low, high)
    switches = [piece.lower for piece in model.ranges if 0 < piece.lower <= max_speed]
    tracker = Tracker.over(model, min([speed for speed, _, _ in found] + switches + [max_speed]), max_speed)
    named = [_named(tracker, *crossing) for crossing in found] + _jumps(tracker, max_speed)
    return tuple(sorted(named, key=lambda c: (c.speed, c.frequency)))


def _named(tracker: Tracker, speed: float, frequency: float, sign: int) -> CriticalSpeed:
    v = np.array([speed])
    ordered = tracker.ordered(v)
    branch = int(np.abs(ordered[0] - 1j * frequency).argmin())
    return _critical_speed(tracker, speed, frequency, sign, branch, ordered)


def _critical_speed(
    tracker: Tracker, speed: float, frequency: float, sign: int, branch: int, ordered: Complex
) -> CriticalSpeed:
    _, labels = tracker.labels(np.array([speed]), ordered)
    kind = "oscillatory" if frequency else "real"
    return CriticalSpeed(speed, kind, labels[0][branch], frequency, "destabilising" if sign > 0 else "stabilising")


def _jumps(tracker: Tracker, max_speed: float) -> list[CriticalSpeed]:
    found = []
    for below, above in pairwise(tracker.stretches):
        before, after, speed = below.values[-1], above.values[0], float(above.speeds[0])
        was, is_ = (x.real > NOISE * np.abs(x).max() for x in (before, after))
        for i in np.flatnonzero((was != is_) & (after.imag >= 0)):
            if speed <= max_speed:
                sign = 1 if is_[i] else -1
                found.append(_critical_speed(tracker, speed, float(after[i].imag), sign, int(i), before[None, :]))
    return found


def _crossings(coefficients: Mapping[int, Array], low: float, high: float) -> list[Crossing]:
    candidates = _candidates(coefficients, low, high)
    found = _polished(coefficients, candidates, low, high)
    for _ in range(3):
        missing = _unexplained(coefficients, found, low, high)
        if not missing.size:
            break
        found = _polished(coefficients, np.concatenate([[c[0] for c in found], missing]), low, high)
    return found


def _candidates(coefficients: Mapping[int, Array], low: float, high: float) -> Array:
    sums = {power: bialternate_sum(matrix) for power, matrix in coefficients.items()}
    roots = np.concatenate([singular_speeds(coefficients), singular_speeds(sums)])
    near = np.abs(roots.imag) <= NEARLY_REAL * np.abs(roots)
    speeds = roots[near].real
    return np.sort(speeds[(speeds > low * (1 - 1e-3)) & (speeds < high * (1 + 1e-3))])


def _polished(coefficients: Mapping[int, Array], candidates: Array, low: float, high: float) -> list[Crossing]:
    """Newton from every candidate and every root that may be the crossing one; each crossing once, touches left out."""
    if not len(candidates):
        return []
    values, slopes, _, _ = eigen(coefficients, candidates)
    size = np.abs(values).max(1, keepdims=True)
    step = np.abs(values.real) / np.maximum(np.abs(slopes.real), 1e-300)
    near = (values.imag >= 0) & ((step <= 0.05 * candidates[:, None]) | (np.abs(values.real) < 1e-6 * size))
    k, i = np.nonzero(near)
    found = _newton(coefficients, candidates[k], values[k, i])
    result: list[Crossing] = []
    for speed, root, slope in sorted(found, key=lambda f: (f[0], abs(f[1].imag))):
        frequency = abs(root.imag)
        if not low < speed <= high or any(
            abs(speed - s) <= 1e-9 * speed and abs(frequency - f) <= 1e-6 * (frequency + 1) for s, f, _ in result
        ):
            continue
        result.append((speed, frequency, 1 if slope > 0 else -1))
    return result


def _newton(coefficients: Mapping[int, Array], speeds: Array, roots: Complex) -> list[tuple[float, complex, float]]:
    """Solve Re lambda(v) = 0 along the roots given; (speed, root, slope) of those that converge."""
    v, expected = speeds.copy(), roots.copy()
    for _ in range(30):
        values, slopes, _, _ = eigen(coefficients, v)
        at = np.abs(values - expected[:, None]).argmin(1)[:, None]
        root = np.take_along_axis(values, at, 1)[:, 0]
        derivative = np.take_along_axis(slopes, at, 1)[:, 0]
        slope = derivative.real
        size = np.abs(values).max(1)
        moved = np.where(np.abs(slope) * v > NOISE * size, -root.real / np.where(slope == 0, 1, slope), np.inf)
        if (np.abs(moved) <= 4e-15 * v).all():
            break
        moved = np.where(np.isfinite(moved), np.clip(moved, -0.1 * v, 0.1 * v), 0.0)
        v, expected = v + moved, root + derivative * moved
    good = np.abs(root.real) <= NOISE * np.abs(values).max(1)
    good &= (np.abs(slope) * v > NOISE * np.abs(values).max(1)) & (np.abs(v - speeds) <= 0.2 * speeds)
    return [(float(v[k]), complex(root[k]), float(slope[k])) for k in np.flatnonzero(good)]


def _unexplained(coefficients: Mapping[int, Array], found: list[Crossing], low: float, high: float) -> Array:
    """Speeds next to crossings that are not in ``found``: where the number of unstable roots changes without them."""
    speeds = np.array([speed for speed, _, _ in found])
    change = np.array([sign * (2 if frequency else 1) for _, frequency, sign in found])
    nodes = np.linspace(low, high, COUNT_NODES + 1)[1:]
    middles = (speeds[1:] + speeds[:-1]) / 2 if len(speeds) else speeds
    points = np.unique(np.concatenate([[low], nodes, middles]))
    points = points[~np.isin(points, speeds)]
    count, missing = _unstable(coefficients, points), []
    known = np.array([change[speeds < v].sum() if len(speeds) else 0 for v in points])
    intervals = [(points[k], points[k + 1]) for k in np.flatnonzero(np.diff(count - known) != 0)]
    for a, b in intervals:
        missing += _bisect(coefficients, a, b)
    return np.array(missing)


def _bisect(coefficients: Mapping[int, Array], a: float, b: float) -> list[float]:
    """Narrow every change of the count of unstable roots in (a, b) down to a speed Newton can start from."""
    found, open_ = [], [(a, b)]
    while open_:
        ends = np.array(open_)
        middle = ends.mean(1)
        count = _unstable(coefficients, np.concatenate([ends[:, 0], middle, ends[:, 1]])).reshape(3, -1)
        halves = [((lo, mid), (mid, hi)) for (lo, hi), mid in zip(open_, middle, strict=True)]
        open_ = []
        for k, pair in enumerate(halves):
            for side, (lo, hi) in enumerate(pair):
                if count[side, k] == count[side + 1, k]:
                    continue
                if hi - lo < 1e-9 * hi:
                    found.append((lo + hi) / 2)
                else:
                    open_.append((lo, hi))
    return found


def _unstable(coefficients: Mapping[int, Array], speeds: Array) -> NDArray[np.intp]:
    values = np.linalg.eigvals(laurent(coefficients, speeds))
    return np.asarray((values.real > NOISE * np.abs(values).max(1, keepdims=True)).sum(1))
