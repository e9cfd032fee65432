"""Finished parts of a sweep in a folder next to its result: one file for each range of bicycles, complete or absent."""

import contextlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from studies.model_space.outputs import OUTPUTS
from studies.sweep.engines import Piece, usual_items
from studies.sweep.labels import coordinates, inner_of
from studies.sweep.specification import Sweep, differences
from studies.sweep.worker import Arrays, stored_names
from tyre.ground.errors import InputError
from tyre.ground.files import make_folder, replacing, write_text


@dataclass(frozen=True)
class Parts:
    """Folder of the finished pieces of one sweep; made by :func:`open_parts`."""

    folder: Path  # RESULT.parts
    items: int  # bicycles in a piece, the last one may have fewer

    def file(self, piece: Piece) -> Path:
        """File (npz, with the check sums of its format) with the results of a ``piece``: first bicycle, one past it."""
        return self.folder / f"{piece[0]:012d}-{piece[1]:012d}.part"

    def has(self, piece: Piece) -> bool:
        """True if there is a file of the ``piece``."""
        return self.file(piece).is_file()

    def read(self, piece: Piece, *names: str) -> Arrays:
        """Results of a finished ``piece`` by name, all without ``names``; InputError if it is missing or damaged."""
        try:
            with self.file(piece).open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
                return {name: arrays[name] for name in names or arrays.files}
        except (OSError, EOFError, KeyError, ValueError, BadZipFile) as error:
            raise InputError(f"{self.file(piece).as_posix()} is missing or damaged") from error

    def write(self, piece: Piece, arrays: Arrays) -> None:
        """Write the results of a ``piece``; a kill leaves no half file."""
        with replacing(self.file(piece)) as target, target.open("wb") as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]

    def drop_damaged(self, sweep: Sweep) -> int:
        """Remove pieces that cannot be read or do not hold what ``sweep`` stores; the number of them."""
        expected, dropped = describe_rows(sweep), 0
        for piece in pieces(sweep, self.items):
            if self.has(piece) and not self._holds(piece, expected):
                self.file(piece).unlink()
                dropped += 1
        return dropped

    def _holds(self, piece: Piece, expected: dict[str, tuple[tuple[int, ...], type]]) -> bool:
        """True if the file of a ``piece`` can be read and has the ``expected`` arrays."""
        try:
            arrays = self.read(piece)
        except InputError:
            return False
        rows = piece[1] - piece[0]
        return {name: (array.shape, array.dtype) for name, array in arrays.items()} == {
            name: ((rows, *inner), np.dtype(kind)) for name, (inner, kind) in expected.items()
        }


def pieces(sweep: Sweep, items: int | None = None) -> Iterator[Piece]:
    """Ranges (first bicycle, one past the last) of ``items`` bicycles that are computed and kept together."""
    step = items or usual_items(sweep)
    return ((start, min(start + step, sweep.items)) for start in range(0, sweep.items, step))


def describe_rows(sweep: Sweep) -> dict[str, tuple[tuple[int, ...], type]]:
    """Shape and type of what is stored of one bicycle, by name."""
    labels = coordinates(sweep)
    rows: dict[str, tuple[tuple[int, ...], type]] = {}
    for name in stored_names(sweep):
        output = OUTPUTS.get(name)
        kind: type = complex if output is not None and output.complex_valued else float
        rows[name] = tuple(len(labels[dim]) for dim in inner_of(name, sweep)), kind
    return rows


def parts_folder(out: Path) -> Path:
    """Folder of the parts of a result ``out``, beside it."""
    return out.with_name(out.name + ".parts")


def open_parts(out: Path, sweep: Sweep) -> Parts:
    """The folder of parts next to ``out``, new or of an interrupted run of the same sweep."""
    folder = parts_folder(out)
    mark = folder / "sweep.json"
    record: dict[str, Any] = {}
    with contextlib.suppress(OSError, ValueError):
        record = dict(json.loads(mark.read_text(encoding="utf-8")))
    same_sweep = record.get("fingerprint") == sweep.fingerprint
    if same_sweep and isinstance(record.get("items"), int) and record["items"] > 0:
        return Parts(folder, record["items"])
    if any(folder.glob("*.part")):
        changed = differences(None if same_sweep else record.get("made_of"), sweep.made_of)
        raise InputError(
            f"{folder.as_posix()} holds parts of another sweep; changed since: {changed}. "
            "To restart, remove that folder or choose another --out"
        )
    make_folder(folder)
    parts = Parts(folder, usual_items(sweep))
    record = {"fingerprint": sweep.fingerprint, "items": parts.items, "made_of": sweep.made_of}
    write_text(mark, json.dumps(record, indent=1))
    return parts
