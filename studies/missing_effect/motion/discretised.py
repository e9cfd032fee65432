"""Linear models over one sample, whole batches at once: exact for torques that are linear between samples."""

import numpy as np

from tyre.base.arrays import Array


def discretised(state: Array, inputs: Array, steps: Array) -> tuple[Array, Array, Array]:
    """x_(k+1) = A x_k + G0 u_k + G1 u_(k+1), exact for a torque that is linear between samples (Van Loan 1978).

    Parameters
    ----------
    state, inputs : ndarray, shapes (..., R, n, n), (..., R, n, m)
        x' = state x + inputs u, of R runs.
    steps : ndarray, shape (R,)
        Sample times, s.

    Returns
    -------
    A, G0, G1 : ndarray, shapes (..., R, n, n), (..., R, n, m), (..., R, n, m)
    """
    n, m = state.shape[-1], inputs.shape[-1]
    block = np.zeros((*state.shape[:-2], n + 2 * m, n + 2 * m))
    block[..., :n, :n] = state * steps[:, None, None]
    block[..., :n, n : n + m] = inputs * steps[:, None, None]
    block[..., n : n + m, n + m :] = np.eye(m)
    power = exponential(block)
    late = power[..., :n, n + m :]
    with np.errstate(invalid="ignore"):  # a trial bicycle that falls at once
        return power[..., :n, :n], power[..., :n, n : n + m] - late, late


def exponential(matrices: Array) -> Array:
    """Exponentials of ``matrices`` (..., n, n) by scaling, Taylor and squaring, all at once.

    Order 10 with an argument below 1/4: error 1e-14.
    """
    size = float(np.abs(matrices).sum(-1).max())
    squarings = max(0, int(np.ceil(np.log2(max(4 * size, 1e-300))))) if np.isfinite(size) else 0
    scaled = matrices / 2.0**squarings
    unit = np.eye(matrices.shape[-1])
    total = unit + scaled / 10
    with np.errstate(over="ignore", invalid="ignore"):  # a trial bicycle that falls at once
        for k in range(9, 0, -1):
            total = unit + scaled @ total / k
        for _ in range(squarings):
            total = total @ total
    return np.asarray(total)
