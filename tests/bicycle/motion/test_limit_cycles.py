"""Periodic motions against shooting on equations of the test's own, exact scaling, closed forms and a prototype."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp, trapezoid

from bicycle.motion import CurveTyre, MagicTyre, find_limit_cycles, magic_formula_model
from tests.shared import shooting
from tests.shared.shooting import FRONT, build, compare_with_own_equations, own_equations, own_state, shoot
from tyre import read_tyre
from tyre.ground import InputError

PAGE = " ".join((Path(__file__).parents[3] / "docs" / "amplitude.md").read_text(encoding="utf-8").split())


def only(found, speed, mode):
    (cycle,) = [cycle for name, cycle in found.at(speed) if name == mode]
    return cycle


def degrees(found, cycle):
    return np.degrees(found.amplitude(cycle))


def test_the_wobble_of_the_faq_is_that_of_the_prototype(faq):
    cycle = only(faq, 10.0, "wobble")
    assert degrees(faq, cycle) == pytest.approx(10.288, rel=1e-4)
    assert cycle.frequency_hz == pytest.approx(7.1157, rel=1e-4)
    branch = next(one for one in faq.branches if one.mode == "wobble")
    assert (branch.begin.speed, branch.end.speed) == pytest.approx((2.849701, 31.672998), rel=1e-6)
    assert [one.kind for one in faq.onsets if one.critical.mode == "wobble"] == ["supercritical"] * 2
    assert not branch.folds
    assert faq.stability(cycle) == "yes"
    assert 2 * faq.acceleration(cycle) / 9.81 == pytest.approx(7.0, abs=0.1)  # g peak to peak
    assert only(faq, 40.0, "weave")
    assert [len(faq.at(speed)) for speed in (2.8498, 31.6729, 34.098, 34.1, 34.2, 38.93)] == [1, 1, 2, 2, 2, 2]
    assert not [cycle for speed in (2.8, 31.7) for _, cycle in faq.at(speed)]


def test_its_weave_jumps_and_folds_back(faq):
    last = faq.onsets[-1]
    assert (last.critical.mode, last.kind) == ("weave", "subcritical")
    (fold,) = next(one for one in faq.branches if one.mode == "weave").folds
    assert fold.speed == pytest.approx(34.10, abs=0.005)
    assert degrees(faq, fold) == pytest.approx(12.0, abs=0.15)  # 12.0 lies 0.4 mm/s above the fold
    lower, upper = (cycle for _, cycle in faq.at(38.0))
    assert (degrees(faq, lower), degrees(faq, upper)) == pytest.approx((2.39, 19.60), abs=0.005)
    assert (faq.stability(lower), faq.stability(upper)) == ("no", "falls slowly")
    assert faq.within_geometry(upper)
    assert not faq.within_geometry(only(faq, 40.0, "weave"))


def test_a_damper_ends_the_wobble_and_lowers_the_weave_limit(faq):
    damped = find_limit_cycles(build(steer_damper={"damping": 1.5}))
    assert not [one for one in damped.onsets if one.critical.mode == "wobble"]
    limits = [found.onsets[-1].critical for found in (faq, damped)]
    assert [one.mode for one in limits] == ["weave"] * 2
    assert [one.speed for one in limits] == pytest.approx([38.9, 35.2], abs=0.05)
    assert [found.onsets[-1].kind for found in (faq, damped)] == ["subcritical"] * 2
    assert "1.5 N m s/rad" in PAGE
    assert "from {:.1f} to {:.1f} m/s".format(*(one.speed for one in limits)) in PAGE
    (weave,) = damped.branches
    assert (weave.reason, weave.folds) == ("geometry", ())
    assert {damped.stability(cycle) for _, cycle in [*damped.at(30.0), *damped.at(35.0)]} == {"no"}
    assert not damped.at(35.3)


def test_slow_weave_is_not_determined(faq):
    (slow,) = [one for one in faq.onsets if one.critical.frequency_hz < 1]
    assert slow.kind == "not determined"
    assert all(branch.begin is not slow.critical for branch in faq.branches)


@pytest.mark.parametrize(("speed", "mode", "which"), [(10.0, "wobble", 0), (30.0, "wobble", 0), (38.0, "weave", 1)])
def test_cycles_are_those_of_shooting(faq, speed, mode, which):
    cycle = [cycle for name, cycle in faq.at(speed) if name == mode][which]
    compare_with_own_equations(faq.model, faq, speed, cycle)


@pytest.mark.parametrize("seed", range(3))
def test_cycles_of_random_bicycles_are_those_of_shooting(seed):
    random = np.random.default_rng(seed)
    tyre = {"cornering_stiffness": random.uniform(4000, 9000), "relaxation_length": random.uniform(0.08, 0.2)}
    front = FRONT | {"stiffness": random.uniform(1500, 5000), "damping": random.uniform(3, 9)}
    model = build(tyre=tyre, front=front)
    found = find_limit_cycles(model)
    branch = next(one for one in found.branches if one.mode == "wobble")
    cycles = [point.cycle for point in branch.points[1:-1] if np.degrees(found.amplitude(point.cycle)) < 20]
    cycle = cycles[len(cycles) // 2]
    compare_with_own_equations(model, found, cycle.speed, cycle)


def test_the_fold_is_that_of_shooting(faq):
    """Beside a fold the difference of both amplitudes goes with the root of the distance in speed."""
    (fold,) = next(one for one in faq.branches if one.mode == "weave").folds
    speeds, sizes = fold.speed + np.array([0.005, 0.01, 0.02]), []
    for speed in speeds:
        rate, names = own_equations(faq.model, speed)
        for _, cycle in faq.at(speed):
            start = own_state(faq.model, faq, cycle) * 1.0002
            _, states = shoot(rate, start, cycle.period / 2 * 1.0002, names.index("steer_rate"))
            sizes.append(np.abs(states[names.index("steer")]).max())
    lower, upper = np.reshape(sizes, (3, 2)).T
    assert np.polyval(np.polyfit((upper - lower) ** 2, speeds, 2), 0) == pytest.approx(fold.speed, abs=1e-4)
    middle = np.polyval(np.polyfit(speeds - fold.speed, (lower + upper) / 2, 2), 0)
    assert middle == pytest.approx(faq.amplitude(fold), rel=1e-4)


def test_shimmy_beside_what_was_measured():
    """Tomiati, Colombo and Magnani 2019 (abstract): 5 to 10 Hz and 5 to 10 g, hardly any change with the speed."""
    rises, hertz, swings = [], [], []
    for stiffness in (1500, 2500, 4000):
        found = find_limit_cycles(build(front=FRONT | {"stiffness": stiffness}), max_speed=26.0)
        table = found.frame([10.0, 15.0, 20.0, 25.0]).query("mode == 'wobble'")
        rises.append(100 * (table["frequency_Hz"].iloc[-1] / table["frequency_Hz"].iloc[0] - 1))
        hertz += table["frequency_Hz"].tolist()
        swings += (2 * table["acceleration_g"]).tolist()
    assert len(swings) == 12
    assert rises == pytest.approx([70, 53, 39], abs=0.5)  # of the prototype
    assert "rises by {:.0f}, {:.0f} and {:.0f} %, which is outside".format(*rises) in PAGE
    said = f"{min(hertz):.1f} to {max(hertz):.1f} Hz and {min(swings):.1f} to {max(swings):.1f} g peak to peak"
    assert said in PAGE
    assert (min(hertz) > 5, max(hertz) < 10, min(swings) > 5, 10 < max(swings) < 10.5) == (True,) * 4


def test_where_a_wheel_slides_harmonics_are_added():
    """A slow weave whose slips have edges: the 33rd harmonic and those above hold more than 1e-4 of them."""
    tyre, front = {"cornering_stiffness": 6000, "relaxation_length": 0.1}, FRONT | {"stiffness": 2500, "damping": 8}
    model = build(bicycle="browser", tyre=tyre, front=front)
    curve = MagicTyre(0.8, 1.4, -1.0)
    found = find_limit_cycles(model, rear=curve, front=curve, max_speed=20.0)
    cycle = only(found, 9.0, "weave")
    assert np.abs(cycle.slips[16:]).max() > 1e-4 * np.abs(cycle.slips).max()
    assert found.resolved(cycle)
    assert not found.resolved(cycle._replace(slips=cycle.slips[:16]))
    compare_with_own_equations(model, found, 9.0, cycle, shape=1.4, curvature=-1.0)


def test_dry_friction_closes_the_branch_of_the_wobble(rubbing):
    assert rubbing.onsets == ()
    wobble, weave = rubbing.branches
    assert (wobble.mode, wobble.reason, wobble.end) == ("wobble", "closed", None)
    speeds = [point.number for point in wobble.points]
    assert (min(speeds), max(speeds)) == pytest.approx((3.25, 29.3), abs=0.2)  # prototype, on a grid of speeds
    assert f"from {min(speeds):.2f} to {max(speeds):.2f} m/s" in PAGE
    assert sorted(fold.speed for fold in wobble.folds) == pytest.approx([min(speeds), max(speeds)])
    assert [rubbing.stability(cycle) for cycle in sorted(wobble.at(10.0), key=rubbing.amplitude)] == ["no", "yes"]
    assert not [mode for speed in (3.0, 30.0) for mode, _ in rubbing.at(speed) if mode == "wobble"]
    assert weave.mode == "weave"


@pytest.mark.parametrize(
    ("torque", "speed", "amplitude", "period"),
    [(0.3, 10.0, 1e-5, 1e-6), (0.3, 3.2, 5e-5, 1e-6), (0.3, 29.4, 1e-5, 1e-6), (0.2, 12.0, 1e-5, 1e-6)],
)
def test_with_dry_friction_against_shooting(rubbing, torque, speed, amplitude, period):
    """With 0.2 N m the smaller motion turns the bar by 0.18 rad/s at most, where friction has 99.8 % of its torque."""
    if torque != 0.3:
        rubbing = find_limit_cycles(build(), dry_friction=torque, max_speed=speed + 1)
    model = rubbing.model
    own, names = own_equations(model, speed)
    linear = model.linear_model()
    column = linear.matrices_at(speed)[1][:, linear.inputs.index("steer_torque")]
    turns = names.index("steer_rate")

    def rate(t, x):
        friction = torque * np.tanh(x[turns] / 0.05)
        return own(t, x) - (column if x.ndim == 1 else column[:, None]) * friction

    cycles = [cycle for mode, cycle in rubbing.at(speed) if mode == "wobble"]
    assert len(cycles) == 2
    for cycle in cycles:
        start = own_state(model, rubbing, cycle) * 1.002
        half, states = shoot(rate, start, cycle.period / 2 * 1.002, turns, tolerance=1e-11)
        assert 2 * half == pytest.approx(cycle.period, rel=period)
        assert np.abs(states[names.index("steer")]).max() == pytest.approx(rubbing.amplitude(cycle), rel=amplitude)


def test_dry_friction_takes_a_hundredth_off_and_much_of_it_ends_the_wobble(faq, rubbing):
    without = only(faq, 13.0, "wobble")
    largest = max((cycle for _, cycle in rubbing.at(13.0)), key=rubbing.amplitude)
    assert 1 - rubbing.amplitude(largest) / faq.amplitude(without) == pytest.approx(0.014, abs=5e-4)
    much = find_limit_cycles(build(), dry_friction=20.0, max_speed=12.0)
    assert "wobble" not in {branch.mode for branch in much.branches}


def compare_with_rate(found, cycle, system):
    start = np.array(list(shooting.state_at_turn(found.system.at_one_speed, cycle, "steer").values()))

    def rate(t, x):
        slip, camber = system.slip_matrix @ x, system.camber_matrix @ x
        found = system.state_matrix @ x
        for what, matrix in (("force", system.force_matrix), ("by_trail", system.trail_matrix)):
            if matrix.any():
                values = [getattr(tyre, what)(slip[k], camber[k]) for k, tyre in enumerate(system.tyres)]
                found = found + matrix @ np.stack(values)
        return found

    shooting.compare(found, cycle, rate, list(system.states), start)


def test_with_a_trail_that_falls_with_slip():
    model = build(pneumatic_trail={"trail": 0.02})
    found = find_limit_cycles(model, max_speed=13.0)
    compare_with_rate(found, only(found, 12.0, "wobble"), magic_formula_model(model, speed=12.0))


def test_with_the_whole_curves_of_a_tyre_file():
    """The file's camber is no slip: signals are four, and curves two or four."""
    file = Path(__file__).parents[2] / "field_cases" / "inputs" / "b600.tir"
    camber = {"camber_stiffness": 400.0, "lag_share": 0.6}
    model = build(tyre={"tyre": str(file), "pressure_bar": 5.5}, camber_thrust=camber)
    tyre = CurveTyre(read_tyre(file), 5.5e5)
    found = find_limit_cycles(model, rear=tyre, front=tyre, max_speed=13.0)
    system = magic_formula_model(model, speed=12.0, rear=tyre, front=tyre)
    assert len(found.system.signals) == 4
    compare_with_rate(found, only(found, 12.0, "wobble"), system)


