"""From a synthetic campaign (the rig simulator) to the sd of critical speeds: what was measured together stays so.

Expected values come from the campaign's own conditions, its calibration, and differences of models built by hand.
"""

import json
from itertools import product

import numpy as np
import pytest
import tomli_w
import xarray as xr

from bicycle import Model, effect_class, load_bicycle
from bicycle.model import build_model
from bicycle.parameters import UNITS, ParameterCovariance
from bicycle.stability import critical_speed_estimates, critical_speeds
from studies.cli import main
from studies.main_study import given_case, settings_of
from studies.uncertainty import Uncertainty
from tyre.fits import FitSettings, fit_campaign, measured_tables, write_tables
from tyre.ground import InputError
from tyre.maps import TyreMap, read_table
from tyre.measured import Calibration
from tyre.rig import CampaignPlan, default_effects, write_campaign_files

LOADS = (460.0, 410.0)  # of rear and front wheel, both measured
BAR = 4.0
BICYCLE = "pista_charlie_drops"
CALIBRATION = Calibration(force=0.008, slip=0.004, displacement=0.003)
PLAN = CampaignPlan(
    loads=tuple(sorted(LOADS)), pressures=(BAR * 1e5, 6e5), rates=(float(np.deg2rad(2.0)),), sweeps=2, pulls=2, steps=1
)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    place = tmp_path_factory.mktemp("rig")
    rng = np.random.default_rng(3)
    write_campaign_files(place, plan=PLAN, effects=default_effects(rng), rng=rng, seed=3)
    return fit_campaign(place, settings=FitSettings(CALIBRATION), jobs=1, progress=False)


@pytest.fixture(scope="module")
def file(campaign, tmp_path_factory):
    paths, remarks = write_tables(campaign, tmp_path_factory.mktemp("out"), wheel_radius=0.34)
    assert not remarks
    return next(path for path in paths if path.suffix == ".csv")


def bicycle():
    """A packaged bicycle with its rider moved so that the wheels stand at LOADS; nobody states its uncertainty."""
    one = load_bicycle(BICYCLE)
    masses, places = ("mR", "mH", "mF"), (0.0, one["xH"], one["w"])
    mass = sum(LOADS) / one["g"] - sum(one[m] for m in masses)
    moment = LOADS[1] * one["w"] / one["g"] - sum(one[m] * x for m, x in zip(masses, places, strict=True))
    return {key: one[key] for key in UNITS} | {"mB": mass, "xB": moment / mass}


def content(file, **effects):
    law = {"tyre": file.as_posix(), "pressure_bar": BAR}
    return {"bicycle": bicycle(), "effects": {"relaxation_length": law, **effects}}


def wobble(c, k, **others):
    """First speed of unstable wobble for C and K of rear and front wheel."""
    law = effect_class("relaxation_length")(
        cornering_stiffness={"rear": c[0], "front": c[1]}, relaxation_length={"rear": c[0] / k[0], "front": c[1] / k[1]}
    )
    whole = load_bicycle(BICYCLE).replace(**bicycle())
    linear = Model(whole, (law, *others.values())).linear_model()
    return next(x.speed for x in critical_speeds(linear) if x.mode == "wobble" and x.direction == "destabilising")


def wobble_of(model):
    """Onset of wobble of a ``model`` with its sd."""
    (critical,) = [one for one in critical_speeds(model.linear_model()) if one.mode == "wobble"][:1]
    return critical


def on_the_bicycle(campaign):
    found = {(c.load, c.pressure): c for c in campaign.conditions}
    return [found[load, BAR * 1e5] for load in LOADS]


