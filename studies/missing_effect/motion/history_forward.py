"""Predicted time histories: the recorded torques replayed, initial states marginalised, coloured noise whitened.

Noise of a channel is first-order autoregressive: e_k = rho e_(k-1) + innovation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.recording import STEER, Run
from bicycle.identification.repeats import about_one_speed
from studies.inference.folds import folds
from studies.inference.forward import ProposedMeasurement, Residual, Rows, Series
from studies.inference.parameter import Candidate, central_differences
from studies.missing_effect.motion.bicycle_forward import SPEED_AXIS, BicycleForward
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.further_channel import FurtherChannel, starts_in
from studies.missing_effect.motion.history_candidates import BIAS, slow_errors
from studies.missing_effect.motion.history_noise import ChannelNoise, rough_noise, whitened
from studies.missing_effect.motion.initial_states import Marginal, integrated_out, start_sd
from studies.missing_effect.motion.pieces import pieces
from studies.missing_effect.motion.prescribed_steer import PrescribedSteer
from studies.missing_effect.motion.replay import Replay
from tyre.base.arrays import Array

FORWARD = (
    0.1  # of the steps of central differences: one-sided ones of the matrices err by 1e-5 to 1e-3, as rounding does
)
FURTHER_SD = {"roll_rate_rad_s": 0.02, "steer_rad": 0.005, "yaw_rate_rad_s": 0.02}


@dataclass(frozen=True, kw_only=True)
class HistoryForward(BicycleForward):
    """The forward model of time histories (see :class:`studies.inference.forward.Forward`).

    Attributes
    ----------
    runs : tuple of Run
        All with the same channels and torques.
    noise : mapping of str to ChannelNoise
        By channel, those that are compared.
    steer_noise : float, optional
        Standard deviation of a steer angle that is prescribed, rad, where it is known.
    """

    thorough = False
    runs: tuple[Run, ...]
    noise: Mapping[str, ChannelNoise]
    steer_noise: float | None = None

    @classmethod
    def of_runs(cls, runs: tuple[Run, ...], noise_sd: Mapping[str, float], **rest: Any) -> "HistoryForward":
        """Runs with their noise as given, else from second differences until a fit is there.

        Parameters
        ----------
        runs : tuple of Run
        noise_sd : mapping of str to float
            By channel, in its unit.
        rest
            Fields of :class:`BicycleForward`.
        """
        noise = {}
        for name in runs[0].channels:
            if name not in BIAS:
                continue
            sd = noise_sd.get(name)
            noise[name] = rough_noise([r.channels[name] for r in runs]) if sd is None else ChannelNoise(sd, given=True)
        dropped = [name for name in runs[0].channels if name not in noise]
        if dropped:
            note = f"{', '.join(dropped)}: not compared, the place of the sensor is not known"
            rest["notes"] = (*rest.get("notes", ()), note)
        return cls(runs=runs, noise=noise, steer_noise=noise_sd.get(STEER), **rest)

    @cached_property
    def _replay(self) -> Replay:
        return self.replay_of(tuple(self.noise))

    def replay_of(self, channels: tuple[str, ...]) -> Replay:
        """The replay of the runs that gives these ``channels`` (columns)."""
        if STEER in self.runs[0].inputs:
            return PrescribedSteer(self.runs, channels, self.steer_noise)
        return Replay(self.runs, channels)

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
        shown = {f"{run.name} {name}": Series(name) for run in self.runs for name in self.noise}
        fold = folds(group, speed, repeat)
        return Rows(tuple(where), np.array(speed), tuple(series), fold, known, shown=shown, axis=SPEED_AXIS)

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Whitened residual (n,), initial states marginalised, and its derivative (n, p) at fixed initial states.

        Arguments as :meth:`.Forward.residual`.
        """
        family = self.family(candidates)
        runs = self._fitted(family, candidates, theta)
        residual = self._flat(runs.residual)
        if not slopes or not len(theta):
            return residual, np.empty((len(residual), 0))
        steps = FORWARD * family.stencil(theta)[1]
        white = self._white(self._replay.slopes(family, theta, steps, runs.start))
        moved = self._flat(runs.without(white))
        return residual, np.negative(moved, out=moved)

    def _fitted(self, family: Family, candidates: tuple[Candidate, ...], theta: Array) -> Marginal:
        """The runs with their initial states marginalised; the last answer is kept, because a fit asks twice."""
        key = (tuple(c.identifier for c in candidates), theta.tobytes())
        if key not in self._last:
            forced, free = self._replay.free(family, theta)
            white = self._white((self._measured - forced)[..., None])
            found = self._marginal(free, white, candidates, start_sd(family))
            self._last.clear()
            self._last[key] = found
        return self._last[key]

    @cached_property
    def _last(self) -> dict[Any, Marginal]:
        return {}

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Sum of ln(1 + s^2) over the runs, with ``candidates`` at ``theta`` (p,)."""
        runs = self._fitted(self.family(candidates), candidates, theta)
        return float(-2 * np.log1p(runs.gain).sum())

    def marginalised(self, candidates: tuple[Candidate, ...], theta: Array, white: Array) -> Array:
        """``white`` noise (n, draws) without what the initial states absorb, with ``candidates`` at ``theta`` (p,)."""
        runs = self._fitted(self.family(candidates), candidates, theta)
        padded = np.zeros((self._recorded.size, white.shape[1]))
        padded[self._recorded.ravel()] = white
        return self._flat(runs.without(padded.reshape(*runs.residual.shape, -1)))

    @property
    def taken_as_held(self) -> bool:
        """Whether the recorded torques are taken as held from sample to sample because most repeat, as nobody said."""
        return not self.runs[0].between and self._replay.held

    @property
    def varied(self) -> bool:
        """Whether the runs are of two speeds, or pushed by two inputs."""
        pushed = {name for run in self.runs for name, u in run.inputs.items() if np.ptp(u) > 0}
        return len(about_one_speed([run.speed for run in self.runs])) > 1 or len(pushed) > 1

    def easier(self) -> tuple["HistoryForward", ...]:
        """The runs in pieces, each with a start of its own, as in multiple shooting: what grows stays near its start.

        Bock (1983), Recent advances in parameter identification techniques for O.D.E.; empty where runs are short.
        """
        short = tuple(piece for run in self.runs for piece in pieces(run))
        return (replace(self, runs=short),) if len(short) > len(self.runs) else ()

    def refined(self, best: Residual) -> "HistoryForward":
        """Noise estimated from the residuals of the ``best`` fit, where it was not given; its colour in any case."""
        series = np.array(self.rows.series)
        noise = {
            name: old.estimated([best.residual[series == f"{run.name} {name}"] for run in self.runs])
            for name, old in self.noise.items()
        }
        return replace(self, noise=noise)

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Channels that were not recorded, at the same runs, and a forced response."""
        total = sum(len(run.time) for run in self.runs)
        channels = [
            FurtherChannel(f"{name} in the same runs", np.full(total, sd), name)
            for name, sd in FURTHER_SD.items()
            if name not in {*self.noise, *self.runs[0].inputs}
        ]
        return (*channels, *self.forced(max(run.speed for run in self.runs)))

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """The channel at ``theta`` (p,) with the initial states that fit best; a forced response is without them.

        Arguments as :meth:`studies.inference.forward.Forward.predict`.
        """
        if not isinstance(proposal, FurtherChannel):
            return super().predict(proposal, candidates, theta)
        batch, steps = self.family(candidates).stencil(theta)
        moved = self.simulated(candidates, theta, (proposal.channel,), batch)
        flat = np.concatenate([moved[:, k, 0, : len(run.time)] for k, run in enumerate(self.runs)], axis=1)
        return flat[0] / proposal.sd, central_differences(flat, steps) / proposal.sd[:, None]

    def loose(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array] | None:
        """What the starts of the same runs and a bias of the new channel do to it; they are integrated out there, too.

        Arguments as :meth:`studies.inference.forward.Forward.loose`.
        """
        if not isinstance(proposal, FurtherChannel):
            return None
        family = self.family(candidates)
        found, states = self._fitted(family, candidates, theta), start_sd(family)
        free = self.replay_of((proposal.channel,)).free(family, theta)[1][:, 0]
        free = free * _scaled(states, free.shape[-1])
        white = self._white(self._replay.slopes(family, theta, FORWARD * family.stencil(theta)[1], found.start))
        return starts_in(proposal, self.runs, candidates, found, white, free, len(states))

    def simulated(self, candidates: tuple[Candidate, ...], theta: Array, channels: tuple[str, ...], at: Array) -> Array:
        """``channels`` (K, runs, channels, T) of ``candidates`` at ``at`` (K, p), from the best starts at ``theta``."""
        return self.replay_of(channels)(self.family(candidates), at, self.starts(candidates, theta))

    def starts(self, candidates: tuple[Candidate, ...], theta: Array) -> Array:
        """Most probable initial state (runs, states) with ``candidates`` at ``theta`` (p,)."""
        return self._fitted(self.family(candidates), candidates, theta).start

    def unexplained(self, candidates: tuple[Candidate, ...], theta: Array) -> list[Array]:
        """Measured minus computed signals of each run (T, channels), in the channels' units, from the best starts.

        Arguments as :meth:`.Forward.residual`, without slopes.
        """
        runs = self._fitted(self.family(candidates), candidates, theta)
        white = runs.without(runs.residual[..., None]).reshape(self._recorded.shape)  # once more: nothing integrated
        found = []
        for run, own in zip(self.runs, white, strict=True):
            channels = zip(self.noise.values(), own[:, : len(run.time)], strict=True)
            found.append(np.stack([noise.colour_again(w) for noise, w in channels], 1))
        return found

    # ------------------------------------------------------------------ inside

    @cached_property
    def _recorded(self) -> NDArray[np.bool_]:
        """Where there are samples (R, C, T): all but behind the end of runs shorter than the longest."""
        there = self._replay.padded([np.ones(len(run.time))] * len(self.noise) for run in self.runs)
        return there > 0

    @cached_property
    def _even(self) -> bool:
        return bool(self._recorded.all())

    @cached_property
    def _measured(self) -> Array:
        """What was recorded (R, C, T), zero behind the end of a run."""
        return self._replay.padded([run.channels[c] for c in self.noise] for run in self.runs)

    def _flat(self, rows: Array) -> Array:
        """The rows (R, C T, ...) of all runs below each other (n, ...)."""
        flat = rows.reshape(-1, *rows.shape[2:])
        return flat if self._even else flat[self._recorded.ravel()]

    def _white(self, signals: Array) -> Array:
        """Signals (R, C, T, columns) -> whitened rows (R, C T, columns)."""
        white = whitened(signals, tuple(self.noise.values()))
        if not self._even:
            white *= self._recorded[..., None]
        return white.reshape(len(white), -1, white.shape[-1])

    def _marginal(self, free: Array, white: Array, candidates: tuple[Candidate, ...], states: Array) -> Marginal:
        """Integrate the initial states out, their prior sd ``states`` (and bias or drift, as candidates)."""
        scale = _scaled(states, free.shape[-1])
        phi = self._white(free) * scale
        n = phi.shape[-1]
        slow = slow_errors(self.runs, self._replay.length, tuple(self.noise), candidates)
        if slow.shape[-1]:
            phi = np.concatenate([phi, self._white(slow)], -1)
        found = integrated_out(phi, white)
        return found._replace(start=found.start[:, :n] * scale)


def _scaled(states: Array, width: int) -> Array:
    """Prior sd of starts (width,): those of the ``states`` (n,) first, low-passes and splines bring their own."""
    return np.concatenate([states, np.ones(width - len(states))])
