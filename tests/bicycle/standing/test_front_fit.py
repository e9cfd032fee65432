"""Readings of exactly known fronts (finite rotations, outside the package) are predicted and fitted."""

import math

import numpy as np
import pytest

from bicycle import Model, load_bicycle
from bicycle.standing import (
    NOT_HELD,
    ONE_HINGE,
    STIFFNESS,
    TWO_JOINTS,
    Deflection,
    Outcome,
    Place,
    Ratio,
    Readings,
    Tap,
    fit_front,
    measure_front,
)
from tests.validation.standing import Owner
from tests.validation.standing_bench import Stand
from tyre.ground import InputError

PISTA = load_bicycle("pista")
FRONT = Stand(PISTA.values, 4200.0, 3.0, 0.31)
HUB, STEM, RIM = Place(0.0), Place(0.6, "fork"), Place(-0.31)


def deflection(loaded, read, stand=FRONT, force=98.1, sd=5e-5):
    on_frame = read.on == "frame"
    way = stand.deflection(force, loaded.above_hub, read.above_hub, on_frame=on_frame)
    return Deflection(force, loaded, read, way, sd)


def tap(*sensors, stand=FRONT, mass=0.0, at=HUB):
    spots = [(0.0, False), *((place.above_hub, place.on == "frame") for place in sensors)]
    hertz, damping, moves = stand.vibration(spots, (mass, at.above_hub))
    ratios = tuple(Ratio(place, HUB, move, 0.005) for place, move in zip(sensors, moves, strict=True))
    return Tap("tap", hertz, 1e-3 * hertz, damping, 0.03 * damping, ratios, mass, at)


WAYS = {
    "two deflections": Readings((deflection(RIM, HUB), deflection(RIM, STEM)), on_side=True),
    "hub and stem": Readings((), (tap(STEM),)),
    "mass on the stem": Readings((), (tap(), tap(mass=1.0, at=STEM))),
    "all": Readings((deflection(RIM, HUB), deflection(HUB, HUB)), (tap(STEM),)),
}


@pytest.mark.parametrize("name", WAYS)
def test_exact_readings_give_the_front_back(name):
    result = measure_front(WAYS[name], Model(PISTA))
    assert result.outcome == Outcome.ONE_HINGE
    fit = result.fit
    tight = 1e-4 if name != "all" else 2e-3  # deflections were read on its side, 0.1 % of the weight's stiffness
    assert fit.values["front_compliance.stiffness"] == pytest.approx(4200.0, rel=tight)
    assert fit.height[0] == pytest.approx(0.31, abs=10 * tight * 0.31)
    if WAYS[name].damped:
        assert fit.values["front_compliance.damping"] == pytest.approx(3.0, rel=tight)
    low, high = fit.value_interval("front_compliance.stiffness")
    assert low < 4200.0 < high < 1.15 * low


def test_one_sensor_alone_is_as_uncertain_as_the_height_that_is_assumed():
    """The inertia about the hinge grows by 5 % in 20 mm: 0.1 m of height are about a quarter of the stiffness."""
    fit = measure_front(Readings((), (tap(),)), Model(PISTA)).fit
    assert fit.height_assumed
    assert fit.coordinate(STIFFNESS)[1] == pytest.approx(0.24, abs=0.03)
    low, high = fit.value_interval("front_compliance.stiffness")
    assert low < 4200.0 < high


def test_a_ratio_without_its_sign_is_no_hinge():
    """Stem and hub move against each other; as if together the hinge lies far above all fronts."""
    signed = tap(STEM)
    (ratio,) = signed.ratios
    assert ratio.value < 0
    unsigned = Tap("tap", signed.frequency_hz, signed.frequency_sd_hz, ratios=(Ratio(STEM, HUB, -ratio.value, 0.005),))
    result = measure_front(Readings((), (unsigned,)), Model(PISTA))
    assert result.outcome != Outcome.ONE_HINGE
    assert result.fit is None


def test_a_mass_on_the_rim_hardly_tells_the_height_and_one_on_the_stem_does():
    """(f0/f)^2 - 1 is stationary in the height near 0.38 m for a mass at the rim."""
    rim = fit_front(Readings((), (tap(), tap(mass=1.0, at=RIM))), Model(PISTA), ONE_HINGE)
    stem = fit_front(Readings((), (tap(), tap(mass=1.0, at=STEM))), Model(PISTA), ONE_HINGE)
    assert rim.height[1] > 2 * stem.height[1]


def test_a_hold_that_gives_way_is_named_by_a_reading_of_the_frame_and_by_both_kinds_of_readings():
    loose = Stand(PISTA.values, 4200.0, 3.0, 0.31, 1.5e4, 3e5)
    both = tuple(deflection(*pair, stand=loose) for pair in ((HUB, HUB), (RIM, HUB), (RIM, RIM)))
    head = Place(0.55, "frame")
    by_frame = measure_front(Readings((), (tap(STEM, head, stand=loose),)), Model(PISTA))
    assert by_frame.outcome == Outcome.NOT_HELD
    assert by_frame.motion.share > 0.01
    by_both = measure_front(Readings(both, (tap(STEM, stand=loose),)), Model(PISTA))
    assert by_both.outcome == Outcome.NOT_HELD
    assert by_both.fits[NOT_HELD.name].fits
    assert not by_both.fits[ONE_HINGE.name].fits
    unseen = measure_front(Readings((), (tap(STEM, stand=loose),)), Model(PISTA))
    assert unseen.hold_checked == ""


def test_a_frame_that_was_read_and_held_is_checked():
    head = Place(0.55, "frame")
    result = measure_front(Readings((), (tap(STEM, head),)), Model(PISTA))
    assert (result.outcome, result.hold_checked) == (Outcome.ONE_HINGE, "frame")


def test_errors_of_place_and_bicycle_are_in_the_intervals():
    """With exact places, sensors and bicycle the interval shrinks to what the frequency says."""
    exact = dict.fromkeys(("w", "c", "lam", "rF", "mH", "xH", "zH", "IHxx", "IHzz", "IHxz", "mF", "IFxx"), 0.0)
    wide = fit_front(WAYS["mass on the stem"], Model(PISTA), ONE_HINGE)
    narrow = fit_front(WAYS["mass on the stem"], Model(PISTA), ONE_HINGE, exact)
    assert narrow.coordinate(STIFFNESS)[1] < 0.98 * wide.coordinate(STIFFNESS)[1]
    shifted = Readings((), WAYS["mass on the stem"].taps, errors=WAYS["all"].errors.__class__(place=0.02))
    assert fit_front(shifted, Model(PISTA), ONE_HINGE).height[1] > 1.5 * wide.height[1]


def test_two_joints_have_the_time_of_damping_in_common():
    ratios = (Ratio(RIM, HUB, 1.337, 0.002), Ratio(STEM, HUB, 0.471, 0.002))
    swaying = Tap("tap", 11.02, 0.001, 0.022, 0.0001, ratios)
    fit = fit_front(Readings((), (swaying,)), Model(PISTA), TWO_JOINTS)
    front, fork = (fit.values[f"{name}.damping"] / fit.values[f"{name}.stiffness"] for name in (
        "front_compliance", "fork_bending"))  # fmt: skip
    assert front == pytest.approx(fork, rel=1e-9)
    assert front == pytest.approx(2 * 0.022 / (2 * math.pi * 11.02), rel=0.01)
    matrix = fit.value_covariance
    assert np.linalg.eigvalsh(matrix / np.sqrt(np.outer(d := np.diag(matrix) + 1e-30, d)))[0] > -1e-9


def test_nothing_and_too_little_are_refused():
    with pytest.raises(InputError, match="nothing was read: give deflections under a load, or taps"):
        measure_front(Readings(), Model(PISTA))
    with pytest.raises(InputError, match="two joints needs 2 numbers, and 1 were read; add readings"):
        fit_front(Readings((deflection(RIM, HUB),)), Model(PISTA), TWO_JOINTS)


def test_repeats_count_once_for_what_they_have_in_common():
    """Ten equal taps are no better than one where the bicycle decides."""
    one = fit_front(WAYS["hub and stem"], Model(PISTA), ONE_HINGE)
    ten = fit_front(Readings((), WAYS["hub and stem"].taps * 10), Model(PISTA), ONE_HINGE)
    assert ten.freedom == one.freedom == 0
    assert ten.coordinate(STIFFNESS)[1] > 0.5 * one.coordinate(STIFFNESS)[1]


def test_recordings_of_the_generator_are_read():
    owner = Owner(Stand(PISTA.values, 9000.0, 9.0, 0.4), np.random.default_rng(5))
    (found,) = owner.recorded_taps(1)
    hertz, damping, (ratio,) = owner.stand.vibration([(0.0, False), (owner.true_place(0.6), False)])
    assert found.frequency_hz == pytest.approx(hertz, rel=1e-3)
    assert found.damping_ratio == pytest.approx(damping, rel=0.02)
    assert found.ratios[0].value == pytest.approx(owner._gain * ratio, rel=0.02)
