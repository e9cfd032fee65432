"""The house: packages listed are packages on disk, data are found from a wheel and from a bare checkout."""

import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]


def test_listed_packages_are_those_on_disk():
    setup = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    listed = set(setup["packages"])
    elsewhere = {folder.replace("/", "."): name for name, folder in setup["package-dir"].items()}
    found = {
        ".".join(init.parent.relative_to(ROOT).parts)
        for top in ("tyre", "bicycle", "studies")
        for init in (ROOT / top).rglob("__init__.py")
    }
    assert listed == {elsewhere.get(name, name) for name in found} | {"tyre.data"}


NO_LIBRARIES = {"build", "mypy", "pandas-stubs", "ruff", "setuptools", "twine"}  # nothing of the package runs with them
TOO_NEW = {"mat-io"}  # needs a numpy above the oldest
PAGE = {"axe-core-python", "dash", "playwright"}  # of the explorer, which is tested with the newest


def numbers_of(text):
    numbers = [int(number) for number in text.split(".")]
    return tuple(numbers + [0] * (3 - len(numbers)))


def test_the_oldest_versions_of_the_checks_are_those_that_are_allowed():
    lines = (ROOT / ".ci" / "oldest.txt").read_text().splitlines()
    pinned = dict(line.lower().split("==") for line in lines if "==" in line)
    apart = ("docs", "benchmarks")  # no test needs them
    extras = [one for name, many in project()["optional-dependencies"].items() if name not in apart for one in many]
    stated = dict(one.lower().split(">=") for one in (*project()["dependencies"], *extras) if ">=" in one)
    libraries = {name for name in stated if not name.startswith("types-")} - NO_LIBRARIES - TOO_NEW - PAGE
    assert libraries == pinned.keys() - {"canmatrix", "numcodecs", "pyparsing"}
    assert {name: numbers_of(pinned[name]) for name in libraries} == {
        name: numbers_of(stated[name]) for name in libraries
    }
    for name in ("numpy", "zarr", "netcdf4"):  # stated more than once, and alike
        assert len({one.lower() for one in (*project()["dependencies"], *extras) if one.lower().startswith(name)}) == 1


def test_the_extra_all_has_every_extra_of_a_user():
    extras = project()["optional-dependencies"]
    (chosen,) = [one.removeprefix("velotyre[").removesuffix("]").split(",") for one in extras["all"]]
    assert {*chosen, "all", "benchmarks", "docs", "test"} == set(extras)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A copy, for setuptools leaves its build folder in the source and packs what it finds there."""
    folder = tmp_path_factory.mktemp("source")
    for file in (*ROOT.glob("[A-Z]*.*"), ROOT / "pyproject.toml", ROOT / "setup.py"):  # README.md ...
        shutil.copy(file, folder)
    shutil.copy(ROOT / "LICENSE", folder)
    for name in ("tyre", "bicycle", "studies", "data", "docs"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    settings = folder / "pyproject.toml"
    settings.write_text(settings.read_text().replace('"-O3"', '"-O0"'))  # no test asks how fast this kernel is
    return folder


@pytest.fixture(scope="module")
def packages(source, tmp_path_factory):
    """A source distribution, and a wheel that is built from it."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, source], check=True, capture_output=True
    )
    return folder


@pytest.fixture(scope="module")
def wheel(packages):
    return next(packages.glob("*.whl"))


@pytest.fixture(scope="module")
def unpacked(wheel, tmp_path_factory):
    """The wheel as it is installed; what one interpreter compiles there serves the next."""
    folder = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheel).extractall(folder)
    return folder


def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_packages_are_what_an_index_takes(packages):
    files = sorted(packages.iterdir())
    name = f"velotyre-{project()['version']}"
    assert [file.name for file in files][1:] == [f"{name}.tar.gz"]
    assert files[0].name.startswith(f"{name}-cp311-abi3-")
    shown = subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *files], capture_output=True, text=True)
    assert shown.returncode == 0, shown.stdout + shown.stderr
    assert shown.stdout.count("PASSED") == 2


