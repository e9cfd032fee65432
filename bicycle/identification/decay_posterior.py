"""Eigenvalues of the modes in a window with one kind of drift: the most probable ones, and mean and scatter about them.

The maximum is sought from peaks of the spectrum; about it the posterior is summed at points of a heavy-tailed
proposal (importance sampling, Owen, Monte Carlo theory, methods and examples, ch. 9; scrambled Sobol points, always
the same), for with one cycle in the window it is far from normal.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.decay_evidence import PLAIN, WITH_REAL_MODE, Evidence
from bicycle.identification.decay_guesses import FASTEST, HIGHEST, LOWEST, SLOWEST, noise_floor
from bicycle.identification.decay_least_squares import Linear, Solved, log_sum
from bicycle.identification.decay_noise import Driving
from bicycle.identification.decay_window import SHARES, Window
from tyre.base.arrays import Array

GROWTH = 30.0  # e-folds over the window
POINTS = 64  # for one mode
FEWEST_POINTS = 3.0  # that must carry the posterior
TAIL = 4.0  # degrees of freedom of the proposal
SCRAMBLED = {2: 14}  # seed by dimension, 1 for others: so few points must give a normal distribution its own sd
WIDER = 1.2
ITERATIONS, IDLE = 25, 3  # the latter without gain, where a direction is flat
NOTHING = 1e-6  # of a gain in the logarithm: what rounding may bring
NEGLIGIBLE = 30.0  # in the logarithm of a weight
UNLIKELY = 0.03  # of driven modes: their own eigenvalues are not sought
ROUNDS, GAINED = 5, 0.5  # the latter in the logarithm of the likelihood
DAMPED = np.array([1.0, 0.6, 0.3, 0.1, 0.02])
LEAST_DECAY = 0.5  # e-folds of a real mode over the window; what decays less is a parabola
RATES = 7  # of a real mode, to start from


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
        For a prior that is even in sigma and omega, and in the logarithm of a rate; comparable for equal numbers of
        modes.
    best_rate, rates : ndarray, shape (1,) and (points,), optional
        Decay of the real mode of an exponential drift, 1/s.
    driven : ndarray, shape (f,)
        Probabilities that something drives the modes all along the window with each share.
    """

    evidence: Evidence
    best: Array
    modes: Array
    weights: Array
    log_evidence: float
    best_rate: Array | None = None
    rates: Array | None = None
    driven: Array = field(default_factory=lambda: np.zeros(SHARES.size))


def posterior(evidence: Evidence, starts: Sequence[Array]) -> tuple[Posterior, Linear] | None:
    """Find the maximum and sum the posterior about it.

    Parameters
    ----------
    evidence : Evidence
    starts : sequence of ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s) to start from.

    Returns
    -------
    Posterior and Linear, or None
        With the amplitudes at its points; None where no maximum lies within the bounds.
    """
    m = len(starts[0])
    span = _rates(evidence)
    trials = np.array([start.ravel() for start in starts])
    if span is not None:
        middle = np.linspace(*span, RATES + 2)[1:-1]
        trials = np.array([[*x, rate] for x in trials for rate in middle])
    order = np.argsort(-_bounded(evidence, trials, m))
    if span is None:
        likely = [trials[order[0]]]
    else:  # slow and quick real modes may both have a maximum
        places = [
            next(k for k in order if low <= trials[k, -1] <= high) for low, high in itertools.pairwise(middle[::2])
        ]
        likely = [trials[k] for k in dict.fromkeys(places)]
    climbs = [_climbed(evidence, start, m) for start in likely]
    maxima = [(x, covariance) for x, covariance in climbs if covariance is not None]
    if not maxima:
        return None
    best, covariance = maxima[int(np.argmax(_bounded(evidence, np.array([x for x, _ in maxima]), m)))]
    points = POINTS * 4 ** (m - 1) * (1 if span is None else 2)
    root = np.linalg.cholesky(covariance) * WIDER
    z, density = _proposal(best.size, points)
    x = best + z @ root.T
    volume = math.log(np.diag(root).prod()) - density
    log, inside, solved = _solved(evidence, x, m)
    if solved is None:
        return None
    log += volume
    if _effective(log) < FEWEST_POINTS:  # rounding hides the shape of it: normal, as the second derivatives say
        normal = _bounded(evidence, best[None], m) - 0.5 * ((WIDER * z) ** 2).sum(1) + volume
        log = np.where(np.isfinite(log), normal, -np.inf)
    total = float(log_sum(log[:, None])[0])
    kept = log > log.max() - NEGLIGIBLE
    (most,), best_rate = _parted(best[None], m)
    modes, rates = _parted(x[kept], m)
    order = np.argsort(most[:, 1])
    prior = 0.0 if span is None else math.log(span[1] - span[0])
    weights, solved = np.exp(log - total)[kept], solved.at(kept[inside])
    found = Posterior(
        evidence, most[order], modes[:, order], weights, total - math.log(points) - prior, best_rate, rates,
        weights @ solved.chances_driven(),
    )  # fmt: skip
    return found, solved.linear().sorted(order)


