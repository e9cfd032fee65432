"""Read the table ``[histories]`` of a measurement file: which recordings, which of their samples and channels."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.identification.recording import (
    AS_HELD,
    AS_LINEAR,
    BETWEEN,
    CHANNELS,
    FASTEST,
    FEWEST,
    INPUTS,
    MOTOR_IN_TORQUE,
    PLACELESS,
    STEER,
    STEER_TORQUE,
    Run,
    read_events,
    refuse_copies,
)
from tyre.channel_map import TABLES, ChannelMap
from tyre.draft import looking
from tyre.errors import InputError, refuse_unknown
from tyre.files import named_folder
from tyre.schema import any_table, anything, by_name, flag, list_of, maybe, needed, number, read, refused, table, text


def _group(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, str | int):
        raise refused(value, "must be a name in quotes")
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
SPEED = table(
    {maybe(KM_H): number(above=0, most=3.6 * FASTEST, says=f"is outside 0 .. {3.6 * FASTEST:g} km/h, or in quotes")},
    others=True,
)  # fmt: skip
RUN = table(
    {
        maybe("file"): text("must be a path in quotes", blank=False),
        maybe("files"): text('must be a pattern of paths in quotes, such as "kick_*.csv"', blank=False),
        needed("speed_m_s", f"no speed_m_s; give the forward speed in m/s, or {KM_H}"): number(
            above=0, most=FASTEST, says=f"is outside 0 .. {FASTEST:g} m/s; is it in km/h, or in quotes?"
        ),
        maybe(KM_H): anything,
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
    if "folder" in histories:
        folder = named_folder(histories["folder"], folder)
    common = {key: histories[key] for key in (*TABLES, "first_s", "last_s") if key in histories}
    if "drop_first_s" in histories:
        if "first_s" in histories:
            raise InputError("[histories]: drop_first_s and first_s say the same; keep one")
        common |= {"first_s": histories["drop_first_s"], START: "drop_first_s"}
    used = common.pop("channels") if isinstance(common.get("channels"), list) else None
    drive = histories.get("input", "")
    read_in = [(run, entry) for entry in histories["runs"] for run in _runs(entry, folder, common)]
    runs = [replace(_only(_driven(run, drive), used), between=histories.get(BETWEEN, "")) for run, _ in read_in]
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
    "kick": "no start transient is dropped (drop_first_s = 0): a kick must not last into the record",
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
    kept = [run.name for run in runs if run.held_out]
    if kept:
        yield NOTES["held out"].format(runs=", ".join(kept))
    yield from (f"{run.name}: {note}" for run in runs for note in run.notes)


def _driven(run: Run, drive: str) -> Run:
    """Make the run as ``drive`` drives it; under a prescribed steer angle the steer torque is a measured channel."""
    recorded = {**run.channels, **run.inputs}
    if drive and drive not in recorded:
        raise InputError(f"{run.name}: input = {drive!r} was not recorded; the run holds {', '.join(recorded)}")
    if drive != STEER:
        return run
    channels = {name: x for name, x in run.channels.items() if not name.startswith("steer")}
    if STEER_TORQUE in run.inputs:
        channels[STEER_TORQUE] = run.inputs[STEER_TORQUE]
    if not channels:
        raise InputError(f"{run.name}: input = {drive!r}, and nothing else was recorded that it could explain")
    others = {name: x for name, x in run.inputs.items() if name != STEER_TORQUE}
    return replace(run, channels=channels, inputs={STEER: run.channels[STEER], **others})


def _only(run: Run, used: list[Any] | None) -> Run:
    """Keep the channels ``used``; the torques stay."""
    if used is None:
        return run
    refuse_unknown("channel", [str(name) for name in used], {*CHANNELS, *run.channels}, where="[histories]: channels")
    lacking = [name for name in used if name not in run.channels]
    if lacking or not used:
        what = f"{', '.join(lacking)} was not recorded; it holds" if lacking else "name one or more of"
        raise InputError(f"{run.name}: channels = {used!r}: {what} {', '.join(run.channels)}")
    return replace(run, channels={name: run.channels[name] for name in used})


def _refuse_repeats(runs: list[Run], entries: Sequence[Mapping[str, Any]]) -> None:
    """Refuse runs of other channels, and one that two entries name."""
    named_by = [next((f"{k} = {entry[k]!r}" for k in ("file", "files") if k in entry), "") for entry in entries]
    for place, run in enumerate(runs):
        if set(run.channels) != set(runs[0].channels) or set(run.inputs) != set(runs[0].inputs):
            raise InputError(f"{run.name}: has other columns than {runs[0].name}; all runs need the same channels")
        for other, by in zip(runs[:place], named_by, strict=False):
            if run.name == other.name:
                both = f"{by} and by {named_by[place]}"
                raise InputError(f"{run.name}: the same recording twice, by {both}; keep one, or it counts twice")
    refuse_copies(runs)


def _runs(entry: Mapping[str, Any], folder: Path, common: Mapping[str, Any]) -> list[Run]:
    """Read the events of one file or of a pattern; the entry goes before what is ``common``."""
    where = " ".join(["[[histories.runs]]", str(entry.get("file", entry.get("files", "")))]).strip()
    given = read(RUN, _in_m_s(entry, where), where=where)
    settings = {**common, **{key: given[key] for key in (*TABLES, "first_s", "last_s") if key in given}}
    if "first_s" in given:
        settings.pop(START, None)
    tables = {key: settings[key] for key in TABLES if key in settings}
    channel_map = ChannelMap.from_table(tables, folder, where=where) if tables else None
    found = []
    for named in _files(given, folder, where):
        with looking(folder / named):
            events = read_events(folder / named, given["speed_m_s"], given["group"], channel_map=channel_map)
        for run in events:
            name = named.as_posix() + run.name.removeprefix(named.name)
            found.append(_window(replace(run, name=name, held_out=given["held_out"]), settings))
    return found


def _in_m_s(entry: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Convert the speed of an entry to m/s, if given in km/h."""
    if KM_H not in entry:
        return dict(entry)
    if "speed_m_s" in entry:
        raise InputError(f"{where}: speed_m_s and {KM_H} say the same; keep one")
    speed = read(SPEED, entry, where=where)[KM_H] / 3.6
    return {**{key: value for key, value in entry.items() if key != KM_H}, "speed_m_s": speed}


