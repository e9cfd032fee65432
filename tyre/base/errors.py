"""The one exception for bad input, raised by every package and shown by the command line as one line."""

import difflib
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
    by_lower_case = {known.lower(): known for known in reversed(names)}
    close = difflib.get_close_matches(str(name).lower(), list(by_lower_case), n=1)
    hint = f"did you mean {by_lower_case[close[0]]!r}? " if close else ""
    return f"unknown {kind} {str(name)!r}; {hint}known: {', '.join(names) or 'none'}"


def is_number(value: Any) -> bool:
    """Whether ``value``, of a file, is a real number that a float can hold (True and False are no numbers)."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def shown(value: object) -> str:
    """A ``value`` of a file as a message shows it, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
