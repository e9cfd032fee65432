"""Replay of recorded runs: the torques through the model, from given starts or with the free responses."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from bicycle.descriptor import DescriptorStack
from bicycle.identification.recording import AS_HELD, CHANNELS, INPUTS, Run
from bicycle.responses import discretised, from_rest, marched, powers_of
from studies.diagnosis.family import Family
from studies.diagnosis.mistakes import DELAY, FRICTION, GAIN, LOWPASS, direction
from tyre.arrays import Array


def lowpassed(signal: Array, tau: Array, steps: Array) -> Array:
    """First-order low-passes tau dy/dt + y = u, exact for signals (T, K, R, ...) that are linear between samples."""
    found = signal.copy()
    ratio = np.round(np.abs(tau)[:, None] / steps, 12)  # (K, R), equal ones together
    for size in np.unique(ratio[ratio > 0]):
        k, r = np.nonzero(ratio == size)
        u = signal[:, k, r]
        keep = np.exp(-1 / size)
        late = size * (1 - keep)  # of the sample before, less what is kept of the output
        first = u[0] - size * (u[1] - u[0])
        state = first - (1 - late) * u[0]
        found[:, k, r] = lfilter([1 - late, late - keep], [1.0, -keep], u, axis=0, zi=state[None])[0]
    negative = tau < 0
    found[:, negative] = 2 * signal[:, negative] - found[:, negative]
    return found


def begun(length: int, tau: Array, steps: Array) -> Array:
    """Decay of another state of the filter at the first sample (T, K, R): exp(-t/tau), of size tau / (tau + h)."""
    ratio = np.abs(tau)[:, None] / steps
    with np.errstate(divide="ignore", invalid="ignore"):
        decay = np.exp(-np.arange(length)[:, None, None] / ratio)
    return np.asarray(np.sign(tau)[:, None] * ratio / (1 + ratio) * np.nan_to_num(decay))


SENSED = (LOWPASS, DELAY, GAIN)


class Driven(NamedTuple):
    """Equations of K bicycles and R runs: dx/dt = state x + inputs u, and the channels, seen x + direct u."""

    state: Array
    inputs: Array
    seen: Array
    direct: Array | None  # None if the inputs are not seen


class Sampled(NamedTuple):
    """Equations from sample to sample: x_(k+1) = step x_k + before u_k + after u_(k+1), with u (K or 1, R, m, T)."""

    step: Array
    before: Array
    after: Array
    seen: Array
    direct: Array | None
    u: Array

    @property
    def first(self) -> tuple[Array, Array, Array, Array, Array | None, Array]:
        """Arrays of the first bicycle, without the axis of bicycles."""
        direct = None if self.direct is None else self.direct[0]
        return self.step[0], self.before[0], self.after[0], self.seen[0], direct, self.u[0]


@dataclass(frozen=True)
class Replay:
    """Runs of one set of torques, replayed at once."""

    runs: tuple[Run, ...]
    channels: tuple[str, ...]

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
        system = self._sampled(family, values, starts)
        with np.errstate(over="ignore", invalid="ignore"):
            y = self._seen(system, self._states(system, starts))
            return self._sensed(y[..., None], values, starts[:, system.step.shape[-1] :])[..., 0]

    def free(self, family: Family, theta: Array) -> tuple[Array, Array]:
        """Channels (R, C, T) of runs that begin at rest, and those of each unit start alone (R, C, T, columns)."""
        values = family.values(theta[None])
        system = self._sampled(family, values, None)
        n = system.step.shape[-1]
        with np.errstate(over="ignore", invalid="ignore"):
            forced = self._seen(system, self._states(system, np.zeros((len(self.runs), n))))
            powers = powers_of(system.step[0], self.length)
            shown = (system.seen[0] @ powers.reshape(*powers.shape[:2], -1)).reshape(*forced.shape[1:], n)
            y = np.concatenate([forced[..., None], shown[None], self._uncertain(system, values)], -1)
            y = self._sensed(y, values, None)[0]
        behind = np.moveaxis(self._filter_starts(values)[0], -2, -1)
        return y[..., 0], np.concatenate([y[..., 1 : 1 + n], behind, y[..., 1 + n :]], -1)

    def slopes(self, family: Family, theta: Array, steps: Array, starts: Array) -> Array:
        """Derivatives of the channels (R, C, T, p), by the differential equations' own derivative.

        d(x)' = A dx + dA x + ...: all coordinates share the system matrix of a run and are marched at once. The
        derivatives of the matrices are differences of ``steps`` (p,).
        """
        values = family.values(np.vstack([theta, theta + np.diag(steps)]))
        system = self._sampled(family, values, starts)
        with np.errstate(over="ignore", invalid="ignore"):
            x = self._states(system, starts, only=1)[0]
            found = self._moved(system, x, steps)
            if not any(kind.format(name) in values for kind in SENSED for name in self.channels):
                return found
            _, _, _, seen, direct, u = system.first
            y, per = np.empty((1 + len(steps), *found.shape[:-1])), steps[:, None, None, None]
            y[0] = seen @ x if direct is None else seen @ x + direct @ u
            y[1:] = y[0] + per * np.moveaxis(found, -1, 0)
            y = self._sensed(y[..., None], values, starts[:, x.shape[1] :])[..., 0]
            return np.moveaxis((y[1:] - y[0]) / per, 0, -1)

    def _moved(self, system: Sampled, x: Array, steps: Array) -> Array:
        """Derivatives (R, C, T, p) before the sensors about the states ``x`` (R, n, T) of the first bicycle."""
        step, _, _, seen, direct, u = system.first
        per = steps[:, None, None, None]
        change = np.concatenate([(m[1:] - m[0]) / per for m in (system.step, system.before, system.after)], -1)
        across, known = [np.moveaxis(change, (0, 1, 3), (2, 0, 1))], [x[..., :-1], u[..., :-1], u[..., 1:]]
        pushes = {k: (system.u[k + 1] - u) / h for k, h in enumerate(steps) if len(system.u) > 1}
        pushes = {k: du for k, du in pushes.items() if du.any()}
        for k, du in pushes.items():  # inputs that the coordinate changes push the states themselves
            known.append(system.before[k + 1] @ du[..., :-1] + system.after[k + 1] @ du[..., 1:])
            own = np.zeros((*step.shape[:-1], len(steps), step.shape[-1]))
            own[:, :, k] = np.eye(step.shape[-1])
            across.append(own)
        found = from_rest(step, np.concatenate(known, 1).swapaxes(-1, -2), np.concatenate(across, 1), seen)
        looked = (system.seen[1:] - seen) / per
        if looked.any():
            found += x.swapaxes(-1, -2)[:, None] @ np.moveaxis(looked, 0, -1)
        if direct is not None and system.direct is not None:
            found += u.swapaxes(-1, -2)[:, None] @ np.moveaxis((system.direct[1:] - direct) / per, 0, -1)
            for k, du in pushes.items():
                found[..., k] += system.direct[k + 1] @ du
        return found

    def _sampled(self, family: Family, values: Mapping[str, Array], starts: Array | None) -> Sampled:
        """The bicycles from sample to sample and what drives them, uncertain inputs as the ``starts`` have them."""
        speeds = np.array([run.speed for run in self.runs])
        driven = self._driven(family, values, family.system(values, speeds))
        step, before, after = discretised(driven.state, driven.inputs, self._steps)
        if self.held:
            recorded = len(self.runs[0].inputs)
            before[..., :recorded] += after[..., :recorded]
            after[..., :recorded] = 0.0
        return Sampled(step, before, after, driven.seen, driven.direct, self._signals(values, starts))

    @cached_property
    def _steps(self) -> Array:
        return np.array([run.step for run in self.runs])

    def _states(self, system: Sampled, starts: Array, only: int | None = None) -> Array:
        """States (K, R, n, T) of the bicycles, or of the first of them ``only``."""
        step, before, after, u = (part[:only] for part in (system.step, system.before, system.after, system.u))
        return marched(step, before @ u[..., :-1] + after @ u[..., 1:], starts[:, : step.shape[-1]])

    @staticmethod
    def _seen(system: Sampled, x: Array) -> Array:
        """Channels (K, R, C, T) before their sensors."""
        y = system.seen @ x
        return y if system.direct is None else y + system.direct @ system.u

    def _driven(self, family: Family, values: Mapping[str, Array], system: DescriptorStack) -> Driven:
        """The bicycles as the torques drive them."""
        names = family.symbolic
        columns = [names.inputs.index(INPUTS[u]) for u in self.runs[0].inputs]
        if FRICTION in values:
            columns.append(names.inputs.index("steer_torque"))
        n = system.mass.shape[-1]
        solved = np.linalg.solve(system.mass, np.concatenate([system.dynamics, system.input[..., columns]], -1))
        seen = system.output[..., [names.outputs.index(CHANNELS[c]) for c in self.channels], :]
        return Driven(solved[..., :n], solved[..., n:], seen, None)

    def _signals(self, values: Mapping[str, Array], starts: Array | None) -> Array:
        """Inputs of each run (K, R, m, T), or (1, R, m, T) if all bicycles have the same."""
        names = list(self.runs[0].inputs)
        k = len(next(iter(values.values())))
        settings = np.zeros((k, 2 * len(names) + 1))
        keys = [*(key.format(name) for name in names for key in (GAIN, DELAY)), FRICTION]
        for column, key in enumerate(keys):
            if key in values:
                settings[:, column] = values[key][:, 0]
        if (settings == settings[0]).all():
            settings = settings[:1]
        found = np.empty((len(settings), len(self.runs), len(names) + (FRICTION in values), self.length))
        found[:, :, : len(names)] = (1 + settings[:, None, :-1:2, None]) * self._recorded
        for i, m in zip(*np.nonzero(settings[:, 1::2]), strict=True):
            delay = settings[i, 2 * m + 1]
            for r, run in enumerate(self.runs):
                shifted = np.interp(run.time - delay, run.time, run.inputs[names[m]])
                found[i, r, m, : len(shifted)] = (1 + settings[i, 2 * m]) * shifted
        if FRICTION in values:
            found[:, :, -1] = -settings[:, -1, None, None] * self._directions
        return found

    def padded(self, signals: Iterable[Sequence[Array]]) -> Array:
        """``signals`` of each run as one array (R, signals, T), zero behind the end of a run."""
        found = [[np.pad(x, (0, self.length - len(x))) for x in own] for own in signals]
        return np.array(found).reshape(len(self.runs), -1, self.length)

    @cached_property
    def _recorded(self) -> Array:
        """Inputs as they were recorded (R, inputs, T)."""
        return self.padded(list(run.inputs.values()) for run in self.runs)

    @cached_property
    def _directions(self) -> Array:
        """Expected sign of the steer rate (R, T)."""
        return self.padded([direction(run)] for run in self.runs)[:, 0]

    def _uncertain(self, system: Sampled, values: Mapping[str, Array]) -> Array:
        """Responses to uncertain parts of the inputs (K, R, C, T, columns): recorded torques are exact."""
        return np.zeros((*system.seen.shape[:-1], self.length, 0))

    def _filter_starts(self, values: Mapping[str, Array]) -> Array:
        """Effect of the unknown state of each low-pass on the channels (K, R, C, filters, T)."""
        filtered = [c for c, name in enumerate(self.channels) if LOWPASS.format(name) in values]
        k = len(next(iter(values.values())))
        found = np.zeros((k, len(self.runs), len(self.channels), len(filtered), self.length))
        for f, c in enumerate(filtered):
            name = self.channels[c]
            size = np.array([np.sqrt(np.mean(run.channels[name] ** 2)) for run in self.runs])
            dying = begun(self.length, values[LOWPASS.format(name)][:, 0], self._steps)
            found[:, :, c, f] = np.moveaxis(size * dying, 0, -1)
        return found

    def _sensed(self, y: Array, values: Mapping[str, Array], starts: Array | None) -> Array:
        """Low-pass, delay (to second order in time) and gain of each channel, outputs (K, R, C, T, ...)."""
        for c, name in enumerate(self.channels):
            one = np.moveaxis(y[:, :, c], 2, 0)  # (T, K, R, ...)
            if LOWPASS.format(name) in values:
                one[:] = lowpassed(one, values[LOWPASS.format(name)][:, 0], self._steps)
            if DELAY.format(name) in values:
                tau = (values[DELAY.format(name)][:, :1] / self._steps)[..., None]  # (K, R, 1), in samples
                first = np.gradient(one, axis=0)
                one += -tau * first + tau**2 / 2 * np.gradient(first, axis=0)
            if GAIN.format(name) in values:
                one *= 1 + values[GAIN.format(name)][:, :, None]
        if starts is not None:
            behind = self._filter_starts(values)
            y[..., 0] += np.einsum("krcft,rf->krct", behind, starts[:, : behind.shape[3]])
        return y
