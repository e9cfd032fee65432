"""The marginal likelihood of a window by dense covariances: y ~ N(0, s^2 (K + X P X')), the prior of log s even."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag, toeplitz
from scipy.optimize import minimize
from scipy.special import gammaln
from scipy.stats import norm

from bicycle import identification as room

MODES = np.array([[-0.8, 4.5]])
NEAR = np.array([[[-0.7, 4.6]], [[-0.9, 4.4]]])  # points at which it is asked for
RATES = np.array([1.3, 0.9])


@pytest.fixture
def seen():
    rng, t = np.random.default_rng(3), np.arange(0, 2.0, 0.05)
    wave = np.exp(complex(*MODES[0]) * t)
    channels = {
        "roll_rate_rad_s": wave.real + 0.2 * np.exp(-1.2 * t) + 0.05 * rng.standard_normal(t.size),
        "steer_rad": ((0.4 - 0.3j) * wave).real + 0.1 + 0.03 * rng.standard_normal(t.size),
    }
    return room.window(room.Run("r.csv", 5.0, t, channels, {}), 0.0, 10.0)


def dense(y, covariance, design, prior):
    whole = covariance + design @ prior @ design.T
    sign, logdet = np.linalg.slogdet(whole)
    assert sign > 0
    left = y @ np.linalg.solve(whole, y)
    return gammaln(y.size / 2) - 0.5 * (y.size * np.log(np.pi * left) + logdet)


def designs(w, drift, rates):
    """Columns (n, h) at each point, and the prior covariance of their amplitudes in units of the signal, by channel."""
    waves = room.basis(NEAR, w.time, rates)
    sizes = room.KINDS[drift]
    kept = len(sizes)
    for k in range(len(NEAR)):
        own = waves[k].T @ waves[k] / len(w.time)
        blocks = [np.linalg.inv(own[:2, :2]) * room.AMPLITUDE**2]
        blocks += [[[room.REAL**2 / own[2, 2]]]] if rates is not None else []
        level = np.maximum(1.0, np.abs(w.signals.mean(0)))
        priors = [
            block_diag(*blocks, *[[[(sd * (size if not j else 1)) ** 2]] for j, sd in enumerate(sizes)])
            for size in level
        ]
        yield np.hstack([waves[k], w.drift[:, :kept]]), priors


def over_colours(w, y, design, prior):
    """The mean likelihood of a channel over the colours of its noise, as a logarithm."""
    lags = np.arange(len(w.time))
    each = [dense(y, toeplitz(phi**lags), design, prior) for phi in w.colours]
    return np.log(np.mean(np.exp(np.array(each) - max(each)))) + max(each)


@pytest.mark.parametrize(("drift", "rates"), [
    ("none", None), ("parabola", None), ("parabola/10", None),
    ("exponential", RATES), ("parabola-exponential/3", RATES),
])  # fmt: skip
def test_noise_of_the_sensors(seen, drift, rates):
    noise = room.noise_floor(seen, MODES)
    found = room.Evidence(seen, drift, noise).solve(NEAR, rates).log()
    for k, (design, priors) in enumerate(designs(seen, drift, rates)):
        channels = zip(seen.signals.T, priors, noise, strict=True)
        total = sum(over_colours(seen, y, design, prior / sd**2) for y, prior, sd in channels)
        assert found[k] == pytest.approx(total, abs=1e-6)


@pytest.mark.parametrize("drift", ["none", "constant", "parabola"])
def test_a_drift_and_noise_without_any_mode(seen, drift):
    """What the odds for an oscillation are taken against."""
    noise, kept = room.noise_floor(seen, MODES), len(room.KINDS[drift])
    total = 0.0
    for channel, y in enumerate(seen.signals.T):
        level = max(1.0, abs(y.mean()))
        sizes = [(sd * (1 if j else level) / noise[channel]) ** 2 for j, sd in enumerate(room.KINDS[drift])]
        total += over_colours(seen, y, seen.drift[:, :kept], np.diag(sizes))
    assert room.Evidence(seen, drift, noise).solve(np.empty((1, 0, 2))).log()[0] == pytest.approx(total, abs=1e-6)


def test_of_two_maxima_a_slow_and_a_quick_real_mode_the_higher_is_found():
    """The quick one is three nats higher; from the best start alone the slow one was found, four sd from it."""
    run = room.read_run(Path(__file__).with_name("growing_weave.csv"), 4.15)
    found = room.identify(run, drift="exponential", thorough=False).estimate.best
    best = found.evidence.solve(found.best[None], found.best_rate).log()[0]
    for rate in (0.16, 0.3, 0.6, 1.0, 1.4, 1.8, 2.4):

        def minus_log(x, rate=rate):
            return -found.evidence.solve(x[None, None], np.array([rate])).log()[0]

        other = minimize(minus_log, [0.72, 1.86], method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-4})
        assert best > -other.fun - 0.01


@pytest.mark.parametrize(("size", "points"), [(2, room.POINTS), (3, 2 * room.POINTS), (4, 4 * room.POINTS)])
def test_the_points_give_a_normal_distribution_its_own_standard_deviation(size, points):
    """95 % intervals in many directions through unit normals of as many dimensions, by the weights of the points."""
    z, density = room.proposal(size, points)
    x = room.WIDER * z
    weights = np.exp(-0.5 * (x**2).sum(1) - density)
    weights /= weights.sum()
    directions = np.random.default_rng(3).standard_normal((300, size))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    ends = np.array([room.interval(x @ u, weights) for u in directions])
    sd = (ends[:, 1] - ends[:, 0]) / (2 * norm.ppf(0.975))
    assert abs(sd.mean() - 1) < 0.02
    assert sd.std() < 0.05
    assert abs(ends.mean()) < 0.05
