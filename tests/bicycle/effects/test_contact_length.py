"""The tyre with a finite contact against the exact stretched string, coded here from its deflection alone.

c_c = 1; inputs alpha = -s/v and phi = -(yaw rate)/v go as exp(p x) with the travelled distance x; deflection > 0 to the
right, forces on the wheel. In the contact the string keeps to the ground path that its leading point has laid down.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from built import built
from hypothesis import given, settings
from hypothesis import strategies as st

from bicycle import Model, critical_speeds
from bicycle.motion import magic_formula_model
from tyre.ground import InputError
from tyre.maps import half_length_under_load, string_trail

LENGTH = 0.11  # m, C/K of a racing tyre
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
CORNERING = {"rear": 6500.0, "front": 6100.0}
RELAXATION = {"rear": 0.108, "front": 0.101}
LAW = {"cornering_stiffness": CORNERING, "relaxation_length": RELAXATION}
HALF = {"rear": 0.034, "front": 0.03}
WHEELS = ("rear", "front")


def model(tyre: dict | None = None, *, bicycle: str = "benchmark", **tables: dict) -> Model:
    """On tyres as above, but for what ``tyre`` says."""
    return built(bicycle, relaxation_length=LAW | (tyre or {}), **tables)


def deflection(p: complex, a: float, sigma: float, distance: np.ndarray) -> np.ndarray:
    """Deflection (m, 2) at a distance behind the leading edge, for alpha and for phi.

    The leading point obeys dv1/dx + v1/sigma = alpha + a phi; what it laid down at the time of a point of the contact
    has since moved off the wheel plane by the integral of alpha + (its place then) phi.
    """
    leading = np.array([1.0, a]) / (p + 1 / sigma)
    since = distance[:, None] / 2 * (NODES + 1)  # (m, nodes)
    weight = distance[:, None] / 2 * WEIGHTS * np.exp(-p * since)
    place = a - distance[:, None] + since
    added = np.stack([weight.sum(1), (weight * place).sum(1)], axis=1)
    return leading * np.exp(-p * distance)[:, None] + added


def exact_string(p: complex, a: float, sigma: float) -> np.ndarray:
    """[[F/alpha, F/phi], [M/alpha, M/phi]]: lateral force and moment of the contact and of both free ends."""
    x = a * NODES
    v = deflection(p, a, sigma, a - x)
    ends = deflection(p, a, sigma, np.array([0.0, 2 * a]))
    force = a * WEIGHTS @ v + sigma * ends.sum(0)
    moment = a * (WEIGHTS * x) @ v + sigma * (a + sigma) * (ends[0] - ends[1])
    return np.array([force, moment])


def states_of(built: Model, wheel: str) -> tuple[np.ndarray, np.ndarray]:
    """A and B of d[F, M]/dx = A [F, M] + B [alpha, phi], read off the matrices of a model."""
    linear = built.linear_model()
    dynamics, states = linear.ranges[0].matrices.dynamics, linear.states
    rows = [states.index(f"{wheel}_lateral_force"), states.index(f"{wheel}_aligning_moment")]
    lateral, yaw = states.index("rear_lateral_velocity"), states.index("yaw_rate")
    lever = 0.0 if wheel == "rear" else linear.parameters["w"]
    gain = -dynamics[0][np.ix_(rows, [lateral, yaw])]
    gain[:, 1] -= lever * gain[:, 0]  # the yaw rate moves the front contact sideways too
    return dynamics[1][np.ix_(rows, rows)], gain


def response(built: Model, wheel: str, p: complex) -> np.ndarray:
    a, b = states_of(built, wheel)
    return np.linalg.solve(p * np.eye(2) - a, b)


def string_like(half: float, length: float = LENGTH) -> Model:
    """Tyres with c_c = 1 N/m^2, as the string above."""
    tyre = {"cornering_stiffness": 2 * length**2, "relaxation_length": length}
    return model(tyre, contact_length={"half_length": half})


def error(found: complex, exact: complex) -> tuple[float, float]:
    """Amplitude in per cent, phase in degrees."""
    ratio = found / exact
    return 100 * (abs(ratio) - 1), math.degrees(np.angle(ratio))


# half length, wavelength (m), per cent and degrees of F/alpha, of M/alpha and F/phi, of M/phi; F/alpha of a single lag
TABLE = [
    (0.03, 1.0, (-0.1, 0.0), (-0.9, 0.0), (-9.2, -3.2), (-7.5, -5.3)),
    (0.03, 0.33, (-1.5, 0.4), (-8.3, 2.2), (-17.1, -7.7), (-18.3, -0.1)),
    (0.045, 2.2, (0.0, 0.0), (-0.3, 0.0), (-11.7, -2.0), (-2.7, -4.3)),
    (0.045, 0.5, (-1.6, 0.0), (-7.4, 1.3), (-19.1, -7.8), (-20.5, -3.9)),
    (0.045, 0.22, (-1.1, 4.9), (-20.9, 18.2), (-35.7, -3.4), (-18.5, 9.9)),
]


@pytest.mark.parametrize(("half", "wavelength", "force", "coupled", "turning", "single"), TABLE)
def test_amplitude_and_phase_against_the_exact_string(half, wavelength, force, coupled, turning, single):
    p = 2j * math.pi / wavelength
    found, exact = response(string_like(half), "front", p), exact_string(p, half, LENGTH - half)
    for (row, column), expected in (((0, 0), force), ((1, 0), coupled), ((0, 1), coupled), ((1, 1), turning)):
        np.testing.assert_allclose(error(found[row, column], exact[row, column]), expected, atol=0.1)
    np.testing.assert_allclose(error(2 * LENGTH**2 / (1 + LENGTH * p), exact[0, 0]), single, atol=0.1)


def test_rolling_steadily_and_standing_still():
    """Long waves: C, -t C, t C, 0 and the lag L - t. Short waves: the stiffness at rest, K and t C in yaw."""
    for half in (0.02, 0.045, 0.08):
        slow, sigma = 1e-5, LENGTH - half
        trail = half * (half**2 / 3 + sigma * LENGTH) / LENGTH**2  # Pacejka's form
        found, exact = response(string_like(half), "rear", slow), exact_string(slow, half, sigma)
        expected = 2 * LENGTH**2 * np.array([[1, trail], [-trail, 0]])
        np.testing.assert_allclose(found, expected, rtol=3e-6, atol=1e-8)
        np.testing.assert_allclose(exact, expected, rtol=3e-6, atol=1e-8)
        for matrix in (found, exact):
            assert (1 - matrix[0, 0] / expected[0, 0]) / slow == pytest.approx(LENGTH - trail, rel=1e-4)
        fast = 1e7
        turned = np.diag([2 * LENGTH, 2 * half * (half**2 / 3 + sigma * LENGTH)])
        np.testing.assert_allclose(fast * response(string_like(half), "rear", fast), turned, rtol=1e-5, atol=1e-7)
        np.testing.assert_allclose(fast * exact_string_at_rest(half, sigma), fast * turned, rtol=1e-12, atol=1e-9)


def exact_string_at_rest(a: float, sigma: float) -> np.ndarray:
    """Force and moment of a contact line shifted by 1 m and turned by 1 rad, its free ends following."""
    x = a * NODES
    shifted = a * WEIGHTS.sum() + 2 * sigma
    turned = a * (WEIGHTS * x) @ x + 2 * sigma * (a + sigma) * a
    return np.diag([shifted, turned])


def test_without_length_it_is_the_single_lag():
    """A power series in the half length, whose limit at zero is the relaxing tyre to 1e-9."""
    beside = {"camber_thrust": {"camber_stiffness": 400.0}}
    expected = model(**beside).linear_model().eigenvalues(7.0)
    table = []
    for half in 3.2e-3 / 2.0 ** np.arange(8):
        found = model(**beside, contact_length={"half_length": half}).linear_model().eigenvalues(7.0)
        table.append(np.array([found[np.abs(found - value).argmin()] for value in expected]))
    size = np.maximum(1, np.abs(expected))
    first = [np.abs((row - expected) / size).max() for row in table]
    np.testing.assert_allclose(first[-2] / first[-1], 2, rtol=0.01)
    for order in range(1, len(table)):  # Richardson's extrapolation
        table = [(2**order * fine - coarse) / (2**order - 1) for coarse, fine in pairwise(table)]
    assert np.abs((table[0] - expected) / size).max() < 1e-9


def test_stiff_and_short_it_is_the_bicycle_that_rolls_without_slip():
    """Meijaard et al. (2007) at 5 m/s; the error falls with the compliance and the half length.

    Extrapolated twice (Richardson), for what is stiffer still is lost in rounding.
    """
    published = np.array([-14.07838969279822, -0.77534188219585 + 4.46486771378823j, -0.32286642900409])

    def nearest(stiffer: float) -> np.ndarray:
        tyre = {"cornering_stiffness": 1e7 * stiffer, "relaxation_length": 1e-3}
        found = model(tyre, contact_length={"half_length": 1e-4 / stiffer}).linear_model().eigenvalues(5.0)
        return np.array([found[np.abs(found - value).argmin()] for value in published])

    one, two, four = nearest(5.0), nearest(10.0), nearest(20.0)
    assert np.abs(four - published).max() < np.abs(two - published).max() < np.abs(one - published).max()
    assert np.abs(four - published).max() < 5e-3
    first, second = 2 * two - one, 2 * four - two
    assert np.abs((4 * second - first) / 3 - published).max() < 2e-5


def test_capsize_depends_on_the_trail_but_not_on_the_lag():
    """A steady turn knows C and t only: other relaxation lengths with the half length of the same trail agree."""
    speeds = []
    for length in (0.08, 0.11, 0.16):
        half = length * (1 - (1 - 3 * 0.01 / length) ** (1 / 3))  # 3 L^2 t = L^3 - (L - a)^3
        beside = {"twisting_torque": {"twisting_stiffness": 1.0}, "camber_thrust": {"camber_stiffness": 300.0}}
        whole = model({"relaxation_length": length}, contact_length={"half_length": half}, **beside)
        speeds.append([c.speed for c in critical_speeds(whole) if c.mode == "capsize"])
    assert len(speeds[0]) == 1
    np.testing.assert_allclose(speeds[1:], [speeds[0]] * 2, rtol=1e-8)


@settings(max_examples=15)
@given(st.floats(0.05, 0.95), st.floats(0.05, 0.3), st.floats(0.01, 3.0), st.floats(0.01, 30.0))
def test_shimmy_of_a_trailing_wheel(share, length, caster, inertia):
    """An undamped wheel on a caster e: the leading point of a string tracks straight where e = sigma + a.

    There it is neutral at every speed, and fast it is stable where e is longer (Pacejka, ch. 5). With the states of the
    package Routh's condition is (e - L) (I v^2 / C - t^2 e) > 0. ``caster`` is e / L, ``inertia`` I v^2 / (C L^3).
    """
    half, e = share * length, caster * length
    a, b = states_of(string_like(half, length), "rear")
    moment_of_inertia = inertia * 2 * length**5  # times v^2
    rows = np.zeros((4, 4))  # yaw, its slope over the distance, F, M; alpha = yaw + e yaw', phi = -yaw'
    rows[0, 1] = 1
    rows[1, 2:] = np.array([-e, 1]) / moment_of_inertia
    rows[2:, 0], rows[2:, 1], rows[2:, 2:] = b[:, 0], e * b[:, 0] - b[:, 1], a
    trail = string_trail(half_length=half, relaxation_length=length)
    stable = (caster - 1) * (inertia - (trail / length) ** 2 * caster)
    growth = np.linalg.eigvals(rows * length).real.max()
    if abs(stable) > 1e-4:
        assert (growth < 0) == (stable > 0)
    rows[1, 2:] = np.array([-length, 1]) / moment_of_inertia
    rows[2:, 1] = length * b[:, 0] - b[:, 1]
    assert np.linalg.eigvals(rows * length).real.max() == pytest.approx(0, abs=1e-7)
    exact = exact_string(0.7j / length, half, length - half)  # the same of the exact string at e = L: a plain spring
    yaw = exact @ np.array([1 + 0.7j, -0.7j / length])
    moment = yaw[1] - length * yaw[0]
    assert moment == pytest.approx(-2 * length**2 * (length + trail), rel=1e-9)


HINGE = {"joint_x": 0.85, "joint_z": -0.65}
CAMBER = {"rear": 365.0, "front": 275.0}


class OnStrings:
    """A bicycle with rider, flexible front, camber thrust; ports from geometry, tyres from a frequency response."""

    def __init__(self) -> None:
        front = {"stiffness": 5000.0, "damping": 20.0, **HINGE}
        self.effects = {"camber_thrust": {"camber_stiffness": CAMBER}, "front_compliance": front}
        linear = model(bicycle="pista_rider", **self.effects).linear_model()
        matrices, p = linear.ranges[0].matrices, linear.parameters
        assert linear.states[8:] == ("rear_lateral_force", "front_lateral_force")
        self.mass = matrices.mass[:8, :8]
        self.dynamics = {power: m[:8, :8] for power, m in matrices.dynamics.items()}  # without any tyre
        cosine, sine = math.cos(p["lam"]), math.sin(p["lam"])
        ahead, up = p["w"] - HINGE["joint_x"], -HINGE["joint_z"]
        tilt = p["lam"]  # the hinge is perpendicular to the steer axis: its axis is (cos, 0, -sin)
        rates = {
            "rear": [1, 0, 0, 0, 0],
            "front": [1, p["w"], 0, -math.sin(tilt) * ahead - math.cos(tilt) * up, -p["c"] * cosine],
        }
        turns = {"rear": [0, 1, 0, 0, 0], "front": [0, 1, 0, -math.sin(tilt), cosine]}
        leans = {"rear": [1, 0, 0], "front": [1, math.cos(tilt), sine]}
        every = ({w: np.array(r, float) for w, r in rows.items()} for rows in (rates, turns, leans))
        self.rates, self.turns, self.leans = every

    def matrix(self, z: complex, speed: float, law) -> np.ndarray:
        """z E - F(v) - ports x tyres x motion, (8, 8); its determinant vanishes at the eigenvalues."""
        total = z * self.mass - sum(speed**power * m for power, m in self.dynamics.items())
        for wheel in WHEELS:
            half, length, stiffness = HALF[wheel], RELAXATION[wheel], CORNERING[wheel]
            tyre_of = stiffness / (2 * length**2) * law(z / speed, half, length - half)
            slip = np.concatenate([self.rates[wheel], -speed * self.turns[wheel][2:]]) / -speed
            trail = string_trail(half_length=half, relaxation_length=length)
            turn = np.concatenate([self.turns[wheel] / -speed, CAMBER[wheel] / (trail * stiffness) * self.leans[wheel]])
            ports = np.stack([self.rates[wheel], self.turns[wheel]], axis=1)
            total[:5] -= ports @ tyre_of @ np.stack([slip, turn])
        return total

    def root(self, z: complex, speed: float, law) -> complex:
        """Newton's method on the determinant."""
        for _ in range(50):
            h = 1e-6 * max(1.0, abs(z))
            slope = (self.matrix(z + h, speed, law) - self.matrix(z - h, speed, law)) / (2 * h)
            step = 1 / np.trace(np.linalg.solve(self.matrix(z, speed, law), slope))
            z -= step
            if abs(step) < 1e-11 * abs(z):
                return z
        raise AssertionError("no root")


