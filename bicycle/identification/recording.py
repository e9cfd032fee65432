"""Read recorded motion and torques of runs, and the table ``[histories]`` of a measurement file that names them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats import contents
from tyre.formats.channel_map import TABLES, ChannelMap, Mounting
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, nearest_name, refuse_unknown
from tyre.ground.files import named_folder
from tyre.ground.schema import (
    any_table,
    anything,
    by_name,
    flag,
    list_of,
    maybe,
    needed,
    number,
    read,
    refusal,
    table,
    text,
)
from tyre.ground.text_table import read_columns
from tyre.ground.units import quantity_of
from tyre.recordings.channels import Record, read_records
from tyre.recordings.clock import GAP, fills, how_to
from tyre.recordings.draft import draft_words, looking, refuse_unmapped


@dataclass(frozen=True)
class Run:
    """One recorded run of a bicycle, equidistant samples in SI units."""

    name: str  # file, and the event in it where it holds several
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
    """Refuse a recording that occurs twice among ``runs``: it would have the weight of two."""
    run_by_samples: dict[tuple[tuple[str, bytes], ...], Run] = {}
    for run in runs:
        samples = tuple((name, run.channels[name].tobytes()) for name in sorted(run.channels))
        if (twin := run_by_samples.setdefault(samples, run)) is not run:
            raise InputError(f"{run.name}: the same recording as {twin.name}; keep one, or it counts twice")


CHANNELS = {  # columns that are measured, and the output of the model they show
    "roll_rate_rad_s": "lean_rate", "lean_rad": "lean", "steer_rad": "steer", "steer_rate_rad_s": "steer_rate",
    "yaw_rate_rad_s": "yaw_rate", "lateral_acceleration_m_s2": "lateral_acceleration",
}  # fmt: skip

STEER, STEER_TORQUE = "steer_rad", "steer_torque_N_m"
# key of a table of recordings: true if the recorded steer torque holds that of a motor of the bicycle
MOTOR_IN_TORQUE = "motor_in_torque"
# another: how the recorded torques go from one sample to the next, and its words
BETWEEN, AS_HELD, AS_LINEAR = "torque_between_samples", "held", "linear"
# columns by another name: that of the model's state, which velotyre simulate writes
SAME = {"lean_rate_rad_s": "roll_rate_rad_s"}
INPUTS = {STEER_TORQUE: "steer_torque", "lean_torque_N_m": "lean_torque"}
# channels of a channel map beside time, and what each measures; the columns above begin with these names
QUANTITIES = {
    "roll_rate": "angular rate", "lean": "angle", "steer": "angle", "steer_rate": "angular rate",
    "yaw_rate": "angular rate", "lateral_acceleration": "acceleration", "steer_torque": "moment",
    "lean_torque": "moment",
}  # fmt: skip

LATERAL_PUSH = "lateral_push_N"
# inputs and motions of a frequency response, and their columns
FORCED_INPUTS: Mapping[str, str] = {**{name: column for column, name in INPUTS.items()}, "lateral_push": LATERAL_PUSH}
MOTIONS: Mapping[str, str] = {re.sub(r"_(rad|rad_s|m_s2)$", "", column): column for column in CHANNELS}

_ENDS = {"angle": "rad", "angular rate": "rad_s", "acceleration": "m_s2", "moment": "N_m"}

FASTEST = 60.0  # m/s
LARGEST = {  # beyond these a column is surely in another unit
    "lean_rad": (1.6, "degrees"), "steer_rad": (1.6, "degrees"), "roll_rate_rad_s": (20.0, "degrees"),
    "steer_rate_rad_s": (50.0, "degrees"), "yaw_rate_rad_s": (20.0, "degrees"),
    "steer_torque_N_m": (1e3, "N mm"), "lean_torque_N_m": (1e4, "N mm"),
}  # fmt: skip

LEAST_MOTION = 1e-8  # SI; no sensor shows so little
LONGEST_STEP = 0.4  # s; beyond it no mode is seen, or time is in ms
PLACELESS = {"lateral_acceleration_m_s2"}
FEWEST = 20  # samples


def read_run(path: Path, speed: float, group: str = "") -> Run:
    """Read one recording: a CSV with ``time_s`` and any of the channels and inputs."""
    record, lines = own_columns(path)
    return run_of(record, path, speed, group, lines)


def own_columns(
    path: Path,
    further: Sequence[str] = (),
    needed: Sequence[str] = (),
    *,
    quantities: Mapping[str, str] = QUANTITIES,
    hint: str = "",
    missing: bool = False,
) -> tuple[Record, list[str]]:
    """Read a CSV in the columns above and ``further`` ones, with the places of its samples.

    A refusal drafts a channel map of ``quantities``, after a ``hint``. Values may be ``missing``: NaN.
    """
    if path.suffix.casefold() not in ("", ".csv"):
        refuse_unmapped(path, quantities)
    numbers = ("time_s", *CHANNELS, *SAME, *INPUTS, *further)
    try:
        columns = read_columns(path, numbers=numbers, needed=("time_s", *needed), blank=numbers[1:] if missing else ())
    except InputError as error:  # a fault in one line of the file needs no channel map
        words = "" if f"{path}, line" in str(error) else draft_words(path, quantities)
        raise InputError(f"{error}; {hint}or give a channel map: {words}") if words else error from error
    columns_read = dict(columns.numbers)
    time = columns_read.pop("time_s")
    names = {column: name for name, column in {**FORCED_INPUTS, **MOTIONS}.items()}
    for column in SAME.keys() & columns_read.keys():
        if SAME[column] in columns_read:
            raise InputError(f"{path}: {column} and {SAME[column]} are the same quantity; keep one column")
    values = {names.get(alias := SAME.get(column, column), alias): x for column, x in columns_read.items()}
    return Record(str(path), time, values), [f"line {line}" for line in columns.lines]


def read_events(path: Path, speed: float, group: str = "", *, channel_map: ChannelMap | None = None) -> tuple[Run, ...]:
    """Read the events of a recording in any columns, units and formats; with several, each is called ``FILE#EVENT``."""
    if channel_map is None:
        return (read_run(path, speed, group),)
    refuse_other_motions(path, channel_map)
    return tuple(run_of(record, path, speed, group) for record in read_records(path, channel_map, QUANTITIES))


