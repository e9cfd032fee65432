"""Roots of a block of bicycles followed and named in plain numpy: what costs time is done for all of them together.

:mod:`bicycle.modal.batch` tells what is done. Tracks are those of :mod:`bicycle.modal.stacked_track`; each bicycle is
named by :func:`bicycle.modal.naming.name_nodes`, as one by itself is, which says whether more nodes could change that.
"""

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import doubtful
from bicycle.eigenvalues.solvers import in_batches, lapack
from bicycle.modal.anchor import WALKING
from bicycle.modal.apart import hermite
from bicycle.modal.block import Block
from bicycle.modal.doubts import BESIDE_A_CHANGE, BEYOND, NO_VECTORS, RIVALS, STIFF, SURE
from bicycle.modal.matching import CLEAR, TWIN
from bicycle.modal.naming import FAST, Evidence, Naming, name_nodes
from bicycle.modal.speed_limits import FASTEST_RATE, FASTEST_SPEED, REFERENCE_SPEED, SLOWEST_SPEED
from bicycle.modal.stacked_track import ManyTracks, track_many
from bicycle.modal.tracking import SAME, STEP
from tyre.base.arrays import Array, Complex

BLOCK = 256  # bicycles tracked together: a call to numpy is worth it, and memory stays small

Bits = NDArray[np.int64]
Status = NDArray[np.int16]


