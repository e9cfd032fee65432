"""Roots of a block of bicycles followed and named by the kernels, without the interpreter lock.

Needs numba (extra ``fast``). :mod:`bicycle.modal.batch` tells what is done.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.solvers import compiled
from bicycle.eigenvalues.vectors_kernel import decompose_stack
from bicycle.modal import anchor_kernel, answer_kernel, follow_kernel, naming_kernel, track_kernel
from bicycle.modal.block import Block
from bicycle.modal.compiled_ahead import compiled_ahead
from bicycle.modal.doubts import BEYOND, NO_VECTORS, NODES, STIFF
from bicycle.modal.naming_kernel import Named
from bicycle.modal.speed_limits import FASTEST_RATE, FASTEST_SPEED, REFERENCE_SPEED, SLOWEST_SPEED
from bicycle.modal.track_kernel import Decomposed, Track
from tyre.base.arrays import Array

BLOCK = 128  # bicycles tracked together: few nodes of each fill the lanes

Asked = Callable[[Track, NDArray[np.int64], Array], int]


def decompose(block: Block, owner: NDArray[np.int64], v: Array) -> Decomposed:
    """Roots of some bicycles at a speed each.

    Parameters
    ----------
    block : Block
    owner : ndarray of int, shape (k,)
        Indices of the bicycles.
    v : ndarray, shape (k,)
        m/s.
    """
    return _decomposed(*matrices(block, owner, v))


def _decomposed(stack: Array, change: Array) -> Decomposed:
    """Of matrices and their change, shape (k, n, n); one without eigenvalues has a doubt that is not a number."""
    k, n = stack.shape[:2]
    found = Decomposed(np.empty((k, n)), np.empty((k, n)), np.empty((2, k, n)), np.empty((k, n, n)), np.empty((k, n)))
    if decompose_stack(stack, change, *found) < 0:
        return found
    if k == 1:
        return Decomposed(*(np.zeros(part.shape) for part in found))._replace(doubt=np.full((k, n), np.nan))
    halves = [_decomposed(stack[half], change[half]) for half in (slice(k // 2), slice(k // 2, k))]  # none is finished
    return Decomposed(
        *(np.concatenate(parts, axis=1 if number == 2 else 0) for number, parts in enumerate(zip(*halves, strict=True)))
    )


def matrices(block: Block, owner: NDArray[np.int64], v: Array) -> tuple[Array, Array]:
    """A (1/s) and dA/dv (1/m) of some bicycles at a speed each, shape (k, n, n).

    Parameters
    ----------
    block : Block
    owner : ndarray of int, shape (k,)
        Indices of the bicycles.
    v : ndarray, shape (k,)
        m/s.
    """
    n = block.coefficients.shape[-1]
    stack, change = np.empty((len(v), n, n)), np.empty((len(v), n, n))
    track_kernel.assemble(block.coefficients, block.powers, owner, v, stack, change)
    return stack, change


def follow(
    block: Block, lowest: Array, highest: Array, asked: Asked | None = None, beside: Array | None = None
) -> tuple[Track, Decomposed]:
    """Track all bicycles where names are given, and from a lowest to a highest speed.

    Parameters
    ----------
    block : Block
    lowest, highest : ndarray, shape (m,)
        In units of speed.
    asked : callable, optional
        Asks for more nodes of a track where all is linked, as :func:`follow_kernel.link_steps` does.
    beside : ndarray, shape (m, k), optional
        Speeds at which roots are wanted beside the track, m/s.

    Returns
    -------
    Track
    Decomposed
        Roots ``beside``, by bicycle.
    """
    bicycles, n = block.coefficients.shape[1:3]
    own, v = block.grid(lowest, highest)
    grid = np.bincount(own, minlength=bicycles)
    track = track_kernel.empty_track(bicycles, max(NODES, 2 * int(grid.max())), n)
    track.grid[:] = grid
    beside = np.empty((bicycles, 0)) if beside is None else beside
    owners = np.concatenate([own, np.repeat(np.arange(bicycles), beside.shape[1])])
    both = decompose(block, owners, np.concatenate([v, beside.ravel()]))  # a call with few points costs as much as ten
    _add(block, track, owners[: len(v)], v, both.part(slice(len(v))), asked)
    owners, speeds = np.empty(track.v.size, np.int64), np.empty(track.v.size)
    count = anchor_kernel.ask_between(track, block.unit, owners, speeds)
    add(block, track, owners[:count], speeds[:count], asked)
    there = np.arange(bicycles), np.abs(track.v / block.unit[:, None] - REFERENCE_SPEED).argmin(1)
    fastest = np.hypot(track.re[there], track.im[there]).max(1)
    track.status[~(fastest * block.unit <= 0.99 * FASTEST_RATE * block.kind.gravity)] = STIFF
    return track, both.part(slice(len(v), None))


def add(block: Block, track: Track, owner: NDArray[np.int64], v: Array, asked: Asked | None = None) -> None:
    """Add nodes at speeds ``v`` (k,) of bicycles ``owner`` (k,) to a track, and those that these ask for.

    Parameters
    ----------
    block : Block
    track : Track
    owner : ndarray of int, shape (k,)
        Indices of the bicycles.
    v : ndarray, shape (k,)
        m/s.
    asked : callable, optional
        As of :func:`follow`.
    """
    if len(v):
        _add(block, track, owner, v, decompose(block, owner, v), asked)


def _add(
    block: Block, track: Track, owner: NDArray[np.int64], v: Array, at: Decomposed, asked: Asked | None
) -> None:  # fmt: skip
    """As :func:`add`, with what is known ``at`` these speeds."""
    room = track.v.size * 3
    owners, speeds = np.empty(room, np.int64), np.empty(room)
    while True:
        follow_kernel.place(track, owner, v, *at)
        count = follow_kernel.link_steps(track, block.unit, owners, speeds)
        if not count and asked:
            count = asked(track, owners, speeds)
        if not count:
            return
        owner, v = owners[:count].copy(), speeds[:count].copy()
        at = decompose(block, owner, v)


def name(block: Block, track: Track, speeds: Array) -> Named:
    """Name all roots of a track of these bicycles; it gets the nodes it needs around ``speeds`` (m, k), m/s.

    Parameters
    ----------
    block : Block
    track : Track
    speeds : ndarray, shape (m, k)
        m/s, NaN for none.
    """
    bicycles, nodes, n = track.re.shape
    found = Named(
        np.zeros((bicycles, nodes, n), np.int64), np.zeros((bicycles, nodes, n), np.int64),
        np.zeros((bicycles, n), np.int64), np.zeros(bicycles),
    )  # fmt: skip
    owners, more = np.empty(track.v.size + 1, np.int64), np.empty(track.v.size + 1)
    todo = np.ones(bicycles, np.int64)
    while todo.any():
        naming_kernel.name_all(track, block.unit, block.kind.roles, found, todo)
        count = answer_kernel.ask_more(track, found, speeds, block.unit, owners, more)
        todo[:] = 0
        todo[owners[:count]] = 1
        if count:
            add(block, track, owners[:count].copy(), more[:count].copy())
    return found


def name_block(
    block: Block, speeds: Array
) -> tuple[NDArray[np.complex128], NDArray[np.int64], Array, NDArray[np.int64], NDArray[np.int16]]:
    """Values, names as bits, anchors, all names and status of :class:`bicycle.modal.batch.NamedRoots`.

    Parameters
    ----------
    block : Block
    speeds : ndarray, shape (m, k)
        Of each bicycle, rising, m/s.
    """
    bicycles, k = speeds.shape
    reach = speeds / block.unit[:, None]
    with compiled_ahead():
        track, _ = follow(block, reach.min(1), reach.max(1))
    slowest = SLOWEST_SPEED if block.kind.singular else 0.0
    track.status[(reach < slowest).any(1) | (reach > FASTEST_SPEED).any(1)] = BEYOND
    found = name(block, track, speeds)
    values = np.full((bicycles, k, block.coefficients.shape[-1]), complex(np.nan, np.nan))
    known = np.flatnonzero(~np.isin(track.status, (STIFF, NO_VECTORS)))  # others may not even be finite
    there = matrices(block, np.repeat(known, k), speeds[known].ravel())[0]
    values[known] = compiled(there).reshape(-1, *values.shape[1:])
    bits = np.zeros(values.shape, np.int64)
    answer_kernel.answer(track, found, block.unit, speeds, values.real.copy(), values.imag.copy(), bits)
    every = np.bitwise_or.reduce(1 << found.name, axis=1)
    return values, bits, found.anchor, every, track.status
