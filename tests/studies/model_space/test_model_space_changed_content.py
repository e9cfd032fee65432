"""A model file with some numbers changed reads back as the model computed with, and says where the rest is from."""

import numpy as np
import pytest

from bicycle.files import load_bicycle, to_toml
from bicycle.model import build_model
from studies.model_space import ModelSpace, changed_content, near_to
from tyre.ground import InputError

LAW = {"tyre": "Tyre1", "pressure_bar": 5.5}
HINGE = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.85, "joint_z": -0.8}
CONTENT = {"bicycle": "pista_charlie_drops", "effects": {"relaxation_length": LAW, "front_compliance": HINGE}}


@pytest.mark.parametrize("numbers", [
    {"pressure_bar.front": 6.5},
    {"pressure_bar": 4.5, "front_compliance.stiffness": 5000.0},
    {"mB": 85.0, "c": 0.05},
    {"relaxation_length.cornering_stiffness.front": 8000.0},
    {"relaxation_length.relaxation_length": 0.2, "front_compliance.damping": 3.0},
])  # fmt: skip
def test_the_changed_file_is_the_model_that_was_computed(numbers):
    space = ModelSpace(CONTENT, list(numbers))
    found = build_model(changed_content(space, list(numbers.values())))
    values = space.values([list(numbers.values())])
    for key, value in found.parameters.items():
        assert value == pytest.approx(float(np.ravel(values[key])[0]), rel=1e-12), key
    for key, number in numbers.items():
        if not key.startswith("pressure"):
            for entry in space.family.entries(key):
                assert found.parameters[entry] == number


@pytest.mark.parametrize("numbers", [
    {"c": 0.05}, {"front_compliance.joint_z": -0.7}, {"front_compliance.damping": 3.0}, {"steer_damper.damping": 1.0},
])  # fmt: skip
def test_a_changed_file_has_numbers_where_others_stood_for_them(numbers):
    """The hinge and its damping stay where they were computed with, though the bicycle under them changes."""
    front = {"stiffness": 3000.0, "height_above_hub": 0.3, "damping_ratio": 0.1}
    effects = {"relaxation_length": LAW, "front_compliance": front, "steer_damper": {"damping": 0.5}}
    space = ModelSpace(CONTENT | {"effects": effects}, list(numbers))
    found = build_model(changed_content(space, list(numbers.values())))
    values = space.values([list(numbers.values())])
    assert found.parameters == pytest.approx({key: float(np.ravel(values[key])[0]) for key in found.parameters})


def test_what_stands_for_parameters_is_no_axis():
    front = {"stiffness": 3000.0, "height_above_hub": 0.3, "damping_ratio": 0.1}
    content = CONTENT | {"effects": {"relaxation_length": LAW, "front_compliance": front}}
    words = "front_compliance.height_above_hub cannot be varied: it stands for front_compliance.joint_x and"
    with pytest.raises(InputError, match=words):
        ModelSpace(content, ["front_compliance.height_above_hub"])
    with pytest.raises(InputError, match="'front_compliance.dampin'; did you mean 'front_compliance.damping'"):
        ModelSpace(content, ["front_compliance.dampin"])


def test_what_is_not_changed_stays_as_it_was_written():
    found = changed_content(ModelSpace(CONTENT, ["pressure_bar.front"]), [6.5])
    assert found["bicycle"] == "pista_charlie_drops"
    assert found["effects"]["relaxation_length"] == {"tyre": "Tyre1", "pressure_bar": {"rear": 5.5, "front": 6.5}}
    assert found["effects"]["front_compliance"] == HINGE
    assert CONTENT["effects"]["relaxation_length"] == LAW
    assert changed_content(ModelSpace(CONTENT, ["pressure_bar"]), [6.5])["effects"]["relaxation_length"] == {
        "tyre": "Tyre1", "pressure_bar": 6.5,
    }  # fmt: skip


def test_a_bicycle_keeps_its_standard_deviations():
    found = build_model(changed_content(ModelSpace(CONTENT, ["c"]), [0.05])).bicycle
    known = load_bicycle("pista_charlie_drops")
    assert dict(found.sd) == dict(known.sd)
    assert found.sd
    assert found["c"] == 0.05
    assert found["w"] == known["w"]


def test_a_bicycle_written_in_the_file_keeps_what_else_stands_there():
    table = dict(load_bicycle("benchmark").values) | {"w": "1.02 +/- 0.003"}
    found = changed_content(ModelSpace({"bicycle": table}, ["w"]), [1.1])["bicycle"]
    assert found["w"] == "1.1 +/- 0.003"
    assert found["c"] == table["c"]


def test_a_tyre_gives_way_to_numbers_where_one_of_its_own_is_changed():
    found = changed_content(ModelSpace(CONTENT, ["relaxation_length.cornering_stiffness.front"]), [8000.0])
    law = found["effects"]["relaxation_length"]
    assert set(law) == {"cornering_stiffness", "relaxation_length"}
    assert law["cornering_stiffness"]["front"] == 8000.0


def test_files_near_the_target_are_named_from_there(tmp_path):
    (tmp_path / "own.toml").write_text(to_toml(load_bicycle("benchmark")))
    content = {
        "bicycle": (tmp_path / "own.toml").as_posix(),
        "effects": {"relaxation_length": {"tyre": {"rear": "Tyre1", "front": "/elsewhere/a.csv"}, "pressure_bar": 5}},
    }
    found = near_to(content, tmp_path)
    assert found["bicycle"] == "own.toml"
    assert found["effects"]["relaxation_length"]["tyre"] == {"rear": "Tyre1", "front": "/elsewhere/a.csv"}
    assert content["bicycle"] != "own.toml"
    assert near_to({"bicycle": dict(load_bicycle("benchmark").values)}, tmp_path)["bicycle"]["w"] == 1.02
