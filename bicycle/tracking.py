"""Follow every eigenvalue continuously along speed, on a grid of its own that is refined where roots come close.

Consecutive speeds are matched by where the roots are heading (eigenvalues and their slopes from both sides) and by the
bi-orthogonal modal assurance criterion ``|u_i(a) x_j(b)| |u_j(b) x_i(a)|``; where the two disagree, a rival comes near
or real roots change their number or order, the step is halved. Real roots that meet leave as a pair: across the last,
tiny step sum and product of the two are continuous although eigenvectors are not, so they are matched as a set, the
larger real root with the upper half of the pair. What is asked at other speeds never changes the grid, hence an answer
does not depend on its neighbours.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from bicycle.linear_model import LinearModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

STEP = 0.1  # of the grid, in units of sqrt(g w): about 0.3 m/s
SMALLEST_STEP = 2.0**-22  # of STEP: below it a step is taken as the meeting point of two roots
BATCH = 1000  # matrices a call: they fit the cache
CLEAR = 0.2  # a match is clear when its error is below this share of the distance to any rival
TWIN = 1e-7  # roots closer than this share of the largest cannot be told apart, and need not be
MAC_ENOUGH = 0.5
REAL = 2e-8  # a pair with an imaginary part below this share of the largest root is a double real root and rounding
MAX_NODES = 20_000


@dataclass(frozen=True)
class Meeting:
    """Two real roots meet and leave as a pair (``merge``, as the speed grows) or come from one (``split``).

    ``branches`` are the two tracked branches, ``eigenvalue`` the double root (1/s).
    """

    speed: float
    kind: str
    branches: tuple[int, int]
    eigenvalue: float


@dataclass(frozen=True)
class Stretch:
    """Tracked roots within one speed range: nodes (m,), ``values`` and ``slopes`` (m, n), one column a branch.

    ``smooth`` (m - 1,) is False on the tiny steps across a meeting point.
    """

    speeds: Array
    values: Complex
    slopes: Complex
    smooth: NDArray[np.bool_]
    participation: Array  # (m, states, n): |left times right eigenvector|, columns sum to 1

    def follow(self, speeds: Array, eigenvalues: Complex) -> NDArray[np.intp]:
        """For speeds (k,) inside the stretch: which eigenvalue (k, n) belongs to each branch."""
        if len(self.speeds) == 1:
            return assign(np.abs(self.values[[0] * len(speeds), :, None] - eigenvalues[:, None, :]))
        at = np.clip(np.searchsorted(self.speeds, speeds, side="right") - 1, 0, len(self.speeds) - 2)
        a, b = at, at + 1
        h = (self.speeds[b] - self.speeds[a])[:, None]
        t = (speeds - self.speeds[a])[:, None] / h
        expected = (
            (1 + 2 * t) * (1 - t) ** 2 * self.values[a] + t**2 * (3 - 2 * t) * self.values[b]
            + h * t * (1 - t) * ((1 - t) * self.slopes[a] - t * self.slopes[b])
        )  # fmt: skip
        cost = np.abs(expected[:, :, None] - eigenvalues[:, None, :])
        rough = ~self.smooth[at]
        if rough.any():
            near = np.where(t[rough, 0] < 0.5, a[rough], b[rough])
            cost[rough] = _set_cost(self.values[near], eigenvalues[rough])
        return assign(cost)


def track(model: LinearModel, lowest: float, highest: float) -> tuple[tuple[Stretch, ...], tuple[Meeting, ...]]:
    """Track all roots from ``lowest`` to ``highest`` (model units, usually m/s); one stretch for each speed range.

    Columns of all stretches are the same branches: across a speed at which the equations switch, roots are matched by
    distance.
    """
    unit = float(np.sqrt(model.parameters["g"] * model.parameters["w"]))
    stretches: list[Stretch] = []
    meetings: list[Meeting] = []
    for piece, coefficients in zip(model.ranges, model.coefficients, strict=True):
        low, high = max(piece.lower, lowest), min(piece.upper, highest)
        if high < low or (stretches and high == low):
            continue
        nodes = grid(low, high, unit, singular=-1 in coefficients)
        nodes = np.unique(np.clip(nodes, piece.lower, piece.upper))
        stretch, met = _track_range(coefficients, nodes, unit * STEP * SMALLEST_STEP)
        if stretches:
            order = assign(_set_cost(stretches[-1].values[-1:], stretch.values[:1]))[0]
            rank = np.argsort(order)
            stretch = Stretch(
                stretch.speeds, stretch.values[:, order], stretch.slopes[:, order], stretch.smooth,
                stretch.participation[:, :, order],
            )  # fmt: skip
            met = [
                Meeting(m.speed, m.kind, (int(rank[m.branches[0]]), int(rank[m.branches[1]])), m.eigenvalue)
                for m in met
            ]
        stretches.append(stretch)
        meetings += met
    return tuple(stretches), tuple(meetings)


def grid(low: float, high: float, unit: float, *, singular: bool) -> Array:
    """Nodes of a fixed sequence that cover [low, high]: even steps, geometric towards 0 where the model is singular."""
    step = unit * STEP
    nodes = step * np.arange(max(np.floor(low / step), 0), np.ceil(high / step) + 1)
    if singular:
        nodes = nodes[nodes > 0]
        halvings = int(np.ceil(2 * max(np.log2(step / low), 0))) if low > 0 else 0
        nodes = np.concatenate([step * 2.0 ** (-np.arange(halvings, 0, -1) / 2), nodes])
    return nodes


def laurent(coefficients: Mapping[int, Array], speeds: Array, *, derivative: bool = False) -> Array:
    """Sum of v^k A_k (or its derivative in v) at speeds (m,), shape (m, rows, columns)."""
    total = np.zeros((len(speeds), *next(iter(coefficients.values())).shape))
    for power, matrix in coefficients.items():
        if not derivative:
            total += (speeds**power if power else np.ones_like(speeds))[:, None, None] * matrix
        elif power:
            total += (power * (speeds ** (power - 1) if power != 1 else np.ones_like(speeds)))[:, None, None] * matrix
    return total


@dataclass
class _Nodes:
    v: Array
    values: Complex
    slopes: Complex
    right: Complex
    left: Complex

    def take(self, index: NDArray[np.intp]) -> "_Nodes":
        return _Nodes(*(getattr(self, key)[index] for key in vars(self)))

    def insert(self, where: NDArray[np.intp], new: "_Nodes") -> "_Nodes":
        return _Nodes(*(np.insert(getattr(self, key), where, getattr(new, key), axis=0) for key in vars(self)))


def eigen(coefficients: Mapping[int, Array], speeds: Array) -> tuple[Complex, Complex, Complex, Complex]:
    """Eigenvalues (m, n), slopes d(lambda)/dv, right (columns) and left (rows) eigenvectors with left right = 1."""
    parts = []
    for v in np.array_split(speeds, max(1, -(-len(speeds) // BATCH))):
        values, right = np.linalg.eig(laurent(coefficients, v))
        left = _inverse(right)
        slopes = np.einsum("mij,mjk,mki->mi", left, laurent(coefficients, v, derivative=True), right, optimize=True)
        parts.append((settle(values), slopes.astype(complex), right.astype(complex), left.astype(complex)))
    values, slopes, right, left = (np.concatenate(part) for part in zip(*parts, strict=True))
    return values, slopes, right, left


def settle(values: Complex) -> Complex:
    """Make pairs real that are pairs by rounding only; values (m, n)."""
    noise = np.abs(values.imag) <= REAL * np.abs(values).max(1, keepdims=True)
    return np.where(noise, values.real, values).astype(complex)


def _inverse(matrices: Complex) -> Complex:
    try:
        return np.asarray(np.linalg.inv(matrices), complex)
    except np.linalg.LinAlgError:  # an exactly defective matrix among them
        return np.asarray(np.linalg.pinv(matrices), complex)


def _track_range(coefficients: Mapping[int, Array], speeds: Array, smallest: float) -> tuple[Stretch, list[Meeting]]:
    nodes = _Nodes(speeds, *eigen(coefficients, speeds))
    n = nodes.values.shape[1]
    links = np.zeros((len(speeds) - 1, n), np.intp)
    done = np.zeros(len(speeds) - 1, bool)
    smooth = done.copy()
    while not done.all():
        open_ = np.flatnonzero(~done)
        a, b = nodes.take(open_), nodes.take(open_ + 1)
        links[open_], good = _link(a, b)
        smooth[open_] = done[open_] = good
        last = open_[~good & ((b.v - a.v <= smallest) | (len(nodes.v) > MAX_NODES))]
        links[last] = assign(_set_cost(nodes.values[last], nodes.values[last + 1]))
        done[last] = True
        split = np.flatnonzero(~done)
        if split.size:
            middle = (nodes.v[split] + nodes.v[split + 1]) / 2
            nodes = nodes.insert(split + 1, _Nodes(middle, *eigen(coefficients, middle)))
            links = np.insert(links, split, 0, axis=0)
            done, smooth = np.insert(done, split, False), np.insert(smooth, split, False)
    return _in_branches(nodes, links, smooth)


def _link(a: _Nodes, b: _Nodes) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Match neighbouring nodes; says where the match is beyond doubt."""
    half = (b.v - a.v)[:, None] / 2
    cost = np.abs((a.values + half * a.slopes)[:, :, None] - (b.values - half * b.slopes)[:, None, :])
    size = np.maximum(np.abs(a.values).max(1), np.abs(b.values).max(1))[:, None]
    cost = np.minimum(np.nan_to_num(cost, nan=np.inf), 1e3 * size[:, :, None])
    kind_a, kind_b = np.sign(a.values.imag), np.sign(b.values.imag)
    allowed = kind_a[:, :, None] == kind_b[:, None, :]
    link = assign(np.where(allowed, cost, 1e6 * size[:, :, None] + cost))
    error = np.take_along_axis(cost, link[:, :, None], 2)[..., 0]
    landed = np.take_along_axis(b.values, link, 1)
    twin = np.abs(landed[:, :, None] - b.values[:, None, :]) <= TWIN * size[:, :, None]
    rival = np.where(twin, np.inf, cost).min(2)
    good = (error < CLEAR * rival).all(1) & np.take_along_axis(allowed, link[:, :, None], 2).all((1, 2))
    mac = np.abs(a.left @ b.right) * np.abs(b.left @ a.right).swapaxes(1, 2)
    good &= ((np.take_along_axis(mac, link[:, :, None], 2)[..., 0] > MAC_ENOUGH) | (twin.sum(2) > 1)).all(1)
    order = np.argsort(np.where(kind_a == 0, a.values.real, np.inf), axis=1)
    real = np.where(np.take_along_axis(kind_a, order, 1) == 0, np.take_along_axis(landed.real, order, 1), np.inf)
    with np.errstate(invalid="ignore"):  # inf - inf beyond the last real root
        good &= ~(np.diff(real) < -TWIN * size).any(1)
    return link, good


