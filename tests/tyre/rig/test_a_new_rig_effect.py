"""A rig effect that is written outside the package: it is simulated by name, and a diagnosis of recordings names it.

Toy (synthetic): a track that leans across, so that a share of the load pushes the tyre aside.
"""

import json
import re
from dataclasses import fields, replace

import numpy as np
import pytest
from pages import section

import tyre.rig
from studies.cli import main
from studies.diagnosis import Curve, Reference, RigRecordings, diagnose
from tests.shared.refusals import refuses
from tyre.ground import InputError
from tyre.recordings import Condition
from tyre.rig import (
    Noise,
    Protocol,
    RigEffect,
    RigTyre,
    SteeringPlay,
    register,
    rig_effects,
    rig_terms,
    set_effect,
    simulate_sweep,
)

C = 7600.0
TYRE = RigTyre(C, 75e3, peak_force=430.0, curvature=0.1, relaxation=False)
FLAT = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="flat", temperature=22.0)
PAGE = section("effects", "Rig effects")
CURVE = Curve(400.0, 5.5e5, (C, 76.0), (75e3, 750.0), None, 430.0, 1.4, 0.1)


@pytest.fixture
def leaning(monkeypatch):
    """The effect of the documentation, known for as long as a test runs."""
    monkeypatch.setattr(tyre.rig.effect, "OUTSIDE", {})
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    namespace = {"__name__": "a_laboratory"}
    exec(compile(block, "effects.md", "exec"), namespace)
    return namespace["LeaningTrack"]


def test_it_is_found_simulated_and_named(leaning):
    assert rig_effects()["leaning_track"] is leaning
    (effect,) = set_effect((), "leaning_track", {"lean": 0.05})
    run = simulate_sweep(
        tyre=TYRE, condition=FLAT, protocol=Protocol(), effects=(effect, Noise()), rng=np.random.default_rng(1)
    )
    measurement = RigRecordings(name="toy", reference=Reference((CURVE,), "the truth"), sweeps=(("s", run),))
    assert "leaning_track" in {c.identifier for c in measurement.prepare().candidates}
    verdict = diagnose(measurement, without=("conicity",)).verdict  # which pushes alike
    assert (verdict.verdict, verdict.equivalent) == ("named", ("leaning_track",))
    (named,) = verdict.effects
    value, sd = named.parameters["lean"]
    assert value == pytest.approx(0.05, abs=3 * sd)
    assert (named.units["lean"], named.signature) == ("rad", "the track leans and pushes the tyre aside")
    both = diagnose(measurement).verdict
    assert set(both.equivalent) == {"leaning_track", "conicity"}


def test_the_command_line_knows_it(leaning, tmp_path):
    options = ["--loads", "400", "--pressures", "5.5", "--rates", "2", "--pulls", "0"]
    main(["tyre", "simulate", str(tmp_path), "--seed", "1", *options, "--effect", "leaning_track:lean=0.03"])
    assert json.loads((tmp_path / "truth.json").read_text())["effects"]["LeaningTrack"] == {"lean": 0.03}


def test_a_name_that_is_taken_is_refused(leaning):
    assert register(leaning) is leaning  # once more is no harm

    class DialGauge(RigEffect):
        pass

    class Another(RigEffect):
        terms = (replace(leaning.terms[0], identifier="conicity"),)

    for effect, name in ((DialGauge, "dial_gauge"), (Another, "conicity")):
        refuses(f"a rig effect or term '{name}' exists already; give {effect.__name__}", register, effect)


def test_what_is_not_registered_is_not_known():
    assert "leaning_track" not in rig_effects()


def test_every_effect_declares_its_numbers():
    """Unit, a typical range inside the bounds, and the term's parameters and words."""
    for name, effect in rig_effects().items():
        for field in fields(effect):
            p = field.metadata["parameter"]
            assert p.name == field.name, name
            assert p.unit, name
            assert p.bounds[0] <= field.default <= p.bounds[1], name
            assert p.bounds[0] <= p.typical[0] < p.typical[1] <= p.bounds[1], name
            assert not p.size or p.typical[0] <= 0.0 <= p.typical[1], (name, p.name)
        for term in effect.terms:
            assert term.sweep or term.pull, term.identifier
            assert len(term.signature) > 10, term.identifier
            for p in term.parameters:
                assert p.bounds[0] <= p.typical[0] < p.typical[1] <= p.bounds[1], (term.identifier, p.name)
                assert p.typical[0] <= 0 <= p.typical[1] if p.size else p.bounds[0] > 0, (term.identifier, p.name)
    names = [term.identifier for term in rig_terms()]
    assert len(names) == len(set(names)) == 15


def test_a_number_out_of_its_bounds_is_refused():
    with pytest.raises(InputError, match=r"effect rig_friction: presliding = 0.0 must be a number from 1e-09 to 1 .m."):
        set_effect((), "rig_friction", {"presliding": 0.0})


def test_delay_and_play_move_the_branches_apart_as_they_should():
    """A delay tau at the rate r moves each branch by r tau of slip, play by its half gap at any rate."""
    for rate in (1.0, 2.0):
        shifts = {}
        for name, values in (("channel_delay", {"delay": 0.05}), ("steering_play", {"half_gap": 1e-3})):
            run = simulate_sweep(
                tyre=replace(TYRE, peak_force=1e6), condition=FLAT, protocol=Protocol(slip_rate=np.deg2rad(rate)),
                effects=set_effect((), name, values), rng=np.random.default_rng(0),
            )  # fmt: skip
            rising = np.gradient(run.slip_angle) > 0
            near = (np.abs(run.slip_angle) < 0.05) & (run.time > 1.0)
            up, down = (np.polyfit(run.slip_angle[near & s], run.lateral_force[near & s], 1) for s in (rising, ~rising))
            shifts[name] = -(up[1] - down[1]) / (up[0] + down[0])
        assert shifts["channel_delay"] == pytest.approx(np.deg2rad(rate) * 0.05, rel=0.01)
        assert shifts["steering_play"] == pytest.approx(1e-3, rel=0.01)


def test_play_is_on_the_side_of_the_last_movement_and_nowhere_before_the_first():
    channels = {"slip_angle": np.array([0.0, 0.02, 0.03, 0.03, 0.01, -0.02])}
    SteeringPlay(half_gap=1e-3).on_rolling(channels, np.random.default_rng(0))
    expected = [0.0, 0.021, 0.031, 0.031, 0.009, -0.021]
    np.testing.assert_allclose(channels["slip_angle"], expected, rtol=1e-12)
