"""Find the modes of a window and sum the posterior of their eigenvalues over all kinds of drift.

For one kind of drift the maximum is sought from peaks of the spectrum; about it the posterior is summed at points of a
heavy-tailed proposal (importance sampling, Owen, Monte Carlo theory, methods and examples, ch. 9; scrambled Sobol
points, always the same), for with one cycle in the window it is far from normal. The kinds are weighed by their
evidence.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from bicycle.identification import decay_noise as noise
from bicycle.identification.recording import CHANNELS
from tyre.ground.arrays import Array

CLEAR = math.log(20)  # of the odds for a further mode
POINTS, WIDER, TAIL = 64, 1.2, 4.0  # for one mode; proposal over posterior; its degrees of freedom
RATIOS = {
    "steer_over_lean": ("steer_rate_rad_s", "roll_rate_rad_s"),
    "yaw_over_lean": ("yaw_rate_rad_s", "roll_rate_rad_s"),
}
ANGLES = {"steer_rate_rad_s": "steer_rad", "roll_rate_rad_s": "lean_rad"}


@dataclass(frozen=True)
class Posterior:
    """Posterior of the modes with one kind of drift, for a prior that is even in sigma, omega and log rate."""

    evidence: noise.Evidence  # window and kind of drift
    best: Array  # (m, 2), most probable sigma (1/s) and omega (rad/s), by frequency
    modes: Array  # (points, m, 2)
    weights: Array  # (points,), with sum 1
    log_evidence: float  # comparable for equal numbers of modes
    best_rate: Array | None  # (1,), decay of the real mode of an exponential drift, 1/s
    linear: noise.Linear  # amplitudes at the points

    @property
    def occam(self) -> float:
        """Logarithm of the prior range of the modes: omega even in its logarithm, sigma up to omega to both sides."""
        return float(np.log(2 * self.best[:, 1] ** 2 * math.log(noise.FASTEST / noise.SLOWEST)).sum())


@dataclass(frozen=True)
class Estimate:
    """Modes of one window; the kinds of drift that were tried are weighed by their evidence."""

    window: noise.Window  # whose samples were fitted
    posteriors: tuple[Posterior, ...]  # one of each kind and size of drift
    weights: tuple[float, ...]  # their probabilities, with sum 1
    mean: Array  # (m, 2), sigma (1/s) and omega (rad/s), by frequency
    sd: Array  # (m, 2), the 95 % interval over 3.92
    ratios: tuple[dict[str, tuple[complex, float]], ...]  # of each mode: ratio of rates -> value and sd of both parts

    @property
    def best(self) -> Posterior:
        """Posterior with the most probable drift."""
        return self.posteriors[int(np.argmax(self.weights))]

    @property
    def kinds(self) -> dict[str, float]:
        """Kind of drift, with its size -> probability."""
        return {p.evidence.drift: weight for p, weight in zip(self.posteriors, self.weights, strict=True)}

    @property
    def drifts(self) -> dict[str, float]:
        """Kind of drift -> probability, the most probable first."""
        kinds = [(kind.partition("/")[0], weight) for kind, weight in self.kinds.items()]
        drifts = {name: sum(weight for drift, weight in kinds if drift == name) for name, _ in kinds}
        return dict(sorted(drifts.items(), key=lambda item: -item[1]))

    def curves(self) -> tuple[Array, Array]:
        """Fit and drift of the most probable kind, (n, c) each, in units of the window's scale."""
        waves, amplitudes = self._best_fit()
        p = 2 * len(self.mean)
        drift = waves[:, p:] @ amplitudes[:, p:].T
        return np.asarray(waves[:, :p] @ amplitudes[:, :p].T + drift), np.asarray(drift)

    def energies(self) -> Array:
        """Sum of squares of each mode over the window and all channels, (m,)."""
        waves, amplitudes = self._best_fit()
        places = [slice(k, k + 2) for k in range(0, 2 * len(self.mean), 2)]
        return np.array([((waves[:, two] @ amplitudes[:, two].T) ** 2).sum() for two in places])

    def energy_from(self, starts: Sequence[float]) -> list[float]:
        """Sum of squares of the oscillations from each of some times on, s after the first sample of the run."""
        fitted, drift = self.curves()
        power = ((fitted - drift) ** 2).sum(1)
        return [float(power[self.window.start + self.window.time >= start].sum()) for start in starts]

    @property
    def explained(self) -> float:
        """Share of the squares of all channels that modes and drift explain at most (R^2)."""
        return 1 - float((self.residual() ** 2).sum()) / self.window.signals.size

    def residual(self) -> Array:
        """Residual of each channel with any amplitudes, (n, c), in units of the window's scale."""
        waves, signals = self._best_fit()[0], self.window.signals
        return np.asarray(signals - waves @ np.linalg.lstsq(waves, signals, rcond=None)[0])

    def whiten(self, residual: Array) -> Array:
        """Residual of each sample given the one before it, by the most probable noise of each channel."""
        best = self.best
        phi = self.window.colours[best.evidence.solve(best.best[None], best.best_rate).colour()]
        return np.asarray(residual[1:] - phi * residual[:-1])

    def _best_fit(self) -> tuple[Array, Array]:
        """Waves and drift (n, h) at the most probable eigenvalues, and their amplitudes (c, h)."""
        modes, rate = self.best.best[None], self.best.best_rate
        amplitudes = self.best.evidence.solve(modes, rate).linear().mean[0]
        waves = noise.basis(modes, self.window.time, rate)[0]
        return np.hstack([waves, self.window.drift[:, : amplitudes.shape[1] - waves.shape[1]]]), amplitudes


