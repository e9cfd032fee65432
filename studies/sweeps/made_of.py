"""What a result is made of besides the sweep itself: digests of tyre data and of the source that computes."""

import hashlib
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files as files_of
from importlib.resources.abc import Traversable
from pathlib import Path

from tyre.base.paths import data_root
from tyre.find_tyre import is_file_name, read_tyre

SOURCES = ("bicycle", "tyre", "studies.sweeps", "studies.sampling")
"""Packages whose source makes the numbers of a sweep."""


@cache
def source_digests() -> Mapping[str, str]:
    """SHA-256 of the source of each of :data:`SOURCES`, by words for messages; line ends do not count."""
    found = {}
    for package in SOURCES:
        digest = hashlib.sha256()
        for place, file in sorted(_python_files(files_of(package))):
            digest.update(f"{place}\0".encode() + file.read_bytes().replace(b"\r\n", b"\n") + b"\0")
        found[f"the source of {package}"] = digest.hexdigest()
    return found


def _python_files(folder: Traversable, above: str = "") -> Iterator[tuple[str, Traversable]]:
    for item in folder.iterdir():
        place = f"{above}/{item.name}"
        if item.is_dir():
            if item.name != "data":  # an installed package has the data inside, a checkout beside it
                yield from _python_files(item, place)
        elif item.name.endswith(".py"):
            yield place, item


def tyre_digest(tyre: str) -> str:
    """SHA-256 of the files that hold a tyre.

    Parameters
    ----------
    tyre : str
        A file, or the name of a packaged tyre (of which the tables of every surface count).

    Raises
    ------
    InputError
        A tyre that is missing or cannot be read.
    """
    digest = hashlib.sha256()
    for file in _own_files(Path(tyre)) if is_file_name(tyre) else _packaged_files(tyre):
        digest.update(f"{file.name}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _own_files(file: Path) -> list[Path]:
    read_tyre(file)  # complains of a file that is missing or bad
    both = {file.with_suffix(suffix) for suffix in (".csv", ".toml")}  # of a table
    return sorted({file, *(one for one in both if one.is_file())})


def _packaged_files(name: str) -> list[Traversable]:
    files = sorted((data_root() / "tyres").iterdir(), key=lambda item: item.name)
    told = [file.name for file in files if file.name.endswith(".toml") and _named(file) == name]
    stems = {toml.removesuffix(".toml") for toml in told}
    return [file for file in files if file.name.rpartition(".")[0] in stems]


def _named(sidecar: Traversable) -> object:
    return tomllib.loads(sidecar.read_text(encoding="utf-8")).get("tyre")


def differences(before: object, now: Mapping[str, str]) -> str:
    """What has changed, in words for a message; versions with both numbers.

    Parameters
    ----------
    before : object
        What an earlier run wrote: a mapping from a name to a digest or version, or anything else if it is damaged.
    now : mapping of str to str
        The same of this run.
    """
    if not isinstance(before, Mapping):
        return "nobody knows what, as no record of it can be read"
    changed = [name for name in (*now, *before) if before.get(name) != now.get(name)]
    return ", ".join(dict.fromkeys(_words(name, before.get(name), now.get(name)) for name in changed))


def _words(name: str, before: object, now: object) -> str:
    if name.startswith("the ") or (before is not None and now is not None and len(str(now)) == DIGITS):
        return name
    return f"{name} ({before or 'not used'} before, {now or 'not used'} now)"


DIGITS = 64  # of a digest
