"""``velotyre sensitivity``: ranked table, CSV, figure and JSON of one mode."""

import json
import math

import pandas as pd
import pytest

from bicycle import Model, load_bicycle
from studies.cli import main

MODEL = """
bicycle = "benchmark"
[effects.relaxation_length]
cornering_stiffness = {rear = 6300.0, front = 6020.0}
relaxation_length = 0.1
[effects.front_compliance]
stiffness = 3000.0
joint_x = 0.8
joint_z = -0.85
damping = 15.0
"""


@pytest.fixture
def model_file(tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(MODEL)
    return str(path)


def run(capsys, *arguments: str) -> str:
    main(["sensitivity", *arguments])
    return capsys.readouterr().out


def test_json_is_ranked_with_the_origin_of_every_deviation(model_file, capsys):
    shown = json.loads(run(capsys, model_file, "--mode", "wobble", "--speed", "8", "--sd", "c=0.002", "--json", "-"))
    rows = {row["parameter"]: row for row in shown["parameters"]}
    sizes = [abs(row["growth_rate_change_1_s"]) for row in shown["parameters"]]
    assert sizes == sorted(sizes, reverse=True)
    assert shown["total_growth_rate_change_1_s"] == pytest.approx(math.hypot(*sizes))
    assert (rows["c"]["sd"], rows["c"]["sd_origin"]) == (0.002, "given")
    assert (rows["g"]["sd"], rows["g"]["sd_origin"]) == (0.0, "exact")
    assert (rows["xB"]["sd"], rows["xB"]["sd_origin"]) == (0.01, "assumed")
    damping = rows["front_compliance.damping"]
    # written without a standard deviation: four of its logarithm span 5 to 40 N m s/rad
    assert damping["sd"] == pytest.approx(15.0 * math.log(40 / 5) / 4)
    assert (damping["sd_origin"], damping["unit"]) == ("assumed", "N m s/rad")
    assert damping["growth_rate_change_1_s"] < 0
    # a band of wobble: more damping begins it later and ends it earlier
    begin, end = damping["critical_speed_changes_m_s"]
    assert begin > 0 > end


def test_table_csv_and_figure(model_file, tmp_path, capsys):
    out = tmp_path / "out"
    shown = run(capsys, model_file, "--mode", "wobble", "--speed", "8", "--top", "6", "--out", str(out))
    assert shown.startswith("wobble at 8 m/s: ")
    assert "all 32 parameters together: " in shown
    assert "front_compliance.joint_z" in shown
    table = pd.read_csv(out / "sensitivity.csv")
    assert len(table) == 32
    assert {"sd", "growth_rate_change_1_s", "frequency_change_Hz"} < set(table.columns)
    assert (out / "tornado.png").read_bytes()[:4] == b"\x89PNG"
    assert b"<svg" in (out / "tornado.svg").read_bytes()


def test_deviations_of_a_measured_tyre_are_used(tmp_path, capsys):
    path = tmp_path / "model.toml"
    path.write_text(
        'bicycle = "pista_charlie_drops"\n[effects.relaxation_length]\ntyre = "Tyre1"\n'
        "pressure_bar = {rear = 7.5, front = 5.5}\n"
    )
    key = "relaxation_length.relaxation_length.rear"
    where = (str(path), "--mode", "weave", "--speed", "6", "--json", "-")
    rows = {row["parameter"]: row for row in json.loads(run(capsys, *where))["parameters"]}
    for name in ("cornering_stiffness", "relaxation_length"):
        for wheel in ("rear", "front"):
            row = rows[f"relaxation_length.{name}.{wheel}"]
            assert row["sd_origin"] == ("assumed" if name == "cornering_stiffness" else "tyre table")
            assert 0 < row["sd"] < 0.5 * row["value"]
            assert row["sd"] != pytest.approx(0.1 * row["value"], rel=1e-6)
    given = {row["parameter"]: row for row in json.loads(run(capsys, *where, "--sd", f"{key}=0.01"))["parameters"]}
    assert (given[key]["sd"], given[key]["sd_origin"]) == (0.01, "given")


@pytest.mark.parametrize(("arguments", "words"), [
    (("--mode", "wobbel", "--speed", "8"), "unknown mode 'wobbel'; did you mean 'wobble'?"),
    (("--mode", "wobble", "--speed", "-1"), "'--speed': -1: give a number from 0 up to 1000"),
    (("--mode", "wobble", "--speed", "8", "--sd", "cc=1"), "unknown parameter 'cc'; did you mean 'c'?"),
])  # fmt: skip
def test_bad_input_ends_with_one_line(model_file, refused, arguments, words):
    shown = refused("sensitivity", model_file, *arguments)
    assert words in shown
    assert shown.count("\n") == 1


def test_a_mode_of_two_real_roots_says_which_one_is_ranked(tmp_path, capsys):
    file = tmp_path / "found.json"
    main(["sensitivity", "pista", "--mode", "weave", "--speed", "1", "--json", str(file)])
    found = json.loads(file.read_text())
    roots = sorted(Model(load_bicycle("pista")).linear_model().eigenvalues([1.0])[0].real)[-2:]
    assert [found["eigenvalue_1_s"][0], *found["other_real_roots_1_s"]] == pytest.approx(roots[::-1])
    first, second = capsys.readouterr().out.splitlines()[:2]
    assert first.startswith(f"weave at 1 m/s: {roots[1]:.4g} 1/s; ")
    assert second == f"it has another real root here, {roots[0]:.4g} 1/s, which this does not rank"


def test_the_total_has_the_correlations_of_a_stated_covariance(tmp_path, capsys):
    """Sum of squares and 2 rho times the product of two changes, of w and c with a correlation of 0.95."""
    sd, between = {"w": 0.02, "c": 0.004}, 0.95
    path = tmp_path / "model.toml"
    matrix = [[sd["w"] ** 2, between * sd["w"] * sd["c"]], [between * sd["w"] * sd["c"], sd["c"] ** 2]]
    path.write_text(f'bicycle = "benchmark"\n[covariance]\nparameters = ["w", "c"]\nmatrix = {matrix}\n')
    where = (str(path), "--mode", "weave", "--speed", "6")
    shown = json.loads(run(capsys, *where, "--json", "-"))
    moved = {row["parameter"]: row["growth_rate_change_1_s"] for row in shown["parameters"]}
    squares = sum(change**2 for change in moved.values()) + 2 * between * moved["w"] * moved["c"]
    assert shown["total_growth_rate_change_1_s"] == pytest.approx(math.sqrt(squares))
    assert shown["total_growth_rate_change_1_s"] != pytest.approx(math.hypot(*moved.values()), rel=0.03)
    assert shown["correlated"] is True
    told = run(capsys, *where)
    assert f"parameters together: {math.sqrt(squares):.4g} 1/s (with their correlations)" in told
    assert "a row changes one parameter and holds the others;" in told
    given = json.loads(run(capsys, *where, "--sd", "c=0.004", "--json", "-"))
    assert given["correlated"] is False  # what is given stands alone
    assert "(independent)" in run(capsys, *where, "--sd", "c=0.004")
