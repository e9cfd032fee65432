"""Predicted time histories: the recorded torques replayed, initial states marginalised, coloured noise whitened.

The initial state of a run enters linearly. It has a wide normal prior and is integrated out exactly: with the whitened
free responses Phi S = U s V', the residual is multiplied by (I + Phi S^2 Phi')^-1/2 = I + U (1/sqrt(1 + s^2) - 1) U'.
Noise of a channel is first-order autoregressive: e_k = rho e_(k-1) + innovation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bicycle.identification.recording import CHANNELS, INPUTS, Run
from studies.inference.folds import folds
from studies.inference.forward import Extra, Residual, Rows
from studies.inference.parameter import Candidate
from studies.missing_effect.motion.bicycle_forward import BicycleForward, error
from studies.missing_effect.motion.family import SPEED_SCALE, Family
from tyre.base.arrays import Array

START = {"rad/s": 3.0, "m/s": 2.0, "N": 0.3, "N m": 0.1, "rad": 0.5}
"""Prior sd of an initial state by its unit, of forces and moments in weights and weights times m; of others 1."""

JOINT_START = {"rad/s": 0.5, "rad": 0.05}
"""The same of an elastic joint, which gives way by a fraction of the lean (rad/s, rad); wider would veil a new mode."""

BIAS = {"roll_rate_rad_s": 0.02, "lean_rad": 0.03, "steer_rad": 0.02, "steer_rate_rad_s": 0.02, "yaw_rate_rad_s": 0.02}
BIAS_KEY = "bias"
LARGEST = 1e12  # of a simulated signal: the trial bicycle has fallen
COLOUR = (0.0, 0.98)  # of the autoregressive coefficient
EXTRA_SD = {"roll_rate_rad_s": 0.02, "steer_rad": 0.005, "yaw_rate_rad_s": 0.02}
HELD_SHARE = 0.5  # of samples that repeat the one before


@dataclass(frozen=True)
class Noise:
    """Marginal sd and autoregressive coefficient of a channel; ``given`` where the user states the sd."""

    sd: float
    colour: float = 0.0
    given: bool = False

    def whiten(self, signal: Array) -> Array:
        """Turn the noise along the first axis into unit white noise."""
        white = np.nan_to_num(signal, nan=LARGEST, posinf=LARGEST, neginf=-LARGEST).clip(-LARGEST, LARGEST) / self.sd
        white[1:] = (white[1:] - self.colour * white[:-1]) / np.sqrt(1 - self.colour**2)
        return white


def history_candidates(run: Run) -> tuple[Candidate, ...]:
    """What may be wrong with a recording: speed, gain and delay of each channel and torque, a bias in each run."""
    found = [Candidate("speed_scale", (error("scale", "1", SPEED_SCALE, 0.02),)), Candidate(BIAS_KEY, ())]
    names = [name for name in (*run.channels, *run.inputs) if name in CHANNELS or name in INPUTS]
    for name in names:
        short = name.rsplit("_rad", 1)[0].rsplit("_N_m", 1)[0]
        found.append(Candidate(f"{short}_scale", (error("scale", "1", f"measurement.{name}_gain", 0.1),)))
        found.append(Candidate(f"{short}_delay", (error("delay", "s", f"measurement.{name}_delay", 0.01),)))
    return tuple(found)


@dataclass(frozen=True)
class RunFit:
    """Whitened residual of a run, left vectors U and gains 1/sqrt(1 + s^2) - 1, and the most probable initial state."""

    residual: Array
    left: Array
    gain: Array
    start: Array


@dataclass(frozen=True, kw_only=True)
class HistoryForward(BicycleForward):
    """The forward model of time histories (see :class:`studies.inference.forward.Forward`)."""

    thorough = False
    runs: tuple[Run, ...]
    noise: Mapping[str, Noise]

    @classmethod
    def of_runs(cls, runs: tuple[Run, ...], noise_sd: Mapping[str, float], **rest: Any) -> "HistoryForward":
        """Noise as given, else from second differences until a fit is there."""
        noise = {}
        for name in runs[0].channels:
            if name not in _outputs(runs[0]):
                continue
            rough = np.sqrt(np.mean([np.var(np.diff(run.channels[name], 2)) / 6 for run in runs]))
            floor = 1e-3 * np.sqrt(np.mean([np.var(run.channels[name]) for run in runs]))
            noise[name] = Noise(noise_sd[name], given=True) if name in noise_sd else Noise(float(max(rough, floor)))
        dropped = [name for name in runs[0].channels if name not in noise]
        if dropped:
            note = f"{', '.join(dropped)}: not compared, the place of the sensor is not known"
            rest["notes"] = (*rest.get("notes", ()), note)
        return cls(runs=runs, noise=noise, **rest)

    @cached_property
    def held(self) -> bool:
        """Whether the torques are piecewise constant (commanded); otherwise they are taken linear between samples."""
        steps = [np.diff(u) for run in self.runs for u in run.inputs.values()]
        return bool(steps) and float(np.mean(np.concatenate(steps) == 0)) > HELD_SHARE

    @cached_property
    def rows(self) -> Rows:
        """Labels of the residuals: channel by channel within a run."""
        where: list[str] = []
        series: list[str] = []
        group: list[str] = []
        repeat: list[str] = []
        speed, inputs = [], []
        for run in self.runs:
            for name, noise in self.noise.items():
                n = len(run.time)
                where += [f"{name}, {run.speed:.3g} m/s"] * n
                series += [f"{run.name} {name}"] * n
                group += [run.group or f"{run.speed:.2g}"] * n
                repeat += [run.name] * n
                speed += [run.speed] * n
                inputs.append(np.stack([noise.whiten(u) for u in run.inputs.values()], 1) if run.inputs else None)
        known = np.vstack([u for u in inputs if u is not None]) if self.runs[0].inputs else None
        return Rows(tuple(where), np.array(speed), tuple(series), folds(group, speed, repeat), known)

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Whitened residual, initial states marginalised, and its derivative at fixed initial states."""
        family = self.family(candidates)
        runs = self._fitted(family, candidates, theta)
        residual = np.concatenate([run.residual for run in runs])
        if not slopes or not len(theta):
            return residual, np.empty((len(residual), 0))
        batch, steps = family.stencil(theta)
        moved, _ = self._simulate(family, batch[: len(steps) + 1], np.array([run.start for run in runs]))
        columns = []
        for k, run in enumerate(self.runs):
            seen = np.clip(np.nan_to_num(moved[:, k, : len(run.time)]), -LARGEST, LARGEST)
            slope = (seen[1:] - seen[0]) / steps[:, None, None]
            columns.append(-_shrink(self._white(np.moveaxis(slope, 0, -1)), runs[k].left, runs[k].gain))
        return residual, np.vstack(columns)

    def _fitted(self, family: Family, candidates: tuple[Candidate, ...], theta: Array) -> list[RunFit]:
        """Each run with its initial state marginalised; the last answer is kept, because a fit asks twice."""
        key = (tuple(c.identifier for c in candidates), theta.tobytes())
        if key not in self._last:
            forced, free = self._simulate(family, theta[None], None)
            found = []
            for k, run in enumerate(self.runs):
                n = len(run.time)
                white = self._white(np.stack([run.channels[c] for c in self.noise], 1) - forced[0, k, :n])
                found.append(self._marginal(run, free[k][:n], white, candidates, family))
            self._last.clear()
            self._last[key] = found
        return self._last[key]

    @cached_property
    def _last(self) -> dict[Any, list[RunFit]]:
        return {}

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Sum of ln(1 + s^2) over the runs."""
        runs = self._fitted(self.family(candidates), candidates, theta)
        return float(-2 * sum(np.log1p(run.gain).sum() for run in runs))

    def refined(self, best: Residual) -> "HistoryForward":
        """Noise estimated from the residuals of a good fit, where it was not given; its colour in any case."""
        series = np.array(self.rows.series)
        noise = {}
        for name, old in self.noise.items():
            raw = []
            for run in self.runs:
                white = best.residual[series == f"{run.name} {name}"]
                raw.append(_colour(white, old))
            level = float(np.sqrt(np.mean([np.mean(e**2) for e in raw])))
            change = float(np.mean([np.mean(np.diff(e) ** 2) for e in raw]))
            sd = old.sd if old.given else level
            noise[name] = Noise(sd, float(np.clip(1 - change / (2 * sd**2), *COLOUR)), old.given)
        return replace(self, noise=noise)

    def compared(self, residual: Array) -> tuple[Array, Array | None]:
        """Nothing to draw over speed."""
        return residual, None

    def extras(self) -> tuple[Extra, ...]:
        """Channels that were not recorded, at the same runs, and a forced response."""
        total = sum(len(run.time) for run in self.runs)
        channels = [
            Extra(f"{name} in the same runs", np.full(total, sd))
            for name, sd in EXTRA_SD.items()
            if name not in self.noise
        ]
        return (*channels, *self.forced(max(run.speed for run in self.runs)))

    def predict(self, extra: Extra, candidates: tuple[Candidate, ...], theta: Array) -> tuple[Array, Array]:
        """The channel with the initial states that fit best; a forced response is without them."""
        if extra.speed is not None:
            return self.predict_forced(extra, candidates, theta)
        name = extra.what.split()[0]
        wider = replace(self, noise={**self.noise, name: Noise(float(extra.sd[0]))})
        family = self.family(candidates)
        starts = [run.start for run in self._fitted(family, candidates, theta)]
        batch, steps = family.stencil(theta)
        moved, _ = wider._simulate(family, batch, np.array(starts))
        p, last = len(steps), len(self.noise)
        flat = np.concatenate([moved[:, k, : len(run.time), last] for k, run in enumerate(self.runs)], axis=1)
        return flat[0] / extra.sd, ((flat[1 : p + 1] - flat[p + 1 :]) / (2 * steps[:, None])).T / extra.sd[:, None]

    # ------------------------------------------------------------------ inside

    def _white(self, signals: Array) -> Array:
        """Signals (T, channels, ...) -> whitened rows (channels T, ...)."""
        return np.concatenate([noise.whiten(signals[:, c]) for c, noise in enumerate(self.noise.values())])

    def _marginal(
        self, run: Run, free: Array, white: Array, candidates: tuple[Candidate, ...], family: Family
    ) -> RunFit:
        """Integrate the initial state out (and a bias of each channel, where it is a candidate)."""
        scale = self._start_scale(family)
        phi = self._white(free) * scale
        n = phi.shape[1]
        if any(c.identifier == BIAS_KEY for c in candidates):
            constant = np.zeros((len(run.time), len(self.noise), len(self.noise)))
            for c, name in enumerate(self.noise):
                constant[:, c, c] = BIAS[name]
            phi = np.hstack([phi, self._white(constant)])
        if not (np.abs(phi).max() < LARGEST and np.abs(white).max() < LARGEST):  # fallen, or not a number
            nothing = np.full((len(phi), 1), np.nan)
            return RunFit(nothing[:, 0], nothing, np.zeros(1), np.zeros(n))
        u, s, vt = np.linalg.svd(phi, full_matrices=False)
        best = vt.T @ (s / (1 + s**2) * (u.T @ white))
        gain = 1 / np.sqrt(1 + s**2) - 1
        return RunFit(_shrink(white[:, None], u, gain)[:, 0], u, gain, best[:n] * scale)

    def _start_scale(self, family: Family) -> Array:
        weight = sum(self.base.bicycle.static_loads)
        found = []
        for state, unit in zip(family.evaluate.symbolic.declared.states, family.state_scale, strict=True):
            sd = (JOINT_START if state.joint else START).get(state.unit, 1.0)
            found.append(sd * (weight if state.forcelike else 1.0) / unit)
        return np.array(found)

    def _simulate(self, family: Family, theta: Array, starts: Array | None) -> tuple[Array, list[Array]]:
        """Outputs (K, runs, T, channels) from ``starts`` (runs, n); without, from rest, with free responses."""
        values = family.values(theta)
        speeds = np.array([run.speed for run in self.runs])
        steps = np.array([run.step for run in self.runs])
        system = family(theta, speeds)
        names = family.evaluate.symbolic
        columns = [names.inputs.index(INPUTS[u]) for u in self.runs[0].inputs]
        state = np.linalg.solve(system.mass, system.dynamics)
        inputs = np.linalg.solve(system.mass, system.input[..., columns])
        seen = system.output[..., [names.outputs.index(CHANNELS[c]) for c in self.noise], :]
        length = max(len(run.time) for run in self.runs)
        torque = np.stack([self._torque(run, values, len(theta), length) for run in self.runs], 1)  # (K, R, T, m)
        ad, g0, g1 = _discrete(np.asarray(state, float), np.asarray(inputs, float), steps)
        if self.held:
            g0, g1 = g0 + g1, np.zeros_like(g1)
        k, r, n = len(theta), len(self.runs), state.shape[-1]
        wide = 1 if starts is not None else 1 + n
        x = np.zeros((length, k, r, n, wide))
        if starts is not None:
            x[0, ..., 0] = starts
        else:
            x[0, ..., 1:] = np.eye(n)
        push = np.einsum("krnm,krtm->tkrn", g0, torque[:, :, :-1]) + np.einsum("krnm,krtm->tkrn", g1, torque[:, :, 1:])
        with np.errstate(over="ignore", invalid="ignore"):
            for t in range(length - 1):
                np.matmul(ad, x[t], out=x[t + 1])
                x[t + 1, ..., 0] += push[t]
            y = self._sensed(seen @ x, values, steps)
        outputs = np.moveaxis(y[..., 0], 0, 2)
        free = [y[:, 0, run, :, 1:] for run in range(r)] if starts is None else []
        return outputs, free

    def _torque(self, run: Run, values: Mapping[str, Array], k: int, length: int) -> Array:
        found = np.zeros((k, length, len(run.inputs)))
        for m, (name, u) in enumerate(run.inputs.items()):
            gain = 1 + values.get(f"measurement.{name}_gain", np.zeros((k, 1)))[:, 0]
            delay = values.get(f"measurement.{name}_delay", np.zeros((k, 1)))[:, 0]
            for i in range(k):
                shifted = np.interp(run.time - delay[i], run.time, u) if delay[i] else u
                found[i, : len(u), m] = gain[i] * shifted
        return found

    def _sensed(self, y: Array, values: Mapping[str, Array], steps: Array) -> Array:
        """Gain and delay (to second order in time) of each channel, outputs (T, K, R, channels, ...)."""
        for c, name in enumerate(self.noise):
            if f"measurement.{name}_delay" in values:
                tau = values[f"measurement.{name}_delay"][:, :1] / steps  # (K, R), in samples
                first = np.gradient(y[:, :, :, c], axis=0)
                y[:, :, :, c] += -tau[..., None] * first + tau[..., None] ** 2 / 2 * np.gradient(first, axis=0)
            if f"measurement.{name}_gain" in values:
                y[:, :, :, c] *= 1 + values[f"measurement.{name}_gain"][:, :, None]
        return y


def _outputs(run: Run) -> list[str]:
    return [name for name in run.channels if name in BIAS]


def _shrink(white: Array, left: Array, gain: Array) -> Array:
    return white + left @ (gain[:, None] * (left.T @ white))


def _colour(white: Array, noise: Noise) -> Array:
    """Undo the whitening of one series."""
    raw = white * noise.sd
    if noise.colour:
        for k in range(1, len(raw)):
            raw[k] = noise.colour * raw[k - 1] + np.sqrt(1 - noise.colour**2) * raw[k]
    return raw


def _discrete(state: Array, inputs: Array, steps: Array) -> tuple[Array, Array, Array]:
    """x_(k+1) = A x_k + G0 u_k + G1 u_(k+1), exact for a torque that is linear between samples (Van Loan 1978)."""
    n, m = state.shape[-1], inputs.shape[-1]
    block = np.zeros((*state.shape[:-2], n + 2 * m, n + 2 * m))
    block[..., :n, :n] = state * steps[:, None, None]
    block[..., :n, n : n + m] = inputs * steps[:, None, None]
    block[..., n : n + m, n + m :] = np.eye(m)
    power = _exponential(block)
    late = power[..., :n, n + m :]
    with np.errstate(invalid="ignore"):  # a trial bicycle that falls at once
        return power[..., :n, :n], power[..., :n, n : n + m] - late, late


def _exponential(matrices: Array) -> Array:
    """Matrix exponentials by scaling, Taylor (order 10, argument below 1/4: error 1e-14) and squaring, all at once."""
    size = float(np.abs(matrices).sum(-1).max())
    squarings = max(0, int(np.ceil(np.log2(max(4 * size, 1e-300))))) if np.isfinite(size) else 0
    scaled = matrices / 2.0**squarings
    unit = np.eye(matrices.shape[-1])
    total = unit + scaled / 10
    with np.errstate(over="ignore", invalid="ignore"):  # a trial bicycle that falls at once
        for k in range(9, 0, -1):
            total = unit + scaled @ total / k
        for _ in range(squarings):
            total = total @ total
    return np.asarray(total)
