"""Uses of a recording, and what ``velotyre tyre fit`` would do with it, by the fits' own checks."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import numpy as np

from studies.look.opened import PULL, ROLLING, Roles
from tyre.fits.campaign import fit_read
from tyre.fits.condition import FitSettings
from tyre.fits.recording_files import QUANTITIES, read_events, rig_recording
from tyre.fits.relaxation import complete_samples, is_slip_step
from tyre.fits.segments import level_conditions, steady_levels, stretches
from tyre.fits.sidecar import Sidecar
from tyre.fits.sweep_curve import block_means, samples_used
from tyre.fits.tydex_recording import tydex_sidecar
from tyre.formats.channel_map import ChannelMap, Window
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.recordings.channels import Record, records
from tyre.recordings.recording import CONVENTIONS, Condition, LateralStiffnessTest, RigRun
from tyre.recordings.run_checks import preflight

SWEEP, PULLED, STEP, STEADY = "slip sweep", "lateral stiffness test", "step (relaxation)", "steady curve"
USES = (
    SWEEP,
    PULLED,
    STEP,
    "free decay (modal)",
    "ride (wobble, spectra)",
    "replay (histories)",
    "frequency response",
)
"""Uses of a recording; of a table without time the first one is a steady curve."""


@dataclass(frozen=True)
class Event:
    """A stretch of a recording for one use."""

    name: str  # of the window; empty for a whole recording
    first: int  # samples of the file, from 1, both included
    last: int  # samples of the file, from 1, both included
    used: int  # how many samples in it are fitted
    left_out: dict[str, int] = field(default_factory=dict)  # why samples in it are not fitted -> how many
    notes: tuple[str, ...] = ()  # what the fit will remark
    start_s: float = 0.0  # s, by the time of the file
    end_s: float = 0.0  # s, by the time of the file


@dataclass(frozen=True)
class Use:
    """One use of a recording."""

    name: str  # one of :data:`USES`
    events: tuple[Event, ...] = ()  # what can be used; empty where nothing can
    reasons: tuple[str, ...] = ()  # why nothing, or not more, can be used
    remedies: tuple[str, ...] = ()  # what to do about that
    next_step: str = ""  # a command
    provided: str = ""  # what the user must still say for the answer to hold
    windows: bool = False  # True if a draft cuts the events out by windows

    @property
    def usable(self) -> bool:
        """True if a command would use some of it."""
        return bool(self.events)


def place_of(use: Use) -> int:
    """Place of a use among :data:`USES`."""
    return USES.index(SWEEP if use.name == STEADY else use.name)


OTHERWISE = {
    SWEEP: "a slip sweep goes up and down between slip angles, without rest, with kind = slip_sweep or none",
    PULLED: "a lateral stiffness test needs lateral_force, plate_displacement and rim_displacement (or "
    "rigid_rim = true)",
    STEADY: 'steady points of slip angle, load and lateral force have no time, with kind = "steady"',
    STEP: 'a step rests, goes to another slip angle and rests there; write kind = "slip_step" into its sidecar',
}
"""What makes a recording the other use."""

KINDS = {"slip_sweep": SWEEP, "lateral_stiffness": PULLED, "slip_step": STEP}  # in which each recording is sorted
ALL_ROLLING = (*ROLLING, "aligning_moment", "inclination", "speed", "temperature", "pressure")
MANY_POINTS = 300  # of a level; nobody waits for so many to settle
CHANNEL_OF = {"load": "vertical_load", "camber": "inclination"}
ALL_PULL = (*PULL, "rim_displacement", "vertical_load", "pressure")


class Found(NamedTuple):
    """An event: its window, its condition by the levels of the channels, and whether it is a step."""

    window: Window  # from and to in s
    condition: Condition  # by the levels of the channels
    step: bool  # a slip step rather than a sweep


@dataclass(frozen=True)
class Supposed:
    """Suppositions of the drafts for a recording without a sidecar."""

    constants: Sidecar | None = None  # that the constants of a TYDEX file make
    axes: str = ""  # under which the signs are right; empty where none was found
    windows: tuple[Found, ...] = ()  # events of several conditions; none: the whole recording is one
    condition: Condition | None = None  # of the whole, by the channels
    load: float = np.nan  # median of the whole, N
    rigid_rim: bool = False  # a lateral stiffness test without rim displacement
    pull: bool = False  # a lateral stiffness test rather than a rolling tyre
    step: bool = False  # the whole recording is a step
    steady: bool = False  # settled points, without time
    levels: tuple[Condition, ...] = ()  # of settled points
    recorded: tuple[str, ...] = ()  # channels of the condition

    @property
    def unsaid(self) -> list[str]:
        """Keys that the user must fill in, as neither the recording nor its constants give them."""
        said_keys = [] if self.constants is None else ["tyre", "surface", "axes"]
        if self.constants is not None:
            said_keys += [
                name for name in ("load", "pressure") if not np.isnan(getattr(self.constants.condition, name))
            ]
        said_keys += self.recorded
        said_keys += [] if np.isnan(self.load) else ["load"]
        return [name for name in ("tyre", "load", "pressure", "surface", "axes") if name not in said_keys]


def find_axes(
    whole: Record, supposed: Supposed, path: Path, load: float | None
) -> tuple[str, RigRun | LateralStiffnessTest]:
    """Find the axes under which the recording has the right signs, else the first ones that can be read."""
    first: tuple[str, RigRun | LateralStiffnessTest] | None = None
    error: InputError | None = None
    likely = CONVENTIONS if load is None or load > 0 else sorted(CONVENTIONS, key=lambda name: name != "SAE")
    for axes in likely:
        try:
            recording = as_rig(whole, supposed, axes, path)
        except InputError as reason:
            error = error or reason
            continue
        if not any(problem.startswith("wrong sign") for problem in preflight(recording).problems):
            return axes, recording
        first = first or (axes, recording)
    if first is None:
        assert error is not None
        raise error
    return first


def as_rig(record: Record, supposed: Supposed, axes: str, path: Path) -> RigRun | LateralStiffnessTest:
    """Make rig data of a ``record``, as ``tyre fit`` has it once the draft (``supposed``) is filled in."""
    load = 400.0 if supposed.pull and "vertical_load" not in record.values else np.nan
    pressure = np.nan if "pressure" in record.values else 5e5
    assumed = Condition("?", load=load, pressure=pressure, surface="flat", camber=np.nan)
    sidecar = supposed.constants or Sidecar(assumed, axes, None, synthetic=False, notes=())
    sidecar = replace(sidecar, axes=axes, rigid_rim=supposed.rigid_rim)
    if supposed.steady:
        load = np.nan if "vertical_load" in record.values else 400.0
        condition = replace(sidecar.condition, load=load)
        return rig_recording(record, replace(sidecar, kind="steady", condition=condition), path)
    recording = rig_recording(record, sidecar, path)
    if isinstance(recording, RigRun) and is_slip_step(recording):
        return rig_recording(record, replace(sidecar, kind="slip_step"), path)
    return recording


def judge(name: str, recording: RigRun | LateralStiffnessTest, roles: Roles, path: Path) -> tuple[str, Event, str]:
    """Judge one event: its use, its samples, and why they cannot be fitted (empty if they can)."""
    if isinstance(recording, RigRun):
        recording = replace(recording, condition=level_conditions({"": recording})[""])
    if isinstance(recording, LateralStiffnessTest):
        kind, used, lacks = PULLED, recording.complete, "lack a reading"
    elif recording.kind == "steady":
        kind, used, lacks = STEADY, np.isfinite(recording.lateral_force), "lack the lateral force"
    elif is_slip_step(recording):
        kind, used, lacks = STEP, complete_samples(recording), "lack a channel"
    else:
        kind, used, lacks = SWEEP, np.isfinite(recording.lateral_force), "lack the lateral force"
    problem = ""
    notes: tuple[str, ...] = ()
    if isinstance(recording, RigRun) and kind == STEP and roles.sidecar is None:
        has_speed = recording.speed is not None or recording.condition.speed is not None
        condition = (
            recording.condition if has_speed else replace(recording.condition, speed=2.5)
        )  # no check hinges on it
        recording = replace(recording, condition=condition)
    try:
        with np.errstate(all="ignore"):  # a wheel that stands still: the fit says so
            summary, _ = fit_read(recording, path, name=name, settings=FitSettings())
        notes = tuple(note for note in summary.notes if note not in roles.opened.signals.notes)
    except InputError as error:
        problem = shorten_error(error, path)
    except (ArithmeticError, ValueError) as error:  # also of linear algebra
        problem = f"cannot be fitted ({type(error).__name__}: {error})"
    if problem and kind == STEP and roles.sidecar is not None and getattr(recording, "kind", "") == "slip_sweep":
        problem += '; it is a step: write kind = "slip_step" into the sidecar'
    left_out = {f"that {lacks}": int(np.count_nonzero(~used))}
    if kind == SWEEP and isinstance(recording, RigRun) and not problem:
        settled = samples_used(recording, block_means(recording))
        left_out["within half a metre after a reversal or in a poor block"] = int(np.count_nonzero(used & ~settled))
        used = settled
    first, start = _place(recording.time, roles)
    end = start + (float(recording.time[-1] - recording.time[0]) if recording.time is not None else 0.0)
    left_out = {why: count for why, count in left_out.items() if count}
    event = Event(name, first + 1, first + used.size, int(np.count_nonzero(used)), left_out, notes, start, end)
    return kind, event, problem


def _place(time: Array | None, roles: Roles) -> tuple[int, float]:
    """Number of the first sample in the file, from 0, and its time, s."""
    if time is None:
        return 0, 0.0
    name = next(iter(roles.names((*ALL_ROLLING, *ALL_PULL)).values()), next(iter(roles.opened.signals.signals)))
    whole = roles.opened.time_of(roles.opened.signals.find(name))
    origin = whole[0] if abs(whole[0]) > 1e6 else 0.0
    return int(np.searchsorted(whole - origin, time[0] - 1e-9)), float(time[0])


def shorten_error(error: Exception, path: Path) -> str:
    """Shorten an ``error`` by the file at ``path``, which is known, and by a draft of a map."""
    text = str(error).partition("\n\n")[0].partition("A first draft of a map")[0].strip(" ;")
    for start in (f"{path}: not usable: ", f"{path}: ", f"{path}, "):
        text = text.removeprefix(start)
    return text or type(error).__name__


def rig_uses(roles: Roles) -> tuple[list[Use], list[Supposed]]:
    """Judge the three uses of a tyre rig's recording, and fill what a draft of its sidecar supposes."""
    if roles.sidecar is not None:
        return _judge_with_sidecar(roles), []
    rolling, first = _judge_without_sidecar(roles, ROLLING)
    pulled, second = _judge_without_sidecar(roles, PULL)
    uses = sorted((*rolling, *pulled), key=place_of)
    return uses, [supposed for supposed in (first, second) if supposed is not None]


