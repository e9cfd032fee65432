"""Half of the kernels is compiled by a process of its own while this one compiles the others.

Once on a machine; on two cores in half the time. What went wrong there is compiled here when it is called, as if
nothing had been begun.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing import parent_process
from subprocess import DEVNULL
from threading import Lock
from typing import Any

import numpy as np

from bicycle.eigenvalues.compilation import kept
from bicycle.modal import answer_kernel, follow_kernel, naming_kernel, track_kernel
from bicycle.modal.batch_kind import Roles
from bicycle.modal.naming_kernel import Named

LONGEST = 300.0  # s; then this process compiles by itself
BEGINNING = Lock()


@contextmanager
def compiled_ahead() -> Iterator[None]:
    """Within the block another process compiles its half of :func:`examples`; after it all of them are at hand."""
    with BEGINNING:
        helper = _begun()
    yield
    if helper is None:
        return
    compile_half(1)
    try:
        helper.wait(LONGEST)
    except subprocess.TimeoutExpired:
        helper.kill()
        helper.wait()


@cache
def _begun() -> subprocess.Popen[bytes] | None:
    """The other process; None where nothing is to be compiled, or where others like this one may do the same."""
    alone = parent_process() is None and not getattr(sys, "frozen", False) and sys.executable
    if not alone or all(kept(kernel) for kernel, _ in examples()[0]):
        return None
    command = [sys.executable, "-c", f"from {__name__} import compile_half; compile_half(0)"]
    places = {**os.environ, "PYTHONPATH": os.pathsep.join(place or os.getcwd() for place in sys.path)}
    try:
        return subprocess.Popen(command, env=places, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL)
    except OSError:
        return None


def examples() -> tuple[tuple[tuple[Any, tuple[Any, ...]], ...], ...]:
    """Kernels of the other process and of this one, each with arguments of the types it is called with."""
    n = 2
    track = track_kernel.empty_track(1, n, n)
    whole, unit, table, roots = np.zeros(1, np.int64), np.ones(1), np.ones((1, 1)), np.ones((1, 1, n))
    found = Named(np.zeros((1, n, n), np.int64), np.zeros((1, n, n), np.int64), np.zeros((1, n), np.int64), unit)
    roles = Roles(
        of_state=whole, lean=0, steer=1, yaw=2, number=3, joint=whole, mark=table, first=whole, weight=unit,
        oscillation=whole, singular=False,
    )  # fmt: skip
    return (
        (
            (follow_kernel.link_steps, (track, unit, whole, unit)),
            (naming_kernel.name_all, (track, unit, roles, found, whole)),
        ),
        (
            (answer_kernel.ask_more, (track, found, table, unit, whole, unit)),
            (answer_kernel.answer, (track, found, unit, table, roots, roots, roots.astype(np.int64))),
        ),
    )


def compile_half(half: int) -> None:
    """Compile the kernels of one half of :func:`examples` and keep them.

    Parameters
    ----------
    half : int
        Index: 0 is that of the other process, 1 that of this one.
    """
    from numba import typeof

    for kernel, arguments in examples()[half]:
        kernel.compile(tuple(typeof(x) for x in arguments))
