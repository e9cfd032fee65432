"""What users have that is no effect of a bicycle: luggage, another speed, geometry, sensors; and what no library knows.

``LIBRARY`` causes should be named; ``OUTSIDE`` ones never can be. Names are those of the truth; what a search may call
them stands in :data:`tests.validation.blind.score.CALLED`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.validation.blind.hidden import Cause
from tests.validation.blind.machine import Extras
from tests.validation.blind.motion import Sensor

Random = np.random.Generator
Makers = Mapping[str, Callable[[Random], Cause]]
LEVELS = {"roll_rate": 0.02, "steer": 0.004, "yaw_rate": 0.01}
COLUMNS = {"roll_rate": "roll_rate_rad_s", "steer": "steer_rad", "yaw_rate": "yaw_rate_rad_s"}


@dataclass(frozen=True)
class Drawn:
    """A cause of a random size from ``low`` to ``high`` in SI, of either sign if ``signed``."""

    low: float
    high: float
    make: Callable[..., Cause]
    signed: bool = False

    def __call__(self, rng: Random) -> Cause:
        """Draw one."""
        sign = rng.choice([-1, 1]) if self.signed else 1
        return self.make(float(sign * rng.uniform(self.low, self.high)))


@dataclass(frozen=True)
class OfSensor(Drawn):
    """A mistake of one channel, whose size may be counted in the noise of the channel."""

    by_noise: bool = False

    def __call__(self, rng: Random) -> Cause:
        """Draw a channel and the mistake."""
        channel = str(rng.choice(list(COLUMNS)))
        sign = rng.choice([-1, 1]) if self.signed else 1
        size = float(sign * rng.uniform(self.low, self.high)) * (LEVELS[channel] if self.by_noise else 1.0)
        what, key, sensor = self.make(size)
        return Cause({f"{channel}_{what}": {key: size}}, sensors={COLUMNS[channel]: sensor})


def known(name: str, key: str, what: str, of: str = "") -> Callable[[float], Cause]:
    """Maker of a cause whose size is the field ``what`` of a cause, or of its ``extras`` or ``shifts``."""

    def make(size: float) -> Cause:
        done: dict[str, Any] = {what: size}
        if of:
            done = {of: Extras(**done) if of == "extras" else done}
        return Cause({name: {key: size}}, **done)

    return make


def unknown(name: str, extras: Callable[[Random], dict[str, Any]]) -> Callable[[Random], Cause]:
    """Maker of a cause that no library knows."""
    return lambda rng: Cause({name: {}}, Extras(**extras(rng)))


def other_sensor(name: str, channel: str, sensor: Callable[[Random], Sensor]) -> Callable[[Random], Cause]:
    """Maker of a mistake of a sensor that no library knows."""
    return lambda rng: Cause({name: {}}, sensors={COLUMNS[channel]: sensor(rng)})


def signed(rng: Random, low: float, high: float) -> float:
    """Draw a number of either sign."""
    return float(rng.choice([-1, 1]) * rng.uniform(low, high))


def rotor(rng: Random) -> dict[str, Any]:
    """Draw a rotor that keeps its speed, 2 to 8 kg m^2/s on the frame or 0.3 to 1.2 on the fork."""
    size = signed(rng, 2, 8)
    return {"rotor": (size, 0.0) if rng.random() < 0.5 else (0.0, 0.15 * size)}


def loose_mass(rng: Random) -> dict[str, Any]:
    """Draw a loose mass that turns with the bar: 0.03 to 0.12 kg m^2 at 1.5 to 3 Hz, damping 10 %."""
    inertia, rate = rng.uniform(0.03, 0.12), 2 * np.pi * rng.uniform(1.5, 3)
    return {"bar_mass": (inertia, inertia * rate**2, 0.2 * inertia * rate)}


LIBRARY: Makers = {
    "luggage_rear": Drawn(2, 8, known("luggage_rear", "mass", "rack", "extras")),  # 5 cm behind the hub, 0.75 m up
    "luggage_bar": Drawn(2, 8, known("luggage_bar", "mass", "bar", "extras")),  # a basket that turns with the bar
    "speed_offset": Drawn(0.1, 0.4, known("speed_offset", "offset", "speed_offset"), signed=True),
    "wrong_tilt": Drawn(0.03, 0.06, known("wrong_tilt", "shift", "lam", "shifts"), signed=True),  # 5 to 10 stated sd
    "wrong_trail": Drawn(0.01, 0.025, known("wrong_trail", "shift", "c", "shifts"), signed=True),  # 5 to 12
}
FRICTION = known("steer_friction", "torque", "friction")
LIBRARY_HISTORIES: Makers = {
    **LIBRARY,
    "friction": Drawn(np.log(0.05), np.log(0.3), lambda log: FRICTION(float(np.exp(log)))),  # N m
    "low_pass": OfSensor(0.015, 0.06, lambda lag: ("low_pass", "time_constant", Sensor(low_pass=lag))),
    "drift": OfSensor(1.5, 5, lambda rate: ("drift", "rate", Sensor(drift=rate)), signed=True, by_noise=True),
}
SENSORS: Makers = {
    "gain": OfSensor(0.08, 0.25, lambda scale: ("scale", "scale", Sensor(gain=1 + scale)), signed=True),
    "delay": OfSensor(0.015, 0.06, lambda late: ("delay", "delay", Sensor(delay=late))),
    "bias": OfSensor(1.5, 5, lambda zero: ("bias", "bias", Sensor(bias=zero)), signed=True, by_noise=True),
}
OUTSIDE: Makers = {
    "lean_spring": unknown("lean_spring", lambda rng: {"lean_spring": signed(rng, 40, 200)}),  # a tether, a strap
    "steer_rate_force": unknown("steer_rate_force", lambda rng: {"force_per_steer_rate": signed(rng, 8, 30)}),
    "structural_damper": unknown(
        "structural_damper", lambda rng: {"maxwell": (rng.uniform(2, 6), rng.uniform(0.05, 0.2))}
    ),
    "rotor": unknown("rotor", rotor),
    "rear_twist": unknown("rear_twist", lambda rng: {"rear_twist": (rng.uniform(60, 200), rng.uniform(0.2, 1))}),
    "bar_mass": unknown("bar_mass", loose_mass),
}
OUTSIDE_HISTORIES: Makers = {
    **OUTSIDE,
    "second_order_filter": other_sensor(
        "second_order_filter", "roll_rate", lambda rng: Sensor(low_pass=rng.uniform(0.015, 0.04), order=2)
    ),
    "tilted_gyro": other_sensor(  # 8 to 20 degrees off: it sees the yaw rate
        "tilted_gyro", "roll_rate",
        lambda rng: Sensor(crosstalk=np.tan(np.radians(signed(rng, 8, 20))), other=COLUMNS["yaw_rate"]),
    ),
    "saturating_sensor": other_sensor(
        "saturating_sensor", "steer", lambda rng: Sensor(limit=rng.uniform(0.08, 0.15))
    ),
}  # fmt: skip


def draw(makers: Makers, rng: Random) -> Cause:
    """One of ``makers``, with its size from ``rng``."""
    return makers[str(rng.choice(list(makers)))](rng)
