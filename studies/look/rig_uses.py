"""Slip sweep, pull test and step: what ``velotyre tyre fit`` would do with a recording, by the fits' own checks."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from studies.look.roles import PULL, ROLLING, Roles
from studies.look.stretches import moving, with_rest
from studies.look.use import Event, Use
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.campaigns.recording import fit_read
from tyre.campaigns.summary import FitSettings
from tyre.channels.channel_map import ChannelMap
from tyre.channels.record import Record, records
from tyre.channels.windows import Window
from tyre.fits.slip_step import complete_samples, is_slip_step
from tyre.fits.sweep_branches import block_means, samples_used
from tyre.recordings.axes import CONVENTIONS
from tyre.recordings.mapped import QUANTITIES
from tyre.recordings.preflight import preflight
from tyre.recordings.read import read_events, read_recording, rig_recording
from tyre.recordings.recording import Condition, PullTest, RigRun
from tyre.recordings.sidecar import Sidecar

SWEEP, PULLED, STEP = "slip sweep", "pull test", "step (relaxation)"
KINDS = {"slip_sweep": SWEEP, "pull_test": PULLED, "slip_step": STEP}
ALL_ROLLING = (*ROLLING, "aligning_moment", "inclination", "speed", "temperature")
ALL_PULL = (*PULL, "rim_displacement")
SUPPOSED_LOAD, SUPPOSED_PRESSURE, SUPPOSED_SPEED = 400.0, 5e5, 2.5  # N, Pa, m/s: no check of a fit hinges on them


@dataclass(frozen=True)
class Supposed:
    """What the drafts suppose of a recording without a sidecar.

    Attributes
    ----------
    axes : str
        Under which the signs are right; empty where none was found.
    windows : tuple of (Window, float)
        Events, and the median load of each, N.
    load : float, optional
        Median of the whole, N.
    rigid_rim : bool
        A pull test without rim displacement.
    pull : bool
    speed_missing : bool
        A step needs the speed, which is not recorded.
    """

    axes: str = ""
    windows: tuple[tuple[Window, float], ...] = ()
    load: float | None = None
    rigid_rim: bool = False
    pull: bool = False
    speed_missing: bool = False


def rig_uses(roles: Roles) -> tuple[list[Use], list[Supposed]]:
    """The three uses of a tyre rig's recording, and what a draft of its sidecar supposes; see :class:`Roles`."""
    if roles.sidecar is not None:
        return _described(roles, roles.sidecar), []
    rolling, first = _supposed(roles, ROLLING)
    pulled, second = _supposed(roles, PULL)
    uses = {use.name: use for use in (*rolling, *pulled)}
    return [uses[name] for name in KINDS.values()], [given for given in (first, second) if given is not None]


def _described(roles: Roles, sidecar: Sidecar) -> list[Use]:
    """Of a recording with its sidecar: exactly what ``tyre fit`` reads."""
    path = roles.opened.path
    try:
        events = {"": read_recording(path)} if roles.map is None else read_events(path, roles.given)
    except InputError as error:
        return [Use(name, reasons=(_short(error, path),), remedies=(_mend(path),)) for name in KINDS.values()]
    judged = [_judge(name, event, roles, path) for name, event in events.items()]
    uses = []
    for name in KINDS.values():
        mine = [(event, problem) for kind, event, problem in judged if kind == name]
        good, bad = [e for e, problem in mine if not problem], [f"{e.name}: {p}".lstrip(": ") for e, p in mine if p]
        others = sorted({kind for kind, _, _ in judged})
        if mine:
            remedies = _ways(roles, bad)
        else:
            bad, remedies = [f"the sidecar and the channels make it a {' and a '.join(others)}"], ()
        uses.append(
            Use(name, tuple(good), tuple(bad), remedies, f"velotyre tyre fit {path.parent} --out fit" * bool(good))
        )
    return uses


def _mend(path: Path) -> str:
    return f"mend what is named, in {path.name} or in its sidecar {path.with_suffix('.toml').name}"


def _ways(roles: Roles, problems: Sequence[str]) -> tuple[str, ...]:
    return (_mend(roles.opened.path),) if problems else ()


