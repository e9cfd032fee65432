"""Files that others' libraries parse are read in a child process, which can harm less than this one could.

On Linux the child has at most so much memory and time, writes no file (of MDF only temporary ones) and has no network,
as far as the kernel has Landlock (5.13) and lets users make namespaces: :func:`confinement` tells. Answers are JSON and
plain numbers, never pickles. One child serves a whole process. Elsewhere files are read in the process itself.
"""

import atexit
import json
import os
import select
import signal
import struct
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from threading import Lock, Thread, Timer
from time import process_time
from typing import Any

import numpy as np

from tyre.arrays import Array
from tyre.channel_map import Reading
from tyre.errors import InputError
from tyre.signals import BUDGET, Column, Contents, Signal

LIMITS: dict[str, Any] = {
    "memory": 6_000_000_000, "temporary": 4_000_000_000, "processor": 60, "clock": 600, "line": 1 << 28,
    "least memory": 600_000_000, "memory a byte": 150, "least processor": 3, "processor a byte": 1e-5,
}  # fmt: skip
"""Bytes of address space and of a temporary file; s of processor and clock a request; bytes of a line of an answer.

The least of both, for a file of a few kB, and how much more each of its bytes may take.
"""

_BEGIN = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from tyre.formats import child, contents, table_rows; child.serve(contents, table_rows)"
)
_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_MAX_THREADS"), "1")
_children: dict[tuple[int, bool], "_Child"] = {}  # by this process, for a fork must not talk to its parent's child
_one_at_a_time = Lock()
_begun: list[str] = []  # in the child: that it is one


def apart() -> bool:
    """Tell if this process reads foreign files in a child."""
    return sys.platform == "linux" and bool(sys.executable) and not _begun


def confinement() -> list[str]:
    """List what the child that reads most formats is kept from; empty if there is none."""
    return list(_ask(False, {"call": "hello"}, Path("hello"), _plain)["kept"]) if apart() else []


def contents_apart(path: Path, reading: Reading, *, temporary: bool) -> Contents:
    """List the columns of a recording in the child, which loads them when asked; ``temporary``: it may write some."""
    about = {"path": str(path), "reading": asdict(reading) | {"dbc": [str(file) for file in reading.dbc]}}
    found = _ask(temporary, about | {"call": "contents"}, path, _plain)

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        request = about | {"call": "load", "names": list(names), "most": most}
        return _ask(temporary, request, path, _signals)

    return Contents(tuple(Column(*column) for column in found["columns"]), load, found["notes"], found["own_times"])


def rows_apart(path: Path, kind: str) -> list[tuple[str, tuple[Any, ...]]]:
    """Read the rows of a workbook or a Parquet file in the child."""
    found = _ask(False, {"call": "rows", "path": str(path), "kind": kind}, path, _plain)
    return [(place, tuple(cells)) for place, cells in found["rows"]]


def _plain(answer: dict[str, Any], stream: Any) -> Any:
    return answer


def _signals(answer: dict[str, Any], stream: Any) -> list[Signal]:
    return [
        Signal(name, _array(stream, count), unit, _array(stream, count) if timed else None)
        for name, unit, count, timed in answer["signals"]
    ]


def _array(stream: Any, count: int) -> Array:
    if not 0 <= count <= BUDGET:
        raise EOFError(f"{count} numbers")
    found = np.empty(count)
    if count and stream.readinto(found.data.cast("B")) != found.nbytes:
        raise EOFError("an answer that was cut off")
    return found


class _Child:
    """A child, and the one request that it works on."""

    def __init__(self, *, temporary: bool) -> None:
        import subprocess  # here: most commands read no foreign file

        paths = json.dumps([os.path.abspath(path) for path in sys.path])
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", _BEGIN, paths, "temporary" * temporary], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=os.environ | _ONE_THREAD, process_group=0,
        )  # fmt: skip

    def answer(self, request: dict[str, Any], receive: Callable[[dict[str, Any], Any], Any]) -> Any:
        """Send a request and ``receive`` what comes back; a child that fails or is interrupted is killed."""
        process = self.process
        timer = Timer(LIMITS["clock"], process.kill)
        timer.daemon = True
        timer.start()
        try:
            process.stdin.write(json.dumps(request).encode() + b"\n")  # type: ignore[union-attr]
            process.stdin.flush()  # type: ignore[union-attr]
            line = process.stdout.readline(LIMITS["line"])  # type: ignore[union-attr]
            if not line.endswith(b"\n"):
                raise EOFError("no answer")
            found = json.loads(line)
            return found if "refused" in found else receive(found, process.stdout)
        except BaseException:
            self.end()
            raise
        finally:
            timer.cancel()

    def end(self) -> None:
        """End the child and take back its pipes."""
        with suppress(Exception):  # one that died says how, others are given no time
            self.process.wait(0.2)
        self.process.kill()
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):  # what it had not read
                pipe.close()  # type: ignore[union-attr]
        self.process.wait()


def _ask(temporary: bool, request: dict[str, Any], path: Path, receive: Callable[[dict[str, Any], Any], Any]) -> Any:  # noqa: FBT001
    key, request = (os.getpid(), temporary), request | {"folder": os.getcwd()}
    with _one_at_a_time:
        child = _children.get(key)
        if child is not None and child.process.poll() is not None:  # killed by others since
            child.end()
        if child is None or child.process.returncode is not None:
            child = _children[key] = _Child(temporary=temporary)
        try:
            found = child.answer(request, receive)
        except (EOFError, OSError, ValueError, TypeError, KeyError) as error:
            cause = _cause(child.process.returncode, _allowed("processor", request))
            raise InputError(f"{path}: cannot be read: {cause}; is it damaged? cut it, or export it as CSV") from error
    if isinstance(found, dict) and "refused" in found:
        raise InputError(found["refused"])
    return found


