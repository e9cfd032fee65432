"""Synthetic measurements of an independent chain model on which earlier searches failed, each with its right answer."""

from dataclasses import replace
from pathlib import Path

import pytest
from small_library import among

from studies.diagnosis import doubts, read_measurement

CASES = Path(__file__).parent / "search_cases"
TYRE = ("pneumatic_trail", "aligning_moment", "contact_length", "steer_damper", "speed_scale")


def judged(case, *tried, runs=None, samples=None):
    """Diagnosis of a case, perhaps of the first ``samples`` of some of its ``runs``."""
    measurement = read_measurement(CASES / case / "measurement.toml")
    if runs is not None:
        kept = measurement.runs[runs]
        short = [{name: x[:samples] for name, x in run.channels.items()} for run in kept]
        kept = [replace(run, time=run.time[:samples], channels=x) for run, x in zip(kept, short, strict=True)]
        measurement = replace(measurement, runs=tuple(kept))
    return among(measurement, tried)


@pytest.mark.parametrize(("case", "truth"), [
    ("none_though_P_truth_0.79_front_compliance", "front_compliance"),
    ("none_though_P_truth_0.82_camber_0.63", "camber_thrust"),
    ("none_though_P_truth_0.91_steer_spring", "steer_spring"),
])  # fmt: skip
def test_what_is_probable_is_said_to_be_though_nothing_may_be_missing(case, truth):
    found = judged(case, truth, "steer_damper", "pneumatic_trail", "speed_scale", "luggage")
    assert found.verdict.verdict in ("tentative", "named")
    assert found.verdict.equivalent[0] == truth


def test_frequencies_alone_name_the_family():
    """A trail is hidden; no decay was measured."""
    found = judged("modal_frequency_only", *TYRE)
    assert found.kind.data[0].shape == (7,)
    assert {"pneumatic_trail"} <= set(found.verdict.equivalent)
    assert {e.family for e in found.verdict.effects} == {"an aligning moment of the tyre"}


def test_a_critical_speed_alone_is_used_and_names_nothing():
    found = judged("critical_speed_only", "steer_damper", "pneumatic_trail")
    assert found.kind.data[0].shape == (2,)
    assert found.verdict.verdict in ("none", "unknown")
    assert found.hypotheses.null.chi2 < found.nominal @ found.nominal


def test_a_rider_who_steers_costs_no_verdict():
    """The torque was not recorded; the bicycle alone runs away from what was ridden, beyond all numbers in trials."""
    found = judged("crash_svd_rider01", "steer_spring", runs=slice(0, 2), samples=100)
    assert found.verdict.verdict == "unknown"
    assert any(doubt.startswith("if the rider steers, record the steer torque") for doubt in doubts(found))


def test_a_member_of_a_family_is_found_where_another_one_is():
    """9.03 mm are hidden in loud data, where a trail alone ends in another minimum."""
    found = judged("loud_truth_lost_pneumatic_trail_9mm", *TYRE[:2], runs=slice(0, 6, 2), samples=90)
    trail = next(f for f in found.hypotheses.fits if f.name == "pneumatic_trail")
    assert trail.theta[-1] == pytest.approx(9.03e-3, abs=3 * trail.covariance[-1, -1] ** 0.5 + 2e-4)
    assert "pneumatic_trail" in found.verdict.equivalent


def test_a_bias_of_the_identification_is_doubted_where_it_explains_as_much():
    """The decays were identified with a bias; it was taken for physics."""
    found = judged("identification_bias_named_as_class", "front_compliance", "decay_offset", "wrong_trail")
    assert found.verdict.verdict != "named"
    assert any(doubt.startswith("an error of the mode identification (") for doubt in doubts(found))
