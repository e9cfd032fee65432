"""The rig simulator obeys the equations it is said to obey; expected numbers are worked out here by hand."""

from importlib import import_module

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tyre.recordings import Condition
from tyre.rig import (
    CampaignPlan,
    DrumCurvature,
    LoadCellDrift,
    Noise,
    PlySteer,
    Protocol,
    RigFriction,
    RigTyre,
    RimCompliance,
    TemperatureDrift,
    default_effects,
    set_effect,
    simulate_pull,
    simulate_step,
    simulate_sweep,
    write_campaign_files,
)

C, K = 6000.0, 60e3
TYRE = RigTyre(cornering_stiffness=C, lateral_stiffness=K, peak_force=420.0)
FLAT = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="flat", temperature=20.0)
DRUM = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="drum", drum_radius=1.3)


def sweep(*effects, condition=FLAT, seed=0, **protocol):
    rng = np.random.default_rng(seed)
    return simulate_sweep(tyre=TYRE, condition=condition, protocol=Protocol(**protocol), effects=effects, rng=rng)


def pull(*effects, seed=0, **protocol):
    rng = np.random.default_rng(seed)
    return simulate_pull(tyre=TYRE, condition=FLAT, protocol=Protocol(**protocol), effects=effects, rng=rng)


def test_default_sweep_is_the_papers_protocol():
    run = sweep()
    assert run.synthetic
    assert any("synthetic" in note for note in run.notes)
    np.testing.assert_allclose(np.diff(run.time), 1 / 200, rtol=1e-9)
    np.testing.assert_allclose(run.speed, 9.3 / 3.6)
    assert np.rad2deg(run.slip_angle.max()) == pytest.approx(4.0, abs=1e-6)
    assert np.rad2deg(run.slip_angle.min()) == pytest.approx(-4.0, abs=1e-6)
    rate = np.rad2deg(np.abs(np.diff(run.slip_angle))) * 200
    assert np.median(rate) == pytest.approx(1.0, rel=1e-6)


def test_branch_gap_is_two_c_rate_length_over_speed():
    # physics: gap = 2 C (d alpha/dt) lambda / v, in the linear range
    rate = np.deg2rad(0.5)
    run = sweep(slip_amplitude=np.deg2rad(0.4), slip_rate=rate, cycles=3)
    up = (np.diff(run.slip_angle, prepend=run.slip_angle[0] - 1e-9) > 0) & (run.time > 1.0)
    near = np.abs(run.slip_angle) < np.deg2rad(0.1)
    at_zero = [
        np.polyfit(run.slip_angle[near & s], run.lateral_force[near & s], 1)[1] for s in (up, ~up & (run.time > 1.0))
    ]
    expected = 2 * C * rate * (C / K) / (9.3 / 3.6)
    assert at_zero[1] - at_zero[0] == pytest.approx(expected, rel=0.01)


def test_step_reaches_63_percent_after_one_relaxation_length():
    protocol = Protocol(step_rise=1e-9, sample_rate=20000.0)
    run = simulate_step(tyre=TYRE, condition=FLAT, protocol=protocol, effects=[], rng=np.random.default_rng(0))
    at_63 = TYRE.steady_force(np.array([(1 - np.exp(-1)) * protocol.step_slip]))[0]  # slip lags, force follows
    travelled = (run.time - protocol.step_wait) * protocol.step_speed
    reached = np.interp(C / K, travelled, run.lateral_force)
    assert reached == pytest.approx(at_63, rel=3e-4)
    assert run.kind == "slip_step"


def test_rim_compliance_moves_the_rim_and_lengthens_the_relaxation():
    test = pull(RimCompliance(stiffness=3e5))
    np.testing.assert_allclose(test.rim_displacement, test.lateral_force / 3e5, rtol=1e-12)
    np.testing.assert_allclose(test.lateral_force, K * test.tyre_deflection, rtol=1e-9)
    soft = RimCompliance(stiffness=3e5).on_tyre(TYRE, FLAT, np.random.default_rng(0))
    assert soft.relaxation_length == pytest.approx(C * (1 / K + 1 / 3e5))


def test_friction_opens_a_loop_of_twice_its_force():
    test = pull(RigFriction(force=2.0, presliding=2e-5))
    middle = np.abs(test.tyre_deflection - 1.25e-3) < 0.8e-3
    going = np.gradient(test.tyre_deflection)
    excess = test.lateral_force - K * test.tyre_deflection
    assert excess[middle & (going > 1e-5)] == pytest.approx(2.0, abs=1e-3)
    assert excess[middle & (going < -1e-5)] == pytest.approx(-2.0, abs=1e-3)
    assert excess[0] == 0.0


