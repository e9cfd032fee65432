"""Which mode a branch belongs to at every speed, when roots of two modes meet and go on as a pair.

A mode is a single real root or a pair (which may have split into two real roots). Going away from the anchor speed, a
pair made of roots of two modes ties these together. Where the tied roots are as many pairs and single real roots as
the modes, each mode takes what has its form: when castering meets one half of a split wobble, the new pair is the
wobble and the other half remains. Identity is then lost only next to the meeting, where the two roots are less than a
factor of two apart. Other tied roots carry both names until their pair splits again.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tyre.base.arrays import Array, Complex

APART = 1 / 3  # |a - b| / (|a| + |b|) of real roots a factor of two apart
MUCH_FASTER = 5.0
PLAIN = 1.5  # ratio of two roots that is not turned by moving on by a step
Label = tuple[int, ...]  # the modes a root may belong to


@dataclass(frozen=True)
class Regions:
    """``labels[cases[k]][i]``: the modes that branch i may belong to at node k.

    ``chance[k]`` where rounding decides which half of a pair of two modes is whose after it has split. ``clear`` is
    False where roots next to a meeting were compared that had nearly the same size, or could be shared out in two ways.
    """

    labels: tuple[tuple[Label, ...], ...]
    cases: NDArray[np.intp]
    chance: NDArray[np.bool_]
    clear: bool


def conjugate_index(values: Complex) -> NDArray[np.intp]:
    """Index (m, n) of the other half of each pair of ``values`` (m, n), of itself where a root is real."""
    same = (values[:, :, None] == values[:, None, :].conj()) & (values.imag != 0)[:, :, None]
    return np.asarray(np.where(values.imag != 0, same.argmax(2), np.arange(values.shape[1])))


def regions(
    speeds: Array, values: Complex, mate: NDArray[np.intp], modes: Sequence[tuple[int, ...]], castering: int,
    anchor: int, always: tuple[float, float], certain: NDArray[np.bool_], step: float,
) -> Regions:  # fmt: skip
    """Carry the identity of modes up and down from one node to all others.

    Outside the speeds ``always`` tracked, what happens changes nothing nearer to the anchor: whether it is seen hangs
    on what else is asked for.

    Parameters
    ----------
    speeds : ndarray, shape (m,)
        m/s, rising.
    values : complex ndarray, shape (m, n)
        Tracked eigenvalues (1/s), one column a branch.
    mate : ndarray of int, shape (m, n)
        Of them, as :func:`conjugate_index` gives it.
    modes : sequence of tuples of int
        Indices of the branches of each mode at node ``anchor``.
    castering : int
        Index of the castering mode, or -1. A single real root of a tyre that forms a pair with it keeps its name, and
        there is no castering: such a pair is the wobble of a model without relaxation.
    anchor : int
        Index of the node at which the modes were told apart.
    always : tuple of float
        Lowest and highest speed (m/s) that is tracked whatever is asked for.
    certain : ndarray of bool, shape (m,)
        Nodes that a track has whatever the roots do: it may step over a pair that is only seen between two of them.
    step : float
        Width of its steps, m/s: between nodes farther apart it has others.
    """
    n = values.shape[1]
    owner = np.empty(n, np.intp)
    for number, unit in enumerate(modes):
        owner[list(unit)] = number
    if (owner[mate] == owner).all():  # no pair is of two modes
        own = tuple((int(mode),) for mode in owner)
        return Regions((own,), np.zeros(len(values), np.intp), np.zeros(len(values), bool), clear=True)
    labels: list[tuple[Label, ...]] = [()] * len(values)
    walk = _Walk(speeds, values, mate, modes, castering, always, certain, step, labels, np.zeros(len(values), bool))
    for nodes in (range(anchor, len(values)), range(anchor, -1, -1)):
        walk.go(nodes, owner.copy())
    cases = sorted(set(labels))
    number_of = {case: k for k, case in enumerate(cases)}
    return Regions(tuple(cases), np.array([number_of[label] for label in labels], np.intp), walk.chance, walk.clear)


@dataclass
class _Walk:
    speeds: Array
    values: Complex
    mate: NDArray[np.intp]
    modes: Sequence[tuple[int, ...]]
    castering: int
    always: tuple[float, float]
    certain: NDArray[np.bool_]
    step: float
    labels: list[tuple[Label, ...]]
    chance: NDArray[np.bool_]
    clear: bool = True

    def go(self, nodes: Sequence[int], owner: NDArray[np.intp]) -> None:
        past: list[int] = []
        now: tuple[Label, ...] = ()
        other = (self.mate[1:] != self.mate[:-1]).any(1).tolist()
        split, hidden = np.zeros((2, len(owner)), bool)  # hidden: pairs of two modes not seen at a certain node yet
        low, high = self.always
        for k in nodes:
            if not past or other[min(k, past[-1])]:
                if past:
                    mate = self.mate[past[-1]]
                    turned = mate != self.mate[k]
                    split |= turned & (owner[mate] != owner)
                    again = split & (self.mate[k] != np.arange(len(owner)))
                    self.clear = self.clear and not (again | (hidden & turned)).any()
                    hidden |= turned & (owner[self.mate[k]] != owner)
                before = owner.copy()
                now, changed = self._assign(k, owner)
                for group in changed if low <= self.speeds[k] <= high else []:
                    self._blur(k, past, before, group)
            hidden &= ~self.certain[k]
            self.labels[k] = now
            self.chance[k] = split.any()
            past.append(k)

    def _assign(self, k: int, owner: NDArray[np.intp]) -> tuple[tuple[Label, ...], list[frozenset[int]]]:
        """Labels at node k, and the groups of modes in which roots changed hands."""
        mate = self.mate[k]
        links = [frozenset((int(owner[i]), int(owner[j]))) for i, j in enumerate(mate) if owner[i] != owner[j]]
        changed = []
        slow_first = np.lexsort((self.values[k].real, np.abs(self.values[k]).round(12))).tolist()
        label: list[Label] = [(int(mode),) for mode in owner]
        for group in _united(links):
            branches = [i for i in slow_first if owner[i] in group]  # ties must not hang on the order of columns
            handed_over = self._assign_group(k, owner, group, branches)
            if handed_over:
                changed.append(group)
            for i in branches:
                label[i] = (int(owner[i]),) if handed_over is not None else self._joint(group)
        return tuple(label), changed

    def _assign_group(self, k: int, owner: NDArray[np.intp], group: frozenset[int], branches: list[int]) -> bool | None:
        """Give the roots of a group of modes back to them; True if any changed hands, None where it cannot be told."""
        mate = self.mate[k]
        pairs = [(i, int(mate[i])) for i in branches if self.values[k, i].imag > 0]
        reals = [i for i in branches if mate[i] == i]
        double, single = ([m for m in sorted(group) if len(self.modes[m]) == size] for size in (2, 1))
        told = len(pairs) == len(double) and len(reals) == len(single) and self._likely(k, pairs, reals, single)
        return self._hand_over(k, owner, pairs, reals, double, single) if told else None

    def _joint(self, group: frozenset[int]) -> Label:
        """The label of roots that may belong to any mode of a group; castering and one root of a tyre are wobble."""
        single = [m for m in group if len(self.modes[m]) == 1]
        tyre = [m for m in single if m != self.castering]
        only_these = self.castering in single and len(tyre) == 1 and len(single) == len(group)
        return (tyre[0],) if only_these and tyre[0] >= self._first_free else tuple(sorted(group))

    def _likely(self, k: int, pairs: list[tuple[int, int]], reals: list[int], single: list[int]) -> bool:
        """False where castering, which is fast, would turn slow, or another real mode much faster than the pair."""
        if not pairs or not reals:
            return True
        size = np.abs(self.values[k])
        pair = size[[i for i, _ in pairs]]
        if single == [self.castering]:
            return self._less(pair.min(), size[reals].min())
        return self._less(size[reals].max(), MUCH_FASTER * pair.max())

    def _less(self, a: float, b: float) -> bool:
        self.clear = self.clear and not b / PLAIN < a < b * PLAIN
        return bool(a <= b)

    @property
    def _first_free(self) -> int:
        """Number of the first mode of a tyre or joint: weave, capsize and castering come before."""
        return self.castering + 1

    def _hand_over(
        self, k: int, owner: NDArray[np.intp], pairs: list[tuple[int, int]], reals: list[int],
        double: list[int], single: list[int],
    ) -> bool:  # fmt: skip
        """Give pairs to the modes that had most of them, what remains to the single modes; True if any changed."""
        before = owner.copy()
        kept = np.zeros((len(pairs), len(double)))
        for p, pair in enumerate(pairs):
            kept[p] = [(before[list(pair)] == m).sum() for m in double]
        rows, columns = linear_sum_assignment(-kept)
        for row, column in zip(rows, columns, strict=True):
            owner[list(pairs[row])] = double[column]
            without = kept.copy()
            without[row, column] = -1
            self.clear = self.clear and without[linear_sum_assignment(-without)].sum() < kept[rows, columns].sum()
        free = [i for i in reals if before[i] not in single]
        lost = [m for m in single if m not in before[reals]]  # the others keep their root
        owner[free] = lost
        self.clear = self.clear and len(free) < 2
        return bool((owner != before).any())

    def _blur(self, here: int, past: list[int], owner: NDArray[np.intp], group: frozenset[int]) -> None:
        """Going back from where roots changed hands: lose identity where roots of two modes were close."""
        branches = np.array([i for i in range(len(owner)) if owner[i] in group])
        joint = tuple(sorted(group))
        regular = sum(len(self.modes[m]) == 2 for m in group)
        for k in reversed(past):
            if (self.values[k, branches].imag > 0).sum() == regular:
                break
            root = self.values[k, branches]
            near = np.abs(root[:, None] - root) / (np.abs(root[:, None]) + np.abs(root) + 1e-300)
            twin = owner[branches][:, None] == owner[branches]
            own = np.where(twin & ~np.eye(len(root), dtype=bool), near, -1.0).max(1)
            other = np.where(twin, np.inf, near).min(1)
            if not ((other < own) & (other < APART)).any():
                break
            self.clear = self.clear and abs(self.speeds[k] - self.speeds[here]) < 1.5 * self.step
            here = k
            label = list(self.labels[k])
            for i in branches:
                label[i] = joint
            self.labels[k] = tuple(label)


def _united(groups: list[frozenset[int]]) -> list[frozenset[int]]:
    """Groups that share a member, as one."""
    result: list[frozenset[int]] = []
    for group in groups:
        apart = [other for other in result if not other & group]
        result = [*apart, group.union(*(other for other in result if other & group))]
    return result
