"""Recorded motion and torques of runs: reading and checking one recording."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bicycle.identification.run import Run
from tyre.base.arrays import Array
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.clock import GAP
from tyre.channels.draft import draft_words, refuse_unmapped
from tyre.channels.even_steps import fills, how_to
from tyre.channels.record import Record, read_records

CHANNELS = {
    "roll_rate_rad_s": "lean_rate", "lean_rad": "lean", "steer_rad": "steer", "steer_rate_rad_s": "steer_rate",
    "yaw_rate_rad_s": "yaw_rate", "lateral_acceleration_m_s2": "lateral_acceleration",
}  # fmt: skip
"""Columns that are measured, and the output of the model they show."""

STEER, STEER_TORQUE = "steer_rad", "steer_torque_N_m"
MOTOR_IN_TORQUE = "motor_in_torque"
"""Key of a table of recordings: whether the recorded steer torque holds that of a motor of the bicycle."""
BETWEEN, AS_HELD, AS_LINEAR = "torque_between_samples", "held", "linear"
"""Another: how the recorded torques go from one sample to the next, and its words."""
SAME = {"lean_rate_rad_s": "roll_rate_rad_s"}
"""Columns by another name: that of the model's state, which ``velotyre simulate`` writes."""
INPUTS = {STEER_TORQUE: "steer_torque", "lean_torque_N_m": "lean_torque"}
QUANTITIES = {
    "roll_rate": "angular rate", "lean": "angle", "steer": "angle", "steer_rate": "angular rate",
    "yaw_rate": "angular rate", "lateral_acceleration": "acceleration", "steer_torque": "moment",
    "lean_torque": "moment",
}  # fmt: skip
"""Channels of a channel map beside ``time``, and what each measures; the columns above begin with these names."""

_ENDS = {"angle": "rad", "angular rate": "rad_s", "acceleration": "m_s2", "moment": "N_m"}

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
    try:
        columns = read_columns(path, numbers=("time_s", *CHANNELS, *SAME, *INPUTS), needed=("time_s",))
    except InputError as error:
        words = "" if f"{path}, line" in str(error) else draft_words(path, QUANTITIES)
        raise InputError(f"{error}; or give a channel map: {words}" if words else str(error)) from error
    numbers: dict[str, Array] = {}
    for column, values in columns.numbers.items():
        name = SAME.get(column, column)
        if name in columns.numbers and name != column:
            raise InputError(f"{path}: {column} and {name} are the same quantity; keep one column")
        numbers[name] = values
    return _checked(str(path), path.name, numbers, [f"line {line}" for line in columns.lines], speed, group)


def read_events(path: Path, speed: float, group: str = "", *, channel_map: ChannelMap | None = None) -> tuple[Run, ...]:
    """Read the events of a recording in any columns, units and formats.

    Parameters
    ----------
    path : Path
    speed : float
        Forward speed, m/s.
    group : str
        Runs of one group are held out together.
    channel_map : ChannelMap, optional
        Which column is which channel; without, the file must be as :func:`read_run` reads it.

    Returns
    -------
    tuple of Run
        One for every event; with several, each is called ``FILE#EVENT``.

    Raises
    ------
    InputError
        As :func:`read_run` and :func:`tyre.channels.record.read_records`; a sample that is missing.
    """
    if channel_map is None:
        if path.suffix.casefold() not in ("", ".csv"):
            refuse_unmapped(path, QUANTITIES)
        return (read_run(path, speed, group),)
    return tuple(run_of(record, path, speed, group) for record in read_records(path, channel_map, QUANTITIES))


def run_of(record: Record, path: Path, speed: float, group: str = "") -> Run:
    """One event of a recording as a run, checked.

    Parameters
    ----------
    record : Record
    path : Path
        The recording.
    speed : float
        Forward speed, m/s.
    group : str
        Runs of one group are held out together.

    Raises
    ------
    InputError
        As :func:`read_run`; a sample that is missing.
    """
    numbers = {f"{name}_{_ENDS[QUANTITIES[name]]}": x for name, x in record.values.items()}
    for name, x in numbers.items():
        if not np.isfinite(x).all():
            missing = np.flatnonzero(~np.isfinite(x))
            fill = f"{how_to(record.time)}, " if fills(record.time, *numbers.values()) else ""
            raise InputError(
                f"{record.source}: {name} is missing in {missing.size} samples, first in sample {missing[0] + 1}; "
                f"{fill}cut the recording with [[windows]] or repair it"
            )
    numbers["time_s"] = record.time
    places = [f"sample {place}" for place in range(1, len(record.time) + 1)]
    name = record.source.removeprefix(str(path.parent)).lstrip("/\\")
    run = _checked(record.source, name, numbers, places, speed, group)
    return replace(run, mountings=record.mountings, notes=(*run.notes, *record.notes))


def _checked(
    source: str, name: str, numbers: Mapping[str, Array], places: Sequence[str], speed: float, group: str
) -> Run:
    """A run of checked columns; ``places`` is what messages call the samples."""
    time = numbers["time_s"]
    channels = {name: column for name, column in numbers.items() if name in CHANNELS}
    if not channels:
        raise InputError(f"{source}: no motion was recorded; give at least one of {', '.join(CHANNELS)}")
    _check_time(source, time, places)
    for channel, column in channels.items():
        if np.ptp(column) == 0:
            raise InputError(f"{source}: {channel} is constant ({column[0]:g}): a dead channel; leave the column out")
    for channel, (largest, unit) in LARGEST.items():
        row = int(np.abs(numbers[channel]).argmax()) if channel in numbers else 0
        if channel in numbers and abs(numbers[channel][row]) > largest:
            raise InputError(
                f"{source}, {places[row]}: {channel} = {numbers[channel][row]:g} is too large (up to {largest:g}); "
                f"is it in {unit}?"
            )
    inputs = {key: column for key, column in numbers.items() if key in INPUTS}
    notes = tuple(
        f"{key} is {x[0]:g} in all samples: it stayed the same during the run, or the channel is dead"
        for key, x in inputs.items()
        if np.ptp(x) == 0
    )
    return Run(name, speed, time, channels, inputs, group, notes=notes)


def _check_time(path: str, time: Array, places: Sequence[str]) -> None:
    if len(time) < FEWEST:
        raise InputError(f"{path}: {len(time)} samples are too few; at least {FEWEST} are needed")
    steps = np.diff(time)
    usual = np.median(steps)
    row = int(np.argmin(steps))
    if steps[row] <= 0:
        raise InputError(
            f"{path}, {places[row + 1]}: time_s = {time[row + 1]:g} does not rise from {time[row]:g}; put the "
            "samples in the order of time, each once"
        )
    if usual > LONGEST_STEP:
        raise InputError(
            f"{path}: time_s steps by {usual:g} s, too long to see a mode (up to {LONGEST_STEP:g} s); is it in ms?"
        )
    if steps.max() - steps.min() > 0.1 * usual:
        row = int(np.argmax(np.abs(steps - usual)))
        how = f"in a channel map, {how_to(time)}"
        if steps.max() > GAP * usual:
            how = f"[resampling] leaves gaps of more than {GAP:g} steps open, so cut the recording there"
        raise InputError(
            f"{path}, {places[row + 1]}: time_s steps by {steps[row]:g} s where {usual:g} s is usual; resample to even "
            f"steps: {how}"
        )