def _supposed(roles: Roles, needed: Sequence[str]) -> tuple[list[Use], Supposed | None]:
    """Of a recording without a sidecar: what ``tyre fit`` would do once the draft is filled in."""
    pull = needed is PULL
    names = (PULLED,) if pull else (SWEEP, STEP)
    wanted = ALL_PULL if pull else ALL_ROLLING
    there = roles.names(wanted)
    lacking = [name for name in needed if name not in there]
    clock = roles.map.clock if roles.map else roles.opened.clock
    timed = clock is not None or all(roles.opened.signals[column].time is not None for column in there.values())
    if not pull and not timed:
        lacking.append("time")
    if lacking:
        reasons = tuple(f"no channel could be the {name.replace('_', ' ')}" for name in lacking)
        return [Use(name, (), reasons, tuple(roles.lacking(name) for name in lacking)) for name in names], None
    unsure = roles.unknown_units(needed if pull else [*needed, "time"])
    given = Supposed(pull=pull, rigid_rim=pull and "rim_displacement" not in there)
    if unsure:
        said = ", ".join(f"{name.replace('_', ' ')} ({column})" for name, column in unsure.items())
        remedy = (
            "write the units into the draft, or scale and offset with the unit where the file holds counts or volts"
        )
        return [Use(name, (), (f"no unit is known of {said}",), (remedy,)) for name in names], given
    try:
        return _tried(roles, roles.map_of(wanted), given, names)
    except InputError as error:
        reason = _short(error, roles.opened.path)
        return [
            Use(name, (), (reason,), ("write the map with --channels, or mend the draft",)) for name in names
        ], given


def _tried(roles: Roles, channel_map: ChannelMap, given: Supposed, names: Sequence[str]) -> tuple[list[Use], Supposed]:
    path, own = roles.opened.path, channel_map.windows
    plain = replace(channel_map, windows=())
    (whole,) = records(roles.opened.signals, plain, QUANTITIES, timed=not given.pull)
    load = whole.values.get("vertical_load")
    middle = None if load is None or given.pull else float(np.nanmedian(load))
    axes, recording = _oriented(whole, given, path, middle)
    given = replace(
        given, axes=axes, load=None if middle is None else abs(middle), speed_missing="speed" not in whole.values
    )
    if own:
        spans = [(record.event, record) for record in records(
            roles.opened.signals, replace(plain, windows=own), QUANTITIES, timed=not given.pull)]  # fmt: skip
        tried = [_judge(name, _as_rig(record, given, axes, path), roles, path) for name, record in spans]
    elif isinstance(recording, RigRun):
        tried, windows = _found(whole, recording, given, roles)
        given = replace(given, windows=windows)
    else:
        tried = [_judge("", recording, roles, path)]
    return _sorted(tried, names, given, windows=bool(given.windows)), given


def _found(
    whole: Record, run: RigRun, given: Supposed, roles: Roles
) -> tuple[list[tuple[str, Event, str]], tuple[tuple[Window, float], ...]]:
    """The whole recording where it is one event, else the events in it that can be fitted."""
    path = roles.opened.path
    at_once = _judge("", run, roles, path)
    stretches = moving(run)
    found, windows = [], []
    for place in range(len(stretches)):
        for first, last in (stretches[place], with_rest(stretches, place, run)):
            kind = "sweep" if (first, last) == stretches[place] else "step"
            window = _window(f"{kind}{place + 1}", whole.time, first, last)
            part = slice(*np.searchsorted(whole.time - whole.time[0], (window.first - 1e-9, window.last + 1e-9)))
            event = replace(whole, time=whole.time[part], values={name: x[part] for name, x in whole.values.items()})
            try:
                judged = _judge(window.name, _as_rig(event, given, run.axes, path), roles, path)
            except InputError:
                continue
            if not judged[2] and (judged[0] == SWEEP) == (kind == "sweep"):
                found.append(judged)
                windows.append((window, float(np.nanmedian(np.abs(event.values["vertical_load"])))))
                break
    much = sum(event.last - event.first + 1 for _, event, _ in found) > 0.9 * run.time.size
    if not found or (not at_once[2] and len(found) == 1 and (much or at_once[0] == STEP)):
        return [at_once], ()
    return found, tuple(windows)


