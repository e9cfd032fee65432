"""Replay of recorded runs: the torques through the model, from given starts or with the free responses."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from bicycle.identification.recording import AS_HELD, CHANNELS, INPUTS, Run
from bicycle.model.descriptor import DescriptorStack
from bicycle.motion.responses import discretise, from_rest, march, powers_of
from studies.diagnosis import mistakes
from studies.diagnosis.family import SPEED_OFFSET, Family
from studies.diagnosis.riding import PUSHES, SHARES, WORDS, TorqueSize, acting_torques, basis_courses
from studies.inference.last_answer import RecentAnswers
from tyre.ground.arrays import Array


def apply_lowpass(signal: Array, tau: Array, steps: Array) -> Array:
    """Outputs y of first-order low-passes, tau dy/dt + y = u, for a ``signal`` u (T, K, R, ...), same shape.

    ``tau`` (K,) and ``steps`` (R,) in s. Exact for signals that are linear between samples and were so before the
    first. A negative tau mirrors y of its absolute value about u, 2 u - y, so that y is smooth in tau at 0.
    """
    filtered = signal.copy()
    ratio = np.round(np.abs(tau)[:, None] / steps, 12)  # (K, R), equal ones are filtered together
    for size in np.unique(ratio[ratio > 0]):
        k, r = np.nonzero(ratio == size)
        u = signal[:, k, r]
        keep = np.exp(-1 / size)
        late = size * (1 - keep)  # of the sample before, less what is kept of the output
        first = u[0] - size * (u[1] - u[0])  # y that follows a ramp with the slope of the first two samples
        state = first - (1 - late) * u[0]
        filtered[:, k, r] = scipy.signal.lfilter([1 - late, late - keep], [1.0, -keep], u, axis=0, zi=state[None])[0]
    negative = tau < 0
    filtered[:, negative] = 2 * signal[:, negative] - filtered[:, negative]
    return filtered


def lowpass_transient(length: int, tau: Array, steps: Array) -> Array:
    """Transient (T, K, R) that another output of the low-pass before the first sample leaves in T = ``length`` samples.

    exp(-t / tau) times tau / (tau + h), with ``tau`` (K,) and the ``steps`` h (R,) in s; it vanishes as tau does.
    """
    ratio = np.abs(tau)[:, None] / steps
    with np.errstate(divide="ignore", invalid="ignore"):
        decay = np.exp(-np.arange(length)[:, None, None] / ratio)
    return np.asarray(np.sign(tau)[:, None] * ratio / (1 + ratio) * np.nan_to_num(decay))


SENSED = (mistakes.LOWPASS, mistakes.DELAY, mistakes.GAIN)


class Driven(NamedTuple):
    """Equations of K bicycles and R runs: dx/dt = state x + inputs u, and the channels, output x + direct u."""

    state: Array  # (K, R, n, n)
    inputs: Array  # (K, R, n, m)
    output: Array  # (K, R, C, n): channels by states
    direct: Array | None  # (K, R, C, m): channels by inputs; None if no channel shows the inputs


class SpeedChange(NamedTuple):
    """Change of the equations with the deviation d of the speed: step + d step_1 + d^2 step_2, and the others alike."""

    deviation: Array  # d (K, R, T), m/s, from the speed in the middle of the run
    step: tuple[Array, Array]  # step_1 and step_2, (K, R, n, n)
    before: tuple[Array, Array]  # (K, R, n, m)
    after: tuple[Array, Array]  # (K, R, n, m)
    output: tuple[Array, Array]  # (K, R, C, n)


class Sampled(NamedTuple):
    """Equations from sample to sample: x_(k+1) = step x_k + before u_k + after u_(k+1), with u (K or 1, R, m, T)."""

    step: Array  # (K, R, n, n)
    before: Array  # (K, R, n, m), by the inputs at the sample before
    after: Array  # (K, R, n, m), by the inputs at the sample itself
    output: Array  # (K, R, C, n): channels by states
    direct: Array | None  # (K, R, C, m): channels by inputs; None if no channel shows the inputs
    u: Array  # (K or 1, R, m, T), N m or N; of a prescribed steer angle also rad and its derivatives
    speed_change: SpeedChange | None = None  # None if the speed is constant

    @property
    def first_bicycle(self) -> "Sampled":
        """Equations of the first bicycle at the speed in the middle of each run, without the axis of bicycles."""
        direct = None if self.direct is None else self.direct[0]
        return Sampled(self.step[0], self.before[0], self.after[0], self.output[0], direct, self.u[0])


@dataclass(frozen=True)
class Replay:
    """Runs of one set of torques, replayed at once."""

    runs: tuple[Run, ...]  # with the same inputs
    channels: tuple[str, ...]  # columns that are computed, C of them
    # Sizes of torques of the ride by identifier, called only where one acts, for it takes fits; 1 N m of those left out
    torque_sizes: Callable[[], Mapping[str, TorqueSize]] = dict

    @cached_property
    def length(self) -> int:
        """Samples T of the longest run."""
        return max(len(run.time) for run in self.runs)

    @cached_property
    def held(self) -> bool:
        """True if the torques are piecewise constant (commanded), as stated or as most samples repeat; else linear."""
        if self.runs[0].between:
            return self.runs[0].between == AS_HELD
        steps = [np.diff(u) for run in self.runs for u in run.inputs.values()]
        return bool(steps) and float(np.mean(np.concatenate(steps) == 0)) > 0.5

    def __call__(self, family: Family, theta: Array, starts: Array) -> Array:
        """Computed channels (K, R, C, T), in their units, at ``theta`` (K, p) from ``starts`` (R, n + others).

        Starts are the n states, in the model's scaled units, then states of the low-passes and weights of the torques
        of the ride (or of splines of the steer angle), in prior sd.
        """
        values = family.values(theta)
        system = self._discretise(family, values, starts)
        n = system.step.shape[-1]
        with np.errstate(over="ignore", invalid="ignore"):
            y = self._outputs(system, self._states(system, starts))
            return self._apply_sensors(y[..., None], values, starts[:, n:])[..., 0]

    def free(self, family: Family, theta: Array) -> tuple[Array, Array]:
        """Computed channels (R, C, T) of runs that begin at rest, and the response (R, C, T, k) to each unit start.

        At ``theta`` (p,), in the units of the channels; the k starts as of :meth:`__call__`.
        """
        values = family.values(theta[None])
        system = self._discretise(family, values, None)
        n = system.step.shape[-1]
        with np.errstate(over="ignore", invalid="ignore"):
            forced = self._outputs(system, self._states(system, np.zeros((len(self.runs), n))))
            if system.speed_change is None:
                powers = powers_of(system.step[0], self.length)
                responses = (system.output[0] @ powers.reshape(*powers.shape[:2], -1)).reshape(*forced.shape[1:], n)
            else:  # the columns of one bicycle, marched together, take the axis of bicycles
                marched = self._march_while_slowing(system, np.broadcast_to(np.eye(n), system.step.shape))[0]
                responses = np.moveaxis(self._outputs(system._replace(direct=None), np.moveaxis(marched, 2, 0)), 0, -1)

            # The sensors act alike on the motion and on each response.
            torque_responses = self._input_responses(system, values)
            y = np.concatenate([forced[..., None], responses[None], torque_responses], -1)
            y = self._apply_sensors(y, values, None)[0]
        filter_responses = np.moveaxis(self._filter_starts(values)[0], -2, -1)
        return y[..., 0], np.concatenate([y[..., 1 : 1 + n], filter_responses, y[..., 1 + n :]], -1)

    def slopes(self, family: Family, theta: Array, steps: Array, starts: Array) -> Array:
        """Derivatives (R, C, T, p) of the computed channels by ``theta`` (p,), at fixed ``starts`` (R, n + others).

        By the derivative of the differential equations, d(x)' = A dx + dA x + ...: all coordinates share the system
        matrix of a run and are marched at once. Those of the matrices are differences of ``steps`` (p,).
        """
        batch = np.vstack([theta, theta + np.diag(steps)])  # the point itself is the first bicycle
        h = steps[:, None, None, None]
        values = family.values(batch)
        if self._coasts(values):  # the matrices change along a run
            outputs = self(family, batch, starts)
            return np.moveaxis((outputs[1:] - outputs[0]) / h, 0, -1)
        system = self._discretise(family, values, starts)
        first = system.first_bicycle
        with np.errstate(over="ignore", invalid="ignore"):
            x = self._states(first, starts)
            derivatives = self._state_derivatives(system, x, steps)
            if not self._has_sensor_errors(values):
                return derivatives

            # Errors of sensors change with theta too: they are applied to the channels and to each that a step makes.
            y = np.empty((1 + len(steps), *derivatives.shape[:-1]))
            y[0] = self._outputs(first, x)
            y[1:] = y[0] + h * np.moveaxis(derivatives, -1, 0)
            y = self._apply_sensors(y[..., None], values, starts[:, x.shape[1] :])[..., 0]
            return np.moveaxis((y[1:] - y[0]) / h, 0, -1)

    def _has_sensor_errors(self, values: Mapping[str, Array]) -> bool:
        """True if :meth:`_apply_sensors` changes any channel with these ``values``."""
        of_channels = (kind.format(name) in values for kind in SENSED for name in self.channels)
        return mistakes.OFFSET in values or mistakes.LEANS in values or any(of_channels)

    def _state_derivatives(self, system: Sampled, x: Array, steps: Array) -> Array:
        """Derivatives (R, C, T, p) of the channels before sensors, by the p coordinates, at states ``x`` (R, n, T).

        Bicycle 0 of the ``system`` is the point itself; each other differs from it by the step (p,) of one coordinate.
        """
        first = system.first_bicycle
        h = steps[:, None, None, None]

        # 1. A coordinate changes the matrices: all dx are driven by the same signals, x and u, through these changes.
        drivers = [x[..., :-1], first.u[..., :-1], first.u[..., 1:]]
        matrices = (system.step, system.before, system.after)
        matrix_slopes = np.concatenate([(m[1:] - m[0]) / h for m in matrices], -1)  # (p, R, n, n + 2 m)
        into_states = [np.moveaxis(matrix_slopes, (0, 1, 3), (2, 0, 1))]  # (R, drivers, p, n)

        # 2. A coordinate may change the inputs (delay, gain, friction): its own driver, which acts on its dx alone.
        input_slopes = {}
        if len(system.u) > 1:
            input_slopes = {k: (system.u[k + 1] - first.u) / step for k, step in enumerate(steps)}
            input_slopes = {k: du for k, du in input_slopes.items() if du.any()}
        n = x.shape[1]
        for k, du in input_slopes.items():
            drivers.append(system.before[k + 1] @ du[..., :-1] + system.after[k + 1] @ du[..., 1:])
            to_own_states = np.zeros((len(x), n, len(steps), n))
            to_own_states[:, :, k] = np.eye(n)
            into_states.append(to_own_states)
        signals = np.concatenate(drivers, 1).swapaxes(-1, -2)
        derivatives = from_rest(first.step, signals, np.concatenate(into_states, 1), first.output)

        # 3. A coordinate may change what the channels show of states and inputs.
        output_slopes = (system.output[1:] - first.output) / h
        if output_slopes.any():
            derivatives += x.swapaxes(-1, -2)[:, None] @ np.moveaxis(output_slopes, 0, -1)
        if first.direct is not None and system.direct is not None:
            direct_slopes = (system.direct[1:] - first.direct) / h
            derivatives += first.u.swapaxes(-1, -2)[:, None] @ np.moveaxis(direct_slopes, 0, -1)
            for k, du in input_slopes.items():
                derivatives[..., k] += system.direct[k + 1] @ du
        return derivatives

    def _discretise(self, family: Family, values: Mapping[str, Array], starts: Array | None) -> Sampled:
        """Equations from sample to sample of K bicycles with parameter ``values``, and the inputs that drive them.

        Torques of the ride as the last ``starts`` have them; none without starts.
        """
        speeds = np.array([run.speed for run in self.runs])
        if self._coasts(values):
            driven, speed_change = self._equations_while_slowing(family, values, speeds)
        else:
            driven, speed_change = self._equations(family, values, family.system(values, speeds)), None
        step, before, after = discretise(driven.state, driven.inputs, self._steps)
        if self.held:  # a recorded torque stays as it is until the next sample
            recorded = len(self.runs[0].inputs)
            before[..., :recorded] += after[..., :recorded]
            after[..., :recorded] = 0.0
        return Sampled(step, before, after, driven.output, driven.direct, self._signals(values, starts), speed_change)

    def _coasts(self, values: Mapping[str, Array]) -> bool:
        """True if ``values`` have a deceleration and a run is longer than 1 s; in less, the speed hardly falls."""
        return mistakes.SLOWS in values and max(float(run.time[-1] - run.time[0]) for run in self.runs) > 1.0

    def _equations_while_slowing(
        self, family: Family, values: Mapping[str, Array], speeds: Array
    ) -> tuple[Driven, SpeedChange]:
        """Equations at the speed in the middle of each run, and their change about it, of second order in the speed.

        ``speeds`` (R,), m/s, as recorded: they are those after the share ``REFERENCE`` of the run.
        """
        durations = np.array([run.time[-1] - run.time[0] for run in self.runs])
        deceleration = values[mistakes.SLOWS]  # (K, 1), m/s^2
        half_range = np.maximum(np.abs(deceleration) * durations / 2, 0.05)  # m/s
        middle = values.get(SPEED_OFFSET, 0.0) - deceleration * (0.5 - values[mistakes.REFERENCE]) * durations
        middle = np.maximum(middle, 2 * half_range + 0.2 - speeds)  # no run ends at rest

        # A parabola through the matrices at the slowest, middle and fastest speed of each run.
        equations, matrices = [], []
        for deviation in (-half_range, 0.0, half_range):
            shifted = {**values, SPEED_OFFSET: middle + deviation}
            driven = self._equations(family, shifted, family.system(shifted, speeds))
            equations.append(driven)
            matrices.append((*discretise(driven.state, driven.inputs, self._steps), driven.output))
        h, orders = half_range[..., None, None], []
        for slow, base, fast in zip(*matrices, strict=True):
            orders.append(((fast - slow) / (2 * h), (fast + slow - 2 * base) / (2 * h**2)))
        since_middle = self._steps[:, None] * np.arange(self.length) - durations[:, None] / 2  # (R, T), s
        return equations[1], SpeedChange(-deceleration[..., None] * since_middle, *orders)

    @staticmethod
    def _march_while_slowing(system: Sampled, x: Array) -> Array:
        """States (K, R, n, columns, T) from starts ``x`` (K, R, n, columns), sample by sample as the speed falls.

        The inputs act if there is one column; several are free responses.
        """
        change = system.speed_change
        assert change is not None
        deviation = change.deviation[..., None, None]  # (K, R, T, 1, 1)

        # m + d m_1 + d^2 m_2, times v, is one product: of the three side by side and of v, d v, d^2 v in a column.
        step = np.concatenate([system.step, *change.step], -1)
        before = np.concatenate([system.before, *change.before], -1)
        after = np.concatenate([system.after, *change.after], -1)

        def stack_powers(v: Array, k: int) -> Array:
            """``v`` (K, R, rows, columns) at sample ``k``, below it d v, and d^2 v."""
            d = deviation[:, :, k]
            return np.concatenate([v, d * v, d**2 * v], -2)

        u = np.broadcast_to(system.u, (len(deviation), *system.u.shape[1:]))[..., None, :]
        driven = bool(u.size) and x.shape[-1] == 1
        states = [x]
        for k in range(deviation.shape[2] - 1):
            x = step @ stack_powers(x, k)
            if driven:
                x = x + before @ stack_powers(u[..., k], k) + after @ stack_powers(u[..., k + 1], k)
            states.append(x)
        return np.stack(states, -1)

    @cached_property
    def _steps(self) -> Array:
        """Time between samples (R,) of each run, s."""
        return np.array([run.step for run in self.runs])

    def _states(self, system: Sampled, starts: Array) -> Array:
        """States (K, R, n, T) under the inputs from ``starts`` (R, n + others); (R, n, T) of a first bicycle."""
        start = starts[:, : system.step.shape[-1]]
        if system.speed_change is not None:
            start_of_each = np.broadcast_to(start, (len(system.step), *start.shape))
            return np.asarray(self._march_while_slowing(system, start_of_each[..., None])[..., 0, :])
        return march(system.step, system.before @ system.u[..., :-1] + system.after @ system.u[..., 1:], start)

    @staticmethod
    def _outputs(system: Sampled, x: Array) -> Array:
        """Channels (K, R, C, T), in their units and before their sensors, of states ``x`` (K, R, n, T)."""
        y = system.output @ x
        change = system.speed_change
        if change is not None:
            d = change.deviation[:, :, None]
            y = y + d * (change.output[0] @ x) + d**2 * (change.output[1] @ x)
        return y if system.direct is None else y + system.direct @ system.u

    def _equations(self, family: Family, values: Mapping[str, Array], system: DescriptorStack) -> Driven:
        """Equations dx/dt = state x + inputs u of a ``system``, u: the recorded torques, friction, torques of the ride.

        Friction and torques of the ride (one column for each of PUSHES) only where ``values`` have them.
        """
        names = family.symbolic
        columns = [names.inputs.index(INPUTS[u]) for u in self.runs[0].inputs]
        if mistakes.FRICTION in values:
            columns.append(names.inputs.index("steer_torque"))
        if acting_torques(values):
            columns += [names.inputs.index(name) for name in PUSHES]
        n = system.mass.shape[-1]
        solved = np.linalg.solve(system.mass, np.concatenate([system.dynamics, system.input[..., columns]], -1))
        outputs = self._turn_gyro_axes(system.output, names.outputs, values)
        output_rows = outputs[..., [names.outputs.index(CHANNELS[c]) for c in self.channels], :]
        return Driven(solved[..., :n], solved[..., n:], output_rows, None)

    @staticmethod
    def _turn_gyro_axes(outputs: Array, names: Sequence[str], values: Mapping[str, Array]) -> Array:
        """Copy of ``outputs`` (K, R, outputs, n) with the rows of the gyros about the axes of their turned box."""
        if mistakes.ROTATION[1] not in values:
            return outputs
        turned = outputs.copy()
        places = [names.index(CHANNELS[name]) for name in mistakes.BOX]
        for place, shares in zip(places, mistakes.turn_axes(values), strict=True):
            turned[..., place, :] = sum(a[..., None] * outputs[..., p, :] for a, p in zip(shares, places, strict=True))
        return turned

    def _torque_basis(self, name: str) -> Array:
        """Basis (R, T, k), N m (gusts: N), of the courses of a torque of the ride, for weights of sd 1; padded by 0."""
        return self._recent_bases.get(name, lambda: self._compute_torque_basis(name))

    @cached_property
    def _recent_bases(self) -> RecentAnswers[Array]:
        """Memory of the bases by name of their torque, which many models share."""
        return RecentAnswers(most=len(WORDS))

    def _compute_torque_basis(self, name: str) -> Array:
        """Compute the basis (R, T, k), N m (gusts: N), that :meth:`_torque_basis` remembers; of size 1 if unknown."""
        size = self.torque_sizes().get(name, TorqueSize(1.0))
        cadences = size.hertz or [None] * len(self.runs)
        bases = [size.sd * basis_courses(name, run.time, f) for run, f in zip(self.runs, cadences, strict=True)]
        most = max(basis.shape[1] for basis in bases)
        return np.array([np.pad(b, ((0, self.length - len(b)), (0, most - b.shape[1]))) for b in bases])

    def _signals(self, values: Mapping[str, Array], starts: Array | None) -> Array:
        """Inputs (K, R, m, T), N m or N: as recorded, with gain and delay; friction; torques of the ride by ``starts``.

        The axis K has length 1 if all bicycles have the same inputs.
        """
        names = list(self.runs[0].inputs)
        bicycles = len(next(iter(values.values())))
        gains, delays, friction = np.zeros((bicycles, len(names))), np.zeros((bicycles, len(names))), np.zeros(bicycles)
        for m, name in enumerate(names):
            for errors, key in ((gains, mistakes.GAIN), (delays, mistakes.DELAY)):
                if key.format(name) in values:
                    errors[:, m] = values[key.format(name)][:, 0]
        if mistakes.FRICTION in values:
            friction[:] = values[mistakes.FRICTION][:, 0]
        if all((errors == errors[0]).all() for errors in (gains, delays, friction)):
            gains, delays, friction = gains[:1], delays[:1], friction[:1]

        # Recorded inputs with their errors.
        riding = acting_torques(values)
        first_push = len(names) + (mistakes.FRICTION in values)
        count = first_push + len(PUSHES) if riding else first_push
        signals = np.zeros((len(gains), len(self.runs), count, self.length))
        signals[:, :, : len(names)] = (1 + gains[:, None, :, None]) * self._recorded_inputs
        for k, m in zip(*np.nonzero(delays), strict=True):
            for r, run in enumerate(self.runs):
                delayed = np.interp(run.time - delays[k, m], run.time, run.inputs[names[m]])
                signals[k, r, m, : len(delayed)] = (1 + gains[k, m]) * delayed

        # Dry friction acts against the steer rate.
        if mistakes.FRICTION in values:
            signals[:, :, len(names)] = -friction[:, None, None] * self._steer_rate_signs

        # The last starts are the weights of the torques of the ride, in their order, each with two courses.
        if starts is None:
            return signals
        for name in reversed(riding):
            basis = self._torque_basis(name)
            size = 2 * basis.shape[-1]
            starts, weights = starts[:, :-size], starts[:, -size:].reshape(len(self.runs), 2, -1)
            signals[:, :, first_push:] += np.einsum("rtk,rik,ij->rjt", basis, weights, SHARES[name])
        return signals

    def pad_runs(self, signals: Iterable[Sequence[Array]]) -> Array:
        """Array (R, signals, T) of the ``signals`` of each run, each (samples,), zero behind the end of a run."""
        rows = [list(run_signals) for run_signals in signals]
        array = np.zeros((len(rows), len(rows[0]), self.length))
        for run_signals, run_rows in zip(array, rows, strict=True):
            for padded, x in zip(run_signals, run_rows, strict=True):
                padded[: len(x)] = x
        return array

    @cached_property
    def _recorded_inputs(self) -> Array:
        """Inputs as they were recorded (R, inputs, T), N m or N, zero behind the end of a run."""
        return self.pad_runs(list(run.inputs.values()) for run in self.runs)

    @cached_property
    def _cos_lean(self) -> Array:
        """Cosine (T, R) of the lean angle: integral of the roll rate p, its bias and start by the balance of torques.

        Of a mass 1 m above the ground, g lean = v yaw rate + dp/dt 1 m; the yaw gyro's own errors change little of it.
        """

        def lean(run: Run) -> Array:
            """Lean angle (samples,) of a ``run``, rad."""
            rate = run.channels[mistakes.BOX[0]]
            integral = np.cumsum(rate) * run.step
            balance = (run.speed * run.channels[mistakes.BOX[1]] + np.gradient(rate, run.step)) / 9.81
            return integral + np.polyval(np.polyfit(run.time, balance - integral, 1), run.time)

        return np.cos(self.pad_runs([lean(run)] for run in self.runs)[:, 0].T)

    @cached_property
    def _steer_rate_signs(self) -> Array:
        """Expected sign (R, T) of the steer rate, -1 to 1, about 0 where noise hides it."""
        return self.pad_runs([mistakes.direction(run)] for run in self.runs)[:, 0]

    def _input_responses(self, system: Sampled, values: Mapping[str, Array]) -> Array:
        """Responses (1, R, C, T, columns) of the channels to each weight of each torque of the ride, at its sd.

        Of the first bicycle, without errors of sensors; columns in the order of :meth:`_signals`.
        """
        first = system.first_bicycle
        responses = [np.zeros((*first.output.shape[:-1], self.length, 0))]
        pushes = slice(-len(PUSHES), None)  # the last inputs
        for name in acting_torques(values):
            basis = self._torque_basis(name)
            k = basis.shape[-1]
            signals = np.concatenate([basis[:, :-1], basis[:, 1:]], -1)  # (R, T - 1, 2 k), sample before and itself

            # Column (course i, weight j) is driven by basis course j, through what course i pushes.
            into_states = np.stack([first.before[..., pushes], first.after[..., pushes]]) @ SHARES[name].T
            across = np.einsum("srni,jk->rskijn", into_states, np.eye(k)).reshape(len(basis), 2 * k, 2 * k, -1)
            responses.append(from_rest(first.step, signals, across, first.output))
        return np.concatenate(responses, -1)[None]

    def _filter_starts(self, values: Mapping[str, Array]) -> Array:
        """Effect (K, R, C, filters, T) of 1 prior sd of the unknown start of each low-pass on the channels.

        The prior sd of a start is the root mean square of the channel in the run.
        """
        filtered = [c for c, name in enumerate(self.channels) if mistakes.LOWPASS.format(name) in values]
        bicycles = len(next(iter(values.values())))
        effects = np.zeros((bicycles, len(self.runs), len(self.channels), len(filtered), self.length))
        for f, c in enumerate(filtered):
            name = self.channels[c]
            rms = np.array([np.sqrt(np.mean(run.channels[name] ** 2)) for run in self.runs])
            transient = lowpass_transient(self.length, values[mistakes.LOWPASS.format(name)][:, 0], self._steps)
            effects[:, :, c, f] = np.moveaxis(rms * transient, 0, -1)
        return effects

    def _apply_sensors(self, y: Array, values: Mapping[str, Array], starts: Array | None) -> Array:
        """Channels ``y`` (K, R, C, T, ...) as sensors show them, in place: lean, low-pass, delay and gain of each.

        The first ``starts`` (R, others) are those of the low-passes and act on the first of the last axis.
        """
        for c, name in enumerate(self.channels):
            channel = np.moveaxis(y[:, :, c], 2, 0)  # (T, K, R, ...), a view
            further = (1,) * (channel.ndim - 3)
            if mistakes.LEANS in values and name == mistakes.BOX[1]:
                channel *= self._cos_lean.reshape(self.length, 1, -1, *further)
            if mistakes.LOWPASS.format(name) in values:
                channel[:] = apply_lowpass(channel, values[mistakes.LOWPASS.format(name)][:, 0], self._steps)
            delay = self._delay_in_samples(name, values)
            if delay is not None:  # a Taylor series, of second order in time
                delay = np.moveaxis(np.broadcast_to(delay, (*delay.shape[:-1], len(channel))), -1, 0)
                delay = delay.reshape(*delay.shape, *further)
                slope = np.gradient(channel, axis=0)
                channel += -delay * slope + delay**2 / 2 * np.gradient(slope, axis=0)
            if mistakes.GAIN.format(name) in values:
                channel *= 1 + values[mistakes.GAIN.format(name)][:, :, None]
        if starts is not None:
            effects = self._filter_starts(values)
            y[..., 0] += np.einsum("krcft,rf->krct", effects, starts[:, : effects.shape[3]])
        return y

    def _delay_in_samples(self, name: str, values: Mapping[str, Array]) -> Array | None:
        """Delay (K, R, T or 1), in samples, of a channel by its sensor and by the clock of its box; None if on time."""
        delay = values.get(mistakes.DELAY.format(name))
        by_clock = mistakes.OFFSET in values and name in mistakes.BOX
        if delay is None and not by_clock:
            return None
        samples = np.zeros((1, 1, 1)) if delay is None else delay[:, :1, None] / self._steps[:, None]
        if by_clock:
            drift = values[mistakes.SKEW][:, :1, None] * np.arange(self.length)
            samples = samples + values[mistakes.OFFSET][:, :1, None] / self._steps[:, None] + drift
        return samples
