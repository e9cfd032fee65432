"""Write a file completely or not at all: an interrupted command leaves the old file, never half a new one."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(target: str | Path) -> Iterator[Path]:
    """Give a file to write beside ``target`` (with its ending); at the end of the block it takes the target's place.

    Raises
    ------
    OSError
        The folder does not exist or cannot be written; the message names the target.
    """
    target = Path(target)
    part = target.with_name(f".{target.stem}.part{os.getpid()}{target.suffix}")
    try:
        yield part
        if target.is_dir():
            raise IsADirectoryError(21, "is a folder; give a file", str(target))
        os.replace(part, target)
    except OSError as error:
        if error.filename == str(part):
            error.filename = str(target)
        raise
    finally:
        part.unlink(missing_ok=True)


def write_text(target: str | Path, text: str) -> None:
    """Write ``text`` to ``target`` in UTF-8, completely or not at all."""
    with replacing(target) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def slug(name: str) -> str:
    """A name fit for a file: letters, digits, ``-`` and ``_``.

    Parameters
    ----------
    name : str
    """
    return "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)
