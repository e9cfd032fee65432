"""What a command is starved of: room on the disk, leave to write, a home."""

import os
from collections.abc import Callable

SMALL = 2000  # bytes
CAPABILITIES = 0x20080522  # version 3 of the header of capset


def _full() -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL, SMALL))


def _under_permissions() -> None:
    """Give up what lets root write where it may not (Linux); others lose nothing."""
    import ctypes

    if os.getuid() == 0:
        kept = (ctypes.c_uint32 * 6)()  # effective, permitted and inheritable, twice 32 bits: none
        header = (ctypes.c_uint32 * 2)(CAPABILITIES, 0)
        if ctypes.CDLL(None).capset(header, kept):
            raise OSError("root cannot give up its capabilities here")


def _homeless() -> None:
    os.environ.pop("HOME", None)


STARVED: dict[str, Callable[[], None]] = {
    "full disk": _full, "read-only folder": _under_permissions, "no home": _homeless
}  # fmt: skip
