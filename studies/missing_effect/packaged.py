"""Packaged measurements by name, wherever the package lies: ``kooijman2008`` is ``measured/kooijman2008.toml``."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources.abc import Traversable
from pathlib import Path
from tempfile import TemporaryDirectory

from tyre.base.errors import InputError, unknown
from tyre.base.paths import data_root


def available_measurements() -> tuple[str, ...]:
    """Names of the packaged measurements, sorted."""
    files = (data_root() / "measured").iterdir()
    return tuple(sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml")))


@contextmanager
def packaged_measurement(name_or_path: str | Path) -> Iterator[Path]:
    """Give the file of a measurement for as long as it is read: ``name_or_path`` itself, or that of a packaged name.

    A package inside a zip file is unpacked, for a measurement names its tables by paths beside it.

    Raises
    ------
    InputError
        No such file, and no packaged measurement of this name.
    """
    path, name = Path(name_or_path), str(name_or_path)
    if path.suffix or path.is_file() or "/" in name:
        yield path
        return
    if name not in available_measurements():
        raise InputError(
            f"{unknown('measurement', name, available_measurements())}; or give a measurement file (.toml)"
        )
    root = data_root()
    if isinstance(root, Path):
        yield root / "measured" / f"{name}.toml"
        return
    with TemporaryDirectory() as folder:
        _unpack(root, Path(folder))
        yield Path(folder) / "measured" / f"{name}.toml"


def _unpack(folder: Traversable, target: Path) -> None:
    for item in folder.iterdir():
        if item.is_dir():
            (target / item.name).mkdir()
            _unpack(item, target / item.name)
        else:
            (target / item.name).write_bytes(item.read_bytes())
