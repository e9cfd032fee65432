"""Tyre forces and slip angles of an ordinary ride, with bands that carry noise, tyre and bicycle.

The recorded motion y and the forces x of the tyres answer the same unknown torques and forces, whose spectra the ride
itself shows. The best linear estimate of x from a record without ends is G y with G = S_xy S_yy^-1 (Wiener 1949), where
S_yy has the noise of the sensors too; its error has the spectrum S_xx - G S_yx. Here the inverse of the covariance of
all samples of a segment takes the place of S_yy^-1, so that the estimate is what a Kalman filter with its smoother
gives, at the ends too; offsets of the sensors are estimated along. The numbers of bicycle, tyres, rider and
disturbances are those that fit the spectra; their remaining uncertainty moves G, and that moves the estimate.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from bicycle.identification.recording import CHANNELS, STEER_TORQUE, Run
from studies.diagnosis.family import Family
from studies.diagnosis.harmonic_response import gain_matrices
from studies.diagnosis.ride_disturbances import ANSWERED, Disturbances, SlipVelocities
from studies.diagnosis.ride_model import Fitted
from studies.diagnosis.ride_spectra import RideSpectra
from studies.inference.fit import Fit
from studies.rides.tops import tops_of
from tyre.ground.arrays import Array, Complex

WANTED = (
    "rear_lateral_force",
    "front_lateral_force",
    "rear_slip_velocity",
    "front_slip_velocity",
)  # and the lateral push
FASTEST_HZ = 25.0  # forces that change faster are not followed
ENOUGH_HZ = 4 * FASTEST_HZ  # samples that are enough for them; a faster recording takes memory and shows no more
SLOWEST_HZ, RATIO = 5e-4, 1.1  # lowest frequency of G; below 0.2 Hz, where G falls as 1/f, each is 10 % above the last
FINE_HZ, COARSE_HZ = 0.02, 0.25  # steps of the frequencies of G, below and above the highest of the spectra
BEYOND = 80.0  # s of unknown motion in the circle that closes a record
SHORT, FROM_END = 40.0, (0.0, 0.5, 2.0, 6.0)
"""s: length of a record on which the variance near its ends is found, and distances from an end."""
STEP = 0.3  # sd: a whole one may lead to a ride that is unstable
SOLVED, ROUGHLY, STEPS = 1e-3, 1e-2, 200  # relative errors of a solution, of one for a variance; most steps to it


@dataclass(frozen=True, eq=False)
class SegmentForces:
    """Estimates along one segment of a ride; lateral forces to the right, x forward and z down."""

    name: str
    speed: float  # m/s
    time: Array  # (n,), s
    force: Array  # (2, n), N, rear and front
    force_sd: Array  # (2, n), N
    slip: Array  # (2, n), rad
    slip_sd: Array  # (2, n), rad
    push: Array  # (n,), N, what else acted on the bicycle from the side, such as wind
    push_sd: Array  # (n,), N


@dataclass(frozen=True, eq=False)
class Smoother:
    """Spectra of recorded channels (C,) and wanted signals (X,) of one ride at frequencies (f,), one-sided, per Hz."""

    hertz: Array  # (f,)
    recorded: Complex  # (f, C, C), S_yy
    across: Complex  # (f, X, C), S_xy
    wanted: Array  # (f, X), diagonal of S_xx
    error: Array  # (f, X), of the estimate, far from the ends
    shifts: Complex  # (f, axes, X, C), change of G by 1 sd along each axis of what is uncertain

    def apply(self, signals: Array, step: float) -> tuple[Array, Array]:
        """Estimates (X, n) from ``signals`` (C, n), sampled every ``step`` (s), and their sd (X, n)."""
        channels, n = signals.shape
        record = Record(self.hertz, self.recorded, n, step)
        across = record.at_bins(self.across)
        # an offset of each sensor is estimated too: nothing is known of it
        columns = np.eye(channels)[:, :, None] * np.ones(n)
        solved = record.solve(np.concatenate([signals[None], columns]))
        between = solved[1:].sum(2)
        offsets = np.linalg.solve(between.T, solved[0].sum(1))
        weights = solved[0] - np.einsum("k,kcn->cn", offsets, solved[1:])
        estimate = record.filtered(across, weights)
        by_offset = np.stack([record.filtered(across, column) for column in solved[1:]])
        spread = np.linalg.inv(between) / (2 * step)
        variance = np.einsum("kxn,kl,lxn->xn", by_offset, spread, by_offset)
        variance += self._noise_variance(n, step)
        continued = record.continued(weights)
        for axis in range(self.shifts.shape[1]):
            variance += record.filtered(record.at_bins(self.shifts[:, axis]), continued) ** 2
        return estimate, np.sqrt(variance)

    def _noise_variance(self, n: int, step: float) -> Array:
        """Variance (X, n) that the noise and the inputs leave; near the ends more, for there is nothing beyond."""
        inside = scipy.integrate.trapezoid(self.error, self.hertz, axis=0)
        short = Record(self.hertz, self.recorded, min(n, round(SHORT / step)), step)
        places = np.unique(np.minimum(np.round(np.array(FROM_END) / step).astype(int), short.n // 2))
        both = np.concatenate([places, short.n - 1 - places, [short.n // 2]])
        left = self._variance_at(short, both)
        more = np.maximum(left[:, :-1] - left[:, -1:], 0.0)
        from_start, from_end = np.arange(n), np.arange(n)[::-1]
        return np.stack(
            [
                inside[x]
                + np.interp(from_start, places, more[x, : len(places)])
                + np.interp(from_end, places, more[x, len(places) :])
                for x in range(len(inside))
            ]
        )

    def _variance_at(self, record: "Record", places: NDArray[np.int_]) -> Array:
        """Variance (X, places) that a record leaves at some samples: S_xx less k' A^-1 k, k the covariances with it."""
        across = record.at_bins(self.across)
        turns = np.exp(-2j * np.pi * np.outer(places, np.arange(len(across))) / record.length)
        left = []
        for x in range(across.shape[1]):
            lagged = np.einsum("fc,pf->pcf", across[:, x].conj(), turns)
            columns = scipy.fft.irfft(lagged, record.length)[..., : record.n]
            explained = (columns * record.solve(columns, ROUGHLY)).sum((1, 2)) / (2 * record.step)
            left.append(scipy.integrate.trapezoid(self.wanted[:, x], self.hertz) - explained)
        return np.array(left)


