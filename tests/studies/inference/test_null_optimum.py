"""Parameters alone find their best optimum: with less of the data's weight at first, or from where an effect leads."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from studies.inference import Kind, Rows, UncertainParameter, fit, null_from

HILLS = CubicSpline([0, 0.5, 1, 2, 4, 6, 8], [0, 0.3, 1.05, 0.2, 0.1, 0.8, 0.1], bc_type=((1, 1 / 6), (1, 0.0)))


@dataclass(frozen=True)
class TwoHills(Kind):
    """One datum of 1 +- 0.01, computed as a curve with a hill that reaches it at 1, and one of 0.8 at 6."""

    nuisances: tuple = (UncertainParameter("place", "1", {"place": 1.0}, 0.0, 1.0),)
    rows: Rows = field(default_factory=lambda: Rows(("x",), np.zeros(1), ("x",), np.zeros(1, int)))

    def residual(self, candidates, theta, *, slopes=True):
        return 100 * (1 - HILLS(theta)), -100 * HILLS(theta, 1)[:, None]


def test_with_less_weight_of_the_data_a_first_step_does_not_lead_to_the_farther_optimum():
    """The slope at the prior mean of 0 promises to reach the datum at 6, which is 6 prior sd away."""
    (hasty,), (patient,) = fit(TwoHills()).theta, fit(TwoHills(), patient=True).theta
    assert hasty == pytest.approx(6, abs=0.5)
    assert 0.8 < patient < 1.3
    assert HILLS(patient) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize(("best", "again", "taken"), [(80.0, 81.0, True), (80.0, 99.5, False), (99.5, 0.0, False)])
def test_an_effect_gets_no_credit_for_a_better_optimum(monkeypatch, best, again, taken):
    null = SimpleNamespace(objective=100.0)
    effect = SimpleNamespace(objective=best, converged=True, theta=[1.0, 2.0, 9.0], effect_columns=slice(2, 3))
    asked = []

    def fit(kind, *, starts):
        asked.append(starts)
        return SimpleNamespace(objective=again)

    monkeypatch.setattr("studies.inference.starts.fit", fit)
    found = null_from(null, [effect], None)
    assert (found is not null) == taken
    assert asked == ([[[1.0, 2.0]]] if best < 99.0 else [])
