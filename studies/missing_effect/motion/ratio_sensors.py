"""Sensors behind the shape ratios of modes: what their gain, delay and low-pass do, and the candidates for them."""

from collections.abc import Sequence

import numpy as np

from studies.inference.parameter import Candidate
from studies.missing_effect.motion.sensor_errors import (
    DELAY,
    GAIN,
    LOWPASS,
    delay_error,
    gain_error,
    lowpass_error,
    speed_errors,
)
from tyre.base.arrays import Complex

RATIO_SENSOR = {"steer_over_lean": "steer", "yaw_over_lean": "yaw"}
LEAN = "lean_of_ratios"  # the signal that all ratios are divided by


def errors_of(errors: dict[str, tuple[int, float]], signal: str) -> list[tuple[int, float] | None]:
    """Column and coordinate of gain (its logarithm), delay and low-pass of a ``signal``, None where it does not float.

    ``errors`` : column and coordinate of every unknown by what it sets.
    """
    return [errors.get(key.format(signal)) for key in (GAIN, DELAY, LOWPASS)]


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # a real root at the filter's own
def apply_sensor(
    number: Complex, slope: Complex, row: int, errors: list[tuple[int, float] | None], *, power: int = 1
) -> None:
    """Multiply a ratio by what a sensor makes of exp(lambda t), gain exp(-lambda delay) / (1 + lambda tau).

    Parameters
    ----------
    number : ndarray, shape (m, 3)
        Eigenvalues and ratios, changed in place.
    slope : ndarray, shape (m, 3, p) or (m, 3, 0)
        Their derivatives, changed in place.
    row : int
        1 or 2, of the ratio.
    errors : list
        Of :func:`errors_of`.
    power : int
        1, or -1 for the sensor in the denominator; no unit.
    """
    gain, delay, tau = errors
    late, constant = (e[1] if e else 0.0 for e in (delay, tau))
    root = number[:, 0].copy()
    if delay or tau:
        slow = 1 / (1 + root * constant)
        number[:, row] *= (np.exp(-root * late) * slow) ** power
        by_root = number[:, row] * power * (-late - constant * slow)
        slope[:, row] = slope[:, row] * (np.exp(-root * late) * slow)[:, None] ** power
        slope[:, row] += by_root[:, None] * slope[:, 0]
        for entry, by in ((delay, -root), (tau, -root * slow)):
            if entry is not None and slope.shape[2]:
                slope[:, row, entry[0]] += power * by * number[:, row]
    if gain:
        number[:, row] *= np.exp(power * gain[1])
        slope[:, row] *= np.exp(power * gain[1])
        if slope.shape[2]:
            slope[:, row, gain[0]] += power * number[:, row]


def measurement_candidates(ratios: Sequence[str], speeds: Sequence[float]) -> tuple[Candidate, ...]:
    """What may be wrong with a modal measurement.

    Speed; gain, delay and low-pass of the sensors of the ratios; delay and low-pass of the lean-rate sensor, which all
    ratios share (its gain cannot be told from theirs).

    Parameters
    ----------
    ratios : sequence of str
        By name, those that were measured.
    speeds : sequence of float
        m/s.
    """
    found = [*speed_errors(speeds)]
    for ratio in ratios:
        sensor = f"{RATIO_SENSOR[ratio]}_sensor"
        found += [gain_error(sensor, ratio, beside="lean_sensor"), delay_error(sensor, ratio)]
        found.append(lowpass_error(sensor, ratio))
    if ratios:
        found += [delay_error("lean_sensor", LEAN), lowpass_error("lean_sensor", LEAN)]
    return tuple(found)
