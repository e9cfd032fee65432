"""What is loaded, in a folder of its own: a command that searches a folder must not find what other commands wrote."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from studies.explorer.recording.desk import loaded_in
from studies.explorer.recording.names import GATHERED
from studies.explorer.recording.outside import refuse_outside


@contextmanager
def gathered(folder: Path) -> Iterator[None]:
    """Within the block the folder :data:`GATHERED` holds every file that is loaded, under its name.

    Parameters
    ----------
    folder : Path
        Of the desk.

    Raises
    ------
    InputError
        A file that from there leads to one that was not loaded.
    """
    target = folder / GATHERED
    shutil.rmtree(target, ignore_errors=True)  # of a command that was cancelled
    target.mkdir()
    try:
        for name, _ in loaded_in(folder):
            place = target / name
            place.parent.mkdir(parents=True, exist_ok=True)
            _linked(folder / name, place)
            refuse_outside(place, folder.resolve())
        yield
    finally:
        shutil.rmtree(target, ignore_errors=True)


def _linked(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:  # a file system without links
        shutil.copyfile(source, target)
