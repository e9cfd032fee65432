"""Numbers of a model that run together mean what they mean in its file; derivatives are those of the matrices."""

import numpy as np
import pytest

from bicycle.model import build_model
from studies.model_space import ModelSpace, axis_of, numbers_by_name, ranges_by_name, typical_range
from tyre.ground import InputError

TYRED = {
    "bicycle": "pista_charlie_drops",
    "effects": {
        "relaxation_length": {"tyre": "Tyre1", "pressure_bar": {"rear": 6.0, "front": 5.0}},
        "front_compliance": {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.85, "joint_z": -0.8},
    },
}
BRAKED = TYRED | {"effects": TYRED["effects"] | {"longitudinal": {"brake_force": 20.0, "gradient": 0.02}}}
PLAIN = {
    "bicycle": "benchmark",
    "effects": {"relaxation_length": {"cornering_stiffness": 7000.0, "relaxation_length": 0.12}},
}
SPEED = 7.0


def filed(content, **changes):
    """State matrix of a file in which numbers were changed by hand."""
    bicycle = dict(build_model({"bicycle": content["bicycle"]}).bicycle.values)
    effects = {name: dict(table) for name, table in content["effects"].items()}
    for key, value in changes.items():
        if key in bicycle:
            bicycle[key] = value
        else:
            effect, name = key.split("__")
            effects[effect][name] = value
    return build_model({"bicycle": bicycle, "effects": effects}).linear_model().state_matrix(SPEED)


CASES = [
    (TYRED, {"pressure_bar.front": 6.3}, {"relaxation_length__pressure_bar": {"rear": 6.0, "front": 6.3}}),
    (TYRED, {"pressure_bar": 6.3}, {"relaxation_length__pressure_bar": 6.3}),
    (TYRED, {"mB": 88.0}, {"mB": 88.0}),  # wheel loads move, and with them the tyres
    (TYRED, {"lam": 0.3}, {"lam": 0.3}),  # the hinge's tilt follows
    (TYRED, {"xB": 0.5, "front_compliance.stiffness": 4000.0}, {"xB": 0.5, "front_compliance__stiffness": 4000.0}),
    (BRAKED, {"longitudinal.brake_force": 45.0}, {"longitudinal__brake_force": 45.0}),  # the loads move here, too
    (BRAKED, {"zB": -0.95, "pressure_bar": 5.6}, {"zB": -0.95, "relaxation_length__pressure_bar": 5.6}),
    (PLAIN, {"relaxation_length.cornering_stiffness.rear": 8000.0},
     {"relaxation_length__cornering_stiffness": {"rear": 8000.0, "front": 7000.0}}),
    (PLAIN, {"relaxation_length.relaxation_length": 0.2, "c": 0.05},
     {"relaxation_length__relaxation_length": 0.2, "c": 0.05}),
]  # fmt: skip


@pytest.mark.parametrize(("content", "numbers", "changes"), CASES)
def test_a_number_means_what_it_means_in_the_file(content, numbers, changes):
    space = ModelSpace(content, list(numbers))
    expected = filed(content, **changes)
    point = list(numbers.values())
    np.testing.assert_allclose(space.matrices([point], SPEED)[0], expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(space.linear_at(point).state_matrix(SPEED), expected, rtol=1e-12, atol=1e-12)
    found = space.model_at(point).linear_model().state_matrix(SPEED)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("content", "numbers", "changes"), CASES)
def test_slopes_are_those_of_the_matrices(content, numbers, changes):
    space = ModelSpace(content, list(numbers))
    point = np.array(list(numbers.values()))
    matrices, slopes = space.matrices_and_slopes([point], SPEED)
    np.testing.assert_allclose(matrices, space.matrices([point], SPEED), rtol=1e-12, atol=1e-12)
    for i, value in enumerate(point):
        step = 1e-5 * abs(value) * np.eye(len(point))[i]
        expected = (space.matrices([point + step], SPEED) - space.matrices([point - step], SPEED)) / (2 * step.sum())
        assert np.abs(slopes[:, i] - expected).max() <= 1e-6 * np.abs(expected).max()
        assert np.abs(expected).max() > 0


