"""Many bicycles of one kind, and the nodes of their sparse tracks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.linear_model import LinearModel
from bicycle.modal.batch_kind import BatchKind
from bicycle.modal.naming import HIGHEST, LOWEST, speed_unit
from bicycle.modal.speed_limits import FASTEST_SPEED, SLOWEST_SPEED
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
        # own arrays: of one that may not be written to, every kernel would be compiled once more
        return cls(np.array(stacked), powers, np.array(unit, float), kind)

    @classmethod
    def of_models(cls, models: Sequence[LinearModel]) -> "Block":
        """From ``models`` with the same effects, each with one range of speed."""
        of_each = [model.coefficients[0] for model in models]
        powers = sorted({power for polynomial in of_each for power in polynomial})
        stacked = np.array([[polynomial.coefficient(power) for polynomial in of_each] for power in powers or [0]])
        unit = np.array([speed_unit(model) for model in models])
        return cls(stacked, np.array(powers or [0], float), unit, BatchKind.of(models[0]))

    def part(self, bicycles: slice) -> "Block":
        """Some of the ``bicycles``."""
        return Block(np.ascontiguousarray(self.coefficients[:, bicycles]), self.powers, self.unit[bicycles], self.kind)

    @property
    def polynomial(self) -> SpeedPolynomial:
        """State matrices (m, n, n), 1/s."""
        return SpeedPolynomial(dict(zip(self.powers.astype(int).tolist(), self.coefficients, strict=True)))

    def grid(self, lowest: Array, highest: Array) -> tuple[NDArray[np.intp], Array]:
        """Nodes of the sparse track of all bicycles: bicycle (k,) and speed (k,), m/s.

        They cover where names are given, and ``lowest`` to ``highest`` (m,), in units of speed; of each as far down and
        up as it must go by itself, so that no result depends on the others.
        """
        slowest = np.clip(lowest, SLOWEST_SPEED, LOWEST) if self.kind.singular else np.zeros(len(self.unit))
        low = slowest / STEP
        reach = np.minimum(np.maximum(highest, HIGHEST), FASTEST_SPEED) / STEP
        top = SPARSE * np.ceil(reach.max() / SPARSE)
        steps = grid(low.min(), top, 1 / STEP, singular=self.kind.singular, sparse=True)
        wanted = np.ones((len(low), len(steps)), bool)
        wanted[:, 1:] = steps[:-1] < reach[:, None]
        wanted[:, :-1] &= steps[1:] > low[:, None]
        own, place = np.nonzero(wanted)
        steps = steps[place]
        steps[(steps == 0) & (lowest[own] >= START * STEP)] = START  # at rest, roots may be double
        return own, (self.unit * STEP)[own] * steps
