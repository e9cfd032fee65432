"""Find the smallest impulse that starts a large motion where the mode at rest is stable."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.motion.limit_cycles import LIMITS, Cycle, LimitCycles
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown

KICKS = {"steer_torque": "N m s", "lateral_push": "N s", "steer": "rad"}
"""Kind of disturbance -> unit: an impulse of a torque or force of the model, or an angle at the start."""

HORIZON = 12.0  # s, after which a kick has started a motion or has not
HELD = 0.5  # 1/s, at which a steady lean decays in the hands of a rider
FALLEN = np.radians(60.0)  # of lean or steer
FACTORS = np.geomspace(0.1, 10.0, 25)  # of the estimate
FINER = np.geomspace(FACTORS[0], FACTORS[1], 14)[1:] / FACTORS[1]  # between two factors
NOTHING, LASTING, FALL = "nothing", "stable limit cycle", "fall"


class Kick(NamedTuple):
    """The smallest impulse that starts a motion at one speed."""

    speed: float  # m/s
    mode: str  # name of the mode whose motion it starts
    estimate: float  # by the normal form, in the unit of the kick
    least: float | None  # confirmed in time to 2 %; None: up to ten times the estimate nothing follows
    follows: str  # stable limit cycle, fall, nothing
    falls_from: float | None  # least kick tried that ends in a fall
    within_geometry: bool  # after the least kick lean stays below 10 degrees, and the bar below 20


def kick_thresholds(limit_cycles: LimitCycles, speeds: ArrayLike, kind: str = "steer_torque") -> list[Kick]:
    """Find the smallest impulse at each speed where an unstable motion coexists with a stable mode or dry friction.

    The normal form gives a first value: the impulse excites the mode to the amplitude of the unstable cycle.
    Motions over 12 s after impulses from a tenth to ten times of it confirm or correct it. A rider holds the slow
    lean meanwhile.
    Kinds: ``steer_torque`` (impulse, N m s), ``lateral_push`` (N s) or ``steer`` (initial angle, rad).
    """
    refuse_unknown("kick", [kind], KICKS)
    system = limit_cycles.system
    at_speed = system.at_one_speed
    if kind == "steer":
        start = np.eye(len(at_speed.states))[at_speed.states.index(kind)]
    elif kind in at_speed.inputs:
        start = at_speed.input_matrix[:, at_speed.inputs.index(kind)]
    else:
        raise InputError(f"impulse {kind!r}: this model has no such input")
    thresholds: list[tuple[float, str, Cycle, float]] = []
    for speed in np.atleast_1d(np.asarray(speeds, float)).tolist():
        leaving = [(mode, cycle) for mode, cycle in limit_cycles.at(speed) if limit_cycles.stability(cycle) == "no"]
        if not leaving:
            continue
        mode, cycle = min(leaving, key=lambda at_speed: limit_cycles.amplitude(at_speed[1]))
        values, vectors = np.linalg.eig(system.linear(speed))
        place = int(np.abs(values - 1j * cycle.angular_frequency).argmin())
        if values[place].real < 0 or limit_cycles.dry_friction:
            amplitude = np.linalg.inv(vectors)[place] @ start * (system.row("steer") @ vectors[:, place])
            thresholds.append((speed, mode, cycle, limit_cycles.amplitude(cycle) / (2 * abs(amplitude))))
    if not thresholds:
        return []
    v, modes, cycles, estimates = zip(*thresholds, strict=True)
    sizes = np.array(estimates)[:, None] * FACTORS
    coarse, _ = _outcomes(limit_cycles, v, cycles, start, sizes)
    first = (coarse != NOTHING).argmax(1)
    sizes_finer = np.take_along_axis(sizes, first[:, None], 1) * FINER
    finer, within = _outcomes(limit_cycles, v, cycles, start, sizes_finer)
    kicks = []
    for k, speed in enumerate(v):
        falls = np.concatenate([sizes_finer[k][finer[k] == FALL], sizes[k][coarse[k] == FALL]])
        least, follows, place = None, NOTHING, 0
        if coarse[k, first[k]] != NOTHING:
            place = int((finer[k] != NOTHING).argmax())
            least = float(sizes_finer[k, place])
            follows = str(finer[k, place])
        falls_from = float(falls.min()) if falls.size and least is not None else None
        kicks.append(Kick(speed, modes[k], float(estimates[k]), least, follows, falls_from, bool(within[k, place])))
    return kicks


def _outcomes(
    limit_cycles: LimitCycles, speeds: Sequence[float], cycles: Sequence[Cycle], start: Array, sizes: Array
) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Outcome (speeds, sizes) of impulses, and if it stays in linear geometry, by the classical Runge-Kutta method."""
    system, states = limit_cycles.system, list(limit_cycles.system.at_one_speed.states)
    a = system.dynamics(np.array(speeds))
    for matrix, speed in zip(a, speeds, strict=True):  # a rider holds the lean that grows without any kick (capsize)
        values, vectors = np.linalg.eig(system.linear(speed))
        is_held = (values.imag == 0) & (values.real > -HELD)
        matrix -= ((vectors * is_held * (values + HELD)) @ np.linalg.inv(vectors)).real
    step = 1.2 / max(np.abs(np.linalg.eigvals(system.linear(v, sticking=True))).max() for v in speeds)
    count = int(HORIZON / step)
    angles = [states.index(name) for name in LIMITS]
    rate = states.index("steer_rate")
    x = sizes[:, :, None] * start
    peaks, last = np.zeros((*sizes.shape, len(angles))), np.zeros(sizes.shape)

    def change(x: Array) -> Array:
        return x @ a.transpose(0, 2, 1) + system.curves(x @ system.signals.T) @ system.entry.T

    for number in range(count):
        k1 = change(x)
        k2 = change(x + step / 2 * k1)
        k3 = change(x + step / 2 * k2)
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + change(x + step * k3))
        peaks = np.maximum(peaks, np.abs(x[..., angles]))
        x[(peaks > FALLEN).any(-1)] = 0.0
        if number * step > HORIZON - 1.0:
            last = np.maximum(last, np.abs(x[..., rate]))
    swing = np.array([system.amplitude(cycle, "steer_rate") for cycle in cycles])
    moves = np.where(last > swing[:, None], LASTING, NOTHING)
    return np.where((peaks > FALLEN).any(-1), FALL, moves), np.all(peaks <= list(LIMITS.values()), -1)
