"""How sure a design is: drawn bicycles, the roots of each followed from those of the design, demands kept or not."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from bicycle.eigenvalues.solvers import Solver, eigenvalues, solver_for
from bicycle.linear_model import LinearModel
from bicycle.modal.matching import assign
from bicycle.modal.named_modes import Modes, modes
from bicycle.model_family import ModelFamily
from studies.design.demand import Demand, members, worst
from studies.uncertainty.uncertain_model import UncertainModel
from tyre.base.arrays import Array, Complex

SHARES = (1 / 3, 2 / 3, 1.0)  # of the way from the design to a draw, at which roots are matched
LOOKED_AT = 60  # draws whose modes are named anew at most, where roots cannot be followed
BINDING = 1e-2  # 1/s: a demand that is kept by more than this beyond its margin does not bind
ALONG = 41  # speeds at which drawn bicycles are looked at, beside the worst ones of the design


@dataclass(frozen=True, eq=False)
class Certainty:
    """What draws say of a design.

    Attributes
    ----------
    excess : mapping of Demand to ndarray, shape (m,)
        By how much each drawn bicycle misses each demand at its worst speed, 1/s; NaN where it could not be told.
    unknown : int
        Draws of which it could not be told.
    refused : int
        Draws that make no bicycle, which are left out.
    """

    excess: Mapping[Demand, Array]
    unknown: int
    refused: int

    @property
    def known(self) -> Array:
        """Largest miss (k,) of all demands of each draw of which it is told, 1/s."""
        every = np.stack(list(self.excess.values()))
        return np.asarray(every[:, ~np.isnan(every).any(0)].max(0))

    @property
    def probability(self) -> float:
        """Share of draws that keep every demand."""
        return float((self.known <= 0).mean()) if self.known.size else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the probability (Wilson 1927), that cannot be told counted both ways."""
        kept, count = int((self.known <= 0).sum()), self.known.size + self.unknown
        return _wilson(kept, count)[0], _wilson(kept + self.unknown, count)[1]

    def back_off(
        self, nominal: Mapping[Demand, float], margins: Mapping[Demand, float], probability: float
    ) -> dict[Demand, float]:
        """Margins (1/s) with which that share of the same draws would have kept every demand.

        A demand that the design keeps by more than its margin counts only in draws that use that up.

        Parameters
        ----------
        nominal : mapping of Demand to float
            By how much the design itself misses each demand at its worst speed, 1/s.
        margins : mapping of Demand to float
            By which the design was to keep them, 1/s.
        probability : float
            0 to 1.
        """
        spread = {demand: float(np.nanstd(values)) or 1e-12 for demand, values in self.excess.items()}
        away = np.stack([(values - nominal[d]) / spread[d] for d, values in self.excess.items()])
        for row, (demand, values) in zip(away, self.excess.items(), strict=True):
            if nominal[demand] + margins.get(demand, 0.0) < -BINDING:
                row[values <= 0] = -np.inf
        beta = float(np.nanquantile(away.max(0), probability, method="higher"))
        return {demand: beta * size for demand, size in spread.items()}


def _wilson(kept: int, count: int) -> tuple[float, float]:
    if not count:
        return 0.0, 1.0
    z = float(norm.ppf(0.975))
    share, spread = kept / count, z**2 / count
    middle, half = share + spread / 2, z * math.sqrt(share * (1 - share) / count + spread / (4 * count))
    return max((middle - half) / (1 + spread), 0.0), min((middle + half) / (1 + spread), 1.0)


