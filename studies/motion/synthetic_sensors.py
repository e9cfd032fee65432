"""Record a simulated response with sensors that are late, noisy and coarse, labelled as synthetic."""

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy

from bicycle.identification.recording import CHANNELS, FEWEST, INPUTS, LONGEST_STEP, PLACELESS
from bicycle.motion.responses import Response
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import read_toml, write_text
from tyre.ground.schema import by_name, maybe, needed, number, read, table
from tyre.recordings.noise import draw_ar1


@dataclass(frozen=True)
class Sensor:
    """Faults of one channel, in its unit if no other is named; they act in this order: delay, low-pass, the rest."""

    noise_sd: float = 0.0  # standard deviation of its noise
    correlation: float = 0.0  # of the noise of neighbouring samples, first-order autoregressive, 0 to 1
    bandwidth_hz: float = 0.0  # the same by the corner frequency of the noise; 0 where ``correlation`` says it
    scale_error: float = 0.0  # reading over truth minus one, no unit
    offset: float = 0.0  # at the start
    drift_per_s: float = 0.0  # change of the offset in a second
    delay_s: float = 0.0  # the reading is late by this, s
    low_pass_hz: float = 0.0  # corner frequency of a first-order filter; 0 for none
    resolution: float = 0.0  # step of the reading; 0 for none

    def read(self, dense: Array, true: Array, time: Array, rng: np.random.Generator | None = None) -> Array:
        """Read the motion ``true`` at even times ``dense`` (s): what is recorded at ``time`` (samples,)."""
        reading = (
            apply_lag(true, dense[1] - dense[0], 1 / (2 * math.pi * self.low_pass_hz)) if self.low_pass_hz else true
        )
        reading = np.interp(time - self.delay_s, dense, reading)  # before the start it stands still
        reading = (1 + self.scale_error) * reading + self.offset + self.drift_per_s * time
        if rng is not None and self.noise_sd:
            reading = reading + self.noise_sd * draw_ar1(len(time), memory=self.memory(time[1] - time[0]), rng=rng)
        return np.round(reading / self.resolution) * self.resolution if self.resolution else np.asarray(reading)

    def memory(self, step: float) -> float:
        """Correlation of the noise of neighbouring samples, ``step`` apart (s)."""
        return math.exp(-2 * math.pi * self.bandwidth_hz * step) if self.bandwidth_hz else self.correlation


def apply_lag(signal: Array, step: float, constant: float) -> Array:
    """Lag ``signal`` (samples,) by T y' = x - y with T = ``constant`` (s), beginning settled.

    Samples are ``step`` (s) apart; the signal is straight between them.
    """
    decay = math.exp(-step / constant)
    newer = 1 - (1 - decay) * constant / step  # weight of the newer sample, exact for a straight line
    older = 1 - decay - newer
    lagging, _ = scipy.signal.lfilter([newer, older], [1.0, -decay], signal, zi=[(decay + older) * signal[0]])
    return np.asarray(lagging)


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
}
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
    """Sensors that record a simulated motion."""

    rate_hz: float  # Hz, samples per second
    channels: Mapping[str, Sensor]  # by the name of the column that each one writes


def read_sensors(path: Path) -> Sensors:
    """Read the file at ``path``."""
    content = read(FILE, read_toml(path, "sensor file"), where=str(path))
    for name, sensor in content["channels"].items():
        if {"correlation", "bandwidth_hz"} <= set(sensor):
            raise InputError(f"{path}: [channels.{name}]: correlation and bandwidth_hz give the same; keep one")
    if not set(content["channels"]) & set(CHANNELS):
        motions = ", ".join(name for name in RECORDED if name in CHANNELS)
        raise InputError(f"{path}: [channels]: no motion is recorded; add one of {motions}")
    return Sensors(content["rate_hz"], {name: Sensor(**sensor) for name, sensor in content["channels"].items()})


LABEL = "# SYNTHETIC: computed by velotyre simulate and not measured"
SEPARATORS = str.maketrans(",;\t", "   ")  # a line that holds them looks like a line of the table to other readers


def record_motion(response: Response, sensors: Sensors, seed: int | None = None) -> dict[str, Array]:
    """Columns (samples,) of a recording, ``time_s`` first, SI."""
    dense = response.time
    count = math.floor((dense[-1] - dense[0]) * sensors.rate_hz * (1 + 1e-9)) + 1
    if count < FEWEST:
        raise InputError(
            f"{count} samples at {sensors.rate_hz:g} Hz until {dense[-1]:.3g} s are too few for a recording "
            f"(at least {FEWEST}); take a longer --duration, or a motion that does not fall so soon"
        )
    time = np.arange(count) / sensors.rate_hz
    signals = {**response.outputs, **response.inputs}
    columns = {"time_s": time}
    for name, sensor in sensors.channels.items():
        true = np.asarray(signals.get(RECORDED[name], np.zeros(len(dense))))  # a torque that nobody gives is zero
        words = [seed or 0, round(1e6 * response.speed), zlib.crc32(name.encode())]
        columns[name] = sensor.read(dense, true, time, None if seed is None else np.random.default_rng(words))
    return columns


def write_recording(target: Path, columns: dict[str, Array], words: str) -> None:
    """Write ``columns`` (samples,), SI, to the CSV file ``target``; ``words`` say how they were made."""
    lines = [f"{LABEL}: {' '.join(words.translate(SEPARATORS).split())}", ",".join(columns)]
    lines += [",".join(f"{x + 0.0:.9g}" for x in row) for row in zip(*columns.values(), strict=True)]
    write_text(target, "\n".join(lines) + "\n")


def fine_step(sensors: Sensors, most: float) -> float:
    """Time between samples of a simulation in which every recorded one falls on a computed one, s; up to ``most`` s."""
    return 1 / (sensors.rate_hz * math.ceil(1 / (sensors.rate_hz * most) - 1e-9))


EXAMPLE = """\
# Sensors of a simulated ride:
# velotyre simulate MODEL --speed 5 --initial lean_rate=0.3 --sensors {file} --noise --out ride
# Written by `velotyre new`. Numbers are in the unit that the channel's name ends in, unless the key says another.

rate_hz = 100                  # samples per second

[channels.roll_rate_rad_s]     # also lean_rad, steer_rad, steer_rate_rad_s, yaw_rate_rad_s, lean_torque_N_m
noise_sd = 0.01                # standard deviation; drawn with --noise only
bandwidth_hz = 20              # corner frequency of the noise, or correlation = 0.3 of neighbouring samples; else white
# scale_error = 0.02           # reads 2 % too much
# offset = 0.005               # at the start
# drift_per_s = 0.001          # growth of the offset
# delay_s = 0.01               # late
# low_pass_hz = 10             # corner frequency of a first-order filter

[channels.steer_rad]
noise_sd = 0.002
resolution = 0.0015            # step of an encoder

[channels.steer_torque_N_m]    # an empty table is a perfect sensor
"""