def _effective(log: Array) -> float:
    """How many points carry the sum of their weights, by the logarithms ``log`` of these."""
    weights = np.exp(log - log.max())
    return float(weights.sum() ** 2 / (weights**2).sum())


@np.errstate(over="ignore")  # a trial far beyond the bounds, which is not used
def _parted(x: Array, m: int) -> tuple[Array, Array | None]:
    """Modes (points, m, 2) and rates (points,) of numbers (points, 2 m), or 2 m + 1 with the logarithm of a rate."""
    rates = np.exp(x[:, -1]) if x.shape[1] > 2 * m else None
    return x[:, : 2 * m].reshape(-1, m, 2), rates


def _rates(evidence: Evidence) -> tuple[float, float] | None:
    """Least and largest logarithm of the rate of a real mode; None where there is none."""
    if evidence.drift not in WITH_REAL_MODE:
        return None
    w = evidence.window
    return math.log(LEAST_DECAY / w.length), math.log(1 / w.time[1])


def climbed(evidence: Evidence, start: Array) -> Array:
    """The most probable modes (m, 2) of an ``evidence`` without a real mode, near a ``start`` (m, 2)."""
    return _climbed(evidence, start.ravel(), len(start))[0].reshape(start.shape)


def _climbed(evidence: Evidence, start: Array, m: int) -> tuple[Array, Array | None]:
    """The most probable numbers near a ``start`` (d,) and their covariance, if any."""
    steps = np.array([*np.stack([np.full(m, 0.1), 0.02 * start[1 : 2 * m : 2]], 1).ravel(), 0.1])[: start.size]
    return _climb(lambda x: _bounded(evidence, x, m), start, steps)


def _bounded(evidence: Evidence, x: Array, m: int) -> Array:
    """Log likelihood, and minus infinity beyond the bounds."""
    return _solved(evidence, x, m)[0]


def _solved(evidence: Evidence, x: Array, m: int) -> tuple[Array, NDArray[np.bool_], Solved | None]:
    """Log likelihood as :func:`_bounded`, which points lie within the bounds, and their least squares."""
    modes, rates = _parted(x, m)
    sigma, omega = modes[..., 0], modes[..., 1]
    highest = min(HIGHEST, GROWTH / evidence.window.length)
    within = (sigma > LOWEST) & (sigma < highest) & (omega > SLOWEST) & (omega < FASTEST)
    inside = np.asarray(within.all(-1))
    span = _rates(evidence)
    if span is not None:
        inside &= (x[:, -1] > span[0]) & (x[:, -1] < span[1])
    found = np.full(len(x), -np.inf)
    if not inside.any():
        return found, inside, None
    solved = evidence.solved(modes[inside], None if rates is None else rates[inside])
    found[inside] = solved.log()
    return found, inside, solved


