"""Free decay, replay and frequency response: what ``velotyre modal`` and ``velotyre diagnose`` would do."""

from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from bicycle.identification.free_decay import Decay, identify
from bicycle.identification.recording import CHANNELS, FASTEST, FEWEST, INPUTS, PLACELESS, QUANTITIES, read_run, run_of
from bicycle.identification.run import Run
from studies.look.opened import Opened
from studies.look.response_use import RESPONSE, response_use
from studies.look.rig_events import short
from studies.look.roles import MOTION, TORQUES, Roles
from studies.look.stretches import MOST_SAMPLES, decays, telling
from studies.look.use import Event, Use
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.record import records
from tyre.channels.units import find_unit, quantity_of
from tyre.channels.windows import Window

DECAY, REPLAY = "free decay (modal)", "replay (histories)"
SUPPOSED_SPEED = 5.0  # m/s: neither a decay nor the reading of histories hinges on it
GOOD, BETTER = 0.95, 0.5  # R^2 of a whole recording below which windows are sought; share of its sd they may have
EPOCH = 1e6  # s; records count later times from their first sample


@dataclass(frozen=True)
class Motion:
    """What the drafts say of a bicycle's recording: ``speed`` in m/s where it was recorded, ``windows`` of decays.

    ``part`` is the longest stretch without missing samples, empty where none are missing; ``kept`` are the channels
    that show a decay where others do not; ``replayed`` says that the torque is there.
    """

    speed: float | None = None
    windows: tuple[Window, ...] = ()
    part: tuple[Window, ...] = ()
    kept: tuple[str, ...] = ()
    replayed: bool = False


def motion_uses(roles: Roles) -> tuple[list[Use], Motion | None]:
    """The three uses of a bicycle's recording, and what the drafts say of it; see :class:`Roles`."""
    wanted = (*MOTION, *TORQUES)
    there, path = roles.names(wanted), roles.opened.path
    names = (DECAY, REPLAY, RESPONSE)
    moved = [name for name in MOTION if name in there]
    clock = roles.map.clock if roles.map else roles.opened.clock
    timed = clock is not None or all(roles.opened.signals[column].time is not None for column in there.values())
    if not moved or not timed:
        reasons = () if moved else ("no channel could be a motion of the bicycle",)
        remedies = () if moved else (roles.lacking("roll_rate"), "or steer_rate, yaw_rate, lean, steer the same way")
        if not timed:
            reasons, remedies = (*reasons, "no channel could be the time"), (*remedies, roles.lacking("time"))
        return [Use(name, (), reasons, remedies) for name in names], None
    unsure = roles.unknown_units([*wanted, "time"])
    known = [name for name in wanted if name not in unsure]
    if not any(name in there for name in MOTION if name in known) or "time" in unsure:
        said = ", ".join(f"{name.replace('_', ' ')} ({column})" for name, column in unsure.items())
        reason, remedy = f"no unit is known of {said}", "write the units into the draft or a map for --channels"
        return [Use(name, (), (reason,), (remedy,)) for name in names], Motion()
    speed = _speed(roles.opened, roles)
    try:
        channel_map, part = _complete(roles, roles.map_of(known))
        runs, whole = _runs(roles, channel_map, speed or SUPPOSED_SPEED)
    except InputError as error:
        reason = short(error, path)
        return [Use(name, (), (reason,), ("mend that in the file or in the map",)) for name in names], Motion(speed)
    decay, windows, kept = _decay(roles, runs, whole, speed)
    replay = _replay(runs, roles, unsure)
    if part:  # windows are counted from the first sample of the file
        begin = part[0].first
        windows = tuple(Window(w.name, round(begin + w.first, 6), round(begin + w.last, 6)) for w in windows)
        windows = windows or part * bool(decay.usable)
        decay, replay = (replace(use, windows=use.usable) for use in (decay, replay))
    at = quote(f"{path}@{speed:.2f}" if speed else f"{path}@SPEED")
    command = f"velotyre frequency-response {at}{_with_map(roles)}"
    return [decay, replay, response_use(replay, runs, command)], Motion(speed, windows, part, kept, replay.usable)


def _complete(roles: Roles, channel_map: ChannelMap) -> tuple[ChannelMap, tuple[Window, ...]]:
    """The map with a window for the longest stretch in which no channel lacks a sample; as it is where none is."""
    if roles.map is not None:
        return channel_map, ()
    (whole,) = records(roles.opened.signals, channel_map.only(QUANTITIES), QUANTITIES)
    good = np.all([np.isfinite(x) for x in whole.values.values()], axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], good, [0]]).astype(np.int8)))
    if good.all() or not edges.size:
        return channel_map, ()
    longest = int(np.argmax(edges[1::2] - edges[::2]))
    first, last = edges[2 * longest], edges[2 * longest + 1] - 1
    if last - first < FEWEST:
        return channel_map, ()
    begin, end = (float(whole.time[place] - whole.time[0]) for place in (first, last))
    part = (Window("complete", round(begin, 6), round(end, 6)),)
    return replace(channel_map, windows=part), part


