"""``velotyre front-frame FILE``: stiffness and hinges of a front frame from a file of measurements."""

from pathlib import Path

from tyre.ground.errors import InputError


def report_front_file(file: Path, *, bicycle: str | None, out: Path | None, json_file: str | None, force: bool) -> None:
    """Fit the front frame to the measurements of a ``file`` of kind standing, print the result and write it.

    ``bicycle`` is a packaged name or a file, used in place of the one that the ``file`` names; ``out`` takes the model
    file, ``json_file`` the numbers (``-``: standard output). Existing files are overwritten with ``force`` only.
    """
    raise InputError(f"{file}: files of kind standing are not read yet")
