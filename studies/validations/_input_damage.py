"""Damage of an input that keeps most of its structure: keys, values, rows, cells, letters and bytes."""

import io
import random
import zipfile
import zlib

from studies.validations._input_bytes import BYTES, block_moved, cut_off, flip
from studies.validations._input_cells import CELLS
from studies.validations._input_text import TEXT, deep_nesting, number_scaled, word_replaced
from studies.validations._input_trees import TREE, Way


def damaged(content: bytes, name: str, rng: random.Random) -> tuple[bytes, str]:
    """Damage a file, one to three times.

    Parameters
    ----------
    content : bytes
        Of a valid example.
    name : str
        Of the file; its ending says which structure it has.
    rng : random.Random

    Returns
    -------
    content : bytes
    what : str
        What was done, for the record.
    """
    ending = name.rsplit(".", 1)[-1].lower() if "." in name else ""
    ways: tuple[Way, ...] = _WAYS.get(ending, BYTES)
    said = []
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3))):
        way = rng.choice(ways)
        try:
            content = way(content, rng)
        except (
            ValueError,
            RecursionError,
            IndexError,
            KeyError,
            TypeError,
            OverflowError,
            zlib.error,
            zipfile.BadZipFile,
            NotImplementedError,
        ):  # damaged before
            way = flip
            content = way(content, rng)
        said.append(way.__name__.strip("_").replace("_", " "))
    return content, ", ".join(said)


def _in_the_archive(content: bytes, rng: random.Random) -> bytes:
    """Damage a member of a ZIP archive (workbooks are such) and pack it again, so that its checksum holds."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    victim = rng.choice([name for name in members if "sheet1" in name] * 3 + list(members))
    way = rng.choice((flip, word_replaced, cut_off, block_moved, number_scaled))
    members[victim] = way(members[victim], rng)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, inside in members.items():
            archive.writestr(name, inside)
    return packed.getvalue()


_WAYS: dict[str, tuple[Way, ...]] = {
    "toml": (*TREE, *TREE, *TREE, *TEXT, deep_nesting), "csv": (*CELLS, *CELLS, *TEXT), "tsv": (*CELLS, *CELLS, *TEXT),
    "xlsx": (_in_the_archive, _in_the_archive, *BYTES),
} | dict.fromkeys(("txt", "yml", "yaml", "tir", "tdx", "json", "address"), TEXT)  # fmt: skip
