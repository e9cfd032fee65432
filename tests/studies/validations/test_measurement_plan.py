"""Plans by simulation: one laboratory played through, and what counts as right."""

import json

import numpy as np
import pytest

from studies.missing_effect import read_measurement
from studies.missing_effect.blind.continued import laboratory
from studies.validations.measurement_plan import case, right, run, summary

CLASS = 1012  # spring or trail, which a run tells apart


def test_a_case_is_open_planned_measured_on_and_named(tmp_path, monkeypatch):
    row = case(CLASS)
    assert row["hidden"] == ["steer_spring"]
    assert row["first"] == "class"
    assert row["open"] == ["steer_spring or pneumatic_trail"]
    assert sum(row["runs"].values()) >= 1
    assert (row["second"], row["second_names"], row["right"]) == ("named", ["steer_spring"], True)
    (tmp_path / "measurement_plan.jsonl").write_text(json.dumps(row) + "\n")
    monkeypatch.setattr("studies.validations.measurement_plan.case", lambda seed: pytest.fail("made again"))
    found = run(out=tmp_path, seed=CLASS, cases=1)
    assert found["after_planned_runs"] == {"cases": 1, "right": 1, "share": 1.0}
    assert found["by_hidden"]["steer_spring"]["cases"] == 1
    assert found["wrong"] == []


@pytest.mark.parametrize(
    ("hidden", "second", "names", "twins", "is_right"),
    [
        ([], "none", [], [], True),
        ([], "named", ["steer_spring"], [], False),
        ([], "unknown", [], [], False),
        (["steer_spring"], "named", ["steer_spring"], [], True),
        (["steer_spring"], "named", ["pneumatic_trail"], [], False),
        (["steer_spring"], "none", [], [], False),
        (["steer_spring"], "tentative", ["steer_spring"], [], False),
        (["steer_spring"], "class", ["steer_spring", "crown_radius"], [], False),
        (["steer_spring"], "class", ["crown_radius", "steer_spring"], ["steer_spring or crown_radius"], True),
        (["steer_spring"], "class", ["steer_spring", "rider_arms"], ["steer_damper or rider_arms"], False),
    ],
)
def test_what_is_right(hidden, second, names, twins, is_right):
    assert right({"hidden": hidden, "second": second, "second_names": names, "inseparable": twins}) is is_right


def test_cases_without_a_plan_do_not_count():
    rows = [{"seed": 1, "hidden": [], "first": "named", "first_names": ["x"]},
            {"seed": 2, "hidden": [], "first": "none", "open": ["a or b"], "inseparable": ["a or b"]}]  # fmt: skip
    made = {"seed": 3, "hidden": [], "first": "none", "first_names": [], "open": ["a or b"], "inseparable": ["a or b"]}
    made |= {"promised": None, "cost": 5.0, "proven": True, "second": "named", "second_names": ["a"], "right": False}
    wrong = summary([made], 3)
    assert (wrong["promised_probability_mean"], len(wrong["wrong"])) == (None, 1)
    found = summary(rows, 1)
    assert (found["something_open"], found["nothing_that_runs_could_settle"]) == (1, 1)
    assert found["after_planned_runs"] == {"cases": 0, "right": 0, "share": None}


def test_the_laboratory_measures_the_same_bicycle_again(tmp_path):
    lab = laboratory(np.random.default_rng(4), ("steer_damper",), points=6, noise=1.0)
    more = lab.measure([6.0, 6.0, 6.0], ("steer_over_lean",))
    assert {row["speed_m_s"] for row in more} == {6.0}
    weave = [complex(row["real_1_s"], row["imag_rad_s"]) for row in more if row["mode"] == "weave"]
    assert 0 < abs(weave[0] - weave[1]) < 8 * more[0]["real_sd_1_s"]
    assert "steer_over_lean_re" in more[0]
    assert "yaw_over_lean_re" not in more[0]
    alone = read_measurement(lab.write(tmp_path / "a"))
    grown = read_measurement(lab.write(tmp_path / "b", lab.measure([6.0])))
    assert len(grown.points) > len(alone.points)
    assert [name for name, _ in read_measurement(lab.write(tmp_path / "c", more)).parts] == ["first", "more"]
