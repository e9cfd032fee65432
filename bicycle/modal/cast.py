"""Which mode of tyres and joints plays which role: by its mean share in the states that mark a mode."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from bicycle.derivation.declarations import Mode
from bicycle.modal.identity import Regions
from tyre.base.arrays import Array

FAINT = 0.02  # a role played with less than this share earns no name
MARGIN = 0.1  # by which a role is clearly played


def named_by_role(
    weight: Array, part: Array, names: Sequence[str], found: Regions, played: Sequence[Mode]
) -> tuple[list[str], bool]:
    """Names of all modes, and whether those that were missing are clear.

    Parameters
    ----------
    weight : ndarray, shape (m,)
        Of each node.
    part : ndarray, shape (m, r, n)
        How far each root plays each of the modes ``played``.
    names : sequence of str
        Of the modes; "" of those that have none yet.
    found : Regions
        Which mode each root belongs to.
    played : sequence of Mode
        That a name may be of, r of them.
    """
    own = np.array([[[label == (m,) for label in case] for m in range(len(names))] for case in found.labels], float)
    k = np.flatnonzero(weight)
    of_case = weight[k] * (found.cases[k] == np.arange(len(own))[:, None])  # (cases, nodes)
    sums = (of_case @ part[k].reshape(len(k), -1)).reshape(len(own), *part.shape[1:])
    total = of_case.sum(1) @ own.sum(2)
    mean = np.einsum("cmi,cri->rm", own, sums) / (total + 1e-300)
    named = [*names]
    free = [m for m, name in enumerate(names) if not name]
    cast, clear = _cast(mean[:, free], np.array([[role.weight] for role in played]))
    clear = clear and bool((total[free] >= MARGIN * weight.sum()).all())  # not from a node or two
    for row, column in cast:
        named[free[column]] = played[row].name
    others = [m for m in free if not named[m]]
    for number, m in enumerate(others, 1):
        named[m] = f"other_{number}"
    return named, clear


def _cast(mean: Array, factors: Array) -> tuple[set[tuple[int, int]], bool]:
    """Roles and modes that belong together by their mean share (roles, modes); and whether by a clear margin."""

    def best(least: float) -> tuple[Array, set[tuple[int, int]]]:
        played = factors * np.where(mean >= least, mean, 0.0)
        rows, columns = linear_sum_assignment(-played)
        return played, {(int(r), int(c)) for r, c in zip(rows, columns, strict=True) if played[r, c] > 0}

    played, cast = best(FAINT)
    whole = sum(played[pair] for pair in cast)
    clear = True
    if ((mean >= FAINT / (1 + MARGIN)) & (mean < FAINT * (1 + MARGIN))).any():
        clear = best(FAINT / (1 + MARGIN))[1] == best(FAINT * (1 + MARGIN))[1] == cast
    for pair in cast:
        without = played.copy()
        without[pair] = 0
        rows, columns = linear_sum_assignment(-without)
        clear = clear and bool(without[rows, columns].sum() < (1 - MARGIN) * whole)
    return cast, clear
