"""What users have that is no effect of a bicycle: luggage, another speed, geometry, sensors; and what no library knows.

``LIBRARY`` causes should be named; ``OUTSIDE`` ones never can be. Names are those of the truth; what a search may call
them stands in :data:`tests.validation.blind.score.CALLED`.
"""

from collections.abc import Callable, Mapping

import numpy as np

from tests.validation.blind.hidden import Cause
from tests.validation.blind.machine import Extras
from tests.validation.blind.motion import Sensor

Random = np.random.Generator
LEVELS = {"roll_rate": 0.02, "steer": 0.004, "yaw_rate": 0.01}
COLUMNS = {"roll_rate": "roll_rate_rad_s", "steer": "steer_rad", "yaw_rate": "yaw_rate_rad_s"}


def luggage_rear(rng: Random) -> Cause:
    """2 to 8 kg on the rear rack (5 cm behind the hub, 0.75 m up); mass from ``rng``."""
    mass = rng.uniform(2, 8)
    return Cause({"luggage_rear": {"mass": mass}}, Extras(rack=mass))


def luggage_bar(rng: Random) -> Cause:
    """2 to 8 kg in a basket on the bar, turning with it; mass from ``rng``."""
    mass = rng.uniform(2, 8)
    return Cause({"luggage_bar": {"mass": mass}}, Extras(bar=mass))


def speed_offset(rng: Random) -> Cause:
    """The speed sensor is off by 0.1 to 0.4 m/s, of either sign; size from ``rng``."""
    offset = _signed(rng, 0.1, 0.4)
    return Cause({"speed_offset": {"offset": offset}}, speed_offset=offset)


def wrong_tilt(rng: Random) -> Cause:
    """The steer axis tilt of the file is 1.7 to 3.4 degrees off, 5 to 10 stated sd; size from ``rng``."""
    shift = _signed(rng, 0.03, 0.06)
    return Cause({"wrong_tilt": {"shift": shift}}, shifts={"lam": shift})


def wrong_trail(rng: Random) -> Cause:
    """The trail of the file is 10 to 25 mm off, 5 to 12 stated sd; size from ``rng``."""
    shift = _signed(rng, 0.01, 0.025)
    return Cause({"wrong_trail": {"shift": shift}}, shifts={"c": shift})


def friction(rng: Random) -> Cause:
    """Coulomb friction of 0.05 to 0.3 N m at the steer; size from ``rng``."""
    torque = float(np.exp(rng.uniform(np.log(0.05), np.log(0.3))))
    return Cause({"steer_friction": {"torque": torque}}, friction=torque)


def low_pass(rng: Random) -> Cause:
    """A first-order filter of 15 to 60 ms in one channel, both from ``rng``."""
    name, lag = _channel(rng), rng.uniform(0.015, 0.06)
    return Cause({f"{name}_low_pass": {"time_constant": lag}}, sensors={COLUMNS[name]: Sensor(low_pass=lag)})


def drift(rng: Random) -> Cause:
    """A channel that runs away by 1.5 to 5 times its noise per second; ``rng`` draws it."""
    name = _channel(rng)
    rate = _signed(rng, 1.5, 5.0) * LEVELS[name]
    return Cause({f"{name}_drift": {"rate": rate}}, sensors={COLUMNS[name]: Sensor(drift=rate)})


def gain(rng: Random) -> Cause:
    """A channel that reads 8 to 25 % too much or too little; ``rng`` draws it."""
    name, scale = _channel(rng), _signed(rng, 0.08, 0.25)
    return Cause({f"{name}_scale": {"scale": scale}}, sensors={COLUMNS[name]: Sensor(gain=1 + scale)})


def delay(rng: Random) -> Cause:
    """A channel that comes 15 to 60 ms late; ``rng`` draws it."""
    name, late = _channel(rng), rng.uniform(0.015, 0.06)
    return Cause({f"{name}_delay": {"delay": late}}, sensors={COLUMNS[name]: Sensor(delay=late)})


def bias(rng: Random) -> Cause:
    """A channel with a zero error of 1.5 to 5 times its noise; ``rng`` draws it."""
    name = _channel(rng)
    zero = _signed(rng, 1.5, 5.0) * LEVELS[name]
    return Cause({f"{name}_bias": {"bias": zero}}, sensors={COLUMNS[name]: Sensor(bias=zero)})


