"""One critical speed followed through many bicycles at once, each solved by Newton from where it is expected."""

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import decompose
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array

NEWTON_STEPS = 25
LONGEST_STEP = 0.1  # of the speed


def follow_crossing(
    polynomials: SpeedPolynomial, speeds: Array, angular_frequency: Array, *, destabilising: bool
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Where one root of each bicycle crosses the imaginary axis, by Newton with d(lambda)/dv.

    Parameters
    ----------
    polynomials : SpeedPolynomial, shape (m, n, n)
        Scaled state matrices of the bicycles, 1/s.
    speeds : ndarray, shape (m,)
        Where to begin, m/s.
    angular_frequency : ndarray, shape (m,)
        Imaginary part of the root there, rad/s; 0 of a real root.
    destabilising : bool
        Whether the real part of the crossing that is meant rises with the speed.

    Returns
    -------
    speeds, angular_frequency : ndarray, shape (m,)
        m/s and rad/s.
    there : ndarray of bool, shape (m,)
        False where no such crossing in the same direction was reached.
    """
    v, root = speeds.copy(), 1j * angular_frequency
    size, here, slope = np.zeros(len(v)), np.zeros(len(v), complex), np.zeros(len(v), complex)
    moving = np.arange(len(v))
    for _ in range(NEWTON_STEPS):
        values, slopes, _, _ = decompose(polynomials.take(moving), v[moving])
        at = np.abs(values - root[moving, None]).argmin(1)[:, None]
        here[moving], slope[moving] = (np.take_along_axis(part, at, 1)[:, 0] for part in (values, slopes))
        size[moving] = np.abs(values).max(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -here[moving].real / slope[moving].real
        longest = LONGEST_STEP * v[moving]
        step = np.where(np.isfinite(step), np.clip(step, -longest, longest), 0.0)
        v[moving], root[moving] = v[moving] + step, here[moving] + slope[moving] * step
        moving = moving[np.abs(step) > 1e-13 * v[moving]]
        if not moving.size:
            break
    kind = np.where(angular_frequency > 0, here.imag > 1e-9 * size, np.abs(here.imag) <= 1e-9 * size)
    there = kind & (np.abs(here.real) <= 1e-9 * size) & ((slope.real > 0) == destabilising)
    return v, np.abs(here.imag), there
