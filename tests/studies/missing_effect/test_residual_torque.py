"""The residual torque of a diagnosis, against the blind generator's other equations, and its parts by hand.

The stand-in of a diagnosis has what the fit needs: the parameters adjusted, the verdict as a library without the cause
leaves it.
"""

import dataclasses
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bicycle import load_bicycle
from bicycle.effect import effect_class
from bicycle.files.model_file import read_model
from studies.inference.acceptance import LEFT_OVER
from studies.inference.evidence import Hypotheses
from studies.inference.fit import fit
from studies.inference.verdict import AcceptanceCheck
from studies.missing_effect import read_measurement
from studies.missing_effect.blind.generator import HELD_OUT, modal_case
from studies.missing_effect.blind.hidden import Cause
from studies.missing_effect.blind.second.closing import build
from studies.missing_effect.blind.second.machine import Extras
from studies.missing_effect.blind.second.shapes import weave_speed
from studies.missing_effect.reporting.corrected_model import corrected_model, model_text
from studies.missing_effect.residual.amplitude import _regressed
from studies.missing_effect.residual.claims import claims
from studies.missing_effect.residual.fitting import fit_residual
from studies.missing_effect.residual.seen import SIZE, seen
from studies.missing_effect.residual.selection import Linear, Selector
from studies.missing_effect.residual.shapes import shape_of
from studies.missing_effect.residual.terms import PAIRS, SpeedScale, keys, name_of, unknown
from studies.validations.residual_torque import prediction_gap, summary, weave_said
from tyre.base.errors import InputError


def said(verdict, *failed):
    """A verdict and the rules that do not hold."""
    return SimpleNamespace(verdict=verdict, checks=[AcceptanceCheck(what, "0.001", False) for what in failed])


def left_open(measurement, without=()):
    forward = measurement.forward(without=without)
    null = fit(forward)
    return SimpleNamespace(
        measurement=measurement, forward=forward, final=null, verdict=said("unknown"),
        hypotheses=Hypotheses(null, (), forward.candidates),
    )  # fmt: skip


@pytest.fixture(scope="module")
def damped(tmp_path_factory):
    """A steer damper that the library is told not to know; its size is the generator's."""
    folder = tmp_path_factory.mktemp("damped")
    rng = np.random.default_rng(11)
    truth = modal_case(folder, hidden=("steer_damper",), rng=rng, bicycle="browser", kind="rolling", held_out=5)
    found = left_open(read_measurement(folder / "MEASUREMENT.toml"), without=("steer_damper",))
    return SimpleNamespace(folder=folder, truth=truth, diagnosis=found, residual=fit_residual(found))


def test_a_damper_that_nobody_knows_is_kept_as_a_torque_against_the_steer_rate(damped):
    found = damped.residual
    assert "steer_from_steer_rate" in found.kept
    gain, sd = found.values["steer_from_steer_rate"], found.sd["steer_from_steer_rate"]
    assert abs(gain + damped.truth.effects["steer_damper"]["damping"]) < 3 * sd
    assert found.sd_alone["steer_from_steer_rate"] < 0.2 * abs(gain)
    assert sd > found.sd_alone["steer_from_steer_rate"]
    assert len(found.kept) <= 3  # sparse
    assert found.after.gap < 0.3 * found.before.gap
    assert all(gain > 0 for pair in found.gains.values() for gain in pair)


def test_what_was_left_out_is_zero_within_what_the_data_leave_open(damped):
    found = damped.residual
    assert not set(found.kept) & set(found.dropped)
    assert len(found.kept) + len(found.dropped) == 24
    assert all(found.sd[name] > 0 for name in found.dropped)
    np.testing.assert_allclose(found.covariance, found.covariance.T, rtol=1e-9, atol=1e-12)
    correlation = found.covariance / np.sqrt(np.outer(found.covariance.diagonal(), found.covariance.diagonal()))
    assert np.linalg.eigvalsh(correlation)[0] > -1e-9


def test_the_corrected_model_predicts_speeds_that_were_kept_back_and_the_weave_of_the_truth(damped):
    path = damped.folder / "model.toml"
    path.write_text(model_text(damped.diagnosis, damped.residual))
    model, measured = read_model(path), read_measurement(damped.folder / HELD_OUT / "MEASUREMENT.toml")
    assert prediction_gap(measured, model) <= 0.25 * prediction_gap(measured, measured.model)
    said = claims(damped.residual, model)
    (weave,) = (one.interval for one in said.found if one.interval.mode == "weave")
    assert weave.holds(damped.truth.weave)
    assert weave.high - weave.low < 2.0
    assert weave_said(said, damped.truth.weave)["outcome"] == "inside"


