"""A rider who steers: two sets of published gains on published matrices, and loops written by hand.

Davis bicycle with its rider (M, C1, K0, K2) and the fifteen controllers identified by Schwab, de Lange, Happee & Moore
(2013), Multibody System Dynamics: moorepants/RiderID, functions/davisbike.m and data/ResultsvKFromPeter19dec2012.txt,
CC BY 3.0. Gains of Hess, Moore & Hubbard (2012): moorepants/HumanControl, gains/BenchmarkSteerGains.txt, MIT.
"""

import control
import numpy as np
import pytest
from built import linear as riding
from eigenvalue_sets import assert_same_eigenvalues
from lagrange import LagrangeBicycle

from bicycle import critical_speeds, load_bicycle, modes
from tyre.ground import InputError

M = np.array([[133.31668525, 2.43885691], [2.43885691, 0.22419262]])
C1 = np.array([[0, 44.65783277], [-0.31500940, 1.46189246]])
K0 = np.array([[-116.73261635, -2.48042260], [-2.48042260, -0.77434358]])
K2 = np.array([[0, 104.85805076], [0, 2.29688720]])
DAVIS = "rigid_rider_joined"
G, OMEGA, ZETA = 9.81, 2 * np.pi * 2.17, np.sqrt(0.5)
RUNS = """248 2.15 5.17 27.21 14.39 -1.92
249 2.19 28.97 32.85 29.02 -2.50
250 2.19 24.25 32.51 26.44 -2.57
184 3.19 22.72 26.12 65.92 -3.00
185 3.18 43.23 30.45 94.00 -3.21
186 3.11 31.12 28.46 71.26 -2.95
251 4.27 72.83 32.44 211.79 -3.81
252 4.25 41.51 28.22 177.45 -3.19
253 4.25 45.43 28.99 169.47 -3.60
190 5.98 34.19 23.34 334.82 -3.52
191 6.06 29.63 22.83 322.89 -3.81
192 6.07 28.32 20.43 293.30 -3.31
255 7.32 37.19 26.66 533.49 -5.37
256 7.34 48.65 29.89 583.43 -7.05
257 7.36 45.58 26.97 617.10 -4.64"""
HESS = {  # speed: k_delta, k_phi_dot, k_phi, k_psi, k_y of the benchmark
    3.6: (33.1311, -0.0535, 19.8266, 0.1056, 0.1338),
    4.8: (44.6406, -0.0529, 13.2253, 0.1720, 0.1001),
    8.34: (78.2238, -0.0388, 9.2493, 0.4676, 0.0571),
}


def identified(run):
    speed, roll, roll_rate, integral, steer_rate = map(float, run.split()[1:])
    gains = {"roll": roll, "roll_rate": roll_rate, "steer_rate": steer_rate}
    return speed, gains, integral


def bicycle_by_hand(speed):
    """State space (lean, steer, lean rate, steer rate, integral of steer) under a steer torque."""
    inverse, state = np.linalg.inv(M), np.zeros((5, 5))
    state[:2, 2:4], state[4, 1] = np.eye(2), 1
    state[2:4, :2], state[2:4, 2:4] = -inverse @ (G * K0 + speed**2 * K2), -inverse @ C1 * speed
    return control.ss(state, np.r_[0, 0, inverse[:, 1], 0][:, None], np.eye(5), 0)


def closed_by_hand(speed, gains, integral, *behind):
    row = [gains["roll"], 0, gains["roll_rate"], gains["steer_rate"], integral]
    muscles = control.tf([OMEGA**2], [1, 2 * ZETA * OMEGA, OMEGA**2])
    rider = control.ss([], [], [], [row])
    for part in (muscles, *behind):
        rider = control.series(rider, control.ss(part))
    return control.feedback(bicycle_by_hand(speed), rider, sign=1).poles()