def _window(name: str, time: Array, first: int, last: int) -> Window:
    """Between samples, so that rounded times name the same ones."""
    middle = 0.5 * (time[1:] + time[:-1]) - time[0]
    begin = 0.0 if first == 0 else float(f"{middle[first - 1]:.6g}")
    end = float(time[-1] - time[0]) if last >= time.size else float(f"{middle[last - 1]:.6g}")
    return Window(name, begin, min(end, float(f"{time[-1] - time[0]:.9g}")))


def _oriented(whole: Record, given: Supposed, path: Path, load: float | None) -> tuple[str, RigRun | PullTest]:
    """The axes under which the recording has the right signs, else the first ones that can be read."""
    first: tuple[str, RigRun | PullTest] | None = None
    error: InputError | None = None
    for axes in _likely(load):
        try:
            found = _as_rig(whole, given, axes, path)
        except InputError as reason:
            error = error or reason
            continue
        if not any(problem.startswith("wrong sign") for problem in preflight(found).problems):
            return axes, found
        first = first or (axes, found)
    if first is None:
        assert error is not None
        raise error
    return first


def _likely(load: float | None) -> Iterator[str]:
    yield from CONVENTIONS if load is None or load > 0 else ("SAE", *[name for name in CONVENTIONS if name != "SAE"])


def _as_rig(record: Record, given: Supposed, axes: str, path: Path) -> RigRun | PullTest:
    load = record.values.get("vertical_load")
    middle = SUPPOSED_LOAD if load is None or given.pull else float(np.nanmedian(np.abs(load)))
    condition = Condition("?", load=middle, pressure=SUPPOSED_PRESSURE, surface="flat")
    sidecar = Sidecar(condition, axes, None, synthetic=False, notes=(), rigid_rim=given.rigid_rim)
    return rig_recording(record, sidecar, path)


def _judge(name: str, recording: RigRun | PullTest, roles: Roles, path: Path) -> tuple[str, Event, str]:
    """Use, samples, and why they cannot be fitted (empty where they can)."""
    if isinstance(recording, PullTest):
        kind, used, lacks = PULLED, recording.complete, "lack a reading"
    elif is_slip_step(recording):
        kind, used, lacks = STEP, complete_samples(recording), "lack a channel"
    else:
        kind, used, lacks = SWEEP, np.isfinite(recording.side_force), "lack the side force"
    problem = ""
    notes: tuple[str, ...] = ()
    if (
        kind == STEP
        and isinstance(recording, RigRun)
        and recording.speed is None
        and roles.sidecar is None
        and recording.condition.speed is None
    ):
        condition = replace(recording.condition, speed=SUPPOSED_SPEED)
        recording = replace(recording, condition=condition)
    try:
        summary, _ = fit_read(recording, path, name=name, settings=FitSettings())
        notes = summary.notes
    except (InputError, ArithmeticError, ValueError) as error:
        problem = _short(error, path)
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


def _sorted(
    tried: Sequence[tuple[str, Event, str]], names: Sequence[str], given: Supposed, *, windows: bool
) -> list[Use]:
    uses = []
    kinds = sorted({kind for kind, _, _ in tried})
    for name in names:
        mine = [(event, problem) for kind, event, problem in tried if kind == name]
        good = tuple(event for event, problem in mine if not problem)
        reasons = tuple(f"{event.name}: {problem}".lstrip(": ") for event, problem in mine if problem)
        remedies = tuple("mend it in the file or in the draft: each reason says how" for _ in reasons[:1])
        if not mine:
            reasons = (f"the channels are there, but what was recorded is a {' and a '.join(kinds)}",)
            remedies = ('write kind = "slip_step" into the sidecar if it is a step',) if name == STEP else ()
        speed = ", the speed" if name == STEP and given.speed_missing else ""
        says = f"tyre, load, pressure, surface{speed} and axes, which no recording says"
        uses.append(Use(name, good, reasons, remedies, "", says if good else "", windows=windows and bool(good)))
    return uses


def _short(error: Exception, path: Path) -> str:
    text = str(error).partition("\n\n")[0].partition("A first draft of a map")[0].strip(" ;")
    for start in (f"{path}: not usable: ", f"{path}: ", f"{path}, "):
        text = text.removeprefix(start)
    return text or type(error).__name__
