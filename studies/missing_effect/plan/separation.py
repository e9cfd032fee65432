"""How well further measurements tell two hypotheses apart: the distribution of the log odds that they will give.

Each hypothesis is its Laplace approximation: coordinates theta = centre + S z with S S' the posterior covariance. Data
y of a block are whitened, y = t_i + T z + e where hypothesis i is true (T = J_i S_i), and hypothesis j expects
N(m_j, A_j + G G') of them, G = J_j S_j, A_j the noise with what is marginalised inside (unknown starts of runs). In
coordinates in which A_j = 1, with rho = y - m_j, b = G' rho and H = 1 + G' G

    -2 ln p_j = rho' rho - b' H^-1 b + ln det H + ln det A_j,

and rho' rho, b, H and ln det A_j are sums over blocks and repeats. So a plan is weighed in the space of the
coordinates, however long its recordings are. z and e are drawn once: plans differ, luck does not.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from studies.inference.fit import Fit
from tyre.base.arrays import Array

DRAWS = 400
Whiten = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Expected:
    """What one hypothesis expects of a block.

    Attributes
    ----------
    truth : ndarray, shape (m,)
        Data without noise where it is true.
    model : ndarray, shape (m,)
        Mean of the data by its model, in which starts are unknown.
    slopes : ndarray, shape (m, p)
        Of the truth, with respect to its coordinates.
    whiten : callable
        Multiplies columns (m, k) by A^-1/2.
    log_det : float
        ln det A.
    without : ndarray, shape (m,)
        The truth without its effects, its nuisances as they are.
    """

    truth: Array
    model: Array
    slopes: Array
    without: Array
    whiten: Whiten = np.asarray
    log_det: float = 0.0


@dataclass(frozen=True, eq=False)
class Block:
    """One further measurement, such as a run at a speed: what every hypothesis expects of it."""

    expected: tuple[Expected, ...]
    seed: int


@dataclass(frozen=True, eq=False)
class Terms:
    """What one repeat of a block adds where one hypothesis is true and another judges; K draws, p its coordinates.

    ``steady`` and ``shaken`` (K,) of rho' rho, ``pull`` and ``jerk`` (p, K) of b, ``gram`` (p, p): first ones grow with
    the number of repeats, second ones with its root.
    """

    steady: Array
    shaken: Array
    pull: Array
    jerk: Array
    gram: Array
    log_det: float


@dataclass(frozen=True, eq=False)
class Judged:
    """Hypotheses that are to be told apart, with draws from each.

    Attributes
    ----------
    fits : tuple of Fit
    log_posterior : ndarray, shape (hypotheses,)
        As they stand.
    """

    fits: tuple[Fit, ...]
    log_posterior: Array

    @cached_property
    def roots(self) -> tuple[Array, ...]:
        """S of each: S S' is the covariance of its coordinates (p, p)."""
        return tuple(_root(fit.covariance) for fit in self.fits)

    @cached_property
    def draws(self) -> tuple[Array, ...]:
        """z of each (p, K), its effects inside their bounds where draws are."""
        return tuple(_drawn(fit, root) for fit, root in zip(self.fits, self.roots, strict=True))

    def terms(self, block: Block, true: int, judge: int) -> Terms:
        """What a repeat of ``block`` adds; ``true`` and ``judge`` are indices of hypotheses."""
        there, here = block.expected[true], block.expected[judge]
        noise = np.random.default_rng([block.seed, 1]).standard_normal((len(there.truth), DRAWS))
        columns = np.column_stack([there.truth - here.model, there.slopes @ self.roots[true], noise])
        seen, g = here.whiten(columns), here.whiten(here.slopes @ self.roots[judge])
        p = there.slopes.shape[1]
        still = seen[:, :1] + seen[:, 1 : p + 1] @ self.draws[true]
        e = seen[:, p + 1 :]
        return Terms(
            (still**2).sum(0) + (e**2).sum(0), 2 * (still * e).sum(0), g.T @ still, g.T @ e, g.T @ g, here.log_det
        )


def log_likelihood(terms: Sequence[Terms], counts: Sequence[int]) -> Array:
    """ln p_judge (K,) of blocks by their ``terms``, each repeated ``counts`` times (numbers without unit)."""
    p, draws = terms[0].pull.shape
    square, pull, hessian = np.zeros(draws), np.zeros((p, draws)), np.eye(p)
    for one, n in zip(terms, counts, strict=True):
        if n:
            root = np.sqrt(n)
            square += n * (one.steady + one.log_det) + root * one.shaken
            pull += n * one.pull + root * one.jerk
            hessian += n * one.gram
    factor = cho_factor(hessian, lower=True)
    volume = 2 * np.log(factor[0].diagonal()).sum()
    return np.asarray(-(square - (pull * cho_solve(factor, pull)).sum(0) + volume) / 2)


@dataclass(frozen=True, eq=False)
class Alike:
    """Inner products of what the effects of each hypothesis do, nuisances marginalised, as far as they are measured.

    ``moves`` (h, h), ``mixed`` (h, n) with the n nuisances in prior sd, ``inner`` (n, n).
    """

    moves: Array
    mixed: Array
    inner: Array

    @classmethod
    def of(cls, moves: Array, nuisances: Array) -> "Alike":
        """From ``moves`` (m, h), whitened, and what ``nuisances`` do (m, n), in prior sd."""
        return cls(moves.T @ moves, moves.T @ nuisances, nuisances.T @ nuisances)

    def plus(self, others: Mapping["Alike", int]) -> "Alike":
        """With ``others``, further blocks and how often each is repeated (a number without unit)."""
        return Alike(
            self.moves + sum(n * o.moves for o, n in others.items()),
            self.mixed + sum(n * o.mixed for o, n in others.items()),
            self.inner + sum(n * o.inner for o, n in others.items()),
        )

    def cosine(self, first: int, second: int) -> float:
        """Of the hypotheses ``first`` and ``second`` (indices); 0 where one of them does nothing."""
        solved = np.linalg.solve(np.eye(len(self.inner)) + self.inner, self.mixed.T)
        gram = self.moves - self.mixed @ solved
        size = gram[first, first] * gram[second, second]
        return float(np.clip(gram[first, second] / np.sqrt(size), -1, 1)) if size > 1e-12 else 0.0


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _drawn(fit: Fit, root: Array) -> Array:
    """Draws of z (p, K) whose effects are inside their bounds and large enough to matter; any where hardly one is."""
    every = np.random.default_rng(len(fit.theta)).standard_normal((len(root), 20 * DRAWS))
    theta = fit.theta[:, None] + root @ every
    inside = np.ones(every.shape[1], bool)
    for k in range(fit.effect_columns.start, len(fit.theta)):
        u = fit.unknowns[k]
        inside &= (theta[k] >= u.lowest) & (theta[k] <= u.highest)
        if u.size:
            inside &= np.abs(theta[k] - u.centre) >= u.least
    kept = np.flatnonzero(inside)
    return every[:, kept[:DRAWS]] if len(kept) >= DRAWS else every[:, :DRAWS]
