"""Numbers as the report prints them, and the check of the standard deviations in words."""

from dataclasses import dataclass, replace

import numpy as np
from small_study import chosen as cases_of
from small_study import small

from studies.main_study.checks import Check, chosen, doubt, excess
from studies.main_study.report_checks import check_table, check_words
from studies.main_study.report_numbers import plain_range, shown_like, signed, signed_range, with_sd
from studies.main_study.study import run_study
from studies.uncertainty.quantity import Quantity
from tyre.base.errors import InputError


@dataclass
class Number:
    value: float
    sd: float
    tyre_sd: float


def test_numbers_have_the_digits_of_their_sd():
    assert with_sd(Number(24.8083, 0.8797, 0.8797)) == "24.8 ± 0.9"
    assert with_sd(Number(24.8083, 1.24, 0.8797)) == "24.8 ± 1.2 (tyre 0.9)"
    assert with_sd(Number(4.90574, 0.000253, 0.000253)) == "4.9057 ± 0.0003"
    assert with_sd(Number(-0.0773, 0.00096, 0.00096)) == "-0.0773 ± 0.0010"
    assert with_sd(Number(1.34, 0.03, 0.001)) == "1.34 ± 0.03 (tyre below 0.03)"
    assert shown_like(38.84, 30.0) == "39"
    assert shown_like(38.84, 0.0) == "38.84"


def test_signs_and_ranges():
    assert signed(-0.0004, ".2f") == "0.00"
    assert signed(0.5, ".1f") == "+0.5"
    assert plain_range([3.04, 2.96], ".1f") == "3.0"
    assert plain_range([3.0, 2.0, 5.0], ".1f") == "2.0 to 5.0"
    assert signed_range([-0.2, 0.1], ".1f") == "-0.2 to +0.1"


def quantity(samples) -> Quantity:
    return Quantity("wobble stable above", "m/s", 20.0, np.array([0.6, 0.8]), {}, np.array(samples))


def test_linear_and_monte_carlo_are_compared_in_words(racing):
    """Two draws a apart have the sd a / sqrt(2); the linear one is 1."""
    result = racing.checks[0].result
    near, wide = (quantity([20.0, 20.0 + a * np.sqrt(2)]) for a in (1.01, 1.2))
    lost = quantity([20.0, 20.0 + np.sqrt(2), np.nan])
    told = check_words(replace(racing, checks=(Check(result, (near, wide, lost)),)))
    assert "In 1 of 3 rows the two standard deviations agree within 5 % (that of the draws is larger by +1.0 %)" in told
    assert "They differ for Tyre1 flat, " in told
    assert "wobble stable above by +20.0 %; Tyre1 flat" in told
    assert "wobble stable above by 0.0 %, lost in 1 draws" in told
    assert "They differ" not in check_words(replace(racing, checks=(Check(result, (near,)),)))
    assert "rows" not in check_words(replace(racing, checks=()))


def test_checks_take_the_most_doubtful_cases_and_the_same_linear_sd(racing):
    settings = racing.settings
    assert [one.result.setup for one in racing.checks] == [settings.reference] * 2 + list(settings.setups[1:])
    for one in racing.checks:
        rivals = racing.of(one.result.setup, one.result.case.name if one.result.setup == settings.reference else None)
        assert doubt(one.result) == max(doubt(r) for r in rivals)
        found = {q.name: q.linear_sd for q in one.quantities}
        assert not one.failure
        for name, part in (("frequency", one.result.frequency), ("damping ratio", one.result.damping)):
            np.testing.assert_allclose(found[f"wobble {name} at 15 m/s"], part["wobble"].sd, rtol=1e-6)
        assert all(len(q.samples) <= settings.samples for q in one.quantities)
    best = next(one for one in racing.checks if one.result.case.name == "Tyre1 flat")
    assert max(abs(excess(q)) for q in best.quantities if not q.lost) < 0.2  # 60 draws


def test_the_most_doubtful_is_the_one_whose_wobble_speed_moves_most(racing):
    first = racing.of(racing.settings.reference, "Tyre3 flat")
    for result in first:
        ends = [edge for edge in (result.bands(40.0)[0].start, result.bands(40.0)[0].end) if edge]
        assert doubt(result) == max(edge.sd / edge.speed for edge in ends)
    assert chosen(racing.results)[1] in first


def test_a_check_that_fails_is_said_and_costs_nothing(racing, monkeypatch):
    def refuse(*arguments):
        raise InputError("no draw is a bicycle")

    settings = small(fronts=2, speeds=racing.settings.speeds[::4])
    monkeypatch.setattr("studies.main_study.checks.check", refuse)
    study = run_study(settings, cases=cases_of(settings, {"Tyre1 flat": (5.5,)}))
    assert len(study.results) == 4
    assert [one.failure for one in study.checks] == ["no draw is a bicycle"] * 4
    told = check_words(study)
    assert "Tyre1 flat, 5.5 bar, hands on, rigid front: this check could not be made (no draw is a bicycle)." in told
    assert check_table(study).startswith("Nothing to compare")