def _set_cost(a: Complex, b: Complex) -> Array:
    """Squared distance, with a light hand that leads the larger of two real roots to the upper half of a pair."""
    rank_a, rank_b = a.real + a.imag, b.real + b.imag
    return np.abs(a[:, :, None] - b[:, None, :]) ** 2 + 1e-3 * (rank_a[:, :, None] - rank_b[:, None, :]) ** 2


def assign(cost: Array) -> NDArray[np.intp]:
    """Cheapest one-to-one match, cost (k, n, n) -> column of each row (k, n)."""
    match = cost.argmin(2)
    for row in np.flatnonzero((np.sort(match) != np.arange(match.shape[1])).any(1)):
        match[row] = linear_sum_assignment(cost[row])[1]
    return match


def _in_branches(nodes: _Nodes, links: NDArray[np.intp], smooth: NDArray[np.bool_]) -> tuple[Stretch, list[Meeting]]:
    n = nodes.values.shape[1]
    order = np.empty((len(nodes.v), n), np.intp)
    order[0] = np.lexsort((nodes.values[0].imag, nodes.values[0].real))
    for step, link in enumerate(links):
        order[step + 1] = link[order[step]]
    values, slopes = (np.take_along_axis(x, order, 1) for x in (nodes.values, nodes.slopes))
    share = np.abs(nodes.right * nodes.left.swapaxes(1, 2))
    share = np.take_along_axis(share, order[:, None, :], 2)
    share /= share.sum(1, keepdims=True)
    meetings = []
    for k in np.flatnonzero(~smooth):
        meetings += _meetings(nodes.v[k : k + 2], values[k : k + 2])
    return Stretch(nodes.v, values, slopes, smooth, share), meetings


def _meetings(v: Array, values: Complex) -> list[Meeting]:
    """Real roots that became a pair, or the reverse, between two nodes (the discriminant is linear there)."""
    real = values.imag == 0
    found = []
    for kind, lone, pair in (("merge", 0, 1), ("split", 1, 0)):
        changed = list(np.flatnonzero(real[lone] & ~real[pair]))
        while changed:
            i = changed.pop(0)
            partner = [j for j in changed if values[pair, j] == values[pair, i].conj()]
            if not partner:
                continue
            j = partner[0]
            changed.remove(j)
            d = ((values[:, i] - values[:, j]) ** 2).real
            t = d[0] / (d[0] - d[1])
            middle = ((values[:, i] + values[:, j]) / 2).real
            speed, root = v[0] + t * (v[1] - v[0]), middle[0] + t * (middle[1] - middle[0])
            found.append(Meeting(float(speed), kind, (int(i), int(j)), float(root)))
    return found
