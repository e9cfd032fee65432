"""The page on tyres: its examples are read and run, and it names every coefficient that is told of in its table."""

import json
import tomllib

import pytest
from pages import page, run_page, without_files, write_files

from bicycle.effects import registry
from bicycle.model import read_model
from tyre import read_tyre

PAGE = page("tyres")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_files(PAGE, tmp_path_factory.mktemp("page"))


def test_the_commands_of_the_page_run(tmp_path, monkeypatch):
    monkeypatch.chdir(write_files(PAGE, tmp_path))
    (shown,) = run_page(without_files(PAGE))
    assert "example.tir" in shown


def test_the_examples_are_tyres_under_a_bicycle(folder):
    model = read_model(folder / "model.toml")
    # the tyre's force of camber is carried by its load: PKY6 of it
    load = model.bicycle.static_loads[1]
    assert model.parameters["camber_thrust.camber_stiffness.front"] == pytest.approx(0.85 * load)
    for name in ("example.tir", "example.toml"):
        tyre = read_tyre(folder / name)
        assert tyre.synthetic
        assert tyre.at(load=400.0, pressure=4e5).inside
    text = (folder / "model.toml").read_text().replace("example.tir", "example.toml").replace("= 5\n", "= 4\n")
    (folder / "other.toml").write_text(text)
    assert read_model(folder / "other.toml").parameters["relaxation_length.relaxation_length.rear"] > 0


def test_every_parameter_that_a_tyre_can_give_is_on_the_page():
    for identifier, effect in registry().items():
        for parameter in effect.parameters:
            if parameter.tyre and effect.slot != "contact law":
                assert f"`{identifier}.{parameter.name}`" in PAGE


def test_lists_and_tables_of_others_on_the_page(folder):
    keys = tomllib.loads((folder / "example.toml").read_text(encoding="utf-8"))
    (folder / "example.json").write_text(json.dumps(keys), encoding="utf-8")
    same = [read_tyre(folder / f"example.{ending}").at(load=400.0, pressure=4e5) for ending in ("toml", "json")]
    assert same[0].cornering_stiffness == same[1].cornering_stiffness
    table = read_tyre(folder / "others.csv")
    assert (table.tyre, table.surface, table.notes) == ("Example 28", "flat", ())
    assert table.loads.tolist() == [340.0, 490.0]
    assert table.at(load=340, pressure=51 * 6894.757293168).cornering_stiffness == pytest.approx(5100, rel=1e-6)
