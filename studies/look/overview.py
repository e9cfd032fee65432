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
        found: dict[str, str] = {}
        names = self.roles.names([*QUANTITIES])
        for name, column in names.items():
            whole = self.opened.signals.find(column)
            found[whole] = f"{found[whole]}, {name}" if whole in found else name
        if self.opened.clock is not None and self.opened.clock.column.name:
            found[self.opened.clock.column.name] = "time"
        return found

    def as_json(self) -> dict[str, Any]:
        """All of it, ready for JSON."""
        taken, channels = self.channels, []
        for column in self.opened.signals.columns:
            seen = self.opened.quality[column.name]
            hertz = usual_rate(self.opened.time_of(column.name)) if self.is_timed(column.name) else None
            numbers = {key: _finite(value) for key, value in (asdict(seen) | {"rate_hz": hertz}).items()}
            remarks = [*seen.remarks, *oddities(self.roles, column.name)]
            named = {"name": column.name, "unit": column.unit, "taken_as": taken.get(column.name, "")}
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
        """Tell if the times of the channel ``name`` are known."""
        return self.opened.signals.signals[name].time is not None or self.opened.time is not None


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value


def look(path: Path, channel_map: ChannelMap | None = None, dbc: Sequence[Path] = ()) -> Look:
    """Look at a recording."""
    opened = open_recording(path, channel_map, dbc)
    from studies.look.motion_uses import motion_uses  # after the file was opened: what is refused is refused at once
    from studies.look.rig_uses import place_of, rig_uses

    found = roles(opened, channel_map)
    if found.given is None and found.map is not None:
        opened = open_recording(path, found.map, dbc)
        found = roles(opened, channel_map)
    rig, supposed = rig_uses(found)
    moved, motion = motion_uses(found)
    uses = sorted((*rig, *moved), key=place_of)
    return Look(opened, found, tuple(uses), supposed, motion)


WIDTH, MOST_EVENTS = 34, 8  # letters of a channel's name, events of a use that are told
HEADS = ("channel", "unit", "samples", "lowest", "median", "highest", "step", "noise", "taken as")


def tell(found: Look, steps: Mapping[str, str]) -> None:
    """Print what was ``found``, with the next command of each use (``steps``)."""
    from tabulate import tabulate

    opened = found.opened
    kinds: Counter[tuple[int, float, float]] = Counter()
    for column in opened.signals.columns:
        size = opened.signals.signals[column.name].values.size
        time = opened.time_of(column.name) if found.is_timed(column.name) else np.zeros(0)
        hz = usual_rate(time) if time.size > 1 else np.nan
        kinds[(size, hz, float(np.nanmax(time) - np.nanmin(time))) if np.isfinite(hz) else (size, 0.0, 0.0)] += 1
    remarks = [
        (column.name, remark)
        for column in opened.signals.columns
        for remark in (*opened.quality[column.name].remarks, *oddities(found.roles, column.name))
    ]
    told: list[tuple[str, Use]] = []
    for use in found.uses:  # uses of which the same is to be said stand together
        same = next((k for k, (_, other) in enumerate(told) if replace(other, name=use.name) == use), None)
        if same is None or use.usable:
            told.append((use.name, use))
        else:
            told[same] = (f"{told[same][0]}, {use.name}", told[same][1])
    content = {
        "opened": opened,
        "kinds": kinds.most_common(),
        "remarks": remarks,
        "uses": told,
        "table": tabulate(list(_rows(found)), headers=HEADS, missingval="-", disable_numparse=True),
        "steps": steps,
        "origin": found.roles.origin,
        "most": MOST_EVENTS,
    }
    click.echo(render_file("studies.look", "look.txt.j2", content, escaped=False), nl=False)


