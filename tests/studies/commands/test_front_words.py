"""Height above the hub and damping ratio are printed where joint_z and damping of a front hinge are."""

import re
from pathlib import Path

import pytest

from bicycle import load_bicycle, read_model
from bicycle.parameters import front_line, front_words, height_above_hub
from studies.explorer import compute_modes, start_state

FRONT = """bicycle = "pista_charlie_drops"

[effects.relaxation_length]
cornering_stiffness = 6400
relaxation_length = 0.1

[effects.front_compliance]
stiffness = 3600
damping = 17
joint_x = 0.87
joint_z = -0.67
"""


@pytest.fixture
def model_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "front.toml").write_text(FRONT)
    return "front.toml"


@pytest.mark.parametrize(
    "command",
    [
        ("sensitivity", "front.toml", "--mode", "wobble", "--speed", "8"),
        ("uncertainty", "front.toml", "--samples", "20"),
    ],
)
def test_a_line_below_the_numbers(printed, model_file, command):
    said = front_line(read_model(model_file).parameters)
    assert said.startswith("front_compliance.joint_z: 0.36 m above the front hub; front_compliance.damping: damping")
    assert said in printed(*command).splitlines()


def test_a_design_says_it_of_the_changed_model(printed, model_file):
    demand = ("--keep", "wobble", "stable", "--from", "6", "--up-to", "8", "--vary", "front_compliance.damping")
    said = printed("design", model_file, *demand, "--out", "better.toml")
    better = front_line(read_model("better.toml").parameters)
    assert better != front_line(read_model(model_file).parameters)
    assert f"in the design {better}" in said


def test_the_crossings_of_a_root_locus_have_a_damping_ratio(printed, model_file, no_pictures):
    locus = ("--parameter", "front_compliance.damping", "--range", "2:60:2", "--speed", "8", "--out", "locus")
    value, ratio = re.search(r"^([\d.]+) \(damping ratio ([\d.]+)\) +wobble", printed("root-locus", model_file, *locus),
                             flags=re.MULTILINE).groups()  # fmt: skip
    parameters = {**read_model(model_file).parameters, "front_compliance.damping": float(value)}
    assert front_words(parameters)["front_compliance.damping"] == f"damping ratio {ratio}"


def test_a_new_model_says_it_of_the_numbers_that_it_offers(printed, model_file):
    printed("new", "model.toml", "--bicycle", "pista")
    block = Path("model.toml").read_text(encoding="utf-8").partition("# [effects.front_compliance]")[2]
    line = next(line for line in block.splitlines() if line.startswith("# joint_z"))
    height = height_above_hub(load_bicycle("pista").values, float(line.split()[3]))
    assert line.endswith(f"here {height:.2f} m above the front hub")
    line = next(line for line in block.splitlines() if line.startswith("# damping"))
    assert re.search(r"here damping ratio 0\.\d+$", line)


def test_the_explorer_notes_it(model_file):
    assert front_line(read_model(model_file).parameters) in compute_modes(start_state(model_file)).notes
