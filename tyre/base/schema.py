"""Tables of files, declared: which keys there are, what each may hold, and the words in which another is refused.

A table is declared once, by its keys (:func:`needed`, :func:`maybe`) and a check of each value
(:mod:`tyre.base.checks`); :func:`read` gives the values back or says what is wrong with the file, the same way for
every file: the place, the key, the value, what is allowed. Voluptuous walks the tables; all words are ours.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from voluptuous import REMOVE_EXTRA, Invalid, MultipleInvalid, Optional, Required, RequiredFieldInvalid, Schema

from tyre.base.checks import Check, NoTable, UnknownKey, any_table, known, text
from tyre.base.errors import InputError, unknown


def needed(key: str, says: str = "") -> Any:
    """A key that must be there.

    Parameters
    ----------
    key : str
    says : str
        Of a table without it; by default ``KEY is missing``.
    """
    return Required(key, msg=says or f"{key} is missing")


def maybe(key: str, default: Any = None) -> Any:
    """A key that may be left out.

    Parameters
    ----------
    key : str
    default : object
        Its value then; None: the table read has no such key.
    """
    return Optional(key) if default is None else Optional(key, default=default)


@dataclass(frozen=True)
class Table:
    """A declared table: called with a mapping, it gives the checked values.

    Attributes
    ----------
    keys : tuple of str
        Its keys.
    schema : voluptuous.Schema
    """

    keys: tuple[str, ...]
    schema: Schema

    def __call__(self, value: Any) -> dict[str, Any]:
        """Check a table: ``value``, whose units its keys name."""
        return dict(self.schema(dict(any_table(value))))


def table(keys: Mapping[Any, Check], *, kind: str = "key", others: bool = False) -> Table:
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
    names = tuple(str(key) for key in keys)
    for place, key in enumerate(keys):
        key.description = place  # the order in which missing ones are told

    def none_else(key: Any) -> str:
        raise UnknownKey(unknown(kind, key, names))

    return Table(names, Schema(dict(keys), extra=REMOVE_EXTRA) if others else Schema({**keys, none_else: object}))


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
    return Table(tuple(allowed), Schema({known(kind, allowed): check}))


tables_by_name = Table((), Schema({str: any_table}))
"""A table of tables whose names and keys are checked elsewhere."""


def path_key(key: str, example: str) -> dict[Any, Check]:
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
    try:
        return declared(content)
    except Invalid as error:
        errors = error.errors if isinstance(error, MultipleInvalid) else [error]
        words = _words(min(errors, key=_rank), section.split(".") if section else [], dotted=dotted)
        raise InputError(f"{where}: {words}" if where else words) from None


def _rank(error: Invalid) -> tuple[int, int]:
    """Unknown keys first, the outermost before all; missing ones last, as declared."""
    if isinstance(error, UnknownKey):
        return 0, len(error.path)
    missing: Any = error.path[-1] if isinstance(error, RequiredFieldInvalid) else None
    return (1, 0) if missing is None else (2, missing.description)


def _words(error: Invalid, section: list[str], *, dotted: bool) -> str:
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
