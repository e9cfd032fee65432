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
from numba import _dynfunc
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import AnnotateTypes, NativeLowering

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

    def holds_any(self) -> bool:
        try:
            return bool(self._cache_file._load_index())
        except DAMAGED:
            return False


@cache
def _kernels() -> bytes:
    """The text of all kernels."""
    return b"".join(file.read_bytes() for file in sorted(Path(__file__).parents[1].rglob("*_kernel.py")))


class _ForCallers(JITCodeLibrary):
    """Code that is linked into that of callers, and neither optimised nor loaded by itself.

    Were it loaded, the linker would take it where a caller calls it, and leave the caller's own copy: twice as slow.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _LeaveToCallers(LoweringPass):
    _name = "leave_to_callers"

    def __init__(self) -> None:  # abstract in numba
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        state.library = _ForCallers(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        return False


@register_pass(mutates_CFG=False, analysis_only=True)
class _KnownToCallers(LoweringPass):
    _name = "known_to_callers"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        known = state.cr.fndesc
        nowhere = 0
        function = _dynfunc.make_function(
            known.lookup_module(), state.func_id.func_name, "", nowhere, state.cr.env, (state.library,)
        )
        state.targetctx.insert_user_function(function, known, [state.library])
        state.cr = state.cr._replace(cfunc=function)
        return False


class _Within(CompilerBase):
    """The default compiler, but for what callers do with their own: optimise it, make it machine code, load it."""

    def define_pipelines(self) -> list[Any]:
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_LeaveToCallers, AnnotateTypes)
        passes.add_pass_after(_KnownToCallers, NativeLowering)
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
    dispatcher = _numba(function)
    dispatcher._cache = _Kept(function)  # as cache=True does, with numba's own
    return dispatcher


def kept(kernel: Any) -> bool:
    """Whether a ``kernel`` of :func:`compiled` is at hand: in this process, or kept for some arguments."""
    return bool(kernel.signatures) or kernel._cache.holds_any()


def compiled_within(function: Callable[..., Any]) -> Any:
    """As :func:`compiled`, for a function that others call which are compiled: Python cannot.

    Every caller takes the whole of it in, optimises it with its own and keeps it. By itself it is neither optimised,
    loaded nor kept therefore. Called from Python it raises a ``TypeError``.

    Parameters
    ----------
    function : callable
    """
    dispatcher = _numba(function, pipeline_class=_Within, no_cpython_wrapper=True)
    dispatcher.__class__ = _ForKernels
    return dispatcher


def _numba(function: Callable[..., Any], **options: Any) -> Any:
    # nothing in C calls it
    return numba.njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)
