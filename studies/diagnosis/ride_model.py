"""Spectra of rides from a bicycle's gains: the loop of the rider closed, the disturbances most probable."""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.tapered_spectra import RideSpectrum
from studies.diagnosis.ride_disturbances import NOBODY, PLACE, PLACE_SPREAD, Disturbances
from studies.diagnosis.ride_likelihood import SpectralMisfit
from tyre.ground.arrays import Array, Complex

TURNS = 40  # most steps to the most probable disturbances from far away
FEW_TURNS = 15  # and from near
LONGEST = 1.5  # step of a coordinate, in prior standard deviations
SETTLED = 1e-4  # of the misfit: a step that promises less is the last; its effect is linear and counted anyway
STUCK = 1e5  # damping at which no step leads further down


Holds = Callable[[Array], NDArray[np.bool_]]
"""Disturbances (R, k) -> rides (R,) that are stable under them."""


@dataclass(frozen=True, eq=False)
class Gains:
    """Open-loop gains of R rides in b bands at q frequencies each, SI, from i inputs, and their derivatives."""

    channels: Complex  # (R, b, q, C, i), as the sensors show them
    answered: Complex  # (R, b, q, 4, i): lean, its rate, steer, its rate
    channel_slopes: Complex  # (R, b, q, p, C, i)
    answered_slopes: Complex  # (R, b, q, p, 4, i)

    @property
    def with_slopes(self) -> bool:
        """True if the derivatives are there."""
        return bool(self.channel_slopes.size)

    def of_ride(self, number: int) -> "Gains":
        """Gains of one ride."""
        parts = (self.channels, self.answered, self.channel_slopes, self.answered_slopes)
        return Gains(*(part[number : number + 1] for part in parts))

    def repeated(self, times: int) -> "Gains":
        """Gains several ``times``, without derivatives."""
        channels, answered = (np.tile(part, (times, *(1,) * 4)) for part in (self.channels, self.answered))
        return Gains(channels, answered, channels[:, :, :, None][:, :, :, :0], answered[:, :, :, None][:, :, :, :0])


@dataclass(frozen=True, eq=False)
class Rides:
    """Measured spectra of R rides with the same channels and bands, and what disturbed them."""

    spectra: tuple[RideSpectrum, ...]
    disturbances: Disturbances
    share: float = 1.0  # of the misfit that counts: less makes a search from far away easier

    @cached_property
    def misfit(self) -> SpectralMisfit:
        """Measured spectra, ready to be compared."""
        values, averages = ([getattr(ride, name) for ride in self.spectra] for name in ("values", "averages"))
        return SpectralMisfit(np.array(values), np.array(averages), self.share)

    @cached_property
    def nodes(self) -> Array:
        """Frequencies (R, b, q), Hz."""
        return np.array([ride.nodes for ride in self.spectra])

    @property
    def weights(self) -> Array:
        """Weights (q,) of the frequencies of a band."""
        return self.spectra[0].weights

    def read_as(self, channel: int, factor: float) -> "Rides":
        """Copy with the ``channel`` of this number times ``factor``, a unit or sign in which it may be meant."""
        factors = np.ones(len(self.spectra[0].channels))
        factors[channel] = factor
        spectra = tuple(replace(ride, values=ride.values * np.outer(factors, factors)) for ride in self.spectra)
        floors = self.disturbances.floors * factors**2
        return replace(self, spectra=spectra, disturbances=replace(self.disturbances, floors=floors))

    def of_ride(self, number: int) -> "Rides":
        """One of the rides."""
        return replace(self, spectra=(self.spectra[number],), disturbances=self.disturbances.of_ride(number))

    def repeated(self, times: int) -> "Rides":
        """The same rides, one after the other, all of them several ``times``."""
        return replace(self, spectra=self.spectra * times, disturbances=self.disturbances.repeated(times))

    def at_speeds(self, factor: float) -> "Rides":
        """Copy with all speeds times ``factor``."""
        return replace(self, spectra=tuple(replace(ride, speed=factor * ride.speed) for ride in self.spectra))

    def settle(self, gains: Gains, start: Array, *, turns: int = TURNS, holds: Holds | None = None) -> Array:
        """Most probable disturbances z (R, k) for these ``gains``, from ``start`` (R, k); Levenberg and Marquardt.

        ``holds`` states for disturbances (R, k) which rides are stable; no step leaves these.
        """
        stable = np.zeros(len(start), bool) if holds is None else holds(start)
        z, damping = start.copy(), np.full(len(start), 1e-4)
        state = Fitted(self, gains, z)
        identity = np.eye(z.shape[1])
        for _ in range(turns):
            slopes = state.disturbance_slopes
            normal = slopes.swapaxes(1, 2) @ slopes + identity
            force = (slopes.swapaxes(1, 2) @ state.residual[..., None])[..., 0] + z
            diagonal = np.diagonal(normal, axis1=1, axis2=2)[:, None] * identity
            step = np.linalg.solve(normal + damping[:, None, None] * diagonal, force[..., None])[..., 0]
            step *= np.minimum(1.0, LONGEST / np.abs(step).max(1, keepdims=True))
            tried = Fitted(self, gains, z - np.nan_to_num(step))
            gained = state.objective - tried.objective
            better = gained > 0
            if holds is not None and stable.any():
                better &= holds(tried.z) | ~stable
            promised = np.abs((force * step).sum(1))  # decrease that the linearised residuals promise, or more
            settled = (promised < SETTLED * (1 + state.objective)) | (damping > STUCK)
            damping = np.where(better, damping / 5, damping * 8)
            if better.all():
                z, state = tried.z, tried
            elif better.any():
                z = np.where(better[:, None], tried.z, z)
                state = state.replaced(better, tried)
            if settled.all():
                break
        return z


