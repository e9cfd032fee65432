"""A look at one recording: channels, uses and drafts."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.look.motion_uses import Motion, motion_uses
from studies.look.oddities import oddities
from studies.look.opened import Opened, open_recording, rate
from studies.look.rig_uses import Supposed, rig_uses
from studies.look.roles import QUANTITIES, Roles, roles
from studies.look.use import USES, Use
from tyre.channels.channel_map import ChannelMap


@dataclass(frozen=True, eq=False)
class Look:
    """What is in one recording and what can be done with it.

    Attributes
    ----------
    opened : Opened
    roles : Roles
    uses : tuple of Use
        In the order of :data:`USES`.
    rig : list of Supposed
        Of the drafts of a sidecar.
    motion : Motion, optional
        Of the drafts for a bicycle's recording.
    """

    opened: Opened
    roles: Roles
    uses: tuple[Use, ...]
    rig: list[Supposed]
    motion: Motion | None

    @property
    def channels(self) -> dict[str, str]:
        """Column -> the channels that it is taken as."""
        found: dict[str, str] = {}
        names = self.roles.names([*QUANTITIES])
        for name, column in names.items():
            whole = self.opened.signals.find(column)
            found[whole] = f"{found[whole]}, {name}" if whole in found else name
        if self.opened.clock is not None:
            found[self.opened.clock.column.name] = "time"
        return found

    def as_json(self) -> dict[str, Any]:
        """All of it, ready for JSON."""
        taken, channels = self.channels, []
        for column in self.opened.signals.columns:
            seen = self.opened.quality[column.name]
            channels.append(
                {"name": column.name, "unit": column.unit, "taken_as": taken.get(column.name, "")}
                | {key: _plain(value) for key, value in asdict(seen).items()}
                | {"rate_hz": _plain(rate(self.opened.time_of(column.name))) if self.is_timed(column.name) else None}
                | {"remarks": [*seen.remarks, *oddities(self.roles, column.name)]}
            )
        return {
            "file": str(self.opened.path), "notes": list(self.opened.signals.notes),
            "channels_from": self.roles.origin, "time": list(self.opened.clock_notes), "channels": channels,
            "not_read": self.opened.unread, "uses": [asdict(use) | {"usable": use.usable} for use in self.uses],
        }  # fmt: skip

    def is_timed(self, name: str) -> bool:
        """Whether the times of the channel ``name`` are known."""
        return self.opened.signals.signals[name].time is not None or self.opened.time is not None


def look(path: Path, channel_map: ChannelMap | None = None, dbc: Sequence[Path] = ()) -> Look:
    """Look at a recording.

    Parameters
    ----------
    path : Path
    channel_map : ChannelMap, optional
        Which column is which channel; without, that of the sidecar, else guesses.
    dbc : sequence of Path
        Databases that decode CAN frames.

    Raises
    ------
    InputError
        A file that cannot be read, a map that does not fit it, or a sidecar that cannot be read.
    """
    opened = open_recording(path, channel_map, dbc)
    found = roles(opened, channel_map)
    if found.given is None and found.map is not None:
        opened = open_recording(path, found.map, dbc)
        found = roles(opened, channel_map)
    rig, supposed = rig_uses(found)
    moved, motion = motion_uses(found)
    uses = sorted((*rig, *moved), key=lambda use: USES.index(use.name))
    return Look(opened, found, tuple(uses), supposed, motion)


def _plain(value: float) -> float | None:
    return None if isinstance(value, float) and not np.isfinite(value) else value
