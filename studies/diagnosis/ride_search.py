"""Search for the rider and the inputs of each ride that make its spectra most probable.

Spectra are alike with very different riders, and a search ends at the next one of them. Few riders hold a bicycle
upright; from one who does, without a step to any who does not, the search mostly ends at the best.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.diagnosis.ride_disturbances import RIDER, Disturbances
from studies.diagnosis.ride_model import Fitted, Gains, Rides
from studies.diagnosis.whitening import Marginal, integrate_starts_out
from tyre.ground.arrays import Array, Complex

SLOW, DRIFT = 0.6, 0.05  # rad/s and 1/s: what is slower than any frequency that was measured decays at least so fast
CHANGES = np.outer([1, -1], [0.05, 0.1, 0.2, 0.5, 1.0, 2.0]).ravel()  # prior sd, of one number of a rider
DEMERIT = 20.0  # of a misfit, of disturbances that make the bicycle unstable
RIDERS, MOST_DRAWN = 8, 4000  # riders who hold the bicycle from whom a search begins, and most draws for them
AT_ONCE = 250  # riders whose loops are tried together
KEPT = 3  # riders of a ride, the best after some steps, from whom the search goes on
FIRST_TURNS, TURNS_FROM_AFAR = 8, 22  # most steps before and after that choice
WORTH = 0.1  # of a misfit: other disturbances that lower it by less are the same


@dataclass(frozen=True, eq=False)
class OpenLoops:
    """Bicycles of R rides without whoever steers them."""

    state: Array  # (R, n, n)
    steered: Array  # (R, n), effect of the steer torque
    motion: Array  # (R, 4, n), rows of what a rider answers: lean, its rate, steer and its rate

    def poles(self, loop: Disturbances, z: Array, rides: NDArray[np.intp]) -> Complex:
        """Eigenvalues (m, n + 2), 1/s, of the ``rides`` (m,) with whoever steers them by ``z`` (m, k).

        A bicycle without numbers is as unstable as can be.
        """
        closed = loop.closed_loops(self.state[rides], self.steered[rides], self.motion[rides], z, rides)
        finite = np.asarray(np.isfinite(closed).all((1, 2)))
        poles: Complex = np.linalg.eigvals(np.where(finite[:, None, None], closed, 0.0)).astype(complex)
        return np.where(finite[:, None], poles, np.inf)

    def hold(self, loop: Disturbances, z: Array, rides: NDArray[np.intp]) -> NDArray[np.bool_]:
        """State which ``rides`` (m,) are stable under disturbances ``z`` (m, k): a ride that lasts for minutes is.

        Spectra hardly distinguish growth from decay, and do not show what is slower than :data:`SLOW`.
        """
        poles = self.poles(loop, z, rides)
        return np.asarray((poles.real < np.where(np.abs(poles) < SLOW, -DRIFT, 0.0)).all(1))


def steady_riders(loop: Disturbances, loops: OpenLoops, z: Array) -> Array:
    """Disturbances (R, k) like ``z`` (R, k), with one number of the rider changed where a ride is unstable.

    It is the number, and the size of :data:`CHANGES`, that make the ride stable with the least change; none may.
    """
    steady = z.copy()
    columns = np.arange(loop.loop.start, loop.loop.stop)
    unstable = ~loops.hold(loop, z, np.arange(len(z))) if len(columns) else np.zeros(len(z), bool)
    for ride in np.flatnonzero(unstable):
        moved = np.tile(z[ride], (len(columns) * len(CHANGES), 1))
        moved[range(len(moved)), np.repeat(columns, len(CHANGES))] += np.tile(CHANGES, len(columns))
        held = loops.hold(loop, moved, np.full(len(moved), ride))
        if held.any():
            sizes = np.tile(np.abs(CHANGES), len(columns))
            steady[ride] = moved[np.argmin(np.where(held, sizes, np.inf))]
    return steady


class RidersDrawn:
    """Riders drawn from their prior, of whom those who hold a bicycle are mostly those who hold one much like it."""

    def __init__(self, loop: Disturbances) -> None:
        self._loop = loop
        self._all = loop.draw_loops(MOST_DRAWN, np.random.default_rng(1))
        self._held: dict[int, NDArray[np.intp]] = {}  # ride -> numbers of riders who held it lately

    def who_hold(self, loops: OpenLoops) -> Array:
        """Disturbances (starts, R, k): riders who hold the bicycle of each ride; the other coordinates are usual."""
        rides = len(loops.state)
        if self._loop.steering != RIDER:
            return np.zeros((1, rides, self._all.shape[1]))
        numbers = [self._of_ride(loops, ride) for ride in range(rides)]
        starts = np.zeros((max(1, *(len(some) for some in numbers)), rides, self._all.shape[1]))
        for ride, some in enumerate(numbers):
            starts[: len(some), ride] = self._all[some]
        return starts

    def _of_ride(self, loops: OpenLoops, ride: int) -> NDArray[np.intp]:
        """Numbers (at most :data:`RIDERS`) of riders who hold the bicycle of a ``ride``."""
        known = self._holding(loops, ride, self._held.get(ride, np.arange(0)))
        if len(known) < RIDERS:
            known = np.arange(0)
            for begin in range(0, MOST_DRAWN, AT_ONCE):
                known = np.append(known, self._holding(loops, ride, np.arange(begin, begin + AT_ONCE)))
                if len(known) >= 2 * RIDERS:  # some for bicycles that differ a little
                    break
            self._held[ride] = known
        return known[:RIDERS]

    def _holding(self, loops: OpenLoops, ride: int, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
        """Select from the riders ``numbers`` those who hold the bicycle of the ``ride``."""
        if not len(numbers):
            return numbers
        return numbers[loops.hold(self._loop, self._all[numbers], np.full(len(numbers), ride))]


def search_from(rides: Rides, gains: Gains, loops: OpenLoops, starts: Array, kept: Array) -> list[Fitted]:
    """Fit rides from several ``starts`` (S, R, k), of which the best go on, and from others that are ``kept``."""
    tried = _settle(rides, gains, loops, starts, FIRST_TURNS) if len(starts) > KEPT else starts
    if len(starts) > KEPT:
        objectives = np.array([Fitted(rides, gains, z).objective for z in tried])
        best = np.argsort(objectives, 0)[:KEPT]
        tried = np.take_along_axis(tried, best[..., None], 0)
    ends = _settle(rides, gains, loops, np.concatenate([kept, tried]), TURNS_FROM_AFAR)
    return [Fitted(rides, gains, z) for z in ends]


def _settle(rides: Rides, gains: Gains, loops: OpenLoops, starts: Array, turns: int) -> Array:
    """Disturbances (S, R, k) to which ``starts`` (S, R, k) lead, all at once."""
    count, of = len(starts), np.tile(np.arange(starts.shape[1]), len(starts))
    many, same = rides.repeated(count), gains.repeated(count)
    ends = many.settle(
        same, starts.reshape(-1, starts.shape[2]), turns=turns, holds=lambda z: loops.hold(rides.disturbances, z, of)
    )
    return ends.reshape(starts.shape)


def most_probable(loops: OpenLoops, options: Sequence[Fitted]) -> Fitted:
    """Choose for each ride the option of the least misfit; one that makes the bicycle unstable has a demerit."""
    best = options[0]
    for other in options[1:]:
        better = _demerits(loops, other) < _demerits(loops, best) - WORTH
        if better.any():
            best = best.replaced(better, other)
    return best


def _demerits(loops: OpenLoops, fitted: Fitted) -> Array:
    """Misfit (R,), with what an unstable bicycle adds."""
    held = loops.hold(fitted.rides.disturbances, fitted.z, np.arange(len(fitted.z)))
    return fitted.objective + DEMERIT * ~held


def integrate_disturbances_out(fitted: Fitted) -> Marginal:
    """Residuals (R, n) with the most probable disturbances integrated out."""
    columns = fitted.disturbance_slopes
    linear = fitted.residual - np.einsum("rnk,rk->rn", columns, fitted.z)
    return integrate_starts_out(columns, linear[..., None])
