"""Uncertainty propagation: linear against finite differences and Monte Carlo, samples against models built by hand."""

import json

import numpy as np
import pytest
import tomli_w

from bicycle import Model, effect_class, load_bicycle
from bicycle.model import ModelFamily, build_model, eigen
from bicycle.stability import critical_speeds, propagation
from studies.cli import main
from studies.uncertainty import Quantity, Uncertainty, remarks, total_effects
from tests.shared.refusals import refuses
from tyre import TyreMap
from tyre.ground import InputError

MEASURED = {"bicycle": "benchmark", "effects": {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 4.0}}}
GIVEN = {
    "bicycle": "benchmark",
    "effects": {"relaxation_length": {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}},
}


def built(stiffness, length, **bicycle):
    """The benchmark bicycle on tyres of C (rear, front) and relaxation length (rear, front)."""
    tyre = effect_class("relaxation_length")(
        cornering_stiffness=dict(zip(("rear", "front"), map(float, stiffness), strict=True)),
        relaxation_length=dict(zip(("rear", "front"), map(float, length), strict=True)),
    )
    return Model(load_bicycle("benchmark").replace(**bicycle), (tyre,)).linear_model()


def lognormal(mean, sd, z):
    """Positive, with this mean and standard deviation: the log-variance is ln(1 + (sd / mean)^2)."""
    square = np.log(1 + (sd / mean) ** 2)
    return mean * np.exp(np.sqrt(square) * z - square / 2)


def hinged(damping):
    """The benchmark with a flexible front of this damping (N m s/rad)."""
    hinge = {"stiffness": 3000.0, "damping": float(damping), "joint_x": 0.8, "joint_z": -0.85}
    tyre = {"cornering_stiffness": 6302.5, "relaxation_length": 0.06}
    return {"bicycle": "benchmark", "effects": {"relaxation_length": tyre, "front_compliance": hinge}}


def first(model, mode, direction="destabilising"):
    return next(c.speed for c in critical_speeds(model) if (c.mode, c.direction) == (mode, direction))


def test_gradients_of_frequency_and_damping_are_those_of_the_formulas():
    """A damped oscillator with f = 2 Hz and ratio 0.1, its parameters moved by hand."""
    ratio, natural = 0.1, 4 * np.pi / np.sqrt(1 - 0.01)

    def root(r, w):
        return complex(-r * w, w * np.sqrt(1 - r * r))

    h = 1e-6
    slopes = np.array([
        (root(ratio + h, natural) - root(ratio - h, natural)) / (2 * h),
        (root(ratio, natural + h) - root(ratio, natural - h)) / (2 * h),
    ])  # fmt: skip
    here = root(ratio, natural)
    np.testing.assert_allclose(propagation.damping_ratio_gradient(here, slopes), [1, 0], atol=1e-8)
    np.testing.assert_allclose(eigen.frequency_hz(slopes), [-natural * ratio / np.sqrt(0.99) / (2 * np.pi),
                                                            np.sqrt(0.99) / (2 * np.pi)], rtol=1e-7)  # fmt: skip
    assert propagation.standard_deviation([3.0, 4.0], [[1.0, 0.5], [0.5, 4.0]]) == pytest.approx(np.sqrt(9 + 12 + 64))


def test_linear_sd_of_measured_tyres_is_that_of_finite_differences():
    """Gradients in C and K by central differences of models built by hand, covariance from the map itself."""
    loads = load_bicycle("benchmark").static_loads
    measured = TyreMap.load("Tyre1", relative_cornering_stiffness_sd=0.03)
    (rear, front), covariance = measured.joint([(load, 4e5) for load in loads])
    mean = np.array([x for one in (rear, front) for x in (one.cornering_stiffness, one.lateral_stiffness)])

    def wobble(x):
        return first(built(x[[0, 2]], x[[0, 2]] / x[[1, 3]]), "wobble")

    steps = 1e-4 * np.diag(mean)
    gradient = [(wobble(mean + h) - wobble(mean - h)) / (2 * h.sum()) for h in steps]
    used = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])
    expected = float(np.sqrt(gradient @ covariance[used] @ gradient))
    uncertainty = Uncertainty(MEASURED, relative_cornering_stiffness_sd=0.03)
    found = {q.name: q for q in uncertainty.quantities([], samples=4000)}["wobble unstable above"]
    assert found.value == pytest.approx(wobble(mean), rel=1e-9)
    assert found.linear_sd == pytest.approx(expected, rel=1e-5)
    assert found.sampled_sd == pytest.approx(expected, rel=0.05)
    assert found.lost == 0
    assert set(found.shares) == {"tyre cornering stiffness", "tyre lateral stiffness"}
    assert sum(found.shares.values()) == pytest.approx(1)


