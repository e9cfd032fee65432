"""The judges of forces and of spectra count what they should."""

from dataclasses import replace

import numpy as np
import pytest

from studies.diagnosis import read_measurement
from tests.validation import ride_forces, ride_spectra
from tests.validation.ride_generator import draw_legs, ride, scale_colours


def test_the_judge_of_forces_knows_truth_and_error():
    rng = np.random.default_rng(1)
    taken = ride(draw_legs(rng, (9.0,))[0], rng, duration=20)
    sd = {name: np.full(len(taken.time), np.std(taken.truth[name])) for name in ride_forces.JUDGED}
    right = ride_forces.judge(taken, ride_forces.Estimate(dict(taken.truth), sd))
    assert all(right[f"held.{name}"] == 1 for name in ride_forces.JUDGED)
    assert right["sum_error_share"] < 1e-9
    assert right["whole_error_share"] < 1e-9
    noisy = {name: taken.truth[name] + sd[name] * rng.standard_normal(len(taken.time)) for name in sd}
    wrong = ride_forces.judge(taken, ride_forces.Estimate(noisy, sd))
    assert all(0.93 < wrong[f"held.{name}"] < 0.97 for name in ride_forces.JUDGED)
    assert wrong["sum_error_share"] > 0.5
    assert "whole_error_share" not in wrong


def test_the_ideal_smoother_holds_what_it_promises():
    """Errors of a ride are as large as its covariance says; low frequencies leave few independent samples."""
    taken = ride_forces.draw_ride("known", "straight", 2, 0, 260.0)
    row = ride_forces.judge(taken, ride_forces.ideal(taken))
    for name in ride_forces.JUDGED:
        assert row[f"error.{name}"] == pytest.approx(row[f"sd.{name}"], rel=0.2)
        assert row[f"error.{name}"] < 0.5 * row[f"size.{name}"]


def test_forces_are_those_of_kanes_bicycle_where_little_but_its_rider_moves_it():
    """Wind and a rider's lean are hardly there, so that the motion alone shows the forces."""
    rng = np.random.default_rng(1)
    leg = ride_forces.draw_ride("known", "straight", 1, 0, 1.0).leg
    calm = {**scale_colours(leg.colours, 0.05), "steer_torque": leg.colours["steer_torque"]}
    taken = ride(replace(leg, colours=calm), rng, duration=60)
    row = ride_forces.judge(taken, ride_forces.engine(taken, "known"))
    for name in ride_forces.JUDGED:
        assert row[f"error.{name}"] < 0.15 * row[f"size.{name}"]
        assert row[f"error.{name}"] < 1.5 * row[f"sd.{name}"]


def test_the_judge_of_spectra_counts_errors_over_bounds():
    rng = np.random.default_rng(3)
    truth, least = {"C": 5000.0, "length": 0.1}, {"C": 0.01, "length": 0.05}
    sd = {key: least[key] * truth[key] for key in truth}
    rows = []
    for _ in range(2000):
        values = {key: truth[key] + 1.2 * sd[key] * rng.standard_normal() for key in truth}
        rows.append(ride_spectra.judge(truth, least, values, {key: 1.2 * size for key, size in sd.items()}))
    for counted in ride_spectra.summary(rows).values():
        assert counted["error_over_bound"] == pytest.approx(1.2, rel=0.06)
        assert counted["held"] == pytest.approx(0.95, abs=0.02)


@pytest.mark.parametrize("cell", ride_spectra.CELLS)
def test_a_case_of_spectra_hides_what_its_cell_says(cell):
    case = ride_spectra.draw_case(cell, 4, 0, duration=1.0)
    bicycle = case.legs[0].bicycle
    assert [leg.speed for leg in case.legs] == list(ride_spectra.SPEEDS)
    assert bicycle.hidden == {"damper": ("steer_damper",), "compliance": ("front_compliance",)}.get(cell, ())
    assert bool(bicycle.outside) == (cell == "outside")
    assert set(case.truth) == set(ride_spectra.ASKED)


def test_a_short_ride_tells_the_rear_tyre(tmp_path):
    """The study's own way to the engine: a ride of one minute at one speed, the bicycle known."""
    case = ride_spectra.draw_case("known", 5, 0, duration=60.0, speeds=(7.0,))
    row = {}
    ride_spectra.estimate(read_measurement(str(ride_spectra.write_case(case, tmp_path))).prepare(), row)
    key = "relaxation_length.cornering_stiffness.rear"
    assert abs(row["values"][key] - case.truth[key]) < 3 * row["sd"][key]
    assert row["sd"][key] < 0.05 * case.truth[key]  # 15 % before the ride
    assert 0.6 < row["misfit"] < 1.4


def test_uncertainties_of_a_case_are_those_of_its_drawing():
    sd = ride_spectra.stated_sd(ride_spectra.draw_case("default", 6, 0, duration=1.0))
    known = ride_spectra.stated_sd(ride_spectra.draw_case("known", 6, 0, duration=1.0))
    assert known["IBxx"] == 0 < sd["IBxx"]
    assert set(ride_spectra.ASKED) <= set(sd)
    assert "front_compliance.stiffness" not in ride_spectra.stated_sd(
        ride_spectra.draw_case("compliance", 6, 0, duration=1.0)
    )