def _judge_with_sidecar(roles: Roles) -> list[Use]:
    """Judge a recording with its sidecar, exactly as ``tyre fit`` reads it."""
    path = roles.opened.path
    mend = f"correct what is named, in {path.name} or in its sidecar {path.with_suffix('.toml').name}"
    try:
        judged = [judge(name, run, roles, path) for name, run in read_events(path, roles.command_map).items()]
    except InputError as error:
        return [Use(name, reasons=(shorten_error(error, path),), remedies=(mend,)) for name in KINDS.values()]
    step = f"velotyre tyre fit {quote(str(path.parent))} --out fit"
    is_steady = roles.sidecar is not None and roles.sidecar.kind == "steady"
    names = [STEADY if is_steady and name == SWEEP else name for name in KINDS.values()]
    return _by_kind(judged, names, "the sidecar and the channels make it a", mend, next_step=step)


def _by_kind(
    judged: Sequence[tuple[str, Event, str]], names: Sequence[str], beginning: str, mend: str, **of_good: Any
) -> list[Use]:
    """Sort the events that were ``judged`` into the uses ``names``; what is true ``of_good`` events alone."""
    uses = []
    for name in names:
        of_kind = [(event, problem) for kind, event, problem in judged if kind == name]
        if not of_kind:
            other_kinds = " and a ".join(sorted({kind for kind, _, _ in judged}))
            uses.append(Use(name, (), (f"{beginning} {other_kinds}",), (OTHERWISE[name],)))
            continue
        good = tuple(event for event, problem in of_kind if not problem)
        bad = tuple(
            f"samples {event.first}-{event.last}: {problem}" if event.name else problem
            for event, problem in of_kind
            if problem
        )
        use = Use(name, good, bad, (mend,) if bad else ())
        uses.append(replace(use, **of_good) if good else use)
    return uses


