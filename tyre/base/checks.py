"""Checks of single values of files, and the words in which another value is refused.

A check is a function: it gives the value back, or raises what :func:`refused` or :func:`remarked` makes.
Tables are made of checks, see :mod:`tyre.base.schema`.
"""

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

from tyre.base.errors import is_number, shown, unknown

Check = Callable[[Any], Any]
MOST = 2**63 - 1  # what an integer of numpy holds


def refused(value: object, says: str) -> Exception:
    """The error that a check of one's own raises.

    Parameters
    ----------
    value : object
        What the file holds.
    says : str
        What it must be: ``must be a time >= 0 in s``.
    """
    return remarked(f"= {shown(value)}{'' if says[:1] == ';' else ' '}{says}")


def remarked(says: str) -> Exception:
    """The same in words that do not show the value.

    Parameters
    ----------
    says : str
        To stand behind the key: ``holds a value twice; give each once``.
    """
    from tyre.base.refusals import Refused

    return Refused(says)


def number(
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
    says: str = "",
    outside: str = "",
    endless: bool = False,
) -> Check:
    """A number, as float.

    Parameters
    ----------
    above, least, most : float
        Bounds, in the unit of the key; the first one excluded.
    says : str
        What it must be; by default made of the bounds.
    outside : str
        What is said of a number that is out of bounds, if it is not the same.
    endless : bool
        Infinity is allowed.
    """
    if not says and outside:
        says = "must be a finite number"
    elif not says:
        ends = [f"above {above:g}"] * (above > -math.inf) + [f"from {least:g}"] * (least > -math.inf)
        ends += [f"up to {most:g}"] * (most < math.inf)
        says = " ".join(["must be a finite number", *ends])

    def check(value: Any) -> float:
        if not is_number(value):
            raise refused(value, says)
        if not (above < value and least <= value <= most) or (math.isinf(value) and not endless):
            raise remarked(f"= {shown(value).removesuffix('.0')} {outside or says}")
        return float(value)

    return check


def whole(*, least: int, most: int = MOST) -> Check:
    """A whole number from ``least`` to ``most``; both are numbers without units."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise refused(value, f"must be a whole number from {least} to {most}")
        return value

    return check


def flag(value: Any) -> bool:
    """true or false: ``value`` as the file holds it, without units."""
    if not isinstance(value, bool):
        raise refused(value, "must be true or false")
    return value


def text(says: str = "must be text in quotes", *, allowed: Collection[str] | None = None, blank: bool = True) -> Check:
    """Text in quotes.

    Parameters
    ----------
    says : str
        What it must be.
    allowed : collection of str, optional
        The only texts allowed.
    blank : bool
        Blanks alone are text, too.
    """

    def check(value: Any) -> str:
        if not isinstance(value, str) or (allowed is not None and value not in allowed):
            raise refused(value, says)
        if not blank and not value.strip():
            raise remarked("is empty")
        if "\0" in value:  # which no path may hold, and no name
            raise remarked("holds a NUL character; write it anew")
        return value

    return check


def not_known(kind: str, name: object, allowed: Collection[str]) -> Exception:
    """The error of a name that is not among some others.

    Parameters
    ----------
    kind : str
        What a message calls it: ``mode``.
    name : object
        As the file has it.
    allowed : collection of str
    """
    from tyre.base.refusals import UnknownKey

    return UnknownKey(unknown(kind, name, allowed))


def known(kind: str, allowed: Collection[str]) -> Check:
    """A name out of several; another one is refused with the nearest.

    Parameters
    ----------
    kind : str
        What a message calls it: ``mode``.
    allowed : collection of str
        The names.
    """

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in allowed:
            raise not_known(kind, value, allowed)
        return value

    return check


def list_of(check: Check, says: str, *, least: int = 0, most: int = MOST, strict: bool = True) -> Check:
    """A list whose every entry passes a check.

    Parameters
    ----------
    check : callable
        Of an entry.
    says : str
        What the whole must be.
    least, most : int
        Fewest and most entries, numbers without units.
    strict : bool
        A bad entry is refused in the words of the whole, with the whole shown; else in its own, with the entry.
    """

    def every(value: Any) -> list[Any]:
        if not isinstance(value, list) or not least <= len(value) <= most:
            raise refused(value, says)
        from tyre.base.refusals import Invalid

        entries = []
        for place, entry in enumerate(value):
            try:
                entries.append(check(entry))
            except Invalid as error:
                if strict:
                    raise refused(value, says) from None
                error.prepend([place])
                raise
        return entries

    return every


def anything(value: Any) -> Any:
    """Whatever stands there: ``value``, in any unit, is checked elsewhere."""
    return value


def any_table(value: Any) -> Mapping[str, Any]:
    """A table whose keys are checked elsewhere: ``value``, whose units its keys name."""
    if not isinstance(value, Mapping):
        from tyre.base.refusals import NoTable

        raise NoTable(shown(value))
    return value
