"""Channels of TYDEX files, factor and offsets applied, in the units and axes of the file."""

from collections.abc import Sequence
from pathlib import Path

from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Contents, Signal
from tyre.channels.tydex_document import read_document


def tydex_contents(path: Path, reading: Reading) -> Contents:
    """Channels under ``**MEASURCHANNELS``.

    Parameters
    ----------
    path : Path
    reading : Reading
        Holds nothing for this format.
    """
    document = read_document(path)

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        return [Signal(name, document.physical(name)[:most], document.channels[name].unit) for name in names]

    columns = tuple(Column(channel.name, channel.unit) for channel in document.channels.values())
    return Contents(str(path), columns, load)
