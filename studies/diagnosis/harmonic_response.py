"""Gains of a bicycle from its inputs to what sensors show, at frequencies and speeds, and their derivatives.

H = C (i omega E - F)^-1 B. Its derivative is dH = dC X + L (dB - (i omega dE - dF) X) with X = (i omega E - F)^-1 B and
L = C (i omega E - F)^-1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studies.diagnosis.family import Family, MatrixSlopes
from tyre.ground.arrays import Array, Complex

ACCELERATION = "lateral_acceleration"


@dataclass(frozen=True)
class Accelerometer:
    """Place of a lateral accelerometer that is fixed to the rear frame, m: ahead of the rear contact, z down."""

    x: float  # m, ahead of the rear contact
    z: float  # m, down from the ground: above it negative


@dataclass(frozen=True, eq=False)
class Wanted:
    """Responses (n,) to be predicted: frequencies (Hz), speeds (m/s), names of inputs and outputs."""

    frequency: Array  # (n,), Hz
    speed: Array  # (n,), m/s, as recorded
    inputs: tuple[str, ...]  # (n,)
    outputs: tuple[str, ...]  # (n,)

    @cached_property
    def s(self) -> Complex:
        """i omega (n,), rad/s."""
        return np.asarray(2j * np.pi * self.frequency)


def responses(
    family: Family, requested: Wanted, theta: Array, accelerometer: Accelerometer | None = None, *, slopes: bool = True
) -> tuple[Complex, Complex]:
    """Gains (n,), SI, and their derivatives (n, p), or (n, 0)."""
    speeds = np.unique(requested.speed)
    bicycle = MatrixSlopes(family, theta, speeds, slopes)
    system, names = bicycle.system, family.symbolic
    places, at = np.unique(np.stack([requested.speed, requested.frequency]), axis=1, return_inverse=True)
    at, of_speed, s = at.ravel(), np.searchsorted(speeds, places[0]), 2j * np.pi * places[1]
    inputs, outputs = list(dict.fromkeys(requested.inputs)), list(dict.fromkeys(requested.outputs))
    selected_inputs = np.zeros((len(s), len(names.inputs), len(inputs)))
    selected_inputs[:, [names.inputs.index(name) for name in inputs], range(len(inputs))] = 1.0
    used, weights, weight_slopes = _weigh_outputs(bicycle, outputs, of_speed, s, accelerometer)
    rows = system.output[0, of_speed][:, used]
    pencil = s[:, None, None] * system.mass[0, of_speed] - system.dynamics[0, of_speed]
    states = np.linalg.solve(pencil, system.input[0, of_speed] @ selected_inputs + 0j)
    pick = ([outputs.index(name) for name in requested.outputs], [inputs.index(name) for name in requested.inputs])
    gains = (weights @ (rows @ states))[at, *pick]
    slope = np.zeros((len(gains), len(bicycle.steps)), complex)
    if slope.size:
        back = np.linalg.solve(pencil.swapaxes(1, 2), (weights @ rows).swapaxes(1, 2)).swapaxes(1, 2)
        force = bicycle.apply("input", of_speed, selected_inputs) + bicycle.force(of_speed, states, s)
        gain_slopes = weights[:, None] @ bicycle.apply("output", of_speed, states, used)
        gain_slopes += weight_slopes @ (rows @ states)[:, None] + back[:, None] @ force
        slope = gain_slopes[at, :, *pick]
    return gains, slope


def _weigh_outputs(
    bicycle: MatrixSlopes, signals: list[str], at: NDArray[np.intp], s: Complex, place: Accelerometer | None
) -> tuple[list[int], Complex, Array]:
    """Measured signals as sums of outputs of the model, at speeds ``at`` and i omega ``s`` (m,)."""
    parts = ("rear_lateral_velocity", "yaw_rate", "lean_rate", "lean")
    used = list(dict.fromkeys([name for name in signals if name != ACCELERATION] + list(parts)))
    weights = np.zeros((len(s), len(signals), len(used)), complex)
    slopes = np.zeros((len(s), len(bicycle.steps), len(signals), len(used)))
    for k, name in enumerate(signals):
        if name != ACCELERATION:
            weights[:, k, used.index(name)] = 1.0
            continue
        assert place is not None
        lateral, yaw, rolling, lean = (used.index(part) for part in parts)
        v, g = bicycle.true_speeds, bicycle.values["g"]
        weights[:, k, lateral], weights[:, k, rolling] = s, -place.z * s
        weights[:, k, yaw], weights[:, k, lean] = place.x * s + v[0, at], -g[0]
        slopes[:, :, k, yaw] = bicycle.difference(v).T[at]
        slopes[:, :, k, lean] = -bicycle.difference(g)[:, 0]
    outputs = bicycle.family.symbolic.outputs
    return [outputs.index(name) for name in used], weights, slopes
