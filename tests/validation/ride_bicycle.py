"""The bicycle of a SYNTHETIC ride: Kane's equations with the inputs and the outputs of a ride.

Nothing is shared with the package but names of parameters. Signs: x ahead, y right, z down; lean, steer and yaw to the
right are positive, lateral forces to the right too. The tyres relax and do not saturate; loads are those of standing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle import load_bicycle
from tests.validation.blind.hidden import perturbed, uncertainty
from tests.validation.kane_bicycle import STEP, WHEELS, KaneBicycle

Real = NDArray[np.float64]
Random = np.random.Generator

INPUTS = ("steer_torque", "lean_torque", "side_force", "yaw_moment")  # N m, N m, N, N m
PLACE = (0.3, -0.8)  # x and z of the accelerometer on the rear frame, m


class RideBicycle(KaneBicycle):
    """A bicycle with the inputs and outputs of a ride; ``outside`` holds what no library of effects knows.

    ``outside``: ``lean_spring`` (N m/rad), ``structural_damper`` (spring in N m/rad and time in s of a Maxwell element
    at the steering), ``rotor`` (spin momenta on the frame and on the fork, kg m^2/s), ``bar_mass`` (inertia in kg m^2,
    spring and damper of a mass that is loose on the handlebar).
    """

    def __init__(
        self, p: Mapping[str, float], effects: Sequence[str], speed: float, outside: Mapping[str, tuple[float, ...]]
    ) -> None:
        self.outside = dict(outside)
        super().__init__(p, effects, speed)
        on_frame, on_fork = self.outside.get("rotor", (0.0, 0.0))
        self.spins += [("pitch", 0.0, -on_frame), ("steer", 0.0, -on_fork)]

    def _hang_hinges(self) -> None:
        super()._hang_hinges()
        if "bar_mass" in self.outside:
            axis, foot, _ = self.hinges["steer"]
            self.hinges["bar_mass"] = (axis, foot, "steer")

    def _bodies(self) -> Any:
        yield from super()._bodies()
        if "bar_mass" in self.outside:
            axis, foot, _ = self.hinges["steer"]
            top = foot - axis * (foot[2] - self.p["zH"]) / axis[2]
            yield 0.0, top, self.outside["bar_mass"][0] * np.eye(3), "bar_mass"

    def _extra_states(self) -> Any:
        yield from super()._extra_states()
        if "structural_damper" in self.outside:
            yield "structural_torque"

    def _torques(self, angle: Any, rate: Any, second: Any, state: Any, front_place: Any, rates: Any) -> Any:
        torques = super()._torques(angle, rate, second, state, front_place, rates)
        if "lean_spring" in self.outside:
            torques["lean"] = torques["lean"] - self.outside["lean_spring"][0] * angle["lean"]
        if "structural_damper" in self.outside:
            spring, time = self.outside["structural_damper"]
            torque = state["structural_torque"]
            rates["structural_torque"] = spring * rate["steer"] - torque / time
            torques["steer"] = torques["steer"] - torque
        if "bar_mass" in self.outside:
            _, spring, damper = self.outside["bar_mass"]
            torques["bar_mass"] = -spring * angle["bar_mass"] - damper * rate["bar_mass"]
        return torques

    def mass_matrix(self) -> Real:
        """Slopes (n, n) of the rows of y, yaw and the hinges over the accelerations, kg and kg m^2."""
        n, m = 1 + len(self.names), len(self.extra)
        still = np.zeros((n, n))
        a = 1j * STEP * np.eye(n)
        rows, _, _ = self.residual(still, still, a, np.zeros((2, n)), np.zeros((m, n)), np.zeros(n))
        return np.asarray(rows[:n].imag / STEP)

    def lateral_velocity_of(self, carrier: str, point: tuple[float, float]) -> Real:
        """Slopes (n,) of the lateral velocity of a point (x, z in m) of what a hinge carries over V, r and rates."""
        n = 1 + len(self.names)
        still = np.zeros((n, n))
        moved = self._moved(still, 1j * STEP * np.eye(n), still, (self.v, 0.0))
        _, _, omega, _, velocity, _, _ = moved[carrier]
        x, z = point
        across = velocity[1] + omega[2] * x - omega[0] * z
        return np.asarray(np.broadcast_to(across, (n,)).imag / STEP)

    def mass_centre_velocity(self) -> tuple[float, Real]:
        """Mass of the whole (kg), and slopes (n,) of the lateral velocity of its centre over V, r and rates."""
        whole, momentum = 0.0, np.zeros(1 + len(self.names))
        for mass, centre, _, carrier in self.bodies:
            whole += mass
            momentum += mass * self.lateral_velocity_of(carrier, (float(centre[0, 0]), float(centre[2, 0])))
        return whole, momentum / whole


@dataclass(frozen=True)
class Motion:
    """x' = matrix x + inputs u of a bicycle at a speed; outputs are rows over [x, u]; u in the order of ``INPUTS``."""

    speed: float  # m/s
    states: tuple[str, ...]
    matrix: Real  # (n, n)
    inputs: Real  # (n, 4)
    outputs: Mapping[str, Real]  # name -> (n + 4,)
    mass: float  # kg
    loads: Real  # (2,) rear and front, N

    @property
    def growth(self) -> float:
        """Largest real part of an eigenvalue without a rider, 1/s."""
        return float(np.linalg.eigvals(self.matrix).real.max())


