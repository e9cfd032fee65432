"""A .toml file that a command is about to write: whether it may, and how it names other files."""

import os
from collections.abc import Sequence
from pathlib import Path

from tyre.ground.errors import InputError


def check_toml_target(out: Path, *, force: bool, companions: Sequence[str] = ()) -> None:
    """Refuse a target ``--out`` that is no .toml file in a folder, or that would overwrite a file without ``force``.

    ``companions`` are endings of files that are written next to it.
    """
    if out.suffix.lower() != ".toml":
        raise InputError(f"--out {out}: the ending {out.suffix!r} is not known; write a .toml file")
    if not out.parent.is_dir():
        raise InputError(f"--out {out}: there is no folder {out.parent}; make it first")
    existing = [file for file in (out, *(out.with_suffix(ending) for ending in companions)) if file.exists()]
    if existing and not force:
        raise InputError(f"{existing[0]} exists; give --force to overwrite it or another name")


def near_to(file: str, target: Path) -> str:
    """Name a ``file`` as it is found from the folder of ``target``."""
    try:
        return Path(os.path.relpath(file, target.parent)).as_posix()
    except ValueError:  # on another drive
        return Path(file).resolve().as_posix()
