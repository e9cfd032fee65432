"""The one exception for bad input, with near matches for mistyped names, and notes that know their subject."""

import math
import numbers
from collections.abc import Iterable, Sequence
from typing import Any

from tyre.ground.renamed import new_name

TINY = 1e-100  # what is smaller counts as 0, for its inverse overflows


class InputError(ValueError):
    """Bad input from the user: the message names the file, row or key, the value, what is allowed and what to do."""


def unknown(kind: str, name: object, allowed: Iterable[str]) -> str:
    """Say that a name is not known, give its new name or suggest the nearest, and list them all."""
    names = sorted(allowed)
    if current := new_name(name, names):
        return f"the {kind} {shown(str(name))} is now called {current!r}"
    match = nearest_name(name, names)
    suggestion = f"did you mean {match!r}? " if match else ""
    return f"unknown {kind} {shown(str(name))}; {suggestion}known: {', '.join(names) or 'none'}"


def refuse_unknown(kind: str, names: Iterable[Any], allowed: Iterable[str], *, where: str = "", more: str = "") -> None:
    """Refuse the first of some names (of a ``kind``: key, column) that is not allowed; ``more`` ends the message."""
    known_names = list(allowed)
    for name in names:
        if not isinstance(name, str) or name not in known_names:
            words = unknown(kind, name, known_names) + (f"; {more}" if more else "")
            raise InputError(f"{where}: {words}" if where else words)


def nearest_name(name: object, allowed: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Find the known name most like a mistyped one (a share ``cutoff`` of letters in common), else give ''."""
    import difflib  # here: most runs have no mistyped name

    by_lower_case = {allowed_name.lower(): allowed_name for allowed_name in reversed(list(allowed))}
    close = difflib.get_close_matches(str(name).lower(), list(by_lower_case), n=1, cutoff=cutoff)
    return by_lower_case[close[0]] if close else ""


def hint(name: object, allowed: Iterable[str]) -> str:
    """End a message with the nearest allowed name as a question; empty without one."""
    suggestion = nearest_name(name, allowed)
    return f"; did you mean {suggestion!r}?" if suggestion else ""


def is_number(value: Any) -> bool:
    """True if ``value`` is a real number that a float can hold (True and False are no numbers)."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def plain_digits(text: object) -> bool:
    """True if a ``text`` is spelt as numbers are: Python alone reads 1_0 as 10, and digits of any script as digits."""
    return not isinstance(text, str) or (text.isascii() and "_" not in text)


def read_number(text: Any) -> float:
    """Read a finite number, as people write it; ValueError of anything else, 0 of less than :data:`TINY`."""
    number = float(text) + 0.0 if plain_digits(text) else math.nan
    if not math.isfinite(number):
        raise ValueError(text)
    return 0.0 if abs(number) < TINY else number


def shown(value: object) -> str:
    """Show a ``value`` of a file in a message, cut if it is long."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


class Note(str):
    """A sentence with its ``subject``, the ``headline`` that must be seen of it, and ``inside``: not extrapolated."""

    subject: str
    headline: str
    inside: bool

    def __new__(cls, text: str, subject: str = "", headline: str = "", *, inside: bool = True) -> "Note":
        note = super().__new__(cls, text)
        note.subject, note.headline, note.inside = subject, headline, inside
        return note

    def replace(self, old: str, new: str, count: int = -1) -> "Note":  # type: ignore[override]
        """Give the same note with ``new`` words for ``old`` ones."""
        return Note(super().replace(old, new, count), self.subject, self.headline, inside=self.inside)


def extrapolated(notes: Sequence[str]) -> bool:
    """True if one of ``notes`` says that values lie beyond what was measured."""
    return any(isinstance(note, Note) and not note.inside for note in notes)


def fold_notes(notes: Sequence[str]) -> list[str]:
    """Fold several notes on one subject into one line; the others stay as they are, in their order."""
    groups: dict[str, list[str]] = {}
    for number, note in enumerate(notes):
        subject = note.subject if isinstance(note, Note) and note.subject else f"\0{number}"
        groups.setdefault(subject, []).append(note)
    lines: list[str] = []
    for subject, group in groups.items():
        first = group[0]
        if len(group) == 1 or not isinstance(first, Note):
            lines += group
        else:
            text = f"{subject} ({first.headline}): {len(group)} notes, --verbose shows them"
            lines.append(Note(text, subject, first.headline, inside=not extrapolated(group)))
    return lines
