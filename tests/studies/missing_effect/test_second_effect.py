"""A second effect that the data cannot rule out: it is said, and the stated sd allows for it (synthetic, linear)."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from studies.missing_effect.engine.forward import Rows
from studies.missing_effect.engine.judge import Subject, judge
from studies.missing_effect.engine.unknown import Candidate, Unknown

N = 24
X = np.linspace(0.0, 1.0, N)
SHAPES = {"slope": X, "bend": (X - 0.3) ** 2, "ripple": np.sin(9 * X)}
LEVEL = Unknown("level", "1", {"level": 1.0}, 0.0, 1.0)
SCALE = 4.0


@dataclass(frozen=True)
class Linear:
    """data = level + sum of size * shape, noise sd 1, all priors normal."""

    data: np.ndarray
    candidates: tuple
    nuisances: tuple = (LEVEL,)
    thorough: bool = True
    refused: tuple = ()
    notes: tuple = ()
    rows: Rows = field(default_factory=lambda: Rows(("x",) * N, X, ("x",) * N, np.arange(N) % 4))

    def residual(self, candidates, theta, *, slopes=True):
        columns = np.stack([np.ones(N), *(SHAPES[c.identifier] for c in candidates)], 1)
        return self.data - columns @ theta, -columns

    def log_determinant(self, candidates, theta):
        return 0.0

    def extras(self):
        return ()

    def compatible(self, candidates):
        return True

    def further(self, candidates):
        return ()

    def phenomenological(self):
        return ()

    def refined(self, best):
        return self


def posterior(data, *names):
    """Mean, variance of the first effect's size and ln evidence: textbook normal equations, no code of the engine."""
    columns = np.stack([np.ones(N), *(SHAPES[name] for name in names)], 1)
    prior = np.diag([1.0, *[SCALE**2] * len(names)])
    gain = prior @ columns.T @ np.linalg.inv(np.eye(N) + columns @ prior @ columns.T)
    evidence = multivariate_normal.logpdf(data, cov=np.eye(N) + columns @ prior @ columns.T)
    return (gain @ data)[1], (prior - gain @ columns @ prior)[1, 1], evidence


def diagnosed(bend, *, seed=3):
    data = 3 * X + bend * SHAPES["bend"] + np.random.default_rng(seed).standard_normal(N)
    sizes = {name: Unknown("size", "1", {name: 1.0}, 0.0, SCALE, size=True) for name in SHAPES}
    candidates = tuple(Candidate(name, (size,)) for name, size in sizes.items())
    return data, judge(Linear(data, candidates), Subject("synthetic")).verdict


def odds(data, second):
    """Of slope and another effect against slope alone: one of three pairs has half the prior of one of three."""
    return math.exp(posterior(data, "slope", second)[2] - posterior(data, "slope")[2]) / 2


@pytest.mark.parametrize("bend", [0.0, 2.0, 3.0])
def test_the_sd_allows_for_a_second_effect_that_cannot_be_ruled_out(bend):
    data, verdict = diagnosed(bend)
    alone, variance, _ = posterior(data, "slope")
    total, weights, said = variance, 1.0, []
    for second in ("bend", "ripple"):
        weight = odds(data, second)
        if weight > 1 / 20:
            mean, spread, _ = posterior(data, "slope", second)
            total, weights = total + weight * (spread + (mean - alone) ** 2), weights + weight
            said.append(second)
    assert said[0] == "bend"
    (found,) = verdict.effects
    value, sd = found.parameters["size"]
    assert (verdict.verdict, found.identifier) == ("named", "slope")
    assert value == pytest.approx(alone, rel=1e-3)
    assert sd == pytest.approx(math.sqrt(total / weights), rel=1e-3)
    assert sd > 1.2 * math.sqrt(variance)
    (told,) = (w for w in verdict.warnings if w.startswith("beside slope cannot be ruled out, with odds: "))
    assert [second for second in ("bend", "ripple") if f"{second} (" in told] == said


def test_a_second_effect_that_is_likely_but_not_clear_makes_a_class():
    data, verdict = diagnosed(8.0, seed=5)
    assert 3 < odds(data, "bend") < 20
    assert verdict.verdict == "class"
    assert [set(name.split("+")) for name in verdict.equivalent] == [{"slope"}, {"slope", "bend"}]
    assert [e.identifier for e in verdict.effects] == ["slope"]


def test_a_second_effect_that_is_clear_is_named():
    data, verdict = diagnosed(9.0, seed=4)
    assert odds(data, "bend") > 20
    assert {e.identifier for e in verdict.effects} == {"slope", "bend"}
