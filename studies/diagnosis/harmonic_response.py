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
    places, at = np.unique(np.stack([requested.speed, requested.frequency]), axis=1, return_inverse=True)
    inputs, outputs = list(dict.fromkeys(requested.inputs)), list(dict.fromkeys(requested.outputs))
    gains, slope = gain_matrices(family, theta, places[0], places[1], inputs, outputs, accelerometer, slopes=slopes)
    pick = ([outputs.index(name) for name in requested.outputs], [inputs.index(name) for name in requested.inputs])
    return gains[at.ravel(), *pick], slope[at.ravel(), :, *pick]


def gain_matrices(
    family: Family,
    theta: Array,
    speed: Array,
    hertz: Array,
    inputs: list[str],
    outputs: list[str],
    accelerometer: Accelerometer | None = None,
    *,
    slopes: bool = True,
) -> tuple[Complex, Complex]:
    """Gains (m, outputs, inputs), SI, at m speeds (m/s) with frequencies (Hz), and derivatives (m, p or 0, ...).

    An output may also be a state of the model.
    """
    speeds = np.unique(speed)
    bicycle = MatrixSlopes(family, theta, speeds, slopes)
    system, names = bicycle.system, family.symbolic
    of_speed = np.searchsorted(speeds, speed)
    s: Complex = np.asarray(2j * np.pi * hertz)
    selected_inputs = np.zeros((len(s), len(names.inputs), len(inputs)))
    selected_inputs[:, [names.inputs.index(name) for name in inputs], range(len(inputs))] = 1.0
    declared = [name for name in outputs if name in (*names.outputs, ACCELERATION)]
    used, weights, weight_slopes = _weigh_outputs(bicycle, declared, of_speed, s, accelerometer)
    rows = system.output[0, of_speed][:, used]
    seen = [name for name in outputs if name not in declared]
    states_seen = _rows_of_states(family, seen)
    pencil = s[:, None, None] * system.mass[0, of_speed] - system.dynamics[0, of_speed]
    states = np.linalg.solve(pencil, system.input[0, of_speed] @ selected_inputs + 0j)
    gains = np.concatenate([weights @ (rows @ states), states_seen @ states], 1)
    slope = np.zeros((len(s), len(bicycle.steps), len(outputs), len(inputs)), complex)
    if slope.size:
        all_rows = np.concatenate([weights @ rows, np.broadcast_to(states_seen, (len(s), *states_seen.shape))], 1)
        back = np.linalg.solve(pencil.swapaxes(1, 2), all_rows.swapaxes(1, 2)).swapaxes(1, 2)
        force = bicycle.apply("input", of_speed, selected_inputs) + bicycle.force(of_speed, states, s)
        slope = back[:, None] @ force
        slope[:, :, : len(declared)] += weights[:, None] @ bicycle.apply("output", of_speed, states, used)
        slope[:, :, : len(declared)] += weight_slopes @ (rows @ states)[:, None]
    order = [[*declared, *seen].index(name) for name in outputs]
    return np.asarray(gains[:, order]), np.asarray(slope[:, :, order])


def _rows_of_states(family: Family, names: list[str]) -> Array:
    """Rows (k, n) that take k states by name, in SI, from the scaled states of the model."""
    states = list(family.symbolic.states)
    rows = np.zeros((len(names), len(states)))
    for row, name in enumerate(names):
        rows[row, states.index(name)] = family.models.scale[states.index(name)]
    return rows


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
