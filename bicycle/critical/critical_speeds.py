"""Critical speeds: where a root of the model crosses the imaginary axis, found without a speed grid.

With A(v) = sum v^k A_k, a real root is zero where det A(v) = 0, and a pair is imaginary where the bialternate sum
2 A(v) (.) I, whose eigenvalues are the sums of two eigenvalues of A, is singular (Guckenheimer, Myers & Sturmfels 1997,
SIAM J. Numer. Anal. 34, 1-21). Both are generalised eigenvalue problems of a companion pencil in v. Newton with
d(lambda)/dv sharpens what they give. The roots tracked for the names then tell what is missing: unstable roots are
counted between the crossings, and where a root turns back near the axis within a step, it is looked at. Where the count
does not add up (large or singular pencils lose digits), the missing ones are found by bisection. Names come from few
tracked speeds where more would not change them, from all otherwise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bicycle.critical.bialternate import bialternate_sum, singular_speeds
from bicycle.critical.completeness import NOISE, Crossing, missing_crossings, near_touches
from bicycle.critical.newton import polished
from bicycle.linear_model import LinearModel
from bicycle.modal.naming import speed_unit
from bicycle.modal.speed_limits import check_trackable
from bicycle.modal.tracker import Tracker
from bicycle.modal.tracking import TrackedRange
from bicycle.model import Model, as_linear
from tyre.base.arrays import Array
from tyre.base.errors import InputError

NEARLY_REAL = 1e-3  # candidates with a relative imaginary part below this are tried: near-double crossings are noisy
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
        Name as in :func:`bicycle.modal.named_modes.modes`.
    frequency_hz : float
        Of the crossing pair, Hz; 0 for a real root.
    direction : str
        What happens to that root as the speed grows: ``stabilising`` or ``destabilising``.
    """

    speed: float
    kind: str
    mode: str
    frequency_hz: float
    direction: str

    def __repr__(self) -> str:
        oscillation = f" at {self.frequency_hz:.4g} Hz" if self.kind == "oscillatory" else ", a real root"
        return f"<CriticalSpeed {self.speed:.6g} m/s: {self.mode} {self.direction}{oscillation}>"


def critical_speeds(model: Model | LinearModel, max_speed: float = 60.0) -> tuple[CriticalSpeed, ...]:
    """All speeds 0 < v <= max_speed at which a root crosses the imaginary axis, by speed.

    A root that only touches the axis is not listed. Where the equations switch at a speed, a root that jumps across
    the axis there is listed at that speed, with kind and frequency of the root above it.

    Parameters
    ----------
    model : Model or LinearModel
    max_speed : float
        m/s.

    Raises
    ------
    InputError
        ``max_speed`` is not a positive finite number or too high to be tracked, or the model is too stiff.
    """
    model = as_linear(model)
    if not (np.isfinite(max_speed) and max_speed > 0):
        raise InputError(f"max_speed = {max_speed!r} m/s is not allowed; give a finite speed > 0 m/s")
    check_trackable(model, np.array([max_speed]), "max_speed")
    rest = REST * speed_unit(model)
    switches = [piece.lower for piece in model.ranges if 0 < piece.lower <= max_speed]
    ranges = [
        (coefficients, max(piece.lower, rest), min(piece.upper, max_speed))
        for piece, coefficients in zip(model.ranges, model.coefficients, strict=True)
    ]
    found = [polished(*part, _candidates(*part)) if part[1] < part[2] else [] for part in ranges]
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
    return tuple(sorted(_named(tracker, every) + _jumps(tracker, max_speed), key=lambda c: (c.speed, c.frequency_hz)))


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


def _critical_speed(speed: float, angular_frequency: float, sign: int, mode: str) -> CriticalSpeed:
    kind = "oscillatory" if angular_frequency else "real"
    hertz = float(angular_frequency / (2 * np.pi))
    return CriticalSpeed(speed, kind, mode, hertz, "destabilising" if sign > 0 else "stabilising")


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
    coefficients: Mapping[int, Array], low: float, high: float, found: list[Crossing], tracked: TrackedRange | None
) -> list[Crossing]:
    """What was found, and what the roots at the tracked speeds tell is missing."""
    missing = near_touches(tracked, low, high) if tracked else np.empty(0)
    if missing.size:
        found = polished(coefficients, low, high, np.concatenate([[c[0] for c in found], missing]))
    for _ in range(3):
        missing = missing_crossings(coefficients, found, low, high, tracked)
        if not missing.size:
            break
        found = polished(coefficients, low, high, np.concatenate([[c[0] for c in found], missing]))
    return found


def _candidates(coefficients: Mapping[int, Array], low: float, high: float) -> Array:
    sums = {power: bialternate_sum(matrix) for power, matrix in coefficients.items()}
    roots = np.concatenate([singular_speeds(coefficients), singular_speeds(sums)])
    near = np.abs(roots.imag) <= NEARLY_REAL * np.abs(roots)
    speeds = roots[near].real
    return np.sort(speeds[(speeds > low * (1 - 1e-3)) & (speeds < high * (1 + 1e-3))])
