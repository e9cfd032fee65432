"""Modes of one window over all kinds of drift: eigenvalues and ratios with all that adds to their sd."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bicycle.identification.decay_evidence import PLAIN, basis, drift_of
from bicycle.identification.decay_guesses import (
    FASTEST,
    SLOWEST,
    first_guesses,
    further_guess,
    noise_floor,
    seeking_block,
)
from bicycle.identification.decay_posterior import Posterior, posterior, prepared
from bicycle.identification.decay_ratios import mode_ratios
from bicycle.identification.decay_window import Window, fitting_block
from tyre.base.arrays import Array

CLEAR = math.log(20)  # of the odds for a further mode
APART, STAYS = 2.0, 0.25  # |eigenvalue| of a further mode over that of others; how far they may move, over their size
INTERVAL = (0.025, 0.975)
NORMAL = 2 * 1.959964
ROUNDING = 1e-9  # of an eigenvalue: no sd is smaller
MOST_SOUGHT = 4000  # samples in which peaks are sought


@dataclass(frozen=True)
class Estimate:
    """What one window says; the kinds of drift that were tried are weighed by their evidence.

    Attributes
    ----------
    window : Window
    posteriors : tuple of Posterior
        One of each kind and size of drift.
    weights : tuple of float
        Their probabilities, with sum 1.
    mean, sd : ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s) of each mode, by frequency; sd is the 95 % interval over 3.92.
    ratios : tuple of dict, one for each mode
        Ratio of rates -> its value and its 1-sigma, one for both parts.
    """

    window: Window
    posteriors: tuple[Posterior, ...]
    weights: tuple[float, ...]
    mean: Array
    sd: Array
    ratios: tuple[dict[str, tuple[complex, float]], ...]

    @property
    def best(self) -> Posterior:
        """With the most probable drift."""
        return self.posteriors[int(np.argmax(self.weights))]

    @property
    def kinds(self) -> dict[str, float]:
        """Kind of drift, with its size -> probability."""
        return {p.evidence.drift: weight for p, weight in zip(self.posteriors, self.weights, strict=True)}

    @property
    def drifts(self) -> dict[str, float]:
        """Kind of drift -> probability, the most probable first."""
        found: dict[str, float] = {}
        for kind, weight in self.kinds.items():
            name = drift_of(kind)
            found[name] = found.get(name, 0.0) + weight
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    @property
    def driven(self) -> float | None:
        """Probability that something drives the modes all along the window; None where it was not weighed."""
        return None if self.best.evidence.driven is None else min(float(self.shares.sum()), 1.0)

    @property
    def shares(self) -> Array:
        """Probability of each share of driven modes, shape (f,)."""
        return np.array(self.weights) @ np.array([p.driven for p in self.posteriors])

    def curves(self) -> tuple[Array, Array]:
        """Fit and drift of the most probable kind, shape (n, c) each, in units of the window's scale."""
        waves, amplitudes = self._best()
        p = 2 * len(self.mean)
        drift = waves[:, p:] @ amplitudes[:, p:].T
        return np.asarray(waves[:, :p] @ amplitudes[:, :p].T + drift), np.asarray(drift)

    def energies(self) -> Array:
        """Sum of squares of each mode over the window and all channels, shape (m,)."""
        waves, amplitudes = self._best()
        return np.array(
            [((waves[:, k : k + 2] @ amplitudes[:, k : k + 2].T) ** 2).sum() for k in range(0, 2 * len(self.mean), 2)]
        )

    @property
    def explained(self) -> float:
        """Share of the squares of all channels that modes and drift explain at most, with any amplitudes (R^2).

        Where the modes are driven, the amplitudes of :meth:`curves` leave what the driving moved.
        """
        return 1 - float((self.left() ** 2).sum()) / self.window.signals.size

    def left(self) -> Array:
        """What modes and drift leave at least of each channel, shape (n, c), in units of the window's scale."""
        waves, signals = self._best()[0], self.window.signals
        return np.asarray(signals - waves @ np.linalg.lstsq(waves, signals, rcond=None)[0])

    def _best(self) -> tuple[Array, Array]:
        """Waves and drift (n, h) at the most probable eigenvalues, and their amplitudes (c, h)."""
        modes, rate = self.best.best[None], self.best.best_rate
        amplitudes = self.best.evidence.solved(modes, rate).linear().mean[0]
        waves = basis(modes, self.window.time, rate)[0]
        return np.hstack([waves, self.window.drift[:, : amplitudes.shape[1] - waves.shape[1]]]), amplitudes


def estimate(w: Window, drifts: Sequence[str], starts: Sequence[Array]) -> Estimate | None:
    """Modes of a window, over some kinds of drift.

    Parameters
    ----------
    w : Window
    drifts : sequence of str
    starts : sequence of ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s).

    Returns
    -------
    Estimate or None
        None where there is no maximum within the bounds.
    """
    evidence, best = prepared(w, starts[0])
    tried = [posterior(replace(evidence, drift=drift), [best, *starts[1:]]) for drift in drifts]
    both = [pair for pair in tried if pair is not None]
    if not both:
        return None
    found, amplitudes = zip(*both, strict=True)
    logs = np.array([p.log_evidence for p in found])
    kinds = np.exp(logs - logs.max())
    kinds /= kinds.sum()
    modes = np.concatenate([p.modes for p in found])
    weights = np.concatenate([weight * p.weights for p, weight in zip(found, kinds, strict=True)])
    mean = np.tensordot(weights, modes, 1)
    sd = np.empty_like(mean)
    for place in np.ndindex(*mean.shape):
        low, high = _quantiles(modes[:, *place], weights)
        sd[place] = max((high - low) / NORMAL, ROUNDING * float(np.hypot(*mean[place[0]])))
    shapes = tuple(mode_ratios(found, amplitudes, kinds, number) for number in range(len(mean)))
    return Estimate(w, found, tuple(float(x) for x in kinds), mean, sd, shapes)


