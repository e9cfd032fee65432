"""Spectra of ordinary rides: nobody kicks the bicycle and nobody logs what moves it.

Auto and cross spectra of the recorded channels are compared with those of the model, moved by unknown torques and
forces and by a rider who steers; :mod:`studies.diagnosis.ride_likelihood` says how far they are.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bicycle.identification.recording import CHANNELS, STEER_TORQUE, Run
from studies.diagnosis.bicycle_kind import BicycleKind, without_motors
from studies.diagnosis.candidates import nobody_rides
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
from studies.diagnosis.ride_model import FEW_TURNS, Fitted, Gains, Rides
from studies.diagnosis.ride_reading import TABLE, read_rides
from studies.diagnosis.whitening import Marginal, integrate_starts_out
from studies.inference.evidence import folds
from studies.inference.kind import Candidates, Prediction, Rows, Series
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
        found = read_rides(content, folder, ridden=not nobody_rides(common["model"]))
        if found.rides.disturbances.controller_gains is not None or STEER_TORQUE in found.rides.spectra[0].channels:
            common, motor_notes = without_motors(content, common)
            found = replace(found, notes=(*found.notes, *motor_notes))
        return cls(
            **common,
            rides=found.rides,
            segments=found.segments,
            left_out=found.left_out,
            notes=(*found.notes, *found.left_out),
        )

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
        count = len(self.channels)
        short = [name.rsplit("_rad", 1)[0].replace("_", " ") for name in self.channels]
        entries = [f"{name}" for name in short]
        pairs = [f"{short[i]} and {short[j]}" for i, j in zip(*np.triu_indices(count, 1), strict=True)]
        entries += [f"{pair}, {part}" for part in ("real", "imaginary") for pair in pairs]
        places, series, abscissa, group, repeat = [], [], [], [], []
        for ride in self.rides.spectra:
            for band, hertz in enumerate(ride.hertz):
                places += [f"{entry}, {ride.speed:.3g} m/s, {hertz:.3g} Hz" for entry in entries]
                series += [f"{ride.name} {entry}" for entry in entries]
                abscissa += [hertz] * len(entries)
                group += [f"{ride.speed:.4g}"] * len(entries)
                repeat += [f"{6 * band // len(ride.hertz)}"] * len(entries)
        displays = {f"{ride.name} {entry}": Series(entry) for ride in self.rides.spectra for entry in entries}
        speeds = np.repeat(self.speeds, len(self.rides.spectra[0].hertz) * len(entries))
        fold = folds(group, speeds, repeat)
        return Rows(tuple(places), np.array(abscissa), tuple(series), fold, displays=displays, axis="frequency, Hz")

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
        shown = [outputs.index(name) for name in signals]
        answered = [outputs.index(name) for name in ANSWERED]
        motion, motion_slopes = values[:, shown], slope[:, :, shown]
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
        errors = family.coordinates(theta)
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

        They are sought from where the latest ones lead, and, ``anew``, from their own starts as well.
        """
        names = tuple(c.identifier for c in candidates)

        def settle() -> Settled:
            gains = self.gains(candidates, theta)
            z = self.rides.settle(gains, self._start(gains, names, theta), turns=FEW_TURNS)
            return self._settled(names, theta, Fitted(self.rides, gains, z))

        settled = self._last_settled.get((names, theta.tobytes()), settle)
        if anew and not settled.anew:
            settled = replace(self._settled(names, theta, self._from_all_starts(settled.fitted)), anew=True)
            self._last_settled.put((names, theta.tobytes()), settled)
        return settled

    def _settled(self, names: tuple[str, ...], theta: Array, fitted: Fitted) -> Settled:
        self._latest.append((names, theta, fitted))
        columns = fitted.disturbance_slopes
        linear = fitted.residual - np.einsum("rnk,rk->rn", columns, fitted.z)
        return Settled(fitted, integrate_starts_out(columns, linear[..., None]))

    def _from_all_starts(self, fitted: Fitted) -> Fitted:
        """The most probable disturbances of each ride: those of ``fitted`` or what its other starts lead to."""
        best = fitted
        for start in self.rides.disturbances.starts():
            z = self.rides.settle(fitted.gains, np.tile(start, (len(fitted.z), 1)), turns=FEW_TURNS)
            other = Fitted(self.rides, fitted.gains, z)
            better = other.objective < best.objective - WORTH
            if better.any():
                best = best.replaced(better, other)
        return best

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
            led = led + latest.follow(theta - latest_theta)
        objectives = [Fitted(self.rides, gains, z).objective for z in (self._first, led)]
        return np.where((objectives[1] < objectives[0])[:, None], led, self._first)

    @cached_property
    def _latest(self) -> "deque[tuple[tuple[str, ...], Array, Fitted]]":
        return deque(maxlen=1)

    @cached_property
    def _first(self) -> Array:
        """Disturbances (R, k) of the base model as stated: where each search for them begins."""
        gains = self.gains((), self.nominal, slopes=False)
        begin = np.tile(self.rides.disturbances.starts()[-1], (len(self.rides.spectra), 1))
        return self._from_all_starts(Fitted(self.rides, gains, self.rides.settle(gains, begin))).z

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
