"""A boundary of a chart: points at which one root lies on the imaginary axis, in order along the curve."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.chart.plane import Look, Plane
from tyre.ground.arrays import Array, Complex

# ends of a curve: at the edge of the chart, in itself, where the frequency of a pair becomes zero, or unknown
EDGE, CLOSED, DOUBLE_ZERO, LOST = "edge", "closed", "double zero", "lost"


@dataclass(frozen=True, eq=False)
class Boundary:
    """A curve on which a root lies on the imaginary axis."""

    shares: Array  # (m, 2), shares of the two axes, 0 to 1
    roots: Complex  # (m,), 1/s, on the imaginary axis
    gradients: Complex  # (m, 2), 1/s, derivatives of the root with the shares
    sizes: Array  # (m,), 1/s, modulus of the largest root, to which rounding is relative
    real: bool  # True: a root crosses at zero; False: a pair
    ends: tuple[str, str]  # EDGE, CLOSED, DOUBLE_ZERO or LOST, of the first and the last point

    def __len__(self) -> int:
        return len(self.shares)

    @property
    def closed(self) -> bool:
        """True if it comes back to its beginning."""
        return self.ends[0] == CLOSED

    @property
    def step(self) -> int:
        """Difference of the number of unstable roots between the two sides."""
        return 1 if self.real else 2

    @property
    def normals(self) -> Array:
        """Unit vectors (m, 2), in shares of the axes, towards where the root is unstable."""
        uphill = self.gradients.real
        return np.asarray(uphill / np.maximum(np.hypot(*uphill.T), 1e-300)[:, None])

    @property
    def segments(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Begin and end (k, 2), shares, of every piece between points, and True (k,) if its left side is unstable."""
        end = np.roll(self.shares, -1, 0) if self.closed else self.shares[1:]
        begin = self.shares[: len(end)]
        piece = end - begin
        normal = self.normals[: len(end)] + np.roll(self.normals, -1, 0)[: len(end)]
        return begin, end, (-piece[:, 1] * normal[:, 0] + piece[:, 0] * normal[:, 1]) > 0

    def distance(self, point: Array) -> tuple[float, int]:
        """Distance of a ``point`` (2,), in shares of the axes, and the number of the nearest piece."""
        if len(self) == 1:
            return float(np.hypot(*(self.shares[0] - point))), 0
        begin, end, _ = self.segments
        piece = end - begin
        t = np.clip(((point - begin) * piece).sum(1) / np.maximum((piece**2).sum(1), 1e-300), 0.0, 1.0)
        distance = np.hypot(*(begin + t[:, None] * piece - point).T)
        return float(distance.min()), int(distance.argmin())

    def passes(self, point: Array, root: complex, normal: Array, within: float) -> bool:
        """True if a critical point (2,) with its root and unit vector (2,) towards instability lies on this curve."""
        distance, k = self.distance(point)
        if distance > within:
            return False
        piece = [k, min(k + 1, len(self) - 1)]
        omega = np.sort(np.abs(self.roots[piece].imag))
        room = 0.05 * (omega[1] + abs(root.imag)) + 1e-6 * self.sizes[k] + (omega[1] - omega[0])
        return bool((omega[0] - room <= abs(root.imag) <= omega[1] + room) and max(self.normals[piece] @ normal) > 0)


class AxisRoot(NamedTuple):
    """The root that crosses the axis near m points."""

    root: Complex  # (m,), 1/s
    gradient: Complex  # (m, 2), 1/s, derivatives of the root with the shares
    height: Array  # (m,), what must vanish: real part in 1/s, of a real root the smallest singular value of the matrix
    uphill: Array  # (m, 2), derivatives of ``height`` with the shares
    size: Array  # (m,), 1/s, modulus of the largest root
    rival: Array  # (m,), 1/s, distance to the nearest other root


