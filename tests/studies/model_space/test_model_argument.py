"""What commands take for a model: packaged bicycles, bicycle files, model files, tyres from the command line."""

import json
import tomllib

import pytest

from bicycle import available_bicycles, load_bicycle
from bicycle.files import to_text, to_toml, to_yaml
from bicycle.model import build_model, read_model
from studies.cli import main
from studies.model_space import choose
from tyre import TyreMap
from tyre.ground import InputError


def critical(capsys, *arguments: str) -> list:
    main(["critical", *arguments, "--json", "-"])
    return json.loads(capsys.readouterr().out)["critical_speeds"]


@pytest.mark.parametrize("name", available_bicycles())
def test_a_bare_bicycle_is_the_whipple_model_and_said_to_be(name):
    chosen = choose(name)
    assert chosen.model == build_model({"bicycle": name})
    assert chosen.remark.startswith(f"{name}: wheels without slip (Whipple model); ")
    assert "\n" not in chosen.remark


@pytest.mark.parametrize(("law", "without_slip"), [
    ("", True), ("[effects.no_slip]\n", False), ('[effects.side_slip]\ntyre = "Tyre1"\npressure_bar = 5\n', False),
])  # fmt: skip
def test_a_flexible_front_frame_without_a_tyre_is_said_to_be_without_slip(law, without_slip, tmp_path):
    file = tmp_path / "front.toml"
    front = "[effects.front_compliance]\njoint_x = 0.9\njoint_z = -0.65\n"
    file.write_text(f'bicycle = "benchmark"\n{front}{law}')
    assert ("wheels without slip (Whipple model); add measured tyres" in choose(str(file)).remark) == without_slip
    if without_slip:
        assert not choose(str(file), tyre="Tyre1", pressure="5").remark


@pytest.mark.parametrize("ending", [".toml", ".yml", ".txt"])
def test_a_bicycle_file_is_taken_too(ending, tmp_path, capsys):
    fisher = load_bicycle("fisher")
    file = tmp_path / f"mine{ending}"
    file.write_text({".toml": to_toml, ".txt": to_text}.get(ending, to_yaml)(fisher))
    assert dict(choose(str(file)).model.bicycle.values) == dict(fisher.values)
    assert critical(capsys, str(file)) == critical(capsys, "fisher")


def test_a_model_file_keeps_its_paths_wherever_the_command_runs(tmp_path, monkeypatch):
    (tmp_path / "models").mkdir()
    (tmp_path / "fit").mkdir()
    TyreMap.load("Tyre3").to_file(tmp_path / "fit" / "three.csv")
    (tmp_path / "models" / "mine.toml").write_text(to_toml(load_bicycle("benchmark")))
    file = tmp_path / "models" / "model.toml"
    file.write_text(
        'bicycle = "mine.toml"\n[effects.relaxation_length]\ntyre = "../fit/three.csv"\npressure_bar = 5.5\n'
    )
    monkeypatch.chdir(tmp_path)
    chosen = choose("models/model.toml")
    assert chosen.model == read_model(file)
    assert chosen.remark == ""
    monkeypatch.chdir(tmp_path / "fit")
    assert build_model(chosen.content) == chosen.model


def test_a_tyre_from_the_command_line_is_that_of_a_file(tmp_path):
    asked = choose("benchmark", tyre="Tyre1", pressure="7.5,5.5", surface="drum")
    table = {"tyre": "Tyre1", "pressure_bar": {"rear": 7.5, "front": 5.5}, "surface": "drum"}
    assert asked.model == build_model({"bicycle": "benchmark", "effects": {"relaxation_length": table}})
    file = tmp_path / "model.toml"
    file.write_text('bicycle = "benchmark"\n[effects.steer_damper]\ndamping = 0.5\n')
    both = choose(str(file), tyre="Tyre3", pressure="5.5").model
    assert {effect.identifier for effect in both.effects} == {"relaxation_length", "steer_damper"}
    TyreMap.load("Tyre1", surface="drum").to_file(tmp_path / "mine.csv")
    own = choose("benchmark", tyre=str(tmp_path / "mine.csv"), pressure="7.5,5.5").model
    assert own.parameters == pytest.approx(asked.model.parameters, rel=1e-7)


