"""Limits of a process that reads files of others: those of the standard library (:mod:`resource`)."""

import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from tyre.formats.channel_map import Reading

# what a file may take: a small one, for each of its bytes beside, and the most of all
MEMORY = (800_000_000, 300, 6_000_000_000)  # bytes
PROCESSOR = (3, 1e-5, 60)  # s
TEMPORARY = 4_000_000_000  # bytes of a file that is written, which only the reader of MDF does
MDF = (".mf4", ".mdf")


def allowance(limits: tuple[float, float, float], path: Path, reading: Reading) -> int:
    """Memory (bytes) or processor time (s) that a recording may take, by the size of its files."""
    least, a_byte, most = limits
    files = [file for file in (path, *reading.dbc) if file.is_file()]
    return int(min(most, least + a_byte * sum(file.stat().st_size for file in files)))


def limit(path: Path, reading: Reading) -> None:
    """Limit what this process may take for a file from now on; limits that are lower already stay."""
    import resource  # here: Windows has none

    is_mdf = path.suffix.casefold() in MDF
    with suppress(ImportError):  # of a library that is slow to import; what this takes counts to no file
        import_module("asammdf" if is_mdf else "numpy")
    pages = int(Path("/proc/self/statm").read_text().split()[0])  # taken by libraries and by files before
    for kind, most in {
        resource.RLIMIT_AS: pages * resource.getpagesize() + allowance(MEMORY, path, reading),
        resource.RLIMIT_CPU: int(time.process_time()) + 1 + allowance(PROCESSOR, path, reading),
        resource.RLIMIT_FSIZE: TEMPORARY if is_mdf else 0,
        resource.RLIMIT_CORE: 0,
    }.items():
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
