"""Pre-flight: each fault is put into a sound recording and must be named, and nothing else."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tyre.recordings import Condition, LateralStiffnessTest, RigRun, preflight

CONDITION = Condition("Tyre", 400.0, 5.5e5, "flat", speed=2.6, temperature=22.0)


def sweep(cycles=3, reach=4.0, slope=6300.0):
    """Triangular sweeps at 200 Hz and 1 deg/s with a little noise."""
    rng = np.random.default_rng(7)
    t = np.arange(int(cycles * 4 * reach * 200)) / 200.0
    phase = t / (4 * reach) % 1.0
    slip = np.deg2rad(reach) * (4.0 * np.abs((phase + 0.75) % 1.0 - 0.5) - 1.0)
    force, load, moment, speed = (rng.normal(0.0, sd, t.size) for sd in (1.0, 1.0, 0.02, 0.01))
    return RigRun(
        CONDITION, "adapted SAE", t, slip, slope * slip + force, 400.0 + load, -0.017 * slope * slip + moment,
        speed=2.6 + speed,
    )  # fmt: skip


def pull():
    up = np.linspace(0.0, 2e-3, 40)
    x = np.concatenate([up, up[::-1]])
    force = 5.5e4 * x + np.repeat([1.0, -1.0], 40)
    rng = np.random.default_rng(7)
    return LateralStiffnessTest(CONDITION, "ISO", force + rng.normal(0.0, 0.1, 80), x + 1e-6 * force, 1e-6 * force)


def changed(recording, **channels):
    """A copy with some channels passed through functions."""
    return replace(recording, **{name: change(getattr(recording, name).copy()) for name, change in channels.items()})


def put(index, value):
    def change(channel):
        channel[index] = value
        return channel

    return change


def test_a_sound_sweep_has_no_problems():
    verdict = preflight(sweep())
    assert verdict.problems == []
    assert verdict.usable
    assert "6 branches" in verdict.present[1]  # three cycles
    assert "slip -4 to 4 deg" in verdict.present[1]
    assert "400 N, 5.5 bar, flat track" in verdict.present[0]
    assert verdict.missing == []


def test_a_sound_pull_has_no_problems():
    verdict = preflight(pull())
    assert verdict.problems == []
    assert verdict.missing == []
    assert verdict.usable


FAULTS = [
    (lambda: sweep(cycles=0.7), "too few sweeps: 1 branch", True),
    (lambda: sweep(cycles=1.0), "too few sweeps: 2 branches show no repeatability", True),
    (lambda: sweep(reach=0.6, cycles=12), r"slip range is \+-0.6 deg, at least \+-1 deg", False),
    (lambda: sweep(reach=2.0), r"slip range is \+-2 deg, curvature shows only beyond \+-3 deg", True),
    (lambda: changed(sweep(), slip_angle=np.abs, lateral_force=np.abs, aligning_moment=lambda m: -np.abs(m)),
     "slip to one side only", True),
    (lambda: changed(sweep(), vertical_load=lambda f: f + np.linspace(0.0, 16.0, f.size)),
     r"vertical load drifts by \+3", True),
    (lambda: changed(sweep(), vertical_load=lambda f: 1.1 * f),
     r"median vertical load is 440 N, \+10.0% off the declared 400 N; at most 5% is allowed: declare", False),
    (lambda: changed(sweep(), lateral_force=put(slice(100, 150), np.nan)),
     "lateral_force has 50 missing samples .*longest run of 50 from sample 101", True),
    (lambda: changed(sweep(), slip_angle=put(slice(0, 3000), np.nan)), "slip_angle has 3000 missing samples", False),
    (lambda: changed(sweep(), lateral_force=lambda f: np.clip(f, -350.0, 350.0)), "lateral_force is saturated", False),
    (lambda: changed(sweep(), lateral_force=put(slice(500, 800), 12.0)), "lateral_force is frozen: 300 samples", False),
    (lambda: changed(sweep(), lateral_force=put(slice(500, 800), 900.0)),
     "lateral_force is saturated: 300 samples", False),
    (lambda: changed(sweep(), lateral_force=np.negative),
     r"under axes = 'adapted SAE'; axes = 'ISO' or 'SAE' fits",
     False),
    (lambda: replace(changed(sweep(), lateral_force=np.negative), axes="SAE"), "axes = 'adapted SAE' fits", False),
    (lambda: changed(sweep(), aligning_moment=np.negative), "wrong sign: aligning moment grows with slip", True),
    (lambda: changed(sweep(), lateral_force=lambda f: np.random.default_rng(1).normal(size=f.size)),
     "lateral force does not follow the slip", True),
    (lambda: changed(sweep(), time=put(40, 0.05)), r"time does not increase at 1 samples, first at sample 41", False),
    (lambda: changed(sweep(), time=put(40, np.nan)), "time is missing in 1 samples", False),
    (lambda: changed(sweep(), time=lambda t: t + 3.0 * (t > 5.0)), "1 gap in time, the first of 3 s after 5", True),
    (lambda: changed(sweep(), speed=lambda v: 1.3 * v), "speed is 12.2 km/h, declared are 9.36 km/h", True),
    (lambda: changed(sweep(), speed=lambda v: v * np.linspace(0.7, 1.3, v.size)), "speed varies by 1", True),
    (lambda: changed(sweep(), speed=np.negative), "the tyre does not roll forward", False),
    (lambda: replace(sweep(), temperature=np.linspace(20.0, 40.0, sweep().time.size)),
     r"temperature drifts by \+1", True),
    (lambda: changed(pull(), lateral_force=np.negative), "lateral force falls with displacement", False),
    (lambda: changed(pull(), lateral_force=lambda f: np.clip(f, None, 80.0)), "lateral_force is saturated", False),
    (lambda: changed(pull(), plate_displacement=lambda x: 0.1 * x, rim_displacement=lambda x: 0.1 * x),
     "tyre deflection covers 0.2 mm, 0.3 mm are needed", False),
    (lambda: changed(pull(), plate_displacement=lambda x: 0 * x + 1.5e-3), "plate_displacement stays at 1.5 mm", False),
    (lambda: changed(pull(), plate_displacement=lambda x: np.round(x, 3)), "fewer than 20 steps of the gauge", True),
    (lambda: changed(pull(), lateral_force=put(slice(5, None), np.nan)),
     "only 5 complete samples, 8 are needed", False),
    (lambda: replace(pull(), plate_displacement=4 * pull().plate_displacement,
                     rim_displacement=3 * pull().plate_displacement), "the rim takes 75% of the plate's", True),
    (lambda: replace(sweep(), slip_angle=np.full(sweep().time.size, np.nan)), "slip_angle has no valid samples", False),
    (lambda: replace(changed(sweep(), slip_angle=lambda a: 1e-4 * a), kind="slip_step"), "the slip step is", False),
]  # fmt: skip


@pytest.mark.parametrize(("fault", "message", "usable"), FAULTS, ids=[message[:40] for _, message, _ in FAULTS])
def test_a_fault_is_named(fault, message, usable):
    verdict = preflight(fault())
    text = "\n".join(verdict.problems)
    assert re.search(message, text), text
    assert verdict.usable is usable


@pytest.mark.parametrize(("factor", "tolerance", "usable", "said"), [
    (1.04, 0.05, True, False), (0.94, 0.05, False, True), (0.5, 0.05, False, True), (0.5, 0.6, True, True),
    (1.03, 0.02, False, True),
])  # fmt: skip
def test_a_load_off_the_declared_one_is_refused_unless_allowed(factor, tolerance, usable, said):
    verdict = preflight(changed(sweep(), vertical_load=lambda f: factor * f), load_tolerance=tolerance)
    assert verdict.usable is usable
    assert any(f"median vertical load is {400 * factor:.3g} N" in text for text in verdict.problems) is said
    assert any(f"at most {tolerance:.0%} is allowed" in text for text in verdict.problems) is not usable


def test_what_is_missing_is_named():
    bare = replace(
        sweep(), aligning_moment=None, speed=None, condition=replace(CONDITION, speed=None, temperature=None)
    )
    text = "\n".join(preflight(bare).missing)
    for words in ("no pneumatic trail", "rate lag cannot be removed", "temperature: its drift"):
        assert words in text
    loading = LateralStiffnessTest(CONDITION, "ISO", *(np.linspace(0.0, top, 40) for top in (100.0, 2e-3, 0.0)))
    text = "\n".join(preflight(loading).missing)
    for words in ("the rim is taken as rigid", "unloading: friction and stiffness are not"):
        assert words in text


@pytest.mark.parametrize(("factor", "said"), [(1.025, False), (0.975, False), (1.035, True)])
def test_a_pressure_within_three_percent_is_the_declared_one(factor, said):
    given = replace(sweep(), pressure=np.full(sweep().time.size, factor * 5.5e5))
    assert any("off by more than 0.17: declare" in text for text in preflight(given).problems) is said


def test_a_slip_that_trembles_between_the_middle_and_an_end_adds_no_branch():
    """The half of the range is crossed at every sample of a tremble; only whole runs count."""
    trembling = changed(sweep(), slip_angle=lambda a: a + np.deg2rad(0.1) * (-1.0) ** np.arange(a.size))
    assert "6 branches" in preflight(trembling).present[1]
