"""The text of a .tir file: sections, assignments and comments."""

import re
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from tyre.base.errors import InputError, plain_digits

_ASSIGNMENT = re.compile(r"^\s*([A-Za-z_]\w*)\s*=\s*(.*)$")
_FIELD_COMMENT = re.compile(r"^!\s*:?\s*(TYRE|SURFACE)\s*:\s*(.+)$")


@dataclass(frozen=True)
class TirText:
    """A .tir file: its text verbatim and its values.

    Attributes
    ----------
    source : str
        Name for error messages.
    text : str
        The whole file.
    sections : dict of str to dict of str to (float or str)
        Values by section and key, in the units of the file; keys without a value are left out.
    comments : dict of str to str
        ``TYRE`` and ``SURFACE`` from the comment lines, where the file has them.
    """

    source: str
    text: str = field(repr=False)
    sections: dict[str, dict[str, float | str]]
    comments: dict[str, str]

    def find(self, *keys: str) -> float | str | None:
        """Return the value of the first of ``keys`` in any section; None where there is none."""
        for key in keys:
            for section in self.sections.values():
                if key in section:
                    return section[key]
        return None


def read_text(path: str | Path) -> str:
    """Return the text of a file in UTF-8 or Latin-1.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    InputError
        It cannot be read.
    """
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def parse(text: str, *, source: str) -> TirText:
    """Split the text of a .tir file into sections and keys.

    Parameters
    ----------
    text : str
        Of the whole file.
    source : str
        Its name, for messages.

    Raises
    ------
    InputError
        A line is no section, assignment, table or comment, or a key stands twice.
    """
    sections: dict[str, dict[str, float | str]] = {}
    comments: dict[str, str] = {}
    current: dict[str, float | str] | None = None
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        where = f"{source}, line {number}"
        stripped = line.strip()
        if not stripped or stripped[0] in "$!#":
            if found := _FIELD_COMMENT.match(stripped):
                comments.setdefault(found.group(1), found.group(2).strip())
            continue
        if stripped[0] == "[":
            name = stripped.partition("]")[0][1:].strip().upper()
            current = sections.setdefault(name, {})
            continue
        assignment = _ASSIGNMENT.match(line)
        if assignment is None:
            if stripped[0] == "{" or re.fullmatch(r"[-+.\deE\s]+", re.split(r"[$!]", stripped)[0]):
                continue  # a table such as [SHAPE], of no use here and kept in the text
            raise InputError(f"{where}: {stripped[:60]!r} is no section, assignment, table row or comment")
        if current is None:
            raise InputError(f"{where}: {stripped[:60]!r} stands before the first [SECTION]; is this a .tir file?")
        key, value = assignment.group(1).upper(), _value(assignment.group(2))
        if value is None:
            continue
        if key in current:
            raise InputError(f"{where}: {key} is given twice in its section; keep one")
        current[key] = value
    if not sections:
        raise InputError(f"{source}: has no [SECTION]; is this a .tir file?")
    return TirText(source, text, sections, comments)


def _value(text: str) -> float | str | None:
    text = text.strip()
    if text[:1] in ("'", '"'):
        return text[1:].partition(text[0])[0].strip()
    text = re.split(r"[$!]", text)[0].strip()
    if not text:
        return None
    if not plain_digits(text):
        return text
    try:
        return value if isfinite(value := float(text)) else text
    except ValueError:
        return text
