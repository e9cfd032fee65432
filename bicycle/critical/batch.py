"""Critical speeds of many bicycles at once, with names, without the interpreter lock; needs numba (extra ``fast``).

All roots are tracked as for their names, and every step is looked at for crossings: it has none beyond doubt, one
beyond doubt, or it is halved. Newton with d(lambda)/dv sharpens them. A bicycle with a step that stays in doubt, a
crossing that rounding blurs, or two that nearly coincide gets a status instead of an answer, as in
:mod:`bicycle.modal.batch`; :func:`bicycle.critical.critical_speeds.critical_speeds` then decides.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.critical import crossing_kernel
from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.modal import answer_kernel, batch, doubts
from bicycle.modal.block import START, Block
from bicycle.modal.compiled_ahead import compiled_ahead
from bicycle.modal.compiled_batch import BLOCK, decompose, follow, name
from bicycle.modal.doubts import SURE
from bicycle.modal.track_kernel import Decomposed, Track
from bicycle.modal.tracking import STEP
from tyre.base.arrays import Array

REST = 1e-7  # of sqrt(g w): closer to rest is rest, where undamped pairs lie on the axis
SLOW_LOOKS = REST * np.geomspace(1.0, START * STEP / REST, 4)  # of sqrt(g w): unstable roots below the track
MOST_STEPS = 8  # of Newton
LAST_STEP = 1e-7  # of the speed: Newton squares what is left
WELL_KNOWN = 2e-10  # m/s: what rounding may change in a crossing at most
APART = 1e-6  # of the speed: two crossings nearer than this are left to the plain path
BLURRED, AT_REST = 7, 8
WHY: Mapping[int, str] = {
    **doubts.WHY,
    BLURRED: "crossings that rounding blurs or that nearly coincide",
    AT_REST: "stability that changes near rest, or slip without relaxation",
}


@dataclass(frozen=True)
class ManyCriticalSpeeds:
    """Critical speeds of many bicycles, one a row, by bicycle and speed.

    Attributes
    ----------
    bicycle : ndarray of int, shape (k,)
        Index of the bicycle.
    speed : ndarray, shape (k,)
        m/s.
    angular_frequency : ndarray, shape (k,)
        rad/s, 0 for a real root.
    destabilising : ndarray of bool, shape (k,)
        Whether the root becomes unstable as the speed grows.
    bits : ndarray of int, shape (k,)
        Numbers of the names of its mode, as bits.
    names : tuple of str
        By number.
    status : ndarray of int, shape (m,)
        Of each bicycle, not 0 where the batch is not sure and lists nothing; :data:`WHY` says why.
    """

    bicycle: NDArray[np.int64]
    speed: Array
    angular_frequency: Array
    destabilising: NDArray[np.bool_]
    bits: NDArray[np.int64]
    names: tuple[str, ...]
    status: NDArray[np.int16]

    @property
    def unsure(self) -> Mapping[str, int]:
        """How many bicycles are left to the plain path, by reason."""
        return {why: count for number, why in WHY.items() if (count := int((self.status == number).sum()))}

    def of(self, bicycle: int) -> tuple[CriticalSpeed, ...]:
        """Those of the bicycle with this index, by speed.

        Parameters
        ----------
        bicycle : int
            Its index.
        """
        return tuple(
            CriticalSpeed.of_root(
                speed=float(self.speed[k]), root=1j * float(self.angular_frequency[k]),
                destabilising=bool(self.destabilising[k]), mode=batch.name_of(int(self.bits[k]), self.names),
            )
            for k in range(*np.searchsorted(self.bicycle, [bicycle, bicycle + 1]))
        )  # fmt: skip


def critical_speeds_of(block: Block, max_speed: float) -> ManyCriticalSpeeds:
    """All critical speeds of all bicycles of a block.

    Parameters
    ----------
    block : Block
    max_speed : float
        m/s.
    """
    parts = [_part(block.part(slice(at, at + BLOCK)), max_speed, at) for at in range(0, len(block.unit), BLOCK)]
    columns = [np.concatenate([part[i] for part in parts]) for i in range(6)]
    owner, speed, omega, rises, bits, status = columns
    return ManyCriticalSpeeds(
        owner.astype(np.int64), speed, omega, rises > 0, bits.astype(np.int64), block.kind.names,
        status.astype(np.int16),
    )  # fmt: skip


def _part(block: Block, max_speed: float, first: int) -> tuple[NDArray[np.generic], ...]:
    """Bicycle, speed, frequency, slope and name of every crossing, and the status of every bicycle."""
    low, high = REST * block.unit, np.full(len(block.unit), max_speed)

    def asked(track: Track, owner: NDArray[np.int64], v: Array) -> int:
        return int(crossing_kernel.divide(track, block.unit, low, high, owner, v))

    with compiled_ahead():
        looks = np.outer(block.unit, SLOW_LOOKS)
        track, near_rest = follow(block, np.full(len(high), START * STEP), high / block.unit, asked, looks)
    track.status[_moves(near_rest, len(high))] = AT_REST
    room = track.re[:, :, 0].size
    owner, step, root = (np.empty(room, np.int64) for _ in range(3))
    start = np.empty((3, room))
    count = crossing_kernel.crossings(track, low, high, owner, step, root, start)
    owner, start = owner[:count].copy(), start[:, :count]
    v, state, re, im, omega = _sharpened(block, owner, start)
    blurred = ~(state[1] < WELL_KNOWN) | ~(np.abs(v - start[0]) < 0.1 * block.unit[owner])
    inside = (v > low[owner]) & (v <= high[owner])
    blurred |= (np.abs(v - high[owner]) < APART * v) | (np.abs(v - low[owner]) < 10 * low[owner])
    order = np.lexsort((v, owner))
    rising, whose = v[order], owner[order]
    near = (rising[1:] - rising[:-1] < APART * rising[1:]) & (whose[1:] == whose[:-1])
    blurred[order[1:][near]] = True
    track.status[owner[blurred]] = BLURRED
    kept = order[(inside & (track.status[owner] == SURE))[order]]
    owner, v, state, omega = owner[kept], v[kept], state[:, kept], omega[kept]
    bits = _named(block, track, owner, v, re[kept], im[kept], omega)
    sure = track.status[owner] == SURE
    return (
        *(column[sure] for column in (owner + first, v, omega, state[0], bits)), track.status,
    )  # fmt: skip


def _moves(at: Decomposed, bicycles: int) -> NDArray[np.bool_]:
    """Whether stability changes between speeds near rest, or may: other roots are unstable, or one is near the axis.

    Shape (bicycles,), from their roots at :data:`SLOW_LOOKS`.
    """
    certain = (np.abs(at.re) > 3 * at.doubt).all(1).reshape(bicycles, -1).all(1)
    order = np.lexsort((at.re, np.abs(at.im)))
    unstable = np.take_along_axis(at.re > 0, order, 1).reshape(bicycles, len(SLOW_LOOKS), -1)  # by frequency
    return np.asarray(~certain | (unstable != unstable[:, :1]).any((1, 2)))


def _sharpened(block: Block, owner: NDArray[np.int64], start: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Speeds (k,), slopes and doubts (2, k), roots (k, n) there in two parts, angular frequencies, by Newton."""
    n = block.coefficients.shape[-1]
    v, root = start[0].copy(), start[1:].copy()
    step, state = np.full(len(v), np.inf), np.full((2, len(v)), np.inf)
    re, im = np.zeros((len(v), n)), np.zeros((len(v), n))
    moving = np.arange(len(v))
    for _ in range(MOST_STEPS):
        if not len(moving):
            break
        at = decompose(block, owner[moving], v[moving])
        there, expected, moved, told = v[moving], root.take(moving, 1), step[moving], state.take(moving, 1)
        crossing_kernel.newton(there, at.re, at.im, at.slopes, at.doubt, expected, moved, told)
        re[moving], im[moving] = at.re, at.im
        v[moving], root[:, moving], step[moving], state[:, moving] = there, expected, moved, told
        moving = moving[~(np.abs(moved) <= LAST_STEP * np.abs(there)) & np.isfinite(there) & (there > 0)]
    state[1, moving] = np.inf
    return v, state, re, im, root[1]


def _named(
    block: Block, track: Track, owner: NDArray[np.int64], v: Array, re: Array, im: Array, omega: Array
) -> NDArray[np.int64]:
    """Names as bits (k,) of crossings at angular frequencies ``omega``, sorted by bicycle, among roots (k, n)."""
    bicycles, n = len(block.unit), re.shape[1]
    place = np.arange(len(owner)) - np.searchsorted(owner, owner)
    width = int(place.max(initial=-1)) + 1
    speeds = np.full((bicycles, width), np.nan)
    roots, bits = np.zeros((2, bicycles, width, n)), np.zeros((bicycles, width, n), np.int64)
    speeds[owner, place] = v
    roots[0, owner, place], roots[1, owner, place] = re, im
    found = name(block, track, speeds)
    answer_kernel.answer(track, found, block.unit, speeds, roots[0], roots[1], bits)
    own = np.hypot(re, im - omega[:, None]).argmin(1)
    return np.asarray(bits[owner, place, own])