@pytest.mark.parametrize("friction", [0.4, 1.1])
def test_the_amplitude_is_proportional_to_the_peak_factor(faq, friction):
    tyre = MagicTyre(peak_factor=friction)
    found = find_limit_cycles(faq.model, rear=tyre, front=tyre)
    for speed in (10.0, 38.0):
        for (_, usual), (_, own) in zip(faq.at(speed), found.at(speed), strict=False):
            assert found.amplitude(own) == pytest.approx(faq.amplitude(usual) * friction / 0.8, rel=1e-8)
            assert own.frequency_hz == pytest.approx(usual.frequency_hz, rel=1e-9)
    assert degrees(found, only(found, 10.0, "wobble")) == pytest.approx(12.86 * friction, rel=1e-3)


@pytest.mark.parametrize(("number", "offset"), [(0, 0.002), (2, -0.01), (3, -0.02)])
def test_beside_the_onset_growth_and_bend_give_the_amplitude(faq, number, offset):
    onset = faq.onsets[number]
    v, linear = onset.critical.speed, faq.model.linear_model()
    values = linear.eigenvalues(v + offset)
    growth = values[np.abs(values - 1j * onset.critical.angular_frequency).argmin()].real
    small = min((cycle for _, cycle in faq.at(v + offset)), key=faq.amplitude)
    assert small.speed == pytest.approx(v + offset, rel=1e-12)
    assert faq.amplitude(small) == pytest.approx(np.sqrt(-growth / onset.bend), rel=0.02)


