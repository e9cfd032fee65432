"""Exact steps of many linear systems whose inputs are linear between samples, and their way through all samples."""

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


def marched(step: Array, push: Array, start: Array) -> Array:
    """States x_(k+1) = A x_k + p_k of many systems from their ``start``, block by block and not sample by sample.

    About sqrt(T) samples make a block; all blocks are marched from rest at once, then their starts are carried along
    (a two-level prefix sum: 2 sqrt(T) products of matrices in place of T products with vectors).

    Parameters
    ----------
    step : ndarray, shape (..., n, n)
        State matrices A of one sample.
    push : ndarray, shape (..., n, T - 1)
        What the inputs add.
    start : ndarray, shape (..., n)

    Returns
    -------
    ndarray, shape (..., n, T)
    """
    count = push.shape[-1] + 1
    block = int(np.ceil(np.sqrt(count)))
    blocks = -(-count // block)
    lead = np.broadcast_shapes(step.shape[:-2], push.shape[:-2], start.shape[:-1])
    n = step.shape[-1]
    pushed = np.zeros((*lead, n, blocks * block))
    pushed[..., : count - 1] = push
    pushed = np.moveaxis(pushed.reshape(*lead, n, blocks, block), -1, 0)
    both = np.zeros((block + 1, *lead, n, blocks + n))  # the blocks from rest, and behind them the powers of A
    rest, powers = both[..., :blocks], both[..., blocks:]
    powers[0] = np.eye(n)
    begin = np.empty((blocks, *lead, n, 1))
    begin[0] = start[..., None]
    for j in range(block):
        np.matmul(step, both[j], out=both[j + 1])
        rest[j + 1] += pushed[j]
    for k in range(blocks - 1):
        begin[k + 1] = powers[block] @ begin[k] + rest[block, ..., k : k + 1]
    states = rest[:block] + powers[:block] @ np.moveaxis(begin[..., 0], 0, -1)
    return np.moveaxis(states, 0, -1).reshape(*lead, n, blocks * block)[..., :count]


def from_rest(step: Array, known: Array, across: Array, seen: Array) -> Array:
    """Outputs of systems that begin at rest under many pushes, each a sum of the same known signals.

    As :func:`marched`, but all pushes of a system are marched in one product, and no states are kept.

    Parameters
    ----------
    step : ndarray, shape (r, n, n)
        State matrices A of one sample.
    known : ndarray, shape (r, T - 1, q)
        Signals of each system.
    across : ndarray, shape (r, q, k, n)
        What each signal adds to the states in each of the k pushes.
    seen : ndarray, shape (r, c, n)
        Output matrices.

    Returns
    -------
    ndarray, shape (r, c, T, k)
    """
    systems, count, q = known.shape[0], known.shape[1] + 1, known.shape[2]
    k, n = across.shape[2:]
    block = int(np.ceil(np.sqrt(count)))
    blocks = -(-count // block)
    padded = np.zeros((systems, blocks * block, q))
    padded[:, : count - 1] = known
    beside = np.ascontiguousarray(np.moveaxis(padded.reshape(systems, blocks, block, q), 2, 0))[:, :, None]
    across = np.ascontiguousarray(np.moveaxis(across, -1, 1))  # states lead, pushes stay neighbours: wide products
    rest, power = np.zeros((systems, n, blocks * k)), np.broadcast_to(np.eye(n), step.shape)
    y = np.empty((block, systems, seen.shape[1], blocks * k))
    powers = np.empty((block, *seen.shape))  # as they are seen
    for j in range(block):
        np.matmul(seen, rest, out=y[j])
        np.matmul(seen, power, out=powers[j])
        rest, power = step @ rest, step @ power
        rest += (beside[j] @ across).reshape(rest.shape)
    ends, begin = rest.reshape(systems, n, blocks, k), np.zeros((systems, n, blocks, k))
    for b in range(blocks - 1):
        begin[:, :, b + 1] = power @ begin[:, :, b] + ends[:, :, b]
    y += powers @ begin.reshape(rest.shape)
    y = y.reshape(block, systems, -1, blocks, k).transpose(1, 2, 3, 0, 4)
    return y.reshape(systems, -1, blocks * block, k)[:, :, :count]


def powers_of(step: Array, count: int) -> Array:
    """Free responses to unit starts, A^k for k = 0 .. ``count`` - 1, by doubling.

    Parameters
    ----------
    step : ndarray, shape (..., n, n)
        State matrices A of one sample.
    count : int
        T, the number of samples.

    Returns
    -------
    ndarray, shape (..., n, T, n)
        State, sample, unit start.
    """
    n = step.shape[-1]
    found = np.empty((*step.shape[:-1], count, n))
    found[..., 0, :] = np.eye(n)
    known, leap = 1, step
    while known < count:
        more = min(known, count - known)
        flat = found[..., :more, :].reshape(*step.shape[:-1], more * n)
        found[..., known : known + more, :] = (leap @ flat).reshape(*step.shape[:-1], more, n)
        known, leap = known + more, leap @ leap
    return found
