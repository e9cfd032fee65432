"""Disturbances of an ordinary ride: torques and forces that are not recorded, and a rider who steers.

Each input has a spectrum S(f) = a^2 [((1 + 1/c^2) / (1 + (f/c)^2))^p + d (1 + b^2) / (f^2 + b^2)], one-sided, with a
size a, a corner c in Hz, a power p and a slow part d, as of a rider who follows a road, b = 0.1 Hz. The rider's torque
on the handlebar, besides that of the spectrum, is that of the arms and that of the muscles, T = -(k steer + d steer
rate) - M(s) (gains on lean, its rate, steer and its rate) with the second-order lag M = w^2 / (s^2 + 2 zeta w s + w^2)
of Schwab, de Lange, Happee & Moore (2013, Multibody System Dynamics), whose zeta is 0.707; two lags one after the other
have a larger one.

These numbers are a ride's own and not stated. They have normal priors, which are judgements, and are integrated
out of what is fitted.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect import Effect
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.arrays import Array, Complex

SIZES = {"steer_torque": 0.3, "lean_torque": 5.0, "lateral_push": 5.0, "yaw_moment": 2.0}
"""Input -> prior median of the root of its density at 1 Hz, N m or N per root of Hz."""
SIZE_SPREAD, CORNER_SPREAD, POWER_SPREAD = 2.0, 1.0, 1.0  # prior sd: logarithms of size and corner, and power
OF_INPUT = ("size", "corner", "power", "slow part")
"""Numbers of the spectrum of an input."""
SLOW_PART, SLOW_PART_SPREAD = 0.01, 2.0  # prior median of the slow part at 1 Hz, in squares of the size; sd of its log
SLOW_CORNER = 0.1  # Hz, below which the slow part is level: a road has few bends longer than 10 s
CORNER, POWER = 1.0, 1.0  # prior median of the corner, Hz; prior mean of the power
ANSWERED = ("lean", "lean_rate", "steer", "steer_rate")
GAINS = (40.0, 20.0, 60.0, 4.0)  # prior sd, N m/rad and N m s/rad: half of what rider_control calls typical
ARMS = {2: 20.0, 3: 3.0}  # prior sd of the arms' stiffness and damping, N m/rad and N m s/rad, by place in ANSWERED
MUSCLES, MUSCLES_SPREAD = 2 * np.pi * 2.17, 0.7  # rad/s, prior median of w; sd of its logarithm
MOTOR = 2 * np.pi * 10.0  # rad/s, prior median of the same lag of a motor that a controller drives
ZETA, ZETA_SPREAD = 0.707, 0.4  # prior median of the lag's damping ratio; sd of its logarithm, for a rider's muscles
Steering = Literal["rider", "controller", "nobody"]
RIDER: Steering = "rider"
CONTROLLER: Steering = "controller"
NOBODY: Steering = "nobody"
SLOW = (-1.0, -1.5, 1.0, 0.0)  # size, corner, power and slow part of an input that falls above 0.2 Hz, in prior sd
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
        spectra = [f"{name} {what}" for name in self.inputs for what in OF_INPUT]
        arms = [f"torque of the arms by {ANSWERED[k]}" for k in ARMS]
        muscles = [f"torque of the muscles by {name}" for name in ANSWERED]
        loop = {
            RIDER: [*arms, *muscles, "damping of the muscles", "frequency of the muscles"],
            CONTROLLER: ["frequency of the motor"],
            NOBODY: list[str](),
        }
        place = [f"place of the push by {name}" for name in PLACE]
        return (*spectra, *place, *loop[self.steering], *(f"noise of channel {k + 1}" for k in range(len(self.floors))))

    @cached_property
    def loop(self) -> slice:
        """Coordinates of the loop: gains and delay."""
        first = len(OF_INPUT) * len(self.inputs) + len(PLACE)
        return slice(first, len(self.names) - len(self.floors))

    def draw_loops(self, count: int, rng: np.random.Generator) -> Array:
        """Coordinates (count, k) of riders who are drawn from the prior; the other coordinates are usual."""
        drawn = np.zeros((count, len(self.names)))
        drawn[:, self.loop] = rng.standard_normal((count, self.loop.stop - self.loop.start))
        return drawn

    def with_usual_inputs(self, z: Array) -> Array:
        """Coordinates ``z`` (k,), and the same with each input in turn as it usually is, and slow: (starts, k)."""
        starts = np.tile(z, (1 + 2 * len(self.inputs), 1))
        for k in range(len(self.inputs)):
            own = slice(len(OF_INPUT) * k, len(OF_INPUT) * (k + 1))
            starts[1 + 2 * k, own] = 0.0
            starts[2 + 2 * k, own] = SLOW
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
            mixed[:, self.inputs.index(name), push] = PLACE_SPREAD * z[:, len(OF_INPUT) * len(self.inputs) + k]
        return mixed

    def densities(self, z: Array, hertz: Array) -> Array:
        """Densities (R, b, q, inputs) of R rides at coordinates ``z`` (R, k), at ``hertz`` (R, b, q)."""
        logarithm, _ = self._log_densities(z, hertz)
        return np.asarray(np.exp(np.clip(logarithm, -LARGEST, LARGEST)))

    def density_slopes(self, z: Array, hertz: Array) -> Array:
        """Derivatives (R, b, q, inputs, 4) of the densities by what :data:`OF_INPUT` names."""
        logarithm, slopes = self._log_densities(z, hertz)
        return np.asarray(np.exp(np.clip(logarithm, -LARGEST, LARGEST))[..., None] * slopes)

    def _log_densities(self, z: Array, hertz: Array) -> tuple[Array, Array]:
        count = len(OF_INPUT)
        x = z[:, : count * len(self.inputs)].reshape(len(z), 1, 1, -1, count)
        size = np.log([SIZES[name] for name in self.inputs]) + SIZE_SPREAD * x[..., 0]
        corner = CORNER * np.exp(np.clip(CORNER_SPREAD * x[..., 1], -FARTHEST, FARTHEST))
        power = POWER + POWER_SPREAD * x[..., 2]
        squared = (hertz[..., None] / corner) ** 2
        fall = np.log1p(1 / corner**2) - np.log1p(squared)
        by_corner = 2 * squared / (1 + squared) - 2 / (1 + corner**2)
        quick = np.exp(np.clip(power * fall, -LARGEST, LARGEST))
        slow = SLOW_PART * np.exp(np.clip(SLOW_PART_SPREAD * x[..., 3], -FARTHEST, FARTHEST))
        slow = slow * (1 + SLOW_CORNER**2) / (hertz[..., None] ** 2 + SLOW_CORNER**2)
        share = quick / (quick + slow)
        logarithm = 2 * size + np.log(quick + slow)
        by_quick = [CORNER_SPREAD * power * by_corner * share, POWER_SPREAD * fall * share]
        slopes = np.stack([np.full(fall.shape, 2 * SIZE_SPREAD), *by_quick, SLOW_PART_SPREAD * (1 - share)], -1)
        return logarithm, slopes

    def answers(self, z: Array, s: Complex) -> Complex:
        """Torque (R, b, q, 4) per lean, its rate, steer and its rate, N m/rad and N m s/rad, at ``s`` (R, b, q)."""
        if self.steering == NOBODY:
            return np.zeros((*s.shape, len(ANSWERED)), complex)
        return self._answers(z, s)[0]

    def answer_slopes(self, z: Array, s: Complex) -> Complex:
        """Derivatives (R, b, q, 4, loop) of :meth:`answers` by the coordinates of the loop."""
        answers, muscles, by_frequency, by_damping = self._answers(z, s)
        slopes = np.zeros((*answers.shape, len(z[0, self.loop])), complex)
        slopes[..., -1] = by_frequency
        if self.steering == RIDER:
            slopes[..., -2] = by_damping
            for column, (k, sd) in enumerate(ARMS.items()):
                slopes[..., k, column] = sd
            for k, gain in enumerate(GAINS):
                slopes[..., k, len(ARMS) + k] = gain * muscles
        return slopes

    def _answers(self, z: Array, s: Complex) -> tuple[Complex, Complex, Complex, Complex]:
        """Torques (R, b, q, 4), the muscles' lag M (R, b, q), derivatives (R, b, q, 4) by its frequency and damping."""
        x = z[:, self.loop]
        gains, frequency, zeta = (number[:, None, None] for number in self._lag(x, np.arange(len(x))))
        ratio = s / frequency
        muscles = 1 / (1 + 2 * zeta * ratio + ratio**2)
        by_frequency = MUSCLES_SPREAD * muscles**2 * (2 * zeta * ratio + 2 * ratio**2)
        by_damping = -ZETA_SPREAD * muscles**2 * 2 * zeta * ratio
        torque = gains * muscles[..., None]
        for column, (k, sd) in enumerate(ARMS.items() if self.controller_gains is None else ()):
            torque[..., k] += sd * x[:, column, None, None]
        return torque, muscles, gains * by_frequency[..., None], gains * by_damping[..., None]

    def _lag(self, x: Array, rides: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Gains (m, 4), frequency (m,), rad/s, and damping ratio (m,) of the lag of ``rides`` (m,), at ``x`` (m, l)."""
        if self.controller_gains is not None:
            return self.controller_gains[rides], MOTOR * _factor(MUSCLES_SPREAD * x[:, -1]), np.full(len(x), ZETA)
        zeta = ZETA * _factor(ZETA_SPREAD * x[:, -2])
        return x[:, len(ARMS) : -2] * GAINS, MUSCLES * _factor(MUSCLES_SPREAD * x[:, -1]), zeta

    def closed_loops(self, state: Array, steered: Array, motion: Array, z: Array, rides: NDArray[np.intp]) -> Array:
        """State matrices (m, n + 2, n + 2) of bicycles x' = ``state`` x + ``steered`` T that somebody steers.

        ``state`` is (m, n, n), ``steered`` (m, n); ``motion`` (m, 4, n) gives lean, its rate, steer and its rate; ``z``
        (m, k) are disturbances of the ``rides`` (m,).
        """
        n = state.shape[1]
        closed = np.zeros((len(z), n + 2, n + 2))
        closed[:, :n, :n] = state
        if self.steering == NOBODY:
            closed[:, range(n, n + 2), range(n, n + 2)] = -1.0
            return closed
        x = z[:, self.loop]
        gains, frequency, zeta = self._lag(x, rides)
        if self.controller_gains is None:
            arms = np.zeros((len(z), 4))
            arms[:, list(ARMS)] = x[:, : len(ARMS)] * list(ARMS.values())
            closed[:, :n, :n] -= steered[:, :, None] * (arms[:, None] @ motion)
        closed[:, :n, n] = -steered
        closed[:, n, n + 1] = 1.0
        closed[:, n + 1, :n] = frequency[:, None] ** 2 * (gains[:, None] @ motion)[:, 0]
        closed[:, n + 1, n], closed[:, n + 1, n + 1] = -(frequency**2), -2 * zeta * frequency
        return closed

    def noise(self, z: Array) -> Array:
        """Noise densities (R, C), unit^2/Hz."""
        logarithm = 2 * FLOOR_SPREAD * z[:, len(self.names) - len(self.floors) :]
        return np.asarray(self.floors * np.exp(np.clip(logarithm, -LARGEST, LARGEST)))


def _factor(logarithm: Array) -> Array:
    """Factor on the usual frequency or damping of the muscles or of the motor."""
    return np.asarray(np.exp(np.clip(logarithm, -FARTHEST, FARTHEST)))
