"""Worker processes, and one BLAS thread if ours run beside each other: the one way of the whole house."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing.context import SpawnContext, SpawnProcess
from threading import Thread
from typing import TYPE_CHECKING, Any

from tyre.ground.errors import InputError

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def worker_pool(
    jobs: int, *, prepare: Callable[..., None] | None = None, arguments: tuple[Any, ...] = ()
) -> "Iterator[ProcessPoolExecutor]":
    """Open a pool of fresh processes with one BLAS thread each, perhaps prepared, which end when this one is killed.

    A worker that dies is an InputError.
    """
    from concurrent.futures import ProcessPoolExecutor  # here, so that who only limits BLAS does not pay for it
    from concurrent.futures.process import BrokenProcessPool

    saved = {name: os.environ[name] for name in _ONE_THREAD if name in os.environ}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        with ProcessPoolExecutor(jobs, mp_context=_Quiet(), initializer=_begin, initargs=(prepare, arguments)) as pool:
            yield pool
    except BrokenProcessPool as error:
        raise InputError("a worker process died (killed, or out of memory)") from error
    finally:
        for name in _ONE_THREAD:
            del os.environ[name]
        os.environ.update(saved)


class _Worker(SpawnProcess):
    """A process that is deaf to Ctrl-C until it is there: what it imports would end in a traceback of its own."""

    def start(self) -> None:
        if not hasattr(signal, "pthread_sigmask"):  # Windows
            super().start()
            return
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # a new process has the mask of its parent
        try:
            super().start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)  # here an interrupt comes late, but comes

    def run(self) -> None:
        """Do the work; Ctrl-C while it imports what a piece of work needs ends it without a word, like that in work."""
        try:
            super().run()
        except KeyboardInterrupt:
            os._exit(128 + signal.SIGINT)


class _Quiet(SpawnContext):
    """Fresh processes that are :class:`_Worker`."""

    Process = _Worker


def _begin(prepare: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    """End with the parent; hear Ctrl-C from now on, or go without a word where it came meanwhile; then ``prepare``."""
    Thread(target=end_with_parent, daemon=True).start()
    if hasattr(signal, "pthread_sigmask"):
        if signal.SIGINT in signal.sigpending():
            os._exit(128 + signal.SIGINT)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    if prepare is not None:
        prepare(*arguments)


def end_with_parent() -> None:
    """End this worker when the process that started it is gone: killed, it cannot end its workers."""
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS from starting threads of its own inside ours."""
    with _controller().limit(limits=1, user_api="blas"):
        yield


@cache
def _controller() -> Any:
    """Find the BLAS libraries of this process, once: looking for them takes milliseconds."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
