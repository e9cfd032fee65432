"""The base model with candidates built in, in batches, and the derivatives of its matrices along the coordinates."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bicycle.equations.lateral import SymbolicModel
from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.descriptor import DescriptorPolynomial, DescriptorStack
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from studies.inference.parameter import Candidate, Coupling, UncertainParameter, couplings, stencil
from tyre.ground.arrays import Array, Complex

MEASUREMENT = "measurement."  # begins the key of each error of the measurement
SPEED_SCALE = "measurement.speed_scale"  # true speed over recorded speed, minus 1
SPEED_OFFSET = "measurement.speed_offset"  # true speed less the scaled recorded one, m/s
WRONG = "wrong."  # WRONG + key: error of the value that the file states for the key
TORQUES = ("steer_torque", "lean_torque")

Settings = tuple[tuple[str, float], ...]
"""Parameters of effects, ``effect.name[.wheel]``, and their SI values."""


def feedback_key(state: str, torque: str) -> str:
    """Key of the gain of a torque proportional to the output ``state``."""
    return f"feedback.{torque}_from_{state}"


FEEDBACK = {
    feedback_key(state, torque): (state, torque)
    for state in ("lean", "steer", "lean_rate", "steer_rate")
    for torque in TORQUES
}


@dataclass(frozen=True)
class Family:
    """All models that differ in the numbers of nuisances and candidates; ``settings`` replace numbers of the base."""

    base: Model  # the bicycle and its effects before candidates are added
    nuisances: tuple[UncertainParameter, ...]  # float in every fit; their coordinates come first
    candidates: tuple[Candidate, ...] = ()  # that are added; their coordinates follow in this order
    settings: Settings = ()

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return Family, (self.base, self.nuisances, self.candidates, self.settings)  # compiled functions do not pickle

    @cached_property
    def unknowns(self) -> tuple[UncertainParameter, ...]:
        """Nuisances, then the unknowns of the candidates."""
        return (*self.nuisances, *(u for candidate in self.candidates for u in candidate.unknowns))

    @cached_property
    def models(self) -> ModelFamily:
        """All models with these effects."""
        return ModelFamily(self.base, further=tuple(c.effect for c in self.candidates if c.effect is not None))

    @property
    def symbolic(self) -> SymbolicModel:
        """Names of states, inputs and outputs."""
        return self.models.evaluate.symbolic

    @cached_property
    def _fixed(self) -> Mapping[str, float]:
        """Parameters, SI, of the base with its settings and of the candidates, where no unknown sets them."""
        values = dict(self.base.parameters) | dict(self.settings)
        for candidate in self.candidates:
            values |= candidate.fixed
        return values

    @cached_property
    def _fixed_numbers(self) -> Array:
        """Fixed parameters (n,), SI, in the order of :attr:`_fixed`."""
        return np.array(list(self._fixed.values()), float)

    def values(self, theta: Array) -> dict[str, Array]:
        """Every parameter for coordinates ``theta`` (K, unknowns), arrays (K, 1)."""
        columns_of_fixed = np.repeat(self._fixed_numbers[:, None, None], len(theta), axis=1)
        fixed = dict(zip(self._fixed, columns_of_fixed, strict=True))
        keys, columns, factors, bent, wrong = self._sets
        coordinates = theta.T.copy()
        for column in bent:
            coordinates[column] = self.unknowns[column].value(theta[:, column])
        for coupling, together in self._couplings:
            coordinates[together] = coupling.values(coordinates[together])
        values = fixed | dict(zip(keys, (factors * coordinates[columns])[..., None], strict=True))
        for key in wrong:
            corrected_key = key.removeprefix(WRONG)
            values[corrected_key] = values[corrected_key] + values[key]
        for candidate in self.candidates:
            values |= {key: values[source] for key, source in candidate.ties.items()}
        return values

    @cached_property
    def _couplings(self) -> list[tuple[Coupling, list[int]]]:
        """Couplings of unknowns, with their columns."""
        return couplings(self.unknowns)

    @cached_property
    def _sets(self) -> tuple[list[str], NDArray[np.intp], Array, list[int], list[str]]:
        """Keys that unknowns set, their columns and factors (n, 1); columns of powers; keys of wrong statements."""
        sets = [(key, column, factor) for column, u in enumerate(self.unknowns) for key, factor in u.sets.items()]
        keys = [key for key, _, _ in sets]
        columns = [column for _, column, _ in sets]
        factors = [factor for _, _, factor in sets]
        bent = [column for column, u in enumerate(self.unknowns) if u.power != 1]
        wrong = [key for key in dict.fromkeys((*self._fixed, *keys)) if key.startswith(WRONG)]
        return keys, np.array(columns, int), np.array(factors, float)[:, None], bent, wrong

    @staticmethod
    def true_speeds(values: Mapping[str, Array], speeds: Array) -> Array:
        """True speeds (K, S) for recorded ``speeds`` (S,), m/s."""
        nothing = np.zeros((len(next(iter(values.values()))), 1))
        return np.asarray(speeds * (1.0 + values.get(SPEED_SCALE, nothing)) + values.get(SPEED_OFFSET, nothing))

    def __call__(self, theta: Array, speeds: Array) -> DescriptorStack:
        """Matrices for coordinates ``theta`` (K, unknowns) at recorded ``speeds`` (S,) in m/s."""
        return self.system(self.values(theta), speeds)

    def system(self, values: Mapping[str, Array], speeds: Array) -> DescriptorStack:
        """Matrices for parameter ``values`` at recorded ``speeds`` (S,) in m/s."""
        true = self.true_speeds(values, speeds)
        return self.matrices(values, true)(true)

    def matrices(self, values: Mapping[str, Array], speeds: Array) -> DescriptorPolynomial:
        """Matrices for parameter ``values`` as polynomials in the true speed, for ``speeds`` (K, S) in m/s."""
        matrices = self.models.descriptor(values, speeds)
        for key, (output, torque) in FEEDBACK.items():
            if key in values:
                column = self.symbolic.inputs.index(torque)
                row = self.symbolic.outputs.index(output)
                matrices = matrices.with_feedback(input=column, output=row, gain=values[key])
        return matrices

    def stencil(self, theta: Array) -> tuple[Array, Array]:
        """Batch [theta, theta + h_k, theta - h_k ...] (2 p + 1, p) about ``theta`` (p,), and the steps h (p,)."""
        return stencil(self.unknowns, theta)

    def measurement_errors(self, theta: Array) -> dict[str, tuple[int, float]]:
        """Column of the coordinate of each error of the measurement that floats, and its value at ``theta`` (p,)."""
        return {key: (column, float(theta[column])) for key, column in self._columns_of_errors.items()}

    @cached_property
    def _columns_of_errors(self) -> dict[str, int]:
        """Column of the coordinate that sets each error of the measurement."""
        sets = [(key, column) for column, u in enumerate(self.unknowns) for key in u.sets]
        return {key: column for key, column in sets if key.startswith(MEASUREMENT)}


Part = Literal["dynamics", "input", "output"]
Terms = list[tuple[Array, Array | Complex]]
"""Matrices (p, 1 or k, rows, columns), each with the vectors (m, columns, q) that it is multiplied by."""


class MatrixSlopes:
    """A bicycle at recorded ``speeds`` (k,), m/s, and the derivatives of its matrices along p coordinates.

    The matrices are polynomials in the speed v: dF/dtheta x = sum over k of v^k dF_k x + F'(v) x dv/dtheta. Only the
    coefficients are differenced, and no matrix is put together at any speed. Without ``wanted`` p is zero. ``steps``
    (p,) are those of the differences; ``values`` and ``true_speeds`` are of the bicycle and of the 2 p about it, and
    ``system`` has the matrices of the bicycle itself, arrays (1, k, ...).
    """

    def __init__(self, family: Family, theta: Array, speeds: Array, slopes: bool = True) -> None:  # noqa: FBT001, FBT002
        batch, self.steps = family.stencil(theta) if slopes else (theta[None], theta[:0])
        self.family, self.values = family, family.values(batch)
        self.true_speeds = family.true_speeds(self.values, speeds)
        self._all = family.matrices(self.values, self.true_speeds)
        self._first = self._all.take(slice(1)) if slopes else self._all
        self.system: DescriptorStack = self._first(self.true_speeds[:1])
        self.mass = self._first.mass[0]  # (1, n, n); (k, n, n) if the equations switch

    def difference(self, part: Array) -> Array:
        """Derivatives (p, ...) of a ``part`` (2 p + 1, ...) known of all bicycles."""
        h = 2 * self.steps.reshape(-1, *(1,) * (part.ndim - 1))
        return (part[1 : len(h) + 1] - part[len(h) + 1 :]) / h

    def apply(
        self,
        matrix: Part,
        at: NDArray[np.intp],
        x: Array | Complex,
        rows: list[int] | None = None,
    ) -> Complex:
        """dP x (m, p, rows, q) of a ``matrix`` P at the speeds with numbers ``at`` (m,), for ``x`` (m, columns, q)."""
        return self._sum(self._changes(matrix, at, x, rows), matrix, at, x, rows)

    def force(self, at: NDArray[np.intp], x: Complex, s: Complex) -> Complex:
        """(dF - s dE) x, shape (m, p, n, q), at the speeds ``at`` (m,), for states ``x`` (m, n, q) and ``s`` (m,)."""
        inertia = self.difference(self._all.mass), -s[:, None, None] * x
        return self._sum([*self._changes("dynamics", at, x), inertia], "dynamics", at, x)

    def _changes(self, matrix: Part, at: NDArray[np.intp], x: Array | Complex, rows: list[int] | None = None) -> Terms:
        """Derivative of the coefficient of each power of the speed v, and ``x`` times that power."""
        polynomial: SpeedPolynomial = getattr(self._all, matrix)
        v, selected = self.true_speeds[0, at, None, None], slice(None) if rows is None else rows
        return [(self.difference(part)[..., selected, :], v**power * x) for power, part in polynomial.items()]

    def _sum(
        self, terms: Terms, matrix: Part, at: NDArray[np.intp], x: Array | Complex, rows: list[int] | None = None
    ) -> Complex:
        """Sum of ``terms`` and of what the coordinates do to the ``matrix`` through the true speed."""
        product = _product(terms, at)
        if (speed_change := self.difference(self.true_speeds)).any():
            selected = slice(None) if rows is None else rows
            per_speed: SpeedPolynomial = getattr(self._first, matrix).derivative
            product += (per_speed(self.true_speeds[:1])[0, at][:, selected] @ x)[:, None] * speed_change.T[
                at, :, None, None
            ]
        return product


def _product(terms: Terms, at: NDArray[np.intp]) -> Complex:
    """Sum (m, p, rows, q) of matrices (p, 1 or k, rows, columns), times vectors (m, columns, q)."""
    parts, vectors = zip(*terms, strict=True)
    left = np.moveaxis(np.concatenate(parts, -1), 0, 1)  # (1 or k, p, rows, all columns)
    right = np.ascontiguousarray(np.concatenate(vectors, 1), complex).view(float)  # real and imaginary by turns
    speeds, p, rows, columns = left.shape
    flat = left.reshape(speeds, p * rows, columns)
    product = (flat if speeds == 1 else flat[at]) @ right
    return product.view(complex).reshape(len(at), p, rows, -1)


def flat_parts(number: Complex, slope: Complex) -> tuple[Array, Array]:
    """Real and imaginary parts, one after the other, of numbers (m,) and of their derivatives (m, p)."""
    parts = np.stack([number.real, number.imag], 1).ravel()
    return parts, np.stack([slope.real, slope.imag], 1).reshape(len(parts), slope.shape[1])