def lean_spring(rng: Random) -> Cause:
    """A spring on lean of 40 to 200 N m/rad, of either sign (a tether, a side stand's strap); ``rng`` draws it."""
    spring = _signed(rng, 40, 200)
    return Cause({"lean_spring": {}}, Extras(lean_spring=spring))


def steer_rate_force(rng: Random) -> Cause:
    """A side force of 8 to 30 N s/rad times the steer rate at the front frame; ``rng`` draws it."""
    return Cause({"steer_rate_force": {}}, Extras(force_per_steer_rate=_signed(rng, 8, 30)))


def structural_damper(rng: Random) -> Cause:
    """A spring of 2 to 6 N m/rad in series with a damper (0.05 to 0.2 s) at the steer; ``rng`` draws both."""
    return Cause({"structural_damper": {}}, Extras(maxwell=(rng.uniform(2, 6), rng.uniform(0.05, 0.2))))


def rotor(rng: Random) -> Cause:
    """A rotor that keeps its speed, 2 to 8 kg m^2/s on the frame or 0.3 to 1.2 on the fork; ``rng`` draws it."""
    size = _signed(rng, 2, 8)
    return Cause({"rotor": {}}, Extras(rotor=(size, 0.0) if rng.random() < 0.5 else (0.0, 0.15 * size)))


def rear_twist(rng: Random) -> Cause:
    """A rear hub or triangle that twists with 60 to 200 N m/rad and 0.2 to 1 N m s/rad; ``rng`` draws both."""
    return Cause({"rear_twist": {}}, Extras(rear_twist=(rng.uniform(60, 200), rng.uniform(0.2, 1))))


def bar_mass(rng: Random) -> Cause:
    """A loose mass that turns with the bar: 0.03 to 0.12 kg m^2 at 1.5 to 3 Hz, damping 10 %; ``rng`` draws it."""
    inertia, rate = rng.uniform(0.03, 0.12), 2 * np.pi * rng.uniform(1.5, 3)
    return Cause({"bar_mass": {}}, Extras(bar_mass=(inertia, inertia * rate**2, 0.2 * inertia * rate)))


def second_order_filter(rng: Random) -> Cause:
    """Roll rate through two equal filters of 15 to 40 ms; ``rng`` draws them."""
    sensor = Sensor(low_pass=rng.uniform(0.015, 0.04), order=2)
    return Cause({"second_order_filter": {}}, sensors={COLUMNS["roll_rate"]: sensor})


def tilted_gyro(rng: Random) -> Cause:
    """A roll gyro that is 8 to 20 degrees off sees the yaw rate; ``rng`` draws it."""
    share = np.tan(np.radians(_signed(rng, 8, 20)))
    return Cause(
        {"tilted_gyro": {}}, sensors={COLUMNS["roll_rate"]: Sensor(crosstalk=share, other=COLUMNS["yaw_rate"])}
    )


def saturating_sensor(rng: Random) -> Cause:
    """A steer sensor that bends: 0.08 to 0.15 rad at most; ``rng`` draws it."""
    return Cause({"saturating_sensor": {}}, sensors={COLUMNS["steer"]: Sensor(limit=rng.uniform(0.08, 0.15))})


Makers = Mapping[str, Callable[[Random], Cause]]
LIBRARY: Makers = {
    "luggage_rear": luggage_rear,
    "luggage_bar": luggage_bar,
    "speed_offset": speed_offset,
    "wrong_tilt": wrong_tilt,
    "wrong_trail": wrong_trail,
}
LIBRARY_HISTORIES: Makers = {**LIBRARY, "friction": friction, "low_pass": low_pass, "drift": drift}
SENSORS: Makers = {"gain": gain, "delay": delay, "bias": bias}
OUTSIDE: Makers = {
    "lean_spring": lean_spring,
    "steer_rate_force": steer_rate_force,
    "structural_damper": structural_damper,
    "rotor": rotor,
    "rear_twist": rear_twist,
    "bar_mass": bar_mass,
}
OUTSIDE_HISTORIES: Makers = {
    **OUTSIDE,
    "second_order_filter": second_order_filter,
    "tilted_gyro": tilted_gyro,
    "saturating_sensor": saturating_sensor,
}


def draw(makers: Makers, rng: Random) -> Cause:
    """One of ``makers``, with its size from ``rng``."""
    return makers[str(rng.choice(list(makers)))](rng)


def _signed(rng: Random, low: float, high: float) -> float:
    return float(rng.choice([-1, 1]) * rng.uniform(low, high))


def _channel(rng: Random) -> str:
    return str(rng.choice(list(COLUMNS)))
