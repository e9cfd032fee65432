"""Tables of bicycles, one a row: CSV, Excel or Parquet with the parameters as columns."""

from pathlib import Path
from typing import Any

from bicycle.files.checked_bicycle import checked_bicycle
from bicycle.files.given_numbers import LEFT_OUT, GivenNumbers, si_unit
from bicycle.parameters import UNITS, UNUSED, Bicycle
from tyre.base.errors import InputError, unknown
from tyre.base.plausible import WAY_OUT
from tyre.base.sheet import ENDINGS, Sheet, read_sheet, split_unit
from tyre.base.unit_words import factor_to_si, is_unit

WORDS = ("name", "description", "source", WAY_OUT)
ROW = "#"  # bicycles.csv#NAME is one of the bicycles
SD = "_sd"


def is_bicycle_table(text: str) -> bool:
    """Whether ``text`` names a table of bicycles, or one of its rows."""
    return Path(text.rpartition(ROW)[0] or text).suffix.lower() in ENDINGS or Path(text).suffix.lower() in ENDINGS


def split_row(text: str) -> tuple[Path, str]:
    """The file of a table and the name of the row, empty where none is named (``FILE#NAME``).

    Parameters
    ----------
    text : str
    """
    file, mark, name = text.rpartition(ROW)
    if mark and Path(file).suffix.lower() in ENDINGS and not Path(text).is_file():
        return Path(file), name
    return Path(text), ""


def one_of_table(text: str, *, allow_unusual: bool = False) -> Bicycle:
    """The bicycle ``FILE#NAME``, or the only one of ``FILE``.

    Parameters
    ----------
    text : str
    allow_unusual : bool, optional
        Take values far outside what bicycles have.

    Raises
    ------
    InputError
        A name that is not in the table, or none where it has several bicycles.
    """
    path, name = split_row(text)
    found = {one.name: one for one in read_bicycles(path, allow_unusual=allow_unusual)}
    if not name and len(found) > 1:
        raise InputError(
            f"{path}: the table has {len(found)} bicycles ({', '.join(list(found)[:4])}{', ...' * (len(found) > 4)}); "
            f"name one of them: {path.name}{ROW}{next(iter(found))}"
        )
    if name and name not in found:
        raise InputError(f"{path}: {unknown('bicycle', name, found)}")
    return found[name] if name else next(iter(found.values()))


def read_bicycles(path: Path, *, allow_unusual: bool = False) -> list[Bicycle]:
    """Read all bicycles of a table, in its order.

    Columns: ``name``; every parameter, SI or with its unit in brackets (``lam [deg]``) or behind its key (``w_mm``);
    perhaps ``KEY_sd``, ``description``, ``source``, ``allow_unusual``. A cell holds a number or text such as
    ``0.375(26)``.

    Parameters
    ----------
    path : Path
    allow_unusual : bool, optional
        Take values far outside what bicycles have.

    Raises
    ------
    InputError
        An unknown or missing column, an empty or repeated name, a cell that is no number, a row that is no bicycle;
        the message names the row and the column.
    """
    sheet = read_sheet(path, kind="bicycles")
    columns = [_column(name, sheet) for name in sheet.header]
    keys = [key for key, _ in columns]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{path}: two columns are of {key}; keep one")
    missing = [key for key in ("name", *UNITS) if key not in keys]
    if missing:
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; a row needs a name and every parameter")
    found: dict[str, Bicycle] = {}
    for place, cells in sheet.rows:
        one = _bicycle(sheet, place, dict(zip(keys, zip(cells, columns, sheet.header, strict=True), strict=True)),
                       allow_unusual=allow_unusual)  # fmt: skip
        if one.name in found:
            raise InputError(f"{path}, {place}, column 'name': {one.name!r} is there already; give each its own name")
        found[one.name] = one
    return list(found.values())


def _column(name: str, sheet: Sheet) -> tuple[str, str]:
    """The key of a column, with ``_sd`` for a standard deviation, and its unit (empty: SI)."""
    known = (*UNITS, *UNUSED, *LEFT_OUT)
    allowed = {*WORDS, *known, *(key + SD for key in known)}
    base, unit = split_unit(name)
    if base not in allowed and not unit:
        start, _, end = base.partition("_")
        with_sd = end == "sd" or end.startswith("sd_")
        key, rest = (start + SD, end[3:]) if with_sd else (start, end)
        base, unit = (key, rest) if key in allowed and is_unit(rest) else (base, unit)
    if base not in allowed:
        words = unknown("column", name, [*WORDS, *UNITS, *UNUSED])
        raise InputError(f"{sheet.path}: {words}; KEY_sd is a standard deviation")
    if unit and base in WORDS:
        raise InputError(f"{sheet.path}: the column {name!r} has no unit")
    if unit:
        factor_to_si(unit, si_unit(base.removesuffix(SD)), where=f"{sheet.path}, column {name!r}")
    return base, unit


def _bicycle(sheet: Sheet, place: str, row: dict[str, tuple[Any, Any, str]], *, allow_unusual: bool) -> Bicycle:
    words = {key: str(row[key][0]) for key in WORDS if key in row}
    if not words["name"] or ROW in words["name"]:
        raise InputError(f"{sheet.path}, {place}, column 'name': {words['name']!r} must be a name without {ROW!r}")
    if words.get(WAY_OUT, "").lower() not in ("", "true", "false"):
        raise InputError(f"{sheet.path}, {place}, column {WAY_OUT!r}: {words[WAY_OUT]!r} must be true or false")
    numbers = GivenNumbers()
    for key, (cell, (_, unit), name) in sorted(row.items(), key=lambda item: item[0].endswith(SD)):
        where = f"{sheet.path}, {place} ({words['name']}), column {name!r}"
        if key in WORDS:
            continue
        if key.endswith(SD):
            if cell != "":
                of = key.removesuffix(SD)
                numbers.add_sd(of, cell, where=where, unit=unit or row[of][1][1] if of in row else unit)
        elif cell == "" and (key in UNUSED or key in LEFT_OUT):
            continue
        elif cell == "":
            raise InputError(f"{where}: the cell is empty; every bicycle needs {key} ({si_unit(key)})")
        else:
            numbers.add(key, cell, where=where, unit=unit)
    numbers.finish()
    try:
        return checked_bicycle(
            words["name"], numbers.values, numbers.sd, words.get("description", ""), words.get("source", ""),
            tuple(numbers.notes), where="table (a column of its own)",
            allow_unusual=allow_unusual or words.get(WAY_OUT, "").lower() == "true",
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{sheet.path}, {place} ({words['name']}): {error}") from error
