"""Say what ``velotyre modal``, ``frequency-response`` and ``diagnose`` would do with a recording."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from shlex import quote
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from bicycle.identification import recording
from bicycle.identification.free_decay import Decay, identify
from bicycle.identification.frequency_response import spectral_response
from bicycle.identification.ride_recording import PIECE, RIDE_QUANTITIES, SPEED, Ride, read_ride
from bicycle.identification.ride_wobble import LOWEST_HZ, SHORTEST, Wobble, identify_wobble
from bicycle.model.eigen import frequency_hz
from studies.diagnosis.ride_reading import spectra_of_rides
from studies.look.opened import MOTION, TORQUES, Opened, Roles
from studies.look.rig_uses import Event, Use, shorten_error
from tyre.formats.channel_map import ChannelMap, Window
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import find_unit, quantity_of
from tyre.recordings.channels import records
from tyre.recordings.signal_quality import noise_level
from tyre.recordings.signal_quality import runs as stretches_of

DECAY, REPLAY, RESPONSE = "free decay (modal)", "replay (histories)", "frequency response"
RIDE = "ride (wobble, spectra)"
STARTS, LENGTHS = (0.0, 0.1, 0.3), (12.0, 6.0, 4.0, 2.5)  # s after the peak, s
ORDER = ("roll_rate_rad_s", "yaw_rate_rad_s", "steer_rate_rad_s", "lean_rad", "steer_rad")  # in which kicks are sought
ANY_SPEED = 5.0  # m/s, in place of an unknown one: what is judged does not depend on it
MOST_MISSING = 0.2  # share of the samples of a speed; with more missing it cuts a ride into pieces
MOST_SAMPLES = 100_000  # of a run that is fitted as a whole
USUAL_SEGMENT, SHORTEST_SEGMENT, SEGMENTS = 10.0, 2.0, 4  # s, s; end to end: overlapping by half they are seven


def _response(replay: Use, runs: Sequence[recording.Run], command: str) -> Use:
    """Judge gain and phase, which need what replay needs, for so long that five segments are independent."""
    if not replay.usable:
        return Use(RESPONSE, (), replay.reasons, replay.remedies[:1])
    source = next(name for name in TORQUES if f"{name}_N_m" in runs[0].inputs)
    motions = {
        name: x for name, x in recording.MOTIONS.items() if x in runs[0].channels and x not in recording.PLACELESS
    }
    column = next(iter(motions.values()))
    longest = max(float(run.time[-1] - run.time[0]) for run in runs)
    segment = min(USUAL_SEGMENT, int(longest / SEGMENTS * 10) / 10)
    events, reasons = [], []
    for run, event in zip(runs, replay.events, strict=True):
        try:
            if segment < SHORTEST_SEGMENT:
                least = SEGMENTS * SHORTEST_SEGMENT
                raise InputError(f"{longest:.3g} s are too short; {least:g} s or more are needed")
            torque, motion = run.inputs[f"{source}_N_m"], run.channels[column]
            response = spectral_response([torque], [motion], run.step, segment_s=segment)
        except InputError as error:
            reasons.append(f"{event.name or 'the whole recording'}: {error}")
            continue
        note = f"{response.averages:.1f} independent segments of {segment:g} s"
        if response.lines:
            note = f"a {source.replace('_', ' ')} of {response.lines} lines"
        events.append(replace(event, notes=(note,)))
    if not events:
        return Use(RESPONSE, (), tuple(reasons), ("record longer, or use replay: it fits the same samples in time",))
    step = f"{command} --input {source} --output {','.join(motions)}"
    if segment != USUAL_SEGMENT:
        step += f" --segment {segment:g}"
    step += " --out responses.csv"
    closed = "where a rider or controller answered the motion, name a reference with --instrument"
    speed = "the forward speed in m/s, after @" if "@SPEED" in command else ""
    return Use(RESPONSE, tuple(events), tuple(reasons), (closed,), step, speed, windows=replay.windows)


@dataclass(frozen=True)
class Motion:
    """Content of the drafts for a bicycle's recording."""

    speed: float | None = None  # m/s, if it was recorded
    windows: tuple[Window, ...] = ()  # of decays
    part: tuple[Window, ...] = ()  # the longest stretch without missing samples; empty if none are missing
    replayed: bool = False  # the torque is there
    ride: "RideDrafts" = field(default_factory=lambda: RideDrafts())  # of a ride


