"""Motion in time: exact between samples while linear, Runge-Kutta steps with saturating tyres or Coulomb friction."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from tests.validation.blind.chain import Real
from tests.validation.blind.closing import Ground, Machine, Space

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
    """Lateral force over grip for a ``demand`` (linear force over grip): brush model with a parabolic pressure."""
    x = np.clip(demand, -3, 3)
    found: Real = x - x * np.abs(x) / 3 + x**3 / 27
    return found


def simulate(space: Space, start: Real, torque: Real, step: float) -> Real:
    """States (samples, states) of the linear motion."""
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
    """States (samples, states) with saturating tyres (which need a lag) and friction."""
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
    """dx/dt of a state and a steer torque; arguments as of :func:`simulate_nonlinear`."""
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


@dataclass(frozen=True)
class Sensor:
    """Errors of one channel."""

    gain: float = 1.0
    delay: float = 0.0
    low_pass: float = 0.0
    order: int = 1
    bias: float = 0.0
    drift: float = 0.0
    limit: float = 0.0
    crosstalk: float = 0.0
    other: str = ""

    def read(self, time: Real, true: Real, other: Real | None = None) -> Real:
        """What is recorded of a channel that is ``true``, at ``time`` (samples,), with an ``other`` channel."""
        seen = np.asarray(true) + (self.crosstalk * other if other is not None else 0.0)
        if self.delay:
            seen = np.interp(time - self.delay, time, seen)
        step = time[1] - time[0]
        for _ in range(self.order if self.low_pass else 0):
            seen = _lagged(seen, step / self.low_pass)
        if self.limit:
            seen = self.limit * np.tanh(seen / self.limit)
        found: Real = self.gain * seen + self.bias + self.drift * time
        return found


def _lagged(signal: Real, steps: float) -> Real:
    """First-order lag of a signal that is straight between samples; it starts settled."""
    decay = np.exp(-steps)
    new = 1 - (1 - decay) / steps  # weight of the newer sample
    found = signal.copy()
    for k in range(1, len(signal)):
        found[k] = decay * found[k - 1] + (1 - decay - new) * signal[k - 1] + new * signal[k]
    return found


SLOWEST = 0.5  # rad/s
FASTEST = 100.0  # 1/s
MOST_DAMPED = 0.7  # share of the decay in the eigenvalue: nothing that a free decay would show beyond
ALMOST_REAL = 0.95  # the same for what is no oscillation at all
SCANNED = (0.6, 20.0, 0.05)  # m/s, for the speed at which the weave becomes stable
CLOSE, ZERO = 1e-6, 1e-3  # m/s and 1/s
WOBBLE = 10.0  # rad/s, above it a steer oscillation is wobble: 1.6 Hz with a very soft front, 4 to 10 Hz usually


@dataclass(frozen=True)
class Shape:
    """An oscillation: eigenvalue (1/s), steer over lean and yaw rate over lean rate."""

    name: str
    root: complex
    steer: complex
    yaw: complex


def shapes(machine: Machine, speed: float) -> dict[str, Shape]:
    """Oscillations of a ``machine`` at a ``speed`` (m/s) by name."""
    space = machine.space(speed)
    roots, vectors = np.linalg.eig(space.matrix)
    found: dict[str, Shape] = {}
    waiting = [k for k in np.argsort(roots.imag) if roots[k].imag > SLOWEST and abs(roots[k]) < FASTEST]
    seen = {name: row @ vectors for name, row in space.outputs.items()}
    if "rider" in seen:
        sway = max(waiting, key=lambda k: abs(seen["rider"][k] / seen["lean"][k]), default=None)
        if sway is not None and len(waiting) > 1:
            waiting.remove(sway)
            found["rider"] = shape_of("rider", roots[sway], sway, seen)
    share = {k: abs(seen["lean"][k] / seen["steer"][k]) for k in waiting}
    slow = [k for k in waiting if roots[k].imag < FASTEST / 3 and share[k] > 0.1]
    swinging = [k for k in slow if -roots[k].real <= ALMOST_REAL * abs(roots[k])]
    if swinging:
        weave = swinging[0]
        found["weave"] = shape_of("weave", roots[weave], weave, seen)
        turning = [k for k in waiting if roots[k].imag > max(WOBBLE, roots[weave].imag) and share[k] < 1 / 1.5]
        if turning:
            wobble = max(turning, key=lambda k: roots[k].real)
            found["wobble"] = shape_of("wobble", roots[wobble], wobble, seen)
    return {name: one for name, one in found.items() if -one.root.real <= MOST_DAMPED * abs(one.root)}


def shape_of(name: str, root: complex, k: int, seen: dict[str, np.ndarray]) -> Shape:
    lean = seen["lean"][k]
    return Shape(name, complex(root), complex(seen["steer"][k] / lean), complex(seen["yaw_rate"][k] / (root * lean)))


def weave_speed(machine: Machine, offset: float = 0.0) -> float | None:
    """The highest recorded speed (m/s) at which the weave of a ``machine`` becomes stable; None where it never does."""

    def growth(speed: float) -> float:
        found = shapes(machine, speed + offset).get("weave")
        return math.nan if found is None else found.root.real

    speeds = np.arange(*SCANNED)
    grows = np.array([growth(float(v)) for v in speeds])
    for k in np.flatnonzero((grows[:-1] > 0) & (grows[1:] <= 0))[::-1]:
        low, high = float(speeds[k]), float(speeds[k + 1])
        while high - low > CLOSE:
            middle = (low + high) / 2
            low, high = (middle, high) if growth(middle) > 0 else (low, middle)
        if abs(growth(low)) < ZERO:  # a root, not a change of names
            return low
    return None
