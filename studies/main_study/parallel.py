"""Work of the study spread over processes that live as long as it; each result in the place of its item."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

Done = TypeVar("Done")


class Each(Protocol):
    """``each(work, items, said)``: ``work(*item)`` of every item; who waits is told of each as ``said`` says."""

    def __call__(
        self, work: Callable[..., Done], items: Iterable[tuple[Any, ...]], said: Callable[..., str]
    ) -> list[Done]:
        """Results of ``work`` on ``items`` in their order; ``said`` makes of an item what is told when it is done."""


@contextmanager
def spread(workers: int, step: Callable[[str], None]) -> Iterator[Each]:
    """Give :class:`Each` of a number of ``workers``, one is this process; ``step`` is told of every item done."""
    if workers < 2:
        yield _here(step)
        return
    from bicycle.effect.workers import model_workers

    with model_workers(workers) as pool:

        def each(work: Callable[..., Done], items: Iterable[tuple[Any, ...]], said: Callable[..., str]) -> list[Done]:
            todo = list(items)
            futures = [pool.submit(work, *item) for item in todo]
            found = []
            for item, future in zip(todo, futures, strict=True):
                found.append(future.result())
                step(said(*item))
            return found

        yield each


def _here(step: Callable[[str], None]) -> Each:
    def each(work: Callable[..., Done], items: Iterable[tuple[Any, ...]], said: Callable[..., str]) -> list[Done]:
        found = []
        for item in items:
            found.append(work(*item))
            step(said(*item))
        return found

    return each
