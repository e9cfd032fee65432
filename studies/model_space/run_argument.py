"""A recording and its speed as one word of a command line: RUN.csv@4.8."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bicycle.identification.recording import FASTEST, Run
from tyre.ground.errors import InputError
from tyre.ground.files import own_ends
from tyre.ground.number_with_unit import typed_numbers


def file_and_speed(text: str, *, may_stand: bool = False) -> tuple[Path, float]:
    """Read the file and the speed (m/s) of a ``text`` such as ``run01.csv@4.8``; 0 only if it ``may_stand``."""
    name, _, at = text.rpartition("@")
    speeds = typed_numbers([at], "m/s")
    if not name or not speeds or not 0 <= speeds[0] <= FASTEST:
        raise InputError(f"{text!r}: give a file and its speed in m/s (up to {FASTEST:g}), as run01.csv@4.8")
    if speeds[0] == 0 and not may_stand:
        raise InputError(f"{text!r}: the speed must be above 0; only `velotyre modal` reads a bicycle at rest")
    return Path(name), speeds[0]


def ride_file_and_speed(text: str) -> tuple[Path, float | None]:
    """Read the file and the speed (m/s) of a ride, ``ride.csv@4.8``; without ``@`` its speed is in the file: None."""
    if "@" not in text or Path(text).is_file():  # a name may hold an @
        return Path(text), None
    return file_and_speed(text)


def name_apart(read: Sequence[tuple[Path, Sequence[Run]]]) -> list[Run]:
    """Name each of the runs ``read`` from files by the shortest end of its path that no other has."""
    ends = own_ends(file for file, _ in read)
    return [replace(run, name=ends[file] + run.name.removeprefix(file.name)) for file, runs in read for run in runs]
