"""The progress bar of every long command: on standard error, and only where that is a terminal."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from io import StringIO
from typing import Any

_told: list[Callable[[dict[str, Any]], None]] = []


@contextmanager
def progress_told(tell: Callable[[dict[str, Any]], None]) -> Iterator[None]:
    """Within the block, bars that are shown tell a function instead of a terminal.

    Parameters
    ----------
    tell : callable
        Called with the ``format_dict`` of tqdm: ``n``, ``total``, ``unit``, ``prefix``, ``postfix``.
    """
    _told.append(tell)
    try:
        yield
    finally:
        _told.remove(tell)


def progress_bar(items: Iterable[Any] | None = None, *, show: bool = True, **settings: Any) -> Any:
    """``tqdm`` with the settings of the house.

    Parameters
    ----------
    items : iterable, optional
        What is gone through; without it ``update`` moves the bar.
    show : bool
        False shows nothing anywhere.
    settings
        ``total``, ``desc``, ``unit`` and the like.
    """
    from tqdm import tqdm

    if _told and show:
        return _telling(tqdm, _told[-1])(items, file=StringIO(), **settings)
    return tqdm(items, disable=None if show else True, file=sys.stderr, **settings)


def _telling(bar: Any, tell: Callable[[dict[str, Any]], None]) -> Any:
    """A tqdm that is told, not drawn: ``display`` is what tqdm leaves to its heirs."""

    class Telling(bar):
        def display(self, msg: str | None = None, pos: int | None = None) -> bool:
            tell(dict(self.format_dict))
            return True

    return Telling