def axis_root(look: Look, expected: Complex, real: NDArray[np.bool_]) -> AxisRoot:
    """Pick at each of m points the root nearest to ``expected`` (m,), 1/s; where ``real`` the one nearest to zero."""
    values = look.values
    row = np.arange(len(values))
    target = np.where(real, 0.0, expected)
    distance = np.abs(values - target[:, None])
    distance = np.where(~real[:, None] & (values.imag <= 0), np.inf, distance)
    nearest = np.where(np.isinf(distance).all(1), np.abs(values - target[:, None]).argmin(1), distance.argmin(1))
    root, gradient = values[row, nearest], look.gradients[row, nearest]
    separation = np.abs(values - root[:, None])
    separation[row, nearest] = np.inf
    height = root.real.copy()
    uphill = gradient.real.copy()
    k = np.flatnonzero(real)
    if k.size:
        left, size, right = np.linalg.svd(look.matrices[k])
        u, x = left[:, :, -1], right[:, -1]
        height[k] = size[:, -1]
        uphill[k] = np.einsum("mi,maij,mj->ma", u, look.slopes[k], x)
        joint = (u * x).sum(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            root[k], gradient[k] = size[:, -1] / joint, uphill[k] / joint[:, None]
    return AxisRoot(root, gradient, height, uphill, np.abs(values).max(1), separation.min(1))


class Sharp(NamedTuple):
    """Points (m, 2) on the axis, what crosses there, and which of them Newton reached."""

    shares: Array  # (m, 2), shares of the two axes, 0 to 1
    at: AxisRoot  # what crosses there
    reached: NDArray[np.bool_]  # (m,), False: no such root on the axis near here


def sharpen(
    plane: Plane,
    shares: Array,
    expected: Complex,
    real: NDArray[np.bool_],
    *,
    longest: float,
    fixed: NDArray[np.bool_] | None = None,
) -> Sharp:
    """Move points (m, 2) by Newton to where the root near ``expected`` (m,), 1/s, lies on the imaginary axis.

    No step is longer than ``longest``; coordinates that are ``fixed`` (m, 2) stay; all in shares of the axes.
    """
    u = shares.copy()
    root = expected.astype(complex)
    free = np.ones_like(u) if fixed is None else (~fixed).astype(float)
    moving = np.arange(len(u))
    for _ in range(12):
        at = axis_root(plane.look(u[moving]), root[moving], real[moving])
        uphill = at.uphill * free[moving]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = -at.height[:, None] * uphill / (uphill**2).sum(1, keepdims=True)
        step = np.where(np.isfinite(step), step, 0.0)
        step *= np.minimum(1.0, longest / np.maximum(np.hypot(*step.T), 1e-300))[:, None]
        moved = np.clip(u[moving] + step, 0.0, 1.0)
        change, u[moving] = moved - u[moving], moved
        root[moving] = at.root + (at.gradient * change).sum(1)
        moving = moving[np.hypot(*change.T) > 1e-13]  # of the range: a step below this is rounding
        if not moving.size:
            break
    at = axis_root(plane.look(u), root, real)
    steep = np.hypot(*(at.uphill * free).T)
    with np.errstate(divide="ignore", invalid="ignore"):
        remaining = np.abs(at.height) / steep
    return Sharp(u, at, (real | (at.root.imag > 0)) & (remaining < 1e-9) & (np.abs(at.root.real) < 1e-9 * at.size))


SMALLEST = 1e-7  # of the range
SLOW = 1e-3  # of sqrt(g/w) about 3 1/s: a pair slower than this is about to become real
STRIDES = (4, 1)  # steps that a walk takes at once, the points between sharpened together; where that fails, one by one


@dataclass(frozen=True)
class Seed:
    """A point (2,) of a boundary in shares of the axes, its root (1/s), whether real, and the root's gradient (2,)."""

    shares: Array  # (2,), 0 to 1
    root: complex  # 1/s
    real: bool  # True: a root crosses at zero; False: a pair
    gradient: Array  # (2,), 1/s, derivatives of the root with the shares

    @property
    def normal(self) -> Array:
        """Unit vector (2,), in shares of the axes, towards where the root is unstable."""
        uphill = self.gradient.real
        return np.asarray(uphill / max(float(np.hypot(*uphill)), 1e-300))


@dataclass
class _Walker:
    plane: Plane  # the two axes
    seed: Seed  # where both ways begin
    step: float  # length of a step in shares of the axes
    slow: float  # 1/s, a pair slower than this is about to become real

    def walk(self, way: float) -> tuple[list[Array], list[complex], str]:
        """Follow the boundary from the seed one ``way`` (1 or -1): points (2,), roots (1/s) and how it ends."""
        u, root, gradient = self.seed.shares, complex(self.seed.root), self.seed.gradient
        normal = self.seed.normal
        first = tangent = way * np.array([-normal[1], normal[0]])
        points: list[Array] = []
        roots: list[complex] = []
        h = self.step
        while len(points) < 20_000:
            # a step in which the square of the frequency, which falls evenly towards zero, does not fall too far
            fall = 0.0 if self.seed.real else -2 * root.imag * float((gradient @ tangent).imag)
            falling = 0.5 * root.imag**2 / fall if fall > 0 else np.inf
            if falling < SMALLEST or (not self.seed.real and abs(root.imag) < self.slow):
                return points, roots, DOUBLE_ZERO
            h = min(h, falling)
            if h < SMALLEST:
                return points, roots, LOST
            reach, leaves = _limit_step(u, tangent, h)
            if leaves and reach < SMALLEST:
                return points, roots, EDGE
            predicted, expected = u + reach * tangent, root + complex(gradient @ (reach * tangent))
            at = self._look(predicted, expected)
            direction = self._direction(at, way, tangent)
            move = _newton(at)
            sure = self.seed.real or abs(complex(at.root[0]) - expected) < 0.5 * float(at.rival[0])
            # the tangent may turn by 0.25 rad; a corrector that moves farther than 0.2 of the step came from too far
            if not (np.hypot(*move) <= 0.2 * reach + 1e-12 and direction @ tangent > np.cos(0.25) and sure):
                h = min(h, reach) / 2
                if h < self.step / 16:  # where the curve bends, one step of Newton leaves a point beside it
                    u = np.clip(u + _newton(self._look(u, root)), 0.0, 1.0)
                    sharpened = self._look(u, root)
                    turned = self._direction(sharpened, way, tangent)
                    if turned @ tangent > 0:
                        tangent, gradient, root = turned, sharpened.gradient[0], complex(sharpened.root[0])
                continue
            corrected = predicted + move
            if leaves or ((corrected < 0) | (corrected > 1)).any():
                edge_point = self._at_edge(u, predicted, corrected, complex(at.root[0]))
                if edge_point is None:
                    h = min(h, reach) / 2
                    continue
                return [*points, edge_point[0]], [*roots, edge_point[1]], EDGE
            if len(points) >= 3 and self._back(u, corrected, first, direction, complex(at.root[0])):
                return points, roots, CLOSED
            tangent, gradient = direction, at.gradient[0]
            u, root = corrected, complex(at.root[0] + gradient @ move)
            points.append(u)
            roots.append(root)
            h = min(self.step, 1.5 * h)
        return points, roots, LOST

    def _direction(self, at: AxisRoot, way: float, before: Array) -> Array:
        """Find the unit tangent (2,) there, ``way`` round; of a real root turned so that it goes on as ``before``."""
        uphill = at.uphill[0]
        tangent = way * np.array([-uphill[1], uphill[0]]) / max(float(np.hypot(*uphill)), 1e-300)
        return -tangent if self.seed.real and tangent @ before < 0 else tangent

    def _look(self, u: Array, expected: complex) -> AxisRoot:
        """Compute the root (1/s) nearest to ``expected`` at one point (2,), shares of the axes."""
        return axis_root(self.plane.look(u[None]), np.array([expected]), np.array([self.seed.real]))

    def _at_edge(self, u: Array, ahead: Array, target: Array, root: complex) -> tuple[Array, complex] | None:
        """Find where the way from ``u`` leaves the chart: point (2,) and root (1/s); None if no such root is there."""
        way = target - u
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(way > 0, (1 - u) / way, np.where(way < 0, -u / way, np.inf))
        k = int(share.argmin())
        start = np.clip(u + min(float(share[k]), 1.0) * way, 0.0, 1.0)
        start[k] = 1.0 if way[k] > 0 else 0.0
        fixed = np.array([[k == 0, k == 1]])
        sharp = sharpen(
            self.plane, start[None], np.array([root]), np.array([self.seed.real]), longest=self.step, fixed=fixed
        )
        close = np.hypot(*(sharp.shares[0] - start)) <= self.step
        return (sharp.shares[0], complex(sharp.at.root[0])) if sharp.reached[0] and close else None

    def _back(self, u: Array, end: Array, first: Array, direction: Array, root: complex) -> bool:
        """True if the step from ``u`` to ``now`` passes the seed again, the same way and with the same root."""
        step, start = end - u, self.seed.shares
        t = float((start - u) @ step) / max(float(step @ step), 1e-300)
        if not -0.25 <= t <= 1.25 or direction @ first < 0.7:
            return False
        distance = np.hypot(*(u + t * step - start))
        alike = abs(root.imag - self.seed.root.imag) <= 0.05 * abs(self.seed.root.imag) + self.slow
        return bool(distance < 0.25 * max(float(np.hypot(*step)), SMALLEST) and (self.seed.real or alike))


def _newton(at: AxisRoot) -> Array:
    """Compute the step (2,), in shares, to where the root of the first point lies on the axis."""
    uphill = at.uphill[0]
    return np.asarray(-float(at.height[0]) * uphill / max(float(np.hypot(*uphill)), 1e-300) ** 2)


def _limit_step(u: Array, tangent: Array, h: float) -> tuple[float, bool]:
    """Limit a step of length ``h`` to the chart: its length, and True if that is shorter."""
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(tangent > 0, (1 - u) / tangent, np.where(tangent < 0, -u / tangent, np.inf))
    reach = max(float(room.min()), 0.0)
    return (reach, True) if reach < h else (h, False)


def trace(plane: Plane, seed: Seed, *, step: float, slow: float) -> Boundary:
    """Trace the whole boundary through a seed in steps of at most ``step``; a pair below ``slow`` (1/s) ends it."""
    for strides in STRIDES:
        shares, roots, ends = _walk_both_ways(_Walker(plane, seed, strides * step, slow), step)
        sharp = _sharpen_on_edges(plane, shares, roots, seed, step)
        good = sharp.reached & (np.hypot(*(sharp.shares - shares).T) <= 0.5 * step)
        if good.all() and LOST not in ends:
            break
    ends = (ends[0] if good[0] else LOST, ends[1] if good[-1] else LOST)
    if seed.real:
        turns = _add_turns(plane, sharp.shares[good], sharp.at.gradient[good].real, seed, step)
        if len(turns) > good.sum():
            sharp = _sharpen_on_edges(plane, turns, np.zeros(len(turns), complex), seed, step)
            good = sharp.reached
    at = sharp.at
    return Boundary(sharp.shares[good], at.root[good], at.gradient[good], at.size[good], seed.real, ends)


def _walk_both_ways(walker: _Walker, step: float) -> tuple[Array, Complex, tuple[str, str]]:
    """Walk both ways from a seed: points (m, 2) at most ``step`` apart, roots (m,), and the two ends."""
    seed = walker.seed
    forward, roots_forward, end = walker.walk(1.0)
    backward, roots_backward, begin = walker.walk(-1.0) if end != CLOSED else ([], [], end)
    shares = np.array([*backward[::-1], seed.shares, *forward])
    roots = np.array([*roots_backward[::-1], seed.root, *roots_forward])
    return *_fill_between(shares, roots, step, closed=end == CLOSED), (begin, end)


def _sharpen_on_edges(plane: Plane, shares: Array, roots: Complex, seed: Seed, step: float) -> Sharp:
    """Sharpen points (m, 2) of the seed's boundary; those on an edge of the chart move along it."""
    fixed = (shares <= 0) | (shares >= 1)
    fixed[fixed.all(1)] = False
    return sharpen(plane, shares, roots, np.full(len(shares), seed.real), longest=step, fixed=fixed)


def _fill_between(shares: Array, roots: Complex, step: float, *, closed: bool) -> tuple[Array, Complex]:
    """Add points and roots between those given, evenly along the chords and at most ``step`` apart."""
    if closed:
        shares, roots = np.vstack([shares, shares[:1]]), np.r_[roots, roots[:1]]
    length = np.hypot(*np.diff(shares, axis=0).T)
    pieces = np.maximum(np.ceil(length / step * (1 - 1e-9)).astype(int), 1)
    at = np.concatenate([k + np.arange(n) / n for k, n in enumerate(pieces)] + [[len(length)]])
    at = at[:-1] if closed else at
    place = np.arange(len(shares))
    filled = np.stack([np.interp(at, place, column) for column in shares.T], -1)
    return filled, np.interp(at, place, roots.real) + 1j * np.interp(at, place, roots.imag)


def _add_turns(plane: Plane, shares: Array, uphill: Array, seed: Seed, step: float) -> Array:
    """Add two points, close to each other, wherever a second root becomes zero and the unstable side changes."""
    points: list[Array] = [shares[0]]
    for k in range(len(shares) - 1):
        a, b, before = shares[k], shares[k + 1], uphill[k]
        if before @ uphill[k + 1] < 0:
            # of the range: how sharply it is located where the unstable side of a real root changes
            while np.hypot(*(b - a)) > 1e-5:
                middle = _sharpen_on_edges(plane, (a + b)[None] / 2, np.zeros(1, complex), seed, step)
                point = middle.shares[0]
                if not min(np.hypot(*(point - a)), np.hypot(*(point - b))) < np.hypot(*(b - a)):
                    break
                a, b = (point, b) if middle.at.gradient[0].real @ before > 0 else (a, point)
            points += [end for end in (a, b) if end is not shares[k] and end is not shares[k + 1]]
        points.append(shares[k + 1])
    return np.array(points)