@dataclass(frozen=True)
class RideDrafts:
    """Content of the drafts for a ride."""

    spectra: bool = False  # a file for diagnose can be drafted
    own_map: bool = False  # the ride needs a map of its own: with the speed, or without windows
    channels: tuple[str, ...] = ()  # of that map
    mapped: bool = True  # the recording needs a map
    speed: float | None = None  # m/s, to be stated; None if it was recorded as a channel, or is unknown
    recorded: bool = False  # the speed is a channel of the map or a column of the file


def motion_uses(roles: Roles) -> tuple[list[Use], Motion | None]:
    """Judge the four uses of a bicycle's recording, and fill what the drafts say of it."""
    channels = (*MOTION, *TORQUES)
    columns, path = roles.names(channels), roles.opened.path

    def unusable(reasons: Sequence[str], remedies: Sequence[str]) -> list[Use]:
        return [Use(name, (), tuple(reasons), tuple(remedies)) for name in (DECAY, REPLAY, RESPONSE, RIDE)]

    has_motion = any(name in columns for name in MOTION)
    timed = roles.is_timed(columns)
    if not has_motion or not timed:
        reasons = [] if has_motion else ["no channel recognised as a motion of the bicycle"]
        remedies = (
            [] if has_motion else [roles.lacking("roll_rate"), "or steer_rate, yaw_rate, lean, steer the same way"]
        )
        reasons += [] if timed else ["no channel recognised as time"]
        return unusable(reasons, remedies if timed else [*remedies, roles.lacking("time")]), None
    unsure = roles.unknown_units([*channels, "time"])
    with_unit = [name for name in channels if name not in unsure]
    if not any(name in columns for name in MOTION if name in with_unit) or "time" in unsure:
        without_unit = ", ".join(f"{name.replace('_', ' ')} ({column})" for name, column in unsure.items())
        remedy = "write the units into the draft or a map for --channels"
        return unusable([f"unknown unit of {without_unit}"], [remedy]), Motion()
    speed = _speed(roles.opened, roles)
    ride, ride_drafts = _ride(roles, with_unit, speed)
    try:
        channel_map, part = _complete(roles, roles.map_of(with_unit))
        runs, whole = _runs(roles, channel_map, speed or ANY_SPEED)
    except InputError as error:
        others = unusable([shorten_error(error, path)], ["correct that in the file or in the map"])
        return [use for use in others if use.name != RIDE] + [ride], Motion(speed, ride=ride_drafts)
    decay, windows = _decay(roles, runs, whole, speed)
    replay = _replay(runs, roles, unsure)
    if part:  # windows are counted from the first sample of the file
        begin = part[0].first
        windows = tuple(Window(w.name, round(begin + w.first, 6), round(begin + w.last, 6)) for w in windows)
        if not windows and decay.usable:
            windows = part
        decay, replay = (replace(use, windows=use.usable) for use in (decay, replay))
    command = f"velotyre frequency-response {_recording(roles, speed)}"
    ride_drafts = replace(ride_drafts, own_map=ride_drafts.own_map or (ride_drafts.mapped and bool(part)))
    uses = [decay, replay, _response(replay, runs, command), ride]
    return uses, Motion(speed, windows, part, replay.usable, ride_drafts)


def _complete(roles: Roles, channel_map: ChannelMap) -> tuple[ChannelMap, tuple[Window, ...]]:
    """Give the map a window for the longest stretch in which no channel lacks a sample, if any does."""
    if roles.map is not None:
        return channel_map, ()
    (whole,) = records(roles.opened.signals, channel_map.only(recording.QUANTITIES), recording.QUANTITIES)
    good = np.all([np.isfinite(x) for x in whole.values.values()], axis=0)
    starts, lengths = stretches_of(good)
    if good.all() or lengths.max(initial=0) <= recording.FEWEST:
        return channel_map, ()
    first = starts[lengths.argmax()]
    begin, end = (float(whole.time[place] - whole.time[0]) for place in (first, first + lengths.max() - 1))
    part = (Window("complete", round(begin, 6), round(end, 6)),)
    return replace(channel_map, windows=part), part


def _runs(roles: Roles, channel_map: ChannelMap, speed: float) -> tuple[list[recording.Run], recording.Run]:
    """Read the events as the commands do, and the whole recording."""
    path, signals = roles.opened.path, roles.opened.signals
    if _is_native(roles):
        run = recording.read_run(path, speed)
        return [run], run
    channel_map = channel_map.only(recording.QUANTITIES) if roles.command_map is None else channel_map
    runs = [recording.run_of(record, path, speed) for record in records(signals, channel_map, recording.QUANTITIES)]
    if not channel_map.windows or roles.map is None:
        return runs, runs[0]
    whole = records(signals, replace(channel_map, windows=()), recording.QUANTITIES)[0]
    return runs, recording.run_of(whole, path, speed)