def name_block(block: Block, speeds: Array) -> tuple[Complex, Bits, Array, Bits, Status]:
    """Values, names as bits, anchors, all names and status of :class:`bicycle.modal.batch.NamedRoots`.

    Parameters
    ----------
    block : Block
    speeds : ndarray, shape (m, k)
        Of each bicycle, rising, m/s.
    """
    try:
        return _name_block(block, speeds)
    except np.linalg.LinAlgError:  # one of them has entries that are not finite, or LAPACK gives up
        m, k, n = *speeds.shape, block.coefficients.shape[-1]
        if m == 1:
            nothing = np.full((1, k, n), complex(np.nan, np.nan))
            bits = np.zeros((1, k, n), np.int64)
            return nothing, bits, np.full(1, np.nan), bits[:, 0, 0], np.full(1, NO_VECTORS, np.int16)
        halves = [name_block(block.part(part), speeds[part]) for part in (slice(0, m // 2), slice(m // 2, m))]
        values, bits, anchor, every, status = (np.concatenate(pair) for pair in zip(*halves, strict=True))
        return values, bits, anchor, every, status


def _name_block(block: Block, speeds: Array) -> tuple[Complex, Bits, Array, Bits, Status]:
    m, k = speeds.shape
    polynomial, n = block.polynomial, block.coefficients.shape[-1]
    values = in_batches(
        lambda part: polynomial.take(np.arange(m * k)[part] // k)(speeds.ravel()[part]), (m * k, n), solver=lapack
    ).reshape(m, k, n)
    status = np.zeros(m, np.int16)
    reach = speeds / block.unit[:, None]
    fastest = np.abs(lapack(polynomial(REFERENCE_SPEED * block.unit))).max(1, initial=0)
    status[~(fastest * block.unit <= 0.99 * FASTEST_RATE * block.kind.gravity)] = STIFF
    slowest = SLOWEST_SPEED if block.kind.singular else 0.0
    status[(reach < slowest).any(1) | (reach > FASTEST_SPEED).any(1)] = BEYOND
    bits, every, anchor = np.zeros((m, k, n), np.int64), np.zeros(m, np.int64), np.full(m, np.nan)
    sure = np.flatnonzero(status == SURE)
    if sure.size:
        own, v = block.grid(reach.min(1), reach.max(1))
        kept = status[own] == SURE
        tracks = track_many(polynomial, block.unit, own[kept], v[kept], speeds, status)
        label, chance = _named(block, tracks, every, anchor, status)
        settled = _settled(block, tracks, label, anchor) & ~chance
        _answer(tracks, label, settled, speeds, values, bits, status)
    return values, bits, anchor, every, status


def _named(
    block: Block, tracks: ManyTracks, every: Bits, anchor: Array, status: Status
) -> tuple[Bits, NDArray[np.bool_]]:
    """Names of all roots at all nodes (N, n) as bits, and where rounding decides (N,); fills in those of bicycles."""
    number = {name: 1 << k for k, name in enumerate(block.kind.names)}
    owner = np.repeat(np.arange(len(status)), np.diff(tracks.start))
    in_units = tracks.v / block.unit[owner]
    seen = Evidence.of(block.kind.rules, in_units, tracks.values, tracks.share)
    weight = _weight(in_units, owner)
    label, chance = np.zeros(tracks.values.shape, np.int64), np.zeros(len(owner), bool)
    for b in np.flatnonzero(status == SURE).tolist():
        nodes = slice(*tracks.start[b : b + 2])
        found = name_nodes(block.kind.rules, float(block.unit[b]), tracks.v[nodes], seen.at(nodes), weight[nodes])
        status[b], anchor[b], chance[nodes] = found.doubt, found.anchor, found.chance
        every[b] = sum(number[name] for name in found.names)
        label[nodes] = _bits(found, number)
    return label, chance


def _bits(found: Naming, number: dict[str, int]) -> Bits:
    cases = [[sum(number[name] for name in {*of_branch}) for of_branch in case] for case in found.labels]
    return np.array(cases, np.int64)[found.cases]


def _weight(v: Array, owner: NDArray[np.intp]) -> Array:
    """Weight of each node where roles are judged, as the full track takes it: half a step beyond the range."""
    middle = (v[1:] + v[:-1]) / 2
    apart = owner[1:] != owner[:-1]
    low = np.append(-np.inf, np.where(apart, -np.inf, middle))
    high = np.append(np.where(apart, np.inf, middle), np.inf)
    low, high = (np.clip(x, WALKING - STEP / 2, FAST + STEP / 2) for x in (low, high))
    return high - low


def _settled(block: Block, tracks: ManyTracks, label: Bits, anchor: Array) -> NDArray[np.bool_]:
    """Whether no name changes in the step from each node to the next (N,), nor beyond as far as the full track may go.

    In a step that the full track takes as a whole the names are those of its end farther from the anchor: from a step
    inside they must stay the same out to there, or to where two roots meet.
    """
    owner = np.repeat(np.arange(len(anchor)), np.diff(tracks.start))
    steps = tracks.v / (block.unit * STEP)[owner]
    full = tracks.given | (np.abs(steps - steps.round()) < SAME)
    changes = np.append((label[1:] != label[:-1]).any(1), [True])
    meets = ~tracks.smooth
    up = tracks.v >= anchor[owner]
    unsettled = meets | changes
    on = np.where(up, ~(np.roll(full, -1) | np.roll(meets, -1)), ~(full | np.roll(meets, 1)))  # not the end of it yet
    while True:
        beyond = np.where(up, np.roll(unsettled, -1), np.roll(unsettled, 1))
        more = unsettled | (on & beyond)
        if (more == unsettled).all():
            return ~unsettled
        unsettled = more


def _answer(
    tracks: ManyTracks, label: Bits, settled: NDArray[np.bool_], speeds: Array, values: Complex, bits: Bits,
    status: Status,
) -> None:  # fmt: skip
    """Fill in the names of the roots at the speeds asked for, or why they are not sure."""
    sure = np.flatnonzero(status == SURE)
    upper = np.zeros((len(sure), speeds.shape[1]), np.intp)
    for row, b in zip(upper, sure.tolist(), strict=True):
        first, end = tracks.start[b : b + 2]
        row[:] = np.clip(first + np.searchsorted(tracks.v[first:end], speeds[b]), first + 1, end - 1)
    left, right = upper.ravel() - 1, upper.ravel()
    owner = np.repeat(sure, speeds.shape[1])
    roots = values[sure].reshape(-1, values.shape[2])
    h = (tracks.v[right] - tracks.v[left])[:, None]
    s = (speeds[sure].ravel() - tracks.v[left])[:, None] / h
    expected = hermite(tracks.values[left], tracks.values[right], h * tracks.slopes[left], h * tracks.slopes[right], s)
    cost = np.abs(expected[:, :, None] - roots[:, None, :])
    own = cost.argmin(2)
    landed = np.take_along_axis(roots, own, 1)
    alike = TWIN * np.abs(roots).max(1)[:, None]
    best = cost.min(2)
    cost[np.abs(landed[:, :, None] - roots[:, None, :]) <= alike[:, :, None]] = np.inf
    clear = (best < CLEAR * cost.min(2)) | (best <= alike)
    clear &= np.sign(landed.imag) == np.sign(tracks.values[left].imag)
    clear &= np.sort(own, 1) == np.arange(own.shape[1])
    status[owner[doubtful(roots) | ~clear.all(1)]] = RIVALS
    status[owner[~settled[left]]] = BESIDE_A_CHANGE
    named = np.zeros(roots.shape, np.int64)
    np.put_along_axis(named, own, label[right], 1)
    bits[sure] = named.reshape(len(sure), *bits.shape[1:])
