"""A simulated response as a recording that every command reads, labelled as synthetic in its first line."""

import math
import zlib
from pathlib import Path

import numpy as np

from bicycle.identification.recording import FEWEST
from bicycle.responses.response import Response
from studies.synthetic_sensors.sensor_file import RECORDED, Sensors
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.files import write_text

LABEL = "# SYNTHETIC: computed by velotyre simulate and not measured"
SEPARATORS = str.maketrans(",;\t", "   ")  # a line that holds them looks like a line of the table to other readers


def recorded(response: Response, sensors: Sensors, seed: int | None = None) -> dict[str, Array]:
    """Columns (samples,) of a recording, ``time_s`` first, SI.

    Parameters
    ----------
    response : Response
        Evenly sampled, at least as fast as the sensors.
    sensors : Sensors
    seed : int, optional
        Of the noise, which differs with the speed and the channel too; without, there is none.

    Raises
    ------
    InputError
        Fewer samples than a recording needs.
    """
    dense = response.time
    count = math.floor((dense[-1] - dense[0]) * sensors.rate_hz * (1 + 1e-9)) + 1
    if count < FEWEST:
        raise InputError(
            f"{count} samples at {sensors.rate_hz:g} Hz until {dense[-1]:.3g} s are too few for a recording "
            f"(at least {FEWEST}); take a longer --duration, or a motion that does not fall so soon"
        )
    time = np.arange(count) / sensors.rate_hz
    signals = {**response.outputs, **response.inputs}
    found = {"time_s": time}
    for name, sensor in sensors.channels.items():
        true = np.asarray(signals.get(RECORDED[name], np.zeros(len(dense))))  # a torque that nobody gives is zero
        words = [seed or 0, round(1e6 * response.speed), zlib.crc32(name.encode())]
        found[name] = sensor.read(dense, true, time, None if seed is None else np.random.default_rng(words))
    return found


def write_recording(target: Path, columns: dict[str, Array], words: str) -> None:
    """Write ``columns`` (samples,), SI, to the CSV file ``target``; ``words`` say how they were made."""
    lines = [f"{LABEL}: {' '.join(words.translate(SEPARATORS).split())}", ",".join(columns)]
    lines += [",".join(f"{x + 0.0:.9g}" for x in row) for row in zip(*columns.values(), strict=True)]
    write_text(target, "\n".join(lines) + "\n")


def fine_step(sensors: Sensors, most: float) -> float:
    """Time between samples of a simulation in which every recorded one falls on a computed one, s; up to ``most`` s."""
    return 1 / (sensors.rate_hz * math.ceil(1 / (sensors.rate_hz * most) - 1e-9))
