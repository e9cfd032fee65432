"""Where compiled code is called from: no coverage sees its own lines, so the tests of these places judge them."""

import ast
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from pathlib import Path

COMPILED = "_kernel.py"
"""End of the names of files that are compiled and kept; what calls them would not notice a change."""


def callers(tree: Path, parts: Sequence[str], file: str) -> set[tuple[str, int]]:
    """Files and lines, outside compiled files, that use what a compiled ``file`` or what is compiled with it defines.

    Parameters
    ----------
    tree : Path
        Top of the source tree.
    parts : sequence of str
        Folders that are searched.
    file : str
        Path below ``tree``, with ``/``.
    """
    used, todo, seen = set(), [file], {file}
    while todo:
        module = todo.pop().removesuffix(".py").replace("/", ".")
        for path in _sources(tree, tuple(parts)):
            lines = list(_uses(path, module))
            name = path.relative_to(tree).as_posix()
            if not name.endswith(COMPILED):
                used |= {(name, line) for line in lines}
            elif lines and name not in seen:
                seen.add(name)
                todo.append(name)
    return used


@lru_cache
def _sources(tree: Path, parts: tuple[str, ...]) -> list[Path]:
    return sorted(path for part in parts for path in (tree / part).rglob("*.py"))


@cache
def _nodes(path: Path) -> tuple[list[ast.ImportFrom], list[ast.Name]]:
    every = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    return [n for n in every if isinstance(n, ast.ImportFrom)], [n for n in every if isinstance(n, ast.Name)]


def _uses(path: Path, module: str) -> Iterator[int]:
    """Lines of ``path`` in which a name that it imports from ``module``, or the module itself, is used."""
    package, _, own = module.rpartition(".")
    imports, uses = _nodes(path)
    names: set[str] = set()
    for node in imports:
        if node.module in (module, package):
            names |= {a.asname or a.name for a in node.names if node.module == module or a.name == own}
    return (node.lineno for node in uses if node.id in names)