def _judge_without_sidecar(roles: Roles, needed: Sequence[str]) -> tuple[list[Use], Supposed | None]:
    """Judge a recording without a sidecar, as ``tyre fit`` would once the draft is filled in."""
    pull = needed is PULL
    names = (PULLED,) if pull else (SWEEP, STEP)
    channels = ALL_PULL if pull else ALL_ROLLING
    columns = roles.names(channels)
    lacking = [name for name in needed if name not in columns]
    if not pull and not roles.is_timed(columns) and not set(lacking) - {"vertical_load"}:
        return _judge_settled_points(roles)
    if not pull and not roles.is_timed(columns):
        lacking.append("time")
    if lacking:
        reasons = (f"no channel recognised as {' or '.join(name.replace('_', ' ') for name in lacking)}",)
        return [Use(name, (), reasons, (roles.lacking(*lacking),)) for name in names], None
    unsure = roles.unknown_units(needed if pull else [*needed, "time"])
    path = roles.opened.path
    sidecar = tydex_sidecar(path) if path.suffix.casefold() == ".tdx" else None
    supposed = Supposed(sidecar, pull=pull, rigid_rim=pull and "rim_displacement" not in columns)
    if unsure:
        mass = {column: re.search(r"[\[(](kg|lb)s?[\])]$", column) for column in unsure.values()}
        more = {column: f": {unit[1]} is a mass, {unit[1]}f a force" if unit else "" for column, unit in mass.items()}
        without_unit = ", ".join(
            f"{name.replace('_', ' ')} ({column}{more[column]})" for name, column in unsure.items()
        )
        reason = f"unknown unit of {without_unit}"
        remedy = (
            "write the units into the draft, or scale and offset with the unit where the file holds counts or volts"
        )
    else:
        try:
            return _judge_channels(roles, roles.map_of(channels), supposed, names)
        except InputError as error:
            reason, remedy = (
                shorten_error(error, roles.opened.path),
                "write the map with --channels, or correct the draft",
            )
    return [Use(name, (), (reason,), (remedy,)) for name in names], supposed


