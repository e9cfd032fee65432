"""Magic Formula simulation against the linear model, its limits, and closed forms."""

from dataclasses import dataclass

import numpy as np
import pytest
from built import built
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import load_bicycle
from bicycle.model import InputHistory, build_model, pulse, step
from bicycle.motion import CurveTyre, MagicTyre, magic_formula_model, respond
from tests.shared.refusals import refuses
from tyre import read_tyre
from tyre.ground import InputError

STIFFNESS = {"rear": 6302.5, "front": 6016.1}  # N/rad
LAGGED = ("relaxation_length", {"cornering_stiffness": STIFFNESS, "relaxation_length": {"rear": 0.12, "front": 0.1}})
STATIC = ("side_slip", {"cornering_stiffness": STIFFNESS})
CAMBER = ("camber_thrust", {"camber_stiffness": 400.0, "lag_share": 0.6})
SETS = {
    "lagged": (LAGGED,),
    "static": (STATIC, CAMBER),
    "tyre": (LAGGED, CAMBER, ("pneumatic_trail", {"trail": 0.017}), ("wheel_compliance", {"stiffness": 3e5})),
    "moments": (LAGGED, ("twisting_torque", {}), ("crown_radius", {}),
                ("aligning_moment", {"aligning_stiffness": 100.0, "relaxation_length": 0.1})),
    "front": (LAGGED, CAMBER, ("front_compliance", {"joint_x": 0.8, "joint_z": -0.85}), ("steer_damper", {})),
    "rider": (LAGGED, ("aerodynamic_drag", {"centre_of_pressure_z": -1.1}), ("rider_arms", {}),
              ("rider_lean", {"mass": 30.0, "x": 0.3, "z": -1.1, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9})),
    "bags": (LAGGED, ("luggage", {"mass": 6.0}), ("handlebar_bag", {"mass": 2.0})),
    "assist": (LAGGED, ("steer_assist", {}), ("steer_motor", {"share": 0.7}), ("steer_spring", {})),
    "torque": (LAGGED, ("unmodelled_torque", {"steer_from_steer_rate": -1.5, "lean_from_lean_slope": 3.0})),
}  # fmt: skip
SHOWN = ("lean", "steer", "yaw_rate", "rear_lateral_force", "front_lateral_force")


def build(*effects):
    return built(**dict(effects))


@pytest.mark.parametrize("effects", SETS.values(), ids=SETS)
def test_its_linearisation_is_the_linear_model(effects):
    model = build(*effects)
    system = magic_formula_model(model, speed=6.5, rear=MagicTyre(0.7, 1.5, -0.8), front=MagicTyre(1.1, 1.1, 0.4))
    found = np.linalg.eigvals(system.jacobian(np.zeros(len(system.states)), np.zeros(len(system.inputs))))
    expected = model.linear_model().eigenvalues(6.5)
    assert_same_eigenvalues(found, expected, atol=1e-10 * np.abs(expected).max())


def kicked(size):
    return {"steer_rate": 40.0 * size, "lean": size}


def relative_difference(nonlinear, linear, trim):
    every = [np.array([each.outputs[name] for name in SHOWN]) for each in (nonlinear, trim, linear)]
    return (np.abs(every[0] - every[1] - every[2]).max(1) / np.abs(every[2]).max(1)).max()


@pytest.mark.parametrize("effects", [SETS["tyre"], SETS["static"]], ids=["tyre", "static"])
def test_half_the_kick_is_a_quarter_of_the_relative_difference(effects):
    model, time = build(*effects), np.linspace(0.0, 0.3, 31)
    system, linear = magic_formula_model(model, speed=6.0), model.linear_model()
    still = system.simulate(time=time)
    assert all(np.abs(still.outputs[name]).max() == 0 for name in SHOWN)
    size, previous, count = 0.005, np.inf, 0
    while previous > 2e-8:
        nonlinear = system.simulate(time=time, initial=kicked(size), tolerance=1e-12)
        found = relative_difference(nonlinear, respond(linear, speed=6.0, time=time, initial=kicked(size)), still)
        assert found <= previous / 3.9**2  # fourfold at each half, up to the next order of the kick
        size, previous, count = size / 4, found, count + 1
    assert count >= 4


