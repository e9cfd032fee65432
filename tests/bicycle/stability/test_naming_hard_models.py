"""Random models that were hard to name or to search: names hang on no other speed, unstable roots add up."""

import json
from pathlib import Path

import numpy as np
import pytest
from built import linear

from bicycle import critical_speeds, load_bicycle, modes

CASES = json.loads((Path(__file__).parents[1] / "hard_models.json").read_text())


def drawn(case):
    return linear(load_bicycle("benchmark").replace(**case["bicycle"]), **case["effects"])


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_names_do_not_hang_on_what_else_is_asked(case):
    model = drawn(case)
    speeds = np.array([0.1, 0.7, 5.0, 17.0, *case.get("at_m_s", [])])
    every = modes(model, np.concatenate([speeds, np.linspace(0.5, 40.0, 50)]))
    for k, speed in enumerate(speeds):
        alone = modes(model, [speed])
        for name, roots in every.branches.items():
            mine = alone.branches[name][0] if name in alone.branches else np.empty(0)
            np.testing.assert_array_equal(mine[~np.isnan(mine)], roots[k][~np.isnan(roots[k])])


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_unstable_roots_change_at_critical_speeds_only(case):
    model = drawn(case)
    found = critical_speeds(model, 40.0)
    speeds = np.linspace(0.5, 40.0, 800)
    unstable = (model.eigenvalues(speeds).real > 0).sum(1)
    change = sum(c.unstable_roots * ((speeds > c.speed) & (c.speed > 0.5)) for c in found)
    np.testing.assert_array_equal(unstable, unstable[0] + change)
