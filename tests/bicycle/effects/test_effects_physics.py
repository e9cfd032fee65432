"""The effects against exact kinematics, limits that must hold and what the literature reports."""

import math
from collections.abc import Mapping
from itertools import combinations_with_replacement

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues
from scipy.optimize import brentq, linear_sum_assignment, root
from scipy.spatial.transform import Rotation

from bicycle import Effect, Model, critical_speeds, effect_class, load_bicycle
from bicycle.parameters import Bicycle
from tyre.errors import InputError

PER_DEG = 180 / math.pi
TYRE = {"cornering_stiffness": {"rear": 110 * PER_DEG, "front": 105 * PER_DEG}}
HINGE = {"joint_x": 0.8, "joint_z": -0.85}
RIDER = {"mass": 40.0, "x": 0.35, "z": -1.2, "Ixx": 3.0, "Izz": 1.0, "Ixz": 0.5, "joint_z": -0.9}


def bicycle() -> Bicycle:
    return load_bicycle("benchmark")


def heavy() -> Bicycle:
    """The benchmark with a synthetic rear frame that contains the moving body above."""
    return bicycle().replace(mB=125.0, xB=0.316, zB=-0.996, IBxx=14.648, IBzz=3.868, IBxz=3.308)


def effect(identifier: str, **parameters: object) -> Effect:
    return effect_class(identifier)(**parameters)


def relaxing(length: float, **parameters: object) -> Effect:
    return effect("relaxation_length", **({**TYRE, "relaxation_length": length} | parameters))


def linear(*effects: Effect, of: Bicycle | None = None):
    return Model(of or bicycle(), effects).linear_model()


# ------------------------------------------------------------------------- exact kinematics, coded independently


def exact_work(p: Mapping[str, float], angles: np.ndarray, *, tilt: float, crown: tuple[float, float], drag: float):
    """Potential of weight and drag (J) on level ground with exact 3-D rotations; both wheels touch, pitch is solved.

    ``angles`` = lean, hinge of the front assembly, sway of the rider, steer. The wheels are tori of the crown radii.
    The drag acts at z = -1.1 m against a drive force at the rear contact.
    """
    lean, hinge, sway, steer = angles
    axes = {
        "hinge": (Rotation.from_rotvec(hinge * np.array([math.cos(tilt), 0, -math.sin(tilt)])), [0.8, 0, -0.85]),
        "sway": (Rotation.from_rotvec([sway, 0, 0]), [0, 0, -0.9]),
        "steer": (
            Rotation.from_rotvec(steer * np.array([math.sin(p["lam"]), 0, math.cos(p["lam"])])),
            [p["w"] + p["c"], 0, 0],
        ),
    }
    front = ("hinge", "steer")

    def place(point, turning, heave, pitch):
        for name in reversed(turning):
            rotation, pivot = axes[name]
            point = np.array(pivot) + rotation.apply(np.array(point) - pivot)
        return ground(pitch).apply(point) + np.array([0, 0, heave])

    def ground(pitch):
        return Rotation.from_rotvec([lean, 0, 0]) * Rotation.from_rotvec([0, pitch, 0])

    def lowest(centre, radius, rho, turning, heave, pitch):
        axle = ground(pitch)
        for name in turning:
            axle = axle * axes[name][0]
        down = axle.apply([0, 1, 0])[2]
        return place(centre, turning, heave, pitch)[2] + (radius - rho) * math.sqrt(1 - down**2) + rho

    wheels = ([0, 0, -p["rR"]], p["rR"], crown[0], ()), ([p["w"], 0, -p["rF"]], p["rF"], crown[1], front)
    posture = root(lambda posture: [lowest(*wheel, *posture) for wheel in wheels], [0, 0], tol=1e-14)
    assert np.abs(posture.fun).max() < 1e-13
    heave, pitch = posture.x
    masses = [
        (p["mB"], [p["xB"], 0, p["zB"]], ()), (-40.0, [0.35, 0, -1.2], ()), (40.0, [0.35, 0, -1.2], ("sway",)),
        (p["mH"], [p["xH"], 0, p["zH"]], front), (p["mR"], wheels[0][0], ()), (p["mF"], wheels[1][0], front),
    ]  # fmt: skip
    weight = sum(-p["g"] * mass * place(point, turning, heave, pitch)[2] for mass, point, turning in masses)
    return weight + drag * (place([0.3, 0, -1.1], (), heave, pitch)[0] - place([0, 0, 0], (), heave, pitch)[0])


