"""``velotyre effects`` and the page of an effect are generated from the declarations."""

import json

import pytest

from bicycle.effects import describe, registry
from studies.cli import main


@pytest.mark.parametrize("identifier", registry())
def test_the_page_holds_the_declaration(identifier, printed):
    shown, effect = printed("effects", identifier), registry()[identifier]
    assert shown == describe(effect)
    assert shown.startswith(f"# {identifier}\n")
    for text in (effect.source, effect.signature, *effect.requires, *(p.description for p in effect.parameters)):
        assert text in shown
    table = [line for line in shown.splitlines() if line.startswith("|")]
    assert len(table) == (2 + len(effect.parameters) if effect.parameters else 0)
    assert len({line.count("|") for line in table}) <= 1


def test_json_of_all_and_of_one(tmp_path, capsys, printed):
    main(["effects", "--json", str(tmp_path / "all.json")])
    everything = json.loads((tmp_path / "all.json").read_text())["effects"]
    assert set(everything) == set(registry())
    capsys.readouterr()
    one = json.loads(printed("effects", "wheel_compliance", "--json", "-"))
    assert one == everything["wheel_compliance"]
    assert one["parameters"][0]["neutral"] == "inf"
    assert one["parameters"][0]["unit"] == "N/m"


def test_an_unknown_effect_is_named(refused):
    assert "unknown effect 'camber_trust'; did you mean 'camber_thrust'?" in refused("effects", "camber_trust")