@pytest.mark.parametrize("run", RUNS.splitlines())
def test_fifteen_identified_riders_hold_the_bicycle_they_were_identified_on(run):
    """The coefficients of the packaged bicycle are those of the paper's program to 7 digits, so are the roots."""
    speed, gains, integral = identified(run)
    found = riding(DAVIS, rider_control=gains, rider_steer_memory={"gain": integral}).eigenvalues(speed)
    assert_same_eigenvalues(found, closed_by_hand(speed, gains, integral), rtol=2e-5)
    assert found.real.max() < -0.5
    assert speed > 5 or riding(DAVIS).eigenvalues(speed).real.max() > 0.4  # below 5 m/s it falls without them


@pytest.mark.parametrize("delay", [0.03, 0.12])
def test_a_delay_is_the_pade_approximant_of_order_two(delay):
    """control.pade is the independent one; the exact delay agrees up to 2 rad of phase."""
    speed, gains, integral = identified(RUNS.splitlines()[4])
    memory = {"gain": integral}
    found = riding(DAVIS, rider_control=gains, rider_steer_memory=memory, rider_delay={"delay": delay})
    expected = closed_by_hand(speed, gains, integral, control.tf(*control.pade(delay, 2)))
    assert_same_eigenvalues(found.eigenvalues(speed), expected, rtol=2e-5)


def response(model, speed, output, omega):
    state, inputs, outputs = model.matrices_at(speed)
    moved = np.linalg.solve(1j * omega * np.eye(len(state)) - state, inputs[:, model.inputs.index("steer_torque")])
    found = dict(zip(model.outputs, outputs @ moved, strict=True)) | dict(zip(model.states, moved, strict=True))
    return found[output]


@pytest.mark.parametrize("speed", HESS)
def test_published_gains_cross_over_where_hess_says(speed):
    """Hess, Moore & Hubbard (2012): the loops of roll, heading and place cross over at 2, 1 and 0.5 rad/s.

    Each with the outer loops open. Gains have four digits; muscles 30 rad/s, damping 0.707.
    """
    steer, roll_rate, roll, heading, place = HESS[speed]
    muscles = {"filter_frequency": 30.0, "filter_damping": 0.707}
    benchmark = load_bicycle("benchmark")

    def command(omega):
        return 900 / (900 - omega**2 + 2j * 0.707 * 30 * omega)

    inner = muscles | {"steer": -steer, "roll_rate": -steer * roll_rate}
    lean = response(riding(rider_control=inner), speed, "lean", 2.0)
    assert abs(steer * roll_rate * roll * command(2.0) * lean) == pytest.approx(1, abs=0.001)

    rolling = inner | {"roll": -steer * roll_rate * roll}
    yaw = response(riding(rider_control=rolling), speed, "yaw_rate", 1.0) / 1j
    assert abs(steer * roll_rate * roll * heading * command(1.0) * yaw) == pytest.approx(1, abs=0.001)

    gain = -steer * roll_rate * roll * heading
    model = riding(rider_control=rolling, rider_path={"heading": gain, "position": 1e-9})
    angle, rear, turned = (response(model, speed, name, 0.5) for name in ("heading", "rear_position", "steer"))
    front = rear + benchmark["w"] * angle - benchmark["c"] * np.cos(benchmark["lam"]) * turned
    assert abs(gain * place * command(0.5) * front) == pytest.approx(1, abs=0.002)

    whole = riding(rider_control=rolling, rider_path={"heading": gain, "position": gain * place})
    assert whole.eigenvalues(speed).real.max() < -0.2


