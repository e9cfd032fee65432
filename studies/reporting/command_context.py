"""Command line of the running command: its arguments, the example of its help, ``--verbose``, and versions."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version

import click

ARGUMENTS = "velotyre.arguments"
"""Key of click's ``meta`` that holds the arguments of the command line."""
VERBOSE = "velotyre.verbose"


def example(*lines: str) -> str:
    r"""Write the epilogue of a command: ``lines`` that run as they stand (``\b`` keeps click from joining them)."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in lines)


def _remember(context: click.Context, parameter: click.Parameter, value: bool) -> None:  # noqa: FBT001 (as click calls it)
    context.meta[VERBOSE] = value


verbose = click.option("--verbose", is_flag=True, expose_value=False, callback=_remember, help="Show notes in full.")
"""Option of every command that prints warnings."""


def version_of(name: str) -> str:
    """Version of an installed distribution, or ``not installed`` (a checkout without installation has none)."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def made_by() -> str:
    """Last paragraph of a report."""
    return f"\n\nMade by velotyre {version_of('velotyre')}.\n"


@contextmanager
def count_seconds(*, after: float = 2.0, interval: float = 1.0) -> Iterator[None]:
    """Count seconds on standard error, if it is a terminal and the block takes longer than ``after`` s."""
    if not sys.stderr.isatty():
        yield
        return
    finished, begun, printed = threading.Event(), time.monotonic(), threading.Event()

    def tell() -> None:
        wait = after
        while not finished.wait(wait):
            bars = getattr(sys.modules.get("tqdm.std"), "tqdm", None)
            if not getattr(bars, "_instances", ()):
                printed.set()
                seconds = time.monotonic() - begun
                click.echo(f"\r\x1b[Kvelotyre: {seconds:.0f} s\r", err=True, nl=False)  # what comes next stands over it
            wait = interval

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        finished.set()
        teller.join()
        if printed.is_set():
            click.echo("\r\x1b[K", err=True, nl=False)
