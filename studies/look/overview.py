"""Look at one recording: channels, uses, lines for the terminal, and a picture."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from studies.look.opened import QUANTITIES, Opened, Roles, oddities, open_recording, roles
from studies.reporting.markdown_text import render_file
from tyre.formats.channel_map import ChannelMap
from tyre.recordings.clock import usual_rate

if TYPE_CHECKING:
    from studies.look.motion_uses import Motion
    from studies.look.rig_uses import Supposed, Use


@dataclass(frozen=True, eq=False)
class Look:
    """Content of one recording and its uses."""

    opened: Opened  # the file
    roles: Roles  # channels that its columns are taken as
    uses: "tuple[Use, ...]"  # in the order of :data:`USES`
    rig: "list[Supposed]"  # of the drafts of a sidecar
    motion: "Motion | None"  # of the drafts for a bicycle's recording

    @property
    def channels(self) -> dict[str, str]:
        """Column -> the channels that it is taken as."""
        channels: dict[str, str] = {}
        names = self.roles.names([*QUANTITIES])
        for name, column in names.items():
            whole = self.opened.signals.find(column)
            channels[whole] = f"{channels[whole]}, {name}" if whole in channels else name
        if self.opened.clock is not None and self.opened.clock.column.name:
            channels[self.opened.clock.column.name] = "time"
        return channels

    def as_json(self) -> dict[str, Any]:
        """All of it, ready for JSON."""
        channel_of, channels = self.channels, []
        for column in self.opened.signals.columns:
            samples = self.opened.quality[column.name]
            hertz = usual_rate(self.opened.time_of(column.name)) if self.is_timed(column.name) else None
            numbers = {key: _null_if_infinite(value) for key, value in (asdict(samples) | {"rate_hz": hertz}).items()}
            remarks = [*samples.remarks, *oddities(self.roles, column.name)]
            named = {"name": column.name, "unit": column.unit, "taken_as": channel_of.get(column.name, "")}
            channels.append(named | numbers | {"remarks": remarks})
        return {
            "file": str(self.opened.path),
            "notes": list(self.opened.signals.notes),
            "channels_from": self.roles.origin,
            "time": list(self.opened.clock_notes),
            "channels": channels,
            "not_read": self.opened.unread,
            "uses": [asdict(use) | {"usable": use.usable} for use in self.uses],
        }

    def is_timed(self, name: str) -> bool:
        """True if the times of the channel ``name`` are known."""
        return self.opened.signals.signals[name].time is not None or self.opened.time is not None


def _null_if_infinite(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value


def look(path: Path, channel_map: ChannelMap | None = None, dbc: Sequence[Path] = ()) -> Look:
    """Look at a recording."""
    opened = open_recording(path, channel_map, dbc)
    from studies.look.motion_uses import motion_uses  # after the file was opened: what is refused is refused at once
    from studies.look.rig_uses import place_of, rig_uses

    channel_roles = roles(opened, channel_map)
    if channel_roles.command_map is None and channel_roles.map is not None:
        opened = open_recording(path, channel_roles.map, dbc)
        channel_roles = roles(opened, channel_map)
    rig, supposed = rig_uses(channel_roles)
    bicycle, motion = motion_uses(channel_roles)
    uses = sorted((*rig, *bicycle), key=place_of)
    return Look(opened, channel_roles, tuple(uses), supposed, motion)


WIDTH, MOST_EVENTS = 34, 8  # letters of a channel's name, events of a use that are told
HEADS = ("channel", "unit", "samples", "lowest", "median", "highest", "step", "noise", "taken as")


def print_look(look: Look, steps: Mapping[str, str]) -> None:
    """Print a ``look`` at one recording, with the next command of each use (``steps``)."""
    from tabulate import tabulate

    opened = look.opened
    kinds: Counter[tuple[int, float, float]] = Counter()
    for column in opened.signals.columns:
        size = opened.signals.signals[column.name].values.size
        time = opened.time_of(column.name) if look.is_timed(column.name) else np.zeros(0)
        hz = usual_rate(time) if time.size > 1 else np.nan
        kinds[(size, hz, float(np.nanmax(time) - np.nanmin(time))) if np.isfinite(hz) else (size, 0.0, 0.0)] += 1
    remarks = [
        (column.name, remark)
        for column in opened.signals.columns
        for remark in (*opened.quality[column.name].remarks, *oddities(look.roles, column.name))
    ]
    lines: list[tuple[str, Use]] = []
    for use in look.uses:  # uses of which the same is to be said stand together
        place = next((k for k, (_, listed) in enumerate(lines) if replace(listed, name=use.name) == use), None)
        if place is None or use.usable:
            lines.append((use.name, use))
        else:
            lines[place] = (f"{lines[place][0]}, {use.name}", lines[place][1])
    content = {
        "opened": opened,
        "kinds": kinds.most_common(),
        "remarks": remarks,
        "uses": lines,
        "table": tabulate(list(_rows(look)), headers=HEADS, missingval="-", disable_numparse=True),
        "steps": steps,
        "origin": look.roles.origin,
        "most": MOST_EVENTS,
    }
    click.echo(render_file("studies.look", "look.txt.j2", content, escaped=False), nl=False)


def _rows(look: Look) -> Iterator[Sequence[object]]:
    channel_of = look.channels
    for column in look.opened.signals.columns:
        samples = look.opened.quality[column.name]
        name = column.name if len(column.name) <= WIDTH else f"...{column.name[3 - WIDTH :]}"
        noise = f"< {samples.step:.2g}" if samples.step and samples.noise < samples.step / 2 else f"{samples.noise:.2g}"
        silent = samples.noise < 1e-7 * (samples.highest - samples.lowest) and not samples.step
        untold = silent or samples.dead or channel_of.get(column.name) == "time"
        numbers = [f"{x:.5g}" if np.isfinite(x) else "-" for x in (samples.lowest, samples.median, samples.highest)]
        missing = f" ({samples.missing} missing)" if samples.missing else ""
        yield (
            name,
            column.unit or "-",
            f"{samples.samples}{missing}",
            *numbers,
            f"{samples.step:.2g}" if samples.step else "-",
            "-" if untold else noise,
            channel_of.get(column.name, ""),
        )


MOST = 60
LABEL = 40
COLOURS = {
    "slip sweep": "#5f9ed1",
    "step (relaxation)": "#3b7d4f",
    "lateral stiffness test": "#5f9ed1",
    "free decay (modal)": "#e5a823",
    "replay (histories)": "#8f6bb0",
}


def draw(look: Look, target: Path) -> Path:
    """Draw the channels of a ``look`` into ``target`` .png and .svg."""
    from matplotlib.patches import Patch

    from studies.reporting.plotting import drawing

    names = [column.name for column in look.opened.signals.columns]
    clock = look.opened.clock
    names = [name for name in names if clock is None or name != clock.column.name or len(names) == 1]
    left_out, names = names[MOST:], names[:MOST]
    columns = 1 if len(names) <= 8 else 2 if len(names) <= 20 else 3
    rows = -(-len(names) // columns)
    marked = [  # only uses that take less than the whole recording
        (use.name, event.start_s, event.end_s, event.name)
        for use in look.uses
        for event in use.events
        if use.name in COLOURS and event.end_s > event.start_s and (use.windows or event.name)
    ]
    width, height = (9.0, 13.0, 16.0)[columns - 1], 1.2 + rows * (1.5 if rows <= 8 else 1.15)
    with drawing(target, width=width, height=height) as figure:
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True).T.ravel()
        channel_of, timed = look.channels, any(look.is_timed(name) for name in names)
        for panel, name in zip(panels, names, strict=False):
            _panel(panel, look, name, channel_of.get(name, ""))
            for use, start, end, _ in marked:
                panel.axvspan(start, end, color=COLOURS[use], alpha=0.18, linewidth=0)
        for _, start, _, event in marked:
            panels[0].annotate(
                event,
                (start, 1),
                xycoords=("data", "axes fraction"),
                xytext=(2, -2),
                fontsize=7,
                va="top",
                textcoords="offset points",
            )
        for empty in panels[len(names) :]:
            empty.set_axis_off()
        for lowest in {min(last, len(names)) - 1 for last in range(rows, rows * columns + 1, rows)}:
            panels[lowest].set_xlabel("time in s" if timed else "sample")
            panels[lowest].tick_params(labelbottom=True)
        more = f"; {len(left_out)} more channels are not drawn" if left_out else ""
        figure.suptitle(f"{look.opened.path.name}{more}", x=0.01, ha="left", fontweight="bold")
        uses = dict.fromkeys(use for use, *_ in marked)
        patches = [Patch(color=COLOURS[use], alpha=0.35, label=f"usable: {use}") for use in uses]
        if patches:
            figure.legend(handles=patches, loc="outside lower left", ncols=len(patches))
    return target.with_name(f"{target.name}.png")


def _panel(axes: Any, look: Look, name: str, channel: str) -> None:
    from studies.reporting.plotting import GREY

    signal = look.opened.signals.signals[name]
    time = look.opened.time_of(name)
    values = np.where(np.isinf(signal.values), np.nan, signal.values)
    if abs(time[0]) > 1e6:
        time = time - time[0]
    dead = look.opened.quality[name].dead
    many = values.size > 5000  # so many points make a picture smaller than lines
    axes.plot(time, values, color=GREY if dead else "#123a6b", linewidth=0.9, rasterized=many)
    missing = np.concatenate([[0], ~np.isfinite(values), [0]]).astype(np.int8)
    edges = np.flatnonzero(np.diff(missing)).tolist()
    for first, last in zip(edges[::2][:200], edges[1::2][:200], strict=True):
        axes.axvspan(time[first], time[min(last, time.size - 1)], color="#c8462f", alpha=0.25, linewidth=0)
    label = name if len(name) <= LABEL else f"...{name[3 - LABEL :]}"
    words = f"{label} in {signal.unit}" if signal.unit.strip("-[] ") else label
    words += f"  =  {channel}" if channel else ""
    words += "  (constant)" if dead and np.isfinite(values).any() else "  (no valid sample)" if dead else ""
    axes.set_title(words.replace("$", r"\$"), fontsize=8.5, fontweight="bold" if channel else "normal")
    axes.tick_params(labelsize=7.5)
    axes.locator_params(axis="y", nbins=4)