class Record:
    """Samples (C, n) of channels with known spectra, in a circle of time that is longer: what lies beyond is unknown.

    Their covariance A is a part of that of the circle, whose inverse is known at each frequency; conjugate gradients
    with the same part of that inverse solve A x = y in some tens of steps (Chan & Ng 1996, SIAM Review 38, 427-482).
    """

    def __init__(self, hertz: Array, spectra: Complex, n: int, step: float) -> None:
        self.n, self.step = n, step
        self.length = int(scipy.fft.next_fast_len(n + round(BEYOND / step), real=True))
        self._hertz, self._bins = hertz, np.asarray(np.fft.rfftfreq(self.length, step), float)
        self._spectra = self.at_bins(spectra, beyond=True)
        self._inverse = np.asarray(np.linalg.inv(self._spectra), complex)

    def at_bins(self, values: Complex, *, beyond: bool = False) -> Complex:
        """Interpolate ``values`` (f, ...) to the frequencies of the circle; 0 above the last unless ``beyond``."""
        flat = values.reshape(len(values), -1)
        columns = [
            np.interp(self._bins, self._hertz, column.real) + 1j * np.interp(self._bins, self._hertz, column.imag)
            for column in flat.T
        ]
        interpolated = np.stack(columns)
        if not beyond:
            interpolated[:, self._bins > self._hertz[-1]] = 0
        return np.moveaxis(interpolated.reshape(*values.shape[1:], -1), -1, 0)

    def filtered(self, gain: NDArray[Any], signals: Array) -> Array:
        """Answers (..., X, n) of a ``gain`` (bins, X, C) to signals (..., C, n) that are 0 beyond."""
        transform = scipy.fft.rfft(signals, self.length)
        answers = np.zeros((*signals.shape[:-2], gain.shape[1], gain.shape[0]), complex)
        for x in range(gain.shape[1]):
            for c in range(
                gain.shape[2]
            ):  # by columns: a product of matrices for each frequency takes four times longer
                answers[..., x, :] += gain[:, x, c] * transform[..., c, :]
        return np.asarray(scipy.fft.irfft(answers, self.length))[..., : self.n]

    def continued(self, weights: Array) -> Array:
        """The whole circle (C, length) as it is most probable, from ``weights`` A^-1 y (C, n)."""
        transform = scipy.fft.rfft(weights, self.length)
        whole = np.einsum("fdc,cf->df", self._spectra, transform)
        return np.asarray(scipy.fft.irfft(whole, self.length))

    def solve(self, right: Array, accuracy: float = SOLVED) -> Array:
        """Solve A x = ``right`` (k, C, n) for x (k, C, n)."""
        x = self.filtered(self._inverse, right)
        size = (right * x).sum((1, 2))
        left = right - self.filtered(self._spectra, x)
        direction = steered = self.filtered(self._inverse, left)
        fall = (left * steered).sum((1, 2))
        for _ in range(STEPS):
            if (fall <= accuracy**2 * size).all():
                break
            moved = self.filtered(self._spectra, direction)
            along = fall / np.maximum((direction * moved).sum((1, 2)), np.finfo(float).tiny)
            x = x + along[:, None, None] * direction
            left = left - along[:, None, None] * moved
            steered = self.filtered(self._inverse, left)
            latest = (left * steered).sum((1, 2))
            direction = steered + (latest / np.maximum(fall, np.finfo(float).tiny))[:, None, None] * direction
            fall = latest
        return x


