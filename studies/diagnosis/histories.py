"""Time histories: the recorded torques replayed, initial states marginalised, coloured noise whitened."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import combinations
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from bicycle.identification.recording import AS_LINEAR, CHANNELS, FEWEST, INPUTS, STEER, STEER_TORQUE, Run, read_runs
from bicycle.identification.scatter import about_one_speed
from studies.diagnosis.bicycle_kind import SPEED_AXIS, BicycleKind, without_motors
from studies.diagnosis.candidates import nobody_rides
from studies.diagnosis.doubts import NAMED, SPEEDS, readings_of
from studies.diagnosis.family import Family
from studies.diagnosis.figures import TRACES
from studies.diagnosis.mistakes import (
    BOX,
    SENSOR,
    clock_error,
    coasting,
    delay_error,
    friction_candidate,
    friction_refused,
    gain_error,
    leaning_error,
    lowpass_error,
    one_speed,
    rotation_error,
    speed_errors,
    third_difference_noise,
)
from studies.diagnosis.prescribed_steer import PrescribedSteer
from studies.diagnosis.replay import Replay
from studies.diagnosis.riding import CADENCE_HZ, WORDS, Course, Sizes, most_probable, riding_candidates, sizes_of
from studies.diagnosis.run_pieces import loudest, means, pieces
from studies.diagnosis.whitening import ChannelNoise, Marginal, integrated_out, limited, rough_noise
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
# ---- initial states: they enter linearly, have a wide normal prior and are integrated out ----

# Prior sd of an initial state by its unit, of forces and moments in weights and weights times m; of others 1. A joint
# gives way by a fraction of the lean; wider would veil a new mode.
START = {"rad/s": 3.0, "m/s": 2.0, "N": 0.3, "N m": 0.1, "rad": 0.5}
JOINT_START = {"rad/s": 0.5, "rad": 0.05}


def start_sd(family: Family) -> Array:
    """Prior sd (n,) of the initial states of a ``family`` of models, in the units of their states."""
    weight = sum(family.base.bicycle.static_loads)
    sds = []
    for state, unit in zip(family.symbolic.declared.states, family.models.scale, strict=True):
        sd = (JOINT_START if state.joint else START).get(state.unit, 1.0)
        sds.append(sd * (weight if state.forcelike else 1.0) / unit)
    return np.array(sds)


def _scaled(states: Array, width: int) -> Array:
    """Prior sd of starts (width,): those of the ``states`` (n,) first, low-passes and splines bring their own."""
    return np.concatenate([states, np.ones(width - len(states))])


# ---- the kind ----

SIZES = np.geomspace(3e-4, 0.2, 20)  # sd of a lean torque of the ride, weights times m
ROUNDS = 6  # fits by which the size of a torque settles where the base model is far off
BETWEEN = (
    "{inputs}: most samples repeat the one before, so it is taken as held from sample to sample; taken as linear "
    "between them, chi^2 of {n} numbers with {model} is {other:.5g} in place of {chi2:.5g}. If it was so, state "
    'torque_between_samples = "linear" in [histories]; if it was held, state "held"'
)
SOMEBODY = "does somebody steer? Record the steer torque, or ride hands off: no effect of a bicycle stands for a rider"
FAINT = (
    "{channel}: its root mean square is {size:.2g} at most, of a noise with sd {sd:.2g}: it tells next to nothing; is "
    "the unit right, and that of noise_sd?"
)


@dataclass(frozen=True, kw_only=True)
class Histories(BicycleKind, kind="histories"):
    """Time histories: runs with the same channels and torques."""

    thorough = False
    columns: ClassVar[tuple[str, ...]] = ("time_s", *CHANNELS, *INPUTS)
    runs: tuple[Run, ...]
    noise_sd: Mapping[str, float] = field(default_factory=dict)  # by channel in its unit, as stated
    unseen: tuple[Run, ...] = ()  # of a kind that is ready: runs that are held out of every fit
    # of a kind that is ready, by channel that is compared; rough until a fit is there unless it is stated
    noise: Mapping[str, ChannelNoise] = field(default_factory=dict)
    ridden: tuple[Candidates, Array] | None = None  # model with which torques of the ride are estimated
    courses: Mapping[str, Course] | None = None  # size of each torque of the ride; None: estimated when first asked

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "Histories":
        runs, noise, notes = read_runs(content, folder)
        if any(STEER_TORQUE in {**run.inputs, **run.channels} for run in runs):
            common, motor_notes = without_motors(content, common)
            notes += motor_notes
        return cls(**common, runs=runs, noise_sd=noise, notes=notes)

    def prepare(self, **how: Any) -> Self:
        ready = super().prepare(**how)
        runs, noise_sd, notes = self._average_blocks()
        fitted = tuple(run for run in runs if not run.held_out)
        unseen = tuple(run for run in runs if run.held_out)
        noise, unplaced = {}, []
        for channel in fitted[0].channels:
            _, bias_sd = SENSORS.get(channel, ("", 0.0))
            if not bias_sd:
                unplaced.append(channel)
            elif channel in noise_sd:
                noise[channel] = ChannelNoise(noise_sd[channel], given=True)
            else:
                noise[channel] = rough_noise([run.channels[channel] for run in fitted])
        if unplaced:
            notes.append(f"{', '.join(unplaced)}: not compared, the place of the sensor is not known")
        return replace(ready, runs=fitted, unseen=unseen, noise=noise, noise_sd=noise_sd, notes=(*ready.notes, *notes))

    def _average_blocks(self) -> tuple[tuple[Run, ...], Mapping[str, float], list[str]]:
        """Runs, their stated noise sd and a note; means of blocks stand for the samples of much data of short steps."""
        numbers, steps = sum(len(run.time) * len(run.channels) for run in self.runs), [run.step for run in self.runs]
        count = min(int(RULES.block / max(steps) + 1e-6), min(len(run.time) for run in self.runs) // FEWEST)
        if count < 2 or numbers <= 2 * RULES.thinned:
            return self.runs, self.noise_sd, []
        sd = {
            name: ChannelNoise(sd).of_means([run.channels[name] for run in self.runs if name in run.channels], count)
            for name, sd in self.noise_sd.items()
        }
        held = self.replay_of(()).held
        runs = tuple(means(run, count, held=held) for run in self.runs)
        note = f"means of {count} samples ({runs[0].step:.2g} s) stand for the samples, which loses next to nothing"
        return runs, sd, [note]

    def mistakes(self) -> tuple[Candidate, ...]:
        """Speed, a bias or drift, gain and delay of each channel and torque, low-pass of each channel; friction."""
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
            errors += [rotation_error(*mounting_sds[:1]), leaning_error()][: len(gyros)]  # both gyros tell the lean
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
        why = "the steer angle is prescribed"
        riding = dict.fromkeys(("imu_rotation", "imu_clock", "coast_down", *WORDS), why) if self.prescribed else {}
        no_rider = nobody_rides(self.model)
        nobody = dict.fromkeys(("pedalling", "rider_sway"), no_rider) if no_rider else {}
        return one_speed(self.speeds.tolist()) | friction_refused(self.runs[0]) | nobody | riding

    @property
    def speeds(self) -> Array:
        return np.array([run.speed for run in self.runs])

    @property
    def recordings(self) -> tuple[str, ...]:
        return tuple(run.name for run in self.runs)

    # ---- physics ----

    @cached_property
    def _replay(self) -> Replay:
        return self.replay_of(tuple(self.noise))

    @cached_property
    def _bare(self) -> Replay:
        """The runs with torques of the ride of unit size."""
        return Replay(self.runs, tuple(self.noise))

    def replay_of(self, channels: tuple[str, ...]) -> Replay:
        """The replay of the runs that gives these ``channels`` (columns)."""
        if self.prescribed:
            return PrescribedSteer(self.runs, channels, steer_noise=self.noise_sd.get(STEER))
        return Replay(self.runs, channels, self._courses_of_ride)

    def _courses_of_ride(self) -> Mapping[str, Course]:
        """Size of each torque of the ride, as it was set or else as the runs show it."""
        return self._estimated_courses if self.courses is None else self.courses

    @cached_property
    def _estimated_courses(self) -> dict[str, Course]:
        """Most probable size of each torque of the ride, where the base model or :attr:`ridden` fits with it."""
        candidates, theta = self.ridden or ((), self.nominal)
        courses = {torque.identifier: self._course(torque, candidates, theta) for torque in riding_candidates()}
        if self.ridden is None:
            for torque in riding_candidates():
                courses = self._settle_course(torque, courses)
        return courses

    def _settle_course(self, torque: Candidate, courses: dict[str, Course]) -> dict[str, Course]:
        """The ``courses``, that of ``torque`` estimated again where a fit with it ends, until it shrinks no more.

        A base model that is far off leaves much that is no torque of the ride: the first estimates are too large.
        """
        theta = self.nominal
        for _ in range(ROUNDS):
            theta = fit(replace(self, courses=courses), (torque,), starts=[theta], turns=ROUGH).theta
            course, previous = self._course(torque, (), theta), courses[torque.identifier]
            courses = courses | {torque.identifier: course}
            if course.sd > 0.6 * previous.sd:
                break
        return courses

    def _course(self, torque: Candidate, candidates: Candidates, theta: Array) -> Course:
        """Most probable size of one ``torque`` of the ride beside ``candidates`` at ``theta``."""
        marginal, columns = self._pushed(torque, candidates, theta)
        weight = sum(self.model.bicycle.static_loads)
        return most_probable(torque.identifier, marginal.residual, columns, weight * SIZES)

    def _pushed(self, torque: Candidate, candidates: Candidates, theta: Array) -> tuple[Marginal, Array]:
        """Runs beside ``candidates``, and what each coefficient of a unit ``torque`` adds (R, C T, k)."""
        forced, free = self._bare.free(self.family((*candidates, torque)), theta)
        count = self._bare.free(self.family(candidates), theta)[1].shape[-1]
        white = self._white((self._measured - forced)[..., None])
        marginal = self._marginal(free[..., :count], white, candidates, start_sd(self.family(candidates)))
        return marginal, marginal.without(self._white(free[..., count:]))

    def marginalised_sizes(self, candidates: Candidates, theta: Array, name: str) -> Sizes:
        """Root mean square and frequency of the torque of the ride called ``name``."""
        for torque in (one for one in riding_candidates() if one.identifier == name):
            marginal, columns = self._pushed(torque, tuple(c for c in candidates if c.identifier != name), theta)
            slopes = self._white_slopes(self.family(candidates), theta, self.starts(candidates, theta))
            slopes = marginal.without(slopes) * [u.scale for u in self.unknowns(candidates)]
            free, weight = integrated_out(slopes, marginal.residual[..., None]), sum(self.model.bicycle.static_loads)
            return sizes_of(name, [run.time for run in self.runs], free.residual, free.without(columns), weight * SIZES)
        return {}

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Rows channel by channel within a run."""
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
        shown = {f"{run.name} {name}": Series(name) for run in self.runs for name in self.noise}
        fold = folds(group, speed, repeat)
        whitened_inputs = np.vstack(inputs) if inputs else None
        return Rows(
            tuple(labels), np.array(speed), tuple(series), fold, whitened_inputs, displays=shown, axis=SPEED_AXIS
        )

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        """Whitened residual (n,), initial states marginalised, and its derivative (n, p) at fixed initial states."""
        family = self.family(candidates)
        runs = self._fitted(family, candidates, theta)
        residual = self._flat(runs.residual)
        if not slopes or not len(theta):
            return residual, np.empty((len(residual), 0))
        changes = self._flat(runs.without(self._white_slopes(family, theta, runs.start)))
        return residual, np.negative(changes, out=changes)

    def _white_slopes(self, family: Family, theta: Array, starts: Array) -> Array:
        # a tenth of the steps of central differences: one-sided ones of the matrices err no more than rounding then
        return self._white(self._replay.slopes(family, theta, 0.1 * family.stencil(theta)[1], starts))

    def _fitted(self, family: Family, candidates: Candidates, theta: Array) -> Marginal:
        """The runs with their initial states integrated out."""

        def integrate() -> Marginal:
            forced, free = self._replay.free(family, theta)
            white = self._white((self._measured - forced)[..., None])
            return self._marginal(free, white, candidates, start_sd(family))

        return self._last_marginal.get((tuple(c.identifier for c in candidates), theta.tobytes()), integrate)

    @cached_property
    def _measured(self) -> Array:
        """Channels as they were recorded (R, C, T)."""
        return self._bare.padded([run.channels[c] for c in self.noise] for run in self.runs)

    @cached_property
    def _last_marginal(self) -> LastAnswer[Marginal]:
        return LastAnswer()

    def log_determinant(self, candidates: Candidates, theta: Array) -> float:
        """Sum of ln(1 + s^2) over the runs."""
        log_cadences = (
            2 * len(self.runs) * np.log(len(CADENCE_HZ)) * any(c.identifier == "pedalling" for c in candidates)
        )
        return float(log_cadences - 2 * np.log1p(self._fitted(self.family(candidates), candidates, theta).gain).sum())

    def marginalise_noise(self, candidates: Candidates, theta: Array, white: Array) -> Array:
        runs = self._fitted(self.family(candidates), candidates, theta)
        padded = np.zeros((self._recorded.size, white.shape[1]))
        padded[self._recorded.ravel()] = white
        return self._flat(runs.without(padded.reshape(*runs.residual.shape, -1)))

    def simulated(self, candidates: Candidates, theta: Array, channels: tuple[str, ...], at: Array) -> Array:
        """``channels`` (K, runs, channels, T) of ``candidates`` at ``at`` (K, p), from the best starts at ``theta``."""
        return self.replay_of(channels)(self.family(candidates), at, self.starts(candidates, theta))

    def starts(self, candidates: Candidates, theta: Array) -> Array:
        """Most probable initial state (runs, states)."""
        return self._fitted(self.family(candidates), candidates, theta).start

    def left(self, candidates: Candidates, theta: Array) -> list[Array]:
        """Measured minus computed signals of each run (T, channels), in their units, from the best starts."""
        runs = self._fitted(self.family(candidates), candidates, theta)
        white = runs.without(runs.residual[..., None]).reshape(self._recorded.shape)  # once more: nothing integrated
        residuals = []
        for run, white_run in zip(self.runs, white, strict=True):
            channels = zip(self.noise.values(), white_run[:, : len(run.time)], strict=True)
            residuals.append(np.stack([noise.colour_again(w) for noise, w in channels], 1))
        return residuals

    @cached_property
    def _recorded(self) -> NDArray[np.bool_]:
        """True at samples (R, C, T), False behind the end of runs shorter than the longest."""
        return self._bare.padded([np.ones(len(run.time))] * len(self.noise) for run in self.runs) > 0

    def _flat(self, rows: Array) -> Array:
        """The rows (R, C T, ...) of all runs below each other (n, ...)."""
        flat = rows.reshape(-1, *rows.shape[2:])
        return flat if self._recorded.all() else flat[self._recorded.ravel()]

    def _white(self, signals: Array) -> Array:
        """Signals (R, C, T, columns) -> whitened rows (R, C T, columns)."""
        white = limited(signals) / np.array([one.sd for one in self.noise.values()])[:, None, None]
        colour = np.array([one.colour for one in self.noise.values()])[:, None, None]
        if colour.any():
            innovation_sd = np.sqrt(1 - colour**2)
            for run in white:  # one after the other: whole copies of all would cost more than the arithmetic
                run[:, 1:] -= colour * run[:, :-1]
                run[:, 1:] /= innovation_sd
        if not self._recorded.all():
            white *= self._recorded[..., None]
        return white.reshape(len(white), -1, white.shape[-1])

    def _marginal(self, free: Array, white: Array, candidates: Candidates, states: Array) -> Marginal:
        """Integrate the initial states out, their prior sd ``states`` (and bias or drift, as candidates)."""
        scale = _scaled(states, free.shape[-1])
        phi = self._white(free) * scale
        n = phi.shape[-1]
        if {"bias", "drift"} & {c.identifier for c in candidates}:
            slow = self._slow(self._bare.length, tuple(self.noise), candidates)
            phi = np.concatenate([phi, self._white(slow)], -1)
        marginal = integrated_out(phi, white)
        return marginal._replace(start=marginal.start[:, :n] * scale)

    def _slow(self, length: int, channels: Sequence[str], candidates: Candidates) -> Array:
        """Signals (R, C, T, columns) that a bias, or a drift, among ``candidates`` adds to C ``channels`` by 1 sd."""
        names = [c.identifier for c in candidates]
        kinds = 2 if "drift" in names else int("bias" in names)
        signals = np.zeros((len(self.runs), len(channels), length, kinds * len(channels)))
        for r, run in enumerate(self.runs):
            n = len(run.time)
            for k, shape in enumerate([np.ones(n), np.linspace(-1.0, 1.0, n)][:kinds]):
                for c, name in enumerate(channels):
                    signals[r, c, :n, c + k * len(channels)] = SENSORS[name][1] * shape
        return signals

    # ---- search ----

    @property
    def varied(self) -> bool:
        """True if the runs are of two speeds, or pushed by two inputs."""
        pushed = {name for run in self.runs for name, u in run.inputs.items() if np.ptp(u) > 0}
        return len(about_one_speed(self.speeds.tolist())) > 1 or len(pushed) > 1

    def easier_problems(self) -> tuple["Histories", ...]:
        """The runs in pieces, each with a start of its own, as in multiple shooting; empty if runs are short.

        Bock (1983), Recent advances in parameter identification techniques for O.D.E.
        """
        short = tuple(piece for run in self.runs for piece in pieces(run))
        return (replace(self, runs=short),) if len(short) > len(self.runs) else ()

    def estimate_noise(self, best: Any) -> "Histories":
        """Noise estimated from the residuals of the ``best`` fit unless it was given; its colour in any case."""
        series = np.array(self.rows.series)
        noise = {
            name: old.estimated([best.residual[series == f"{run.name} {name}"] for run in self.runs])
            for name, old in self.noise.items()
        }
        absorbed = isinstance(best, Fit) and (not best.candidates or any(c.absorbs for c in best.candidates))
        if not absorbed:  # it may stand for a torque of the ride, whose size is not known with it
            return replace(self, noise=noise)
        named, theta = [c for c in best.candidates if not c.absorbs], list(best.theta[: best.effect_columns.start])
        for c in named:
            theta += best.theta[best.columns(c)].tolist()
        return replace(self, noise=noise, ridden=(tuple(named), np.array(theta)))

    # ---- what to measure next ----

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Channels that were not recorded, at the same runs, and a forced response."""
        total = sum(len(run.time) for run in self.runs)
        recorded = {*self.noise, *self.runs[0].inputs}
        channels = [
            Proposal(
                f"{name} in the same runs",
                np.full(total, sd),
                partial(self._channel, name),
                partial(self._starts_in, name, sd),
            )
            for name, sd in (("roll_rate_rad_s", 0.02), ("steer_rad", 0.005), ("yaw_rate_rad_s", 0.02))
            if name not in recorded
        ]
        return (*channels, *self.forced(float(self.speeds.max())))

    def _channel(self, channel: str, candidates: Candidates, theta: Array) -> Prediction:
        """The channel (m,) with the initial states that fit best, and its derivatives (m, p)."""
        batch, steps = self.family(candidates).stencil(theta)
        signals = self.simulated(candidates, theta, (channel,), batch)
        flat = np.concatenate([signals[:, k, 0, : len(run.time)] for k, run in enumerate(self.runs)], axis=1)
        return flat[0], central_differences(flat, steps)

    def _starts_in(self, channel: str, sd: float, candidates: Candidates, theta: Array) -> Prediction:
        """Effect of the starts of the same runs, and of a bias, on a further channel."""
        family = self.family(candidates)
        marginal, states = self._fitted(family, candidates, theta), start_sd(family)
        free = self.replay_of((channel,)).free(family, theta)[1][:, 0]
        free = free * _scaled(states, free.shape[-1])
        white = self._white_slopes(family, theta, marginal.start)
        uncertain, last = free.shape[-1] - len(states), marginal.start.shape[1]
        places = [*range(len(states)), *range(last - uncertain, last)]  # filters of the recorded channels lie between
        follow, spread = -marginal.follows(white)[:, places], marginal.spread[:, places]
        slow = self._slow(free.shape[1], (channel,), candidates)[:, 0]
        lengths = [len(run.time) for run in self.runs]
        spreads = [np.hstack([f[:n] @ s, e[:n]]) for f, s, e, n in zip(free, spread, slow, lengths, strict=True)]
        followed = np.vstack([f[:n] @ s for f, s, n in zip(free, follow, lengths, strict=True)])
        return followed / sd, block_diag(*spreads) / sd

    # ---- report ----

    def figures(self) -> dict[str, Figure]:
        return {"before_after": TRACES}

    def held_out_data(self) -> "Histories | None":
        return replace(self, runs=self.unseen, unseen=()) if self.unseen else None

    def residuals_by_channel(self, candidates: Candidates, theta: Array) -> dict[str, Array]:
        residuals = np.concatenate(self.left(candidates, theta))
        return dict(zip(self.noise, residuals.T, strict=True))

    def channel_noise_sd(self, left: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
        """Channels whose sd is estimated: it, and the noise from sample to sample by third differences."""
        ends = np.cumsum([len(run.time) for run in self.runs])[:-1]
        noise_sds = {}
        for name, noise in self.noise.items():
            pairs = zip((run.channels[name] for run in self.runs), np.split(left[name], ends), strict=True)
            squares = [[third_difference_noise(x) ** 2 for x in pair] for pair in pairs if len(pair[1]) >= 20]
            if squares and not noise.given:
                noise_sds[name] = (noise.sd, float(np.sqrt(np.mean(squares, axis=0).min())))
        return noise_sds

    # ---- doubts ----

    def doubts(self, judgement: Judgement, torque: Fit | None = None) -> tuple[str, ...]:
        sentences = []
        for name, noise in self.noise.items():
            size = max(float(np.sqrt(np.mean(run.channels[name] ** 2))) for run in self.runs)
            if size < 0.3 * noise.sd:  # noise of the stated sd has 1
                sentences.append(FAINT.format(channel=name, size=size, sd=noise.sd))
        ridden = not nobody_rides(self.model) and not {STEER, STEER_TORQUE} & {*self.runs[0].inputs}
        if ridden and judgement.verdict.verdict == "unknown":
            sentences.append(SOMEBODY)
        return (*sentences, *self._between_samples(judgement, torque))

    @property
    def taken_as_held(self) -> bool:
        """True if the torques are taken as held from sample to sample because most repeat, as nobody said."""
        return not self.runs[0].between and self._replay.held

    def _between_samples(self, judgement: Judgement, torque: Fit | None) -> tuple[str, ...]:
        """Torques that were taken as held from sample to sample, though linear ones fit clearly better."""
        named = judgement.verdict.verdict in (*NAMED, "none")
        if not self.taken_as_held or not (named or torque is not None):
            return ()
        compared = judgement.final if torque is None else torque
        least = 25 * max(1.0, compared.objective / len(compared.residual))
        linear = replace(self, runs=tuple(replace(run, between=AS_LINEAR) for run in self.runs))
        linear_fit = fit(linear, compared.candidates, starts=[compared.theta])
        if not linear_fit.objective < compared.objective - least:
            return ()
        names = ", ".join(name for name in self.runs[0].inputs if name in INPUTS)
        final = judgement.final
        model = final.name.replace("+", " + ") if final.candidates else "parameters only"
        model += " and the residual torque" * (torque is not None)
        n = len(compared.residual)
        return (BETWEEN.format(inputs=names, n=n, model=model, other=linear_fit.chi2, chi2=compared.chi2),)

    def misreadings(self) -> Iterator[tuple[str, Self]]:
        """Units and sign of each channel and torque, channels in each other's place, and the speeds."""
        for name in (*self.noise, *(name for name in self.runs[0].inputs if name != STEER)):
            for reading, factor in readings_of(name).items():
                yield f"{name} {reading}", self._read_as({name: name}, factor)
        for first, second in combinations(self.noise, 2):
            yield f"{first} and {second} swapped", self._read_as({first: second, second: first}, 1.0)
        for reading, factor in SPEEDS.items():
            yield reading, replace(self, runs=tuple(replace(run, speed=factor * run.speed) for run in self.runs))

    def _read_as(self, names: Mapping[str, str], factor: float) -> Self:
        """The runs with some signals under other names, times a factor, and their noise alike."""

        def read(signals: Mapping[str, Array]) -> dict[str, Array]:
            return {**signals, **{names[n]: factor * x for n, x in signals.items() if n in names}}

        noise = {names[n]: replace(one, sd=abs(factor) * one.sd) for n, one in self.noise.items() if n in names}
        runs = tuple(replace(run, channels=read(run.channels), inputs=read(run.inputs)) for run in self.runs)
        return replace(self, runs=runs, noise={**self.noise, **noise})

    def thin(self, most: int) -> Self:
        """Runs of all speeds, eight at least, of long ones the loudest part; whole ones if an angle is prescribed."""
        if len(self.rows.places) <= 2 * most:
            return self
        samples, lengths = most // len(self.noise), [len(run.time) for run in self.runs]
        whole = self.prescribed
        count = min(len(self.runs), max(8, round(samples / np.median(lengths))))
        order = np.argsort(self.speeds, kind="stable")
        chosen = [self.runs[k] for k in sorted(order[np.linspace(0, len(order) - 1, count).round().astype(int)])]
        runs = chosen if whole else [loudest(run, self.noise, samples // count) for run in chosen]
        return replace(self, runs=tuple(runs))

    def simplify(self) -> "Histories":
        """Eight runs at most, in pieces; three whole ones if a prescribed angle has to be smoothed."""
        whole = self.prescribed
        thinned = self.thin(RULES.thinned)
        thinned = replace(thinned, runs=thinned.runs[:: -(-len(thinned.runs) // (3 if whole else 8))])
        return thinned if whole else (thinned.easier_problems() or (thinned,))[-1]


@dataclass(frozen=True, kw_only=True)
class ReplayedTorque(Histories, kind="replay", table="histories"):
    """Time histories whose recorded steer torque is replayed."""

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> Histories:
        return super().read({"input": STEER_TORQUE, **content}, folder, common)
