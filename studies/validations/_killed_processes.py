"""Children of this process that run a command, with what starves them, what they say and who is left of them."""

import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

PATIENCE = 600.0  # s for a whole command


def started(arguments: list[str], folder: Path, restrict: Callable[[], None] | None = None) -> int:
    """Start a command in a child, which has all modules at hand and leads a session of its own.

    Parameters
    ----------
    arguments : list of str
        Of ``velotyre``.
    folder : Path
        Where it runs.
    restrict : callable, optional
        Called in the child before the command.

    Returns
    -------
    int
        Number of the process.
    """
    from studies.cli import main

    said = os.open(_said(os.getpid()), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    process = os.fork()
    if process:
        os.close(said)
        return process
    code = 1
    try:
        os.setsid()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        os.dup2(said, 1)
        os.dup2(said, 2)
        sys.stdout, sys.stderr = (os.fdopen(os.dup(said), "w") for _ in range(2))
        os.chdir(folder)
        if restrict:
            restrict()
        main(arguments)
        code = 0
    except SystemExit as error:
        code = int(error.code or 0)
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _said(process: int) -> str:
    return f"{tempfile.gettempdir()}/velotyre_killed_{process}.txt"


def waited(process: int, seconds: float) -> int | None:
    """Exit status of the child ``process`` where it ends within some ``seconds`` (s); None where it goes on."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            return os.waitpid(process, 0)[1]
        time.sleep(0.005)
    return None


def ended(process: int) -> tuple[int, str]:
    """Exit code of the child ``process`` and what it said; -1 where it had to be ended."""
    status = waited(process, PATIENCE)
    if status is None:
        os.killpg(process, signal.SIGKILL)
        os.waitpid(process, 0)
    code = -1 if status is None else os.waitstatus_to_exitcode(status)
    return code, Path(_said(os.getpid())).read_text(encoding="utf-8", errors="replace")


def session(leader: int) -> list[int]:
    """Processes that are alive (Linux) of the session that the process ``leader`` began."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rpartition(")")[2].split()
        except OSError:  # ended meanwhile
            continue
        if int(fields[3]) == leader and fields[0] != "Z":
            found.append(int(entry.parent.name))
    return found