def _judge_settled_points(roles: Roles) -> tuple[list[Use], Supposed | None]:
    """Judge a table of slip angle and lateral force without time: settled points, sorted by their levels."""
    path, channels = roles.opened.path, ALL_ROLLING
    supposed = Supposed(steady=True)
    step = Use(STEP, (), ("no channel recognised as time: these are steady points",), (OTHERWISE[STEP],))
    if unsure := roles.unknown_units(["slip_angle", "lateral_force", "vertical_load"]):
        reason = f"unknown unit of {', '.join(unsure.values())}"
        return [Use(STEADY, (), (reason,), ("write the units into the draft",)), step], supposed
    try:
        (whole,) = records(roles.opened.signals, roles.map_of(channels), QUANTITIES, timed=False)
        load = whole.values.get("vertical_load")
        middle = None if load is None else float(np.nanmedian(load))
        recorded = tuple(name for name in ("pressure", "speed", "camber") if CHANNEL_OF.get(name, name) in whole.values)
        supposed = replace(supposed, recorded=recorded, load=np.nan if middle is None else abs(middle))
        axes, recording = find_axes(whole, supposed, path, middle)
        assert isinstance(recording, RigRun)
        levels = steady_levels(recording)
        conditions = level_conditions(levels)
        judged = [judge(name, run, roles, path) for name, run in levels.items()]
    except InputError as error:
        return [
            Use(STEADY, (), (shorten_error(error, path),), ("write the map with --channels, or correct the draft",)),
            step,
        ], supposed
    size = recording.time.size
    events = tuple(
        replace(event, first=1, last=size, left_out=_count_unused(size - event.used), start_s=0.0, end_s=0.0)
        for _, event, problem in judged
        if not problem
    )
    reasons = tuple(f"{event.name or 'all points'}: {problem}" for _, event, problem in judged if problem)
    supposed = replace(supposed, axes=axes, levels=tuple(conditions.values()))
    provided = f"{', '.join(supposed.unsaid)} (not in the recording)" if supposed.unsaid else ""
    many = max((event.used for event in events), default=0) > MANY_POINTS
    remedies = ("so many points are rather samples of a sweep, which lags: then map their time",) if many else ()
    return [Use(STEADY, events, reasons, remedies, provided=provided if events else ""), step], supposed


