"""Recordings that must not be averaged silently: other rims, copies, other units, repeats that disagree."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.shared.refusals import refuses
from tyre.fits import (
    FitSettings,
    Key,
    RecordingSummary,
    check_plausible,
    check_repeats,
    combine_campaign,
    near_conditions,
    refuse_infinite,
    repeat_warnings,
)
from tyre.recordings import Condition

CONDITION = Condition(tyre="T", load=400.0, pressure=5.5e5, surface="flat", rim="A")


def summary(file, value=6500.0, *, kind="slip_sweep", condition=CONDITION, fit_sd=10.0, r_squared=0.999, **details):
    return RecordingSummary(file, kind, condition, True, value, fit_sd, r_squared, details=details)


@pytest.mark.parametrize(("name", "other"), [("rim", "B"), ("drum_radius", 0.5)])
def test_recordings_that_are_no_repeats_are_refused(name, other):
    first = replace(CONDITION, drum_radius=1.0)
    pair = [summary("a.csv", condition=first), summary("b.csv", 6700.0, condition=replace(first, **{name: other}))]
    refuses(f"T, 400 N: a.csv and b.csv differ in {name} .* folders of their own", check_repeats, pair, "T, 400 N")


def test_a_copy_is_refused_and_a_reprint_is_said():
    original = summary("a.csv", residual_sd_N=2.0)
    copy = summary("b.csv", residual_sd_N=2.0)
    refuses("a.csv and b.csv hold the same recording; keep one", check_repeats, [original, copy], "T")
    printed = summary("a.tdx", 6500.1, residual_sd_N=2.0001)
    check_repeats([original, printed], "T")
    assert "the same recording twice?" in repeat_warnings([original, printed])[0]
    assert repeat_warnings([original, summary("c.csv", 6520.0, residual_sd_N=2.1)]) == []


def test_repeats_that_disagree_and_doubtful_pulls_are_said():
    said = repeat_warnings([summary("a.csv", 6500.0), summary("b.csv", 7500.0, fit_sd=11.0)])
    assert said == ["a.csv and b.csv differ by 13.3 %"]
    pull = summary("p.csv", 6e4, kind="lateral_stiffness", r_squared=0.89, friction_N=32.0, largest_force_N=100.0)
    assert repeat_warnings([pull]) == [
        "p.csv: the friction loop fits badly (R^2 0.890); did a gauge slip?",
        "p.csv: friction is 32 % of the largest force",
    ]


def test_conditions_that_were_perhaps_meant_to_be_one_are_said():
    keys = [Key("T", "flat", load, 5.5e5) for load in (400.0, 401.0, 490.0)] + [Key("T", "drum", 400.0, 5.5e5)]
    said = near_conditions(keys)
    assert set(said) == set(keys[:2])
    assert "nearly the same condition is taken as two: T, 400 N, 5.5 bar and T, 401 N, 5.5 bar" in said[keys[0]]


@pytest.mark.parametrize(("found", "words"), [
    (summary("a.csv", float("inf")), "a.csv: value came out as inf; numbers are too large"),
    (summary("a.csv", fit_sd=float("inf")), "a.csv: sd came out as inf"),
    (summary("a.csv", r_squared=float("-inf")), "a.csv: R.2 came out as -inf"),
    (summary("a.csv", linear_range_m=float("inf")), "a.csv: linear_range_m came out as inf"),
])  # fmt: skip
def test_what_is_infinite_is_refused_by_its_name(found, words):
    refuses(words, refuse_infinite, found, Path("a.csv"))
    refuse_infinite(summary("a.csv", pneumatic_trail_m=float("nan")), Path("a.csv"))  # not measured


@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [
        ("slip_sweep", 2.0 * CONDITION.load, 60.0 * CONDITION.load),
        ("lateral_stiffness", 5e3, 1e6),
        ("slip_step", 3e-3, 3.0),
    ],
)
def test_what_no_tyre_has_is_refused_from_the_limits_on(kind, low, high):
    words = r"a tyre has [\d.e+-]+ to [\d.e+]+, so a column is in another unit"
    for value in (0.97 * low, 1.03 * high):
        refuses(words, check_plausible, summary("run.csv", value, kind=kind), Path("run.csv"))
    for value in (1.03 * low, 0.97 * high):
        check_plausible(summary("run.csv", value, kind=kind), Path("run.csv"))


@pytest.mark.parametrize(("stiffnesses", "exponents"), [
    ((120e3, 102e3, 62e3), ["load^-1.3", "load^-2.2"]),  # ln(62/120)/ln(500/300), ln(62/102)/ln(500/400)
    ((40e3, 55e3, 95e3), ["load^1.7", "load^2.4"]),
    ((60e3, 62e3, 63e3), []),
])  # fmt: skip
def test_a_lateral_stiffness_that_changes_with_the_load_as_no_tyres_does_is_said(stiffnesses, exponents):
    loads = (300.0, 400.0, 500.0)
    pulls = [
        summary(f"{load:g}.csv", k, kind="lateral_stiffness", condition=replace(CONDITION, load=load), fit_sd=100.0)
        for load, k in zip(loads, stiffnesses, strict=True)
    ]
    conditions, _, _ = combine_campaign(pulls, FitSettings(), where="rig")
    said = [text for text in conditions[2].warnings if "lateral stiffness changes from" in text]
    assert len(said) == len(exponents)
    assert all(exponent in text for exponent, text in zip(exponents, said, strict=True))


@pytest.mark.parametrize(
    ("trails", "sd", "expected"),
    [
        ([0.0160], 3e-4, 3e-4),
        ([0.0160, 0.0160], 3e-4, 3e-4 / 2**0.5),  # two fits that agree by chance
        ([0.0150, 0.0170], 3e-4, 1e-3),  # a scatter that refutes the sd of the fits stands alone
    ],
)
def test_a_mean_trail_is_known_no_better_than_its_fits(trails, sd, expected):
    sweeps = [
        summary(f"{number}.csv", 6500.0 + 20.0 * number, pneumatic_trail_m=trail, pneumatic_trail_sd_m=sd)
        for number, trail in enumerate(trails)
    ]
    trail = combine_campaign(sweeps, FitSettings(), where="here")[0][0].pneumatic_trail
    assert trail is not None
    assert trail.value == pytest.approx(0.016)
    assert trail.sd == pytest.approx(expected)