@pytest.mark.parametrize(("options", "words"), [
    ({"text": "psta"}, "unknown bicycle or model 'psta'; did you mean 'pista'?.*velotyre new model.toml writes"),
    ({"text": "absent.toml"}, "absent.toml: no such model file"),
    ({"text": "absent.txt"}, "absent.txt: no such bicycle file; packaged bicycles: .*benchmark"),
    ({"text": "benchmark", "pressure": "5.5"}, "--pressure 5.5 applies to a measured tyre; give --tyre too"),
    ({"text": "benchmark", "surface": "drum"}, "--surface drum applies to a measured tyre; give --tyre too"),
    ({"text": "benchmark", "tyre": "Tyre1"}, "--tyre Tyre1 needs --pressure, in bar; it was measured at 3.5, 5.5"),
    ({"text": "benchmark", "tyre": "Tyre1", "pressure": "high"}, "'high': give one number, in bar or with its unit"),
    ({"text": "benchmark", "tyre": "Tyre1", "pressure": "1,2,3"}, "or REAR,FRONT"),
    ({"text": "benchmark", "tyre": "Tyre1", "pressure": "550"}, "pressure_bar = 550.0 of the rear wheel"),
    ({"text": "benchmark", "tyre": "Tyre9", "pressure": "5"}, "no tyre 'Tyre9' .did you mean 'Tyre"),
    ({"text": "benchmark", "extrapolate": True}, "--extrapolate applies to a measured tyre, and the model has none"),
    ({"text": "pista", "tyre": "Tyre1", "pressure": "5"}, "42.39 N is more than one range width outside the 340-490 N"),
])  # fmt: skip
def test_what_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        _ = choose(**options).model


def test_a_tyre_is_not_put_over_another(tmp_path):
    file = tmp_path / "model.toml"
    file.write_text('bicycle = "benchmark"\n[effects.side_slip]\ncornering_stiffness = 6000\n')
    with pytest.raises(InputError, match=r"has its own contact law, \[effects.side_slip\]; change the tyre there"):
        choose(str(file), tyre="Tyre1", pressure="5.5")


def test_a_mistake_in_a_model_file_names_the_file(tmp_path, refused):
    file = tmp_path / "model.toml"
    file.write_text('bicycle = "benchmark"\n[effects.side_slp]\ncornering_stiffness = 6000\n')
    assert f"{file}: unknown effect 'side_slp'; did you mean 'side_slip'?" in refused("critical", file)


def test_extrapolate_does_what_the_key_in_the_file_does(tmp_path, capsys):
    file = tmp_path / "model.toml"
    text = 'bicycle = "fisher"\n[effects.relaxation_length]\ntyre = "Tyre1"\npressure_bar = 5.5\n'
    file.write_text(text)
    flagged = critical(capsys, str(file), "--extrapolate")
    file.write_text(text + "extrapolate = true\n")
    assert critical(capsys, str(file)) == flagged
    assert critical(capsys, "fisher", "--tyre", "Tyre1", "--pressure", "5.5", "--extrapolate") == flagged
    assert tomllib.loads(file.read_text())["effects"]["relaxation_length"]["extrapolate"] is True


@pytest.mark.parametrize("arguments", [
    ["modes", "--speeds", "3,5.5"], ["critical"], ["sensitivity", "--mode", "weave", "--speed", "5.5"],
    ["uncertainty", "--speeds", "5.5", "--samples", "50"],
    ["root-locus", "--parameter", "pressure_bar", "--range", "5:6:0.5", "--speed", "6.5", "--out", "locus"],
    ["simulate", "--speed", "5.5", "--initial", "lean=0.02", "--duration", "0.2", "--out", "history"],
])  # fmt: skip
def test_every_command_takes_a_name_and_a_tyre(no_pictures, arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    name, *options = arguments
    main([name, "pista_charlie_drops", *options, "--tyre", "Tyre3", "--pressure", "5.5"])
    shown = capsys.readouterr()
    assert shown.out.strip()
    assert "Tyre3 on flat (rear 442 N, 5.5 bar, interpolated" in shown.err


def test_parameters_at_the_top_of_a_toml_file_are_a_bicycle(tmp_path):
    (tmp_path / "flat.toml").write_text("".join(f"{k} = {v!r}\n" for k, v in load_bicycle("benchmark").values.items()))
    assert choose(str(tmp_path / "flat.toml")).model.bicycle.values == load_bicycle("benchmark").values


@pytest.mark.parametrize("effects", ["5", "true", "[1]", '"x"', "2020-01-01"])
@pytest.mark.parametrize("options", [{}, {"tyre": "Tyre1", "pressure": "5.5"}, {"extrapolate": True}])
def test_effects_that_are_no_table(effects, options, tmp_path):
    (tmp_path / "m.toml").write_text(f'bicycle = "benchmark"\neffects = {effects}\n')
    with pytest.raises(InputError, match=r"m\.toml: effects = .* must be a table"):
        choose(str(tmp_path / "m.toml"), **options).model  # noqa: B018


@pytest.mark.parametrize("name", ["bike", "bike.toml"])
def test_a_file_that_is_no_toml_names_the_forms(tmp_path, name):
    (tmp_path / name).write_text('{"w": 1.02}')
    with pytest.raises(
        InputError, match=r"not a TOML file.*the file ending states the format: .toml for a model, .toml, .json"
    ):
        choose(str(tmp_path / name))