@dataclass(frozen=True)
class RiddenBicycle:
    """A bicycle as it is, and what a file says of it.

    ``values`` holds the true parameters and ``stated`` those of the file, both by the package's keys (SI), an effect's
    as ``effect.key`` or ``effect.key.wheel``. ``declared`` are the effects of the file; ``hidden`` is what the bicycle
    has beside them, ``outside`` what no library knows.
    """

    base: str  # packaged bicycle from which it was drawn
    values: Mapping[str, float]
    stated: Mapping[str, float]
    declared: tuple[str, ...]
    hidden: tuple[str, ...] = ()
    outside: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    push_at: tuple[float, float] = (0.3, -0.9)  # where the side force acts on the rear frame: x and z, m

    @cached_property
    def known_motions(self) -> dict[float, Motion]:
        """Motions that were asked for, by speed (m/s)."""
        return {}

    def motion(self, speed: float) -> Motion:
        """Linear motion at a speed (m/s)."""
        if speed not in self.known_motions:
            self.known_motions[speed] = self._motion(speed)
        return self.known_motions[speed]

    def _motion(self, speed: float) -> Motion:
        kane = RideBicycle(self.values, (*self.declared, *self.hidden), speed, self.outside)
        names, matrix, _ = kane.state_matrix()
        inputs = self._input_columns(kane, len(names))
        outputs = _output_rows(kane, names, matrix, inputs)
        return Motion(speed, tuple(names), matrix, inputs, outputs, kane.mass_centre_velocity()[0], kane.loads)

    def _input_columns(self, kane: RideBicycle, states: int) -> Real:
        n = 1 + len(kane.names)
        forces = np.zeros((n, len(INPUTS)))  # what each input does to y, yaw and the hinges, by virtual power
        forces[1 + kane.names.index("steer"), 0] = 1.0
        forces[1 + kane.names.index("lean"), 1] = 1.0
        forces[:, 2] = kane.lateral_velocity_of("pitch", self.push_at)
        forces[1 + kane.names.index("yaw"), 3] = 1.0
        return np.vstack([np.linalg.solve(kane.mass_matrix(), forces), np.zeros((states - n, len(INPUTS)))])

    def stated_effects(self) -> dict[str, dict[str, Any]]:
        """Declared effects and their stated values, as the tables of a model file."""
        tables: dict[str, dict[str, Any]] = {name: {} for name in self.declared}
        for key, value in self.stated.items():
            effect, *rest = key.split(".")
            if effect in tables and len(rest) == 2:
                tables[effect].setdefault(rest[0], {})[rest[1]] = value
            elif effect in tables:
                tables[effect][rest[0]] = value
        return tables


def _output_rows(kane: RideBicycle, names: Sequence[str], matrix: Real, inputs: Real) -> dict[str, Real]:
    """Rows over states and inputs of what a ride is asked for."""
    n, size = 1 + len(kane.names), len(names)
    unit = np.eye(size, size + len(INPUTS))
    rates = np.hstack([matrix, inputs])

    def acceleration(velocity: Real) -> Real:  # of a point, across the heading: d/dt of its velocity, and v r
        return np.asarray(velocity @ rates[:n] + kane.v * unit[names.index("yaw_rate")])

    rows = {name: unit[names.index(name)] for name in ("lean", "steer", "steer_rate", "yaw_rate")}
    rows["roll_rate"] = unit[names.index("lean_rate")]
    slips = kane._slip_slopes(kane.v, size)
    for k, wheel in enumerate(WHEELS):
        rows[f"{wheel}_lateral_force"] = unit[names.index(f"{wheel}_lateral_force")]
        rows[f"{wheel}_slip_angle"] = np.append(-slips[k] / kane.v, np.zeros(len(INPUTS)))
    # an accelerometer that leans with the frame reads a share of gravity
    frame_point = acceleration(kane.lateral_velocity_of("pitch", PLACE))
    rows["lateral_acceleration"] = frame_point - kane.p["g"] * rows["lean"]
    rows["mass_centre_acceleration"] = acceleration(kane.mass_centre_velocity()[1])
    rows["mass_centre_velocity"] = np.append(kane.mass_centre_velocity()[1], np.zeros(size - n + len(INPUTS)))
    for k, name in enumerate(INPUTS):
        rows[name] = np.eye(size + len(INPUTS))[size + k]
    return rows


