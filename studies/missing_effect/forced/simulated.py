"""The table that ``velotyre simulate --frequency-response`` writes: a row per frequency, two columns per output."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bicycle.responses.response import column
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError

WIDE = "a table of velotyre simulate --frequency-response"
FREQUENCY = "frequency_Hz"
_GAIN = re.compile(r"(\w+?)_per_(\w+)")


def is_wide(header: Sequence[str]) -> bool:
    """Whether the columns of a ``header`` are those of such a table."""
    return FREQUENCY in header and any("_per_" in name for name in header)


def read_wide(
    path: Path, inputs: Mapping[str, str], outputs: Mapping[str, str], units: Mapping[str, str]
) -> tuple[list[tuple[str, str, float, complex]], tuple[str, ...]]:
    """Input, output, frequency (Hz) and complex gain (SI) of every row, and the outputs that are not compared.

    Parameters
    ----------
    path : Path
    inputs : mapping of str to str
        Name -> quantity.
    outputs : mapping of str to str
        Of those that are compared: name -> SI unit.
    units : mapping of str to str
        Quantity -> SI unit.

    Raises
    ------
    InputError
        See :func:`read_columns`; an input that is not known, no output that is compared.
    """
    columns = read_columns(path, numbers=_every(path), needed=(FREQUENCY,)).numbers
    sources = {column(name, units[quantity]): name for name, quantity in inputs.items()}
    shown = {column(name, unit): name for name, unit in outputs.items()}
    found: list[tuple[str, str, float, complex]] = []
    left: list[str] = []
    for name, size in columns.items():
        match = _GAIN.fullmatch(name)
        if match is None:
            continue
        if match[2] not in sources:
            raise InputError(f"{path}: {name}: a response to {match[2]} is not compared; known: {', '.join(sources)}")
        output = shown.get(match[1])
        phase = f"{output}_phase_rad"
        if output is None or phase not in columns:
            left.append(name)
            continue
        gains = size * np.exp(1j * columns[phase])
        found += [
            (sources[match[2]], output, float(f), complex(h)) for f, h in zip(columns[FREQUENCY], gains, strict=True)
        ]
    if not found:
        raise InputError(f"{path}: no output that is compared; known: {', '.join(shown)}")
    return found, tuple(left)


def _every(path: Path) -> list[str]:
    """Names of all columns: they follow from the model that was simulated."""
    return [name.strip() for name in path.read_text(encoding="utf-8-sig").partition("\n")[0].split(",")]
