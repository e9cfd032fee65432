"""Tables of files, declared: which keys there are, what each may hold, and the words in which another is refused.

A table is declared once, by its keys (:func:`needed`, :func:`maybe`) and a check of each value
(:mod:`tyre.base.checks`); :func:`read` gives the values back or says what is wrong with the file, the same way for
every file: the place, the key, the value, what is allowed. Voluptuous walks the tables; all words are ours.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tyre.base.checks import Check, any_table, anything, known, not_known, text
from tyre.base.errors import InputError


@dataclass(frozen=True, eq=False)
class Key:
    """A key of a table: its name, what is said of a table without it, and its value then."""

    name: str
    missing: str = ""
    default: Any = None


def needed(key: str, says: str = "") -> Key:
    """A key that must be there.

    Parameters
    ----------
    key : str
    says : str
        Of a table without it; by default ``KEY is missing``.
    """
    return Key(key, says or f"{key} is missing")


def maybe(key: str, default: Any = None) -> Key:
    """A key that may be left out.

    Parameters
    ----------
    key : str
    default : object
        Its value then, in the unit of the key; None: the table read has no such key.
    """
    return Key(key, default=default)


@dataclass(frozen=True, eq=False)
class Table:
    """A declared table: called with a mapping, it gives the checked values.

    Attributes
    ----------
    declared : mapping of Key to callable
        Its keys and the checks of their values.
    wildcard : tuple of two callables, optional
        Checks of any other key, and of its value.
    others : bool
        Other keys are passed over.
    """

    declared: Mapping[Key, Check]
    wildcard: tuple[Check, Check] | None = None
    others: bool = False

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of its keys."""
        return tuple(key.name for key in self.declared)

    def __call__(self, value: Any) -> dict[str, Any]:
        """Check a table: ``value``, whose units its keys name."""
        return dict(self._schema(dict(any_table(value))))

    @cached_property
    def _schema(self) -> Any:
        from voluptuous import PREVENT_EXTRA, REMOVE_EXTRA, Optional, Required, Schema

        compiled: dict[Any, Check] = {}
        for place, (key, check) in enumerate(self.declared.items()):  # missing ones are told in this order
            if key.missing:
                compiled[Required(key.name, msg=key.missing, description=place)] = check
            elif key.default is None:
                compiled[Optional(key.name)] = check
            else:
                compiled[Optional(key.name, default=key.default)] = check
        if self.wildcard:
            compiled[self.wildcard[0]] = self.wildcard[1]
        return Schema(compiled, extra=REMOVE_EXTRA if self.others else PREVENT_EXTRA)


def table(keys: Mapping[Key, Check], *, kind: str = "key", others: bool = False) -> Table:
    """A table of declared keys.

    Parameters
    ----------
    keys : mapping
        Check of every key, each key made by :func:`needed` or :func:`maybe`.
    kind : str
        What a message calls its keys.
    others : bool
        Other keys may stand beside them, and are passed over.
    """

    def none_else(key: Any) -> Any:
        raise not_known(kind, key, [known.name for known in keys])

    return Table(keys, None if others else (none_else, any_table), others)


def by_name(check: Check, allowed: Collection[str], *, kind: str) -> Table:
    """A table in which any of some names may stand, with values of one sort.

    Parameters
    ----------
    check : callable
        Of every value.
    allowed : collection of str
        Names.
    kind : str
        What a message calls them.
    """
    return Table({}, (known(kind, allowed), check))


tables_by_name = Table({}, (anything, any_table))
"""A table of tables whose names and keys are checked elsewhere."""


def path_key(key: str, example: str) -> dict[Key, Check]:
    """A key that names another file, to be merged with those of :func:`table`.

    Parameters
    ----------
    key : str
    example : str
        A file, for the message.
    """
    how = f'write {key} = "{example}"'
    return {needed(key, f"no {key}; {how}"): text(f"must be a path in quotes; {how}")}


def read(declared: Check, content: Any, *, where: str = "", section: str = "", dotted: bool = False) -> Any:
    """Check the content of a file, or of one of its tables.

    Parameters
    ----------
    declared : callable
        Made by :func:`table`, :func:`by_name`, or the check of one value.
    content : object
        What the file holds.
    where : str
        What a message begins with: file, row.
    section : str
        Name of the table within the file: ``histories``, ``rig.calibration``.
    dotted : bool
        A key is named with its table, ``grid.mB``, instead of ``[grid]: mB``.

    Returns
    -------
    dict or object
        Checked values; keys left out have their default.

    Raises
    ------
    InputError
        An unknown key before all else, then the first value that is not allowed, then a key that is missing.
    """
    from voluptuous import Invalid, MultipleInvalid

    try:
        return declared(content)
    except Invalid as error:
        errors = error.errors if isinstance(error, MultipleInvalid) else [error]
        words = _words(min(errors, key=_rank), section.split(".") if section else [], dotted=dotted)
        raise InputError(f"{where}: {words}" if where else words) from None


def _rank(error: Any) -> tuple[int, int]:
    """Unknown keys first, the outermost before all; missing ones last, as declared."""
    from voluptuous import RequiredFieldInvalid

    from tyre.base.refusals import UnknownKey

    if isinstance(error, UnknownKey):
        return 0, len(error.path)
    missing: Any = error.path[-1] if isinstance(error, RequiredFieldInvalid) else None
    return (1, 0) if missing is None else (2, missing.description)


def _words(error: Any, section: list[str], *, dotted: bool) -> str:
    from voluptuous import RequiredFieldInvalid

    from tyre.base.refusals import NoTable, UnknownKey

    path = section + [part if isinstance(part, int) else str(part) for part in error.path]
    name, message = ".".join(part for part in path if isinstance(part, str)), error.error_message
    alone = isinstance(error, UnknownKey | RequiredFieldInvalid)
    if isinstance(error, NoTable):
        alone = not path or isinstance(path[-1], int)
        way = "" if alone else f": write [{name}] and the keys below it"
        message = f"{'' if alone else '= '}{message} must be a table{way}"
    if dotted and not alone:
        return f"{name} {message}"
    if dotted:
        outer = name.rpartition(".")[0] if isinstance(error, RequiredFieldInvalid) else ""
        return f"{outer}: {message}" if outer else message
    key = path.pop() if path and isinstance(path[-1], str) and (error.path or not alone) else ""
    numbers = [part + 1 for part in path if isinstance(part, int)]
    outer = ".".join(part for part in path if isinstance(part, str))
    label = f"[[{outer}]] number {numbers[-1]}: " if numbers else f"[{outer}]: " if outer else ""
    return label + (message if alone else f"{key} {message}".strip())
