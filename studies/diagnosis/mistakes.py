"""Possible mistakes of sensors and files as candidates, sensors of harmonic motion, and dry friction of the steering.

A candidate of this kind is a mistake, not a thing that the bicycle has. Its prior weight is below that of an ordinary
candidate, for a laboratory looks for such mistakes before it publishes. Recorded signals lag: delays and time constants
are zero or positive. A torque counts as an actuator's: it acts when it was commanded, or later.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter
from scipy.special import erf

from bicycle.identification.recording import STEER, STEER_TORQUE, Run
from bicycle.model import Model
from studies.diagnosis.family import SPEED_OFFSET, SPEED_SCALE, WRONG
from studies.inference.fit import Fit
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.arrays import Array, Complex

GAIN, DELAY, LOWPASS = "measurement.{}_gain", "measurement.{}_delay", "measurement.{}_lowpass"  # of a signal
FRICTION = "measurement.steer_friction"
SENSOR, FILE = 0.5, 0.2  # prior weights (judgements): a calibration, a geometry beyond its stated uncertainty
GEOMETRY = {"wrong_tilt": ("lam", "rad", 0.05, 2e-3, "steer axis tilt"), "wrong_trail": ("c", "m", 0.02, 1e-3, "trail")}
"""Candidate: key of the bicycle, unit, prior sd, least size if the file states no uncertainty, and its name."""


def error(
    name: str, unit: str, key: str, scale: float, *, least: float, lowest: float | None = None
) -> UncertainParameter:
    """Size of a mistake under ``key``, of sd ``scale``, worth a name from ``least``; bounds are ten sd by default."""
    low = -10 * scale if lowest is None else lowest
    return UncertainParameter(name, unit, {key: 1.0}, 0.0, scale, low, 10 * scale, size=True, least=least)


def mistake(identifier: str, size: UncertainParameter, words: str) -> Candidate:
    """Candidate for one mistake of a sensor, of one ``size``."""
    return Candidate(identifier, (size,), signature=words.replace("_", " "), weight=SENSOR)


def gain_error(sensor: str, signal: str, *, beside: str = "") -> Candidate:
    """Wrong scale of a ``sensor`` whose ``signal`` is multiplied by 1 + scale: 10 %, worth a name from 0.2 %."""
    size = replace(error("scale", "1", GAIN.format(signal), 0.1, least=0.002), power=0, relative=True)
    more = f" beside the {beside}" if beside else ""
    return mistake(f"{sensor}_scale", size, f"the {sensor} reads too much or too little{more} by a constant factor")


def delay_error(sensor: str, signal: str) -> Candidate:
    """Late ``signal`` of a ``sensor``: 10 ms, worth a name from 0.5 ms."""
    size = error("delay", "s", DELAY.format(signal), 0.01, least=5e-4, lowest=0.0)
    return mistake(f"{sensor}_delay", size, f"the {sensor} is late by a constant time")


def lowpass_error(sensor: str, signal: str) -> Candidate:
    """First-order low-pass of a ``signal``: 20 ms, worth a name from 0.5 ms."""
    size = error("time_constant", "s", LOWPASS.format(signal), 0.02, least=5e-4, lowest=0.0)
    return mistake(f"{sensor}_lowpass", size, f"the {sensor} is smoothed by a first-order low-pass")


def speed_errors(speeds: Sequence[float]) -> tuple[Candidate, ...]:
    """Wrong scale of the speedometer, and an offset unless all ``speeds`` (m/s) are one."""
    scale = error("scale", "1", SPEED_SCALE, 0.02, least=0.002)
    found = [mistake("speed_scale", scale, "the true speed is the recorded one times a constant factor")]
    if len(set(speeds)) > 1:
        offset = error("offset", "m/s", SPEED_OFFSET, 0.1, least=0.01, lowest=-min(1.0, 0.5 * min(speeds)))
        found.append(mistake("speed_offset", offset, "the true speed is the recorded one and a constant more"))
    return tuple(found)


def one_speed(speeds: Sequence[float]) -> dict[str, str]:
    """Reason why an offset of the speed is not tried at ``speeds``, m/s; empty if it is."""
    return {} if len(set(speeds)) != 1 else {"speed_offset": "one speed: an offset is a scale there, see speed_scale"}


def geometry_errors(
    model: Model, floating: Sequence[UncertainParameter]
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Tilt or trail of the file that is off beyond its stated uncertainty, and why one is not tried."""
    found: list[Candidate] = []
    refused: dict[str, str] = {}
    for identifier, (key, unit, scale, least, word) in GEOMETRY.items():
        nuisance = next((u for u in floating if key in u.sets), None)
        sd = 0.0 if nuisance is None else nuisance.scale
        if sd >= scale:
            refused[identifier] = f"the stated sd of {key}, {sd:g} {unit}, already allows for it ({scale:g} {unit})"
            continue
        own = {u.name for u in floating if u.name != key}
        moved = [key, *(f for f, leader in model.tied.items() if leader == key and f not in own)]
        size = UncertainParameter(
            "error", unit, {WRONG + name: 1.0 for name in moved}, 0.0, scale, -6 * scale, 6 * scale, size=True,
            least=max(3 * sd, least),
        )  # fmt: skip
        found.append(Candidate(identifier, (size,), signature=f"the stated {word} ({key}) is wrong", weight=FILE))
    return tuple(found), refused


