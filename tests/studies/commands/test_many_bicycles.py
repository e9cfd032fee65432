"""Commands on tables of bicycles, and on bicycles as other projects write them."""

import csv
import io
import json

import pandas as pd
import pytest

from bicycle import Model, load_bicycle
from bicycle.parameters import UNITS
from bicycle.stability import critical_speeds
from studies.cli import main

NAMES = ("benchmark", "kooijman2008", "slow")


@pytest.fixture
def table(tmp_path):
    rows = [{"name": name} | {key: load_bicycle(name)[key] for key in UNITS} for name in NAMES[:2]]
    rows.append(rows[0] | {"name": "slow", "c": -0.04})  # so little trail that no speed up to 10 m/s is critical
    pd.DataFrame(rows).assign(c_sd=[0.005, None, None]).to_csv(tmp_path / "many.csv", index=False)
    return str(tmp_path / "many.csv")


def speeds(name):
    return [one.speed for one in critical_speeds(Model(load_bicycle(name)).linear_model(), max_speed=10.0)]


def test_critical_of_every_bicycle(table, printed):
    rows = list(csv.DictReader(io.StringIO(printed("critical", table, "--max-speed", "10", "--csv", "-"))))
    for name in NAMES[:2]:
        assert [float(row["speed_m_s"]) for row in rows if row["bicycle"] == name] == speeds(name)
    assert [row["bicycle"] for row in rows][-1] == "slow"
    assert rows[-1]["speed_m_s"] == ""  # it has none, and is not lost
    shown = printed("critical", table, "--max-speed", "10").splitlines()
    assert [line.split()[0] for line in shown[2:]] == ["benchmark"] * 2 + ["kooijman2008"] * 2 + ["slow"]
    assert shown[-1].split()[1:] == ["none", "-", "-", "-", "unstable", "throughout"]
    found = json.loads(printed("critical", table, "--max-speed", "10", "--json", "-"))["bicycles"]
    assert [one["name"] for one in found] == list(NAMES)
    assert [c["speed_m_s"] for c in found[1]["critical_speeds"]] == speeds("kooijman2008")


def test_modes_of_every_bicycle(table, refused, printed):
    rows = list(csv.DictReader(io.StringIO(printed("modes", table, "--speeds", "4,6", "--csv", "-"))))
    assert list(dict.fromkeys((row["bicycle"], row["speed_m_s"]) for row in rows)) == [
        (name, speed) for name in NAMES for speed in ("4.0", "6.0")
    ]
    lines = [line.split() for line in printed("modes", table, "--speeds", "4,6").splitlines()]
    assert [line[:2] for line in lines[2:8]] == [[name, speed] for name in NAMES for speed in ("4", "6")]
    assert lines[0][:4] == ["bicycle", "speed", "m/s", "weave"]
    said = refused("modes", table, "--plot", "a.png")
    assert "--plot draws one bicycle; name one of the table: FILE#benchmark" in said


def test_a_model_file_puts_every_bicycle_on_its_tyre(table, tmp_path, printed):
    law = "[effects.relaxation_length]\ncornering_stiffness = 6000\nrelaxation_length = 0.1\n"
    (tmp_path / "m.toml").write_text('bicycle = "many.csv"\n' + law)
    (tmp_path / "one.toml").write_text('bicycle = "many.csv#kooijman2008"\n' + law)
    every = json.loads(printed("critical", str(tmp_path / "m.toml"), "--json", "-"))["bicycles"]
    one = json.loads(printed("critical", str(tmp_path / "one.toml"), "--json", "-"))
    assert every[1] == {"name": "kooijman2008"} | one
    assert len(one["states"]) > 4


def test_a_bicycle_that_cannot_be_computed_is_named(table, refused):
    said = refused("critical", table, "--tyre", "Tyre1", "--pressure", "5.5")
    assert "bicycle kooijman2008: rear wheel: " in said


@pytest.mark.parametrize("command", [
    ["uncertainty"], ["sensitivity", "--mode", "weave", "--speed", "5"], ["bicycles"], ["convert", "--to", "OUT.txt"],
    ["simulate", "--speed", "5", "--initial", "lean=0.02", "--out", "OUT"],
    ["rider", "--rider", "jason", "--posture", "upright", "--out", "OUT.toml"],
    ["root-locus", "--parameter", "c", "--range", "0.05:0.1:0.01", "--speed", "5", "--out", "OUT"],
    ["animate", "--mode", "weave", "--speed", "5", "--out", "OUT.gif"],
])  # fmt: skip
def test_other_commands_take_one_of_the_table(table, command, tmp_path, refused):
    more = [word.replace("OUT", str(tmp_path / "out")) for word in command[1:]]
    said = refused(command[0], table, *more)
    assert "the table has 3 bicycles (benchmark, kooijman2008, slow); name one of them: many.csv#benchmark" in said


def test_sd_of_a_table_reaches_uncertainty_and_text(table, tmp_path, printed):
    assert "c 100 %" in printed("uncertainty", f"{table}#benchmark", "--stated-only", "--samples", "50")
    main(["convert", f"{table}#benchmark", "--to", str(tmp_path / "b.txt")])
    assert dict(load_bicycle(tmp_path / "b.txt").sd) == {"c": 0.005}
