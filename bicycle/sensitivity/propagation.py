"""Linear propagation of uncertainty: from a covariance of parameters to sd of frequency, damping and critical speeds.

With z = a + i b, f = b / (2 pi) and the damping ratio -a / abs(z):
df = db / (2 pi), d(ratio) = b (a db - b da) / abs(z)^3.
"""

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.eigenvalues.oscillation import frequency_hz
from bicycle.model import Model
from bicycle.parameter_covariance import checked_covariance
from bicycle.parameter_key import entries_of
from bicycle.sensitivity.eigenvalue_derivatives import critical_speed_sensitivities, sensitivities
from tyre.base.arrays import Array
from tyre.base.errors import InputError, unknown


def frequency_gradient(slope: ArrayLike) -> Array:
    """Derivatives of the damped frequency, which is linear in the eigenvalue.

    Parameters
    ----------
    slope : array_like, shape (...)
        Derivatives of the eigenvalue, 1/s.

    Returns
    -------
    ndarray, shape (...)
        Hz.
    """
    return frequency_hz(slope)


def damping_ratio_gradient(eigenvalue: ArrayLike, slope: ArrayLike) -> Array:
    """Derivatives of the damping ratio of oscillations.

    Parameters
    ----------
    eigenvalue : array_like, shape (...)
        1/s.
    slope : array_like, shape (...)
        Their derivatives, 1/s; the two shapes broadcast.

    Returns
    -------
    ndarray, of the common shape
    """
    root: Any = np.asarray(eigenvalue, complex)
    change: Any = np.asarray(slope, complex)
    return np.asarray(root.imag * (root.real * change.imag - root.imag * change.real) / abs(root) ** 3)


def standard_deviation(gradient: ArrayLike, covariance: ArrayLike) -> Array:
    """First-order sd, sqrt(g' S g).

    Parameters
    ----------
    gradient : array_like, shape (..., p)
        Derivatives of each quantity with the parameters.
    covariance : array_like, shape (p, p)
        Of the parameters, SI units.

    Returns
    -------
    ndarray, shape (...)
    """
    g = np.asarray(gradient, float)
    return np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", g, np.asarray(covariance, float), g), 0.0))


def mode_gradients(model: Model, speed: ArrayLike, eigenvalue: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    """Derivatives of frequency (Hz) and damping ratio of oscillations with respect to parameters.

    Parameters
    ----------
    model : Model
        A bicycle with its effects.
    speed : array_like, shape () or (m,)
        m/s.
    eigenvalue : array_like, shape (...) or (m, ...)
        1/s; the root nearest to each is taken. NaN stands for a mode that is not there.
    names : sequence of str
        Free parameters of the model, p of them; ``effect.name`` of a property that differs between the wheels means
        both of them, moving by the same amount.

    Returns
    -------
    frequency, damping_ratio : ndarray, of the shape of ``eigenvalue`` and (p,)
        NaN where the root is real or not there.

    Raises
    ------
    InputError
        A parameter the model does not have.
    """
    v, wanted = np.atleast_1d(np.asarray(speed, float)), np.asarray(eigenvalue, complex)
    if np.ndim(speed) and wanted.shape[:1] != v.shape:
        raise InputError(f"{len(v)} speeds, but eigenvalues of shape {wanted.shape}; give a row for each speed")
    rows = wanted.reshape(len(v), -1)
    every = sensitivities(model, v)
    slopes = np.stack([slope_of(name, every.parameters, every.of) for name in names], -1)  # (m, n, p)
    distance = np.abs(every.eigenvalues[:, None, :] - rows[:, :, None])
    at = np.where(np.isnan(distance), np.inf, distance).argmin(-1)
    root: Any = np.take_along_axis(every.eigenvalues, at, 1)
    root = np.where(np.isnan(rows) | (root.imag == 0), np.nan, root)
    change = np.take_along_axis(slopes, at[..., None], 1)
    frequency = frequency_gradient(np.where(np.isnan(root)[..., None], np.nan * 1j, change))
    damping = damping_ratio_gradient(root[..., None], change)
    shape = (*wanted.shape, len(names))
    return frequency.reshape(shape), damping.reshape(shape)


def mode_sd(
    model: Model, speed: ArrayLike, eigenvalue: ArrayLike, names: Sequence[str], covariance: ArrayLike
) -> tuple[Array, Array]:
    """Sd of frequency (Hz) and damping ratio of oscillations at one speed or along speeds.

    Parameters
    ----------
    model, speed, eigenvalue, names
        As in :func:`mode_gradients`: speed () or (m,) in m/s, eigenvalue (...) or (m, ...) in 1/s.
    covariance : array_like, shape (p, p)
        Of the parameters, SI units; what rear and front tyre share stands off the diagonal.

    Returns
    -------
    frequency, damping_ratio : ndarray, of the shape of ``eigenvalue``
        NaN where the root is real or not there.

    Raises
    ------
    InputError
        A parameter the model does not have, or a covariance that is none.
    """
    spread = checked_covariance(names, covariance)
    frequency, damping = mode_gradients(model, speed, eigenvalue, names)
    return standard_deviation(frequency, spread), standard_deviation(damping, spread)


def critical_speed_gradients(model: Model, critical: Sequence[CriticalSpeed], names: Sequence[str]) -> Array:
    """Derivatives of critical speeds with respect to parameters.

    Parameters
    ----------
    model : Model
        A bicycle with its effects.
    critical : sequence of CriticalSpeed
        Critical speeds of this model, k of them.
    names : sequence of str
        As in :func:`mode_gradients`.

    Returns
    -------
    ndarray, shape (k, p)
        m/s per SI unit of the parameter.
    """
    if not critical:
        return np.empty((0, len(names)))
    slopes = critical_speed_sensitivities(model, critical)
    return np.stack([slope_of(name, slopes, slopes.__getitem__) for name in names], -1)


def critical_speed_sd(
    model: Model, critical: Sequence[CriticalSpeed], names: Sequence[str], covariance: ArrayLike
) -> Array:
    """Sd of critical speeds.

    First order knows no end of a critical speed: where two of them are a few sd apart, draws may lose both.

    Parameters
    ----------
    model, critical
        As in :func:`critical_speed_gradients`.
    names : sequence of str
        As in :func:`mode_gradients`.
    covariance : array_like, shape (p, p)
        Of the parameters, SI units.

    Returns
    -------
    ndarray, shape (len(critical),)
        m/s.

    Raises
    ------
    InputError
        A parameter the model does not have, or a covariance that is none.
    """
    spread = checked_covariance(names, covariance)
    return standard_deviation(critical_speed_gradients(model, critical, names), spread)


def slope_of(name: str, known: Collection[str], slope: Callable[[str], Any]) -> Any:
    """Derivative with respect to a parameter, or the sum over both wheels where it stands for both.

    Parameters
    ----------
    name : str
        As in :func:`mode_gradients`.
    known : collection of str
        Free parameters, by wheel.
    slope : callable
        The derivative (any shape) with respect to one of them.

    Raises
    ------
    InputError
        A parameter that is not known.
    """
    entries = entries_of(name, known)
    if not entries:
        raise InputError(unknown("parameter", name, known))
    return slope(entries[0]) if len(entries) == 1 else sum(slope(key) for key in entries)