class Fitted:
    """Rides at some gains and disturbances z (R, k): residuals and their derivatives."""

    def __init__(self, rides: Rides, gains: Gains, z: Array) -> None:
        self.rides, self.gains, self.z = rides, gains, z
        self._mixed = rides.disturbances.mix(z)[:, None, None]
        self._channels, self._answered = gains.channels @ self._mixed, gains.answered @ self._mixed
        s: Complex = np.asarray(2j * np.pi * rides.nodes)
        loop = rides.disturbances
        self._answers = loop.answers(z, s)
        steered = self._answered[..., 0]
        self._loop_gain = 1 + np.einsum("rbqk,rbqk->rbq", self._answers, steered)
        self._torque = -np.einsum("rbqk,rbqki->rbqi", self._answers, self._answered) / self._loop_gain[..., None]
        self.closed = self._channels + self._channels[..., :1] * self._torque[..., None, :]
        self._white = rides.misfit.whiten(self.closed)
        self.densities = loop.densities(z, rides.nodes)  # (R, b, q, i)
        self._weighted = self.densities * rides.weights[:, None]
        inverse = rides.misfit.root_inverse
        self._floors = inverse * loop.noise(z)[:, None, None, :] @ inverse.conj().swapaxes(-1, -2)
        relative = self._products(self._white * self._weighted[..., None, :], self._white) + self._floors
        residual, self.axes = rides.misfit.residual(relative)
        self.residual = residual.reshape(len(z), -1)

    def replaced(self, rides: NDArray[np.bool_], other: "Fitted") -> "Fitted":
        """Copy with the ``rides`` (R,) of the ``other``, which has the same gains."""
        mixed = copy.copy(self)
        for name in ("disturbance_slopes", "slopes"):
            vars(mixed).pop(name, None)
        for name, value in list(vars(mixed).items()):
            if isinstance(value, np.ndarray):
                chosen = rides.reshape(-1, *(1,) * (value.ndim - 1))
                setattr(mixed, name, np.where(chosen, getattr(other, name), value))
        mixed.axes = self.axes.replaced(rides, other.axes)
        return mixed

    @staticmethod
    def _products(left: Complex, right: Complex) -> Complex:
        """Sums (R, b, C, C) over frequencies and inputs of left right^H, both (R, b, q, C, i)."""
        rides, bands, _, channels, _ = left.shape
        flat = [np.moveaxis(part, 2, 3).reshape(rides, bands, channels, -1) for part in (left, right)]
        return np.asarray(flat[0] @ flat[1].conj().swapaxes(-1, -2))

    @property
    def objective(self) -> Array:
        """Misfit and penalty (R,)."""
        return np.asarray((self.residual**2).sum(1) + (self.z**2).sum(1))

    @property
    def spectra(self) -> Complex:
        """Spectra (R, b, C, C) of the model, product of the channels' units per Hz."""
        noise = self.rides.disturbances.noise(self.z)[:, None, :, None] * np.eye(self.closed.shape[3])
        return self._products(self.closed * self._weighted[..., None, :], self.closed) + noise

    @cached_property
    def disturbance_slopes(self) -> Array:
        """Derivatives (R, b C^2, k) of the residuals by the disturbances."""
        rides, loop = self.rides, self.rides.disturbances
        white, weights = self._white, self.rides.weights
        # products of each input's column, weighted by what a number of its spectrum changes
        columns = white.transpose(0, 1, 4, 3, 2)[:, :, :, None]  # (R, b, i, 1, C, q)
        changed = loop.density_slopes(self.z, rides.nodes).transpose(0, 1, 3, 4, 2) * weights
        by_spectra = (columns * changed[..., None, :]) @ columns.conj().swapaxes(-1, -2)
        parts = [by_spectra.reshape(*by_spectra.shape[:2], -1, *by_spectra.shape[4:])]
        push = loop.inputs.index("lateral_push")
        pushed = white[..., push] * self._weighted[..., push, None]
        for name in PLACE:
            half = np.einsum("rbqc,rbqd->rbcd", white[..., loop.inputs.index(name)], pushed.conj())
            parts.append(PLACE_SPREAD * (half + half.conj().swapaxes(-1, -2))[:, :, None])
        if rides.disturbances.steering != NOBODY:
            changes = loop.answer_slopes(self.z, np.asarray(2j * np.pi * rides.nodes))
            steered = rides.misfit.whiten(self._channels[..., :1])[..., 0]
            # the torque on the handlebar changes by -(dg z + T dg z_steer) / (1 + g z_steer)
            answered = self._answered + self._answered[..., :1] * self._torque[..., None, :]
            torque = -(changes.swapaxes(-1, -2) @ answered) / self._loop_gain[..., None, None]  # (R, b, q, l, i)
            scaled = torque * self._weighted[..., None, :]
            back = scaled @ white.conj().swapaxes(-1, -2)  # (R, b, q, l, C)
            half = steered.swapaxes(-1, -2)[:, :, None] @ back.swapaxes(2, 3)  # (R, b, l, C, C)
            parts.append(half + half.conj().swapaxes(-1, -2))
        inverse, floors = rides.misfit.root_inverse, loop.noise(self.z)
        columns = inverse.swapaxes(-1, -2)[..., None]  # (R, b, C, C, 1): one of R^-1 a channel
        parts.append(2 * floors[:, None, :, None, None] * columns @ columns.conj().swapaxes(-1, -2))
        return self._flat_slopes(np.concatenate(parts, 2))

    @cached_property
    def slopes(self) -> Array:
        """Derivatives (R, b C^2, p) of the residuals by the coordinates of the bicycle, at fixed disturbances."""
        mixed = self._mixed[:, :, :, None]
        channel_slopes, answered_slopes = self.gains.channel_slopes @ mixed, self.gains.answered_slopes @ mixed
        by_answers = np.einsum("rbqk,rbqpki->rbqpi", self._answers, answered_slopes)
        torque = -(by_answers + self._torque[..., None, :] * by_answers[..., :1]) / self._loop_gain[..., None, None]
        change = channel_slopes + channel_slopes[..., :1] * self._torque[..., None, None, :]
        change = change + self._channels[..., None, :, :1] * torque[..., None, :]
        rides, bands, nodes, p, channels, inputs = change.shape
        white = self.rides.misfit.whiten(change) * self._weighted[..., None, None, :]
        left = white.transpose(0, 1, 3, 4, 2, 5).reshape(rides, bands, p * channels, nodes * inputs)
        right = np.moveaxis(self._white, 2, 3).reshape(rides, bands, channels, -1)
        half = (left @ right.conj().swapaxes(-1, -2)).reshape(rides, bands, p, channels, channels)
        return self._flat_slopes(half + half.conj().swapaxes(-1, -2))

    def follow(self, change: Array) -> Array:
        """Change (R, k) of the most probable disturbances with a ``change`` (p,) of the bicycle's coordinates."""
        columns = self.disturbance_slopes
        normal = columns.swapaxes(1, 2) @ columns + np.eye(columns.shape[2])
        moved = (self.slopes @ change)[..., None]
        return -np.asarray(np.linalg.solve(normal, columns.swapaxes(1, 2) @ moved))[..., 0]

    def _flat_slopes(self, change: Complex) -> Array:
        slopes = self.axes.slopes(change)
        return slopes.reshape(len(slopes), -1, slopes.shape[-1])
