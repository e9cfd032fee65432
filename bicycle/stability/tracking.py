"""Follow every eigenvalue along the speed or another number, in steps that are halved until each match is clear.

Roots of neighbours are matched by where they are heading (eigenvalues and slopes from both sides) and by the
bi-orthogonal modal assurance criterion |u_i(a) x_j(b)| |u_j(b) x_i(a)|. Real roots that meet leave as a pair: across
the last, tiny step sum and product of the two are continuous although eigenvectors are not, so they are matched as a
set.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from bicycle.model.eigen import eigensystem_with_slopes
from tyre.ground.arrays import Array, Complex

CLEAR = 0.2  # a match is clear when its error is below this share of the distance to any rival
TWIN = 1e-7  # roots closer than this share of the largest cannot be told apart, and need not be
MAX_NODES = 20_000


@dataclass
class Nodes:
    """Eigenvalues and their slopes (m, n) at ``v`` (m,), right (columns) and left (rows) eigenvectors (m, n, n)."""

    v: Array  # (m,), m/s or what else the roots are followed over
    values: Complex  # (m, n), 1/s
    slopes: Complex  # (m, n), 1/s per unit of ``v``
    right: Complex  # (m, n, n), columns
    left: Complex  # (m, n, n), rows

    def take(self, index: NDArray[np.intp]) -> Self:
        """Take the nodes at the places ``index`` (k,)."""
        return type(self)(*(part[index] for part in vars(self).values()))

    def join(self, new: Self) -> tuple[Self, NDArray[np.intp]]:
        """Join these and the ``new`` nodes in order of ``v``; also the places of the old ones among them."""
        order = np.argsort(np.concatenate([self.v, new.v]), kind="stable")
        places = np.empty_like(order)
        places[order] = np.arange(len(order))
        pairs = zip(vars(self).values(), vars(new).values(), strict=True)
        return type(self)(*(np.concatenate(parts)[order] for parts in pairs)), places[: len(self.v)]


@dataclass(frozen=True)
class Branches:
    """Followed roots: nodes ``v`` (m,), ``values`` (m, n), one column a branch; ``order`` (m, n) of the roots in
    these."""

    v: Array  # (m,), m/s or what else the roots are followed over
    values: Complex  # (m, n), 1/s
    order: NDArray[np.intp]  # (m, n), place of each branch's root among those of the node
    smooth: NDArray[np.bool_]  # (m - 1,), steps over which each root clearly follows one; else they are matched as sets


class Meeting(NamedTuple):
    """Two real roots meet and leave as a pair (``merge``, as the number grows) or come from one (``split``)."""

    at: float  # m/s or what else the roots are followed over
    kind: str  # merge or split
    branches: tuple[int, int]  # numbers of the two
    value: float  # 1/s, the double root
    step: int  # from node ``step`` to the next


class BranchCrossing(NamedTuple):
    """Branch number ``branch`` crosses the imaginary axis at ``value`` with the root ``root`` (1/s)."""

    branch: int  # column of the eigenvalues
    value: float  # of the number that is varied
    root: complex  # 1/s, the upper half of a pair
    destabilising: bool  # its real part grows with the number


def link(a: Nodes, b: Nodes) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Match k nodes ``a`` with their neighbours ``b``: which root follows which (k, n), and if that is clear (k,)."""
    half = (b.v - a.v)[:, None] / 2
    cost = np.abs((a.values + half * a.slopes)[:, :, None] - (b.values - half * b.slopes)[:, None, :])
    size = np.maximum(np.abs(a.values).max(1), np.abs(b.values).max(1))[:, None]
    cost = np.fmin(cost, 1e3 * size[:, :, None])
    kind_a, kind_b = np.sign(a.values.imag), np.sign(b.values.imag)
    allowed = kind_a[:, :, None] == kind_b[:, None, :]
    match = assign(np.where(allowed, cost, 1e6 * size[:, :, None] + cost))
    row = np.arange(len(match))[:, None]
    column = np.arange(match.shape[1])
    landed = b.values[row, match]
    twin = np.abs(landed[:, :, None] - b.values[:, None, :]) <= TWIN * size[:, :, None]
    rival = np.where(twin, np.inf, cost).min(2)
    good = (cost[row, column, match] < CLEAR * rival).all(1) & allowed[row, column, match].all(1)
    order = np.argsort(np.where(kind_a == 0, a.values.real, np.inf), axis=1)
    real = np.where(kind_a[row, order] == 0, landed.real[row, order], np.inf)
    with np.errstate(invalid="ignore"):  # inf - inf beyond the last real root
        good &= ~(np.diff(real) < -TWIN * size).any(1)
    mac = np.abs(a.left @ b.right)[row, column, match] * np.abs(b.left @ a.right)[row, match, column]
    return match, good & ((mac > 0.5) | (twin.sum(2) > 1)).all(1)


def assign(cost: Array) -> NDArray[np.intp]:
    """Cheapest one-to-one match, ``cost`` of shape (k, n, n) -> column of each row (k, n)."""
    match = cost.argmin(2)
    for row in np.flatnonzero((np.sort(match) != np.arange(match.shape[1])).any(1)):
        match[row] = scipy.optimize.linear_sum_assignment(cost[row])[1]
    return match


