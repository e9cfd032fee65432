"""Packages that velotyre can do without: imported when they are asked for, with the way to install them."""

from importlib import import_module
from typing import Any


def optional_module(name: str, *, extra: str) -> Any:
    """Import a package that comes with an extra of velotyre.

    Parameters
    ----------
    name : str
        Of the package.
    extra : str
        Of velotyre, whose installation brings it.

    Raises
    ------
    ImportError
        It is not installed; the message tells how to install it.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise ImportError(f'{name} is not installed; install it with: pip install "velotyre[{extra}]"') from error
