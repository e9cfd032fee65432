"""Replay of recorded runs: the torques through the model, from given starts or with the free responses."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bicycle.descriptor import DescriptorStack
from bicycle.identification.recording import CHANNELS, INPUTS, Run
from bicycle.responses.discretisation import discretised, marched, powers_of
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.friction import FRICTION, direction
from studies.missing_effect.motion.lowpass import begun, lowpassed
from studies.missing_effect.motion.sensor_errors import DELAY, GAIN, LOWPASS
from tyre.base.arrays import Array

HELD_SHARE = 0.5  # of samples that repeat the one before


class Driven(NamedTuple):
    """What is marched: dx/dt = state x + inputs u, and the channels, seen x + direct u; of K bicycles and R runs."""

    state: Array
    inputs: Array
    seen: Array
    direct: Array


@dataclass(frozen=True)
class Replay:
    """Runs of one set of torques, replayed at once.

    Attributes
    ----------
    runs : tuple of Run
        R runs of at most T samples.
    channels : tuple of str
        Columns that are computed.
    """

    runs: tuple[Run, ...]
    channels: tuple[str, ...]

    @cached_property
    def held(self) -> bool:
        """Whether the torques are piecewise constant (commanded); otherwise they are taken linear between samples."""
        steps = [np.diff(u) for run in self.runs for u in run.inputs.values()]
        return bool(steps) and float(np.mean(np.concatenate(steps) == 0)) > HELD_SHARE

    def __call__(self, family: Family, theta: Array, starts: Array | None) -> tuple[Array, list[Array]]:
        """Simulate every run.

        Parameters
        ----------
        family : Family
            The model with its p unknowns and n states.
        theta : ndarray, shape (K, p)
            Coordinates.
        starts : ndarray, shape (R, n + filters + uncertain), optional
            Initial states, then those of the low-pass of each channel that has one, in shares of the channel's size,
            then what is uncertain of the inputs; without them the runs begin at rest, and the free responses are given.

        Returns
        -------
        outputs : ndarray, shape (K, R, T, channels)
        free : list of ndarray, shape (T, channels, n + filters + uncertain)
            For each run, without ``starts`` only; of the first coordinates.
        """
        values = family.values(theta)
        speeds = np.array([run.speed for run in self.runs])
        steps = np.array([run.step for run in self.runs])
        length = max(len(run.time) for run in self.runs)
        driven = self._driven(family, values, family(theta, speeds))
        n = driven.state.shape[-1]
        ad, g0, g1 = discretised(driven.state, driven.inputs, steps)
        if self.held:
            recorded = len(self.runs[0].inputs)
            g0[..., :recorded] += g1[..., :recorded]
            g1[..., :recorded] = 0.0
        u = self._signals(values, len(theta), length, starts).swapaxes(-1, -2)  # (K, R, m, T)
        begin = np.zeros((len(self.runs), n)) if starts is None else starts[:, :n]
        with np.errstate(over="ignore", invalid="ignore"):
            x = marched(ad, g0 @ u[..., :-1] + g1 @ u[..., 1:], begin)
            y = (driven.seen @ x + driven.direct @ u)[..., None]  # (K, R, channels, T, 1)
            if starts is None:
                free = powers_of(ad, length)
                shown = (driven.seen @ free.reshape(*free.shape[:3], -1)).reshape(*y.shape[:-1], n)
                y = np.concatenate([y, shown, self._uncertain(driven, values, (ad, g0, g1), length)], -1)
            y = self._sensed(np.moveaxis(y, 3, 0), values, steps)
        behind = self._filter_starts(values, length, steps)
        if starts is not None:
            y[..., 0] += np.einsum("tkrcf,rf->tkrc", behind, starts[:, n : n + behind.shape[-1]])
        outputs = np.moveaxis(y[..., 0], 0, 2)
        every = (
            np.concatenate([y[:, 0, r, :, 1 : 1 + n], behind[:, 0, r], y[:, 0, r, :, 1 + n :]], -1)
            for r in range(len(self.runs))
        )
        return outputs, list(every) if starts is None else []

    def _driven(self, family: Family, values: Mapping[str, Array], system: DescriptorStack) -> Driven:
        """The bicycles as the torques drive them."""
        names = family.symbolic
        columns = [names.inputs.index(INPUTS[u]) for u in self.runs[0].inputs]
        if FRICTION in values:
            columns.append(names.inputs.index("steer_torque"))
        seen = system.output[..., [names.outputs.index(CHANNELS[c]) for c in self.channels], :]
        return Driven(
            np.asarray(np.linalg.solve(system.mass, system.dynamics), float),
            np.asarray(np.linalg.solve(system.mass, system.input[..., columns]), float), seen,
            np.zeros((*seen.shape[:-1], len(columns))),
        )  # fmt: skip

    def _signals(self, values: Mapping[str, Array], k: int, length: int, starts: Array | None) -> Array:
        """What drives each run (K, R, T, m)."""
        return np.stack([self._torque(run, values, k, length) for run in self.runs], 1)

    def _uncertain(
        self, driven: Driven, values: Mapping[str, Array], steps: tuple[Array, Array, Array], length: int
    ) -> Array:
        """Responses to what is uncertain of the inputs (K, R, channels, T, columns): recorded torques are exact."""
        return np.zeros((*driven.seen.shape[:-1], length, 0))

    def _torque(self, run: Run, values: Mapping[str, Array], k: int, length: int) -> Array:
        found = np.zeros((k, length, len(run.inputs) + (FRICTION in values)))
        if FRICTION in values:
            found[:, : len(run.time), -1] = -values[FRICTION] * self._directions[run.name]
        for m, (name, u) in enumerate(run.inputs.items()):
            gain = 1 + values.get(GAIN.format(name), np.zeros((k, 1)))[:, 0]
            delay = values.get(DELAY.format(name), np.zeros((k, 1)))[:, 0]
            for i in range(k):
                shifted = np.interp(run.time - delay[i], run.time, u) if delay[i] else u
                found[i, : len(u), m] = gain[i] * shifted
        return found

    @cached_property
    def _directions(self) -> dict[str, Array]:
        """Expected sign (n,) of the steer rate of each run by its name."""
        return {run.name: direction(run) for run in self.runs}

    def _filter_starts(self, values: Mapping[str, Array], length: int, steps: Array) -> Array:
        """What the unknown state of each low-pass does to the channels (T, K, R, channels, filters)."""
        filtered = [c for c, name in enumerate(self.channels) if LOWPASS.format(name) in values]
        k = len(next(iter(values.values())))
        found = np.zeros((length, k, len(self.runs), len(self.channels), len(filtered)))
        for f, c in enumerate(filtered):
            name = self.channels[c]
            size = np.array([np.sqrt(np.mean(run.channels[name] ** 2)) for run in self.runs])
            found[:, :, :, c, f] = size * begun(length, values[LOWPASS.format(name)][:, 0], steps)
        return found

    def _sensed(self, y: Array, values: Mapping[str, Array], steps: Array) -> Array:
        """Low-pass, delay (to second order in time) and gain of each channel, outputs (T, K, R, channels, ...)."""
        for c, name in enumerate(self.channels):
            if LOWPASS.format(name) in values:
                y[:, :, :, c] = lowpassed(y[:, :, :, c], values[LOWPASS.format(name)][:, 0], steps)
            if DELAY.format(name) in values:
                tau = values[DELAY.format(name)][:, :1] / steps  # (K, R), in samples
                first = np.gradient(y[:, :, :, c], axis=0)
                y[:, :, :, c] += -tau[..., None] * first + tau[..., None] ** 2 / 2 * np.gradient(first, axis=0)
            if GAIN.format(name) in values:
                y[:, :, :, c] *= 1 + values[GAIN.format(name)][:, :, None]
        return y
