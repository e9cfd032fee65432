"""Progress bars and interrupts of long commands, and packages that velotyre can do without."""

import _thread
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from io import StringIO
from typing import Any

_told: list[Callable[[dict[str, Any]], None]] = []


@contextmanager
def progress_told(tell: Callable[[dict[str, Any]], None]) -> Iterator[None]:
    """Let bars within the block tell a function (the ``format_dict`` of tqdm) instead of a terminal."""
    _told.append(tell)
    try:
        yield
    finally:
        _told.remove(tell)


def progress_bar(items: Iterable[Any] | None = None, *, show: bool = True, **settings: Any) -> Any:
    """Make a ``tqdm`` on standard error, shown only on a terminal, and nowhere without ``show``."""
    from tqdm import tqdm

    if _told and show:
        return _telling(tqdm, _told[-1])(items, file=StringIO(), **settings)
    return tqdm(items, disable=None if show else True, file=sys.stderr, **settings)


def _telling(bar: Any, tell: Callable[[dict[str, Any]], None]) -> Any:
    """Make a tqdm that is told, not drawn: ``display`` is left by tqdm to its heirs."""

    class Telling(bar):
        def display(self, msg: str | None = None, pos: int | None = None) -> bool:
            tell(dict(self.format_dict))
            return True

    return Telling


@contextmanager
def interrupts_arrive() -> Iterator[None]:
    """Let a KeyboardInterrupt that Python swallows (in ``__del__``, in a callback) interrupt the main thread again."""
    before = sys.unraisablehook

    def again(found: "sys.UnraisableHookArgs") -> None:
        if found.exc_type is not None and issubclass(found.exc_type, KeyboardInterrupt):
            threading.Timer(0.05, _thread.interrupt_main).start()  # s: by then the callback has returned
        else:
            before(found)

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
        raise ImportError(not_installed(name, extra=extra)) from error


def not_installed(name: str, *, extra: str) -> str:
    """Say that a package is missing, which an ``extra`` of velotyre brings."""
    return f"{name} is not installed; install it with: {install_command(extra)}"


def install_command(extra: str) -> str:
    """Give the command that adds an ``extra`` to this velotyre, from where it was installed."""
    import json  # here: they are slow to import, and seldom needed
    from importlib.metadata import distributions
    from urllib.parse import urlsplit
    from urllib.request import url2pathname

    recorded = (found.read_text("direct_url.json") for found in distributions(name="velotyre"))
    origin = json.loads(next(filter(None, recorded), "{}"))
    if "dir_info" in origin:
        folder = url2pathname(urlsplit(origin["url"]).path)
        return f'pip install {"-e " if origin["dir_info"].get("editable") else ""}"{folder}[{extra}]"'
    if not origin:
        return f'pip install "velotyre[{extra}]"'
    kind = f"{origin['vcs_info']['vcs']}+" if "vcs_info" in origin else ""
    return f'pip install "velotyre[{extra}] @ {kind}{origin["url"]}"'
