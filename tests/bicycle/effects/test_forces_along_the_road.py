"""Drive, brakes, gradient and wind: loads and forces by hand, and literature."""

import math

import numpy as np
import pytest
from built import built, effect, linear

from bicycle import Model, load_bicycle
from bicycle.model import build_model, step
from bicycle.motion import frequency_response, magic_formula_model, respond
from tests.validation.independent_derivation import draw, largest_error
from tyre import read_tyre
from tyre.ground import InputError

FRONT = {"joint_x": 0.8, "joint_z": -0.85}
TYRE = {"cornering_stiffness": 5000.0, "relaxation_length": 0.1}


def loads(bicycle, *effects) -> tuple[float, float]:
    model = Model(bicycle, effects)
    return model.evaluator.wheel_loads(model.parameters)[:2]


def whole(b) -> tuple[float, float, float]:
    """Mass (kg), mass times height (kg m) and spin-up of the wheels per acceleration (kg m) of a bicycle."""
    masses = {"mB": b["zB"], "mR": -b["rR"], "mH": b["zH"], "mF": -b["rF"]}
    moment = -sum(b[key] * z for key, z in masses.items())
    return sum(b[key] for key in masses), moment, b["IRyy"] / b["rR"] + b["IFyy"] / b["rF"]


@pytest.mark.parametrize("name", ["benchmark", "pista_rider", "crescendo"])
def test_braking_moves_load_by_the_height_of_the_mass_centre_and_the_spin_up(name):
    """N_front w = m g x + (B z + sum(Iyy / r) a) of the whole bicycle, B = m a; a gradient takes g cos(slope)."""
    b, brake, gradient = load_bicycle(name), 60.0, -0.08
    mass, moment, spins = whole(b)
    deceleration = brake / mass - b["g"] * math.sin(math.atan(-gradient))
    moved = (brake * moment / mass + spins * deceleration) / b["w"]
    rear, front = (load * math.cos(math.atan(gradient)) for load in b.static_loads)
    found = loads(b, effect("longitudinal", brake_force=brake, front_share=0.3, gradient=gradient))
    assert found == pytest.approx((rear - moved, front + moved), rel=1e-12)


def test_luggage_is_braked_too():
    b, bag = load_bicycle("benchmark"), effect("luggage", mass=12.0, x=-0.2, z=-0.7)
    braked = loads(b, bag, effect("longitudinal", brake_force=80.0))
    mass, moment, spins = whole(b)
    moved = 80.0 * (moment + 12.0 * 0.7 + spins) / (mass + 12.0) / b["w"]
    assert braked[1] - loads(b, bag)[1] == pytest.approx(moved, rel=1e-12)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_without_slip_the_yaw_rate_of_a_steer_angle_changes_with_the_speed(seed):
    """Kane's equations with the slips held at zero while the speed changes: S_u u' + S_q q' + (dv/dt) dS/dv x = 0."""
    model = draw(np.random.default_rng(seed), ["no_slip", "longitudinal"])
    assert largest_error(model, 2.0 + 3.0 * seed) < 1e-9


def test_a_front_wheel_that_rolls_freely_pushes_forward_while_the_rear_brakes():
    """The road gives it the torque that slows its spin: 0.28 kg m^2 on 0.35 m at 1 m/s^2 are 2.3 N."""
    b, deceleration = load_bicycle("benchmark"), 1.0
    pushed = b["IFyy"] / b["rF"] ** 2 * deceleration
    assert pushed == pytest.approx(2.3, abs=0.05)
    brake = whole(b)[0] * deceleration
    rolls = effect("longitudinal", brake_force=brake, front_share=-pushed / brake)
    model = Model(b, [effect("relaxation_length", **TYRE), rolls])
    assert not model.linear_model().warnings
    assert largest_error(model, 6.0) < 1e-9
    rear_only = Model(
        b, [effect("relaxation_length", **TYRE), effect("longitudinal", brake_force=brake, front_share=0)]
    )
    assert np.abs(model.linear_model().eigenvalues(6.0) - rear_only.linear_model().eigenvalues(6.0)).max() > 1e-3
    with pytest.raises(InputError, match=r"front_share = 70 is outside -1 \.\. 2"):
        effect("longitudinal", front_share=70.0)


@pytest.mark.parametrize(("forces", "wheel"), [({"brake_force": 800.0}, "rear"), ({"drive_force": 500.0}, "front")])
def test_forces_that_lift_a_wheel_are_refused(forces, wheel):
    with pytest.raises(InputError, match=f"lift the {wheel} wheel, whose load becomes -.* N; give smaller forces"):
        built(longitudinal=forces)


def test_luggage_behind_and_drive_lift_the_front_wheel_together():
    bag, drive = effect("luggage", mass=60.0, x=-0.3, z=-0.8), effect("longitudinal", drive_force=200.0)
    assert min(loads("benchmark", bag) + loads("benchmark", drive)) > 0
    with pytest.raises(InputError, match="lift the front wheel"):
        Model("benchmark", [bag, drive]).linear_model()


MEASURED = {"tyre": "Tyre2", "pressure_bar": 5.5, "extrapolate": True}


def braked_model(name: str, damping: float = 15.0, tyre: dict = MEASURED, **forces: float) -> Model:
    """Bicycle with a flexible front of 3000 N m/rad and a ``damping`` in N m s/rad."""
    front = FRONT | {"stiffness": 3000.0, "damping": damping}
    effects = {"relaxation_length": tyre, "longitudinal": forces, "front_compliance": front}
    return build_model({"bicycle": name, "effects": effects})