def test_the_model_file_holds_the_fit_and_its_covariance(damped):
    path = damped.folder / "again.toml"
    path.write_text(model_text(damped.diagnosis, damped.residual))
    read, made = read_model(path), corrected_model(damped.diagnosis, damped.residual)
    assert read.parameters == pytest.approx(made.parameters, rel=1e-9, abs=1e-12)
    for name, sd in damped.residual.sd.items():
        assert read.sd[f"residual_torque.{name}"] == pytest.approx(sd, rel=1e-6)
    assert read.sd["residual_torque.middle_speed"] == 0
    assert read.sd["c"] > 0
    assert read.covariance.origin == "model file"
    low, high = damped.residual.scale.ends
    assert f"extrapolated outside {low:.3g} to {high:.3g} m/s" in path.read_text()
    assert "does not describe the data" not in path.read_text()
    assert "residual_torque" not in [e.identifier for e in corrected_model(damped.diagnosis).effects]


def test_a_torque_that_leaves_twice_the_noise_does_not_describe_the_data(damped):
    good, poor = (dataclasses.replace(damped.residual, misfit=misfit) for misfit in (3.9, 4.1))
    assert (good.describes, poor.describes) == (True, False)
    assert "it is no cause, does not describe the data, and is extrapolated" in model_text(damped.diagnosis, poor)


def test_its_shape_is_that_of_the_effect_that_was_left_out(damped):
    found, forward = damped.residual, damped.diagnosis.forward
    motion = seen(forward, found.fit.candidates, found.fit.theta)
    assert np.sqrt((np.abs(motion.angle) ** 2).sum(1).mean()) == pytest.approx(SIZE)
    np.testing.assert_allclose(motion.state[:, 3], motion.root * motion.state[:, 1])
    shape = shape_of(forward, found, motion)
    assert sum(shape.shares.values()) == pytest.approx(1.0)
    assert shape.shares["steer", "steer_rate"] > 0.8
    best = shape.library[0]
    assert (best.identifier, best.reversed) == ("steer_damper", False)
    assert best.share > 0.8
    assert all(0 <= one.share <= 1 for one in (*shape.library, *shape.errors))
    assert {one.identifier for one in shape.errors} >= {"speed_scale", "lean_sensor_delay"}


def test_a_gap_that_is_explained_keeps_nothing(damped):
    for verdict in (said("none", LEFT_OVER), said("named"), said("class"), said("tentative", "a size that occurs")):
        closed = SimpleNamespace(**vars(damped.diagnosis) | {"verdict": verdict})
        assert fit_residual(closed) is None
    tyre = SimpleNamespace(verdict=said("unknown"), measurement=object(), forward=None, final=None)
    assert fit_residual(tyre) is None


def test_beside_a_tentative_name_a_torque_is_kept_if_one_is_left(damped):
    tentative = SimpleNamespace(**vars(damped.diagnosis) | {"verdict": said("tentative", LEFT_OVER)})
    assert fit_residual(tentative).values == damped.residual.values


def test_data_that_cannot_carry_one_are_refused(damped):
    measurement = damped.diagnosis.measurement
    model = measurement.model.with_effect(effect_class("residual_torque")())
    with pytest.raises(InputError, match=r"the base model has \[effects.residual_torque\] already; take it out to fit"):
        fit_residual(left_open(measurement.on(model)))
    one = dataclasses.replace(measurement, points=measurement.points[:1])
    with pytest.raises(InputError, match="all data are of one run: none can be left out to tell a torque from a good"):
        fit_residual(left_open(one))


def test_noise_alone_is_not_kept(tmp_path):
    modal_case(tmp_path, hidden=(), rng=np.random.default_rng(5), bicycle="browser", kind="rolling")
    with pytest.raises(InputError, match="no torque that is linear in the state improves the prediction of data left"):
        fit_residual(left_open(read_measurement(tmp_path / "MEASUREMENT.toml")))


def test_a_spring_on_lean_that_no_library_has_is_a_lean_torque(tmp_path):
    cause = Cause({"lean_spring": {}}, Extras(lean_spring=150.0))
    rng = np.random.default_rng(8)
    modal_case(tmp_path, hidden=(), rng=rng, bicycle="pista", kind="rolling", cause=cause, noise=0.5)
    found = fit_residual(left_open(read_measurement(tmp_path / "MEASUREMENT.toml")))
    mean, sd = found.gains_at(np.array([found.scale.middle]))
    k = PAIRS.index(("lean", "lean"))
    assert abs(mean.reshape(-1)[k] + 150.0) < 3 * sd.reshape(-1)[k]
    assert found.after.gap < found.before.gap


# ------------------------------------------------------------------ the linear problem


@pytest.fixture(scope="module")
def line():
    rng = np.random.default_rng(2)
    return Linear(rng.normal(size=(30, 5)), 2 * rng.normal(size=30), np.arange(30) % 4)


