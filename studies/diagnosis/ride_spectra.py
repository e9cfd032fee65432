"""Spectra of ordinary rides: nobody kicks the bicycle and nobody logs what moves it.

Auto and cross spectra of the recorded channels are compared with those of the model, moved by unknown torques and
forces and by a rider who steers; :mod:`studies.diagnosis.ride_likelihood` says how far they are.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.recording import CHANNELS, STEER_TORQUE, Run
from studies.diagnosis.bicycle_kind import BicycleKind, without_motors
from studies.diagnosis.candidates import nobody_rides
from studies.diagnosis.doubts import SPEEDS, readings_of
from studies.diagnosis.family import Family, Settings
from studies.diagnosis.harmonic_response import gain_matrices
from studies.diagnosis.mistakes import (
    BOX,
    ROTATION,
    apply_sensor,
    delay_error,
    errors_of,
    gain_error,
    lowpass_error,
    rotation_error,
    speed_errors,
    turn_axes,
)
from studies.diagnosis.ride_disturbances import ANSWERED, CONTROLLER, NOBODY, RIDER, YawMoment
from studies.diagnosis.ride_figures import DENSITIES
from studies.diagnosis.ride_model import FEW_TURNS, Fitted, Gains, Holds, Rides
from studies.diagnosis.ride_reading import TABLE, RidesRead, read_rides
from studies.diagnosis.whitening import Marginal, integrate_starts_out
from studies.inference.evidence import folds
from studies.inference.kind import Candidates, Figure, Prediction, Rows, Series
from studies.inference.last_answer import LastAnswer
from studies.inference.parameter import Candidate
from tyre.ground.arrays import Array, Complex

SENSORS = {
    "roll_rate_rad_s": "roll_rate", "yaw_rate_rad_s": "yaw_rate", "steer_rate_rad_s": "steer_rate",
    "steer_rad": "steer", "lean_rad": "lean", STEER_TORQUE: "steer_torque",
}  # fmt: skip


def _with_first_input(gains: Complex) -> Complex:
    """Gains (m, C, i) with a further channel that shows the first input."""
    row = np.zeros((len(gains), 1, gains.shape[2]), complex)
    row[..., 0] = 1.0
    return np.concatenate([gains, row], 1)


def _with_nothing(slopes: Complex) -> Complex:
    """Derivatives (m, p, C, i) of gains with a further channel that does not depend on the bicycle."""
    return np.concatenate([slopes, np.zeros_like(slopes[:, :, :1])], 2)


UNSTABLE = 0.3  # 1/s: a ride of minutes whose motion grows faster is none
DEMERIT = 20.0  # of a misfit, of disturbances that make the bicycle unstable
RIDERS, MOST_DRAWN = 8, 4000  # riders who hold the bicycle from whom a search begins, and most draws for them
TURNS_FROM_AFAR = 30  # most steps of such a search
FAR_OFF = 12.0  # prior sd: no disturbance is sought further off
EVERY = 3  # accepted points of a fit, of which one is looked at from all starts
WORTH = 0.1  # of a misfit: other disturbances that lower it by less are the same


@dataclass(frozen=True, eq=False)
class Settled:
    """Rides at one point: gains, most probable disturbances, and what integrating these out leaves."""

    fitted: Fitted
    marginal: Marginal
    anew: bool = False  # sought from all starts


@dataclass(frozen=True, kw_only=True)
class RideSpectra(BicycleKind, kind="ride_spectra"):
    """Spectra of rides at one speed or more."""

    thorough = False
    keys: ClassVar[Any] = TABLE
    columns: ClassVar[tuple[str, ...]] = ("time_s", *CHANNELS, STEER_TORQUE)
    rides: Rides
    segments: tuple[tuple[Run, ...], ...] = ()  # of each ride: stretches at steady speed, from which its spectra are

    left_out: tuple[str, ...] = ()  # sentences: parts of the recordings that are not used, and why

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "RideSpectra":
        rides = read_rides(content, folder, ridden=not nobody_rides(common["model"]))
        return cls.of_rides(rides, content, common)

    @classmethod
    def of_rides(cls, rides: RidesRead, content: Mapping[str, Any], common: Mapping[str, Any]) -> "RideSpectra":
        """The measurement of ``rides``; motors are taken out of the model if their torque is in a recorded one."""
        motor_notes: tuple[str, ...] = ()
        spectra = rides.rides
        if spectra.disturbances.controller_gains is not None or STEER_TORQUE in spectra.spectra[0].channels:
            common, motor_notes = without_motors(content, common)
        notes = (*rides.notes, *motor_notes, *rides.left_out)
        return cls(**common, rides=spectra, segments=rides.segments, left_out=rides.left_out, notes=notes)

    # ---- candidates ----

    def mistakes(self) -> tuple[Candidate, ...]:
        """Speed; gain, delay and low-pass of each channel but the first; a turned box of gyros."""
        errors = [*speed_errors(self.speeds.tolist())]
        channels = self.channels
        for name in channels[1:]:  # the first is what the others are compared with: no torque has a size
            errors += [gain_error(SENSORS[name], name, reference=SENSORS[channels[0]].replace("_", " "))]
            errors += [delay_error(SENSORS[name], name), lowpass_error(SENSORS[name], name)]
        if set(BOX) <= set(channels):
            errors.append(rotation_error())
        return tuple(errors)

    def assumptions(self) -> tuple[str, ...]:
        inputs = ", ".join(name.replace("_", " ") for name in self.rides.disturbances.inputs)
        who = {RIDER: "a rider who steers, ", CONTROLLER: "a controller, ", NOBODY: ""}[
            self.rides.disturbances.steering
        ]
        return (f"{who}{inputs} of unknown size move the bicycle, each with a smooth spectrum of its own",)

    # ---- physics ----

    @property
    def channels(self) -> tuple[str, ...]:
        """Recorded channels (C,)."""
        return self.rides.spectra[0].channels

    @property
    def speeds(self) -> Array:
        return np.array([ride.speed for ride in self.rides.spectra])

    @property
    def recordings(self) -> tuple[str, ...]:
        return tuple(ride.name for ride in self.rides.spectra)

    def family(self, candidates: Candidates, settings: Settings = ()) -> Family:
        """The base model with ``candidates`` and a moment about the vertical as a further input."""
        return self._recent_families.get(
            (settings, *map(id, candidates)), lambda: Family(self._moved, self.nuisances, candidates, settings)
        )

    @cached_property
    def _moved(self) -> Any:
        return self.model.with_effect(YawMoment())

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """A series is an entry of the spectra of one ride, along frequency."""
        entries = self._entries()
        places, series, abscissa, group, repeat = [], [], [], [], []
        for ride in self.rides.spectra:
            for band, hertz in enumerate(ride.hertz):
                places += [f"{name}, {ride.speed:.3g} m/s, {hertz:.3g} Hz" for name in entries]
                series += [f"{ride.name} {name}" for name in entries]
                abscissa += [hertz] * len(entries)
                group += [f"{ride.speed:.4g}"] * len(entries)
                repeat += [f"{6 * band // len(ride.hertz)}"] * len(entries)
        displays = {f"{ride.name} {name}": display for ride in self.rides.spectra for name, display in entries.items()}
        speeds = np.repeat(self.speeds, len(self.rides.spectra[0].hertz) * len(entries))
        fold = folds(group, speeds, repeat)
        return Rows(tuple(places), np.array(abscissa), tuple(series), fold, displays=displays, axis="frequency, Hz")

    def _entries(self) -> dict[str, Series]:
        """Displays of the C^2 numbers of a band: densities of the channels, and parts of their coherencies."""
        short = [name.partition("_rad")[0].partition("_N_m")[0].replace("_", " ") for name in self.channels]
        entries = {name: Series(name, "density", logarithm=True) for name in short}
        for part in ("real", "imaginary"):
            for i, j in zip(*np.triu_indices(len(short), 1), strict=True):
                name = f"{short[i]} and {short[j]}, {part}"
                entries[name] = Series(name, f"coherency, {part} part")
        return entries

    def _show(self, spectra: Complex) -> Array:
        """Numbers (R b C^2,) of ``spectra`` (R, b, C, C) in the order of the rows: logarithms and coherencies."""
        density = np.diagonal(spectra, axis1=-2, axis2=-1).real
        coherency = spectra / np.sqrt(density[..., :, None] * density[..., None, :])
        above = coherency[..., *np.triu_indices(len(self.channels), 1)]
        return np.concatenate([np.log(density), above.real, above.imag], -1).ravel()

    def measured_by_channel(self) -> dict[str, Array]:
        """Logarithms of measured densities and parts of measured coherencies (m,) by their name."""
        return self._by_channel(self._show(self.rides.misfit.measured))

    def residuals_by_channel(self, candidates: Candidates, theta: Array) -> dict[str, Array]:
        """Measured minus computed numbers (m,), as :meth:`measured_by_channel` gives them."""
        computed = self.settle(candidates, theta, anew=True).fitted.spectra
        return self._by_channel(self._show(self.rides.misfit.measured) - self._show(computed))

    def _by_channel(self, numbers: Array) -> dict[str, Array]:
        channels = self.rows.channels
        return {name: numbers[channels == name] for name in dict.fromkeys(channels.tolist())}

    def misreadings(self) -> Iterator[tuple[str, "RideSpectra"]]:
        """Units and signs of the channels, and the unit of the speeds."""
        for place, name in enumerate(self.channels):
            for reading, factor in readings_of(name).items():
                yield f"{name} {reading}", replace(self, rides=self.rides.read_as(place, factor))
        for reading, factor in SPEEDS.items():
            yield reading, replace(self, rides=self.rides.at_speeds(factor))

    def figures(self) -> dict[str, Figure]:
        return {"before_after": DENSITIES}

    def gains(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Gains:
        """Gains of the bicycle, as the sensors show them, at all frequencies of all rides."""
        nodes = self.rides.nodes
        shape = nodes.shape
        family = self.family(candidates)
        signals = [CHANNELS[name] for name in self.channels if name != STEER_TORQUE]
        outputs = list(dict.fromkeys([*signals, *ANSWERED]))
        speed = np.broadcast_to(self.speeds[:, None, None], shape).ravel()
        values, slope = gain_matrices(
            family, theta, speed, nodes.ravel(), list(self.rides.disturbances.inputs), outputs, slopes=slopes
        )
        recorded = [outputs.index(name) for name in signals]
        answered = [outputs.index(name) for name in ANSWERED]
        motion, motion_slopes = values[:, recorded], slope[:, :, recorded]
        if STEER_TORQUE in self.channels:  # the last channel: the torque itself, the first input
            motion, motion_slopes = _with_first_input(motion), _with_nothing(motion_slopes)
        s: Complex = np.asarray(2j * np.pi * nodes.ravel())
        channels, channel_slopes = self._as_shown(family, theta, s, motion, motion_slopes)
        return Gains(
            channels.reshape(*shape, *channels.shape[1:]),
            values[:, answered].reshape(*shape, len(answered), -1),
            channel_slopes.reshape(*shape, *channel_slopes.shape[1:]),
            slope[:, :, answered].reshape(*shape, slope.shape[1], len(answered), values.shape[2]),
        )

    def _as_shown(
        self, family: Family, theta: Array, s: Complex, values: Complex, slope: Complex
    ) -> tuple[Complex, Complex]:
        """Gains (m, C, i) and slopes (m, p, C, i) as boxes that are turned and other sensors show them."""
        errors = family.measurement_errors(theta)
        inputs = values.shape[2]
        if ROTATION[1] in errors:
            values, slope = self._turned(errors, values, slope)
        for c, name in enumerate(self.channels):
            errors_here = errors_of(errors, name)
            if not any(errors_here):
                continue
            number = values[:, c].ravel().copy()
            flat_slope = np.moveaxis(slope[:, :, c], 2, 1).reshape(len(number), -1).copy()
            apply_sensor(number, flat_slope, np.repeat(s, inputs), errors_here)
            values[:, c] = number.reshape(-1, inputs)
            slope[:, :, c] = np.moveaxis(flat_slope.reshape(-1, inputs, slope.shape[1]), 1, 2)
        return values, slope

    def _turned(
        self, errors: Mapping[str, tuple[int, float]], values: Complex, slope: Complex
    ) -> tuple[Complex, Complex]:
        """Gains and slopes with the axes of roll and yaw gyro turned."""
        lean, yaw = (self.channels.index(name) for name in BOX)
        angles = np.array([errors[key][1] for key in ROTATION])

        def turn(turned: Array) -> Array:
            return np.array(turn_axes(dict(zip(ROTATION, turned, strict=True))))

        pair = [lean, yaw]
        straight = values[:, pair]
        values, slope = values.copy(), slope.copy()
        values[:, pair] = turn(angles) @ straight
        if slope.shape[1]:
            slope[:, :, pair] = turn(angles) @ slope[:, :, pair]
            for k, key in enumerate(ROTATION):
                step = 1e-5 * np.eye(3)[k]
                change = (turn(angles + step) - turn(angles - step)) / 2e-5
                slope[:, errors[key][0], pair] += change @ straight
        return values, slope

    def settle(self, candidates: Candidates, theta: Array, *, anew: bool = False) -> Settled:
        """Most probable disturbances at ``theta`` (p,), and residuals with the disturbances integrated out.

        They are sought from where the latest ones lead. ``anew``, and where these need a rider who makes the bicycle
        unstable, they are sought from their own starts too: spectra hardly tell a growth from a decay.
        """
        names = tuple(c.identifier for c in candidates)

        def settle() -> Settled:
            first_of_its_kind = not self._latest or self._latest[0][0] != names
            gains = self.gains(candidates, theta)
            z = self.rides.settle(
                gains, self._start(gains, names, theta), turns=FEW_TURNS, holds=self._holds(candidates, theta)
            )
            fitted = Fitted(self.rides, gains, z)
            if first_of_its_kind:
                fitted = self._from_all_starts(candidates, theta, fitted)
            return self._settled(names, theta, fitted)

        settled = self._last_settled.get((names, theta.tobytes()), settle)
        if anew and not settled.anew:
            fitted = settled.fitted
            due = next(self._looks) % EVERY == 0
            if due or (self.growth(candidates, theta, fitted.z) > UNSTABLE).any():
                fitted = self._from_all_starts(candidates, theta, fitted)
                settled = self._settled(names, theta, fitted)
            settled = replace(settled, anew=True)
            self._last_settled.put((names, theta.tobytes()), settled)
        return settled

    def _settled(self, names: tuple[str, ...], theta: Array, fitted: Fitted) -> Settled:
        self._latest.append((names, theta, fitted))
        columns = fitted.disturbance_slopes
        linear = fitted.residual - np.einsum("rnk,rk->rn", columns, fitted.z)
        return Settled(fitted, integrate_starts_out(columns, linear[..., None]))

    def _from_all_starts(self, candidates: Candidates, theta: Array, fitted: Fitted) -> Fitted:
        """The most probable disturbances of each ride: those of ``fitted``, or what riders who are drawn lead to.

        Spectra are alike with very different riders, and a search ends at the next one of them. Few riders hold a
        bicycle upright; from one who does, without a step to any who does not, the search mostly ends at the best.
        """
        holds = self._holds(candidates, theta)
        best = fitted
        for start in self._riders(holds):
            z = self.rides.settle(fitted.gains, start, turns=TURNS_FROM_AFAR, holds=holds)
            other = Fitted(self.rides, fitted.gains, z)
            demerits = [one.objective + DEMERIT * ~holds(one.z) for one in (other, best)]
            better = demerits[0] < demerits[1] - WORTH
            if better.any():
                best = best.replaced(better, other)
        return best

    def _riders(self, holds: Holds) -> Array:
        """Disturbances (starts, R, k): riders from the prior who hold the bicycle of each ride, all else usual."""
        loop, rides = self.rides.disturbances, len(self.speeds)
        if loop.steering != RIDER:
            return np.zeros((1, rides, len(loop.names)))
        starts = np.zeros((RIDERS, rides, len(loop.names)))
        counts = np.zeros(rides, int)
        rng = np.random.default_rng(1)
        for _ in range(MOST_DRAWN):
            drawn = loop.draw_loops(rides, rng)
            for ride in np.flatnonzero(holds(drawn) & (counts < RIDERS)):
                starts[counts[ride], ride] = drawn[ride]
                counts[ride] += 1
            if (counts == RIDERS).all():
                break
        return starts[: max(counts.max(), 1)]

    def growth(self, candidates: Candidates, theta: Array, z: Array) -> Array:
        """Largest growth (R,), 1/s, of the bicycle with whoever steers it, at disturbances ``z`` (R, k)."""
        return np.array([poles.real.max() for poles in self.closed_loop_poles(candidates, theta, z)])

    def closed_loop_poles(self, candidates: Candidates, theta: Array, z: Array) -> list[Complex]:
        """Eigenvalues (n + 2,), 1/s, of the bicycle with whoever steers it, for each ride."""
        rides = range(len(self.speeds))
        return [self._poles_of_ride(candidates, theta, z[ride : ride + 1], ride)[0] for ride in rides]

    def _poles_of_ride(self, candidates: Candidates, theta: Array, z: Array, ride: int) -> Complex:
        """Eigenvalues (m, n + 2), 1/s, of one ride with several disturbances ``z`` (m, k)."""
        return self._poles(*self._open_loop(candidates, theta, ride), z, ride)

    def _open_loop(self, candidates: Candidates, theta: Array, ride: int) -> tuple[Array, Array, Array]:
        """State matrix (n, n), effect (n,) of the steer torque and rows (4, n) of what a rider answers, of one ride."""
        family = self.family(candidates)
        names = family.symbolic
        stack = family(theta[None], self.speeds[ride : ride + 1])
        steered = stack.input[0, 0][:, [names.inputs.index("steer_torque")]]
        solved = np.linalg.solve(stack.mass[0, 0], np.hstack([stack.dynamics[0, 0], steered]))
        motion = stack.output[0, 0][[names.outputs.index(name) for name in ANSWERED]]
        return solved[:, :-1], solved[:, -1], motion

    def _poles(self, state: Array, steered: Array, motion: Array, z: Array, ride: int) -> Complex:
        loop = self.rides.disturbances
        closed = np.array([loop.closed_loop(state, steered, motion, one, ride) for one in z])
        finite = np.isfinite(closed).all((1, 2), keepdims=True)  # a bicycle without numbers is as unstable as can be
        return np.where(finite[..., 0], np.linalg.eigvals(np.where(finite, closed, 0.0)), np.inf).astype(complex)

    def _holds(self, candidates: Candidates, theta: Array) -> Holds:
        """Whether rides are stable under disturbances: a ride that lasts for minutes is."""
        loops = [self._open_loop(candidates, theta, ride) for ride in range(len(self.speeds))]

        def holds(z: Array) -> NDArray[np.bool_]:
            growths = [self._poles(*loop, z[r : r + 1], r).real.max() for r, loop in enumerate(loops)]
            return np.array(growths) < UNSTABLE

        return holds

    @cached_property
    def _looks(self) -> Iterator[int]:
        """Numbers of the looks for other disturbances, of which every third is taken in any case."""
        return count(1)

    @cached_property
    def _last_settled(self) -> LastAnswer[Settled]:
        return LastAnswer()

    def _start(self, gains: Gains, names: tuple[str, ...], theta: Array) -> Array:
        """Disturbances (R, k) to begin with: those of the base model or as the latest ones lead on, as fits better."""
        if not self._latest:
            return self._first
        latest_names, latest_theta, latest = self._latest[0]
        led = latest.z
        if latest_names == names:
            moved = led + latest.follow(theta - latest_theta)
            return np.where(np.isfinite(moved).all(1, keepdims=True), np.clip(moved, -FAR_OFF, FAR_OFF), self._first)
        objectives = [Fitted(self.rides, gains, z).objective for z in (self._first, led)]
        return np.where((objectives[1] < objectives[0])[:, None], led, self._first)

    @cached_property
    def _latest(self) -> "deque[tuple[tuple[str, ...], Array, Fitted]]":
        return deque(maxlen=1)

    @cached_property
    def _first(self) -> Array:
        """Disturbances (R, k) of the base model as stated: where each search for them begins."""
        gains = self.gains((), self.nominal, slopes=False)
        usual = np.zeros((len(self.speeds), len(self.rides.disturbances.names)))
        return self._from_all_starts((), self.nominal, Fitted(self.rides, gains, usual)).z

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        """Whitened residual (n,), disturbances integrated out, and its derivative (n, p)."""
        settled = self.settle(candidates, theta, anew=slopes)
        residual = settled.marginal.residual.ravel()
        if not slopes or not len(theta):
            return residual, np.empty((len(residual), 0))
        changes = settled.marginal.integrate_out(settled.fitted.slopes)
        return residual, changes.reshape(len(residual), -1)

    def log_determinant(self, candidates: Candidates, theta: Array) -> float:
        """Sum of ln(1 + s^2), s the singular values of the responses to 1 prior sd of each disturbance."""
        return float(-2 * np.log1p(self.settle(candidates, theta).marginal.gain).sum())

    def marginalise_noise(self, candidates: Candidates, theta: Array, white: Array) -> Array:
        """Residuals (n, draws) of ``white`` noise (n, draws) once the disturbances are integrated out of it."""
        marginal = self.settle(candidates, theta).marginal
        shape = (*marginal.residual.shape, white.shape[1])
        return marginal.integrate_out(white.reshape(shape)).reshape(white.shape)
