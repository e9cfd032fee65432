"""Possible errors of sensors and files as candidates, sensors of harmonic motion, and dry friction of the steering.

A candidate of this kind is a measurement error, no effect of the bicycle. Its prior weight is below that of an ordinary
candidate, for a laboratory looks for such errors before it publishes. Recorded signals lag: delays and time constants
are zero or positive. A torque is treated as an actuator's: it acts when it was commanded, or later.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy
from scipy.special import erf

from bicycle.identification.recording import STEER, STEER_TORQUE, Run
from bicycle.model.model import Model
from studies.diagnosis.family import SPEED_OFFSET, SPEED_SCALE, WRONG
from studies.inference.fit import Fit
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.ground.arrays import Array, Complex

GAIN, DELAY, LOWPASS = "measurement.{}_gain", "measurement.{}_delay", "measurement.{}_lowpass"  # of a signal
FRICTION = "measurement.steer_friction"
ROTATION = tuple(f"measurement.imu_{axis}" for axis in ("roll", "pitch", "yaw"))
BOX = ("roll_rate_rad_s", "yaw_rate_rad_s")  # channels of one box of gyros
LEANS = "measurement.yaw_gyro_leans"
OFFSET, SKEW = "measurement.imu_offset", "measurement.imu_skew"
DECAY_SCALE, DECAY_OFFSET, CLOCK = (f"measurement.{name}" for name in ("decay_scale", "decay_offset", "clock_scale"))
SLOWS, REFERENCE = "measurement.deceleration", "measurement.reference"
SENSOR, FILE = 0.5, 0.2  # prior weights (judgements): a calibration, a geometry beyond its stated uncertainty
GEOMETRY = {"wrong_tilt": ("lam", "rad", 0.05, 2e-3, "steer axis tilt"), "wrong_trail": ("c", "m", 0.02, 1e-3, "trail")}
"""Candidate: key of the bicycle, unit, prior sd, smallest size if the file states no uncertainty, and its name."""


def error(
    name: str, unit: str, key: str, scale: float, *, least: float, lowest: float | None = None
) -> UncertainParameter:
    """Size of an error under ``key``, of sd ``scale``, worth a name from ``least``; bounds are ten sd by default."""
    low = -10 * scale if lowest is None else lowest
    return UncertainParameter(name, unit, {key: 1.0}, 0.0, scale, low, 10 * scale, size=True, least=least)


LAG = "a lag of the {}"
Sizes = UncertainParameter | tuple[UncertainParameter, ...]


def mistake(identifier: str, sizes: Sizes, title: str, words: str = "", family: str = "") -> Candidate:
    """Candidate for one error of a sensor, of one size or several; its ``title`` says what its ``words`` would."""
    unknowns = sizes if isinstance(sizes, tuple) else (sizes,)
    title, words = title.replace("_", " "), words.replace("_", " ")
    return Candidate(
        identifier, unknowns, signature=words or title, title=title, weight=SENSOR, family=family.replace("_", " ")
    )


def gain_error(sensor: str, signal: str, *, reference: str = "") -> Candidate:
    """Wrong scale of a ``sensor`` whose ``signal`` is multiplied by 1 + scale: 10 %, worth a name from 0.2 %."""
    size = replace(error("scale", "1", GAIN.format(signal), 0.1, least=0.002), power=0, relative=True)
    more = f" relative to the {reference}" if reference else ""
    title = f"wrong gain of the {sensor}"
    return mistake(f"{sensor}_scale", size, title, f"the {sensor} reads wrong{more} by a constant factor")


def delay_error(sensor: str, signal: str) -> Candidate:
    """Late ``signal`` of a ``sensor``: 10 ms, worth a name from 0.5 ms."""
    size = error("delay", "s", DELAY.format(signal), 0.01, least=5e-4, lowest=0.0)
    words = f"the {sensor} is late by a constant time"
    return mistake(f"{sensor}_delay", size, f"delay of the {sensor}", words, LAG.format(sensor))


def lowpass_error(sensor: str, signal: str) -> Candidate:
    """First-order low-pass of a ``signal``: 20 ms, worth a name from 0.5 ms."""
    size = error("time_constant", "s", LOWPASS.format(signal), 0.02, least=5e-4, lowest=0.0)
    words = f"the {sensor} is smoothed by a first-order low-pass"
    return mistake(f"{sensor}_lowpass", size, f"low-pass of the {sensor}", words, LAG.format(sensor))


def rotation_error(sd: float = 0.08) -> Candidate:
    """Turned box of gyros, ``sd`` in rad: lean and yaw rate mix by its pitch, the other angles only weaken them."""
    pitch = error("pitch", "rad", ROTATION[1], sd, least=0.01)
    aside = [UncertainParameter(key[16:], "rad", {key: 1.0}, 0.0, 0.5 * sd, -0.5, 0.5) for key in ROTATION[::2]]
    words = "the box of the gyros is turned: its roll and yaw axes are not those of the frame"
    return mistake("imu_rotation", (pitch, *aside), "turned box of gyros", words)


def turn_axes(values: Mapping[str, Any]) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Shares of roll and yaw rate in the roll gyro, and in the yaw gyro, of a box turned by yaw, pitch, then roll."""
    roll, pitch, yaw = (values[key] for key in ROTATION)
    aside = np.cos(yaw) * np.sin(pitch) * np.cos(roll) + np.sin(yaw) * np.sin(roll)
    return (np.cos(yaw) * np.cos(pitch), -np.sin(pitch)), (aside, np.cos(pitch) * np.cos(roll))