def test_the_source_distribution_holds_what_one_works_with(packages):
    with tarfile.open(next(packages.glob("*.tar.gz"))) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {"CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "docs/index.md", "docs/conf.py"}
    assert wanted | {"studies/diagnosis/templates/report.md.j2", "data/SOURCES.md"} <= names
    assert not {name for name in names if name.startswith(("docs/api/", "docs/auto_gallery/", "docs/generated/"))}


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no compiler: the wheel does without the kernel")
def test_the_wheel_holds_the_kernel_in_c(wheel):
    assert any(name.startswith("bicycle/_kernel.abi3.") for name in zipfile.ZipFile(wheel).namelist())


def test_a_wheel_made_without_a_compiler_is_for_every_platform(source, tmp_path):
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path, source]
    subprocess.run(command, check=True, capture_output=True, env=os.environ | {"CC": "false"})
    (wheel,) = tmp_path.iterdir()
    assert wheel.name == f"velotyre-{project()['version']}-py3-none-any.whl"
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (described,) = (name for name in names if name.endswith(".dist-info/WHEEL"))
        assert "Root-Is-Purelib: true" in archive.read(described).decode()
    assert {"bicycle/model/eigen.py", "tyre/data/SOURCES.md"} <= set(names)
    assert not [name for name in names if name.startswith("bicycle/_kernel.") and not name.endswith(".c")]


def test_every_package_says_that_it_is_typed(wheel):
    inside = set(zipfile.ZipFile(wheel).namelist())
    assert {f"{name}/py.typed" for name in ("tyre", "bicycle", "studies", "velotyre")} <= inside


def test_the_version_stands_in_one_place(printed):
    stated = project()["version"]
    assert version("velotyre") == stated, "install again: pip install -e ."
    assert printed("--version").strip() == f"velotyre, version {stated}"


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors", "version", "date-released", "license"} <= citation.keys()
    assert citation["version"] == project()["version"]
    assert citation["license"] == project()["license"]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = [line for line in changes.splitlines() if line.startswith("## ") and line != "## Unreleased"]
    newest = released[0]
    assert newest == f"## {citation['version']} - {citation['date-released'].isoformat()}"


USER = """
import velotyre as vt

tyre = vt.RelaxationLength(cornering_stiffness={"rear": 6000.0, "front": 5000.0}, relaxation_length=0.1)
model = vt.Model(vt.load_bicycle("benchmark"), [tyre, vt.effects.SteerDamper(damping=1.0)])
hertz: float = vt.critical_speeds(vt.Model(vt.load_bicycle("benchmark"), tyre))[0].frequency_hz
vt.modes(model, [5.0]).plot()
vt.RelaxationLength(cornering_stiffness=6000.0, relaxation_lenght=0.1)
vt.SteerDamper(damping="1")
vt.SteerDampr
"""

BESIDE = (
    "numpy", "scipy", "sympy", "pandas", "matplotlib", "xarray", "click", "yaml", "control", "threadpoolctl", "dask",
    "distributed", "zarr", "jinja2", "tqdm",
)  # fmt: skip
"""Libraries that cost mypy most of its time and that the user's script does not need checked."""


def test_a_type_checker_knows_the_door_and_the_parameters_of_effects(unpacked, tmp_path):
    (tmp_path / "user.py").write_text(USER.lstrip())
    skipped = ",".join(f"{name}.*" for name in BESIDE)
    settings = "[mypy]\nfollow_imports = silent\nignore_missing_imports = True\n"
    settings += f"[mypy-{skipped}]\nfollow_imports = skip\nfollow_imports_for_stubs = True\n"
    (tmp_path / "mypy.ini").write_text(settings)
    shown = subprocess.run(
        [sys.executable, "-m", "mypy", f"--cache-dir={os.devnull}", "user.py"],
        capture_output=True, text=True, cwd=tmp_path, env=os.environ | {"MYPYPATH": str(unpacked)},
    ).stdout  # fmt: skip
    errors = [line for line in shown.splitlines() if ": error:" in line]
    assert [line.partition(": error: ")[0] for line in errors] == ["user.py:7", "user.py:8", "user.py:9"], shown
    assert 'Unexpected keyword argument "relaxation_lenght"' in errors[0]
    assert 'Argument "damping" to "SteerDamper" has incompatible type "str"; expected "float"' in errors[1]
    assert 'maybe "SteerDamper"?' in errors[2]


QUESTION = "from bicycle import load_bicycle; from tyre import TyreMap; import tyre.ground.files; " + (
    "print(load_bicycle('benchmark')['w'], TyreMap.load('Tyre1').tyre, tyre.ground.files.__file__)"
)
DOOR = "import velotyre as vt; print(vt.SideSlip.identifier, vt.__file__)"
MEASURED = "print([vt.read_measurement(name).name for name in ('kooijman2008', 'tyre1_drum')])"  # tables elsewhere


def ask(path, question=QUESTION):
    """Run with a ``path`` before all others: no editable install of this checkout is in its way."""
    code = f"import sys; sys.path.insert(0, {str(path)!r}); {question}"
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd="/").stdout


