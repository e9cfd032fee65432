"""Following a boundary through the chart: predictor along the tangent, corrector across it, whatever way it turns.

The arc length is the parameter, so that folds are passed (Keller 1977). One corrector step is taken at each point of a
walk in long strides; points are filled in, and all are sharpened together.
"""

from dataclasses import dataclass

import numpy as np

from studies.stability_charts.axis_root import AxisRoot, Sharp, axis_root, sharpened
from studies.stability_charts.boundary import CLOSED, DOUBLE_ZERO, EDGE, LOST, Boundary
from studies.stability_charts.plane import Plane
from tyre.base.arrays import Array, Complex

SMALLEST = 1e-7  # of the range
TURN = 0.25  # rad that the tangent may turn in a step
ACROSS = 0.2  # of the step: a corrector that moves farther came from too far
HALVES = 0.5  # to which the square of a frequency may fall in a step
SLOW = 1e-3  # of sqrt(g/w) about 3 1/s: a pair slower than this is about to become real
TURNED = 1e-5  # of the range: how sharply it is told where the unstable side of a real root changes
STRIDES = (4, 1)  # steps that a walk takes at once, the points between sharpened together; where that fails, one by one
MOST_POINTS = 20_000


@dataclass(frozen=True)
class Seed:
    """A point (2,) of a boundary in shares of the axes, its root (1/s), whether real, and the root's gradient (2,)."""

    shares: Array
    root: complex
    real: bool
    gradient: Array

    @property
    def normal(self) -> Array:
        """Unit vector (2,), in shares of the axes, towards where the root is unstable."""
        uphill = self.gradient.real
        return np.asarray(uphill / max(float(np.hypot(*uphill)), 1e-300))


@dataclass
class _Walker:
    plane: Plane
    seed: Seed
    step: float
    slow: float

    def walk(self, way: float) -> tuple[list[Array], list[complex], str]:
        """Points and roots from the seed on, without it, and how the way ends."""
        u, root, gradient = self.seed.shares, complex(self.seed.root), self.seed.gradient
        normal = self.seed.normal
        first = tangent = way * np.array([-normal[1], normal[0]])
        points: list[Array] = []
        roots: list[complex] = []
        h = self.step
        while len(points) < MOST_POINTS:
            falling = self._frequency_limit(root, gradient, tangent)
            if falling < SMALLEST or (not self.seed.real and abs(root.imag) < self.slow):
                return points, roots, DOUBLE_ZERO
            h = min(h, falling)
            if h < SMALLEST:
                return points, roots, LOST
            reach, leaves = _within(u, tangent, h)
            if leaves and reach < SMALLEST:
                return points, roots, EDGE
            ahead = u + reach * tangent
            at = self._look(ahead, root + complex(gradient @ (reach * tangent)))
            uphill = at.uphill[0]
            steep = float(np.hypot(*uphill))
            move = -float(at.height[0]) * uphill / max(steep, 1e-300) ** 2
            direction = np.array([-uphill[1], uphill[0]]) / max(steep, 1e-300)
            direction = direction if direction @ tangent > 0 else -direction
            jump = abs(complex(at.root[0]) - root - complex(gradient @ (reach * tangent)))
            sure = self.seed.real or jump < 0.5 * float(at.rival[0])
            if not (np.hypot(*move) <= ACROSS * reach + 1e-12 and direction @ tangent > np.cos(TURN) and sure):
                h = min(h, reach) / 2
                continue
            now = ahead + move
            if leaves or ((now < 0) | (now > 1)).any():
                found = self._at_edge(u, ahead, now, complex(at.root[0]))
                if found is None:
                    h = min(h, reach) / 2
                    continue
                points.append(found[0])
                roots.append(found[1])
                return points, roots, EDGE
            if len(points) >= 3 and self._back(u, now, first, direction, complex(at.root[0])):
                return points, roots, CLOSED
            tangent, gradient = direction, at.gradient[0]
            u, root = now, complex(at.root[0] + gradient @ move)
            points.append(u)
            roots.append(root)
            h = min(self.step, 1.5 * h)
        return points, roots, LOST

    def _look(self, u: Array, expected: complex) -> AxisRoot:
        return axis_root(self.plane.look(u[None]), np.array([expected]), np.array([self.seed.real]))

    def _frequency_limit(self, root: complex, gradient: Array, tangent: Array) -> float:
        """A step in which the square of the frequency, which falls evenly towards zero, does not fall too far."""
        fall = 0.0 if self.seed.real else -2 * root.imag * float((gradient @ tangent).imag)
        return (1 - HALVES) * root.imag**2 / fall if fall > 0 else np.inf

    def _at_edge(self, u: Array, ahead: Array, now: Array, root: complex) -> tuple[Array, complex] | None:
        """The point at which the way from ``u`` leaves the chart."""
        way = now - u
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(way > 0, (1 - u) / way, np.where(way < 0, -u / way, np.inf))
        k = int(share.argmin())
        start = np.clip(u + min(float(share[k]), 1.0) * way, 0.0, 1.0)
        start[k] = 1.0 if way[k] > 0 else 0.0
        held = np.array([[k == 0, k == 1]])
        found = sharpened(
            self.plane, start[None], np.array([root]), np.array([self.seed.real]), longest=self.step, held=held
        )
        near = np.hypot(*(found.shares[0] - start)) <= self.step
        return (found.shares[0], complex(found.at.root[0])) if found.reached[0] and near else None

    def _back(self, u: Array, now: Array, first: Array, direction: Array, root: complex) -> bool:
        """Whether the step from ``u`` to ``now`` passes the seed again, the same way and with the same root."""
        along, start = now - u, self.seed.shares
        t = float((start - u) @ along) / max(float(along @ along), 1e-300)
        if not -0.25 <= t <= 1.25 or direction @ first < 0.7:
            return False
        away = np.hypot(*(u + t * along - start))
        alike = abs(root.imag - self.seed.root.imag) <= 0.05 * abs(self.seed.root.imag) + self.slow
        return bool(away < 0.25 * max(float(np.hypot(*along)), SMALLEST) and (self.seed.real or alike))