def test_sd_of_modes_and_critical_speeds_from_a_covariance_of_parameters():
    """The four contact numbers of the main study: finite differences of models built by hand."""
    mean = np.array([6000.0, 0.1, 5500.0, 0.09])
    names = [f"relaxation_length.{what}.{wheel}" for wheel in ("rear", "front")
             for what in ("cornering_stiffness", "relaxation_length")]  # fmt: skip
    spread = np.diag(0.03 * mean) @ (0.3 + 0.7 * np.eye(4)) @ np.diag(0.03 * mean)

    def quantities(x):
        model = built(x[[0, 2]], x[[1, 3]])
        values = model.eigenvalues(8.0)
        weave = values[np.abs(values.imag - 4.4).argmin()]
        return np.array([weave.imag / (2 * np.pi), -weave.real / abs(weave), first(model, "wobble")])

    steps = 1e-5 * np.diag(mean)
    slopes = np.array([(quantities(mean + h) - quantities(mean - h)) / (2 * h.sum()) for h in steps]).T
    expected = np.sqrt(np.diag(slopes @ spread @ slopes.T))
    tyre = effect_class("relaxation_length")(
        cornering_stiffness={"rear": 6000.0, "front": 5500.0}, relaxation_length={"rear": 0.1, "front": 0.09}
    )
    model = Model(load_bicycle("benchmark"), (tyre,))
    values = model.linear_model().eigenvalues(8.0)
    found = propagation.mode_sd(model, 8.0, values[np.abs(values.imag - 4.4).argmin()], names, spread)
    assert found == pytest.approx(expected[:2], rel=1e-5)
    crossings = [c for c in critical_speeds(model.linear_model()) if c.mode == "wobble"]
    slope = propagation.critical_speed_gradients(model, crossings, names)
    assert propagation.standard_deviation(slope, spread)[0] == pytest.approx(expected[2], rel=1e-5)
    assert propagation.critical_speed_gradients(model, [], names).shape == (0, len(names))
    refuses("unknown parameter 'tyre'", propagation.mode_sd, model, 8.0, 1j, ["tyre"], [[1.0]])
    refuses("unknown parameter 'tyre'", propagation.critical_speed_gradients, model, crossings, ["tyre"])


def test_matched_draws_have_the_moments_of_the_distribution():
    uncertainty = Uncertainty(GIVEN, sd={"c": 0.001, "mB": 2.0, "w": 0.002})
    z = uncertainty.matched_draw(50, 3)
    np.testing.assert_allclose(z.mean(0), 0, atol=1e-14)
    np.testing.assert_allclose(np.cov(z.T), np.eye(3), atol=1e-13)
    assert np.corrcoef(z[:, 0], uncertainty.draw(50, 3)[:, 0])[0, 1] > 0.95
    found = uncertainty.quantities([8.0], samples=50, only=["weave"], matched=True)
    assert {q.name.split()[0] for q in found} == {"weave"}
    assert all(q.sampled_sd == pytest.approx(q.linear_sd, rel=0.02) for q in found)
    refuses("4 samples of 3 numbers cannot be matched; take more samples", uncertainty.matched_draw, 4, 3)