def _allowed(kind: str, request: dict[str, Any]) -> int:
    """Memory or processor that a request may take, by the size of its files: a small one that takes much is no data."""
    files = [request.get("path", ""), *request.get("reading", {}).get("dbc", ())]
    size = sum(os.path.getsize(file) for file in files if os.path.isfile(file))
    return int(min(LIMITS[kind], LIMITS[f"least {kind}"] + size * LIMITS[f"{kind} a byte"]))


def _cause(code: int, seconds: int) -> str:
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        return f"it takes more than {seconds} s, or more memory than there is"
    name = signal.Signals(-code).name if code < 0 else f"code {code}"
    return f"its library failed ({name})"


@atexit.register
def _end_children() -> None:
    for (process, _), child in _children.items():
        if process == os.getpid():
            child.process.kill()
            child.end()


def serve(contents: Callable[..., Contents], table_rows: Callable[[Path, str], Any]) -> None:
    """Answer requests by these two readers, one a line of standard input, until it ends: the work of the child."""
    import resource

    _begun.append("child")
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # libraries may print
    kept = confine(temporary=sys.argv[2] == "temporary")
    Thread(target=_end_with_parent, daemon=True).start()
    with suppress(ImportError):  # told when it is needed; what it takes counts to no file
        if sys.argv[2]:
            import asammdf  # noqa: F401
    state: tuple[Any, Contents] | None = None
    for line in sys.stdin.buffer:
        request = json.loads(line)
        if request["call"] == "hello":
            _send(out, {"kept": kept})
            continue
        os.chdir(request["folder"])
        _limit("CPU", int(process_time()) + 1 + _allowed("processor", request), hard=False)
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()  # libraries, files before
        _limit("AS", min(LIMITS["memory"], taken + _allowed("memory", request)), hard=False)
        try:
            if request["call"] == "rows":
                _send(out, {"rows": table_rows(Path(request["path"]), request["kind"])})
            else:
                state = _answer(out, request, state, contents)
        except InputError as error:
            _send(out, {"refused": str(error)})


def _end_with_parent() -> None:
    """End when the other end of the standard input is gone, even in the midst of a request."""
    hangup = select.poll()
    hangup.register(0, 0)
    hangup.poll()
    os._exit(1)


def _answer(
    out: Any, request: dict[str, Any], state: tuple[Any, Contents] | None, contents: Callable[..., Contents]
) -> tuple[Any, Contents] | None:
    """Answer one request; a listing is kept for the load that mostly follows it."""
    path = Path(request["path"])
    about = [path, request["folder"], request["reading"], path.stat().st_mtime_ns if path.is_file() else 0]
    if state is None or state[0] != about:
        reading = request["reading"] | {"dbc": tuple(map(Path, request["reading"]["dbc"]))}
        state = about, contents(path, reading=Reading(**reading))
    found = state[1]
    if request["call"] == "contents":
        _send(out, {
            "columns": [(column.name, column.unit) for column in found.columns], "notes": found.notes,
            "own_times": found.own_times,
        })  # fmt: skip
        return state
    signals = list(found.load(request["names"], request["most"]))
    _send(out, {"signals": [(one.name, one.unit, len(one.values), one.time is not None) for one in signals]},
          *(x for one in signals for x in (one.values, one.time) if x is not None))  # fmt: skip
    return None


def _send(out: Any, answer: dict[str, Any], *arrays: Array) -> None:
    out.write(json.dumps(answer, default=str).encode() + b"\n")
    for x in arrays:
        if x.size:
            out.write(np.ascontiguousarray(x, float).data.cast("B"))
    out.flush()


def _limit(kind: str, most: int, *, hard: bool = True) -> None:
    """Lower a limit of this process, the ``hard`` one too; one that is lower already stays."""
    import resource

    number = getattr(resource, f"RLIMIT_{kind}")
    ceiling = resource.getrlimit(number)[1]
    least = most if ceiling == resource.RLIM_INFINITY else min(most, ceiling)
    resource.setrlimit(number, (least, least if hard else ceiling))


def confine(*, temporary: bool) -> list[str]:
    """Take from this process what reading needs not; what the system does not offer is left out of the list."""
    import ctypes
    import tempfile

    for kind, most in (("AS", LIMITS["memory"]), ("CORE", 0), ("FSIZE", LIMITS["temporary"] * temporary)):
        _limit(kind, most)
    kept = [f"more than {LIMITS['memory'] / 1e9:g} GB and {LIMITS['processor']} s a file"]
    libc, none, size = ctypes.CDLL(None), ctypes.c_long(0), ctypes.c_size_t
    if any(libc.unshare(spaces) == 0 for spaces in (0x40000000, 0x50000000)):  # of network, of a user and network
        kept.append("the network")
    writing = 0b1_1111_1111_0011  # Landlock: to execute, write, remove and make files; reading stays
    libc.prctl(38, 1, 0, 0, 0)  # no new privileges, which Landlock asks for
    rules = libc.syscall(444, struct.pack("Q", writing), size(8), none)
    if rules >= 0:
        if temporary:
            folder = os.open(tempfile.gettempdir(), os.O_PATH)
            libc.syscall(445, rules, 1, struct.pack("=Qi", writing & ~1, folder), none)
        if libc.syscall(446, rules, none) == 0:
            kept.append("writing files")
    return kept
