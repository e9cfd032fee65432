"""Read recorded motion and torques of runs, and check each recording."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tyre.arrays import Array
from tyre.channel_map import ChannelMap, Mounting
from tyre.channels import Record, read_records
from tyre.clock import GAP, fills, how_to
from tyre.draft import draft_words, refuse_unmapped
from tyre.errors import InputError
from tyre.formats import contents
from tyre.table import read_columns
from tyre.units import quantity_of


@dataclass(frozen=True)
class Run:
    """One recorded run of a bicycle, equidistant samples in SI units."""

    name: str
    speed: float  # m/s
    time: Array  # s
    channels: Mapping[str, Array]  # measured, by column
    inputs: Mapping[str, Array]  # known, by column
    group: str = ""  # runs of one group are held out together
    mountings: tuple[Mounting, ...] = ()  # rotations of sensors that were applied, each with its uncertainty
    notes: tuple[str, ...] = ()  # what was done to the recording
    held_out: bool = False  # never fitted, only predicted
    between: str = ""  # how the torques go from sample to sample: held or linear; empty if nobody said so

    @property
    def step(self) -> float:
        """Sample time, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))


def refuse_copies(runs: Sequence[Run]) -> None:
    """Refuse a recording that stands twice among ``runs``: it would count as two."""
    seen: dict[tuple[tuple[str, bytes], ...], Run] = {}
    for run in runs:
        samples = tuple((name, run.channels[name].tobytes()) for name in sorted(run.channels))
        if (other := seen.setdefault(samples, run)) is not run:
            raise InputError(f"{run.name}: the same recording as {other.name}; keep one, or it counts twice")


CHANNELS = {
    "roll_rate_rad_s": "lean_rate", "lean_rad": "lean", "steer_rad": "steer", "steer_rate_rad_s": "steer_rate",
    "yaw_rate_rad_s": "yaw_rate", "lateral_acceleration_m_s2": "lateral_acceleration",
}  # fmt: skip
"""Columns that are measured, and the output of the model they show."""

STEER, STEER_TORQUE = "steer_rad", "steer_torque_N_m"
MOTOR_IN_TORQUE = "motor_in_torque"
"""Key of a table of recordings: true if the recorded steer torque holds that of a motor of the bicycle."""
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

LATERAL_FORCE = "lateral_force_N"
FORCED_INPUTS: Mapping[str, str] = {**{name: column for column, name in INPUTS.items()}, "lateral_force": LATERAL_FORCE}
MOTIONS: Mapping[str, str] = {re.sub(r"_(rad|rad_s|m_s2)$", "", column): column for column in CHANNELS}
"""Inputs and motions of a frequency response, and their columns."""

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
    """Read one recording: a CSV with ``time_s`` and any of the channels and inputs."""
    try:
        columns = read_columns(path, numbers=("time_s", *CHANNELS, *SAME, *INPUTS), needed=("time_s",))
    except InputError as error:
        raise _with_draft(error, path, "") from error
    numbers: dict[str, Array] = {}
    for column, values in columns.numbers.items():
        name = SAME.get(column, column)
        if name in columns.numbers and name != column:
            raise InputError(f"{path}: {column} and {name} are the same quantity; keep one column")
        numbers[name] = values
    return _checked(str(path), path.name, numbers, [f"line {line}" for line in columns.lines], speed, group)


def _with_draft(error: InputError, path: Path, more: str) -> InputError:
    """Error with the draft of a channel map; a fault in one line of the file needs none."""
    words = "" if f"{path}, line" in str(error) else draft_words(path, QUANTITIES)
    return InputError(f"{error}; {more}or give a channel map: {words}") if words else error


def read_events(path: Path, speed: float, group: str = "", *, channel_map: ChannelMap | None = None) -> tuple[Run, ...]:
    """Read the events of a recording in any columns, units and formats; with several, each is called ``FILE#EVENT``."""
    if channel_map is None:
        if path.suffix.casefold() not in ("", ".csv"):
            refuse_unmapped(path, QUANTITIES)
        return (read_run(path, speed, group),)
    return tuple(run_of(record, path, speed, group) for record in read_records(path, channel_map, QUANTITIES))


def run_of(record: Record, path: Path, speed: float, group: str = "") -> Run:
    """Make a run of one event of a recording, and check it."""
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
    """Check columns and make a run of them; ``places`` is what messages call the samples."""
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


def read_forced(
    path: Path, speed: float, *, reference: str = "", channel_map: ChannelMap | None = None
) -> tuple[Run, ...]:
    """Read the events of a forced run; its ``inputs`` hold torques, the lateral force and the reference."""
    if channel_map is not None:
        known = {**QUANTITIES, "lateral_force": "force"}
        if reference and reference not in known:
            if reference not in channel_map.channels:
                raise InputError(
                    f"{path}: no channel {reference!r}; map it with a unit, any: {reference} = "
                    '{column = "...", unit = "N m"}'
                )
            known[reference] = quantity_of(channel_map.channels[reference].unit) or "moment"
        records = read_records(path, channel_map, known)
        return tuple(_run(record, path, speed, reference) for record in records)
    if path.suffix.casefold() not in ("", ".csv"):
        refuse_unmapped(path, QUANTITIES)
    own = ("time_s", *CHANNELS, *INPUTS, LATERAL_FORCE)
    more = [] if reference in ("", *own) else [reference]
    try:
        columns = read_columns(path, numbers=(*own, *more), needed=("time_s", *more))
    except InputError as error:
        there = [] if f"{path}, line" in str(error) else [column.name for column in contents(path).columns]
        if more and "time_s" in there and reference not in there:
            every = ", ".join(there)
            raise InputError(f"{path}: --instrument {reference}: there is no such column; it has {every}") from error
        raise _with_draft(error, path, "a reference is named with --instrument; ") from error
    numbers = dict(columns.numbers)
    names = {column: name for name, column in {**FORCED_INPUTS, **MOTIONS}.items()}
    values = {names.get(column, column): x for column, x in numbers.items() if column != "time_s"}
    return (_run(Record(str(path), numbers["time_s"], values), path, speed, names.get(reference, reference)),)


def _run(record: Record, path: Path, speed: float, reference: str) -> Run:
    further = {k: x for k, x in record.values.items() if k not in QUANTITIES}
    own = replace(record, values={k: x for k, x in record.values.items() if k in QUANTITIES})
    run = run_of(own, path, speed)
    inputs = {FORCED_INPUTS.get(name, name): x for name, x in further.items()}
    column = {**FORCED_INPUTS, **MOTIONS}.get(reference, reference)
    if reference and column not in inputs:
        inputs[column] = {**run.channels, **run.inputs}[column]
    for name, x in inputs.items():
        if not np.isfinite(x).all():
            fill = f"{how_to(record.time)}, " if fills(record.time, x) else ""
            way_out = f"{fill}cut the recording with [[windows]] or repair it"
            raise InputError(f"{record.source}: {name} lacks samples; {way_out}")
        if np.ptp(x) == 0:
            raise InputError(f"{record.source}: {name} is constant ({x[0]:g}): it moves nothing; leave it out")
    return replace(run, inputs={**run.inputs, **inputs})