OUTSIDE = ("lean_spring", "structural_damper", "rotor", "bar_mass")


def draw_outside(name: str, rng: Random) -> dict[str, tuple[float, ...]]:
    """A thing that no library of effects knows, of a size from ``rng``; ``name`` is one of ``OUTSIDE``."""
    sign = float(rng.choice([-1, 1]))
    inertia, rate = rng.uniform(0.03, 0.12), 2 * np.pi * rng.uniform(1.5, 3)
    sizes: dict[str, tuple[float, ...]] = {
        "lean_spring": (sign * rng.uniform(40, 200),),
        "structural_damper": (rng.uniform(2, 6), rng.uniform(0.05, 0.2)),
        "rotor": (sign * rng.uniform(2, 8), 0.0) if rng.random() < 0.5 else (0.0, sign * rng.uniform(0.3, 1.2)),
        "bar_mass": (inertia, inertia * rate**2, 0.2 * inertia * rate),
    }
    return {name: tuple(float(size) for size in sizes[name])}


def draw_bicycle(
    rng: Random, *, base: str = "benchmark", spread: float = 1.0, tyre_sd: float = 0.0, front_sd: float = 0.0,
    camber_thrust: bool = False, compliance: str = "declared", damper: str = "none", outside: str = "",
) -> RiddenBicycle:  # fmt: skip
    """Draw a bicycle on relaxing tyres around a packaged one.

    Parameters are off by ``spread`` times the default standard uncertainty of a bicycle; those of the tyres (C and
    relaxation length of each wheel) and of the front frame (stiffness, damping) by the relative ``tyre_sd`` and
    ``front_sd``. ``compliance`` of the front frame and the steering ``damper`` are "none", "declared" or "hidden".
    """
    nominal = load_bicycle(base)
    sd = {key: spread * value for key, value in uncertainty(nominal).items()}
    real = perturbed(nominal, sd, rng) if spread else nominal
    extra: dict[str, tuple[float, float]] = {}  # stated value and relative sd
    factor, length = rng.uniform(10, 16), rng.uniform(0.08, 0.15)
    for wheel, load in zip(WHEELS, nominal.static_loads, strict=True):
        extra[f"relaxation_length.cornering_stiffness.{wheel}"] = (round(factor * load, 1), tyre_sd)
        extra[f"relaxation_length.relaxation_length.{wheel}"] = (round(length, 4), tyre_sd)
        if camber_thrust:
            extra[f"camber_thrust.camber_stiffness.{wheel}"] = (round(0.9 * load, 1), tyre_sd)
    if camber_thrust:
        extra["camber_thrust.lag_share"] = (1.0, 0.0)
    if compliance != "none":
        extra["front_compliance.stiffness"] = (round(rng.uniform(2500, 6000)), front_sd)
        extra["front_compliance.damping"] = (round(rng.uniform(20, 45), 1), front_sd)
        extra["front_compliance.joint_x"] = (round(rng.uniform(0.75, 0.95), 3), 0.0)
        extra["front_compliance.joint_z"] = (round(rng.uniform(-0.9, -0.7), 3), 0.0)
    if damper != "none":
        extra["steer_damper.damping"] = (round(float(np.exp(rng.uniform(*np.log((0.5, 2.0))))), 3), 0.0)
    values = dict(real.values) | {
        key: value * (1 + relative * rng.standard_normal()) for key, (value, relative) in extra.items()
    }
    stated = dict(nominal.values) | {key: value for key, (value, _) in extra.items()}
    if compliance != "none":
        values["front_compliance.axis_tilt"] = real["lam"]
        stated["front_compliance.axis_tilt"] = nominal["lam"]
    effects = {"relaxation_length": "declared", "front_compliance": compliance, "steer_damper": damper}
    effects["camber_thrust"] = "declared" if camber_thrust else "none"
    declared, hidden = (tuple(k for k, how in effects.items() if how == what) for what in ("declared", "hidden"))
    stated = {key: value for key, value in stated.items() if key.split(".")[0] not in hidden}
    push_at = (float(rng.uniform(0.2, 0.5)), float(rng.uniform(-1.1, -0.7)))
    beyond = draw_outside(outside, rng) if outside else {}
    return RiddenBicycle(base, values, stated, declared, hidden, beyond, push_at)
