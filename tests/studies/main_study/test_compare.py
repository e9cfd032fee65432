"""Causes of a change, what the answer hinges on, and random fronts: against models put together by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from by_hand import ARMS, FRONT, TENSE, by_hand, front_inertia, growing, least_damping
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
    front = small().front.__class__(8000.0, 0.1912, from_file=True)
    settings = small(front=front, further=NO_FRICTION, speeds=np.linspace(0, 30, 4), trail=0.0, twisting=0.0)
    low, high = chosen(settings, {"Tyre1 flat": (3.5, 7.5)}).studied
    results = [main_study.solve(settings, case, settings.reference) for case in (high, low)]
    assert results[0].bands(30.0) == []
    assert results[1].bands(30.0)
    found = main_study.decompose(settings, *results)
    assert found.change(CrossingIdentity("wobble", destabilising=True)) is None
    assert found.change(CrossingIdentity("weave", destabilising=False)) is not None
    assert found.change("wobble", main_study.DAMPING) is not None


NO_FRICTION = {"steer_damper": {"damping": 0.0}}
ENDS = {
    "arms relaxed/tense": ({"front": FRONT, "arms": ARMS}, {"front": FRONT, "arms": TENSE}),
    "hands off/on": ({"front": FRONT}, {"front": FRONT, "arms": ARMS}),
    "front frame flexible/rigid": ({"front": FRONT}, {}),
    "front-frame stiffness": ({"front": FRONT | {"stiffness": 2500.0}}, {"front": FRONT | {"stiffness": 1e4}}),
    "front-frame damping ratio": ({"front": FRONT | {"ratio": 0.15}}, {"front": FRONT | {"ratio": 0.40}}),
    "front-frame joint height": ({"front": FRONT | {"height": 0.55}}, {"front": FRONT | {"height": 0.75}}),
    "steering friction": (
        {"front": FRONT, "steer_damper": {"damping": 0.05}},
        {"front": FRONT, "steer_damper": {"damping": 0.35}},
    ),
    "camber stiffness": ({"front": FRONT, "camber": 0.43}, {"front": FRONT, "camber": 0.94}),
    "pneumatic trail": ({"front": FRONT, "trail": 0.012}, {"front": FRONT, "trail": 0.026}),
    "twisting torque": ({"front": FRONT, "twisting": 2.4}, {"front": FRONT, "twisting": 12.0}),
    "pressure": ({"front": FRONT}, {"front": FRONT}),
}


def slowest_weave(model) -> float:
    """Speed (m/s) from which no oscillation below 3 Hz grows, by bisection."""
    unstable, stable = 2.0, 8.0
    for _ in range(40):
        middle = (unstable + stable) / 2
        values = model.eigenvalues(middle)
        grows = ((values.real > 0) & (values.imag > 0) & (values.imag < 6 * np.pi)).any()
        unstable, stable = (middle, stable) if grows else (unstable, middle)
    return stable


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
            assert not any(growing(model, float(v), rate=0.5) for v in racing.settings.speeds[2:])
            continue
        weave = slowest_weave(model)
        assert growing(model, end.span.low + 0.01, rate=0.5) == 1
        if abs(end.span.low - weave) > 1e-3:
            assert end.span.low > weave
            assert growing(model, end.span.low - 0.01, rate=0.5) == 0
        if math.isfinite(end.span.high):
            assert growing(model, end.span.high - 0.01, rate=0.5) == 1
            assert growing(model, end.span.high + 0.01, rate=0.5) == 0
        else:
            assert growing(model, racing.settings.fastest, rate=0.5) == 1


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
    bicycle = load_bicycle(RACING)
    ratio = 20 / (2 * math.sqrt(5000.0 * front_inertia(bicycle, 0.65)))  # 20 N m s/rad
    settings = small(
        bicycle, front=main_study.Front(5000.0, ratio), further=NO_FRICTION, twisting=0.0,
        speeds=np.linspace(0, 40, 161), max_speed=60.0,
    )  # fmt: skip
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
        assert low < end.span.low < end.span.high < high  # where wobble grows by 0.5 1/s; unstable from low to high
        assert end.least.damping_ratio == pytest.approx(ratio, abs=1e-4)
    study = main_study.solve(settings, case, settings.reference)  # with the assumed 17 mm
    (band,) = study.bands(40.0)
    assert (band.start.speed, band.end.speed) == pytest.approx((4.050, 33.684), abs=1e-3)
    assert study.least.damping_ratio == pytest.approx(-0.0709, abs=1e-4)


@pytest.fixture(scope="module")
def known():
    """Racing bicycle, a tyre at two pressures."""
    settings = small(fronts=8)
    return settings, chosen(settings, {"Tyre1 flat": (3.5, 7.5)}).studied


def test_draws_fill_their_ranges():
    settings = small(fronts=128)
    found = main_study.front_draws(settings)
    for name, (low, high) in settings.ranges.drawn.items():
        values = found[name]
        assert values.shape == (128,)
        assert low <= values.min() < values.max() <= high
        middle = np.sqrt(low * high) if low > 0 else (low + high) / 2
        assert abs((values < middle).sum() - 64) <= 1  # even in the logarithm, or in the value
    assert abs(np.corrcoef([found["stiffness"], found["damping_ratio"]])[0, 1]) < 0.1


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


@pytest.mark.parametrize(("common", "low", "high"), [(1.0, 0.98, 1.0), (0.5, 0.3, 0.7), (0.0, -0.25, 0.25)])
def test_errors_of_one_rig_are_common_to_its_pressures(known, common, low, high):
    """Correlation over 150 samples of the front tyre's relaxation length at two pressures; its sd is 0.08 or less.

    It is not quite 1: the uncertainties of C and K have another ratio at the other pressure.
    """
    settings, cases = known
    settings = replace(settings, common_error=common)
    lengths = [
        [values["relaxation_length.relaxation_length.front"] for values in main_study.draws(
            settings, case, main_study.uncertainty(settings, case, settings.reference), 150
        )]
        for case in cases
    ]  # fmt: skip
    assert low <= np.corrcoef(lengths)[0, 1] <= high + 1e-12


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
    arms = settings.arms
    if number:  # hands on little wobbles in the assumed ranges; less damping makes it
        arms = replace(arms, inertia=0.05, stiffness=0.0, damping=0.05, grip="", from_file=True)
        settings = replace(settings, arms=arms)
        setup = settings.setups[1]
    found = main_study.sample_bicycles(settings, case, setup)
    drawn = main_study.front_draws(settings)
    tyres = main_study.draws(settings, case, main_study.uncertainty(settings, case, setup), settings.fronts)
    wobbling = 0
    for k, values in enumerate(tyres):
        contact = [values[f"relaxation_length.{name}.{wheel}"] for wheel in ("rear", "front")
                   for name in ("cornering_stiffness", "relaxation_length")]  # fmt: skip
        height = 0.65 + drawn["hinge"][k]
        front = {"stiffness": drawn["stiffness"][k], "ratio": drawn["damping_ratio"][k], "height": height}
        held = {name: getattr(arms, name) * drawn[f"arm_{name}"][k] for name in ("inertia", "stiffness", "damping")}
        model = by_hand(
            settings.bicycle, contact, front=front, arms=held if number else None, camber=drawn["camber_share"][k],
            trail=drawn["trail"][k], twisting=drawn["twisting"][k], steer_damper={"damping": drawn["friction"][k]},
        )  # fmt: skip
        assert found.computed[k]
        if np.isnan(found.onset[k]):
            assert not any(growing(model, speed, rate=0.5) for speed in np.linspace(6, 30, 40))
            continue
        wobbling += 1
        slowest = 3.0 if number else max(4.0, slowest_weave(model))
        assert growing(model, found.onset[k] + 0.01, rate=0.5) == 1
        if abs(found.onset[k] - slowest) > 1e-3:
            assert found.onset[k] > slowest
            assert growing(model, found.onset[k] - 0.01, rate=0.5) == 0
        assert growing(model, found.end[k] - 0.01, rate=0.5) == 1
        assert growing(model, found.end[k] + 0.01, rate=0.5) == (found.end[k] == settings.fastest)
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
    assert "steer_damper.damping" not in found  # it stays what the file states
    assert values["steer_damper.damping"] == 0.5


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
    one = main_study.Samples(
        cases[0], settings.reference, onset, onset + 10, computed, np.zeros((24, 30)), np.arange(1.0, 31.0)
    )
    assert (one.count, one.stable_count) == (23, 2)
    assert one.interval("onset") == pytest.approx((2.0, 20.0))
    assert one.interval("end") == pytest.approx((12.0, 30.0))
    few = main_study.Samples(
        cases[0], settings.reference, onset[18:], onset[18:], computed[18:], one.growth[18:], one.speeds
    )
    assert few.interval("onset") == (19.0, 21.0)  # of few it is all
    none = main_study.Samples(
        cases[0], settings.reference, onset[21:], onset[21:], computed[21:], one.growth[21:], one.speeds
    )
    assert none.interval("onset") is None
    assert (none.count, none.stable_count) == (2, 2)
