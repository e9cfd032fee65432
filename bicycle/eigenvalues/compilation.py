"""Functions that numba compiles once on a machine: kept beside the source, also where several processes share them.

numba numbers the files of what it keeps and writes its index before them. A process that is killed in between, or
another that reads there, finds under that number what an older source or version left. Here every file has a name of
its own, so that what the index names is what was written for it or is not there; and what cannot be written, as on a
full disk, is compiled again the next time. Kernels call each other across files, and numba looks at the date of one
file: here all kernels are compiled anew when the text of one has changed.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from pickle import UnpicklingError
from typing import Any
from uuid import uuid4

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

DAMAGED = (EOFError, UnpicklingError, ValueError, OSError)


class _OwnNames(IndexDataCacheFile):
    def _data_name(self, number: int) -> str:
        return str(super()._data_name(uuid4().int))

    def save(self, key: Any, data: Any) -> None:
        super().save(key, data)
        folder, named = Path(self._cache_path), set(self._load_index().values())
        for file in folder.glob(f"{self._index_name.removesuffix('.nbi')}.*.nbc"):
            if file.name not in named:  # of an older source or version
                file.unlink(missing_ok=True)


class _Kept(FunctionCache):
    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        source = sha256(_kernels() + Path(function.__code__.co_filename).read_bytes()).hexdigest()
        self._cache_file = _OwnNames(self._cache_path, self._impl.filename_base, source)

    def load_overload(self, *arguments: Any) -> Any:
        try:
            return super().load_overload(*arguments)
        except DAMAGED:
            with suppress(OSError):
                self._cache_file.flush()
            return None

    def save_overload(self, *arguments: Any) -> None:
        with suppress(OSError):
            super().save_overload(*arguments)


@cache
def _kernels() -> bytes:
    """The text of all kernels."""
    return b"".join(file.read_bytes() for file in sorted(Path(__file__).parents[1].rglob("*_kernel.py")))


def compiled(function: Callable[..., Any]) -> Any:
    """The function compiled by numba, which leaves the interpreter free; division by zero gives what numpy gives.

    Parameters
    ----------
    function : callable
        Of a file: what is compiled is kept beside it.

    Raises
    ------
    RuntimeError
        There is no place beside the source, as in a zipped wheel.
    """
    dispatcher = numba.njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True)(function)  # nothing in C calls it
    dispatcher._cache = _Kept(function)  # as cache=True does, with numba's own
    return dispatcher
