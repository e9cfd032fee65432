"""An eigenvalue as an oscillation: z = -zeta |z| + i 2 pi f, with damped frequency f and damping ratio zeta.

>>> round(float(damping_ratio(-3 + 4j)), 3), round(float(frequency_hz(2j * np.pi)), 3)
(0.6, 1.0)
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tyre.base.arrays import Array, Complex


def frequency_hz(eigenvalues: ArrayLike) -> Array:
    """Damped frequency Im(z) / (2 pi), Hz; 0 for a real root, below 0 for the lower half of a pair.

    Parameters
    ----------
    eigenvalues : array_like, shape (...)
        1/s.

    Returns
    -------
    ndarray, shape (...)
    """
    return np.asarray(np.asarray(eigenvalues, complex).imag / (2 * np.pi))


def angular_frequency(hertz: ArrayLike) -> Array:
    """2 pi f, rad/s: the imaginary part of the upper half of a pair.

    Parameters
    ----------
    hertz : array_like, shape (...)
        f, Hz.

    Returns
    -------
    ndarray, shape (...)
    """
    return np.asarray(2 * np.pi * np.asarray(hertz, float))


def damping_ratio(eigenvalues: ArrayLike) -> Array:
    """Damping ratio -Re(z) / |z|; below 0 where the oscillation grows, NaN for a root at zero.

    Parameters
    ----------
    eigenvalues : array_like, shape (...)
        1/s; either half of a pair. (Of a real root the result is 1 or -1 and means nothing.)

    Returns
    -------
    ndarray, shape (...)
    """
    root = np.asarray(eigenvalues, complex)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(-root.real / np.abs(root))


def oscillating(eigenvalues: ArrayLike) -> Complex:
    """The upper halves of pairs, NaN in place of every other root.

    Parameters
    ----------
    eigenvalues : array_like, shape (...)
        1/s.

    Returns
    -------
    ndarray of complex, shape (...)
    """
    root = np.asarray(eigenvalues, complex)
    with np.errstate(invalid="ignore"):
        return np.where(root.imag > 0, root, complex(np.nan, np.nan))


def least_damping_ratio(eigenvalues: ArrayLike) -> Array:
    """Smallest damping ratio among oscillations, NaN where none oscillates.

    Parameters
    ----------
    eigenvalues : array_like, shape (..., n)
        1/s.

    Returns
    -------
    ndarray, shape (...)
    """
    root = np.asarray(eigenvalues, complex)
    ratio = np.where(root.imag > 0, damping_ratio(root), np.inf).min(-1)
    return np.where(np.isinf(ratio), np.nan, ratio)


def pair_damping_ratio(first: Complex, second: Complex) -> NDArray[np.float64]:
    """Damping ratio of the two roots of one mode, a pair or two real roots after it has split.

    -Re/|z| of a pair, -(a + b) / (2 sqrt(a b)) of two real roots of one sign (above 1 in size), otherwise NaN.

    Parameters
    ----------
    first : ndarray, shape (...)
        The upper half of a pair, or one real root; 1/s.
    second : ndarray, shape (...)
        The other real root, NaN for a pair; 1/s.

    Returns
    -------
    ndarray, shape (...)
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        overdamped = -(first + second).real / (2 * np.sqrt(np.maximum((first * second).real, 0)))
        ratio = np.where(first.imag > 0, damping_ratio(first), overdamped)
    return np.where(np.isfinite(ratio), ratio, np.nan)