def test_what_follows_another_parameter_moves_with_it():
    """A relaxation length tied to the wheelbase, by central differences of models built by hand."""

    def follow(p):
        return {f"relaxation_length.relaxation_length.{wheel}": 0.1 * p["w"] / 1.02 for wheel in ("rear", "front")}

    uncertainty = Uncertainty(GIVEN, sd={"w": 0.01}, follow=follow)
    found = {q.name: q for q in uncertainty.quantities([], samples=30)}["wobble unstable above"]
    ends = [first(built([6000, 6000], [0.1 * w / 1.02] * 2, w=w), "wobble") for w in (1.021, 1.019)]
    assert found.gradient[0] == pytest.approx((ends[0] - ends[1]) / 0.002 * 0.01, rel=1e-4)
    w = lognormal(1.02, 0.01, uncertainty.draw(30, 0)[4, 0])
    assert found.samples[4] == pytest.approx(first(built([6000, 6000], [0.1 * w / 1.02] * 2, w=w), "wobble"), rel=1e-8)


def test_samples_are_the_models_with_those_parameters():
    uncertainty = Uncertainty(GIVEN, sd={"c": 0.004, "mB": 3.0})
    found = {q.name: q for q in uncertainty.quantities([8.0], samples=40, seed=2)}
    z = uncertainty.draw(40, 2)
    trail, mass = (z[:, uncertainty.names.index(name)] for name in ("c", "mB"))
    for k in range(0, 40, 8):
        model = built([6000, 6000], [0.1, 0.1], c=0.08 + 0.004 * trail[k], mB=lognormal(85, 3, mass[k]))
        assert found["wobble unstable above"].samples[k] == pytest.approx(first(model, "wobble"), rel=1e-8)
        assert found["weave stable above"].samples[k] == pytest.approx(first(model, "weave", "stabilising"), rel=1e-8)
        values = model.eigenvalues(8.0)
        hertz = found["weave frequency at 8 m/s"].samples[k]
        assert np.abs(values.imag / (2 * np.pi) - hertz).min() < 1e-9
        ratio = found["weave damping ratio at 8 m/s"].samples[k]
        assert np.nanmin(np.abs(-values.real / np.abs(values) - ratio)) < 1e-9


def test_a_crossing_that_vanishes_is_counted_as_lost():
    """A hinge that is often damped enough to end the wobble: its onset then does not exist."""
    uncertainty = Uncertainty(hinged(15), sd={"front_compliance.damping": 3.0})
    found = {q.name: q for q in uncertainty.quantities([], samples=40)}["wobble unstable above"]
    exact = np.full(40, np.nan)
    for k, z in enumerate(uncertainty.draw(40, 0)[:, 0]):
        crossings = critical_speeds(build_model(hinged(lognormal(15, 3, z))))
        onsets = [c.speed for c in crossings if (c.mode, c.direction) == ("wobble", "destabilising") and c.speed < 14]
        exact[k] = onsets[0] if onsets else np.nan
    assert 0 < found.lost < 40
    np.testing.assert_allclose(found.samples, exact, rtol=1e-8)
    pytest.importorskip("SALib")
    words = r"wobble unstable above is missing up to 60 m/s for \d+ of \d+ bicycles, so its variance is not defined"
    refuses(words, total_effects, uncertainty, "wobble unstable above", base=16)


def test_critical_speeds_that_only_some_samples_have_are_counted():
    """At its means this bicycle does not wobble; with a hinge of less damping it does."""
    uncertainty = Uncertainty(hinged(21), sd={"front_compliance.damping": 3.0})
    found = uncertainty.quantities([], samples=60, seed=4)
    assert not any(q.name.startswith("wobble") for q in found)
    drawn = [build_model(hinged(lognormal(21, 3, z))) for z in uncertainty.draw(60, 4)[:, 0]]
    exact = sum(any(c.mode == "wobble" for c in critical_speeds(model)) for model in drawn)
    assert exact > 0
    assert uncertainty.count_unlisted(found, samples=60, seed=4) == exact
    told = remarks(found, exact, 60, 60.0)
    assert len(told) == 1
    assert told[0].startswith(f"at least {exact} of 60 samples have further critical speeds up to 60 m/s")


