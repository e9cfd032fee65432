"""The count of joint diagnoses: what it makes of answers, and one case from end to end."""

import json

import numpy as np
import pytest

import studies.validations.joint_diagnosis as count
from studies.missing_effect.blind.joint import joint_case
from studies.validations.joint_diagnosis import run, scored


def answer(verdict="named", named=("steer_damper",), sd=0.1, *, right=True, contradicts=()):
    return {
        "verdict": verdict, "class": ["+".join(named)], "sizes": {"steer_damper.damping": [1.0, sd]},
        "contradicts": list(contradicts), "right": right, "misnamed": False, "some_false": False, "covered": 1,
        "judged": 1,
    }  # fmt: skip


def row(joint, planted="", part="", alone=None):
    return {
        "seed": 1, "planted": planted, "hidden": "steer_damper", "error": None, "part": part, "mistake": {},
        "parts": ["modes", "kicks"], "joint": joint,
        "alone": alone or {"modes": answer(sd=0.2), "kicks": answer(sd=0.4, right=False)},
    }  # fmt: skip


def test_right_names_and_widths_stand_beside_those_of_the_parts():
    found = scored([row(answer()), row(answer(right=False))])
    assert found["right"]["joint"]["share"] == 0.5
    assert found["right"]["modes"]["share"] == 1.0
    assert found["right"]["kicks"]["share"] == 0.0
    assert found["sd_joint_over_best_part"] == {"median": 0.5, "largest": 0.5, "of": 1}


def test_an_accusation_where_nothing_is_planted_is_false():
    found = scored([
        row(answer()), row(answer(contradicts=["modes"])), row(answer(named=("steer_damper", "kicks/drift"))),
        row(answer("none", ())),
    ])  # fmt: skip
    assert found["false_contradiction"]["hits"] == 2


def test_a_planted_mistake_is_found_in_its_part_only():
    found = scored([
        row(answer(contradicts=["kicks"]), "scale", "kicks"), row(answer(contradicts=["modes"]), "scale", "kicks"),
        row(answer(named=("modes/speed_offset",)), "speed", "modes"),
        row(answer("unknown", ("modes/speed_offset",)), "speed", "modes"),
    ])  # fmt: skip
    assert found["planted_found"]["hits"] == 2
    assert found["planted_found_by_mistake"]["scale"]["of"] == 2


def test_a_case_that_raised_is_counted():
    found = scored([{"seed": 3, "planted": "", "error": "ValueError: no"}, row(answer())])
    assert found["crashed"]["hits"] == 1
    assert found["errors"][0]["seed"] == 3


def test_a_part_alone_is_diagnosed_and_scored(tmp_path):
    case = joint_case(tmp_path, hidden=("steer_spring",), rng=np.random.default_rng(8))
    found = count.answer(tmp_path / "modes.toml", case.truth.effects)
    assert found["right"]
    assert found["class"] == ["steer_spring"]
    assert found["sizes"]["steer_spring.stiffness"][1] > 0
    assert found["contradicts"] == []


def test_what_raises_is_a_row_with_its_error(monkeypatch):
    def breaks(*_args):
        raise ArithmeticError("no matter what")

    monkeypatch.setattr(count, "answer", breaks)
    assert count.one_case(4, "speed")["error"] == "ArithmeticError: no matter what"


def test_an_interrupted_count_goes_on(tmp_path, monkeypatch):
    (tmp_path / "joint_cases.jsonl").write_text("")
    assert run(out=tmp_path, seed=5, cases=0)["crashed"]["of"] == 0
    with (tmp_path / "joint_cases.jsonl").open("w") as file:
        for seed in (5, 6):
            file.write(json.dumps(row(answer()) | {"seed": seed}) + "\n")
        file.write(json.dumps(row(answer(contradicts=["kicks"]), "scale", "kicks") | {"seed": 5}) + "\n")
    monkeypatch.setattr(count, "one_case", None)  # nothing is left to do
    found = run(out=tmp_path, seed=5, cases=2)
    assert found["right"]["joint"]["of"] == 2
    assert found["planted_found"]["hits"] == 1
    assert found["false_contradiction"]["share"] == pytest.approx(0)