def leaning_error() -> Candidate:
    """Yaw gyro that leans with the frame, which no file states: it shows the yaw rate times cos(lean), no number."""
    words = "the yaw gyro leans with the frame: it shows the yaw rate times the cosine of the lean"
    title = "yaw gyro that leans with the frame"
    return Candidate("yaw_gyro_leans", (), fixed={LEANS: 1.0}, signature=words, title=title, weight=SENSOR)


def clock_error() -> Candidate:
    """Clock of the gyros that is late or early, and gains or loses, against that of the steering."""
    late = error("offset", "s", OFFSET, 0.01, least=1e-3)
    skew = error("skew", "1", SKEW, 0.005, least=5e-4)
    words = "the gyros have another clock than the steering: late by an offset that grows in time"
    return mistake("imu_clock", (late, skew), "gyros on another clock", words)


def coasting() -> Candidate:
    """Speed that falls along a run; the recorded one is that after the share ``reference`` of it."""
    slows = error("deceleration", "m/s^2", SLOWS, 0.3, least=0.02)
    reference = UncertainParameter("reference", "1", {REFERENCE: 1.0}, 0.4, 0.2, 0.0, 1.0)
    words = "the speed decreases steadily along each run"
    return mistake("coast_down", (slows, reference), "speed that decreases along the runs", words)


def speed_errors(speeds: Sequence[float]) -> tuple[Candidate, ...]:
    """Wrong scale of the speedometer, and an offset unless all ``speeds`` (m/s) are one."""
    scale = error("scale", "1", SPEED_SCALE, 0.02, least=0.002)
    words = "the true speed is the recorded one times a constant factor"
    candidates = [mistake("speed_scale", scale, "wrong scale of the speed", words)]
    if len(set(speeds)) > 1:
        offset = error("offset", "m/s", SPEED_OFFSET, 0.1, least=0.01, lowest=-min(1.0, 0.5 * min(speeds)))
        words = "the true speed is the recorded one plus a constant"
        candidates.append(mistake("speed_offset", offset, "constant error of the speed", words))
    return tuple(candidates)


def one_speed(speeds: Sequence[float]) -> dict[str, str]:
    """Reason why an offset of the speed is not tried at ``speeds``, m/s; empty if it is."""
    return {} if len(set(speeds)) != 1 else {"speed_offset": "one speed: an offset equals a scale, see speed_scale"}