def by_hand(campaign):
    """Covariance (4, 4) of C rear, C front, K rear, K front: each wheel's own, and the calibration between them."""
    rear, front = on_the_bicycle(campaign)
    spread = np.zeros((4, 4))
    for at, one in ((0, rear), (1, front)):
        spread[np.ix_([at, at + 2], [at, at + 2])] = one.covariance[:2, :2]
    c, k = ([o.cornering_stiffness.value for o in (rear, front)], [o.lateral_stiffness.value for o in (rear, front)])
    force, slip, gauge = CALIBRATION.force**2, CALIBRATION.slip**2, CALIBRATION.displacement**2
    spread[0, 1] = spread[1, 0] = c[0] * c[1] * (force + slip)
    spread[2, 3] = spread[3, 2] = k[0] * k[1] * (force + gauge)
    for at, other in ((0, 1), (1, 0)):
        spread[at, 2 + other] = spread[2 + other, at] = c[at] * k[other] * force
    return np.array(c), np.array(k), spread


def gradient_by_hand(campaign):
    c, k, _ = by_hand(campaign)
    mean = np.concatenate([c, k])
    slopes = []
    for step in 1e-4 * np.diag(mean):
        ends = [wobble((mean + s * step)[:2], (mean + s * step)[2:]) for s in (1, -1)]
        slopes.append((ends[0] - ends[1]) / (2 * step.sum()))
    return np.array(slopes)


def test_the_map_has_the_campaigns_own_covariance(campaign, file):
    tyre = TyreMap.from_file(file)
    for one in campaign.conditions:
        at = tyre.at(load=one.load, pressure=one.pressure)
        assert at.origin == "measured"
        np.testing.assert_allclose(at.covariance, one.covariance, rtol=1e-9)
        assert at.relaxation_length_sd == pytest.approx(one.relaxation_length.sd, rel=1e-9)
        # independent standard deviations of C and K would make it wider by the load cell, twice
        apart = np.hypot(at.cornering_stiffness_sd / at.cornering_stiffness,
                         at.lateral_stiffness_sd / at.lateral_stiffness)  # fmt: skip
        relative = at.relaxation_length_sd / at.relaxation_length
        assert apart**2 - relative**2 == pytest.approx(2 * CALIBRATION.force**2, rel=1e-9)
        estimates = (one.cornering_stiffness, one.lateral_stiffness, one.relaxation_length)
        np.testing.assert_allclose(at.degrees_of_freedom, [e.dof for e in estimates], rtol=1e-9)
        assert at.pneumatic_trail == pytest.approx(one.pneumatic_trail.value, rel=1e-12)
        assert at.pneumatic_trail_sd == pytest.approx(one.pneumatic_trail.sd, rel=1e-9)
        step = at.direct_relaxation_lengths["slip step"]
        assert (step.value, step.sd) == pytest.approx((one.direct["slip step"].value, one.direct["slip step"].sd))
        assert step.dof == pytest.approx(one.direct["slip step"].dof)


