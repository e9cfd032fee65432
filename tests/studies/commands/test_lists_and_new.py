"""The lists of bicycles and tyres, the commented model file, pictures and tables of modes."""

import csv
import io
import json
import re
import tomllib

import numpy as np
import pytest

from bicycle import available_bicycles, load_bicycle, registry
from bicycle.model import build_model, read_model
from bicycle.stability import modes
from studies.cli import main
from studies.model_space import example_model
from tyre import TyreMap, available_tyres
from tyre.ground import InputError
from tyre.maps import packaged_formulas


def json_of(capsys, *arguments: str) -> dict:
    main([*arguments, "--json", "-"])
    return json.loads(capsys.readouterr().out)


def test_bicycles_are_listed_one_a_line_with_mass_and_loads(printed):
    lines = printed("bicycles").splitlines()
    for name in available_bicycles():
        (line,) = [line for line in lines if line.split() and line.split()[0] == name]
        rear, front = load_bicycle(name).static_loads
        assert f"{rear:.4g}" in line
        assert f"{front:.4g}" in line
    # Meijaard et al. (2007), table 1: 2 + 85 + 4 + 3 kg
    assert next(line for line in lines if line.startswith("benchmark")).split()[1] == "94"


def test_one_bicycle_in_full_and_as_json(capsys, refused, printed):
    shown = printed("bicycles", "pista")
    assert "source: BSD-2-Clause" in shown
    assert re.search(r"^lam +0.2758 +rad +0.003491$", shown, flags=re.MULTILINE)
    one = json_of(capsys, "bicycles", "pista")
    assert one["values"] == dict(load_bicycle("pista").values)
    assert one in json_of(capsys, "bicycles")["bicycles"]
    assert "did you mean 'pista'?" in refused("bicycles", "pistta")


def test_tyres_are_listed_with_what_was_measured(capsys, printed):
    lines = printed("tyres").splitlines()
    for tyre, surfaces in available_tyres().items():
        for surface in surfaces:
            (line,) = [line for line in lines if line.split()[:2] == [tyre, surface]]
            assert "340, 400, 490" in line  # the paper's loads, N, and pressures, bar
            assert "3.5, 5.5, 7.5" in line
    assert lines[-1].endswith("slips without lag: tyre = NAME under [effects.side_slip] of a model file")  # Schwalbe's
    assert {(t["tyre"], t["surface"]) for t in json_of(capsys, "tyres")["tyres"]} == {
        (tyre, surface) for tyre, surfaces in available_tyres().items() for surface in surfaces
    } | {(name, tyre.surface) for name, tyre in packaged_formulas().items()}


def test_one_tyre_in_full(capsys, refused, printed):
    shown = printed("tyres", "Tyre1", "--surface", "drum")
    assert "note: lateral stiffness on the drum is the flat-track value" in shown
    one = json_of(capsys, "tyres", "Tyre1")
    assert one["conditions"] == 9
    assert np.isclose(one["cornering_stiffness_N_per_deg"][4], 111.7)  # the paper's table 2, 400 N and 5.5 bar
    assert "did you mean 'Tyre1'?" in refused("tyres", "Tyr1")


def test_the_example_model_runs_as_it_is(tmp_path, monkeypatch, printed):
    monkeypatch.chdir(tmp_path)
    assert "velotyre modes model.toml" in printed("new", "model.toml")
    assert "wobble" in printed("modes", "model.toml", "--speeds", "5")
    assert "weave" in printed("critical", "model.toml")
    assert read_model("model.toml").bicycle == load_bicycle("benchmark")


def test_the_example_model_is_not_overwritten_by_chance(tmp_path, refused):
    file = tmp_path / "model.toml"
    file.write_text("mine")
    assert "exists; give --force to overwrite it or another name" in refused("new", str(file))
    assert file.read_text() == "mine"
    main(["new", str(file), "--force", "--bicycle", "fisher"])
    assert read_model(file).bicycle == load_bicycle("fisher")  # far outside the tests, and said in the file
    assert "extrapolate = true  # the wheel loads are more than one range width outside" in file.read_text()
    assert "a model file ends in .toml" in refused("new", str(tmp_path / "model.txt"))
    assert "did you mean 'fisher'?" in refused("new", str(tmp_path / "a.toml"), "--bicycle", "fishr")