@dataclass(frozen=True, eq=False)
class _Closed:
    """Closed-loop gains on the grid and what disturbs, for one ride."""

    channels: Complex  # (f, C, i), from the inputs, the loop open
    answered: Complex  # (f, 4, i)
    wanted: Complex  # (f, X, i)
    disturbances: Disturbances
    hertz: Array  # (f,)

    def spectra(self, z: Array) -> tuple[Complex, Complex, Complex]:
        """S_xx (f, X, X), S_xy (f, X, C) and S_yy (f, C, C) at disturbances ``z`` (k,)."""
        at = z[None]
        nodes = self.hertz[None, :, None]
        answers = self.disturbances.answers(at, np.asarray(2j * np.pi * nodes))[0, :, 0]
        mixed = self.disturbances.mix(at)[0]
        channels, answered, wanted = self.channels @ mixed, self.answered @ mixed, self.wanted @ mixed
        torque = -np.einsum("fk,fki->fi", answers, answered)
        torque /= (1 + np.einsum("fk,fk->f", answers, answered[..., 0]))[:, None]
        y = channels + channels[..., :1] * torque[:, None]
        x = wanted + wanted[..., :1] * torque[:, None]
        density = self.disturbances.densities(at, nodes)[0, :, 0][:, None]
        y_h, x_h = y.conj().swapaxes(1, 2), x.conj().swapaxes(1, 2)
        noise = np.diag(self.disturbances.noise(at)[0])
        return (x * density) @ x_h, (x * density) @ y_h, (y * density) @ y_h + noise

    def gain(self, z: Array) -> Complex:
        """G (f, X, C)."""
        _, across, recorded = self.spectra(z)
        return np.asarray(np.linalg.solve(recorded, across.conj().swapaxes(1, 2)).conj().swapaxes(1, 2))


def _grid(highest: float, step: float) -> Array:
    end = min(FASTEST_HZ, 0.5 / step)
    slow = SLOWEST_HZ * RATIO ** np.arange(np.log(FINE_HZ / (RATIO - 1) / SLOWEST_HZ) / np.log(RATIO))
    fine = np.arange(slow[-1] + FINE_HZ, min(highest, end), FINE_HZ)
    return np.concatenate([slow, fine, np.arange(fine[-1] + FINE_HZ, end, COARSE_HZ), [end]])


def smoother_of(kind: RideSpectra, final: Fit, ride: int, step: float) -> Smoother:
    """Smoother of the ride with number ``ride``, sampled every ``step`` (s), from the ``final`` fit of its spectra."""
    spectrum = kind.rides.spectra[ride]
    hertz = _grid(float(spectrum.hertz[-1]), step)
    base = kind.family(final.candidates)
    family = Family(base.base.with_effect(SlipVelocities()), base.nuisances, base.candidates, base.settings)
    signals = [CHANNELS[name] for name in kind.channels if name != STEER_TORQUE]
    outputs = list(dict.fromkeys([*signals, *ANSWERED, *WANTED]))
    speed = np.full(len(hertz), spectrum.speed)
    inputs = list(kind.rides.disturbances.inputs)

    def itself(name: str) -> Array:
        """Gains (f, 1, i) of an input that is itself a signal."""
        return np.tile(np.eye(len(inputs))[[inputs.index(name)]], (len(hertz), 1, 1))

    def closed(theta: Array) -> _Closed:
        values, _ = gain_matrices(family, theta, speed, hertz, inputs, outputs, slopes=False)
        channels, answered, wanted = (
            values[:, [outputs.index(name) for name in names]] for names in (signals, ANSWERED, WANTED)
        )
        if STEER_TORQUE in kind.channels:  # the last channel
            channels = np.concatenate([channels, itself("steer_torque")], 1)
        wanted = np.concatenate([wanted, itself("lateral_push")], 1)
        return _Closed(channels, answered, wanted, kind.rides.disturbances.of_ride(ride), hertz)

    settled = kind.settle(final.candidates, final.theta, anew=True)
    z = settled.fitted.z[ride]
    loop = closed(final.theta)
    wanted, _, recorded = loop.spectra(z)
    tops, weights = tops_of(kind.rides.of_ride(ride), settled.fitted.gains.of_ride(ride), z)
    gain, error, spread = _over_tops(loop, tops, weights)
    shifts = [
        (closed(final.theta + part).gain(z + more) - closed(final.theta - part).gain(z - more)) / (2 * STEP)
        if part.any()
        else (loop.gain(z + more) - loop.gain(z - more)) / (2 * STEP)
        for part, more in ((STEP * a, STEP * b) for a, b in uncertain_axes(settled.fitted, final, ride))
    ]
    sizes = np.diagonal(wanted, axis1=1, axis2=2).real
    return Smoother(hertz, recorded, gain @ recorded, sizes, error, np.stack([*shifts, *spread], 1))


