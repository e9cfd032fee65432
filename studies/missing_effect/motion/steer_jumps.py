"""Where a recorded steer torque jumps within a run, and with it the acceleration of a prescribed steer angle.

Seen from the angle alone a jump is a motion like others; the torque shows it from one sample to the next. A cubic and a
step are fitted to a few samples about each place by least squares, the largest first, and compared with white noise
whose sd comes from third differences, of which steps are outliers.
"""

import numpy as np

from tyre.base.arrays import Array

ASIDE = 6  # samples to each side of a step
SMOOTH = 3  # degree of what else the torque does there
CLEAR = 6.0  # sd of a step
ROUNDS = 3  # in which steps that are near each other are told apart
BESIDE = 0.25  # of a larger step within so many samples, that a further one must have
FEWEST = 12  # samples of the run for each step
NORMAL = 1.4826 / np.sqrt(20.0)  # of third differences: from the median of their absolute values to the sd of noise


def torque_jumps(time: Array, torque: Array) -> tuple[float, ...]:
    """Times (s) at which a torque jumps, the largest first.

    Parameters
    ----------
    time, torque : ndarray, shape (T,)
        s, even; N m.

    Returns
    -------
    tuple of float
        In the middle between two samples; at most one for every :data:`FEWEST` samples.
    """
    if len(torque) < 2 * ASIDE:
        return ()
    u = (np.arange(2 * ASIDE) - ASIDE + 0.5) / ASIDE
    weights = np.linalg.pinv(np.column_stack([u > 0, *(u**k for k in range(SMOOTH + 1))]))[0]
    noise = NORMAL * float(np.median(np.abs(np.diff(torque, 3))))
    clear = CLEAR * max(noise * float(np.linalg.norm(weights)), float(np.finfo(float).eps * np.abs(torque).max()))
    steps: dict[int, float] = {}  # place -> size, each with the others taken away
    passed: list[int] = []
    while len(steps) < len(torque) // FEWEST:
        sizes = np.correlate(_without(torque, steps), weights, "valid")
        sizes[[*steps, *passed]] = 0.0
        place = int(np.argmax(np.abs(sizes)))
        if abs(sizes[place]) <= clear:
            break
        if any(abs(place - k) <= ASIDE and abs(sizes[place]) < BESIDE * abs(size) for k, size in steps.items()):
            passed.append(place)  # what a cubic does not follow beside a larger step
            continue
        steps[place] = float(sizes[place])
        for other in list(steps) * ROUNDS:
            left = _without(torque, {k: size for k, size in steps.items() if k != other})
            steps[other] = float(weights @ left[other : other + len(weights)])
    found = [k for k in sorted(steps, key=lambda k: -abs(steps[k])) if abs(steps[k]) > clear]
    return tuple(float(x) for x in (time[ASIDE - 1 :][found] + time[ASIDE:][found]) / 2)


def _without(torque: Array, steps: dict[int, float]) -> Array:
    """A torque (T,) without ``steps``: size by the first of the samples that are fitted about it."""
    left = torque.copy()
    for place, size in steps.items():
        left[place + ASIDE :] -= size
    return left