def _runs(roles: Roles, channel_map: ChannelMap, speed: float) -> tuple[list[Run], Run]:
    """The events as the commands read them, and the whole recording."""
    path, signals = roles.opened.path, roles.opened.signals
    if roles.map is None and _is_native(path, signals.columns):
        run = read_run(path, speed)
        return [run], run
    channel_map = channel_map.only(QUANTITIES) if roles.given is None else channel_map
    found = [run_of(record, path, speed) for record in records(signals, channel_map, QUANTITIES)]
    if not channel_map.windows:
        return found, found[0]
    if roles.map is None:
        return found, found[0]
    whole = records(signals, replace(channel_map, windows=()), QUANTITIES)[0]
    return found, run_of(whole, path, speed)


def _is_native(path: Path, columns: Any) -> bool:
    """Whether ``modal`` reads the file as it is."""
    names = {column.name for column in columns}
    return path.suffix.casefold() == ".csv" and "time_s" in names and names <= {"time_s", *CHANNELS, *INPUTS}


def _speed(opened: Opened, roles: Roles) -> float | None:
    """Median of the recorded speed, m/s; None where none was recorded or it is no speed of a bicycle."""
    guess = roles.guessed.get("speed")
    if guess is None or quantity_of(guess.unit or guess.column.unit) != "speed":
        return None
    unit = find_unit(guess.unit or guess.column.unit, "speed", where=str(opened.path))
    found = unit.factor * opened.quality[guess.column.name].median
    return found if 0 < found <= FASTEST else None


def _event(run: Run, file: Array, name: str, first_s: float, last_s: float, notes: tuple[str, ...]) -> Event:
    keep = (run.time >= run.time[0] + first_s - 1e-9) & (run.time <= run.time[0] + last_s + 1e-9)
    start = float(run.time[keep][0])
    end, used = float(run.time[keep][-1]), int(np.count_nonzero(keep))
    first, last = (int(np.searchsorted(file, moment - 1e-9)) for moment in (start, end))
    return Event(name, first + 1, last + 1, used, {}, notes, start, end)


def _file_time(roles: Roles) -> Array:
    """Times of the samples of the file, s, as its records have them."""
    name = next(iter(roles.names((*MOTION, *TORQUES)).values()))
    time = roles.opened.time_of(roles.opened.signals.find(name))
    return time - time[0] if abs(time[0]) > EPOCH else time


def _said(decay: Decay) -> tuple[str, ...]:
    sign = "decays" if decay.eigenvalue.real < 0 else "GROWS"
    return (
        f"{decay.eigenvalue.imag / (2 * np.pi):.3g} Hz, {sign} with {decay.eigenvalue.real:.3g} 1/s, "
        f"{decay.cycles:.1f} cycles, R^2 {decay.r_squared:.3f}",
    )


def _identified(run: Run) -> tuple[Decay | None, str]:
    if run.time.size > MOST_SAMPLES:
        return None, f"{run.time.size} samples at once are more than a decay has, and are not tried as one"
    try:
        found = identify(run)
    except (InputError, ArithmeticError, ValueError) as error:
        return None, str(error).removeprefix(f"{run.name}: ")
    return found, found.rejected


