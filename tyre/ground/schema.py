"""Tables of files, declared: the keys, a check of each value, and the words in which anything else is refused.

A check gives the value back or raises what :func:`refused` or :func:`remarked` makes; :func:`read` names the place.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tyre.ground.errors import InputError, is_number, shown, unknown

Check = Callable[[Any], Any]
MOST = 2**63 - 1  # what an integer of numpy holds


class Refusal(Exception):
    """A refused value: the words behind its key, the path to it, and its rank among the refusals of a file."""

    def __init__(self, says: str, kind: str = "value", order: int = 0) -> None:
        super().__init__(says)
        self.says, self.kind, self.order = says, kind, order
        self.path: list[Any] = []

    @property
    def rank(self) -> tuple[int, int]:
        """Unknown keys before all, the outermost first; missing keys last, in the order of the declaration."""
        if self.kind == "unknown":
            return 0, len(self.path)
        if self.kind == "missing":
            return 2, self.order
        return 1, 0


def refusal(value: object, says: str) -> Exception:
    """Make the error of a ``value`` that must be something else: ``must be a time >= 0 in s``."""
    space = "" if says.startswith(";") else " "
    return Refusal(f"= {shown(value)}{space}{says}")


remarked = Refusal  # its words stand behind the key without the value: ``holds a value twice``, ``: give one of two``


def table_refusal(says: str, *path: int) -> Refusal:
    """Make the error of a table whose keys do not go together; ``path`` leads to it from the value that is checked."""
    error = Refusal(says, "table")
    error.path += path
    return error


def number(
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
    says: str = "",
    outside: str = "",
    endless: bool = False,
) -> Check:
    """Check a number within bounds (``above`` excluded); ``outside`` is the message for others; gives a float."""
    ends = []
    if above > -math.inf:
        ends.append(f"above {above:g}")
    if least > -math.inf:
        ends.append(f"from {least:g}")
    if most < math.inf:
        ends.append(f"up to {most:g}")
    if not says:
        # what is beyond the ends is refused in words of its own: only the kind of value is asked for here
        says = "must be a finite number" if outside else " ".join(["must be a finite number", *ends])

    def check(value: Any) -> float:
        if not is_number(value):
            raise refusal(value, says)
        within_bounds = above < value and least <= value <= most
        if not within_bounds or (math.isinf(value) and not endless):
            raise Refusal(f"= {shown(value).removesuffix('.0')} {outside or says}")
        return float(value)

    return check


def whole_number(*, least: int, most: int = MOST) -> Check:
    """Check a whole number from ``least`` to ``most``."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise refusal(value, f"must be a whole number from {least} to {most}")
        return value

    return check


def flag(value: Any) -> bool:
    """Check that ``value`` is true or false."""
    if not isinstance(value, bool):
        raise refusal(value, "must be true or false")
    return value


def text(says: str = "must be text in quotes", *, allowed: Collection[str] | None = None, blank: bool = True) -> Check:
    """Check a text, perhaps one of those ``allowed``; without ``blank`` it must hold more than blanks."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or (allowed is not None and value not in allowed):
            raise refusal(value, says)
        if not blank and not value.strip():
            raise Refusal("is empty")
        if "\0" in value:  # which no path may hold, and no name
            raise Refusal("holds a NUL character; delete it")
        return value

    return check


def name_in(kind: str, allowed: Collection[str]) -> Check:
    """Check a name among ``allowed``; another one is refused with the nearest, as an unknown ``kind``."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in allowed:
            raise Refusal(unknown(kind, value, allowed), "unknown")
        return value

    return check


def list_of(check: Check, says: str, *, least: int = 0, most: int = MOST, strict: bool = True) -> Check:
    """Check a list of ``least`` to ``most`` entries; if ``strict``, a bad entry is refused in the words of the list."""

    def every(value: Any) -> list[Any]:
        if not isinstance(value, list) or not least <= len(value) <= most:
            raise refusal(value, says)
        entries = []
        for place, entry in enumerate(value):
            try:
                entries.append(check(entry))
            except Refusal as error:
                if strict:
                    raise refusal(value, says) from None
                error.path.insert(0, place)
                raise
        return entries

    return every


def anything(value: Any) -> Any:
    """Let any ``value`` pass: it is checked elsewhere."""
    return value


BELOW = ": write [{}] and the keys below it"


def any_table(value: Any) -> Mapping[str, Any]:
    """Check that ``value`` is a table; its keys are checked elsewhere."""
    if not isinstance(value, Mapping):
        raise Refusal(shown(value), "no table")
    return value


@dataclass(frozen=True, eq=False)
class Key:
    """A key of a table: its name, the words about a table without it (if needed), and its default."""

    name: str  # of the key in the file
    missing: str = ""  # refusal of a table without the key; empty: it may be left out
    default: Any = None  # of a key that is left out; None: none


