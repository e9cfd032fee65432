"""Progress bars and interrupts of long commands, and packages that velotyre can do without."""

import _thread
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

NOT_INSTALLED = "{} is not installed; install it with: {} ([all] instead of [{}] installs every extra)"


def progress_bar(items: Iterable[Any] | None = None, *, show: bool = True, **settings: Any) -> Any:
    """Make a ``tqdm`` on standard error, shown only on a terminal, and nowhere without ``show``."""
    from tqdm import tqdm

    return tqdm(items, disable=None if show else True, file=sys.stderr, **settings)


@contextmanager
def interrupts_arrive() -> Iterator[None]:
    """Let a KeyboardInterrupt that Python swallows (in ``__del__``, in a callback) interrupt the main thread again."""
    before = sys.unraisablehook

    def again(unraisable: "sys.UnraisableHookArgs") -> None:
        if unraisable.exc_type is not None and issubclass(unraisable.exc_type, KeyboardInterrupt):
            threading.Timer(0.05, _thread.interrupt_main).start()  # s: by then the callback has returned
        else:
            before(unraisable)

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = before


def optional_module(name: str, *, extra: str) -> Any:
    """Import a package that comes with an extra of velotyre."""
    try:
        return import_module(name)
    except ImportError as error:
        raise ImportError(missing_package_text(name, extra=extra)) from error


def missing_package_text(name: str, *, extra: str) -> str:
    """Say that a package is missing, and the ``extra`` of velotyre that installs it."""
    return NOT_INSTALLED.format(name, install_command(extra), extra)


def install_command(extra: str) -> str:
    """Give the command that adds an ``extra`` to this velotyre, from where it was installed."""
    import json  # here: they are slow to import, and seldom needed
    from importlib.metadata import distributions
    from urllib.parse import urlsplit
    from urllib.request import url2pathname

    recorded = (distribution.read_text("direct_url.json") for distribution in distributions(name="velotyre"))
    origin = json.loads(next(filter(None, recorded), "{}"))
    source, option = f"velotyre[{extra}]", ""
    if "dir_info" in origin:
        source = f"{url2pathname(urlsplit(origin['url']).path)}[{extra}]"
        option = "-e " if origin["dir_info"].get("editable") else ""
    elif origin:
        kind = f"{origin['vcs_info']['vcs']}+" if "vcs_info" in origin else ""
        source = f"{source} @ {kind}{origin['url']}"
    return f'pip install {option}"{source}"'
