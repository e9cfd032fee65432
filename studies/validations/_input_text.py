"""Damage of text: words, numbers, lines, letters, encodings, line ends."""

import random
import re

from studies.validations._input_bytes import cut_off, flip
from studies.validations._input_trees import FACTORS, Way

HOSTILE_WORDS = (
    "1e308", "-1e308", "1e-308", "5e-324", "nan", "NaN", "inf", "-inf", "-1", "0", "-0.0", "1e5", "1e-5", "1e15", "1_0",
    "1e400", "0x10", "٣.٥", "１２", "true", "", " ", "1,5", "1.5.2", "9" * 400, "1e-400", "--1", "1e", "+5", "NULL",
    "=1+1", "a" * 100_000, "é", "\u202e5", "1\u00a0000", "\0", "\x1b[31m", "#", "|", "<b>", "'", '"', "../../etc",
)  # fmt: skip


"""What stands in place of a number or word of a text."""


_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


_DEEP = 3000


def deep_nesting(content: bytes, rng: random.Random) -> bytes:
    """Tables or lists within each other at a line of the ``content`` drawn with ``rng``."""
    deep = rng.choice((20, 200, _DEEP))
    line = rng.choice((b"x = " + b"[" * deep + b"]" * deep, b"x = " + b"{a=" * deep + b"1" + b"}" * deep,
                       b"[" + b".".join([b"a"] * deep) + b"]\nb = 1"))  # fmt: skip
    lines = content.split(b"\n")
    lines.insert(rng.randrange(len(lines) + 1), line)
    return b"\n".join(lines)


def word_replaced(content: bytes, rng: random.Random) -> bytes:
    """A number of the ``content``, drawn with ``rng``, as something hostile."""
    numbers = list(_NUMBER.finditer(content))
    if not numbers:
        raise ValueError
    one = rng.choice(numbers)
    return content[: one.start()] + rng.choice(HOSTILE_WORDS).encode() + content[one.end() :]


def number_scaled(content: bytes, rng: random.Random) -> bytes:
    """A number of the ``content`` times a factor, both drawn with ``rng``."""
    one = rng.choice(list(_NUMBER.finditer(content)))
    return content[: one.start()] + repr(float(one[0]) * rng.choice(FACTORS)).encode() + content[one.end() :]


def _line_away(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    del lines[rng.randrange(len(lines))]
    return b"\n".join(lines)


def _line_twice(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    lines.insert(rng.randrange(len(lines)), rng.choice(lines))
    return b"\n".join(lines)


def _lines_swapped(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _line_cut(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    place = rng.randrange(len(lines))
    lines[place] = lines[place][: rng.randrange(len(lines[place]) + 1)]
    return b"\n".join(lines)


def _line_ends(content: bytes, rng: random.Random) -> bytes:
    return content.replace(b"\n", rng.choice((b"\r\n", b"\r", b"\n\n", b"\x0b", "\u2028".encode(), b" \n", b"")))


def _encoded(content: bytes, rng: random.Random) -> bytes:
    text = content.decode("utf-8")
    how = rng.choice(("utf-16", "utf-32", "utf-8-sig", "cp1252", "utf-16-le", "utf-7", "cp500", "twice"))
    return b"\xef\xbb\xbf\xef\xbb\xbf" + content if how == "twice" else text.encode(how, "replace")


def _letters_in(content: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(content) + 1)
    return content[:place] + rng.choice(HOSTILE_WORDS).encode() + content[place:]


TEXT: tuple[Way, ...] = (
    word_replaced, word_replaced, number_scaled, _line_away, _line_twice, _lines_swapped, _line_cut, _line_ends,
    _encoded, _letters_in, flip, cut_off,
)  # fmt: skip
