"""The anchor speed, at which weave, capsize and castering are named: where they are plainest.

There the three slowest motions of lean, steer and yaw are a pair and two real roots that keep apart from each other and
from all other roots.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.modal.tracking import STEP
from tyre.base.arrays import Array, Complex

SLOW, QUICK = 0.7, 3.0  # of sqrt(g w), about 2 to 9 m/s: the anchor lies between
SPARE = 0.2  # nodes next to that range are looked at too
WALKING = 1.5  # about 5 m/s: the anchor of a model without weave, capsize and castering
MOSTLY = 0.5  # a root of lean, steer and yaw has at least this share of them
WHOLE = 3  # a pair and two real roots
LEVEL = 1e-8  # plainness this near is equal: rounding decides
BETTER = 1.05  # an anchor is plainer by so much than speeds that a finer track may look at in addition

Unit = tuple[int, ...]  # branches of a pair or of a single real root


def units_at(values: Complex, mate: NDArray[np.intp]) -> list[Unit]:
    """The pairs and single real roots at a node as tuples of branches, slow first.

    Parameters
    ----------
    values : complex ndarray, shape (n,)
        Eigenvalues, 1/s.
    mate : ndarray of int, shape (n,)
        Index of the other half of each pair, of itself for a real root.
    """
    of = mate.tolist()
    slow_first = np.argsort(np.abs(values), kind="stable").tolist()
    return [(i,) if of[i] == i else (i, of[i]) for i in slow_first if of[i] == i or values[i].imag > 0]


class Cores(NamedTuple):
    """Where an anchor may be, the pair and the two real roots among the three slowest of lean, steer and yaw.

    Attributes
    ----------
    core : ndarray of bool, shape (m, n)
        Which roots these are, of a pair the upper half; what there is of them. None outside.
    plain : ndarray, shape (m,)
        How far they are from meeting, among themselves and with other modes; 0 outside.
    others : ndarray, shape (m, 2)
        At the ends of a step in which roots meet: how many they are, and how plain, without those that meet.
    """

    core: NDArray[np.bool_]
    plain: Array
    others: Array

    @classmethod
    def of(cls, speeds: Array, values: Complex, mate: NDArray[np.intp], moving: Array) -> "Cores":
        """Of tracked roots.

        Parameters
        ----------
        speeds : ndarray, shape (m,)
            In units of sqrt(g w).
        values : complex ndarray, shape (m, n)
            Eigenvalues, 1/s.
        mate : ndarray of int, shape (m, n)
            Index of the other half of each pair.
        moving : ndarray, shape (m, n)
            Share of lean, steer and yaw in each.
        """
        core, plain, others = np.zeros(values.shape, bool), np.zeros(len(values)), np.zeros((len(values), 2))
        near = (speeds >= SLOW - SPARE) & (speeds <= QUICK + SPARE)
        k = np.flatnonzero(near)
        core[k] = _core(values[k], moving[k])
        plain[k] = _plainness(values[k], core[k])
        meets = np.zeros(values.shape, bool)
        meets[1:] = meets[:-1] = mate[1:] != mate[:-1]
        meets[1:-1] = (mate[2:] != mate[1:-1]) | (mate[1:-1] != mate[:-2])
        k = np.flatnonzero(near & meets.any(1))
        if k.size:
            rest = _core(values[k], np.where(meets[k], 0.0, moving[k]))
            others[k] = np.column_stack([rest.sum(1), _plainness(values[k], rest)])
        return cls(core, plain, others)

    def at(self, nodes: slice) -> "Cores":
        """Of some ``nodes``."""
        return Cores(self.core[nodes], self.plain[nodes], self.others[nodes])


def _core(values: Complex, moving: Array) -> NDArray[np.bool_]:
    size = np.where((moving >= MOSTLY) & (values.imag >= 0), np.abs(values), np.inf)
    slowest = np.argsort(size, axis=1, kind="stable")[:, :3]
    is_core = np.isfinite(np.take_along_axis(size, slowest, 1))
    pair = np.take_along_axis(values.imag, slowest, 1) > 0
    both_real = (is_core & ~pair).sum(1, keepdims=True) == 2
    is_core &= np.where(pair, np.cumsum(pair, axis=1) == 1, both_real)
    core = np.zeros(values.shape, bool)
    np.put_along_axis(core, slowest, is_core, 1)
    return core


def _plainness(values: Complex, core: NDArray[np.bool_]) -> Array:
    size = np.abs(values)
    gap = np.abs(values[:, :, None] - values[:, None, :]) / (size[:, :, None] + size[:, None, :] + 1e-300)
    other = core[:, :, None] & (values.imag >= 0)[:, None, :] & ~np.eye(values.shape[1], dtype=bool)
    own = np.where(core & (values.imag > 0), values.imag / np.maximum(size, 1e-300), np.inf)
    return np.asarray(np.minimum(np.where(other, gap, np.inf).min((1, 2)), own.min(1)))


def find_anchor(speeds: Array, mate: NDArray[np.intp], cores: Cores) -> tuple[int, bool]:
    """Node at which weave, capsize and castering are plainest, and whether a finer track would have no plainer one.

    Parameters
    ----------
    speeds : ndarray, shape (m,)
        Rising, in units of sqrt(g w).
    mate : ndarray of int, shape (m, n)
        Index of the other half of each pair.
    cores : Cores
    """
    core, plain, others = cores
    within = (speeds >= SLOW) & (speeds <= QUICK)
    count = core.sum(1)
    most = count[within].max(initial=0)
    best = np.where(within & (count == most), plain.round(9), -1.0) if most else -np.abs(speeds - WALKING)
    k = int(best.argmax())
    divided = (np.diff(speeds) < 0.75 * STEP) | (mate[1:] != mate[:-1]).any(1)  # a finer track has nodes there
    divided &= (speeds[1:] >= SLOW) & (speeds[:-1] <= QUICK)
    beside = np.append(divided, [False]) | np.append([False], divided)
    rivals = beside | (within & (best > best[k] - LEVEL))
    rivals[k] = beside[k]
    more = bool(most < WHOLE)  # between these nodes there may be a whole one for a short while
    for number, how in ((count, plain), others.T):
        level = number + np.where(how * BETTER >= plain[k], 0.5, 0.0)
        more = more or (rivals & (level > most)).any()
    return k, not more


def core_at(units: Sequence[Unit], core: NDArray[np.bool_], lean: Array, steer: Array) -> dict[str, Unit]:
    """A pair and two real roots, where these are the slowest of lean, steer and yaw; else what there is of them.

    Parameters
    ----------
    units : sequence of tuples of int
        As of :func:`units_at`.
    core : ndarray of bool, shape (n,)
        Which roots are among them.
    lean, steer : ndarray, shape (n,)
        Share in each root.
    """
    found: dict[str, Unit] = {}
    pairs, reals = ([unit for unit in units if core[unit[0]] and len(unit) == length] for length in (2, 1))
    if pairs:
        found["weave"] = pairs[0]
    if reals:
        leaning = [lean[i] / (lean[i] + steer[i] + 1e-300) for (i,) in reals]
        found["capsize"], found["castering"] = reals if leaning[0] >= leaning[1] else reals[::-1]
    return found