def needed(key: str, says: str = "") -> Key:
    """Declare a key that must be there; ``says`` is the message for a table without it."""
    return Key(key, says or f"{key} is missing")


def maybe(key: str, default: Any = None) -> Key:
    """Declare a key that may be left out; without a default the table read has no such key."""
    return Key(key, default=default)


@dataclass(frozen=True, eq=False)
class Table:
    """A declared table: called with a mapping, it gives the checked values."""

    declared: Mapping[Key, Check]  # key -> check of its value
    # checks of the name and of the value of every other key; None: others are passed over
    wildcard: tuple[Check, Check] | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of the declared keys."""
        return tuple(key.name for key in self.declared)

    def __call__(self, value: Any) -> dict[str, Any]:
        """Check every value of a table; the gravest refusal is raised."""
        content = dict(any_table(value))
        checks = {key.name: check for key, check in self.declared.items()}
        for key in self.declared:
            if not key.missing and key.default is not None:
                content.setdefault(key.name, key.default)
        checked: dict[str, Any] = {}
        refusals: list[Refusal] = []
        for name, entry in content.items():
            try:
                if name in checks:
                    checked[name] = checks[name](entry)
                elif self.wildcard is not None:
                    checked[self.wildcard[0](name)] = self.wildcard[1](entry)
            except Refusal as error:
                error.path.insert(0, name)
                refusals.append(error)
        for place, key in enumerate(self.declared):
            if key.missing and key.name not in content:
                refusals.append(Refusal(key.missing, "missing", place))
                refusals[-1].path.append(key.name)
        if refusals:
            raise min(refusals, key=lambda error: error.rank)
        return checked


def table(keys: Mapping[Key, Check], *, kind: str = "key", others: bool = False) -> Table:
    """Declare a table; an unknown ``kind`` of key is refused, or passed over with ``others``."""
    return Table(keys, None if others else (name_in(kind, [key.name for key in keys]), anything))


def by_name(check: Check, allowed: Collection[str], *, kind: str) -> Table:
    """Declare a table in which any of the ``allowed`` names may stand, with values of one sort."""
    return Table({}, (name_in(kind, allowed), check))


tables_by_name = Table({}, (anything, any_table))
"""A table of tables whose names and keys are checked elsewhere."""


def path_key(key: str, example: str) -> dict[Key, Check]:
    """Declare a key that names another file, to be merged with those of :func:`table`."""
    how = f'write {key} = "{example}"'
    return {needed(key, f"no {key}; {how}"): text(f"must be a path in quotes; {how}")}


def read(declared: Check, content: Any, *, where: str = "", section: str = "", dotted: bool = False) -> Any:
    """Check the content of a file, or of its table ``section`` (``rig.calibration``); messages begin with ``where``."""
    try:
        return declared(content)
    except Refusal as error:
        words = _words(error, section.split(".") if section else [], dotted=dotted)
        raise InputError(f"{where}: {words}" if where else words) from None


def _words(error: Refusal, section: list[str], *, dotted: bool) -> str:
    """Say what is refused and where: ``[rig] mass = -1 must be ...``, or ``rig.mass = -1 must be ...`` if dotted."""
    path = section + [part if isinstance(part, int) else str(part) for part in error.path]
    name = ".".join(part for part in path if isinstance(part, str))
    message = error.says
    names_key = error.kind in ("unknown", "missing", "table")  # the message does so itself
    if error.kind == "no table":
        names_key = not path or isinstance(path[-1], int)
        message = f"{message} must be a table" if names_key else f"= {message} must be a table{BELOW.format(name)}"
    if dotted:
        return _dotted_words(name, message, error.kind, names_key=names_key)
    key = ""
    if path and error.kind != "table" and (error.path or not names_key):
        last = path[-1]
        if isinstance(last, str):
            key = last
            path.pop()
    space = "" if message.startswith(":") else " "
    return _label(path) + (message if names_key else f"{key}{space}{message}".strip())


def _dotted_words(name: str, message: str, kind: str, *, names_key: bool) -> str:
    """Put the dotted ``name`` of a key before a message that lacks it; of a missing key that of its table."""
    if not names_key:
        return f"{name} {message}"
    outer = {"table": name, "missing": name.rpartition(".")[0]}.get(kind, "")
    return f"{outer}: {message}" if outer else message


def _label(path: Sequence[str | int]) -> str:
    """Name the table at ``path`` as its file heads it: ``[rig.sensors]: ``, ``[[windows]] number 2: [trigger]: ``."""
    names: list[str] = []
    label, below = "", 0  # of the innermost list, and how many names lead to it
    for part in path:
        if isinstance(part, str):
            names.append(part)
        else:
            label, below = f"[[{'.'.join(names)}]] number {part + 1}: ", len(names)
    inner = ".".join(names[below:])
    return label + (f"[{inner}]: " if inner else "")
