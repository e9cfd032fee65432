"""Derivatives of eigenvalues and critical speeds with every parameter of a model.

From E x' = F(v) x with left and right eigenvectors u, x of an eigenvalue z,

    dz/dp = u^H (dF/dp - z dE/dp) x / (u^H E x)        (Lancaster 1964, Numerische Mathematik 6, 377-387),

and a critical speed moves by dv/dp = -Re(dz/dp) / Re(dz/dv). Where two roots meet, each has an infinite derivative
while their sum and product move smoothly: :func:`pair_sensitivities`.

>>> from bicycle import Model, load_bicycle
>>> found = sensitivities(Model(load_bicycle("benchmark")), [5.0])
>>> found.of("c").shape
(1, 4)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from bicycle.equations.evaluation import Matrices
from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.eigen import BATCH, eigensystem
from bicycle.model.model import Model
from bicycle.model.state_space import LinearModel
from bicycle.stability.critical import CriticalSpeed
from tyre.ground.arrays import Array, Complex
from tyre.ground.door import library
from tyre.ground.errors import InputError, unknown
from tyre.ground.workers import one_blas_thread

sp = library("sympy")

ON_AXIS = 1e-6  # a root on the imaginary axis, relative to the largest root
schur: Any = linalg.schur  # its stubs know no sort of complex values


Slopes = Mapping[str, tuple[Matrices, ...]]  # parameter p -> dE/dp, dF/dp ... in every speed range


def matrix_slopes(model: Model, linear: LinearModel) -> Slopes:
    """Derivatives of the matrices with each free, finite parameter, one for every speed range."""
    evaluate, values = model.evaluator, model.parameters
    indicators = [tuple(float(at.upper <= speed) for speed in evaluate.switch_speeds(values)) for at in linear.ranges]
    tied = model.tied

    slopes = {}
    for key, value in values.items():
        if key in tied or not np.isfinite(value) or (key not in evaluate.symbolic.parameters and "." not in key):
            continue
        together = [key, *(name for name, leader in tied.items() if leader == key)]
        slopes[key] = tuple(
            _sum_matrices([evaluate.derivative(parameter, values, at) for parameter in together]) for at in indicators
        )
    return slopes


def _sum_matrices(terms: Sequence[Matrices]) -> Matrices:
    """The sum of the mass matrices E and dynamics F of several ``terms``."""
    first = terms[0].dynamics
    total = {power: sum(term.dynamics[power] for term in terms) for power in first}
    mass = np.asarray(sum(term.mass for term in terms))
    return replace(terms[0], mass=mass, dynamics=SpeedPolynomial(total, shape=first.shape))


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of every eigenvalue with respect to every parameter, along speed."""

    speeds: Array  # (m,), m/s
    eigenvalues: Complex  # (m, n), 1/s, sorted by real then imaginary part
    parameters: tuple[str, ...]  # free and finite parameters: bicycle keys and ``effect.name[.wheel]``
    derivatives: Complex  # (m, n, parameters), 1/s per SI unit of the parameter; indicators of switches are held
    d_dspeed: Complex  # (m, n), d(eigenvalue)/dv, 1/m

    def of(self, key: str) -> Complex:
        """Derivatives (m, n) with respect to one parameter."""
        if key not in self.parameters:
            raise InputError(unknown("parameter", key, self.parameters))
        return np.asarray(self.derivatives[..., self.parameters.index(key)])


@dataclass(frozen=True)
class PairSensitivities:
    """Derivatives of sum (1/s) and product (1/s^2) of two roots with each parameter, smooth where the two meet."""

    sum: float  # 1/s
    product: float  # 1/s^2
    parameters: tuple[str, ...]  # p bicycle keys and ``effect.name[.wheel]``
    of_sum: Array  # (p,), 1/s per SI unit of the parameter
    of_product: Array  # (p,), 1/s^2 per SI unit of the parameter


def sensitivities(model: Model, speeds: ArrayLike) -> Sensitivities:
    """Derivatives of all eigenvalues with respect to every free parameter, batched over the speeds."""
    linear = model.linear_model()
    v = np.atleast_1d(linear.check_speeds(speeds))
    slopes = matrix_slopes(model, linear)
    values, d_dspeed = (np.empty((len(v), linear.order), complex) for _ in range(2))
    derivatives = np.empty((*values.shape, len(slopes)), complex)
    with one_blas_thread():
        for start in range(0, len(v), BATCH):
            part = slice(start, start + BATCH)
            _derivatives(linear, slopes, v[part], values[part], derivatives[part], d_dspeed[part])
    return Sensitivities(v, values, tuple(slopes), derivatives, d_dspeed)


def _derivatives(
    linear: LinearModel, slopes: Slopes, v: Array, values: Complex, derivatives: Complex, d_dspeed: Complex
) -> None:
    """Fill in eigenvalues (m, n), derivatives (m, n, parameters) and derivatives with speed (m, n)."""
    roots, right, left = eigensystem(linear.state_matrix(v))
    order = np.lexsort((roots.imag, roots.real), axis=-1)
    values[:] = np.take_along_axis(roots, order, -1)
    place = np.argsort(order, axis=-1)
    upper = roots.imag >= 0  # of a pair, the other half is the conjugate
    for number, part in linear.by_range(v):
        k, i = np.nonzero(upper[part])
        at, matrices = part[k], linear.ranges[number].matrices
        root = roots[at, i]
        x = linear.scale * right[at, :, i]
        u = (left[at, i] / linear.scale) @ np.linalg.inv(matrices.mass)
        range_slopes, speed = [slope[number] for slope in slopes.values()], v[at]
        terms: list[tuple[Any, Array]] = [(-root, np.array([slope.mass for slope in range_slopes]))]
        for power in matrices.dynamics:
            terms.append((speed ** float(power), np.array([slope.dynamics[power] for slope in range_slopes])))
        pair = np.flatnonzero(root.imag > 0)
        targets = place[at, i], place[at[pair], i[pair] + 1]  # LAPACK puts the conjugate next to it
        slope = eigenvalue_derivative_terms(u, x, terms)
        derivatives[at, targets[0]] = slope
        derivatives[at[pair], targets[1]] = slope[pair].conj()
        terms = [(speed ** float(power), matrix[None]) for power, matrix in matrices.dynamics.derivative.items()]
        along = eigenvalue_derivative_terms(u, x, terms)[:, 0] if terms else np.zeros(len(at), complex)
        d_dspeed[at, targets[0]], d_dspeed[at[pair], targets[1]] = along, along[pair].conj()


