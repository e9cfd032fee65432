"""The file of ``velotyre simulate --sensors``: which channels are recorded, how fast, and how badly."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from bicycle.identification.recording import CHANNELS, INPUTS, LONGEST_STEP, PLACELESS
from studies.synthetic_sensors.sensor import Sensor
from tyre.base.checks import number
from tyre.base.errors import InputError
from tyre.base.schema import by_name, maybe, needed, read, table
from tyre.base.toml_file import read_toml

RECORDED = {name: output for name, output in {**CHANNELS, **INPUTS}.items() if name not in PLACELESS}
"""Columns of a recording, and the output or input of the model that each shows."""

SLOWEST, FASTEST = 1 / LONGEST_STEP, 1e5  # Hz
LIMITS = {
    "noise_sd": number(least=0, says="must be a standard deviation >= 0, in the unit of the channel"),
    "correlation": number(least=0, most=0.999, says="must be the correlation of neighbouring samples, from 0 to 0.999"),
    "bandwidth_hz": number(above=0, says="must be a frequency above 0 in Hz; leave it out for white noise"),
    "scale_error": number(least=-0.9, most=10, says="must be reading over truth minus one (0.02 reads 2 % too much)"),
    "offset": number(),
    "drift_per_s": number(),
    "delay_s": number(least=0, most=1, says="must be a time from 0 to 1 s; no sensor is early"),
    "low_pass_hz": number(above=0, says="must be a frequency above 0 in Hz; leave it out for no filter"),
    "resolution": number(above=0, says="must be a step above 0, in the unit of the channel; leave it out for none"),
}  # fmt: skip
FILE = table(
    {
        needed("rate_hz", "rate_hz is missing; give the samples per second, rate_hz = 100"): number(
            least=SLOWEST, most=FASTEST, says=f"must be the samples per second, {SLOWEST:g} to {FASTEST:g} Hz"
        ),
        needed("channels", "no channels; write [channels.roll_rate_rad_s] and the keys below it"): by_name(
            table({maybe(key): check for key, check in LIMITS.items()}), RECORDED, kind="channel"
        ),
    }
)


@dataclass(frozen=True)
class Sensors:
    """What is recorded: samples per second (Hz), and the sensor of every column."""

    rate_hz: float
    channels: Mapping[str, Sensor]


def read_sensors(path: Path) -> Sensors:
    """Read the file at ``path``.

    Raises
    ------
    InputError
        No such file, an unknown channel or key, a value that is not allowed, no motion among the channels.
    """
    content = read(FILE, read_toml(path, "sensor file"), where=str(path))
    for name, given in content["channels"].items():
        if {"correlation", "bandwidth_hz"} <= set(given):
            raise InputError(f"{path}: [channels.{name}]: correlation and bandwidth_hz say the same; keep one")
    if not set(content["channels"]) & set(CHANNELS):
        motions = ", ".join(name for name in RECORDED if name in CHANNELS)
        raise InputError(f"{path}: [channels]: no motion is recorded; add one of {motions}")
    return Sensors(content["rate_hz"], {name: Sensor(**given) for name, given in content["channels"].items()})
