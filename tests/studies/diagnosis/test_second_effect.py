"""A second effect that the data cannot rule out: it is said; where it is likely, the sd allows for it (synthetic)."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from studies.inference import Candidate, Kind, Rows, UncertainParameter, judge

N = 24
X = np.linspace(0.0, 1.0, N)
SHAPES = {"slope": X, "bend": (X - 0.3) ** 2, "ripple": np.sin(9 * X)}
LEVEL = UncertainParameter("level", "1", {"level": 1.0}, 0.0, 1.0)
SCALE = 4.0


@dataclass(frozen=True)
class Linear(Kind):
    """data = level + sum of size * shape, noise sd 1, all priors normal."""

    readings: np.ndarray
    candidates: tuple
    nuisances: tuple = (LEVEL,)
    rows: Rows = field(default_factory=lambda: Rows(("x",) * N, X, ("x",) * N, np.arange(N) % 4))

    def residual(self, candidates, theta, *, slopes=True):
        columns = np.stack([np.ones(N), *(SHAPES[c.identifier] for c in candidates)], 1)
        return self.readings - columns @ theta, -columns


def posterior(data, *names):
    """Mean, variance of the first effect's size and ln evidence: textbook normal equations, no code of the engine."""
    columns = np.stack([np.ones(N), *(SHAPES[name] for name in names)], 1)
    prior = np.diag([1.0, *[SCALE**2] * len(names)])
    gain = prior @ columns.T @ np.linalg.inv(np.eye(N) + columns @ prior @ columns.T)
    evidence = multivariate_normal.logpdf(data, cov=np.eye(N) + columns @ prior @ columns.T)
    return (gain @ data)[1], (prior - gain @ columns @ prior)[1, 1], evidence


def diagnosed(bend, *, seed=3):
    data = 3 * X + bend * SHAPES["bend"] + np.random.default_rng(seed).standard_normal(N)
    sizes = {name: UncertainParameter("size", "1", {name: 1.0}, 0.0, SCALE, size=True) for name in SHAPES}
    candidates = tuple(Candidate(name, (size,)) for name, size in sizes.items())
    return data, judge(Linear(data, candidates)).verdict


def odds(data, second):
    """Of slope and another effect against slope alone: one of three pairs has half the prior of one of three."""
    return math.exp(posterior(data, "slope", second)[2] - posterior(data, "slope")[2]) / 2


@pytest.mark.parametrize("bend", [0.0, 2.0, 3.0])
def test_a_second_effect_that_cannot_be_ruled_out_is_said(bend):
    data, verdict = diagnosed(bend)
    alone, variance, _ = posterior(data, "slope")
    (found,) = verdict.effects
    assert (verdict.verdict, found.identifier) == ("named", "slope")
    assert found.parameters["size"] == pytest.approx((alone, math.sqrt(variance)), rel=1e-3)
    (told,) = (w for w in verdict.warnings if w.startswith("in addition to slope not ruled out, with odds: "))
    for second in ("bend", "ripple"):
        assert (f"{second} (" in told) == (odds(data, second) > 1 / 20)
    against = 1 / odds(data, "bend")
    assert f"bend (1 : {against:.0f})" in told


def test_one_that_is_likely_but_not_clear_joins_the_class_and_the_sd_allows_for_it():
    data, verdict = diagnosed(8.0, seed=5)
    weight = odds(data, "bend")
    assert 3 < weight < 20
    assert verdict.verdict == "class"
    assert [set(name.split("+")) for name in verdict.equivalent] == [{"slope"}, {"slope", "bend"}]
    alone, variance, _ = posterior(data, "slope")
    both, spread, _ = posterior(data, "slope", "bend")
    (found,) = verdict.effects
    value, sd = found.parameters["size"]
    assert (found.identifier, value) == ("slope", pytest.approx(alone, rel=1e-3))
    assert sd == pytest.approx(math.sqrt((variance + weight * (spread + (both - alone) ** 2)) / (1 + weight)), rel=1e-3)
    assert abs(value - 3) > 2 * math.sqrt(variance)  # what the effect alone would claim
    assert abs(value - 3) < 2 * sd


def test_a_second_effect_that_is_clear_is_named():
    data, verdict = diagnosed(9.0, seed=4)
    assert odds(data, "bend") > 20
    assert {e.identifier for e in verdict.effects} == {"slope", "bend"}
