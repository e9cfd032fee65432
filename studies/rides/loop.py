"""Modes of a bicycle together with whoever steers it, from the spectra of its rides."""

from dataclasses import dataclass

import numpy as np

from studies.diagnosis.ride_spectra import RideSpectra
from studies.inference.fit import Fit
from studies.rides.forces import uncertain_axes

STEP = 0.3  # sd; a whole one may exchange modes
SLOWEST, FASTEST = 1.0, 60.0  # rad/s


@dataclass(frozen=True)
class LoopMode:
    """An oscillation of bicycle and rider, or controller, at one speed."""

    speed: float  # m/s
    real: float  # 1/s; negative where it decays
    real_sd: float  # 1/s
    imaginary: float  # rad/s
    imaginary_sd: float  # rad/s


def loop_modes(kind: RideSpectra, final: Fit) -> list[list[LoopMode]]:
    """Oscillations of each ride, the slowest first, with the uncertainty of the ``final`` fit.

    Poles of the bicycle whose steer torque answers the motion as the spectra say. Their standard deviations carry the
    coordinates of the fit and the loop, times the noise factor of the fit where it does not explain the data.
    """
    fitted = kind.settle(final.candidates, final.theta, anew=True).fitted
    poles = kind.closed_loop_poles(final.candidates, final.theta, fitted.z)
    modes = []
    for ride, speed in enumerate(kind.speeds.tolist()):
        oscillations = sorted((p for p in poles[ride] if SLOWEST < p.imag < FASTEST), key=lambda pole: pole.imag)
        variance = np.zeros((len(oscillations), 2))
        for change, disturbed in uncertain_axes(fitted, final, ride):
            z = fitted.z.copy()
            z[ride] += STEP * disturbed
            moved = kind.closed_loop_poles(final.candidates, final.theta + STEP * change, z)[ride]
            for row, pole in enumerate(oscillations):
                shift = (moved[np.argmin(np.abs(moved - pole))] - pole) / STEP
                variance[row] += shift.real**2, shift.imag**2
        sd = final.noise_factor * np.sqrt(variance)
        modes.append(
            [LoopMode(speed, p.real, float(s[0]), p.imag, float(s[1])) for p, s in zip(oscillations, sd, strict=True)]
        )
    return modes
