"""``velotyre front-frame`` with published figures: what it shows and writes, and what it refuses."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import velotyre as vt
from bicycle.files import load_bicycle
from bicycle.model import read_model
from bicycle.parameters import height_above_hub
from studies.bicycles import own_bicycle
from studies.main_study import settings_of

PAIR = ("front-frame", "--head-tube", "95", "--fork", "45")


def test_the_screen_says_what_is_known_and_what_is_not(printed):
    said = printed(*PAIR)
    hinge = vt.front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=45)
    low, high = hinge.stiffness_interval
    assert f"{hinge.stiffness:.0f} N m/rad, 95 % interval {low:.0f} to {high:.0f} N m/rad" in said
    assert f"{hinge.height:.3f} ± {hinge.height_sd:.3f} m above the front hub" in said
    assert "damping            unknown: no static test measures it" in said
    assert "lateral sway       unknown" in said
    assert "computed, not measured" in said
    assert "joint_z" not in said


@pytest.mark.parametrize(
    "options",
    [
        ("--head-tube", "5443.099 N m/rad", "--fork", "45 N/mm"),
        ("--head-tube", "95N_m/deg", "--fork", "45kN/m"),
    ],
)
def test_other_units(printed, options):
    assert printed("front-frame", *options).partition("correlation")[0] == printed(*PAIR).partition("correlation")[0]


def test_ground_figures_in_other_units(printed):
    plain = printed("front-frame", "--ground-mm", "32.7", "--ground-kg", "20")
    assert printed("front-frame", "--ground-mm", "3.27 cm", "--ground-kg", "44.092452 lb") == plain


@pytest.mark.parametrize("name", ["pista_charlie_drops", "browser"])
def test_the_model_file_holds_the_hinge_with_its_covariance(printed, tmp_path, name):
    target = tmp_path / "front.toml"
    printed(*PAIR, "--bicycle", name, "--out", str(target))
    model, hinge = read_model(target), vt.front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=45)
    values = {key.rpartition(".")[2]: value for key, value in model.parameters.items() if "front_compliance" in key}
    assert values["stiffness"] == pytest.approx(hinge.stiffness, rel=1e-4)
    assert height_above_hub(model.bicycle.values, values["joint_z"]) == pytest.approx(hinge.height, abs=1e-4)
    sd = {key: model.sd[f"front_compliance.{key}"] for key in ("stiffness", "joint_x", "joint_z")}
    assert sd["stiffness"] == pytest.approx(hinge.stiffness * hinge.relative_sd, rel=1e-5)
    # the hinge moves along the steer axis
    assert math.hypot(sd["joint_x"], sd["joint_z"]) == pytest.approx(hinge.height_sd, rel=1e-5)
    assert sd["joint_x"] == pytest.approx(sd["joint_z"] * math.tan(model.bicycle["lam"]), rel=1e-5)
    names = [f"front_compliance.{key}" for key in ("stiffness", "joint_z")]
    spread = model.covariance.among(names)
    assert spread[0, 1] / np.sqrt(spread[0, 0] * spread[1, 1]) == pytest.approx(-hinge.correlation, rel=1e-4)
    assert "front_compliance.damping" not in model.sd
    text = target.read_text(encoding="utf-8")
    assert "ASSUMED: no static test measures it" in text
    target.write_text(text.replace("# damping =", "damping ="), encoding="utf-8")
    assert read_model(str(target)).parameters == model.parameters


def test_the_main_study_reads_it_and_still_assumes_the_damping(printed, tmp_path):
    target = tmp_path / "front.toml"
    printed(*PAIR, "--bicycle", "pista_charlie_drops", "--out", str(target))
    front = settings_of(str(target)).front
    assert front.from_file
    assert front.defaults == ("damping_ratio",)
    assert front.damping_ratio == 0.25


def test_the_hinge_on_paper_is_the_one_in_json(printed):
    record = json.loads(printed(*PAIR, "--bicycle", "pista", "--json", "-"))
    assert record["damping"] is None
    assert record["sway"] is None
    numbers = record["effects"]["front_compliance"]
    assert set(numbers) == {"stiffness", "joint_x", "joint_z"}
    assert height_above_hub(load_bicycle("pista").values, numbers["joint_z"]) == pytest.approx(
        record["height_above_hub"]
    )
    assert f"joint_z = {numbers['joint_z']:.3f} m" in printed(*PAIR, "--bicycle", "pista")


def test_a_wheel_outside_the_models_is_noted(printed):
    assert "Note: the front wheel has a radius of 0.350 m" in printed(*PAIR, "--bicycle", "benchmark")
    assert "Note" not in printed(*PAIR, "--bicycle", "pista")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "give published figures, --head-tube and --fork or --ground-mm and --ground-kg, or a FILE"),
        (("--fork", "45"), "the fork alone says little"),
        (("--ground-mm", "32"), "needs the weight"),
        (("--head-tube", "95", "--ground-mm", "32", "--ground-kg", "20"), "give either"),
        (("--head-tube", "9500"), "9500 N m/deg is outside 61 to 143"),
        (("--head-tube", "95kg"), "write for example N m/rad, N m/deg"),
        (("standing.toml", "--fork", "45"), "standing.toml holds the measurements; leave out --fork"),
        (("--head-tube", "95", "--out", "x.toml"), "give --bicycle"),
        (("--head-tube", "95", "--bicycle", "pista", "--out", "x.txt"), "write a .toml file"),
        (("--head-tube", "95", "--bicycle", "pista", "--out", "no/x.toml"), "there is no folder no"),
        (("--head-tube", "95", "--bicycle", "pist"), "did you mean 'pista'"),
        (("--plan", "--out", "x.toml"), "--plan prints and ends; leave out --out"),
        (("--plan", "--bicycle", "pista", "--json", "-"), "--plan prints and ends; leave out --json"),
        (("--plan", "--head-tube", "95"), "leave out --head-tube"),
        (("standing.toml", "--plan"), "leave out FILE"),
    ],
)
def test_what_is_refused(refused, options, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert words in refused("front-frame", *options)


def test_a_file_is_not_overwritten_by_chance(printed, refused, tmp_path):
    target = tmp_path / "front.toml"
    target.write_text("mine")
    command = (*PAIR, "--bicycle", "pista", "--out", str(target))
    assert "give --force" in refused(*command)
    assert target.read_text() == "mine"
    printed(*command, "--force")
    assert "front_compliance" in target.read_text()


def test_a_bicycle_with_small_wheels_is_refused():
    hinge = vt.front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=45)
    small = load_bicycle("pista").replace(rF=0.25)
    with pytest.raises(vt.InputError, match="front wheel 0.25 m; published figures"):
        hinge.effect_numbers(small)


def test_a_new_model_holds_the_front_next_to_its_measured_tyre(printed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    printed("new", "model.toml", "--bicycle", "pista_charlie_drops", "--head-tube", "95", "--fork", "45")
    printed(*PAIR, "--bicycle", "pista_charlie_drops", "--out", "alone.toml")
    model, alone = read_model("model.toml"), read_model("alone.toml")
    for key in ("front_compliance.stiffness", "front_compliance.joint_x", "front_compliance.joint_z"):
        assert model.parameters[key] == alone.parameters[key]
        assert model.sd[key] == alone.sd[key]
    assert any(key.startswith("relaxation_length") for key in model.sd)


EIGHT = (
    *("--wheelbase", "1.02", "--trail", "0.06", "--head-angle", "72.5", "--wheel", "28-622", "--mass", "9"),
    *("--rider-mass", "75", "--rider-place", "0.42,1.06", "--rider-inertia", "7.5,8,2.7,0.9"),
)


def test_a_bicycle_of_ones_own_takes_the_figures_of_a_magazine(printed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(own_bicycle, "LIMITS", replace(own_bicycle.LIMITS, draws=40, wobble_draws=40))
    shown = [printed("new", f"{name}.toml", *EIGHT, *more) for name, more in
             (("plain", ()), ("stiff", ("--head-tube", "140", "--fork", "80")),
              ("soft", ("--ground-mm", "50", "--ground-kg", "20")))]  # fmt: skip
    assert "front-frame compliance, both ASSUMED" in shown[0]
    assert "front-frame stiffness by published figures" in shown[1]
    chance = [int(text.partition("probability ")[2].partition(" %")[0]) for text in shown]
    assert chance[2] > chance[1]
    model = read_model("stiff_model.toml")
    hinge = vt.front_frame(head_tube_N_m_per_deg=140, fork_N_per_mm=80)
    assert model.parameters["front_compliance.stiffness"] == pytest.approx(hinge.stiffness, rel=1e-4)
    assert "--head-tube 140" in (tmp_path / "stiff.toml").read_text(encoding="utf-8")
    front = settings_of("stiff_model.toml").front
    assert front.defaults == ("damping_ratio",)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--kind", "sensors", "--head-tube", "95"), "--head-tube is of a model file"),
        (("--kind", "measurement", "--ground-mm", "30", "--ground-kg", "20"), "--ground-mm is of a model file"),
        (("--bicycle", "pista", "--fork", "45"), "the fork alone says little"),
        (
            ("--wheelbase", "1.5", "--trail", "0.06", "--head-angle", "72", "--wheel", "28-622", "--mass", "19",
             "--head-tube", "95"),
            "wheelbase 1.5 m; published figures are those of racing frames",
        ),
    ],
)  # fmt: skip
def test_new_refuses_figures_that_do_not_apply(refused, tmp_path, options, words):
    assert words in refused("new", str(tmp_path / "m.toml"), *options)