@pytest.mark.parametrize("columns", [[], [1], [0, 3, 4]])
def test_evidence_and_held_out_score_are_normal_densities(line, columns):
    a, y = line.jacobian[:, columns], line.target
    whole = np.eye(30) + a @ a.T
    index = np.array(columns, int)
    assert line.evidence(index) == pytest.approx(multivariate_normal(np.zeros(30), whole).logpdf(y))
    score = 0.0
    for fold in range(4):
        out, rest = np.flatnonzero(line.fold == fold), np.flatnonzero(line.fold != fold)
        pull = whole[np.ix_(out, rest)] @ np.linalg.inv(whole[np.ix_(rest, rest)])
        mean, spread = pull @ y[rest], whole[np.ix_(out, out)] - pull @ whole[np.ix_(rest, out)]
        score += multivariate_normal(mean, (spread + spread.T) / 2).logpdf(y[out])
    assert line.held_out(index) == pytest.approx(score)


def test_the_posterior_of_coordinates_is_that_of_ridge_regression(line):
    columns, sd = np.array([0, 2]), np.array([1.0, 0.1])
    mean, covariance = line.posterior(columns, sd)
    inverse = np.linalg.inv(line.jacobian[:, columns].T @ line.jacobian[:, columns] + np.diag(1 / sd**2))
    np.testing.assert_allclose(covariance, inverse, rtol=1e-9)
    np.testing.assert_allclose(mean, inverse @ line.jacobian[:, columns].T @ line.target, rtol=1e-9)
    assert line.misfit(np.array([], int)) == pytest.approx(float(line.target @ line.target) / 30)
    assert line.louder(2.0).misfit(np.array([], int)) == pytest.approx(float(line.target @ line.target) / 120)


@pytest.mark.parametrize("wanted", [{("steer", "steer_rate"): 1}, {("lean", "lean"): 2, ("steer", "lean"): 1}])
def test_few_terms_are_found_among_many(wanted):
    rng, scale = np.random.default_rng(4), SpeedScale(5.0, 2.0, 3)
    jacobian = rng.normal(size=(200, 2 + 24))
    places = {key: 2 + k for k, key in enumerate(keys(dict.fromkeys(PAIRS, 3)))}
    target = rng.normal(size=200) + sum(2.0 * jacobian[:, places[key]] for key in keys(wanted))
    selector = Selector(Linear(jacobian, target, np.arange(200) % 6), 2, scale)
    assert selector.select({}) == wanted
    assert selector.select(dict.fromkeys(PAIRS, 1)) == wanted
    assert all(min(gain) > 0 for gain in selector.gains(wanted).values())


def test_a_curve_is_found_where_the_slope_beneath_it_gains_nothing():
    """A slope alone is not worth its price, so from a constant the curve is only reached by two terms at once."""
    pair, rng, terms = ("steer", "lean"), np.random.default_rng(4), keys(dict.fromkeys(PAIRS, 3))
    columns = math.sqrt(200) * np.linalg.qr(rng.normal(size=(200, 25)))[0]  # orthogonal, the last one noise
    target = columns @ [{(pair, 0): 4.0, (pair, 2): 2.0}.get(term, 0.0) for term in (*terms, None)] + columns[:, 24]
    selector = Selector(Linear(columns[:, :24], target, np.arange(200) % 6), 0, SpeedScale(5.0, 2.0, 3))
    assert selector.worth({pair: 2}) < selector.worth({pair: 1}) < selector.worth({pair: 3})
    assert selector.select({pair: 1}) == {pair: 3}


def test_speeds_allow_as_many_powers_as_there_are_speeds():
    assert SpeedScale.of([4.0, 4.01, 4.02]).most == 1
    assert SpeedScale.of([4.0, 6.0]).most == 2
    wide = SpeedScale.of([4.0, 5.0, 8.0])
    assert (wide.middle, wide.span, wide.most) == (6.0, 2.0, 3)
    np.testing.assert_allclose(wide.powers([4.0, 6.0, 7.0]), [[1, -1, 1], [1, 0, 0], [1, 0.5, 0.25]])


def test_every_term_is_a_parameter_of_the_effect():
    declared = {p.name for p in effect_class("residual_torque").parameters}
    assert {name_of(*key) for key in keys(dict.fromkeys(PAIRS, 3))} == declared - {"middle_speed", "speed_span"}


@pytest.mark.parametrize("pair", PAIRS)
def test_the_usual_size_of_a_coefficient_is_one_sd_of_its_constant(pair):
    usual = next(p.typical[1] for p in effect_class("residual_torque").parameters if p.name == name_of(pair, 0))
    assert unknown(pair, 0).scale == pytest.approx(usual)


