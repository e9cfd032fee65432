"""A crossing followed from nearby, in its direction only; identities as data."""

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from bicycle.critical.critical_speed import CriticalSpeed, CrossingIdentity, identified
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.critical.followed import follow_crossing
from bicycle.model_family import ModelFamily

TYRE = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)


def test_crossings_are_reached_in_their_direction_only():
    model = Model(load_bicycle("benchmark"), (TYRE,))
    polynomial, _ = ModelFamily(model).polynomials({}, 1)
    for crossing in critical_speeds(model):
        start, omega = np.array([1.05 * crossing.speed]), np.array([crossing.angular_frequency])
        for direction in (True, False):
            speed, frequency, there = follow_crossing(polynomial, start, omega, destabilising=direction)
            assert there[0] == (direction == crossing.destabilising)
            if there[0]:
                assert speed[0] == pytest.approx(crossing.speed, rel=1e-9)
                assert frequency[0] == pytest.approx(omega[0], abs=1e-6)


def test_crossings_of_many_bicycles_are_those_of_each_alone():
    model = Model(load_bicycle("benchmark"))
    weave = critical_speeds(model)[0]
    trails = weave.speed * 0 + np.linspace(0.07, 0.09, 4)
    family = ModelFamily(model, ("c",))
    polynomial, _ = family.polynomials({"c": trails}, 4)
    omega = np.full(4, weave.angular_frequency)
    speeds, _, there = follow_crossing(polynomial, np.full(4, weave.speed), omega, destabilising=False)
    assert there.all()
    for speed, trail in zip(speeds, trails, strict=True):
        alone = identified(critical_speeds(family.with_values({"c": trail})))
        assert speed == pytest.approx(alone[CrossingIdentity("weave", destabilising=False)].speed, rel=1e-9)


def test_crossings_of_one_mode_and_direction_are_counted_from_slow_to_fast():
    def crossing(speed, mode, *, up):
        return CriticalSpeed.of_root(speed=speed, root=20j, destabilising=up, mode=mode)

    every = [crossing(3, "wobble", up=True), crossing(5, "weave", up=False), crossing(8, "wobble", up=False),
             crossing(12, "wobble", up=True), crossing(14, "weave+wobble", up=True)]  # fmt: skip
    which = identified(every)
    assert list(which.values()) == every
    assert [str(one) for one in which] == [
        "wobble unstable above", "weave stable above", "wobble stable above", "wobble unstable above (2)",
        "weave+wobble unstable above",
    ]  # fmt: skip
    assert which[CrossingIdentity("wobble", destabilising=True, occurrence=2)].speed == 12


def test_roots_gained_and_frequency_follow_from_the_root():
    pair = CriticalSpeed.of_root(speed=4.0, root=-4j * np.pi, destabilising=True)
    real = CriticalSpeed.of_root(speed=4.0, root=0j, destabilising=False)
    assert (pair.kind, pair.frequency_hz, pair.unstable_roots) == ("oscillatory", pytest.approx(2.0), 2)
    assert (real.kind, real.frequency_hz, real.unstable_roots) == ("real", 0.0, -1)
    assert pair.named("wobble").mode == "wobble"