def test_remarks_name_quantities_for_which_the_linear_sd_fails():
    def told(samples, unit="m/s", count=2000):
        quantity = Quantity("x", unit, 1.0, np.array([1.0]), {}, np.asarray(samples, float))
        return remarks([quantity], 0, count, 60.0)

    draws = np.random.default_rng(0).standard_normal(2000)
    assert told(draws) == told(1.5 * draws[:10]) == ()  # so few samples show nothing
    (found,) = told(2 * draws)
    assert f"standard uncertainty {2 * draws.std(ddof=1):.3g} m/s by Monte Carlo, 1 m/s linear" in found
    (ratio,) = told(2 * draws, "1")  # a number without unit
    assert f"standard uncertainty {2 * draws.std(ddof=1):.3g} by Monte Carlo, 1 linear" in ratio
    lost = np.where(draws > 1, np.nan, draws)
    for unit in ("m/s", "Hz"):
        assert f"{np.isnan(lost).sum()} of 2000 samples" in told(lost, unit)[0]
    assert told(draws[:39], count=39)[-1].startswith("39 samples are too few")


def test_draws_that_make_no_bicycle_are_left_out_and_counted(monkeypatch):
    """A product of inertia free in sign, between the positive moments of inertia: IBxx IBzz >= IBxz^2 by hand."""
    uncertainty = Uncertainty(GIVEN, sd={"IBxz": 1.2, "IBzz": 1.4})
    z = dict(zip(uncertainty.names, uncertainty.draw(400, 0).T, strict=True))
    inertia = load_bicycle("benchmark")
    beyond = inertia["IBxx"] * lognormal(inertia["IBzz"], 1.4, z["IBzz"]) < (inertia["IBxz"] + 1.2 * z["IBxz"]) ** 2
    assert 0 < beyond.sum() < 400
    assert uncertainty.left_out(samples=400) == {"IBxx IBzz < IBxz^2": beyond.sum()}
    found = uncertainty.quantities([6.0], samples=400)
    assert {len(q.samples) for q in found} == {400 - beyond.sum()}
    monkeypatch.setattr(ModelFamily, "without_mass", lambda self, numbers, count: np.arange(count) == 3)
    assert Uncertainty(GIVEN, sd={"c": 0.001}).left_out(samples=9) == {"the mass matrix is not positive definite": 1}


def test_an_honest_deviation_of_a_stiffness_is_no_reason_to_lose_the_study():
    """Sd of 100 %: nominal bicycle and linear sd are those of the stated mean and sd, the draws stay positive."""
    content = {"bicycle": "benchmark", "effects": hinged(15)["effects"] | MEASURED["effects"]}
    uncertainty = Uncertainty(content, relative_cornering_stiffness_sd=1.0, sd={"front_compliance.stiffness": 3000.0})
    assert uncertainty.nominal.parameters["front_compliance.stiffness"] == pytest.approx(3000.0, rel=1e-12)
    names, covariance = uncertainty.covariance()
    at = names.index("front_compliance.stiffness")
    assert np.sqrt(covariance[at, at]) == pytest.approx(3000.0, rel=1e-6)
    values = uncertainty.points(uncertainty.draw(2000, 0)).values
    contact = (f"relaxation_length.cornering_stiffness.{wheel}" for wheel in ("rear", "front"))
    for key in ("front_compliance.stiffness", *contact):
        assert values[key].min() > 0
    found = uncertainty.quantities([6.0], samples=60)
    assert all(len(q.kept) > 50 for q in found if q.name.split()[0] in ("weave", "capsize"))
    frequency, damping = ({q.name.split()[0]: q.lost for q in found if f" {what} at" in q.name}
                          for what in ("frequency", "damping ratio"))  # fmt: skip
    assert frequency == damping  # a root that is real or confused has neither
    assert sum(frequency.values()) > 0
    assert sum(uncertainty.left_out(samples=60).values()) == 0


def test_variance_shares_of_a_nearly_linear_case_are_the_linear_ones():
    pytest.importorskip("SALib")
    sd = {"c": 0.001, "relaxation_length.relaxation_length.front": 0.002, "IFxx": 0.0001}
    uncertainty = Uncertainty(GIVEN, sd=sd)
    effects = total_effects(uncertainty, "wobble unstable above", base=256)
    linear = {q.name: q for q in uncertainty.quantities([], samples=2)}["wobble unstable above"].shares
    for name, (one, total, width) in effects.items():
        assert one == pytest.approx(linear[name], abs=0.08)
        assert total == pytest.approx(linear[name], abs=max(0.02, 2 * width))


