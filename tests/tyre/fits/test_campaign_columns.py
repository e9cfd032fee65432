"""Every column and number that a campaign writes, computed again by hand from numbers that were chosen."""

import csv
from math import hypot, pi, sqrt
from pathlib import Path
from statistics import mean, stdev

import numpy as np
import pytest
from scipy.stats import t as student

from tyre.fits import (
    Campaign,
    FitSettings,
    Key,
    RecordingSummary,
    Repeatability,
    combine,
    fit_lateral_stiffness,
    with_camber,
    write_tables,
)
from tyre.measured import Calibration
from tyre.recordings import Condition, LateralStiffnessTest

FORCE, SLIP, DISPLACEMENT = 0.004, 0.006, 0.009
SWEEP, SWEEP_DOF, PULL, PULL_DOF = 0.02, 12.0, 0.03, 9.0
CALIBRATION = Calibration(force=FORCE, slip=SLIP, displacement=DISPLACEMENT)
# load -> cornering stiffnesses of its sweeps, N/rad; trails, m; lateral stiffnesses of its pulls, N/m
MEASURED = {
    300.0: ((5000.0, 5200.0), (0.021, 0.026), (60e3,)),
    500.0: ((7000.0, 7100.0, 7300.0), (0.024, 0.025, 0.029), (62e3, 66e3)),
}


def recording(kind, load, number, value, **details):
    condition = Condition("T", load, 5.5e5, "flat")
    file, sd = f"{kind}{load:g}_{number}", 1e-3 * value
    return RecordingSummary(file, kind, condition, False, value, sd, 0.99, details=details)


@pytest.fixture(scope="module")
def campaign():
    conditions = []
    for load, (cs, trails, ks) in MEASURED.items():
        sweeps = [
            recording("slip_sweep", load, n, c, pneumatic_trail_m=t, pneumatic_trail_sd_m=1e-3)
            for n, (c, t) in enumerate(zip(cs, trails, strict=True))
        ]
        pulls = [recording("lateral_stiffness", load, n, k) for n, k in enumerate(ks)]
        conditions.append(
            combine(
                Key("T", "flat", load, 5.5e5), [*sweeps, *pulls], borrowed=[], calibration=CALIBRATION,
                sweep_repeatability=Repeatability(SWEEP, SWEEP_DOF, measured=True, conditions=2),
                pull_repeatability=Repeatability(PULL, PULL_DOF, measured=True, conditions=1),
            )
        )  # fmt: skip
    none = Repeatability(0.0, 1.0, measured=False, conditions=0)
    settings = FitSettings(calibration=CALIBRATION)
    return Campaign(Path("c"), tuple(conditions), none, none, settings, {}, ())


def by_hand(load):
    """Relative sd of the mean of n repeats, beside certificates that more repeats do not make better (JCGM 100)."""
    cs, trails, ks = MEASURED[load]
    c, k = mean(cs), mean(ks)
    c_mean, k_mean = SWEEP / sqrt(len(cs)), PULL / sqrt(len(ks))
    c_sd = sqrt(c_mean**2 + FORCE**2 + SLIP**2)
    k_sd = sqrt(k_mean**2 + FORCE**2 + DISPLACEMENT**2)
    # length = C/K: the gain of the load cell cancels
    length_sd = sqrt(c_mean**2 + k_mean**2 + SLIP**2 + DISPLACEMENT**2)
    return {
        "c": c, "c_sd": c * c_sd, "c_dof": c_sd**4 / (c_mean**4 / SWEEP_DOF),  # Welch-Satterthwaite
        "k": k, "k_sd": k * k_sd, "k_dof": k_sd**4 / (k_mean**4 / PULL_DOF),
        "correlation": FORCE**2 / (c_sd * k_sd), "length": c / k, "length_sd": c / k * length_sd,
        "length_dof": length_sd**4 / (c_mean**4 / SWEEP_DOF + k_mean**4 / PULL_DOF),
        "trail": mean(trails), "trail_sd": stdev(trails) / sqrt(len(trails)), "trail_dof": len(trails) - 1.0,
    }  # fmt: skip


def test_every_column_of_a_map(campaign, tmp_path):
    write_tables(campaign, tmp_path, wheel_radius=0.34)
    with (tmp_path / "maps" / "T_flat.csv").open(newline="") as file:
        rows = [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]
    assert len(rows) == len(MEASURED)
    for row, load in zip(rows, MEASURED, strict=True):
        hand = by_hand(load)
        expected = {
            "load_N": load, "pressure_bar": 5.5,
            "cornering_stiffness_N_per_deg": hand["c"] * pi / 180,
            "cornering_stiffness_sd_N_per_deg": hand["c_sd"] * pi / 180,
            "lateral_stiffness_N_per_mm": hand["k"] / 1000, "lateral_stiffness_sd_N_per_mm": hand["k_sd"] / 1000,
            "stiffness_correlation": hand["correlation"], "cornering_stiffness_dof": hand["c_dof"],
            "lateral_stiffness_dof": hand["k_dof"], "pneumatic_trail_mm": 1000 * hand["trail"],
            "pneumatic_trail_sd_mm": 1000 * hand["trail_sd"], "pneumatic_trail_dof": hand["trail_dof"],
        }  # fmt: skip
        assert row == pytest.approx(expected, rel=1e-12)