def of_states(p: complex, a: float, sigma: float) -> np.ndarray:
    """The two states by hand, with c_c = 1."""
    length = sigma + a
    trail = a * (a**2 / 3 + sigma * length) / length**2
    matrix = np.array([[p, -1 / (trail * length)], [1, p + 1 / trail]])
    return np.linalg.solve(matrix, np.diag([2 * length, 2 * length**2 * trail]))


def test_the_bicycle_on_exact_strings_has_the_same_weave_and_wobble():
    """Independent assembly: the same states to rounding, the exact string within what docs/physics.md says."""
    strings = OnStrings()
    linear = model(bicycle="pista_rider", **strings.effects, contact_length={"half_length": HALF}).linear_model()
    wobble = {3.6: 0.17, 6.0: 0.07, 20.0: 0.01}  # 1/s
    for speed, bound in wobble.items():
        values = linear.eigenvalues(speed)
        values = values[values.imag > 0.5]
        for z in values:
            assert abs(strings.root(z + 1e-3, speed, of_states) - z) < 1e-8 * max(1, abs(z))
        for z in values[(values.imag < 100) & (values.imag > 30) & (values.real > -20)]:
            assert abs(strings.root(z, speed, exact_string) - z) < bound
        for z in values[(values.imag < 30) & (values.real > -20)]:  # weave
            assert abs(strings.root(z, speed, exact_string) - z) < 0.03


