"""The finished pieces of a sweep on disk: one file each, there whole or not at all."""

import contextlib
import hashlib
import io
import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.sweeps.made_of import differences
from studies.sweeps.part_size import usual_items
from studies.sweeps.spec import Sweep
from tyre.base.errors import InputError
from tyre.base.files import write_text

Piece = tuple[int, int]
DIGEST = 32  # bytes of SHA-256


@dataclass(frozen=True)
class Parts:
    """Folder of the finished pieces of one sweep; made by :func:`open_parts`."""

    folder: Path
    fingerprint: str
    items: int
    """Number of bicycles in a part."""

    def file(self, piece: Piece) -> Path:
        """Where the results of items ``piece`` are: a SHA-256 of them, their place and the sweep, then an npz."""
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

    def groups(self, pieces: Iterable[Piece], *, most_bytes: int) -> Iterator[tuple[int, dict[str, NDArray[Any]]]]:
        """Finished pieces joined along their items: first item and arrays, of about so many bytes.

        Parameters
        ----------
        pieces : iterable of tuple of int, shape (2,)
            In order, without gaps.
        most_bytes : int
            Bytes at which a group is full.
        """
        start, held, size = 0, list[dict[str, NDArray[Any]]](), 0
        for piece in pieces:
            start = piece[0] if not held else start
            held.append(self.read(piece))
            size += sum(array.nbytes for array in held[-1].values())
            if size >= most_bytes:
                yield start, _joined(held)
                held, size = [], 0
        if held:
            yield start, _joined(held)

    def write(self, piece: Piece, arrays: dict[str, NDArray[Any]]) -> None:
        """Write ``arrays`` (any shape) under another name, make sure they are on the disk, then rename.

        A kill leaves no half file.
        """
        temporary, buffer = self.file(piece).with_suffix(".tmp"), io.BytesIO()
        np.savez(buffer, **arrays)  # type: ignore[arg-type]
        content = buffer.getbuffer()
        try:
            with temporary.open("wb") as stream:
                stream.write(self._digest(piece, content))
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
        return found[DIGEST:] if self._digest(piece, found[DIGEST:]) == found[:DIGEST] else None

    def _digest(self, piece: Piece, content: bytes | memoryview) -> bytes:
        """Of a part and of what it is: one of another place or another sweep is as good as damaged."""
        digest = hashlib.sha256(json.dumps([self.fingerprint, *piece]).encode())
        digest.update(content)
        return digest.digest()

    def remove(self) -> None:
        """Delete the folder."""
        shutil.rmtree(self.folder)


def open_parts(out: Path, sweep: Sweep, items: Callable[[], int] | None = None) -> Parts:
    """The folder of parts beside ``out``, new or of an interrupted run of the same sweep.

    Parameters
    ----------
    out : Path
    sweep : Sweep
    items : callable, optional
        Gives the number of bicycles in a part, where no run has settled it before; the usual one by default.

    Raises
    ------
    InputError
        It holds parts of another sweep, or made with other tyre data, source or versions of the software.
    """
    folder = out.with_name(out.name + ".parts")
    mark = folder / "sweep.json"
    found: Any = None
    if mark.exists():
        with contextlib.suppress(ValueError):
            found = json.loads(mark.read_text(encoding="utf-8"))
    found = found if isinstance(found, dict) else {}
    same = found.get("fingerprint") == sweep.fingerprint
    if same and isinstance(found.get("items"), int) and found["items"] > 0:
        return Parts(folder, sweep.fingerprint, found["items"])
    if any(folder.glob("*.part")):
        changed = differences(None if same else found.get("made_of"), sweep.made_of)
        raise InputError(
            f"{folder.as_posix()} holds parts of another sweep; changed since: {changed}. "
            "To start anew, remove that folder or choose another --out"
        )
    folder.mkdir(parents=True, exist_ok=True)
    count = items() if items else usual_items(sweep)
    wanted = {"fingerprint": sweep.fingerprint, "items": count, "made_of": sweep.made_of}
    write_text(mark, json.dumps(wanted, indent=1))
    return Parts(folder, sweep.fingerprint, count)


def _joined(held: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    return {name: np.concatenate([one[name] for one in held]) for name in held[0]} if len(held) > 1 else held[0]
