"""Covariance of all uncertain parameters of a model, and critical speeds with what it leaves open."""

from collections.abc import Mapping, Sequence

import numpy as np

from bicycle.critical.critical_speeds import CriticalSpeed
from bicycle.default_sd import GIVEN, standard_deviations
from bicycle.model import Model
from bicycle.sensitivity.propagation import critical_speed_gradients, standard_deviation
from tyre.base.arrays import Array
from tyre.estimate import Estimate


def model_covariance(
    model: Model, given: Mapping[str, float] | None = None, *, assume: bool = False
) -> tuple[tuple[str, ...], Array]:
    """Parameters that are uncertain and their covariance: what was measured together is correlated.

    Parameters
    ----------
    model : Model
        Its ``covariance`` ties the numbers of a measured tyre to each other.
    given : mapping, optional
        1-sigma (SI) by key, as :func:`bicycle.default_sd.standard_deviations`; what is given stands alone.
    assume : bool
        Take the defaults of :mod:`bicycle.default_sd` for what nobody states; else that counts as exact.

    Returns
    -------
    names : tuple of str
        p of them.
    covariance : ndarray, shape (p, p)
        SI units, as :func:`bicycle.sensitivity.propagation.mode_sd` takes it.

    Raises
    ------
    InputError
        ``given`` names no parameter of the model, or a number that is not finite and >= 0.
    """
    deviations = standard_deviations(model, given, assume=assume)
    entering = model.evaluator.symbolic.parameters
    names = tuple(key for key, d in deviations.items() if d.sd > 0 and ("." in key or key in entering))
    covariance = np.diag([deviations[key].sd ** 2 for key in names])
    tied = np.array([key in model.covariance.names and deviations[key].origin != GIVEN for key in names], dtype=bool)
    both = np.outer(tied, tied)
    covariance[both] = model.covariance.among(names)[both]
    return names, covariance


def critical_speed_estimates(
    model: Model,
    critical: Sequence[CriticalSpeed],
    given: Mapping[str, float] | None = None,
    *,
    assume: bool = False,
) -> tuple[Estimate, ...]:
    """Critical speeds with the standard deviation that the model's own data leave, to first order.

    Parameters
    ----------
    model : Model
    critical : sequence of CriticalSpeed
        Of this model.
    given, assume
        As in :func:`model_covariance`.

    Returns
    -------
    tuple of Estimate
        m/s, with the effective degrees of freedom behind the standard deviation: infinite unless a tyre table states
        how well its own are known.

    Raises
    ------
    InputError
        As :func:`model_covariance`.
    """
    names, covariance = model_covariance(model, given, assume=assume)
    gradients = critical_speed_gradients(model, critical, names)
    return tuple(
        Estimate(c.speed, float(standard_deviation(g, covariance)), model.covariance.degrees_of_freedom(
            names, g, covariance
        ))
        for c, g in zip(critical, gradients, strict=True)
    )  # fmt: skip