def certainty(
    uncertain: UncertainModel,
    demands: Sequence[Demand],
    speeds: Array,
    *,
    samples: int,
    seed: int,
    matched: bool = False,
) -> Certainty:
    """Draw bicycles about a design and see which of them keep the demands.

    Parameters
    ----------
    uncertain : UncertainModel
        Of the design.
    demands : sequence of Demand
    speeds : ndarray, shape (k,)
        m/s, rising: at which drawn bicycles are looked at.
    samples : int
        Number of draws.
    seed : int
        Of the random numbers.
    matched : bool
        Whether mean and covariance of the draws are exact where there are enough of them.
    """
    draw = uncertain.matched_draw if matched and uncertain.can_match(samples) else uncertain.draw
    z, refused = uncertain.possible(draw(samples, seed))
    family = ModelFamily(uncertain.nominal)
    nominal = modes(uncertain.nominal.linear_model(), speeds)
    start = nominal.model.eigenvalues(speeds)
    masks = {demand: _mask(start, nominal, demand) for demand in demands}
    excess = {demand: np.full(len(z), np.nan) for demand in demands}
    lost: list[int] = []
    solver = solver_for(len(z) * len(SHARES) * len(speeds))  # one for all draws
    for rows in (slice(a, a + 256) for a in range(0, len(z), 256)):
        roots, good = _followed(uncertain, z[rows], speeds, start, solver)
        own = np.arange(rows.start, rows.start + len(roots))
        for demand, mask in masks.items():
            missed = _top(speeds, np.where(mask, demand.excess(roots), -np.inf).max(2))
            excess[demand][own] = np.where((good | ~mask).all((1, 2)), missed, np.nan)
        lost += own[np.isnan(np.stack([excess[d][own] for d in demands])).any(0)].tolist()
    for row in lost[:LOOKED_AT]:
        points = uncertain.points(z[row : row + 1])
        linear = family.linear_model({key: points.value(key, 0) for key in points.values})
        for demand, value in _named(linear, demands, speeds).items():
            excess[demand][row] = value
    unknown = int(np.isnan(np.stack(list(excess.values()))).any(0).sum())
    return Certainty(excess, unknown, sum(refused.values()))


def _mask(start: Complex, nominal: Modes, demand: Demand) -> NDArray[np.bool_]:
    """Which of the roots (speeds, n) belong to the mode of a demand; of a pair both."""
    own = members(nominal.branches, demand.mode)
    own = np.concatenate([own, own.conj()], 1)
    away = np.abs(start[:, :, None] - own[:, None, :])
    return np.asarray(np.nanmin(np.where(np.isnan(away), np.inf, away), 2) <= 1e-7 * np.abs(start).max(1)[:, None])


def _followed(
    uncertain: UncertainModel, z: Array, speeds: Array, start: Complex, solver: Solver
) -> tuple[Complex, NDArray[np.bool_]]:
    """Roots (m, k, n) of draws in the order of those of the design, and which of them are beyond doubt."""
    count, n = len(z), start.shape[1]
    past: Any = None
    here: Any = np.broadcast_to(start, (count, *start.shape)).reshape(-1, n)
    good = np.ones(here.shape, bool)
    for share in SHARES:
        values = np.concatenate(
            [
                eigenvalues(polynomial(speeds[None]), solver=solver).reshape(-1, n)
                for _, polynomial, _ in uncertain.batches(z, share=share)
            ]
        )
        expected = here if past is None else 2 * here - past
        cost = np.abs(expected[:, :, None] - values[:, None, :])
        order = assign(cost)
        error = np.take_along_axis(cost, order[:, :, None], 2)[..., 0]
        rival = np.where(order[:, :, None] == np.arange(n), np.inf, cost).min(2)
        good &= error < rival / 2
        past, here = here, np.take_along_axis(values, order, 1)
    return here.reshape(count, *start.shape), good.reshape(count, *start.shape)


def _top(speeds: Array, excess: Array) -> Array:
    """Largest value (m,) along speed of values (m, k), between speeds too: of the parabola through three of them."""
    row, at = np.arange(len(excess)), np.clip(excess.argmax(1), 1, len(speeds) - 2)
    (a, fa), (b, fb), (c, fc) = ((speeds[at + k], excess[row, at + k]) for k in (-1, 0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        left, right = (fb - fa) / (b - a), (fc - fb) / (c - b)
        bend = (right - left) / (c - a)
        slope = left + bend * (b - a)  # at the middle of the three
        top = fb - slope**2 / (4 * bend)
    inside = np.isfinite(top) & (bend < 0) & (np.abs(slope) < -2 * bend * np.maximum(b - a, c - b))
    return np.asarray(np.where(inside, np.maximum(top, excess.max(1)), excess.max(1)))


def _named(linear: LinearModel, demands: Sequence[Demand], speeds: Array) -> dict[Demand, float]:
    branches = modes(linear, speeds).branches
    found = {}
    for demand in demands:
        roots, there = worst(demand, members(branches, demand.mode))
        found[demand] = float(demand.excess(roots[there]).max()) if there.any() else -math.inf
    return found
