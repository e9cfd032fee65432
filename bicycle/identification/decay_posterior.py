"""Eigenvalues of the modes in a window with one kind of drift: the most probable ones, and mean and scatter about them.

The maximum is sought from peaks of the spectrum; about it the posterior is summed at points of a heavy-tailed
proposal (importance sampling, Owen, Monte Carlo theory, methods and examples, ch. 9; scrambled Sobol points, always
the same), for with one cycle in the window it is far from normal.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from bicycle.eigenvalues.oscillation import angular_frequency
from bicycle.identification.decay_evidence import Evidence, basis, log_sum
from bicycle.identification.decay_noise import driven
from bicycle.identification.decay_window import Window
from tyre.base.arrays import Array

SLOWEST, FASTEST = 0.1, 200.0  # rad/s
HIGHEST_PEAK = FASTEST / 2  # of a spectrum, rad/s
LOWEST, HIGHEST = -50.0, 20.0  # 1/s
GROWTH = 30.0  # e-folds over the window
POINTS = 64  # for one mode
TAIL = 4.0  # degrees of freedom of the proposal
WIDER = 1.2
ITERATIONS = 25
NEGLIGIBLE = 30.0  # in the logarithm of a weight
DAMPED = np.array([1.0, 0.6, 0.3, 0.1, 0.02])
FACTORS = np.array([0.35, 0.5, 0.65, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 1.8])
DAMPING = (-0.1, 0.02, 0.1, 0.2, 0.35, 0.6)  # -sigma / omega
DEAD = (1.0, 2.5)  # the same of a transient


@dataclass(frozen=True)
class Posterior:
    """What a window says of its modes with one kind of drift.

    Attributes
    ----------
    evidence : Evidence
    best : ndarray, shape (m, 2)
        Most probable sigma (1/s) and omega (rad/s), by frequency.
    modes : ndarray, shape (points, m, 2)
    weights : ndarray, shape (points,)
        Of the points, with sum 1.
    log_evidence : float
        For a prior that is even in sigma and omega; comparable for equal numbers of modes.
    """

    evidence: Evidence
    best: Array
    modes: Array
    weights: Array
    log_evidence: float

    @property
    def mean(self) -> Array:
        """Mean sigma and omega, shape (m, 2)."""
        return np.asarray(np.tensordot(self.weights, self.modes, 1))


def posterior(evidence: Evidence, starts: Sequence[Array]) -> Posterior | None:
    """Find the maximum and sum the posterior about it.

    Parameters
    ----------
    evidence : Evidence
    starts : sequence of ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s) to start from.

    Returns
    -------
    Posterior or None
        None where no maximum lies within the bounds.
    """
    tried = np.array([evidence.log(start[None])[0] for start in starts])
    start = starts[int(tried.argmax())]
    size, points = start.shape, POINTS * 4 ** (len(start) - 1)

    best, covariance = climbed(evidence, start)
    if covariance is None:
        return None
    best = best.ravel()
    root = np.linalg.cholesky(covariance) * WIDER
    z, density = _proposal(best.size, points)
    x = best + z @ root.T
    log = _bounded(evidence, x.reshape(-1, *size)) - density + math.log(np.diag(root).prod())
    total = float(log_sum(log[:, None])[0])
    order = np.argsort(best.reshape(size)[:, 1])
    kept = log > log.max() - NEGLIGIBLE
    return Posterior(
        evidence, best.reshape(size)[order], x.reshape(-1, *size)[kept][:, order], np.exp(log - total)[kept],
        total - math.log(points),
    )  # fmt: skip


def climbed(evidence: Evidence, start: Array) -> tuple[Array, Array | None]:
    """The most probable modes (m, 2) of an ``evidence`` near a ``start`` (m, 2) and their covariance, if any."""
    steps = np.stack([np.full(len(start), 0.1), 0.02 * start[:, 1]], 1).ravel()
    best, covariance = _climb(lambda x: _bounded(evidence, x.reshape(-1, *start.shape)), start.ravel(), steps)
    return best.reshape(start.shape), covariance


def _bounded(evidence: Evidence, modes: Array) -> Array:
    """Log likelihood, and minus infinity beyond the bounds."""
    sigma, omega = modes[..., 0], modes[..., 1]
    highest = min(HIGHEST, GROWTH / evidence.window.length)
    inside = ((sigma > LOWEST) & (sigma < highest) & (omega > SLOWEST) & (omega < FASTEST)).all(-1)
    found = np.full(len(modes), -np.inf)
    if inside.any():
        found[inside] = evidence.log(modes[inside])
    return found


def _climb(log: Callable[[Array], Array], x: Array, steps: Array) -> tuple[Array, Array | None]:
    """Maximum by Newton's method with differences, and the inverse of minus the second derivatives there."""
    n = x.size
    pairs = [(i, j) for i in range(n) for j in range(i)]
    unit = np.eye(n)
    shifts = [s * unit[i] for i in range(n) for s in (1, -1)]
    shifts += [a * unit[i] + b * unit[j] for i, j in pairs for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    stencil = np.array([np.zeros(n), *shifts])
    covariance, gain = None, np.inf
    for _ in range(ITERATIONS):
        top, *rest = log(x + stencil * steps)
        around = np.array(rest)
        if not np.isfinite(top):
            return x, None
        around = np.where(np.isfinite(around), around, top - 50.0)
        up, down = around[: 2 * n : 2], around[1 : 2 * n : 2]
        hessian = np.diag(up + down - 2 * top)
        for k, (i, j) in enumerate(pairs):
            a, b, c, d = around[2 * n + 4 * k : 2 * n + 4 * k + 4]
            hessian[i, j] = hessian[j, i] = (a - b - c + d) / 4
        values, vectors = np.linalg.eigh(-hessian)
        inverse = (vectors / np.maximum(np.abs(values), 0.02)) @ vectors.T
        covariance = np.asarray(inverse * np.outer(steps, steps))
        shift = inverse @ ((up - down) / 2) * steps
        trials = x + np.outer(DAMPED, shift)
        found = log(trials)
        place = int(np.argmax(found))
        gain = found[place] - top
        if gain > 0:
            x = trials[place]
        elif up.max() > top or down.max() > top:  # not a parabola yet
            x = x + stencil[1 + int(np.argmax(around))] * steps
            gain = np.inf
        bends = np.diag(-hessian)
        settled = ((bends > 0.1) & (bends < 3.0)).all()
        steps = steps * np.clip(1 / np.sqrt(np.maximum(np.abs(bends), 1e-4)), 0.1, 5.0)  # to where log falls by 1/2
        if gain < 1e-3 and settled:
            break
    return x, covariance


@cache
def _proposal(size: int, points: int) -> tuple[Array, Array]:
    """Points (points, size) of a t distribution of unit scale, and the log of their density."""
    from scipy.stats import chi2, multivariate_t, norm
    from scipy.stats.qmc import Sobol

    # "rng" is the newer name, of scipy 1.15
    uniform = Sobol(size + 1, seed=np.random.default_rng(1)).random(points)
    z = norm.ppf(uniform[:, :size]) / np.sqrt(chi2.ppf(uniform[:, size], TAIL) / TAIL)[:, None]
    return z, np.asarray(multivariate_t(np.zeros(size), np.eye(size), df=TAIL).logpdf(z)).reshape(-1)


def noise_floor(w: Window, modes: Array) -> Array:
    """Sd (c,) of what the ``modes`` (m, 2) and a parabola leave of each channel of the window ``w``."""
    whole = np.hstack([basis(modes[None], w.time)[0], w.drift])
    left = w.signals - whole @ np.linalg.lstsq(whole, w.signals, rcond=None)[0]
    return np.asarray(np.maximum(np.sqrt((left**2).sum(0) / max(len(w.time) - whole.shape[1], 1)), 1e-6))


def first_guesses(w: Window, start_hz: float | None) -> list[Array]:
    """Single modes to start from, the most probable of a net about the highest peak of the spectrum first.

    Parameters
    ----------
    w : Window
    start_hz : float, optional
        In place of the peak.

    Returns
    -------
    list of ndarray, shape (1, 2)
    """
    peak = _peak(w, w.signals) if start_hz is None else float(angular_frequency(start_hz))
    return _net(w, peak, DAMPING, [])


def further_guess(w: Window, known: Array, start_hz: float | None = None) -> list[Array]:
    """The ``known`` modes (m, 2) with one more, sought in what they leave of a window ``w`` or near ``start_hz``."""
    whole = np.hstack([basis(known[None], w.time)[0], w.drift])
    left = w.signals - whole @ np.linalg.lstsq(whole, w.signals, rcond=None)[0]
    peak = _peak(w, left) if start_hz is None else float(angular_frequency(start_hz))
    return _net(w, peak, (*DAMPING, *DEAD), [known])


def _net(w: Window, peak: float, damping: tuple[float, ...], known: list[Array]) -> list[Array]:
    """The three best (by least squares with a parabola) of a net about a peak."""
    omega = np.clip(FACTORS * peak, 1.01 * SLOWEST, 0.99 * FASTEST)
    net = np.array([[[-zeta * o, o]] for o in omega for zeta in damping])
    net[..., 0] = np.clip(net[..., 0], 0.9 * LOWEST, 0.9 * HIGHEST)
    if known:
        net = np.concatenate([np.repeat(known[0][None], len(net), 0), net], 1)
    fixed = np.broadcast_to(w.drift, (len(net), *w.drift.shape))
    q, _ = np.linalg.qr(np.concatenate([basis(net, w.time), fixed], 2))
    left = (w.signals**2).sum() - ((np.swapaxes(q, 1, 2) @ w.signals) ** 2).sum((1, 2))
    return [net[k] for k in np.argsort(left)[:3]]


def seeking_block(w: Window) -> int:
    """Samples of a window ``w`` that may be made one where peaks are sought; in longer blocks a fast one seems slow."""
    return max(1, int(math.pi / HIGHEST_PEAK / (w.time[1] - w.time[0])))


def _peak(w: Window, signals: Array) -> float:
    """Highest peak of the summed spectra, rad/s."""
    step, size = w.time[1] - w.time[0], 8 * len(w.time)
    power = (np.abs(np.fft.rfft(signals - signals.mean(0), size, axis=0)) ** 2).sum(1)
    frequency = angular_frequency(np.fft.rfftfreq(size, step))
    power = np.where((frequency < 1.0) | (frequency > HIGHEST_PEAK), 0.0, power)
    return float(frequency[int(np.argmax(power))])


def prepared(w: Window, modes: Array, weight: float | None = None) -> tuple[Evidence, Array]:
    """The evidence of a window about modes that are known roughly, for a parabola, and these modes more closely.

    Parameters
    ----------
    w : Window
    modes : ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s).
    weight : float, optional
        Share of the evidence of the channels that counts; by default as at these modes.
    """
    evidence = Evidence(w, "parabola", noise_floor(w, modes), driven(w, modes))
    best, _ = climbed(evidence, modes)
    evidence = Evidence(w, "parabola", noise_floor(w, best), driven(w, best))
    return (evidence.weighed(best) if weight is None else replace(evidence, weight=weight)), best
