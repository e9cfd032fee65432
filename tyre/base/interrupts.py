"""Ctrl-C that falls into a callback of the interpreter, which swallows exceptions: it ends the command all the same."""

import _thread
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

SOON = 0.05  # s: by then the callback has returned


@contextmanager
def interrupts_arrive() -> Iterator[None]:
    """Within the block a KeyboardInterrupt that nobody could raise further (in ``__del__``, in a weak reference's
    callback, where Python prints it and goes on) interrupts the main thread again.
    """
    before = sys.unraisablehook

    def again(found: "sys.UnraisableHookArgs") -> None:
        if found.exc_type is not None and issubclass(found.exc_type, KeyboardInterrupt):
            threading.Timer(SOON, _thread.interrupt_main).start()
        else:
            before(found)

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = before