def test_a_soft_wheel_is_a_spring_in_series_with_the_string():
    """alpha of the tyre = alpha - p F/K_w: eliminated by hand."""
    springs = {"rear": 2e5, "front": 1e5}
    contact = {"contact_length": {"half_length": HALF}}
    alone, soft = model(**contact), model(**contact, wheel_compliance={"stiffness": springs})
    for wheel in WHEELS:
        p = 2j * math.pi / 0.45
        hard = response(alone, wheel, p)
        spring = np.array([[p / springs[wheel], 0], [0, 0]])
        expected = np.linalg.solve(np.eye(2) + hard @ spring, hard)
        np.testing.assert_allclose(response(soft, wheel, p), expected, rtol=1e-10)


def test_camber_thrust_acts_at_the_centre_and_builds_up_like_turn_slip():
    camber = {"camber_stiffness": {"rear": 500.0, "front": 400.0}}
    linear = model(contact_length={"half_length": HALF}, camber_thrust=camber).linear_model()
    dynamics, states = linear.ranges[0].matrices.dynamics, linear.states
    rows = [states.index("rear_lateral_force"), states.index("rear_aligning_moment")]
    seen = dynamics[1][rows, states.index("lean")]
    np.testing.assert_allclose(-np.linalg.solve(dynamics[1][np.ix_(rows, rows)], seen), [500.0, 0.0], atol=1e-9)


