"""Periodic motions over a number against shooting, and bands against runs of their own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bicycle import ModelFamily
from bicycle.critical import critical_speeds
from bicycle.cycle_variants import amplitude_band, cycles_over, onset_band
from bicycle.limit_cycles import find_limit_cycles
from bicycle.nonlinear import CurveTyre, MagicTyre
from tests.shared.refusals import refuses
from tests.shared.shooting import FRONT, build, compare_with_own_equations
from tyre import read_tyre
from tyre.errors import InputError

FAMILY = ModelFamily(build(steer_damper={"damping": 1.0}))


def damped(damping):
    return FAMILY.with_values({"steer_damper.damping": damping})


@pytest.fixture(scope="module")
def over_damping():
    return cycles_over(damped, (0.0, 2.0), speed=10.0)


def test_amplitude_against_damping_to_zero(over_damping):
    """At the damping at which the wobble ends, the speed is a critical speed of the model with it."""
    (branch,) = over_damping.branches
    assert (branch.mode, branch.reason) == ("wobble", "range")
    (ends,) = over_damping.begins
    assert min(abs(one.speed - 10.0) for one in critical_speeds(damped(ends)) if one.mode == "wobble") < 1e-6
    table = over_damping.frame(np.linspace(0, 1.3, 6))
    sizes = table["steer_amplitude_deg"].to_numpy()
    assert len(sizes) == 6
    assert sizes[0] == pytest.approx(10.288, rel=1e-4)  # without damper
    assert (np.diff(sizes) < 0).all()
    beside = ends - np.array([1e-4, 4e-4])  # the square of the amplitude goes with the distance
    near, far = over_damping.frame(beside)["steer_amplitude_deg"] ** 2
    assert far / near == pytest.approx(4.0, rel=0.01)
    assert over_damping.frame([ends + 0.01, 1.9]).empty


def test_a_motion_with_half_of_that_damper_by_shooting(over_damping):
    ((_, cycle),) = over_damping.at(0.7)
    compare_with_own_equations(damped(0.7), over_damping.at_value(0.7), 10.0, cycle)


def test_over_a_tyre_stiffness_as_over_the_speed():
    """Another bicycle: at single values the motions are those that are followed over the speed."""

    def make(stiffness):
        return build(bicycle="pista_rider", tyre={"cornering_stiffness": stiffness, "relaxation_length": 0.12})

    found = cycles_over(make, (5000.0, 9000.0), speed=12.0)
    for value in (5000.0, 6500.0, 9000.0):
        own = find_limit_cycles(make(value), max_speed=30.0)
        expected = sorted(own.amplitude(cycle) for _, cycle in own.at(12.0))
        assert sorted(found.at_value(value).amplitude(cycle) for _, cycle in found.at(value)) == pytest.approx(expected)
        assert expected


def test_a_fold_in_the_dry_friction_that_a_wobble_bears(rubbing):
    """Over the friction itself: the least motion and the lasting one meet, beyond there is none."""
    expected = sorted(rubbing.amplitude(cycle) for _, cycle in rubbing.at(10.0))
    found = cycles_over(damped, (0.0, 2.0), speed=10.0, dry_friction=0.3)
    (branch,) = found.branches
    assert (branch.reason, found.begins) == ("range", ())
    ((most, mode, _),) = found.folds()
    assert mode == "wobble"
    assert 0 < most < 1.373  # without friction the damper that ends it
    assert len(expected) == 2
    assert sorted(map(found.at_value(0.0).amplitude, branch.at(0.0))) == pytest.approx(expected, rel=1e-5)
    assert not found.at(most + 1e-3)
    assert len(found.at(most - 1e-3)) == 2


def test_a_weave_that_is_beyond_linear_geometry_at_both_ends():
    """Over the mass of the rider and frame: it is found from the middle, as over the speed."""
    front = FRONT | {"stiffness": 2000, "damping": 8}
    tyre = {"cornering_stiffness": 7000.0, "relaxation_length": 0.13}
    family = ModelFamily(build(bicycle="benchmark", front=front, tyre=tyre, pneumatic_trail={"trail": 0.03}))
    found = cycles_over(lambda mass: family.with_values({"mB": mass}), (60.0, 110.0), speed=13.7)
    assert sorted(branch.mode for branch in found.branches) == ["weave", "wobble"]
    assert {mode for end in (60.0, 110.0) for mode, _ in found.at(end)} == {"wobble"}
    own = find_limit_cycles(family.model, max_speed=25.0)
    expected = sorted((mode, own.amplitude(cycle)) for mode, cycle in own.at(13.7))
    there = sorted((mode, found.at_value(85.0).amplitude(cycle)) for mode, cycle in found.at(85.0))
    assert [mode for mode, _ in there] == [mode for mode, _ in expected]
    assert [size for _, size in there] == pytest.approx([size for _, size in expected], rel=1e-7)


def test_values_fall():
    refuses("values 2 to 0: give the least and then the largest", cycles_over, damped, (2.0, 0.0), speed=10.0)


def test_how_motions_begin_over_the_band_of_the_curve(faq):
    table = onset_band(faq)
    weave = table[(table["mode"] == "weave") & (table["speed_m_s"] > 30)]
    assert weave["begins"].tolist() == ["jumps"] * 3
    assert weave["added_curvature"].tolist() == [-1.0, 0.0, 1.0]
    for place, e in enumerate((-1.0, 0.0, 1.0)):
        tyre = MagicTyre(curvature_factor=e)
        own = find_limit_cycles(faq.model, rear=tyre, front=tyre) if e else faq
        (fold,) = own.branches[-1].folds
        row = weave.iloc[place]
        assert row["fold_speed_m_s"] == pytest.approx(fold.speed, rel=1e-9)
        assert row["fold_amplitude_deg"] == pytest.approx(np.degrees(own.amplitude(fold)), rel=1e-9)
        above = max(own.amplitude(cycle) for _, cycle in own.at(row["speed_m_s"] + 1e-6))
        assert row["jump_amplitude_deg"] == pytest.approx(np.degrees(above), rel=1e-5)
    page = (Path(__file__).parents[2] / "docs" / "amplitude.md").read_text(encoding="utf-8")
    said = "folds at {:.1f}, {:.1f} and {:.1f} m/s for E = -1, 0, 1".format(*weave["fold_speed_m_s"])
    assert said in " ".join(page.split())
    others = table[table["mode"] == "wobble"]
    assert others["begins"].eq("grows gently").all()
    assert others[["fold_speed_m_s", "jump_amplitude_deg"]].isna().all(axis=None)
    slow = table[(table["mode"] == "weave") & (table["speed_m_s"] < 10)]
    assert slow["begins"].eq("not determined").all()


@pytest.mark.parametrize("shape", [1.1, 1.6])
def test_the_coefficient_is_linear_in_the_curvature_and_turns_at_a_closed_form(shape):
    """Two equal tyres: sin(C atan(u - E (u - atan u))) = C u - C u^3 ((1 + E)/3 + C^2/6) + ... of the slip u."""
    tyre = MagicTyre(shape_factor=shape, curvature_factor=-1 - shape**2 / 2)
    found = find_limit_cycles(build(), rear=tyre, front=tyre, max_speed=3.5)
    assert found.onsets[0].kind == "not determined"
    table = onset_band(found, (-0.5, 0.0, 0.5)).query("mode == 'wobble'")
    low, middle, high = table["lyapunov_1_s_rad2"]
    assert abs(middle) < 1e-3 * abs(high)
    assert low == pytest.approx(-high, rel=1e-3)
    assert [table["begins"].iloc[0], table["begins"].iloc[2]] == ["jumps", "grows gently"]


def test_the_band_of_amplitudes_is_that_of_runs_of_their_own(faq):
    soft = build(front=FRONT | {"stiffness": 3000})
    table = amplitude_band(faq, [10.0, 36.0], models=[soft]).set_index(["speed_m_s", "mode"])
    row = table.loc[(10.0, "wobble")]

    def angle(model, *, peak=0.8, curvature=0.0):
        tyre = MagicTyre(friction=peak, curvature_factor=curvature)
        found = find_limit_cycles(model, rear=tyre, front=tyre, max_speed=11.0)
        ((_, cycle),) = found.at(10.0)
        return np.degrees(found.amplitude(cycle))

    own, softer = angle(faq.model), angle(soft)
    peaks = angle(faq.model, peak=0.6), angle(faq.model, peak=1.0)
    assert (row["peak_low_deg"], row["peak_high_deg"]) == pytest.approx(peaks, rel=1e-8)
    sizes = [own, angle(faq.model, curvature=-1.0), angle(faq.model, curvature=1.0)]
    assert (row["curvature_low_deg"], row["curvature_high_deg"]) == pytest.approx((min(sizes), max(sizes)), rel=1e-9)
    assert (row["model_low_deg"], row["model_high_deg"]) == pytest.approx((own, softer), rel=1e-9)
    whole = [0.75 * min(sizes), 1.25 * softer]
    assert (row["low_deg"], row["high_deg"]) == pytest.approx(whole, rel=1e-9)
    assert row["frequency_low_Hz"] < 7.1157 < row["frequency_high_Hz"]
    largest = max(np.degrees(faq.amplitude(cycle)) for _, cycle in faq.at(36.0))
    assert table.loc[(36.0, "weave"), "steer_amplitude_deg"] == pytest.approx(largest)


def test_a_front_whose_weave_has_no_motion_within_linear_geometry(faq):
    """With a damper weave jumps to a fall above 35.2 m/s; a stiff front has no wobble at 10 m/s."""
    table = amplitude_band(faq, [36.0], models=[build(steer_damper={"damping": 1.5})], added=())
    row = table.set_index("mode").loc["weave"]
    assert (row["model_high_deg"], row["high_deg"]) == (np.inf, np.inf)
    slow = replace(faq, max_speed=11.0)
    stiff = amplitude_band(slow, [10.0], models=[build(front=FRONT | {"stiffness": 12000})], added=())
    assert stiff["model_low_deg"].tolist() == [0.0]


def test_bands_that_are_not_determined(faq):
    rubbing = find_limit_cycles(faq.model, dry_friction=0.1, max_speed=5.0)
    refuses("dry_friction: with it amplitudes are not proportional to D", amplitude_band, rubbing, [4.0])
    file = Path(__file__).parents[1] / "field_cases" / "inputs" / "b600.tir"
    for front in (MagicTyre(friction=0.7), CurveTyre(read_tyre(file), 5.5e5)):
        with pytest.raises(InputError, match="peak: the band over D needs Magic Formula tyres of one D"):
            amplitude_band(replace(faq, front=front), [10.0])
