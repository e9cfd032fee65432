"""What a loaded file may not do: lead to another file that was not loaded."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tyre.base.errors import InputError, shown

_WORDS = ("description", "source", "note")  # keys whose text is never a file


def refuse_outside(path: Path, root: Path) -> None:
    """Refuse a TOML or HDF5 file that names a file outside a folder.

    Parameters
    ----------
    path : Path
    root : Path
        The folder, without links in its path.

    Raises
    ------
    InputError
        A text of a TOML file leads to a file or folder that is there and not inside ``root``; an HDF5 file keeps
        some of its data in other files.
    """
    if path.suffix.lower() != ".toml":
        if _is_linked(path):
            raise InputError(
                f"{path.name}: some of its data are in other files (HDF5 links); load a file that holds all"
            )
        return
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, OSError, RecursionError):
        return  # what is wrong with it is said by the command that reads it
    for text in _texts(content):
        if _leads_out(text, path.parent, root):
            raise InputError(
                f"{path.name}: {shown(text[:200])} is a file outside what was loaded; load it too and name it as it is "
                "called here"
            )


def _leads_out(text: str, folder: Path, root: Path) -> bool:
    for name in (text, text.partition("#")[0]):
        if not name or "\0" in name or len(name) > 4096:
            continue
        slashed = name.replace("\\", "/")
        climbs = slashed.startswith(("/", "~")) or ".." in slashed.split("/") or Path(name).is_absolute()
        if climbs and any(mark in name for mark in "*?["):
            return True
        for place in (folder / name, folder / slashed, Path(slashed).expanduser() if climbs else folder / slashed):
            try:
                if place.exists() and not place.resolve().is_relative_to(root):
                    return True
            except (OSError, RuntimeError, ValueError):
                continue
    return False


def _texts(content: Any) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict):
        for key, value in content.items():
            if key not in _WORDS or not isinstance(value, str):
                yield from _texts(value)
            yield str(key)
    elif isinstance(content, list):
        for value in content:
            yield from _texts(value)


def _is_linked(path: Path) -> bool:
    """Whether an HDF5 file holds external links, data in raw files, or virtual datasets; False of any other file."""
    try:
        import h5py
    except ImportError:  # then nothing reads it
        return False
    found: list[str] = []

    def look(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            found.extend([name] if item.external or item.is_virtual else [])
        else:
            found.extend(one for one in item if isinstance(item.get(one, getlink=True), h5py.ExternalLink))

    try:
        if not h5py.is_hdf5(path):
            return False
        with h5py.File(path, "r") as file:
            look("", file)
            file.visititems(look)
    except (OSError, RuntimeError):  # what is wrong with it is said by the command that reads it
        return False
    return bool(found)