def test_without_turn_slip_the_standing_wheel_turns_freely():
    none, gain = (states_of(model(contact_length={"half_length": HALF, "turn_slip_share": share}), "front")[1]
                  for share in (0.0, 0.5))  # fmt: skip
    np.testing.assert_array_equal(none[1], 0)
    trail = string_trail(half_length=HALF["front"], relaxation_length=RELAXATION["front"])
    assert gain[1, 1] == pytest.approx(0.5 * trail * CORNERING["front"])


@pytest.mark.parametrize(("tables", "words"), [
    *(({"relaxation_length": LAW, "contact_length": {}} | other, "exclude each other: both are the aligning moment of")
      for other in ({"pneumatic_trail": {}}, {"aligning_moment": {"aligning_stiffness": 1, "relaxation_length": 0.1}})),
    *((law | {"contact_length": {}}, "'contact_length' needs a relaxing contact, .* use relaxation_length")
      for law in ({}, {"side_slip": {"cornering_stiffness": 6000.0}})),
    ({"relaxation_length": LAW, "contact_length": {"half_length": {"rear": 0.03, "front": 0.12}}},
     "half_length.front = 0.12 m must be less than the relaxation length, 0.101 m"),
])  # fmt: skip
def test_what_it_cannot_stand_beside_is_refused(tables, words):
    with pytest.raises(InputError, match=words):
        built(**tables)


