"""A hypothesis without effects is fitted from where the best effect leads, if its own search ended higher."""

from types import SimpleNamespace

import pytest

from studies.inference import null_from


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
