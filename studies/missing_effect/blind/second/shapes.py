"""Which oscillation a laboratory would call weave, wobble or rider, and its shape."""

from dataclasses import dataclass

import numpy as np

from studies.missing_effect.blind.second.closing import Machine

SLOWEST = 0.5  # rad/s
FASTEST = 100.0  # 1/s
MOST_DAMPED = 0.7  # share of the decay in the eigenvalue: nothing that a free decay would show beyond
WOBBLE = 18.0  # rad/s, above it a steer oscillation is wobble


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
    slowest faster one in which the steer moves more than the lean.
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
    for k in waiting:
        lean, steer = abs(seen["lean"][k]), abs(seen["steer"][k])
        if "weave" not in found and roots[k].imag < FASTEST / 3 and lean > 0.1 * steer:
            found["weave"] = _shape("weave", roots[k], k, seen)
        elif "weave" in found and "wobble" not in found and roots[k].imag > WOBBLE and steer > 1.5 * lean:
            found["wobble"] = _shape("wobble", roots[k], k, seen)
    return {name: one for name, one in found.items() if -one.root.real <= MOST_DAMPED * abs(one.root)}


def _shape(name: str, root: complex, k: int, seen: dict[str, np.ndarray]) -> Shape:
    lean = seen["lean"][k]
    return Shape(name, complex(root), complex(seen["steer"][k] / lean), complex(seen["yaw_rate"][k] / (root * lean)))
