"""The one exception for bad input, raised by every package and shown by the command line as one line."""

import numbers
from collections.abc import Iterable
from typing import Any


class InputError(ValueError):
    """Bad input from the user: the message names the file, row or key, the value, what is allowed and what to do."""


def unknown(kind: str, name: object, allowed: Iterable[str]) -> str:
    """Say that a name is not known, suggest the nearest known one and list them all.

    Parameters
    ----------
    kind : str
        What is named, e.g. ``key``.
    name : object
        The name that was given.
    allowed : iterable of str
        The names that are known.
    """
    names = sorted(allowed)
    near = nearest(name, names)
    hint = f"did you mean {near!r}? " if near else ""
    return f"unknown {kind} {shown(str(name))}; {hint}known: {', '.join(names) or 'none'}"


def refuse_unknown(kind: str, names: Iterable[Any], allowed: Iterable[str], *, where: str = "", more: str = "") -> None:
    """Refuse the first of some names that is not allowed.

    Parameters
    ----------
    kind : str
        What a name is: ``key``, ``column``.
    names : iterable of str
        As given.
    allowed : iterable of str
        Known names.
    where : str
        What the message begins with.
    more : str
        What it ends with.

    Raises
    ------
    InputError
        With the nearest known name, and all of them.
    """
    known = list(allowed)
    for name in names:
        if not isinstance(name, str) or name not in known:
            words = unknown(kind, name, known) + (f"; {more}" if more else "")
            raise InputError(f"{where}: {words}" if where else words)


def nearest(name: object, allowed: Iterable[str], *, cutoff: float = 0.6) -> str:
    """The known name most like a mistyped one, small and capital letters alike; empty where none is like it.

    Parameters
    ----------
    name : object
        As given.
    allowed : iterable of str
        Known names.
    cutoff : float
        Share of letters in common below which a name is not like it, 0 to 1.
    """
    import difflib  # here: most runs have no mistyped name

    by_lower_case = {known.lower(): known for known in reversed(list(allowed))}
    close = difflib.get_close_matches(str(name).lower(), list(by_lower_case), n=1, cutoff=cutoff)
    return by_lower_case[close[0]] if close else ""


def hint(name: object, allowed: Iterable[str]) -> str:
    """The nearest to ``name`` among ``allowed``, as a question that ends a message; empty where there is none."""
    near = nearest(name, allowed)
    return f"; did you mean {near!r}?" if near else ""


def is_number(value: Any) -> bool:
    """Whether ``value``, of a file, is a real number that a float can hold (True and False are no numbers)."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def plain_digits(text: object) -> bool:
    """Whether a ``text`` is spelt as numbers are: Python alone reads 1_0 as 10, and digits of any script as digits."""
    return not isinstance(text, str) or (text.isascii() and "_" not in text)


def shown(value: object) -> str:
    """A ``value`` of a file as a message shows it, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