def refuse_other_motions(path: Path, channel_map: ChannelMap, quantities: Mapping[str, str] = QUANTITIES) -> None:
    """Refuse a mapped channel that is none of ``quantities`` and neither turns a sensor nor triggers."""
    helpers = {name for mounting in channel_map.mountings for name in mounting.channels}
    helpers |= {window.trigger.channel for window in channel_map.windows if window.trigger}
    unknown_channel = next(
        (name for name in channel_map.channels if name not in helpers and name not in quantities), ""
    )
    # a name like one of ours is left to the reader, which asks whether that was meant
    if unknown_channel and not nearest_name(unknown_channel, quantities, cutoff=0.85):
        raise InputError(
            f"{path}: channel {unknown_channel!r} is no motion or torque of a bicycle, which are "
            f"{', '.join(quantities)}; an oscillation keeps its frequency and damping under any "
            "of these names that has its unit"
        )


def run_of(record: Record, path: Path, speed: float, group: str = "", lines: Sequence[str] = ()) -> Run:
    """Make a run of one event of a recording, and check it; ``lines`` are the places of its samples in the file."""
    source, time = record.source, record.time
    numbers = by_column(record)
    _refuse_missing(source, time, numbers)
    places = lines or [f"sample {place}" for place in range(1, len(time) + 1)]
    refuse_motionless(source, numbers)
    check_time(source, time, places)
    check_values(source, numbers, places)
    channels = {name: column for name, column in numbers.items() if name in CHANNELS}
    inputs = {key: column for key, column in numbers.items() if key in INPUTS}
    dead = tuple(
        f"{key} is {x[0]:g} in all samples: it stayed the same during the run, or the channel is dead"
        for key, x in inputs.items()
        if np.ptp(x) == 0
    )
    name = source.removeprefix(str(path.parent)).lstrip("/\\")
    return Run(name, speed, time, channels, inputs, group, record.mountings, (*dead, *record.notes))


