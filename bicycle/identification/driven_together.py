"""Whether something drives free decays that were recorded together: each run is told what the others say of it.

One window leaves a faint driving open. Runs of one test share their ground: it drives none of them, or all with about
the same share, and with probability 1 - :data:`ALIKE` a run is another case. What is known of each before its own
samples are seen then follows from those of the others by Bayes' rule (Gelman et al., Bayesian Data Analysis, ch. 5).
"""

from collections.abc import Callable, Sequence

import numpy as np

from bicycle.identification.decay_window import EVEN, SHARES
from bicycle.identification.free_decay import Decay
from tyre.base.arrays import Array
from tyre.base.errors import InputError

ALIKE = 0.95
SPREAD = 1.0  # sd of the shares of runs on one ground, in steps of SHARES
LEAST = 1e-9  # of a probability: below it only rounding tells
SAME = 0.01  # change of the probability of any share that leaves a fit what it is


def chances_by_others(alone: Array) -> Array:
    """Probability that each run is driven with each share, before its own samples are seen, by those of the others.

    Parameters
    ----------
    alone : ndarray, shape (n, f)
        The same by the samples of each run alone, from :data:`EVEN`; that itself for one that tells nothing.

    Returns
    -------
    ndarray, shape (n, f)

    Raises
    ------
    InputError
        No probabilities, or of another number of shares.
    """
    p = np.asarray(alone, float)
    if p.ndim != 2 or p.shape[1] != SHARES.size or not ((p >= 0).all() and (p.sum(1) <= 1 + 1e-6).all()):
        raise InputError(
            f"probabilities {p.tolist()}: of each run one for each of {SHARES.size} shares is needed, 0 to 1 in sum"
        )
    prior, states = _with_nothing(EVEN[None])[0], _with_nothing(p)
    likelihoods = np.log(np.maximum(states, LEAST) / prior)
    given = _given_ground(prior)
    top = likelihoods.max(1, keepdims=True)
    each = np.log(np.exp(likelihoods - top) @ given.T)  # (n, grounds); the top cancels
    others = np.log(prior) + each.sum(0) - each
    ground = np.exp(others - others.max(1, keepdims=True))
    return np.asarray((ground / ground.sum(1, keepdims=True) @ given)[:, 1:])


def _with_nothing(shares: Array) -> Array:
    """Probabilities (n, f + 1): that nothing drives the run, then of the ``shares`` (n, f)."""
    return np.hstack([1 - shares.sum(1, keepdims=True), shares])


def _given_ground(prior: Array) -> Array:
    """Probabilities of the states of a run (columns: nothing, each share) for each of the same states of its ground."""
    steps = np.arange(SHARES.size)
    near = np.exp(-0.5 * ((steps[:, None] - steps) / SPREAD) ** 2)
    alike = np.zeros((prior.size, prior.size))
    alike[0, 0], alike[1:, 1:] = 1.0, near / near.sum(1, keepdims=True)
    return ALIKE * alike + (1 - ALIKE) * prior


def together(
    alone: Sequence[Sequence[Decay]], again: Callable[[int, Array], Sequence[Decay]]
) -> tuple[list[Sequence[Decay]], int]:
    """Decays of runs of one test, of which each is told what the others say of the driving.

    Parameters
    ----------
    alone : sequence of sequence of Decay
        Modes of each run, fitted by itself from even odds.
    again : callable
        Fits a run, by its place, from other probabilities that it is driven with each share.

    Returns
    -------
    list of sequence of Decay
        Those of ``alone``, fitted again where the others change what is known of them.
    int
        How many were.
    """
    own = [_driven(modes) for modes in alone]
    found, fitted = list(alone), 0
    if sum(shares is not None for shares in own) < 2:
        return found, fitted
    told = chances_by_others(np.array([EVEN if shares is None else shares for shares in own]))
    for place, (shares, chances) in enumerate(zip(own, told, strict=True)):
        if shares is None:
            continue
        then = _with_nothing(shares[None]) * _with_nothing(chances[None]) / _with_nothing(EVEN[None])
        if np.abs(then[0, 1:] / then.sum() - shares).max() > SAME:
            found[place], fitted = again(place, chances), fitted + 1
    return found, fitted


def _driven(modes: Sequence[Decay]) -> Array | None:
    """Probability that a run is driven with each share; None where it tells nothing of it."""
    first = modes[0]
    if first.rejected or first.estimate is None or first.estimate.driven is None:
        return None
    return first.estimate.shares / max(float(first.estimate.shares.sum()), 1.0)