def posterior(evidence: noise.Evidence, starts: Sequence[Array]) -> Posterior | None:
    """Find the maximum near ``starts`` (m, 2) and sum the posterior about it; None without one within the bounds."""
    m = len(starts[0])
    span = _rates(evidence)
    trials = np.array([start.ravel() for start in starts])
    if span is not None:
        middle = np.linspace(*span, 9)[1:-1]
        trials = np.array([[*x, rate] for x in trials for rate in middle])
    order = np.argsort(-_solve(evidence, trials, m)[0])
    if span is None:
        likely = [trials[order[0]]]
    else:  # slow and quick real modes may both have a maximum
        ends = itertools.pairwise(middle[::2])
        places = [next(k for k in order if low <= trials[k, -1] <= high) for low, high in ends]
        likely = [trials[k] for k in dict.fromkeys(places)]
    climbs = [_climb_from(evidence, start, m) for start in likely]
    maxima = [(x, covariance) for x, covariance in climbs if covariance is not None]
    if not maxima:
        return None
    best, covariance = maxima[int(np.argmax(_solve(evidence, np.array([x for x, _ in maxima]), m)[0]))]
    points = POINTS * 4 ** (m - 1) * (1 if span is None else 2)
    root = np.linalg.cholesky(covariance) * WIDER
    z, density = proposal(best.size, points)
    x = best + z @ root.T
    volume = math.log(np.diag(root).prod()) - density
    log, within_bounds, solved = _solve(evidence, x, m)
    if solved is None:
        return None
    log += volume
    weights = np.exp(log - log.max())
    if weights.sum() ** 2 / (weights**2).sum() < 3:  # rounding hides the shape: normal, as the second derivatives say
        normal = _solve(evidence, best[None], m)[0] - 0.5 * ((WIDER * z) ** 2).sum(1) + volume
        log = np.where(np.isfinite(log), normal, -np.inf)
    total = float(noise.log_sum(log[:, None])[0])
    relevant = log > log.max() - 30.0
    (most,), best_rate = _split_rate(best[None], m)
    order = np.argsort(most[:, 1])
    prior = 0.0 if span is None else math.log(span[1] - span[0])
    linear = solved.take(relevant[within_bounds]).linear().reorder(order)
    modes = _split_rate(x[relevant], m)[0][:, order]
    evidence_log = total - math.log(points) - prior
    return Posterior(evidence, most[order], modes, np.exp(log - total)[relevant], evidence_log, best_rate, linear)