def test_with_an_offset_half_the_kick_is_half_of_the_relative_difference():
    # around the steady motion that the offset enforces, F(alpha) has a second derivative; the linear model takes the
    # local slope, with camber as the slip that gives the same force
    # (equal offsets would only make it turn, without slip, at a lean of Sv)
    rear, front = (MagicTyre(peak_factor=0.5, offset=offset) for offset in (-0.05, 0.05))
    model, time = build(LAGGED, CAMBER), np.linspace(0.0, 0.3, 31)
    system = magic_formula_model(model, speed=6.0, rear=rear, front=front)
    trim = system.trim()
    state = np.array([trim[name] for name in system.states])
    at = zip(system.tyres, system.slip_matrix @ state, strict=True)
    slope = np.array([tyre.slope("force", slip, np.zeros(())) for tyre, slip in at])
    share = slope / np.array([*STIFFNESS.values()])
    assert (share < 0.97).all()
    local = {"cornering_stiffness": dict(zip(STIFFNESS, slope.tolist(), strict=True)),
             "relaxation_length": LAGGED[1]["relaxation_length"]}  # fmt: skip
    camber = {"camber_stiffness": dict(zip(STIFFNESS, (400.0 * share).tolist(), strict=True)), "lag_share": 0.6}
    linear = build(("relaxation_length", local), ("camber_thrust", camber)).linear_model()
    still = system.simulate(time=time, initial=trim, tolerance=1e-12)
    assert np.ptp(still.outputs["lean"]) < 1e-9
    found = []
    for halvings in range(8):
        kick = kicked(0.004 / 2**halvings)
        start = {name: value + kick.get(name, 0.0) for name, value in trim.items()}
        nonlinear = system.simulate(time=time, initial=start, tolerance=1e-12)
        found.append(relative_difference(nonlinear, respond(linear, speed=6.0, time=time, initial=kick), still))
    ratios = np.array(found[:-1]) / found[1:]
    assert (ratios > 1.85).all()
    assert ratios[-1] == pytest.approx(2.0, rel=0.02)


def test_lateral_forces_never_exceed_friction_times_load():
    model = build(LAGGED, CAMBER)
    system = magic_formula_model(model, speed=6.0, rear=MagicTyre(0.3), front=MagicTyre(0.3))
    found = system.simulate(time=np.linspace(0, 1.5, 151), inputs={"lateral_push": pulse(400.0, duration=0.5)})
    for wheel, load in zip(("rear", "front"), load_bicycle("benchmark").static_loads, strict=True):
        largest = np.abs(found.outputs[f"{wheel}_lateral_force"]).max()
        assert 0.99 * 0.3 * load < largest <= 0.3 * load * (1 + 1e-12)


def test_drag_shifts_load_from_the_front_wheel_to_the_rear():
    # D h / w with D = density area v^2 / 2 (Sharp 2001)
    drag = {"drag_area": 0.4, "centre_of_pressure_z": -1.1, "air_density": 1.225}
    system = magic_formula_model(build(LAGGED, ("aerodynamic_drag", drag)), speed=10.0)
    shift = 1.225 * 0.4 * 10.0**2 / 2 * 1.1 / 1.02
    rear, front = load_bicycle("benchmark").static_loads
    assert system.loads.tolist() == pytest.approx([rear + shift, front - shift], rel=1e-12)
    with pytest.raises(InputError, match="at 60 m/s the drag lifts the front wheel off the road; ride slower"):
        magic_formula_model(build(LAGGED, ("aerodynamic_drag", drag)), speed=60.0)


def test_slip_step_of_a_bicycle_that_stays_straight_gives_the_magic_formula():
    # F = D Fz sin{C atan[B a - E (B a - atan(B a))]} + Sv Fz by hand at a = 0.1 rad, wheels held by a huge mass
    masses = {key: 1e9 * value for key, value in load_bicycle("benchmark").values.items() if key[0] in "Im"}
    heavy = load_bicycle("benchmark").replace(g=1e-9 * 9.81, **masses, allow_unusual=True)
    law = {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}
    tyre = MagicTyre(peak_factor=0.7, shape_factor=1.4, curvature_factor=-0.5, offset=0.02)
    system = magic_formula_model(built(heavy, relaxation_length=law), speed=5.0, rear=tyre, front=tyre)
    found = system.simulate(time=[0.0, 2.0], inputs={"rear_slip": step(0.1)})
    load = load_bicycle("benchmark").static_loads[0]
    b = 6000.0 / (1.4 * 0.7 * load)
    curved = b * 0.1 + 0.5 * (b * 0.1 - np.arctan(b * 0.1))
    expected = load * (0.7 * np.sin(1.4 * np.arctan(curved)) + 0.02)
    assert found.outputs["rear_lateral_force"][1] == pytest.approx(expected, rel=1e-6)