@pytest.mark.parametrize(("model", "options", "words"), [
    (GIVEN, {}, "nothing is uncertain: the bicycle states no sd and the model has no measured tyre"),
    ({"bicycle": dict(load_bicycle("benchmark").values) | {"w": "1.02+/-0"}}, {},
     "nothing is uncertain: the bicycle states an sd of 0 and the model has no measured tyre"),
    (GIVEN, {"sd": {"mb": 1.0}}, "unknown parameter 'mb'; did you mean 'mB'"),
    (GIVEN, {"relative_cornering_stiffness_sd": 0.1}, "needs a measured tyre in the model file"),
])  # fmt: skip
def test_refusals(model, options, words):
    refuses(words, Uncertainty, model, **options)


def test_salib_missing(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "SALib.analyze", None)
    with pytest.raises(InputError, match=r"SALib is not installed; install it with: pip install .*\[sensitivity\]"):
        total_effects(Uncertainty(GIVEN, sd={"c": 0.001}), "x")


def test_command(tmp_path, refused, printed):
    file = tmp_path / "model.toml"
    file.write_text(tomli_w.dumps(MEASURED), encoding="utf-8")
    arguments = ["uncertainty", str(file), "--speeds", "6", "--samples", "50"]
    arguments += ["--relative-cornering-stiffness-sd", "0.03"]
    found = json.loads(printed(*arguments, "--sd", "c=0.002", "--json", "-"))["quantities"]
    assert {"weave frequency at 6 m/s", "wobble unstable above"} <= {q["quantity"] for q in found}
    assert all(q["linear_sd"] > 0 for q in found)
    pytest.importorskip("SALib")
    shown = printed(*arguments[:2], "--sd", "c=0.002", "--samples", "50", "--narrow", "capsize unstable above")
    assert "measurements that reduce the variance of 'capsize unstable above'" in shown
    for wrong, words in (
        (["c"], "--sd c: give NAME=VALUE"),
        (["c=1", "c=2"], "--sd c is given twice; keep one"),
        (["c=-1"], "--sd c=-1: the standard deviation must be finite and >= 0"),
        (["c=nan"], "--sd c=nan: give NAME=VALUE"),
    ):
        assert words in refused(*arguments, *(text for one in wrong for text in ("--sd", one)))


def test_command_shows_the_table_and_its_notes(tmp_path, capsys, printed):
    file = tmp_path / "model.toml"
    file.write_text(tomli_w.dumps(hinged(15)), encoding="utf-8")
    arguments = ["uncertainty", str(file), "--sd", "front_compliance.damping=3", "--samples", "40"]
    shown = printed(*arguments, "--stated-only", "--json", str(tmp_path / "found.json"))
    found = json.loads((tmp_path / "found.json").read_text())
    wobble = next(q for q in found["quantities"] if q["quantity"] == "wobble unstable above")
    assert 0 < wobble["lost"] < 40
    assert not wobble["linear_holds"]
    assert f"note: wobble unstable above: absent below 60 m/s in {wobble['lost']} of 40 samples; Monte" in shown
    assert (found["samples"], found["seed"], found["max_speed_m_s"]) == (40, 0, 60.0)
    assert found["samples_with_further_critical_speeds"] == 0
    pytest.importorskip("SALib")
    with pytest.raises(SystemExit, match="2"):
        main([*arguments, "--stated-only", "--narrow", "wobble unstable above"])
    both = capsys.readouterr()
    assert "wobble unstable above" in both.out  # the table is not lost
    assert "so its variance is not defined" in both.err


def test_command_says_what_is_odd_of_the_bicycle_and_shows_no_nan(capsys):
    main(["uncertainty", "browser", "--samples", "2", "--seed", "2", "--stated-only", "--sd", "c=0.5"])
    both = capsys.readouterr()
    assert "violate the triangle inequality" in both.err
    assert "no Monte Carlo values" in both.out
    assert "nan" not in both.out
