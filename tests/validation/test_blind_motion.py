"""Motion of the blind test's bicycles, from a chain of bodies: against published numbers, and against the model."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linear_sum_assignment

from bicycle import Model, effect_class, load_bicycle
from tests.validation.blind.causes import OUTSIDE
from tests.validation.blind.closing import build, canonical
from tests.validation.blind.machine import Extras, coefficients, tensor
from tests.validation.blind.motion import Nonlinear, saturating, shapes, simulate, simulate_nonlinear

PUBLISHED = Path(__file__).parents[1] / "published"
MEIJAARD = json.loads((PUBLISHED / "meijaard2007.json").read_text(encoding="utf-8"))
TYRES = json.loads((PUBLISHED / "tyre_eigenvalues.json").read_text(encoding="utf-8"))["cases"]
BENCHMARK = MEIJAARD["parameters"]
TYRE = {"relaxation_length": {"cornering_stiffness": {"rear": 7000.0, "front": 3600.0}, "relaxation_length": 0.1}}


def far(found, expected):
    """Largest distance of two sets of roots, each paired with its nearest, over max(|root|, 1)."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert len(found) == len(expected)
    apart = np.abs(expected[:, None] - found[None, :]) / np.maximum(np.abs(expected), 1)[:, None]
    return apart[linear_sum_assignment(apart)].max()


def roots(effects, speed, values=BENCHMARK, extras=None):
    machine = build(values, effects, extras or Extras())
    return np.linalg.eigvals(machine.space(speed).matrix)


@pytest.mark.parametrize("row", MEIJAARD["eigenvalues"], ids=lambda row: str(row["speed_m_s"]))
def test_rolling_gives_the_published_eigenvalues(row):
    weave = complex(*row["weave"])
    expected = [row["castering"], row["capsize"], weave, weave.conjugate()]
    assert far(roots({}, row["speed_m_s"]), expected) < 1e-12


def test_a_frame_is_symmetric_about_its_plane():
    """So the axis across it is a principal one, and the tensor is symmetric."""
    inertia = tensor(2.0, 3.0, 0.5)
    np.testing.assert_array_equal(inertia, inertia.T)
    np.testing.assert_array_equal(inertia @ [0, 1, 0], [0, inertia[1, 1], 0])


def oscillators(rates, **rows):
    """A machine of undamped-looking pairs of these angular frequencies (rad/s), damped by 10 %, and its outputs."""
    size = 2 * len(rates)
    matrix = np.zeros((size, size))
    for k, rate in enumerate(rates):
        matrix[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[-0.2 * rate, -(rate**2)], [1.0, 0.0]]
    outputs = {name: np.array([x for one in row for x in one]) for name, row in rows.items()}
    return SimpleNamespace(space=lambda speed: SimpleNamespace(matrix=matrix, outputs=outputs))


@pytest.mark.parametrize(("rate", "called"), [(5.0, {"weave"}), (30.0, {"weave"}), (40.0, set()), (90.0, set())])
def test_an_oscillation_faster_than_5_hz_is_no_weave(rate, called):
    found = shapes(oscillators([rate], lean=[(0.0, 1.0)], steer=[(0.0, 0.5)], yaw_rate=[(0.3, 0.0)]), 5.0)
    assert set(found) == called
    for one in found.values():
        assert abs(one.root) == pytest.approx(rate)
        assert (one.steer, one.yaw) == (pytest.approx(0.5), pytest.approx(0.3))


@pytest.mark.parametrize(("weave", "rider"), [(5.0, 12.0), (12.0, 5.0)])
def test_the_oscillation_of_the_rider_is_that_in_which_he_sways_most_over_the_lean(weave, rider):
    """Not that in which all that moves moves most: here he sways more in the weave, but the bicycle leans far more."""
    machine = oscillators(
        [weave, rider], lean=[(0, 1.0), (0, 0.1)], steer=[(0, 0.5), (0, 0.05)], rider=[(0, 0.3), (0, 0.2)],
        yaw_rate=[(0.1, 0), (0.1, 0)],
    )  # fmt: skip
    found = {name: abs(one.root) for name, one in shapes(machine, 5.0).items()}
    assert found == pytest.approx({"weave": weave, "rider": rider})


