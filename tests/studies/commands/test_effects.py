"""``velotyre effects`` and the page of an effect are generated from the declarations."""

import json

import pytest

from bicycle.effect_docs import describe
from bicycle.effect_registry import registry
from studies.cli import main


@pytest.mark.parametrize("identifier", registry())
def test_the_page_holds_the_declaration(identifier, capsys):
    main(["effects", identifier])
    shown, effect = capsys.readouterr().out, registry()[identifier]
    assert shown == describe(effect)
    assert shown.startswith(f"# {identifier}\n")
    for text in (effect.source, effect.signature, *effect.requires, *(p.description for p in effect.parameters)):
        assert text in shown
    table = [line for line in shown.splitlines() if line.startswith("|")]
    assert len(table) == (2 + len(effect.parameters) if effect.parameters else 0)
    assert len({line.count("|") for line in table}) <= 1


def test_json_of_all_and_of_one(tmp_path, capsys):
    main(["effects", "--json", str(tmp_path / "all.json")])
    everything = json.loads((tmp_path / "all.json").read_text())["effects"]
    assert set(everything) == set(registry())
    capsys.readouterr()
    main(["effects", "wheel_compliance", "--json", "-"])
    one = json.loads(capsys.readouterr().out)
    assert one == everything["wheel_compliance"]
    assert one["parameters"][0]["neutral"] == "inf"
    assert one["parameters"][0]["unit"] == "N/m"


def test_an_unknown_effect_is_named(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["effects", "camber_trust"])
    assert stop.value.code == 2
    assert "unknown effect 'camber_trust'; did you mean 'camber_thrust'?" in capsys.readouterr().err