def sought(
    cut: Callable[[int], Window], drifts: Sequence[str], start_hz: float | None, count: int, *, further: bool
) -> Estimate | None:
    """Modes of a window, sought from the peaks of its spectrum.

    Parameters
    ----------
    cut : callable
        The window with a number of samples made one.
    drifts : sequence of str
    start_hz : float, optional
        Where to look for the first.
    count : int
        Number of modes that are asked for.
    further : bool
        One more is fitted beside where the evidence for it is clear (odds of 20) and it leaves the others what they
        are.
    """
    whole = cut(1)
    whole = cut(max(1, min(len(whole.time) // MOST_SOUGHT, seeking_block(whole))))
    starts = first_guesses(whole, start_hz)
    rough, w = starts, _fine(cut, whole, starts)
    for _ in range(1, count):  # the next is sought in what the fitted ones leave; a guess leaves more of itself
        starts, rough = further_guess(whole, prepared(w, starts[0])[1]), further_guess(whole, rough[0])
        w = _fine(cut, whole, starts)
    found = estimate(w, drifts, starts)
    if found is None and count > 1:  # where no more are there, little is left to begin from
        w = _fine(cut, whole, rough)
        found = estimate(w, drifts, rough)
    if found is None or not further:
        return found
    starts = further_guess(whole, found.best.best)
    spared = np.log(noise_floor(w, found.best.best) / noise_floor(w, starts[0])).sum()
    if len(w.time) * spared < CLEAR:  # at most so much evidence, were the noise white
        return found
    w = _fine(cut, whole, starts)
    drift = [found.best.evidence.drift]
    few, more = estimate(w, drift, [found.best.best]), estimate(w, drift, starts)
    if few is None or more is None or not clearer(more.best, few.best) or not _beside(few.best.best, more.best.best):
        return found
    both = estimate(w, drifts, [more.best.best])
    return found if both is None or not _beside(few.best.best, both.best.best) else both


def _fine(cut: Callable[[int], Window], whole: Window, starts: Sequence[Array]) -> Window:
    """The window with as many samples made one as the fastest mode of the best start allows."""
    return cut(whole.block * fitting_block(whole, float(starts[0][:, 1].max())))


def _beside(few: Array, more: Array) -> bool:
    """Whether one ``more`` mode (m + 1, 2) leaves the ``few`` (m, 2) what they are and is none of their kind.

    Two that share between them what one oscillation fitted are no answer to what that one is: a motion that is no sum
    of exponentials looks like that.
    """
    stays, other = few[:, 0] + 1j * few[:, 1], more[:, 0] + 1j * more[:, 1]
    away = np.abs(other[:, None] - stays) / np.abs(stays)
    further = int(away.min(1).argmax())
    apart = np.abs(np.log(np.abs(other[further] / np.delete(other, further)))).min()
    return bool(np.delete(away, further, 0).min(0).max() < STAYS and apart > math.log(APART))


def clearer(more: Posterior, few: Posterior) -> bool:
    """Whether the odds of ``more`` modes over ``few`` are 20 or higher."""
    return _log_odds(more, few) > CLEAR


def log_odds_of_each(found: Estimate) -> Array:
    """Logarithm of the odds of each of several modes (m,), infinite where none less would do in the same window.

    One less is fitted from where each of them is left out in turn. Where the best of these does as well, the mode that
    it does without is the one in doubt, and the next is asked for among the others.

    Parameters
    ----------
    found : Estimate
    """
    w, evidence = found.window, found.best.evidence
    odds, left = np.full(len(found.mean), math.inf), list(range(len(found.mean)))
    while len(left) > 1:
        modes = found.best.best[left]
        starts = [modes, *(np.delete(modes, k, 0) for k in range(len(modes)))]
        every, *tried = (estimate(w, [evidence.drift], [start]) for start in starts)
        fewer = [one.best for one in tried if one is not None]
        if every is None or not fewer:
            break
        few = max(fewer, key=lambda one: one.log_evidence)
        if clearer(every.best, few):
            break
        away = np.linalg.norm(modes[:, None] - few.best[None], axis=-1).min(1)
        odds[left.pop(int(away.argmax()))] = _log_odds(every.best, few)
    return odds


def log_odds_of_any(found: Estimate) -> float:
    """Logarithm of the odds of the modes over a drift and the noise of sensors alone.

    Parameters
    ----------
    found : Estimate
    """
    without = [replace(found.best.evidence, driven=None, drift=d).log(np.empty((1, 0, 2)))[0] for d in PLAIN]
    with_modes = [p.log_evidence - _occam(p) for p in found.posteriors]
    more, less = (np.logaddexp.reduce(logs) - math.log(len(logs)) for logs in (with_modes, without))
    return float(more - less)


def _log_odds(more: Posterior, few: Posterior) -> float:
    return more.log_evidence - _occam(more) - few.log_evidence + _occam(few)


def _occam(found: Posterior) -> float:
    """Log of the prior range of the modes: omega even in its logarithm, sigma up to omega to both sides."""
    omega = found.best[:, 1]
    return float(np.log(2 * omega**2 * math.log(FASTEST / SLOWEST)).sum())


def _quantiles(x: Array, weights: Array) -> tuple[float, float]:
    order = np.argsort(x)
    share = np.cumsum(weights[order]) - 0.5 * weights[order]
    low, high = np.interp(INTERVAL, share, x[order])
    return float(low), float(high)
