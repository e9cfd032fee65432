"""What the page shows of a command's answer: one sentence, figures with their tables, and for a look the channels."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.explorer.recording.panels import Curve, Panel, entry
from studies.explorer.recording.shown_fit import fit_shown
from studies.explorer.recording.sidecar import drafted
from studies.look.figure import spans, thinned
from studies.look.look import Look
from studies.look.roles import QUANTITIES
from tyre.channels.draft import UNKNOWN
from tyre.channels.units import SI

MOST_CHANNELS = 24  # that are drawn

Shown = dict[str, Any]


def shown_of(kind: str, found: Any) -> Shown:
    """What the page shows.

    Parameters
    ----------
    kind : str
        ``look``, ``fit``, ``tyre_fit`` or ``diagnosis``.
    found : object
        What the command returned.
    """
    if kind == "diagnosis":
        from studies.explorer.recording.shown_diagnosis import diagnosis_shown  # imports as long as a look takes

        return diagnosis_shown(found)
    if kind == "tyre_fit":
        from studies.explorer.recording.shown_tyre import tyre_shown

        return tyre_shown(found, Path(kind))
    return _look(found) if kind == "look" else fit_shown(found)


def _look(found: list[Look]) -> Shown:
    (one,) = found
    usable = [use.name for use in one.uses if use.usable]
    count = len(one.opened.signals.columns)
    name = one.opened.path.name
    does = (
        f"can be used for: {', '.join(usable)}"
        if usable
        else "cannot be used for any fit as it is; the reasons are below"
    )
    plain = one.as_json()
    return {
        "sentence": f"{name}: {count} channel{'s' * (count != 1)} of numbers; it {does}.",
        "figures": _channels_figure(one),
        "uses": [
            {"name": use.name, "usable": use.usable, "provided": use.provided,
             "said": [*(event.words for event in use.events), *use.reasons], "remedies": list(use.remedies)}
            for use in one.uses
        ],
        "channels": [row | _mapped(one, row["name"]) for row in plain["channels"]],
        "channels_from": one.roles.origin,
        "times": plain["time"] + plain["notes"],
        "unread": plain["not_read"],
        "drafts": drafted(Path("look")),
        "known": {name: SI[quantity] for name, quantity in {**QUANTITIES, "time": "time"}.items()},
    }  # fmt: skip


def _mapped(found: Look, column: str) -> dict[str, Any]:
    """How the map, given or guessed, takes a column."""
    clock = found.opened.clock
    if clock is not None and clock.column.name == column:
        return {"channel": "time", "map_unit": "" if clock.unit == UNKNOWN else clock.unit, "sign": 1}
    given = found.roles.map
    if given is not None:
        for name, entry_ in given.channels.items():
            if found.opened.signals.find(entry_.column) == column:
                return {"channel": name, "map_unit": entry_.unit, "sign": int(entry_.sign)}
        return {"channel": "", "map_unit": "", "sign": 1}
    for name, guess in found.roles.guessed.items():
        if guess.column.name == column:
            return {"channel": name, "map_unit": "" if guess.unit == UNKNOWN else guess.unit, "sign": 1}
    return {"channel": "", "map_unit": "", "sign": 1}


def _channels_figure(found: Look) -> list[dict[str, Any]]:
    clock, taken, opened = found.opened.clock, found.channels, found.opened
    names = [c.name for c in opened.signals.columns if clock is None or c.name != clock.column.name]
    names = names or [c.name for c in opened.signals.columns]
    marked = spans(found)
    panels = []
    for name in names[:MOST_CHANNELS]:
        signal = opened.signals.signals[name]
        time, values = thinned(opened.time_of(name), np.where(np.isinf(signal.values), np.nan, signal.values))
        role = f" = {taken[name]}" if name in taken else ""
        panels.append(
            Panel(
                f"{name}{role}", "time, s" if found.is_timed(name) else "sample", signal.unit.strip("-[] "),
                [Curve("recorded", 0, time.tolist(), values.tolist())], [(start, end) for _, start, end, _ in marked],
            )
        )  # fmt: skip
    used = ", ".join(dict.fromkeys(use for use, *_ in marked))
    more = f"{len(names) - MOST_CHANNELS} more channels are not drawn. " if len(names) > MOST_CHANNELS else ""
    note = f"{more}{f'Shaded: stretches that a fit would take ({used}).' if marked else ''}".strip()
    return [entry("channels", "Channels", opened.path.name, panels, note=note)]
