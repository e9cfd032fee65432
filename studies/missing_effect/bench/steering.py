"""What the steering of a bicycle at rest asks of the hand: the equation of a bench test.

The rear frame is held upright, at the pitch at which it rides, and the bar is held or turned steadily. The torque is

    T = K steer + D d(steer)/dt + (T_f + T_s cos(tilt)) sign(direction)

with K and D from the steer row of the linear model at v = 0 (Meijaard, Papadopoulos, Ruina & Schwab 2007, eq. 5.3:
there K is g K0 of steer,steer, - g S_A sin(tilt), S_A = m_A u_A + mu m_T x_T, and what springs add; D is that of
dampers). The part mu m_T x_T is the load N of the front wheel at its trail: the contact carries

    N (rho sin(tilt)^2 - c cos(tilt) sin(tilt))

with crown radius rho, c cos(tilt) being the distance of the contact from the steer axis. It is there where the wheel
stands, on the floor or on a plate that slides and turns freely, and gone where the wheel is lifted: then only the
weight of the front assembly is left, - g m_A u_A sin(tilt).

T_f is dry friction of the steering, half the width of the loop of a slow sweep. T_s is the friction of a standing tyre
that slides in its contact patch, a moment about the vertical, on the floor only: for a round patch of radius a under
even pressure 2/3 mu N a (Pacejka, Tire and Vehicle Dynamics, ch. 9, parking manoeuvres). Readings taken before the
patch slides, just after a reversal, do not belong here.

A tyre at rest has no slip and no force from rolling: neither the trail of a side force nor twisting torque acts here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from studies.missing_effect.bench.table import Reading
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.friction import FRICTION
from tyre.base.arrays import Array

SCRUB = "bench.contact_scrub"
TORQUE_GAIN, FORCE_GAIN, ARM_ERROR = "bench.torque_gain", "bench.force_gain", "bench.lever_arm_error"
TORQUE_ZERO, FORCE_ZERO, STEER_ZERO = "bench.torque_zero", "bench.force_zero", "bench.steer_zero"
CROWN = "crown_radius.crown_radius.front"


@dataclass(frozen=True, eq=False)
class Setup:
    """The states at which n ``readings`` were taken."""

    readings: Sequence[Reading]

    def _column(self, name: str) -> Array:
        return np.array([float(getattr(reading, name)) for reading in self.readings])

    @cached_property
    def steer(self) -> Array:
        """Steer angle (n,), rad."""
        return self._column("steer")

    @cached_property
    def rate(self) -> Array:
        """Steer rate (n,), rad/s."""
        return self._column("rate")

    @cached_property
    def direction(self) -> Array:
        """Sign of the rate (n,), 0 where the steering was held."""
        return self._column("direction")

    @cached_property
    def arm(self) -> Array:
        """Lever arm (n,) of a force, m; 0 where a torque was read."""
        return self._column("arm")

    @cached_property
    def load(self) -> Array:
        """Measured load (n,) of the front wheel, N; nan where it was not measured."""
        return self._column("load")

    @cached_property
    def lifted(self) -> Array:
        """Whether the front wheel was off the ground (n,)."""
        return np.array([reading.condition == "lifted" for reading in self.readings])

    @cached_property
    def floor(self) -> Array:
        """1 where the tyre stood on the floor (n,), else 0."""
        return np.array([float(reading.condition == "floor") for reading in self.readings])


def torques(family: Family, setup: Setup, theta: Array) -> Array:
    """Torques (K, n), N m, that a bicycle at rest would have shown at coordinates ``theta`` (K, p).

    Parameters
    ----------
    family : Family
        Of models that roll without slip and hold only what acts at rest.
    setup : Setup
        n readings.
    theta : ndarray, shape (K, p)
        Coordinates.
    """
    values, names = family.values(theta), family.symbolic
    system = family(theta, np.zeros(1))
    row, angle = names.states.index("steer_rate"), names.states.index("steer")
    stiffness, damping = (-system.dynamics[:, 0, row, j, None] / family.models.scale[j] for j in (angle, row))
    tilt, ground = values["lam"], _of_the_load(values)
    mine = np.broadcast_to(family.models.evaluate(values).static_loads[..., 1], (len(theta), 1))
    carried = np.where(setup.lifted, 0.0, np.where(np.isnan(setup.load), mine, setup.load))

    def error(key: str) -> Array:
        return values.get(key, np.zeros((len(theta), 1)))

    at = setup.steer + error(STEER_ZERO)
    rubbing = error(FRICTION) + error(SCRUB) * np.cos(tilt) * setup.floor
    torque = (stiffness + ground * (carried - mine)) * at + damping * setup.rate + rubbing * setup.direction
    forced = setup.arm > 0
    arm = np.where(forced, setup.arm, 1.0)
    by_force = torque * (1 + error(FORCE_GAIN)) * arm / (arm + error(ARM_ERROR)) + error(FORCE_ZERO) * arm
    by_torque = torque * (1 + error(TORQUE_GAIN)) + error(TORQUE_ZERO)
    return np.asarray(np.where(forced, by_force, by_torque))


def _of_the_load(values: dict[str, Array]) -> Array:
    """Stiffness (K, 1) about the steer axis per load of the front wheel, m/rad."""
    tilt, trail = values["lam"], values["c"]
    crown = values.get(CROWN, np.zeros(1))
    return np.asarray(crown * np.sin(tilt) ** 2 - trail * np.cos(tilt) * np.sin(tilt))


def turning(readings: Sequence[Reading]) -> bool:
    """Whether any of ``readings`` shows dry friction."""
    return any(reading.direction for reading in readings)
