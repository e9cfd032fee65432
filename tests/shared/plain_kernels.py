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


def put_roots(track: Any, bicycle: int | slice, slot: int, values: Any, slopes: Any) -> None:
    """Complex ``values`` and ``slopes`` as those of a node of a kernel's ``track``."""
    track.re[bicycle, slot], track.im[bicycle, slot] = values.real, values.imag
    track.dre[bicycle, slot], track.dim[bicycle, slot] = slopes.real, slopes.imag
