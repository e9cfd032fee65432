"""What numba compiles is told: the first sweep in batches waits for it about half a minute, once on a machine."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bicycle.eigenvalues.solvers import compiled, default_solver
from tyre.base.progress import progress_bar

COMPILING = "compiling, once on this machine, about half a minute"


@contextmanager
def compilation_told(*, show: bool) -> Iterator[None]:
    """Within the block a bar counts the functions that are compiled; none where all are at hand.

    Parameters
    ----------
    show : bool
        False shows nothing anywhere.
    """
    if default_solver() is not compiled or not show:
        yield
        return
    from numba.core import event

    class Told(event.Listener):
        bar: Any = None

        def on_start(self, event: Any) -> None:
            if self.bar is None:
                self.bar = progress_bar(desc=COMPILING, unit=" functions", leave=False)

        def on_end(self, event: Any) -> None:
            self.bar.update()

    told = Told()
    try:
        with event.install_listener("numba:compile", told):
            yield
    finally:
        if told.bar is not None:
            told.bar.close()