def _is_native(roles: Roles, more: Sequence[str] = ()) -> bool:
    """True if ``modal`` reads the file as it is, without a map; for a ride, with ``more`` columns."""
    names = {column.name for column in roles.opened.signals.columns}
    own_names = "time_s" in names and names <= {"time_s", *recording.CHANNELS, *recording.INPUTS, *more}
    return own_names and roles.map is None and roles.opened.path.suffix.casefold() == ".csv"


def _speed(opened: Opened, roles: Roles) -> float | None:
    """Median of the recorded speed, m/s; None where none was recorded or it is no speed of a bicycle."""
    guess = roles.guessed.get("speed")
    if guess is None or quantity_of(guess.unit or guess.column.unit) != "speed":
        return None
    unit = find_unit(guess.unit or guess.column.unit, "speed", where=str(opened.path))
    speed = unit.factor * opened.quality[guess.column.name].median
    return speed if 0 < speed <= recording.FASTEST else None


WOBBLE = "wobble{at}: {hertz:.3g} Hz, decays with {real:.3g} ± {sd:.2g} 1/s"
SPARSE = "the speed has fewer samples than the motion: its median is stated for the whole ride"
FOR_SPECTRA = "for spectra, fill in the draft *.spectra.toml of --out DIR, and run `velotyre diagnose` with it"
STEADY = f"wobble of a ride needs {SHORTEST:g} s or more straight ahead at one speed; it needs no impulse"


def _ride(roles: Roles, channels: Sequence[str], speed: float | None) -> tuple[Use, RideDrafts]:
    """Judge a ride without an impulse by what ``modal --ride`` and ``diagnose`` make of it."""
    path = roles.opened.path
    mapped = not _is_native(roles, (SPEED, recording.KM_H, PIECE))
    recorded, channels = _speed_channel(roles, channels, mapped=mapped)
    stated = None if recorded else speed
    channel_map = roles.map_of(channels) if mapped else None
    if channel_map is not None and roles.command_map is None:
        channel_map = channel_map.only(RIDE_QUANTITIES)
    try:
        ride = read_ride(path, None if recorded else stated or ANY_SPEED, channel_map=channel_map)
    except InputError as error:
        return Use(RIDE, (), (shorten_error(error, path),), (STEADY,)), RideDrafts()
    wobbles, reasons = _wobbles_of(ride, is_known=recorded or stated is not None)
    sound = [wobble for wobble in wobbles if not wobble.rejected]
    try:
        spectra_of_rides([ride], ridden=True)
        has_spectra = True
    except (InputError, ArithmeticError, ValueError) as error:
        reasons.append(f"spectra: {shorten_error(error, path)}")
        has_spectra = False
    if not sound and not has_spectra:
        return Use(RIDE, (), tuple(reasons), (STEADY,)), RideDrafts()
    drafts = RideDrafts(has_spectra, mapped and recorded, tuple(channels), mapped, stated, recorded)
    events = _segments(roles, ride, sound, is_known=recorded or stated is not None)
    if stated:
        events = (replace(events[0], notes=(*events[0].notes, SPARSE)), *events[1:])
    if not sound:
        step, provided = "velotyre diagnose MEASUREMENT.toml --out diagnosis", "the bicycle"
        if not recorded:
            provided += " and the forward speed"
        return Use(RIDE, events, tuple(reasons), (STEADY,), step, provided), drafts
    at = quote(str(path)) if recorded else quote(f"{path}@{f'{stated:.2f}' if stated else 'SPEED'}")
    if mapped:
        at += f" --channels {quote(str(roles.command_map.source)) if roles.command_map else 'MAP.toml'}"
    step = f"velotyre modal {at} --ride --out wobble.csv"
    provided = "" if recorded or stated else "the forward speed in m/s, after @"
    return Use(RIDE, events, tuple(reasons), (FOR_SPECTRA,) if has_spectra else (), step, provided), drafts