@pytest.mark.parametrize("case", TYRES, ids=lambda case: case["name"])
def test_tyres_and_joints_give_the_reference_eigenvalues(case):
    machine = build(case["bicycle"], case["effects"])
    assert machine.coefficients.loads == pytest.approx(tuple(case["static_loads_N"].values()), rel=1e-12)
    for speed, expected in case["eigenvalues_by_speed_m_s"].items():
        found = np.linalg.eigvals(machine.space(float(speed)).matrix)
        assert far(found, [complex(*root) for root in expected]) < 1e-9


@pytest.mark.parametrize("law", [{"side_slip": {}}, {"relaxation_length": {"relaxation_length": 1e-3}}])
def test_stiff_tyres_roll_without_slip(law):
    """Meijaard et al. (2007): -0.77534188 + 4.46486771 i at 5 m/s."""
    found = roots({name: table | {"cornering_stiffness": 1e9} for name, table in law.items()}, 5.0)
    assert np.abs(found - (-0.77534188219585 + 4.46486771378823j)).min() < 1e-5


@pytest.mark.parametrize("name", ["browser", "pista", "rigid_rider"])
@pytest.mark.parametrize("effects", [
    {}, {"side_slip": {"cornering_stiffness": 4000.0}, "camber_thrust": {"camber_stiffness": 300.0}},
    TYRE | {"pneumatic_trail": {"trail": 0.02}, "crown_radius": {"crown_radius": 0.02}},
    {"steer_spring": {"stiffness": 3.0}, "steer_damper": {"damping": 0.5}, "pneumatic_trail": {"trail": 0.02}},
    {"crown_radius": {"crown_radius": 0.025}, "twisting_torque": {"twisting_stiffness": 2.0}},
    TYRE | {"front_compliance": {"stiffness": 2000.0, "damping": 9.0, "joint_x": 0.8, "joint_z": -0.8}},
])  # fmt: skip
def test_the_model_of_the_house_computes_the_same(name, effects):
    """Two derivations that share nothing prove each other; neither is used in the other."""
    bicycle = load_bicycle(name)
    model = Model(bicycle, tuple(effect_class(key)(**table) for key, table in effects.items())).linear_model()
    for speed in (2.0, 5.0, 9.0):
        assert far(roots(effects, speed, bicycle.values), model.eigenvalues(speed)) < 1e-9


# What no library knows.


def test_a_spring_on_lean_and_a_steer_spring_stand_where_they_should():
    plain, sprung = (canonical(coefficients(BENCHMARK, {}, e), 3.0) for e in (Extras(), Extras(lean_spring=70.0)))
    np.testing.assert_allclose(sprung[2] - plain[2], [[70, 0], [0, 0]], atol=1e-9)


@pytest.mark.parametrize(("joint", "turn"), [(0, 0.0), (1, np.pi / 10)])
def test_a_rotor_on_the_frame_or_the_fork_couples_lean_and_steer(joint, turn):
    """On wheels that stand (v = 0) the rear frame cannot yaw: a rotor on it does nothing, on the fork it couples."""
    rotor = (0.0, 5.0) if joint else (5.0, 0.0)
    c = coefficients(BENCHMARK, {}, Extras(rotor=rotor))
    rows = np.zeros((2, 4))  # turn about x, about z, over y, yaw, lean, steer
    rows[0, 2] = rows[1, 1] = 1
    rows[0, 3], rows[1, 3] = np.sin(turn) if joint else 0, np.cos(turn) if joint else 0
    expected = 5.0 * (np.outer(rows[1], rows[0]) - np.outer(rows[0], rows[1]))
    np.testing.assert_allclose(c.damping, expected, atol=1e-9)
    assert np.allclose(c.damping, -c.damping.T)  # no power


def test_a_stiff_maxwell_element_is_a_damper_and_a_slow_one_a_spring():
    damped = roots({"steer_damper": {"damping": 2.0}}, 5.0)
    found = roots({}, 5.0, extras=Extras(maxwell=(2.0 / 1e-6, 1e-6)))
    assert far(sorted(found, key=abs)[:4], damped) < 1e-4
    sprung = roots({"steer_spring": {"stiffness": 4.0}}, 5.0)
    found = roots({}, 5.0, extras=Extras(maxwell=(4.0, 1e7)))
    assert far(sorted(found, key=abs)[1:], sprung) < 1e-4


