"""Time histories and frequency responses of the linear model, exact to rounding.

Between two jumps or bends the inputs go straight from u0 to u1, and x(t + h) = Phi x(t) + Gamma u0 + G (u1 - u0) with
exp([[A h, B h, 0], [0, 0, 1], [0, 0, 0]]) = [[Phi, Gamma, G], [0, 1, 1], [0, 0, 1]] (Van Loan 1978, IEEE Trans.
Automatic Control 23, 395-404), so there is no step-size error whatever the time grid. Yaw angle and lateral
displacement of the rear contact, d(psi)/dt = r and dy/dt = V + v psi, are carried along.

>>> from bicycle import Model, load_bicycle
>>> found = respond(Model(load_bicycle("benchmark")).linear_model(), speed=5.0, time=[0.0, 0.5], initial={"lean": 0.02})
>>> found.outputs["lean"].round(5)
array([0.02   , 0.02971])
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from bicycle.eigenvalues.decomposition import eigensystem
from bicycle.eigenvalues.oscillation import angular_frequency
from bicycle.linear_model import LinearModel
from bicycle.model import Model, as_linear
from bicycle.responses.inputs import InputHistory
from bicycle.responses.response import PATH, FrequencyResponse, Response, units_of
from tyre.base.arrays import Array
from tyre.base.errors import InputError, unknown


def respond(
    model: Model | LinearModel, *, speed: float, time: ArrayLike,
    initial: Mapping[str, float] | None = None, inputs: Mapping[str, InputHistory] | None = None,
) -> Response:  # fmt: skip
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
        Input of the model -> its history (:mod:`bicycle.responses.inputs`).

    Raises
    ------
    InputError
        An unknown state or input, a time that does not increase, a value that is not finite, or a response that grows
        beyond all numbers.
    """
    model = as_linear(model)
    given = dict(inputs or {})
    check_names("input", given, model.inputs)
    t = check_time(time)
    x = initial_state(model.states, initial, units_of(model)) / model.scale
    _, input_matrix, output_matrix = model.matrices_at(speed)
    columns = [model.inputs.index(name) for name in given]
    a, b, c = _with_path(
        model, speed, model.state_matrix(speed), input_matrix[:, columns] / model.scale[:, None],
        output_matrix * model.scale,
    )  # fmt: skip
    grid, begin, end = input_grid(t, given)
    with np.errstate(over="ignore", invalid="ignore"):
        states = _propagate(a, b, np.concatenate([x, np.zeros(len(PATH))]), grid, begin, end)[np.searchsorted(grid, t)]
        values = states @ c.T
    if not np.isfinite(values).all():
        raise InputError(
            f"the response at {speed:g} m/s grows beyond all numbers within {t[-1] - t[0]:g} s; take less time"
        )
    shown = begin[np.searchsorted(grid, t)]
    values[:, : len(model.outputs)] += shown @ model.feedthrough(speed)[:, columns].T
    outputs = dict(zip((*model.outputs, *PATH), values.T, strict=True))
    return Response(t, float(speed), outputs, dict(zip(given, shown.T, strict=True)), units_of(model))


def modal_response(model: LinearModel, *, speed: float, eigenvalue: complex, time: ArrayLike) -> Response:
    """Free motion in one mode, Re(x exp(lambda t)).

    The largest of lean, steer and yaw starts with amplitude 1, lean with phase 0. ``eigenvalue`` (1/s) picks the
    nearest root of the model at ``speed`` (m/s).

    Parameters
    ----------
    model : LinearModel
    speed : float
        m/s.
    eigenvalue : complex
        1/s.
    time : array_like, shape (m,)
        Increasing, s.
    """
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
    check_names("input", [input], model.inputs)
    hertz = np.atleast_1d(np.asarray(frequency_hz, float))
    bad = ~(np.isfinite(hertz) & (hertz > 0))
    if bad.any():
        raise InputError(f"frequency {hertz[bad][0]:g} Hz is not allowed; give finite values > 0")
    a, (_, b, c) = model.state_matrix(speed), model.matrices_at(speed)
    j = model.inputs.index(input)
    omega = angular_frequency(hertz)[:, None, None]
    states = np.linalg.solve(1j * omega * np.eye(model.order) - a, (b[:, j] / model.scale)[None, :, None])
    gains = (c * model.scale @ states)[..., 0] + model.feedthrough(speed)[:, j]
    return FrequencyResponse(
        hertz, float(speed), input, dict(zip(model.outputs, gains.T, strict=True)), units_of(model)
    )


