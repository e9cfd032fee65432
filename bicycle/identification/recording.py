"""Time histories: recorded motion and torques of one run per CSV file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError, is_number, shown, unknown

CHANNELS = {
    "roll_rate_rad_s": "lean_rate", "lean_rad": "lean", "steer_rad": "steer", "steer_rate_rad_s": "steer_rate",
    "yaw_rate_rad_s": "yaw_rate", "lateral_acceleration_m_s2": "lateral_acceleration",
}  # fmt: skip
"""Columns that are measured, and the output of the model they show."""

INPUTS = {"steer_torque_N_m": "steer_torque", "lean_torque_N_m": "lean_torque"}
KEYS = ("drop_first_s", "runs", "noise_sd")
RUN_KEYS = ("file", "speed_m_s", "group")
FASTEST = 60.0  # m/s
LARGEST = {
    "lean_rad": (1.6, "degrees"), "steer_rad": (1.6, "degrees"), "roll_rate_rad_s": (20.0, "degrees"),
    "steer_rate_rad_s": (50.0, "degrees"), "yaw_rate_rad_s": (20.0, "degrees"),
    "steer_torque_N_m": (1e3, "N mm"), "lean_torque_N_m": (1e4, "N mm"),
}  # fmt: skip
"""Beyond these a column is surely in another unit."""

LONGEST_STEP = 0.4  # s; beyond it no mode is seen, or time is in ms
PLACELESS = {"lateral_acceleration_m_s2"}
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

    Parameters
    ----------
    table : mapping
        As read from TOML.
    folder : Path
        What the files of the runs are relative to.

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
    if not is_number(drop) or not 0 <= drop < math.inf:
        raise InputError(f"[histories]: drop_first_s = {shown(drop)} must be a time >= 0 in s")
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
    if not set(runs[0].channels) - PLACELESS:
        raise InputError(
            f"{runs[0].name}: {', '.join(runs[0].channels)} cannot be compared, for the place of the sensor is not "
            f"known; add one of {', '.join(name for name in CHANNELS if name not in PLACELESS)}"
        )
    noise = table.get("noise_sd", {})
    if not isinstance(noise, Mapping):
        raise InputError(f"[histories]: noise_sd = {shown(noise)} must be a table: write [histories.noise_sd]")
    for name, sd in noise.items():
        if name not in runs[0].channels:
            raise InputError(f"[histories.noise_sd]: {unknown('channel', name, runs[0].channels)}")
        if not is_number(sd) or not 0 < sd < math.inf:
            raise InputError(
                f"[histories.noise_sd]: {name} = {shown(sd)} must be positive; leave it out to estimate it"
            )
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
        what = f"file = {shown(entry['file'])} must be a path in quotes" if "file" in entry else "no file"
        raise InputError(f'[[histories.runs]]: {what}; write file = "RUN.csv"')
    where, speed, group = f"[[histories.runs]] {entry['file']}", entry.get("speed_m_s"), entry.get("group", "")
    if speed is None:
        raise InputError(f"{where}: no speed_m_s; give the forward speed in m/s")
    if not is_number(speed) or not 0 < speed <= FASTEST:
        raise InputError(
            f"{where}: speed_m_s = {shown(speed)} is outside 0 .. {FASTEST:g} m/s; is it in km/h, or in quotes?"
        )
    if isinstance(group, bool) or not isinstance(group, str | int):
        raise InputError(f"{where}: group = {shown(group)} must be a name in quotes")
    run = replace(read_run(folder / entry["file"], float(speed), str(group)), name=Path(entry["file"]).as_posix())
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
    """One CSV with ``time_s`` and any of the channels and inputs.

    Parameters
    ----------
    path : Path
    speed : float
        Forward speed, m/s.
    group : str, optional
        Runs of one group are held out together; without one, those of one speed are.
    """
    columns = read_columns(path, numbers=("time_s", *CHANNELS, *INPUTS), needed=("time_s",))
    numbers, lines = columns.numbers, columns.lines
    time = numbers["time_s"]
    channels = {name: column for name, column in numbers.items() if name in CHANNELS}
    if not channels:
        raise InputError(f"{path}: no motion was recorded; give at least one of {', '.join(CHANNELS)}")
    if len(time) < FEWEST:
        raise InputError(f"{path}: {len(time)} samples are too few; at least {FEWEST} are needed")
    steps = np.diff(time)
    if steps.min() <= 0:
        row = int(np.argmin(steps))
        raise InputError(
            f"{path}, line {lines[row + 1]}: time_s = {time[row + 1]:g} does not rise from {time[row]:g}; put the "
            "samples in the order of time, each once"
        )
    if np.median(steps) > LONGEST_STEP:
        raise InputError(
            f"{path}: time_s steps by {np.median(steps):g} s, too long to see a mode (up to {LONGEST_STEP:g} s); "
            "is it in ms?"
        )
    if steps.max() - steps.min() > 0.1 * np.median(steps):
        row = int(np.argmax(np.abs(steps - np.median(steps))))
        raise InputError(
            f"{path}, line {lines[row + 1]}: time_s steps by {steps[row]:g} s where {np.median(steps):g} s is usual; "
            "resample to even steps"
        )
    for name, column in channels.items():
        if np.ptp(column) == 0:
            raise InputError(f"{path}: {name} is constant ({column[0]:g}): a dead channel; leave the column out")
    for name, (largest, unit) in LARGEST.items():
        row = int(np.abs(numbers[name]).argmax()) if name in numbers else 0
        if name in numbers and abs(numbers[name][row]) > largest:
            raise InputError(
                f"{path}, line {lines[row]}: {name} = {numbers[name][row]:g} is too large (up to {largest:g}); "
                f"is it in {unit}?"
            )
    return Run(path.name, speed, time, channels, {k: x for k, x in numbers.items() if k in INPUTS}, group)