def test_the_speed_is_an_axis_like_any_other():
    space = ModelSpace(TYRED, ["speed", "c"])
    at = space.matrices([[SPEED, 0.05], [9.0, 0.06]])
    other = ModelSpace(TYRED, ["c"]).matrices([[0.05], [0.06]], [SPEED, 9.0])
    np.testing.assert_allclose(at, other, rtol=1e-13)
    one = ModelSpace(TYRED, ["c"]).matrices([0.05], [3.0, SPEED])  # one point at two speeds
    np.testing.assert_allclose(one[1], filed(TYRED, c=0.05), rtol=1e-12, atol=1e-12)
    assert one.shape == (2, *at.shape[1:])
    _, slopes = space.matrices_and_slopes([[SPEED, 0.05]])
    ends = space.matrices([[SPEED + 1e-4, 0.05], [SPEED - 1e-4, 0.05]])
    np.testing.assert_allclose(slopes[0, 0], (ends[0] - ends[1]) / 2e-4, rtol=1e-6, atol=1e-6)


def test_values_as_they_stand():
    assert ModelSpace(TYRED, ["pressure_bar.front", "c"]).base.tolist() == [5.0, pytest.approx(0.06173, abs=1e-5)]
    assert np.isnan(ModelSpace(TYRED, ["pressure_bar", "speed"]).base).all()


@pytest.mark.parametrize(("content", "keys", "message"), [
    (PLAIN, ["front_compliance.damping"], "the model has no effect front_compliance: add [effects.front_comp"),
    (PLAIN, ["stifness"], "unknown parameter 'stifness'"),
    (PLAIN, ["pressure_bar"], "pressure_bar needs a measured tyre in the model file"),
    (TYRED, ["front_compliance.axis_tilt"], "front_compliance.axis_tilt was not given and equals lam"),
    (TYRED, ["pressure_bar", "pressure_bar.front"], "pressure_bar.front is set twice; keep one of them"),
])  # fmt: skip
def test_what_is_no_axis(content, keys, message):
    with pytest.raises(InputError) as error:
        ModelSpace(content, keys)
    assert message in str(error.value)


@pytest.mark.parametrize(("content", "keys", "points", "message"), [
    (TYRED, ["front_compliance.stiffness"], [[-5.0], [3000.0]], "stiffness = -5 N m/rad is not possible"),
    (TYRED, ["pressure_bar.front"], [[5.0], [25.0]], "is not possible; give values from 0 to 20"),
    (TYRED, ["pressure_bar.front"], [[5.0], [18.0]], "more than one range width outside the 3.5-7.5 bar"),
    (PLAIN, ["xB"], [[-0.9], [0.3]], "the front wheel bears no load"),
    (PLAIN, ["relaxation_length.relaxation_length"], [[0.1], [40.0]], "far outside the usual"),
    (TYRED, ["load_N.front"], [[0.0], [400.0]], "give loads above 0 N"),
])  # fmt: skip
def test_what_is_no_bicycle(content, keys, points, message):
    with pytest.raises(InputError) as error:
        ModelSpace(content, keys).refuse_impossible(points)
    assert message in str(error.value)


def test_usual_ranges():
    model = build_model(TYRED)
    assert typical_range(model, axis_of(model, "front_compliance.stiffness")) == (1000.0, 10000.0)
    low, high = typical_range(model, axis_of(model, "w"))
    assert (low, high) == (pytest.approx(0.4945), pytest.approx(1.4835))
    assert axis_of(model, "relaxation_length.cornering_stiffness.front").said == "cornering stiffness front"
    assert axis_of(model, "front_compliance.stiffness").column == "front_compliance_stiffness_N_m_rad"
    assert axis_of(model, "pressure_bar.front").column == "pressure_bar_front_bar"


@pytest.mark.parametrize(("read", "texts", "told"), [
    (numbers_by_name, ["c=0.01", "w=0"], {"c": 0.01, "w": 0.0}),
    (numbers_by_name, ["c"], "--sd c: give NAME=VALUE, for example --sd c=1 (SI units)"),
    (numbers_by_name, ["c=1", "c=2"], "--sd c is given twice; keep one"),
    (numbers_by_name, ["c=-1"], "--sd c=-1: the number must be finite and >= 0"),
    (numbers_by_name, ["c=inf"], "(SI units), finite"),
    (ranges_by_name, ["c=0.01:0.02"], {"c": (0.01, 0.02)}),
    (ranges_by_name, ["c=1"], "--limits c=1: give NAME=LOW:HIGH, for example --limits c=0.03:0.1"),
    (ranges_by_name, ["c=2:1"], "--limits c=2:1: the range must be finite, LOW below HIGH"),
])  # fmt: skip
def test_pairs_on_the_command_line(read, texts, told):
    more = ("--sd", "c=1") if read is numbers_by_name else ()
    if isinstance(told, dict):
        assert read(texts, *more) == told
        return
    with pytest.raises(InputError) as error:
        read(texts, *more)
    assert told in str(error.value)
