"""The finished pieces of a sweep on disk: one file each, there whole or not at all."""

import json
import os
import shutil
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.sweeps.spec import Sweep
from tyre.errors import InputError

Piece = tuple[int, int]


@dataclass(frozen=True)
class Parts:
    """Folder of the finished pieces of one sweep; made by :func:`open_parts`."""

    folder: Path

    def file(self, piece: Piece) -> Path:
        """Where the results of items ``piece`` are."""
        return self.folder / f"{piece[0]:012d}-{piece[1]:012d}.npz"

    def has(self, piece: Piece) -> bool:
        """True where the piece is finished; a file that a crash of the machine left damaged does not count."""
        try:
            with zipfile.ZipFile(self.file(piece)) as archive:
                return archive.testzip() is None
        except (OSError, zipfile.BadZipFile):
            return False

    def read(self, piece: Piece) -> dict[str, NDArray[Any]]:
        """Results of a finished piece."""
        with np.load(self.file(piece), allow_pickle=False) as found:
            return dict(found)

    def write(self, piece: Piece, arrays: dict[str, NDArray[Any]]) -> None:
        """Write under another name, make sure it is on the disk, then rename: a kill leaves no half file."""
        temporary = self.file(piece).with_suffix(".tmp")
        try:
            with temporary.open("wb") as stream:
                np.savez(stream, **arrays)  # type: ignore[arg-type]
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(self.file(piece))
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise

    def remove(self) -> None:
        """Delete the folder."""
        shutil.rmtree(self.folder)


def open_parts(out: Path, sweep: Sweep) -> Parts:
    """The folder ``OUT.parts``, new or of an interrupted run of the same sweep.

    Raises
    ------
    InputError
        It holds parts of another sweep, or of another version of the software.
    """
    folder = out.with_name(out.name + ".parts")
    mark = folder / "sweep.json"
    if mark.exists():
        try:
            found = json.loads(mark.read_text(encoding="utf-8")).get("fingerprint")
        except ValueError:
            found = None
        if found != sweep.fingerprint:
            raise InputError(
                f"{folder.as_posix()} holds parts of another sweep (the file, its model or the software has changed); "
                "remove that folder or choose another --out"
            )
        return Parts(folder)
    if folder.exists() and any(folder.glob("*.npz")):
        raise InputError(f"{folder.as_posix()} is in the way and has no sweep.json; remove it or choose another --out")
    folder.mkdir(parents=True, exist_ok=True)
    temporary = mark.with_suffix(".tmp")
    temporary.write_text(json.dumps({"fingerprint": sweep.fingerprint}), encoding="utf-8")
    temporary.replace(mark)
    return Parts(folder)
