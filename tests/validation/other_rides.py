"""SYNTHETIC rides of a second kind, made after the fitter was finished: other inputs, another rider, other mathematics.

The bicycle is that of ``ride_bicycle``. The side force is wind of von Karman's spectrum (1948, Proceedings of the
National Academy of Sciences 34, 530-539) whose size swings by a third. The lean torque is pink noise. The rider answers
lean and steer after a pure delay and a lag, corrects by pulses at random times, and follows bends along a spline.
Nothing of that is in the family of the fitter. The motion is marched with held inputs.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from tests.validation.ride_bicycle import INPUTS, Motion, Random, Real, RiddenBicycle, draw_bicycle
from tests.validation.ride_generator import (
    FED_BACK,
    SAMPLE,
    STYLES,
    TRIES,
    Leg,
    Ride,
    Rider,
    Sensors,
    tune_rider,
)
from tyre.ground import InputError

STEP = 0.002  # s, over which inputs are held
EACH = round(SAMPLE / STEP)
SETTLING = 20.0  # s, before the recording begins
DECAYED, LEFT = 8.0, 0.05  # s, and the share of a free motion that may be left then
RIDERS = 12  # drawn for a bicycle, most of whom do not hold it after a pure delay
SWING, SWING_PERIOD = 0.33, 60.0  # of the size of the wind, s


@dataclass(frozen=True)
class Inputs:
    """Torques and forces (4, n) in the order of ``INPUTS``, those of bends apart from the rest."""

    rest: Real
    bends: Real


def von_karman(hertz: Real, time: float) -> Real:
    """Density of turbulence of variance 1, 1/Hz, of which the eddies take ``time`` (s) to pass."""
    return np.asarray(4 * time / (1 + 70.8 * (hertz * time) ** 2) ** (5 / 6))


def coloured(density: Real, count: int, rng: Random) -> Real:
    """Noise (count,) sampled every ``STEP`` with a one-sided ``density`` at the frequencies of its transform."""
    white = rng.standard_normal((2, len(density)))
    transform = (white[0] + 1j * white[1]) * np.sqrt(density * count / STEP) / 2
    return np.asarray(np.fft.irfft(transform, count))


def pulses(rate: float, count: int, rng: Random) -> Real:
    """Corrections (count,): raised cosines of 0.2 to 0.5 s at random times, ``rate`` a second, of normal sizes."""
    signal = np.zeros(count)
    for begin in rng.integers(0, count, rng.poisson(rate * count * STEP)):
        length = round(rng.uniform(0.2, 0.5) / STEP)
        shape = (1 - np.cos(2 * np.pi * np.arange(length) / length)) / 2
        end = min(count, begin + length)
        signal[begin:end] += rng.standard_normal() * shape[: end - begin]
    return signal


def draw_inputs(count: int, rng: Random) -> Inputs:
    """Inputs of a ride of ``count`` steps."""
    hertz = np.fft.rfftfreq(count, STEP)
    time = STEP * np.arange(count)
    rest = np.zeros((len(INPUTS), count))
    at = INPUTS.index
    pink = 1 / np.maximum(hertz, 0.05) / (1 + (hertz / 3) ** 4)  # a body does not sway faster
    swing = 1 + SWING * np.sin(2 * np.pi * time / SWING_PERIOD + rng.uniform(0, 2 * np.pi))
    wind = coloured(von_karman(hertz, rng.uniform(0.3, 2.0)), count, rng)
    rest[at("side_force")] = rng.uniform(6, 14) * swing * wind
    rest[at("lean_torque")] = rng.uniform(2, 5) * coloured(pink, count, rng)
    rest[at("yaw_moment")] = rng.uniform(0.8, 2.5) * coloured(von_karman(hertz, rng.uniform(0.02, 0.06)), count, rng)
    quick = coloured(von_karman(hertz, rng.uniform(0.05, 0.2)), count, rng)
    rest[at("steer_torque")] = rng.uniform(0.3, 0.8) * quick + rng.uniform(0.8, 2) * pulses(0.8, count, rng)
    knots = np.arange(0, time[-1] + 20, rng.uniform(4, 8))
    bends = np.zeros_like(rest)
    bends[at("steer_torque")] = CubicSpline(knots, rng.standard_normal(len(knots)))(time)
    return Inputs(rest, bends)


def march(motion: Motion, rider: Rider, inputs: Real) -> tuple[Real, Real]:
    """States (k, s, n) and inputs (k, s, 4) every ``SAMPLE`` from ``inputs`` (s, 4, steps); the rider's torque added.

    The first of the rider's lags is a pure delay here. Without inputs a motion begins with a lean of 1 rad.
    """
    n, (several, _, count) = len(motion.matrix), inputs.shape
    both = expm(STEP * np.block([[motion.matrix, motion.inputs], [np.zeros((len(INPUTS), n + len(INPUTS)))]]))
    once, pushed = both[:n, :n], both[:n, n:]
    answered = sum(gain * motion.outputs[name][:n] for gain, name in zip(rider.gains, FED_BACK, strict=True))
    late, decay = round(rider.lags[0] / STEP), math.exp(-STEP / rider.lags[1])
    x, torque = np.zeros((several, n)), np.zeros(several)
    if not inputs.any():
        x[:, motion.states.index("lean")] = 1.0
    past = np.zeros((late, several))
    states, acted = np.empty((count // EACH, several, n)), np.empty((count // EACH, several, len(INPUTS)))
    for k in range(count):
        torque = decay * torque + (1 - decay) * past[k % late]
        past[k % late] = x @ answered
        u = inputs[:, :, k].copy()
        u[:, 0] += torque
        if k % EACH == 0:
            states[k // EACH], acted[k // EACH] = x, u
        x = x @ once.T + u @ pushed.T
    return states, acted


def draw_other_rides(
    rng: Random, speeds: Sequence[float], *, base: str, duration: float = 300.0, **of_bicycle: Any
) -> list[Ride]:
    """Rides of a fresh bicycle, one at each of the ``speeds`` (m/s), recorded by three gyros for ``duration`` s."""
    for _ in range(TRIES):
        bicycle = draw_bicycle(rng, base=base, **of_bicycle)
        try:
            riders = [draw_rider(bicycle.motion(speed), rng) for speed in speeds]
        except InputError:
            continue
        return [
            other_ride(bicycle, speed, rider, rng, duration=duration)
            for speed, rider in zip(speeds, riders, strict=True)
        ]
    raise InputError(f"nobody rides such a bicycle at {', '.join(f'{v:g}' for v in speeds)} m/s")


def draw_rider(motion: Motion, rng: Random) -> Rider:
    """A rider who holds the bicycle after a pure delay; InputError if none of :data:`RIDERS` does."""
    for _ in range(RIDERS):
        rider = tune_rider(motion, rng)
        if holds(motion, rider):
            return rider
    raise InputError(f"none of {RIDERS} riders holds the bicycle at {motion.speed:g} m/s")


def holds(motion: Motion, rider: Rider) -> bool:
    """Tell whether a free motion decays under a rider with a pure delay."""
    states, _ = march(motion, rider, np.zeros((1, len(INPUTS), round(DECAYED / STEP))))
    begin, end = (float(np.abs(part).max()) for part in (states[: round(2 / SAMPLE)], states[-round(1 / SAMPLE) :]))
    return end < LEFT * begin


def other_ride(bicycle: RiddenBicycle, speed: float, rider: Rider, rng: Random, *, duration: float) -> Ride:
    """A ride of a ``bicycle`` at a ``speed`` (m/s) with this ``rider``, recorded for ``duration`` s."""
    motion, style = bicycle.motion(speed), STYLES["straight"]
    drawn = draw_inputs(round((SETTLING + duration) / STEP), rng)
    states, inputs = march(motion, rider, np.stack([drawn.rest, drawn.bends]))
    first = round(SETTLING / SAMPLE)
    both = np.concatenate([states, inputs], 2)[first:]
    yaw = motion.outputs["yaw_rate"]
    of_bends = rng.uniform(*style.bends) / float(np.std(both[:, 1] @ yaw))
    whole = both[:, 0] + of_bends * both[:, 1]
    upright = style.largest * speed / bicycle.values["g"] / float(np.std(whole @ motion.outputs["lean"]))
    whole *= min(1.0, upright)
    truth = {name: whole @ row for name, row in motion.outputs.items()}
    sensors, time = Sensors(), SAMPLE * np.arange(len(whole))
    recorded = sensors.read(time, truth, bicycle.values["lam"], rng)
    leg = Leg(bicycle, speed, rider, {})
    return Ride(leg, sensors, time, np.full(len(time), speed), truth, recorded, np.ones(len(time), bool))
