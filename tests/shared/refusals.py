"""Refusals of bad input."""

from collections.abc import Callable
from typing import Any

import pytest

from tyre.ground import InputError


def refuses(words: str, action: Callable[..., Any], *given: Any, **named: Any) -> None:
    """Assert that ``action`` refuses what it is given, in a message that matches the pattern ``words``."""
    with pytest.raises(InputError, match=words):
        action(*given, **named)
