"""Say of several recordings what is alike once, and of each in a line what it can be used for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from studies.look.opened import oddities
from studies.look.overview import Look
from studies.reporting.markdown_text import render_file
from tyre.formats import FORMATS
from tyre.formats.signals import join_names
from tyre.recordings.clock import usual_rate

MOST_REMARKS, MOST_COMMANDS, MOST_FILES = 3, 6, 40  # of a group of recordings alike


@dataclass(frozen=True)
class Group:
    """Recordings with the same channels, taken as the same, and the same uses."""

    looks: tuple[Look, ...]  # one a recording
    channel_lines: tuple[str, ...]  # channel = column [unit]
    unused_columns: tuple[str, ...]  # columns that are no channel
    files: tuple[str, ...]  # a line each: name, samples, what it can be used for
    unusable: Mapping[str, Sequence[str]]  # why -> uses
    remarks: tuple[str, ...]  # a line each, on any of the recordings
    commands: tuple[str, ...]  # next commands, without repetition


def recordings_of(paths: Sequence[Path]) -> list[Path]:
    """List the files among ``paths``; of a folder those that lie in it and end like a recording."""
    files: list[Path] = []
    for path in paths:
        candidates = [file for file in sorted(path.iterdir()) if file.is_file()] if path.is_dir() else [path]
        files += [file for file in candidates if not path.is_dir() or file.suffix.casefold() in FORMATS]
    return list(dict.fromkeys(files))


def print_looks(looks: Sequence[Look], steps: Sequence[Mapping[str, str]], written: Sequence[str]) -> None:
    """Print what several recordings hold, with the next commands (``steps`` of each) and the files ``written``."""
    alike: dict[Any, list[int]] = {}
    for place, look in enumerate(looks):
        columns = tuple((c.name, c.unit, look.channels.get(c.name, "")) for c in look.opened.signals.columns)
        alike.setdefault((columns, tuple((use.name, use.usable) for use in look.uses)), []).append(place)
    groups = [_group([looks[k] for k in places], [steps[k] for k in places]) for places in alike.values()]
    content = {
        "groups": groups,
        "count": len(looks),
        "written": written,
        "most_files": MOST_FILES,
        "most_remarks": MOST_REMARKS,
        "most_commands": MOST_COMMANDS,
    }
    filters = {"listed": lambda names: join_names(list(names), most=8)}
    click.echo(render_file("studies.look", "several.txt.j2", content, escaped=False, filters=filters), nl=False)


def _group(looks: Sequence[Look], steps: Sequence[Mapping[str, str]]) -> Group:
    first = looks[0]
    channels = first.channels
    columns = first.opened.signals.columns
    unusable: dict[str, list[str]] = {}
    for use in first.uses:
        if not use.usable:
            unusable.setdefault(use.reasons[0] if use.reasons else "", []).append(use.name)
    losses, further_remarks = list[str](), list[str]()  # what is lost comes first
    for look in looks:
        losses += [f"{look.opened.path.name}: {note}" for note in look.opened.clock_notes]
        for column in look.opened.signals.columns:
            where, samples = f"{look.opened.path.name}, {column.name}", look.opened.quality[column.name]
            losses += [f"{where}: {remark}" for remark in samples.losses]
            odd = [remark for remark in samples.remarks if remark not in samples.losses]
            further_remarks += [f"{where}: {remark}" for remark in (*odd, *oddities(look.roles, column.name))]
    channel_lines = []
    for column in columns:
        if column.name in channels:
            unit = f" [{column.unit}]" if column.unit else ""
            channel_lines.append(f"{channels[column.name]} = {column.name}{unit}")
    return Group(
        looks=tuple(looks),
        channel_lines=tuple(channel_lines),
        unused_columns=tuple(column.name for column in columns if column.name not in channels),
        files=tuple(_line(look) for look in looks),
        unusable=unusable,
        remarks=(*losses, *further_remarks),
        commands=tuple(dict.fromkeys(step for of_file in steps for step in of_file.values())),
    )


def _line(look: Look) -> str:
    """Name, samples with their rate, and uses of one recording."""
    signals = look.opened.signals.signals
    size = max(signal.values.size for signal in signals.values())
    longest = next(name for name, signal in signals.items() if signal.values.size == size)
    time = look.opened.time_of(longest) if look.is_timed(longest) else np.zeros(0)
    rate = f" at {usual_rate(time):.4g} Hz" if time.size > 1 and np.isfinite(usual_rate(time)) else ""
    uses = []
    for use in look.uses:
        if use.usable:
            count = len(use.events)
            note = "1 event" if count == 1 else f"{count} events"
            if count == 1 and use.events[0].notes:
                note = use.events[0].notes[0]
            condition = f"; specify {use.provided}" if use.provided else ""
            uses.append(f"{use.name}: {note}{condition}")
    uses_text = "; ".join(uses) or "can be used for nothing as it is"
    return f"{look.opened.path.name}, {size} samples{rate}: {uses_text}"
