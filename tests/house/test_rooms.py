"""The rooms of the house: arrows one way, no circles, no presentation where numbers are made, tests through doors.

Everything is read from the source (``house_imports``), so a new file or room is held to the same rules.
"""

import ast
import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from house_imports import (
    PACKAGES,
    Graph,
    circle,
    foreign,
    import_statements,
    imports,
    modules,
    named_imports,
    of_rooms,
    room,
)

ROOT = Path(__file__).parents[2]
FILES = modules(ROOT)

PRESENTATION = {"matplotlib", "jinja2", "click", "tabulate"}
"""Libraries that draw or print; numbers are made without them."""

DRAWN_BY_THE_MODES = {"bicycle.stability.mode_figure"}
"""``Modes.plot`` draws with it: the only presentation below ``studies``."""

BESIDE_THE_ROOMS = {"benchmarks", "docs", "field_cases", "golden", "house", "published", "shared", "validation"}
"""Folders of tests about the house as a whole, its documents and the literature."""


@cache
def graph() -> Graph:
    """Module -> the modules that it imports."""
    return imports(FILES)


def inside(package: str) -> list[str]:
    return [module for module in FILES if module == package or module.startswith(f"{package}.")]


def test_no_circle_of_files():
    """Files of one room may name each other's types; between rooms annotations count, too."""
    assert circle(imports(FILES, annotations=False)) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_circle_of_rooms(package):
    assert circle(of_rooms(graph(), package)) == []


def test_arrows_between_the_packages_point_one_way():
    wrong = [
        f"{module} imports {target}"
        for module, targets in graph().items()
        for target in targets
        if PACKAGES.index(target.split(".")[0]) > PACKAGES.index(module.split(".")[0])
    ]
    assert wrong == []


def test_the_bicycle_knows_nothing_of_rigs():
    """The two meet in the properties of a tyre; how it was measured is unknown to the bicycle."""
    imported = {target for module in inside("bicycle") for target in graph()[module]}
    assert "tyre.measured.properties" in imported
    assert {room(target) for target in imported} & {"tyre.rig", "tyre.fits"} == set()
    assert imported & {"tyre.recordings.recording", "tyre.recordings.run_checks"} == set()


def test_inference_needs_numpy_and_scipy_only():
    rooms = inside("studies.inference")
    assert len(rooms) > 5
    assert {target for module in rooms for target in graph()[module]} <= set(rooms)
    outside = {name for module in rooms for name in foreign(module, FILES[module])}
    assert outside - sys.stdlib_module_names == {"numpy", "scipy"}


def test_numbers_are_made_without_presentation():
    drawing = {module for module in inside("tyre") + inside("bicycle") if foreign(module, FILES[module]) & PRESENTATION}
    assert drawing <= DRAWN_BY_THE_MODES


def test_files_are_read_in_one_go():
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES.values()}
    assert {str(path.relative_to(ROOT)): count for path, count in lines.items() if count > 600} == {}


def test_no_function_is_tangled():
    """McCabe's complexity is at most 20."""
    command = ["check", "--isolated", "--ignore-noqa", "--no-cache", "--select", "C901", "--output-format", "json"]
    limit = ["--config", "lint.mccabe.max-complexity=20"]
    shown = subprocess.run(
        [sys.executable, "-m", "ruff", *command, *limit, *PACKAGES], capture_output=True, text=True, cwd=ROOT
    )
    assert shown.stderr == ""
    assert [entry["filename"] for entry in json.loads(shown.stdout)] == []


def outside_doors(text: str) -> list[str]:
    """Names of the house that a test imports from a file inside a room, or that are private."""
    found = []
    for node in import_statements(text):
        origin = (node.module or "") if isinstance(node, ast.ImportFrom) else ""
        for name in (alias.name for alias in node.names):
            parts = (origin or name).split(".")
            if parts[0] in (*PACKAGES, "velotyre") and (len(parts) > 2 or (origin and name.startswith("_"))):
                found.append(f"{'.'.join(parts)}:{name}")
    return found


def test_tests_import_from_doors():
    """A door is a package, or a room right below it; private names are left alone."""
    every = {str(file): outside_doors(file.read_text(encoding="utf-8")) for file in (ROOT / "tests").rglob("*.py")}
    assert {file: names for file, names in every.items() if names} == {}


def test_what_is_outside_of_doors_is_seen():
    doors = (
        "from bicycle import Model\nfrom studies.diagnosis import diagnose\nimport velotyre as vt\nimport numpy.linalg"
    )
    assert outside_doors(doors) == []
    inner = "from studies.diagnosis.kind import Kind\nfrom tyre.measured.tables import _cell"
    assert outside_doors(inner) == ["studies.diagnosis.kind:Kind", "tyre.measured.tables:_cell"]


def test_tests_mirror_the_rooms():
    """A folder of tests belongs to a room; the name of a flat test begins with a room's."""
    assert {path.name for path in (ROOT / "tests").iterdir() if _is_room(path)} == BESIDE_THE_ROOMS | set(PACKAGES)
    for package in PACKAGES:
        rooms = {name.split(".")[1] for name in of_rooms(graph(), package)}
        assert {path.name for path in (ROOT / "tests" / package).iterdir() if _is_room(path)} <= rooms
        for test in (ROOT / "tests" / package).glob("test_*.py"):
            assert any(test.stem.startswith(f"test_{name}") for name in rooms), f"{test.name}: no room of {package}"


def _is_room(path: Path) -> bool:
    return path.is_dir() and path.name != "__pycache__"


def test_every_way_of_importing_is_seen(tmp_path):
    """The reader of imports itself, on a toy house."""
    for name, source in {
        "ground/numbers": "import json, os.path",
        "house/walls/left": "from ground.numbers import pi\nfrom house.walls import right",
        "house/walls/right": "def lift():\n    import house.roof",
        "house/roof": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .walls.left import Brick",
        "house/cellar": "import_module('house.roof')\nfrom numpy import (\n  array,\n)",
    }.items():
        file = tmp_path / f"{name}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(source)
    files = modules(tmp_path, ("ground", "house"))
    assert imports(files) == {
        "ground.numbers": set(), "house.cellar": set(), "house.walls.right": {"house.roof"},
        "house.walls.left": {"ground.numbers", "house.walls.right"}, "house.roof": {"house.walls.left"},
    }  # fmt: skip
    assert set(circle(imports(files))) == {"house.roof", "house.walls.left", "house.walls.right"}
    assert circle(imports(files, annotations=False)) == []
    assert set(circle(of_rooms(imports(files), "house"))) == {"house.roof", "house.walls"}
    assert named_imports("ground.numbers", files["ground.numbers"]) == {"json", "os.path"}
    assert foreign("house.cellar", files["house.cellar"], ("ground", "house")) == {"numpy"}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_stands_on_the_page_of_the_rooms(package):
    page = (ROOT / "docs" / "contributing.md").read_text(encoding="utf-8")
    names = {module.split(".")[1] for module in inside(package) if module.count(".") and "._" not in module}
    assert [name for name in sorted(names) if f"`{name}`" not in page] == []