def _within(u: Array, tangent: Array, h: float) -> tuple[float, bool]:
    """How far a step may go without leaving the chart, and whether that is short of ``h``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(tangent > 0, (1 - u) / tangent, np.where(tangent < 0, -u / tangent, np.inf))
    reach = max(float(room.min()), 0.0)
    return (reach, True) if reach < h else (h, False)


def trace(plane: Plane, seed: Seed, *, step: float, slow: float) -> Boundary:
    """The whole boundary through a point of it.

    Parameters
    ----------
    plane : Plane
    seed : Seed
    step : float
        Longest step, as a share of the axes.
    slow : float
        Frequency (rad/s) below which a pair is about to become real.
    """
    for strides in STRIDES:
        shares, roots, ends = _walked(_Walker(plane, seed, strides * step, slow), step)
        sharp = _sharp(plane, shares, roots, seed, step)
        good = sharp.reached & (np.hypot(*(sharp.shares - shares).T) <= 0.5 * step)
        if good.all() and LOST not in ends:
            break
    ends = (ends[0] if good[0] else LOST, ends[1] if good[-1] else LOST)
    if seed.real:
        turns = _turns(plane, sharp.shares[good], sharp.at.gradient[good].real, seed, step)
        if len(turns) > good.sum():
            sharp = _sharp(plane, turns, np.zeros(len(turns), complex), seed, step)
            good = sharp.reached
    at = sharp.at
    return Boundary(sharp.shares[good], at.root[good], at.gradient[good], at.size[good], seed.real, ends)


def _walked(walker: _Walker, step: float) -> tuple[Array, Complex, tuple[str, str]]:
    """Points and roots of the way to both sides, in steps of at most ``step``, and how it ends."""
    seed = walker.seed
    ahead, roots_ahead, end = walker.walk(1.0)
    behind: list[Array] = []
    roots_behind: list[complex] = []
    begin = end
    if end != CLOSED:
        behind, roots_behind, begin = walker.walk(-1.0)
    shares = np.array([*behind[::-1], seed.shares, *ahead])
    roots = np.array([*roots_behind[::-1], seed.root, *roots_ahead])
    return *_filled(shares, roots, step, closed=end == CLOSED), (begin, end)


def _sharp(plane: Plane, shares: Array, roots: Complex, seed: Seed, step: float) -> Sharp:
    held = (shares <= 0) | (shares >= 1)
    held[held.all(1)] = False
    return sharpened(plane, shares, roots, np.full(len(shares), seed.real), longest=step, held=held)


def _filled(shares: Array, roots: Complex, step: float, *, closed: bool) -> tuple[Array, Complex]:
    """Points and roots with others between, in even steps along the chords."""
    if closed:
        shares, roots = np.vstack([shares, shares[:1]]), np.r_[roots, roots[:1]]
    length = np.hypot(*np.diff(shares, axis=0).T)
    pieces = np.maximum(np.ceil(length / step * (1 - 1e-9)).astype(int), 1)
    at = np.concatenate([k + np.arange(n) / n for k, n in enumerate(pieces)] + [[len(length)]])
    at = at[:-1] if closed else at
    place = np.arange(len(shares))
    found = np.stack([np.interp(at, place, column) for column in shares.T], -1)
    return found, np.interp(at, place, roots.real) + 1j * np.interp(at, place, roots.imag)


def _turns(plane: Plane, shares: Array, uphill: Array, seed: Seed, step: float) -> Array:
    """Points with two more, close to each other, wherever a second root becomes zero and the unstable side changes."""
    points: list[Array] = [shares[0]]
    for k in range(len(shares) - 1):
        a, b, before = shares[k], shares[k + 1], uphill[k]
        if before @ uphill[k + 1] < 0:
            while np.hypot(*(b - a)) > TURNED:
                middle = _sharp(plane, (a + b)[None] / 2, np.zeros(1, complex), seed, step)
                point = middle.shares[0]
                if not min(np.hypot(*(point - a)), np.hypot(*(point - b))) < np.hypot(*(b - a)):
                    break
                a, b = (point, b) if middle.at.gradient[0].real @ before > 0 else (a, point)
            points += [one for one in (a, b) if one is not shares[k] and one is not shares[k + 1]]
        points.append(shares[k + 1])
    return np.array(points)
