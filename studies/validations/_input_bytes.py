"""Damage of bytes, whatever they mean, and of what is packed in an archive."""

import random

from studies.validations._input_trees import Way


def flip(content: bytes, rng: random.Random) -> bytes:
    """Change 1 to 16 bytes of the ``content``, drawn with ``rng``."""
    raw = bytearray(content or b"x")
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        raw[rng.randrange(len(raw))] ^= rng.randrange(1, 256)
    return bytes(raw)


def cut_off(content: bytes, rng: random.Random) -> bytes:
    """The ``content`` up to a place drawn with ``rng``."""
    return content[: rng.randrange(len(content) + 1)]


def block_moved(content: bytes, rng: random.Random) -> bytes:
    """Some bytes of the ``content`` at another place, both drawn with ``rng``."""
    start, length, target = rng.randrange(len(content)), rng.choice((1, 4, 8, 64, 512)), rng.randrange(len(content))
    block = content[start : start + length]
    return content[:target] + block + content[target + rng.choice((0, len(block))) :]


def _block_set(content: bytes, rng: random.Random) -> bytes:
    start, length = rng.randrange(len(content)), rng.choice((1, 2, 4, 8, 64))
    fill = rng.choice((b"\0", b"\xff", b"\x7f", b"\x80"))
    return content[:start] + fill * min(length, len(content) - start) + content[start + length :]


BYTES: tuple[Way, ...] = (flip, cut_off, block_moved, _block_set)