def test_conditions_stay_correlated(campaign, file):
    tyre = TyreMap.from_file(file)
    conditions = campaign.conditions
    properties, covariance = tyre.joint([(one.load, one.pressure) for one in conditions])
    sd = [CALIBRATION.force, CALIBRATION.slip, CALIBRATION.displacement]
    gains = np.array([[1, -1, 0], [1, 0, -1], [0, -1, 1]]) * sd
    common = gains @ gains.T  # of C, K, C/K, relative: the load cell cancels in the last
    for (i, one), (j, other) in product(enumerate(properties), repeat=2):
        if i != j:
            values = [np.array([p.cornering_stiffness, p.lateral_stiffness, p.relaxation_length]) for p in (one, other)]
            block = covariance[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
            np.testing.assert_allclose(block, common * np.outer(*values), rtol=1e-9, atol=1e-12)


def test_reading_what_was_written_gives_the_same_table(campaign, file):
    (written,), _ = measured_tables(campaign)
    table = read_table(file)
    assert table.synthetic
    assert table.calibration == written.calibration
    for name in ("stiffness_correlation", "cornering_stiffness_dof", "lateral_stiffness_dof"):
        np.testing.assert_allclose(getattr(table, name), getattr(written, name), rtol=1e-12)
    columns = [(t.pneumatic_trail, t.direct_relaxation_length["slip step"]) for t in (table, written)]
    for one, other in zip(*columns, strict=True):
        np.testing.assert_allclose([one.value, one.sd, one.dof], [other.value, other.sd, other.dof], rtol=1e-12)


def test_the_critical_speed_knows_the_covariance(campaign, file):
    c, k, spread = by_hand(campaign)
    slopes = gradient_by_hand(campaign)
    expected = float(np.sqrt(slopes @ spread @ slopes))
    independent = float(np.sqrt(slopes**2 @ np.diag(spread)))
    assert abs(expected / independent - 1) > 0.05  # else this test could not tell

    model = build_model(content(file))
    critical = wobble_of(model)
    assert critical.speed == pytest.approx(wobble(c, k), rel=1e-9)
    (estimate,) = critical_speed_estimates(model, [critical])
    assert estimate.sd == pytest.approx(expected, rel=1e-5)
    assert dict(model.sd) == model.covariance.sd

    found = {q.name: q for q in Uncertainty(content(file)).quantities([], samples=4000)}["wobble unstable above"]
    assert found.linear_sd == pytest.approx(expected, rel=1e-5)
    assert found.sampled_sd == pytest.approx(expected, rel=0.06)

    uncertain = Uncertainty(content(file))
    values = uncertain.points(uncertain.matched_draw(4000, 1)).values
    drawn = np.cov([values[name] for name in model.covariance.names])
    scale = np.sqrt(np.outer(*[np.diag(model.covariance.matrix)] * 2))
    np.testing.assert_allclose(drawn / scale, model.covariance.matrix / scale, atol=0.01)  # lognormal, nearly normal

    case = given_case(content(file)["effects"]["relaxation_length"], load_bicycle(BICYCLE).replace(**bicycle()))
    to_contact = np.zeros((4, 4))  # from C rear, C front, K rear, K front to C and C/K of each wheel
    for at in (0, 1):
        to_contact[2 * at, at] = 1
        to_contact[2 * at + 1, [at, at + 2]] = 1 / k[at], -c[at] / k[at] ** 2
    np.testing.assert_allclose(case.covariance, to_contact @ spread @ to_contact.T, rtol=1e-6)


def test_the_critical_speed_knows_its_degrees_of_freedom(campaign, file):
    c, k, spread = by_hand(campaign)
    slopes = gradient_by_hand(campaign)
    own = np.diag(spread) / np.concatenate([c, k]) ** 2
    common_c, common_k = (CALIBRATION.force**2 + other**2 for other in (CALIBRATION.slip, CALIBRATION.displacement))
    scatter = (own - [common_c, common_c, common_k, common_k]) * np.concatenate([c, k]) ** 2 * slopes**2
    pooled = campaign.sweep_repeatability.dof, campaign.pull_repeatability.dof
    spent = scatter[:2].sum() ** 2 / pooled[0] + scatter[2:].sum() ** 2 / pooled[1]
    model = build_model(content(file))
    critical = wobble_of(model)
    (estimate,) = critical_speed_estimates(model, [critical])
    assert estimate.dof == pytest.approx((slopes @ spread @ slopes) ** 2 / spent, rel=1e-4)
    (wider,) = critical_speed_estimates(model, [critical], assume=True)  # what is assumed counts as known well
    assert wider.sd > estimate.sd
    assert wider.dof > estimate.dof
    (alone,) = critical_speed_estimates(model, [critical], dict.fromkeys(model.covariance.names, 0.0) | {"c": 0.001})
    assert alone.dof == np.inf


def test_the_measured_trail_is_offered_to_its_effect(campaign, file):
    without = build_model(content(file))
    assert any('[effects.pneumatic_trail] with trail = "tyre" takes it' in note for note in without.notes)
    model = build_model(content(file, pneumatic_trail={"trail": "tyre"}))
    for wheel, one in zip(("rear", "front"), on_the_bicycle(campaign), strict=True):
        key = f"pneumatic_trail.trail.{wheel}"
        assert model.parameters[key] == pytest.approx(one.pneumatic_trail.value)
        assert model.sd[key] == pytest.approx(one.pneumatic_trail.sd)
    assert not any("trail" in note for note in model.notes)
    given = build_model(content(file, pneumatic_trail={"trail": 0.01}))
    assert given.parameters["pneumatic_trail.trail.front"] == 0.01
    assert not any("trail" in note for note in given.notes)

    c, k, _ = by_hand(campaign)
    trail = [one.pneumatic_trail for one in on_the_bicycle(campaign)]
    steps = 1e-5 * np.eye(2)

    def at(away):
        values = {w: t.value + d for w, t, d in zip(("rear", "front"), trail, away, strict=True)}
        return wobble(c, k, trail=effect_class("pneumatic_trail")(trail=values))

    by_trail = sum(((at(h) - at(-h)) / 2e-5 * t.sd) ** 2 for h, t in zip(steps, trail, strict=True))
    uncertain = Uncertainty(content(file, pneumatic_trail={"trail": "tyre"}))
    found = {q.name: q for q in uncertain.quantities([], samples=50)}["wobble unstable above"]
    share = found.shares["pneumatic_trail.trail.rear, pneumatic_trail.trail.front"]
    assert share * found.linear_sd**2 == pytest.approx(by_trail, rel=1e-4)


def test_the_main_study_takes_the_measured_trail_into_every_world(campaign, file, tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(tomli_w.dumps(content(file, pneumatic_trail={"trail": "tyre"})))
    trail = settings_of(str(path)).further["pneumatic_trail"]["trail"]
    measured = [one.pneumatic_trail.value for one in on_the_bicycle(campaign)]
    assert [trail["rear"], trail["front"]] == pytest.approx(measured)


def test_commands_take_the_fitted_table_and_say_that_it_is_synthetic(campaign, file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text(tomli_w.dumps(content(file)))
    main(["critical", "model.toml", "--json", "critical.json"])
    shown = capsys.readouterr()
    assert "synthetic" in shown.out + shown.err
    found = json.loads((tmp_path / "critical.json").read_text())["critical_speeds"]
    assert {"weave", "capsize"} <= {one["mode"] for one in found}
    (tmp_path / "s.toml").write_text(
        'model = "model.toml"\noutputs = ["parameters"]\n[grid]\nload_N = [410.0, 460.0]\n'
    )
    main(["sweep", "s.toml", "--out", "r.zarr"])
    with xr.open_zarr("r.zarr", consolidated=False) as opened:  # at loads that were measured the fit itself comes back
        stiffness = opened.parameters.sel(parameter="relaxation_length.cornering_stiffness.front").values
    fitted = [one.cornering_stiffness.value for one in on_the_bicycle(campaign)]
    assert stiffness == pytest.approx(fitted[::-1], rel=1e-9)


def test_covariances_of_parameters_are_put_together():
    one = ParameterCovariance(("a", "b"), np.array([[4.0, 1.0], [1.0, 9.0]]), (np.diag([1.0, 2.0]),))
    two = ParameterCovariance(("c",), np.array([[16.0]]))
    whole = one.and_also(two)
    assert whole.sd == {"a": 2.0, "b": 3.0, "c": 4.0}
    np.testing.assert_array_equal(whole.among(["c", "x", "b", "a"]),
                                  [[16, 0, 0, 0], [0, 0, 0, 0], [0, 0, 9, 1], [0, 0, 1, 4]])  # fmt: skip
    # variance of a + b is 15, of which 1 and 2 were each known with one degree of freedom, together as one
    assert whole.degrees_of_freedom(["a", "b"], [1.0, 1.0], whole.among(["a", "b"])) == pytest.approx(15**2 / 3**2)
    assert whole == one.and_also(two)
    assert hash(whole) == hash(one.and_also(two))
    assert whole != one
    with pytest.raises(InputError, match=r"covariance of a, b has the shape \(1, 1\); it must be 2 x 2"):
        ParameterCovariance(("a", "b"), np.ones((1, 1)))
    with pytest.raises(InputError, match="covariance of a, c, a: a parameter is given twice; keep one"):
        ParameterCovariance(("a", "c", "a"), np.eye(3))
