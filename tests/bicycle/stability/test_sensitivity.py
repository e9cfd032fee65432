"""Derivatives of eigenvalues and critical speeds against high precision, differences and exact limits."""

import numpy as np
import pytest
from built import built
from eigenvalue_sets import assert_same_eigenvalues, in_order_of

from bicycle.files import load_bicycle
from bicycle.model import Model
from bicycle.stability import (
    CriticalSpeed,
    critical_speed_sensitivities,
    critical_speeds,
    pair_sensitivities,
    sensitivities,
    sensitivity,
)
from tests.validation.sensitivity_mpmath import ORDERS, compare, draw_model
from tyre.ground import InputError

TYRE = {"cornering_stiffness": {"rear": 6300.0, "front": 6020.0}, "relaxation_length": 0.1}


def flexible(lam_change: float = 0.0, **changes: float) -> Model:
    """The benchmark on relaxing tyres with a flexible front, whose hinge is perpendicular to the steer axis."""
    base, hinge = load_bicycle("benchmark"), {"joint_x": 0.8, "joint_z": -0.85} | changes
    return built(base.replace(lam=base["lam"] + lam_change), relaxation_length=TYRE, front_compliance=hinge)


@pytest.mark.parametrize("seed", [1, 4])
def test_random_models_against_fifty_digits(seed):
    """Five eigenvalue-parameter pairs of a model against central differences in mpmath; 50 in studies/validations."""
    generator = np.random.default_rng(seed)
    model = draw_model(generator)
    assert model.linear_model().order in ORDERS
    pairs = list(compare(model, generator))
    assert len(pairs) == 5
    assert max(pair.error for pair in pairs) < 1e-8


def test_speeds_are_batched_and_eigenvalues_are_the_models():
    speeds = [3.0, 8.0, 20.0]
    model = flexible()
    found = sensitivities(model, speeds)
    assert_same_eigenvalues(found.eigenvalues, model.linear_model().eigenvalues(speeds), rtol=1e-12, atol=1e-10)
    assert found.derivatives.shape == (3, 10, len(found.parameters))
    one = sensitivities(model, [8.0])
    np.testing.assert_allclose(found.derivatives[1], one.derivatives[0], rtol=1e-9, atol=1e-12)


def test_derivative_with_speed():
    model, h = flexible(), 1e-4
    found = sensitivities(model, [8.0])
    low, high = (in_order_of(found.eigenvalues[0], model.linear_model().eigenvalues(8.0 + s)) for s in (-h, h))
    np.testing.assert_allclose(found.d_dspeed[0], (high - low) / (2 * h), rtol=1e-6, atol=1e-7)


def test_a_parameter_that_does_not_occur_changes_nothing():
    """A hinge along x hides Izz of a body, one along z its Ixx, which equals IBxx of the bicycle here."""
    rider = {"mass": 30.0, "x": 0.5, "z": -1.1, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.95}
    leaning = sensitivities(built("pista_charlie_drops", rider_lean=rider), [6.0])
    assert (leaning.of("rider_lean.Izz") == 0).all()
    assert np.abs(leaning.of("rider_lean.Ixx")).max() > 1e-3
    seated = built("pista_charlie_drops", rider_saddle={"mass": 78.0})
    assert np.abs(sensitivities(seated, [6.0]).of("IBxx")).max() > 1e-3


def test_a_tied_parameter_moves_with_the_bicycle():
    """The hinge stays perpendicular to the steer axis unless its tilt is given: then the two are free of each other."""
    h = 1e-5
    found = sensitivities(flexible(), [8.0])
    assert "front_compliance.axis_tilt" not in found.parameters
    ends = [in_order_of(found.eigenvalues[0], flexible(s * h).linear_model().eigenvalues(8.0)) for s in (1, -1)]
    np.testing.assert_allclose(found.of("lam")[0], (ends[0] - ends[1]) / (2 * h), rtol=1e-6, atol=1e-6)
    given = sensitivities(flexible(axis_tilt=load_bicycle("benchmark")["lam"]), [8.0])
    total = given.of("lam") + given.of("front_compliance.axis_tilt")
    np.testing.assert_allclose(total, found.of("lam"), rtol=1e-9, atol=1e-10)
    assert np.abs(given.of("front_compliance.axis_tilt")).max() > 0.1


def test_an_unknown_parameter_is_named():
    found = sensitivities(flexible(), [8.0])
    with pytest.raises(InputError, match="unknown parameter 'front_compliance.stifness'; did you mean 'front_compl"):
        found.of("front_compliance.stifness")


def test_speed_zero_with_side_slip_is_refused():
    with pytest.raises(InputError, match="speed 0 m/s is not allowed"):
        sensitivities(built(side_slip={"cornering_stiffness": 6000.0}), [0.0])


