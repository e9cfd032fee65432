"""Runs the commands of the README and the documentation and compares the numbers of their results with kept ones.

``pytest tests/golden --golden-update`` writes the kept numbers anew; look at the differences before you commit them.
"""

import json
import math
import re
import shlex
import shutil
import tomllib
from collections import Counter
from collections.abc import Iterator
from csv import reader
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from studies.cli import main

HERE = Path(__file__).parent
CASES: dict[str, dict[str, Any]] = tomllib.loads((HERE / "commands.toml").read_text(encoding="utf-8"))
NAME = re.compile(r"[\w.+#-]{1,40}")  # a class, a mode, a verdict: no prose
UNSTEADY = re.compile(r"version|seconds|took|path|file|folder|sha|date|note|sentence|description|source|warning")
LONG = 6  # a list with more numbers is kept as a summary


def summary(values: list[Any]) -> dict[str, Any]:
    """Give of a long list its length, three of its numbers, their mean and extremes, and the count of each name."""
    numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
    names = Counter(str(value) for value in values if isinstance(value, str | bool) and NAME.fullmatch(str(value)))
    some: dict[str, Any] = {"n": len(values)}
    if len(numbers) < len(values):
        some["names"] = dict(sorted(names.items()))
    if numbers:
        some |= {"numbers": len(numbers), "some": [numbers[0], numbers[len(numbers) // 2], numbers[-1]]}
    finite = [value for value in numbers if math.isfinite(value)]
    if finite:
        some |= {"mean": math.fsum(finite) / len(finite), "least": min(finite), "greatest": max(finite)}
    return some


def kept(content: Any) -> Any:
    """Reduce the ``content`` of a JSON or TOML file to its numbers and names."""
    if isinstance(content, dict):
        return {key: kept(value) for key, value in content.items() if not UNSTEADY.search(key.lower())}
    if isinstance(content, list) and len(content) > LONG:
        if all(isinstance(row, dict) for row in content):
            return {key: kept([row.get(key) for row in content]) for key in content[0] if not UNSTEADY.search(key)}
        if all(isinstance(row, list) and len(row) == len(content[0]) for row in content):
            return [kept(list(column)) for column in zip(*content, strict=True)]
        if not any(isinstance(value, dict | list) for value in content):
            return summary(content)
    if isinstance(content, list):
        return [kept(value) for value in content]
    if isinstance(content, str) and not NAME.fullmatch(content):
        return ""
    return content


def columns(text: str) -> dict[str, Any]:
    """Reduce a CSV table to a summary of each column."""
    header, *rows = [row for row in reader(StringIO(text)) if row and not row[0].startswith("#")] or [[]]
    return {name: summary([number(row[k]) for row in rows]) for k, name in enumerate(header)}


def number(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def contents(text: str, name: str) -> Any:
    """Reduce a result by what its ``name`` ends with."""
    if name.endswith("csv"):
        return columns(text)
    return kept(tomllib.loads(text) if name.endswith("toml") else json.loads(text))


def results(case: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """Run the lines of a ``case`` in the working directory and return exit codes and numbers."""
    found: dict[str, Any] = {}
    for k, line in enumerate(case["run"], 1):
        try:
            main(shlex.split(line))
            code: Any = 0
        except SystemExit as end:
            code = end.code or 0
        said = capsys.readouterr().out
        result = found[f"{k} {line.split()[0]}"] = {"exit": code}
        for kind in ("json", "csv"):
            if f"--{kind} -" in line and code in (0, 1):
                result["out"] = contents(said, kind)
    for pattern in case.get("keep", []):
        files = sorted(Path().glob(pattern))
        assert files, f"nothing written to {pattern}"
        for file in files:
            if not file.name.endswith("manifest.json"):
                found[file.as_posix()] = contents(file.read_text(encoding="utf-8"), file.name)
    return json.loads(json.dumps(found))


def differences(was: Any, now: Any, loose: dict[str, list[float]], place: str = "") -> Iterator[str]:
    """Yield each place whose value is not the kept one."""
    if isinstance(was, dict) and isinstance(now, dict):
        for key in sorted(was.keys() | now.keys()):
            if key in was and key in now:
                yield from differences(was[key], now[key], loose, f"{place}/{key}")
            else:
                yield f"{place}/{key}: {'new' if key in now else 'gone'}"
    elif isinstance(was, list) and isinstance(now, list) and len(was) == len(now):
        for k, pair in enumerate(zip(was, now, strict=True)):
            yield from differences(*pair, loose, f"{place}/{k}")
    elif not same(
        was, now, next((bound for pattern, bound in loose.items() if re.search(pattern, place)), [1e-9, 1e-12])
    ):
        yield f"{place}: {was!r} -> {now!r}"


def same(was: Any, now: Any, bound: list[float]) -> bool:
    if bound[0] == math.inf:
        return True
    if isinstance(was, float | int) and isinstance(now, float | int):
        return math.isclose(was, now, rel_tol=bound[0], abs_tol=bound[1]) or (math.isnan(was) and math.isnan(now))
    return bool(was == now)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("default")
def test_numbers_are_the_kept_ones(
    name: str, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    shutil.copytree(HERE / "inputs", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    if not CASES[name].get("figures"):
        request.getfixturevalue("no_pictures")
    found = results(CASES[name], capsys)
    file = HERE / "expected" / f"{name}.json"
    if request.config.getoption("--golden-update", default=False):
        file.write_text(json.dumps(found, indent=0) + "\n", encoding="utf-8")
    wrong = list(differences(json.loads(file.read_text(encoding="utf-8")), found, CASES[name].get("loose", {})))
    assert not wrong, f"{len(wrong)} differ:\n" + "\n".join(wrong[:20])


def test_a_changed_number_is_seen() -> None:
    was = {"a": [1.0, {"mode": "weave"}], "b": math.nan}
    assert not list(differences(was, {"a": [1.0 + 1e-11, {"mode": "weave"}], "b": math.nan}, {}))
    now = {"a": [1.0 + 1e-8, {"mode": "wobble"}], "c": 1}
    assert len(list(differences(was, now, {}))) == 4
    assert len(list(differences(was, now, {"/a/0": [1e-6, 0.0]}))) == 3
