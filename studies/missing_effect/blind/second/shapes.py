"""Which oscillation a laboratory would call weave, wobble or rider, and its shape."""

import math
from dataclasses import dataclass

import numpy as np

from studies.missing_effect.blind.second.closing import Machine

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
    """Oscillations of a ``machine`` at a ``speed`` (m/s) by name.

    The rider's is that in which he sways most against the bicycle; weave is the slowest of the others, wobble the
    least damped faster one in which the steer moves more than the lean.
    """
    space = machine.space(speed)
    roots, vectors = np.linalg.eig(space.matrix)
    found: dict[str, Shape] = {}
    waiting = [k for k in np.argsort(roots.imag) if roots[k].imag > SLOWEST and abs(roots[k]) < FASTEST]
    seen = {name: row @ vectors for name, row in space.outputs.items()}
    if "rider" in seen:
        sway = max(waiting, key=lambda k: abs(seen["rider"][k] / seen["lean"][k]), default=None)
        if sway is not None and len(waiting) > 1:
            waiting.remove(sway)
            found["rider"] = _shape("rider", roots[sway], sway, seen)
    share = {k: abs(seen["lean"][k] / seen["steer"][k]) for k in waiting}
    slow = [k for k in waiting if roots[k].imag < FASTEST / 3 and share[k] > 0.1]
    swinging = [k for k in slow if -roots[k].real <= ALMOST_REAL * abs(roots[k])]
    if swinging:
        weave = swinging[0]
        found["weave"] = _shape("weave", roots[weave], weave, seen)
        turning = [k for k in waiting if roots[k].imag > max(WOBBLE, roots[weave].imag) and share[k] < 1 / 1.5]
        if turning:
            wobble = max(turning, key=lambda k: roots[k].real)
            found["wobble"] = _shape("wobble", roots[wobble], wobble, seen)
    return {name: one for name, one in found.items() if -one.root.real <= MOST_DAMPED * abs(one.root)}


def _shape(name: str, root: complex, k: int, seen: dict[str, np.ndarray]) -> Shape:
    lean = seen["lean"][k]
    return Shape(name, complex(root), complex(seen["steer"][k] / lean), complex(seen["yaw_rate"][k] / (root * lean)))


def weave_speed(machine: Machine, offset: float = 0.0) -> float | None:
    """The highest recorded speed (m/s) at which the weave of a ``machine`` becomes stable; None where it never does.

    Speeds from 0.6 to 20 m/s are looked at.

    Parameters
    ----------
    machine : Machine
    offset : float
        True less recorded speed, m/s.
    """

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
