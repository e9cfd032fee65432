"""Derivatives of the matrices E and F of a model with each of its free parameters."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bicycle.linear_model import LinearModel
from bicycle.model import Model
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array


@dataclass(frozen=True)
class MatrixSlope:
    """dE/dp (n, n) and dF/dp, a polynomial in v, of one parameter p in one speed range."""

    mass: Array
    dynamics: SpeedPolynomial


Slopes = Mapping[str, tuple[MatrixSlope, ...]]  # parameter -> its slope in every speed range


def matrix_slopes(model: Model, linear: LinearModel) -> Slopes:
    """Derivatives of the matrices with each free, finite parameter; what is tied to a parameter moves with it.

    Parameters
    ----------
    model : Model
        A bicycle with its effects.
    linear : LinearModel
        The same with numbers.

    Returns
    -------
    mapping of str to tuple of MatrixSlope
        One for every speed range; SI units per unit of the parameter.
    """
    evaluate, values = model.evaluator, model.parameters
    indicators = [tuple(float(at.upper <= speed) for speed in evaluate.switch_speeds(values)) for at in linear.ranges]
    tied = model.tied

    def slope(key: str) -> tuple[MatrixSlope, ...]:
        every = (evaluate.derivative(key, values, at) for at in indicators)
        return tuple(MatrixSlope(matrices.mass, matrices.dynamics) for matrices in every)

    slopes = {}
    for key, value in values.items():
        if key in tied or not np.isfinite(value) or (key not in evaluate.symbolic.parameters and "." not in key):
            continue
        followers = [name for name, leader in tied.items() if leader == key]
        slopes[key] = tuple(map(_added, zip(*map(slope, [key, *followers]), strict=True)))
    return slopes


def _added(terms: tuple[MatrixSlope, ...]) -> MatrixSlope:
    if len(terms) == 1:
        return terms[0]
    first = terms[0].dynamics
    powers = sorted({power for term in terms for power in term.dynamics})
    total = {power: np.sum([term.dynamics.coefficient(power) for term in terms], axis=0) for power in powers}
    return MatrixSlope(np.sum([term.mass for term in terms], axis=0), SpeedPolynomial(total, shape=first.shape))
