"""Files of measurements that neighbouring projects write: ``key : value`` or ``key = value+/-sd`` a line."""

import math
import re
from collections.abc import Collection
from importlib.resources.abc import Traversable
from pathlib import Path

from tyre.base.errors import InputError, unknown

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
    for row, line in enumerate(path.read_bytes().decode("utf-8-sig", errors="replace").splitlines(), 1):
        text = line.partition("#")[0].strip()
        key, separator, value = (part.strip() for part in LINE.match(text).groups())  # type: ignore[union-attr]
        if not text or (others and key not in allowed):
            continue
        where = f"{path}, line {row}"
        if not separator:
            raise InputError(f"{where}: {text!r} is no 'key : value'")
        if key not in allowed:
            raise InputError(f"{where}: {unknown(kind, key, allowed)}")
        if key in values:
            raise InputError(f"{where}: {key} is given twice; keep one")
        number, _, spread = value.replace("±", "+/-").partition("+/-")
        values[key] = finite(number, where=where, key=key)
        if spread.strip():
            sd[key] = finite(spread, where=where, key=key)
    return values, sd


def finite(text: str, *, where: str, key: str) -> float:
    """A finite number from text.

    Parameters
    ----------
    text : str
    where : str
        File and line, for the message.
    key : str
        What it is the value of.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{where}: {key} = {text.strip()!r} is not a finite number")
    return number
