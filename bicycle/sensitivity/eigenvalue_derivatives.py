"""How eigenvalues and critical speeds move with every parameter of a model.

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
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike, NDArray
from scipy import linalg

from bicycle.critical.critical_speeds import CriticalSpeed
from bicycle.derivation.evaluation import Matrices
from bicycle.eigenvalues.batch import eigenvalue_derivative_terms
from bicycle.eigenvalues.solvers import BATCH
from bicycle.linear_model import LinearModel
from bicycle.model import Model
from tyre.base.arrays import Array, Complex
from tyre.base.blas import one_blas_thread
from tyre.base.errors import InputError, unknown

Slopes = Mapping[str, tuple[Matrices, ...]]  # of E and F with each parameter, in every speed range

ON_AXIS = 1e-6  # a root on the imaginary axis, relative to the largest root
schur: Any = linalg.schur  # its stubs know no sort of complex values


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of every eigenvalue with respect to every parameter, along speed.

    Attributes
    ----------
    speeds : ndarray, shape (m,)
        m/s.
    eigenvalues : ndarray, shape (m, n)
        1/s, sorted by real then imaginary part.
    parameters : tuple of str
        Free and finite parameters: bicycle keys and ``effect.name[.wheel]``. A parameter that equals a bicycle
        parameter because none was given moves with it and is not listed.
    derivatives : ndarray, shape (m, n, parameters)
        1/s per SI unit of the parameter; the indicator of a speed at which the equations switch is held.
    with_speed : ndarray, shape (m, n)
        d(eigenvalue)/dv, 1/m.
    """

    speeds: Array
    eigenvalues: Complex
    parameters: tuple[str, ...]
    derivatives: Complex
    with_speed: Complex

    def of(self, key: str) -> Complex:
        """Derivatives (m, n) with respect to one parameter.

        Raises
        ------
        InputError
            The model has no such free parameter.
        """
        if key not in self.parameters:
            raise InputError(unknown("parameter", key, self.parameters))
        return np.asarray(self.derivatives[..., self.parameters.index(key)])


@dataclass(frozen=True)
class PairSensitivities:
    """Derivatives of sum (1/s) and product (1/s^2) of two roots with each parameter, smooth where the two meet."""

    sum: float
    product: float
    parameters: tuple[str, ...]
    of_sum: Array
    of_product: Array


def sensitivities(model: Model, speeds: ArrayLike) -> Sensitivities:
    """Derivatives of all eigenvalues at speeds (m,), batched over the speeds.

    Raises
    ------
    InputError
        A speed that the model does not allow.
    """
    linear = model.linear_model()
    v = np.atleast_1d(linear.check_speeds(speeds))
    slopes = matrix_slopes(model, linear)
    values, with_speed = (np.empty((len(v), linear.order), complex) for _ in range(2))
    found = np.empty((*values.shape, len(slopes)), complex)
    with one_blas_thread():
        for start in range(0, len(v), BATCH):
            part = slice(start, start + BATCH)
            _derivatives(linear, slopes, v[part], values[part], found[part], with_speed[part])
    return Sensitivities(v, values, tuple(slopes), found, with_speed)


def _derivatives(
    linear: LinearModel, slopes: Slopes, v: Array, values: Complex, found: Complex, with_speed: Complex
) -> None:
    """Fill in eigenvalues (m, n), derivatives (m, n, parameters) and derivatives with speed (m, n)."""
    roots, right = (part.astype(complex, copy=False) for part in np.linalg.eig(linear.state_matrix(v)))
    left = np.linalg.inv(right)
    order = np.lexsort((roots.imag, roots.real), axis=-1)
    values[:] = np.take_along_axis(roots, order, -1)
    place = np.argsort(order, axis=-1)
    upper = roots.imag >= 0  # of a pair, the other half is the conjugate
    for number, part in _parts(linear, v):
        k, i = np.nonzero(upper[part])
        if not k.size:
            continue
        at, own = part[k], linear.ranges[number].matrices
        root = roots[at, i]
        x = linear.scale * right[at, :, i]
        u = (left[at, i] / linear.scale) @ np.linalg.inv(own.mass)
        every, speed = [slope[number] for slope in slopes.values()], v[at]
        terms = [(-root, np.array([slope.mass for slope in every]))]
        for power in own.dynamics:
            terms.append((speed ** float(power), np.array([slope.dynamics[power] for slope in every])))
        pair = np.flatnonzero(root.imag > 0)
        targets = place[at, i], place[at[pair], i[pair] + 1]  # LAPACK puts the conjugate next to it
        derivatives = eigenvalue_derivative_terms(u, x, terms)
        found[at, targets[0]] = derivatives
        found[at[pair], targets[1]] = derivatives[pair].conj()
        terms = [(power * speed ** float(power - 1), m[None]) for power, m in own.dynamics.items() if power]
        along = eigenvalue_derivative_terms(u, x, terms)[:, 0] if terms else np.zeros(len(at), complex)
        with_speed[at, targets[0]], with_speed[at[pair], targets[1]] = along, along[pair].conj()


