"""Small faults put into Python source on purpose: a sign turned, a number changed, a term or a factor dropped."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

SIGNS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
"""Operators and what stands in their place."""

LARGER = 1.1
"""Factor on a number with a decimal point; one is added to a whole number."""

_WORDS = (ast.JoinedStr, ast.FormattedValue, ast.List, ast.Tuple, ast.ListComp)


@dataclass(frozen=True)
class Mutant:
    """One fault.

    Attributes
    ----------
    file : str
        Path below the top of the source tree, with ``/``.
    line, column : int
        Of the first character, from 1 and from 0.
    end_line, end_column : int
        Behind the last one.
    kind : str
        ``"sign"``, ``"number"``, ``"minus"`` or ``"term"``.
    before, after : str
        What stands there, and what is put in its place.
    """

    file: str
    line: int
    column: int
    end_line: int
    end_column: int
    kind: str
    before: str
    after: str

    @property
    def name(self) -> str:
        """Where and what, in a line."""
        return f"{self.file}:{self.line}:{self.column} {self.kind} {_short(self.before)} -> {_short(self.after)}"

    def applied(self, text: str) -> str:
        """The source ``text`` of the file with the fault in it."""
        raw = text.encode()
        starts = _line_starts(raw)
        first, last = starts[self.line - 1] + self.column, starts[self.end_line - 1] + self.end_column
        if raw[first:last].decode() != self.before:
            raise ValueError(f"{self.file}:{self.line}: holds {raw[first:last].decode()!r}, expected {self.before!r}")
        return (raw[:first] + self.after.encode() + raw[last:]).decode()


def mutants(file: str, text: str) -> list[Mutant]:
    """Every fault of these kinds in the source ``text`` of a ``file``, in the order of the source.

    Parameters
    ----------
    file : str
        Path below the top of the source tree.
    text : str

    Notes
    -----
    Left alone: type annotations, decorators, text, and blocks for type checkers.
    """
    raw = text.encode()
    found = [m for node in _nodes(ast.parse(text)) for m in _of_node(node, file, raw)]
    return sorted(found, key=lambda m: (m.line, m.column, m.end_line, m.end_column, m.kind))


def all_mutants(top: Path, parts: tuple[str, ...]) -> list[Mutant]:
    """Every fault in the Python files of some ``parts`` (folders) of the source tree ``top``."""
    files = sorted(path for part in parts for path in (top / part).rglob("*.py"))
    return [m for path in files for m in mutants(path.relative_to(top).as_posix(), path.read_text(encoding="utf-8"))]


def _nodes(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes that compute something when the program runs."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(child, (ast.JoinedStr, ast.Import, ast.ImportFrom)):
                continue
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
                continue
            yield child
            yield from _nodes(child)


def _of_node(node: ast.AST, file: str, raw: bytes) -> Iterator[Mutant]:
    if isinstance(node, ast.BinOp) and type(node.op) in SIGNS and not (_is_text(node.left) or _is_text(node.right)):
        yield from _of_operator(node, file, raw)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = _source(raw, node.operand)
        positive = f"+{inner}" if isinstance(node.operand, ast.Constant) else inner
        yield _mutant(node, file, raw, "minus", f"({positive})")
    elif isinstance(node, ast.Constant):
        if type(node.value) is int:
            yield _mutant(node, file, raw, "number", repr(node.value + 1))
        elif type(node.value) is float:
            yield _mutant(node, file, raw, "number", repr(node.value * LARGER or 1.0))


def _of_operator(node: ast.BinOp, file: str, raw: bytes) -> Iterator[Mutant]:
    sign, other = SIGNS[type(node.op)]
    left, right = _source(raw, node.left), _source(raw, node.right)
    whole = _source(raw, node)
    starts = _line_starts(raw)
    behind = starts[_end(node.left)[0] - 1] + _end(node.left)[1]
    before = starts[node.right.lineno - 1] + node.right.col_offset
    between = raw[behind:before].decode()
    place = behind + len(between[: between.index(sign)].encode())
    line = sum(start <= place for start in starts)
    column = place - starts[line - 1]
    yield Mutant(file, line, column, line, column + len(sign), "sign", sign, other)
    yield Mutant(file, node.lineno, node.col_offset, *_end(node), "term", whole, f"({left})")
    alone = f"(-({right}))" if isinstance(node.op, ast.Sub) else f"({right})"
    if not isinstance(node.op, ast.Div):
        yield Mutant(file, node.lineno, node.col_offset, *_end(node), "term", whole, alone)


def _mutant(node: ast.expr, file: str, raw: bytes, kind: str, after: str) -> Mutant:
    return Mutant(file, node.lineno, node.col_offset, *_end(node), kind, _source(raw, node), after)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, _WORDS) or (isinstance(node, ast.Constant) and not isinstance(node.value, (int, float)))


def _source(raw: bytes, node: ast.expr) -> str:
    starts = _line_starts(raw)
    line, column = _end(node)
    return raw[starts[node.lineno - 1] + node.col_offset : starts[line - 1] + column].decode()


def _end(node: ast.expr) -> tuple[int, int]:
    if node.end_lineno is None or node.end_col_offset is None:  # never of parsed source
        raise ValueError(f"no end of {ast.dump(node)}")
    return node.end_lineno, node.end_col_offset


@lru_cache(maxsize=4)
def _line_starts(raw: bytes) -> list[int]:
    starts = [0]
    for line in raw.split(b"\n"):
        starts.append(starts[-1] + len(line) + 1)
    return starts


def _short(text: str) -> str:
    flat = " ".join(text.split())
    return flat if len(flat) <= 40 else f"{flat[:37]}..."
