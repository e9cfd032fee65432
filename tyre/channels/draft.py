"""A first channel map, guessed from the names and units of columns, ready to be corrected and pasted."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shlex import quote

from tyre.base.errors import InputError
from tyre.channels.read import contents
from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Contents, Signals, listed
from tyre.channels.units import SI, quantity_of

_NAMES = {
    "time": r"^t$|time|zeit|stamp|elapsed",
    "slip_angle": r"slip|alpha|^sa$|schr(ä|ae)glauf",
    "side_force": r"\bfy|side.?force|lat.*force|seitenkraft|querkraft",
    "vertical_load": r"\bfz|load|vert.*force|normal.?force|radlast",
    "aligning_moment": r"\bmz|align|r(ü|ue)ckstell",
    "inclination": r"inclin|camber|gamma|sturz",
    "speed": r"speed|veloc|^v$|geschw",
    "temperature": r"temp",
    "plate_displacement": r"plate|table|platte",
    "rim_displacement": r"rim|felge",
    "roll_rate": r"roll.?(rate|vel|dot)|phi.?dot|(gyro|omega|rate|gyr|w).?x$|lean.?rate|^p$",
    "lean": r"lean(?!.?(rate|torque))|roll(?!.?(rate|vel|acc|torque|dot))|phi$",
    "steer_rate": r"steer.*(rate|vel|speed|dot)|delta.?dot",
    "steer_torque": r"steer.*(torque|moment|trq|tq)|t.?delta$",
    "steer": r"steer(?!.*(rate|vel|torque|moment|speed|dot|trq|tq))|delta$|handlebar|lenk",
    "yaw_rate": r"yaw.?(rate|vel)|(gyro|omega|rate|gyr|w).?z$|psi.?dot|gier|^r$",
    "lateral_acceleration": r"lat.*acc|acc?(el)?.?y$|^ay$",
    "lean_torque": r"(lean|roll).*(torque|moment)",
    "lateral_force": r"\bfy|lat.*force",
}
"""Channel -> what its column is often called."""


UNKNOWN = "?"
"""Unit of a guess that only the user knows."""


@dataclass(frozen=True)
class Guess:
    """A ``column`` that may be a channel, and how far that is sure.

    Attributes
    ----------
    column : Column
    unit : str
        Empty where the file says it, :data:`UNKNOWN` where no one does.
    doubt : str
        Why the user must check it; empty where its name and unit say the same.
    """

    column: Column
    unit: str = ""
    doubt: str = ""

    def line(self, name: str) -> str:
        """Of a channel map, in TOML.

        Parameters
        ----------
        name : str
            The channel.
        """
        said = f", unit = {_quoted(self.unit)}" if self.unit else ""
        note = f"  # the file says {self.column.unit}" if not said and self.column.unit else ""
        if self.unit == UNKNOWN:
            note = "  # FILL IN the unit"
        elif self.doubt:
            note = f"  # CHECK: {self.doubt}"
        return f"{name} = {{column = {_quoted(self.column.name)}{said}}}{note}"


def draft_map(
    given: Signals | Contents | Sequence[Column], quantities: Mapping[str, str], *, clock: bool = True
) -> str:
    """A table ``[channels]`` as text, guessed from names and units.

    Parameters
    ----------
    given : Signals, Contents or sequence of Column
        What the file holds.
    quantities : mapping of str to str
        Channels that are wanted, and what each measures.
    clock : bool
        Whether a line for ``time`` is needed: not where the file gives every channel its own times.

    Returns
    -------
    str
        TOML. ``"?"`` stands where nothing can be guessed, in a comment where no column fits.
    """
    columns = list(given.columns if isinstance(given, Signals | Contents) else given)
    wanted = {**({"time": "time"} if clock else {}), **quantities}
    found = guesses(columns, wanted)
    lines, lacking = [], []
    for name, quantity in wanted.items():
        if name in found:
            lines.append(found[name].line(name))
        else:
            lacking.append(f'# {name} = {{column = "?", unit = "{SI[quantity]}"}}')
    return "\n".join(["[channels]", *lines, *lacking])


def guesses(columns: Sequence[Column], quantities: Mapping[str, str]) -> dict[str, Guess]:
    """Columns that may be the channels wanted, each taken once.

    Parameters
    ----------
    columns : sequence of Column
    quantities : mapping of str to str
        Channels that are wanted, and what each measures.

    Returns
    -------
    dict of str to Guess
        Without the channels for which no column fits.
    """
    taken: dict[str, Guess] = {}
    for name, quantity in quantities.items():
        used = [guess.column.name for guess in taken.values()]
        found = _guess(name, quantity, [column for column in columns if column.name not in used])
        if found is not None:
            said = quantity_of(found.unit) == quantity or found.unit == "datetime"
            taken[name] = Guess(found, "" if said else _unit_of_name(found.name, quantity) or UNKNOWN)
    return taken


def draft_words(path: Path, quantities: Mapping[str, str], *, reading: Reading | None = None) -> str:
    """Columns of a file and a draft of a channel map, to end a message; empty where the file cannot be read at all.

    Parameters
    ----------
    path : Path
    quantities : mapping of str to str
        Channels that are wanted, and what each measures.
    reading : Reading, optional
        How to read the file where it must be told.
    """
    try:
        found = contents(path, reading=reading)
    except InputError:
        return ""
    return _words(found, quantities)


def refuse_unmapped(path: Path, quantities: Mapping[str, str], *, reading: Reading | None = None) -> None:
    """Refuse a file without a channel map, showing its columns and a draft of a map.

    Parameters
    ----------
    path : Path
    quantities : mapping of str to str
        Channels that are wanted, and what each measures.
    reading : Reading, optional
        How to read the file where it must be told.

    Raises
    ------
    InputError
        Always; the draft follows an empty line.
    """
    found = contents(path, reading=reading)
    raise InputError(f"{path}: no channel map says which column is which channel; {_words(found, quantities)}")


@contextmanager
def looking(path: Path) -> Iterator[None]:
    """Add the next step, a look at the recording at ``path``, to an error of reading it.

    Raises
    ------
    InputError
        That of the block, with the next step where there is such a file.
    """
    try:
        yield
    except InputError as error:
        if not path.is_file():
            raise
        there = f"`velotyre look {quote(str(path))}` shows what is in it and what it can be used for"
        raise InputError(f"{error}; {there}") from error


def _words(found: Contents, quantities: Mapping[str, str]) -> str:
    said = [f"{column.name} [{column.unit}]" if column.unit else column.name for column in found.columns]
    return (
        f"the columns are {listed(said)}. A first draft of a map, guessed from names and units; check it, signs above "
        f"all:\n\n{draft_map(found, quantities, clock=not found.own_times)}\n#"  # what others append is a comment
    )


def _guess(name: str, quantity: str, columns: Sequence[Column]) -> Column | None:
    """The column of the right unit, or of none, whose name is like that of the channel; rather one with a unit."""
    pattern = re.compile(_NAMES.get(name, re.escape(name).replace("_", ".?")), re.IGNORECASE)
    fitting: list[tuple[bool, int, Column]] = []
    for column in columns:
        measured = quantity_of(column.unit)
        if measured not in ("", quantity) and not (quantity == "time" and column.unit == "datetime"):
            continue
        plain = re.sub(r"[_\W]*(?:" + "|".join(map(re.escape, _unit_words(column.name))) + r")$", "", column.name)
        if any(pattern.search(part) for part in (column.name, plain, column.spellings[1], re.sub("_", " ", plain))):
            fitting.append((measured != quantity, len(fitting), column))
    return min(fitting)[2] if fitting else None


def _unit_words(name: str) -> list[str]:
    """Ends of a name that are units: ``deg_s``, ``kN``."""
    parts = re.split(r"[_\s]+", name)
    ends = ["_".join(parts[-count:]) for count in (2, 1) if len(parts) > count]
    return [end for end in ends if quantity_of(end)] or ["\0"]


def _unit_of_name(name: str, quantity: str) -> str:
    return next((end for end in _unit_words(name) if quantity_of(end) == quantity), "")


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a string of JSON is one of TOML