def _climb(log: Callable[[Array], Array], x: Array, steps: Array) -> tuple[Array, Array | None]:
    """Maximum by Newton's method with differences, and the inverse of minus the second derivatives there."""
    n = x.size
    pairs = [(i, j) for i in range(n) for j in range(i)]
    unit = np.eye(n)
    shifts = [s * unit[i] for i in range(n) for s in (1, -1)]
    shifts += [a * unit[i] + b * unit[j] for i, j in pairs for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    stencil = np.array([np.zeros(n), *shifts])
    covariance, gain, idle = None, np.inf, 0
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
        if gain > NOTHING:
            x = trials[place]
        elif up.max() > top or down.max() > top:  # not a parabola yet
            x = x + stencil[1 + int(np.argmax(around))] * steps
            gain = np.inf
        bends = np.diag(-hessian)
        settled = ((bends > 0.1) & (bends < 3.0)).all()
        steps = steps * np.clip(1 / np.sqrt(np.maximum(np.abs(bends), 1e-4)), 0.1, 5.0)  # to where log falls by 1/2
        idle = idle + 1 if gain < 1e-3 else 0
        if idle and (settled or idle > IDLE):
            break
    return x, covariance


@cache
def _proposal(size: int, points: int) -> tuple[Array, Array]:
    """Points (points, size) of a t distribution of unit scale, and the log of their density."""
    from scipy.stats import chi2, multivariate_t, norm
    from scipy.stats.qmc import Sobol

    # "rng" is the newer name, of scipy 1.15
    seed = np.random.default_rng(SCRAMBLED.get(size, 1))
    uniform = Sobol(size + 1, seed=seed).random(points)
    z = norm.ppf(uniform[:, :size]) / np.sqrt(chi2.ppf(uniform[:, size], TAIL) / TAIL)[:, None]
    return z, np.asarray(multivariate_t(np.zeros(size), np.eye(size), df=TAIL).logpdf(z)).reshape(-1)


def prepared(w: Window, modes: Array) -> tuple[Evidence, Array]:
    """The evidence of a window about modes that are known roughly, for a parabola, and these modes more closely.

    Parameters
    ----------
    w : Window
    modes : ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s).
    """
    best = climbed(Evidence(w, "parabola", noise_floor(w, modes)), modes)
    return _with_driving(Evidence(w, "parabola", noise_floor(w, best)), best), best


def _with_driving(evidence: Evidence, modes: Array) -> Evidence:
    """The ``evidence`` with driven modes, sought from ``modes`` (m, 2), which are those of noise of the sensors."""
    if not evidence.window.driven.any():
        return evidence
    found, most, phases = None, -math.inf, None
    for _ in range(ROUNDS):  # what is driven has the eigenvalues of the modes, which hang on what is driven
        trial, phases = _pushed(evidence, modes, phases)
        kinds = [replace(trial, drift=drift) for drift in PLAIN]
        best = max(kinds, key=lambda kind: float(kind.log(modes[None])[0]))
        if best.solved(modes[None]).chances_driven()[0].sum() < UNLIKELY:
            return found or trial
        modes = climbed(best, modes)
        log = float(best.log(modes[None])[0])
        if found is None or log > most:
            found = trial
        if log < most + GAINED:
            break
        most = log
    return found or evidence


def _pushed(evidence: Evidence, modes: Array, phases: Array | None) -> tuple[Evidence, Array]:
    """The ``evidence`` with driven ``modes`` (m, 2), pushed in these ``phases`` (m,), and the phases.

    Without phases, each is the most probable given those before.
    """
    driving = Driving.of(evidence.window, modes)
    if phases is not None:
        return replace(evidence, driven=driving.at(phases.tolist())), phases
    phases, chosen = np.zeros(len(modes)), evidence
    for k in range(len(modes)):
        trials = []
        for phase in driving.phases[k]:
            phases[k] = phase
            trial = replace(evidence, driven=driving.at(phases.tolist()))
            kinds = (replace(trial, drift=drift).solved(modes[None]).driven for drift in PLAIN)
            trials.append((max(float(log_sum(one.log.T)[0]) for one in kinds if one is not None), phase, trial))
        _, phases[k], chosen = max(trials, key=lambda one: one[0])
    return chosen, phases
