"""A first-order lag, integrated exactly between equidistant samples."""

import numpy as np
from scipy.signal import lfilter

from tyre.base.arrays import Array


def first_order_lag(signal: Array, *, step: float, start: float | None = None) -> Array:
    """Solve y' + y = signal for an input that is linear between samples.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    step : float
        Distance between samples over the length of the lag (or time over its time constant), > 0.
    start : float, optional
        y at the first sample; by default the steady value, that of the signal.

    Returns
    -------
    ndarray, shape (n,)
        y, in the unit of the signal.
    """
    decay = np.exp(-step)
    ramp = (1.0 - decay) / step
    begin = ramp * signal[0] if start is None else start - (1.0 - ramp) * signal[0]
    lagged, _ = lfilter([1.0 - ramp, ramp - decay], [1.0, -decay], signal, zi=[begin])
    return np.asarray(lagged)