def _speed_channel(roles: Roles, channels: Sequence[str], *, mapped: bool) -> tuple[bool, list[str]]:
    """Find whether a ride has its speed, and the channels of its map with it.

    A speed with fewer samples than the motion, as of a GPS, is not mapped: it would cut the motion at its gaps, or
    bring it to its own rate.
    """
    if not mapped:
        names = {column.name for column in roles.opened.signals.columns}
        return bool(names & {SPEED, recording.KM_H}), list(channels)
    with_speed = [*channels, "speed"]
    if roles.map is not None:
        return "speed" in roles.map.channels, with_speed
    if "speed" not in roles.guessed or "speed" in roles.unknown_units(["speed"]):
        return False, list(channels)
    samples = roles.opened.quality[roles.guessed["speed"].column.name]
    is_sparse = samples.missing > MOST_MISSING * samples.samples
    if is_sparse or roles.resampling(with_speed) != roles.resampling(channels):
        return False, list(channels)
    return True, with_speed


def _wobbles_of(ride: Ride, *, is_known: bool) -> tuple[tuple[Wobble, ...], list[str]]:
    """Identify the wobble of a ``ride`` at each speed, known or not; and say why some speeds have none."""
    try:
        wobbles = identify_wobble(ride)
    except (ArithmeticError, ValueError) as error:
        return (), [f"wobble: {error}"]
    rejected = [wobble for wobble in wobbles if wobble.rejected]
    return wobbles, [f"wobble{_at(wobble.speed, is_known=is_known)}: {wobble.rejected}" for wobble in rejected]


def _at(speed: float, *, is_known: bool) -> str:
    return f" at {speed:.3g} m/s" if is_known else ""


def _segments(roles: Roles, ride: Ride, wobbles: Sequence[Wobble], *, is_known: bool) -> tuple[Event, ...]:
    """List the segments of a ``ride``; the first of each speed names the wobble at that speed."""
    file = _file_time(roles)
    runs = list(ride.segments)
    if (np.diff(file) <= 0).any():  # time begins again at each piece, and does not find the samples
        left_out: Counter[str] = Counter()
        for part in ride.parts_left_out:
            left_out[part.why] += part.samples
        events = [Event("", 1, file.size, sum(run.time.size for run in runs), dict(left_out))]
    else:
        names = [run.name.partition("#")[2] for run in runs]
        events = [
            _event(run, file, f"segment {name}" if name else "", 0.0, np.inf, ())
            for run, name in zip(runs, names, strict=True)
        ]
    for wobble in wobbles:
        nearest = min(range(len(runs)), key=lambda k: abs(runs[k].speed - wobble.speed))
        root = wobble.eigenvalue
        note = WOBBLE.format(
            at=_at(wobble.speed, is_known=is_known), hertz=float(frequency_hz(root)), real=-root.real, sd=wobble.sd[0]
        )
        place = min(nearest, len(events) - 1)
        events[place] = replace(events[place], notes=(*events[place].notes, note))
    return tuple(events)


def _event(run: recording.Run, file: Array, name: str, first_s: float, last_s: float, notes: tuple[str, ...]) -> Event:
    keep = (run.time >= run.time[0] + first_s - 1e-9) & (run.time <= run.time[0] + last_s + 1e-9)
    start = float(run.time[keep][0])
    end = float(run.time[keep][-1])
    used = int(np.count_nonzero(keep))
    first, last = (int(np.searchsorted(file, moment - 1e-9)) for moment in (start, end))
    return Event(name, first + 1, last + 1, used, {}, notes, start, end)


def _file_time(roles: Roles) -> Array:
    """Times of the samples of the file, s, as its records have them."""
    name = next(iter(roles.names((*MOTION, *TORQUES)).values()))
    time = roles.opened.time_of(roles.opened.signals.find(name))
    return time - time[0] if abs(time[0]) > 1e6 else time  # as records count times of an epoch


OSCILLATION = "{hertz:.3g} Hz, {sign} with {real:.3g} 1/s, {cycles:.1f} cycles, R^2 {r_squared:.3f}"


def _describe_decay(decay: Decay) -> tuple[str, ...]:
    sign, root = "decays" if decay.eigenvalue.real < 0 else "GROWS", decay.eigenvalue
    hertz = root.imag / (2 * np.pi)
    return (OSCILLATION.format(sign=sign, hertz=hertz, real=root.real, cycles=decay.cycles, r_squared=decay.r_squared),)


def _try_identify(run: recording.Run, **settings: Any) -> tuple[Decay | None, str]:
    if run.time.size > MOST_SAMPLES:
        return None, f"{run.time.size} samples at once are more than a decay has, and are not tried as one"
    try:
        decay = identify(run, **settings)
    except (InputError, ArithmeticError, ValueError) as error:
        return None, str(error).removeprefix(f"{run.name}: ")
    return decay, decay.rejected


