"""One computation at a time, in another process, so that the page answers while it runs and can stop it.

The process takes the next order too: what it imports costs seconds. One that was stopped or broke down is replaced.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from threading import Lock, Thread
from typing import Any

from studies.explorer.recording.desk import Desk
from studies.explorer.recording.work import work
from tyre.base.errors import InputError
from tyre.base.parallel import lone_process

BUSY = "another computation runs on this server; wait for its end, or cancel it"
ENDED = "the computation ended without an answer; the terminal of velotyre explore may say why"


@dataclass
class Job:
    """A computation.

    Attributes
    ----------
    kind : str
        Folder of its results, see :data:`studies.explorer.recording.desk.RESULTS`.
    token : str
        Of the desk that asked for it.
    state : str
        ``running``, ``done``, ``failed`` or ``cancelled``.
    message : str
        Why it failed, in the words of the library.
    progress : dict
        What its bar tells: ``n``, ``unit``, ``prefix``, ``postfix``.
    began : float
        s, by a clock of this process.
    """

    kind: str
    token: str
    state: str = "running"
    message: str = ""
    progress: dict[str, Any] = field(default_factory=dict)
    began: float = field(default_factory=time.monotonic)

    def told(self) -> dict[str, Any]:
        """For the page."""
        p = self.progress
        count = f"{p['n']}{p['unit']}" if p.get("n") else ""
        words = ", ".join(filter(None, [p.get("prefix", "").rstrip(": "), count, p.get("postfix") or ""]))
        return {"kind": self.kind, "state": self.state, "message": self.message, "words": words,
                "seconds": round(time.monotonic() - self.began, 1)}  # fmt: skip


class Busy(InputError):
    """Another computation runs."""


class Jobs:
    """The computation of a server."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._last: Job | None = None
        self._process: Any = None
        self._ready: tuple[Any, Connection] | None = None
        self._closed = False

    def prepare(self) -> None:
        """Have a process ready, which imports what a computation needs before one is asked for."""
        with self._lock:
            if self._ready is None and not self._closed:
                self._ready = _fresh()

    @property
    def running(self) -> str:
        """Token of the desk whose computation runs; empty where none does."""
        return self._last.token if self._last is not None and self._last.state == "running" else ""

    def of(self, desk: Desk) -> Job | None:
        """The last one that a ``desk`` asked for; None where another was later."""
        job = self._last
        return job if job is not None and job.token == desk.token else None

    def start(self, desk: Desk, kind: str, arguments: Sequence[str]) -> Job:
        """Begin.

        Parameters
        ----------
        desk : Desk
            Whose files it works on.
        kind : str
            Folder of its results in the desk's; what is in it is replaced.
        arguments : sequence of str
            Of the command line.

        Raises
        ------
        Busy
            Another one runs.
        """
        with self._lock:
            if self.running:
                raise Busy(BUSY)
            if self._ready is None or not self._ready[0].is_alive():
                self._ready = _fresh()
            (self._process, pipe), self._ready = self._ready, None
            job = self._last = Job(kind, desk.token)
            desk.results.pop(kind, None)
            pipe.send((str(desk.folder), kind, list(arguments)))
            Thread(target=self._listen, args=(job, desk, pipe, self._process), daemon=True).start()
            return job

    def cancel(self) -> None:
        """End the one that runs, if one does; whoever began it may be gone."""
        with self._lock:
            if self._last is not None and self.running:
                self._last.state = "cancelled"
                self._process.kill()

    def close(self) -> None:
        """End what runs."""
        with self._lock:
            self._closed = True
            for process in (self._process, self._ready[0] if self._ready else None):
                if process is not None:
                    process.kill()
                    process.join()

    def _listen(self, job: Job, desk: Desk, pipe: Connection, process: Any) -> None:
        said: tuple[str, Any] = ("failed", ENDED)
        free = False
        try:
            while not free:
                what, content = pipe.recv()
                if what == "progress":
                    job.progress = content
                elif what == "free":
                    free = True
                else:
                    said = (what, content)
        except (EOFError, OSError):  # its end
            process.join()
        with self._lock:
            if job.state == "running":
                if said[0] == "done":
                    desk.results[job.kind] = said[1]
                else:
                    job.message = said[1]
                job.state = said[0]
                if free:  # it takes the next order
                    self._ready = (process, pipe)
                    return
        pipe.close()
        self.prepare()


def _fresh() -> tuple[Any, Connection]:
    """A process that waits for an order, and the pipe to it."""
    mine, theirs = Pipe()
    process = lone_process(work, (theirs,))
    process.start()
    theirs.close()
    return process, mine
