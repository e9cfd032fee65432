"""[covariance] of a model file: read, taken by every uncertainty, and what it refuses."""

import numpy as np
import pytest

from bicycle import critical_speeds
from bicycle.model import build_model, read_model, standard_deviations
from bicycle.stability import critical_speed_estimates, model_covariance
from studies.uncertainty import UncertainModel
from tyre.ground import InputError

DAMPED = {"bicycle": "benchmark", "effects": {"steer_damper": {"damping": 0.5}}}
NAMES = ["c", "steer_damper.damping"]
MATRIX = [[4e-6, -5e-5], [-5e-5, 1e-2]]


def stated(names=NAMES, matrix=MATRIX, **more):
    return DAMPED | {"covariance": {"parameters": names, "matrix": matrix}} | more


def test_it_is_the_covariance_of_the_model_and_says_where_it_is_from():
    model = build_model(stated())
    names, covariance = model_covariance(model)
    assert list(names) == NAMES
    np.testing.assert_array_equal(covariance, MATRIX)
    found = standard_deviations(model, assume=False)["c"]
    assert (found.sd, found.origin) == (pytest.approx(2e-3), "model file")


def test_critical_speeds_carry_it_with_its_correlation():
    """Against differences of the critical speed itself."""
    model = build_model(stated())
    (weave,) = [c for c in critical_speeds(model, 10.0) if c.mode == "weave"]

    def at(c, damping):
        moved = build_model({"bicycle": dict(model.bicycle.values) | {"c": c}, "effects": {"steer_damper": {
            "damping": damping}}})  # fmt: skip
        return next(one.speed for one in critical_speeds(moved, 10.0) if one.mode == "weave")

    c, step = model.bicycle["c"], 1e-4
    slope = np.array([at(c + step, 0.5) - at(c - step, 0.5), at(c, 0.5 + step) - at(c, 0.5 - step)]) / (2 * step)
    (estimate,) = critical_speed_estimates(model, [weave])
    assert estimate.sd == pytest.approx(np.sqrt(slope @ np.array(MATRIX) @ slope), rel=1e-4)


def test_random_bicycles_have_it():
    drawn = UncertainModel(stated())
    names, covariance = drawn.covariance()
    order = [names.index(name) for name in NAMES]
    np.testing.assert_allclose(covariance[np.ix_(order, order)], MATRIX, rtol=1e-6)


def test_a_zero_is_exact():
    found = standard_deviations(build_model(stated(matrix=[[4e-6, 0.0], [0.0, 0.0]])))["steer_damper.damping"]
    assert (found.sd, found.origin) == (0.0, "exact")


def test_it_survives_a_file(tmp_path):
    text = '[covariance]\nparameters = ["c"]\nmatrix = [[4e-6]]\n'
    (tmp_path / "model.toml").write_text(f'bicycle = "benchmark"\n{text}')
    assert read_model(tmp_path / "model.toml").sd == {"c": pytest.approx(2e-3)}


@pytest.mark.parametrize(("content", "words"), [
    (stated(names=["c", "cc"]), "\\[covariance\\]: unknown parameter 'cc'"),
    (stated(names=["c", "IByy"]), "\\[covariance\\]: unknown parameter 'IByy'"),
    (stated(names=["c", "c"]), "\\[covariance\\]: c is given twice; keep one"),
    (stated(names=[]), "parameters"),
    (stated(matrix=[[1.0]]), "matrix.* must be 2 rows of as many numbers"),
    (stated(matrix=[[1.0, 0.0], [0.0, "x"]]), "matrix.* must be 2"),
    (stated(matrix=[[1.0, 2.0], [2.0, 1.0]]), "must be symmetric without negative eigenvalues"),
    (stated(matrix=[[5e-324, 1.0], [1.0, 5e-324]]), "must be symmetric without negative eigenvalues"),
    (DAMPED | {"covariance": {"parameters": ["c"]}}, "give one of matrix and factor"),
    (DAMPED | {"covariance": {"parameters": ["c"], "matrix": [[1.0]], "colour": 1}}, "colour"),
    (DAMPED | {"covariance": 3.0}, "covariance"),
])  # fmt: skip
def test_what_is_no_covariance_is_refused(content, words):
    with pytest.raises(InputError, match=words):
        build_model(content)


def test_a_parameter_that_follows_another_or_is_stated_already_is_refused():
    tied = {"bicycle": "benchmark", "effects": {"front_compliance": {"stiffness": 3000.0, "damping": 10.0,
            "joint_x": 0.85, "joint_z": -0.8}}}  # fmt: skip
    assert build_model(tied).tied == {"front_compliance.axis_tilt": "lam"}
    with pytest.raises(InputError, match="front_compliance.axis_tilt equals lam of the bicycle and follows"):
        build_model(tied | {"covariance": {"parameters": ["front_compliance.axis_tilt"], "matrix": [[1.0]]}})
    own = build_model({"bicycle": "browser"}).bicycle
    assert own.sd
    key = next(iter(own.sd))
    with pytest.raises(InputError, match=f"the bicycle states an sd of {key} already; keep one of them"):
        build_model({"bicycle": "browser", "covariance": {"parameters": [key], "matrix": [[1e-9]]}})


MEASURED_TYRE = {
    "cornering_stiffness": "tyre",
    "relaxation_length": "tyre",
    "tyre": "Tyre1",
    "pressure_bar": 5.5,
}


def test_a_measured_tyre_brings_that_of_its_own_numbers():
    content = {"bicycle": "benchmark", "effects": {"relaxation_length": MEASURED_TYRE}}
    name = "relaxation_length.cornering_stiffness.front"
    assert name in build_model(content).sd
    with pytest.raises(InputError, match=f"the measured tyre states an sd of {name} already; give its numbers instead"):
        build_model(content | {"covariance": {"parameters": [name], "matrix": [[4e4]]}})


def test_a_front_frame_that_was_measured_goes_with_a_measured_tyre():
    """The file states the front, the table the tyre: both travel, each under its own name, without correlation."""
    front = {"stiffness": 4200.0, "damping": 17.0, "joint_x": 0.877, "joint_z": -0.614}
    names = ["front_compliance.stiffness", "front_compliance.joint_z"]
    matrix = [[1e4, -0.2], [-0.2, 1.6e-5]]
    content = {
        "bicycle": "pista_charlie_drops",
        "effects": {"relaxation_length": MEASURED_TYRE, "front_compliance": front},
        "covariance": {"parameters": names, "matrix": matrix},
    }
    model = build_model(content)
    found = standard_deviations(model)
    assert found[names[0]].sd == pytest.approx(100.0)
    assert found[names[0]].origin == "model file"
    assert found["relaxation_length.relaxation_length.front"].origin == "tyre table"
    drawn, covariance = UncertainModel(content).covariance()
    order = [drawn.index(name) for name in names]
    np.testing.assert_allclose(covariance[np.ix_(order, order)], matrix, rtol=1e-6)
    tyre = drawn.index("relaxation_length.relaxation_length.front")
    assert covariance[tyre, tyre] > 0
    assert covariance[tyre, order[0]] == pytest.approx(0.0, abs=1e-12)
