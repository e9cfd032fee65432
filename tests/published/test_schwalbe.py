"""The Schwalbe tyre measured on VeTyT, as published by its users: slopes of the sets in use, fate of the older ones.

Sets and check values: mechmotum/bicycle-kickplate-model (BSD-3-Clause), formula: mechmotum/Magic-Formula-89 (CC0).
"""

import json
from pathlib import Path

import numpy as np
import pytest

from tyre.ground import InputError
from tyre.laws import Pacejka89, check_coefficients, read_pacejka89

OLDER = json.loads((Path(__file__).parent / "data" / "schwalbe_t03_older_fits.json").read_text())["sets"]
# Slope of the lateral force at zero slip, N/rad, at 300, 400, 500, 600 N: the authors' evaluation of the three sets
SLOPES = {
    3e5: (4870.0, 5878.0, 6549.0, 6937.0), 4e5: (4419.0, 5848.0, 7235.0, 8565.0), 5e5: (4563.0, 5403.0, 5901.0, 6134.0),
}  # fmt: skip


@pytest.fixture(scope="module")
def tyre():
    return read_pacejka89("schwalbe_energizer_plus_28x1.75")


def older_lateral_force():
    """Older lateral force sets in degrees, by what their authors said of them."""
    sets = {}
    for entry in OLDER:
        if entry["quantity"] == "lateral_force" and entry["slip_unit"] == "deg":
            fit = Pacejka89(entry["label"], 3e5, 1000.0, tuple(entry["coefficients"]))
            sets[(entry["commit"], entry["label"][:24])] = fit
    aborted = next(key for key in sets if "still need refinements" in sets[key].label)
    return sets.pop(aborted), list(sets.values())


@pytest.mark.parametrize("pressure", SLOPES)
def test_slopes_of_the_sets_in_use(tyre, pressure):
    found = tyre.linear(load=np.array([300.0, 400.0, 500.0, 600.0]), pressure=np.full(4, pressure))
    found = found["cornering_stiffness"]
    np.testing.assert_allclose(found, SLOPES[pressure], rtol=0.0, atol=0.51)  # printed to the newton per radian


def test_the_aborted_fit_is_refused():
    aborted, _ = older_lateral_force()
    with pytest.raises(InputError, match=r"cornering stiffness at 200 N is 2729 N/deg, a tyre has 6 to 200 N/deg"):
        check_coefficients(aborted)
    # its slope is in the thousands per degree and the sign of its lateral force flips over load: neither is a tyre
    assert float(aborted.linear(load=450.0)["cornering_stiffness"]) * np.pi / 180.0 == pytest.approx(6000.0, rel=0.05)
    at_four = np.deg2rad(4.0)
    assert aborted.lateral_force(slip_angle=at_four, load=600.0) > 0.0
    assert aborted.lateral_force(slip_angle=at_four, load=800.0) < 0.0


def test_older_fits_of_one_data_set_share_the_slope_and_nothing_else():
    _, fits = older_lateral_force()
    fits = [*fits, read_pacejka89("schwalbe_energizer_plus_28x1.75").sets[0]]
    slopes = np.array([float(fit.linear(load=400.0)["cornering_stiffness"]) for fit in fits])
    a = np.array([fit.lateral_force_coefficients for fit in fits])
    shape, peak, curvature = a[:, 0], a[:, 1] * 0.4**2 + a[:, 2] * 0.4, a[:, 6] * 0.4 + a[:, 7]
    assert len(fits) == 5
    assert np.ptp(slopes) / slopes.mean() < 0.012
    assert shape.max() / shape.min() > 70.0
    assert peak.max() / peak.min() > 40.0
    assert np.ptp(curvature) > 0.4


def test_the_older_sets_in_degrees_pass_the_checks():
    for fit in older_lateral_force()[1]:
        check_coefficients(fit)


def test_an_older_set_in_radians_describes_the_same_tyre(tyre):
    entry = next(e for e in OLDER if e["quantity"] == "lateral_force" and e["slip_unit"] == "rad")
    fit = Pacejka89(entry["label"], 3e5, 1000.0, tuple(entry["coefficients"]), slip_unit="rad")
    slip = np.deg2rad([-3.0, -1.0, 1.0, 3.0])
    in_use = tyre.lateral_force(slip_angle=slip, load=400.0, pressure=3e5)
    np.testing.assert_allclose(fit.lateral_force(slip_angle=slip, load=400.0), in_use, atol=0.05 * np.abs(in_use).max())


def test_trails_fit_the_contact_patch(tyre):
    # brush model (Pacejka, Tire and Vehicle Dynamics, 3rd ed., section 3.2): t = a / 3, half-length a of 30 to 90 mm
    for pressure in SLOPES:
        trail = tyre.linear(load=np.array([300.0, 400.0, 500.0]), pressure=np.full(3, pressure))["pneumatic_trail"]
        assert (trail > 0.010).all()
        assert (trail < 0.030).all()


def test_camber_thrust_is_near_the_load(tyre):
    # a thin toroid in steady lean needs F / Fz = tan(camber) without slip: camber stiffness about the load per radian
    for load in (300.0, 400.0):
        ratio = tyre.at(load=load, pressure=4e5).camber_stiffness / load
        assert 0.6 < ratio < 1.2