def _decay(
    roles: Roles, runs: list[recording.Run], whole: recording.Run, speed: float | None
) -> tuple[Use, tuple[Window, ...]]:
    """Judge a free decay; also the windows that were found."""
    says = "" if speed else "the forward speed in m/s, after @"
    command = f"velotyre modal {_recording(roles, speed)}"
    file = _file_time(roles)
    windows: tuple[Window, ...] = ()
    kicks, searched = None, roles.map is None or not roles.map.windows
    quick = [{"drift": "parabola", "thorough": False}] if searched else []  # enough if kicks tell much more
    for settings in (*quick, {}):
        events, reasons, fits = _fit_whole_runs(runs, file, **settings)
        poorest = min((fit.r_squared for fit in fits), default=0.0)
        if poorest < 0.95 and searched:
            kicks = kicks or _kicks(whole, file)
            kick_windows, kick_events, kick_fits = kicks
            if kick_events and (not fits or max(map(_doubt, kick_fits)) < 0.5 * min(map(_doubt, fits))):
                if events:
                    reasons.append(f"the whole recording: R^2 = {poorest:.2f}; the stretches after impulses fit better")
                windows, events, fits = kick_windows, kick_events, kick_fits
                break
            reasons += [] if events else ["no stretch after a peak is one decaying oscillation either"]
    if not events:
        how = "record free motion after an impulse, hands off, two cycles or more; or search near a known frequency: "
        how += f"{command} --from S --to S --start-hz HZ"
        remedies = [how]
        if len(whole.channels) > 1:
            remedies.append("or leave motions that show no decay out of the map")
        return Use(DECAY, (), tuple(reasons), tuple(remedies)), ()
    step = f"{command} --out modal.csv"
    if all(float(frequency_hz(fit.eigenvalue)) >= LOWEST_HZ for fit in fits):
        step += " --mode wobble"
    if len(windows) == 1 and _is_native(roles):
        step += f" --from {windows[0].first:g} --to {windows[0].last:g}"
    grows = any("GROWS" in note for event in events for note in event.notes)
    doubt = ("an oscillation that does not die away may be driven: was it free motion, hands off?",) if grows else ()
    return Use(DECAY, tuple(events), tuple(reasons), doubt, step, says, windows=bool(windows)), windows


def _doubt(fit: Decay) -> float:
    return max(fit.sd) / abs(fit.eigenvalue)


def _fit_whole_runs(
    runs: list[recording.Run], file: Array, **settings: Any
) -> tuple[list[Event], list[str], list[Decay]]:
    """Fit runs as ``modal`` does: events that it uses, why not the others, and the fits."""
    events, reasons, fits = [], [], []
    for run in runs:
        decay, problem = _try_identify(run, **settings)
        name = run.name.partition("#")[2]
        if decay is not None and not problem:
            events.append(_event(run, file, name, 0.0, np.inf, _describe_decay(decay)))
            fits.append(decay)
        else:
            reasons.append(f"{name or 'the whole recording'}: {problem}")
    return events, reasons, fits


def _kicks(whole: recording.Run, file: Array) -> tuple[tuple[Window, ...], list[Event], list[Decay]]:
    """Find windows after impulses, their events and fits."""
    kicks = decays(whole)
    windows = tuple(Window(f"kick{place}", first, last) for place, (first, last, _) in enumerate(kicks, 1))
    events = [
        _event(whole, file, window.name, window.first, window.last, _describe_decay(decay))
        for window, (_, _, decay) in zip(windows, kicks, strict=True)
    ]
    return windows, events, [decay for _, _, decay in kicks]


def decays(run: recording.Run) -> list[tuple[float, float, Decay]]:
    """Windows of a ``run`` in which one oscillation dies away: start and end, s after its first sample, and its fit."""
    name = next((name for name in ORDER if name in run.channels), next(iter(run.channels)))
    x = np.abs(run.channels[name] - np.median(run.channels[name]))
    distance = max(int(1.5 / run.step), 1)  # s
    height = max(0.35 * float(x.max()), 5 * noise_level(run.channels[name]))
    peaks = scipy.signal.find_peaks(np.concatenate([[0.0], x, [0.0]]), height=height, distance=distance)[0] - 1
    peaks = _after_rest(x, peaks, max(int(run.time.size and 1.0 / run.step), 1))
    peaks = np.sort(peaks[np.argsort(-x[peaks])][:12])
    stretches: list[tuple[float, float, Decay]] = []
    free = 0.0
    for number, peak in enumerate(peaks):
        begin = float(run.time[peak] - run.time[0])
        ends = run.time[peaks[number + 1]] - 0.2 if number + 1 < len(peaks) else run.time[-1]
        best = _find_best_window(run, begin, float(ends - run.time[0])) if begin >= free else None
        if best is not None:
            stretches.append(best)
            free = best[1]
    return stretches