def test_wheel_holds_every_data_file(wheel):
    inside = set(zipfile.ZipFile(wheel).namelist())
    kept = (".csv", ".toml", ".md", ".json", ".txt")
    data = {f"tyre/{path.relative_to(ROOT).as_posix()}" for path in (ROOT / "data").rglob("*") if path.suffix in kept}
    templates = {path.relative_to(ROOT).as_posix() for path in (ROOT / "studies").rglob("*.j2")}
    assert templates
    assert data | templates <= inside


@pytest.mark.parametrize("form", ["wheel", "unpacked"])
def test_data_door_and_measurements_by_name_work_from_a_zipped_and_an_unpacked_wheel(request, form):
    place = request.getfixturevalue(form)
    data, door, *measured = ask(place, f"{QUESTION}; {DOOR}; {MEASURED if form == 'wheel' else ''}").splitlines()
    assert data.startswith(f"1.02 Tyre1 {place}")
    assert door.startswith(f"side_slip {place}")
    assert measured == ["['kooijman2008', 'tyre1_drum']"] * (form == "wheel")


def test_data_are_found_in_a_bare_checkout(tmp_path):
    for name in ("tyre", "bicycle", "studies", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    bare = "sys.meta_path = [f for f in sys.meta_path if 'editable' not in type(f).__module__ + str(f)]"
    assert ask(tmp_path, f"{bare}; {QUESTION}").startswith("1.02 Tyre1")


STAGES = """
def loaded(*names): print([name for name in names if name in sys.modules])
import studies.velotyre as vt
loaded("numpy", "sympy", "bicycle", "tyre")
from studies.cli import main
main(["--help"])
loaded("matplotlib", "sympy", "scipy", "pandas")
vt.load_bicycle
loaded("matplotlib", "pandas", "control", "xarray")
import bicycle
loaded(*bicycle.LATER.values())
import tyre
loaded("matplotlib.pyplot", "control", "pandas", "xarray", "dask", "sphinx")
"""


def test_importing_stays_light_and_help_lists_every_command():
    """One process imports more and more and says each time what it must not have loaded."""
    shown = ask(ROOT, f"exec({STAGES!r})").splitlines()
    assert [line for line in shown if line.startswith("[")] == ["[]"] * 5
    for module in (ROOT / "studies" / "commands").glob("[a-z]*.py"):
        assert any(line.startswith(f"  {module.stem.replace('_', '-')} ") for line in shown)


REFUSED = """
amplitude nope
animate benchmark --mode nope --speed 5 --out nope.gif
bicycles nope
chart benchmark --x speed=1:10 --y c=nan:0.12 --out chart
chart benchmark --x speed=nan:10 --y c=0.02:0.12 --out chart
critical nope
critical benchmark --tyre nope
design benchmark --keep nope stable --up-to 6 --vary c --out nope.toml
design benchmark --keep weave stable --up-to 6 --vary nope --out nope.toml
diagnose nope
diagnose docs/examples/measurements/bench/MEASUREMENT.toml --with nope
diagnose docs/examples/measurements/histories/MEASUREMENT.toml --with nope
diagnose docs/examples/measurements/joint/MEASUREMENT.toml --with nope
diagnose docs/examples/measurements/modal/MEASUREMENT.toml --with nope
diagnose docs/examples/measurements/modal/MEASUREMENT.toml --without nope
effects nope
explore nope
look nope.csv
modal nope.csv@4.6 --from 0.4 --to 3 --out weave.csv
modes benchmark --speeds nan
new x.toml --bicycle nope
run --bicycle nope
root-locus benchmark --parameter nope --range 1:2 --out nope
sensitivity benchmark --mode nope --speed 5
sweep nope.toml
tyres nope
tyre fit nope --out fit
uncertainty benchmark --sd c=nan
uncertainty benchmark --sd nope=1
"""
REFUSE = """
import sys
from studies.cli import main
slow = ["sympy.core", "pandas", "matplotlib", "scipy.optimize", "scipy.stats", "scipy.signal", "scipy.integrate"]
for line in {!r}.strip().splitlines():
    try:
        main(line.split())
        print(line, "was not refused")
    except SystemExit as end:
        print(line, end.code, [name for name in slow if name in sys.modules])
"""


def test_a_refusal_waits_for_no_library_that_takes_long_to_load():
    """A second each on a quiet machine, which no test can time: what they load is named instead."""
    shown = ask(ROOT, f"exec({REFUSE.format(REFUSED)!r})").splitlines()
    assert shown == [f"{line} 2 []" for line in REFUSED.strip().splitlines()]
