"""Model files: bicycles, effects, measured tyres at the static loads, and what is refused."""

import pytest

from bicycle import load_bicycle
from bicycle.model import build_model, read_model
from studies.cli import main
from tests.shared.refusals import refuses
from tyre import TyreMap
from tyre.ground import InputError, extrapolated

TYRE = {"tyre": "Tyre1", "pressure_bar": 5.5}


def relaxed(table, bicycle="pista_charlie_drops"):
    return build_model({"bicycle": bicycle, "effects": {"relaxation_length": table}})


def test_tyre_values_come_from_the_map_at_the_static_loads():
    model = relaxed(TYRE)
    values = model.parameters
    # Dell'Orto et al., tables 2 and 6, 5.5 bar: 106.4 N/deg, 100.9 mm at 340 N and 114.8 N/deg, 108.9 mm at 490 N;
    # the wheels carry 442 and 426 N, between 400 N (111.7 N/deg, 106.0 mm) and 490 N
    per_radian = 57.29577951308232
    for wheel in ("rear", "front"):
        assert 111.7 * per_radian < values[f"relaxation_length.cornering_stiffness.{wheel}"] < 114.8 * per_radian
        assert 0.1060 < values[f"relaxation_length.relaxation_length.{wheel}"] < 0.1089
    assert not any("extrapolated" in note for note in model.linear_model().warnings)


def test_tyre_surface_and_pressure_may_differ_between_the_wheels():
    mixed = {
        "tyre": {"rear": "Tyre3", "front": "Tyre1"},
        "surface": {"rear": "flat", "front": "drum"},
        "pressure_bar": {"rear": 7.5, "front": 3.5},
    }
    lengths = relaxed(mixed).effects[0].relaxation_length
    assert lengths.rear > 0.145  # Tyre3, 7.5 bar: 145.8 mm at 400 N, 163.3 mm at 490 N (table 9)
    assert 0.1231 <= lengths.front < 0.1309  # Tyre1, drum, 3.5 bar: 123.1 mm at 400 N, 130.9 mm at 490 N (table 7)


@pytest.fixture
def own(tmp_path):
    """Tyre1 on the drum and Tyre3, as tables of the user in a folder beside the model's."""
    (tmp_path / "fit").mkdir()
    TyreMap.load("Tyre1", surface="drum").to_file(tmp_path / "fit" / "drum.csv")
    TyreMap.load("Tyre3").to_file(tmp_path / "fit" / "three.csv")
    (tmp_path / "models").mkdir()
    return tmp_path


def effect_of(tyre, surface=""):
    law = f"[effects.relaxation_length]\npressure_bar = 5.5\ntyre = {tyre}\n{surface}\n"
    return f'bicycle = "pista_charlie_drops"\n{law}'


@pytest.mark.parametrize(("tyre", "packaged"), [
    ('"../fit/drum.csv"', {"tyre": "Tyre1", "surface": "drum"}),
    ('"../fit/drum.toml"', {"tyre": "Tyre1", "surface": "drum"}),
    ('{rear = "../fit/three.csv", front = "Tyre1"}', {"tyre": {"rear": "Tyre3", "front": "Tyre1"}, "surface": "flat"}),
])  # fmt: skip
def test_a_tyre_may_be_a_table_of_the_user_beside_the_model(own, tyre, packaged):
    file = own / "models" / "model.toml"
    file.write_text(effect_of(tyre))
    found = read_model(file)
    known = relaxed(packaged | {"pressure_bar": 5.5})
    assert found.parameters == pytest.approx(known.parameters, rel=1e-7)  # a fit, of values that were rounded
    assert found.sd == pytest.approx(known.sd, rel=1e-5)
    assert len(found.notes) == len(known.notes)


@pytest.mark.parametrize(("tyre", "surface", "words"), [
    ('"../fit/none.csv"', "", "none.csv"),
    ('"../fit/drum.csv"', 'surface = "flat"', "drum.csv was not measured on surface 'flat', only on: drum"),
    ('"../fit/bad.csv"', "", "column 'pressure': no unit; write it in brackets, pressure"),
])  # fmt: skip
def test_tables_of_the_user_that_cannot_be_used(own, tyre, surface, words):
    (own / "fit" / "bad.csv").write_text("load_N,pressure\n1,2\n")
    (own / "fit" / "bad.toml").write_text((own / "fit" / "three.toml").read_text())
    file = own / "models" / "model.toml"
    file.write_text(effect_of(tyre, surface))
    refuses(words, read_model, file)


def test_extrapolation_is_said():
    model = build_model({"bicycle": "benchmark", "effects": {"side_slip": TYRE}})
    words = "cornering stiffness extrapolated beyond the measured 340-490 N and 3.5-7.5 bar"
    said = [note for note in model.linear_model().warnings if words in note]
    assert len(said) == 1
    assert said[0].startswith("Tyre1 on flat (rear 613 N, 5.5 bar, extrapolated; front 309 N, 5.5 bar, extrapolated): ")


def test_bicycle_as_table_and_as_file_next_to_the_model(tmp_path):
    values = dict(load_bicycle("benchmark").values)
    (tmp_path / "mine.yml").write_text("".join(f"{k}: {v}\n" for k, v in values.items()))
    (tmp_path / "model.toml").write_text('bicycle = "mine.yml"\n')
    assert dict(read_model(tmp_path / "model.toml").bicycle.values) == values
    assert dict(build_model({"bicycle": values}).bicycle.values) == values


