"""Loop, threads, processes or dask cluster that compute the parts of a sweep, and the size of a part."""

import ctypes
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, ThreadPoolExecutor, wait
from typing import Any

from studies.sweep.specification import Sweep
from studies.sweep.worker import SLOW_ITEMS, block_items, slow
from tyre.ground.errors import InputError
from tyre.ground.workers import one_blas_thread, worker_pool

Piece = tuple[int, int]
Work = Callable[[int, int], Any]
Results = Iterator[tuple[Piece, Any]]
Engine = Callable[[Work, Iterable[Piece]], Results]
PATIENCE = 30  # seconds to reach a scheduler, and without a worker
MOST_SLOW = 4096  # bicycles in a part if each is worked on by itself: some seconds of work, which a kill may cost


def in_loop() -> Engine:
    """One piece after the other, here."""
    return lambda work, pieces: ((piece, work(*piece)) for piece in pieces)


def in_threads(workers: int) -> Engine:
    """Threads of this process; numpy leaves the interpreter free."""

    def run(work: Work, pieces: Iterable[Piece]) -> Results:
        with one_blas_thread(), ThreadPoolExecutor(workers) as pool:
            yield from _spread(pool, work, pieces, workers)

    return run


def in_processes(workers: int) -> Engine:
    """Processes of this machine."""

    def run(work: Work, pieces: Iterable[Piece]) -> Results:
        with worker_pool(workers) as pool:
            yield from _spread(pool, work, pieces, workers)

    return run


def on_cluster(address: str) -> Engine:
    """Workers of a dask.distributed scheduler at an address such as tcp://host:8786."""

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
            lost = f"all workers of {address} are lost; start new ones with 'dask worker {address}'"
            try:
                yield from _spread(client.get_executor(pure=False), work, pieces, workers, client.nthreads, lost)
            except KilledWorker as error:
                raise InputError(f"workers of {address} died on the same points") from error
            except (CancelledError, OSError) as error:
                raise InputError(f"the connection to the scheduler at {address} was lost") from error

    return run


def on_this_machine(sweep: Sweep, workers: int) -> Engine:
    """Workers of this machine: processes if many bicycles are tracked one by one, which threads cannot share."""
    many = sweep.items >= 256  # a process takes a second to start
    return in_processes(workers) if workers > 1 and slow(sweep) and many else in_threads(workers)


def _keep_freed_memory() -> None:
    """Let a worker reuse the memory of its short-lived arrays: dask has it given back at once, at twice the time."""
    libc = ctypes.CDLL(None) if sys.platform == "linux" else None
    if libc and hasattr(libc, "mallopt"):
        for threshold in (-1, -3):  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of glibc's malloc.h
            libc.mallopt(threshold, 2**25)


def _spread(
    pool: Executor | Any,
    work: Work,
    pieces: Iterable[Piece],
    workers: int,
    alive: Callable[[], Any] = lambda: True,
    lost: str = "",
) -> Results:
    """Results as they finish; each worker has two pieces ahead, so that memory stays flat."""
    waiting = iter(pieces)
    running: dict[Any, Piece] = {}
    try:
        while True:
            while len(running) < 3 * workers and (piece := next(waiting, None)) is not None:
                running[pool.submit(work, *piece)] = piece
            if not running:
                return
            finished = wait(running, timeout=PATIENCE, return_when=FIRST_COMPLETED).done
            if not finished and not alive():
                raise InputError(lost)
            for future in finished:
                yield running.pop(future), future.result()
    finally:
        for future in running:
            future.cancel()


def usual_items(sweep: Sweep) -> int:
    """Bicycles in a part: whole blocks, and a thousandth of the sweep if each bicycle is worked on by itself."""
    block, most = block_items(sweep), max(1, sweep.points_per_part // sweep.points_per_item)
    if slow(sweep):
        most = min(most, max(SLOW_ITEMS, min(sweep.items // 1000, MOST_SLOW)))
    return math.ceil(most / block) * block
