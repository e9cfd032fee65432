"""Branches of periodic motions over the speed or another number, by pseudo-arclength (Keller 1977)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy

from bicycle.motion.slip_system import Complex, Cycle, SlipSystem
from bicycle.stability.critical import CriticalSpeed
from tyre.ground.arrays import Array

FEWEST, MOST = 16, 128  # harmonics
TAIL = 1e-6  # share of the last harmonics in a signal, from which on there are half as many more
STRAIGHT = 0.95  # cosine between the tangents at both ends of a step
SHORTEST, LONGEST, MOST_POINTS = 1e-4, 1.5, 600  # steps of a branch
TURNING = 1e-5  # share of the number in the tangent: the branch turns there
REST = 1e-9  # rad of slip: no motion
UNIT_SLIP, UNIT_SPEED = 0.02, 2.0  # rad and m/s that count as one in the length of a branch
SAME = 1e-4  # of the largest slip: two motions are one, whose dry friction is cut at other harmonics


class Point(NamedTuple):
    """A solution on a branch: the unknowns (slips, omega, number), each over its size, the tangent, the cycle."""

    unknowns: Array  # (u,), no unit
    tangent: Array  # (u,), of length 1; zero at the far end of a branch
    cycle: Cycle  # the solution in SI units
    number: float  # what the branch is followed over: speed in m/s, or another number


class Rest(NamedTuple):
    """A number at which a motion begins, and the critical speed that it is one of."""

    number: float  # speed in m/s, or the other number that the branch is followed over
    critical: CriticalSpeed  # oscillatory, at the number


def pad(vector: Array, length: int) -> Array:
    """The ``vector`` of unknowns with zeros for higher harmonics, (``length``,): omega and number stay last."""
    return np.concatenate([vector[:-2], np.zeros(length - len(vector)), vector[-2:]])


def cosine(a: Point, b: Point) -> float:
    """Cosine between the tangents of two points."""
    length = max(len(a.tangent), len(b.tangent))
    return float(pad(a.tangent, length) @ pad(b.tangent, length))


def unit_at(length: int, place: int) -> Array:
    """Row (``length``,) that is 1 at a ``place`` and else 0."""
    row = np.zeros(length)
    row[place] = 1.0
    return row


@dataclass(frozen=True)
class Balance:
    """Newton's method on the balance with a phase and one more condition, in unknowns of comparable size."""

    system: SlipSystem  # at every number, or with ``make`` at the one that it was made for
    omega: float  # rad/s, and
    unit: float  # the number that count as one
    limits: tuple[float, float] = (0.0, np.inf)  # of the number
    make: Callable[[float], tuple[SlipSystem, float]] | None = None  # number -> system and speed; None: it is the speed

    def unpack(self, unknowns: Array) -> tuple[Complex, float, float]:
        """Slips (orders, signals) in rad, omega in rad/s and the number that ``unknowns`` (u,) stand for."""
        parts = UNIT_SLIP * unknowns[:-2].reshape(-1, len(self.system.signals), 2)
        return parts[..., 0] + 1j * parts[..., 1], float(unknowns[-2] * self.omega), float(unknowns[-1] * self.unit)

    def pack(self, slips: Complex, omega: float, number: float) -> Array:
        """Unknowns (u,), no unit, of ``slips`` (orders, signals) in rad, ``omega`` in rad/s and ``number``."""
        parts = np.stack([slips.real, slips.imag], -1).ravel() / UNIT_SLIP
        return np.array([*parts, omega / self.omega, number / self.unit])

    def _equations(self, slips: Complex, omega: float, number: float) -> tuple[Complex, Array, Complex, float]:
        """Residual (orders, signals), its jacobian by slips, omega and number, states (orders, n) and speed (m/s)."""
        if self.make is None:
            return (*self.system.balance(slips, omega, number), number)
        system, speed = self.make(number)
        residual, jacobian, states = system.balance(slips, omega, speed)
        step = 1e-5 * self.unit * (1 if number < np.mean(self.limits) else -1)
        shifted, *_ = self.make(number + step)[0].response(slips, omega, speed)
        change = (shifted - residual).ravel() / step
        jacobian[:, -1] = [*change.real, *change.imag]
        return residual, jacobian, states, speed

    def correct(self, guess: Array, direction: Array, phase: Array) -> Point | None:
        """Solve with along . (u - guess) = 0 and phase . u = 0; None if Newton's method does not get there.

        Harmonics are added until the last ones are small.
        """
        u = guess
        direction, phase = (pad(row, len(u)) for row in (direction, phase))
        size = np.array([*np.full(len(u) - 2, UNIT_SLIP), self.omega, self.unit])
        for _ in range(9):
            slips, omega, unclipped = self.unpack(u)
            number = float(np.clip(unclipped, *self.limits))
            if not (omega > 0 and abs(unclipped - number) <= 1e-9 * self.unit):
                return None
            residual, jacobian, states, speed = self._equations(slips, omega, number)
            whole = np.vstack([jacobian * size, phase, direction])
            right = np.array([*residual.real.ravel(), *residual.imag.ravel(), phase @ u, direction @ (u - guess)])
            try:
                step, tangent = np.linalg.solve(whole, np.column_stack([right, unit_at(len(u), -1)])).T
            except np.linalg.LinAlgError:
                return None
            if not np.abs(step).max() < 1e3:
                return None
            u = u - step
            if np.abs(step).max() < 1e-9:  # the next step would be far below rounding
                slips, omega, unclipped = self.unpack(u)
                number = float(np.clip(unclipped, *self.limits))
                cycle = Cycle(speed if self.make else number, omega, slips, states)
                if cycle.tail < TAIL or len(slips) >= MOST:
                    return Point(u, tangent / np.linalg.norm(tangent), cycle, number)
                more = min(len(slips) // 2, MOST - len(slips))
                return self.correct(pad(u, len(u) + more * 2 * slips.shape[1]), direction, phase)
        return None

    def phase(self, slips: Complex) -> Array:
        """Row (u,), of length 1, that is 0 times unknowns whose first harmonic is in phase with that of ``slips``."""
        turned = np.zeros_like(slips)
        turned[0] = 1j * slips[0]
        row = self.pack(turned, 0.0, 0.0)
        return np.asarray(row / np.linalg.norm(row))

    def point_at_rest(self, at: Rest, first: Complex) -> Point:
        """Point at rest, whose tangent is the ``first`` harmonic (signals,) of a growing motion."""
        slips, omega = np.zeros((FEWEST, len(first)), complex), at.critical.angular_frequency
        still = Cycle(at.critical.speed, omega, slips, np.zeros((FEWEST, len(self.system.entry)), complex))
        tangent = self.pack(np.vstack([first, slips[1:]]), 0.0, 0.0)
        return Point(self.pack(slips, omega, at.number), tangent / np.linalg.norm(tangent), still, at.number)

    def start(self, cycle: Cycle, number: float) -> Point | None:
        """Point of a ``cycle`` near a ``number``, its tangent upwards in the number; None where Newton fails."""
        guess = self.pack(cycle.slips, cycle.angular_frequency, number)
        return self.correct(guess, unit_at(len(guess), -1), self.phase(cycle.slips))

    def point_between(self, start: Point, neighbour: Point, number: float) -> Point | None:
        """Point at a ``number`` between those of two neighbours on a branch; None at rest or where Newton fails."""
        length = max(len(start.unknowns), len(neighbour.unknowns))
        first, second = (pad(end.unknowns, length) for end in (start, neighbour))
        share = (number - start.number) / (neighbour.number - start.number)
        folds = [abs(end.tangent[-1]) < TURNING and bool(end.cycle.slips.any()) for end in (start, neighbour)]
        if folds[0]:  # from a fold on it goes like a square root
            share = np.sqrt(share)
        elif folds[1]:
            share = 1 - np.sqrt(1 - share)
        guess = first + share * (second - first)
        if not any(folds):  # beside rest the square of the amplitude goes with the number
            squares = [end[:-2] @ end[:-2] for end in (first, second)]
            size = np.sqrt((1 - share) * squares[0] + share * squares[1])
            guess[:-2] *= size / max(np.linalg.norm(guess[:-2]), REST)
        guess[-1] = number / self.unit
        if not guess[:-2].any():
            return None
        point = self.correct(guess, unit_at(length, -1), self.phase(self.unpack(guess)[0]))
        return point if point is not None and np.abs(point.cycle.slips[0]).max() > REST else None


@dataclass(frozen=True)
class Branch:
    """Connected periodic motions, in the order in which they were followed."""

    mode: str  # name of the mode whose motion begins there
    begin: CriticalSpeed  # where it begins; with dry friction, where it would begin without
    end: CriticalSpeed | None  # where the motion shrinks to rest again; None if it does not
    reason: str  # why it ends: critical speed, geometry, speed, slow, lost, closed, sticks, range
    points: tuple[Point, ...]  # in the order in which they were followed
    folds: tuple[Cycle, ...]  # cycles at which the branch turns back in the number
    balance: Balance = field(repr=False)  # whose solutions the points are

    def at(self, number: float) -> list[Cycle]:
        """Cycles at a speed in m/s, or at another ``number`` that the branch is over; as many as it has there."""
        cycles: list[Cycle] = []
        for start, end in pairwise(self.points):
            if start.number != end.number and (number - start.number) * (number - end.number) <= 0:
                point = self.balance.point_between(start, end, number)
                if point is not None and not any(same(point.cycle, cycle) for cycle in cycles):
                    cycles.append(point.cycle)
        return cycles


def same(a: Cycle, b: Cycle) -> bool:
    """True if two cycles are one, whatever their phase."""
    count = min(len(a.slips), len(b.slips))
    sizes = np.abs(a.slips[:count]) - np.abs(b.slips[:count])
    return bool(np.abs(sizes).max() < SAME * np.abs(a.slips).max() + REST)


def follow(
    balance: Balance,
    begin: Point,
    leaves: Callable[[Point], str],
    mode: str,
    critical: CriticalSpeed,
    rests: Sequence[Rest] = (),
) -> Branch:
    """Follow a branch until it comes to one of the ``rests``, closes, or ``leaves`` names a reason."""
    points, folds, step, end, reason = [begin], [], 0.1, None, "lost"
    phase = balance.phase(begin.cycle.slips if begin.cycle.slips.any() else balance.unpack(begin.tangent)[0])
    while len(points) < MOST_POINTS and step > SHORTEST:
        last = points[-1]

        def point_ahead(length: float, last: Point = last, phase: Array = phase) -> Point | None:
            return balance.correct(last.unknowns + length * last.tangent, last.tangent, phase)

        def turning(length: float, last: Point = last, point_ahead: Any = point_ahead) -> float:
            return float((point_ahead(length) or last).tangent[-1])

        goal = balance.unit * (last.unknowns + step * last.tangent)[-1]
        limit = float(np.clip(goal, *balance.limits))
        if limit == last.number != goal:
            reason = "range"
            break
        if limit == goal:
            point = point_ahead(step)
        else:  # as far as a limit of the number alone
            share = (limit - last.number) / (balance.unit * last.tangent[-1])
            direction = np.sign(last.tangent[-1]) * unit_at(len(last.unknowns), -1)
            point = balance.correct(last.unknowns + share * last.tangent, direction, phase)
            point = point and point._replace(number=limit)
        if point is None or np.abs(point.cycle.slips).max() < REST or cosine(point, last) < STRAIGHT:
            step /= 2
            continue
        cycle = point.cycle
        if (cycle.slips[0] * last.cycle.slips[0].conj()).real.sum() < 0:  # through rest, to the mirror image
            if rests:
                end = min(
                    rests,
                    key=lambda candidate: abs(candidate.number - point.number) + abs(candidate.number - last.number),
                )
                reason = "critical speed"
                resting = balance.point_at_rest(end, cycle.slips[0])
                points.append(resting._replace(tangent=0 * resting.tangent))
            break
        if point.tangent[-1] * last.tangent[-1] < 0 and len(points) > 1:
            fold = point_ahead(scipy.optimize.brentq(turning, 0.0, step, xtol=1e-6))
            if fold is not None:
                points.append(fold)
                folds.append(fold.cycle)
        passes = (begin.number - last.number) * (begin.number - point.number) <= 0
        if len(points) > 4 and begin.cycle.slips.any() and passes:
            returned = balance.point_between(last, point, begin.number)
            if returned is not None and same(returned.cycle, begin.cycle):
                points.append(begin)
                reason = "closed"
                break
        points.append(point)
        reason = "range" if limit != goal else leaves(point) or "lost"
        if reason != "lost":
            break
        phase, step = balance.phase(cycle.slips), min(1.5 * step, LONGEST)
    return Branch(mode, critical, end and end.critical, reason, tuple(points), tuple(folds), balance)


def follow_both_ways(
    balance: Balance,
    begin: Point,
    leaves: Callable[[Point], str],
    mode: str,
    critical: CriticalSpeed,
    rests: Sequence[Rest] = (),
) -> Branch:
    """Follow a branch from a motion up and down in the number; of two ends the upper one is the branch's."""
    up = follow(balance, begin, leaves, mode, critical, rests)
    if up.reason == "closed":
        return up
    down = follow(balance, begin._replace(tangent=-begin.tangent), leaves, mode, critical, rests)
    if len(up.points) == 1:  # it begins at a limit of the number
        return down
    return replace(up, points=(*down.points[::-1], *up.points[1:]), folds=(*down.folds[::-1], *up.folds))
