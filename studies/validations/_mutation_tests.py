"""Which tests run a line of the source, and how long each takes: what a mutation is judged by."""

import json
import re
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tyre.base.errors import InputError
from tyre.base.files import write_text
from tyre.base.optional import not_installed

_DURATION = re.compile(r"^([0-9.]+)s (?:call|setup)\s+(tests/\S.*)$")
_WHOLE_FILE = 0  # line under which all tests that run anything of a file stand


@dataclass(frozen=True)
class LineTests:
    """Tests by the lines that they run.

    Attributes
    ----------
    seconds : dict
        Of each test.
    tests : dict
        Indices of tests by file and line (as text); line 0 holds all tests of the file.
    names : tuple of str
        Of the tests.
    """

    seconds: dict[str, float]
    tests: dict[str, dict[str, list[int]]]
    names: tuple[str, ...]

    def of_lines(self, file: str, first: int, last: int) -> list[str]:
        """Tests that run one of the lines, or of the whole file where it runs at import; quickest first.

        Parameters
        ----------
        file : str
            Path below the top of the source tree.
        first, last : int
        """
        lines = self.tests.get(file, {})
        found = {k for line in range(first, last + 1) for k in lines.get(str(line), ())}
        chosen = found or set(lines.get(str(_WHOLE_FILE), ()))
        return self._sorted(chosen)

    def of_places(self, places: Iterable[tuple[str, int]]) -> list[str]:
        """Tests that run one of some ``places``, files and lines; quickest first."""
        return self._sorted({k for file, line in places for k in self.tests.get(file, {}).get(str(line), ())})

    def _sorted(self, chosen: set[int]) -> list[str]:
        return sorted((self.names[k] for k in chosen), key=lambda name: (self.seconds.get(name, 0.0), name))


def measure(tree: Path, parts: Sequence[str], *, workers: int, selected: Sequence[str]) -> LineTests:
    """Run the tests of a source ``tree`` once under coverage.

    Parameters
    ----------
    tree : Path
    parts : sequence of str
        Folders whose lines are recorded.
    workers : int
        Processes.
    selected : sequence of str
        Tests or folders of tests.

    Raises
    ------
    InputError
        Coverage is not installed.
    """
    try:
        from coverage import CoverageData
    except ImportError as error:
        raise InputError(f"mutation: {not_installed('pytest-cov', extra='mutation')}") from error
    write_text(tree / "mutation.rc", "[run]\ncore = ctrace\n")
    settings = [f"--cov={part}" for part in parts]
    ran = subprocess.run(
        [
            sys.executable, "-m", "pytest", "-q", "-vv", "-n", str(workers), "--durations=0", "--durations-min=0",
            "--cov-config=mutation.rc", "--cov-context=test", "--cov-report=", *settings, *selected,
        ],
        cwd=tree, capture_output=True, text=True, check=False,
    )  # fmt: skip
    seconds: dict[str, float] = {}
    for line in ran.stdout.splitlines():
        if found := _DURATION.match(line):
            seconds[found[2]] = seconds.get(found[2], 0.0) + float(found[1])
    data = CoverageData(str(tree / ".coverage"))
    data.read()
    return _by_lines(tree, data, seconds)


def _by_lines(tree: Path, data: Any, seconds: dict[str, float]) -> LineTests:
    index: dict[str, int] = {}
    tests: dict[str, dict[str, list[int]]] = {}
    for path in sorted(data.measured_files()):
        lines: dict[str, list[int]] = {}
        every: set[int] = set()
        for line, contexts in data.contexts_by_lineno(path).items():
            ran = {context.rpartition("|")[0] for context in contexts if "|" in context}
            numbers = sorted({index.setdefault(name, len(index)) for name in ran})
            every |= set(numbers)
            if numbers:
                lines[str(line)] = numbers
        lines[str(_WHOLE_FILE)] = sorted(every)
        tests[Path(path).relative_to(tree).as_posix()] = lines
    return LineTests(seconds, tests, tuple(index))


def write_map(path: Path, found: LineTests) -> None:
    """Keep what was ``found`` in the file ``path``, as JSON."""
    write_text(path, json.dumps({"seconds": found.seconds, "tests": found.tests, "names": found.names}))


def read_map(path: Path) -> LineTests:
    """What :func:`write_map` wrote to ``path``."""
    content = json.loads(path.read_text(encoding="utf-8"))
    return LineTests(content["seconds"], content["tests"], tuple(content["names"]))
