"""Roots of many bicycles followed and named at once, without the interpreter lock; needs numba (extra ``fast``).

A block of bicycles is tracked on the sparse grid of :mod:`bicycle.modal.tracking`, all nodes of a round together, named
by the rules of :mod:`bicycle.modal.naming`, and answers for the speeds asked for. Every step of this says when it is
not sure: two roots that cannot be told apart, a name by a narrow margin, a speed next to which names change. Such a
bicycle gets no answer here but a status, and the caller asks the plain path for it, which is the judge of this one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.vectors_kernel import decompose_stack
from bicycle.linear_model import LinearModel
from bicycle.modal import anchor_kernel, answer_kernel, follow_kernel, naming_kernel, track_kernel
from bicycle.modal.batch_kind import BatchKind
from bicycle.modal.naming import HIGHEST, LOWEST, speed_unit
from bicycle.modal.naming_kernel import Named
from bicycle.modal.speed_limits import FASTEST_RATE, FASTEST_SPEED, REFERENCE_SPEED, SLOWEST_SPEED
from bicycle.modal.track_kernel import Decomposed, Track
from bicycle.modal.tracking import SPARSE, STEP, grid
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array

BLOCK = 128  # bicycles tracked together: few nodes of each fill the lanes
START = 2.0**-6  # in steps: where a track begins that needs not reach rest
STIFF, BEYOND = 6, 12  # statuses beside those of the kernels
NODES = 192  # of one bicycle at most
WHY = {
    track_kernel.NO_VECTORS: "a root without eigenvectors",
    track_kernel.TOO_CLOSE: "roots that come too close",
    naming_kernel.NOT_CLEAR: "roles that two modes play nearly alike",
    naming_kernel.NO_ANCHOR: "two speeds at which names are equally plain",
    naming_kernel.SHORT_PAIR: "real roots that are a pair for a short while",
    naming_kernel.NO_HEIR: "roots that change hands in two ways",
    answer_kernel.BESIDE_A_CHANGE: "names change next to a speed asked for",
    BEYOND: "speeds that cannot be tracked",
    STIFF: "models that are nearly too stiff to be computed",
    answer_kernel.RIVALS: "roots that are too close at a speed asked for",
}
"""Why a batch is not sure of a bicycle, by status."""

Asked = Callable[[Track, NDArray[np.int64], Array], int]


@dataclass(frozen=True)
class Block:
    """Bicycles of one kind: state matrices as polynomials in the speed, one range of speed.

    Attributes
    ----------
    coefficients : ndarray, shape (p, m, n, n)
        Of the powers of the speed.
    powers : ndarray, shape (p,)
        These powers.
    unit : ndarray, shape (m,)
        sqrt(g w), m/s.
    kind : BatchKind
        What they have in common.
    """

    coefficients: Array
    powers: Array
    unit: Array
    kind: BatchKind

    @classmethod
    def of(cls, polynomial: SpeedPolynomial, unit: Array, kind: BatchKind) -> "Block":
        """From state matrices and units of speed of bicycles of one kind.

        Parameters
        ----------
        polynomial : SpeedPolynomial, shape (m, n, n)
            Scaled state matrices, 1/s.
        unit : ndarray, shape (m,)
            sqrt(g w), m/s.
        kind : BatchKind
        """
        shape = polynomial.shape
        stacked = [np.broadcast_to(matrix, shape) for matrix in polynomial.values()] or [np.zeros(shape)]
        powers = np.array(list(polynomial) or [0], float)
        return cls(np.ascontiguousarray(stacked), powers, np.ascontiguousarray(unit, dtype=float), kind)

    @classmethod
    def of_models(cls, models: Sequence[LinearModel]) -> "Block":
        """From ``models`` with the same effects, each with one range of speed."""
        of_each = [model.coefficients[0] for model in models]
        powers = sorted({power for polynomial in of_each for power in polynomial})
        stack = {power: np.stack([polynomial.coefficient(power) for polynomial in of_each]) for power in powers}
        polynomial = SpeedPolynomial(stack, shape=(len(models), *of_each[0].shape))
        return cls.of(polynomial, np.array([speed_unit(model) for model in models]), BatchKind.of(models[0]))

    def part(self, bicycles: slice) -> "Block":
        """Some of the ``bicycles``."""
        return Block(np.ascontiguousarray(self.coefficients[:, bicycles]), self.powers, self.unit[bicycles], self.kind)

    def decompose(self, owner: NDArray[np.int64], v: Array) -> Decomposed:
        """Roots of bicycles ``owner`` (k,) at speeds ``v`` (k,), m/s."""
        stack, change = self.matrices(owner, v)
        k, n = stack.shape[:2]
        found = Decomposed(
            np.empty((k, n)), np.empty((k, n)), np.empty((2, k, n)), np.empty((k, n, n)), np.empty((k, n))
        )
        start = 0
        while start < k:
            part = Decomposed(*(x[:, start:] if x is found.slopes else x[start:] for x in found))
            failed = decompose_stack(stack[start:], change[start:], *part)
            if failed < 0:
                break
            found.doubt[start + failed] = np.nan
            found.re[start + failed] = found.im[start + failed] = found.share[start + failed] = 0.0
            found.slopes[:, start + failed] = 0.0
            start += failed + 1
        return found

    def matrices(self, owner: NDArray[np.int64], v: Array) -> tuple[Array, Array]:
        """A (1/s) and dA/dv (1/m) of bicycles ``owner`` (k,) at speeds ``v`` (k,), m/s, shape (k, n, n) each."""
        n = self.coefficients.shape[-1]
        stack, change = np.empty((len(v), n, n)), np.empty((len(v), n, n))
        track_kernel.assemble(self.coefficients, self.powers, owner, v, stack, change)
        return stack, change

    def follow(self, lowest: float, highest: Array, asked: Asked | None = None) -> Track:
        """Track all bicycles where names are given, and from ``lowest`` to ``highest`` (m,), in units of speed.

        ``asked`` may ask for more nodes of a track where all is linked, as :func:`follow_kernel.link_steps` does.
        """
        bicycles, n = self.coefficients.shape[1:3]
        low = min(lowest, LOWEST if self.kind.singular else 0.0)
        reach = np.minimum(np.maximum(highest, HIGHEST), FASTEST_SPEED) / STEP
        top = SPARSE * np.ceil(reach.max() / SPARSE)
        steps = grid(low / STEP, top, 1 / STEP, singular=self.kind.singular, sparse=True)
        if steps[0] == 0 and lowest >= START * STEP:
            steps[0] = START  # at rest, roots may be double
        track = track_kernel.empty_track(bicycles, max(NODES, 2 * len(steps)), n)
        # each as far as it must go by itself, so that no result depends on the others
        own, place = map(np.copy, np.nonzero(np.concatenate([[-1.0], steps[:-1]]) < reach[:, None]))
        track.grid[:] = np.bincount(own, minlength=bicycles)
        self.add(track, own, (self.unit * STEP)[own] * steps[place], asked)
        owners, speeds = np.empty(track.v.size, np.int64), np.empty(track.v.size)
        count = anchor_kernel.ask_between(track, self.unit, owners, speeds)
        self.add(track, owners[:count], speeds[:count], asked)
        slot = int(np.abs(steps * STEP - REFERENCE_SPEED).argmin())
        fastest = np.hypot(track.re[:, slot], track.im[:, slot]).max(1)
        track.status[~(fastest * self.unit <= 0.99 * FASTEST_RATE * self.kind.gravity)] = STIFF
        return track

    def add(self, track: Track, owner: NDArray[np.int64], v: Array, asked: Asked | None = None) -> None:
        """Add nodes at speeds ``v`` (k,) of bicycles ``owner`` (k,) to a track, and those that these ask for.

        Parameters
        ----------
        track : Track
        owner : ndarray of int, shape (k,)
            Indices of the bicycles.
        v : ndarray, shape (k,)
            m/s.
        asked : callable, optional
            As of :meth:`follow`.
        """
        room = track.v.size * 3
        owners, speeds = np.empty(room, np.int64), np.empty(room)
        while len(v):
            follow_kernel.place(track, owner, v, *self.decompose(owner, v))
            count = follow_kernel.link_steps(track, self.unit, owners, speeds)
            if not count and asked:
                count = asked(track, owners, speeds)
            owner, v = owners[:count].copy(), speeds[:count].copy()

    def name(self, track: Track, speeds: Array) -> Named:
        """Name all roots of a track of these bicycles; it gets the nodes it needs around ``speeds`` (m, k), m/s.

        Parameters
        ----------
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
            naming_kernel.name_all(track, self.unit, self.kind.roles, found, todo)
            count = answer_kernel.ask_more(track, found, speeds, self.unit, owners, more)
            todo[:] = 0
            todo[owners[:count]] = 1
            if count:
                self.add(track, owners[:count].copy(), more[:count].copy())
        return found


