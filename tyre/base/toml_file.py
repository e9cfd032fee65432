"""Read a TOML file with one kind of complaint."""

import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from tyre.base.errors import InputError
from tyre.base.paths import refuse_special


def read_toml(path: Path | Traversable, kind: str, *, where: str = "", absent: str = "") -> dict[str, Any]:
    """Content of a TOML file in UTF-8, with a byte-order mark or without.

    Parameters
    ----------
    path : Path
    kind : str
        What it should be, for the message: ``model file``.
    where : str
        What the message begins with; the path if not given.
    absent : str
        What the message says where there is no such file.

    Raises
    ------
    InputError
        No such file, a pipe or a device, one that cannot be read, or not TOML.
    """
    where = where or str(path)
    refuse_special(path)
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError as error:
        raise InputError(f"{where}: {absent or f'no such {kind}'}") from error
    except OSError as error:
        raise InputError(f"{where}: cannot be read as a {kind} ({error.strerror})") from error
    except (ValueError, RecursionError) as error:  # a number of thousands of digits is a ValueError, too
        raise InputError(f"{where}: not a TOML file: {error}") from error