def by_column(record: Record) -> dict[str, Array]:
    """Name the values of a record, (n,) in SI units, by the columns above."""
    return {f"{name}_{_ENDS[QUANTITIES[name]]}": x for name, x in record.values.items()}


def refuse_motionless(source: str, numbers: Mapping[str, Array]) -> None:
    """Refuse a recording whose columns hold no motion."""
    if not numbers.keys() & CHANNELS.keys():
        raise InputError(f"{source}: no motion was recorded; give at least one of {', '.join(CHANNELS)}")


def check_values(source: str, numbers: Mapping[str, Array], places: Sequence[str]) -> None:
    """Refuse a motion that never changes, and a column that is surely in another unit."""
    for channel, column in numbers.items():
        if channel in CHANNELS and np.ptp(column) == 0:
            raise InputError(f"{source}: {channel} is constant ({column[0]:g}): a dead channel; leave the column out")
        if channel in CHANNELS and np.ptp(column) < LEAST_MOTION:
            raise InputError(
                f"{source}: {channel} changes by {np.ptp(column):.2g} in all, less than {LEAST_MOTION:g}; correct its "
                "unit, or leave the column out"
            )
    for channel, (largest, unit) in LARGEST.items():
        row = int(np.abs(numbers[channel]).argmax()) if channel in numbers else 0
        if channel in numbers and abs(numbers[channel][row]) > largest:
            raise InputError(
                f"{source}, {places[row]}: {channel} = {numbers[channel][row]:g} is too large (up to {largest:g}); "
                f"is it in {unit}?"
            )


def _refuse_missing(source: str, time: Array, numbers: Mapping[str, Array]) -> None:
    for name, x in numbers.items():
        if not np.isfinite(x).all():
            missing = np.flatnonzero(~np.isfinite(x))
            fill = f"{how_to(time)}, " if fills(time, *numbers.values()) else ""
            raise InputError(
                f"{source}: {name} is missing in {missing.size} samples, first in sample {missing[0] + 1}; "
                f"{fill}cut the recording with [[windows]] or repair it"
            )


def check_time(path: str, time: Array, places: Sequence[str]) -> None:
    """Refuse a ``time`` (n,) in s that does not rise in even steps; ``places`` are those of its samples."""
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
        quantities = {**QUANTITIES, "lateral_push": "force"}
        if reference and reference not in quantities:
            if reference not in channel_map.channels:
                raise InputError(
                    f"{path}: no channel {reference!r}; map it with a unit, any: {reference} = "
                    '{column = "...", unit = "N m"}'
                )
            quantities[reference] = quantity_of(channel_map.channels[reference].unit) or "moment"
        return tuple(_run(record, path, speed, reference) for record in read_records(path, channel_map, quantities))
    column = SAME.get(reference, reference)
    more = [] if column in ("", "time_s", *CHANNELS, *INPUTS, LATERAL_PUSH) else [column]
    try:
        record, _ = own_columns(path, (LATERAL_PUSH, *more), more, hint="a reference is named with --instrument; ")
    except InputError as error:
        says_more = more and f"{path}, line" not in str(error)
        column_names = [column.name for column in contents(path).columns] if says_more else []
        if "time_s" in column_names and reference not in column_names:
            names = ", ".join(column_names)
            raise InputError(f"{path}: --instrument {reference}: there is no such column; it has {names}") from error
        raise
    return (_run(record, path, speed, column),)


def _run(record: Record, path: Path, speed: float, reference: str) -> Run:
    further_values = {k: x for k, x in record.values.items() if k not in QUANTITIES}
    run = run_of(replace(record, values={k: x for k, x in record.values.items() if k in QUANTITIES}), path, speed)
    inputs = {FORCED_INPUTS.get(name, name): x for name, x in further_values.items()}
    column = {**FORCED_INPUTS, **MOTIONS}.get(reference, reference)
    if reference and column not in inputs:
        inputs[column] = {**run.channels, **run.inputs}[column]
    _refuse_missing(record.source, record.time, inputs)
    for name, x in inputs.items():
        if np.ptp(x) == 0:
            raise InputError(f"{record.source}: {name} is constant ({x[0]:g}): it moves nothing; leave it out")
    return replace(run, inputs={**run.inputs, **inputs})