@pytest.mark.parametrize("key", ["c", "IFyy", "lam"])
def test_critical_speeds_move_as_differences_say(key):
    base, h = load_bicycle("benchmark"), 1e-6
    critical = critical_speeds(built(relaxation_length=TYRE))
    assert [c.mode for c in critical] == ["weave", "capsize", "wobble"]
    found = critical_speed_sensitivities(built(relaxation_length=TYRE), critical)[key]
    beside = [built(base.replace(**{key: base[key] + s * h}), relaxation_length=TYRE) for s in (1, -1)]
    ends = [[c.speed for c in critical_speeds(model)] for model in beside]
    np.testing.assert_allclose(found, np.subtract(*ends) / (2 * h), rtol=1e-5, atol=1e-5)


def test_capsize_speed_does_not_move_with_the_relaxation_length():
    """It is a steady state: Pacejka, Tire and Vehicle Dynamics, ch. 11."""
    model = built(relaxation_length=TYRE)
    critical = [c for c in critical_speeds(model) if c.mode == "capsize"]
    found = critical_speed_sensitivities(model, critical)
    assert abs(found["relaxation_length.relaxation_length.front"][0]) < 1e-8
    assert abs(found["relaxation_length.cornering_stiffness.front"][0]) > 1e-6


def test_a_jump_at_a_switch_speed_moves_with_the_switch():
    """A critical speed where no root is on the axis is the speed at which the equations switch."""
    model = built(steer_assist={"gain": 0.0, "fade_speed": 8.0, "lean_gain": 60.0})
    found = sensitivities(model, [8.0, 8.5])
    assert np.abs(found.of("steer_assist.lean_gain")[0]).max() == 0  # the switch speed belongs to the range below
    assert np.abs(found.of("steer_assist.lean_gain")[1]).max() > 0
    jump = CriticalSpeed(8.0, "oscillatory", "weave", 1.0, "destabilising")
    moved = critical_speed_sensitivities(model, [jump])
    assert moved["steer_assist.fade_speed"][0] == 1
    assert moved["c"][0] == 0


def meeting(model: Model, low: float, high: float) -> float:
    """Speed at which two real roots become a pair, by bisection of the number of real roots."""
    linear = model.linear_model()

    def real_roots(v: float) -> int:
        return int((np.abs(linear.eigenvalues(v).imag) < 1e-12).sum())

    below = real_roots(low)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if real_roots(middle) == below else (low, middle)
    return (low + high) / 2


def test_sum_and_product_move_smoothly_through_a_double_root():
    """At the meeting the single derivatives are huge; sum and product agree with differences of both roots."""
    model, h = flexible(), 1e-4
    linear = model.linear_model()
    speed = meeting(model, 0.05, 2.5)
    values = linear.eigenvalues(speed)
    gaps = np.abs(values[:, None] - values) + 1e9 * np.eye(len(values))
    i, j = np.unravel_index(gaps.argmin(), gaps.shape)
    assert gaps[i, j] < 1e-5
    found = pair_sensitivities(model, speed, (values[i], values[j]))
    assert found.sum == pytest.approx((values[i] + values[j]).real, rel=1e-9)
    assert found.product == pytest.approx((values[i] * values[j]).real, rel=1e-9)
    assert np.abs(sensitivities(model, [speed]).of("c")[0, [i, j]]).max() > 1e3

    def moved(c_change: float) -> tuple[float, float]:
        changed = Model(model.bicycle.replace(c=model.bicycle["c"] + c_change), model.effects).linear_model()
        near = changed.eigenvalues(speed)
        pair = near[np.argsort(np.abs(near - found.sum / 2))[:2]]
        return float(pair.sum().real), float(pair.prod().real)

    (sum_up, product_up), (sum_down, product_down) = moved(h), moved(-h)
    at = found.parameters.index("c")
    assert found.of_sum[at] == pytest.approx((sum_up - sum_down) / (2 * h), rel=1e-4)
    assert found.of_product[at] == pytest.approx((product_up - product_down) / (2 * h), rel=1e-4)


def test_a_pair_of_unrelated_roots_is_refused():
    values = flexible().linear_model().eigenvalues(8.0)
    pair = values[values.imag > 1]
    with pytest.raises(InputError, match="are no pair; give two real roots or a root and its conjugate"):
        pair_sensitivities(flexible(), 8.0, (pair[0], pair[1]))


def test_first_order_is_the_sum_of_products():
    rng = np.random.default_rng(4)
    left, right = (rng.normal(size=(2500, 5)) + 1j * rng.normal(size=(2500, 5)) for _ in range(2))
    stacks = [rng.normal(size=(3, 5, 5)) * (rng.random((5, 5)) < 0.4) for _ in range(2)]
    weights = [rng.normal(size=2500), rng.normal(size=2500) + 1j]
    terms = list(zip(weights, stacks, strict=True))
    expected = sum(w[:, None] * np.einsum("ki,pij,kj->kp", left, stack, right) for w, stack in terms)
    found = sensitivity.eigenvalue_derivative_terms(left, right, terms)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