def exact_hessian(**how) -> np.ndarray:
    """Second derivatives by central differences, extrapolated to step zero."""

    def at_step(h):
        hessian, steps = np.zeros((4, 4)), h * np.eye(4)
        for i, j in combinations_with_replacement(range(4), 2):
            for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                hessian[i, j] += a * b * exact_work(angles=a * steps[i] + b * steps[j], **how) / (4 * h * h)
            hessian[j, i] = hessian[i, j]
        return hessian

    return (4 * at_step(0.01) - at_step(0.02)) / 3


@pytest.mark.parametrize(
    ("tilt", "crown", "drag"), [(0.3, (0.0, 0.0), 0.0), (0.3, (0.013, 0.02), 0.0), (0.1, (0.03, 0.01), 25.0)]
)
def test_stiffness_equals_the_exact_nonlinear_potential(tilt, crown, drag):
    """Weight, contact heights of toroidal wheels, hinges and the load shift of the drag, with pitch solved exactly."""
    speed = 10.0
    effects = [
        relaxing(0.1),
        effect("crown_radius", crown_radius={"rear": crown[0], "front": crown[1]}),
        effect("front_compliance", stiffness=0.0, axis_tilt=tilt, **HINGE),
        effect("rider_lean", stiffness=0.0, **RIDER),
        effect("aerodynamic_drag", drag_area=2 * drag / speed**2, air_density=1.0, centre_of_pressure_z=-1.1),
    ]
    model = linear(*effects, of=heavy())
    joints = ["lean", "front_compliance", "rider_lean", "steer"]
    rows = [model.states.index(f"{joint}_rate") for joint in joints]
    columns = [model.states.index(joint) for joint in joints]
    dynamics = model.ranges[0].matrices.dynamics
    # the kinematics of the tyres enters the side forces, the spinning wheels the rates: angles see only the potential
    found = -sum(speed**power * dynamics[power][np.ix_(rows, columns)] for power in (0, 2) if power in dynamics)
    exact = exact_hessian(p=heavy().values, tilt=tilt, crown=crown, drag=drag)
    np.testing.assert_allclose(found, exact, atol=1e-6 * np.abs(exact).max(), rtol=0)


def test_drag_turns_the_leaning_bicycle_and_loads_the_rear_wheel():
    """Virtual work of drag and drive force on yaw, from rotated points, next to the yaw row of the model."""
    area, density, z, h = 0.5, 1.2, -1.05, 1e-4
    lean = Rotation.from_rotvec([h, 0, 0])

    def forward(yaw):
        return (Rotation.from_rotvec([0, 0, yaw]) * lean).apply([0.2, 0, z])[0]

    per_speed_squared = -density * area / 2 * (forward(h) - forward(-h)) / (2 * h) / h
    model = linear(
        relaxing(0.1), effect("aerodynamic_drag", drag_area=area, air_density=density, centre_of_pressure_z=z)
    )
    added = model.ranges[0].matrices.dynamics[2]
    yaw, lateral = model.states.index("yaw_rate"), model.states.index("rear_lateral_velocity")
    assert per_speed_squared > 0  # a bicycle that leans right is turned to the right
    np.testing.assert_allclose(added[yaw, model.states.index("lean")], per_speed_squared, rtol=1e-7)
    np.testing.assert_array_equal(added[lateral], 0)


# ------------------------------------------------------------------------- limits and equivalences


def test_aligning_moment_with_the_stiffness_of_a_trail_is_pneumatic_trail():
    trail = {"rear": 0.016, "front": 0.019}
    length = {"rear": 0.11, "front": 0.09}
    stiffness = {wheel: trail[wheel] * TYRE["cornering_stiffness"][wheel] for wheel in trail}
    tyre = relaxing(0.1, relaxation_length=length)
    with_trail = linear(tyre, effect("pneumatic_trail", trail=trail))
    with_moment = linear(tyre, effect("aligning_moment", aligning_stiffness=stiffness, relaxation_length=length))
    assert with_moment.states[-2:] == ("rear_side_force", "front_side_force")
    assert {"rear_aligning_moment", "front_aligning_moment"} < set(with_moment.states)
    for speed in (1.0, 5.0, 12.0, 30.0):
        expected, found = with_trail.eigenvalues(speed), with_moment.eigenvalues(speed)  # two lags more
        missed = np.abs(expected[:, None] - found)
        assert (missed[linear_sum_assignment(missed)] <= 1e-12 * np.maximum(np.abs(expected), 1)).all()