def _files(given: Mapping[str, Any], folder: Path, where: str) -> list[Path]:
    """List what ``file`` or ``files`` names, relative to the folder."""
    if ("file" in given) == ("files" in given):
        raise InputError(f'{where}: give one of file = "RUN.csv" and files = "kick_*.csv"')
    if "file" in given:
        return [Path(given["file"])]
    pattern = Path(given["files"])
    root = Path(pattern.anchor) if pattern.is_absolute() else folder
    names = pattern.relative_to(pattern.anchor).as_posix()
    found = sorted(path for path in root.glob(names) if path.is_file())
    if not found:
        held = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir()) if folder.is_dir() else []
        held = [name for name in held if pattern.suffix and name.endswith(pattern.suffix)] or held
        more = f" and {len(held) - 8} more" if len(held) > 8 else ""
        raise InputError(
            f'{where}: no file in {folder} is called so; give a pattern such as "kick_*.csv" or "ride_*/recording.csv"'
            f"; it holds {', '.join(held[:8]) or 'nothing'}{more}"
        )
    return found if pattern.is_absolute() else [path.relative_to(folder) for path in found]


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
        asked = f"after {start} = {first:g} s" if "last_s" not in settings else ""
        asked = asked or f"from {start} = {first:g} s to last_s = {last:g} s"
        raise InputError(f"{run.name}: {keep.sum()} samples {asked} of {since[-1]:g} s; at least {FEWEST} are needed")
    return replace(
        run, time=run.time[keep], channels={k: x[keep] for k, x in run.channels.items()},
        inputs={k: x[keep] for k, x in run.inputs.items()},
    )  # fmt: skip
