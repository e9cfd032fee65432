"""Time histories: recorded motion and torques of one run per CSV file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.checks import any_table, list_of, number, refused
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError
from tyre.base.schema import by_name, maybe, needed, path_key, read, table

CHANNELS = {
    "roll_rate_rad_s": "lean_rate", "lean_rad": "lean", "steer_rad": "steer", "steer_rate_rad_s": "steer_rate",
    "yaw_rate_rad_s": "yaw_rate", "lateral_acceleration_m_s2": "lateral_acceleration",
}  # fmt: skip
"""Columns that are measured, and the output of the model they show."""

INPUTS = {"steer_torque_N_m": "steer_torque", "lean_torque_N_m": "lean_torque"}
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


def _group(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, str | int):
        raise refused(value, "must be a name in quotes")
    return str(value)


HOW = "write [[histories.runs]] with file and speed_m_s for each"
TABLE = table(
    {
        needed("runs", f"no runs; {HOW}"): list_of(
            any_table, f"must be tables with file and speed_m_s: {HOW}", least=1
        ),
        maybe("drop_first_s", 0.0): number(least=0, says="must be a time >= 0 in s"),
        maybe("noise_sd", {}): any_table,
    }
)
RUN = table(
    {
        **path_key("file", "RUN.csv"),
        needed("speed_m_s", "no speed_m_s; give the forward speed in m/s"): number(
            above=0, most=FASTEST, says=f"is outside 0 .. {FASTEST:g} m/s; is it in km/h, or in quotes?"
        ),
        maybe("group", ""): _group,
    }
)
NOISE_SD = number(above=0, says="must be positive; leave it out to estimate it")


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


def read_runs(content: Mapping[str, Any], folder: Path) -> tuple[tuple[Run, ...], dict[str, float], tuple[str, ...]]:
    """Read the runs of the table ``[histories]``.

    Parameters
    ----------
    content : mapping
        The table.
    folder : Path
        Where the files that it names are.

    Returns
    -------
    runs : tuple of Run
    noise_sd : dict
        Standard deviations that are given, by channel, in its unit.
    notes : tuple of str

    Raises
    ------
    InputError
        Unknown keys or columns, a speed out of range, uneven sampling, degrees, dead channels, a run twice.
    """
    histories = read(TABLE, content, section="histories")
    drop = histories["drop_first_s"]
    runs = [_run(entry, folder, drop) for entry in histories["runs"]]
    _refuse_repeats(runs)
    channels = runs[0].channels
    if not set(channels) - PLACELESS:
        raise InputError(
            f"{runs[0].name}: {', '.join(channels)} cannot be compared, for the place of the sensor is not "
            f"known; add one of {', '.join(name for name in CHANNELS if name not in PLACELESS)}"
        )
    noise = read(by_name(NOISE_SD, channels, kind="channel"), histories["noise_sd"], section="histories.noise_sd")
    estimated = [name for name in channels if name not in noise]
    notes = [f"noise of {', '.join(estimated)} is estimated from the residual"] if estimated else []
    if drop == 0:
        notes.append("no start transient is dropped (drop_first_s = 0): a kick must not last into the record")
    return tuple(runs), noise, tuple(notes)


def _refuse_repeats(runs: list[Run]) -> None:
    for place, run in enumerate(runs):
        if set(run.channels) != set(runs[0].channels) or set(run.inputs) != set(runs[0].inputs):
            raise InputError(f"{run.name}: has other columns than {runs[0].name}; all runs need the same channels")
        for other in runs[:place]:
            same = len(run.time) == len(other.time) and all(
                (run.channels[c] == x).all() for c, x in other.channels.items()
            )
            if run.name == other.name or same:
                raise InputError(f"{run.name}: the same recording as {other.name}; keep one, or it counts twice")


def _run(entry: Mapping[str, Any], folder: Path, drop: float) -> Run:
    given = read(RUN, entry, where=" ".join(["[[histories.runs]]", str(entry.get("file", ""))]).strip())
    run = replace(
        read_run(folder / given["file"], given["speed_m_s"], given["group"]), name=Path(given["file"]).as_posix()
    )
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
    """Read one recording: a CSV with ``time_s`` and any of the channels and inputs.

    Parameters
    ----------
    path : Path
    speed : float
        Forward speed, m/s.
    group : str
        Runs of one group are held out together.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        No such file, other columns, uneven sampling, another unit, a dead channel.
    """
    columns = read_columns(path, numbers=("time_s", *CHANNELS, *INPUTS), needed=("time_s",))
    numbers, time = columns.numbers, columns.numbers["time_s"]
    channels = {name: column for name, column in numbers.items() if name in CHANNELS}
    if not channels:
        raise InputError(f"{path}: no motion was recorded; give at least one of {', '.join(CHANNELS)}")
    _check_time(path, time, columns.lines)
    for name, column in channels.items():
        if np.ptp(column) == 0:
            raise InputError(f"{path}: {name} is constant ({column[0]:g}): a dead channel; leave the column out")
    for name, (largest, unit) in LARGEST.items():
        row = int(np.abs(numbers[name]).argmax()) if name in numbers else 0
        if name in numbers and abs(numbers[name][row]) > largest:
            raise InputError(
                f"{path}, line {columns.lines[row]}: {name} = {numbers[name][row]:g} is too large (up to {largest:g}); "
                f"is it in {unit}?"
            )
    return Run(path.name, speed, time, channels, {k: x for k, x in numbers.items() if k in INPUTS}, group)


def _check_time(path: Path, time: Array, lines: Sequence[int]) -> None:
    if len(time) < FEWEST:
        raise InputError(f"{path}: {len(time)} samples are too few; at least {FEWEST} are needed")
    steps = np.diff(time)
    usual = np.median(steps)
    row = int(np.argmin(steps))
    if steps[row] <= 0:
        raise InputError(
            f"{path}, line {lines[row + 1]}: time_s = {time[row + 1]:g} does not rise from {time[row]:g}; put the "
            "samples in the order of time, each once"
        )
    if usual > LONGEST_STEP:
        raise InputError(
            f"{path}: time_s steps by {usual:g} s, too long to see a mode (up to {LONGEST_STEP:g} s); is it in ms?"
        )
    if steps.max() - steps.min() > 0.1 * usual:
        row = int(np.argmax(np.abs(steps - usual)))
        raise InputError(
            f"{path}, line {lines[row + 1]}: time_s steps by {steps[row]:g} s where {usual:g} s is usual; "
            "resample to even steps"
        )
