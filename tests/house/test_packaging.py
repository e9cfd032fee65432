"""The house: packages listed are packages on disk, data are found from a wheel and from a bare checkout."""

import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_listed_packages_are_those_on_disk():
    listed = set(tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"])
    found = {
        ".".join(init.parent.relative_to(ROOT).parts)
        for top in ("tyre", "bicycle", "studies")
        for init in (ROOT / top).rglob("__init__.py")
    }
    assert listed == found | {"tyre.data"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    source = (
        folder / "source"
    )  # a copy, for setuptools leaves its build folder in the source and packs what it finds there
    source.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for name in ("tyre", "bicycle", "studies", "data"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", folder, source],
        check=True, capture_output=True,
    )  # fmt: skip
    return next(folder.glob("*.whl"))


QUESTION = "from bicycle import load_bicycle; from tyre import TyreMap; import tyre.paths; " + (
    "print(load_bicycle('benchmark')['w'], TyreMap.load('Tyre1').tyre, tyre.paths.__file__)"
)


def ask(path):
    """Run in an isolated interpreter (-I: no editable install of this checkout is shadowed by the folder)."""
    code = f"import sys; sys.path.insert(0, {str(path)!r}); {QUESTION}"
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd="/").stdout


def test_wheel_holds_every_data_file(wheel):
    inside = set(zipfile.ZipFile(wheel).namelist())
    for path in (ROOT / "data").rglob("*"):
        if path.suffix in (".csv", ".toml", ".md", ".json"):
            assert f"tyre/data/{path.relative_to(ROOT / 'data').as_posix()}" in inside
    templates = [path.relative_to(ROOT).as_posix() for path in (ROOT / "studies").rglob("*.j2")]
    assert templates
    assert set(templates) <= inside


def test_data_are_found_in_an_unpacked_and_in_a_zipped_wheel(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path)
    assert ask(tmp_path).startswith(f"1.02 Tyre1 {tmp_path}")
    assert ask(wheel).startswith(f"1.02 Tyre1 {wheel}")


def test_data_are_found_in_a_bare_checkout(tmp_path):
    for name in ("tyre", "bicycle", "studies", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    code = (
        "import sys; sys.meta_path = [f for f in sys.meta_path if 'editable' not in type(f).__module__ + str(f)]; "
        f"sys.path.insert(0, {str(tmp_path)!r}); {QUESTION}"
    )
    shown = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd="/").stdout
    assert shown.startswith("1.02 Tyre1")


def test_importing_stays_light():
    heavy = ("matplotlib.pyplot", "control", "pandas", "xarray", "dask", "sphinx")
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r}); import tyre, bicycle, studies.cli; "
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert shown.strip() == "[]"


def test_help_lists_every_command_and_stays_light():
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r}); from studies.cli import main; main(['--help']); "
        "print([name for name in ('matplotlib', 'sympy', 'scipy', 'pandas') if name in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    for module in (ROOT / "studies" / "commands").glob("[a-z]*.py"):
        assert f"  {module.stem.replace('_', '-')} " in shown
    assert shown.splitlines()[-1] == "[]"
