"""The unmodelled torque: what its coefficients do, by hand; that it can never be a cause that a diagnosis names."""

import numpy as np
import pytest
from built import built

from bicycle import Model, effect_class, registry
from bicycle.model import Deviation, standard_deviations
from studies.diagnosis import find_candidates
from tyre.ground import InputError

Residual = effect_class("unmodelled_torque")
STATES = ("lean", "steer", "lean_rate", "steer_rate")


def roots(*effects, speed=6.0):
    return np.sort_complex(Model("benchmark", effects).linear_model().eigenvalues(speed))


@pytest.mark.parametrize("torque", ["steer", "lean"])
@pytest.mark.parametrize("state", STATES)
def test_each_coefficient_feeds_a_state_back_to_a_torque(torque, state):
    """det(s E - F) of the bare bicycle, with the column of the torque fed with the row of the state."""
    bare = Model("benchmark").linear_model()
    matrices = bare.ranges[0].matrices
    column, row = bare.inputs.index(f"{torque}_torque"), bare.outputs.index(state)
    push, seen = matrices.input_matrix(6.0)[:, column], matrices.output_matrix(6.0)[row]
    closed = np.linalg.solve(matrices.mass, matrices.dynamics(6.0) + 1.7 * np.outer(push, seen))
    found = roots(Residual(**{f"{torque}_from_{state}": 1.7}))
    np.testing.assert_allclose(found, np.sort_complex(np.linalg.eigvals(closed)), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(("speed", "damping"), [(5.0, 1.0), (7.0, 1.0 + 0.5 + 0.25), (3.0, 1.0 - 0.5 + 0.25),
                                                (6.0, 1.0 + 0.25 + 0.0625)])  # fmt: skip
def test_slope_and_curve_count_spans_of_speed_from_the_middle(speed, damping):
    terms = {"steer_from_steer_rate": -1.0, "steer_from_steer_rate_slope": -0.5, "steer_from_steer_rate_curve": -0.25}
    found = roots(Residual(middle_speed=5.0, speed_span=2.0, **terms), speed=speed)
    np.testing.assert_allclose(found, roots(effect_class("steer_damper")(damping=damping), speed=speed), rtol=1e-10)


def test_it_is_never_a_candidate_whatever_is_asked_for():
    model = built(relaxation_length={"cornering_stiffness": 8000.0, "relaxation_length": 0.1})
    found, refused = find_candidates(model, {})
    assert "unmodelled_torque" not in {c.identifier for c in found}
    assert refused["unmodelled_torque"].startswith("an empirical term, never a name")
    for known, also in (({"unmodelled_torque": {}}, ()), ({}, ("unmodelled_torque",))):
        with pytest.raises(
            InputError, match="unmodelled_torque: an empirical term, never a name.*; it cannot be a cand"
        ):
            find_candidates(model, known, (), also)


def test_it_is_the_only_effect_without_a_cause():
    assert [name for name, kind in registry().items() if not kind.nameable] == ["unmodelled_torque"]


def test_no_size_of_a_fitted_torque_is_doubted_and_the_speeds_behind_it_are():
    """A slip of units cannot be told where nothing is known of the size."""
    fitted = Residual(lean_from_lean=-4000.0, steer_from_steer_rate=200.0, middle_speed=500.0)
    (only,) = fitted.doubts().values()
    assert only.text.startswith("unmodelled_torque.middle_speed = 500 m/s is outside the usual 2 .. 20")


def test_the_speeds_that_a_fitted_torque_refers_to_are_exact():
    """They say what its gains mean; as in a fit of it, they have no standard deviation."""
    model = Model("benchmark", [Residual(lean_from_lean=-4.0, middle_speed=6.0, speed_span=2.0)])
    deviations = standard_deviations(model)
    for name in ("middle_speed", "speed_span"):
        assert deviations[f"unmodelled_torque.{name}"] == Deviation(0.0, "exact", "chosen")
    assert deviations["unmodelled_torque.lean_from_lean"].sd == pytest.approx(0.4)