def test_nonlinear_tyres_refuse_it():
    with pytest.raises(InputError, match="touch the ground at a point; the effect 'contact_length' is linear only"):
        magic_formula_model(model(contact_length={}), speed=5.0)


def test_half_length_from_load_and_pressure():
    """Area and shape of the ellipse: pi a b = N/p, a/b = sqrt(R/rho)."""
    a = half_length_under_load(load=400.0, pressure=5.5e5, wheel_radius=0.335, tyre_width=0.025)
    b = a / math.sqrt(0.335 / 0.0125)
    assert math.pi * a * b == pytest.approx(400 / 5.5e5)
    assert 0.034 < a < 0.035


@given(share=st.floats(0.01, 1.0), length=st.floats(0.02, 0.5))
def test_trail_of_a_half_length(share, length):
    trail = string_trail(half_length=share * length, relaxation_length=length)
    assert share * length / 3 - 1e-12 < trail <= share * length
    assert 3 * length**2 * trail == pytest.approx(length**3 - (length - share * length) ** 3, rel=1e-9)


def test_impossible_sizes_are_refused():
    with pytest.raises(InputError, match="pressure = 0 must be a positive number in SI units"):
        half_length_under_load(load=400.0, pressure=0, wheel_radius=0.335, tyre_width=0.025)