def _rows(found: Look) -> Iterator[Sequence[object]]:
    taken = found.channels
    for column in found.opened.signals.columns:
        seen = found.opened.quality[column.name]
        name = column.name if len(column.name) <= WIDTH else f"...{column.name[3 - WIDTH :]}"
        noise = f"< {seen.step:.2g}" if seen.step and seen.noise < seen.step / 2 else f"{seen.noise:.2g}"
        silent = seen.noise < 1e-7 * (seen.highest - seen.lowest) and not seen.step
        untold = silent or seen.dead or taken.get(column.name) == "time"
        numbers = [f"{x:.5g}" if np.isfinite(x) else "-" for x in (seen.lowest, seen.median, seen.highest)]
        missing = f" ({seen.missing} missing)" if seen.missing else ""
        yield (
            name,
            column.unit or "-",
            f"{seen.samples}{missing}",
            *numbers,
            f"{seen.step:.2g}" if seen.step else "-",
            "-" if untold else noise,
            taken.get(column.name, ""),
        )


MOST = 60
LABEL = 40
COLOURS = {
    "slip sweep": "#5f9ed1",
    "step (relaxation)": "#3b7d4f",
    "pull test": "#5f9ed1",
    "free decay (modal)": "#e5a823",
    "replay (histories)": "#8f6bb0",
}


def draw(found: Look, target: Path) -> Path:
    """Draw what was ``found`` into ``target`` .png and .svg."""
    from matplotlib.patches import Patch

    from studies.reporting.plotting import drawing

    names = [column.name for column in found.opened.signals.columns]
    clock = found.opened.clock
    names = [name for name in names if clock is None or name != clock.column.name or len(names) == 1]
    left_out, names = names[MOST:], names[:MOST]
    columns = 1 if len(names) <= 8 else 2 if len(names) <= 20 else 3
    rows = -(-len(names) // columns)
    marked = [  # only uses that take less than the whole recording
        (use.name, event.start_s, event.end_s, event.name)
        for use in found.uses
        for event in use.events
        if use.name in COLOURS and event.end_s > event.start_s and (use.windows or event.name)
    ]
    width, height = (9.0, 13.0, 16.0)[columns - 1], 1.2 + rows * (1.5 if rows <= 8 else 1.15)
    with drawing(target, width=width, height=height) as figure:
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True).T.ravel()
        taken, timed = found.channels, any(found.is_timed(name) for name in names)
        for panel, name in zip(panels, names, strict=False):
            _panel(panel, found, name, taken.get(name, ""))
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
        figure.suptitle(f"{found.opened.path.name}{more}", x=0.01, ha="left", fontweight="bold")
        uses = dict.fromkeys(use for use, *_ in marked)
        patches = [Patch(color=COLOURS[use], alpha=0.35, label=f"usable: {use}") for use in uses]
        if patches:
            figure.legend(handles=patches, loc="outside lower left", ncols=len(patches))
    return target.with_name(f"{target.name}.png")


def _panel(axes: Any, found: Look, name: str, taken: str) -> None:
    from studies.reporting.plotting import GREY

    signal = found.opened.signals.signals[name]
    time, values = found.opened.time_of(name), np.where(np.isinf(signal.values), np.nan, signal.values)
    if abs(time[0]) > 1e6:
        time = time - time[0]
    dead = found.opened.quality[name].dead
    many = values.size > 5000  # so many points make a picture smaller than lines
    axes.plot(time, values, color=GREY if dead else "#123a6b", linewidth=0.9, rasterized=many)
    missing = np.concatenate([[0], ~np.isfinite(values), [0]]).astype(np.int8)
    edges = np.flatnonzero(np.diff(missing)).tolist()
    for first, last in zip(edges[::2][:200], edges[1::2][:200], strict=True):
        axes.axvspan(time[first], time[min(last, time.size - 1)], color="#c8462f", alpha=0.25, linewidth=0)
    label = name if len(name) <= LABEL else f"...{name[3 - LABEL :]}"
    words = f"{label} in {signal.unit}" if signal.unit.strip("-[] ") else label
    words += f"  =  {taken}" if taken else ""
    words += "  (constant)" if dead and np.isfinite(values).any() else "  (no valid sample)" if dead else ""
    axes.set_title(words.replace("$", r"\$"), fontsize=8.5, fontweight="bold" if taken else "normal")
    axes.tick_params(labelsize=7.5)
    axes.locator_params(axis="y", nbins=4)