def _group(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, str | int):
        raise refusal(value, "must be a name in quotes")
    return str(value)


DRIVES = (*INPUTS, STEER)  # what may drive a replay
HOW = "write [[histories.runs]] with file and speed_m_s for each"
TIME = number(least=0, says="must be a time >= 0 in s, from the first sample of the run")
WINDOW = {maybe("first_s"): TIME, maybe("last_s"): TIME}
TABLE = table(
    {
        needed("runs", f"no runs; {HOW}"): list_of(
            any_table, f"must be tables with file and speed_m_s: {HOW}", least=1
        ),
        maybe("folder"): text('must be a folder in quotes, such as "runs" or "$VARIABLE/runs"', blank=False),
        maybe("input"): text(f"is not allowed; write one of {', '.join(map(repr, DRIVES))}", allowed=DRIVES),
        maybe("drop_first_s"): number(least=0, says="must be a time >= 0 in s"),
        maybe(MOTOR_IN_TORQUE): flag,
        maybe(BETWEEN): text(f"is not allowed; write {AS_HELD!r} or {AS_LINEAR!r}", allowed=(AS_HELD, AS_LINEAR)),
        **WINDOW,
        maybe("noise_sd", {}): any_table,
        **dict.fromkeys(map(maybe, TABLES), anything),
    }
)
KM_H = "speed_km_h"  # in place of speed_m_s
SPEED = number(above=0, most=3.6 * FASTEST, says=f"is outside 0 .. {3.6 * FASTEST:g} km/h, or in quotes")
RUN = table(
    {
        maybe("file"): text("must be a path in quotes", blank=False),
        maybe("files"): text('must be a pattern of paths in quotes, such as "kick_*.csv"', blank=False),
        needed("speed_m_s", f"no speed_m_s; give the forward speed in m/s, or {KM_H}"): number(
            above=0, most=FASTEST, says=f"is outside 0 .. {FASTEST:g} m/s; is it in km/h, or in quotes?"
        ),
        maybe("group", ""): _group,
        maybe("held_out", False): flag,
        **WINDOW,
        **dict.fromkeys(map(maybe, TABLES), anything),
    }
)
START = "first_s is called"
NOISE_SD = number(above=0, says="must be positive; leave it out to estimate it")


def read_runs(content: Mapping[str, Any], folder: Path) -> tuple[tuple[Run, ...], dict[str, float], tuple[str, ...]]:
    """Read the runs of the table ``[histories]``."""
    histories = read(TABLE, content, section="histories")
    folder = named_folder(histories["folder"], folder) if "folder" in histories else folder
    common = {key: histories[key] for key in (*TABLES, "first_s", "last_s") if key in histories}
    if "drop_first_s" in histories:
        if "first_s" in histories:
            raise InputError("[histories]: drop_first_s and first_s give the same; keep one")
        common |= {"first_s": histories["drop_first_s"], START: "drop_first_s"}
    used = common.pop("channels") if isinstance(common.get("channels"), list) else None
    drive = histories.get("input", "")
    read_in = [(run, entry) for entry in histories["runs"] for run in _runs(entry, folder, common)]
    runs = [
        replace(_keep_channels(_set_drive(run, drive), used), between=histories.get(BETWEEN, "")) for run, _ in read_in
    ]
    _refuse_repeats(runs, [entry for _, entry in read_in])
    if all(run.held_out for run in runs):
        raise InputError("[[histories.runs]]: held_out = true in every run; leave it out where a run is to be fitted")
    channels = runs[0].channels
    if not set(channels) - PLACELESS:
        raise InputError(
            f"{runs[0].name}: {', '.join(channels)} cannot be compared, for the place of the sensor is not "
            f"known; add one of {', '.join(name for name in CHANNELS if name not in PLACELESS)}"
        )
    noisy = (*channels, *(name for name in runs[0].inputs if name == STEER))
    noise = read(by_name(NOISE_SD, noisy, kind="channel"), histories["noise_sd"], section="histories.noise_sd")
    for name, sd in noise.items():
        varies = max(float(np.std({**run.channels, **run.inputs}[name])) for run in runs)
        if sd < 1e-6 * varies:  # the last digit of 20 bits: what is fitted would be rounding
            raise InputError(
                f"[histories.noise_sd]: {name} = {sd:g} is below a millionth of what it varies by ({varies:.3g}), less "
                f"than any sensor's noise; give {1e-6 * varies:.2g} or more, or leave it out to estimate it"
            )
    return tuple(runs), noise, tuple(_notes(histories, common, runs, noise))


