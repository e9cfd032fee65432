"""Motion of a linear model in time and frequency."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from bicycle.model.eigen import angular_frequency, eigensystem
from bicycle.model.inputs import InputHistory
from bicycle.model.model import Model, as_linear
from bicycle.model.state_space import LinearModel
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.text_table import write_csv

if TYPE_CHECKING:
    import pandas as pd


def discretise(state: Array, inputs: Array, steps: Array) -> tuple[Array, Array, Array]:
    """x_(k+1) = A x_k + G0 u_k + G1 u_(k+1), exact for inputs that are linear between samples."""
    n, m = state.shape[-1], inputs.shape[-1]
    power = exponential(_with_inputs(state, inputs, steps))
    late = power[..., :n, n + m :]
    with np.errstate(invalid="ignore"):
        return power[..., :n, :n], power[..., :n, n : n + m] - late, late


def _with_inputs(state: Array, inputs: Array, steps: Array) -> Array:
    """Matrices whose exponential carries the state, its inputs and their change over a step (Van Loan)."""
    n, m = state.shape[-1], inputs.shape[-1]
    block = np.zeros((*np.broadcast_shapes(state.shape[:-2], steps.shape), n + 2 * m, n + 2 * m))
    block[..., :n, :n] = state * steps[:, None, None]
    block[..., :n, n : n + m] = inputs * steps[:, None, None]
    block[..., n : n + m, n + m :] = np.eye(m)
    return block


def exponential(matrices: Array) -> Array:
    """Matrix exponentials by scaling, Taylor series and squaring, all at once."""
    order = 10  # with arguments below 1/4 it errs by 1e-14
    size = float(np.abs(matrices).sum(-1).max())
    squarings = max(0, int(np.ceil(np.log2(max(4 * size, 1e-300))))) if np.isfinite(size) else 0
    scaled = matrices / 2.0**squarings
    unit = np.eye(matrices.shape[-1])
    total = unit + scaled / order
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(order - 1, 0, -1):
            total = unit + scaled @ total / k
        for _ in range(squarings):
            total = total @ total
    return np.asarray(total)


def march(step: Array, push: Array, start: Array) -> Array:
    """States x_(k+1) = A x_k + p_k of many systems from their ``start``, block by block and not sample by sample."""
    count = push.shape[-1] + 1
    block = int(np.ceil(np.sqrt(count)))
    blocks = -(-count // block)
    lead = np.broadcast_shapes(step.shape[:-2], push.shape[:-2], start.shape[:-1])
    n = step.shape[-1]
    pushed = np.zeros((*lead, n, blocks * block))
    pushed[..., : count - 1] = push
    pushed = np.moveaxis(pushed.reshape(*lead, n, blocks, block), -1, 0)
    both = np.zeros((block + 1, *lead, n, blocks + n))  # the blocks from rest, and behind them the powers of A
    rest, powers = both[..., :blocks], both[..., blocks:]
    powers[0] = np.eye(n)
    begin = np.empty((blocks, *lead, n, 1))
    begin[0] = start[..., None]
    for j in range(block):
        np.matmul(step, both[j], out=both[j + 1])
        rest[j + 1] += pushed[j]
    for k in range(blocks - 1):
        begin[k + 1] = powers[block] @ begin[k] + rest[block, ..., k : k + 1]
    states = rest[:block] + powers[:block] @ np.moveaxis(begin[..., 0], 0, -1)
    return np.moveaxis(states, 0, -1).reshape(*lead, n, blocks * block)[..., :count]


def from_rest(step: Array, known: Array, across: Array, seen: Array) -> Array:
    """Outputs of systems that begin at rest under many pushes, each a sum of the same known signals."""
    systems, count, q = known.shape[0], known.shape[1] + 1, known.shape[2]
    k, n = across.shape[2:]
    block = int(np.ceil(np.sqrt(count)))
    blocks = -(-count // block)
    padded = np.zeros((systems, blocks * block, q))
    padded[:, : count - 1] = known
    inputs = np.ascontiguousarray(np.moveaxis(padded.reshape(systems, blocks, block, q), 2, 0))[:, :, None]
    across = np.ascontiguousarray(np.moveaxis(across, -1, 1))  # states lead, pushes stay neighbours: wide products
    rest = np.zeros((systems, n, blocks * k))
    power = np.broadcast_to(np.eye(n), step.shape)
    y = np.empty((block, systems, seen.shape[1], blocks * k))
    powers = np.empty((block, *seen.shape))  # as they are seen
    for j in range(block):
        np.matmul(seen, rest, out=y[j])
        np.matmul(seen, power, out=powers[j])
        rest, power = step @ rest, step @ power
        rest += (inputs[j] @ across).reshape(rest.shape)
    ends = rest.reshape(systems, n, blocks, k)
    begin = np.zeros((systems, n, blocks, k))
    for b in range(blocks - 1):
        begin[:, :, b + 1] = power @ begin[:, :, b] + ends[:, :, b]
    y += powers @ begin.reshape(rest.shape)
    y = y.reshape(block, systems, -1, blocks, k).transpose(1, 2, 3, 0, 4)
    return y.reshape(systems, -1, blocks * block, k)[:, :, :count]


def powers_of(step: Array, count: int) -> Array:
    """Free responses to unit starts, A^k for k = 0 .. ``count`` - 1, by doubling."""
    n = step.shape[-1]
    states = np.empty((*step.shape[:-1], count, n))
    states[..., 0, :] = np.eye(n)
    done_steps, leap = 1, step
    while done_steps < count:
        more = min(done_steps, count - done_steps)
        flat = states[..., :more, :].reshape(*step.shape[:-1], more * n)
        states[..., done_steps : done_steps + more, :] = (leap @ flat).reshape(*step.shape[:-1], more, n)
        done_steps, leap = done_steps + more, leap @ leap
    return states


PATH = {"yaw": "rad", "rear_lateral_displacement": "m"}  # carried along beside the model's outputs, with unit
LINEAR_UP_TO = 0.35  # rad: the geometry is linear in lean and steer; sin and tan leave it by 2 to 4 % here


def units_of(model: LinearModel) -> dict[str, str]:
    """SI unit of every state, input and output of a model, of the yaw angle and of the lateral displacement."""
    return {**PATH, **model.declared.units}


def column(name: str, unit: str) -> str:
    """Column name with unit: ``yaw_rate`` in rad/s -> ``yaw_rate_rad_s``."""
    return f"{name}_{unit.replace('/', '_').replace(' ', '_')}"


@dataclass(frozen=True)
class Response:
    """A time history at constant speed.

    Attributes
    ----------
    time : ndarray, shape (m,)
        s.
    speed : float
        m/s.
    outputs, inputs : mapping of str to ndarray, shape (m,)
        SI units; an input is given from each sample on.
    units : mapping of str to str
        Unit of every output and input by name, as the model declares it (:func:`units_of`).
    """

    time: Array
    speed: float
    outputs: Mapping[str, Array]
    inputs: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return (
            f"<Response at {self.speed:g} m/s: {len(self.time)} times, {self.time[0]:g} to {self.time[-1]:g} s\n"
            f" outputs {', '.join(self.outputs)}\n"
            f" inputs {', '.join(self.inputs) or 'none'}; warnings: {len(self.warnings)}>"
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of a motion that linear geometry cannot describe."""
        fallen = [] if self.fall is None else [f"the bicycle has fallen at {self.time[self.fall]:.2f} s"]
        largest = {name: float(np.abs(self.outputs[name]).max()) for name in ("lean", "steer")}
        text = "{} reaches {:.2g} rad, but the geometry is linear and holds up to about {} rad"
        large = [text.format(name, x, LINEAR_UP_TO) for name, x in largest.items() if x > LINEAR_UP_TO]
        return (*fallen, *large)

    @property
    def fall(self) -> int | None:
        """Number of the first sample with lean or steer beyond 90 degrees, None if there is none."""
        fallen = np.maximum(np.abs(self.outputs["lean"]), np.abs(self.outputs["steer"])) > np.pi / 2
        return int(fallen.argmax()) if fallen.any() else None

    def until_fall(self) -> Response:
        """A history up to and with the sample :attr:`fall`; all of it if the bicycle does not fall."""
        until_fall = slice(None if self.fall is None else self.fall + 1)
        outputs, inputs = ({name: x[until_fall] for name, x in of.items()} for of in (self.outputs, self.inputs))
        return Response(self.time[until_fall], self.speed, outputs, inputs, self.units)

    def frame(self) -> pd.DataFrame:
        """A row per sample: time_s, outputs, inputs, with the unit in every column name."""
        import pandas as pd

        named = {**self.outputs, **self.inputs}
        return pd.DataFrame({"time_s": self.time, **{column(n, self.units[n]): x for n, x in named.items()}})

    def to_csv(self, path: str | Path) -> None:
        """Write :meth:`frame` as CSV with all digits to ``path``."""
        write_csv(path, self.frame())


