"""What the process of a computation does: it runs a command as a terminal would, and tells what the page shows."""

import io
import logging
import os
import shutil
import sys
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from studies.explorer.recording.gathered import gathered
from tyre.base.errors import InputError

FAILED = "this could not be computed; the terminal of velotyre explore says why"
GENTLY = 5  # of the priority, so that the page stays quick
AHEAD = (
    "matplotlib.figure", "studies.cli", "studies.explorer.recording.shown", "studies.look.drafts",
    "studies.explorer.recording.shown_diagnosis", "studies.explorer.recording.shown_tyre",
)  # fmt: skip
"""Imported before an order comes: it takes longer than a look."""


def work(pipe: Connection) -> None:
    """Wait for an order, run a command and tell of it; then wait for the next.

    Parameters
    ----------
    pipe : multiprocessing.connection.Connection
        Gives ``(folder, kind, arguments)``: where to run, the folder in it that is emptied first and gets the results,
        and the command line. Gets ``("progress", dict)``, then ``("done", dict)`` or ``("failed", words)``, and last
        ``("free", None)`` if the next order may come; after a fault it is not known what is left behind, and the
        process ends.
    """
    os.environ["MPLBACKEND"] = "Agg"
    if hasattr(os, "nice"):
        os.nice(GENTLY)
    for name in AHEAD:
        import_module(name)
    sound = True
    while sound:
        try:
            folder, kind, arguments = pipe.recv()
        except EOFError:  # nobody wants anything any more
            return
        os.chdir(folder)
        shutil.rmtree(kind, ignore_errors=True)
        Path(kind).mkdir()
        try:
            pipe.send(("done", _answer(kind, arguments, pipe)))
        except InputError as error:
            pipe.send(("failed", str(error)))
        except OSError as error:
            pipe.send(("failed", f"{error.filename or 'a file'}: {error.strerror or error}"))
        except Exception:
            logging.getLogger(__name__).exception("no answer")
            pipe.send(("failed", FAILED))
            sound = False
        os.chdir(Path(folder).anchor)  # so that the folder can be deleted
        if sound:
            pipe.send(("free", None))
    pipe.close()


def _answer(kind: str, arguments: list[str], pipe: Connection) -> dict[str, Any]:
    import click

    from studies.cli import build
    from studies.explorer.recording.shown import shown_of
    from tyre.base.progress import progress_told

    def tell(bar: dict[str, Any]) -> None:
        pipe.send(("progress", {key: bar.get(key) for key in ("n", "unit", "prefix", "postfix")}))

    printed, noted = io.StringIO(), io.StringIO()
    terminal = sys.stderr
    try:
        with ExitStack() as until_the_end, redirect_stdout(printed), redirect_stderr(noted), progress_told(tell):
            command = build()
            if kind == "tyre_fit":
                until_the_end.enter_context(gathered(Path()))
            found = command.main(args=arguments, prog_name="velotyre", standalone_mode=False, obj=until_the_end)
            seen = shown_of(kind, found)
    except click.ClickException as error:
        raise InputError(error.format_message()) from error
    except InputError:
        raise
    except Exception:
        terminal.write(noted.getvalue())
        raise
    return seen | {"printed": printed.getvalue(), "notes": noted.getvalue().splitlines()}
