"""A TYDEX document made from values, in the columns of the manual."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tyre.base.errors import InputError
from tyre.channels.tydex_document import (
    FIELD,
    KEYWORD_LINE,
    NOT_AVAILABLE,
    ChannelEntry,
    Entry,
    Section,
    TydexDocument,
)


def build(
    *,
    header: Sequence[Entry],
    comments: str,
    constants: Sequence[Entry],
    channels: Sequence[ChannelEntry],
    measured: NDArray[np.float64],
    source: str = "TYDEX text",
) -> TydexDocument:
    """Make a document from values.

    Parameters
    ----------
    header, constants : sequence of Entry
        Names of at most 8 characters; descriptions are cut at 29 and units at 9 characters.
    comments : str
        May hold several lines, none beginning with ``**``.
    channels : sequence of ChannelEntry
    measured : ndarray, shape (rows, len(channels))
        Printed with as many decimals as fit in fields of ten columns; NaN becomes NOTAVAIL.
    source : str, optional
        What messages call the document.

    Returns
    -------
    TydexDocument

    Raises
    ------
    InputError
        When a name is too long or a number does not fit in its field.
    """
    for name in [entry.name for entry in (*header, *constants)] + [channel.name for channel in channels]:
        if not re.fullmatch(r"[A-Z0-9_]{1,8}", name):
            raise InputError(f"{source}: TYDEX name {name!r} must be 1 to 8 capital letters, digits or underscores")
    if KEYWORD_LINE.search(comments):
        raise InputError(f"{source}: no line of the comments may begin with ** (a TYDEX keyword)")
    rows = {
        "HEADER": "".join(_line(entry, entry.value) for entry in header),
        "COMMENTS": comments + "\n",
        "CONSTANTS": "".join(_line(entry, entry.value) for entry in constants),
        "MEASURCHANNELS": "".join(
            _line(c, f"{c.factor:<10.6g}{c.measured_offset:<10.6g}{c.physical_offset:<10.6g}") for c in channels
        ),
        "MEASURDATA": _print_numbers(measured, [channel.name for channel in channels], source),
    }
    sections = [Section(name, f"**{name}\n", body + "\n") for name, body in rows.items()]
    return TydexDocument((*sections, Section("END", "**END\n", "")), source)


def _line(entry: Entry | ChannelEntry, value: str | None) -> str:
    text = " ".join((NOT_AVAILABLE if value is None else value).split("\n"))
    return f"{entry.name:<10}{entry.description[:29]:<30}{entry.unit[:9]:<10}{text}".rstrip() + "\n"


def _print_numbers(measured: NDArray[np.float64], names: Sequence[str], source: str) -> str:
    rounded = np.empty_like(measured)
    template = ""
    for index, name in enumerate(names):
        largest = float(np.nanmax(np.abs(measured[:, index]), initial=0.0))
        digits = len(str(int(largest + 0.5))) if np.isfinite(largest) else FIELD
        if digits > FIELD - 3:
            raise InputError(f"{source}: channel {name} reaches {largest:g}, too wide for its field")
        decimals = FIELD - 3 - digits
        rounded[:, index] = np.round(measured[:, index], decimals) + 0.0  # no negative zero
        template += f"%{FIELD}.{decimals}f"
    text = "".join([(template + "\n") % tuple(row) for row in rounded.tolist()])
    return text.replace("       nan", f"  {NOT_AVAILABLE}")
