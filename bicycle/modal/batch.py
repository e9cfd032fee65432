"""Roots of many bicycles followed and named at once: compiled (extra ``fast``), or in plain numpy.

A block of bicycles is tracked on the sparse grid of :mod:`bicycle.modal.tracking`, all nodes of a round together, named
by the rules of :mod:`bicycle.modal.naming`, and answers for the speeds asked for. Every step of this says when it is
not sure: two roots that cannot be told apart, a name by a narrow margin, a speed next to which names change. Such a
bicycle gets no answer here but a status, and the caller asks the plain path for it, which is the judge of this one.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.solvers import Solver, compiled, default_solver
from bicycle.modal.block import Block
from bicycle.modal.doubts import WHY
from tyre.base.arrays import Array


@dataclass(frozen=True)
class NamedRoots:
    """Roots of many bicycles at speeds, and what each may be called.

    Attributes
    ----------
    values : complex ndarray, shape (m, k, n)
        Of each bicycle at its speeds, sorted, 1/s.
    bits : ndarray of int, shape (m, k, n)
        Numbers of the names of each root, as bits; several where identity is lost.
    names : tuple of str
        By number.
    anchor : ndarray, shape (m,)
        Speed at which names were given, m/s.
    every : ndarray of int, shape (m,)
        Numbers of the names of all modes of each bicycle, as bits.
    status : ndarray of int, shape (m,)
        Not 0 where the batch is not sure and there is no answer; :data:`WHY` says why.
    """

    values: NDArray[np.complex128]
    bits: NDArray[np.int64]
    names: tuple[str, ...]
    anchor: Array
    every: NDArray[np.int64]
    status: NDArray[np.int16]

    @property
    def unsure(self) -> Mapping[str, int]:
        """How many bicycles were left to the plain path, by reason."""
        return {why: count for number, why in WHY.items() if (count := int((self.status == number).sum()))}


def name_roots(block: Block, speeds: Array, *, solver: Solver | None = None) -> NamedRoots:
    """Roots at speeds and their names, of all bicycles of a block.

    Parameters
    ----------
    block : Block
    speeds : ndarray, shape (m, k)
        Of each bicycle, m/s.
    solver : callable, optional
        :func:`bicycle.eigenvalues.solvers.compiled` for the kernels, :func:`bicycle.eigenvalues.solvers.lapack` for
        plain numpy; by default the kernels where they can be.

    Returns
    -------
    NamedRoots
    """
    if (solver or default_solver()) is compiled:
        from bicycle.modal.compiled_batch import BLOCK, name_block
    else:
        from bicycle.modal.stacked_batch import BLOCK, name_block
    order = np.argsort(speeds, axis=1, kind="stable")
    rising = np.take_along_axis(speeds, order, 1)
    parts = [
        name_block(block.part(slice(at, at + BLOCK)), rising[at : at + BLOCK]) for at in range(0, len(speeds), BLOCK)
    ]
    values, bits, anchor, every, status = (np.concatenate([part[i] for part in parts]) for i in range(5))
    back = np.argsort(order, axis=1)[..., None]
    values, bits = np.take_along_axis(values, back, 1), np.take_along_axis(bits, back, 1)
    return NamedRoots(values, bits, block.kind.names, anchor, every, status)


def name_of(bits: int, names: tuple[str, ...]) -> str:
    """The name that ``bits`` stand for, among ``names``: joint where there are several.

    Parameters
    ----------
    bits : int
        Index of each name as a bit.
    names : tuple of str
        By number.
    """
    return "+".join(sorted(name for number, name in enumerate(names) if bits >> number & 1))
