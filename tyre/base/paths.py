"""Where the packaged data are: installed as ``tyre.data``, or ``data`` of a bare checkout; and folders of users."""

import os
from collections.abc import Iterable
from importlib import import_module, resources
from importlib.resources.abc import Traversable
from pathlib import Path

from tyre.base.errors import InputError

VARIABLE = "$"  # before the name of an environment variable, at the beginning of a folder


def data_root() -> Traversable:
    """Return the folder with ``tyres/``, ``bicycles/`` and ``measured/``.

    Returns
    -------
    importlib.resources.abc.Traversable
        ``tyre.data`` of an installation (wheel, editable or zipped), else ``data/`` next to the package.
    """
    try:
        import_module("tyre.data")
    except ModuleNotFoundError:
        return Path(__file__).resolve().parents[2] / "data"
    return resources.files("tyre.data")


def refuse_special(path: Path | Traversable) -> None:
    """Refuse what is neither a file nor a folder: a pipe waits for ever, and a device never ends.

    Parameters
    ----------
    path : Path
        What is not there is left to whoever reads it.

    Raises
    ------
    InputError
        A pipe, a socket or a device.
    """
    if isinstance(path, Path) and path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"{path}: is a pipe or a device; write what comes out of it to a file and give that")


def own_ends(files: Iterable[Path]) -> dict[Path, str]:
    """The shortest end of each path that no other of the ``files`` has: ``a/run.csv``, ``b/run.csv``, but ``two.csv``.

    Parameters
    ----------
    files : iterable of Path
    """
    every = list(dict.fromkeys(files))
    found = {}
    for file in every:
        lengths = range(1, len(file.parts) + 1)
        own = (n for n in lengths if not any(other.parts[-n:] == file.parts[-n:] for other in every if other != file))
        found[file] = Path(*file.parts[-next(own, len(file.parts)) :]).as_posix()
    return found


def named_folder(name: str, beside: Path) -> Path:
    """The folder that a file names: relative to the file, or below one named by an environment variable.

    Parameters
    ----------
    name : str
        Such as ``recordings`` or ``$VARIABLE/recordings``.
    beside : Path
        The folder of the file.

    Raises
    ------
    InputError
        The variable is not set, or there is no such folder.
    """
    first, *rest = Path(name).parts or ("",)
    folder = beside / name
    if first.startswith(VARIABLE):
        variable = first.removeprefix(VARIABLE)
        given = os.environ.get(variable, "")
        if not given:
            raise InputError(
                f"folder = {name!r}: the environment variable {variable} is not set; set it to the folder that holds "
                f"{'/'.join(rest) or 'the recordings'}, or write the folder itself"
            )
        folder = Path(given, *rest)
    if not folder.is_dir():
        raise InputError(f"folder = {name!r}: there is no folder {folder}; give the one that holds the recordings")
    return folder
