"""Damage of a table of text: cells, rows, columns and their names."""

import random

from studies.validations._input_text import HOSTILE_WORDS
from studies.validations._input_trees import FACTORS, Way, misspelt


def _table(content: bytes) -> tuple[list[list[bytes]], bytes]:
    head = content.partition(b"\n")[0]
    mark = max((b",", b";", b"\t"), key=head.count)
    return [line.split(mark) for line in content.split(b"\n")], mark


def _cell_away(content: bytes, rng: random.Random) -> bytes:
    rows, mark = _table(content)
    row = rng.choice(rows)
    del row[rng.randrange(len(row))]
    return b"\n".join(mark.join(row) for row in rows)


def _cell_more(content: bytes, rng: random.Random) -> bytes:
    rows, mark = _table(content)
    row = rng.choice(rows)
    row.insert(rng.randrange(len(row) + 1), rng.choice((rng.choice(row), rng.choice(HOSTILE_WORDS).encode())))
    return b"\n".join(mark.join(row) for row in rows)


def _cell_replaced(content: bytes, rng: random.Random) -> bytes:
    rows, mark = _table(content)
    row = rng.choice(rows)
    row[rng.randrange(len(row))] = rng.choice(HOSTILE_WORDS).encode()
    return b"\n".join(mark.join(row) for row in rows)


def _column_changed(content: bytes, rng: random.Random) -> bytes:
    rows, mark = _table(content)
    full = [row for row in rows if len(row) == len(rows[0])]
    one, other = rng.randrange(len(rows[0])), rng.randrange(len(rows[0]))
    how = rng.choice(("away", "twice", "swapped", "empty", "scaled", "constant"))
    factor, word = rng.choice(FACTORS), rng.choice(HOSTILE_WORDS).encode()
    for place, row in enumerate(full):
        if how == "away":
            del row[one]
        elif how == "twice":
            row.append(row[one])
        elif how == "swapped" and place:
            row[one], row[other] = row[other], row[one]
        elif how in ("empty", "constant") and place:
            row[one] = b"" if how == "empty" else word
        elif how == "scaled" and place:
            row[one] = repr(float(row[one]) * factor).encode()
    return b"\n".join(mark.join(row) for row in rows)


def _header_renamed(content: bytes, rng: random.Random) -> bytes:
    rows, mark = _table(content)
    place = rng.randrange(len(rows[0]))
    rows[0][place] = misspelt(rows[0][place].decode(), rng).encode()
    return b"\n".join(mark.join(row) for row in rows)


def _rows_away(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    start = rng.randrange(len(lines))
    return b"\n".join(lines[:start] + lines[start + rng.randrange(1, len(lines) + 1) :])


CELLS: tuple[Way, ...] = (
    _cell_away, _cell_more, _cell_replaced, _cell_replaced, _cell_replaced, _column_changed, _column_changed,
    _header_renamed, _rows_away,
)  # fmt: skip