@dataclass(frozen=True)
class FrequencyResponse:
    """Complex gains ``outputs[name]`` (m,) from one input, SI, at ``frequency_hz`` (m,); ``units`` by name."""

    frequency_hz: Array  # (m,), Hz
    speed: float  # m/s
    input: str  # name of the harmonic input
    outputs: Mapping[str, Complex]  # name -> (m,), unit of the output per unit of the input
    units: Mapping[str, str] = field(default_factory=dict)  # of input and outputs, by name

    def __repr__(self) -> str:
        hertz = self.frequency_hz
        return (
            f"<FrequencyResponse to {self.input} at {self.speed:g} m/s: {hertz.size} frequencies, "
            f"{hertz.min():g} to {hertz.max():g} Hz\n"
            f" outputs {', '.join(self.outputs)}>"
        )

    def frame(self) -> pd.DataFrame:
        """A row per frequency: Hz, then gain and phase (rad, unwrapped) of each output."""
        import pandas as pd

        columns, per = {"frequency_Hz": self.frequency_hz}, column(self.input, self.units[self.input])
        for name, gain in self.outputs.items():
            columns[f"{column(name, self.units[name])}_per_{per}"] = np.abs(gain)
            columns[f"{name}_phase_rad"] = np.unwrap(np.angle(gain))
        return pd.DataFrame(columns)


