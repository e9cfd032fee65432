"""The finished pieces of a sweep on disk: one file each, there whole or not at all."""

import contextlib
import hashlib
import io
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.sweeps.spec import Sweep
from tyre.base.errors import InputError

Piece = tuple[int, int]
DIGEST = 32  # bytes of SHA-256


@dataclass(frozen=True)
class Parts:
    """Folder of the finished pieces of one sweep; made by :func:`open_parts`."""

    folder: Path

    def file(self, piece: Piece) -> Path:
        """Where the results of items ``piece`` are: their SHA-256, then an npz."""
        return self.folder / f"{piece[0]:012d}-{piece[1]:012d}.part"

    def has(self, piece: Piece) -> bool:
        """True where the piece is finished; a file that a crash of the machine left damaged does not count."""
        return self._content(piece) is not None

    def read(self, piece: Piece) -> dict[str, NDArray[Any]]:
        """Results of a finished piece.

        Raises
        ------
        InputError
            It is not there, or damaged.
        """
        content = self._content(piece)
        if content is None:
            raise InputError(f"{self.file(piece).as_posix()} is missing or damaged")
        with np.load(io.BytesIO(content), allow_pickle=False) as found:
            return dict(found)

    def write(self, piece: Piece, arrays: dict[str, NDArray[Any]]) -> None:
        """Write ``arrays`` (any shape) under another name, make sure they are on the disk, then rename.

        A kill leaves no half file.
        """
        temporary, buffer = self.file(piece).with_suffix(".tmp"), io.BytesIO()
        np.savez(buffer, **arrays)  # type: ignore[arg-type]
        content = buffer.getbuffer()
        try:
            with temporary.open("wb") as stream:
                stream.write(hashlib.sha256(content).digest())
                stream.write(content)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(self.file(piece))
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise

    def _content(self, piece: Piece) -> bytes | None:
        try:
            found = self.file(piece).read_bytes()
        except OSError:
            return None
        return found[DIGEST:] if hashlib.sha256(found[DIGEST:]).digest() == found[:DIGEST] else None

    def remove(self) -> None:
        """Delete the folder."""
        shutil.rmtree(self.folder)


def open_parts(out: Path, sweep: Sweep) -> Parts:
    """The folder of parts beside ``out``, new or of an interrupted run of the same sweep.

    Raises
    ------
    InputError
        It holds parts of another sweep, or of another version of the software.
    """
    folder = out.with_name(out.name + ".parts")
    mark = folder / "sweep.json"
    wanted, found = {"fingerprint": sweep.fingerprint}, None
    if mark.exists():
        with contextlib.suppress(ValueError):
            found = json.loads(mark.read_text(encoding="utf-8"))
    if found == wanted:
        return Parts(folder)
    if any(folder.glob("*.part")):
        raise InputError(
            f"{folder.as_posix()} holds parts of another sweep (the file, its model or the software has changed); "
            "remove that folder or choose another --out"
        )
    folder.mkdir(parents=True, exist_ok=True)
    temporary = mark.with_suffix(".tmp")
    temporary.write_text(json.dumps(wanted), encoding="utf-8")
    temporary.replace(mark)
    return Parts(folder)