def estimate(w: noise.Window, drifts: Sequence[str], starts: Sequence[Array]) -> Estimate | None:
    """Weigh the modes of a window over some kinds of drift, from ``starts`` (m, 2); None without a maximum."""
    evidence, best = evidence_about(w, starts[0])
    of_drifts = [posterior(replace(evidence, drift=drift), [best, *starts[1:]]) for drift in drifts]
    posteriors = tuple(of_drift for of_drift in of_drifts if of_drift is not None)
    if not posteriors:
        return None
    logs = np.array([p.log_evidence for p in posteriors])
    kinds = np.exp(logs - logs.max())
    kinds /= kinds.sum()
    modes = np.concatenate([p.modes for p in posteriors])
    weights = np.concatenate([weight * p.weights for p, weight in zip(posteriors, kinds, strict=True)])
    mean = np.tensordot(weights, modes, 1)
    ends = np.array([interval(modes[:, *place], weights) for place in np.ndindex(*mean.shape)]).reshape(*mean.shape, 2)
    sd = np.maximum((ends[..., 1] - ends[..., 0]) / (2 * 1.959964), 1e-9 * np.hypot(*mean.T)[:, None])  # rounding
    ratios = tuple(_ratios(posteriors, weights, number) for number in range(len(mean)))
    return Estimate(w, posteriors, tuple(float(x) for x in kinds), mean, sd, ratios)


