"""Write a file completely or not at all: an interrupted command leaves the old file, never half a new one."""

import os
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path


@contextmanager
def replacing(target: str | Path) -> Iterator[Path]:
    """Give a file to write beside ``target`` (with its ending); at the end of the block it takes the target's place.

    It is on the disk before it does, and keeps the permissions of what it replaces. A link stays a link, and a device
    or a pipe (``/dev/null``) is written as it is.

    Raises
    ------
    OSError
        The folder does not exist or cannot be written, or the disk is full; the message names the target.
    """
    asked, target = str(target), Path(target)
    if target.is_symlink():
        target = target.resolve()
    device = target.exists() and not (target.is_file() or target.is_dir())
    part = target if device else target.with_name(f".{target.stem}.part{os.getpid()}{target.suffix}")
    try:
        yield part
        if target.is_dir():
            raise IsADirectoryError(21, "is a folder; give a file", asked)
        if not device:
            _settle(part, target)
            os.replace(part, target)
    except OSError as error:
        if error.errno is not None and error.filename in (None, str(part)):  # a full disk says no name
            error.filename = asked
        raise
    finally:
        if not device:
            part.unlink(missing_ok=True)


def left_by_a_killed_run(name: str) -> bool:
    """Whether a file called ``name`` is one that :func:`replacing` gave and never put in its place."""
    return re.fullmatch(r"\..+\.part\d+(\.\w+)?", name) is not None


def clear_of_killed_runs(folder: Path) -> None:
    """Remove what killed runs left in a ``folder`` (see :func:`left_by_a_killed_run`)."""
    for file in folder.iterdir():
        if left_by_a_killed_run(file.name):
            file.unlink(missing_ok=True)


def _settle(part: Path, target: Path) -> None:
    """Put ``part`` on the disk, with the permissions of ``target`` where there is one."""
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    if target.exists():
        shutil.copymode(target, part)


def write_text(target: str | Path, text: str) -> None:
    """Write ``text`` to ``target`` in UTF-8, completely or not at all."""
    with replacing(target) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(target: str | Path, content: bytes) -> None:
    """Write ``content`` to ``target``, completely or not at all."""
    with replacing(target) as part:
        part.write_bytes(content)


def slug(name: str) -> str:
    """A name fit for a file: letters, digits, ``-`` and ``_``.

    Parameters
    ----------
    name : str
    """
    return "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)


def slugs(names: Iterable[str]) -> dict[str, str]:
    """Names fit for files, no two alike, whatever the file system makes of capitals: the next one ends in ``_2``.

    Parameters
    ----------
    names : iterable of str
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        if name in found:
            continue
        stem = slug(name)
        found[name] = next(one for n in count(1) if (one := stem if n == 1 else f"{stem}_{n}").casefold() not in taken)
        taken.add(found[name].casefold())
    return found
