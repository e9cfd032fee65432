"""Slip sweep, pull test and step: what ``velotyre tyre fit`` would do with a recording, by the fits' own checks."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote

import numpy as np

from studies.look.rig_events import (
    ALL_PULL,
    ALL_ROLLING,
    KINDS,
    OTHERWISE,
    PULLED,
    STEP,
    SWEEP,
    Found,
    Supposed,
    as_rig,
    judge,
    oriented,
    short,
)  # fmt: skip
from studies.look.roles import PULL, ROLLING, Roles
from studies.look.stretches import moving, with_rest
from studies.look.use import Event, Use
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.record import Record, records
from tyre.channels.windows import Window
from tyre.recordings.mapped import QUANTITIES
from tyre.recordings.read import read_events, read_recording
from tyre.recordings.recording import RigRun
from tyre.recordings.sidecar import Sidecar


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
        return [Use(name, reasons=(short(error, path),), remedies=(_mend(path),)) for name in KINDS.values()]
    judged = [judge(name, event, roles, path) for name, event in events.items()]
    uses = []
    for name in KINDS.values():
        mine = [(event, problem) for kind, event, problem in judged if kind == name]
        good = [event for event, problem in mine if not problem]
        bad = [f"{f'{event.name}: ' * bool(event.name)}{problem}" for event, problem in mine if problem]
        others = sorted({kind for kind, _, _ in judged})
        if mine:
            undeclared = name == STEP and any(getattr(e, "kind", "") == "slip_sweep" for e in events.values())
            declare = ('it is a step: write kind = "slip_step" into the sidecar',) if undeclared and bad else ()
            remedies = declare + _ways(roles, bad)
        else:
            bad = [f"the sidecar and the channels make it a {' and a '.join(others)}"]
            remedies = (OTHERWISE[name],)
        fit = f"velotyre tyre fit {quote(str(path.parent))} --out fit"
        uses.append(Use(name, tuple(good), tuple(bad), remedies, fit * bool(good)))
    return uses


def _mend(path: Path) -> str:
    return f"mend what is named, in {path.name} or in its sidecar {path.with_suffix('.toml').name}"


def _ways(roles: Roles, problems: Sequence[str]) -> tuple[str, ...]:
    return (_mend(roles.opened.path),) if problems else ()


def _mass(column: str) -> str:
    """What is to be written for a load in a unit of mass."""
    unit = re.search(r"[\[(](kg|lb)s?[\])]$", column)
    return f": {unit[1]} is a mass, {unit[1]}f a force" if unit else ""


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
        reasons = (f"no channel could be the {', the '.join(name.replace('_', ' ') for name in lacking)}",)
        return [Use(name, (), reasons, (roles.lacking(*lacking),)) for name in names], None
    unsure = roles.unknown_units(needed if pull else [*needed, "time"])
    given = Supposed(pull=pull, rigid_rim=pull and "rim_displacement" not in there)
    if unsure:
        said = ", ".join(f"{name.replace('_', ' ')} ({column}{_mass(column)})" for name, column in unsure.items())
        remedy = (
            "write the units into the draft, or scale and offset with the unit where the file holds counts or volts"
        )
        return [Use(name, (), (f"no unit is known of {said}",), (remedy,)) for name in names], given
    try:
        return _tried(roles, roles.map_of(wanted), given, names)
    except InputError as error:
        reason = short(error, roles.opened.path)
        return [
            Use(name, (), (reason,), ("write the map with --channels, or mend the draft",)) for name in names
        ], given


def _tried(roles: Roles, channel_map: ChannelMap, given: Supposed, names: Sequence[str]) -> tuple[list[Use], Supposed]:
    path, own = roles.opened.path, channel_map.windows
    plain = replace(channel_map, windows=())
    (whole,) = records(roles.opened.signals, plain, QUANTITIES, timed=not given.pull)
    load = whole.values.get("vertical_load")
    middle = None if load is None or given.pull else float(np.nanmedian(load))
    axes, recording = oriented(whole, given, path, middle)
    given = replace(
        given, axes=axes, load=None if middle is None else abs(middle), speed_missing="speed" not in whole.values,
        step=isinstance(recording, RigRun) and recording.kind == "slip_step",
    )  # fmt: skip
    if own:
        spans = [(record.event, record) for record in records(
            roles.opened.signals, replace(plain, windows=own), QUANTITIES, timed=not given.pull)]  # fmt: skip
        tried = [judge(name, as_rig(record, given, axes, path), roles, path) for name, record in spans]
    elif isinstance(recording, RigRun):
        tried, windows = _found(whole, recording, given, roles)
        given = replace(given, windows=windows)
    else:
        tried = [judge("", recording, roles, path)]
    return _sorted(tried, names, given, windows=bool(given.windows)), given


def _found(
    whole: Record, run: RigRun, given: Supposed, roles: Roles
) -> tuple[list[tuple[str, Event, str]], tuple[Found, ...]]:
    """The whole recording where it is one event, else the events in it that can be fitted."""
    path = roles.opened.path
    at_once = judge("", run, roles, path)
    stretches = moving(run)
    found, windows, failed = [], [], []
    for place in range(len(stretches)):
        judged = at_once
        for first, last in (stretches[place], with_rest(stretches, place, run)):
            kind = "sweep" if (first, last) == stretches[place] else "step"
            window = _window(f"{kind}{place + 1}", whole.time, first, last)
            part = slice(*np.searchsorted(whole.time - whole.time[0], (window.first - 1e-9, window.last + 1e-9)))
            event = replace(whole, time=whole.time[part], values={name: x[part] for name, x in whole.values.items()})
            try:
                judged = judge(window.name, as_rig(event, given, run.axes, path), roles, path)
            except InputError:
                continue
            if not judged[2] and (judged[0] == SWEEP) == (kind == "sweep"):
                found.append(judged)
                load = float(np.nanmedian(np.abs(event.values["vertical_load"])))
                windows.append(Found(window, load, kind == "step"))
                break
        else:
            if judged is not at_once and judged[2]:
                failed.append(judged)
    much = sum(event.last - event.first + 1 for _, event, _ in found) > 0.9 * run.time.size
    if not found or (not at_once[2] and len(found) == 1 and (much or at_once[0] == STEP)):
        return [at_once], ()
    return [*found, *failed], tuple(windows)


def _window(name: str, time: Array, first: int, last: int) -> Window:
    """Between samples, so that rounded times name the same ones."""
    middle = 0.5 * (time[1:] + time[:-1]) - time[0]
    begin = 0.0 if first == 0 else float(f"{middle[first - 1]:.6g}")
    end = float(time[-1] - time[0]) if last >= time.size else float(f"{middle[last - 1]:.6g}")
    return Window(name, begin, min(end, float(f"{time[-1] - time[0]:.9g}")))


def _sorted(
    tried: Sequence[tuple[str, Event, str]], names: Sequence[str], given: Supposed, *, windows: bool
) -> list[Use]:
    uses = []
    kinds = sorted({kind for kind, _, _ in tried})
    for name in names:
        mine = [(event, problem) for kind, event, problem in tried if kind == name]
        good = tuple(event for event, problem in mine if not problem)
        reasons = tuple(f"samples {event.first}-{event.last}: {problem}" for event, problem in mine if problem)
        remedies = tuple("mend it in the file or in the draft: each reason says how" for _ in reasons[:1])
        if not mine:
            reasons = (f"the channels are there, but what was recorded is a {' and a '.join(kinds)}",)
            remedies = (OTHERWISE[name],)
        speed = ", the speed" if name == STEP and given.speed_missing else ""
        says = f"tyre, load, pressure, surface{speed} and axes, which no recording says"
        uses.append(Use(name, good, reasons, remedies, "", says if good else "", windows=windows and bool(good)))
    return uses
