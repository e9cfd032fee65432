"""Time histories: recorded motion and torques of one run per CSV file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.missing_effect.motion.csv_table import read_columns
from tyre.errors import InputError, unknown

Array = NDArray[np.float64]
CHANNELS = {
    "roll_rate_rad_s": "lean_rate", "lean_rad": "lean", "steer_rad": "steer", "steer_rate_rad_s": "steer_rate",
    "yaw_rate_rad_s": "yaw_rate", "lateral_acceleration_m_s2": "lateral_acceleration",
}  # fmt: skip
"""Columns that are measured, and the output of the model they show."""

INPUTS = {"steer_torque_N_m": "steer_torque", "lean_torque_N_m": "lean_torque"}
KEYS = ("drop_first_s", "runs", "noise_sd")
RUN_KEYS = ("file", "speed_m_s", "group")
FASTEST = 60.0  # m/s
LARGEST = {"lean_rad": 1.6, "steer_rad": 1.6, "roll_rate_rad_s": 20.0, "steer_rate_rad_s": 50.0, "yaw_rate_rad_s": 20.0}
"""Beyond these a column is surely in degrees."""

FEWEST = 20  # samples


@dataclass(frozen=True)
class Run:
    """One run: equidistant samples ``time`` (s), measured ``channels`` and known ``inputs`` by column name, SI."""

    name: str
    speed: float
    time: Array
    channels: Mapping[str, Array]
    inputs: Mapping[str, Array]
    group: str = ""

    @property
    def step(self) -> float:
        """Sample time, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))


def read_runs(table: Mapping[str, Any], folder: Path) -> tuple[tuple[Run, ...], dict[str, float], tuple[str, ...]]:
    """Runs, given noise standard deviations and notes of the table ``[histories]``.

    Raises
    ------
    InputError
        Unknown keys or columns, a speed out of range, uneven sampling, degrees, dead channels, a run twice.
    """
    for key in table:
        if key not in KEYS:
            raise InputError(f"[histories]: {unknown('key', key, KEYS)}")
    entries, drop = table.get("runs"), table.get("drop_first_s", 0.0)
    if not isinstance(entries, list) or not entries:
        raise InputError("[histories]: no runs; write [[histories.runs]] with file and speed_m_s for each")
    if isinstance(drop, bool) or not isinstance(drop, int | float) or not 0 <= drop < math.inf:
        raise InputError(f"[histories]: drop_first_s = {drop!r} must be a time >= 0 in s")
    runs = [_run(entry, folder, float(drop)) for entry in entries]
    for number, run in enumerate(runs):
        if set(run.channels) != set(runs[0].channels) or set(run.inputs) != set(runs[0].inputs):
            raise InputError(f"{run.name}: has other columns than {runs[0].name}; all runs need the same channels")
        for other in runs[:number]:
            if run.name == other.name or (
                len(run.time) == len(other.time)
                and all((run.channels[c] == other.channels[c]).all() for c in run.channels)
            ):
                raise InputError(f"{run.name}: the same recording as {other.name}; keep one, or it counts twice")
    noise = table.get("noise_sd", {})
    for name, sd in noise.items():
        if name not in runs[0].channels:
            raise InputError(f"[histories.noise_sd]: {unknown('channel', name, runs[0].channels)}")
        if isinstance(sd, bool) or not isinstance(sd, int | float) or not 0 < sd < math.inf:
            raise InputError(f"[histories.noise_sd]: {name} = {sd!r} must be positive; leave it out to estimate it")
    estimated = [name for name in runs[0].channels if name not in noise]
    notes = [f"noise of {', '.join(estimated)} is estimated from the residual"] if estimated else []
    if drop == 0:
        notes.append("no start transient is dropped (drop_first_s = 0): a kick must not last into the record")
    return tuple(runs), dict(noise), tuple(notes)


def _run(entry: Any, folder: Path, drop: float) -> Run:
    if not isinstance(entry, Mapping):
        raise InputError("[[histories.runs]] must be tables with file and speed_m_s")
    for key in entry:
        if key not in RUN_KEYS:
            raise InputError(f"[[histories.runs]]: {unknown('key', key, RUN_KEYS)}")
    if not isinstance(entry.get("file"), str):
        raise InputError('[[histories.runs]]: file = "RUN.csv" is missing')
    speed = entry.get("speed_m_s")
    if isinstance(speed, bool) or not isinstance(speed, int | float) or not 0 < speed <= FASTEST:
        raise InputError(
            f"[[histories.runs]] {entry['file']}: speed_m_s = {speed!r} is outside 0 .. {FASTEST:g} m/s; is it in km/h?"
        )
    run = read_run(folder / entry["file"], float(speed), str(entry.get("group", "")))
    keep = run.time >= run.time[0] + drop - 1e-9
    if keep.sum() < FEWEST:
        raise InputError(
            f"{run.name}: {keep.sum()} samples after drop_first_s = {drop:g} s; at least {FEWEST} are needed"
        )
    return replace(
        run, time=run.time[keep], channels={k: x[keep] for k, x in run.channels.items()},
        inputs={k: x[keep] for k, x in run.inputs.items()},
    )  # fmt: skip


def read_run(path: Path, speed: float, group: str = "") -> Run:
    """One CSV with ``time_s`` and any of the channels and inputs."""
    numbers, _ = read_columns(path, numbers=("time_s", *CHANNELS, *INPUTS), needed=("time_s",))
    time = numbers["time_s"]
    channels = {name: column for name, column in numbers.items() if name in CHANNELS}
    if not channels:
        raise InputError(f"{path}: no motion was recorded; give at least one of {', '.join(CHANNELS)}")
    if len(time) < FEWEST:
        raise InputError(f"{path}: {len(time)} samples are too few; at least {FEWEST} are needed")
    steps = np.diff(time)
    if steps.min() <= 0 or steps.max() - steps.min() > 0.1 * np.median(steps):
        row = int(np.argmax(np.abs(steps - np.median(steps))))
        raise InputError(
            f"{path}, line {row + 3}: time_s steps by {steps[row]:g} s where {np.median(steps):g} s is usual; "
            "resample to even steps"
        )
    for name, column in channels.items():
        if np.ptp(column) == 0:
            raise InputError(f"{path}: {name} is constant ({column[0]:g}): a dead channel; leave the column out")
        if np.abs(column).max() > LARGEST.get(name, math.inf):
            row = int(np.abs(column).argmax())
            raise InputError(f"{path}, line {row + 2}: {name} = {column[row]:g} is too large; is it in degrees?")
    return Run(path.name, speed, time, channels, {k: x for k, x in numbers.items() if k in INPUTS}, group)