def test_multipliers_hold_one_along_the_cycle_and_the_mean_divergence(faq):
    """Liouville: the determinant is exp of the mean trace; curves of lagged slips are off the diagonal of the rate."""
    cycle = only(faq, 10.0, "wobble")
    multipliers = faq.multipliers(cycle, 400)
    assert np.abs(multipliers - 1).min() < 1e-8
    trace = np.trace(faq.system.dynamics(cycle.speed)) * cycle.period / 2
    assert np.log(np.abs(np.prod(multipliers))) == pytest.approx(trace, rel=1e-3)


@pytest.mark.parametrize(("speed", "which", "leaves"), [(10.0, 0, False), (38.0, 0, True), (38.0, 1, True)])
def test_multipliers_are_those_of_small_motions_beside_the_cycle(faq, speed, which, leaves):
    """The map of half a period by integration in time from neighbouring states, central differences."""
    _, cycle = faq.at(speed)[which]
    system, start = magic_formula_model(faq.model, speed=speed), cycle.states.sum(0).real
    n, size = len(start), 1e-5
    begins = start + size * np.concatenate([np.eye(n), -np.eye(n)])

    def rate(t, flat):
        x = flat.reshape(-1, n)
        forces = system.lateral_forces(x @ system.slip_matrix.T)
        return (x @ system.state_matrix.T + forces @ system.force_matrix.T).ravel()

    motion = solve_ivp(rate, (0, cycle.period / 2), begins.ravel(), "DOP853", rtol=1e-11, atol=1e-13)
    after = motion.y[:, -1].reshape(-1, n)
    expected = np.linalg.eigvals(-(after[:n] - after[n:]).T / (2 * size))
    largest = sorted(faq.multipliers(cycle, 256), key=abs)[-4:]
    assert [np.abs(expected - one).min() for one in largest] == pytest.approx([0.0] * 4, abs=1e-4)
    assert (faq.growth(cycle)[0] > 1e-6) == leaves


