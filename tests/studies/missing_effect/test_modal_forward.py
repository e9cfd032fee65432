"""Predicted eigenvalues, ratios and derivatives against the model and against differences of the whole prediction."""

import pickle

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from bicycle.modal.named_modes import modes
from studies.missing_effect.motion.candidates import find_candidates
from studies.missing_effect.motion.modal_forward import ModalForward
from studies.missing_effect.motion.modal_table import ModalPoint
from studies.missing_effect.motion.nuisances import nuisances
from studies.missing_effect.motion.ratio_sensors import apply_sensor, measurement_candidates
from studies.missing_effect.motion.sensor_errors import geometry_errors
from studies.missing_effect.motion.slopes import Slopes

TYRE = {"cornering_stiffness": {"rear": 6000.0, "front": 4500.0}, "relaxation_length": 0.1}


def forward_at(model, speeds, mode="weave"):
    found = modes(model.linear_model(), speeds)
    shape = found.shape(mode).phasors
    points = tuple(
        ModalPoint(
            v, mode, z, (0.05, 0.05), {"steer_over_lean": (s[1] / s[0], 0.02), "yaw_over_lean": (s[2] / s[0], 0.02)}
        )
        for v, z, s in zip(speeds, found.branch(mode)[:, 0], shape, strict=True)
    )
    unknowns, _ = nuisances(model, {})
    candidates, refused = find_candidates(model, {})
    sensors = measurement_candidates(("steer_over_lean", "yaw_over_lean"), speeds) + geometry_errors(model, unknowns)[0]
    return ModalForward(
        base=model, points=points, nuisances=unknowns, candidates=(*candidates, *sensors), refused=refused
    )


@pytest.fixture(scope="module", params=["rolling", "tyre"])
def forward(request):
    effects = () if request.param == "rolling" else (effect_class("relaxation_length")(**TYRE),)
    return forward_at(Model(load_bicycle("benchmark"), effects), [4.5, 5.5, 7.0])


def test_the_modes_of_the_model_itself_leave_no_residual(forward):
    residual, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]))
    assert np.abs(residual).max() < 1e-8


def test_a_dense_series_of_speeds_is_more_than_one_and_repeats_are_not():
    model = Model(load_bicycle("benchmark"))
    assert forward_at(model, [5.0, 5.1, 5.2, 5.3, 5.4]).varied  # each within 5 % of the next
    assert not forward_at(model, [5.0, 5.1, 5.2]).varied


def test_derivatives_agree_with_differences_of_the_prediction(forward):
    for candidate in forward.candidates:
        unknowns = (*forward.nuisances, *candidate.unknowns)
        theta = np.concatenate([[u.centre for u in forward.nuisances], candidate.starts[1]])
        _, jacobian = forward.residual((candidate,), theta)
        for k, u in enumerate(unknowns):
            h = np.zeros_like(theta)
            h[k] = 1e-3 * (min(u.scale, theta[k]) if u.lowest > 0 else u.scale)
            plus, minus = (forward.residual((candidate,), theta + s * h, slopes=False)[0] for s in (1, -1))
            numeric = (plus - minus) / (2 * h[k])
            scale = max(np.abs(numeric).max(), 1e-3 / u.scale)
            assert np.abs(jacobian[:, k] - numeric).max() < 3e-4 * scale, (candidate.identifier, u.name)


def test_matrix_slopes_agree_with_the_symbolic_derivative(forward):
    family = forward.family(())
    theta = np.array([u.centre for u in forward.nuisances])
    n = len(family.models.scale)
    slope = Slopes(family, theta, np.array([5.0])).applied("dynamics", np.array([0]), np.eye(n)[None] + 0j)[0]
    for key in ("lam", "IBxx", "c"):
        k = [u.name for u in forward.nuisances].index(key)
        exact = family.models.evaluate.derivative(key, forward.base.parameters)
        total = sum(5.0**power * matrix for power, matrix in exact.dynamics.items()) * family.models.scale
        np.testing.assert_allclose(slope[k].real, total, rtol=1e-6, atol=1e-6 * np.abs(total).max())


def test_a_mode_without_lean_is_not_finite_and_no_warning():
    """A warning of numpy would reach the user's terminal in the middle of a search."""
    errors = [(0, 0.1), (1, 0.02), (2, 0.05)]
    for power in (1, -1):
        number = np.array([[-20.0 + 0j, np.inf + 0j, 1.0]])  # 1 / (1 + root tau) is infinite too
        slope = np.full((1, 3, 3), np.inf + 0j)
        apply_sensor(number, slope, 1, errors, power=power)
        assert not np.isfinite(number[0, 1])
        assert np.isfinite(number[0, [0, 2]]).all()


def test_a_speed_with_two_modes_uses_each_root_once():
    model = Model(load_bicycle("benchmark"), (effect_class("relaxation_length")(**TYRE),))
    found = modes(model.linear_model(), [8.0])
    weave, wobble = (complex(found.branch(name)[0, 0]) for name in ("weave", "wobble"))
    near = 0.6 * weave + 0.4 * wobble  # the nearest root of this one is weave
    points = (ModalPoint(8.0, "weave", weave, (0.1, 0.1)), ModalPoint(8.0, "wobble", near, (0.1, 0.1)))
    forward = ModalForward(base=model, points=points, nuisances=(), candidates=())
    residual, _ = forward.residual((), np.empty(0))
    np.testing.assert_allclose(residual[:2], 0, atol=1e-6)
    assert residual[3] == pytest.approx((near - wobble).imag / 0.1)


def test_the_proposed_forced_response_is_that_of_the_model(forward):
    """Against python-control's frequency response of the same model; derivatives against differences."""
    nominal = np.array([u.centre for u in forward.nuisances])
    extra = forward.forced(7.0)[0]
    assert extra.speed == 7.0
    assert "swept steer torque, 0.5-4 Hz, at 7 m/s" in extra.what
    predicted, slope = forward.predict(extra, (), nominal)
    plant = forward.base.linear_model().to_control(
        7.0, inputs=["steer_torque"], outputs=["lean_rate", "steer", "yaw_rate"]
    )
    expected = np.stack([plant(1j * w)[:, 0] for w in 2 * np.pi * np.geomspace(0.5, 4.0, 6)]).ravel()
    seen = (predicted * extra.sd).reshape(-1, 2)
    assert np.allclose(seen[:, 0] + 1j * seen[:, 1], expected, rtol=1e-8)
    k = [u.name for u in forward.nuisances].index("zB")
    h = 1e-4 * np.eye(len(nominal))[k]
    numeric = (forward.predict(extra, (), nominal + h)[0] - forward.predict(extra, (), nominal - h)[0]) / 2e-4
    assert np.allclose(slope[:, k], numeric, rtol=1e-3, atol=1e-3 * np.abs(numeric).max())


def test_no_speed_is_proposed_that_is_far_beyond_those_measured(forward):
    assert [one.speed for one in forward.forced(6.0)] == [6.0, 7.5]


def test_a_bicycle_that_falls_is_not_proposed_for_a_sweep(forward):
    assert forward.forced(1.0) == ()  # 1 and 1.25 m/s, far below the weave speed


def test_it_can_be_sent_to_another_process_after_use(forward):
    theta = np.array([u.centre for u in forward.nuisances])
    residual, _ = forward.residual((), theta)
    again, _ = pickle.loads(pickle.dumps(forward)).residual((), theta)
    np.testing.assert_array_equal(again, residual)
