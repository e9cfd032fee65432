"""The blind test: scoring, intervals, resuming, bad input."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

import studies.missing_effect.blind_generator as generator
import studies.missing_effect.blind_histories as histories
from studies.cli import main
from studies.missing_effect.blind_score import judge, summary, wilson
from studies.missing_effect.blind_test import CELLS, make


def verdict(kind, names, effects=()):
    return {
        "verdict": kind, "class": list(names), "held_out_gap": {"nominal": 1.0, "final": 0.1},
        "effects": [{"identifier": n, "parameters": p} for n, p in effects],
    }  # fmt: skip


TRUTH = {"effects": {"steer_spring": {"stiffness": 2.0}}, "noise": 1.0}


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (verdict("named", ["steer_spring"], [("steer_spring", {"stiffness": {"value": 2.1, "sd": 0.1}})]),
         {"says": True, "right": True, "false": False, "misnamed": False, "covered": 1, "judged": 1}),
        (verdict("named", ["steer_spring"], [("steer_spring", {"stiffness": {"value": 2.5, "sd": 0.1}})]),
         {"covered": 0}),
        (verdict("class", ["pneumatic_trail", "steer_spring"]), {"right": True, "misnamed": False}),
        (verdict("class", [*"abc", "steer_spring"]), {"right": False}),
        (verdict("named", ["pneumatic_trail"]), {"right": False, "false": True, "misnamed": True}),
        (verdict("partial", ["pneumatic_trail"]), {"false": True, "misnamed": False}),
        (verdict("named", ["steer_damper+steer_spring"], [("steer_damper", {}), ("steer_spring", {})]),
         {"right": False, "some_false": True}),
        (verdict("unknown", []), {"detected": True, "says": False}),
        (verdict("none", []), {"detected": False, "says": False}),
    ],
)  # fmt: skip
def test_judging(found, expected):
    got = judge(found, TRUTH)
    assert {key: got[key] for key in expected} == expected


def test_wilson_interval_against_the_published_example():
    """Newcombe (1998), Statistics in Medicine 17, table I: 81 of 263 gives 0.2553 to 0.3662."""
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)


@pytest.mark.parametrize("module", [generator, histories])
def test_the_generators_share_nothing_with_the_fitter(module):
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    imported = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name for name in imported if name.startswith("studies")} <= {"studies.missing_effect.blind_generator"}


@pytest.mark.parametrize("cell", CELLS)
def test_every_cell_makes_a_case_that_is_the_same_for_the_same_seed(tmp_path, cell):
    first, out = make(cell, 5, tmp_path / "a")
    second, _ = make(cell, 5, tmp_path / "b")
    assert first == second
    assert bool(first.effects) == ("none" not in cell)
    assert bool(out) == (cell == "modal-outside")
    for file in (tmp_path / "a").iterdir():
        assert file.read_text() == (tmp_path / "b" / file.name).read_text()
        assert "hidden" not in file.read_text()


def test_resuming_and_summary(tmp_path, capsys):
    out = tmp_path / "r.jsonl"
    settings = ["blind-test", "--cell", "modal-none", "--seed", "3", "--workers", "1", "--out", str(out)]
    main([*settings, "--cases", "1"])
    first = out.read_text()
    main([*settings, "--cases", "1", "--json", str(tmp_path / "s.json")])
    assert out.read_text() == first  # nothing is done twice
    found = json.loads((tmp_path / "s.json").read_text())
    assert found["cells"]["modal-none"]["cases"] == 1
    assert found["confusion"] == {"nothing": {"none: -": 1}}
    assert summary([])["cells"] == {}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--cell", "modal-nine"], "unknown cell 'modal-nine'; did you mean 'modal-none'"),
        (["--cases", "0"], "must be at least 1"),
    ],
)
def test_bad_input(tmp_path, capsys, arguments, words):
    with pytest.raises(SystemExit):
        main(["blind-test", "--out", str(tmp_path / "r.jsonl"), *arguments])
    assert words in capsys.readouterr().err


def test_a_file_that_holds_something_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "r.jsonl").write_text("speed_m_s,mode\n")
    with pytest.raises(SystemExit):
        main(["blind-test", "--out", str(tmp_path / "r.jsonl"), "--cases", "1"])
    assert "not a result file of blind-test" in capsys.readouterr().err
    assert (tmp_path / "r.jsonl").read_text() == "speed_m_s,mode\n"


def test_coloured_noise_has_the_stated_spread_and_colour():
    noise = histories.coloured(200_000, 0.3, 0.6, np.random.default_rng(1))
    assert np.std(noise) == pytest.approx(0.3, rel=0.02)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.6, abs=0.01)
