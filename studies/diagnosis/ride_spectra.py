"""Spectra of ordinary rides, without impulses and without a record of what moves the bicycle.

Auto and cross spectra of the recorded channels are compared with those of the model, moved by unknown torques and
forces and by a rider who steers; :mod:`studies.diagnosis.ride_likelihood` says how far they are.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
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
from studies.diagnosis.ride_model import FEW_TURNS, Fitted, Gains, Rides
from studies.diagnosis.ride_reading import TABLE, RidesRead, read_rides
from studies.diagnosis.ride_search import (
    OpenLoops,
    RidersDrawn,
    integrate_disturbances_out,
    most_probable,
    search_from,
    steady_riders,
)
from studies.diagnosis.whitening import Marginal
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


FAR_OFF = 12.0  # prior sd: no disturbance is sought further off
BAD = 2.0  # misfit a number of a ride, above which other riders are sought for a bicycle with other effects
EASIER = (0.003, 0.03, 0.3)  # shares of the misfit, one after the other, by which a search from far away begins
EVERY, SOON = 10, 4  # accepted points of a fit, at one of which riders are sought anew; the same where nobody holds it


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

    def easier_problems(self) -> tuple["RideSpectra", ...]:
        """Count less of the misfit: what the file states then outweighs what a wrong rider asks for."""
        return tuple(replace(self, rides=replace(self.rides, share=share)) for share in EASIER)

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
            flat_slope = np.moveaxis(slope[:, :, c], 2, 1).reshape(len(number), slope.shape[1]).copy()
            apply_sensor(number, flat_slope, np.repeat(s, inputs), errors_here)
            values[:, c] = number.reshape(-1, inputs)
            slope[:, :, c] = np.moveaxis(flat_slope.reshape(len(values), inputs, slope.shape[1]), 1, 2)
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

        They are sought from where the latest ones lead. ``anew``, as at each accepted point of a fit, the derivatives
        are there too, and now and then, or where no rider holds the bicycle, other riders are sought.
        """
        names = tuple(c.identifier for c in candidates)

        def settle() -> Settled:
            loops, gains = self.open_loops(candidates, theta), self.gains(candidates, theta, slopes=False)
            if not self._latest or self._latest[0][0] != names:
                return self._settled(self._search_anew(gains, loops))
            start = steady_riders(self.rides.disturbances, loops, self._start(theta))
            return self._settled(self._settle_near(gains, loops, start))

        settled = self._last_settled.get((names, theta.tobytes()), settle)
        if anew and not settled.anew:
            fitted, loops = settled.fitted, self.open_loops(candidates, theta)
            if not fitted.gains.with_slopes:
                fitted = Fitted(self.rides, self.gains(candidates, theta), fitted.z)
            holds = loops.hold(self.rides.disturbances, fitted.z, self._every_ride)
            if next(self._looks) % (EVERY if holds.all() else SOON) == 0:
                steady = steady_riders(self.rides.disturbances, loops, fitted.z)
                options = search_from(self.rides, fitted.gains, loops, self._riders.who_hold(loops), steady[None])
                fitted = most_probable(loops, [fitted, *options])
            settled = replace(self._settled(fitted), anew=True)
            self._last_settled.put((names, theta.tobytes()), settled)
            self._latest.append((names, theta, fitted))
        return settled

    def _settled(self, fitted: Fitted) -> Settled:
        return Settled(fitted, integrate_disturbances_out(fitted))

    def _settle_near(self, gains: Gains, loops: OpenLoops, start: Array) -> Fitted:
        """Fit rides from disturbances ``start`` (R, k) that are nearly right; who holds the bicycle still does."""
        holds = partial(loops.hold, self.rides.disturbances, rides=self._every_ride)
        return Fitted(self.rides, gains, self.rides.settle(gains, start, turns=FEW_TURNS, holds=holds))

    def _search_anew(self, gains: Gains, loops: OpenLoops) -> Fitted:
        """Fit rides from the disturbances of the last fit; riders are drawn where these fit badly."""
        usual = np.zeros((len(self.speeds), len(self.rides.disturbances.names)))
        led = steady_riders(self.rides.disturbances, loops, self._latest[0][2].z if self._latest else usual)
        if self._latest:
            fitted = self._settle_near(gains, loops, led)
            stable = loops.hold(self.rides.disturbances, fitted.z, self._every_ride)
            if (fitted.objective < BAD * fitted.residual.shape[1]).all() and stable.all():
                return fitted
            led = fitted.z
        return most_probable(loops, search_from(self.rides, gains, loops, self._riders.who_hold(loops), led[None]))

    def closed_loop_poles(self, candidates: Candidates, theta: Array, z: Array) -> list[Complex]:
        """Eigenvalues (n + 2,), 1/s, of the bicycle with whoever steers it, for each ride."""
        return [*self.open_loops(candidates, theta).poles(self.rides.disturbances, z, self._every_ride)]

    @property
    def _every_ride(self) -> NDArray[np.intp]:
        """Numbers (R,) of the rides."""
        return np.arange(len(self.rides.spectra))

    def open_loops(self, candidates: Candidates, theta: Array) -> OpenLoops:
        """The bicycles of all rides without whoever steers them."""
        family = self.family(candidates)
        names = family.symbolic
        stack = family(theta[None], self.speeds)
        steered = stack.input[0][:, :, [names.inputs.index("steer_torque")]]
        solved = np.linalg.solve(stack.mass[0], np.concatenate([stack.dynamics[0], steered], 2))
        motion = stack.output[0][:, [names.outputs.index(name) for name in ANSWERED]]
        return OpenLoops(solved[..., :-1], solved[..., -1], motion)

    @cached_property
    def _riders(self) -> RidersDrawn:
        return RidersDrawn(self.rides.disturbances)

    @cached_property
    def _looks(self) -> Iterator[int]:
        """Numbers of the accepted points, at some of which other riders are sought."""
        return count(1)

    @cached_property
    def _last_settled(self) -> LastAnswer[Settled]:
        return LastAnswer()

    def _start(self, theta: Array) -> Array:
        """Disturbances (R, k) to which the latest ones lead as the bicycle moves on to ``theta`` (p,)."""
        _, latest_theta, latest = self._latest[0]
        moved = latest.z + latest.follow(theta - latest_theta)
        return np.where(np.isfinite(moved).all(1, keepdims=True), np.clip(moved, -FAR_OFF, FAR_OFF), latest.z)

    @cached_property
    def _latest(self) -> "deque[tuple[tuple[str, ...], Array, Fitted]]":
        return deque(maxlen=1)

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
