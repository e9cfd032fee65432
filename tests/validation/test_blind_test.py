"""The blind test: scoring, intervals, resuming, bad input."""

import ast
from pathlib import Path

import numpy as np
import pytest

import tests.validation.blind.generator as generator
import tests.validation.blind.histories as histories
from bicycle import load_bicycle
from tests.shared.refusals import refuses
from tests.validation.blind import baseline as rival
from tests.validation.blind import run as running
from tests.validation.blind.report import write_report
from tests.validation.blind.run import blind_test, results_in
from tests.validation.blind.score import judge, summary
from tests.validation.blind_test import run as blind_study
from tests.validation.cases import KeptCases, wilson
from tyre.ground import InputError


def verdict(kind, names, effects=()):
    return {
        "verdict": kind, "class": list(names), "held_out_gap": {"nominal": 1.0, "final": 0.1},
        "effects": [{"identifier": n, "parameters": p} for n, p in effects],
    }  # fmt: skip


TRUTH = {"effects": {"steer_spring": {"stiffness": 2.0}}, "noise": 1.0}


@pytest.mark.parametrize(("found", "expected"), [
    (verdict("named", ["steer_spring"], [("steer_spring", {"stiffness": {"value": 2.1, "sd": 0.1}})]),
     {"says": True, "right": True, "some_false": False, "misnamed": False, "covered": 1, "judged": 1}),
    (verdict("named", ["steer_spring"], [("steer_spring", {"stiffness": {"value": 2.5, "sd": 0.1}})]),
     {"covered": 0}),
    (verdict("class", ["pneumatic_trail", "steer_spring"]), {"right": True, "misnamed": False}),
    (verdict("class", [*"abc", "steer_spring"]), {"right": False}),
    (verdict("named", ["pneumatic_trail"]), {"right": False, "some_false": False, "misnamed": True}),
    (verdict("partial", ["pneumatic_trail"]), {"right": False, "misnamed": False}),
    (verdict("named", ["steer_damper+steer_spring"], [("steer_damper", {}), ("steer_spring", {})]),
     {"right": False, "some_false": True}),
    (verdict("unknown", []), {"detected": True, "says": False}),
    (verdict("none", []), {"detected": False, "says": False, "any_name": False}),
    (verdict("tentative", ["steer_spring"]),
     {"says": False, "right": False, "tentative": True, "tentative_right": True, "any_name": True}),
    (verdict("tentative", ["steer_damper"]), {"tentative_right": False, "misnamed": False, "some_false": False}),
    (verdict("class", ["steer_damper", "steer_spring"]), {"class_right": True}),
])  # fmt: skip
def test_judging(found, expected):
    got = judge(found, TRUTH)
    assert {key: got[key] for key in expected} == expected


def test_wilson_interval_against_the_published_example():
    """Newcombe (1998), Statistics in Medicine 17, table I: 81 of 263 gives 0.2553 to 0.3662."""
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)


BLIND = Path(generator.__file__).parent
JUDGES = {"run", "score", "report"}
GENERATORS = sorted(p for p in BLIND.rglob("*.py") if p.stem not in JUDGES)
ALLOWED = {
    "bicycle": {"Bicycle", "load_bicycle"},
    "tyre.ground": {"InputError", "Array", "write_text"},
}


@pytest.mark.parametrize("file", GENERATORS, ids=lambda p: p.stem)
def test_the_generators_share_nothing_with_the_fitter(file):
    """Of `bicycle` they may know the reader of parameters, of tests one another, else errors, types, the writer."""
    imported = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Import | ast.ImportFrom)]
    for node in imported:
        names, home = {alias.name for alias in node.names}, getattr(node, "module", None)
        top = {(home or name).split(".")[0] for name in names}
        if top & {"bicycle", "studies", "tests", "tyre"}:
            own = str(home).startswith("tests.validation.blind")
            assert own or names <= ALLOWED.get(home, set()), home
            assert not own or not ({home.rsplit(".", 1)[-1]} | names) & JUDGES


def test_resuming_and_summary(tmp_path, monkeypatch):
    monkeypatch.setattr(rival, "TABLE", {})
    blind_study(out=tmp_path, seed=3, cases=1, cells="modal-none", workers=1)
    file = tmp_path / "blind_test_cases.jsonl"
    first = file.read_text()
    found = blind_study(out=tmp_path, seed=3, cases=1, cells="modal-none", workers=1)
    assert file.read_text() == first  # nothing is done twice
    assert found["cells"]["modal-none"]["cases"] == 1
    assert found["cells"]["modal-none"]["crashed"] == [0, 1]
    refuses("did you mean 'modal-none'", blind_study, out=tmp_path, seed=3, cases=1, cells="modal-nine", workers=1)


def test_a_run_that_is_killed_over_its_first_case_leaves_no_empty_file(tmp_path):
    path = tmp_path / "r.jsonl"
    rows = KeptCases(path, ("seed",), also=()).computed(
        [(1,)], lambda seed: {"seed": seed, "there": path.exists()}, workers=1, what="cases"
    )
    assert rows == [{"seed": 1, "there": False}]
    assert path.read_text() == '{"seed": 1, "there": false}\n'