def test_drum_lowers_the_cornering_stiffness_only_on_a_drum():
    effect = DrumCurvature(exponent=0.6, wheel_radius=0.34)
    rng = np.random.default_rng(0)
    on_drum = effect.on_tyre(TYRE, DRUM, rng)
    assert on_drum.cornering_stiffness == pytest.approx(C / (1 + 0.34 / 1.3) ** 0.6)
    assert on_drum.lateral_stiffness == K
    assert effect.on_tyre(TYRE, FLAT, rng) == TYRE


def test_drift_offset_and_temperature_add_up():
    plain, changed = sweep(), sweep(PlySteer(force=8.0), LoadCellDrift(rate=6.0))
    difference = changed.lateral_force - plain.lateral_force
    assert difference[0] == pytest.approx(8.0, abs=1e-9)
    assert difference[-1] == pytest.approx(8.0 + 0.1 * plain.time[-1], abs=1e-6)
    warm = sweep(TemperatureDrift(rise=4.0, per_kelvin=-0.002))
    assert warm.temperature[-1] - warm.temperature[0] == pytest.approx(4.0)
    assert warm.lateral_force[-100] / plain.lateral_force[-100] == pytest.approx(1 - 0.002 * 2.0, abs=1e-4)


def test_noise_has_the_declared_size_and_memory():
    quiet = sweep(cycles=8)
    noisy = sweep(Noise(white=0.0, correlated=2.0, correlation_time=0.1, slip=0.0), cycles=8)
    wander = noisy.lateral_force - quiet.lateral_force
    assert wander.std() == pytest.approx(2.0, rel=0.15)
    lag = np.corrcoef(wander[:-20], wander[20:])[0, 1]  # 20 samples are one correlation time
    assert lag == pytest.approx(np.exp(-1), abs=0.1)
    sizes = {"lateral_force": 7.0, "slip_angle": 1e-3, "vertical_load": 5.0, "aligning_moment": 0.4}
    shaken = sweep(Noise(white=7.0, correlated=0.0, slip=1e-3, load=5.0, moment=0.4), cycles=8)
    for name, size in sizes.items():
        assert (getattr(shaken, name) - getattr(quiet, name)).std() == pytest.approx(size, rel=0.05)


def test_effects_are_set_and_removed_by_name():
    effects = default_effects(np.random.default_rng(0))
    louder = set_effect(effects, "noise", {"white": 9.0})
    assert next(effect for effect in louder if isinstance(effect, Noise)).white == 9.0
    assert not any(isinstance(effect, Noise) for effect in set_effect(effects, "noise", None))
    added = set_effect((), "dropouts", {"share": 0.01})
    assert added[0].share == 0.01
    refuses("unknown effect 'rig_frction'; did you mean 'rig_friction'", set_effect, effects, "rig_frction", {})
    refuses("effect noise: unknown parameter 'wite'; did you mean 'white'", set_effect, effects, "noise", {"wite": 1.0})


def test_campaign_refuses_a_folder_with_recordings(tmp_path):
    plan = CampaignPlan(loads=(400.0,), pressures=(5.5e5,), rates=(0.1,), pulls=1)
    settings = {"plan": plan, "effects": (), "rng": np.random.default_rng(0)}
    write_campaign_files(tmp_path, **settings)
    refuses("already holds recordings; give an empty folder", write_campaign_files, tmp_path, **settings)
    for words, plan in (("format 'xls'; known: csv, mixed, tdx", CampaignPlan(file_format="xls")),
                        ("surface 'wet'; known: drum, flat", CampaignPlan(surfaces=("wet",)))):  # fmt: skip
        refuses(f"unknown {words}", write_campaign_files, tmp_path, **settings | {"plan": plan})


@pytest.mark.parametrize(("readings", "cycles"), [(20, 2), (12, 1), (7, 3)])
def test_a_lateral_stiffness_test_has_so_many_readings_a_stroke(readings, cycles):
    """From rest, out and back: two strokes a cycle. Between readings the plate goes one part of its way."""
    test = pull(pull_readings=readings, pull_cycles=cycles, pull_force=120.0)
    assert test.lateral_force.size == 1 + 2 * readings * cycles
    turns = test.tyre_deflection[::readings]
    np.testing.assert_allclose(turns, np.tile([0.0, 120.0 / K], cycles + 1)[: turns.size], atol=1e-12)


def test_the_simulator_has_no_code_of_the_fits_that_it_judges():
    """Only the term by which a diagnosis adds friction to a pull is theirs."""
    fits = {
        "relaxation",
        "magic_formula",
        "noise",
        "sweep_curve",
        "slip_sweep",
        "lateral_stiffness",
        "pull_curve",
        "contact_patch",
        "friction",
    }
    used = {
        (module, thing.__module__.rpartition(".")[2])
        for module in ("simulator", "effect", "effects.mechanics", "effects.sensors", "effects.tyre")
        for thing in vars(import_module(f"tyre.rig.{module}")).values()
        if callable(thing) and getattr(thing, "__module__", None)
    }
    assert {(module, home) for module, home in used if home in fits} == {("effects.mechanics", "friction")}
