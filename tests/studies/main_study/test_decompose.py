"""What causes a change between two pressures: one pair of tyre numbers varied, the other held."""

import numpy as np
import pytest
from by_hand import FRONT, by_hand, growing
from small_study import chosen, small

from bicycle.critical.critical_speed import CriticalSpeed, CrossingIdentity
from studies.main_study.decompose import CRITICAL, DAMPING, Change, decompose, named_speeds
from studies.main_study.solve import solve


def test_parts_of_a_change_by_varying_one_and_holding_the_other(racing):
    decomposition = racing.decomposition(racing.settings.reference, "Tyre1 flat")
    high, low = decomposition.higher.contact, decomposition.lower.contact
    change = decomposition.change(CrossingIdentity("wobble", destabilising=False))

    def last_edge(contact) -> float:
        model = by_hand(racing.settings.bicycle, contact, front=FRONT)
        inside, outside = 12.0, 40.0
        for _ in range(40):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if growing(model, middle) else (inside, middle)
        return inside

    before = last_edge(high)
    assert change.before == pytest.approx(before, abs=1e-6)
    assert change.length_part == pytest.approx(last_edge([high[0], low[1], high[2], low[3]]) - before, abs=1e-6)
    assert change.stiffness_part == pytest.approx(last_edge([low[0], high[1], low[2], high[3]]) - before, abs=1e-6)
    assert change.total == pytest.approx(last_edge(low) - before, abs=1e-6)
    assert change.stiffness_part + change.length_part + change.interaction == pytest.approx(change.total)


def test_capsize_speed_does_not_depend_on_the_relaxation_length(racing):
    found = [
        d.change(CrossingIdentity("capsize", destabilising=True)) for d in racing.decompositions if d.setup.arms is None
    ]
    assert len(found) == 4
    for change in found:
        assert abs(change.length_part) < 1e-8
        assert abs(change.stiffness_part) > 1e-4


def test_damping_decomposition_ends_at_the_damping_of_the_results(racing):
    for setup in racing.settings.setups:
        for name in racing.names:
            low, high = racing.of(setup, name)[0], racing.of(setup, name)[-1]
            for mode in ("wobble", "weave"):
                change = racing.decomposition(setup, name).change(mode, DAMPING)
                assert change.before == pytest.approx(high.damping[mode].value)
                assert change.after == pytest.approx(low.damping[mode].value)


def test_what_exists_at_one_pressure_only_has_no_decomposition():
    """The front almost stiff enough: at 7.5 bar there is no unstable wobble to move."""
    settings = small(front=small().front.__class__(8000.0, 20.0, given=True), speeds=np.linspace(0, 30, 4))
    low, high = chosen(settings, {"Tyre1 flat": (3.5, 7.5)}).found
    results = [solve(settings, case, settings.reference) for case in (high, low)]
    assert results[0].span(30.0) is None
    assert results[1].span(30.0) is not None
    found = decompose(settings, *results)
    assert found.change(CrossingIdentity("wobble", destabilising=True)) is None
    assert found.change(CrossingIdentity("weave", destabilising=False)) is not None
    assert found.change("wobble", DAMPING) is not None


def test_several_critical_speeds_of_one_name_are_numbered():
    def edge(mode, speed, hertz, direction):
        return CriticalSpeed(speed, "oscillatory", mode, hertz, direction)

    edges = [edge("wobble", 4, 6, "destabilising"), edge("wobble", 8, 7, "stabilising"),
             edge("wobble", 12, 8, "destabilising"), edge("weave", 5, 0.4, "stabilising"),
             edge("weave+wobble", 20, 5, "stabilising")]  # fmt: skip
    assert {str(which): speed for which, speed in named_speeds(edges).items()} == {
        "wobble unstable above": 4, "wobble stable above": 8, "wobble unstable above (2)": 12,
        "weave stable above": 5, "wobble stable above (2)": 20,
    }  # fmt: skip


def test_a_band_that_goes_is_not_explained_as_a_shift():
    """From 58 to 10 m/s, of which the two parts explain 3: another crossing has the name at the other pressure."""
    assert not Change(CrossingIdentity("wobble", destabilising=True), CRITICAL, 58.0, 10.2, -2.0, -1.0).of_one_crossing
    assert Change(
        CrossingIdentity("wobble", destabilising=True), CRITICAL, 9.757, 5.898, -0.777, -3.623
    ).of_one_crossing
    assert Change(
        CrossingIdentity("capsize", destabilising=True), CRITICAL, 9.813, 9.818, 0.0, 0.001
    ).of_one_crossing  # too small to matter