def pair_sensitivities(model: Model, speed: float, pair: tuple[complex, complex]) -> PairSensitivities:
    """Sum and product of the two roots nearest to ``pair`` at a speed (m/s), with derivatives.

    The two span an invariant subspace with right basis X and left basis U, U X = 1, on which the state matrix acts as
    B = U A X; the sum is tr B, the product det B, and dB = U dA X to first order in both.

    Raises
    ------
    InputError
        ``pair`` is neither two real roots nor a complex pair of the model.
    """
    linear = model.linear_model()
    v = linear.check_speeds([speed])
    matrix = linear.state_matrix(v)[0].astype(complex)
    values = np.linalg.eigvals(matrix)
    first = int(np.abs(values - pair[0]).argmin())
    second = int(np.where(np.arange(len(values)) == first, np.inf, np.abs(values - pair[1])).argmin())
    two, others = values[[first, second]], np.delete(values, [first, second])
    if abs(two.sum().imag) > ON_AXIS * np.abs(values).max() or not others.size:
        raise InputError(
            f"{two[0]:.4g} and {two[1]:.4g} 1/s are no pair; give two real roots or a root and its conjugate"
        )
    t, q, _ = schur(matrix, output="complex", sort=lambda z: np.abs(z - two).min() < np.abs(z - others).min())
    tie = linalg.solve_sylvester(t[:2, :2], -t[2:, 2:], t[:2, 2:])
    basis, dual = q[:, :2], np.hstack([np.eye(2), tie]) @ q.conj().T
    block = t[:2, :2]
    slopes = matrix_slopes(model, linear)
    number = next(number for number, part in _parts(linear, v) if part.size)
    mass = linear.ranges[number].matrices.mass
    u = np.linalg.solve(mass.T, (dual / linear.scale).T).T
    x = linear.scale[:, None] * basis
    changes = np.array(
        [
            u @ sum(float(speed) ** power * m for power, m in slope[number].dynamics.items()) @ x
            - u @ slope[number].mass @ x @ block
            for slope in slopes.values()
        ]
    )
    adjugate = np.array([[block[1, 1], -block[0, 1]], [-block[1, 0], block[0, 0]]])
    return PairSensitivities(
        float(two.sum().real), float(two.prod().real), tuple(slopes),
        np.trace(changes, axis1=1, axis2=2).real, np.trace(adjugate @ changes, axis1=1, axis2=2).real,
    )  # fmt: skip


def critical_speed_sensitivities(model: Model, critical: Sequence[CriticalSpeed]) -> dict[str, Array]:
    """d(critical speed)/d(parameter), m/s per SI unit: parameter -> one value for each of ``critical``.

    Where a root jumps across the axis because the equations switch, the critical speed is the switch speed.
    """
    found = sensitivities(model, [c.speed for c in critical])
    rows = np.empty((len(critical), len(found.parameters)))
    for k, c in enumerate(critical):
        values = found.eigenvalues[k]
        distance = np.abs(values - 2j * np.pi * c.frequency_hz)
        at = int(distance.argmin())
        if distance[at] <= ON_AXIS * np.abs(values).max():
            rows[k] = -found.derivatives[k, at].real / found.with_speed[k, at].real
        else:
            rows[k] = _switch_slopes(model, c.speed, found.parameters)
    return dict(zip(found.parameters, rows.T, strict=True))


def _switch_slopes(model: Model, speed: float, parameters: Sequence[str]) -> list[float]:
    symbolic, values = model.evaluator.symbolic, model.parameters
    speeds = model.evaluator.switch_speeds(values)
    switch = list(symbolic.switches.values())[int(np.abs(np.subtract(speeds, speed)).argmin())]
    known = {sp.Symbol(name, real=True): values[name] for name in symbolic.parameters}
    return [float(sp.diff(switch, sp.Symbol(key, real=True)).subs(known)) for key in parameters]


def matrix_slopes(model: Model, linear: LinearModel) -> Slopes:
    """Derivatives of the matrices of a model with each free, finite parameter, one set for every speed range."""
    evaluate, values = model.evaluator, model.parameters
    indicators = [
        tuple(float(piece.upper <= speed) for speed in evaluate.switch_speeds(values)) for piece in linear.ranges
    ]
    tied = model.tied

    def slope(key: str) -> tuple[Matrices, ...]:
        return tuple(evaluate.derivative(key, values, at) for at in indicators)

    found = {}
    for key, value in values.items():
        if key in tied or not np.isfinite(value) or (key not in evaluate.symbolic.parameters and "." not in key):
            continue
        followers = [name for name, leader in tied.items() if leader == key]
        found[key] = tuple(map(_added, zip(*map(slope, [key, *followers]), strict=True)))
    return found


def _added(terms: tuple[Matrices, ...]) -> Matrices:
    first, *rest = terms
    if not rest:
        return first
    powers = {power for term in terms for power in term.dynamics}

    def total(parts: list[Array]) -> Array:
        return np.asarray(np.sum(parts, axis=0))

    return Matrices(
        total([term.mass for term in terms]),
        {power: total([term.dynamics.get(power, np.zeros_like(first.mass)) for term in terms]) for power in powers},
        {}, {}, total([term.static_loads for term in terms]),
    )  # fmt: skip


def _parts(linear: LinearModel, v: Array) -> list[tuple[int, NDArray[np.intp]]]:
    """Which speeds lie in which speed range; a switch speed belongs to the range below it."""
    at = np.searchsorted([piece.upper for piece in linear.ranges], v)
    return [(number, np.flatnonzero(at == number)) for number in range(len(linear.ranges))]


def _between(u: Any, matrix: Array, x: Any) -> Complex:
    return np.asarray(np.einsum("mij,mji->mi", u @ matrix, x))
