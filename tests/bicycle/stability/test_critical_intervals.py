"""Speeds at which a mode may be critical: by hand for two lines, by moved bicycles, and what the data do not tell."""

import math

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from bicycle.stability import (
    OSCILLATORY,
    REAL,
    CriticalInterval,
    critical_intervals,
    critical_speeds,
    modes,
    zero_within,
)
from tyre.ground import InputError

SPEEDS = np.linspace(2.0, 9.0, 71)
WEAVE, CAPSIZE = 4.292382536, 6.024262015  # m/s, Meijaard et al. (2007), Proc. R. Soc. A 463, section 5
INF = math.inf


def found(sd, speeds=SPEEDS, **moved):
    bicycle = load_bicycle("benchmark")
    return critical_intervals(Model(bicycle.replace(**moved)), speeds, sd)


def of(intervals, mode):
    return [(one.low, one.high) for one in intervals if one.mode == mode]


@pytest.mark.parametrize(("lower", "upper", "inside"), [
    ([-1, -1, 1, 1], [1, 1, 3, 3], [(-INF, 1.5)]),
    ([-3, -3, -1, -1], [-1, -1, 1, 1], [(1.5, INF)]),
    ([-1, -1, -1, -1], [1, 1, 1, 1], [(-INF, INF)]),
    ([1, 1, 1, 1], [2, 2, 2, 2], []),
    ([-4, -4, 2, 2], [-2, -2, 4, 4], [(1 + 1 / 3, 1 + 2 / 3)]),  # between two places
    ([1, -1, -1, 1], [2, 2, 2, 2], [(0.5, 2.5)]),
    ([-1, 1, 1, -1], [2, 2, 2, 2], [(-INF, 0.5), (2.5, INF)]),
])  # fmt: skip
def test_zero_between_two_lines(lower, upper, inside):
    at = np.arange(4.0)
    assert zero_within(at, np.array(lower, float), np.array(upper, float)) == [pytest.approx(ends) for ends in inside]


def test_the_published_crossings_lie_within_and_the_limits_are_where_a_moved_bicycle_is_critical():
    sd = 0.002
    intervals = found({"c": sd})
    (weave,), (capsize,) = of(intervals, "weave"), of(intervals, "capsize")
    assert weave[0] < WEAVE < weave[1]
    assert capsize[0] < CAPSIZE < capsize[1]
    assert {one.mode: one.kind for one in intervals} == {"weave": OSCILLATORY, "capsize": REAL}
    trail = load_bicycle("benchmark")["c"]
    ends = []
    for step in (-1.96 * sd, 1.96 * sd):
        moved = critical_speeds(Model(load_bicycle("benchmark").replace(c=trail + step)), 9.0)
        ends.append({one.mode: one.speed for one in moved})
    for mode, interval in (("weave", weave), ("capsize", capsize)):
        assert interval == pytest.approx(sorted(end[mode] for end in ends), abs=0.02)


def test_a_real_root_that_is_absent_at_some_speeds_is_listed_where_it_crosses():
    """At low speeds capsize and castering of this bicycle are a pair; the crossing was left out if these were seen."""
    model = Model(load_bicycle("crescendo"))
    assert "capsize+castering" in modes(model, np.linspace(0.3, 9.0, 88)).branches
    (crossing,) = [one.speed for one in critical_speeds(model, 9.0) if one.mode == "capsize"]
    (capsize,) = of(critical_intervals(model, np.linspace(0.3, 9.0, 88), {"c": 0.002}), "capsize")
    assert capsize[0] < crossing < capsize[1]


@pytest.mark.parametrize("sd", [1e-2, 1e-6])
def test_a_crossing_lies_within_however_well_it_is_known(sd):
    (weave,) = of(found({"c": sd}), "weave")
    assert weave[0] <= WEAVE + 1e-8
    assert weave[1] >= WEAVE - 1e-8


def test_a_crossing_that_the_model_misses_is_open_to_the_side_where_it_may_be():
    """Weave of the benchmark is stable from 4.3 m/s on: looked at from 4.4 m/s, it has no crossing."""
    (weave,) = of(found({"c": 0.02}, np.linspace(4.4, 5.6, 30)), "weave")
    assert weave[0] == -INF
    assert 4.4 < weave[1] < 5.6


def test_what_the_data_do_not_tell_has_no_limit():
    (weave,) = [one for one in found({"c": 0.5}, np.linspace(4.4, 5.6, 30)) if one.mode == "weave"]
    assert not weave.told
    assert weave.holds(1e9)
    limited = CriticalInterval("weave", OSCILLATORY, 3.0, INF)
    assert limited.told
    assert (limited.holds(2.9), limited.holds(3.1)) == (False, True)


def test_a_number_of_both_wheels_counts_for_both():
    tyre = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)
    model, key = Model(load_bicycle("benchmark"), (tyre,)), "relaxation_length.relaxation_length"
    both, rear = (of(critical_intervals(model, SPEEDS, {name: 0.02}), "weave") for name in (key, f"{key}.rear"))
    assert np.ptp(both) > np.ptp(rear) > 0


def test_nothing_uncertain_has_no_interval():
    assert found({}) == ()


@pytest.mark.parametrize("speeds", [[3.0], [3.0, 3.0], [4.0, 3.0], [[3.0, 4.0]]])
def test_speeds_must_rise(speeds):
    with pytest.raises(InputError, match="give two or more speeds, each above the last"):
        found({"c": 0.01}, speeds)