def _over_tops(closed: _Closed, tops: Array, weights: Array) -> tuple[Complex, Array, list[Complex]]:
    """Mean gain (f, X, C) and error (f, X) over sets of disturbances ``tops`` (t, k) with ``weights`` (t,).

    The third are changes of the gain whose squares add up to its variance over the sets.
    """
    gains = [closed.gain(z) for z in tops]
    mean = np.asarray(sum(weight * gain for weight, gain in zip(weights, gains, strict=True)))
    error = np.zeros(mean.shape[:2])
    for z, gain, weight in zip(tops, gains, weights, strict=True):
        wanted, across, _ = closed.spectra(z)
        left = np.diagonal(wanted, axis1=1, axis2=2).real - np.einsum("fxc,fxc->fx", gain, across.conj()).real
        error += weight * np.maximum(left, 0.0)
    return mean, error, [np.sqrt(weight) * (gain - mean) for gain, weight in zip(gains, weights, strict=True)]


def uncertain_axes(fitted: Fitted, final: Fit, ride: int) -> list[tuple[Array, Array]]:
    """Independent axes of what is uncertain, 1 sd each: changes of the coordinates (p,), and of the disturbances (k,).

    Disturbances follow the coordinates as they are most probable, and have a spread of their own about that.
    """
    columns = fitted.disturbance_slopes[ride]
    precision = columns.T @ columns + np.eye(columns.shape[1])
    spread = np.linalg.cholesky(np.linalg.inv(precision))
    nothing = np.zeros(len(final.theta))
    alone = [(nothing, column) for column in spread.T]
    if not len(final.theta):  # tyre and bicycle are known
        return alone
    follow = -np.linalg.solve(precision, columns.T @ fitted.slopes[ride])
    size, direction = np.linalg.eigh(final.covariance)
    scaled = direction.T * np.sqrt(np.maximum(size, 0.0))[:, None]
    axes = [(axis, follow @ axis) for axis in scaled]
    return axes + alone


def thinned(run: Run) -> Run:
    """Keep every so many samples of a ``run``, 100 a second or more, low-passed before; a slower one as it is."""
    every = int(1 / (ENOUGH_HZ * run.step) + 1e-6)
    if every < 2:
        return run

    def thin(signals: Mapping[str, Array]) -> dict[str, Array]:
        return {k: np.asarray(scipy.signal.resample_poly(x, 1, every, padtype="line")) for k, x in signals.items()}

    return replace(run, time=run.time[::every], channels=thin(run.channels), inputs=thin(run.inputs))


def segment_forces(kind: RideSpectra, final: Fit) -> tuple[SegmentForces, ...]:
    """Forces and slip angles along each segment of the rides of ``kind``, whose spectra ``final`` fits.

    Where it does not fit them, uncertainties are larger by the root of chi^2 for each number (Birge 1932).
    """
    estimates = []
    for ride, segments in enumerate(kind.segments):
        runs = [thinned(run) for run in segments]
        smoother = smoother_of(kind, final, ride, runs[0].step)
        for run in runs:
            recorded = {**run.channels, **run.inputs}
            signals = np.stack([recorded[name] for name in kind.channels])
            value, sd = smoother.apply(signals, run.step)
            sd *= final.noise_factor
            speed = kind.rides.spectra[ride].speed
            slip, slip_sd = -value[2:4] / speed, sd[2:4] / speed
            estimates.append(
                SegmentForces(run.name, speed, run.time, value[:2], sd[:2], slip, slip_sd, value[4], sd[4])
            )
    return tuple(estimates)
