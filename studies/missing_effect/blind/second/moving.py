"""Motion in time: exact between samples while linear, Runge-Kutta steps with saturating tyres or Coulomb friction."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from studies.missing_effect.blind.second.chain import Real
from studies.missing_effect.blind.second.closing import Ground, Space

SUBSTEPS = 10
SLIDING = 0.02  # rad/s, steer rate at which friction is fully there


@dataclass(frozen=True)
class Nonlinear:
    """What bends: grip (N, both wheels, 0 for linear tyres) and Coulomb friction at the steer (N m)."""

    grip: tuple[float, float] = (0.0, 0.0)
    friction: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.grip[0] or self.friction)


def saturating(demand: Real) -> Real:
    """Side force over grip for a ``demand`` (linear force over grip): brush model with a parabolic pressure.

    Fiala (1954): x - x |x| / 3 + x^3 / 27 until the whole contact slides at x = 3.
    """
    x = np.clip(demand, -3, 3)
    found: Real = x - x * np.abs(x) / 3 + x**3 / 27
    return found


def simulate(space: Space, start: Real, torque: Real, step: float) -> Real:
    """States (samples, states) of the linear motion.

    Parameters
    ----------
    space : Space
    start : ndarray, shape (states,)
    torque : ndarray, shape (samples,)
        Steer torque, N m, each held to the next sample.
    step : float
        s.
    """
    size = len(start)
    whole = np.zeros((size + 1, size + 1))
    whole[:size, :size], whole[:size, size] = space.matrix, space.inputs[:, 0]
    once = expm(whole * step)
    found = np.empty((len(torque), size))
    found[0] = start
    for k in range(1, len(torque)):
        found[k] = once[:size, :size] @ found[k - 1] + once[:size, size] * torque[k - 1]
    return found


def simulate_nonlinear(
    space: Space, law: Ground, speed: float, bends: Nonlinear, motion: tuple[Real, Real, float]
) -> Real:
    """States (samples, states) with saturating tyres (which need a lag) and friction.

    Parameters
    ----------
    space : Space
    law : Ground
    speed : float
        m/s.
    bends : Nonlinear
    motion : tuple
        Start, torque and step as of :func:`simulate`.
    """
    start, torque, step = motion
    rate = derivative(space, law, speed, bends)
    h, found = step / SUBSTEPS, np.empty((len(torque), len(start)))
    found[0] = x = start
    for k in range(1, len(torque)):
        pull = torque[k - 1]
        for _ in range(SUBSTEPS):
            a = rate(x, pull)
            b = rate(x + h / 2 * a, pull)
            c = rate(x + h / 2 * b, pull)
            x = x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c, pull))
        found[k] = x
    return found


def derivative(space: Space, law: Ground, speed: float, bends: Nonlinear) -> Callable[[Real, float], Real]:
    """dx/dt of a state and a steer torque; arguments as of :func:`simulate_nonlinear`.

    Parameters
    ----------
    space : Space
    law : Ground
    speed : float
        m/s.
    bends : Nonlinear
    """
    matrix, pull, steering = space.matrix, space.inputs[:, 0], space.outputs["steer_rate"]
    wanted = np.zeros((0, len(matrix)))
    grip = np.array(bends.grip)
    if bends.grip[0] and law.cornering is not None and law.length is not None:
        wanted = -(law.cornering / speed)[:, None] * space.slip + law.camber[:, None] * space.camber
        lag = (speed / law.length)[:, None] * space.force  # dF/dt follows the wanted force
        wanted = wanted / grip[:, None]
        lag = lag * grip[:, None]

    def rate(x: Real, torque: float) -> Real:
        if bends.friction:
            torque -= bends.friction * float(np.tanh(steering @ x / SLIDING))
        found = matrix @ x + pull * torque
        if len(wanted):
            demand = wanted @ x
            found = found + (saturating(demand) - demand) @ lag
        return np.asarray(found)

    return rate
