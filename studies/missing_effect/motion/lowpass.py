"""A first-order low-pass of sampled signals: tau dy/dt + y = u, exact for signals that are linear between samples."""

import numpy as np
from scipy.signal import lfilter

from tyre.base.arrays import Array

SAME = 12  # digits by which two ratios of sample time to time constant are one


def lowpassed(signal: Array, tau: Array, steps: Array) -> Array:
    """The signal behind the filter, which begins in step with it.

    Parameters
    ----------
    signal : ndarray, shape (T, K, R, ...)
        Samples of R runs for K time constants.
    tau : ndarray, shape (K,)
        Time constants, s. A small negative one, as a central difference asks for, is the continuation: 2 u - y(-tau).
    steps : ndarray, shape (R,)
        Sample times, s.

    Returns
    -------
    ndarray, shape (T, K, R, ...)
        What was filtered before the first sample is not known: :func:`begun` is what may be added.
    """
    found = signal.copy()
    ratio = np.round(np.abs(tau)[:, None] / steps, SAME)  # (K, R)
    for size in np.unique(ratio[ratio > 0]):
        k, r = np.nonzero(ratio == size)
        u = signal[:, k, r]
        keep = np.exp(-1 / size)
        late = size * (1 - keep)  # of the sample before, less what is kept of the output
        first = u[0] - size * (u[1] - u[0])
        state = first - (1 - late) * u[0]
        found[:, k, r] = lfilter([1 - late, late - keep], [1.0, -keep], u, axis=0, zi=state[None])[0]
    negative = tau < 0
    found[:, negative] = 2 * signal[:, negative] - found[:, negative]
    return found


def begun(length: int, tau: Array, steps: Array) -> Array:
    """How another state of the filter at the first sample dies away (T, K, R): exp(-t/tau), of size tau / (tau + h).

    Parameters
    ----------
    length : int
        Number of samples T.
    tau : ndarray, shape (K,)
        Time constants, s.
    steps : ndarray, shape (R,)
        Sample times h, s. With tau far below them there is no such state.
    """
    ratio = np.abs(tau)[:, None] / steps
    with np.errstate(divide="ignore", invalid="ignore"):
        decay = np.exp(-np.arange(length)[:, None, None] / ratio)
    return np.asarray(np.sign(tau)[:, None] * ratio / (1 + ratio) * np.nan_to_num(decay))
