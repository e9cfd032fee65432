"""Crossings of the imaginary axis sharpened by Newton, and told from what rounding makes of a root near the axis.

What rounding changes in a root, divided by the slope of its real part, is how well the speed of a crossing is known.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.eigenvalues.decomposition import Decomposition, decompose, uncertainty
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array, Complex

MOST_STEPS = 30  # of Newton
LAST_STEP = 1e-9  # of the speed: after a step below this the next would be rounding
ROUNDING = 1e-7  # of the speed: a step below this that does not halve is rounding
FARTHEST = 0.2  # of the speed: a crossing so far from its candidate has another one
SAME_SPEED, SAME_FREQUENCY = 1e-9, 1e-6
WELL_KNOWN = 1e-8  # of the speed: a crossing known better than this needs no second look
SLACK = 300.0  # of what rounding should change in a root, where a count tells that there is a crossing
LOOKS = (2.0, 20.0, 200.0)  # of the doubt: where the sign on both sides is looked at
FARTHEST_LOOK = 1e-3  # of the speed
HARDLY_KNOWN = 0.02  # of the speed: a crossing known no better than this is none


@dataclass(frozen=True)
class _Zero:
    """Where a root was found to cross: ``slope`` d(lambda)/dv, ``doubt`` of the speed in m/s."""

    speed: float
    angular_frequency: float
    slope: complex
    doubt: float


def newton_crossings(
    polynomial: SpeedPolynomial, low: float, high: float, candidates: Array, *, counted: bool = False
) -> list[CriticalSpeed]:
    """Newton from every candidate and every root that may be the crossing one; each crossing once, touches left out.

    Parameters
    ----------
    polynomial : SpeedPolynomial, shape (n, n)
        Scaled state matrix of one speed range, 1/s.
    low, high : float
        Crossings at low < v <= high are kept, m/s.
    candidates : ndarray, shape (k,)
        Speeds near crossings, m/s.
    counted : bool
        The number of unstable roots has told that there are crossings: what rounding hides close to one is looked for
        farther away.

    Returns
    -------
    list of CriticalSpeed
        By speed, without names.
    """
    if not len(candidates):
        return []
    at = decompose(polynomial, candidates)
    values, slopes = at.values, at.slopes
    size = np.abs(values).max(1, keepdims=True)
    step = np.abs(values.real) / np.maximum(np.abs(slopes.real), 1e-300)
    near = (values.imag >= 0) & ((step <= 0.05 * candidates[:, None]) | (np.abs(values.real) < 1e-6 * size))
    k, i = np.nonzero(near)
    there = Decomposition(*(part[k] for part in at))
    slack = SLACK if counted else 1.0
    zeros = _newton(polynomial, candidates[k], values[k, i], there, slack) if k.size else []
    found = [zero for zero in zeros if low < zero.speed <= high]
    sure = _crossing(polynomial, found, LOOKS if counted else LOOKS[:1])
    return [
        CriticalSpeed.of_root(speed=zero.speed, root=1j * zero.angular_frequency, destabilising=zero.slope.real > 0)
        for zero in _once(sure)
    ]


def _newton(
    polynomial: SpeedPolynomial, speeds: Array, roots: Complex, at: Decomposition, slack: float = 1.0
) -> list[_Zero]:
    """Solve Re lambda(v) = 0 along the roots given; those that converge. ``at`` is of the matrices at ``speeds``.

    ``slack`` is by how much rounding may be worse than it should.
    """
    v, expected, still = speeds.copy(), roots.copy(), np.zeros(len(speeds), bool)
    last, row = np.full(len(speeds), np.inf), np.arange(len(speeds))
    for _ in range(MOST_STEPS):
        values, slopes, right, left = at
        own = np.abs(values - expected[:, None]).argmin(1)
        root, slope = values[row, own], slopes[row, own]
        moved = np.where(slope.real != 0, -root.real / np.where(slope.real == 0, 1, slope.real), 0.0)
        step = np.abs(moved) / v
        still |= (step <= ROUNDING) & (step > last / 2)  # as near as rounding lets it come
        if still.all():
            break
        moved = np.where(still, 0.0, np.clip(moved, -0.1 * v, 0.1 * v))
        v, expected = v + moved, root + slope * moved
        if (still | (step <= LAST_STEP)).all():
            root = np.where(root.imag == 0, expected.real, expected)
            break
        last = step
        at = decompose(polynomial, v)
    else:
        v = v - moved
    error = slack * uncertainty(values, left, polynomial(v), right)[row, own]
    rise = v * np.abs(slope.real)
    good = (np.abs(root.real) <= np.maximum(error, ROUNDING * rise)) & (np.abs(v - speeds) <= FARTHEST * speeds)
    error = np.maximum(error, np.abs(root.real))
    good &= error < HARDLY_KNOWN * rise
    return [
        _Zero(float(v[k]), abs(float(root[k].imag)), complex(slope[k]), float(error[k] / abs(slope[k].real)))
        for k in np.flatnonzero(good)
    ]


def _crossing(polynomial: SpeedPolynomial, zeros: Sequence[_Zero], looks: Sequence[float]) -> list[_Zero]:
    """Those whose real part changes its sign beyond doubt; what rounding makes of a touch of the axis does not."""
    sure = [zero for zero in zeros if zero.doubt <= WELL_KNOWN * zero.speed]
    rest = [zero for zero in zeros if zero.doubt > WELL_KNOWN * zero.speed]
    for look in looks:
        if not rest:
            break
        distance = [min(look * zero.doubt, max(FARTHEST_LOOK * zero.speed, 2 * zero.doubt)) for zero in rest]
        away = np.array([[-far, far] for far in distance])
        values = decompose(polynomial, (np.array([[zero.speed] for zero in rest]) + away).reshape(-1)).values
        crossing = np.array([[1j * zero.angular_frequency] for zero in rest])
        roots = crossing + np.array([[zero.slope] for zero in rest]) * away
        own = np.abs(values - roots.reshape(-1, 1)).argmin(1)
        before, after = values[np.arange(len(own)), own].reshape(-1, 2).T
        changes = [
            zero.slope.real * a < 0 < zero.slope.real * b
            for zero, a, b in zip(rest, before.real, after.real, strict=True)
        ]
        sure += [zero for zero, here in zip(rest, changes, strict=True) if here]
        rest = [zero for zero, here in zip(rest, changes, strict=True) if not here]
    return sure


def _once(zeros: Sequence[_Zero]) -> list[_Zero]:
    """Each crossing once, by speed; two that cannot be told apart and go opposite ways are a touch."""
    groups: list[list[_Zero]] = []
    for zero in sorted(zeros, key=lambda zero: (zero.speed, zero.angular_frequency)):
        group = next((group for group in groups if _same(group[-1], zero)), None)
        if group:
            group.append(zero)
        else:
            groups.append([zero])
    best = [min(g, key=lambda zero: zero.doubt) for g in groups if g[0].slope.real * g[-1].slope.real > 0]
    return sorted(best, key=lambda zero: (zero.speed, zero.angular_frequency))


def _same(a: _Zero, b: _Zero) -> bool:
    near = max(SAME_SPEED * b.speed, a.doubt + b.doubt)
    alike = SAME_FREQUENCY * (b.angular_frequency + 1) + near * max(abs(a.slope), abs(b.slope))
    return b.speed - a.speed <= near and abs(b.angular_frequency - a.angular_frequency) <= alike