def wobble_growth(*model, **forces: float) -> float:
    """Growth rate (1/s) of wobble at 9 m/s of ``braked_model``."""
    values = braked_model(*model, **forces).linear_model().eigenvalues(9.0)
    return float(values[(values.imag > 30) & (values.imag < 55)].real.max())


def test_a_measured_tyre_is_taken_at_the_load_that_braking_leaves():
    model = braked_model("benchmark", brake_force=90.0)
    at = model.evaluator.wheel_loads(model.parameters)
    for wheel, load in zip(("rear", "front"), at, strict=False):
        expected = read_tyre("Tyre2").at(load=load, pressure=5.5e5)
        for key in ("cornering_stiffness", "relaxation_length"):
            assert model.parameters[f"relaxation_length.{key}.{wheel}"] == pytest.approx(getattr(expected, key))
    front = "relaxation_length.cornering_stiffness.front"
    assert model.parameters[front] > 1.1 * braked_model("benchmark").parameters[front]


@pytest.mark.parametrize("name", ["benchmark", "pista_rider"])
def test_braking_takes_damping_from_wobble_and_drive_gives_it(name):
    """Limebeer, Sharp & Evangelou (2001): braking or downhill destabilises wobble, drive or uphill settles it.

    Their frame twists with 34100 N m/rad and 99.7 N m s/rad (as in Sharp, 1994); the front here is damped alike.
    """
    front = (name, 3000.0 * 99.7 / 34100.0)
    steady = wobble_growth(*front)
    assert wobble_growth(*front, brake_force=150.0) > steady + 0.02
    assert wobble_growth(*front, brake_force=60.0, gradient=-0.065) > steady
    driven, uphill = wobble_growth(*front, drive_force=80.0), wobble_growth(*front, drive_force=60.0, gradient=0.065)
    assert driven < uphill < steady - 0.3


def test_a_well_damped_front_turns_what_braking_does_by_the_stiffer_tyre_alone():
    """The load of braking stiffens the front tyre, which moves the hinge more: its damper takes more energy."""
    by_numbers = {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}
    changes = {
        (name, damping): wobble_growth("benchmark", damping, tyre, brake_force=150.0)
        - wobble_growth("benchmark", damping, tyre)
        for name, tyre in (("measured", MEASURED), ("by numbers", by_numbers))
        for damping in (5.0, 40.0)
    }
    assert changes["measured", 5.0] > 0.1
    assert changes["measured", 40.0] < -0.1
    assert min(changes["by numbers", 5.0], changes["by numbers", 40.0]) > 0.02


def test_tyres_at_their_limit_are_not_braked():
    with pytest.raises(InputError, match="side grip .* is not known here; leave out longitudinal"):
        magic_formula_model(braked_model("benchmark", brake_force=60.0), speed=6.0)


def test_wind_from_the_side_pushes_drags_and_turns_by_its_yaw_angle():
    """Generalised forces of the input on lateral motion, yaw and lean at rest of the bicycle, by hand."""
    area, side, turning, x, z, density, speed = 0.45, 0.7, 0.2, 0.3, -1.15, 1.2, 12.0
    drag = {"drag_area": area, "side_area": side, "yaw_moment_area": turning, "centre_of_pressure_x": x,
            "centre_of_pressure_z": z, "air_density": density}  # fmt: skip
    model = linear("pista_rider", relaxation_length=TYRE, aerodynamic_drag=drag)
    assert model.inputs[-1] == "side_wind"
    assert model.declared.units["side_wind"] == "m/s"
    force = model.ranges[0].matrices.input_matrix(speed)[:, -1]
    push = density * speed / 2 * (area + side)
    for state, expected in (
        ("rear_lateral_velocity", push), ("yaw_rate", x * push + density * speed / 2 * turning),
        ("lean_rate", -z * push), ("steer_rate", 0.0), ("rear_lateral_force", 0.0),
    ):  # fmt: skip
        assert force[model.states.index(state)] == pytest.approx(expected, rel=1e-12)


def test_a_bicycle_that_drifts_with_the_wind_feels_none():
    """Only the relative wind counts: drifting sideways at the wind's speed gives the same force as neither."""
    drag = {"centre_of_pressure_z": -1.1, "side_area": 0.8}
    models = linear(relaxation_length=TYRE, aerodynamic_drag=drag), linear(relaxation_length=TYRE)
    with_drag, without = (model.ranges[0].matrices for model in models)
    drifting = with_drag.dynamics(9.0)[:, 0] - without.dynamics(9.0)[:, 0]
    np.testing.assert_allclose(drifting, -with_drag.input_matrix(9.0)[:, -1], atol=1e-9)


def test_side_wind_is_an_input_of_responses_and_simulation():
    """A steady wind that a stable bicycle has long felt: the motion is the frequency response at low frequency."""
    model = built(aerodynamic_drag={"centre_of_pressure_z": -1.0, "drag_area": 0.1})
    gust = step(2.0)
    moved = respond(model, speed=5.0, time=np.linspace(0, 120, 50), inputs={"side_wind": gust})
    gain = frequency_response(model, speed=5.0, input="side_wind", frequency_hz=1e-5).outputs["lean"][0]
    assert moved.outputs["lean"][-1] == pytest.approx(2.0 * gain.real, rel=1e-4)
    assert moved.outputs["lean"][-1] != 0
    with pytest.raises(InputError, match="unknown input 'side_wind'"):
        respond(built(), speed=5.0, time=[0.0, 1.0], inputs={"side_wind": gust})
