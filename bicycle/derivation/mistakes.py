"""Mistakes in the Python files of users: what went wrong and where, in one line."""

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tyre.base.errors import InputError

OWN = "bicycle."  # a fault of velotyre itself keeps its traceback


def said(error: BaseException) -> str:
    """Kind and text of an ``error``."""
    return f"{type(error).__name__}: {error}"


def line_of(error: BaseException, path: Path) -> str:
    """``, line 8``: the last line of a file that an ``error`` passed; empty where it passed none.

    Parameters
    ----------
    error : BaseException
    path : Path
        Python file.
    """
    calls = traceback.extract_tb(error.__traceback__)
    lines = [call.lineno for call in calls if Path(call.filename) == path.resolve()]
    return f", line {lines[-1]}" if lines else ""


@contextmanager
def applying(effect: type) -> Iterator[None]:
    """Say in one line what goes wrong when an effect that is not velotyre's own is added to the equations.

    Parameters
    ----------
    effect : type
        Its class.

    Raises
    ------
    InputError
        Any error of the block, with file and line.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        file = getattr(sys.modules.get(effect.__module__), "__file__", None)
        if file is None or effect.__module__.startswith(OWN):
            raise
        name = getattr(effect, "identifier", effect.__name__)
        raise InputError(
            f"{file}{line_of(error, Path(file))}: effect {name!r} cannot be added to the equations: {said(error)}; "
            "mend its apply (docs/add_an_effect.md shows one)"
        ) from error
