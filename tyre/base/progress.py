"""The progress bar of every long command: on standard error, and only where that is a terminal."""

import sys
from collections.abc import Iterable
from typing import Any


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

    return tqdm(items, disable=None if show else True, file=sys.stderr, **settings)
