"""Options of all commands: numbers are finite and within ends, and what memory cannot hold is refused in words."""

import re
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

from studies.chart import split_range
from studies.cli import build, main
from studies.main_study import settings_of
from studies.model_space import (
    Number,
    check_memory,
    choose,
    file_and_speed,
    numbers_by_name,
    ranges_by_name,
    ride_file_and_speed,
)
from studies.motion import parse_range
from studies.reporting import parse_speeds
from tyre.ground import InputError

BARE = (click.types.FloatParamType, click.types.IntParamType)


def commands(group, context):
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        yield from commands(command, context) if isinstance(command, click.Group) else [(name, command)]


def test_no_option_takes_a_bare_number():
    """NaN passes every range of click."""
    found = list(commands(build(), click.Context(build())))
    assert len(found) > 20
    bare = [(name, option.opts[0]) for name, command in found for option in command.params
            if isinstance(option.type, BARE)]  # fmt: skip
    assert bare == []


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "1e309", "", "x", "-1e-9", "1.0000001", "0", "1"])
def test_what_is_no_number_between_open_ends(text):
    with pytest.raises(click.BadParameter, match="give a number above 0 below 1"):
        Number(0, 1, above=True, below=True).convert(text, None, None)


def test_numbers():
    assert Number(0, 1).convert("1", None, None) == 1.0
    assert Number(0, 5, whole=True).convert("5", None, None) == 5
    assert str(Number(-1, 1).convert("-0", None, None)) == "0.0"  # no sign that a result could show
    assert Number(-1, 1).convert("1e-320", None, None) == 0.0
    for text in ("1e-320", "-0"):
        with pytest.raises(click.BadParameter, match="give a number above 0 up to 1"):
            Number(0, 1, above=True).convert(text, None, None)
    for text in ("٣", "1_0"):  # Python alone reads these
        with pytest.raises(click.BadParameter, match="give a number from 0 up to 20"):
            Number(0, 20).convert(text, None, None)
    with pytest.raises(click.BadParameter, match="2.5: give a whole number from 0 up to 5"):
        Number(0, 5, whole=True).convert("2.5", None, None)


DESIGN = ["design", "benchmark", "--keep", "weave", "stable", "--vary", "c", "--out", "x.toml"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([*DESIGN, "--up-to", "nan"], "'--up-to': nan: give a number above 0 up to 1000 m/s"),
        ([*DESIGN, "--up-to", "1e9"], "'--up-to': 1e9: give a number above 0 up to 1000 m/s"),
        ([*DESIGN, "--up-to", "6", "--probability", "nan"], "'--probability': nan: give a number above 0 below 1"),
        ([*DESIGN, "--up-to", "6", "--from", "4", "--sd", "c=0.003", "--samples", "2000000000"],
         "samples = 2000000000: the arrays would take 64 GB of memory; up to 31250000 fit into the 1 GB"),
        (["uncertainty", "benchmark", "--samples", "2000000000"], "fit into the 1 GB that are allowed"),
        (["uncertainty", "benchmark", "--max-speed", "inf"], "'--max-speed': inf: give a number above 0 up to 1000"),
        (["modes", "benchmark", "--tyre", "Tyre1", "--pressure", "5.5", "--speeds", "0:20:0.00005"],
         "number of --speeds = 400001: the arrays would take 1.64 GB of memory; up to 244140 fit"),
        (["root-locus", "benchmark", "--parameter", "c", "--range", "0.05:0.1", "--speed", "5", "--out", "x",
          "--max-frequency", "nan"], "'--max-frequency': nan: give a number above 0"),
        (["chart", "benchmark", "--x", "w", "--y", "c", "--speed", "inf", "--out", "x"], "'--speed': inf: give a"),
        (["chart", "benchmark", "--x", "w", "--y", "c", "--speeds", "5", "--out", "x"],
         "--speeds 5: one speed is meant here: give --speed, for example --speed 5"),
        (["chart", "benchmark", "--x", "speed=1:10", "--y", "c=1e-320:2e-320", "--out", "x"],
         "axis 'c=1e-320:2e-320': give NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:log"),
        (["modes", "benchmark", "--speeds", "٣"], "speeds '٣': give start:stop:step"),
        (["modes", "benchmark", "--tyre", "Tyre1", "--pressure", "nan"], "--pressure 'nan': give one number, in bar"),
        (["amplitude", "benchmark", "--point", "1_0,0"], "--point 1_0,0: give X,Z in m"),
        (["simulate", "benchmark", "--speed", "5", "--initial", "lean=1_0", "--out", "x"], "initial 'lean=1_0': write"),
        (["tyre", "simulate", "x", "--seed", "1", "--loads", "inf"], "loads = 'inf' must be numbers separated by"),
        (["root-locus", "benchmark", "--parameter", "c", "--range", "0.05:0.05000000000000001", "--speed", "5",
          "--out", "x"], "range '0.05:0.05000000000000001': its values differ by less than sixteen digits"),
        (["convert", "pista", "--to", "a\0b.txt"], "'a\\x00b.txt' holds a NUL character; leave it out"),
        (["modes", "benchmark", "--speed", "5"], "--speed 5: give --speeds, one or more: --speeds 5, a list 2,5,8"),
    ],
)  # fmt: skip
def test_refused(arguments, words, tmp_path, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)
    *remarks, told = refused(*arguments).splitlines()
    assert words in told
    assert len(remarks) <= 1  # a bicycle that rolls without slip