# ------------------------------------------------------------------ amplitude, generator, counts


def test_dry_friction_makes_the_damping_fall_with_the_amplitude():
    """4 T / (pi A) of Den Hartog (1931): T = 0.2 N m beside 0.5 N m s/rad."""
    rng = np.random.default_rng(1)
    rate = np.geomspace(0.2, 2.0, 20)
    sd = np.full(20, 0.05)
    found = _regressed(rate, 0.5 + 4 * 0.2 / (np.pi * rate) + sd * rng.standard_normal(20), sd)
    assert found.dry[0] == pytest.approx(0.2, abs=3 * found.dry[1])
    assert found.viscous[0] == pytest.approx(0.5, abs=3 * found.viscous[1])
    assert (found.falls, found.rises) == (True, False)
    plain = _regressed(rate, 0.5 + sd * rng.standard_normal(20), sd)
    assert (plain.falls, plain.rises) == (False, False)
    assert _regressed(rate, 0.5 - 4 * 0.2 / (np.pi * rate), sd).rises
    assert _regressed(np.linspace(1.0, 1.5, 20), sd, sd) is None  # too alike
    assert _regressed(rate[:5], sd[:5], sd[:5]) is None


def test_the_generator_knows_the_weave_of_the_benchmark():
    """Meijaard et al. (2007), Proc. R. Soc. A 463, section 5: weave becomes stable at 4.292 m/s."""
    machine = build(load_bicycle("benchmark").values, {})
    assert weave_speed(machine) == pytest.approx(4.29238253634111, abs=2e-6)
    assert weave_speed(machine, offset=0.5) == pytest.approx(3.79238253634111, abs=2e-6)


def test_what_is_held_out_changes_nothing_of_a_case(tmp_path):
    for name, held_out in (("with", 4), ("none", 0)):
        rng = np.random.default_rng(3)
        truth = modal_case(tmp_path / name, hidden=("steer_spring",), rng=rng, bicycle="browser", held_out=held_out)
        assert (truth.weave is None) == (held_out == 0) or truth.weave is None
    for file in ("MEASUREMENT.toml", "modes.csv"):
        assert (tmp_path / "with" / file).read_text() == (tmp_path / "none" / file).read_text()
    assert not (tmp_path / "none" / HELD_OUT).exists()
    kept = (tmp_path / "with" / HELD_OUT / "modes.csv").read_text().splitlines()[1:]
    measured = (tmp_path / "with" / "modes.csv").read_text().splitlines()[1:]
    speeds = [{row.split(",")[0] for row in rows} for rows in (kept, measured)]
    assert kept
    assert not speeds[0] & speeds[1]


def row(corrected, true, outcome, **more):
    intervals = [[4.0, 5.5], [9.0, None]]
    return {
        "error": None, "left_open": True, "fitted": True,
        "gaps": {"stated": 4.0, "adjusted": 2.0, "corrected": corrected},
        "weave": {"true": true, "intervals": intervals, "outcome": outcome}, "speeds": [3.0, 8.0],
    } | more  # fmt: skip


def test_cases_are_counted_as_they_are():
    rows = [
        row(1.0, 5.0, "inside"), row(0.0, 7.0, "outside"), row(2.0, 2.0, "not_looked_for"), row(3.0, None, None),
        row(1.0, 4.0, "inside", left_open=False), row(1.0, 4.0, "no_corrected_model", fitted=False, speeds=None),
        row(1.0, 4.0, "inside", error="x"), row(2.0, 9.5, "inside_one_limit"), row(2.0, 6.0, "withheld"),
        row(2.0, 6.0, "not_told"),
    ]  # fmt: skip
    found = summary(rows)
    assert (found["cases"], found["errors"], found["left_open"], found["fitted"]) == (10, 1, 8, 7)
    assert found["held_out_gap_left"]["median"] == pytest.approx(0.5)
    assert found["held_out_gap_left"]["at_most_a_quarter"] == 2
    assert found["against_parameters_only"]["median"] == pytest.approx(1.0)
    inside = found["weave_inside_95"]
    assert (inside["hits"], inside["of"], inside["hits_with_one_limit"], inside["nothing_claimed"]) == (2, 3, 1, 4)
    assert inside["why"] == {"no_corrected_model": 1, "withheld": 1, "not_looked_for": 1, "not_told": 1}
    assert inside["median_width_m_s"] == pytest.approx(1.5)
    near = found["weave_inside_95_within_measured_speeds"]
    assert (near["hits"], near["of"], near["nothing_claimed"]) == (1, 2, 2)
    assert summary([])["held_out_gap_left"] == {"of": 0}
    assert list(itertools.islice(found, 2)) == ["cases", "errors"]
