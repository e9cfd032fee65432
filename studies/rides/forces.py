"""Tyre forces and slip angles of an ordinary ride, with bands that carry noise, tyre and bicycle.

The recorded motion y and the forces x of the tyres answer the same unknown torques and forces, whose spectra the ride
itself shows. The best linear estimate of x is G y with G = S_xy S_yy^-1 (Wiener 1949), where S_yy has the noise of the
sensors too; its error has the spectrum S_xx - G S_yx. It is what a Kalman filter with its smoother gives away from the
ends of a ride. The numbers of bicycle, tyres, rider and disturbances are those that fit the spectra; their remaining
uncertainty moves G, and that moves the estimate.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from bicycle.identification.recording import CHANNELS
from studies.diagnosis.family import Family
from studies.diagnosis.harmonic_response import gain_matrices
from studies.diagnosis.ride_disturbances import ANSWERED, Disturbances, SlipVelocities
from studies.diagnosis.ride_model import Fitted
from studies.diagnosis.ride_spectra import RideSpectra
from studies.inference.fit import Fit
from tyre.ground.arrays import Array, Complex

WANTED = ("rear_lateral_force", "front_lateral_force", "rear_slip_velocity", "front_slip_velocity")
FASTEST_HZ = 25.0  # forces that change faster are not followed
FINE_HZ, COARSE_HZ = 0.02, 0.25  # steps of the frequencies of G, below and above the highest of the spectra
END = 2.0  # s at either end of a segment, where what came before or after is missing


@dataclass(frozen=True, eq=False)
class SegmentForces:
    """Estimates along one segment of a ride, about their mean; lateral forces to the right, x forward and z down."""

    name: str
    speed: float  # m/s
    time: Array  # (n,), s
    force: Array  # (2, n), N, rear and front
    force_sd: Array  # (2, n), N
    slip: Array  # (2, n), rad
    slip_sd: Array  # (2, n), rad


@dataclass(frozen=True, eq=False)
class Smoother:
    """Gain G from the recorded channels (C,) to the wanted signals (X,) of one ride, on a grid of frequencies."""

    hertz: Array  # (f,)
    gain: Complex  # (f, X, C)
    error: Array  # (f, X), spectra of the error, one-sided
    shifts: Complex  # (f, axes, X, C), change of G by 1 sd along each axis of what is uncertain

    def apply(self, signals: Array, step: float) -> tuple[Array, Array]:
        """Estimates (X, n) from ``signals`` (C, n), sampled every ``step`` (s), and their sd (X, n)."""
        n = signals.shape[1]
        padded = n + round(2 * END / step)
        hertz: Array = np.asarray(np.fft.rfftfreq(padded, step), float)
        transform = np.fft.rfft(signals - signals.mean(1, keepdims=True), padded)
        estimate = self._filtered(self.gain, transform, hertz, padded)[:, :n]
        variance: Array = np.repeat(scipy.integrate.trapezoid(self.error, self.hertz, axis=0)[:, None], n, 1)
        for axis in range(self.shifts.shape[1]):
            shift = self._filtered(self.shifts[:, axis], transform, hertz, padded)[:, :n]
            variance += shift**2
        return estimate, np.sqrt(variance)

    def _filtered(self, gain: Complex, transform: Complex, hertz: Array, length: int) -> Array:
        used = hertz <= self.hertz[-1]
        result = np.zeros((gain.shape[1], len(hertz)), complex)
        for x in range(gain.shape[1]):
            for c in range(gain.shape[2]):
                at = np.interp(hertz[used], self.hertz, gain[:, x, c].real).astype(complex)
                at += 1j * np.interp(hertz[used], self.hertz, gain[:, x, c].imag)
                result[x, used] += at * transform[c, used]
        return np.asarray(np.fft.irfft(result, length, axis=1))


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
        torque = -np.einsum("fk,fki->fi", answers, self.answered)
        torque /= (1 + np.einsum("fk,fk->f", answers, self.answered[..., 0]))[:, None]
        y = self.channels + self.channels[..., :1] * torque[:, None]
        x = self.wanted + self.wanted[..., :1] * torque[:, None]
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
    fine = np.arange(0.01, min(highest, end), FINE_HZ)
    return np.concatenate([fine, np.arange(fine[-1] + FINE_HZ, end, COARSE_HZ), [end]])


def smoother_of(kind: RideSpectra, final: Fit, ride: int, step: float) -> Smoother:
    """Smoother of the ride with number ``ride``, sampled every ``step`` (s), from the ``final`` fit of its spectra."""
    spectrum = kind.rides.spectra[ride]
    hertz = _grid(float(spectrum.hertz[-1]), step)
    base = kind.family(final.candidates)
    family = Family(base.base.with_effect(SlipVelocities()), base.nuisances, base.candidates, base.settings)
    signals = [CHANNELS[name] for name in kind.channels]
    outputs = list(dict.fromkeys([*signals, *ANSWERED, *WANTED]))
    speed = np.full(len(hertz), spectrum.speed)
    inputs = list(kind.rides.disturbances.inputs)

    def closed(theta: Array) -> _Closed:
        values, _ = gain_matrices(family, theta, speed, hertz, inputs, outputs, slopes=False)
        channels, answered, wanted = (
            values[:, [outputs.index(name) for name in names]] for names in (signals, ANSWERED, WANTED)
        )
        return _Closed(channels, answered, wanted, kind.rides.disturbances.of_ride(ride), hertz)

    settled = kind.settle(final.candidates, final.theta)
    z = settled.fitted.z[ride]
    here = closed(final.theta)
    wanted, across, _ = here.spectra(z)
    gain = here.gain(z)
    error = np.diagonal(wanted, axis1=1, axis2=2).real - np.einsum("fxc,fxc->fx", gain, across.conj()).real
    shifts = [
        (closed(final.theta + step_).gain(z + more) - closed(final.theta - step_).gain(z - more)) / 2
        if step_.any()
        else (here.gain(z + more) - here.gain(z - more)) / 2
        for step_, more in _axes(settled.fitted, final, ride)
    ]
    return Smoother(hertz, gain, np.maximum(error, 0.0), np.stack(shifts, 1))


def _axes(fitted: Fitted, final: Fit, ride: int) -> list[tuple[Array, Array]]:
    """Independent axes of what is uncertain, 1 sd each: changes of the coordinates (p,), and of the disturbances (k,).

    Disturbances follow the coordinates as they are most probable, and have a spread of their own about that.
    """
    columns = fitted.disturbance_slopes[ride]
    precision = columns.T @ columns + np.eye(columns.shape[1])
    follow = -np.linalg.solve(precision, columns.T @ fitted.slopes[ride])
    size, direction = np.linalg.eigh(final.covariance)
    scaled = direction.T * np.sqrt(np.maximum(size, 0.0))[:, None]
    axes = [(axis, follow @ axis) for axis in scaled]
    spread = np.linalg.cholesky(np.linalg.inv(precision))
    nothing = np.zeros(len(final.theta))
    return axes + [(nothing, column) for column in spread.T]


def ride_forces(kind: RideSpectra, final: Fit) -> tuple[SegmentForces, ...]:
    """Forces and slip angles along each segment of the rides of ``kind``, whose spectra ``final`` fits."""
    estimates = []
    for ride, runs in enumerate(kind.segments):
        smoother = smoother_of(kind, final, ride, runs[0].step)
        for run in runs:
            signals = np.stack([run.channels[name] for name in kind.channels])
            value, sd = smoother.apply(signals, run.step)
            kept = (run.time >= run.time[0] + END) & (run.time <= run.time[-1] - END)
            speed = kind.rides.spectra[ride].speed
            force, force_sd = value[:2, kept], sd[:2, kept]
            slip, slip_sd = -value[2:, kept] / speed, sd[2:, kept] / speed
            estimates.append(SegmentForces(run.name, speed, run.time[kept], force, force_sd, slip, slip_sd))
    return tuple(estimates)
