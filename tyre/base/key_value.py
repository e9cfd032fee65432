"""Files of measurements that neighbouring projects write: ``key : value`` or ``key = value+/-sd`` a line."""

import re
from collections.abc import Collection, Iterator
from importlib.resources.abc import Traversable
from pathlib import Path

from tyre.base.errors import InputError, unknown
from tyre.base.measured_number import measured_number

LINE = re.compile(r"([^:=]*)([:=]?)(.*)")


def read_key_values(
    path: Path | Traversable, allowed: Collection[str], *, kind: str, others: bool = False
) -> tuple[dict[str, float], dict[str, float]]:
    """Read the numbers of a file; what follows # is not read.

    Parameters
    ----------
    path : Path
    allowed : collection of str
        Keys.
    kind : str
        What a message calls a key.
    others : bool
        Lines with other keys, or with none, are passed over.

    Returns
    -------
    values, sd : dict
        By key; standard deviations where stated.

    Raises
    ------
    InputError
        A line without a key, an unknown or repeated key, a value that is not a finite number.
    """
    values: dict[str, float] = {}
    sd: dict[str, float] = {}
    for where, key, text in key_value_lines(path, allowed if others else None):
        if key not in allowed:
            raise InputError(f"{where}: {unknown(kind, key, allowed)}")
        if key in values:
            raise InputError(f"{where}: {key} is given twice; keep one")
        number = measured_number(text, where=where, key=key)
        values[key] = number.value
        if number.sd is not None:
            sd[key] = number.sd
    return values, sd


def key_value_lines(path: Path | Traversable, only: Collection[str] | None = None) -> Iterator[tuple[str, str, str]]:
    """Lines of a file as (file and line, key, text of the value); what follows # is not read.

    Parameters
    ----------
    path : Path
    only : collection of str, optional
        Lines with other keys, or with none, are passed over.

    Raises
    ------
    InputError
        No such file, or a line without a key.
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    for row, line in enumerate(raw.decode("utf-8-sig", errors="replace").splitlines(), 1):
        text = line.partition("#")[0].strip()
        key, separator, value = (part.strip() for part in LINE.match(text).groups())  # type: ignore[union-attr]
        if not text or (only is not None and key not in only):
            continue
        where = f"{path}, line {row}"
        if not separator:
            raise InputError(f"{where}: {text!r} is no 'key : value'")
        yield where, key, value