def test_the_place_and_heading_are_those_of_a_bicycle_that_rolls_without_slip():
    """Meijaard et al. (2007), eq. 5.7: w psi' = (v delta + c delta') cos lam; the rear contact goes v psi sideways."""
    speed, path = 4.3, {"heading": 3.0, "position": 0.4}
    model = riding(rider_control={"roll": 40.0, "roll_rate": 3.0}, rider_path=path)
    state, names, benchmark = model.matrices_at(speed)[0], list(model.states), load_bicycle("benchmark")
    scale = np.cos(benchmark["lam"]) / benchmark["w"]
    row = dict(zip(names, state[names.index("heading")], strict=True))
    assert row["steer"] == pytest.approx(speed * scale, rel=1e-12)
    assert row["steer_rate"] == pytest.approx(benchmark["c"] * scale, rel=1e-12)
    assert dict(zip(names, state[names.index("rear_position")], strict=True))["heading"] == pytest.approx(speed)


@pytest.mark.parametrize("name", ["benchmark", "pista_charlie_hoods", "rigid_rider_joined"])
@pytest.mark.parametrize("speed", [2.5, 7.0])
def test_a_rider_on_tyres_is_lagranges_bicycle_with_his_torque(name, speed):
    """Lateral place and heading are coordinates there; his loop is closed here by hand, on every signal at once."""
    stiffness, length = {"rear": 8000.0, "front": 6000.0}, {"rear": 0.1, "front": 0.14}
    gains = {"roll": 40.0, "roll_rate": 9.0, "steer": -30.0, "steer_rate": -2.5}
    tyre = {"cornering_stiffness": stiffness, "relaxation_length": length}
    path = {"heading": 4.0, "position": 0.7}
    found = riding(name, relaxation_length=tyre, rider_path=path, rider_control=gains).eigenvalues(speed)

    exact = LagrangeBicycle(load_bicycle(name).values, stiffness=(8000.0, 6000.0), length=(0.1, 0.14))
    n, inner = len(exact.mass), exact.state_matrix(speed)
    y, yaw, lean, steer = np.eye(n)
    assert exact.ports[0] == pytest.approx(y)
    angles = gains["roll"] * lean + gains["steer"] * steer + path["heading"] * yaw + path["position"] * exact.ports[1]
    rates = gains["roll_rate"] * lean + gains["steer_rate"] * steer
    size = len(inner)
    state = np.zeros((size + 2, size + 2))
    state[:size, :size] = inner
    state[n : 2 * n, size] = np.linalg.solve(exact.mass, steer)
    state[size, size + 1] = 1
    state[size + 1, : 2 * n] = OMEGA**2 * np.r_[angles, rates]
    state[size + 1, size:] = -(OMEGA**2), -2 * ZETA * OMEGA
    assert_same_eigenvalues(found, np.linalg.eigvals(state), rtol=1e-6, atol=1e-5)


def test_a_rider_of_fixed_gains_holds_a_band_around_the_speed_of_the_gains():
    speed, gains, integral = identified(RUNS.splitlines()[6])
    model = riding(DAVIS, rider_control=gains, rider_steer_memory={"gain": integral})
    last = critical_speeds(model, 12.0)[-2:]
    assert [one.direction for one in last] == ["stabilising", "destabilising"]
    assert last[0].speed < speed < last[1].speed
    assert "muscles" in modes(model, [speed]).names


@pytest.mark.parametrize(("effects", "words"), [
    ({"rider_delay": {"delay": 0.1}}, "'rider_delay' needs a rider torque, .* use rider_control"),
    ({"rider_control": {}, "rider_steer_memory": {"gain": 0.0}}, "gain = 0 N m/rad s adds a root at zero"),
    ({"rider_control": {}, "rider_path": {"heading": 1.0, "position": 0.0}}, "leaves the lane free"),
    ({"rider_control": {}, "rider_path": {"heading": 1.0, "position": 1.0}, "rider_steer_memory": {"gain": 1.0}},
     "exclude each other: both are the heading loop of the rider"),
    ({"rider_control": {}, "rider_delay": {"delay": 0.0}}, "delay = 0 s is outside 0.001"),
])  # fmt: skip
def test_what_makes_no_rider_is_refused(effects, words):
    with pytest.raises(InputError, match=words):
        riding(**effects)
