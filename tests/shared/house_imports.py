"""Who imports whom in the house, read from the source: nothing is imported, nothing is listed by hand.

Every import statement counts: at the top, inside a function, and, if asked for, under ``TYPE_CHECKING``. What is found
by its place (``import_module`` over the folder of effects, of commands) is no arrow: the finder knows none of them.
A room is a folder or a flat file directly under a package (``bicycle.effects``, ``studies.cli``); the package's own
``__init__`` is its door, not a room.
"""

import ast
import re
from collections.abc import Iterable, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

PACKAGES = ("tyre", "bicycle", "studies")
"""The packages of the house; an arrow may point from a later one to an earlier one only."""

Graph = dict[str, set[str]]


def modules(root: Path, packages: Iterable[str] = PACKAGES) -> dict[str, Path]:
    """Every module of the packages under the folder by its dotted name; a package is the name of its folder."""
    named = {}
    for package in packages:
        for file in sorted((root / package).rglob("*.py")):
            parts = file.relative_to(root).with_suffix("").parts
            named[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return named


IMPORT = re.compile(r"^[ \t]*((?:from [\w.]+ )?import (?:\([^)]*\)|[^\n(]+))", re.MULTILINE)
FOR_ANNOTATIONS = re.compile(r"^if (?:typing\.)?TYPE_CHECKING:.*\n(?:[ \t].*\n?|\n)*", re.MULTILINE)


def import_statements(text: str) -> list[ast.Import | ast.ImportFrom]:
    """Import statements of a source, also in its texts; to parse all of the house would take seconds."""
    found = ast.parse("\n".join(IMPORT.findall(text))).body
    return [node for node in found if isinstance(node, ast.Import | ast.ImportFrom)]


@cache
def named_imports(module: str, file: Path, *, annotations: bool = True) -> frozenset[str]:
    """Every name that a module imports, as written but without relative dots: ``a.b`` for ``from a import b``.

    Without ``annotations`` imports under ``TYPE_CHECKING`` are left out.
    """
    names: set[str] = set()
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    text = file.read_text(encoding="utf-8")
    for node in import_statements(text if annotations else FOR_ANNOTATIONS.sub("", text)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        else:
            above = ".".join(package.split(".")[: len(package.split(".")) + 1 - node.level]) if node.level else ""
            origin = ".".join(part for part in (above, node.module) if part)
            names |= {f"{origin}.{alias.name}" for alias in node.names}
    return frozenset(names)


def imports(files: Mapping[str, Path], *, annotations: bool = True) -> Graph:
    """Module -> the modules of the house that it imports, each the deepest that the import names."""
    graph: Graph = {}
    for module, file in files.items():
        graph[module] = set()
        for name in named_imports(module, file, annotations=annotations):
            home = name
            while home and home not in files:
                home = home.rpartition(".")[0]
            graph[module] |= {home} - {"", module}
    return graph


def foreign(module: str, file: Path, packages: Iterable[str] = PACKAGES) -> set[str]:
    """Top-level names of everything that a module imports from outside the house."""
    return {name.split(".")[0] for name in named_imports(module, file)} - set(packages)


def room(module: str) -> str:
    """The room of a module: its package and the folder or flat file below it; the package itself for its door."""
    return ".".join(module.split(".")[:2])


def of_rooms(graph: Graph, package: str) -> Graph:
    """Room -> the rooms of the same package that it imports, without the package's door."""
    rooms: Graph = {}
    for module, targets in graph.items():
        if module.startswith(f"{package}."):
            inside = {room(target) for target in targets if target.startswith(f"{package}.")}
            rooms.setdefault(room(module), set()).update(inside - {room(module)})
    return rooms


def circle(graph: Graph) -> list[str]:
    """Nodes that import each other round, the first one again at the end; empty without such a circle."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []
