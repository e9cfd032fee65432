"""The rooms of the house: arrows one way, no circles, few floors, no presentation where numbers are made, small files.

Everything is read from the source (``house_imports``), so that a new file or room is held to the same rules unasked.
"""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from statistics import median

import pytest
from house_imports import PACKAGES, Graph, circles, floors, foreign, imports, modules, named_imports, of_rooms, room

ROOT = Path(__file__).parents[2]
FILES = modules(ROOT)

PRESENTATION = {"matplotlib", "jinja2", "click", "tabulate"}
"""Libraries that draw or print; numbers are made without them."""

DRAWN_BY_THE_MODES = {"bicycle.modal.figure", "bicycle.modal.looks"}
"""What ``Modes.plot`` draws with: the only presentation below ``studies``."""

COMPLEX_KERNELS = {"bicycle/eigenvalues/hessenberg_kernel.py:_reduce"}
"""Householder reduction written out for numba (Golub & Van Loan, Matrix Computations, 4th ed., algorithm 7.4.2)."""

BESIDE_THE_ROOMS = {"benchmarks", "docs", "house", "published", "shared"}
"""Folders of tests that belong to no single room: about the house as a whole, its documents and the literature."""


@cache
def graph() -> Graph:
    """Module -> the modules that it imports; read when it is asked for, by one of the processes that tests run in."""
    return imports(FILES)


def inside(package: str) -> list[str]:
    return [module for module in FILES if module == package or module.startswith(f"{package}.")]


def test_no_circle_of_files():
    assert circles(graph()) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_circle_of_rooms(package):
    assert circles(of_rooms(graph(), package)) == []


def test_arrows_between_the_packages_point_one_way():
    wrong = [
        f"{module} imports {target}"
        for module, targets in graph().items()
        for target in targets
        if PACKAGES.index(target.split(".")[0]) > PACKAGES.index(module.split(".")[0])
    ]
    assert wrong == []


def test_the_bicycle_stands_on_at_most_eight_floors():
    floor = floors(of_rooms(graph(), "bicycle"))
    assert floor["bicycle.effect"] > floor["bicycle.parameters"] >= 1
    assert max(floor.values()) <= 8, sorted(floor.items(), key=lambda item: item[1])


def test_derivation_knows_no_effect():
    known = {room(target) for module in inside("bicycle.derivation") for target in graph()[module]}
    assert (
        known & {"bicycle.effect", "bicycle.effects", "bicycle.effect.parameter", "bicycle.effect.signature"} == set()
    )


def test_the_ground_of_the_house_imports_nothing_of_the_house():
    ground = inside("tyre.base")
    assert {target for module in ground for target in graph()[module]} <= set(ground)


def test_channels_stand_on_the_ground():
    """Rigs and bicycles read their recordings through them, so that they know of neither."""
    known = {room(target) for module in inside("tyre.channels") for target in graph()[module]}
    assert known == {"tyre.base", "tyre.channels"}


def test_the_bicycle_knows_nothing_of_rigs():
    """The two meet in what a tyre is; how it was measured is unknown to the bicycle."""
    known = {room(target) for module in inside("bicycle") for target in graph()[module]}
    assert "tyre.properties" in known
    assert known & {"tyre.rig", "tyre.recordings", "tyre.campaigns", "tyre.fits"} == set()


def test_inference_needs_numpy_and_scipy_only():
    rooms = inside("studies.inference")
    assert len(rooms) > 5
    assert {target for module in rooms for target in graph()[module]} <= set(rooms)
    outside = {name for module in rooms for name in foreign(module, FILES[module])}
    assert outside - sys.stdlib_module_names == {"numpy", "scipy"}


def test_numbers_are_made_without_presentation():
    drawing = {module for module in inside("tyre") + inside("bicycle") if foreign(module, FILES[module]) & PRESENTATION}
    assert drawing - DRAWN_BY_THE_MODES == set()
    users = {module for module, targets in graph().items() if "bicycle.modal.figure" in targets}
    assert {module for module in users if not module.startswith("studies.")} == {"bicycle.modal.named_modes"}


def test_files_are_short():
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES.values()}
    assert {str(path.relative_to(ROOT)): count for path, count in lines.items() if count > 300} == {}
    assert 70 <= median(count for path, count in lines.items() if path.name != "__init__.py") <= 120


def test_files_of_tests_are_readable_in_one_go():
    long = {path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / "tests").rglob("*.py")}
    assert {name: count for name, count in long.items() if count > 500} == {}


def test_no_function_is_tangled():
    """McCabe's complexity is at most 20; a kernel that is excepted must still need it."""
    command = ["check", "--isolated", "--ignore-noqa", "--no-cache", "--select", "C901", "--output-format", "json"]
    limit = ["--config", "lint.mccabe.max-complexity=20"]
    shown = subprocess.run(
        [sys.executable, "-m", "ruff", *command, *limit, *PACKAGES], capture_output=True, text=True, cwd=ROOT
    )
    assert shown.stderr == ""
    tangled = {
        f"{Path(entry['filename']).relative_to(ROOT).as_posix()}:{entry['message'].split('`')[1]}"
        for entry in json.loads(shown.stdout)
    }
    assert tangled == COMPLEX_KERNELS


def test_tests_mirror_the_rooms():
    """A folder of tests for every room that is a folder, none for anything else; flat tests name a flat room."""
    assert {path.name for path in (ROOT / "tests").iterdir() if _is_room(path)} == BESIDE_THE_ROOMS | set(PACKAGES)
    for package in PACKAGES:
        rooms = {path.name for path in (ROOT / package).iterdir() if _is_room(path)} - {"velotyre"}
        assert {path.name for path in (ROOT / "tests" / package).iterdir() if _is_room(path)} == rooms
        flat = {name.split(".")[1] for name in of_rooms(graph(), package)} - rooms
        for test in (ROOT / "tests" / package).glob("test_*.py"):
            assert test.stem.removeprefix("test_") in flat, f"{test.name} belongs to no room of {package}"


def _is_room(path: Path) -> bool:
    return path.is_dir() and path.name != "__pycache__"


# The reader of imports itself, on a toy house.


@pytest.fixture
def toy(tmp_path):
    """Write a house of the given files, path without suffix -> source, and return its modules."""

    def build(sources: dict[str, str]) -> dict[str, Path]:
        for name, source in sources.items():
            file = tmp_path / f"{name}.py"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(source)
        return modules(tmp_path, ("ground", "house"))

    return build


def test_every_way_of_importing_is_seen(toy):
    files = toy(
        {
            "ground/numbers": "import json, os.path",
            "house/walls/left": "from ground.numbers import pi\nfrom house.walls import right",
            "house/walls/right": "def lift():\n    import house.roof",
            "house/roof": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .walls.left import Brick",
            "house/cellar": "import_module('house.roof')\nfrom numpy import (\n  array,\n)",
        }
    )
    assert imports(files) == {
        "ground.numbers": set(),
        "house.walls.left": {"ground.numbers", "house.walls.right"},
        "house.walls.right": {"house.roof"},
        "house.roof": {"house.walls.left"},
        "house.cellar": set(),
    }
    assert circles(imports(files)) == [["house.roof", "house.walls.left", "house.walls.right"]]
    assert circles(of_rooms(imports(files), "house")) == [["house.roof", "house.walls"]]
    assert named_imports("ground.numbers", files["ground.numbers"]) == {"json", "os.path"}
    assert foreign("house.cellar", files["house.cellar"], ("ground", "house")) == {"numpy"}


def test_the_door_of_a_package_counts_for_circles_of_files(toy):
    files = toy({"house/__init__": "from house.roof import tile", "house/roof": "from house import tile"})
    assert circles(imports(files)) == [["house", "house.roof"]]


def test_circles_and_floors_of_graphs_with_known_answers():
    assert circles({"a": {"b"}, "b": {"a"}, "c": {"a", "d"}, "d": {"e"}, "e": {"d", "c"}, "f": set()}) == [
        ["a", "b"], ["c", "d", "e"],
    ]  # fmt: skip
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []
    assert floors({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == {"c": 1, "b": 2, "a": 3}
    with pytest.raises(ValueError, match=r"a circle through \[\['a', 'b'\]\]"):
        floors({"a": {"b"}, "b": {"a"}})
