"""Sensors that flatten softly, or have two gains, are named in a sweep; a tyre that saturates is not."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.validation.sensor_faults import TYRES, sweep, two_gains
from tyre.fits import fit_slip_sweep
from tyre.recordings import Condition, RigRun


def clean(seed, kind="brush"):
    return sweep(np.random.default_rng(seed), TYRES[kind])


def quiet(noise=1.5, reach=6.0, flat=None):
    """Lateral force 400 sin(1.4 atan(B x)) N with a slope of 6000 N/rad at zero, swept at 1 deg/s without lag."""
    rng = np.random.default_rng(3)
    t = np.arange(int(12 * reach * 100)) / 100.0
    phase = t / (4 * reach) % 1.0
    slip = np.deg2rad(reach) * (4.0 * np.abs((phase + 0.75) % 1.0 - 0.5) - 1.0)
    force = 400.0 * np.sin(1.4 * np.arctan(6000.0 / (1.4 * 400.0) * slip))
    if flat:
        size = np.abs(force)
        force = np.sign(force) * np.where(size > flat, flat + 60.0 * np.tanh((size - flat) / 60.0), size)
    force = force + rng.normal(0.0, noise, t.size)
    return RigRun(Condition("T", 400.0, 5e5, "flat", speed=2.6), "ISO", t, slip, force, np.full(t.size, 400.0))


@pytest.mark.parametrize("kind", TYRES)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_tyre_that_saturates_is_no_fault(kind, seed):
    assert fit_slip_sweep(clean(seed, kind)).sensor_faults == ()


def test_a_tyre_that_slides_is_no_fault():
    run = quiet(reach=12.0)
    left = 1.0 - np.minimum(6000.0 * np.abs(np.tan(run.slip_angle)) / 1200.0, 1.0)  # a brush of 400 N
    brush = np.sign(run.slip_angle) * 400.0 * (1.0 - left**3)
    noise = np.random.default_rng(4).normal(0.0, 1.5, brush.size)
    assert fit_slip_sweep(replace(run, lateral_force=brush + noise)).sensor_faults == ()


def test_a_force_cell_that_flattens_is_named_and_its_samples_are_not_used():
    fit = fit_slip_sweep(quiet(flat=250.0))
    (said,) = fit.sensor_faults
    found = re.search(
        r"that of lateral_force: beyond \+-([\d.]+) N .* at least (\d+) % at its largest, ([\d.]+) N", said
    )
    assert found, said
    onset, share, largest = map(float, found.groups())
    assert largest == pytest.approx(305.0, abs=8.0)
    assert 210.0 < onset < 290.0
    assert 3.0 <= share <= 20.0  # 370 N read as 308 N, of which the curve hides a part
    assert np.abs(fit.blocks.force[fit.blocks.settled]).max() <= onset + 1.0
    assert fit.cornering_stiffness.value == pytest.approx(6000.0, rel=0.03)
    assert said in fit.notes


def test_a_slip_sensor_that_flattens_is_named():
    run = quiet()
    end = np.deg2rad(6.0)
    size = np.abs(run.slip_angle)
    low = np.where(size > 0.5 * end, 0.5 * end + 0.3 * end * np.tanh((size - 0.5 * end) / (0.3 * end)), size)
    fit = fit_slip_sweep(replace(run, slip_angle=np.sign(run.slip_angle) * low))
    (said,) = fit.sensor_faults
    assert re.search(r"that of slip_angle: beyond \+-[\d.]+ deg it reads too little", said)
    assert fit.cornering_stiffness.value == pytest.approx(6000.0, rel=0.03)


def test_two_gains_are_told_with_their_difference():
    (said,) = fit_slip_sweep(two_gains(quiet(reach=4.0), 0.06)).sensor_faults
    found = re.search(r"a larger gain to the right than to the left, by at least about ([\d.]+) %", said)
    assert found, said
    assert float(found.group(1)) == pytest.approx(6.0, abs=1.5)
    (said,) = fit_slip_sweep(two_gains(quiet(reach=4.0), -0.06)).sensor_faults
    assert "a larger gain to the left than to the right" in said


def test_a_fit_without_lag_correction_judges_no_sensor():
    assert fit_slip_sweep(quiet(flat=250.0), lag_correction=False).sensor_faults == ()
