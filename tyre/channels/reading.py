"""The table ``[reading]`` of a channel map: what a file does not say of itself."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tyre.base.checks import list_of, text, whole
from tyre.base.schema import maybe, read, table

_DELIMITER = 'must be one character in quotes, "\\t" for tabs, or "blanks"'
_LINE = whole(least=1)
TABLE = table(
    {
        maybe("delimiter"): text(_DELIMITER, blank=True),
        maybe("decimal"): text('must be "." or ","', allowed=(".", ",")),
        maybe("encoding"): text(blank=False),
        maybe("names_line"): _LINE,
        maybe("units_line"): _LINE,
        maybe("first_line"): _LINE,
        maybe("sheet"): text(blank=False),
        maybe("table"): text(blank=False),
        maybe("dbc"): list_of(text(blank=False), 'must be a list of files: ["powertrain.dbc"]', least=1),
    }
)


@dataclass(frozen=True)
class Reading:
    """How to read a file where it must be told.

    Attributes
    ----------
    delimiter, decimal, encoding : str
        Of text; found out where empty. ``blanks`` separates by any number of blanks.
    names_line, units_line, first_line : int
        Lines of the column names, of the units and of the first samples, from 1; found out where 0.
    sheet : str
        Of a spreadsheet; the first one where empty.
    table : str
        Variable of a .mat file or group of an HDF5 or TDMS file to be read alone; all where empty.
    dbc : tuple of Path
        Databases that decode the CAN frames of a measurement file.
    """

    delimiter: str = ""
    decimal: str = ""
    encoding: str = ""
    names_line: int = 0
    units_line: int = 0
    first_line: int = 0
    sheet: str = ""
    table: str = ""
    dbc: tuple[Path, ...] = ()

    @classmethod
    def from_table(cls, content: Any, folder: Path, *, where: str) -> "Reading":
        """The options in ``content``, the table of a file.

        Parameters
        ----------
        content : object
        folder : Path
            Where the files that it names are.
        where : str
            What a message begins with.

        Raises
        ------
        InputError
            An unknown key, or a value that is not allowed.
        """
        given: Mapping[str, Any] = read(TABLE, content, where=where, section="reading")
        delimiter = given.get("delimiter", "")
        if len(delimiter) > 1 and delimiter != "blanks":
            from tyre.base.errors import InputError

            raise InputError(f"{where}: [reading]: delimiter = {delimiter!r} {_DELIMITER}")
        return cls(**(dict(given) | {"dbc": tuple(folder / name for name in given.get("dbc", ()))}))