def slip(table):
    return {"bicycle": "benchmark", "effects": {"side_slip": table}}


@pytest.mark.parametrize(("content", "words"), [
    ({}, "the key 'bicycle' is missing"),
    ({"bicycle": 3}, "bicycle = 3 must be a name, a file or a table"),
    ({"bicycle": "benchmark", "effect": {}}, "unknown key 'effect'; did you mean 'effects'"),
    (slip(1), r"\[effects\]: side_slip = 1 must be a table: write \[effects.side_slip\]"),
    ({"bicycle": "benchmark", "effects": {"sideslip": {}}}, "unknown effect 'sideslip'; did you mean 'side_slip'"),
    (slip({}), "missing parameter 'cornering_stiffness'"),
    (slip({"tyre": "Tyre1"}), "pressure_bar is missing"),
    (slip({"pressure_bar": 5.5}), "tyre is missing"),
    ({"bicycle": "benchmark", "effects": {"steer_damper": TYRE}}, "'steer_damper' does not take a tyre"),
    (slip(TYRE | {"cornering_stiffness": 1.0}), "pressure_bar or cornering_stiffness, not both"),
    (slip(TYRE | {"pressure_bar": "5"}), "= '5' of the rear wheel must be a number above 0 and up to 20 bar"),
    (slip(TYRE | {"surface": {"rear": "flat"}}), "surface has the"),
    (slip(TYRE | {"pressure_bar": 550000}), "pressure_bar = 550000 of"),
    (slip(TYRE | {"pressure_bar": 10**400}), "pressure_bar = 10"),
    (slip(TYRE | {"tyre": 1}), "tyre = 1 of the rear wheel must be"),
    (slip(TYRE | {"surface": ["flat"]}), "must be a name in quotes"),
    (slip({"cornering_stiffness": 10**400}), "must be a number N/rad"),
    (slip(TYRE | {"tyre": "Tyre9"}), "Tyre9"),
    (slip(TYRE | {"surface": "gravel"}), "gravel"),
])  # fmt: skip
def test_refused_models(content, words):
    refuses(words, build_model, content)


def test_unreadable_model_files(tmp_path):
    refuses("no such model file", read_model, tmp_path / "absent.toml")
    (tmp_path / "bad.toml").write_text("bicycle = ")
    refuses("not a TOML file", read_model, tmp_path / "bad.toml")
    (tmp_path / "worse.toml").write_text('bicycle = "benchmark"\n[effects.steer_damper]\ndamping = -1.0\n')
    with pytest.raises(InputError, match="worse.toml: effect 'steer_damper': damping = -1 N m s/rad is outside 0 .. "):
        read_model(tmp_path / "worse.toml")


@pytest.fixture
def whipple(tmp_path):
    path = tmp_path / "whipple.toml"
    path.write_text('bicycle = "benchmark"\n')
    return path


@pytest.mark.parametrize(("arguments", "words"), [
    (["modes", "{model}", "--speeds", "fast"], "give start:stop:step"),
    (["modes", "{model}", "--speeds", "0:20:0"], "the step must be positive"),
    (["modes", "{model}", "--speeds", "0:2000:0.001"], "are more than 1000000"),
    (["modes", "{model}", "--speeds=-1,2"], "speed -1 m/s is not allowed"),
    (["modes", "absent.toml", "--speeds", "1"], "no such model file"),
    (["mode", "{model}"], "unknown command 'mode'; did you mean 'modes'?"),
    (["modes", "{model}", "--speeds", "1", "--json", "{folder}/absent/x.json"], "no such folder; make it first"),
])  # fmt: skip
def test_bad_use_ends_with_one_line_and_exit_code_2(arguments, words, whipple, capsys):
    filled = [a.format(model=whipple, folder=whipple.parent) for a in arguments]
    with pytest.raises(SystemExit) as stop:
        main(filled)
    shown = capsys.readouterr()
    assert stop.value.code == 2
    assert words in shown.err
    assert shown.err.count("\n") == 1
    assert "Traceback" not in shown.err


def test_a_model_out_of_reach_needs_the_key_and_says_so():
    refuses(r"rear wheel: 42.39 N is more than .* extrapolate = true .*--extrapolate", relaxed, TYRE, "pista")
    refuses("extrapolate = 'yes' must be true or false", relaxed, TYRE | {"extrapolate": "yes"}, "pista")
    notes = relaxed(TYRE | {"extrapolate": True}, "pista").notes
    assert extrapolated(notes)
    told = "rear 42 N, 5.5 bar, extrapolated; front 53 N, 5.5 bar, extrapolated"
    assert {note.headline for note in notes} == {told}


def test_a_parameter_called_self_is_unknown_like_any_other():
    with pytest.raises(InputError, match="effect 'no_slip': unknown parameter 'self'; known: none"):
        build_model({"bicycle": "benchmark", "effects": {"no_slip": {"self": 1}}})


@pytest.mark.parametrize("tyre", ["a\0b.csv", {"rear": "Tyre1", "front": "a\0b.tir"}])
def test_a_tyre_file_with_a_nul_in_its_name(tyre):
    refuses("is no file name; it holds a NUL character", relaxed, {"tyre": tyre, "pressure_bar": 5.0})
