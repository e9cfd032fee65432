"""Time histories: the recorded torques replayed, initial states marginalised, coloured noise whitened."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain, combinations
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from bicycle.identification.recording import CHANNELS, INPUTS, STEER, STEER_TORQUE, Run, read_runs
from bicycle.identification.scatter import about_one_speed
from studies.diagnosis.bicycle_kind import SPEED_AXIS, BicycleKind, without_motors
from studies.diagnosis.candidates import nobody_rides
from studies.diagnosis.doubts import SPEEDS, readings_of
from studies.diagnosis.family import Family
from studies.diagnosis.figures import TRACES
from studies.diagnosis.history_doubts import doubt_faint_channels, doubt_held_torques, doubt_unrecorded_rider
from studies.diagnosis.mistakes import (
    BOX,
    SENSOR,
    clock_error,
    coasting,
    delay_error,
    friction_candidate,
    gain_error,
    leaning_error,
    lowpass_error,
    one_speed,
    refuse_friction,
    rotation_error,
    speed_errors,
    third_difference_noise,
)
from studies.diagnosis.prescribed_steer import PrescribedSteer
from studies.diagnosis.replay import Replay
from studies.diagnosis.riding import (
    CADENCE_HZ,
    WORDS,
    Sizes,
    TorqueSize,
    estimate_torque_size,
    posterior_sizes,
    riding_candidates,
)
from studies.diagnosis.run_pieces import average_blocks, cut_loudest, cut_pieces
from studies.diagnosis.whitening import (
    ChannelNoise,
    Marginal,
    clip_fallen,
    integrate_starts_out,
    rough_noise,
    start_scale,
    start_sd,
)
from studies.inference.evidence import folds
from studies.inference.fit import ROUGH, Fit, fit
from studies.inference.judge import Judgement
from studies.inference.kind import Candidates, Figure, Prediction, Proposal, Rows, Series
from studies.inference.last_answer import LastAnswer
from studies.inference.parameter import Candidate, central_differences
from studies.inference.rules import RULES
from tyre.ground.arrays import Array

# Name of the sensor of each column, and the prior sd of its bias, 0 if the column is only an input.
SENSORS = {
    "roll_rate_rad_s": ("roll_rate", 0.02), "lean_rad": ("lean", 0.03), "steer_rad": ("steer", 0.02),
    "steer_rate_rad_s": ("steer_rate", 0.02), "yaw_rate_rad_s": ("yaw_rate", 0.02),
    "steer_torque_N_m": ("steer_torque", 0.1), "lean_torque_N_m": ("lean_torque", 0.0),
}  # fmt: skip

# ---- the kind ----

SIZES = np.geomspace(3e-4, 0.2, 20)  # sd that are tried for a torque of the ride, weights times m (a force: weights)
ROUNDS = 6  # most fits by which the size of a torque settles where the base model is far off


@dataclass(frozen=True, kw_only=True)
class Histories(BicycleKind, kind="histories"):
    """Time histories: runs with the same channels and torques."""

    thorough = False
    columns: ClassVar[tuple[str, ...]] = ("time_s", *CHANNELS, *INPUTS)
    runs: tuple[Run, ...]  # R runs with the same C channels; of a prepared kind only those that are fitted
    noise_sd: Mapping[str, float] = field(default_factory=dict)  # by channel in its unit, as stated
    unseen: tuple[Run, ...] = ()  # runs that are held out of every fit; filled by :meth:`prepare`
    # by channel that is compared, rough until the first fit unless stated; filled by :meth:`prepare`
    noise: Mapping[str, ChannelNoise] = field(default_factory=dict)
    ride_model: tuple[Candidates, Array] | None = None  # and theta (p,), to estimate torques of the ride with
    # by identifier of a torque of the ride; None: estimated when first needed
    torque_sizes: Mapping[str, TorqueSize] | None = None

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "Histories":
        """Runs of the table ``content``; motors are taken out of the model if the steer torque was recorded."""
        runs, noise, notes = read_runs(content, folder)
        if any(STEER_TORQUE in {**run.inputs, **run.channels} for run in runs):
            common, motor_notes = without_motors(content, common)
            notes += motor_notes
        return cls(**common, runs=runs, noise_sd=noise, notes=notes)

    def prepare(self, **how: Any) -> Self:
        """Copy with nuisances and candidates, held-out runs apart, and the noise stated or estimated roughly."""
        prepared = super().prepare(**how)
        runs, noise_sd, notes = average_blocks(self.runs, self.noise_sd, held=self.replay_of(()).held)
        fitted = tuple(run for run in runs if not run.held_out)
        unseen = tuple(run for run in runs if run.held_out)
        noise, unplaced = {}, []
        for channel in fitted[0].channels:
            _, bias_sd = SENSORS.get(channel, ("", 0.0))
            if not bias_sd:
                unplaced.append(channel)
            elif channel in noise_sd:
                noise[channel] = ChannelNoise(noise_sd[channel], stated=True)
            else:
                noise[channel] = rough_noise([run.channels[channel] for run in fitted])
        if unplaced:
            notes.append(f"{', '.join(unplaced)}: not compared, the place of the sensor is not known")
        return replace(
            prepared, runs=fitted, unseen=unseen, noise=noise, noise_sd=noise_sd, notes=(*prepared.notes, *notes)
        )

    def mistakes(self) -> tuple[Candidate, ...]:
        """Candidates for errors of speeds, channels, clocks and mounting, dry friction, and torques of the ride."""
        run = self.runs[0]
        channels = [name for name in run.channels if SENSORS.get(name, ("", 0.0))[1]]
        errors = [
            *speed_errors(self.speeds.tolist()),
            Candidate(
                "bias",
                (),
                signature="each channel of each run has an offset",
                title="offset of each channel",
                weight=SENSOR,
            ),
            Candidate(
                "drift",
                (),
                signature="each channel of each run has an offset that changes in time",
                title="drift of each channel",
                weight=SENSOR,
            ),
        ]
        for name in (*channels, *run.inputs):
            errors += [gain_error(SENSORS[name][0], name), delay_error(SENSORS[name][0], name)]
        errors += [lowpass_error(SENSORS[name][0], name) for name in channels]
        gyros = [name for name in BOX if name in channels]
        if gyros:
            mounting_sds = [m.sd for m in run.mountings if m.sd > 0]
            errors += [rotation_error(*mounting_sds[:1]), leaning_error()][: len(gyros)]  # only two gyros show a lean
        if gyros and len(channels) + len(run.inputs) > len(gyros):
            errors.append(clock_error())
        errors += [coasting(), *riding_candidates(), friction_candidate()]
        refused = self.refusals()
        return tuple(c for c in errors if c.identifier not in refused)

    @property
    def prescribed(self) -> bool:
        """True if the steer angle is an input."""
        return STEER in self.runs[0].inputs

    def refusals(self) -> dict[str, str]:
        """Reasons why candidates cannot be tried on these runs, by identifier."""
        reasons = one_speed(self.speeds.tolist()) | refuse_friction(self.runs[0])
        no_rider = nobody_rides(self.model)
        if no_rider:
            reasons |= dict.fromkeys(("pedalling", "rider_sway"), no_rider)
        if self.prescribed:
            reasons |= dict.fromkeys(
                ("imu_rotation", "imu_clock", "coast_down", *WORDS), "the steer angle is prescribed"
            )
        return reasons

    @property
    def speeds(self) -> Array:
        """Mean speed (R,) of each run, m/s."""
        return np.array([run.speed for run in self.runs])

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the runs."""
        return tuple(run.name for run in self.runs)

    # ---- physics ----

    @cached_property
    def _replay(self) -> Replay:
        """Replay of the runs with the compared channels; torques of the ride have their most probable sizes."""
        return self.replay_of(tuple(self.noise))

    @cached_property
    def _unit_replay(self) -> Replay:
        """Replay of the runs with the compared channels; torques of the ride have an sd of 1 N m (a force 1 N)."""
        return Replay(self.runs, tuple(self.noise))

    def replay_of(self, channels: tuple[str, ...]) -> Replay:
        """Replay of the inputs of the runs that computes these ``channels``, in their order."""
        if self.prescribed:
            return PrescribedSteer(self.runs, channels, steer_noise=self.noise_sd.get(STEER))
        return Replay(self.runs, channels, self._find_torque_sizes)

    def _find_torque_sizes(self) -> Mapping[str, TorqueSize]:
        """Sd (N m or N) and cadences (Hz) of each torque of the ride by identifier: as set, else as estimated."""
        return self._estimated_torque_sizes if self.torque_sizes is None else self.torque_sizes

    @cached_property
    def _estimated_torque_sizes(self) -> dict[str, TorqueSize]:
        """Most probable sd and cadence of each torque of the ride, by identifier; with ``ride_model`` or base model."""
        candidates, theta = self.ride_model or ((), self.nominal)
        torque_sizes = {
            torque.identifier: self._estimate_torque_size(torque, candidates, theta) for torque in riding_candidates()
        }
        if self.ride_model is None:
            for torque in riding_candidates():
                torque_sizes = self._settle_torque_size(torque, torque_sizes)
        return torque_sizes

    def _settle_torque_size(self, torque: Candidate, torque_sizes: dict[str, TorqueSize]) -> dict[str, TorqueSize]:
        """Copy of ``torque_sizes``, that of ``torque`` estimated again after a fit with it, until its sd falls < 40 %.

        A base model that is far off leaves much that is no torque of the ride: the first estimates are too large.
        """
        theta = self.nominal
        for _ in range(ROUNDS):
            theta = fit(replace(self, torque_sizes=torque_sizes), (torque,), starts=[theta], turns=ROUGH).theta
            previous = torque_sizes[torque.identifier]
            estimate = self._estimate_torque_size(torque, (), theta)
            torque_sizes = torque_sizes | {torque.identifier: estimate}
            if estimate.sd > 0.6 * previous.sd:
                break
        return torque_sizes

    def _estimate_torque_size(self, torque: Candidate, candidates: Candidates, theta: Array) -> TorqueSize:
        """Most probable sd (N m or N) and cadences (Hz) of a ``torque`` next to ``candidates`` at ``theta`` (p,)."""
        marginal, columns = self._respond_to_torque(torque, candidates, theta)
        weight = sum(self.model.bicycle.static_loads)
        return estimate_torque_size(torque.identifier, marginal.residual, columns, weight * SIZES)

    def _respond_to_torque(self, torque: Candidate, candidates: Candidates, theta: Array) -> tuple[Marginal, Array]:
        """Whitened residual, and responses (R, C T, k) to k weights of a unit ``torque``, without what starts explain.

        Starts are integrated out of both. The model has ``candidates``, the torque not among them, at ``theta`` (p,).
        """
        forced, free = self._unit_replay.free(self.family((*candidates, torque)), theta)
        count = self._unit_replay.free(self.family(candidates), theta)[1].shape[-1]
        white = self._whiten((self._measured - forced)[..., None])
        marginal = self._integrate_out(free[..., :count], white, candidates, start_sd(self.family(candidates)))
        return marginal, marginal.integrate_out(self._whiten(free[..., count:]))

    def marginalised_sizes(self, candidates: Candidates, theta: Array, name: str) -> Sizes:
        """Mean, sd, unit of the rms (N m or N) and frequency (Hz) of the torque ``name``; empty for another effect."""
        torques = {torque.identifier: torque for torque in riding_candidates()}
        if name not in torques:
            return {}
        others = tuple(c for c in candidates if c.identifier != name)
        marginal, columns = self._respond_to_torque(torques[name], others, theta)
        slopes = self._white_slopes(self.family(candidates), theta, self.initial_states(candidates, theta))
        slopes = marginal.integrate_out(slopes) * [u.scale for u in self.unknowns(candidates)]
        theta_marginal = integrate_starts_out(slopes, marginal.residual[..., None])  # the coordinates as well
        sds = sum(self.model.bicycle.static_loads) * SIZES
        times = [run.time for run in self.runs]
        return posterior_sizes(name, times, theta_marginal.residual, theta_marginal.integrate_out(columns), sds)

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Places, speeds, series, folds and whitened inputs of the n residuals: by run, by channel, in time."""
        labels, series, group, repeat, speed, inputs = [], [], [], [], [], []
        for run in self.runs:
            for name, noise in self.noise.items():
                n = len(run.time)
                labels += [f"{name}, {run.speed:.3g} m/s"] * n
                series += [f"{run.name} {name}"] * n
                group += [run.group or f"{run.speed:.2g}"] * n
                repeat += [run.name] * n
                speed += [run.speed] * n
                if run.inputs:
                    inputs.append(np.stack([noise.whiten(u) for u in run.inputs.values()], 1))
        names = [(f"{run.name} {name}", name) for run in self.runs for name in self.noise]
        displays = {series_name: Series(channel) for series_name, channel in names}
        fold = folds(group, speed, repeat)
        whitened_inputs = np.vstack(inputs) if inputs else None
        return Rows(
            tuple(labels), np.array(speed), tuple(series), fold, whitened_inputs, displays=displays, axis=SPEED_AXIS
        )

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        """Whitened residual (n,), measured minus computed, initial states integrated out, and its derivative (n, p)."""
        family = self.family(candidates)
        runs = self._integrate_starts(family, candidates, theta)
        residual = self._flatten(runs.residual)
        if not slopes or not len(theta):
            return residual, np.empty((len(residual), 0))
        changes = self._flatten(runs.integrate_out(self._white_slopes(family, theta, runs.start)))
        return residual, np.negative(changes, out=changes)

    def _white_slopes(self, family: Family, theta: Array, starts: Array) -> Array:
        """Whitened derivatives (R, C T, p) of computed channels by ``theta`` (p,) at fixed ``starts`` (R, states)."""
        # a tenth of the steps of central differences: one-sided ones of the matrices err no more than rounding then
        return self._whiten(self._replay.slopes(family, theta, 0.1 * family.stencil(theta)[1], starts))

    def _integrate_starts(self, family: Family, candidates: Candidates, theta: Array) -> Marginal:
        """Whitened residual (measured minus computed) of each run at ``theta`` (p,), initial states integrated out."""

        def integrate() -> Marginal:
            """Integrate the initial states out again, as :meth:`_integrate_starts` remembers it."""
            forced, free = self._replay.free(family, theta)
            white = self._whiten((self._measured - forced)[..., None])
            return self._integrate_out(free, white, candidates, start_sd(family))

        return self._last_marginal.get((tuple(c.identifier for c in candidates), theta.tobytes()), integrate)

    @cached_property
    def _measured(self) -> Array:
        """Recorded channels (R, C, T), in their units, zero behind the end of shorter runs."""
        return self._unit_replay.pad_runs([run.channels[c] for c in self.noise] for run in self.runs)

    @cached_property
    def _last_marginal(self) -> LastAnswer[Marginal]:
        """Memory of the last :meth:`_integrate_starts`: a fit needs residuals and slopes at the same point."""
        return LastAnswer()

    def log_determinant(self, candidates: Candidates, theta: Array) -> float:
        """Sum of ln(1 + s^2), s the singular values of whitened responses to 1 prior sd of all that is integrated out.

        Pedalling adds 2 ln(number of cadences) for each run: it chose its cadence among these.
        """
        gain = self._integrate_starts(self.family(candidates), candidates, theta).gain
        log_cadences = 0.0
        if any(c.identifier == "pedalling" for c in candidates):
            log_cadences = 2 * len(self.runs) * np.log(len(CADENCE_HZ))
        return float(log_cadences - 2 * np.log1p(gain).sum())

    def marginalise_noise(self, candidates: Candidates, theta: Array, white: Array) -> Array:
        """Residuals (n, draws) of ``white`` noise (n, draws) of sd 1 once initial states are integrated out of it."""
        runs = self._integrate_starts(self.family(candidates), candidates, theta)
        padded = np.zeros((self._is_sample.size, white.shape[1]))
        padded[self._is_sample.ravel()] = white
        return self._flatten(runs.integrate_out(padded.reshape(*runs.residual.shape, -1)))

    def simulate(self, candidates: Candidates, theta: Array, channels: tuple[str, ...], at: Array) -> Array:
        """Computed ``channels`` (K, R, C, T) at coordinates ``at`` (K, p), from the best starts at ``theta`` (p,)."""
        return self.replay_of(channels)(self.family(candidates), at, self.initial_states(candidates, theta))

    def initial_states(self, candidates: Candidates, theta: Array) -> Array:
        """Most probable starts (R, k) at ``theta`` (p,): states in the model's scaled units, then others in prior sd.

        The others are the states of filters and the coefficients of torques of the ride.
        """
        return self._integrate_starts(self.family(candidates), candidates, theta).start

    def residual_signals(self, candidates: Candidates, theta: Array) -> list[Array]:
        """Measured minus computed signals (T, C) of each run, in the channels' units, from the most probable starts."""
        runs = self._integrate_starts(self.family(candidates), candidates, theta)
        white = runs.integrate_out(runs.residual[..., None]).reshape(self._is_sample.shape)  # the inverse
        residuals = []
        for run, white_run in zip(self.runs, white, strict=True):
            channels = zip(self.noise.values(), white_run[:, : len(run.time)], strict=True)
            residuals.append(np.stack([noise.colour_again(w) for noise, w in channels], 1))
        return residuals

    @cached_property
    def _is_sample(self) -> NDArray[np.bool_]:
        """True at samples (R, C, T), False behind the end of runs shorter than the longest."""
        return self._unit_replay.pad_runs([np.ones(len(run.time))] * len(self.noise) for run in self.runs) > 0

    def _flatten(self, rows: Array) -> Array:
        """Rows (n, ...) of all runs below each other, from ``rows`` (R, C T, ...) with zeros behind shorter runs."""
        flat = rows.reshape(-1, *rows.shape[2:])
        return flat if self._is_sample.all() else flat[self._is_sample.ravel()]

    def _whiten(self, signals: Array) -> Array:
        """Whitened rows (R, C T, columns) of ``signals`` (R, C, T, columns) in the channels' units."""
        white = clip_fallen(signals) / np.array([noise.sd for noise in self.noise.values()])[:, None, None]
        colour = np.array([noise.colour for noise in self.noise.values()])[:, None, None]
        if colour.any():
            innovation_sd = np.sqrt(1 - colour**2)
            for run in white:  # one after the other: whole copies of all would cost more than the arithmetic
                run[:, 1:] -= colour * run[:, :-1]
                run[:, 1:] /= innovation_sd
        if not self._is_sample.all():
            white *= self._is_sample[..., None]
        return white.reshape(len(white), -1, white.shape[-1])

    def _integrate_out(self, free: Array, white: Array, candidates: Candidates, state_sds: Array) -> Marginal:
        """Integrate initial states, and a bias or drift among ``candidates``, out of ``white`` runs (R, C T, 1).

        ``free`` (R, C, T, k): responses to unit starts; ``state_sds`` (n,): prior sd of the first n, of others it is 1.
        """
        scale = start_scale(state_sds, free.shape[-1])
        phi = self._whiten(free) * scale
        n = phi.shape[-1]
        if {"bias", "drift"} & {c.identifier for c in candidates}:
            biases = self._bias_signals(self._unit_replay.length, tuple(self.noise), candidates)
            phi = np.concatenate([phi, self._whiten(biases)], -1)
        marginal = integrate_starts_out(phi, white)
        return marginal._replace(start=marginal.start[:, :n] * scale)

    def _bias_signals(self, length: int, channels: Sequence[str], candidates: Candidates) -> Array:
        """Signals (R, C, T, columns), T = ``length``, of 1 prior sd of bias, or bias and drift, of C ``channels``."""
        names = [c.identifier for c in candidates]
        shape_count = 2 if "drift" in names else int("bias" in names)
        signals = np.zeros((len(self.runs), len(channels), length, shape_count * len(channels)))
        for r, run in enumerate(self.runs):
            n = len(run.time)
            for k, shape in enumerate([np.ones(n), np.linspace(-1.0, 1.0, n)][:shape_count]):
                for c, name in enumerate(channels):
                    signals[r, c, :n, c + k * len(channels)] = SENSORS[name][1] * shape
        return signals

    # ---- search ----

    @property
    def varied(self) -> bool:
        """True if the runs have two or more speeds, or two or more inputs that vary."""
        varying: set[str] = set()
        for run in self.runs:
            varying |= {name for name, u in run.inputs.items() if np.ptp(u) > 0}
        return len(about_one_speed(self.speeds.tolist())) > 1 or len(varying) > 1

    def easier_problems(self) -> tuple["Histories", ...]:
        """One problem: runs cut in pieces, each with its own initial state (multiple shooting); none if runs are short.

        Bock (1983), Recent advances in parameter identification techniques for O.D.E.
        """
        short = tuple(chain.from_iterable(map(cut_pieces, self.runs)))
        return (replace(self, runs=short),) if len(short) > len(self.runs) else ()

    def estimate_noise(self, best: Any) -> "Histories":
        """Copy with noise as in ``best.residual`` (n,); ``best`` is its ride model if without effects or with a torque.

        The residual is whitened by the old noise. A stated sd stays; the colour is always estimated. The ride model, by
        which torques of the ride get their size, is a fit without effects or with such a torque, which is taken out.
        """
        series = np.array(self.rows.series)
        noise = {}
        for name, old in self.noise.items():
            noise[name] = old.estimate([best.residual[series == f"{run.name} {name}"] for run in self.runs])
        trusted = isinstance(best, Fit) and (not best.candidates or any(c.absorbs for c in best.candidates))
        if not trusted:  # its effect may stand for a torque of the ride, whose size is not known with it
            return replace(self, noise=noise)
        effects = [c for c in best.candidates if not c.absorbs]
        theta = list(best.theta[: best.effect_columns.start])
        for c in effects:
            theta += best.theta[best.columns(c)].tolist()
        return replace(self, noise=noise, ride_model=(tuple(effects), np.array(theta)))

    # ---- what to measure next ----

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Further measurements: each channel that was not recorded, in the same runs, and a forced response."""
        total = sum(len(run.time) for run in self.runs)
        recorded = {*self.noise, *self.runs[0].inputs}
        channels = [
            Proposal(
                f"{name} in the same runs",
                np.full(total, sd),
                partial(self._predict_channel, name),
                partial(self._predict_start_effects, name, sd),
            )
            for name, sd in (("roll_rate_rad_s", 0.02), ("steer_rad", 0.005), ("yaw_rate_rad_s", 0.02))
            if name not in recorded
        ]
        return (*channels, *self.propose_forced_response(float(self.speeds.max())))

    def _predict_channel(self, channel: str, candidates: Candidates, theta: Array) -> Prediction:
        """Computed ``channel`` (m,) of all runs from the most probable starts, and derivatives (m, p), in its unit."""
        batch, steps = self.family(candidates).stencil(theta)
        signals = self.simulate(candidates, theta, (channel,), batch)
        flat = np.concatenate([signals[:, k, 0, : len(run.time)] for k, run in enumerate(self.runs)], axis=1)
        return flat[0], central_differences(flat, steps)

    def _predict_start_effects(self, channel: str, sd: float, candidates: Candidates, theta: Array) -> Prediction:
        """Effects of starts on a further ``channel``, over its noise ``sd``: slopes by ``theta`` (m, p), spread (m, k).

        The first: derivatives of what the most probable starts do to it, which follow ``theta`` (p,). The second: what
        1 posterior sd of the starts, and 1 prior sd of a bias or drift, add.
        """
        family = self.family(candidates)
        marginal = self._integrate_starts(family, candidates, theta)
        state_sds = start_sd(family)
        free = self.replay_of((channel,)).free(family, theta)[1][:, 0]
        free = free * start_scale(state_sds, free.shape[-1])
        white = self._white_slopes(family, theta, marginal.start)
        # Columns of the starts that act on this channel too; those of filters of the recorded channels lie between.
        states, starts = len(state_sds), marginal.start.shape[1]
        uncertain = free.shape[-1] - states
        acting = [*range(states), *range(starts - uncertain, starts)]
        start_slopes = -marginal.shift_starts(white)[:, acting]
        spread = marginal.spread[:, acting]
        biases = self._bias_signals(free.shape[1], (channel,), candidates)[:, 0]
        lengths = [len(run.time) for run in self.runs]
        effects = [np.hstack([f[:n] @ s, e[:n]]) for f, s, e, n in zip(free, spread, biases, lengths, strict=True)]
        slopes = np.vstack([f[:n] @ s for f, s, n in zip(free, start_slopes, lengths, strict=True)])
        return slopes / sd, block_diag(*effects) / sd

    # ---- report ----

    def figures(self) -> dict[str, Figure]:
        """Figure of measured and computed signals before and after, by its name."""
        return {"before_after": TRACES}

    def held_out_data(self) -> "Histories | None":
        """The runs that are held out of every fit, with the same noise; None if there are none."""
        return replace(self, runs=self.unseen, unseen=()) if self.unseen else None

    def residuals_by_channel(self, candidates: Candidates, theta: Array) -> dict[str, Array]:
        """Measured minus computed values (samples of all runs,) of each channel, in its unit."""
        residuals = np.concatenate(self.residual_signals(candidates, theta))
        return dict(zip(self.noise, residuals.T, strict=True))

    def measured_by_channel(self) -> dict[str, Array]:
        """Measured values (samples of all runs,) of each channel, in its unit."""
        return {name: np.concatenate([run.channels[name] for run in self.runs]) for name in self.noise}

    def channel_noise_sd(self, residuals: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
        """Noise sd of each channel without a stated one: as estimated, and by third differences, in its unit."""
        ends = np.cumsum([len(run.time) for run in self.runs])[:-1]
        noise_sds = {}
        for name, noise in self.noise.items():
            squares = []  # variances by third differences of signal and of residual; the lower counts
            for run, residual in zip(self.runs, np.split(residuals[name], ends), strict=True):
                if len(residual) >= 20:
                    signal = run.channels[name]
                    squares.append([third_difference_noise(signal) ** 2, third_difference_noise(residual) ** 2])
            if squares and not noise.stated:
                noise_sds[name] = (noise.sd, float(np.sqrt(np.mean(squares, axis=0).min())))
        return noise_sds

    # ---- doubts ----

    def doubts(self, judgement: Judgement, torque: Fit | None = None) -> tuple[str, ...]:
        """Sentences about channels without a signal, a rider who may steer, and torques read as piecewise constant."""
        return (
            *doubt_faint_channels(self),
            *doubt_unrecorded_rider(self, judgement),
            *doubt_held_torques(self, judgement, torque),
        )

    @property
    def taken_as_held(self) -> bool:
        """True if torques are replayed as piecewise constant as most samples repeat, and the file does not state it."""
        return not self.runs[0].between and self._replay.held

    def misreadings(self) -> Iterator[tuple[str, Self]]:
        """Pairs of another reading in words and the runs read so: units, signs, channels swapped, unit of speeds."""
        for name in (*self.noise, *(name for name in self.runs[0].inputs if name != STEER)):
            for reading, factor in readings_of(name).items():
                yield f"{name} {reading}", self._read_as({name: name}, factor)
        for first, second in combinations(self.noise, 2):
            yield f"{first} and {second} swapped", self._read_as({first: second, second: first}, 1.0)
        for reading, factor in SPEEDS.items():
            yield reading, replace(self, runs=tuple(replace(run, speed=factor * run.speed) for run in self.runs))

    def _read_as(self, names: Mapping[str, str], factor: float) -> Self:
        """Copy with each signal and noise that is a key of ``names`` renamed to its value and times ``factor``."""

        def read(signals: Mapping[str, Array]) -> dict[str, Array]:
            """Copy of ``signals`` with those in ``names`` renamed and scaled."""
            return {**signals, **{names[n]: factor * x for n, x in signals.items() if n in names}}

        noise = {names[n]: replace(old, sd=abs(factor) * old.sd) for n, old in self.noise.items() if n in names}
        runs = tuple(replace(run, channels=read(run.channels), inputs=read(run.inputs)) for run in self.runs)
        return replace(self, runs=runs, noise={**self.noise, **noise})

    def thin(self, most: int) -> Self:
        """Copy with about ``most`` numbers: eight runs or more over all speeds, of each the loudest part.

        Itself if there are not twice as many; whole runs if the steer angle is prescribed.
        """
        if len(self.rows.places) <= 2 * most:
            return self
        samples = most // len(self.noise)
        lengths = [len(run.time) for run in self.runs]
        count = min(len(self.runs), max(8, round(samples / np.median(lengths))))
        order = np.argsort(self.speeds, kind="stable")
        chosen = [self.runs[k] for k in sorted(order[np.linspace(0, len(order) - 1, count).round().astype(int)])]
        runs = chosen if self.prescribed else [cut_loudest(run, self.noise, samples // count) for run in chosen]
        return replace(self, runs=tuple(runs))

    def simplify(self) -> "Histories":
        """Copy with eight runs at most, in pieces of 0.6 s; with three whole runs if the steer angle is prescribed."""
        thinned = self.thin(RULES.thinned)
        thinned = replace(thinned, runs=thinned.runs[:: -(-len(thinned.runs) // (3 if self.prescribed else 8))])
        return thinned if self.prescribed else (thinned.easier_problems() or (thinned,))[-1]


@dataclass(frozen=True, kw_only=True)
class ReplayedTorque(Histories, kind="replay", table="histories"):
    """Time histories whose recorded steer torque is replayed."""

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> Histories:
        """Runs of the table ``content`` whose steer torque is an input."""
        return super().read({"input": STEER_TORQUE, **content}, folder, common)
