"""Stretches of a recording: by time, or about the moments at which a channel crosses a level."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.checks import any_table, anything, list_of, number, text
from tyre.base.errors import InputError
from tyre.base.schema import maybe, needed, read, table

TRIGGER = table(
    {
        needed("channel", "channel is missing; name the channel that crosses a level"): text(blank=False),
        maybe("above"): number(),
        maybe("below"): number(),
        needed("unit", "unit is missing; give the unit of the level"): text(blank=False),
        maybe("before_s", 0.0): number(least=0),
        needed("after_s", "after_s is missing; say how long an event lasts after the crossing, in s"): number(above=0),
    }
)
TABLE = table(
    {
        maybe("name"): text(blank=False),
        maybe("from_s"): number(least=0),
        maybe("to_s"): number(above=0),
        maybe("trigger"): any_table,
    }
)
LIST = list_of(anything, "must be tables: write [[windows]] with from_s and to_s, or with a trigger", least=1)


@dataclass(frozen=True)
class Trigger:
    """A level, ``above`` it or below it, in ``unit``, that ``channel`` crosses; ``before`` and ``after`` it in s."""

    channel: str
    level: float
    above: bool
    unit: str
    before: float
    after: float


@dataclass(frozen=True)
class Window:
    """A stretch: from ``first`` to ``last`` s after the first sample, or one about every crossing of a ``trigger``."""

    name: str = ""
    first: float = 0.0
    last: float = math.inf
    trigger: Trigger | None = None


def read_windows(content: Any, *, where: str) -> tuple[Window, ...]:
    """The list of tables ``[[windows]]``.

    Parameters
    ----------
    content : object
        What the file holds.
    where : str
        What a message begins with.

    Raises
    ------
    InputError
        An unknown key, a window that ends before it begins, a trigger beside times, two levels, or a name twice.
    """
    found: list[Window] = []
    for place, entry in enumerate(read(LIST, content, where=where, section="windows"), 1):
        here = f"{where}: [[windows]] number {place}"
        given = read(TABLE, entry, where=here)
        timed = "from_s" in given or "to_s" in given
        if timed == ("trigger" in given):
            raise InputError(f"{here}: give either from_s and to_s, or a trigger")
        name = given.get("name", str(place))
        if name in [window.name for window in found]:
            raise InputError(f"{here}: the name {name!r} is given twice")
        if not timed:
            found.append(Window(name, trigger=_trigger(given["trigger"], here)))
            continue
        first, last = given.get("from_s", 0.0), given.get("to_s", math.inf)
        if last <= first:
            raise InputError(f"{here}: to_s = {last:g} must be later than from_s = {first:g}")
        found.append(Window(name, first, last))
    return tuple(found)


def _trigger(content: Mapping[str, Any], where: str) -> Trigger:
    given = read(TRIGGER, content, where=where, section="trigger")
    if ("above" in given) == ("below" in given):
        raise InputError(f"{where}: a trigger needs one level, above or below")
    above = "above" in given
    level = given["above"] if above else given["below"]
    return Trigger(given["channel"], level, above, given["unit"], given["before_s"], given["after_s"])


def cut(
    windows: tuple[Window, ...], time: Array, levels: Mapping[str, tuple[Array, float]], *, where: str
) -> tuple[dict[str, slice], list[str]]:
    """Samples of every event.

    Parameters
    ----------
    windows : tuple of Window
    time : ndarray, shape (n,)
        s, rising.
    levels : mapping of str to tuple
        For each window with a trigger, by its name: the channel, shape (n,), and the level, both in one SI unit.
    where : str
        What a message begins with.

    Returns
    -------
    events : dict of str to slice
        By name; crossings of one trigger are numbered.
    notes : list of str
        Crossings whose event is not whole.

    Raises
    ------
    InputError
        A window outside the recording, or a level that is never crossed.
    """
    events: dict[str, slice] = {}
    notes = []
    start, length = float(time[0]), float(time[-1] - time[0])
    for window in windows:
        if window.trigger is None:
            if window.first >= length or (math.isfinite(window.last) and window.last > length * (1 + 1e-9) + 1e-9):
                raise InputError(
                    f"{where}: window {window.name!r} from {window.first:g} to {window.last:g} s is not inside the "
                    f"recording, which lasts {length:g} s"
                )
            events[window.name] = _between(time, start + window.first, start + window.last)
            continue
        values, level = levels[window.name]
        spans, left_out = _crossings(window.trigger, time, values, level)
        if not spans:
            low, high = np.nanmin(values), np.nanmax(values)
            more = f"; {left_out} events are cut off by the ends of the recording" if left_out else ""
            raise InputError(
                f"{where}: {window.trigger.channel} gives no event: it ranges from {low:.6g} to {high:.6g} and the "
                f"level is {level:.6g}, in SI units{more}"
            )
        events |= {f"{window.name}.{number}": span for number, span in enumerate(spans, 1)}
        if left_out:
            notes.append(
                f"{left_out} events of window {window.name!r} are cut off by an end of the recording: left out"
            )
    return events, notes


def _crossings(trigger: Trigger, time: Array, values: Array, level: float) -> tuple[list[slice], int]:
    beyond = values > level if trigger.above else values < level
    rising = np.flatnonzero(beyond[1:] & ~beyond[:-1] & np.isfinite(values[:-1])) + 1
    spans, left_out, busy = [], 0, -math.inf
    for sample in rising:
        moment = float(time[sample])
        if moment <= busy:
            continue
        busy = moment + trigger.after
        if moment - trigger.before < time[0] - 1e-9 or busy > time[-1] + 1e-9:
            left_out += 1
        else:
            spans.append(_between(time, moment - trigger.before, busy))
    return spans, left_out


def _between(time: Array, first: float, last: float) -> slice:
    return slice(int(np.searchsorted(time, first - 1e-9)), int(np.searchsorted(time, last + 1e-9, side="right")))