NOTES = {
    "estimated": "noise of {channels} is estimated from the residual",
    "prescribed": f"{STEER} is prescribed: smoothed by a spline, the white noise of its record {{source}}; what noise "
    "and smoothing may have done to the angle and its derivatives is integrated out",
    "kick": "no start transient is dropped (drop_first_s = 0): the record must begin after an impulse has ended",
    "held out": "never fitted, only predicted: {runs}",
}


def _notes(
    histories: Mapping[str, Any], common: Mapping[str, Any], runs: Sequence[Run], noise: Mapping[str, float]
) -> Iterator[str]:
    """Notes on what the table leaves to be assumed, and those of the recordings."""
    estimated = [name for name in runs[0].channels if name not in noise]
    if estimated:
        yield NOTES["estimated"].format(channels=", ".join(estimated))
    if STEER in runs[0].inputs:
        source = "as the file says, or more where it shows more" if STEER in noise else "estimated from it"
        yield NOTES["prescribed"].format(source=source)
    starts = "first_s" in histories or all("first_s" in entry for entry in histories["runs"])
    if not starts and not common.get("first_s") and not set(INPUTS) & set(runs[0].inputs):
        yield NOTES["kick"]
    predicted = [run.name for run in runs if run.held_out]
    if predicted:
        yield NOTES["held out"].format(runs=", ".join(predicted))
    yield from (f"{run.name}: {note}" for run in runs for note in run.notes)


def _set_drive(run: Run, drive: str) -> Run:
    """Make the run as ``drive`` drives it; under a prescribed steer angle the steer torque is a measured channel."""
    recorded = {**run.channels, **run.inputs}
    if drive and drive not in recorded:
        raise InputError(f"{run.name}: input = {drive!r} was not recorded; the run holds {', '.join(recorded)}")
    if drive != STEER:
        return run
    channels = {name: x for name, x in run.channels.items() if not name.startswith("steer")}
    channels |= {STEER_TORQUE: run.inputs[STEER_TORQUE]} if STEER_TORQUE in run.inputs else {}
    if not channels:
        raise InputError(f"{run.name}: input = {drive!r}, and nothing else was recorded that it could explain")
    other_inputs = {name: x for name, x in run.inputs.items() if name != STEER_TORQUE}
    return replace(run, channels=channels, inputs={STEER: run.channels[STEER], **other_inputs})


def _keep_channels(run: Run, used: list[Any] | None) -> Run:
    """Keep the channels ``used``; the torques stay."""
    if used is None:
        return run
    refuse_unknown("channel", [str(name) for name in used], {*CHANNELS, *run.channels}, where="[histories]: channels")
    lacking = [name for name in used if name not in run.channels]
    if lacking or not used:
        what_is_there = f"{', '.join(lacking)} was not recorded; it holds" if lacking else "name one or more of"
        raise InputError(f"{run.name}: channels = {used!r}: {what_is_there} {', '.join(run.channels)}")
    return replace(run, channels={name: run.channels[name] for name in used})


def _refuse_repeats(runs: list[Run], entries: Sequence[Mapping[str, Any]]) -> None:
    """Refuse runs of other channels, and one that two entries name."""
    named_by = [next((f"{k} = {entry[k]!r}" for k in ("file", "files") if k in entry), "") for entry in entries]
    for place, run in enumerate(runs):
        if set(run.channels) != set(runs[0].channels) or set(run.inputs) != set(runs[0].inputs):
            raise InputError(f"{run.name}: has other columns than {runs[0].name}; all runs need the same channels")
        for earlier, by in zip(runs[:place], named_by, strict=False):
            if run.name == earlier.name:
                named_twice = f"{by} and by {named_by[place]}"
                raise InputError(
                    f"{run.name}: the same recording twice, by {named_twice}; keep one, or it counts twice"
                )
    refuse_copies(runs)