def wrong_geometry(final: Fit) -> dict[str, float]:
    """Errors of the values that the file states, by parameter (SI), as the fit ``final`` found them."""
    return {
        key.removeprefix(WRONG): factor * float(u.value(x))
        for c in final.candidates
        for u, x in zip(c.unknowns, final.theta[final.columns(c)], strict=True)
        for key, factor in u.sets.items()
        if key.startswith(WRONG)
    }


# ---- sensors of harmonic motion ----

Errors = tuple[tuple[int, float] | None, ...]


def errors_of(errors: Mapping[str, tuple[int, float]], signal: str) -> Errors:
    """Column and coordinate of gain (its logarithm), delay and low-pass of a ``signal``, None if it does not float."""
    return tuple(errors.get(key.format(signal)) for key in (GAIN, DELAY, LOWPASS))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # a real root at the filter's own
def apply_sensor(
    number: Complex, slope: Complex, s: Complex, errors: Errors, *, s_slope: Complex | None = None, power: int = 1
) -> None:
    """Multiply a signal exp(s t) by gain exp(-s delay) / (1 + s tau), or divide by it (``power`` -1), in place."""
    gain, delay, tau = errors
    late, constant = (e[1] if e else 0.0 for e in (delay, tau))
    if delay or tau:
        slow = 1 / (1 + s * constant)
        factor = (np.exp(-s * late) * slow) ** power
        number *= factor
        slope *= factor[:, None]
        if s_slope is not None:
            slope += (number * power * (-late - constant * slow))[:, None] * s_slope
        for entry, by in ((delay, -s), (tau, -s * slow)):
            if entry is not None and slope.shape[1]:
                slope[:, entry[0]] += power * by * number
    if gain:
        number *= np.exp(power * gain[1])
        slope *= np.exp(power * gain[1])
        if slope.shape[1]:
            slope[:, gain[0]] += power * number


# ---- dry friction of the steering ----


def friction_candidate() -> Candidate:
    """Dry friction of the steering, which is no mistake of a sensor."""
    torque = error("torque", "N m", FRICTION, 0.5, least=0.02, lowest=0.0)
    signature = "a torque of one size against the steer rate"
    family = "damping at the steering"
    return Candidate("steer_friction", (torque,), signature=signature, family=family, approximate=True)  # no sticking


def friction_refused(run: Run) -> dict[str, str]:
    """Reason why friction of the steering cannot be tried on runs like ``run``; empty if it can."""
    if STEER in run.inputs:
        why = f"the steer angle is prescribed: only {STEER_TORQUE} would show it"
        return {} if STEER_TORQUE in run.channels else {"steer_friction": why}
    if "steer_rate_rad_s" in run.channels or STEER in run.channels:
        return {}
    why = f"the direction of friction is that of the steering, which was not recorded ({STEER} or steer_rate_rad_s)"
    return {"steer_friction": why}


def direction(run: Run) -> Array:
    """Expected sign (n,) of the steer rate of a ``run``: -1 to 1, about 0 where noise hides it."""
    signals = {**run.inputs, **run.channels}
    derivative = 0 if "steer_rate_rad_s" in signals else 1
    signal = signals[STEER if derivative else "steer_rate_rad_s"]
    window = max(5, round(0.1 / run.step) // 2 * 2 + 1)  # 0.1 s: a parabola smooths the rate
    window = min(window, len(signal) - 1 + len(signal) % 2)
    how = {"polyorder": 2, "deriv": derivative, "delta": run.step}
    rate = savgol_filter(signal, window, **how)
    sd = third_difference_noise(signal) * np.linalg.norm(savgol_coeffs(window, **how))
    return np.asarray(erf(rate / (np.sqrt(2.0) * max(float(sd), 1e-9))))


def third_difference_noise(signal: Array) -> float:
    """Sd of the white noise in a ``signal`` (n,), in its unit: noise of sd 1 has third differences of variance 20."""
    return float(np.std(np.diff(signal, 3)) / np.sqrt(20.0))