def seek_modes(
    cut: Callable[[int], noise.Window], drifts: Sequence[str], start_hz: float | None, count: int, *, further: bool
) -> Estimate | None:
    """Seek ``count`` modes from the peaks of the spectrum, one after the other; ``further``: one more if it is clear.

    ``cut`` gives the window whose samples are means of so many of the recording.
    """
    whole = cut(1)
    whole = cut(max(1, min(len(whole.time) // 4000, whole.seeking_block)))

    def fine(starts: Sequence[Array]) -> noise.Window:
        return cut(whole.block * whole.fitting_block(float(starts[0][:, 1].max())))

    starts = noise.guesses(whole, start_hz=start_hz)
    rough, w = starts, fine(starts)
    for _ in range(1, count):  # the next is sought in what the fitted ones leave; a guess leaves more of itself
        starts, rough = noise.guesses(whole, evidence_about(w, starts[0])[1]), noise.guesses(whole, rough[0])
        w = fine(starts)
    fit = estimate(w, drifts, starts)
    if fit is None and count > 1:  # if no more are there, little is left to begin from
        w = fine(rough)
        fit = estimate(w, drifts, rough)
    if fit is None or not further:
        return fit
    starts = noise.guesses(whole, fit.best.best)
    spared = np.log(noise.noise_floor(w, fit.best.best) / noise.noise_floor(w, starts[0])).sum()
    if len(w.time) * spared < CLEAR:  # at most so much evidence, were the noise white
        return fit
    w = fine(starts)
    drift = [fit.best.evidence.drift]
    fewer, more = estimate(w, drift, [fit.best.best]), estimate(w, drift, starts)
    if (
        fewer is None
        or more is None
        or not clearer(more.best, fewer.best)
        or not _keeps_modes(fewer.best.best, more.best.best)
    ):
        return fit
    weighed = estimate(w, drifts, [more.best.best])
    return fit if weighed is None or not _keeps_modes(fewer.best.best, weighed.best.best) else weighed


def _keeps_modes(fewer: Array, more: Array) -> bool:
    """True if ``more`` modes (m + 1, 2) keep the ``fewer`` (m, 2), and the further one differs in size by factor 2."""
    stays, all_modes = fewer[:, 0] + 1j * fewer[:, 1], more[:, 0] + 1j * more[:, 1]
    distance = np.abs(all_modes[:, None] - stays) / np.abs(stays)
    added = int(distance.min(1).argmax())
    size_ratio = np.abs(np.log(np.abs(all_modes[added] / np.delete(all_modes, added)))).min()
    return bool(np.delete(distance, added, 0).min(0).max() < 0.25 and size_ratio > math.log(2.0))


def _log_odds(more: Posterior, fewer: Posterior) -> float:
    return more.log_evidence - more.occam - fewer.log_evidence + fewer.occam


def clearer(more: Posterior, fewer: Posterior) -> bool:
    """True if the odds of ``more`` modes over ``fewer`` are 20 or higher."""
    return _log_odds(more, fewer) > CLEAR


def log_odds_of_each(fit: Estimate) -> Array:
    """Logarithm of the odds of each of several modes (m,), infinite if none less would do in the same window."""
    odds = np.full(len(fit.mean), math.inf)
    remaining = list(range(len(fit.mean)))
    while len(remaining) > 1:
        modes = fit.best.best[remaining]
        starts = [modes, *(np.delete(modes, k, 0) for k in range(len(modes)))]
        whole, *reduced = (estimate(fit.window, [fit.best.evidence.drift], [start]) for start in starts)
        fewer = [estimate_without.best for estimate_without in reduced if estimate_without is not None]
        if whole is None or not fewer:
            break
        likeliest = max(fewer, key=lambda fit: fit.log_evidence)
        if clearer(whole.best, likeliest):
            break
        distance = np.linalg.norm(modes[:, None] - likeliest.best[None], axis=-1).min(1)
        odds[remaining.pop(int(distance.argmax()))] = _log_odds(whole.best, likeliest)
    return odds


def log_odds_of_any(fit: Estimate) -> float:
    """Logarithm of the odds of the modes over a drift and noise alone."""
    none = np.empty((1, 0, 2))
    drift_alone = [replace(fit.best.evidence, drift=drift).solve(none).log()[0] for drift in noise.PLAIN]
    with_modes = [p.log_evidence - p.occam for p in fit.posteriors]
    more, less = (np.logaddexp.reduce(logs) - math.log(len(logs)) for logs in (with_modes, drift_alone))
    return float(more - less)


def evidence_about(w: noise.Window, modes: Array) -> tuple[noise.Evidence, Array]:
    """Evidence of a window about modes (m, 2) that are known roughly, for a parabola, and these modes more closely."""
    rough = noise.Evidence(w, "parabola", noise.noise_floor(w, modes))
    best = _climb_from(rough, modes.ravel(), len(modes))[0].reshape(modes.shape)
    return noise.Evidence(w, "parabola", noise.noise_floor(w, best)), best


def interval(x: Array, weights: Array) -> tuple[float, float]:
    """Ends of the central 95 % of points ``x`` (points,) with ``weights`` (points,), in the unit of ``x``."""
    order = np.argsort(x)
    low, high = np.interp((0.025, 0.975), np.cumsum(weights[order]) - 0.5 * weights[order], x[order])
    return float(low), float(high)


@cache
def proposal(size: int, points: int) -> tuple[Array, Array]:
    """Points (points, size) of a t distribution of unit scale, and the log of their density."""
    from scipy.stats import chi2, multivariate_t, norm
    from scipy.stats.qmc import Sobol

    seed = np.random.default_rng(14 if size == 2 else 1)  # so few points must give a normal distribution its own sd
    uniform = Sobol(size + 1, seed=seed).random(points)  # "rng" is the newer name, of scipy 1.15
    z = norm.ppf(uniform[:, :size]) / np.sqrt(chi2.ppf(uniform[:, size], TAIL) / TAIL)[:, None]
    return z, np.asarray(multivariate_t(np.zeros(size), np.eye(size), df=TAIL).logpdf(z)).reshape(-1)


def ratio_pairs(channels: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Pairs of channels whose ratio a mode has: :data:`RATIOS`; of sensors at other places each over the first."""
    if set(channels) & set(CHANNELS):
        return RATIOS
    return {f"{name}_over_{channels[0]}": (name, channels[0]) for name in channels[1:]}


def _ratios(posteriors: Sequence[Posterior], weights: Array, number: int) -> dict[str, tuple[complex, float]]:
    """Ratios of one mode by the law of total variance over its posterior: value, and sd of both parts."""
    w, turn = posteriors[0].evidence.window, np.array([1, -1j])
    root = np.concatenate([p.modes[:, number, 0] + 1j * p.modes[:, number, 1] for p in posteriors])
    two = slice(2 * number, 2 * number + 2)
    phasors = np.concatenate([p.linear.mean[:, :, two] @ turn for p in posteriors])
    blocks = np.concatenate([p.linear.covariance[:, :, two][..., two] for p in posteriors])
    spread = np.real(np.einsum("pcij,i,j->pc", blocks, turn, turn.conj()))
    ratios = {}
    for name, pair in ratio_pairs(w.channels).items():
        columns = [rate if rate in w.channels else ANGLES.get(rate, "") for rate in pair]
        if not set(columns) <= set(w.channels):
            continue
        a, b = (w.channels.index(column) for column in columns)
        over, under = (
            w.scale[k] * (1.0 if w.channels[k] == rate else root) for k, rate in zip((a, b), pair, strict=True)
        )
        value = over * phasors[:, a] / (under * phasors[:, b])
        miss = spread[:, a] + np.abs(phasors[:, a] / phasors[:, b]) ** 2 * spread[:, b]
        variance = miss / np.abs(phasors[:, a]) ** 2 * np.abs(value) ** 2 / 2
        mean = complex(weights @ value)
        ratios[name] = (mean, math.sqrt(float(weights @ (variance + np.abs(value - mean) ** 2 / 2))))
    return ratios


@np.errstate(over="ignore")  # a trial far beyond the bounds, which is not used
def _split_rate(x: Array, m: int) -> tuple[Array, Array | None]:
    """Modes (points, m, 2) and rates (points,) of numbers (points, 2 m), or 2 m + 1 with the logarithm of a rate."""
    rates = np.exp(x[:, -1]) if x.shape[1] > 2 * m else None
    return x[:, : 2 * m].reshape(-1, m, 2), rates


def _rates(evidence: noise.Evidence) -> tuple[float, float] | None:
    """Least and largest logarithm of the rate of a real mode; None without one."""
    w = evidence.window
    return (math.log(0.5 / w.length), math.log(1 / w.time[1])) if evidence.drift in noise.WITH_REAL_MODE else None


def _solve(evidence: noise.Evidence, x: Array, m: int) -> tuple[Array, NDArray[np.bool_], noise.Solved | None]:
    """Log likelihood (minus infinity beyond the bounds), which points lie within, and their least squares."""
    modes, rates = _split_rate(x, m)
    sigma, omega = modes[..., 0], modes[..., 1]
    highest = min(noise.HIGHEST, 30.0 / evidence.window.length)  # e-folds over the window
    within = (sigma > noise.LOWEST) & (sigma < highest) & (omega > noise.SLOWEST) & (omega < noise.FASTEST)
    inside = np.asarray(within.all(-1))
    span = _rates(evidence)
    if span is not None:
        inside &= (x[:, -1] > span[0]) & (x[:, -1] < span[1])
    log_likelihood = np.full(len(x), -np.inf)
    if not inside.any():
        return log_likelihood, inside, None
    solved = evidence.solve(modes[inside], None if rates is None else rates[inside])
    log_likelihood[inside] = solved.log()
    return log_likelihood, inside, solved


def _climb_from(evidence: noise.Evidence, start: Array, m: int) -> tuple[Array, Array | None]:
    """The most probable numbers near a ``start`` (d,) and their covariance, if any."""
    steps = np.array([*np.stack([np.full(m, 0.1), 0.02 * start[1 : 2 * m : 2]], 1).ravel(), 0.1])[: start.size]
    return _climb(lambda x: _solve(evidence, x, m)[0], start, steps)


def _climb(log: Callable[[Array], Array], x: Array, steps: Array) -> tuple[Array, Array | None]:
    """Climb to a maximum by Newton's method with differences; the inverse of minus the second derivatives there."""
    n = x.size
    pairs = [(i, j) for i in range(n) for j in range(i)]
    unit = np.eye(n)
    shifts = [s * unit[i] for i in range(n) for s in (1, -1)]
    shifts += [a * unit[i] + b * unit[j] for i, j in pairs for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    stencil = np.array([np.zeros(n), *shifts])
    damped = np.array([1.0, 0.6, 0.3, 0.1, 0.02])
    covariance, gain, idle = None, np.inf, 0
    for _ in range(25):
        top, *heights_around = log(x + stencil * steps)
        around = np.array(heights_around)
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
        trials = x + np.outer(damped, inverse @ ((up - down) / 2) * steps)
        heights = log(trials)
        place = int(np.argmax(heights))
        gain = heights[place] - top
        if gain > 1e-6:  # less is rounding
            x = trials[place]
        elif up.max() > top or down.max() > top:  # not a parabola yet
            x = x + stencil[1 + int(np.argmax(around))] * steps
            gain = np.inf
        bends = np.diag(-hessian)
        settled = ((bends > 0.1) & (bends < 3.0)).all()
        steps = steps * np.clip(1 / np.sqrt(np.maximum(np.abs(bends), 1e-4)), 0.1, 5.0)  # to where log falls by 1/2
        idle = idle + 1 if gain < 1e-3 else 0
        if idle and (settled or idle > 3):  # a direction may be flat
            break
    return x, covariance
