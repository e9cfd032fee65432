"""What may be wrong with time histories, and what else only they can show, as candidates."""

from collections.abc import Sequence

import numpy as np

from bicycle.identification.recording import Run
from studies.inference.parameter import Candidate
from studies.missing_effect.motion.friction import friction_candidate, friction_refused
from studies.missing_effect.motion.sensor_errors import (
    constant_errors,
    delay_error,
    gain_error,
    lowpass_error,
    one_speed,
    speed_errors,
)
from tyre.base.arrays import Array

BIAS = {"roll_rate_rad_s": 0.02, "lean_rad": 0.03, "steer_rad": 0.02, "steer_rate_rad_s": 0.02, "yaw_rate_rad_s": 0.02,
        "steer_torque_N_m": 0.1}  # fmt: skip
BIAS_KEY, DRIFT_KEY = "bias", "drift"
SENSOR = {
    "roll_rate_rad_s": "roll_rate", "lean_rad": "lean", "steer_rad": "steer", "steer_rate_rad_s": "steer_rate",
    "yaw_rate_rad_s": "yaw_rate", "steer_torque_N_m": "steer_torque", "lean_torque_N_m": "lean_torque",
}  # fmt: skip
"""What the errors of a channel or a torque are called after."""


def history_candidates(runs: Sequence[Run]) -> tuple[Candidate, ...]:
    """What may be wrong with ``runs``, and what else only runs can show.

    Speed, a bias or drift, gain and delay of each channel and torque, low-pass of each channel; friction of the
    steering (see :mod:`.friction`), which is no mistake.
    """
    channels = [name for name in runs[0].channels if name in BIAS]
    found = [*speed_errors([run.speed for run in runs]), *constant_errors()]
    for name in (*channels, *runs[0].inputs):
        found += [gain_error(SENSOR[name], name), delay_error(SENSOR[name], name)]
    found += [lowpass_error(SENSOR[name], name) for name in channels]
    if not friction_refused(runs[0]):
        found.append(friction_candidate())
    return tuple(found)


def histories_refused(runs: Sequence[Run]) -> dict[str, str]:
    """Which of :func:`history_candidates` cannot be tried on ``runs``, and why."""
    friction = friction_refused(runs[0])
    return one_speed([run.speed for run in runs]) | ({"steer_friction": friction} if friction else {})


def slow_errors(runs: Sequence[Run], length: int, channels: Sequence[str], candidates: Sequence[Candidate]) -> Array:
    """What a bias, or a drift, among ``candidates`` adds to each of C ``channels`` by 1 sd (R, C, T, columns).

    A constant of each channel; of a drift a trend of as much over half the run, too; no column without either. The
    ``length`` T is the number of samples of the longest of the R ``runs``.
    """
    names = {c.identifier for c in candidates}
    kinds = 2 if DRIFT_KEY in names else 1 if BIAS_KEY in names else 0
    found = np.zeros((len(runs), len(channels), length, kinds * len(channels)))
    for r, run in enumerate(runs):
        n = len(run.time)
        for k, shape in enumerate([np.ones(n), np.linspace(-1.0, 1.0, n)][:kinds]):
            for c, name in enumerate(channels):
                found[r, c, :n, c + k * len(channels)] = BIAS[name] * shape
    return found