def test_every_number_of_the_json(campaign):
    for found, load in zip(campaign.as_json()["conditions"], MEASURED, strict=True):
        hand = by_hand(load)
        for name, key in (("cornering_stiffness_N_per_rad", "c"), ("lateral_stiffness_N_per_m", "k"),
                          ("relaxation_length_m", "length")):  # fmt: skip
            value, sd = hand[key], hand[f"{key}_sd"]
            half = student.ppf(0.975, hand[f"{key}_dof"]) * sd
            assert (found[name]["value"], found[name]["sd"]) == pytest.approx((value, sd), rel=1e-12)
            assert found[name]["ci95"] == pytest.approx([value - half, value + half], rel=1e-9)
        assert (found["load_N"], found["pressure_bar"], found["camber_deg"]) == (load, 5.5, 0.0)
        assert found["r_squared"] == pytest.approx(0.99)


FLAT = Condition("T", 400.0, 5.5e5, "flat")


def pull(noise, *, step=0.0, seed=0, readings=60):
    """Straight pull of a tyre of 55 kN/m to 2.5 mm, on a rim that moves by 0.1 mm; read in ``step`` (m)."""
    x = np.linspace(0.0, 2.5e-3, readings)
    force = 55e3 * x + noise * np.random.default_rng(seed).standard_normal(readings)
    rim = 0.04 * x
    plate = x + rim
    if step:
        plate, rim = (step * np.round(one / step) for one in (plate, rim))
    return LateralStiffnessTest(FLAT, "ISO", force, plate, rim)


def test_the_sd_of_one_pull_is_that_of_its_fit_the_repeats_and_the_certificates():
    fit = fit_lateral_stiffness(pull(1.0), calibration=Calibration(0.004, 0.006, 0.009, 0.02))
    k = fit.lateral_stiffness.value
    parts = fit.fit_sd, k * 0.02, k * 0.004, k * 0.009
    assert fit.lateral_stiffness.sd == pytest.approx(hypot(*parts), rel=1e-12)
    assert k == pytest.approx(55e3, rel=0.01)


def test_a_coarse_gauge_of_the_rim_widens_by_its_rounding_and_no_more():
    """A step of 0.02 mm of a rim that moves 0.1 mm: its rounding is common to the pull, step / sqrt(12) over 2.5 mm."""
    step, span = 2e-5, 2.5e-3
    fine, coarse = fit_lateral_stiffness(pull(0.05)), fit_lateral_stiffness(pull(0.05, step=step))
    share = step / sqrt(12) / span
    assert fine.fit_sd / 55e3 < share / 5
    assert share * 0.98 < coarse.fit_sd / 55e3 < step / span / 2
    assert abs(coarse.lateral_stiffness.value / 55e3 - 1) < step / span  # both ends rounded by half a step at most


def test_the_slope_over_camber_its_sd_and_degrees_of_freedom():
    """A straight line through three cambers of sd 2 N: one degree of freedom beside the 8 of what is stated."""
    cambers, forces, sd = np.deg2rad([0.0, 5.0, 10.0]), np.array([1.0, 28.0, 48.0]), 2.0
    none = Repeatability(0.01, 8.0, measured=True, conditions=1)
    conditions = []
    for number, (camber, force) in enumerate(zip(cambers, forces, strict=True)):
        sweep = recording("slip_sweep", 400.0, number, 6000.0, force_at_zero_N=force, force_at_zero_sd_N=sd)
        key = Key("T", "flat", 400.0, 5.5e5, float(camber))
        conditions.append(
            combine(
                key, [sweep], borrowed=[], sweep_repeatability=none, pull_repeatability=none, calibration=CALIBRATION
            )
        )
    (found, *others) = [c.camber_stiffness for c in with_camber(conditions, Calibration(force=0.0))]
    line, covariance = np.polyfit(cambers, forces, 1, w=np.full(3, 1 / sd), cov="unscaled")
    squares = float(np.sum((np.polyval(line, cambers) - forces) ** 2)) / sd**2
    assert (found.value, found.sd) == pytest.approx((line[0], sqrt(covariance[0, 0] * (8 + squares) / 9)), rel=1e-9)
    assert found.dof == pytest.approx(9.0)
    assert others == [found, found]
