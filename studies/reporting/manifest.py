"""Manifest of a folder of results: the command, its inputs, the versions, and every file.

It is written twice: first that the command has begun, last with the files. So the next command into a folder knows if
the one before was stopped.
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

from studies.reporting.command_context import ARGUMENTS, version_of
from studies.reporting.output import print_warnings
from tyre.ground.errors import InputError
from tyre.ground.files import files_below, hold_folder, left_by_a_killed_run, make_folder, texts_in, write_text

VERSIONS = ("velotyre", "numpy", "scipy", "sympy", "pandas", "matplotlib", "control")


@contextmanager
def results(folder: Path) -> Iterator[None]:
    """Write results into ``folder``, made if missing, and last their manifest, called ``COMMAND.manifest.json``.

    Another command that writes there at the same time is waited for.
    """
    if folder.resolve() == folder.resolve().parent:
        raise InputError(f"{folder} is a whole disk; give a folder for the results")
    context = click.get_current_context(silent=True)
    arguments = [] if context is None else context.meta.get(ARGUMENTS, [])
    named = [_entry(file, file.as_posix()) for file in inputs(arguments, outside=folder)]
    created = not folder.is_dir()
    make_folder(folder)
    waiting = f"{folder}: another command is writing there; this one waits for its end"
    with hold_folder(folder, lambda: print_warnings([waiting])):
        folder.mkdir(exist_ok=True)  # the other one may have taken back what it had made
        called = "" if context is None else "_".join(context.command_path.split()[1:])
        with _write_manifest(folder, called, arguments, named, created=created):
            yield


@contextmanager
def _write_manifest(
    folder: Path, called: str, arguments: Sequence[str], named: list[dict[str, Any]], *, created: bool
) -> Iterator[None]:
    manifest = folder / f"{called.replace('-', '_') or 'velotyre'}.manifest.json"
    if (stopped := unfinished_command(manifest)) is not None:
        print_warnings([f"{folder}: an earlier {stopped} did not finish; what it left there is replaced file by file"])
        for file in _stamps(folder):
            if left_by_a_killed_run(file.name):
                file.unlink()
    content: dict[str, Any] = {
        "command": shlex.join(["velotyre", *arguments]),
        "finished": False,
        "versions": {"python": platform.python_version()} | {name: version_of(name) for name in VERSIONS},
        "inputs": named,
    }
    write_text(manifest, json.dumps(content, indent=1) + "\n")
    before = _stamps(folder)
    try:
        yield
    except BaseException:
        if _stamps(folder) == before and stopped is None:  # refused before it wrote: there is nothing to replace
            manifest.unlink()
            if created:
                folder.rmdir()
        raise
    written = [file for file, stamp in _stamps(folder).items() if before.get(file) != stamp]
    files = [_entry(file, file.relative_to(folder).as_posix()) for file in sorted(written) if file != manifest]
    write_text(manifest, json.dumps(content | {"finished": True, "files": files}, indent=1) + "\n")


def unfinished_command(manifest: Path) -> str | None:
    """Command that wrote a ``manifest`` and did not finish; None if it did, or if there is no manifest."""
    try:
        content = json.loads(manifest.read_text(encoding="utf-8"))
        return None if content["finished"] else str(content["command"])
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        return "command"  # whose manifest is not one


def inputs(arguments: Sequence[str], *, outside: Path) -> list[Path]:
    """List files that the ``arguments`` of a command line name, those of a folder, and those that they name
    themselves."""
    files: dict[Path, None] = {}
    for argument in arguments:
        text = argument.partition("=")[2] if argument.startswith("--") and "=" in argument else argument
        for name in (text, text.rpartition("@")[0]):  # RUN.csv@4.8 is a file and its speed
            if name and "\0" not in name and os.path.exists(name):
                if Path(name).resolve() != outside.resolve():
                    _follow(Path(name), files)
                break
    return [file for file in files if not file.resolve().is_relative_to(outside.resolve())]


def _follow(path: Path, files: dict[Path, None]) -> None:
    """Add a file, its sidecar and the files that it names, or the files of a folder, to ``files``."""
    if path.is_dir():
        files |= dict.fromkeys(files_below(path))
        return
    if path in files or not path.is_file():
        return
    files[path] = None
    if (sidecar := path.with_suffix(".toml")).is_file():
        _follow(sidecar, files)
    if path.suffix.lower() == ".toml":
        try:
            content = tomllib.loads(path.read_text(encoding="utf-8"))
        except (ValueError, OSError, RecursionError):  # whoever needs the file says what is wrong with it
            return
        for name in texts_in(content):  # os.path says no where pathlib raises: a text may be too long for a name
            if name and "\0" not in name and len(name) < 1024 and os.path.isfile(path.parent / name):
                _follow(path.parent / name, files)


def _stamps(folder: Path, deepest: int = 3) -> dict[Path, tuple[int, int, int]]:
    """Inode, time of change and size of each file: a file written again has others."""
    stamps = {}
    for place, folders, names in os.walk(folder):
        depth = len(Path(place).relative_to(folder).parts)
        folders[:] = [name for name in folders if depth + 1 < deepest and name != "cache" and not name.startswith(".")]
        for name in names:
            state = os.stat(file := Path(place) / name)
            stamps[file] = (state.st_ino, state.st_mtime_ns, state.st_size)
    return stamps


def _entry(file: Path, name: str) -> dict[str, Any]:
    with file.open("rb") as opened:
        return {"file": name, "bytes": file.stat().st_size, "sha256": hashlib.file_digest(opened, "sha256").hexdigest()}