def respond(
    model: Model | LinearModel,
    *,
    speed: float,
    time: ArrayLike,
    initial: Mapping[str, float] | None = None,
    inputs: Mapping[str, InputHistory] | None = None,
) -> Response:
    """Time history from initial states and inputs that are constant between jumps, or linear between samples.

    Parameters
    ----------
    model : Model or LinearModel
    speed : float
        m/s.
    time : array_like, shape (m,)
        Increasing, s; the initial state holds at its first entry.
    initial : mapping, optional
        State -> value, SI; the others start at zero.
    inputs : mapping, optional
        Input of the model -> its history (:mod:`bicycle.model.inputs`).

    Raises
    ------
    InputError
        An unknown state or input, a time that does not increase, a value that is not finite, or a response that grows
        beyond all numbers.
    """
    model = as_linear(model)
    input_histories = dict(inputs or {})
    refuse_unknown("input", input_histories, model.inputs)
    t = check_time(time)
    x = initial_state(model.states, initial, units_of(model)) / model.scale
    _, input_matrix, output_matrix = model.matrices_at(speed)
    columns = [model.inputs.index(name) for name in input_histories]
    a, b, c = _with_path(
        model,
        speed,
        model.state_matrix(speed),
        input_matrix[:, columns] / model.scale[:, None],
        output_matrix * model.scale,
    )
    grid, begin, end = input_grid(t, input_histories)
    with np.errstate(over="ignore", invalid="ignore"):
        states = _propagate(a, b, np.concatenate([x, np.zeros(len(PATH))]), grid, begin, end)[np.searchsorted(grid, t)]
        values = states @ c.T
    if not np.isfinite(values).all():
        raise InputError(
            f"the response at {speed:g} m/s grows beyond all numbers within {t[-1] - t[0]:g} s; take less time"
        )
    input_values = begin[np.searchsorted(grid, t)]
    values[:, : len(model.outputs)] += input_values @ model.feedthrough(speed)[:, columns].T
    outputs = dict(zip((*model.outputs, *PATH), values.T, strict=True))
    return Response(t, float(speed), outputs, dict(zip(input_histories, input_values.T, strict=True)), units_of(model))


def modal_response(model: LinearModel, *, speed: float, eigenvalue: complex, time: ArrayLike) -> Response:
    """Free motion in one mode, Re(x exp(lambda t))."""
    t = check_time(time)
    (values,), (vectors,), _ = eigensystem(model.state_matrix([speed]))
    k = int(np.abs(values - eigenvalue).argmin())
    root = values[k]
    phasors = dict(zip(model.outputs, model.matrices_at(speed)[2] @ (model.scale * vectors[:, k]), strict=True))
    yaw = phasors["yaw_rate"] / root
    phasors |= {"yaw": yaw, "rear_lateral_displacement": (phasors["rear_lateral_velocity"] + speed * yaw) / root}
    largest = max(abs(phasors[name]) for name in ("lean", "steer", "yaw"))
    unit = largest * (phasors["lean"] / abs(phasors["lean"]) if phasors["lean"] else 1.0)
    growth = np.exp(root * t)
    motion = {name: (phasor / unit * growth).real for name, phasor in phasors.items()}
    return Response(t, float(speed), motion, units=units_of(model))