@dataclass(frozen=True)
class NamedRoots:
    """Roots of many bicycles at speeds, and what each may be called.

    Attributes
    ----------
    values : complex ndarray, shape (m, k, n)
        Of each bicycle at its speeds, sorted, 1/s.
    bits : ndarray of int, shape (m, k, n)
        Numbers of the names of each root, as bits; several where identity is lost.
    names : tuple of str
        By number.
    anchor : ndarray, shape (m,)
        Speed at which names were given, m/s.
    every : ndarray of int, shape (m,)
        Numbers of the names of all modes of each bicycle, as bits.
    status : ndarray of int, shape (m,)
        Not 0 where the batch is not sure and there is no answer; :data:`WHY` says why.
    """

    values: NDArray[np.complex128]
    bits: NDArray[np.int64]
    names: tuple[str, ...]
    anchor: Array
    every: NDArray[np.int64]
    status: NDArray[np.int16]

    @property
    def unsure(self) -> Mapping[str, int]:
        """How many bicycles were left to the plain path, by reason."""
        return {why: count for number, why in WHY.items() if (count := int((self.status == number).sum()))}


def name_roots(block: Block, speeds: Array) -> NamedRoots:
    """Roots at speeds and their names, of all bicycles of a block.

    Parameters
    ----------
    block : Block
    speeds : ndarray, shape (m, k)
        Of each bicycle, m/s.

    Returns
    -------
    NamedRoots
    """
    order = np.argsort(speeds, axis=1, kind="stable")
    rising = np.take_along_axis(speeds, order, 1)
    parts = [
        _name_part(block.part(slice(at, at + BLOCK)), rising[at : at + BLOCK]) for at in range(0, len(speeds), BLOCK)
    ]
    values, bits, anchor, every, status = (np.concatenate([part[i] for part in parts]) for i in range(5))
    back = np.argsort(order, axis=1)[..., None]
    values, bits = np.take_along_axis(values, back, 1), np.take_along_axis(bits, back, 1)
    return NamedRoots(values, bits, block.kind.names, anchor, every, status)


