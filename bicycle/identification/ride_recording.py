"""Read a recorded ride and choose its segments of steady speed, straight ahead."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.recording import (
    CHANNELS,
    FASTEST,
    FEWEST,
    KM_H,
    QUANTITIES,
    Run,
    by_column,
    check_time,
    check_values,
    own_columns,
    refuse_motionless,
    refuse_other_motions,
    run_of,
)
from tyre.formats.channel_map import ChannelMap
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.recordings.channels import Record, read_records

WIDEST_STEP = 1.5  # usual steps; a longer one is a gap
STEADY_SHARE, STEADY_SPEED = 0.03, 0.15  # of the middle speed, m/s: the larger one is how far a speed may be from it
SMOOTHING = 1.0  # s, over which the speed is averaged before it is judged
SHORTEST, SHORTEST_OF_PIECES = 20.0, 4.0  # s, of a segment; of one in a file that was cut into pieces
TURN, TURN_MEAN = 0.15, 2.0  # rad/s, mean yaw rate above which a bicycle turns; s, of that mean
SLOWEST = 1.0  # m/s; below it the bicycle stands
SPEEDS_APART = 0.05  # difference of a stated and a recorded speed that is worth a note
SPEED, PIECE = "speed_m_s", "piece"  # columns of a ride besides those of a run
RIDE_QUANTITIES = {**QUANTITIES, "speed": "speed"}  # channels of a channel map of a ride

REASONS = {  # why a part of a ride is left out -> its sentence
    "missing": "A channel is missing {when}.",
    "standing": "The bicycle stands {when}: its speed is below {least:g} m/s.",
    "turn": "The bicycle turns {when}: its mean yaw rate reaches {value:.2g} rad/s.",
    "unsteady": "The speed is not steady {when}: its longest steady interval is {value:.3g} s of {least:g} s.",
    "short": "The steady part {when} is too short: {value:.3g} s, where at least {least:g} s are needed.",
    "dead": "A channel is constant {when}, so its sensor was dead.",
}


@dataclass(frozen=True)
class LeftOut:
    """A part of a ride that is not used."""

    why: str  # key of ``REASONS``
    first_s: float  # s, time of its first sample
    last_s: float  # s, time of its last sample
    samples: int
    piece: str = ""  # of a file with pieces or windows
    value: float = 0.0  # what the reason states: rad/s of a turn, s of the longest steady interval
    least: float = 0.0  # what would be needed: m/s where the bicycle stands, s where a part is short

    @property
    def sentence(self) -> str:
        """Sentence about the part that is left out: from when to when, and why."""
        when = _when(self.first_s, self.last_s, self.piece)
        return REASONS[self.why].format(when=when, value=self.value, least=self.least)


@dataclass(frozen=True)
class Ride:
    """A recorded ride: its segments of steady speed in the order of the file, and what was left out."""

    name: str  # of the file
    segments: tuple[Run, ...]  # each with even time, s, as in the file, and its mean speed, m/s
    parts_left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]
    pieces: tuple[str, ...]  # of each segment; empty text where the file has none
    speed_ranges: tuple[tuple[float, float], ...]  # m/s, lowest and highest smoothed speed of each segment

    @property
    def left_out(self) -> tuple[str, ...]:
        """One sentence for each part that is left out: from when to when, and why."""
        return tuple(part.sentence for part in self.parts_left_out)


def segment_rows(ride: Ride) -> list[dict[str, str | float]]:
    """Make a row of a table for each segment: its name, times, s, speeds, m/s, and channels."""
    return [
        {
            "segment": run.name,
            **({"piece": piece} if piece else {}),
            "from, s": float(run.time[0]),
            "to, s": float(run.time[-1]),
            "speed, m/s": run.speed,
            "lowest speed, m/s": low,
            "highest speed, m/s": high,
            "channels": ", ".join([*run.channels, *run.inputs]),
        }
        for run, piece, (low, high) in zip(ride.segments, ride.pieces, ride.speed_ranges, strict=True)
    ]


def read_ride(
    path: Path,
    speed: float | None = None,
    *,
    channel_map: ChannelMap | None = None,
    group: str = "",
    keep_turns: bool = False,
) -> Ride:
    """Read a ride and choose its segments of steady speed.

    A segment is the longest interval in which the speed, averaged over 1 s, stays within 3 % or 0.15 m/s of its
    middle, whichever is more; the next one is chosen in what remains. Its length is 20 s or more, 4 s where the
    file has pieces or windows. Standing still is left out, and so are turns unless ``keep_turns``. A gap of more than
    1.5 usual steps ends it.

    ``path`` is a CSV with ``time_s``, motions and torques as of a run, and, if recorded, ``speed_m_s`` or
    ``speed_km_h`` and ``piece``, whole numbers: where they change, time may restart. With a ``channel_map`` it is
    any recording, ``speed`` one of its channels. ``speed``, m/s, is that of the whole ride where none was recorded.
    Segments whose speeds are near to each other have one ``group``, which begins with the given one.

    Raises InputError where the file cannot be read, no speed is known, or no part is steady for long enough.
    """
    path = Path(path)
    if speed is not None and not SLOWEST <= speed <= FASTEST:
        raise InputError(
            f"{path}: speed = {speed:g} m/s is outside {SLOWEST:g} to {FASTEST:g} m/s; is it in km/h, or at rest?"
        )
    wholes = _read(path, channel_map)
    shortest = SHORTEST_OF_PIECES if any(whole.piece for whole in wholes) else SHORTEST
    if speed is None and wholes[0].speed is None:
        raise InputError(f"{path}: no speed was recorded; add a column {SPEED}, or give the speed of the ride")
    choices, left_out, gaps = _choose(wholes, shortest, keep_turns=keep_turns)
    if not choices:
        raise InputError(_nothing_steady(path, left_out, shortest, gaps))
    ends = [f"#{place}" for place in range(1, len(choices) + 1)] if len(choices) > 1 else [""]
    runs = [_run(choice, path, speed, end) for choice, end in zip(choices, ends, strict=True)]
    return Ride(
        path.name,
        _grouped(runs, group),
        tuple(left_out),
        tuple(dict.fromkeys(_notes(wholes, gaps, runs, speed))),
        tuple(choice.piece for choice in choices),
        tuple(choice.speed_range(speed) for choice in choices),
    )


@dataclass(frozen=True, eq=False)
class _Stretch:
    """Samples of one piece of a ride."""

    record: Record  # motions and torques
    speed: Array | None  # (n,), m/s; None if none was recorded
    smooth: Array | None  # (n,), m/s, averaged; None before that
    places: Sequence[str]  # (n,), of the samples in the file
    piece: str  # name; empty if the file has none

    @property
    def time(self) -> Array:
        """Times (n,), s."""
        return self.record.time

    def cut(self, first: int, end: int) -> "_Stretch":
        """Keep the samples from ``first`` to before ``end``."""
        span = slice(first, end)
        values = {name: x[span] for name, x in self.record.values.items()}
        return replace(
            self,
            record=replace(self.record, time=self.time[span], values=values),
            speed=None if self.speed is None else self.speed[span],
            smooth=None if self.smooth is None else self.smooth[span],
            places=self.places[span],
        )

    def speed_range(self, stated: float | None) -> tuple[float, float]:
        """Find the lowest and highest averaged speed, m/s; twice the ``stated`` one if none was recorded."""
        if self.smooth is None:
            return float(stated or 0.0), float(stated or 0.0)
        return float(self.smooth.min()), float(self.smooth.max())

    def left_out(self, why: str, value: float = 0.0, least: float = 0.0) -> LeftOut:
        """Leave all samples out."""
        return LeftOut(why, float(self.time[0]), float(self.time[-1]), self.time.size, self.piece, value, least)


def _when(first: float, last: float, piece: str) -> str:
    where = f" in piece {piece}" if piece else ""
    return f"from {first:.6g} to {last:.6g} s{where}"


# ---------------------------------------------------------------------------------------------- reading


def _read(path: Path, channel_map: ChannelMap | None) -> list[_Stretch]:
    """Read the pieces of a file, checked but for their times."""
    if channel_map is None:
        record, lines = own_columns(path, (SPEED, KM_H, PIECE), quantities=RIDE_QUANTITIES, missing=True)
        wholes = list(_pieces(record, lines))
    else:
        refuse_other_motions(path, channel_map, RIDE_QUANTITIES)
        records = read_records(path, channel_map, RIDE_QUANTITIES)
        wholes = [_stretch(record, record.event) for record in records]
    for whole in wholes:
        refuse_motionless(str(path), by_column(whole.record))
        _check_speeds(path, whole)
    for name in wholes[0].record.values:  # over all pieces: a sensor may rest in one of them
        joined = {name: np.concatenate([whole.record.values[name] for whole in wholes])}
        valid = np.isfinite(joined[name])
        for column, values in by_column(replace(wholes[0].record, values=joined)).items():
            _refuse_empty(path, column, values)
        places = [place for whole in wholes for place in whole.places]
        numbers = by_column(replace(wholes[0].record, values={name: joined[name][valid]}))
        check_values(str(path), numbers, [places[k] for k in np.flatnonzero(valid)])
    if wholes[0].speed is not None:
        _refuse_empty(path, "the speed", np.concatenate([np.asarray(whole.speed) for whole in wholes]))
    return wholes


def _refuse_empty(path: Path, column: str, values: Array) -> None:
    if not np.isfinite(values).any():
        raise InputError(f"{path}: {column} holds no number; leave the column out")


def _stretch(record: Record, piece: str, places: Sequence[str] = ()) -> _Stretch:
    """Take the speed, m/s, out of the values of a record."""
    values = dict(record.values)
    if SPEED in values and KM_H in values:
        raise InputError(f"{record.source}: {SPEED} and {KM_H} give the same; keep one")
    speed = values.pop(SPEED, values.pop("speed", None))
    if KM_H in values:
        speed = values.pop(KM_H) / 3.6
    places = places or [f"sample {place}" for place in range(1, record.time.size + 1)]
    return _Stretch(replace(record, values=values), speed, None, places, piece)


def _pieces(record: Record, lines: Sequence[str]) -> Iterator[_Stretch]:
    """Cut a record where the number of its piece changes."""
    if PIECE not in record.values:
        yield _stretch(record, "", lines)
        return
    values = dict(record.values)
    numbers = values.pop(PIECE)
    if (numbers != np.round(numbers)).any():
        row = int(np.argmax(numbers != np.round(numbers)))
        raise InputError(f"{record.source}, {lines[row]}: {PIECE} = {numbers[row]:g} must be a whole number")
    whole = _stretch(replace(record, values=values), "", lines)
    for first, end in _spans(numbers):
        yield replace(whole.cut(first, end), piece=f"{numbers[first]:.0f}")


def _check_speeds(path: Path, whole: _Stretch) -> None:
    if whole.speed is None or not np.isfinite(whole.speed).any():
        return
    row = int(np.nanargmax(np.abs(whole.speed)))
    fastest = whole.speed[row]
    if fastest > FASTEST:
        raise InputError(
            f"{path}, {whole.places[row]}: the speed is {fastest:g} m/s, above {FASTEST:g} m/s; is it in km/h? "
            f"The column {KM_H} is read so"
        )
    if fastest < -SLOWEST:
        raise InputError(
            f"{path}, {whole.places[row]}: the speed is {fastest:g} m/s; it must be positive, so change its sign"
        )


def _drop_missing(whole: _Stretch) -> tuple[list[_Stretch], list[LeftOut]]:
    """Keep the samples of which every channel was recorded."""
    columns = [*whole.record.values.values()]
    if whole.speed is not None:
        columns.append(whole.speed)
    is_complete = np.logical_and.reduce([np.isfinite(x) for x in columns])
    kept, missing = [], []
    for first, end in _spans(is_complete):
        if is_complete[first]:
            kept.append(whole.cut(first, end))
        else:
            missing.append(whole.cut(first, end).left_out("missing"))
    return kept, missing


def _spans(labels: NDArray[np.generic]) -> list[tuple[int, int]]:
    """Find the runs of equal labels (n,): first sample and the one after the last of each."""
    borders = [0, *(np.flatnonzero(labels[1:] != labels[:-1]) + 1).tolist(), len(labels)]
    return list(pairwise(borders))


def _cut_at_gaps(piece: _Stretch) -> list[_Stretch]:
    """Cut where time makes more than 1.5 usual steps, and refuse uneven steps between."""
    steps = np.diff(piece.time)
    usual = float(np.median(steps)) if steps.size else 0.0
    after = np.flatnonzero(steps > WIDEST_STEP * usual) + 1 if usual > 0 else np.array([], int)
    borders = [0, *after.tolist(), piece.time.size]
    stretches = [piece.cut(first, end) for first, end in pairwise(borders)]
    for stretch in stretches:
        if stretch.time.size >= FEWEST:
            check_time(piece.record.source, stretch.time, stretch.places)
    return stretches


# ---------------------------------------------------------------------------------------------- choosing


def _choose(
    wholes: Sequence[_Stretch], shortest: float, *, keep_turns: bool
) -> tuple[list[_Stretch], list[LeftOut], list[tuple[float, float]]]:
    """Choose the segments, each of ``shortest`` s or more; also what is left out, and the gaps in time, s."""
    choices: list[_Stretch] = []
    left_out: list[LeftOut] = []
    gaps: list[tuple[float, float]] = []
    for whole in wholes:
        complete, unused = _drop_missing(whole)
        stretches = [stretch for part in complete for stretch in _cut_at_gaps(part)]
        gaps += _gaps(stretches)
        for stretch in stretches:
            segments, remainders = _choose_segments(stretch, shortest, keep_turns=keep_turns)
            choices += segments
            unused += remainders
        left_out += sorted(unused, key=lambda part: part.first_s)
    return choices, left_out, gaps


def _choose_segments(stretch: _Stretch, shortest: float, *, keep_turns: bool) -> tuple[list[_Stretch], list[LeftOut]]:
    """Choose the steady segments, each of ``shortest`` s or more, of a stretch at even times."""
    if stretch.time.size < FEWEST:
        return [], [stretch.left_out("short", float(np.ptp(stretch.time)), shortest)]
    step = _step(stretch)
    if stretch.speed is not None:
        stretch = replace(stretch, smooth=_average(stretch.speed, round(SMOOTHING / step)))
    labels = np.full(stretch.time.size, "")
    yaw_rate = stretch.record.values.get("yaw_rate")
    turning = np.zeros(stretch.time.size)
    if yaw_rate is not None and not keep_turns:
        turning = np.abs(_average(yaw_rate, round(TURN_MEAN / step)))
        labels = np.where(turning > TURN, "turn", labels)
    if stretch.smooth is not None:
        labels = np.where(stretch.smooth < SLOWEST, "standing", labels)
    used: list[_Stretch] = []
    left_out: list[LeftOut] = []
    for first, end in _spans(labels):
        part = stretch.cut(first, end)
        if labels[first] == "turn":
            left_out.append(part.left_out("turn", float(turning[first:end].max())))
        elif labels[first] == "standing":
            left_out.append(part.left_out("standing", least=SLOWEST))
        else:
            segments, remainders = _divide(part, step, shortest)
            used += segments
            left_out += remainders
    return used, left_out


def _step(stretch: _Stretch) -> float:
    """Find the sample time, s."""
    return float((stretch.time[-1] - stretch.time[0]) / (stretch.time.size - 1))


def _average(x: Array, samples: int) -> Array:
    """Average (n,) over so many samples about each; near the ends over those that there are."""
    half = samples // 2
    sums = np.concatenate([[0.0], np.cumsum(x)])
    place = np.arange(x.size)
    first = np.maximum(place - half, 0)
    end = np.minimum(place + half + 1, x.size)
    return np.asarray((sums[end] - sums[first]) / (end - first))


def _divide(part: _Stretch, step: float, shortest: float) -> tuple[list[_Stretch], list[LeftOut]]:
    """Choose the longest steady interval of a part again and again; what remains is left out."""
    n = part.time.size
    since = np.zeros(n, int) if part.smooth is None else steady_since(part.smooth)
    fewest = max(FEWEST, int(np.ceil(shortest / step - 1e-6)))
    open_spans = [(0, n)]
    chosen: list[tuple[int, int]] = []
    left_out: list[LeftOut] = []
    while open_spans:
        low, high = open_spans.pop()
        first = np.maximum(since[low:high], low)
        lengths = np.arange(low, high) + 1 - first
        longest = int(np.argmax(lengths))
        if lengths[longest] < fewest:
            # a remainder that is steady throughout is only too short
            why = "short" if lengths[longest] == high - low else "unsteady"
            left_out.append(part.cut(low, high).left_out(why, float(lengths[longest]) * step, shortest))
            continue
        start, end = int(first[longest]), low + longest + 1
        chosen.append((start, end))
        open_spans += [span for span in ((low, start), (end, high)) if span[0] < span[1]]
    segments: list[_Stretch] = []
    for span in sorted(chosen):
        segment = part.cut(*span)
        if _is_dead(segment):
            left_out.append(segment.left_out("dead"))
        else:
            segments.append(segment)
    return segments, left_out


def _is_dead(segment: _Stretch) -> bool:
    """True if a motion is constant, as of a sensor that stopped."""
    numbers = by_column(segment.record)
    return any(np.ptp(x) == 0 for name, x in numbers.items() if name in CHANNELS)


def is_steady(low: float, high: float) -> bool:
    """True if speeds from ``low`` to ``high``, m/s, are within 3 % or 0.15 m/s of their middle."""
    middle = (low + high) / 2
    return high - middle <= max(STEADY_SHARE * middle, STEADY_SPEED)


def steady_since(speed: Array) -> NDArray[np.int_]:
    """Find the first sample (n,) of the longest steady interval that ends at each sample of ``speed`` (n,), m/s."""
    speeds = speed.tolist()
    lows: deque[int] = deque()  # samples that are lower than all after them, up to the present one
    highs: deque[int] = deque()
    since = np.empty(len(speeds), int)
    start = 0
    for k, present in enumerate(speeds):
        while lows and speeds[lows[-1]] >= present:
            lows.pop()
        while highs and speeds[highs[-1]] <= present:
            highs.pop()
        lows.append(k)
        highs.append(k)
        # an interval inside a steady one is steady, so that the start only ever moves on
        while not is_steady(speeds[lows[0]], speeds[highs[0]]):
            start += 1
            if lows[0] < start:
                lows.popleft()
            if highs[0] < start:
                highs.popleft()
        since[k] = start
    return since


# ---------------------------------------------------------------------------------------------- the ride


def _run(choice: _Stretch, path: Path, stated: float | None, end: str) -> Run:
    speed = float(choice.speed.mean()) if choice.speed is not None else float(stated or 0.0)
    record = replace(choice.record, source=f"{path}{end}")
    return run_of(record, path, speed, lines=choice.places)


def _grouped(runs: Sequence[Run], group: str) -> tuple[Run, ...]:
    """Name one group for the runs whose speeds are within 3 % or 0.15 m/s of their middle."""
    speeds_by_group: list[list[float]] = []
    for speed in sorted(run.speed for run in runs):
        if speeds_by_group and is_steady(speeds_by_group[-1][0], speed):
            speeds_by_group[-1].append(speed)
        else:
            speeds_by_group.append([speed])
    name_by_speed: Mapping[float, str] = {
        speed: f"{group} {(speeds[0] + speeds[-1]) / 2:.3g} m/s".strip()
        for speeds in speeds_by_group
        for speed in speeds
    }
    return tuple(replace(run, group=name_by_speed[run.speed]) for run in runs)


def _gaps(stretches: Sequence[_Stretch]) -> list[tuple[float, float]]:
    """Find the length, s, of each gap between the stretches of a piece, and the time, s, after which it is."""
    return [(float(after.time[0] - before.time[-1]), float(before.time[-1])) for before, after in pairwise(stretches)]


def _notes(
    wholes: Sequence[_Stretch], gaps: Sequence[tuple[float, float]], runs: Sequence[Run], stated: float | None
) -> Iterator[str]:
    """Notes of the reader, on gaps, on turns that cannot be seen, and on two speeds that differ."""
    for whole in wholes:
        yield from whole.record.notes
    if gaps:
        length, since = max(gaps)
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        yield f"time has {count}, the longest of {length:.3g} s after {since:.6g} s; a gap ends a segment"
    if "yaw_rate" not in wholes[0].record.values:
        yield "no yaw rate was recorded, so turns are not left out"
    if wholes[0].speed is None:
        yield "no speed was recorded: the stated one is that of the whole ride"
    elif stated is not None:
        lengths = [run.time.size for run in runs]
        recorded = float(np.average([run.speed for run in runs], weights=lengths))
        if abs(stated / recorded - 1) > SPEEDS_APART:
            yield (
                f"the recorded speed is used: its mean {recorded:.3g} m/s is {100 * (recorded / stated - 1):+.0f} % "
                f"from the stated {stated:.3g} m/s"
            )


def _nothing_steady(
    path: Path, left_out: Sequence[LeftOut], shortest: float, gaps: Sequence[tuple[float, float]]
) -> str:
    """Say which part was the longest steady one, and what would do."""
    steady = [part for part in left_out if part.why in ("short", "unsteady")]
    found = "the bicycle stands or turns all the time"
    if steady:
        longest = max(steady, key=lambda part: part.value)
        when = _when(longest.first_s, longest.last_s, longest.piece)
        found = f"the longest lasts {longest.value:.3g} s, {when}"
        if longest.why == "unsteady":
            found = f"the longest steady interval {when} is {longest.value:.3g} s"
    do = f"ride straight ahead at one speed (within {100 * STEADY_SHARE:g} %) for {shortest:g} s or more"
    if gaps:
        count = "gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        do += f", or close the {count} in time with [resampling] of a channel map"
    return f"{path}: no part of the ride is steady for {shortest:g} s; {found}; {do}"