def in_time(found, cycle, *names):
    """Times over a period and states at these."""
    states, phase = list(found.system.at_one_speed.states), np.linspace(0, 2 * np.pi, 20001)
    x = (np.exp(1j * np.outer(phase, cycle.orders)) @ cycle.states).real.T
    return phase / cycle.angular_frequency, x[[states.index(name) for name in names]]


def test_an_acceleration_by_differences_in_time(faq):
    cycle, values = only(faq, 12.0, "wobble"), faq.model.parameters
    x_p, z_p = values["w"] + values["c"] - 0.8 * np.tan(values["lam"]), -0.8
    time, (side, yaw, lean) = in_time(faq, cycle, "rear_lateral_velocity", "yaw_rate", "lean_rate")
    expected = np.gradient(side + x_p * yaw - z_p * lean, time)[5:-5] + 12.0 * yaw[5:-5]
    assert faq.acceleration(cycle) == pytest.approx(np.abs(expected).max(), rel=1e-5)
    assert faq.acceleration(cycle, (x_p, z_p)) == faq.acceleration(cycle)


def test_a_displacement_by_integration_of_the_path(faq):
    """Of (0.3, -0.9): the contact of the rear wheel goes with the yaw angle, the point with yaw and lean."""
    cycle = only(faq, 12.0, "wobble")
    time, (side, yaw_rate, lean) = in_time(faq, cycle, "rear_lateral_velocity", "yaw_rate", "lean")
    yaw = cumulative_trapezoid(yaw_rate, time, initial=0)
    yaw -= trapezoid(yaw, time) / cycle.period
    path = cumulative_trapezoid(side + 12.0 * yaw, time, initial=0)
    path -= trapezoid(path, time) / cycle.period
    expected = np.abs(path + 0.3 * yaw + 0.9 * lean).max()
    assert faq.displacement(cycle, (0.3, -0.9)) == pytest.approx(expected, rel=1e-5)


