"""Packages that velotyre can do without: imported when they are asked for, with the way to install them."""

import json
from importlib import import_module
from importlib.metadata import distributions
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname


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
        raise ImportError(not_installed(name, extra=extra)) from error


def not_installed(name: str, *, extra: str) -> str:
    """What is said where a package called ``name`` is missing, which an ``extra`` of velotyre brings."""
    return f"{name} is not installed; install it with: {install_command(extra)}"


def install_command(extra: str) -> str:
    """The command that adds an ``extra`` to this velotyre: from where it was installed, an index, a folder or a file.

    The origin is what installers record (https://packaging.python.org/specifications/direct-url/).
    """
    recorded = (found.read_text("direct_url.json") for found in distributions(name="velotyre"))
    origin = json.loads(next(filter(None, recorded), "{}"))
    if "dir_info" in origin:
        folder = url2pathname(urlsplit(origin["url"]).path)
        return f'pip install {"-e " if origin["dir_info"].get("editable") else ""}"{folder}[{extra}]"'
    if not origin:
        return f'pip install "velotyre[{extra}]"'
    kind = f"{origin['vcs_info']['vcs']}+" if "vcs_info" in origin else ""
    return f'pip install "velotyre[{extra}] @ {kind}{origin["url"]}"'
