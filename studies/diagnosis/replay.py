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
    """First-order low-passes tau dy/dt + y = u, exact for signals (T, K, R, ...) that are linear between samples."""
    filtered = signal.copy()
    ratio = np.round(np.abs(tau)[:, None] / steps, 12)  # (K, R), equal ones together
    for size in np.unique(ratio[ratio > 0]):
        k, r = np.nonzero(ratio == size)
        u = signal[:, k, r]
        keep = np.exp(-1 / size)
        late = size * (1 - keep)  # of the sample before, less what is kept of the output
        first = u[0] - size * (u[1] - u[0])
        state = first - (1 - late) * u[0]
        filtered[:, k, r] = scipy.signal.lfilter([1 - late, late - keep], [1.0, -keep], u, axis=0, zi=state[None])[0]
    negative = tau < 0
    filtered[:, negative] = 2 * signal[:, negative] - filtered[:, negative]
    return filtered


def lowpass_transient(length: int, tau: Array, steps: Array) -> Array:
    """Decay of another state of the filter at the first sample (T, K, R): exp(-t/tau), of size tau / (tau + h)."""
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


class Along(NamedTuple):
    """Change of the equations with the speed along a run: step + d step_1 + d^2 step_2, and the others alike."""

    change: Array  # d (K, R, T), m/s
    step: tuple[Array, Array]  # (K, R, n, n)
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
    u: Array  # (K or 1, R, m, T)
    speed_change: Along | None = None  # change with the speed; None if the speed is constant

    @property
    def first(self) -> tuple[Array, Array, Array, Array, Array | None, Array]:
        """Arrays of the first bicycle, without the axis of bicycles."""
        direct = None if self.direct is None else self.direct[0]
        return self.step[0], self.before[0], self.after[0], self.output[0], direct, self.u[0]


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
        """Channels (K, R, C, T) at ``theta`` (K, p) from ``starts`` (R, n + filters + uncertain)."""
        values = family.values(theta)
        system = self._discretise(family, values, starts)
        with np.errstate(over="ignore", invalid="ignore"):
            y = self._outputs(system, self._states(system, starts))
            return self._apply_sensors(y[..., None], values, starts[:, system.step.shape[-1] :])[..., 0]

    def free(self, family: Family, theta: Array) -> tuple[Array, Array]:
        """Channels (R, C, T) of runs that begin at rest, and those of each unit start alone (R, C, T, columns)."""
        values = family.values(theta[None])
        system = self._discretise(family, values, None)
        n = system.step.shape[-1]
        with np.errstate(over="ignore", invalid="ignore"):
            forced = self._outputs(system, self._states(system, np.zeros((len(self.runs), n))))
            if system.speed_change is None:
                powers = powers_of(system.step[0], self.length)
                responses = (system.output[0] @ powers.reshape(*powers.shape[:2], -1)).reshape(*forced.shape[1:], n)
            else:  # each start is a bicycle of its own
                marched = self._march_while_slowing(system, np.broadcast_to(np.eye(n), system.step.shape))[0]
                responses = np.moveaxis(self._outputs(system._replace(direct=None), np.moveaxis(marched, 2, 0)), 0, -1)
            y = np.concatenate([forced[..., None], responses[None], self._input_responses(system, values)], -1)
            y = self._apply_sensors(y, values, None)[0]
        behind = np.moveaxis(self._filter_starts(values)[0], -2, -1)
        return y[..., 0], np.concatenate([y[..., 1 : 1 + n], behind, y[..., 1 + n :]], -1)

    def slopes(self, family: Family, theta: Array, steps: Array, starts: Array) -> Array:
        """Derivatives of the channels (R, C, T, p), by the differential equations' own derivative.

        d(x)' = A dx + dA x + ...: all coordinates share the system matrix of a run and are marched at once. The
        derivatives of the matrices are differences of ``steps`` (p,).
        """
        batch = np.vstack([theta, theta + np.diag(steps)])
        values = family.values(batch)
        if self._coasts(values):
            outputs = self(family, batch, starts)
            return np.moveaxis((outputs[1:] - outputs[0]) / steps[:, None, None, None], 0, -1)
        system = self._discretise(family, values, starts)
        with np.errstate(over="ignore", invalid="ignore"):
            x = self._states(system, starts, only=1)[0]
            derivatives = self._state_derivatives(system, x, steps)
            if not {mistakes.OFFSET, mistakes.LEANS} & {*values} and not any(
                kind.format(name) in values for kind in SENSED for name in self.channels
            ):
                return derivatives
            _, _, _, output_rows, direct, u = system.first
            y, per = np.empty((1 + len(steps), *derivatives.shape[:-1])), steps[:, None, None, None]
            y[0] = output_rows @ x if direct is None else output_rows @ x + direct @ u
            y[1:] = y[0] + per * np.moveaxis(derivatives, -1, 0)
            y = self._apply_sensors(y[..., None], values, starts[:, x.shape[1] :])[..., 0]
            return np.moveaxis((y[1:] - y[0]) / per, 0, -1)

    def _state_derivatives(self, system: Sampled, x: Array, steps: Array) -> Array:
        """Derivatives (R, C, T, p) before the sensors about the states ``x`` (R, n, T) of the first bicycle."""
        step, _, _, output_rows, direct, u = system.first
        per = steps[:, None, None, None]
        change = np.concatenate([(m[1:] - m[0]) / per for m in (system.step, system.before, system.after)], -1)
        across, drivers = [np.moveaxis(change, (0, 1, 3), (2, 0, 1))], [x[..., :-1], u[..., :-1], u[..., 1:]]
        pushes = {k: (system.u[k + 1] - u) / h for k, h in enumerate(steps) if len(system.u) > 1}
        pushes = {k: du for k, du in pushes.items() if du.any()}
        for k, du in pushes.items():  # inputs that the coordinate changes push the states themselves
            drivers.append(system.before[k + 1] @ du[..., :-1] + system.after[k + 1] @ du[..., 1:])
            identity = np.zeros((*step.shape[:-1], len(steps), step.shape[-1]))
            identity[:, :, k] = np.eye(step.shape[-1])
            across.append(identity)
        derivatives = from_rest(
            step, np.concatenate(drivers, 1).swapaxes(-1, -2), np.concatenate(across, 1), output_rows
        )
        output_change = (system.output[1:] - output_rows) / per
        if output_change.any():
            derivatives += x.swapaxes(-1, -2)[:, None] @ np.moveaxis(output_change, 0, -1)
        if direct is not None and system.direct is not None:
            derivatives += u.swapaxes(-1, -2)[:, None] @ np.moveaxis((system.direct[1:] - direct) / per, 0, -1)
            for k, du in pushes.items():
                derivatives[..., k] += system.direct[k + 1] @ du
        return derivatives

    def _discretise(self, family: Family, values: Mapping[str, Array], starts: Array | None) -> Sampled:
        """The bicycles from sample to sample and what drives them, uncertain inputs as the ``starts`` have them."""
        speeds = np.array([run.speed for run in self.runs])
        if self._coasts(values):
            driven, along_run = self._equations_while_slowing(family, values, speeds)
        else:
            driven, along_run = self._equations(family, values, family.system(values, speeds)), None
        step, before, after = discretise(driven.state, driven.inputs, self._steps)
        if self.held:
            recorded = len(self.runs[0].inputs)
            before[..., :recorded] += after[..., :recorded]
            after[..., :recorded] = 0.0
        return Sampled(step, before, after, driven.output, driven.direct, self._signals(values, starts), along_run)

    def _coasts(self, values: Mapping[str, Array]) -> bool:
        """True if the speed falls along the runs; over less than a second it hardly does."""
        return mistakes.SLOWS in values and max(float(run.time[-1] - run.time[0]) for run in self.runs) > 1.0

    def _equations_while_slowing(
        self, family: Family, values: Mapping[str, Array], speeds: Array
    ) -> tuple[Driven, Along]:
        """Equations at the speed in the middle of each run, and their change about it, of second order in the speed."""
        lasts = np.array([run.time[-1] - run.time[0] for run in self.runs])
        slows, since = values[mistakes.SLOWS], self._steps[:, None] * np.arange(self.length)
        half_range = np.maximum(np.abs(slows) * lasts / 2, 0.05)  # m/s
        middle = values.get(SPEED_OFFSET, 0.0) - slows * (0.5 - values[mistakes.REFERENCE]) * lasts
        middle = np.maximum(middle, 2 * half_range + 0.2 - speeds)  # no run ends at rest
        sides = []
        for side in (-half_range, 0.0, half_range):
            shifted = {**values, SPEED_OFFSET: middle + side}
            driven = self._equations(family, shifted, family.system(shifted, speeds))
            sides.append((driven, (*discretise(driven.state, driven.inputs, self._steps), driven.output)))
        h, parts = half_range[..., None, None], []
        for slow, base, fast in zip(*(matrices for _, matrices in sides), strict=True):
            parts.append(((fast - slow) / (2 * h), (fast + slow - 2 * base) / (2 * h**2)))
        return sides[1][0], Along(-slows[..., None] * (since - lasts[:, None] / 2), *parts)

    @staticmethod
    def _march_while_slowing(system: Sampled, x: Array, only: int | None = None) -> Array:
        """States (K, R, n, columns, T) from starts ``x`` (K, R, n, columns) under the inputs, sample by sample."""
        changes, states = system.speed_change, [x]
        assert changes is not None
        parts = (changes.step, changes.before, changes.after)
        stacked = [
            np.concatenate([part[:only], *(order[:only] for order in change)], -1)
            for part, change in zip(system[:3], parts, strict=True)
        ]
        d = changes.change[:only]
        u = np.broadcast_to(system.u[:only], (len(d), *system.u.shape[1:]))

        def grown(vector: Array, k: int) -> Array:
            d_k = d[..., k, None, None]
            return np.concatenate([vector, d_k * vector, d_k**2 * vector], -2)

        driven = bool(u.size) and x.shape[-1] == 1
        for k in range(d.shape[-1] - 1):
            x = stacked[0] @ grown(x, k)
            if driven:
                x = x + stacked[1] @ grown(u[..., k, None], k) + stacked[2] @ grown(u[..., k + 1, None], k)
            states.append(x)
        return np.stack(states, -1)

    @cached_property
    def _steps(self) -> Array:
        return np.array([run.step for run in self.runs])

    def _states(self, system: Sampled, starts: Array, only: int | None = None) -> Array:
        """States (K, R, n, T) of the bicycles, or of the first of them ``only``."""
        step, before, after, u = (part[:only] for part in (system.step, system.before, system.after, system.u))
        start = starts[:, : step.shape[-1]]
        if system.speed_change is not None:
            wide = np.broadcast_to(start, (len(step), *start.shape))[..., None]
            return np.asarray(self._march_while_slowing(system, wide, only)[..., 0, :])
        return march(step, before @ u[..., :-1] + after @ u[..., 1:], start)

    @staticmethod
    def _outputs(system: Sampled, x: Array) -> Array:
        """Channels (K, R, C, T) before their sensors."""
        y = system.output @ x
        if system.speed_change is not None:
            d = system.speed_change.change[:, :, None]
            y = y + d * (system.speed_change.output[0] @ x) + d**2 * (system.speed_change.output[1] @ x)
        return y if system.direct is None else y + system.direct @ system.u

    def _equations(self, family: Family, values: Mapping[str, Array], system: DescriptorStack) -> Driven:
        """The bicycles as the torques drive them."""
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
        """Rows of the ``outputs`` (K, R, outputs, n) with those of the gyros about the axes of their turned box."""
        if mistakes.ROTATION[1] not in values:
            return outputs
        turned = outputs.copy()
        places = [names.index(CHANNELS[name]) for name in mistakes.BOX]
        for place, shares in zip(places, mistakes.turn_axes(values), strict=True):
            turned[..., place, :] = sum(a[..., None] * outputs[..., p, :] for a, p in zip(shares, places, strict=True))
        return turned

    def _torque_basis(self, name: str) -> Array:
        """Courses (R, T, k) of a torque of the ride by coefficients of sd 1, N m; of unit size where none is known."""
        return self._recent_bases.get(name, lambda: self._compute_torque_basis(name))

    @cached_property
    def _recent_bases(self) -> RecentAnswers[Array]:
        """Courses by name of their torque, which many models share."""
        return RecentAnswers(most=len(WORDS))

    def _compute_torque_basis(self, name: str) -> Array:
        """Compute what :meth:`_torque_basis` remembers: courses (R, T, k), N m, zero behind the end of a run."""
        course = self.torque_sizes().get(name, TorqueSize(1.0))
        hertz = course.hertz or [None] * len(self.runs)
        by_run = [course.sd * basis_courses(name, run.time, f) for run, f in zip(self.runs, hertz, strict=True)]
        most = max(x.shape[1] for x in by_run)
        return np.array([np.pad(x, ((0, self.length - len(x)), (0, most - x.shape[1]))) for x in by_run])

    def _signals(self, values: Mapping[str, Array], starts: Array | None) -> Array:
        """Inputs of each run (K, R, m, T), or (1, R, m, T) if all bicycles have the same."""
        names = list(self.runs[0].inputs)
        k = len(next(iter(values.values())))
        settings = np.zeros((k, 2 * len(names) + 1))
        keys = [*(key.format(name) for name in names for key in (mistakes.GAIN, mistakes.DELAY)), mistakes.FRICTION]
        for column, key in enumerate(keys):
            if key in values:
                settings[:, column] = values[key][:, 0]
        if (settings == settings[0]).all():
            settings = settings[:1]
        riding = acting_torques(values)
        last = len(names) + (mistakes.FRICTION in values)
        with_pushes = last + len(PUSHES) if riding else last
        signals = np.zeros((len(settings), len(self.runs), with_pushes, self.length))
        signals[:, :, : len(names)] = (1 + settings[:, None, :-1:2, None]) * self._recorded
        for i, m in zip(*np.nonzero(settings[:, 1::2]), strict=True):
            delay = settings[i, 2 * m + 1]
            for r, run in enumerate(self.runs):
                shifted = np.interp(run.time - delay, run.time, run.inputs[names[m]])
                signals[i, r, m, : len(shifted)] = (1 + settings[i, 2 * m]) * shifted
        if mistakes.FRICTION in values:
            signals[:, :, last - 1] = -settings[:, -1, None, None] * self._directions
        coefficients = np.zeros((len(self.runs), 0)) if starts is None else starts  # of the courses the last
        for name in reversed(riding if starts is not None else []):
            courses = self._torque_basis(name)
            count = 2 * courses.shape[-1]
            coefficients, sizes = coefficients[:, :-count], coefficients[:, -count:].reshape(len(self.runs), 2, -1)
            signals[:, :, last:] += np.einsum("rtk,rik,ij->rjt", courses, sizes, SHARES[name])
        return signals

    def pad_runs(self, signals: Iterable[Sequence[Array]]) -> Array:
        """``signals`` of each run as one array (R, signals, T), zero behind the end of a run."""
        rows = [list(run_signals) for run_signals in signals]
        array = np.zeros((len(rows), len(rows[0]), self.length))
        for run_signals, run_rows in zip(array, rows, strict=True):
            for padded, x in zip(run_signals, run_rows, strict=True):
                padded[: len(x)] = x
        return array

    @cached_property
    def _recorded(self) -> Array:
        """Inputs as they were recorded (R, inputs, T)."""
        return self.pad_runs(list(run.inputs.values()) for run in self.runs)

    @cached_property
    def _leaning(self) -> Array:
        """cos(lean) of the runs (T, R) by their roll rate p, whose bias and start follow from the balance of torques.

        Of a mass 1 m above the ground, g lean = v yaw rate + dp/dt 1 m; the yaw gyro's own errors change little of it.
        """

        def lean(run: Run) -> Array:
            rate = run.channels[mistakes.BOX[0]]
            integral = np.cumsum(rate) * run.step
            balance = (run.speed * run.channels[mistakes.BOX[1]] + np.gradient(rate, run.step)) / 9.81
            return integral + np.polyval(np.polyfit(run.time, balance - integral, 1), run.time)

        return np.cos(self.pad_runs([lean(run)] for run in self.runs)[:, 0].T)

    @cached_property
    def _directions(self) -> Array:
        """Expected sign of the steer rate (R, T)."""
        return self.pad_runs([mistakes.direction(run)] for run in self.runs)[:, 0]

    def _input_responses(self, system: Sampled, values: Mapping[str, Array]) -> Array:
        """Responses to uncertain parts of the inputs (K, R, C, T, columns), of one bicycle: torques of the ride."""
        step, before, after, output_rows, _, _ = system.first
        columns = [np.zeros((*system.output.shape[1:-1], self.length, 0))]
        for name in acting_torques(values):
            courses = self._torque_basis(name)
            driving, k = np.concatenate([courses[:, :-1], courses[:, 1:]], -1), courses.shape[-1]
            pushes = slice(-len(PUSHES), None)
            into = np.stack([before[..., pushes], after[..., pushes]]) @ SHARES[name].T  # (2, R, n, 2)
            across = np.einsum("srni,jk->rskijn", into, np.eye(k)).reshape(len(step), 2 * k, 2 * k, -1)
            columns.append(from_rest(step, driving, across, output_rows))
        return np.concatenate(columns, -1)[None]

    def _filter_starts(self, values: Mapping[str, Array]) -> Array:
        """Effect of the unknown state of each low-pass on the channels (K, R, C, filters, T)."""
        filtered = [c for c, name in enumerate(self.channels) if mistakes.LOWPASS.format(name) in values]
        k = len(next(iter(values.values())))
        effects = np.zeros((k, len(self.runs), len(self.channels), len(filtered), self.length))
        for f, c in enumerate(filtered):
            name = self.channels[c]
            size = np.array([np.sqrt(np.mean(run.channels[name] ** 2)) for run in self.runs])
            dying = lowpass_transient(self.length, values[mistakes.LOWPASS.format(name)][:, 0], self._steps)
            effects[:, :, c, f] = np.moveaxis(size * dying, 0, -1)
        return effects

    def _apply_sensors(self, y: Array, values: Mapping[str, Array], starts: Array | None) -> Array:
        """Low-pass, delay (to second order in time) and gain of each channel, outputs (K, R, C, T, ...)."""
        for c, name in enumerate(self.channels):
            channel = np.moveaxis(y[:, :, c], 2, 0)  # (T, K, R, ...)
            if mistakes.LEANS in values and name == mistakes.BOX[1]:
                channel *= self._leaning.reshape(self.length, 1, -1, *(1,) * (channel.ndim - 3))
            if mistakes.LOWPASS.format(name) in values:
                channel[:] = apply_lowpass(channel, values[mistakes.LOWPASS.format(name)][:, 0], self._steps)
            late = values.get(mistakes.DELAY.format(name))
            if late is not None or (mistakes.OFFSET in values and name in mistakes.BOX):
                tau = np.zeros((1, 1, 1)) if late is None else late[:, :1, None] / self._steps[:, None]  # (K, R, T)
                if mistakes.OFFSET in values and name in mistakes.BOX:
                    since = values[mistakes.SKEW][:, :1, None] * np.arange(self.length)
                    tau = tau + values[mistakes.OFFSET][:, :1, None] / self._steps[:, None] + since
                tau = np.moveaxis(np.broadcast_to(tau, (*tau.shape[:-1], channel.shape[0])), -1, 0)
                tau = tau.reshape(*tau.shape, *(1,) * (channel.ndim - 3))
                first = np.gradient(channel, axis=0)
                channel += -tau * first + tau**2 / 2 * np.gradient(first, axis=0)
            if mistakes.GAIN.format(name) in values:
                channel *= 1 + values[mistakes.GAIN.format(name)][:, :, None]
        if starts is not None:
            behind = self._filter_starts(values)
            y[..., 0] += np.einsum("krcft,rf->krct", behind, starts[:, : behind.shape[3]])
        return y
