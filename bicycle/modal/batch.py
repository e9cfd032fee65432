"""Roots of many bicycles followed and named at once: compiled (extra ``fast``), or in plain numpy.

A block of bicycles is tracked on the sparse grid of :mod:`bicycle.modal.tracking`, all nodes of a round together, named
by the rules of :mod:`bicycle.modal.naming`, and answers for the speeds asked for. Every step of this says when it is
not sure: two roots that cannot be told apart, a name by a narrow margin, a speed next to which names change. Such a
bicycle gets no answer here but a status, and the caller asks the plain path for it, which is the judge of this one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.solvers import Solver, compiled, default_solver
from bicycle.linear_model import LinearModel
from bicycle.modal.batch_kind import BatchKind
from bicycle.modal.doubts import WHY
from bicycle.modal.naming import HIGHEST, LOWEST, speed_unit
from bicycle.modal.speed_limits import FASTEST_SPEED
from bicycle.modal.tracking import SPARSE, STEP, grid
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array

START = 2.0**-6  # in steps: where a track begins that needs not reach rest


@dataclass(frozen=True)
class Block:
    """Bicycles of one kind: state matrices as polynomials in the speed, one range of speed.

    Attributes
    ----------
    coefficients : ndarray, shape (p, m, n, n)
        Of the powers of the speed.
    powers : ndarray, shape (p,)
        These powers.
    unit : ndarray, shape (m,)
        sqrt(g w), m/s.
    kind : BatchKind
        What they have in common.
    """

    coefficients: Array
    powers: Array
    unit: Array
    kind: BatchKind

    @classmethod
    def of(cls, polynomial: SpeedPolynomial, unit: Array, kind: BatchKind) -> "Block":
        """From state matrices and units of speed of bicycles of one kind.

        Parameters
        ----------
        polynomial : SpeedPolynomial, shape (m, n, n)
            Scaled state matrices, 1/s.
        unit : ndarray, shape (m,)
            sqrt(g w), m/s.
        kind : BatchKind
        """
        shape = polynomial.shape
        stacked = [np.broadcast_to(matrix, shape) for matrix in polynomial.values()] or [np.zeros(shape)]
        powers = np.array(list(polynomial) or [0], float)
        return cls(np.ascontiguousarray(stacked), powers, np.ascontiguousarray(unit, dtype=float), kind)

    @classmethod
    def of_models(cls, models: Sequence[LinearModel]) -> "Block":
        """From ``models`` with the same effects, each with one range of speed."""
        of_each = [model.coefficients[0] for model in models]
        powers = sorted({power for polynomial in of_each for power in polynomial})
        stack = {power: np.stack([polynomial.coefficient(power) for polynomial in of_each]) for power in powers}
        polynomial = SpeedPolynomial(stack, shape=(len(models), *of_each[0].shape))
        return cls.of(polynomial, np.array([speed_unit(model) for model in models]), BatchKind.of(models[0]))

    def part(self, bicycles: slice) -> "Block":
        """Some of the ``bicycles``."""
        return Block(np.ascontiguousarray(self.coefficients[:, bicycles]), self.powers, self.unit[bicycles], self.kind)

    @property
    def polynomial(self) -> SpeedPolynomial:
        """State matrices (m, n, n), 1/s."""
        return SpeedPolynomial(dict(zip(self.powers.astype(int).tolist(), self.coefficients, strict=True)))

    def grid(self, lowest: float, highest: Array) -> tuple[NDArray[np.intp], Array]:
        """Nodes of the sparse track of all bicycles: bicycle (k,) and speed (k,), m/s.

        They cover where names are given, and ``lowest`` to ``highest`` (m,), in units of speed; of each as far as it
        must go by itself, so that no result depends on the others.
        """
        low = min(lowest, LOWEST if self.kind.singular else 0.0)
        reach = np.minimum(np.maximum(highest, HIGHEST), FASTEST_SPEED) / STEP
        top = SPARSE * np.ceil(reach.max() / SPARSE)
        steps = grid(low / STEP, top, 1 / STEP, singular=self.kind.singular, sparse=True)
        if steps[0] == 0 and lowest >= START * STEP:
            steps[0] = START  # at rest, roots may be double
        own, place = np.nonzero(np.concatenate([[-1.0], steps[:-1]]) < reach[:, None])
        return own, (self.unit * STEP)[own] * steps[place]


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