def _name_part(
    block: Block, speeds: Array
) -> tuple[NDArray[np.complex128], NDArray[np.int64], Array, NDArray[np.int64], NDArray[np.int16]]:
    bicycles, k = speeds.shape
    reach = speeds / block.unit[:, None]
    track = block.follow(float(reach.min()), reach.max(1))
    slowest = SLOWEST_SPEED if block.kind.singular else 0.0
    track.status[(reach < slowest).any(1) | (reach > FASTEST_SPEED).any(1)] = BEYOND
    found = block.name(track, speeds)
    values = eigenvalues_of(block, np.repeat(np.arange(bicycles), k), speeds.ravel())
    values = values.reshape(bicycles, k, -1)
    bits = np.zeros(values.shape, np.int64)
    answer_kernel.answer(track, found, block.unit, speeds, values.real.copy(), values.imag.copy(), bits)
    every = np.bitwise_or.reduce(1 << found.name, axis=1)
    return values, bits, found.anchor, every, track.status


def eigenvalues_of(block: Block, owner: NDArray[np.int64], v: Array) -> NDArray[np.complex128]:
    """Eigenvalues (k, n) of bicycles ``owner`` (k,) at speeds ``v`` (k,), m/s, sorted, 1/s.

    Parameters
    ----------
    block : Block
    owner : ndarray of int, shape (k,)
        Indices of the bicycles.
    v : ndarray, shape (k,)
        m/s.
    """
    from bicycle.eigenvalues.solvers import compiled

    return compiled(block.matrices(owner, v)[0])


def name_of(bits: int, names: tuple[str, ...]) -> str:
    """The name that ``bits`` stand for, among ``names``: joint where there are several.

    Parameters
    ----------
    bits : int
        Index of each name as a bit.
    names : tuple of str
        By number.
    """
    return "+".join(sorted(name for number, name in enumerate(names) if bits >> number & 1))
