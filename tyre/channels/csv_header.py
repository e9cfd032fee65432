"""Names and units of columns, from the lines above the samples of a text table or a sheet."""

import re
from collections.abc import Sequence

from tyre.base.errors import InputError
from tyre.channels.reading import Reading
from tyre.channels.units import quantity_of

NUMBER = {sign: re.compile(rf"[+-]?(\d+{re.escape(sign)}?\d*|{re.escape(sign)}\d+)([eE][+-]?\d+)?") for sign in ".,"}
"""What a number looks like, by its decimal sign."""

_BRACKETS = re.compile(r"^(.*\S)\s*[\[(]([^\[\]()]*)[\])]$")


def named(cells: Sequence[str]) -> list[tuple[str, str]]:
    """Name and unit of every column from cells such as ``Fy [N]``; columns without a name are numbered from 1.

    Parameters
    ----------
    cells : sequence of str
    """
    found = []
    for place, cell in enumerate(cells, 1):
        match = _BRACKETS.match(cell)
        known = match is not None and (match.group(2) in ("", "-", "1") or quantity_of(match.group(2)) != "")
        name, unit = match.groups() if match and known else (cell, "")
        found.append((name or f"column {place}", unit))
    return found


def header(
    where: str, rows: list[list[str]], first: int, width: int, reading: Reading, decimal: str
) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Names and units of columns from the lines above the samples, and how many lines above them were passed over.

    Parameters
    ----------
    where : str
        What a message begins with.
    rows : list of list of str
        Cells of the lines.
    first : int
        Index of the first line of samples, from 0.
    width : int
        Number of columns.
    reading : Reading
    decimal : str
        Sign in numbers.
    """
    above = [index for index in range(first) if any(rows[index])]
    if reading.names_line:
        if reading.names_line > first:
            raise InputError(f"{where}: [reading]: names_line = {reading.names_line} must be above the samples")
        block = [reading.names_line - 1]
    else:
        block = _block(where, rows, above, width, reading, decimal)
    units_row = reading.units_line - 1 if reading.units_line else None
    if units_row is None and len(block) > 1 and are_units(_stripped(rows[block[-1]], width)):
        units_row = block.pop()
    parts = [_stripped(rows[index], width) for index in block]
    joined = [".".join(filter(None, cells)) for cells in zip(*parts, strict=True)] if parts else [""] * width
    if len(joined) != width:
        raise InputError(f"{where}: {len(joined)} names of columns where the samples have {width} columns")
    pairs = named(joined)
    units = [unit for _, unit in pairs]
    if units_row is not None:
        row = _stripped(rows[units_row], width)
        if len(row) != width:
            raise InputError(f"{where}, line {units_row + 1}: {len(row)} units where there are {width} columns")
        units = [unit.strip("[]()") or old for unit, old in zip(row, units, strict=True)]
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            pairs_of = [place for place, other in enumerate(names) if other == name]
            for place in pairs_of:
                names[place] = f"{name} (column {place + 1})"
    return tuple(names), tuple(units), len([index for index in above if index < min(block, default=0)])


def _block(
    where: str, rows: list[list[str]], above: list[int], width: int, reading: Reading, decimal: str
) -> list[int]:
    """Lines with names, and perhaps units, right above the samples: as wide as they, without numbers or blank lines."""
    block: list[int] = []
    for index in reversed(above):
        if reading.units_line and index == reading.units_line - 1:
            continue
        row = _stripped(rows[index], width)
        apart = bool(block) and (index + 1 not in above or sum(map(bool, row)) < 0.5 * width)  # a title, padded
        if len(row) != width or apart:
            break
        wrong = [cell for cell in row if NUMBER[decimal].fullmatch(cell)]
        if wrong and not block and len(wrong) < width:
            raise InputError(
                f"{where}, line {index + 1}: names of columns were expected above the samples, it holds "
                f"{wrong[0]!r}; correct the line, or give names_line and first_line in [reading]"
            )
        if wrong:
            break
        block.insert(0, index)
    if above and not block and not reading.first_line:
        raise InputError(
            f"{where}, line {above[-1] + 1}: {len(rows[above[-1]])} cells above samples of {width} columns; no "
            "names of columns were found: give names_line in [reading]"
        )
    return block


def _stripped(row: list[str], width: int) -> list[str]:
    """A line of the header without the mark of a comment and without a delimiter at its end."""
    cells = list(row)
    if cells and cells[0][:1] in ("#", "%"):
        cells[0] = cells[0][1:].strip()
        if not cells[0] and len(cells) == width + 1:
            cells = cells[1:]
    while len(cells) > width and not cells[-1]:
        cells.pop()
    return cells


def are_units(cells: list[str]) -> bool:
    """Whether the ``cells`` of a line are units: at least half of those that are filled, and one that is known."""
    known = [quantity_of(cell) != "" or cell.strip("[]()") in ("-", "%", "1") for cell in cells if cell]
    return sum(known) >= 0.5 * len(known) and any(map(quantity_of, cells))
