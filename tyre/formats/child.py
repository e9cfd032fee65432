"""Files that others' libraries parse are read in a child process, which may take only so much of the machine.

A library that crashes ends only the child. It has the rights of this process: links to other files are refused where
they are read (:mod:`tyre.formats.hdf5`). One child serves a process. Only Linux keeps all limits of
:mod:`tyre.formats.limits`; elsewhere files are read in the process itself.
"""

import atexit
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from threading import Lock, Thread
from typing import Any

from tyre.formats.channel_map import Reading
from tyre.formats.limits import PROCESSOR, allowance, limit
from tyre.formats.signals import Contents, Signal
from tyre.ground.errors import InputError

CLOCK = 600.0  # s to wait for an answer
_BEGIN = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from tyre.formats import child, contents_here, rows_here; child.serve(contents_here, rows_here)"
)
_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_MAX_THREADS"), "1")
_children: dict[int, "_Child"] = {}  # by the process that asks: a fork must not talk to the child of its parent
_one_at_a_time = Lock()


def apart() -> bool:
    """True if this process reads foreign files in a child."""
    return sys.platform == "linux" and bool(sys.executable)


def list_in_child(path: Path, reading: Reading) -> Contents:
    """List the columns of a recording in the child, which loads them when asked."""
    columns, notes, own_times = _ask("list", path, reading)

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        signals: list[Signal] = _ask("load", path, reading, names, most)
        return signals

    return Contents(columns, load, notes, own_times)


def read_rows_in_child(path: Path, kind: str) -> list[tuple[str, tuple[Any, ...]]]:
    """Read the rows of a workbook or a Parquet file in the child."""
    rows: list[tuple[str, tuple[Any, ...]]] = _ask("rows", path, Reading(), kind)
    return rows


def _ask(task: str, path: Path, reading: Reading, *how: Any) -> Any:
    with _one_at_a_time:
        child = _children.get(os.getpid())
        if child is None or child.process.poll() is not None:  # none yet, or killed by others since
            child = _children[os.getpid()] = _Child()
        try:
            answer = child.answer((os.getcwd(), task, path, reading, how))
        except (EOFError, OSError) as error:
            code = child.process.returncode
            why = f"its library failed ({signal.Signals(-code).name if code < 0 else f'code {code}'})"
            if code in (-signal.SIGXCPU, -signal.SIGKILL):
                why = f"it takes more than {allowance(PROCESSOR, path, reading)} s, or more memory than there is"
            raise InputError(f"{path}: cannot be read: {why}; is it damaged? cut it, or export it as CSV") from error
    if isinstance(answer, InputError):
        raise answer
    return answer


class _Child:
    """A child process and the line to it."""

    def __init__(self) -> None:
        self.line, end = Pipe()
        paths = json.dumps([os.path.abspath(path) for path in sys.path])
        command = [sys.executable, "-P", "-c", _BEGIN, paths, str(end.fileno())]
        with end:
            self.process = subprocess.Popen(
                command,
                pass_fds=[end.fileno()],
                stdin=subprocess.PIPE,  # never written: it closes when this process ends
                stdout=subprocess.DEVNULL,  # libraries may print
                stderr=subprocess.DEVNULL,
                env=os.environ | _ONE_THREAD,
                process_group=0,  # Ctrl-C reaches this process, which ends the child
            )
        atexit.register(self.end)

    def answer(self, request: Any) -> Any:
        """Send a request and wait for its answer; a child that fails, is late or is interrupted is ended."""
        try:
            self.line.send(request)
            if not self.line.poll(CLOCK):
                raise TimeoutError
            return self.line.recv()
        except BaseException:
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(0.2)  # one that died by itself says how
            self.end()
            raise

    def end(self) -> None:
        """End the child and close what leads to it."""
        atexit.unregister(self.end)
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()  # type: ignore[union-attr]
        self.line.close()


def serve(contents: Callable[[Path, Reading], Contents], rows: Callable[[Path, str], Any]) -> None:
    """Answer requests by these two readers until the process that asks ends: the work of the child."""
    Thread(target=_end_with_parent, daemon=True).start()
    line: Connection[Any, Any] = Connection(int(sys.argv[2]))
    listing: tuple[Any, Contents] | None = None  # of a file in which a load mostly follows
    while True:
        folder, task, path, reading, how = line.recv()
        os.chdir(folder)
        limit(path, reading)
        try:
            if task == "rows":
                line.send(rows(path, *how))
                continue
            file = (folder, path, reading, path.stat().st_mtime_ns)
            if listing is None or listing[0] != file:
                listing = file, contents(path, reading)
            listed = listing[1]
            line.send((listed.columns, listed.notes, listed.own_times) if task == "list" else list(listed.load(*how)))
            listing = listing if task == "list" else None  # it may hold the whole file
        except InputError as error:
            line.send(error)


def _end_with_parent() -> None:
    """End when the other end of the standard input is gone, even in the midst of a request."""
    sys.stdin.read()
    os._exit(1)
