"""The judge of the grades: its truth agrees with the package where all numbers are known, its draws with its ranges."""

from dataclasses import replace

import numpy as np
import pytest

from studies.main_study import Settings, tyre_cases
from tests.validation.answer_grades import RANGES, draw, true_wobble

USUAL = {"stiffness": 5000.0, "damping_ratio": 0.25, "hinge": 0.65, "friction": 0.15, "camber_share": 0.65,
         "trail": 0.017, "twisting": 5.0}  # fmt: skip


def test_draws_lie_in_the_stated_ranges_and_half_of_the_fronts_are_measured():
    cases = [draw(seed) for seed in range(100)]
    for name, (low, high) in RANGES.items():
        values = [case.numbers[name] for case in cases]
        assert low <= min(values) < max(values) <= high
    assert 35 <= sum(bool(case.measured) for case in cases) <= 65


def test_the_wobble_range_from_kanes_equations_is_that_of_the_package():
    from studies.main_study import solve

    settings = Settings(draw(1).bicycle, tyre="Tyre1")
    studied = tyre_cases(settings).studied[0]
    span = solve(settings, studied, settings.reference).wobble
    case = replace(draw(1), numbers=USUAL)
    length, growth = true_wobble(case, np.asarray(studied.contact))
    assert length == pytest.approx(min(span.high, 30.0) - span.low, abs=0.5)
    assert growth == pytest.approx(span.growth, abs=0.05)
