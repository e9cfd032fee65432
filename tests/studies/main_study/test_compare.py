"""Causes of a change, what the answer hinges on, and random fronts: against models put together by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from by_hand import ARMS, FRONT, by_hand, growing, least_damping
from small_study import RACING, chosen, small

from bicycle.files import load_bicycle
from bicycle.stability import CrossingIdentity
from studies import main_study


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
    which = CrossingIdentity("capsize", destabilising=True)
    found = [d.change(which) for d in racing.decompositions if d.setup.arms is None]
    assert len(found) == 3
    for change in found:
        assert abs(change.length_part) < 1e-8
        assert abs(change.stiffness_part) > 1e-4


def test_damping_decomposition_ends_at_the_damping_of_the_results(racing):
    """Where another root has the name at the lower pressure, there is no change to split: in two worlds at most."""
    changes = 0
    for setup in racing.settings.setups:
        for name in racing.names if setup == racing.settings.reference else racing.names[:1]:
            low, high = racing.results_of(setup, name)[0], racing.results_of(setup, name)[-1]
            for mode in ("wobble", "weave"):
                change = racing.decomposition(setup, name).change(mode, main_study.DAMPING)
                if change is not None:
                    changes += 1
                    assert change.before == pytest.approx(high.damping[mode].value)
                    assert change.after == pytest.approx(low.damping[mode].value)
    assert changes >= 2 * 5 - 2


def test_what_exists_at_one_pressure_only_has_no_decomposition():
    """The front almost stiff enough: at 7.5 bar there is no unstable wobble to move."""
    front = small().front.__class__(8000.0, 20.0, from_file=True)
    settings = small(front=front, speeds=np.linspace(0, 30, 4), trail=0.0, twisting=0.0)
    low, high = chosen(settings, {"Tyre1 flat": (3.5, 7.5)}).studied
    results = [main_study.solve(settings, case, settings.reference) for case in (high, low)]
    assert results[0].span(30.0) is None
    assert results[1].span(30.0) is not None
    found = main_study.decompose(settings, *results)
    assert found.change(CrossingIdentity("wobble", destabilising=True)) is None
    assert found.change(CrossingIdentity("weave", destabilising=False)) is not None
    assert found.change("wobble", main_study.DAMPING) is not None


ENDS = {
    "hands off/on": ({"front": FRONT}, {"front": FRONT, "arms": ARMS}),
    "front frame flexible/rigid": ({"front": FRONT}, {}),
    "front-frame stiffness": ({"front": FRONT | {"stiffness": 2500.0}}, {"front": FRONT | {"stiffness": 1e4}}),
    "front-frame damping": ({"front": FRONT | {"damping": 5.0}}, {"front": FRONT | {"damping": 40.0}}),
    "front-frame joint height": ({"front": FRONT | {"height": 0.55}}, {"front": FRONT | {"height": 0.75}}),
    "steering friction": ({"front": FRONT}, {"front": FRONT, "steer_damper": {"damping": 1.0}}),
    "camber stiffness": ({"front": FRONT, "camber": 0.43}, {"front": FRONT, "camber": 0.94}),
    "pneumatic trail": ({"front": FRONT, "trail": 0.012}, {"front": FRONT, "trail": 0.026}),
    "twisting torque": ({"front": FRONT, "twisting": 2.4}, {"front": FRONT, "twisting": 12.0}),
    "pressure": ({"front": FRONT}, {"front": FRONT}),
}


@pytest.mark.parametrize("what", ENDS)
def test_both_ends_against_models_put_together_by_hand(racing, what):
    (hinge,) = (one for one in racing.hinges if one.what == what)
    speeds = [float(v) for v in racing.settings.speeds if 3 <= v <= 20]
    contacts = [racing.focus.contact] * 2
    if what == "pressure":
        contacts = [racing.subject[0].contact, racing.subject[-1].contact]
        assert (hinge.low.what, hinge.high.what) == ("3.5 bar", "7.5 bar")
    for end, parts, contact in zip((hinge.low, hinge.high), ENDS[what], contacts, strict=True):
        model = by_hand(racing.settings.bicycle, contact, **parts)
        if end.what != "rigid":  # there the tyres' own vibration comes into the range of frequencies
            assert end.least.damping_ratio == pytest.approx(least_damping(model, speeds), rel=1e-6)
        if end.span is None:
            assert not any(growing(model, float(v)) for v in racing.settings.speeds[1:])  # at rest it is neutral
            continue
        assert (growing(model, end.span.low - 0.01), growing(model, end.span.low + 0.01)) == (0, 1)
        if math.isfinite(end.span.high):
            assert (growing(model, end.span.high - 0.01), growing(model, end.span.high + 0.01)) == (1, 0)
        else:
            assert growing(model, racing.settings.fastest) == 1


def test_the_largest_change_of_the_least_damping_comes_first(racing):
    sizes = [abs(one.high.least.damping_ratio - one.low.least.damping_ratio) for one in racing.hinges]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes == pytest.approx([one.size for one in racing.hinges])
    assert racing.hinges[0].what == "front frame flexible/rigid"


def test_size_where_wobble_is_no_oscillation_at_an_end(racing):
    least = racing.hinges[0].low.least
    there, gone = main_study.End("a", None, least), main_study.End("b", None, None)
    assert main_study.Hinge("x", there, gone).size == main_study.Hinge("x", gone, there).size == math.inf
    assert main_study.Hinge("x", gone, gone).size == 0.0
    assert main_study.Hinge("x", there, there).size == 0.0


def test_what_the_file_gives_or_has_once_is_not_varied():
    given = {"camber_thrust": {"camber_stiffness": 200.0}, "steer_damper": {"damping": 0.5}}
    settings = small(further=given, speeds=small().speeds[::4])
    (case,) = chosen(settings, {"Tyre1 flat": (5.5,)}).studied
    found = {one.what for one in main_study.hinges(settings, [case], case)}
    assert found == set(ENDS) - {"camber stiffness", "steering friction", "pressure"}


def test_lag_trail_and_string_side_by_side():
    """Models put together effect by effect from Tyre1 at 3.5 bar: 60 mm of contact have a trail of 24.1 mm.

    Most of what a string changes is its trail: a lag with that trail has -0.0778 of -0.0883, from -0.0509.
    """
    settings = small(load_bicycle(RACING), twisting=0.0, speeds=np.linspace(0, 40, 161), max_speed=60.0)
    (case,) = chosen(settings, {"Tyre1 flat": (3.5,)}).studied
    assumed, _ = main_study.contact_models(settings, [case])
    assert assumed.trail == pytest.approx((0.0241, 0.0241), abs=5e-5)
    expected = {
        "lag": (4.817, 28.890, -0.0509),
        "trailing": (3.843, 35.430, -0.0778),
        "string": (4.291, 37.376, -0.0883),
    }
    for name, (low, high, ratio) in expected.items():
        end = getattr(assumed, name)
        assert (end.span.low, end.span.high) == pytest.approx((low, high), abs=1e-3)
        assert end.least.damping_ratio == pytest.approx(ratio, abs=1e-4)
    study = main_study.solve(settings, case, settings.reference)  # with the assumed 17 mm
    assert (study.span(40.0).low, study.span(40.0).high) == pytest.approx((4.050, 33.684), abs=1e-3)
    assert study.least.damping_ratio == pytest.approx(-0.0709, abs=1e-4)


@pytest.fixture(scope="module")
def known():
    """Racing bicycle, a tyre at two pressures."""
    settings = small(fronts=8)
    return settings, chosen(settings, {"Tyre1 flat": (3.5, 7.5)}).studied


def test_draws_fill_their_ranges():
    settings = small(fronts=128)
    found = main_study.front_draws(settings)
    for name, (low, high) in vars(settings.ranges).items():
        values = found[name]
        assert values.shape == (128,)
        assert low <= values.min() < values.max() <= high
        middle = np.sqrt(low * high) if low > 0 else (low + high) / 2
        assert abs((values < middle).sum() - 64) <= 1  # even in the logarithm, or in the value
    assert abs(np.corrcoef([found["stiffness"], found["damping"]])[0, 1]) < 0.1


def test_the_front_is_the_same_for_every_pressure_and_the_tyre_is_not(known):
    settings, cases = known
    drawn = main_study.front_draws(settings)
    for setup in settings.setups[:2]:
        rows = []
        for case in cases:
            values = list(
                main_study.draws(settings, case, main_study.uncertainty(settings, case, setup), settings.fronts)
            )
            rows.append(
                [(one, main_study.front_values(settings, setup, drawn, k, one)) for k, one in enumerate(values)]
            )
        for (tyre, mine), (other_tyre, other) in zip(*rows, strict=True):
            assert mine == other
            assert tyre["relaxation_length.relaxation_length.front"] != pytest.approx(
                other_tyre["relaxation_length.relaxation_length.front"], rel=0.01
            )


def test_the_bicycle_is_the_same_for_every_tyre():
    settings = small(load_bicycle(RACING))
    first, second = chosen(settings, {"Tyre1 flat": (5.5,), "Tyre3 flat": (3.5,)}).studied
    found = [(case, main_study.uncertainty(settings, case, settings.reference)) for case in (first, second)]
    rows = zip(*(main_study.draws(settings, case, one, 5) for case, one in found), strict=True)
    for mine, other in rows:
        for key in ("mB", "xB", "IBxz", "lam"):
            assert mine[key] == other[key] != settings.bicycle[key]


@pytest.mark.parametrize("number", [0, 1])
def test_edges_are_those_of_the_model_put_together_by_hand(known, number):
    settings, cases = known
    setup, case = settings.setups[number], cases[0]
    if number:  # hands on nothing wobbles in the assumed ranges; less damping makes it
        settings = replace(
            settings, arms=replace(settings.arms, inertia=0.05, stiffness=0.0, damping=0.05, from_file=True)
        )
        setup = settings.setups[1]
    found = main_study.sample_bicycles(settings, case, setup)
    drawn = main_study.front_draws(settings)
    tyres = main_study.draws(settings, case, main_study.uncertainty(settings, case, setup), settings.fronts)
    wobbling = 0
    for k, values in enumerate(tyres):
        contact = [values[f"relaxation_length.{name}.{wheel}"] for wheel in ("rear", "front")
                   for name in ("cornering_stiffness", "relaxation_length")]  # fmt: skip
        front = {"stiffness": drawn["stiffness"][k], "damping": drawn["damping"][k], "height": 0.65 + drawn["hinge"][k]}
        arms = {name: drawn[f"arm_{name}"][k] for name in ("inertia", "stiffness", "damping")}
        model = by_hand(
            settings.bicycle, contact, front=front, arms=arms if number else None, camber=drawn["camber_share"][k],
            trail=drawn["trail"][k], twisting=drawn["twisting"][k], steer_damper={"damping": drawn["friction"][k]},
        )  # fmt: skip
        assert found.computed[k]
        if np.isnan(found.onset[k]):
            assert not any(growing(model, speed) for speed in np.linspace(0.5, 30, 40))
            continue
        wobbling += 1
        assert growing(model, found.onset[k] + 0.01) == 1
        assert growing(model, found.onset[k] - 0.01) == 0
        assert growing(model, found.end[k] - 0.01) == 1
        assert growing(model, found.end[k] + 0.01) == (found.end[k] == settings.fastest)
    assert 0 < wobbling == found.count - found.stable_count
    assert wobbling < settings.fronts


def test_camber_thrust_and_friction_of_the_file_are_kept(known):
    settings, cases = known
    further = {"camber_thrust": {"camber_stiffness": 200.0}, "steer_damper": {"damping": 0.5}}
    given = replace(settings, further=further)
    drawn = main_study.front_draws(given)
    (values,) = main_study.draws(given, cases[0], main_study.uncertainty(given, cases[0], given.reference), 1)
    found = main_study.front_values(given, given.reference, drawn, 0, values)
    assert found["camber_thrust.camber_stiffness.rear"] == pytest.approx(200.0 * drawn["camber_share"][0])
    assert 0.8 <= drawn["camber_share"][0] <= 1.25
    assert found["steer_damper.damping"] == 0.5


def test_a_draw_that_makes_no_bicycle_is_counted_and_costs_no_other(known, monkeypatch):
    settings, cases = known
    whole = main_study.sample_bicycles(settings, cases[0], settings.reference)

    draws = main_study.draws

    def with_gap(*arguments):
        for k, values in enumerate(draws(*arguments)):
            yield None if k == 3 else values | {"mB": -1.0} if k == 4 else values

    monkeypatch.setattr("studies.main_study.result.draws", with_gap)
    found = main_study.sample_bicycles(settings, cases[0], settings.reference)
    assert not found.computed[3]
    kept = np.flatnonzero(found.computed)
    assert set(kept) >= {0, 1, 2, 5, 6, 7}
    np.testing.assert_array_equal(found.onset[[0, 1, 2, 5, 6, 7]], whole.onset[[0, 1, 2, 5, 6, 7]])
    assert np.isnan(found.onset[3])
    assert found.count == len(kept)


def test_counts_and_quantiles(known):
    settings, cases = known
    onset = np.array([*np.arange(1.0, 22.0), np.nan, np.nan, np.nan])
    computed = np.array([True] * 23 + [False])
    one = main_study.Samples(cases[0], settings.reference, onset, onset + 10, computed, np.zeros((24, 30)))
    assert (one.count, one.stable_count) == (23, 2)
    assert one.interval("onset") == pytest.approx((2.0, 20.0))
    assert one.interval("end") == pytest.approx((12.0, 30.0))
    few = main_study.Samples(cases[0], settings.reference, onset[18:], onset[18:], computed[18:], one.growth[18:])
    assert few.interval("onset") == (19.0, 21.0)  # of few it is all
    none = main_study.Samples(cases[0], settings.reference, onset[21:], onset[21:], computed[21:], one.growth[21:])
    assert none.interval("onset") is None
    assert (none.count, none.stable_count) == (2, 2)