def _runs(entry: Mapping[str, Any], folder: Path, common: Mapping[str, Any]) -> list[Run]:
    """Read the events of one file or of a pattern; the entry goes before what is ``common``."""
    where = " ".join(["[[histories.runs]]", str(entry.get("file", entry.get("files", "")))]).strip()
    entry_settings = read(RUN, _in_m_s(entry, where), where=where)
    settings = {
        **common,
        **{key: entry_settings[key] for key in (*TABLES, "first_s", "last_s") if key in entry_settings},
    }
    if "first_s" in entry_settings:
        settings.pop(START, None)
    tables = {key: settings[key] for key in TABLES if key in settings}
    channel_map = ChannelMap.from_table(tables, folder, where=where) if tables else None
    runs = list[Run]()
    for named in _files(entry_settings, folder, where):
        with looking(folder / named):
            events = read_events(
                folder / named, entry_settings["speed_m_s"], entry_settings["group"], channel_map=channel_map
            )
        names = [named.as_posix() + run.name.removeprefix(named.name) for run in events]
        named_runs = (
            replace(run, name=name, held_out=entry_settings["held_out"])
            for run, name in zip(events, names, strict=True)
        )
        runs += [_window(run, settings) for run in named_runs]
    return runs


def _in_m_s(entry: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Convert the speed of an entry to m/s, if given in km/h."""
    converted = dict(entry)
    if KM_H in converted and "speed_m_s" in converted:
        raise InputError(f"{where}: speed_m_s and {KM_H} give the same; keep one")
    if KM_H in converted:
        converted["speed_m_s"] = read(SPEED, converted.pop(KM_H), where=where, section=KM_H) / 3.6
    return converted


def _files(settings: Mapping[str, Any], folder: Path, where: str) -> list[Path]:
    """List what ``file`` or ``files`` names, relative to the folder."""
    if ("file" in settings) == ("files" in settings):
        raise InputError(f'{where}: give one of file = "RUN.csv" and files = "kick_*.csv"')
    if "file" in settings:
        return [Path(settings["file"])]
    pattern = Path(settings["files"])
    root = Path(pattern.anchor) if pattern.is_absolute() else folder
    paths = sorted(path for path in root.glob(pattern.relative_to(pattern.anchor).as_posix()) if path.is_file())
    if not paths:
        names = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir()) if folder.is_dir() else []
        names = [name for name in names if pattern.suffix and name.endswith(pattern.suffix)] or names
        more = f" and {len(names) - 8} more" if len(names) > 8 else ""
        raise InputError(
            f'{where}: no file in {folder} is called so; give a pattern such as "kick_*.csv" or "ride_*/recording.csv"'
            f"; it holds {', '.join(names[:8]) or 'nothing'}{more}"
        )
    return paths if pattern.is_absolute() else [path.relative_to(folder) for path in paths]


def _window(run: Run, settings: Mapping[str, Any]) -> Run:
    """Cut the samples from ``first_s`` to ``last_s``, counted from the first sample of the run."""
    first, last = settings.get("first_s", 0.0), settings.get("last_s", float("inf"))
    start = settings.get(START, "first_s")
    if first >= last:
        raise InputError(
            f"{run.name}: last_s = {last:g} s is not after {start} = {first:g} s; both count from the first sample "
            "of the run, give a later last_s or leave it out"
        )
    since = run.time - run.time[0]
    keep = (since >= first - 1e-9) & (since <= last + 1e-9)
    if keep.sum() < FEWEST:
        interval = f"after {start} = {first:g} s" if "last_s" not in settings else ""
        interval = interval or f"from {start} = {first:g} s to last_s = {last:g} s"
        raise InputError(
            f"{run.name}: {keep.sum()} samples {interval} of {since[-1]:g} s; at least {FEWEST} are needed"
        )
    return replace(
        run,
        time=run.time[keep],
        channels={k: x[keep] for k, x in run.channels.items()},
        inputs={k: x[keep] for k, x in run.inputs.items()},
    )
