"""Matrices that are a Laurent polynomial in the forward speed v: the one place where such a polynomial is evaluated.

>>> import numpy as np
>>> drag = SpeedPolynomial({0: np.eye(2), 2: 0.5 * np.eye(2)})
>>> drag([0.0, 2.0])[:, 0, 0]
array([1., 3.])
>>> drag.derivative(2.0)[0, 0]
np.float64(2.0)
"""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground.arrays import Array


class SpeedPolynomial(Mapping[int, Array]):
    """P(v) = sum over k of v^k P_k; as a mapping, power k -> coefficient P_k, of the powers that occur."""

    def __init__(self, coefficients: Mapping[int, ArrayLike], *, shape: tuple[int, ...] | None = None) -> None:
        self._coefficients: dict[int, Array] = {k: np.asarray(matrix, float) for k, matrix in coefficients.items()}
        if shape is None:
            shape = next(iter(self._coefficients.values())).shape
        self.shape = shape

    def __getitem__(self, power: int) -> Array:
        return self._coefficients[power]

    def __iter__(self) -> Iterator[int]:
        return iter(self._coefficients)

    def __len__(self) -> int:
        return len(self._coefficients)

    def __repr__(self) -> str:
        return f"<SpeedPolynomial {self.shape} in v^{', v^'.join(map(str, self)) or '- (zero)'}>"

    def coefficient(self, power: int) -> Array:
        """The matrix of v to the ``power`` (no unit), zeros where it does not occur, shape (..., rows, columns)."""
        return self._coefficients[power] if power in self._coefficients else np.zeros(self.shape)

    def __call__(self, speeds: ArrayLike) -> Array:
        """The matrices at speeds."""
        v = np.asarray(speeds, float)
        *bicycles, rows, columns = self.shape
        if v.ndim and v.ndim < len(bicycles):
            raise ValueError(f"speeds of shape {v.shape} do not match a stack of shape {tuple(bicycles)}")
        aligned = (*bicycles, *(1,) * (v.ndim - len(bicycles)))
        shape = (*np.broadcast_shapes(v.shape, aligned), rows, columns)
        total: Any = None
        for power, matrix in self._coefficients.items():
            term: Any = matrix.reshape(*aligned, rows, columns)
            if power:
                term = np.asarray(v if power == 1 else v**power)[..., None, None] * term
            total = term if total is None else total + term
        if total is None:
            return np.zeros(shape)
        return np.array(np.broadcast_to(total, shape)) if len(self) == 1 else np.asarray(total)

    def __mul__(self, factor: Array) -> "SpeedPolynomial":
        """The polynomial with every coefficient times ``factor``, which broadcasts against them, in their units."""
        scaled = {power: matrix * factor for power, matrix in self._coefficients.items()}
        return SpeedPolynomial(scaled, shape=self.shape)

    @cached_property
    def derivative(self) -> "SpeedPolynomial":
        """dP/dv, a polynomial too; called like this one, per m/s."""
        return SpeedPolynomial(
            {power - 1: power * matrix for power, matrix in self._coefficients.items() if power}, shape=self.shape
        )

    def take(self, bicycles: Any) -> "SpeedPolynomial":
        """The polynomial of some bicycles of a stack."""
        coefficients = {power: matrix[bicycles] for power, matrix in self._coefficients.items()}
        return SpeedPolynomial(coefficients, shape=np.broadcast_to(0.0, self.shape)[bicycles].shape)
