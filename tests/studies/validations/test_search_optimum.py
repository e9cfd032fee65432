"""Random starts find the optimum that a fit missed, on a forward model with a row of local optima (synthetic)."""

import json
from dataclasses import dataclass, field

import numpy as np
import pytest

from studies.inference import Candidate, ForwardModel, Rows, UncertainParameter
from studies.inference.fit import fit
from studies.validations.search_optimum import against_random, one_case, random_start, run

X = np.linspace(0.0, 1.0, 40)
SIZE = UncertainParameter("size", "1", {"wave": 1.0}, 0.0, 10.0, 0.0, 60.0, size=True)
WAVE = Candidate("wave", (SIZE,))


@dataclass(frozen=True)
class Wave(ForwardModel):
    """data = sin(size x): another minimum every few units of the size."""

    data: np.ndarray
    candidates: tuple = (WAVE,)
    nuisances: tuple = ()
    rows: Rows = field(default_factory=lambda: Rows(("x",) * 40, X, ("x",) * 40, np.arange(40) % 5))

    def residual(self, candidates, theta, *, slopes=True):
        return (self.data - np.sin(theta[0] * X)) / 0.05, -(X * np.cos(theta[0] * X))[:, None] / 0.05


@pytest.mark.parametrize(("start", "reached"), [(2.0, False), (20.5, True)])
def test_a_fit_that_stopped_elsewhere_is_found_out(start, reached):
    forward = Wave(np.sin(21.0 * X) + 0.05 * np.random.default_rng(4).standard_normal(40))
    found = fit(forward, (WAVE,), starts=[np.array([start])])
    row = against_random(forward, found, np.random.default_rng(5), 40)
    assert row["reached"] is reached
    assert row["random"] == pytest.approx(fit(forward, (WAVE,), starts=[np.array([21.0])]).objective, abs=0.01)
    assert row["share_of_starts"] > 0


def test_random_starts_stay_within_bounds_and_go_from_neutral_to_what_seldom_occurs():
    draws = np.array([random_start((SIZE,), np.random.default_rng(k)) for k in range(200)])
    assert draws.min() >= 0
    assert draws.min() < 1
    assert 28 < draws.max() <= 30


def test_cases_that_were_computed_are_not_computed_again_and_one_that_raised_counts_as_missed(tmp_path):
    lower = {"hypothesis": "a", "search": 2.0, "random": 1.0, "reached": False, "share_of_starts": 0.5}
    rows = [
        {"seed": 8, "starts": 3, "compared": [], "error": "ArithmeticError: no matter what"},
        {"seed": 6, "starts": 3, "compared": [lower | {"reached": True}, lower], "error": None},
        {"seed": 7, "starts": 3, "compared": [lower | {"reached": True}], "error": None},
        {"seed": 7, "starts": 4, "compared": [lower], "error": None},  # of another count
    ]
    file = tmp_path / "search_optimum_cases.jsonl"
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    found = run(out=tmp_path, seed=6, cases=3, starts=3)  # nothing is left to do
    assert (found["fits_compared"], found["cases_with_every_optimum_reached"]) == (3, 1)
    assert found["missed"] == [{"seed": 6, **lower}]
    assert found["errors"] == [{"seed": 8, "error": "ArithmeticError: no matter what"}]
    assert found["random_starts_that_reached_it"] == 0.5


def test_what_raises_is_kept_with_its_error():
    assert one_case(-1, 2)["error"].startswith("ValueError")  # no generator has a negative seed
