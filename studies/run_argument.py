"""A recording and its speed as one word of a command line: RUN.csv@4.8."""

from pathlib import Path

from bicycle.identification.recording import FASTEST
from tyre.base.errors import InputError


def file_and_speed(text: str) -> tuple[Path, float]:
    """The file and the speed (m/s) of a ``text`` such as ``run01.csv@4.8``.

    Raises
    ------
    InputError
        No file, no speed, or one that is not above 0 and up to :data:`FASTEST`.
    """
    name, _, at = text.rpartition("@")
    try:
        speed = float(at)
    except ValueError:
        speed = 0.0
    if not name or not 0 < speed <= FASTEST:
        raise InputError(f"{text!r}: give a file and its speed in m/s (up to {FASTEST:g}), as run01.csv@4.8")
    return Path(name), speed