def frequency_response(
    model: Model | LinearModel, *, speed: float, input: str, frequency_hz: ArrayLike
) -> FrequencyResponse:
    """Gain C (i omega - A)^-1 B + D from one input to every output, omega = 2 pi ``frequency_hz``.

    Parameters
    ----------
    model : Model or LinearModel
    speed : float
        m/s.
    input : str
        Of the model.
    frequency_hz : array_like, shape (m,)
        Hz, > 0.

    Raises
    ------
    InputError
        An unknown input, or a frequency that is not finite and positive.
    """
    model = as_linear(model)
    refuse_unknown("input", [input], model.inputs)
    hertz = np.atleast_1d(np.asarray(frequency_hz, float))
    bad = ~(np.isfinite(hertz) & (hertz > 0))
    if bad.any():
        raise InputError(f"frequency {hertz[bad][0]:g} Hz is not allowed; give finite values > 0")
    a = model.state_matrix(speed)
    _, b, c = model.matrices_at(speed)
    j = model.inputs.index(input)
    omega = angular_frequency(hertz)[:, None, None]
    states = np.linalg.solve(1j * omega * np.eye(model.order) - a, (b[:, j] / model.scale)[None, :, None])
    gains = (c * model.scale @ states)[..., 0] + model.feedthrough(speed)[:, j]
    return FrequencyResponse(
        hertz, float(speed), input, dict(zip(model.outputs, gains.T, strict=True)), units_of(model)
    )


def check_time(time: ArrayLike) -> Array:
    """Increasing, finite times as an array (s)."""
    t = np.atleast_1d(np.asarray(time, float))
    if t.ndim != 1 or not t.size or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise InputError("time must be one or more finite, increasing instants in s")
    return t


def initial_state(states: tuple[str, ...], initial: Mapping[str, float] | None, units: Mapping[str, str]) -> Array:
    """Initial values (n,) of named states, SI; ``units`` of the states by name are for the words of an error."""
    refuse_unknown("state", initial or {}, states)
    for name, value in (initial or {}).items():
        if not np.isfinite(value):
            raise InputError(f"initial {name} = {value!r} {units[name]} must be finite")
    return np.array([(initial or {}).get(name, 0.0) for name in states], float)


def input_grid(time: Array, inputs: Mapping[str, InputHistory]) -> tuple[Array, Array, Array]:
    """Times (k,) with every jump and bend among them, and the inputs between: they go straight from begin to end."""
    times = [h.time[(h.time > time[0]) & (h.time < time[-1])] for h in inputs.values()]
    grid = np.unique(np.concatenate([time, *times]))
    begin = np.array([h.at(grid) for h in inputs.values()]).reshape(len(inputs), len(grid)).T
    end = np.array([h.before(grid[1:]) for h in inputs.values()]).reshape(len(inputs), len(grid) - 1).T
    return grid, begin, end


def _with_path(
    model: LinearModel, speed: float, state: Array, input_matrix: Array, output_matrix: Array
) -> tuple[Array, Array, Array]:
    """Append yaw angle and lateral displacement to states and outputs."""
    n = len(state)
    rows = [model.outputs.index(name) for name in ("yaw_rate", "rear_lateral_velocity")]
    a = np.zeros((n + 2, n + 2))
    a[:n, :n], a[n:, :n], a[n + 1, n] = state, output_matrix[rows], speed
    c = np.eye(len(output_matrix) + 2, n + 2, k=n - len(output_matrix))
    c[:-2] = np.hstack([output_matrix, np.zeros((len(output_matrix), 2))])
    return a, np.vstack([input_matrix, np.zeros((2, input_matrix.shape[1]))]), c


def _propagate(a: Array, b: Array, x: Array, grid: Array, begin: Array, end: Array) -> Array:
    n, m = b.shape
    steps, which = np.unique(np.diff(grid), return_inverse=True)
    transition = expm(_with_inputs(a, b, steps))[:, :n] if steps.size else np.empty((0, n, n + 2 * m))
    states = np.empty((len(grid), n))
    states[0] = x
    for k, i in enumerate(which):
        states[k + 1] = transition[i] @ np.concatenate([states[k], begin[k], end[k] - begin[k]])
    return states
