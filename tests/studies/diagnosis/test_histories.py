"""Time histories made by the generator that shares nothing with the fitter."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from small_library import among

from bicycle import Model, effect_class, load_bicycle
from bicycle.identification import Run
from bicycle.model import InputHistory
from bicycle.motion import respond
from studies.diagnosis import Histories, read_measurement
from studies.inference import fit
from tests.validation.blind.histories import coloured, history_case

FEW = {"runs": 3, "duration": 2.5}
LIKELY = ("steer_damper", "steer_spring", "pneumatic_trail", "crown_radius", "steer_friction", "steer_scale",
          "roll_rate_delay", "speed_scale")  # fmt: skip
FEWER = ("steer_damper", "steer_spring", "steer_scale")


def case(tmp_path, hidden, seed, **settings):
    truth = history_case(tmp_path, hidden=hidden, rng=np.random.default_rng(seed), **settings)
    return truth, read_measurement(tmp_path / "MEASUREMENT.toml")


def test_the_model_replays_its_own_response(tmp_path):
    """UncertainParameter start, torque held between samples: what is left is the wide prior of the start only."""
    model, time = Model(load_bicycle("benchmark")), np.arange(300) * 0.01
    torque = InputHistory(np.array([0.0, 0.5, 0.9, 1.3]), np.array([0.0, 3.0, -3.0, 0.0]))
    r = respond(model.linear_model(), speed=5.0, time=time, initial={"lean_rate": 0.3}, inputs={"steer_torque": torque})
    channels = {"roll_rate_rad_s": r.outputs["lean_rate"], "steer_rad": r.outputs["steer"]}
    run = Run("a", 5.0, time, channels, {"steer_torque_N_m": torque.at(time)})
    measurement = Histories(
        name="own", model=model, runs=(run,), noise_sd={"roll_rate_rad_s": 0.02, "steer_rad": 0.005}
    )
    forward = measurement.prepare()
    residual, jacobian = forward.residual((), forward.nominal)
    assert residual @ residual < 2 * (0.3 / 3.0) ** 2  # the prior of the initial lean rate has sd 3 rad/s
    assert jacobian.shape == (600, len(forward.nuisances))


@pytest.mark.parametrize("step", [0.01, 0.002])
def test_a_channel_that_is_late_is_replayed_as_late_as_it_is(step):
    """20 ms, of a bicycle that a smooth torque moves from rest: nine tenths and more of what it misses is explained."""
    time = np.arange(round(2.0 / step)) * step
    torque = np.sin(np.pi * time) ** 2
    driven = {"steer_torque": InputHistory(time, torque, linear=True)}
    model = Model(load_bicycle("benchmark"))
    rate = respond(model.linear_model(), speed=5.0, time=time, inputs=driven).outputs["lean_rate"]
    late = round(0.02 / step)
    seen = np.concatenate([np.zeros(late), rate[:-late]])
    run = Run("a", 5.0, time, {"roll_rate_rad_s": seen}, {"steer_torque_N_m": torque})
    noise = {"roll_rate_rad_s": 0.01 * np.std(rate)}
    forward = Histories(name="own", model=model, runs=(run,), noise_sd=noise).prepare()
    (delay,) = (c for c in forward.candidates if c.identifier == "roll_rate_delay")
    nominal = forward.nominal
    off, explained = (
        forward.residual(joined, np.append(nominal, of), slopes=False)[0] for joined, of in (((), []), ((delay,), 0.02))
    )
    assert np.linalg.norm(explained) < 0.1 * np.linalg.norm(off)


def test_runs_of_any_length_and_step_are_those_of_each_alone():
    """Behind the end of the short run, whose bicycle falls, its motion would grow beyond all numbers."""
    model, runs = Model(load_bicycle("benchmark")), []
    for name, speed, step_s, count in (("short", 1.5, 0.01, 120), ("long", 6.0, 0.02, 24_000)):
        time, rng = np.arange(count) * step_s, np.random.default_rng(count)
        torque = InputHistory(np.array([0.0, 0.2, 0.5]), np.array([0.5, -0.5, 0.0]))
        r = respond(model.linear_model(), speed=speed, time=time, inputs={"steer_torque": torque})
        channels = {"roll_rate_rad_s": r.outputs["lean_rate"], "steer_rad": r.outputs["steer"]}
        channels = {key: signal + 0.01 * rng.standard_normal(count) for key, signal in channels.items()}
        runs.append(Run(name, speed, time, channels, {"steer_torque_N_m": torque.at(time)}))
    noise = {"roll_rate_rad_s": 0.02, "steer_rad": 0.02}
    both, *alone = (
        Histories(name="own", model=model, runs=of, noise_sd=noise).prepare()
        for of in (tuple(runs), *((run,) for run in runs))
    )
    for identifier in ("steer_damper", "bias", "drift", "roll_rate_lowpass", "steer_friction"):
        joined = tuple(c for c in both.candidates if c.identifier == identifier)
        theta = np.concatenate([[u.centre for u in both.nuisances], *(c.starts[0] for c in joined)])
        found, each = both.residual(joined, theta), [one.residual(joined, theta) for one in alone]
        residual, slopes = (np.concatenate([one[k] for one in each]) for k in range(2))
        np.testing.assert_allclose(found[0], residual, rtol=1e-8, atol=1e-8)
        apart, size = np.linalg.norm(found[1] - slopes, axis=0), np.linalg.norm(slopes, axis=0)
        assert (apart <= 1e-4 * size + 1e-9 * size.max()).all()  # rounding of eight minutes
        total = sum(one.log_determinant(joined, theta) for one in alone)
        assert both.log_determinant(joined, theta) == pytest.approx(total, rel=1e-9)


def test_derivatives_agree_with_differences_of_the_residual(tmp_path):
    _, measurement = case(tmp_path, (), 3, bicycle="pista", **FEW)
    forward = measurement.prepare()
    identifiers = ("steer_damper", "steer_torque_delay", "roll_rate_delay", "steer_scale", "speed_scale")
    for identifier in (*identifiers, "roll_rate_lowpass", "steer_friction", "speed_offset", "wrong_tilt", "luggage"):
        candidate = next(c for c in forward.candidates if c.identifier == identifier)
        theta = np.concatenate([[u.centre for u in forward.nuisances], candidate.starts[0]])
        _, jacobian = forward.residual((candidate,), theta)
        k = len(forward.nuisances)
        h = np.zeros_like(theta)
        h[k] = 1e-3 * candidate.unknowns[0].scale
        plus, minus = (forward.residual((candidate,), theta + s * h, slopes=False)[0] for s in (1, -1))
        numeric, slope = (plus - minus) / (2 * h[k]), jacobian[:, k]
        # the derivative holds the marginalised start: it differs where the start would follow, not in direction
        assert slope @ numeric / np.sqrt((slope @ slope) * (numeric @ numeric)) > 0.98, identifier


def test_the_gradient_of_a_run_whose_wobble_grows_is_that_of_the_objective():
    """The root grows by exp(16) in the run; the steps that do for a run that dies out give a gradient wrong by 3 %."""
    tyre = {"cornering_stiffness": {"rear": 1250.0, "front": 770.0}, "relaxation_length": 0.095}
    model, true = (
        Model(load_bicycle("browser")).with_effect(effect_class("relaxation_length")(**tyre | {"relaxation_length": s}))
        for s in (0.095, 0.097)
    )
    speed, time = 24.0, np.arange(300) * 0.01
    linear = true.linear_model()
    assert linear.eigenvalues([speed]).real.max() * time[-1] == pytest.approx(16, abs=1)
    r = respond(linear, speed=speed, time=time, initial={"steer": 3e-8})
    channels = {"roll_rate_rad_s": r.outputs["lean_rate"], "steer_rad": r.outputs["steer"]}
    noise = {"roll_rate_rad_s": 0.02, "steer_rad": 0.004}
    run = Run("a", speed, time, channels, {})
    forward = Histories(name="own", model=model, runs=(run,), noise_sd=noise).prepare()
    theta = forward.nominal
    residual, jacobian = forward.residual((), theta)
    assert 0.1 < max(np.abs(seen).max() for seen in channels.values()) < 10
    gradient, numeric = residual @ jacobian, []
    for k, u in enumerate(forward.nuisances):
        h = np.zeros(len(theta))
        h[k] = 1e-4 * u.scale
        plus, minus = (forward.residual((), theta + s * h, slopes=False)[0] for s in (1, -1))
        numeric.append((plus @ plus - minus @ minus) / (4 * h[k]))
    scale = np.array([u.scale for u in forward.nuisances])
    np.testing.assert_allclose(gradient * scale, numeric * scale, rtol=2e-3, atol=2e-4 * np.abs(numeric * scale).max())


@pytest.mark.parametrize("settings", [{"forced": False}, {"transient": 0.05}])
def test_nothing_hidden_nothing_named(tmp_path, settings):
    _, measurement = case(tmp_path, (), 7, bicycle="browser", **FEW, **settings)
    found = among(measurement, FEWER).verdict
    assert found.verdict == "none"
    assert found.effects == ()


def test_coloured_noise_is_estimated_and_keeps_chi_squared_honest(tmp_path):
    _, measurement = case(tmp_path, (), 8, bicycle="browser", **FEW)
    rng = np.random.default_rng(4)
    runs = tuple(
        dataclasses.replace(run, channels={k: x + coloured(len(x), 0.03, 0.9, rng) for k, x in run.channels.items()})
        for run in measurement.runs
    )
    measurement = dataclasses.replace(measurement, runs=runs, noise_sd={})
    forward = measurement.prepare()
    forward = forward.estimate_noise(fit(forward))
    assert 0.8 < forward.noise["steer_rad"].colour < 0.95
    found = fit(forward)
    assert found.chi2 / len(found.residual) == pytest.approx(1, abs=0.1)


SETTINGS = {"steer_damper": {"bicycle": "browser"}, "relaxation_length": {"speeds": (13.0, 17.0)}}  # near 15 m/s


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """Truth and diagnosis of a case by the name of its effect; each is made once."""

    @cache
    def of(name):
        truth, measurement = case(tmp_path_factory.mktemp(name), (name,), 3, **FEW, **SETTINGS[name])
        return truth, among(measurement, {*FEWER, name})

    return of


@pytest.mark.parametrize("name", SETTINGS)
def test_one_hidden_effect_is_named_with_its_size(diagnosed, name):
    truth, diagnosis = diagnosed(name)
    found = diagnosis.verdict
    assert found.verdict in ("named", "class")
    assert found.equivalent[0] == name
    key, (value, sd) = next(iter(found.effects[0].parameters.items()))
    assert abs(value - truth.effects[name][key]) < 4 * sd


def test_a_sensor_that_reads_too_much_is_told_from_a_physical_effect(tmp_path):
    _, measurement = case(tmp_path, (), 9, bicycle="browser", **FEW)
    runs = tuple(
        dataclasses.replace(run, channels={**run.channels, "steer_rad": 0.8 * run.channels["steer_rad"]})
        for run in measurement.runs
    )
    found = among(dataclasses.replace(measurement, runs=runs), LIKELY).verdict
    assert found.equivalent[0] == "steer_scale"
    assert found.effects[0].parameters["scale"][0] == pytest.approx(-0.2, abs=0.02)


def test_one_speed_names_nothing_neither_do_its_repeats_nor_one_run(tmp_path):
    _, three = case(tmp_path, ("steer_damper",), 5, bicycle="browser", speeds=(6.0, 6.0), noise=0.5, **FEW)
    assert {run.speed for run in three.runs} == {6.0}
    assert set(three.prepare().rows.fold) == {0, 1, 2}
    one_speed = among(three, FEWER).verdict  # repeats are no evidence: any flexible mix passes them
    assert (one_speed.verdict, one_speed.effects) == ("unknown", ())
    assert [check.passed for check in one_speed.checks if check.rule == "varied"] == [False]
    found = among(dataclasses.replace(three, runs=three.runs[:1]), FEWER)
    assert found.verdict.verdict == "unknown"
    assert any("one run: nothing can be held out" in w for w in found.verdict.warnings)
    assert found.verdict.held_out_gap == {"nominal": 1.0, "nuisance_only": None, "final": None}


def test_advice_for_histories_ranks_forced_inputs_too(tmp_path):
    """Three free decays cannot tell the crown's radius from trail; a ruler can, a swept torque hardly."""
    _, measurement = case(tmp_path, ("crown_radius",), 26, noise=2.0, forced=False, **FEW)
    found = among(measurement, LIKELY).verdict
    assert (found.verdict, set(found.equivalent)) == ("class", {"crown_radius", "pneumatic_trail"})
    assert found.separating_measurements[0].what.startswith("round cross-section of the tyre, measured separately (")
    assert any(s.what.startswith("swept steer torque") and s.gain > 0.5 for s in found.separating_measurements)


@pytest.mark.parametrize(("seconds", "count"), [(0.5, 1), (0.8, 1), (2.5, 4), (3.0, 5)])
def test_pieces_of_a_run_hold_every_sample_once(seconds, count):
    """About 0.6 s each, with the inputs of their own samples and names of their own."""
    time = np.arange(0.0, seconds, 0.01)
    run = Run("r.csv", 4.8, time, {"steer_rad": np.sin(time)}, {"steer_torque_N_m": np.cos(time)})
    kind = Histories(name="own", model=Model(load_bicycle("benchmark")), runs=(run,))
    parts = kind.easier_problems()[0].runs if count > 1 else (run,)
    assert (kind.easier_problems() == ()) == (count == 1)
    assert len({part.name for part in parts}) == len(parts) == count
    for of, whole in (
        (lambda part: part.time, time), (lambda part: part.channels["steer_rad"], np.sin(time)),
        (lambda part: part.inputs["steer_torque_N_m"], np.cos(time)),
    ):  # fmt: skip
        np.testing.assert_array_equal(np.concatenate([of(part) for part in parts]), whole)
    assert {part.speed for part in parts} == {4.8}
    assert max(len(part.time) for part in parts) - min(len(part.time) for part in parts) <= 1
