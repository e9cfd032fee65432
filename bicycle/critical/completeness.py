"""Whether crossings of the imaginary axis are complete: roots at tracked speeds, counted and followed in between."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.modal.tracking import TrackedRange
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array, Complex

UNTRACKED = 12  # speeds at which unstable roots are counted below those that are tracked
NEAR_AXIS = 0.2  # of the real part at the nearest node: a root that comes so near is looked at
NOISE = 1e-12  # of the largest root: a root smaller than this is zero


def missing_crossings(
    polynomial: SpeedPolynomial, crossings: Sequence[CriticalSpeed], low: float, high: float,
    tracked: TrackedRange | None,
) -> Array:  # fmt: skip
    """Speeds next to crossings that are not listed: where the number of unstable roots changes without them.

    Parameters
    ----------
    polynomial : SpeedPolynomial, shape (n, n)
        Scaled state matrix of one speed range, 1/s.
    crossings : sequence of CriticalSpeed
        Those that are known.
    low, high : float
        Ends of the range that is looked at, m/s.
    tracked : TrackedRange, optional
        Roots that are known already.

    Returns
    -------
    ndarray, shape (k,)
        m/s; empty where the count adds up.
    """
    speeds = np.array([crossing.speed for crossing in crossings])
    change = np.array([crossing.unstable_roots for crossing in crossings], int)
    nodes, count = np.empty(0), np.empty(0, np.intp)
    if tracked:
        inside = (tracked.speeds > low) & (tracked.speeds <= high)
        nodes, count = tracked.speeds[inside], _above(tracked.values[inside])
    first = min([high, *nodes])
    below = UNTRACKED if tracked is None or tracked.speeds[0] > low else 1
    others = np.concatenate([np.linspace(low, first, below), (speeds[1:] + speeds[:-1]) / 2, [high]])
    others = np.setdiff1d(others, nodes)
    points = np.concatenate([nodes, others])
    count = np.concatenate([count, _unstable(polynomial, others)])
    order = np.argsort(points)
    order = order[~np.isin(points[order], speeds)]
    points, count = points[order], count[order]
    known = np.append(0, np.cumsum(change))[np.searchsorted(speeds, points)]
    missing = []
    for k in np.flatnonzero(np.diff(count - known) != 0):
        missing += _bisect(polynomial, points[k], points[k + 1])
    return np.array(missing)


def near_touches(tracked: TrackedRange, low: float, high: float) -> Array:
    """Speeds next to which a real part that turns back between two nodes may be zero, before and after it turns.

    Parameters
    ----------
    tracked : TrackedRange
    low, high : float
        Ends of the range that is looked at, m/s.

    Returns
    -------
    ndarray, shape (k,)
        m/s.
    """
    within = (tracked.speeds[1:] > low) & (tracked.speeds[1:] <= high) & tracked.smooth
    h = np.diff(tracked.speeds)[:, None]
    noise = NOISE * np.abs(tracked.values).max(1, keepdims=True)
    a, b = tracked.values.real[:-1], tracked.values.real[1:]
    rise_a, rise_b = h * tracked.slopes.real[:-1], h * tracked.slopes.real[1:]
    towards = (a * b > 0) & (a * rise_a < 0) & (b * rise_b > 0) & (np.abs(a) > noise[:-1]) & (np.abs(b) > noise[1:])
    k, i = np.nonzero(towards & within[:, None])
    a, b, rise_a, rise_b = a[k, i], b[k, i], rise_a[k, i], rise_b[k, i]
    square, cube = 3 * (b - a) - 2 * rise_a - rise_b, rise_a + rise_b - 2 * (b - a)  # Hermite's cubic
    root = np.sqrt(np.maximum(square**2 - 3 * cube * rise_a, 0))
    t = -rise_a / (square + np.where(a > 0, root, -root))
    turn = a + t * (rise_a + t * (square + t * cube))
    reached = turn * np.sign(a) < NEAR_AXIS * np.minimum(np.abs(a), np.abs(b))
    bend = np.maximum(np.abs(2 * square + 6 * cube * t), 1e-300)
    apart = np.minimum(np.sqrt(2 * np.abs(turn) / bend), 0.5)  # of the two zeros from the turn
    start, width = tracked.speeds[k], h[k, 0]
    return np.concatenate([(start + width * at)[reached] for at in (t - apart, t + apart)])


def _bisect(polynomial: SpeedPolynomial, a: float, b: float) -> list[float]:
    """Narrow every change of the count of unstable roots in (a, b) down to a speed Newton can start from."""
    narrowed, open_ = [], [(a, b)]
    while open_:
        ends = np.array(open_)
        middle = ends.mean(1)
        count = _unstable(polynomial, np.concatenate([ends[:, 0], middle, ends[:, 1]])).reshape(3, -1)
        halves = [((lo, mid), (mid, hi)) for (lo, hi), mid in zip(open_, middle, strict=True)]
        open_ = []
        for k, pair in enumerate(halves):
            for side, (lo, hi) in enumerate(pair):
                if count[side, k] != count[side + 1, k]:
                    if hi - lo < 1e-9 * hi:
                        narrowed.append((lo + hi) / 2)
                    else:
                        open_.append((lo, hi))
    return narrowed


def _unstable(polynomial: SpeedPolynomial, speeds: Array) -> NDArray[np.intp]:
    return _above(np.linalg.eigvals(polynomial(speeds)).astype(complex, copy=False))


def _above(values: Complex) -> NDArray[np.intp]:
    """Number of unstable roots of each row."""
    return np.asarray((values.real > NOISE * np.abs(values).max(1, keepdims=True)).sum(1))