def test_wheel_compliance_is_a_spring_in_series_with_the_tyre():
    """Relaxation length C (1/K_y + 1/K_w); K_y = C / relaxation length of the tyre alone."""
    stiffness, hub, length = TYRE["cornering_stiffness"], {"rear": 2e5, "front": 1e5}, 0.08
    longer = {k: stiffness[k] * (1 / (stiffness[k] / length) + 1 / hub[k]) for k in stiffness}
    soft = linear(relaxing(length), effect("wheel_compliance", stiffness=hub))
    alone = linear(relaxing(0.1, relaxation_length=longer))
    speeds = [0.0, 6.0, 25.0]
    assert_same_eigenvalues(soft.eigenvalues(speeds), alone.eigenvalues(speeds), rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("contact", [(), (relaxing(0.1),)], ids=["no slip", "relaxing tyre"])
@pytest.mark.parametrize(
    ("identifier", "geometry"), [("front_compliance", HINGE), ("rider_lean", RIDER)], ids=["front", "rider"]
)
def test_a_locked_joint_returns_to_the_rigid_bicycle_as_one_over_stiffness(contact, identifier, geometry):
    rigid = linear(*contact, of=heavy()).eigenvalues(6.0)
    errors = []
    for stiffness in (1e6, 1e7, 1e8):
        found = linear(*contact, effect(identifier, stiffness=stiffness, **geometry), of=heavy()).eigenvalues(6.0)
        errors.append(max(np.abs(found - value).min() for value in rigid))
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(10, rel=0.005)  # the next order is gone


def test_arms_add_to_the_steering_only():
    """Inertia, damper and spring stand in the steer row and nowhere else."""
    model, bare = linear(effect("rider_arms", inertia=0.2, stiffness=7.0, damping=1.5)), linear()
    steer, rate = model.states.index("steer"), model.states.index("steer_rate")
    mass = model.ranges[0].matrices.mass - bare.ranges[0].matrices.mass
    force = model.ranges[0].matrices.dynamics[0] - bare.ranges[0].matrices.dynamics[0]
    expected = np.zeros((2, *mass.shape))
    expected[0, rate, rate], expected[1, rate, steer], expected[1, rate, rate] = 0.2, -7.0, -1.5
    np.testing.assert_allclose([mass, force], expected, atol=1e-12)
    spring = linear(effect("steer_spring", stiffness=7.0)).ranges[0].matrices.dynamics[0]
    np.testing.assert_allclose((spring - bare.ranges[0].matrices.dynamics[0])[rate, steer], -7.0, rtol=1e-12)


def test_steer_assist_follows_its_law_on_each_side_of_the_fade_speed():
    """Torque gain (v_fade - v) d(lean)/dt below, lean_gain (v - v_fade) lean above, nothing at the fade speed."""
    model, bare = linear(effect("steer_assist", gain=8.0, fade_speed=5.0, lean_gain=3.0)), linear()
    row = model.states.index("steer_rate")
    inputs = bare.ranges[0].matrices.mass[:, row]
    assert inputs.any()
    assert [(piece.lower, piece.upper) for piece in model.ranges] == [(0.0, 5.0), (5.0, math.inf)]
    for speed, rate_gain, lean_gain in ((2.0, 24.0, 0.0), (5.0, 0.0, 0.0), (7.0, 0.0, 6.0)):
        change = model.matrices_at(speed)[0] - bare.matrices_at(speed)[0]
        torque = bare.ranges[0].matrices.mass @ change
        expected = np.zeros_like(torque)
        expected[row, model.states.index("lean_rate")] = rate_gain
        expected[row, model.states.index("lean")] = lean_gain
        np.testing.assert_allclose(torque, expected, atol=1e-10)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mass": 125.0}, "mass = 125 kg leaves 0 kg of the rear frame .*must contain the moving body"),
        ({"Ixx": 20.0}, "what remains of the rear frame has a negative principal inertia"),
        ({"z": -2.5}, "what remains of the rear frame has a negative principal inertia"),
        ({"Ixz": 2.0}, "the moving body has a negative principal inertia"),
    ],
)
def test_a_body_that_is_not_in_the_rear_frame_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        Model(heavy(), (effect("rider_lean", **{**RIDER, **change}),))


def test_a_crown_wider_than_the_wheel_is_refused():
    with pytest.raises(InputError, match="crown_radius.front = 0.4 m is larger than the wheel .*half the width"):
        Model(bicycle(), (effect("crown_radius", crown_radius={"rear": 0.01, "front": 0.4}),))


# ------------------------------------------------------------------------- what the literature reports


def capsize(model, speed: float) -> float:
    """The slow real eigenvalue (1/s)."""
    found = model.eigenvalues(speed)
    real = found[np.abs(found.imag) < 1e-9].real
    return float(real[np.abs(real).argmin()])