def geometry_errors(
    model: Model, floating: Sequence[UncertainParameter]
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Tilt or trail of the file that is off beyond its stated uncertainty, and why one is not tried."""
    candidates: list[Candidate] = []
    reasons: dict[str, str] = {}
    for identifier, (key, unit, scale, least, word) in GEOMETRY.items():
        nuisance = next((u for u in floating if key in u.sets), None)
        sd = 0.0 if nuisance is None else nuisance.scale
        if sd >= scale:
            reasons[identifier] = f"the stated sd of {key}, {sd:g} {unit}, already allows for it ({scale:g} {unit})"
            continue
        floating_names = {u.name for u in floating if u.name != key}
        keys = [key, *(f for f, leader in model.tied.items() if leader == key and f not in floating_names)]
        size = UncertainParameter(
            "error",
            unit,
            {WRONG + name: 1.0 for name in keys},
            0.0,
            scale,
            -6 * scale,
            6 * scale,
            size=True,
            least=max(3 * sd, least),
        )
        signature, title = f"the stated {word} ({key}) is wrong", f"another {word} than the file states"
        candidates.append(Candidate(identifier, (size,), signature=signature, title=title, weight=FILE))
    return tuple(candidates), reasons


def wrong_geometry(final: Fit) -> dict[str, float]:
    """Errors of the values that the file states, by parameter (SI), as the fit ``final`` found them."""
    return {
        key.removeprefix(WRONG): factor * float(u.value(x))
        for c in final.candidates
        for u, x in zip(c.unknowns, final.theta[final.columns(c)], strict=True)
        for key, factor in u.sets.items()
        if key.startswith(WRONG)
    }


# ---- identification and sensors of harmonic motion ----


def identification_errors() -> tuple[Candidate, ...]:
    """Biased decays (a poor window, friction averaged over amplitudes), and a clock that is fast or slow."""
    return (
        mistake(
            "decay_scale",
            error("scale", "1", DECAY_SCALE, 0.1, least=0.01),
            "biased identification of decays",
            "all identified decays are wrong by one factor",
        ),
        mistake(
            "decay_offset",
            error("offset", "1/s", DECAY_OFFSET, 0.1, least=0.01),
            "decay of the identification",
            "the identification adds one decay to all modes, as an exponential window does",
        ),
        mistake(
            "clock_scale",
            error("scale", "1", CLOCK, 0.01, least=0.001),
            "clock of the recorder fast or slow",
            "the clock of the recorder is fast or slow, so that all decays and frequencies are scaled",
        ),
    )


def apply_identification_errors(root: Complex, slope: Complex, errors: Mapping[str, tuple[int, float]]) -> None:
    """Add errors of identification and clock to true roots (m,), 1/s, and their slopes (m, p), in place."""
    for key, add in ((CLOCK, root.copy()), (DECAY_SCALE, root.real + 0j), (DECAY_OFFSET, np.ones(len(root)))):
        if key in errors:
            column, size = errors[key]
            root += size * add
            if slope.shape[1]:
                slope += size * {CLOCK: slope, DECAY_SCALE: slope.real}.get(key, np.zeros(1))
                slope[:, column] += add


def turn_ratios(ratios: Complex, slope: Complex, errors: Mapping[str, tuple[int, float]]) -> None:
    """Turn ratios (m, 2), steer and yaw over lean rate, and slopes (m, 2, p) into those of a turned box, in place."""
    if ROTATION[1] not in errors:
        return

    def shown(turn: Array) -> tuple[Complex, Complex, Array]:
        (a, b), to_yaw = turn_axes(dict(zip(ROTATION, turn, strict=True)))
        lean = a + b * ratios[:, 1]
        return (
            np.stack([ratios[:, 0], to_yaw[0] + to_yaw[1] * ratios[:, 1]], 1) / lean[:, None],
            lean,
            np.array([a, b, *to_yaw]),
        )

    angles, step = np.array([errors[key][1] for key in ROTATION]), 1e-5
    turned, lean, (_, b, _, to_yaw) = shown(angles)
    if slope.shape[2]:
        by_yaw = slope[:, 1].copy()
        slope[:, 1] *= to_yaw
        slope -= turned[:, :, None] * b * by_yaw[:, None]
        slope /= lean[:, None, None]
        for k, key in enumerate(ROTATION):
            after, before = (shown(angles + sign * step * np.eye(3)[k])[0] for sign in (1, -1))
            slope[:, :, errors[key][0]] += (after - before) / (2 * step)
    ratios[:] = turned


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
    """Dry friction of the steering, which is no error of a sensor."""
    torque = error("torque", "N m", FRICTION, 0.5, least=0.02, lowest=0.0)
    return Candidate(
        "steer_friction",
        (torque,),
        signature="a torque of one size against the steer rate",
        title="dry friction of the steering",
        family="damping at the steering",
        approximate=True,  # no sticking
    )


def refuse_friction(run: Run) -> dict[str, str]:
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
    rate = scipy.signal.savgol_filter(signal, window, **how)
    sd = third_difference_noise(signal) * np.linalg.norm(scipy.signal.savgol_coeffs(window, **how))
    return np.asarray(erf(rate / (np.sqrt(2.0) * max(float(sd), 1e-9))))


def third_difference_noise(signal: Array) -> float:
    """Sd of the white noise in a ``signal`` (n,), in its unit: noise of sd 1 has third differences of variance 20."""
    return float(np.std(np.diff(signal, 3)) / np.sqrt(20.0))
