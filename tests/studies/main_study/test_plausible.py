"""The outer error bar: random bicycles whose unmeasured parts are drawn from what is plausible."""

from dataclasses import replace

import numpy as np
import pytest
from by_hand import by_hand, growing
from small_study import RACING, chosen, small

from bicycle.files.bicycle_file import load_bicycle
from studies.main_study import plausible as module
from studies.main_study.plausible import Plausible, changed, plausible, shares, spread_over
from studies.main_study.spread import draws, uncertainty


@pytest.fixture(scope="module")
def known():
    """Racing bicycle, a tyre at two pressures."""
    settings = small(fronts=8)
    return settings, chosen(settings, {"Tyre1 flat": (3.5, 7.5)}).found


def test_draws_fill_their_ranges():
    settings = small(fronts=128)
    found = shares(settings)
    for name, (low, high) in vars(settings.ranges).items():
        values = found[name]
        assert values.shape == (128,)
        assert low <= values.min() < values.max() <= high
        middle = np.sqrt(low * high) if low > 0 else (low + high) / 2
        assert abs((values < middle).sum() - 64) <= 1  # even in the logarithm, or in the value
    assert abs(np.corrcoef([found["stiffness"], found["damping"]])[0, 1]) < 0.1


def test_spreading_over_a_range():
    assert spread_over((2500.0, 10000.0), np.array([0, 0.5, 1])) == pytest.approx([2500, 5000, 10000])
    assert spread_over((-0.1, 0.1), np.array([0, 0.5, 1])) == pytest.approx([-0.1, 0, 0.1], abs=1e-15)
    assert spread_over((0.0, 0.0), np.array([0, 0.5, 1])).tolist() == [0, 0, 0]


def test_the_front_is_the_same_for_every_pressure_and_the_tyre_is_not(known):
    settings, cases = known
    drawn = shares(settings)
    for setup in settings.setups[:2]:
        rows = []
        for case in cases:
            values = list(draws(settings, case, uncertainty(settings, case, setup), settings.fronts))
            rows.append([(one, changed(settings, setup, drawn, k, one)) for k, one in enumerate(values)])
        for (tyre, mine), (other_tyre, other) in zip(*rows, strict=True):
            assert mine == other
            assert tyre["relaxation_length.relaxation_length.front"] != pytest.approx(
                other_tyre["relaxation_length.relaxation_length.front"], rel=0.01
            )


def test_the_bicycle_is_the_same_for_every_tyre():
    settings = small(load_bicycle(RACING))
    first, second = chosen(settings, {"Tyre1 flat": (5.5,), "Tyre3 flat": (3.5,)}).found
    rows = [
        list(draws(settings, case, uncertainty(settings, case, settings.reference), 5)) for case in (first, second)
    ]  # fmt: skip
    for mine, other in zip(*rows, strict=True):
        for key in ("mB", "xB", "IBxz", "lam"):
            assert mine[key] == other[key] != settings.bicycle[key]


@pytest.mark.parametrize("number", [0, 1])
def test_edges_are_those_of_the_model_put_together_by_hand(known, number):
    settings, cases = known
    setup, case = settings.setups[number], cases[0]
    if number:  # hands on nothing wobbles in the assumed ranges; less damping makes it
        settings = replace(settings, arms=replace(settings.arms, inertia=0.05, stiffness=0.0, damping=0.05, given=True))
        setup = settings.setups[1]
    found = plausible(settings, case, setup)
    drawn = shares(settings)
    tyres = draws(settings, case, uncertainty(settings, case, setup), settings.fronts)
    wobbling = 0
    for k, values in enumerate(tyres):
        contact = [values[f"relaxation_length.{name}.{wheel}"] for wheel in ("rear", "front")
                   for name in ("cornering_stiffness", "relaxation_length")]  # fmt: skip
        front = {"stiffness": drawn["stiffness"][k], "damping": drawn["damping"][k], "height": 0.65 + drawn["hinge"][k]}
        arms = {name: drawn[f"arm_{name}"][k] for name in ("inertia", "stiffness", "damping")}
        model = by_hand(
            settings.bicycle, contact, front=front, arms=arms if number else None, camber=drawn["camber_share"][k],
            steer_damper={"damping": drawn["friction"][k]},
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
    assert 0 < wobbling == found.count - found.without
    assert wobbling < settings.fronts


def test_camber_thrust_and_friction_of_the_file_are_kept(known):
    settings, cases = known
    given = replace(
        settings, further={"camber_thrust": {"camber_stiffness": 200.0}, "steer_damper": {"damping": 0.5}}
    )  # fmt: skip
    drawn = shares(given)
    (values,) = draws(given, cases[0], uncertainty(given, cases[0], given.reference), 1)
    found = changed(given, given.reference, drawn, 0, values)
    assert found["camber_thrust.camber_stiffness.rear"] == pytest.approx(200.0 * drawn["camber_share"][0])
    assert 0.8 <= drawn["camber_share"][0] <= 1.25
    assert found["steer_damper.damping"] == 0.5


def test_a_draw_that_makes_no_bicycle_is_counted_and_costs_no_other(known, monkeypatch):
    settings, cases = known
    whole = plausible(settings, cases[0], settings.reference)

    def with_gap(*arguments):
        for k, values in enumerate(draws(*arguments)):
            yield None if k == 3 else values | {"mB": -1.0} if k == 4 else values

    monkeypatch.setattr(module, "draws", with_gap)
    found = plausible(settings, cases[0], settings.reference)
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
    one = Plausible(cases[0], settings.reference, onset, onset + 10, computed)
    assert (one.count, one.without) == (23, 2)
    assert one.likely("onset") == pytest.approx((2.0, 20.0))
    assert one.likely("end") == pytest.approx((12.0, 30.0))
    few = Plausible(cases[0], settings.reference, onset[18:], onset[18:], computed[18:])
    assert few.likely("onset") == (19.0, 21.0)  # of few it is all
    none = Plausible(cases[0], settings.reference, onset[21:], onset[21:], computed[21:])
    assert none.likely("onset") is None
    assert (none.count, none.without) == (2, 2)
