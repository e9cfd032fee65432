"""Disturbances of an ordinary ride: torques and forces that are not recorded, and a rider who steers.

Each input has a spectrum S(f) = a^2 ((1 + 1/c^2) / (1 + (f/c)^2))^p, one-sided, with its root a at 1 Hz, a corner c in
Hz and a power p. The rider's torque on the handlebar, beside that of the spectrum, is that of the arms and that of the
muscles, T = -(k steer + d steer rate) - M(s) (gains on lean, its rate, steer and its rate) with the second-order lag
M = w^2 / (s^2 + 2 zeta w s + w^2) of Schwab, de Lange, Happee & Moore (2013, Multibody System Dynamics), zeta = 0.707.
These numbers are a ride's own and not stated. They have normal priors, which are judgements, and are integrated
out of what is fitted.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from bicycle.effects.effect import Effect
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.arrays import Array, Complex

SIZES = {"steer_torque": 0.3, "lean_torque": 5.0, "lateral_push": 5.0, "yaw_moment": 2.0}
"""Input -> prior median of the root of its density at 1 Hz, N m or N per root of Hz."""
SIZE_SPREAD, CORNER_SPREAD, POWER_SPREAD = 2.0, 1.0, 1.0  # prior sd: logarithms of size and corner, and power
CORNER, POWER = 1.0, 1.0  # prior median of the corner, Hz; prior mean of the power
ANSWERED = ("lean", "lean_rate", "steer", "steer_rate")
GAINS = (40.0, 20.0, 60.0, 4.0)  # prior sd, N m/rad and N m s/rad: half of what rider_control calls typical
ARMS = {2: 20.0, 3: 3.0}  # prior sd of the arms' stiffness and damping, N m/rad and N m s/rad, by place in ANSWERED
MUSCLES, MUSCLES_SPREAD = 2 * np.pi * 2.17, 0.7  # rad/s, prior median of w; sd of its logarithm
MOTOR = 2 * np.pi * 10.0  # rad/s, prior median of the same lag of a motor that a controller drives
ZETA = 0.707
Steering = Literal["rider", "controller", "nobody"]
RIDER: Steering = "rider"
CONTROLLER: Steering = "controller"
NOBODY: Steering = "nobody"
SLOW = (-1.0, -1.5, 1.0)  # size, corner and power of an input that falls above 0.2 Hz, in prior sd
FARTHEST = 12.0  # of the logarithm of a corner or of the muscles' frequency: it lies far outside the band
LARGEST = 60.0  # of a logarithm of a density: a trial far outside its prior
FOLLOWS = 5e-4  # s; at 15 Hz it lags by 3 degrees
PLACE = ("lean_torque", "yaw_moment")
PLACE_SPREAD = 0.2  # m, prior sd of height and length by which the lateral push acts elsewhere than stated
FLOOR_SPREAD = 1.0  # prior sd of the logarithm of a channel's noise


class YawMoment(Effect):
    """A moment about the vertical on the rear frame, as wind and a crooked road give it."""

    identifier = "ride_yaw_moment"
    source = "virtual work"

    def apply(self, model: ModelBuilder) -> None:
        model.add_yaw_moment("rear frame", model.add_input("yaw_moment", unit="N m"))


class SlipVelocities(Effect):
    """Slip velocity of each wheel as a state that follows it within :data:`FOLLOWS`, and acts on nothing."""

    identifier = "ride_slip_velocities"
    source = "definition"

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            seen = model.add_state(f"{wheel.name}_slip_velocity", unit="m/s", role=wheel.name)
            model.set_rate(seen, (wheel.slip_velocity - seen) / FOLLOWS)


@dataclass(frozen=True, eq=False)
class Disturbances:
    """Numbers of R rides that float in each fit, as normal coordinates z (R, k), all 0 +- 1."""

    inputs: tuple[str, ...]  # the first is the steer torque
    floors: Array  # (C,), usual noise densities of the channels, unit^2/Hz
    steering: Steering = RIDER
    controller_gains: Array | None = None  # (R, 4), of a controller, N m/rad and N m s/rad; they are known

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names (k,) of the coordinates."""
        spectra = [f"{name} {what}" for name in self.inputs for what in ("size", "corner", "power")]
        arms = [f"torque of the arms by {ANSWERED[k]}" for k in ARMS]
        muscles = [f"torque of the muscles by {name}" for name in ANSWERED]
        loop = {
            RIDER: [*arms, *muscles, "frequency of the muscles"],
            CONTROLLER: ["frequency of the motor"],
            NOBODY: list[str](),
        }
        place = [f"place of the push by {name}" for name in PLACE]
        return (*spectra, *place, *loop[self.steering], *(f"noise of channel {k + 1}" for k in range(len(self.floors))))

    @cached_property
    def loop(self) -> slice:
        """Coordinates of the loop: gains and delay."""
        first = 3 * len(self.inputs) + len(PLACE)
        return slice(first, len(self.names) - len(self.floors))

    def draw_loops(self, count: int, rng: np.random.Generator) -> Array:
        """Coordinates (count, k) of riders who are drawn from the prior; all else is usual."""
        drawn = np.zeros((count, len(self.names)))
        drawn[:, self.loop] = rng.standard_normal((count, self.loop.stop - self.loop.start))
        return drawn

    def with_usual_inputs(self, z: Array) -> Array:
        """Coordinates ``z`` (k,), and the same with each input in turn as it usually is, and slow: (starts, k)."""
        starts = np.tile(z, (1 + 2 * len(self.inputs), 1))
        for k in range(len(self.inputs)):
            starts[1 + 2 * k, 3 * k : 3 * k + 3] = 0.0
            starts[2 + 2 * k, 3 * k : 3 * k + 3] = SLOW
        return starts

    def repeated(self, times: int) -> "Disturbances":
        """Disturbances of the same rides, one after the other, all of them several ``times``."""
        gains = self.controller_gains
        return replace(self, controller_gains=None if gains is None else np.tile(gains, (times, 1)))

    def of_ride(self, number: int) -> "Disturbances":
        """Disturbances of one ride."""
        gains = self.controller_gains
        return replace(self, controller_gains=None if gains is None else gains[number : number + 1])

    def mix(self, z: Array) -> Array:
        """Inputs (R, i, i) as they act: a push at another height or length is a push with a torque and a moment."""
        mixed = np.tile(np.eye(len(self.inputs)), (len(z), 1, 1))
        push = self.inputs.index("lateral_push")
        for k, name in enumerate(PLACE):
            mixed[:, self.inputs.index(name), push] = PLACE_SPREAD * z[:, 3 * len(self.inputs) + k]
        return mixed

    def densities(self, z: Array, hertz: Array) -> Array:
        """Densities (R, b, q, inputs) of R rides at coordinates ``z`` (R, k), at ``hertz`` (R, b, q)."""
        logarithm, _ = self._log_densities(z, hertz)
        return np.asarray(np.exp(np.clip(logarithm, -LARGEST, LARGEST)))

    def density_slopes(self, z: Array, hertz: Array) -> Array:
        """Derivatives (R, b, q, inputs, 3) of the densities by size, corner and power."""
        logarithm, slopes = self._log_densities(z, hertz)
        return np.asarray(np.exp(np.clip(logarithm, -LARGEST, LARGEST))[..., None] * slopes)

    def _log_densities(self, z: Array, hertz: Array) -> tuple[Array, Array]:
        x = z[:, : 3 * len(self.inputs)].reshape(len(z), 1, 1, -1, 3)
        size = np.log([SIZES[name] for name in self.inputs]) + SIZE_SPREAD * x[..., 0]
        corner = CORNER * np.exp(np.clip(CORNER_SPREAD * x[..., 1], -FARTHEST, FARTHEST))
        power = POWER + POWER_SPREAD * x[..., 2]
        squared = (hertz[..., None] / corner) ** 2
        fall = np.log1p(1 / corner**2) - np.log1p(squared)
        by_corner = 2 * squared / (1 + squared) - 2 / (1 + corner**2)
        logarithm = 2 * size + power * fall
        slopes = np.stack(
            [np.full(fall.shape, 2 * SIZE_SPREAD), CORNER_SPREAD * power * by_corner, POWER_SPREAD * fall], -1
        )
        return logarithm, slopes

    def answers(self, z: Array, s: Complex) -> Complex:
        """Torque (R, b, q, 4) per lean, its rate, steer and its rate, N m/rad and N m s/rad, at ``s`` (R, b, q)."""
        if self.steering == NOBODY:
            return np.zeros((*s.shape, len(ANSWERED)), complex)
        return self._answers(z, s)[0]

    def answer_slopes(self, z: Array, s: Complex) -> Complex:
        """Derivatives (R, b, q, 4, loop) of :meth:`answers` by the coordinates of the loop."""
        answers, muscles, by_frequency = self._answers(z, s)
        slopes = np.zeros((*answers.shape, len(z[0, self.loop])), complex)
        slopes[..., -1] = by_frequency
        if self.steering == RIDER:
            for column, (k, sd) in enumerate(ARMS.items()):
                slopes[..., k, column] = sd
            for k, gain in enumerate(GAINS):
                slopes[..., k, len(ARMS) + k] = gain * muscles
        return slopes

    def _answers(self, z: Array, s: Complex) -> tuple[Complex, Complex, Complex]:
        """Torques (R, b, q, 4), the muscles' lag M (R, b, q), and derivatives (R, b, q, 4) by their frequency."""
        x = z[:, self.loop]
        ridden = self.controller_gains is None
        gains = x[:, len(ARMS) : -1] * GAINS if self.controller_gains is None else self.controller_gains
        frequency = (MUSCLES if ridden else MOTOR) * _factor_of(x[:, -1])[:, None, None]
        ratio = s / frequency
        muscles = 1 / (1 + 2 * ZETA * ratio + ratio**2)
        by_frequency = MUSCLES_SPREAD * muscles**2 * (2 * ZETA * ratio + 2 * ratio**2)
        torque = gains[:, None, None] * muscles[..., None]
        for column, (k, sd) in enumerate(ARMS.items() if ridden else ()):
            torque[..., k] += sd * x[:, column, None, None]
        return torque, muscles, gains[:, None, None] * by_frequency[..., None]

    def closed_loop(self, state: Array, steered: Array, motion: Array, z: Array, ride: int) -> Array:
        """State matrix (n + 2, n + 2) of a bicycle x' = ``state`` x + ``steered`` T whose rider or controller steers.

        ``motion`` (4, n) gives lean, its rate, steer and its rate; ``z`` (k,) are the disturbances of this ``ride``.
        """
        n = len(state)
        closed = np.zeros((n + 2, n + 2))
        closed[:n, :n] = state
        if self.steering == NOBODY:
            closed[range(n, n + 2), range(n, n + 2)] = -1.0
            return closed
        x = z[self.loop]
        gains, frequency = np.zeros(4), MOTOR * _factor_of(x[-1])
        if self.controller_gains is not None:
            gains = self.controller_gains[ride]
        else:
            arms = np.zeros(4)
            arms[list(ARMS)] = x[: len(ARMS)] * list(ARMS.values())
            closed[:n, :n] -= np.outer(steered, arms @ motion)
            gains, frequency = x[len(ARMS) : -1] * GAINS, MUSCLES * _factor_of(x[-1])
        closed[:n, n] = -steered
        closed[n, n + 1] = 1.0
        closed[n + 1, :n] = frequency**2 * (gains @ motion)
        closed[n + 1, n:] = -(frequency**2), -2 * ZETA * frequency
        return closed

    def noise(self, z: Array) -> Array:
        """Noise densities (R, C), unit^2/Hz."""
        logarithm = 2 * FLOOR_SPREAD * z[:, len(self.names) - len(self.floors) :]
        return np.asarray(self.floors * np.exp(np.clip(logarithm, -LARGEST, LARGEST)))


def _factor_of(coordinate: Array) -> Array:
    """Factor on the usual frequency of the muscles or of the motor."""
    return np.asarray(np.exp(np.clip(MUSCLES_SPREAD * coordinate, -FARTHEST, FARTHEST)))
