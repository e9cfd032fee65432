"""Where the chunks of a sweep run: a plain loop, threads, processes or a dask cluster; results come as they finish."""

import ctypes
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, ThreadPoolExecutor, wait
from typing import Any

from tyre.base.errors import InputError
from tyre.base.parallel import one_blas_thread, worker_pool

Piece = tuple[int, int]
Work = Callable[[int, int], Any]
Results = Iterator[tuple[Piece, Any]]
Engine = Callable[[Work, Iterable[Piece]], Results]
AHEAD = 2  # pieces handed out per worker beyond the one it works on: memory stays flat
PATIENCE = 30  # seconds to reach a scheduler, and without a worker
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h
KEPT_BYTES = 2**25


class NoWorkers(Exception):
    """Nobody is left to work."""


def in_loop() -> Engine:
    """One piece after the other, here."""
    return lambda work, pieces: ((piece, work(*piece)) for piece in pieces)


def in_threads(workers: int) -> Engine:
    """Threads of this process, a number ``workers``; numpy and the compiled kernel leave the interpreter free."""

    def run(work: Work, pieces: Iterable[Piece]) -> Results:
        with one_blas_thread(), ThreadPoolExecutor(workers) as pool:
            yield from _spread(pool, work, pieces, workers)

    return run


def in_processes(workers: int) -> Engine:
    """Processes of this machine, a number ``workers``."""

    def run(work: Work, pieces: Iterable[Piece]) -> Results:
        from concurrent.futures.process import BrokenProcessPool

        with worker_pool(workers) as pool:
            try:
                yield from _spread(pool, work, pieces, workers)
            except BrokenProcessPool as error:
                raise InputError("a worker process died (killed, or out of memory)") from error

    return run


def on_cluster(address: str) -> Engine:
    """Run on the workers of a dask.distributed scheduler at ``address``, for example tcp://host:8786."""

    def run(work: Work, pieces: Iterable[Piece]) -> Results:
        from distributed import Client, KilledWorker

        try:
            client = Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError(
                f"no dask scheduler answers at {address} ({error}); start one with 'dask scheduler'"
            ) from error
        with client:
            workers = sum(client.nthreads().values())
            if not workers:
                raise InputError(f"the scheduler at {address} has no workers; start some with 'dask worker {address}'")
            client.run(_keep_freed_memory)
            try:
                yield from _spread(client.get_executor(pure=False), work, pieces, workers, alive=client.nthreads)
            except NoWorkers as error:
                raise InputError(
                    f"all workers of {address} are lost; start new ones with 'dask worker {address}'"
                ) from error
            except KilledWorker as error:
                raise InputError(f"workers of {address} died while they worked on the same points") from error
            except (CancelledError, OSError) as error:
                raise InputError(f"the scheduler at {address} went away") from error

    return run


def _keep_freed_memory() -> None:
    """Let a worker reuse the memory of its short-lived arrays: dask has it given back at once, at twice the time."""
    libc = ctypes.CDLL(None) if sys.platform == "linux" else None
    if libc and hasattr(libc, "mallopt"):
        for threshold in (M_TRIM_THRESHOLD, M_MMAP_THRESHOLD):
            libc.mallopt(threshold, KEPT_BYTES)


def _spread(
    pool: Executor | Any, work: Work, pieces: Iterable[Piece], workers: int, alive: Callable[[], Any] = lambda: True
) -> Results:
    rest = iter(pieces)
    running: dict[Any, Piece] = {}
    try:
        while True:
            while len(running) < workers * (1 + AHEAD) and (piece := next(rest, None)) is not None:
                running[pool.submit(work, *piece)] = piece
            if not running:
                return
            done = wait(running, timeout=PATIENCE, return_when=FIRST_COMPLETED).done
            if not done and not alive():
                raise NoWorkers
            for future in done:
                yield running.pop(future), future.result()
    finally:
        for future in running:
            future.cancel()
