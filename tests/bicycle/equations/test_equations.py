"""What an effect of a user may put into the equations, and what is refused with a reason."""

import numpy as np
import pytest
import sympy as sp

from bicycle import Effect, Model, Parameter, effect_class, load_bicycle
from tyre.ground import InputError

BICYCLE = load_bicycle("benchmark")
TYRES = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)
SIZE = 3.0


def effect(add):
    """An effect with one parameter that adds to a model what ``add(model, size)`` says."""

    class Toy(Effect):
        """A toy."""

        identifier = "toy"
        size = Parameter("1", "of the toy", bounds=(0.0, 10.0), typical=(1.0, 5.0), default=SIZE)

        def apply(self, model):
            add(model, self.size)

    return Toy()


def steer(factor):
    """Adds a torque on the steering: ``factor(model, size)`` times the angle."""
    return lambda model, size: model.add_torque(model.steer, -factor(model, size) * model.steer.angle)


def lagged(model, size):
    """A torque that follows the lateral force of the front tyre."""
    state = model.add_state("lagged", unit="N m")
    model.set_rate(state, (size * model.wheels[1].lateral_force - state) / 0.1)


FRONT_LOAD = BICYCLE.static_loads[1]


@pytest.mark.parametrize(("factor", "stiffness"), [
    (lambda model, size: size, SIZE),
    (lambda model, size: sp.Piecewise((size, size > 2), (0, True)), SIZE),
    (lambda model, size: sp.Piecewise((0, size > 2), (size, True)), 0.0),
    (lambda model, size: sp.sqrt(size) * sp.exp(-size) + sp.Max(size, 4), SIZE**0.5 * np.exp(-SIZE) + 4),
    (lambda model, size: size / 100 * model.wheels[1].static_load, SIZE / 100 * FRONT_LOAD),
    (lambda model, size: sp.pi * abs(1 - size), 2 * np.pi),
    (lambda model, size: ((model.speed + size) ** 2 - model.speed**2) / size - 2 * model.speed, SIZE),
    (lambda model, size: model.speed * (size / model.speed), SIZE),
])  # fmt: skip
def test_a_spring_may_be_written_in_many_ways(factor, stiffness):
    own = Model(BICYCLE, effect(steer(factor))).linear_model()
    known = Model(BICYCLE, effect_class("steer_spring")(stiffness=stiffness)).linear_model()
    assert set(own.coefficients[0]) == set(known.coefficients[0])
    for speed in (0.0, 6.0):
        np.testing.assert_allclose(own.eigenvalues(speed), known.eigenvalues(speed), rtol=1e-12)


def test_a_sum_within_a_function_may_be_linear_in_the_motion():
    """The case distinction stands around the angle."""

    def add(model, size):
        model.add_torque(model.steer, sp.Piecewise((-size * model.steer.angle, size > 1), (0, True)))

    known = Model(BICYCLE, effect_class("steer_spring")(stiffness=SIZE)).linear_model()
    own = Model(BICYCLE, effect(add)).linear_model()
    np.testing.assert_allclose(own.eigenvalues(6.0), known.eigenvalues(6.0), rtol=1e-12)


def test_a_motor_may_be_told_what_the_tyre_does():
    """A command in terms of a lateral force, which is itself made of slip velocities."""

    def told(model, size):
        model.motor.tell(size / 100 * model.wheels[1].lateral_force)

    def added(model, size):
        model.add_torque(model.steer, size / 100 * model.wheels[1].lateral_force)

    one, other = (Model(BICYCLE, (TYRES, effect(add))).linear_model() for add in (told, added))
    np.testing.assert_allclose(one.eigenvalues(6.0), other.eigenvalues(6.0), rtol=1e-12)


@pytest.mark.parametrize(("add", "words"), [
    (steer(lambda model, size: size * model.speed**3), r"the rate of the state '\w+' depend on speed\^3; equ"),
    (steer(lambda model, size: size / model.speed**2), r"depend on speed\^-2; equations hold v\^-1 to v\^2 only"),
    (steer(lambda model, size: sp.sqrt(model.speed)), r"depends on the speed as sqrt\(v\) does; equations hold"),
    (steer(lambda model, size: model.steer.angle), "which is not linear in 'steer'; give its linearisation"),
    (steer(lambda model, size: model.lean.rate), "which is not linear in '.*'; give its linearisation for small"),
    (steer(lambda model, size: size * sp.Symbol("own")), "puts 'own' where only parameters of bicycle and effects"),
    (lambda model, size: model.add_inertia(model.steer, model.speed * model.lean.angle), "puts '.*' where only"),
    (lambda model, size: model.add_input("lean_torque", unit="N m"), "the name 'lean_torque' of an input is taken"),
    (lambda model, size: model.motor.tell(size * model.motor.command), "makes the steer motor command depend on i"),
    (lagged, "rate of the state 'lagged' depends on a lateral force, of which held contacts know nothing; give its e"),
    (
        lambda model, size: model.add_torque(model.steer, size * model.speed * model.wheels[1].lateral_force),
        "an effect takes a lateral force times a power of the speed; with held contacts it must not",
    ),
])  # fmt: skip
def test_what_the_equations_cannot_hold_is_refused(add, words):
    with pytest.raises(InputError, match=words):
        Model(BICYCLE, effect(add)).linear_model()


def test_a_state_may_follow_a_lateral_force_of_tyres():
    assert "lagged" in Model(BICYCLE, (TYRES, effect(lagged))).linear_model().states