def _count_unused(count: int) -> dict[str, int]:
    return {"of other levels, or incomplete": count} if count else {}


def _judge_channels(
    roles: Roles, channel_map: ChannelMap, supposed: Supposed, names: Sequence[str]
) -> tuple[list[Use], Supposed]:
    path, windows_of_map = roles.opened.path, channel_map.windows
    plain = replace(channel_map, windows=())
    (whole,) = records(roles.opened.signals, plain, QUANTITIES, timed=not supposed.pull)
    load = whole.values.get("vertical_load")
    middle = None if load is None else float(np.nanmedian(load))
    recorded = tuple(name for name in ("pressure", "speed", "camber") if CHANNEL_OF.get(name, name) in whole.values)
    supposed = replace(supposed, recorded=recorded, load=np.nan if middle is None else abs(middle))
    axes, recording = find_axes(whole, supposed, path, middle)
    if isinstance(recording, RigRun):
        supposed = replace(
            supposed, condition=level_conditions({"": recording})[""], step=recording.kind == "slip_step"
        )
    else:
        supposed = replace(supposed, condition=recording.condition)
    supposed = replace(supposed, axes=axes)
    if windows_of_map:
        spans = [
            (record.event, record)
            for record in records(
                roles.opened.signals, replace(plain, windows=windows_of_map), QUANTITIES, timed=not supposed.pull
            )
        ]
        judged = [judge(name, as_rig(record, supposed, axes, path), roles, path) for name, record in spans]
    elif isinstance(recording, RigRun):
        judged, windows = _judge_events(whole, recording, supposed, roles)
        supposed = replace(supposed, windows=windows)
    else:
        judged = [judge("", recording, roles, path)]
    beginning = "the channels are there, but what was recorded is a"
    mend = "correct it in the file or in the draft: each reason says how"
    uses = _by_kind(judged, names, beginning, mend, windows=bool(supposed.windows))
    lacking = [[*supposed.unsaid, *["speed"] * (use.name == STEP and "speed" not in recorded)] for use in uses]
    return [
        replace(use, provided=f"{', '.join(names)} (not in the recording)" if use.usable and names else "")
        for use, names in zip(uses, lacking, strict=True)
    ], supposed


def _judge_events(
    whole: Record, run: RigRun, supposed: Supposed, roles: Roles
) -> tuple[list[tuple[str, Event, str]], tuple[Found, ...]]:
    """Judge the whole recording if it is one event, else the events in it that can be fitted."""
    path = roles.opened.path
    at_once = judge("", run, roles, path)
    fitted, failed = [], []
    events: dict[str, tuple[Window, RigRun]] = {}
    for number, cut in enumerate(stretches(run), 1):
        window = _window(f"{cut.kind}{number}", whole.time, cut.first, cut.last)
        part = slice(*np.searchsorted(whole.time - whole.time[0], (window.first - 1e-9, window.last + 1e-9)))
        event = replace(whole, time=whole.time[part], values={name: x[part] for name, x in whole.values.items()})
        try:
            rig = as_rig(event, supposed, run.axes, path)
            judged = judge(window.name, rig, roles, path)
        except InputError:
            continue
        if isinstance(rig, RigRun) and not judged[2] and (judged[0] == SWEEP) == (cut.kind == "sweep"):
            fitted.append(judged)
            events[window.name] = window, rig
        elif judged[2]:
            failed.append(judged)
    much = sum(event.last - event.first + 1 for _, event, _ in fitted) > 0.9 * run.time.size
    if not fitted or (not at_once[2] and len(fitted) == 1 and (much or at_once[0] == STEP)):
        return [at_once], ()
    conditions = level_conditions({name: rig for name, (_, rig) in events.items()})
    windows = [Found(window, conditions[name], rig.kind == "slip_step") for name, (window, rig) in events.items()]
    return [*fitted, *failed], tuple(windows)


def _window(name: str, time: Array, first: int, last: int) -> Window:
    """Cut between samples, so that rounded times name the same ones."""
    middle = 0.5 * (time[1:] + time[:-1]) - time[0]
    begin = 0.0 if first == 0 else float(f"{middle[first - 1]:.6g}")
    end = float(time[-1] - time[0]) if last >= time.size else float(f"{middle[last - 1]:.6g}")
    return Window(name, begin, min(end, float(f"{time[-1] - time[0]:.9g}")))
