"""Draws mutants by cosmic-ray and runs tests on them: ``python tests/validation/_mutants.py TREE SEED COUNT OUT``.

``TREE`` is a copy of the sources that may be spoilt; cosmic-ray 8.7.0 must be installed. A line is drawn, then a place
in it, then a mutant of the place, as many in each area as its lines weigh. Bit operators, annotations, overloads,
caches, errors and texts are left out. The tests are those of the mirrored room, nearest file first, for 60 s.
"""

import json
import random
import re
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


def killed(tree: Path, file: str, operator: str, number: int) -> bool:
    """Whether the tests of the mirrored room fail on one mutant, which is taken back."""
    from cosmic_ray import plugins
    from cosmic_ray.mutating import use_mutation

    room = tree / "tests" / Path(file).parent
    tests = sorted(room.rglob("test_*.py"), key=lambda test: (Path(file).stem not in test.name, test.name))
    command = [sys.executable, "-B", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *map(str, tests)]
    with use_mutation(tree / file, plugins.get_operator(operator)(), number):
        try:
            return subprocess.run(command, cwd=tree, timeout=60, capture_output=True, check=False).returncode != 0
        except subprocess.TimeoutExpired:
            return False  # of a slow room too: look at what is left by hand


if __name__ == "__main__":
    source, seed, count, out = Path(sys.argv[1]).resolve(), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4])
    result = [[*mutant, killed(source, mutant[1], *mutant[3:])] for mutant in drawn(source, seed, count)]
    out.write_text(json.dumps({"seed": seed, "mutants": result}, indent=1) + "\n", encoding="utf-8")