@pytest.mark.parametrize("contact", [(), (relaxing(0.1),)], ids=["no slip", "relaxing tyre"])
def test_twisting_torque_stabilises_capsize(contact):
    """The torque steers into the lean. Cossalter, Motorcycle Dynamics, ch. 2 and 7; Pacejka, ch. 11."""
    growth = [
        capsize(linear(*contact, effect("twisting_torque", twisting_stiffness=k)), 9.0) for k in (0.0, 1.0, 3.0, 10.0)
    ]
    assert growth[0] > 0
    assert growth[-1] < 0
    assert np.all(np.diff(growth) < 0)


def pair(model, speed: float, slowest: float, fastest: float) -> complex:
    """The least stable pair with a frequency (rad/s) in a band."""
    found = model.eigenvalues(speed)
    inside = found[(found.imag > slowest) & (found.imag < fastest)]
    return complex(inside[inside.real.argmax()])


def test_assist_stabilises_weave_at_low_speed():
    """Schwab, Kooijman & Meijaard (2008): lean-rate feedback lowers the speed above which a bicycle balances itself."""

    def lowest_stable(*effects):
        model = linear(*effects)
        return brentq(lambda v: pair(model, v, 0.1, 20).real, 1.7, 5.5)

    assert lowest_stable() == pytest.approx(4.29238253634111, rel=1e-9)  # Meijaard et al. (2007)
    assert lowest_stable(effect("steer_assist", gain=4.0, fade_speed=6.0)) < 3.0


def test_a_rounder_tyre_falls_more_slowly():
    """A wheel that rolls sideways on its crown raises the effective support: Cossalter, Motorcycle Dynamics, ch. 1."""
    fall = [linear(effect("crown_radius", crown_radius=r)).eigenvalues(0.0).real.max() for r in (0.0, 0.01, 0.03)]
    assert np.all(np.diff(fall) < 0)


def test_drag_of_a_toroidal_tyre_pulls_beside_the_mid_plane():
    """The rear contact lies rho gamma beside the wheel plane, so the lever of drag and drive is height minus rho."""
    rho, height, air = 0.02, 1.1, 1.2 * 0.4 / 2
    drag = effect("aerodynamic_drag", drag_area=0.4, air_density=1.2, centre_of_pressure_z=-height)
    crown = effect("crown_radius", crown_radius=rho)
    bare, model = linear(relaxing(0.1), crown), linear(relaxing(0.1), drag, crown)
    added = model.ranges[0].matrices.dynamics[2]
    yaw, lean = model.states.index("yaw_rate"), model.states.index("lean")
    assert 2 not in bare.ranges[0].matrices.dynamics
    assert added[yaw, lean] == pytest.approx(air * (height - rho), rel=1e-12)


def test_the_speed_at_which_drag_lifts_the_front_wheel_is_said():
    # benchmark: front load 309.30 N (Meijaard's masses), D h / w = 309.30 N at v = sqrt(309.30 w / (h rho A / 2))
    drag = effect("aerodynamic_drag", drag_area=0.4, air_density=1.2, centre_of_pressure_z=-1.1)
    model = linear(relaxing(0.1), drag)
    speed = math.sqrt(309.30352941176477 * 1.02 / (1.1 * 1.2 * 0.4 / 2))
    assert f"the front wheel lifts off the ground above {speed:.2f} m/s" in model.warnings[-1]
    assert not any("lifts off" in text for text in linear(relaxing(0.1)).warnings)


@pytest.mark.parametrize("spring", ["steer_spring", "rider_arms"])
def test_a_steer_spring_lowers_weave_and_capsize_speed(spring):
    """What the signatures of the two effects say, on the benchmark without slip."""
    given = {"stiffness": 3.0} if spring == "steer_spring" else {"inertia": 0.0, "stiffness": 3.0, "damping": 0.0}
    before, after = (critical_speeds(linear(*added)) for added in ((), (effect(spring, **given),)))
    for mode in ("weave", "capsize"):
        old, new = (next(c.speed for c in found if c.mode == mode) for found in (before, after))
        assert 0 < new < old


@pytest.mark.parametrize(
    ("effects", "mode", "sign"),
    [
        ([effect("overturning_moment", overturning_stiffness=value) for value in (-5.0, 0.0, 5.0)], "weave", -1),
        ([effect("overturning_moment", overturning_stiffness=value) for value in (0.0, 2.0, 5.0)], "capsize", -1),
        ([effect("rotating_mass", inertia=0.02, spin=value) for value in (-300.0, 0.0, 300.0)], "capsize", 1),
    ],
)
def test_what_one_sees_of_a_rotor_and_an_overturning_moment_is_as_declared(effects, mode, sign):
    speeds = [
        next(one.speed for one in critical_speeds(linear(relaxing(0.1), each), 20.0) if one.mode == mode)
        for each in effects
    ]
    assert (sign * np.diff(speeds) > 0).all()
