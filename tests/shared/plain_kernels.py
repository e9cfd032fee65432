"""Kernels as plain Python: what they say, without waiting for the compiler."""

from collections.abc import Callable
from types import FunctionType
from typing import Any


def plain(kernel: Any) -> Callable[..., Any]:
    """A ``kernel`` and all that it calls, not compiled."""
    function = kernel.py_func
    names = dict(function.__globals__)
    called = {name for name in function.__code__.co_names if hasattr(names.get(name), "py_func")}
    return FunctionType(function.__code__, names | {name: plain(names[name]) for name in called})
