"""Worker processes that know the effects from outside the package which this process knows."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

from bicycle.effect.registry import outside_origins, take_over
from tyre.base.parallel import worker_pool


@contextmanager
def model_workers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Open a :func:`tyre.base.parallel.worker_pool` for work on models.

    Parameters
    ----------
    jobs : int
        Number of processes.

    Yields
    ------
    concurrent.futures.ProcessPoolExecutor

    Raises
    ------
    InputError
        An effect was defined in a session, where no other process can find it.
    """
    origins = outside_origins()
    for origin in origins:
        origin.check_importable()
    with worker_pool(jobs, prepare=take_over if origins else None, arguments=(origins,) if origins else ()) as pool:
        yield pool
