"""Signals as a file holds them: every channel with its name, its unit as written, and its own time base."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from tyre.base.arrays import Array
from tyre.base.errors import InputError, hint

SEPARATORS = "./\\"
"""Between the parts of a name: group and channel, structure and field."""


@dataclass(frozen=True)
class Column:
    """A channel that a file lists: its ``name``, its ``unit`` as written (empty where the file says none)."""

    name: str
    unit: str = ""

    @property
    def spellings(self) -> tuple[str, ...]:
        """Other ways to name it: with its unit in brackets, and without its groups."""
        short = self.name
        for separator in SEPARATORS:
            short = short.rpartition(separator)[2] or short
        names = (self.name, short)
        return tuple(
            dict.fromkeys(
                (*names, *(f"{name} {left}{self.unit}{right}" for name in names for left, right in ("[]", "()")))
            )
        )


@dataclass(frozen=True, eq=False)
class Signal:
    """One channel of a file.

    Attributes
    ----------
    name : str
        As in the file; groups and fields before it, separated by ``/`` or ``.``.
    values : ndarray, shape (n,)
        In ``unit``; NaN where a sample is missing.
    unit : str
        As written in the file; empty where it says none.
    time : ndarray, shape (n,), optional
        Its own time base, s; None where the file keeps the time in a column like others, or has none.
    """

    name: str
    values: Array
    unit: str = ""
    time: Array | None = None


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals of one file by name.

    Attributes
    ----------
    source : str
        The file, for messages.
    signals : mapping of str to Signal
    notes : tuple of str
        What a reader must be told: lines passed over, an encoding that was taken.
    """

    source: str
    signals: Mapping[str, Signal]
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Signal:
        """The signal called ``name``, by its whole name or by any spelling that only one signal has."""
        return self.signals[self.find(name)]

    def find(self, name: str, *, where: str = "") -> str:
        """The whole name of a signal, see :func:`find_column`.

        Parameters
        ----------
        name : str
        where : str, optional
            What a message begins with.
        """
        return find_column(name, self.columns, where=where or self.source)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Names and units of all signals."""
        return tuple(Column(signal.name, signal.unit) for signal in self.signals.values())


Load = Callable[[Sequence[str], int | None], Iterable[Signal]]


@dataclass(frozen=True, eq=False)
class Contents:
    """What a file lists, and how to load some of it.

    Attributes
    ----------
    source : str
        The file, for messages.
    columns : tuple of Column
    load : callable
        Signals of the columns named, in that order, at most so many first samples of each (None: all).
    notes : list of str
        What a reader must be told; loading may add to it.
    own_times : bool
        Every channel comes with its own times.
    """

    source: str
    columns: tuple[Column, ...]
    load: Load
    notes: list[str] = field(default_factory=list)
    own_times: bool = False


def find_column(name: str, columns: Iterable[Column], *, where: str) -> str:
    """The whole name of a column that is given by any of its spellings.

    Parameters
    ----------
    name : str
        Whole, without its groups, or with its unit in brackets; blanks are alike.
    columns : iterable of Column
    where : str
        What a message begins with.

    Raises
    ------
    InputError
        No such column, or several; the message lists them.
    """
    columns = tuple(columns)
    wanted = " ".join(name.split())
    for spelled in (lambda column: column.spellings[:1], lambda column: column.spellings):
        fitting = [c.name for c in columns if wanted in [" ".join(text.split()) for text in spelled(c)]]
        if len(fitting) > 1:
            raise InputError(f"{where}: {name!r} is several columns: {', '.join(fitting)}; give the whole name")
        if fitting:
            return fitting[0]
    names = [column.name for column in columns]
    raise InputError(f"{where}: no column {name!r} that holds numbers; there are {listed(names)}{hint(name, names)}")


def listed(names: Sequence[str], *, most: int = 40) -> str:
    """Names in one line, cut where they are many.

    Parameters
    ----------
    names : sequence of str
    most : int
        How many are shown.
    """
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more if names else "none"
