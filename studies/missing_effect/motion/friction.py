"""Dry friction of the steering as a known torque: against the steer rate that was measured.

Coulomb friction is not linear in the motion, but with the sign of the measured steer rate it is linear in its size T:
the torque -T sign(rate) is replayed like a recorded one. While the steering sticks the torque is anything below T and
the sign means nothing; the sign is softened there by how well the rate is known, and the sticking itself is not
modelled. So this holds for motion that is large beside the noise and does not stop: a steering that rests for a good
part of a run is stiffer than this says, and a size found in such runs is too small.
"""

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter
from scipy.special import erf

from bicycle.identification.recording import STEER, STEER_TORQUE, Run
from studies.inference.parameter import Candidate
from studies.missing_effect.motion.sensor_errors import error
from tyre.base.arrays import Array

FRICTION = "measurement.steer_friction"
TYPICAL, LEAST = 0.5, 0.02  # N m
RATE, ANGLE = "steer_rate_rad_s", STEER
WINDOW, FEWEST, ORDER = 0.1, 5, 2  # s and samples over which a parabola smooths the rate


def friction_candidate() -> Candidate:
    """Dry friction of the steering as a candidate: it is there, and no mistake of a sensor."""
    torque = error("torque", "N m", FRICTION, TYPICAL, least=LEAST, lowest=0.0)
    signature = "a torque of one size against the steer rate"
    return Candidate("steer_friction", (torque,), signature=signature, approximate=True)  # sticking is left out


def friction_refused(run: Run) -> str:
    """Why friction of the steering cannot be tried on runs like ``run``; empty where it can."""
    if STEER in run.inputs:
        return (
            "" if STEER_TORQUE in run.channels else f"the steer angle is prescribed: only {STEER_TORQUE} would show it"
        )
    if RATE in run.channels or ANGLE in run.channels:
        return ""
    return f"the direction of friction is that of the steering, which was not recorded ({ANGLE} or {RATE})"


def direction(run: Run) -> Array:
    """Expected sign (n,) of the steer rate of a ``run``: -1 to 1, about 0 where noise hides it."""
    signals = {**run.inputs, **run.channels}
    derivative = 0 if RATE in signals else 1
    signal = signals[RATE if RATE in signals else ANGLE]
    window = max(FEWEST, round(WINDOW / run.step) // 2 * 2 + 1)
    window = min(window, len(signal) - 1 + len(signal) % 2)
    how = {"polyorder": ORDER, "deriv": derivative, "delta": run.step}
    rate = savgol_filter(signal, window, **how)
    sd = third_difference_noise(signal) * np.linalg.norm(savgol_coeffs(window, **how))
    return np.asarray(erf(rate / (np.sqrt(2.0) * max(float(sd), 1e-9))))


def third_difference_noise(signal: Array) -> float:
    """Sd of the white noise in a ``signal`` (n,), in its unit: noise of sd 1 has third differences of variance 20."""
    return float(np.std(np.diff(signal, 3)) / np.sqrt(20.0))