def test_limits_of_linear_geometry_are_told_by_name(faq):
    assert faq.beyond(only(faq, 10.0, "wobble")) == ()
    assert faq.beyond(only(faq, 45.0, "weave")) == ("steer",)
    row = faq.frame([45.0], (0.5, -0.5)).iloc[0]
    assert (row["beyond_geometry"], bool(row["within_geometry"])) == ("steer", False)
    assert row["acceleration_g"] * 9.80665 == pytest.approx(row["acceleration_m_s2"], rel=1e-12)


def test_a_table_of_forty_speeds(faq):
    frame = faq.frame(np.arange(1.0, 41.0))
    assert list(frame)[:4] == ["speed_m_s", "mode", "stable", "steer_amplitude_deg"]
    assert len(frame) == 39


def test_a_bicycle_without_cycles():
    found = find_limit_cycles(build(front=None), max_speed=20.0)
    assert not found.branches
    assert found.frame([5.0]).empty


@pytest.mark.parametrize(("model", "tyre", "message"), [
    ({}, MagicTyre(offset=0.02), "offset = 0.02: periodic motions are of tyres without ply steer; give 0"),
    ({"aerodynamic_drag": {"centre_of_pressure_z": -1.1}}, None, "leave out drag, side_slip"),
])  # fmt: skip
def test_what_it_does_not_take(model, tyre, message):
    with pytest.raises(InputError, match=message):
        find_limit_cycles(build(**model), rear=tyre)


@pytest.mark.parametrize("torque", [-0.1, float("nan")])
def test_dry_friction_is_no_push(torque):
    with pytest.raises(InputError, match="dry_friction = .* N m is not allowed; give a finite torque >= 0"):
        find_limit_cycles(build(), dry_friction=torque)
