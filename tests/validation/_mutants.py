"""Draws mutants by cosmic-ray and runs tests on them: ``python tests/validation/_mutants.py TREE SEED COUNT OUT``.

``TREE`` is a copy of the sources that may be spoilt; cosmic-ray 8.7.0 must be installed. A line is drawn, then a place
in it, then a mutant of the place, as many in each area as its lines weigh. Bit operators, annotations, overloads,
caches, errors and texts are left out. The tests are those that import the module and those of the mirrored room,
nearest file first, for 75 s of the processor. Of a sample only counts are kept: tests would be tuned to a list.
"""

import json
import random
import re
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

AREAS = {"tyre": ["tyre"], "bicycle": ["bicycle"], "diagnosis": ["studies/diagnosis", "studies/inference"]}


def left_out(node: Any) -> bool:
    """Whether a place is an annotation, a text, an error or a decorator that only types or caches."""
    if node.type == "decorator":
        return bool(re.search("overload|cache|wraps", node.get_code()))
    parent = node.parent
    while parent is not None:
        kind = parent.type
        if kind.startswith("fstring") or kind in ("raise_stmt", "assert_stmt", "tfpdef"):
            return True
        if kind == "annassign" and parent.children[1] is node:
            return True
        if kind == "funcdef" and parent.annotation is node:
            return True
        if kind == "if_stmt" and "TYPE_CHECKING" in parent.children[1].get_code():
            return True
        node, parent = parent, parent.parent
    return False


def drawn(tree: Path, seed: int, count: int) -> list[tuple[str, str, int, str, int]]:
    """Area, file, line, operator and occurrence of each mutant."""
    from cosmic_ray import plugins
    from cosmic_ray.ast import ast_nodes, get_ast_from_path

    easy = re.compile("_(RShift|LShift|BitOr|BitAnd|BitXor)$|Eq_Is$|NotEq_IsNot$")
    operators = [(n, plugins.get_operator(n)) for n in plugins.operator_names() if not easy.search(n)]
    operators = [(name, operator()) for name, operator in operators if not operator.arguments()]
    files = {area: [f for room in rooms for f in sorted((tree / room).rglob("*.py"))] for area, rooms in AREAS.items()}
    lines = {area: sum(len(f.read_text().splitlines()) for f in mine) for area, mine in files.items()}
    generator, found = random.Random(seed), []
    for area, mine in files.items():
        places: dict[Any, dict[Any, list[Any]]] = {}
        for file in mine:
            nodes = list(ast_nodes(get_ast_from_path(file)))
            for name, operator in operators:
                spots = [(node, *spot) for node in nodes for spot in operator.mutation_positions(node)]
                for number, (node, *spot) in enumerate(spots):
                    in_function = any(p.type in ("funcdef", "lambdef") for p in parents(node))
                    if not left_out(node) and ("BitOr_" not in name or in_function):
                        key = str(file.relative_to(tree)), spot[0][0]
                        places.setdefault(key, {}).setdefault(tuple(spot), []).append((name, number))
        for key in generator.sample(sorted(places), round(count * lines[area] / sum(lines.values()))):
            spot = generator.choice(sorted(places[key]))
            found.append((area, *key, *generator.choice(places[key][spot])))
    generator.shuffle(found)
    return found


def parents(node: Any) -> list[Any]:
    """What a node stands in, from the inside."""
    return [] if node.parent is None else [node.parent, *parents(node.parent)]


def tests_of(tree: Path, file: str) -> list[Path]:
    """Test files that import a module, and those of its room: those called after it first."""
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    package, _, name = module.rpartition(".")
    imported = re.compile(rf"(from|import) {re.escape(module)}\b|from {re.escape(package)} import .*\b{name}\b")
    room = tree / "tests" / Path(file).parent
    aside = {tree / "tests" / folder for folder in ("validation", "benchmarks")}
    tests = [test for test in (tree / "tests").rglob("test_*.py") if not aside & {*test.parents}]
    importing = {test for test in tests if imported.search(test.read_text(encoding="utf-8"))}
    near = importing | {test for test in tests if room in test.parents}
    return sorted(near, key=lambda test: (Path(file).stem not in test.name, test not in importing, test.name))


def noticed(tree: Path, file: str, operator: str, number: int) -> bool:
    """Whether the tests of :func:`tests_of` fail on one mutant, which is taken back."""
    from cosmic_ray import plugins
    from cosmic_ray.mutating import use_mutation

    command = [sys.executable, "-B", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
    command += map(str, tests_of(tree, file))
    with use_mutation(tree / file, plugins.get_operator(operator)(), number):
        ended = subprocess.run(command, cwd=tree, capture_output=True, check=False, preexec_fn=_limit_time)
    return ended.returncode > 0  # below zero: the time was over; look at what is left by hand


def _limit_time() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (75, 76))  # s


if __name__ == "__main__":
    source, seed, count, out = Path(sys.argv[1]).resolve(), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4])
    result = [[*mutant, noticed(source, mutant[1], *mutant[3:])] for mutant in drawn(source, seed, count)]
    out.write_text(json.dumps({"seed": seed, "mutants": result}, indent=1) + "\n", encoding="utf-8")
