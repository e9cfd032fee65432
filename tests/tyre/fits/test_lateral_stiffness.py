"""Lateral stiffness test to lateral stiffness: friction loops made here by hand, with known stiffness and friction."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.shared.refusals import refuses
from tyre.fits import fit_lateral_stiffness
from tyre.recordings import Condition, LateralStiffnessTest

K = 55e3
FLAT = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="flat")
CHANNELS = ("lateral_force", "plate_displacement", "rim_displacement")


def loop(
    *, friction=2.0, presliding=0.0, noise=0.0, gauge=0.0, softening=0.0, cycles=2, readings=20, drift=0.0, both=False,
    seed=0,
):  # fmt: skip
    """Out and back to 2.5 mm (or to both sides); friction is a step (presliding 0) or builds up exponentially."""
    rng = np.random.default_rng(seed)
    corners = [0.0] + [2.5e-3, -2.5e-3 if both else 0.0] * cycles + ([0.0] if both else [])
    x = np.concatenate([[0.0]] + [np.linspace(a, b, readings + 1)[1:] for a, b in pairwise(corners)])
    x = x + np.where(np.isin(x, corners), 0.0, rng.uniform(-2e-5, 2e-5, x.size))
    force = K * x * (1.0 - softening * np.abs(x) / 2.5e-3)
    drag = 0.0
    for k in range(1, x.size):
        target = friction * np.sign(x[k] - x[k - 1])
        drag = target if presliding == 0.0 else target + (drag - target) * np.exp(-abs(x[k] - x[k - 1]) / presliding)
        force[k] += drag
    force += noise * rng.standard_normal(x.size) + drift * np.arange(x.size) / x.size
    rim = force / 5e5
    plate = x + rim
    if gauge:
        plate, rim = (gauge * np.round(channel / gauge) for channel in (plate, rim))
    return LateralStiffnessTest(
        condition=FLAT, axes="ISO", lateral_force=force, plate_displacement=plate, rim_displacement=rim
    )


@pytest.mark.parametrize("noise", [2.0, 20.0])
def test_r_squared_is_what_noise_leaves_of_the_scatter_about_the_mean(noise):
    """1 - s^2 / var(F) of white noise s."""
    clean, noisy = (loop(friction=0.0, readings=200, noise=sd) for sd in (0.0, noise))
    left = noise**2 / (np.var(clean.lateral_force) + noise**2)
    assert 1 - fit_lateral_stiffness(noisy).r_squared == pytest.approx(left, rel=0.1)


def test_loop_gives_stiffness_and_friction_exactly():
    fit = fit_lateral_stiffness(loop(friction=2.0, presliding=8e-5))
    assert fit.lateral_stiffness.value == pytest.approx(K, rel=1e-4)
    assert fit.friction == pytest.approx(2.0, rel=2e-3)
    assert fit.presliding == pytest.approx(8e-5, rel=0.02)
    assert fit.strokes == 4
    rim = (K * 2.5e-3 + 2 * 2.0) / 5e5  # friction loads the rim too, from -2 N at the origin to +2 N at the far end
    assert fit.rim_share == pytest.approx(rim / (2.5e-3 + rim), rel=2e-3)


def test_loading_alone_leaves_stiction_out_of_the_slope():
    test = loop(friction=2.0, presliding=5e-5, cycles=1)
    half = slice(0, 21)
    alone = LateralStiffnessTest(FLAT, "ISO", *(getattr(test, name)[half] for name in CHANNELS))
    fit = fit_lateral_stiffness(alone)
    assert fit.lateral_stiffness.value == pytest.approx(K, rel=1e-3)
    assert fit.friction == 0.0
    assert any("loading only" in note for note in fit.notes)


def test_scatter_of_repeats_matches_the_claimed_uncertainty():
    fits = [fit_lateral_stiffness(loop(noise=0.4, gauge=1e-5, presliding=4e-5, seed=seed)) for seed in range(60)]
    values = np.array([fit.lateral_stiffness.value for fit in fits])
    claimed = np.sqrt(np.mean([fit.fit_sd**2 for fit in fits]))
    assert abs(values.mean() / K - 1) < 4 * values.std() / np.sqrt(60) / K + 5e-4
    assert 0.75 < values.std(ddof=1) / claimed < 1.3  # 99 % of a chi with 59 degrees of freedom: 0.78..1.25


def test_drift_of_the_cell_does_not_spoil_the_loop():
    fit = fit_lateral_stiffness(loop(drift=5.0, presliding=4e-5))
    assert fit.lateral_stiffness.value == pytest.approx(K, rel=2e-3)
    assert (fit.friction, fit.drift) == pytest.approx((2.0, 5.0), rel=0.03)
    assert fit.offset == pytest.approx(2.5, abs=0.1)  # in the middle of the test


def test_softening_is_reported_and_the_slope_is_that_at_the_origin():
    fit = fit_lateral_stiffness(loop(softening=0.08, noise=0.2))
    assert fit.lateral_stiffness.value == pytest.approx(K, rel=0.01)
    assert fit.departure == pytest.approx(-0.08, abs=0.01)
    # F departs from K x by softening x / 2.5 mm: 2 % at 0.625 mm
    assert fit.linear_range == pytest.approx(0.625e-3, rel=0.12)
    assert any("the initial tangent" in note for note in fit.notes)


@settings(max_examples=15)
@given(factor=st.floats(0.2, 5.0), mirrored=st.booleans(), shift=st.floats(-20.0, 20.0))
def test_scaling_mirroring_and_offset(factor, mirrored, shift):
    test = loop(noise=0.3, presliding=4e-5)
    sign = -1.0 if mirrored else 1.0
    force = sign * factor * test.lateral_force + shift
    changed = LateralStiffnessTest(FLAT, "ISO", force, sign * test.plate_displacement, sign * test.rim_displacement)
    plain, other = fit_lateral_stiffness(test), fit_lateral_stiffness(changed)
    assert other.lateral_stiffness.value == pytest.approx(factor * plain.lateral_stiffness.value, rel=1e-5)
    assert other.friction == pytest.approx(factor * plain.friction, rel=1e-4)


def _hardly_moved(plate):
    return 1e-5 * np.round(5e-3 * plate / 1e-5)


@pytest.mark.parametrize(("changes", "words"), [
    ({"plate_displacement": lambda a: -a, "rim_displacement": lambda a: -a}, "falls with plate - rim displacement"),
    ({"lateral_force": lambda a: np.where(np.arange(a.size) < 5, a, np.nan)}, "5 readings are too few"),
    ({"plate_displacement": _hardly_moved, "rim_displacement": np.zeros_like}, "than 20 reading steps"),
])  # fmt: skip
def test_unusable_lateral_stiffness_tests_are_refused(changes, words):
    test = loop()
    channels = {name: getattr(test, name) for name in CHANNELS}
    for name, change in changes.items():
        channels[name] = change(channels[name])
    refuses(words, fit_lateral_stiffness, LateralStiffnessTest(condition=FLAT, axes="ISO", **channels))


def test_a_pull_in_a_dozen_equal_steps_is_no_coarse_gauge():
    plate = 0.3e-3 * np.arange(12)
    test = LateralStiffnessTest(FLAT, "ISO", 5e4 * plate, plate, np.zeros(12))
    assert fit_lateral_stiffness(test).lateral_stiffness.value == pytest.approx(5e4, rel=1e-6)


@pytest.mark.parametrize("reach", [2.5e-3, 10e-3])
@pytest.mark.parametrize(("back", "strokes"), [(20e-6, 1), (100e-6, 3)])
def test_a_turn_beyond_the_noise_of_the_gauge_begins_a_stroke(reach, back, strokes):
    """A gauge of 5 um noise may turn by some 40 um by chance, however far the pull goes."""
    x = np.concatenate([np.linspace(0, 1e-3, 30), np.linspace(1e-3, 1e-3 - back, 5)[1:], np.linspace(1e-3, reach, 40)])
    seen = x + 5e-6 * np.random.default_rng(3).standard_normal(x.size)
    test = LateralStiffnessTest(
        FLAT, "ISO", lateral_force=K * x, plate_displacement=seen, rim_displacement=np.zeros(x.size)
    )
    assert fit_lateral_stiffness(test).strokes == strokes


@pytest.mark.parametrize(("both", "strokes"), [(False, 2), (True, 3)])
def test_drift_is_told_from_two_strokes_on(both, strokes):
    """A walk of the cell by 5 N is told from the stiffness out and back, and beyond."""
    fit = fit_lateral_stiffness(loop(drift=5.0, presliding=4e-5, cycles=1, both=both, readings=60))
    assert fit.strokes == strokes
    assert fit.drift == pytest.approx(5.0, rel=0.2)
    assert fit.lateral_stiffness.value == pytest.approx(K, rel=2e-3)


def test_a_gauge_that_was_not_set_to_zero_counts_from_its_first_reading():
    """A tyre that softens is stiffest at the begin of the pull, wherever the gauge stands there."""
    test = loop(friction=0.0, softening=0.08, noise=0.2, readings=60)
    moved = LateralStiffnessTest(
        FLAT, "ISO", test.lateral_force, test.plate_displacement + 12e-3, test.rim_displacement
    )
    fits = [fit_lateral_stiffness(one) for one in (test, moved)]
    assert fits[1].lateral_stiffness.value == pytest.approx(fits[0].lateral_stiffness.value, rel=1e-6)
    assert any("12.00 mm, far from zero" in note for note in fits[1].notes)


def test_test_and_fit_print_three_lines_at_most_with_their_numbers_and_units():
    test = loop(noise=0.5)
    fit = fit_lateral_stiffness(test)
    first, second, third = str(fit).splitlines()
    assert first.startswith(f"<LateralStiffnessFit: {fit.readings_used} of {fit.readings} readings used")
    value, sd = second.removeprefix(" lateral stiffness ").partition(" N/mm, ")[0].split(" ± ")
    k = fit.lateral_stiffness.scaled(1e-3)
    assert (float(value), float(sd)) == pytest.approx((k.value, k.sd), abs=0.05 * k.sd)
    assert second.endswith(f"friction {fit.friction:.3g} N")
    assert third.startswith(f" linear within 2 % up to {1e3 * fit.linear_range:.3g} mm")
    assert str(test).startswith(
        f"<LateralStiffnessTest: Synthetic on flat, 400 N, 5.5 bar; {test.rim_displacement.size} "
    )
    assert len(str(test).splitlines()) == 2
