"""Decays that noise drowns: whether an oscillation is there at all, and whether what it leaves is noise.

A small R^2 says that noise is loud or that another motion was recorded. The first only makes the answer less sure,
which its sd tells; the second makes it wrong.
"""

import math

import numpy as np
from scipy.stats import chi2

from bicycle.identification.decay_estimate import CLEAR, Estimate, log_odds_of_any
from tyre.base.arrays import Array

LEAST = 0.01  # p below which what is left is not taken for noise
LAGS = 20


def why_drowned(found: Estimate) -> str:
    """Why a decay with a small R^2 tells nothing, in words; empty where it does.

    Parameters
    ----------
    found : Estimate
    """
    odds = log_odds_of_any(found)
    if odds < CLEAR:
        said = f"{math.exp(odds):.2g}" if odds > -200 else "less than 1e-86"
        return f"an oscillation beside drift and noise has odds of {said} : 1 (at least {math.exp(CLEAR):g})"
    p = probability_of_noise(found)
    if p > LEAST:
        return ""
    return f"what is left is no noise (p {p:.2g}): another motion, or its own that something drives, is too large"


def probability_of_noise(found: Estimate) -> float:
    """Probability that noise leaves at least as much correlation between neighbours as the most probable modes do.

    Portmanteau test of Ljung & Box (1978, Biometrika 65, 297-303), all channels together, of what is left over its
    most probable noise.

    Parameters
    ----------
    found : Estimate
    """
    left = _whitened(found)
    n, channels = left.shape
    lags = np.arange(1, max(min(n // 5, LAGS), 3) + 1)
    left = left - left.mean(0)
    correlations = np.array([(left[lag:] * left[:-lag]).sum(0) for lag in lags]) / (left**2).sum(0)
    total = n * (n + 2) * (correlations**2 / (n - lags)[:, None]).sum()
    return float(chi2.sf(total, lags.size * channels))


def _whitened(found: Estimate) -> Array:
    """What is left (n, c) over the most probable kind of noise."""
    best = found.best
    noise, w = best.evidence.solved(best.best[None], best.best_rate).most_probable(), found.window
    left = found.left()
    driven = best.evidence.driven
    if noise.share is None or driven is None:
        phi = w.colours[noise.colours]
        return np.asarray(left[1:] - phi * left[:-1])
    along = driven.directions * driven.level[:, None, None]
    scaled = ((w.signals - found.curves()[0]) / driven.level).T  # the driving moved more than any amplitudes leave
    shrunk = 1 / np.sqrt(1 + driven.variances[noise.share]) - 1
    along = along.reshape(scaled.size, -1)
    whole = scaled.ravel() + along @ (shrunk * (scaled.ravel() @ along))
    return np.asarray(whole.reshape(scaled.shape).T)
