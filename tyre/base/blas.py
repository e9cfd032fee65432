"""One thread for BLAS, where many small matrices or threads of our own would only be slowed down by more."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cache
from importlib.util import find_spec
from typing import Any


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS from starting threads of its own meanwhile (where threadpoolctl is installed); also a decorator."""
    with _controller().limit(limits=1, user_api="blas") if find_spec("threadpoolctl") else nullcontext():
        yield


@cache
def _controller() -> Any:
    """What finds the BLAS libraries of this process; looking for them takes milliseconds."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
