"""Motorcycles among bicycles: what their numbers are compared with, in every form of file."""

import pickle

import pytest

from bicycle import Bicycle, Model, effect_class, load_bicycle
from bicycle.files import WRITERS
from bicycle.model import available_models, build_model, read_model
from studies.cli import main
from studies.model_space import choose
from tests.shared.refusals import refuses

MOTORCYCLE = read_model("sharp2004").bicycle


def usual(warnings) -> list[str]:
    return [text for text in warnings if "usual" in text]


def test_a_motorcycle_is_not_compared_with_bicycles():
    as_bicycle = Bicycle("b", MOTORCYCLE.values)
    assert usual(MOTORCYCLE.warnings) == []
    assert len(usual(as_bicycle.warnings)) > 3
    refuses(r"mB = 2 kg is far outside the usual 80 .. 500 kg", MOTORCYCLE.replace, mB=2.0)


@pytest.mark.parametrize("ending", WRITERS)
def test_every_form_of_file_keeps_the_kind(ending, tmp_path):
    file = tmp_path / f"m{ending}"
    file.write_text(WRITERS[ending](MOTORCYCLE))
    found = load_bicycle(file)
    assert (found.kind, usual(found.warnings)) == ("motorcycle", [])
    assert pickle.loads(pickle.dumps(found)).kind == "motorcycle"
    assert "kind" not in WRITERS[ending](load_bicycle("benchmark"))


def test_a_column_of_a_table_says_the_kind(tmp_path):
    header = ["name", "kind", *MOTORCYCLE.values]
    (tmp_path / "m.csv").write_text(
        ",".join(header) + "\n" + ",".join(["one", "motorcycle", *map(repr, MOTORCYCLE.values.values())]) + "\n"
    )
    assert load_bicycle(tmp_path / "m.csv").kind == "motorcycle"


@pytest.mark.parametrize("ending", [".toml", ".yaml"])
def test_an_unknown_kind_is_refused_with_the_file(ending, tmp_path):
    file = tmp_path / f"m{ending}"
    file.write_text(WRITERS[ending](MOTORCYCLE).replace("motorcycle", "motorbike"))
    refuses(rf"m{ending}.*unknown kind of vehicle 'motorbike'; did you mean 'motorcycle'", load_bicycle, file)
    refuses("unknown kind of vehicle 'moped'", Bicycle, "b", MOTORCYCLE.values, kind="moped")


def test_a_comment_that_begins_with_kind_is_a_comment(tmp_path):
    (tmp_path / "b.txt").write_text("# kind: city bike\n" + WRITERS[".txt"](load_bicycle("benchmark")))
    assert load_bicycle(tmp_path / "b.txt").kind == "bicycle"


def test_effects_of_a_motorcycle_reach_further_and_slips_of_units_are_still_told():
    """A stiff frame passes; the same tyre per degree, or in N/mm, does not."""
    table = {"stiffness": 1e5, "damping": 50.0, "joint_x": 1.2, "joint_z": -0.8}
    for kind, count in (("motorcycle", 0), ("bicycle", 3)):
        bicycle = Bicycle("b", MOTORCYCLE.values, kind=kind, unusual=True)
        model = Model(bicycle, (effect_class("front_compliance")(**table), effect_class("no_slip")()))
        assert len(usual(model.linear_model().warnings)) == count
    law = {"cornering_stiffness": 250.0, "relaxation_length": 0.2}  # N/deg
    content = {"bicycle": {"kind": "motorcycle", **MOTORCYCLE.values}, "effects": {"relaxation_length": law}}
    (told,) = usual(build_model(content).linear_model().warnings)
    assert "N/deg?" in told
    law["cornering_stiffness"] = 10.0
    refuses(r"cornering_stiffness = 10 N/rad is far outside", build_model, content)


@pytest.mark.parametrize("name", available_models())
def test_a_packaged_model_is_a_model_of_every_command(name, printed):
    assert choose(name).model == read_model(name)
    assert choose(name).remark == ""
    assert f"source: {read_model(name).bicycle.source}" in printed("list", "models", name)


def test_models_are_listed_and_unknown_ones_refused(capsys, printed, refused):
    main(["list", "models"])
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert set(available_models()) < set(names)
    assert '"kind": "bicycle"' in printed("list", "models", "kooijman2011", "--json", "-")
    assert "unknown bicycle or model 'sharp1970'; did you mean 'sharp1971'" in refused("modes", "sharp1970")


def test_the_table_of_a_bicycle_keeps_the_kind():
    assert build_model({"bicycle": MOTORCYCLE.table}).bicycle.kind == "motorcycle"
    assert load_bicycle("benchmark").table == dict(load_bicycle("benchmark").values)


def test_a_packaged_model_is_written_to_be_changed(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    main(["list", "models", "sharp1994", "--to", str(file)])
    assert read_model(file) == read_model("sharp1994")
    for arguments in (["sharp1994", "--to", "mine.yaml"], ["--to", "mine.toml"]):
        with pytest.raises(SystemExit):
            main(["list", "models", *arguments])
        assert "name a MODEL, and a file that ends in .toml" in capsys.readouterr().err


def test_a_file_of_the_same_name_comes_first(tmp_path, monkeypatch):
    (tmp_path / "sharp1971").write_text('bicycle = "pista"\n')
    monkeypatch.chdir(tmp_path)
    assert choose("sharp1971").model.bicycle.name == "pista"