def test_samples_that_are_joined_by_straight_lines_are_integrated_from_bend_to_bend():
    model = build(*SETS["static"])
    clock = np.array([0.05, 0.2, 0.31, 0.5, 0.6, 0.9])
    samples = InputHistory(clock, 1e-4 * np.array([0.5, 1.0, -1.0, 0.0, 0.0, 0.7]), linear=True)
    inputs = {"steer_torque": samples, "rear_slip": step(1e-5, start=0.5011)}
    time = np.linspace(0, 1.2, 13)
    found = magic_formula_model(model, speed=5.0).simulate(time=time, inputs=inputs, tolerance=1e-12)
    expected = respond(model.linear_model(), speed=5.0, time=time, inputs=inputs)
    for name, values in expected.outputs.items():
        assert np.allclose(found.outputs[name], values, rtol=0, atol=1e-6 * np.abs(values).max())


def test_refused_models_and_motions():
    with pytest.raises(InputError, match="need the effect side_slip or relaxation_length; this model rolls with 'no_s"):
        magic_formula_model(build(), speed=5.0)
    with pytest.raises(InputError, match="speed 0 m/s is not allowed with side_slip"):
        magic_formula_model(build(STATIC), speed=0.0)
    with pytest.raises(InputError, match="need a cornering_stiffness > 0 on both wheels"):
        magic_formula_model(build(("side_slip", {"cornering_stiffness": 0.0})), speed=5.0)
    system = magic_formula_model(build(LAGGED), speed=1.0)
    with pytest.raises(InputError, match="unknown state 'rear_lateral_force'; .*known: front_transient_slip"):
        system.simulate(time=[0, 1], initial={"rear_lateral_force": 1.0})
    with pytest.raises(InputError, match="unknown input 'steer'"):
        system.simulate(time=[0, 1], inputs={"steer": step(1.0)})
    refuses("unknown input 'steer'", system.trim, {"steer": 1.0})
    refuses("no steady motion found at 1 m/s; take smaller offsets or inputs", system.trim, {"lateral_push": 5000.0})
    for lean in (1e250, 1e290):  # which a few seconds, or the first step, carry out of what numbers hold
        with pytest.raises(InputError, match="simulation at 1 m/s stops at .* s: .*probably fallen; take less time"):
            system.simulate(time=[0.0, 400.0], initial={"lean": lean}, tolerance=1e-4)


@pytest.mark.parametrize(("given", "words"), [
    ({"peak_factor": 0.0}, "peak_factor = 0 is outside 0 .. 3 .0 excluded."),
    ({"peak_factor": np.nan}, "peak_factor = nan is outside"),
    ({"shape_factor": 2.5}, "shape_factor = 2.5 is outside 0 .. 2 .0 excluded."),
    ({"curvature_factor": 1.1}, "curvature_factor = 1.1 is outside -100 .. 1$"),
    ({"offset": -2.0}, "offset = -2 is outside -1 .. 1$"),
])  # fmt: skip
def test_refused_tyres(given, words):
    refuses(words, MagicTyre, **given)


CURVED = """[MODEL]
FITTYP = 61
UNLOADED_RADIUS = 0.34
NOMPRES = 500000
FNOMIN = 450
LATERAL_STIFFNESS = 60000
PCY1 = 1.3
PDY1 = 0.9
PEY1 = -0.5
PKY1 = -17
PKY2 = 1.8
PKY6 = -0.9
PVY3 = -0.2
QBZ1 = 9
QCZ1 = 1.2
QDZ1 = 0.05
QBZ9 = 10
QDZ8 = -0.02
"""
TABLES = {"camber_thrust": {"camber_stiffness": "tyre", "lag_share": 0.6}, "pneumatic_trail": {"trail": "tyre"},
          "twisting_torque": {"twisting_stiffness": "tyre"}}  # fmt: skip


def curved(folder, **tables):
    (folder / "t.tir").write_text(CURVED)
    law = {"relaxation_length": {"tyre": str(folder / "t.tir"), "pressure_bar": 5}}
    model = build_model({"bicycle": "benchmark", "effects": law | tables})
    return model, CurveTyre(read_tyre(folder / "t.tir"), 5e5)


