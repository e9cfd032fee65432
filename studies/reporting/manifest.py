"""The manifest of a folder of results: what was asked, from which inputs, with which versions, and every file of it.

It is written twice: first that the command has begun, last with the files. A folder whose manifest says no more than
the first was left by a command that was stopped, and the next one into it says so.
"""

import hashlib
import json
import os
import platform
import shlex
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from studies.reporting.examples import ARGUMENTS
from studies.reporting.made_by import version_of
from studies.reporting.output import print_warnings
from tyre.base.errors import InputError
from tyre.base.files import left_by_a_killed_run, write_text

VERSIONS = ("velotyre", "numpy", "scipy", "sympy", "pandas", "matplotlib", "control")
DEEPEST = 3  # folders of a path below the folder of results: figures/residuals/one.png
CACHE = "cache"  # of the fits: what is in it carries its own digest


@contextmanager
def results(folder: Path) -> Iterator[None]:
    """Write results into ``folder`` and, last, their manifest; it is made where it does not exist.

    The manifest is called after the command, ``run.manifest.json``. A command before that did not finish is said on
    standard error; one that is refused before it writes leaves none.

    Raises
    ------
    InputError
        A file is in the place of the ``folder``.
    """
    context = click.get_current_context(silent=True)
    arguments = [] if context is None else context.meta.get(ARGUMENTS, [])
    called = "" if context is None else "_".join(context.command_path.split()[1:])
    manifest = folder / f"{called.replace('-', '_') or 'velotyre'}.manifest.json"
    made = not folder.is_dir()
    if made and folder.exists():
        raise InputError(f"{folder} is a file; give a folder for the results")
    folder.mkdir(parents=True, exist_ok=True)
    if (stopped := unfinished(manifest)) is not None:
        print_warnings([f"{folder}: an earlier {stopped} did not finish; what it left there is replaced file by file"])
        for file in _stamps(folder):
            if left_by_a_killed_run(file.name):
                file.unlink()
    content: dict[str, Any] = {
        "command": shlex.join(["velotyre", *arguments]), "finished": False,
        "versions": {"python": platform.python_version()} | {name: version_of(name) for name in VERSIONS},
        "inputs": [_entry(file, file.as_posix()) for file in inputs(arguments, outside=folder)],
    }  # fmt: skip
    _write(manifest, content)
    before = _stamps(folder)
    try:
        yield
    except BaseException:
        if _stamps(folder) == before and stopped is None:  # refused before it wrote: there is nothing to replace
            manifest.unlink()
            if made:
                folder.rmdir()
        raise
    written = [file for file, stamp in _stamps(folder).items() if before.get(file) != stamp]
    files = [_entry(file, file.relative_to(folder).as_posix()) for file in sorted(written) if file != manifest]
    _write(manifest, content | {"finished": True, "files": files})


def unfinished(manifest: Path) -> str | None:
    """The command that wrote a ``manifest`` and did not finish; None where it did, or where there is no manifest."""
    try:
        found = json.loads(manifest.read_text(encoding="utf-8"))
        return None if found["finished"] else str(found["command"])
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        return "command"  # whose manifest is not one


def inputs(arguments: Sequence[str], *, outside: Path) -> list[Path]:
    """Files that the ``arguments`` of a command line name, those of a folder, and those that they name themselves.

    Files below the folder ``outside`` are left out.
    """
    found: dict[Path, None] = {}
    for argument in arguments:
        text = argument.partition("=")[2] if argument.startswith("--") and "=" in argument else argument
        for name in (text, text.rpartition("@")[0]):  # RUN.csv@4.8 is a file and its speed
            if name and "\0" not in name and os.path.exists(name):
                _follow(Path(name), found)
                break
    return [file for file in found if not file.resolve().is_relative_to(outside.resolve())]


def _follow(path: Path, found: dict[Path, None]) -> None:
    """Add a file, its sidecar and the files that it names, or the files of a folder, to those ``found``."""
    if path.is_dir():
        for inside in sorted(path.rglob("*")):
            if inside.is_file():
                found.setdefault(inside)
        return
    if path in found or not path.is_file():
        return
    found[path] = None
    sidecar = path.with_suffix(".toml")
    if sidecar.is_file():
        _follow(sidecar, found)
    if path.suffix.lower() == ".toml":
        for name in _texts(_content(path)):
            named = path.parent / name
            if name and "\0" not in name and len(name) < 1024 and "\n" not in name and os.path.isfile(named):
                _follow(named, found)


def _content(path: Path) -> Any:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, OSError, RecursionError):  # what is wrong with it is said by whoever needs it
        return {}


def _texts(content: Any) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict):
        for value in content.values():
            yield from _texts(value)
    elif isinstance(content, list):
        for value in content:
            yield from _texts(value)


def _stamps(folder: Path) -> dict[Path, tuple[int, int, int]]:
    """Inode, time of change and size of each file of a folder: what was written again has others."""
    found = {}
    for place, folders, names in os.walk(folder):
        depth = len(Path(place).relative_to(folder).parts)
        folders[:] = [name for name in folders if depth + 1 < DEEPEST and name != CACHE and not name.startswith(".")]
        for name in names:
            state = os.stat(file := Path(place) / name)
            found[file] = (state.st_ino, state.st_mtime_ns, state.st_size)
    return found


def _entry(file: Path, name: str) -> dict[str, Any]:
    with file.open("rb") as opened:
        return {"file": name, "bytes": file.stat().st_size, "sha256": hashlib.file_digest(opened, "sha256").hexdigest()}


def _write(manifest: Path, content: dict[str, Any]) -> None:
    write_text(manifest, json.dumps(content, indent=1) + "\n")