def _decay(
    roles: Roles, runs: list[Run], whole: Run, speed: float | None
) -> tuple[Use, tuple[Window, ...], tuple[str, ...]]:
    """The use, the windows that were found, and the channels to be kept where not all of them show a decay."""
    path = roles.opened.path
    says = "" if speed else "the forward speed in m/s, after @"
    at = quote(f"{path}@{speed:.2f}" if speed else f"{path}@SPEED")
    file = _file_time(roles)
    free = roles.map is None and not _is_native(path, roles.opened.signals.columns)
    events, reasons, fits = _as_they_are(runs, file)
    windows: tuple[Window, ...] = ()
    kept: tuple[str, ...] = ()
    poorest = min((fit.r_squared for fit in fits), default=0.0)
    if poorest < GOOD and (roles.map is None or not roles.map.windows):
        within, found, better = _kicks(whole, file)
        if found and (not fits or max(map(_doubt, better)) < BETTER * min(map(_doubt, fits))):
            if events:
                reasons.append(f"the whole recording: R^2 = {poorest:.2f}; each stretch after a kick tells more")
            windows, events = within, found
        if not events:
            kept = telling(whole)
            alone = replace(whole, channels={name: whole.channels[name] for name in kept}) if kept else None
            if alone is not None and free:
                events, _, _ = _as_they_are([alone], file)
                windows, events = ((), events) if events else _kicks(alone, file)[:2]
                out = [name for name in whole.channels if name not in kept]
                reasons.append(f"left out of the draft, as they show no decay: {', '.join(out)}")
        reasons += [] if events or kept else ["no stretch after a peak is one decaying oscillation either"]
    if not events:
        how = "record free motion after a kick, hands off, two cycles or more; or look near a frequency of yours: "
        how += f"velotyre modal {at}{_with_map(roles)} --from S --to S --start-hz HZ"
        if kept:
            how = f"{', '.join(kept)} alone would show a decay: leave the other motions out of the map or file"
        return Use(DECAY, (), tuple(reasons), (how,)), (), ()
    step = f"velotyre modal {at}{_with_map(roles)} --out modal.csv"
    if len(windows) == 1 and not free and roles.map is None:
        step += f" --from {windows[0].first:g} --to {windows[0].last:g}"
    names = tuple(_channel_of(name) for name in kept)
    grows = any("GROWS" in note for event in events for note in event.notes)
    doubt = ("an oscillation that does not die away may be driven: was it free motion, hands off?",) if grows else ()
    return Use(DECAY, tuple(events), tuple(reasons), doubt, step, says, windows=bool(windows)), windows, names


def _channel_of(column: str) -> str:
    return next(name for name in MOTION if column.startswith(f"{name}_"))


def _doubt(fit: Decay) -> float:
    return max(fit.sd) / abs(fit.eigenvalue)


def _as_they_are(runs: list[Run], file: Array) -> tuple[list[Event], list[str], list[Decay]]:
    """Runs as ``modal`` takes them: those that it uses, why not the others, and the fits of those."""
    events, reasons, fits = [], [], []
    for run in runs:
        found, problem = _identified(run)
        name = run.name.partition("#")[2]
        if found is not None and not problem:
            events.append(_event(run, file, name, 0.0, np.inf, _said(found)))
            fits.append(found)
        else:
            reasons.append(f"{name or 'the whole recording'}: {problem}")
    return events, reasons, fits


def _kicks(whole: Run, file: Array) -> tuple[tuple[Window, ...], list[Event], list[Decay]]:
    """Windows after kicks, their events and fits."""
    kicks = decays(whole)
    windows = tuple(Window(f"kick{place}", first, last) for place, (first, last, _) in enumerate(kicks, 1))
    events = [
        _event(whole, file, window.name, window.first, window.last, _said(found))
        for window, (_, _, found) in zip(windows, kicks, strict=True)
    ]
    return windows, events, [found for _, _, found in kicks]


def _with_map(roles: Roles) -> str:
    if roles.given is not None:
        return f" --channels {quote(str(roles.given.source))}"
    if _is_native(roles.opened.path, roles.opened.signals.columns) and roles.map is None:
        return ""
    return " --channels MAP.toml"


def _replay(runs: list[Run], roles: Roles, unsure: dict[str, str]) -> Use:
    file = _file_time(roles)
    torques = [name for name in TORQUES if f"{name}_N_m" in runs[0].inputs]
    constant = [name for name in torques if all(np.ptp(run.inputs[f"{name}_N_m"]) == 0 for run in runs)]
    reasons, remedies = [], []
    if not set(runs[0].channels) - PLACELESS:
        reasons.append(f"{', '.join(runs[0].channels)} cannot be compared: the place of the sensor is not known")
        remedies.append(roles.lacking("roll_rate"))
    if not torques:
        unknown = [name for name in TORQUES if name in unsure]
        reasons.append(
            f"no unit is known of {' and '.join(unknown)}" if unknown else "no channel could be the steer torque"
        )
        remedies.append("write its unit into the draft" if unknown else roles.lacking("steer_torque"))
        remedies.append("without a torque, runs after a kick still serve diagnose as free motion (kind = histories)")
    elif len(constant) == len(torques):
        reasons.append(f"{', '.join(constant)} is constant: nothing drives the bicycle")
        remedies.append("map the channel that holds the torque, or use the run as free motion")
    if reasons:
        return Use(REPLAY, (), tuple(reasons), tuple(remedies))
    events = tuple(
        _event(run, file, run.name.partition("#")[2], 0.0, np.inf, (f"torque: {', '.join(torques)}",)) for run in runs
    )
    more = ("with one run nothing is held out, and nothing is named: give several",) if len(runs) == 1 else ()
    return Use(
        REPLAY, events, (), more, "velotyre diagnose MEASUREMENT.toml --out diagnosis", "the bicycle and its speed"
    )
