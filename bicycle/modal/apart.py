"""Whether roots that are linked across a step keep apart inside it, in plain numpy for many steps at once.

Two roots meet where their discriminant (a - b)^2 is zero. It is smooth where roots are not, so that Hermite's cubic of
the two ends tells whether it may be zero in between: two real roots that are a pair for a moment, a pair that splits
for a moment, two pairs of which it is not plain whether they cross or turn back.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bicycle.modal.matching import TWIN
from tyre.base.arrays import Array, Complex

Number = TypeVar("Number", Array, Complex)
FAR = 3.0  # a discriminant is at least so many misses away from zero
AWAY = 6.0  # roots so many times farther apart than they move need no further look
BLURRED = 20.0  # of the distance at which two roots count as one: nearer, rounding may decide
LOOKS = 8  # places at which two pairs are looked at in a step


def keep_apart(a: Complex, z: Complex, rise_a: Complex, rise_z: Complex, free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether no two roots can meet in a step, beyond those two that it is known for.

    Parameters
    ----------
    a, z : complex ndarray, shape (k, n)
        Roots at both ends of k steps, in the same order, 1/s.
    rise_a, rise_z : complex ndarray, shape (k, n)
        Their slopes there times the width of the step, 1/s.
    free : ndarray of bool, shape (k, n)
        Roots that are looked at: not those that are known to meet.

    Returns
    -------
    ndarray of bool, shape (k,)
    """
    blur = BLURRED * TWIN * np.maximum(np.abs(a).max(1), np.abs(z).max(1))
    apart = np.ones(len(a), bool)
    upper, real = free & (a.imag > 0), free & (a.imag == 0)
    k, i = np.nonzero(upper)
    _mark(apart, k, _stay(a.imag[k, i], z.imag[k, i], rise_a.imag[k, i], rise_z.imag[k, i], blur[k]))
    first, second = np.triu_indices(a.shape[1], 1)
    for alike, stay in ((real, _real_stay), (upper, _pairs_stay)):
        k, c = np.nonzero(alike[:, first] & alike[:, second])
        i, j = first[c], second[c]
        distance, later, rise, later_rise = (x[k, i] - x[k, j] for x in (a, z, rise_a, rise_z))
        _mark(apart, k, stay(distance, later, rise, later_rise, blur[k]))
    return apart


def _mark(apart: NDArray[np.bool_], step: NDArray[np.intp], stay: NDArray[np.bool_]) -> None:
    apart[step[~stay]] = False


def _real_stay(a: Complex, z: Complex, rise_a: Complex, rise_z: Complex, blur: Array) -> NDArray[np.bool_]:
    return _stay(a.real, z.real, rise_a.real, rise_z.real, blur)


def _stay(a: Array, z: Array, rise_a: Array, rise_z: Array, blur: Array) -> NDArray[np.bool_]:
    """Whether distances with these ends and slopes, and their squares, stay away from zero."""
    far = np.minimum(np.abs(a), np.abs(z)) >= blur
    slow = (AWAY * np.abs(rise_a) < np.abs(a)) & (AWAY * np.abs(rise_z) < np.abs(z)) & (np.abs(z - a) < 0.5 * np.abs(a))
    k = np.flatnonzero(far & ~slow)
    a, z, rise_a, rise_z = (x[k] for x in (a, z, rise_a, rise_z))
    square = a * a, z * z, 2 * a * rise_a, 2 * z * rise_z
    far[k] = _least(*square) > blur[k] ** 2 + FAR * _miss(*square)
    return far


def _pairs_stay(a: Complex, z: Complex, rise_a: Complex, rise_z: Complex, blur: Array) -> NDArray[np.bool_]:
    """Whether distances of two upper halves with these ends and slopes stay away from zero."""
    first, last = np.abs(a), np.abs(z)
    far = np.minimum(first, last) >= blur
    slow = (AWAY * np.abs(rise_a) < first) & (AWAY * np.abs(rise_z) < last) & (np.abs(z - a) < 0.5 * first)
    k = np.flatnonzero(far & ~slow)
    a, z, rise_a, rise_z = (x[k] for x in (a, z, rise_a, rise_z))
    square = a * a, z * z, 2 * a * rise_a, 2 * z * rise_z
    off = blur[k] ** 2 + FAR * _miss(*square)
    at = np.linspace(0, 1, LOOKS + 1)[:, None]
    far[k] = (np.abs(hermite(*square, at)) > off).all(0)
    return far


def hermite(a: Number, z: Number, rise_a: Number, rise_z: Number, s: Array) -> Number:
    """Cubic of s in 0..1 with these ends and slopes, real or complex.

    Parameters
    ----------
    a, z, rise_a, rise_z : ndarray, shape (...)
        Ends, and slopes times the width.
    s : ndarray, shape (...)
        No unit.
    """
    return (1 + 2 * s) * (1 - s) ** 2 * a + s**2 * (3 - 2 * s) * z + s * (1 - s) * ((1 - s) * rise_a - s * rise_z)


def _least(a: Array, z: Array, rise_a: Array, rise_z: Array) -> Array:
    """Smallest value of the cubic of :func:`hermite` between its ends."""
    square, cube = 3 * (z - a) - 2 * rise_a - rise_z, rise_a + rise_z - 2 * (z - a)
    least = np.minimum(a, z)
    with np.errstate(all="ignore"):
        root = np.sqrt(square * square - 3 * cube * rise_a)
        for sign in (-1, 1):
            s = -rise_a / (square + sign * root)
            inside = (s > 0) & (s < 1)
            least = np.where(inside, np.minimum(least, hermite(a, z, rise_a, rise_z, s)), least)
    return least


def _miss(a: Number, z: Number, rise_a: Number, rise_z: Number) -> Array:
    """How far what both ends foretell for the middle differs."""
    return np.abs(a + 0.5 * rise_a - z + 0.5 * rise_z)