def _after_rest(x: Array, peaks: NDArray[np.intp], second: int) -> NDArray[np.intp]:
    """Keep the ``peaks`` of ``x`` that do not belong to the motion after another one: those of impulses."""
    kicks: list[int] = []
    for peak in peaks:
        if kicks:
            between = x[kicks[-1] : peak]
            quiet = min(float(between[first : first + second].max()) for first in range(0, between.size, second))
            if quiet > 0.5 * x[peak] and x[peak] < 1.5 * x[kicks[-1]]:
                continue
        kicks.append(int(peak))
    return np.array(kicks, int)


def _find_best_window(run: recording.Run, begin: float, end: float) -> tuple[float, float, Decay] | None:
    """The window after an impulse that shows one decaying oscillation best."""
    trials: list[tuple[float, float, Decay]] = []
    for start in STARTS:
        for length in dict.fromkeys(min(length, end - begin - start) for length in LENGTHS):
            first = round(begin + start, 3)
            last = min(round(first + length, 3), math.floor(1e3 * (run.time[-1] - run.time[0])) / 1e3)
            try:
                decay = identify(run, first_s=first, last_s=last, drift="parabola", thorough=False)
            except (InputError, ArithmeticError, ValueError):  # too short, or numbers that no fit goes through
                continue
            if not decay.rejected and decay.eigenvalue.real < 0:
                trials.append((first, last, decay))
    trials.sort(key=lambda trial: max(trial[2].sd) / abs(trial[2].eigenvalue))
    for first, last, _ in trials[:3]:  # windows of a kick whose start is checked as `modal` does
        decay = identify(run, first_s=first, last_s=last)
        if not decay.rejected and decay.eigenvalue.real < 0:
            return first, last, decay
    return None


def _recording(roles: Roles, speed: float | None) -> str:
    """The file, its speed and the channel map as a command takes them."""
    at = quote(f"{roles.opened.path}@{f'{speed:.2f}' if speed else 'SPEED'}")
    if roles.command_map is not None:
        return f"{at} --channels {quote(str(roles.command_map.source))}"
    return at if _is_native(roles) else f"{at} --channels MAP.toml"


def _replay(runs: list[recording.Run], roles: Roles, unsure: dict[str, str]) -> Use:
    """Judge a replay of recorded torques."""
    file = _file_time(roles)
    torques = [name for name in TORQUES if f"{name}_N_m" in runs[0].inputs]
    constant = [name for name in torques if all(np.ptp(run.inputs[f"{name}_N_m"]) == 0 for run in runs)]
    reasons, remedies = [], []
    if not set(runs[0].channels) - recording.PLACELESS:
        reasons.append(f"{', '.join(runs[0].channels)} cannot be compared: the place of the sensor is not known")
        remedies.append(roles.lacking("roll_rate"))
    if not torques:
        unknown = [name for name in TORQUES if name in unsure]
        reasons.append(
            f"unknown unit of {' and '.join(unknown)}" if unknown else "no channel recognised as steer torque"
        )
        remedies.append("write its unit into the draft" if unknown else roles.lacking("steer_torque"))
        remedies.append("without a torque, diagnose can use runs after an impulse as free motion (kind = histories)")
    elif len(constant) == len(torques):
        reasons.append(f"{', '.join(constant)} is constant: nothing drives the bicycle")
        remedies.append("map the channel that holds the torque, or use the run as free motion")
    if reasons:
        return Use(REPLAY, (), tuple(reasons), tuple(remedies))
    events = tuple(
        _event(run, file, run.name.partition("#")[2], 0.0, np.inf, (f"torque: {', '.join(torques)}",)) for run in runs
    )
    more = ("with one run nothing is held out, and any name is only probable: give several",) if len(runs) == 1 else ()
    return Use(
        REPLAY, events, (), more, "velotyre diagnose MEASUREMENT.toml --out diagnosis", "the bicycle and its speed"
    )
