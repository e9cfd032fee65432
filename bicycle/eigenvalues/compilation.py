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
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import AnnotateTypes

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


class _AsItIs(JITCodeLibrary):
    def _optimize_final_module(self) -> None:
        pass


@register_pass(mutates_CFG=False, analysis_only=True)
class _LeaveToCallers(LoweringPass):
    _name = "leave_to_callers"

    def __init__(self) -> None:  # abstract in numba
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        state.library = _AsItIs(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return False


class _Within(CompilerBase):
    """The default compiler, but for the optimisation of what callers optimise again as a part of theirs."""

    def define_pipelines(self) -> list[Any]:
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_LeaveToCallers, AnnotateTypes)
        passes.finalize()
        return [passes]


class _ForKernels(CPUDispatcher):
    def __call__(self, *_: Any) -> None:  # without a wrapper for Python the process would end
        raise TypeError(f"{self.py_func.__name__} is compiled for other compiled functions; Python cannot call it")


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
    return _kept(function)


def compiled_within(function: Callable[..., Any]) -> Any:
    """As :func:`compiled`, for a function that others call which are compiled: Python cannot, and waits a third less.

    Every caller takes the whole of it in and optimises it with its own. By itself it is not optimised therefore.
    Called from Python it raises a ``TypeError``.

    Parameters
    ----------
    function : callable
        As in :func:`compiled`.

    Raises
    ------
    RuntimeError
        As in :func:`compiled`.
    """
    dispatcher = _kept(function, pipeline_class=_Within, no_cpython_wrapper=True)
    dispatcher.__class__ = _ForKernels
    return dispatcher


def _kept(function: Callable[..., Any], **options: Any) -> Any:
    # nothing in C calls it
    dispatcher = numba.njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)
    dispatcher._cache = _Kept(function)  # as cache=True does, with numba's own
    return dispatcher