def test_luggage_is_what_the_same_mass_in_the_frame_is():
    x, z, mass = -0.05, -0.75, 6.0
    whole = BENCHMARK["mB"] + mass
    dx, dz = x - BENCHMARK["xB"], z - BENCHMARK["zB"]
    spread = BENCHMARK["mB"] * mass / whole
    loaded = BENCHMARK | {
        "mB": whole, "xB": BENCHMARK["xB"] + mass * dx / whole, "zB": BENCHMARK["zB"] + mass * dz / whole,
        "IBxx": BENCHMARK["IBxx"] + spread * dz**2, "IBzz": BENCHMARK["IBzz"] + spread * dx**2,
        "IBxz": BENCHMARK["IBxz"] - spread * dx * dz,
    }  # fmt: skip
    assert far(roots({}, 5.0, extras=Extras(rack=mass)), roots({}, 5.0, loaded)) < 1e-9


def test_stiff_joints_that_no_library_knows_vanish():
    plain = roots(TYRE, 6.0)
    for extras in (Extras(rear_twist=(1e9, 1e5)), Extras(bar_mass=(1e-9, 1e3, 1.0))):
        found = roots(TYRE, 6.0, extras=extras)
        assert all(np.abs(found - root).min() < 1e-3 * max(1, abs(root)) for root in plain)


@pytest.mark.parametrize("name", OUTSIDE)
def test_what_is_outside_the_library_moves_the_weave_visibly(name):
    values = load_bicycle("benchmark").values
    extras = [Extras(), *(OUTSIDE[name](np.random.default_rng(seed)).extras for seed in range(3))]
    plain, *moved = (shapes(build(values, {}, one), 6.0)["weave"].root for one in extras)
    assert max(abs(root - plain) for root in moved) > 0.05


# Time.


def test_linear_motion_is_that_of_an_adaptive_integration():
    space = build(BENCHMARK, TYRE).space(6.0)
    torque = np.where(np.arange(101) < 30, 2.0, -1.0)
    start = 0.1 * space.outputs["lean_rate"]
    found = simulate(space, start, torque, 0.01)
    push = space.inputs[:, 0]
    first = solve_ivp(lambda _, x: space.matrix @ x + 2 * push, (0, 0.3), start, rtol=1e-10, atol=1e-12).y[:, -1]
    second = solve_ivp(lambda _, x: space.matrix @ x - push, (0, 0.7), first, rtol=1e-10, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(found[-1], second, rtol=1e-6, atol=1e-8)


def test_tyres_bend_with_slip_and_are_linear_for_small_motion():
    machine = build(BENCHMARK, TYRE | {"camber_thrust": {"camber_stiffness": 500.0}})
    space, torque = machine.space(6.0), np.zeros(101)
    grip = Nonlinear((550.0, 280.0))
    distances = []
    for size in (1e-4, 0.3):
        start = size * space.outputs["lean_rate"]
        straight = simulate(space, start, torque, 0.01)
        bent = simulate_nonlinear(space, machine.law, 6.0, grip, (start, torque, 0.01))
        distances.append(np.abs(bent - straight).max() / np.abs(straight).max())
    assert distances[0] < 1e-4
    assert distances[1] > 1e-3
    np.testing.assert_allclose(saturating(np.array([-9.0, 0.001, 3.0, 9.0])), [-1, 0.001, 1, 1], rtol=1e-3)


def test_friction_takes_energy_and_its_torque_is_bounded():
    """A friction of T loses against a damper of T / rate where the steer turns slower, and wins where it is faster."""
    machine = build(load_bicycle("browser").values, {})
    space, torque = machine.space(6.0), np.zeros(151)
    start = 0.4 * space.outputs["lean_rate"]
    free = simulate(space, start, torque, 0.01) @ space.outputs["steer"]
    rough = simulate_nonlinear(space, machine.law, 6.0, Nonlinear(friction=0.3), (start, torque, 0.01))
    assert np.abs(rough @ space.outputs["steer"]).max() < np.abs(free).max()
    smooth = simulate_nonlinear(space, machine.law, 6.0, Nonlinear(friction=1e-9), (start, torque, 0.01))
    np.testing.assert_allclose(smooth @ space.outputs["steer"], free, atol=1e-6)
