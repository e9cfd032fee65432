"""Linear propagation of uncertainty: from the derivatives of an eigenvalue to the sd of frequency and damping ratio.

With z = a + i b, f = b / (2 pi) and the damping ratio -a / abs(z):
df = db / (2 pi), d(ratio) = b (a db - b da) / abs(z)^3.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.critical import CriticalSpeed
from bicycle.model import Model
from bicycle.sensitivity import critical_speed_sensitivities, sensitivities
from tyre.errors import InputError, unknown

Array = NDArray[np.float64]


def frequency_gradient(slope: ArrayLike) -> Array:
    """Derivatives (Hz) of the damped frequency from those of the eigenvalue (1/s), any shape."""
    return np.asarray(np.asarray(slope, complex).imag / (2 * np.pi))


def damping_ratio_gradient(eigenvalue: complex, slope: ArrayLike) -> Array:
    """Derivatives of the damping ratio of an oscillation from those of its eigenvalue (1/s), any shape."""
    change: Any = np.asarray(slope, complex)
    a, b = eigenvalue.real, eigenvalue.imag
    return np.asarray(b * (a * change.imag - b * change.real) / abs(eigenvalue) ** 3)


def standard_deviation(gradient: ArrayLike, covariance: ArrayLike) -> Array:
    """First-order sd, sqrt(g' S g), of quantities with gradients (..., p) in parameters of covariance (p, p)."""
    g = np.asarray(gradient, float)
    return np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", g, np.asarray(covariance, float), g), 0.0))


def mode_sd(
    model: Model, speed: float, eigenvalue: complex, names: Sequence[str], covariance: ArrayLike
) -> tuple[float, float]:
    """Sd of frequency (Hz) and damping ratio of the oscillation nearest to ``eigenvalue`` at a speed (m/s).

    Parameters
    ----------
    names : sequence of str
        Uncertain parameters of the model, p of them.
    covariance : array_like, shape (p, p)
        Theirs, SI units.

    Raises
    ------
    InputError
        A parameter the model does not have.
    """
    found = sensitivities(model, [speed])
    at = int(np.abs(found.eigenvalues[0] - eigenvalue).argmin())
    slopes = np.array([found.of(name)[0, at] for name in names])
    root = complex(found.eigenvalues[0, at])
    gradients = (frequency_gradient(slopes), damping_ratio_gradient(root, slopes))
    frequency, damping = (float(standard_deviation(gradient, covariance)) for gradient in gradients)
    return frequency, damping


def critical_speed_sd(
    model: Model, critical: Sequence[CriticalSpeed], names: Sequence[str], covariance: ArrayLike
) -> Array:
    """Sd of critical speeds, m/s, shape (len(critical),); ``names`` and ``covariance`` as in :func:`mode_sd`.

    Raises
    ------
    InputError
        A parameter the model does not have, or a speed at which the equations switch.
    """
    found = critical_speed_sensitivities(model, critical)
    for name in names:
        if found and name not in found:
            raise InputError(unknown("parameter", name, found))
    return standard_deviation(np.array([found[name] for name in names]).T, covariance) if found else np.empty(0)