def test_the_linearisation_of_a_file_with_curves_is_the_linear_model(tmp_path):
    """Beside the lags of camber, which stand apart from those of slip: -v over the relaxation length."""
    model, tyre = curved(tmp_path, **TABLES)
    system = magic_formula_model(model, speed=6.5, rear=tyre, front=tyre)
    found = np.linalg.eigvals(system.jacobian(np.zeros(len(system.states)), np.zeros(len(system.inputs))))
    lengths = [model.parameters[f"relaxation_length.relaxation_length.{wheel}"] for wheel in ("rear", "front")]
    expected = np.concatenate([model.linear_model().eigenvalues(6.5), -6.5 / np.array(lengths)])
    assert_same_eigenvalues(found, expected, atol=1e-8 * np.abs(expected).max())


def test_forces_and_moments_are_those_of_the_file_at_the_lagged_slip(tmp_path):
    """The yaw acceleration that is left beside the lateral force is the moment's, up to full sliding."""
    model, tyre = curved(tmp_path, pneumatic_trail={"trail": "tyre"})
    system = magic_formula_model(model, speed=5.0, rear=tyre, front=tyre)
    state, yaw = np.zeros(len(system.states)), system.states.index("yaw_rate")
    left, moments = [], []
    for slip in (1e-5, 0.1, 0.4):
        state[system.states.index("rear_transient_slip")] = slip
        at = {"slip_angle": slip, "load": system.loads[0], "pressure": 5e5}
        force = tyre.source.lateral_force(**at)
        assert system.lateral_forces(system.slip_matrix @ state)[0] == pytest.approx(force, rel=1e-9)
        rate = system.rate(state, np.zeros(len(system.inputs))) - system.state_matrix @ state
        left.append((rate - system.force_matrix[:, 0] * force)[yaw])
        moments.append(float(tyre.source.aligning_moment(**at)))
    np.testing.assert_allclose(np.array(left) / left[0], np.array(moments) / moments[0], rtol=1e-5)


@dataclass(frozen=True)
class CurveWithoutMoment:
    """A file of a tyre that holds no moment: lateral force by tanh, at a camber of which a third counts as slip."""

    def lateral_force(self, *, slip_angle, camber, load, pressure):
        return 0.8 * load * np.tanh(20.0 * (np.asarray(slip_angle) + np.asarray(camber) / 3.0))

    def aligning_moment(self, **_):
        raise InputError("no aligning moment")


@pytest.mark.parametrize("kind", ["magic", "curve"])
@pytest.mark.parametrize(("slip", "camber"), [(0.03, 0.0), (0.02, 0.02), (-0.05, 0.01), (0.0, -0.04)])
def test_a_trail_that_no_curve_gives_falls_with_slip_and_camber_together(kind, slip, camber):
    """t / t0 = 1 / (1 + (z / 0.28)^2), z = C (slip + camber) / (3 peak), whatever the sign."""
    load, stiffness = 400.0, 7000.0
    tyre = MagicTyre(peak_factor=0.8, shape_factor=1.4) if kind == "magic" else CurveTyre(CurveWithoutMoment(), 5e5)
    under = tyre.under(load, stiffness)
    # the curve slides whole at its peak up to 20 deg, its slip scaled from 6400 to 7000 N/rad
    peak = 0.8 * load if kind == "magic" else 0.8 * load * np.tanh(20.0 * stiffness / 6400.0 * np.radians(20.0))
    z = stiffness * (slip + camber) / (3 * peak)
    trail = float(under.by_trail(np.array(slip), np.array(camber)) / under.force(np.array(slip), np.array(camber)))
    assert trail == pytest.approx(1 / (1 + (z / 0.28) ** 2), rel=1e-6)


def test_without_a_curve_of_the_moment_the_trail_falls_like_that_of_a_brush():
    """Half of it where (1 - z)^3 = (1 - z + z^2/3) / 2, z = C slip / (3 D load): Pacejka (2012), section 3.2.1."""
    z = next(z for z in np.linspace(0, 1, 10001) if (1 - z) ** 3 <= (1 - z + z * z / 3) / 2)
    model, tyre = build(LAGGED, ("pneumatic_trail", {"trail": 0.017})), MagicTyre(peak_factor=0.7, shape_factor=1.4)
    system = magic_formula_model(model, speed=5.0, rear=tyre, front=tyre)
    slip = np.full(2, z * 3 * 0.7 * system.loads / np.array([*STIFFNESS.values()]))
    trailing = [one.by_trail(s, np.zeros(())) for one, s in zip(system.tyres, slip, strict=True)]
    np.testing.assert_allclose(trailing, system.lateral_forces(slip) / 2, rtol=0.01)
    assert system.trail_matrix.any()
    assert not magic_formula_model(build(LAGGED), speed=5.0).trail_matrix.any()