@pytest.mark.parametrize("half", ['{"cell": "modal-none", "se', "{", '{"cell": '])
def test_what_a_killed_run_began_to_write_is_computed_again(tmp_path, half):
    out = tmp_path / "r.jsonl"
    done = '{"cell": "a", "seed": 1, "error": null}\n'
    out.write_text(done + half)
    assert [record["seed"] for record in results_in(out).read()] == [1]
    assert [record["seed"] for record in blind_test(out, cases=1, seed=1, cells=("a",), workers=1)] == [1]
    assert out.read_text() == done


@pytest.mark.parametrize("content", ["speed_m_s,mode\n", "3\n", '{"cell": 1}\n', "mine", '{"a": 1', "[1]\nmine"])
def test_a_file_that_holds_something_else_is_left_alone(tmp_path, content):
    (tmp_path / "r.jsonl").write_text(content)
    with pytest.raises(InputError, match="not the cases of such a count"):
        blind_test(tmp_path / "r.jsonl", cases=1, seed=1, cells=("modal-none",), workers=1)
    assert (tmp_path / "r.jsonl").read_text() == content


def test_a_generator_that_finds_no_bicycle_says_so():
    bicycle, rng = load_bicycle("benchmark"), np.random.default_rng(1)
    refuses("no physical bicycle near 'benchmark'", generator.perturbed, bicycle, {"IBxz": 1e9}, rng)
    with pytest.raises(InputError, match="'benchmark' cannot hold rider_lean"):
        generator.hide(("rider_lean",), bicycle, load_bicycle("browser"), {}, rng)


def test_coloured_noise_has_the_stated_spread_and_colour():
    noise = histories.coloured(200_000, 0.3, 0.6, np.random.default_rng(1))
    assert np.std(noise) == pytest.approx(0.3, rel=0.02)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.6, abs=0.01)


def test_a_cause_may_be_called_by_another_name():
    truth = {"effects": {"steer_friction": {"torque": 0.1}}, "noise": 1.0}
    found = verdict("named", ["steer_friction"], [("steer_friction", {"torque": {"value": 0.11, "sd": 0.01}})])
    assert {"right": True, "covered": 1, "judged": 1}.items() <= judge(found, truth).items()
    assert not judge(found, TRUTH)["right"]


def test_a_crash_is_a_line_that_is_counted_and_the_test_goes_on(tmp_path, monkeypatch):
    def breaks(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(rival, "TABLE", {})
    monkeypatch.setattr(running, "_diagnosed", breaks)
    crashed = running.run_case("modal-one", 1)
    assert crashed["verdict"] is None
    assert crashed["made"]
    assert crashed["error"].startswith("LinAlgError: Singular matrix (")
    monkeypatch.setattr(running, "make", breaks)
    unmade = running.run_case("modal-one", 2)
    assert not unmade["made"]
    found = summary([crashed, unmade])["cells"]["modal-one"]
    assert (found["cases"], found["left_out"], found["crashed"]["hits"], found["crashed"]["of"]) == (0, 1, 1, 1)
    write_report(summary([crashed, unmade]), tmp_path)
    assert "| modal-one | 0 " in (tmp_path / "report.md").read_text()


def test_report(tmp_path):
    spring, wheels = {"steer_spring": {"stiffness": 2.0}}, {"camber_thrust": {"camber_stiffness": {"rear": 300.0}}}
    far = ("steer_spring", {"stiffness": {"value": 3.0, "sd": 0.1}})
    thrust = ("camber_thrust", {"camber_stiffness.rear": {"value": 310.0, "sd": 10.0}})
    cases = [
        ("modal-none", {}, 1.0, verdict("none", [])),
        ("modal-one", spring, 0.5, verdict("named", ["steer_spring"], [far])),
        ("modal-one", spring, 2.0, verdict("class", ["rider_arms", "steer_spring"])),
        ("modal-one", wheels, 2.0, verdict("partial", ["camber_thrust"], [thrust])),
        ("modal-one", spring, 2.0, verdict("named", ["steer_damper"])),
        ("modal-one", spring, 2.0, verdict("unknown", [])),
    ]
    told = [
        {"cell": cell, "seconds": 1.0, "truth": {"effects": truth, "noise": noise}, "verdict": found}
        for cell, truth, noise, found in cases
    ]
    write_report(summary(told), tmp_path)
    lines = (tmp_path / "report.md").read_text().splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    for row in (
        ["nothing hidden: an effect named", "<= 2 %", "0 of 1, 0% (0%-79%)", "-", "-"],
        ["of these named (class and partial included)", "", "4 of 5, 80% (38%-96%)", "-", "-"],
        ["named right when named", ">= 90 %", "3 of 4, 75% (30%-95%)", "-", "-"],
        ["modal-one", "all", "1 of 1", "3 of 4"],
        ["modal-one", "steer_spring", "1", "1", "", "", "1", "", "1", "named steer_damper (1)"],
        ["modal-one", "camber_thrust", "", "", "1", "", "", "", "", ""],
        ["modal-one", "steer_spring.stiffness", "0 of 1, 0% (0%-79%)"],
        ["modal-one", "camber_thrust.camber_stiffness", "1 of 1, 100% (21%-100%)"],
    ):
        assert row in rows