def pair_sensitivities(model: Model, speed: float, pair: tuple[complex, complex]) -> PairSensitivities:
    """Sum (1/s) and product (1/s^2) of two roots at a ``speed`` (m/s), and their derivatives by each parameter.

    The two span an invariant subspace with right basis X and left basis U, U X = 1, on which the state matrix acts as B
    = U A X; the sum is tr B, the product det B, and dB = U dA X to first order in both.
    """
    linear = model.linear_model()
    v = linear.check_speeds([speed])
    matrix = linear.state_matrix(v)[0].astype(complex)
    values = np.linalg.eigvals(matrix)
    first = int(np.abs(values - pair[0]).argmin())
    second = int(np.where(np.arange(len(values)) == first, np.inf, np.abs(values - pair[1])).argmin())
    two, further_values = values[[first, second]], np.delete(values, [first, second])
    if abs(two.sum().imag) > ON_AXIS * np.abs(values).max() or not further_values.size:
        raise InputError(
            f"{two[0]:.4g} and {two[1]:.4g} 1/s are no pair; give two real roots or a root and its conjugate"
        )
    t, q, _ = schur(matrix, output="complex", sort=lambda z: np.abs(z - two).min() < np.abs(z - further_values).min())
    tie = linalg.solve_sylvester(t[:2, :2], -t[2:, 2:], t[:2, 2:])
    basis, dual = q[:, :2], np.hstack([np.eye(2), tie]) @ q.conj().T
    block = t[:2, :2]
    slopes = matrix_slopes(model, linear)
    ((number, _),) = linear.by_range(v)
    mass = linear.ranges[number].matrices.mass
    u = np.linalg.solve(mass.T, (dual / linear.scale).T).T
    x = linear.scale[:, None] * basis
    changes = np.array(
        [u @ slope[number].dynamics(float(speed)) @ x - u @ slope[number].mass @ x @ block for slope in slopes.values()]
    )
    adjugate = np.array([[block[1, 1], -block[0, 1]], [-block[1, 0], block[0, 0]]])
    return PairSensitivities(
        float(two.sum().real),
        float(two.prod().real),
        tuple(slopes),
        np.trace(changes, axis1=1, axis2=2).real,
        np.trace(adjugate @ changes, axis1=1, axis2=2).real,
    )


def critical_speed_sensitivities(model: Model, critical: Sequence[CriticalSpeed]) -> dict[str, Array]:
    """d(critical speed)/d(parameter), m/s per SI unit of the parameter."""
    at_each = sensitivities(model, [crossing.speed for crossing in critical])
    rows = np.empty((len(critical), len(at_each.parameters)))
    for k, crossing in enumerate(critical):
        values = at_each.eigenvalues[k]
        distance = np.abs(values - 1j * crossing.angular_frequency)
        at = int(distance.argmin())
        if distance[at] <= ON_AXIS * np.abs(values).max():
            rows[k] = -at_each.derivatives[k, at].real / at_each.d_dspeed[k, at].real
        else:
            rows[k] = _switch_slopes(model, crossing.speed, at_each.parameters)
    return dict(zip(at_each.parameters, rows.T, strict=True))


def _switch_slopes(model: Model, speed: float, parameters: Sequence[str]) -> list[float]:
    symbolic, values = model.evaluator.symbolic, model.parameters
    speeds = model.evaluator.switch_speeds(values)
    switch = list(symbolic.switches.values())[int(np.abs(np.subtract(speeds, speed)).argmin())]
    numbers = {sp.Symbol(name, real=True): values[name] for name in symbolic.parameters}
    return [float(sp.diff(switch, sp.Symbol(key, real=True)).subs(numbers)) for key in parameters]


def eigenvalue_derivative_terms(left: Complex, right: Complex, terms: Sequence[tuple[Any, Array]]) -> Complex:
    """Sum over terms of weight u M_p x, (k, p), for k eigenvalues and p parameters: one real product for all."""
    places = [np.nonzero((stack != 0).any(0)) for _, stack in terms]
    table = np.concatenate([stack[:, i, j].T for (_, stack), (i, j) in zip(terms, places, strict=True)])
    result = np.empty((len(left), len(terms[0][1])), complex)
    products = np.empty((2, len(table), BATCH))  # real and imaginary part; an eigenvalue is a column
    for start in range(0, len(left), BATCH):
        k = slice(start, start + BATCH)
        u, x = (np.ascontiguousarray(vectors[k].T) for vectors in (left, right))
        count_done = 0
        for (weight, _), (i, j) in zip(terms, places, strict=True):
            product = (weight[k] * u)[i]
            product *= x[j]
            rows = slice(count_done, count_done := count_done + len(i))
            products[0, rows, : u.shape[1]], products[1, rows, : u.shape[1]] = product.real, product.imag
        result[k].real, result[k].imag = (part[:, : u.shape[1]].T @ table for part in products)
    return result