def assign_sets(a: Complex, b: Complex) -> NDArray[np.intp]:
    """Match of roots ``a`` and ``b`` (k, n) by distance; the larger of two real roots is the upper half of a pair."""
    rank_a, rank_b = a.real + a.imag, b.real + b.imag
    distance = np.abs(a[:, :, None] - b[:, None, :]) ** 2
    return assign(distance + 1e-3 * (rank_a[:, :, None] - rank_b[:, None, :]) ** 2)


def follow(nodes: Nodes, compute: Callable[[Array], Nodes], smallest: float) -> tuple[Nodes, Branches]:
    """Follow all roots through ``nodes``, steps halved until every match is clear or they are the ``smallest``."""
    links = np.zeros((len(nodes.v) - 1, nodes.values.shape[1]), np.intp)
    is_linked = np.zeros(len(nodes.v) - 1, bool)
    smooth = is_linked.copy()
    while not is_linked.all():
        open_ = np.flatnonzero(~is_linked)
        links[open_], good = link(nodes.take(open_), nodes.take(open_ + 1))
        smooth[open_] = is_linked[open_] = good
        last = open_[~good & ((np.diff(nodes.v)[open_] <= smallest) | (len(nodes.v) > MAX_NODES))]
        links[last] = assign_sets(nodes.values[last], nodes.values[last + 1])
        is_linked[last] = True
        split = np.flatnonzero(~is_linked)
        if split.size:
            nodes, places = nodes.join(compute((nodes.v[split] + nodes.v[split + 1]) / 2))
            links, is_linked, smooth = (
                _move_steps(part, places, len(nodes.v) - 1) for part in (links, is_linked, smooth)
            )
    order = np.empty(nodes.values.shape, np.intp)
    order[0] = np.lexsort((nodes.values[0].imag, nodes.values[0].real))
    for step, following in enumerate(links):
        order[step + 1] = following[order[step]]
    return nodes, Branches(nodes.v, np.take_along_axis(nodes.values, order, 1), order, smooth)


def _move_steps(part: NDArray[Any], places: NDArray[np.intp], count: int) -> NDArray[Any]:
    """Move the values of each step to the new place of its first node; new steps have zeros."""
    shifted = np.zeros((count, *part.shape[1:]), part.dtype)
    shifted[places[:-1]] = part
    return shifted


def meetings(branches: Branches) -> list[Meeting]:
    """Find where real roots become a pair, or the reverse, on the last tiny steps of ``branches``."""
    crossings = []
    for step in np.flatnonzero(~branches.smooth).tolist():
        v, values = branches.v[step : step + 2], branches.values[step : step + 2]
        real = values.imag == 0
        for kind, lone, pair in (("merge", 0, 1), ("split", 1, 0)):
            for i in np.flatnonzero(real[lone] & ~real[pair] & (values[pair].imag > 0)).tolist():
                j = int(np.abs(values[pair] - values[pair, i].conj()).argmin())
                d = ((values[:, i] - values[:, j]) ** 2).real  # the discriminant is linear here
                t = d[0] / (d[0] - d[1])
                middle = ((values[:, i] + values[:, j]) / 2).real
                at, root = v[0] + t * (v[1] - v[0]), middle[0] + t * (middle[1] - middle[0])
                crossings.append(Meeting(float(at), kind, (i, j), float(root), step))
    return crossings


def follow_branches(matrices: Callable[[Array], Array], values: Array) -> tuple[Array, Complex]:
    """Follow every eigenvalue through rising ``values`` of a number: nodes (m,) that it took, branches (m, n), 1/s."""
    low, high = values[0], values[-1]

    def compute(at: Array) -> Nodes:
        """Roots, slopes and vectors; slopes only say where roots are heading, by one-sided differences at the ends."""
        h = 1e-6 * (high - low)
        upper = np.minimum(at + h, high)
        lower = np.maximum(at - h, low)
        matrix, up, down = np.split(matrices(np.concatenate([at, upper, lower])), 3)
        return Nodes(at, *eigensystem_with_slopes(matrix, (up - down) / (upper - lower)[:, None, None]))

    _, branches = follow(compute(values), compute, 2.0**-26 * (high - low))
    return branches.v, branches.values


def branch_crossings(matrices: Callable[[Array], Array], values: Array, eigenvalues: Complex) -> list[BranchCrossing]:
    """Places where branches cross the imaginary axis; a crossing back and forth between two values is not seen."""
    crossings = []
    for k, i in np.argwhere((eigenvalues.real[:-1] > 0) != (eigenvalues.real[1:] > 0)):
        ends = eigenvalues[[k, k + 1], i]
        if (ends.imag < 0).any():
            continue

        def root_at(value: float, a: float = values[k], b: float = values[k + 1], ends: Complex = ends) -> complex:
            t = (value - a) / (b - a)
            candidates = np.linalg.eigvals(matrices(np.array([value]))[0])
            return complex(candidates[np.abs(candidates - (1 - t) * ends[0] - t * ends[1]).argmin()])

        sides = [root_at(value).real > 0 for value in values[[k, k + 1]]]
        if sides[0] == sides[1]:  # rounding moved a root that lies on the axis
            continue
        value = scipy.optimize.brentq(
            lambda x, root_at=root_at: root_at(x).real, *values[k : k + 2], xtol=1e-14, rtol=1e-13
        )
        crossings.append(BranchCrossing(int(i), value, root_at(value), bool(ends[1].real > ends[0].real)))
    return sorted(crossings, key=lambda crossing: (crossing.value, abs(crossing.root.imag)))