def test_the_number_that_would_pass_passes():
    check_memory("x", 1250000, 800)
    with pytest.raises(InputError, match="x = 1250001: the arrays would take 1 GB of memory; up to 1250000 fit"):
        check_memory("x", 1250001, 800)


def test_ctrl_c_while_the_command_line_is_imported_is_one_line():
    code = (
        "import sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name == 'click':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "import studies.cli\n"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (shown.returncode, shown.stdout, shown.stderr) == (130, "", "velotyre: interrupted\n")


def test_a_search_that_finds_no_critical_speed_is_no_error(capsys):
    main(["sensitivity", "benchmark", "--mode", "weave", "--speed", "5", "--max-speed", "2"])
    assert "parameters together" in capsys.readouterr().out


REFUSED = (
    "diagnose no.toml", "explore no", "look no.csv", "tyre fit no --out fit", "modal no.csv@5", "sweep no.toml --out g",
    "frequency-response no.csv@6", "run no.toml", "closed-loop benchmark --rider-control no",
    "chart no --x c=1:2 --y w=1:2",
)  # fmt: skip


def test_a_refusal_loads_nothing_that_only_a_result_needs(tmp_path):
    code = f"""import sys\nfrom studies.cli import main
for line in {REFUSED}:
    try: main(line.split())
    except SystemExit as end: print(end.code)
print([name for name in ('scipy.stats', 'scipy.signal', 'matplotlib', 'pandas', 'xarray', 'control', 'dash')
       if name in sys.modules])"""
    told = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert told.stdout.split("\n") == ["2"] * len(REFUSED) + ["[]", ""]
    assert len(told.stderr.splitlines()) == len(REFUSED)


def test_every_command_takes_numbers_with_their_units():
    """Where a person types a speed, pressure or length, another unit of it may stand behind."""
    np.testing.assert_allclose(parse_speeds("18:36:9km/h"), [5.0, 7.5, 10.0])
    np.testing.assert_allclose(parse_speeds("18km/h,7.5 m/s"), [5.0, 7.5])
    psi = 4.4482216152605 / 0.0254**2 / 1e5  # bar
    tables = [choose("benchmark", tyre="Tyre1", pressure=text).content["effects"] for text in ("80psi", "80,90psi")]
    single, both = (table["relaxation_length"]["pressure_bar"] for table in tables)
    assert single == pytest.approx(80 * psi)
    assert both == pytest.approx({"rear": 80 * psi, "front": 90 * psi})
    assert settings_of(pressures="50,80psi").pressures == pytest.approx((50 * psi, 80 * psi))
    assert parse_range("10:20deg", "rad")[[0, -1]] == pytest.approx(np.radians([10, 20]))
    assert split_range("speed=9:36km/h") == ("speed", pytest.approx((2.5, 10.0)), False)
    assert numbers_by_name(["c=2mm", "lam=0.5deg"], "--sd", "") == pytest.approx({"c": 0.002, "lam": np.radians(0.5)})
    assert ranges_by_name(["trail=30:90mm"]) == {"c": pytest.approx((0.03, 0.09))}
    assert file_and_speed("run.csv@18km/h") == (Path("run.csv"), pytest.approx(5.0))
    assert ride_file_and_speed("ride.csv@18km/h") == (Path("ride.csv"), pytest.approx(5.0))
    assert ride_file_and_speed("ride.csv") == (Path("ride.csv"), None)
    assert Number(0, 1000, unit="m/s").convert("18 km/h", None, None) == pytest.approx(5.0)
    with pytest.raises(InputError, match="write the unit behind the last number alone, or behind each"):
        choose("benchmark", tyre="Tyre1", pressure="80psi,5.5")
    with pytest.raises(click.UsageError, match="'kg' is not a unit of speed"):
        Number(0, 1000, unit="m/s").convert("18 kg", None, None)
    with pytest.raises(InputError, match="give the number without a unit"):
        numbers_by_name(["c=2mm"], "--cost", "", own_unit=False)


def test_an_option_in_a_unit_reads_others():
    """The help names the unit; the type of the option knows it."""
    units = {r"m/s\b": "m/s", r"\bkg\b(?! m)": "kg", r"(^|, )m[.;]": "m", r"(^|, )s[.,]": "s"}
    seen = 0
    for name, command in commands(build(), click.Context(build())):
        for option in command.params:
            words = getattr(option, "help", None) or ""
            for pattern, unit in units.items():
                if isinstance(option.type, Number) and re.search(pattern, words):
                    assert option.type.unit == unit, (name, option.name)
                    seen += 1
    assert seen > 20
