"""Sensors behind a frequency response: what gain, delay and low-pass do to it, and the candidates for them.

Of an output y and an input u the recorded ratio is that of the bicycle times gain exp(-s delay) / (1 + s tau) of
each, s = i omega: a channel lags behind the motion, and a torque acts when it is recorded as commanded, or later. The
gain of an input is, as in time histories, what acts over what is recorded.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from studies.inference.parameter import Candidate
from studies.missing_effect.forced.table import ResponsePoint, spoken
from studies.missing_effect.motion.sensor_errors import (
    DELAY,
    GAIN,
    LOWPASS,
    delay_error,
    gain_error,
    lowpass_error,
    one_speed,
    speed_errors,
)
from tyre.base.arrays import Array, Complex


def sensor_candidates(points: Sequence[ResponsePoint]) -> tuple[Candidate, ...]:
    """What may be wrong with the measurement of ``points``.

    The speed; gain, delay and low-pass of each output; gain and delay of each input that has several outputs.
    """
    found = [*speed_errors([p.speed for p in points])]
    for name in dict.fromkeys(p.output for p in points):
        sensor = spoken(name).replace(" ", "_")
        found += [gain_error(sensor, name), delay_error(sensor, name), lowpass_error(sensor, name)]
    alone = _alone(points)
    for name in dict.fromkeys(p.input for p in points):
        if name not in alone:
            found += [gain_error(name, name), delay_error(name, name)]
    return tuple(found)


def sensors_refused(points: Sequence[ResponsePoint]) -> dict[str, str]:
    """What of that cannot be tried on ``points``, and why."""
    refused = one_speed([p.speed for p in points])
    for name, output in _alone(points).items():
        for what in ("scale", "delay"):
            refused[f"{name}_{what}"] = (
                f"the only response to it is that of the {spoken(output)}, whose {what} looks the same: see "
                f"{spoken(output).replace(' ', '_')}_{what}"
            )
    return refused


def _alone(points: Sequence[ResponsePoint]) -> dict[str, str]:
    """Inputs with a single output that has no other input either: input -> output."""
    pairs = {(p.input, p.output) for p in points}
    inputs, outputs = [a for a, _ in pairs], [b for _, b in pairs]
    return {a: b for a, b in pairs if inputs.count(a) == 1 and outputs.count(b) == 1}


def sense(
    gains: Complex, slopes: Complex, s: Complex, signal: Array, name: str, errors: Mapping[str, tuple[int, float]]
) -> None:
    """Apply the errors of one sensor to responses, in place.

    Parameters
    ----------
    gains : ndarray, shape (n,)
        SI.
    slopes : ndarray, shape (n, p) or (n, 0)
        Their derivatives.
    s : ndarray, shape (n,)
        i omega, rad/s.
    signal : ndarray of bool, shape (n,)
        Which responses hold the signal.
    name : str
        Of the signal.
    errors : mapping
        Column and coordinate of every unknown by what it sets; that of a gain is its logarithm.
    """
    gain, delay, tau = (errors.get(key.format(name)) for key in (GAIN, DELAY, LOWPASS))
    here = s[signal]
    late, constant = (e[1] if e else 0.0 for e in (delay, tau))
    if delay or tau:
        factor = np.exp(-here * late) / (1 + here * constant)
        gains[signal] *= factor
        slopes[signal] *= factor[:, None]
        for entry, by in ((delay, -here), (tau, -here / (1 + here * constant))):
            if entry is not None and slopes.shape[1]:
                slopes[signal, entry[0]] += by * gains[signal]
    if gain:
        gains[signal] *= np.exp(gain[1])
        slopes[signal] *= np.exp(gain[1])
        if slopes.shape[1]:
            slopes[signal, gain[0]] += gains[signal]
