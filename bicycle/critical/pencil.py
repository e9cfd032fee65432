"""Where a root of one model crosses the imaginary axis, found without a speed grid: the plain path, and the judge.

With A(v) = sum v^k A_k, a real root is zero where det A(v) = 0, and a pair is imaginary where the bialternate sum
2 A(v) (.) I, whose eigenvalues are the sums of two eigenvalues of A, is singular (Guckenheimer, Myers & Sturmfels 1997,
SIAM J. Numer. Anal. 34, 1-21). Both are generalised eigenvalue problems of a companion pencil in v. Newton with
d(lambda)/dv sharpens what they give. The roots tracked for the names then tell what is missing: unstable roots are
counted between the crossings, and where a root turns back near the axis within a step, it is looked at. Where the count
does not add up (large or singular pencils lose digits), the missing ones are found by bisection. Names come from few
tracked speeds where more would not change them, from all otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bicycle.critical.bialternate import bialternate_sum, singular_speeds
from bicycle.critical.completeness import NOISE, missing_crossings, near_touches
from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.critical.newton import SAME_FREQUENCY, SAME_SPEED, newton_crossings
from bicycle.linear_model import LinearModel
from bicycle.modal.naming import speed_unit
from bicycle.modal.speed_limits import check_trackable
from bicycle.modal.tracker import Tracker
from bicycle.modal.tracking import TrackedRange
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array

NEARLY_REAL = 1e-3  # candidates with a relative imaginary part below this are tried: near-double crossings are noisy
SEARCHES = 3  # for crossings that a count of unstable roots tells are missing
REST = 1e-7  # of sqrt(g w): closer to rest is rest, where undamped pairs lie on the axis


@dataclass(frozen=True)
class _SearchedRange:
    """The part low < v <= high (m/s) of a speed range of the model, and its scaled state matrix."""

    number: int
    polynomial: SpeedPolynomial
    low: float
    high: float

    def near(self, crossings: Sequence[CriticalSpeed], further: Array, *, counted: bool = False) -> list[CriticalSpeed]:
        """Those crossings again, and those next to ``further`` speeds (m/s), where unstable roots are ``counted``."""
        candidates = np.concatenate([[crossing.speed for crossing in crossings], further])
        return newton_crossings(self.polynomial, self.low, self.high, candidates, counted=counted)


def crossings_by_pencil(model: LinearModel, max_speed: float) -> tuple[CriticalSpeed, ...]:
    """All critical speeds of a model, as :func:`bicycle.critical.critical_speeds.critical_speeds` gives them.

    Parameters
    ----------
    model : LinearModel
    max_speed : float
        m/s, > 0.

    Raises
    ------
    InputError
        ``max_speed`` is too high to be tracked, or the model is too stiff.
    """
    check_trackable(model, np.array([max_speed]), "max_speed")
    rest = REST * speed_unit(model)
    switches = [at.lower for at in model.ranges if 0 < at.lower <= max_speed]
    whole = [
        _SearchedRange(number, polynomial, max(at.lower, rest), min(at.upper, max_speed))
        for number, (at, polynomial) in enumerate(zip(model.ranges, model.coefficients, strict=True))
    ]
    searched = [part for part in whole if part.low < part.high]
    by_part = [part.near([], _candidates(part)) for part in searched]
    while True:
        lowest = min([crossing.speed for crossings in by_part for crossing in crossings] + switches + [max_speed])
        tracker = Tracker.over(model, lowest, max_speed, sparse=True)
        by_part = [
            _completed(part, crossings, tracker.within(part.number))
            for part, crossings in zip(searched, by_part, strict=True)
        ]
        every = [crossing for crossings in by_part for crossing in crossings]
        speeds = np.array([crossing.speed for crossing in every])
        if not every or speeds.min() >= tracker.tracked[0].speeds[0]:
            break
    if not tracker.sure(speeds):
        tracker = Tracker.over(model, lowest, max_speed)
    return tuple(sorted(_named(tracker, every) + _jumps(tracker, max_speed), key=lambda c: (c.speed, c.frequency_hz)))


def _named(tracker: Tracker, crossings: Sequence[CriticalSpeed]) -> list[CriticalSpeed]:
    if not crossings:
        return []
    speeds = np.array([crossing.speed for crossing in crossings])
    roots = np.array([1j * crossing.angular_frequency for crossing in crossings])
    ordered = tracker.ordered(speeds)
    branches = np.abs(ordered - roots[:, None]).argmin(1)
    index, labels = tracker.labels(speeds, ordered)
    return [
        crossing.named(labels[case][branch]) for crossing, case, branch in zip(crossings, index, branches, strict=True)
    ]


def _jumps(tracker: Tracker, max_speed: float) -> list[CriticalSpeed]:
    """Roots that jump across the axis where the equations switch."""
    jumps = []
    for below, above in pairwise(tracker.tracked):
        before, after, speed = below.values[-1], above.values[0], float(above.speeds[0])
        was, is_ = (x.real > NOISE * np.abs(x).max() for x in (before, after))
        for i in np.flatnonzero((was != is_) & (after.imag >= 0)):
            if speed <= max_speed:
                _, labels = tracker.labels(np.array([speed]), before[None, :])
                jumps.append(
                    CriticalSpeed.of_root(
                        speed=speed, root=1j * after[i].imag, destabilising=bool(is_[i]), mode=labels[0][i]
                    )
                )
    return jumps


def _completed(
    part: _SearchedRange, crossings: list[CriticalSpeed], tracked: TrackedRange | None
) -> list[CriticalSpeed]:
    """The crossings known, and what the roots at the tracked speeds tell is missing."""
    missing = near_touches(tracked, part.low, part.high) if tracked else np.empty(0)
    if missing.size:
        crossings = part.near(crossings, missing)
    for _ in range(SEARCHES):
        missing = missing_crossings(part.polynomial, crossings, part.low, part.high, tracked)
        if not missing.size:
            return crossings
        crossings = part.near(crossings, missing)
    return _beyond_rounding(part, crossings, tracked)


def _beyond_rounding(
    part: _SearchedRange, crossings: list[CriticalSpeed], tracked: TrackedRange | None
) -> list[CriticalSpeed]:
    """The crossings, and those that rounding hides close to them, where the count of unstable roots adds up with them.

    Those that are known stay as they are.
    """
    missing = missing_crossings(part.polynomial, crossings, part.low, part.high, tracked)
    if not missing.size:
        return crossings
    found = [c for c in part.near([], missing, counted=True) if not any(_same(c, known) for known in crossings)]
    more = sorted([*crossings, *found], key=lambda c: c.speed)
    left = missing_crossings(part.polynomial, more, part.low, part.high, tracked)
    return more if left.size < missing.size else crossings


def _same(one: CriticalSpeed, other: CriticalSpeed) -> bool:
    """Whether two are one crossing, found twice."""
    near = abs(one.speed - other.speed) <= SAME_SPEED * other.speed
    return (
        near
        and one.destabilising == other.destabilising
        and abs(one.frequency_hz - other.frequency_hz) <= SAME_FREQUENCY * max(one.frequency_hz, other.frequency_hz)
    )


def _candidates(part: _SearchedRange) -> Array:
    """Speeds (k,) near which a real root may be zero or a pair imaginary, m/s."""
    sums = SpeedPolynomial({power: bialternate_sum(matrix) for power, matrix in part.polynomial.items()})
    roots = np.concatenate([singular_speeds(part.polynomial), singular_speeds(sums)])
    near = np.abs(roots.imag) <= NEARLY_REAL * np.abs(roots)
    speeds = roots[near].real
    return np.sort(speeds[(speeds > part.low * (1 - 1e-3)) & (speeds < part.high * (1 + 1e-3))])
