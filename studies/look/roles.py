"""Which column is which channel: by the map given, by the sidecar, or guessed from names and units."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bicycle.identification.recording import QUANTITIES as OF_MOTION
from studies.look.opened import Opened, rate
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.clock import GAP
from tyre.channels.draft import UNKNOWN, Guess, guesses
from tyre.channels.signals import Column, listed
from tyre.channels.units import SI, quantity_of
from tyre.recordings.mapped import QUANTITIES as OF_RIG
from tyre.recordings.mapped import sidecar_of
from tyre.recordings.sidecar import Sidecar

ROLLING = ("slip_angle", "side_force", "vertical_load")
PULL = ("side_force", "plate_displacement")
MOTION = ("roll_rate", "lean", "steer", "steer_rate", "yaw_rate", "lateral_acceleration")
TORQUES = ("steer_torque", "lean_torque")
SPARSE = 0.2
"""Share of missing samples from which a channel was recorded at a lower rate than the table has rows."""

QUANTITIES = {**OF_RIG, **OF_MOTION}


@dataclass(frozen=True, eq=False)
class Roles:
    """Channels of one file.

    Attributes
    ----------
    opened : Opened
    given : ChannelMap, optional
        Of the command line.
    sidecar : Sidecar, optional
        Beside the file.
    guessed : dict of str to Guess
        Channels guessed, where no map is given; their units may be unknown.
    """

    opened: Opened
    given: ChannelMap | None
    sidecar: Sidecar | None
    guessed: Mapping[str, Guess]

    @property
    def origin(self) -> str:
        """Where the channels come from, in words."""
        if self.given is not None:
            return f"by {self.given.source}"
        if self.sidecar is not None and self.sidecar.channel_map is not None:
            return f"by the sidecar {self.opened.path.with_suffix('.toml').name}"
        if self.sidecar is not None:
            return (
                f"of a rig by the names of the columns, with the sidecar {self.opened.path.with_suffix('.toml').name}"
            )
        return "guessed from names and units"

    @property
    def map(self) -> ChannelMap | None:
        """The map that is given, by the command line or by the sidecar."""
        own = self.sidecar.channel_map if self.sidecar else None
        return own if own is not None and own.channels else self.given

    def names(self, wanted: Sequence[str]) -> dict[str, str]:
        """Channel -> column, of the channels ``wanted`` that there are."""
        if self.map is not None:
            return {name: entry.column for name, entry in self.map.channels.items() if name in wanted}
        return {name: self.guessed[name].column.name for name in wanted if name in self.guessed}

    def unknown_units(self, wanted: Sequence[str]) -> dict[str, str]:
        """Channel -> column, of those ``wanted`` whose unit only the user knows."""
        if self.map is not None:
            return {}
        found = {**self.guessed, **({"time": self.opened.clock} if self.opened.clock else {})}
        return {name: found[name].column.name for name in wanted if name in found and found[name].unit == UNKNOWN}

    def lines(self, wanted: Sequence[str]) -> list[str]:
        """Lines of a channel map for the channels ``wanted``, with the time; where no map is given."""
        clock = self.opened.clock
        time = [clock.line("time")] if clock is not None else []
        return [*time, *(self.guessed[name].line(name) for name in wanted if name in self.guessed)]

    def map_of(self, wanted: Sequence[str]) -> ChannelMap:
        """The map given, else that of the guesses for the channels ``wanted`` whose units are known."""
        if self.map is not None:
            return self.map
        unsure = self.unknown_units([*wanted, "time"])
        lines = [line for line in self.lines(wanted) if line.partition(" ")[0] not in unsure]
        content = tomllib.loads("\n".join(["[channels]", *lines, *self.resampling(wanted)]))
        made = ChannelMap.from_table(content, self.opened.path.parent, where=str(self.opened.path))
        return replace(made, reading=self.opened.reading)

    def resampling(self, wanted: Sequence[str]) -> list[str]:
        """Lines of a map that bring the channels ``wanted`` to one rate, where the file holds several."""
        unsure = self.unknown_units(wanted)
        columns = [column for name, column in self.names(wanted).items() if name not in unsure]
        times = [self.opened.time_of(column) for column in columns]
        rates = []
        for column, time in zip(columns, times, strict=True):
            seen = self.opened.quality[column]
            regular = seen.missing > SPARSE * seen.samples and seen.longest_missing < GAP
            rates.append(rate(time) * (1 - seen.missing / seen.samples if regular else 1.0))
        sparse = any(own < 0.99 * rate(time) for own, time in zip(rates, times, strict=True))
        same = all(time.size == times[0].size and np.array_equal(time, times[0]) for time in times)
        if not times or (same and not sparse) or not min(rates) > 0:
            return []
        return ["", "[resampling]", f"rate_hz = {min(rates):.6g}  # CHECK: the lowest rate of these channels"]

    def lacking(self, *names: str) -> str:
        """What to do about the channels ``names`` that no column could be."""
        entries, which = [], []
        for name in names:
            quantity = QUANTITIES.get(name, "time")
            more = " or time = {rate_hz = ...}" if name == "time" else ""
            entries.append(f'{name} = {{column = "...", unit = "{SI[quantity]}"}}{more}')
            fitting = self._free(quantity)
            which.append(f"in a unit of {quantity}: {listed(fitting, most=4)}" if fitting else "")
        none = dict.fromkeys(QUANTITIES.get(name, "time") for name, said in zip(names, which, strict=True) if not said)
        which = [*dict.fromkeys(said for said in which if said)]
        which += [f"no free column has a unit of {' or '.join(none)}"] if none else []
        silent = self._free("")
        which += [f"without a known unit: {listed(silent, most=4)}"] if none and silent else []
        return f"map {', '.join(entries)} ({'; '.join(which)})"

    def _free(self, quantity: str) -> list[str]:
        """Columns that are no channel yet and measure a ``quantity`` (empty: in no unit that is known)."""
        taken = set(self.names([*QUANTITIES]).values())
        taken |= {self.opened.clock.column.name} if self.opened.clock else set()
        return [
            column.name for column in self.opened.signals.columns
            if column.name not in taken and quantity_of(column.unit) == quantity
            and not self.opened.quality[column.name].dead
        ]  # fmt: skip


def roles(opened: Opened, given: ChannelMap | None) -> Roles:
    """Find the channels of an opened file; ``given`` is the map of the command line.

    Raises
    ------
    InputError
        A sidecar that cannot be read.
    """
    sidecar = _sidecar(opened.path)
    columns = [c for c in opened.signals.columns if opened.clock is None or c.name != opened.clock.column.name]
    live = [c for c in columns if opened.quality[c.name].samples > opened.quality[c.name].missing]
    found = {**guesses(live, OF_RIG), **guesses(live, OF_MOTION)}
    for needed in (ROLLING, ("side_force", "plate_displacement")):
        if "side_force" in found or any(name in found for name in needed):
            found |= _by_unit(live, found, needed)
    found |= _by_unit(live, found, ("speed", "temperature"))
    if "side_force" not in found:
        found |= _by_unit(live, found, PULL, both=True)
    return Roles(opened, given, sidecar, found)


def _sidecar(path: Path) -> Sidecar | None:
    beside = path.with_suffix(".toml")
    if not beside.is_file():
        return None
    text = beside.read_text(encoding="utf-8", errors="replace")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{beside}: the sidecar is no TOML ({error}); mend or remove it") from error
    return sidecar_of(path) if "axes" in content or "tyre" in content else None


def _by_unit(
    columns: Sequence[Column], found: Mapping[str, Guess], needed: Sequence[str], *, both: bool = False
) -> dict[str, Guess]:
    """Channels needed whose quantity a single free column measures; with ``both``, all of them or none."""
    more: dict[str, Guess] = {}
    for name in needed:
        if name in found:
            continue
        taken = {guess.column.name for guess in (*found.values(), *more.values())}
        fitting = [c for c in columns if c.name not in taken and quantity_of(c.unit) == OF_RIG[name]]
        if len(fitting) == 1:
            more[name] = Guess(fitting[0], "", f"the only column in a unit of {OF_RIG[name]}, its name says little")
    return {} if both and len(more) < len([name for name in needed if name not in found]) else more
