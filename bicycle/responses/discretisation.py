"""Exact steps of many linear systems whose inputs are linear between samples."""

import numpy as np

from tyre.base.arrays import Array

ORDER = 10  # of the Taylor series; with arguments below 1/4 it errs by 1e-14


def discretised(state: Array, inputs: Array, steps: Array) -> tuple[Array, Array, Array]:
    """x_(k+1) = A x_k + G0 u_k + G1 u_(k+1), exact for inputs that are linear between samples.

    (Van Loan 1978, IEEE Trans. Automatic Control 23, 395-404.)

    Parameters
    ----------
    state : ndarray, shape (..., r, n, n)
        State matrices, 1/s.
    inputs : ndarray, shape (..., r, n, m)
        Input matrices.
    steps : ndarray, shape (r,)
        Sample times, s.

    Returns
    -------
    a, g0, g1 : ndarray, shape (..., r, n, n), (..., r, n, m) and (..., r, n, m)
        Not finite for a system that grows beyond all numbers within a step.
    """
    n, m = state.shape[-1], inputs.shape[-1]
    block = np.zeros((*state.shape[:-2], n + 2 * m, n + 2 * m))
    block[..., :n, :n] = state * steps[:, None, None]
    block[..., :n, n : n + m] = inputs * steps[:, None, None]
    block[..., n : n + m, n + m :] = np.eye(m)
    power = exponential(block)
    late = power[..., :n, n + m :]
    with np.errstate(invalid="ignore"):
        return power[..., :n, :n], power[..., :n, n : n + m] - late, late


def exponential(matrices: Array) -> Array:
    """Matrix exponentials by scaling, Taylor series and squaring, all at once.

    Parameters
    ----------
    matrices : ndarray, shape (..., n, n)

    Returns
    -------
    ndarray, shape (..., n, n)
    """
    size = float(np.abs(matrices).sum(-1).max())
    squarings = max(0, int(np.ceil(np.log2(max(4 * size, 1e-300))))) if np.isfinite(size) else 0
    scaled = matrices / 2.0**squarings
    unit = np.eye(matrices.shape[-1])
    total = unit + scaled / ORDER
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(ORDER - 1, 0, -1):
            total = unit + scaled @ total / k
        for _ in range(squarings):
            total = total @ total
    return np.asarray(total)
