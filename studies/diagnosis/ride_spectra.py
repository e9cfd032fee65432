"""Spectra of ordinary rides: nobody kicks the bicycle and nobody logs what moves it.

Auto and cross spectra of the recorded channels are compared with those of the model, moved by unknown torques and
forces and by a rider who steers; :mod:`studies.diagnosis.ride_likelihood` says how far they are.
"""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

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
from studies.diagnosis.ride_reading import TABLE, read_rides
from studies.diagnosis.whitening import Marginal, integrate_starts_out
from studies.inference.evidence import folds
from studies.inference.fit import ROUGH, fit
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
DRAWN, HOLDERS = 400, 24  # riders that are drawn, and of those who hold the bicycle that are tried
FIRST_TURNS, MOST_STARTS = 10, 4  # steps from each of them, and those that are followed to their end
ROUNDS = 4  # most fits of the base model, each with the riders who suit the latest one
NOTABLE = 2.0  # of a misfit, by which a rider is better than those before
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

    begun: Array | None = None  # (starts, R, k), disturbances of a similar measurement, from which others are sought
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
        shown = self._entries()
        places, series, abscissa, group, repeat = [], [], [], [], []
        for ride in self.rides.spectra:
            for band, hertz in enumerate(ride.hertz):
                places += [f"{name}, {ride.speed:.3g} m/s, {hertz:.3g} Hz" for name in shown]
                series += [f"{ride.name} {name}" for name in shown]
                abscissa += [hertz] * len(shown)
                group += [f"{ride.speed:.4g}"] * len(shown)
                repeat += [f"{6 * band // len(ride.hertz)}"] * len(shown)
        displays = {f"{ride.name} {name}": display for ride in self.rides.spectra for name, display in shown.items()}
        speeds = np.repeat(self.speeds, len(self.rides.spectra[0].hertz) * len(shown))
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
                yield f"{name} {reading}", replace(self, begun=self._starts, rides=self.rides.read_as(place, factor))
        for reading, factor in SPEEDS.items():
            yield reading, replace(self, begun=self._starts, rides=self.rides.at_speeds(factor))

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
            z = self.rides.settle(gains, self._start(gains, names, theta), turns=FEW_TURNS)
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
        """The most probable disturbances of each ride, stable if any are: ``fitted`` or what other starts lead to."""
        others = [
            Fitted(self.rides, fitted.gains, self.rides.settle(fitted.gains, start, turns=FEW_TURNS))
            for start in self._starts
        ]
        best = self._best_of(candidates, theta, [fitted, *others])
        return Fitted(self.rides, best.gains, self.rides.settle(best.gains, best.z))

    def _best_of(self, candidates: Candidates, theta: Array, several: Sequence[Fitted]) -> Fitted:
        """The best of ``several`` for each ride, the first where others are hardly better."""

        def demerit(one: Fitted) -> Array:
            return one.objective + DEMERIT * (self.growth(candidates, theta, one.z) > UNSTABLE)

        best = several[0]
        for other in several[1:]:
            better = demerit(other) < demerit(best) - WORTH
            if better.any():
                best = best.replaced(better, other)
        return best

    def growth(self, candidates: Candidates, theta: Array, z: Array) -> Array:
        """Largest growth (R,), 1/s, of the bicycle with whoever steers it, at disturbances ``z`` (R, k)."""
        return np.array([poles.real.max() for poles in self.closed_loop_poles(candidates, theta, z)])

    def closed_loop_poles(self, candidates: Candidates, theta: Array, z: Array) -> list[Complex]:
        """Eigenvalues (n + 2,), 1/s, of the bicycle with whoever steers it, for each ride."""
        rides = range(len(self.speeds))
        return [self._poles_of_ride(candidates, theta, z[ride : ride + 1], ride)[0] for ride in rides]

    def _poles_of_ride(self, candidates: Candidates, theta: Array, z: Array, ride: int) -> Complex:
        """Eigenvalues (m, n + 2), 1/s, of one ride with several disturbances ``z`` (m, k)."""
        family, loop = self.family(candidates), self.rides.disturbances
        names = family.symbolic
        stack = family(theta[None], self.speeds[ride : ride + 1])
        steered = stack.input[0, 0][:, [names.inputs.index("steer_torque")]]
        solved = np.linalg.solve(stack.mass[0, 0], np.hstack([stack.dynamics[0, 0], steered]))
        motion = stack.output[0, 0][[names.outputs.index(name) for name in ANSWERED]]
        closed = np.array([loop.closed_loop(solved[:, :-1], solved[:, -1], motion, one, ride) for one in z])
        finite = np.isfinite(closed).all((1, 2), keepdims=True)  # a bicycle without numbers is as unstable as can be
        return np.where(finite[..., 0], np.linalg.eigvals(np.where(finite, closed, 0.0)), np.inf).astype(complex)

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
        several = [Fitted(self.rides, gains, z) for z in self._starts]
        return self._best_of((), self.nominal, several).z

    @cached_property
    def _starts(self) -> Array:
        """Disturbances (starts, R, k) from which others are sought, from the best of the riders who hold the bicycle.

        Spectra are alike with very different riders, and a search from one of them ends at the next like him. Who is
        best depends on the bicycle: it is fitted with the best so far, then others are drawn who hold the fitted one.
        """
        if self.begun is not None:
            return self.begun
        starts = self._settle_holders(self.nominal, 0)
        for seed in range(1, ROUNDS + 1 if self.nuisances else 0):
            with np.errstate(invalid="ignore", over="ignore", divide="ignore"):  # a fit that failed is left at once
                fitted = fit(replace(self, begun=starts), (), turns=ROUGH)
            if not np.isfinite(fitted.objective):
                break
            gains = self.gains((), fitted.theta, slopes=False)
            old = np.array([self.rides.settle(gains, z) for z in starts])
            new = self._settle_holders(fitted.theta, seed)
            least = [np.min([Fitted(self.rides, gains, z).objective for z in some], 0) for some in (old, new)]
            starts = self._best_starts(gains, np.concatenate([old, new]))
            if (least[1] > least[0] - NOTABLE).all():
                break
        return starts

    def _settle_holders(self, theta: Array, seed: int) -> Array:
        """Disturbances (starts, R, k) that suit each ride best, of riders who hold the base model at ``theta`` (p,)."""
        gains = self.gains((), theta, slopes=False)
        several = np.array([self.rides.settle(gains, z, turns=FIRST_TURNS) for z in self._holders(theta, seed)])
        return np.array([self.rides.settle(gains, start) for start in self._best_starts(gains, several)])

    def _best_starts(self, gains: Gains, several: Array) -> Array:
        """The best of ``several`` disturbances (m, R, k) for each ride: (starts, R, k), best first."""
        order = np.argsort([Fitted(self.rides, gains, z).objective for z in several], axis=0)[:MOST_STARTS]
        return np.asarray(several[order, np.arange(several.shape[1])])

    def _holders(self, theta: Array, seed: int) -> Array:
        """Disturbances (riders, R, k): of riders who are drawn, those under whom the base model is stable or nearly."""
        loop = self.rides.disturbances
        if loop.steering != RIDER:
            return np.zeros((1, len(self.speeds), len(loop.names)))
        drawn = loop.draw(DRAWN, seed)
        each_ride = []
        for ride in range(len(self.speeds)):
            growth = np.array([poles.real.max() for poles in self._poles_of_ride((), theta, drawn, ride)])
            order = np.argsort(np.maximum(growth, 0.0), kind="stable")
            each_ride.append(drawn[order[:HOLDERS]])
        return np.stack(each_ride, 1)

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