def test_every_effect_of_the_example_can_be_switched_on():
    text = example_model(load_bicycle("benchmark"), TyreMap.load("Tyre1"), file="model.toml")
    base = tomllib.loads(text)
    for identifier, effect in registry().items():
        if not effect.parameters or identifier == "relaxation_length":
            continue
        block = text.partition(f"# [effects.{identifier}]\n")[2].partition("\n\n")[0]
        lines = [line.removeprefix("# ") for line in block.splitlines()]
        unfit = [line for line in lines if line.startswith("(Typical values, but not all at once on this bicycle")]
        table = tomllib.loads("\n".join(line for line in lines if line not in unfit))
        assert set(table) == {p.name for p in effect.parameters}
        effects = {identifier: table} if effect.slot == "contact law" else base["effects"] | {identifier: table}
        if unfit:
            with pytest.raises(InputError, match=f"effect '{identifier}'"):
                build_model({"bicycle": "benchmark", "effects": effects})
            continue
        model = build_model({"bicycle": "benchmark", "effects": effects})
        assert identifier in [one.identifier for one in model.effects]
        for p in effect.parameters:
            assert f"# {p.unit}; " in block


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_modes_as_picture_and_table(ending, tmp_path, capsys):
    picture, table = tmp_path / f"modes.{ending}", tmp_path / "modes.csv"
    main(["modes", "benchmark", "--speeds", "1,5.5", "--plot", str(picture), "--csv", str(table)])
    start = {"png": b"\x89PNG", "svg": b"<?xml"}[ending]
    assert picture.read_bytes().startswith(start)
    rows = list(csv.DictReader(io.StringIO(table.read_text())))
    found = modes(build_model({"bicycle": "benchmark"}), [1.0, 5.5])
    assert len(rows) == sum((z.imag >= 0) for z in found.eigenvalues.ravel())
    weave = next(row for row in rows if row["mode"] == "weave" and float(row["speed_m_s"]) == 5.5)
    assert float(weave["frequency_Hz"]) == found.frequency("weave")[1]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["modes.csv", picture.name])
    assert "castering" in capsys.readouterr().out


@pytest.mark.parametrize(("options", "words"), [
    (["--plot", "modes.gif"], "the ending must be one of .png, .svg, .pdf"),
    (["--plot", "none/modes.png"], "none/modes.png: cannot write the picture: there is no folder none; make it first"),
    (["--csv", "-", "--json", "-"], "--csv - and --json - would write into each other; give one of them a file"),
    (["--csv", "none/modes.csv"], "--csv none/modes.csv: no such folder; make it first"),
    (["--json", "modes.csv"], "modes.csv: what is written is JSON; give a name that ends in .json"),
])  # fmt: skip
def test_pictures_and_tables_that_cannot_be_written(options, words, tmp_path, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)
    assert words in refused("modes", "benchmark", "--speeds", "5", *options)


def test_no_critical_speed_is_said_in_words(capsys):
    main(["critical", "benchmark", "--max-speed", "4.2"])  # weave is stable above 4.292 m/s
    assert capsys.readouterr().out == (
        "no critical speed up to 4.2 m/s: weave unstable throughout (checked at 2.1 m/s)\n"
    )


def test_a_model_without_critical_speed_that_is_singular_at_rest(tmp_path, printed):
    (tmp_path / "m.toml").write_text('bicycle = "benchmark"\n[effects.side_slip]\ncornering_stiffness = 0\n')
    assert printed("critical", str(tmp_path / "m.toml")).startswith("no critical speed up to 60 m/s")


def test_a_deviation_that_a_table_does_not_state_is_no_zero(capsys):
    main(["tyres", "Tyre2"])  # the paper gives none of the cornering stiffness
    head, rule, row = capsys.readouterr().out.partition("\n\n")[2].splitlines()[:3]
    names, starts = head.split(), [match.start() for match in re.finditer("-+", rule)]
    at = starts[names.index("cornering_stiffness_sd_N_per_deg")]
    assert row[at:].split()[0] == "-"


@pytest.mark.parametrize("command", [("modes", "mine"), ("bicycles", "mine"), ("run", "mine"), ("diagnose", "mine")])
def test_a_file_without_its_ending_is_suggested(refused, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    assert "did you mean" not in refused(*command)
    (tmp_path / "mine.toml").write_text("")
    assert "did you mean the file mine.toml?" in refused(*command)
