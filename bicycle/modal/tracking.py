"""Follow every eigenvalue continuously along speed, on a grid of its own that is refined where roots come close.

Consecutive speeds are matched by where the roots are heading (eigenvalues and their slopes from both sides) and by the
bi-orthogonal modal assurance criterion ``|u_i(a) x_j(b)| |u_j(b) x_i(a)|``; where the two disagree, a rival comes near
or real roots change their number or order, the step is halved. Real roots that meet leave as a pair: across the last,
tiny step sum and product of the two are continuous although eigenvectors are not, so they are matched as a set, the
larger real root with the upper half of the pair. What is asked at other speeds never changes the grid, hence an answer
does not depend on its neighbours.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import decompose
from bicycle.linear_model import LinearModel
from bicycle.modal.double_roots import between, join_double_root, steps_with_one
from bicycle.modal.matching import Nodes, assign, link, set_cost
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array, Complex

STEP = 0.1  # of the grid, in units of sqrt(g w): about 0.3 m/s
SMALLEST_STEP = 2.0**-22  # of STEP: below it a step is taken as the meeting point of two roots
MAX_NODES = 20_000
SAME = 1e-9  # of a step of the grid: rounding
SPARSE_FROM, SPARSE = 32, 8  # a sparse grid has every eighth node from there (in steps), above any anchor of names


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
class TrackedRange:
    """Tracked roots within one speed range: nodes (m,), ``values`` and ``slopes`` (m, n), one column a branch.

    ``smooth`` (m - 1,) is False on the tiny steps across a meeting point.
    """

    speeds: Array
    values: Complex
    slopes: Complex
    smooth: NDArray[np.bool_]
    participation: Array  # (m, states, n): |left times right eigenvector|, columns sum to 1

    def follow(self, speeds: Array, eigenvalues: Complex) -> NDArray[np.intp]:
        """For ``speeds`` (k,) inside the range: which of the ``eigenvalues`` (k, n) belongs to each branch."""
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
            cost[rough] = set_cost(self.values[near], eigenvalues[rough])
        return assign(cost)


def track(
    model: LinearModel, lowest: float, highest: float, *, sparse: bool = False
) -> tuple[tuple[TrackedRange, ...], tuple[Meeting, ...]]:
    """Track all roots of a ``model`` from ``lowest`` to ``highest`` (its unit, usually m/s), within each speed range.

    Columns of all ranges are the same branches: across a speed at which the equations switch, roots are matched by
    distance. ``sparse`` takes fewer nodes: wide steps at high speed, and none to close in on the meetings of roots.
    """
    unit = float(np.sqrt(model.parameters["g"] * model.parameters["w"]))
    tracked: list[TrackedRange] = []
    meetings: list[Meeting] = []
    for at, polynomial in zip(model.ranges, model.coefficients, strict=True):
        low, high = max(at.lower, lowest), min(at.upper, highest)
        if high < low or (tracked and high == low):
            continue
        nodes = grid(low, high, unit, singular=-1 in polynomial, sparse=sparse)
        nodes = np.unique(np.clip(nodes, at.lower, at.upper))
        compute = partial(_nodes, polynomial)
        own, met = in_branches(*refine(compute(nodes), compute, unit * STEP * SMALLEST_STEP, sparse=sparse))
        if tracked:
            order = assign(set_cost(tracked[-1].values[-1:], own.values[:1]))[0]
            rank = np.argsort(order)
            own = TrackedRange(
                own.speeds, own.values[:, order], own.slopes[:, order], own.smooth, own.participation[:, :, order],
            )  # fmt: skip
            met = [
                Meeting(m.speed, m.kind, (int(rank[m.branches[0]]), int(rank[m.branches[1]])), m.eigenvalue)
                for m in met
            ]
        tracked.append(own)
        meetings += met
    return tuple(tracked), tuple(meetings)


def grid(low: float, high: float, unit: float, *, singular: bool, sparse: bool = False) -> Array:
    """Nodes of a fixed sequence that cover [low, high]: even steps, geometric towards 0 where the model is singular.

    ``low`` and ``high`` in m/s, ``unit`` the model's unit of speed, sqrt(g w), in m/s; ``singular`` says whether the
    model divides by the speed, ``sparse`` whether fewer nodes will do.
    """
    step = unit * STEP
    numbers = np.arange(max(np.floor(low / step), 0), np.ceil(high / step) + 1)
    if sparse:
        ends = (numbers == numbers[0]) | (numbers == numbers[-1])
        numbers = numbers[(numbers < SPARSE_FROM) | (numbers % SPARSE == 0) | ends]
    nodes = step * numbers
    if singular:
        nodes = nodes[nodes > 0]
        halvings = int(np.ceil(2 * max(np.log2(step / low), 0))) if low > 0 else 0
        nodes = np.concatenate([step * 2.0 ** (-np.arange(halvings, 0, -1) / 2), nodes])
    return nodes


def given(speeds: Array, *, singular: bool) -> NDArray[np.bool_]:
    """Which speeds are nodes of :func:`grid` (m,): a track there has them whatever the roots do.

    Parameters
    ----------
    speeds : ndarray, shape (m,)
        In units of sqrt(g w).
    singular : bool
        Whether the model divides by the speed.
    """
    steps = speeds / STEP
    number = np.where((steps < 1) & (steps > 0), 2 * np.log2(np.maximum(steps, 1e-300)), steps) if singular else steps
    return np.asarray(np.abs(number - number.round()) < SAME)


def refine(
    nodes: Nodes, compute: Callable[[Array], Nodes], smallest: float, *, sparse: bool = False
) -> tuple[Nodes, NDArray[np.intp], NDArray[np.bool_]]:
    """Halve the steps between ``nodes`` until every match is beyond doubt, or the step no larger than ``smallest``.

    ``compute`` gives the nodes at new places (k,); ``smallest`` is in the unit of these, usually m/s. With ``sparse``,
    steps may span the meeting of two roots where it is plain which two.

    Returns
    -------
    nodes : Nodes
        With those that ``compute`` was asked for.
    links : ndarray of int, shape (m - 1, n)
        Which root of the next node follows each root of a node.
    smooth : ndarray of bool, shape (m - 1,)
        False where two roots meet in the step.
    """
    links = np.zeros((len(nodes.v) - 1, nodes.values.shape[1]), np.intp)
    done = np.zeros(len(nodes.v) - 1, bool)
    smooth = done.copy()
    while not done.all():
        open_ = np.flatnonzero(~done)
        a, b = nodes.take(open_), nodes.take(open_ + 1)
        met = {k: join_double_root(a, b, k) for k in steps_with_one(a, b)} if sparse else {}
        links[open_], good = link(a, b)
        smooth[open_] = good
        for k, two in met.items():
            smooth[open_[k]] = False
            good[k] = two is not None and good[k] and set(links[open_[k], two[0]].tolist()) == set(two[1])
            if two and good[k]:
                links[open_[k], two[0]] = two[1]
        done[open_] = good
        last = open_[~good & ((np.diff(nodes.v)[open_] <= smallest) | (len(nodes.v) > MAX_NODES))]
        links[last] = assign(set_cost(nodes.values[last], nodes.values[last + 1]))
        done[last] = True
        split = np.flatnonzero(~done)
        if split.size:
            ends = nodes.take(split), nodes.take(split + 1)
            new = compute(_quarters(*ends)) if sparse else between(*ends, compute, smallest)
            nodes, places = nodes.joined(new)
            links, done, smooth = (_moved(part, places, len(nodes.v) - 1) for part in (links, done, smooth))
    return nodes, links, smooth


def _quarters(a: Nodes, b: Nodes) -> Array:
    return np.concatenate([a.v + share * (b.v - a.v) for share in (0.25, 0.5, 0.75)])


def _moved(part: NDArray[Any], places: NDArray[np.intp], count: int) -> NDArray[Any]:
    """What is known of each step, at the new place of its first node; new steps have zeros."""
    moved = np.zeros((count, *part.shape[1:]), part.dtype)
    moved[places[:-1]] = part
    return moved


def _nodes(polynomial: SpeedPolynomial, speeds: Array) -> Nodes:
    return Nodes(speeds, *decompose(polynomial, speeds))


def in_branches(nodes: Nodes, links: NDArray[np.intp], smooth: NDArray[np.bool_]) -> tuple[TrackedRange, list[Meeting]]:
    """Columns of the roots of ``nodes`` along ``links``, and where real roots meet.

    ``links`` (m - 1, n) and ``smooth`` (m - 1,) are what :func:`refine` gives with the nodes.
    """
    n = nodes.values.shape[1]
    order = np.empty((len(nodes.v), n), np.intp)
    order[0] = np.lexsort((nodes.values[0].imag, nodes.values[0].real))
    for step, following in enumerate(links):
        order[step + 1] = following[order[step]]
    values, slopes = (np.take_along_axis(x, order, 1) for x in (nodes.values, nodes.slopes))
    share = np.abs(nodes.right * nodes.left.swapaxes(1, 2))
    share = np.take_along_axis(share, order[:, None, :], 2)
    share /= share.sum(1, keepdims=True)
    meetings = []
    for k in np.flatnonzero(~smooth):
        meetings += _meetings(nodes.v[k : k + 2], values[k : k + 2])
    return TrackedRange(nodes.v, values, slopes, smooth, share), meetings


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