def check_names(kind: str, given: Mapping[str, object] | list[str], allowed: tuple[str, ...]) -> None:
    """Refuse a name that the model does not have.

    Parameters
    ----------
    kind : str
        What the words call it.
    given : mapping or list of str
    allowed : tuple of str
    """
    for name in given:
        if name not in allowed:
            raise InputError(unknown(kind, name, allowed))


def check_time(time: ArrayLike) -> Array:
    """Increasing, finite times as an array (s).

    Parameters
    ----------
    time : array_like, shape (m,)
        s.
    """
    t = np.atleast_1d(np.asarray(time, float))
    if t.ndim != 1 or not t.size or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise InputError("time must be one or more finite, increasing instants in s")
    return t


def initial_state(states: tuple[str, ...], initial: Mapping[str, float] | None, units: Mapping[str, str]) -> Array:
    """Initial values (n,) of named states, SI; ``units`` of the states by name are for the words of an error.

    Parameters
    ----------
    states : tuple of str
    initial : mapping of str to float, optional
        State -> value, SI.
    units : mapping of str to str
        Unit of each state, for the words of an error.
    """
    x = np.zeros(len(states))
    check_names("state", dict(initial or {}), states)
    for name, value in (initial or {}).items():
        if not np.isfinite(value):
            raise InputError(f"initial {name} = {value!r} {units[name]} must be finite")
        x[states.index(name)] = value
    return x


def input_grid(time: Array, inputs: Mapping[str, InputHistory]) -> tuple[Array, Array, Array]:
    """Times (k,) with every jump and bend among them, and the inputs between: they go straight from begin to end.

    Parameters
    ----------
    time : ndarray, shape (m,)
        s.
    inputs : mapping of str to InputHistory

    Returns
    -------
    grid : ndarray, shape (k,)
        s.
    begin : ndarray, shape (k, number)
        Inputs just after each time.
    end : ndarray, shape (k - 1, number)
        Inputs just before the next.
    """
    times = [h.time[(h.time > time[0]) & (h.time < time[-1])] for h in inputs.values()]
    grid = np.unique(np.concatenate([time, *times]))
    begin = np.array([h.at(grid) for h in inputs.values()]).reshape(len(inputs), len(grid)).T
    end = np.array([h.before(grid[1:]) for h in inputs.values()]).reshape(len(inputs), len(grid) - 1).T
    return grid, begin, end


def _with_path(
    model: LinearModel, speed: float, state: Array, input_matrix: Array, output_matrix: Array
) -> tuple[Array, Array, Array]:
    """Append yaw angle and lateral displacement to states and outputs."""
    n, rows = len(state), [model.outputs.index(name) for name in ("yaw_rate", "rear_lateral_velocity")]
    a = np.zeros((n + 2, n + 2))
    a[:n, :n], a[n:, :n], a[n + 1, n] = state, output_matrix[rows], speed
    c = np.eye(len(output_matrix) + 2, n + 2, k=n - len(output_matrix))
    c[:-2] = np.hstack([output_matrix, np.zeros((len(output_matrix), 2))])
    return a, np.vstack([input_matrix, np.zeros((2, input_matrix.shape[1]))]), c


def _propagate(a: Array, b: Array, x: Array, grid: Array, begin: Array, end: Array) -> Array:
    n, m = b.shape
    steps, which = np.unique(np.diff(grid), return_inverse=True)
    block = np.zeros((len(steps), n + 2 * m, n + 2 * m))
    block[:, :n, :n] = a * steps[:, None, None]
    block[:, :n, n : n + m] = b * steps[:, None, None]
    block[:, n : n + m, n + m :] = np.eye(m)
    transition = expm(block)[:, :n] if steps.size else np.empty((0, n, n + 2 * m))
    states = np.empty((len(grid), n))
    states[0] = x
    for k, i in enumerate(which):
        states[k + 1] = transition[i] @ np.concatenate([states[k], begin[k], end[k] - begin[k]])
    return states
