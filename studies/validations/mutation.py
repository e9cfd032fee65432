"""How many small faults in the source do the tests notice? A sign turned, a number changed, a term dropped, at random.

Of all such faults in the physics and the statistics (`bicycle`, `tyre`, `studies/inference`, `studies/uncertainty`,
`studies/missing_effect`) some are drawn; each is put into a copy of the source tree and judged by the tests that run
its line, quickest first. Needs a source tree with its tests and pytest-cov (extra `mutation`). Resumable: run again to
go on. Survivors are listed: a stranger says of each whether it is a hole, a mere tolerance, or no change at all.
"""

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from studies.validations._mutants import Mutant, all_mutants
from studies.validations._mutation_callers import COMPILED, callers
from studies.validations._mutation_tests import LineTests, measure, read_map, write_map
from tyre.base.errors import InputError
from tyre.base.files import write_text

PARTS = ("bicycle", "tyre", "studies/inference", "studies/uncertainty", "studies/missing_effect")
AROUND = ("studies", "tests", "data", "docs", "pyproject.toml", "README.md", "LICENSE")
OWN = ("tests/house", "tests/docs")
"""Tests of the source as text: they judge no behaviour."""

_SPARE = 60.0  # s beyond four times what the tests take
_COMPILING = 120.0  # s more where kernels are compiled anew
_PASSED = 0  # pytest's code


def run(*, out: Path, seed: int, mutants: int = 500, workers: int = 2, longest: float = 90.0) -> dict[str, Any]:
    """Draw faults and count those that tests notice.

    Parameters
    ----------
    out : Path
        Gets ``tests.json`` (which tests run which lines) and ``mutants.jsonl``, a line for each fault.
    seed : int
        Of the draw.
    mutants : int
        Number of faults.
    workers : int
        Number of processes.
    longest : float
        Time of the tests that judge one fault at most, s; the quickest are taken.

    Returns
    -------
    dict
        Counts by part of the source, and the survivors.

    Raises
    ------
    InputError
        There is no source tree with tests here.
    """
    top = Path(__file__).parents[2]
    if not (top / "tests").is_dir() or not (top / "pyproject.toml").is_file():
        raise InputError(f"mutation: {top} holds no tests; run it in a source tree of velotyre")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        trees = [_copy(top, Path(name) / str(k)) for k in range(workers)]
        kept = out / "tests.json"
        if not kept.exists():
            ignored = [f"--ignore={folder}" for folder in OWN]
            write_map(kept, measure(trees[0], PARTS, workers=workers, selected=["tests", *ignored]))
        tests = read_map(kept)
        drawn = random.Random(seed).sample(all_mutants(top, PARTS), mutants)
        rows = _judge_all(drawn, trees, tests, out / "mutants.jsonl", longest)
    return {
        "what": "faults put into the source and noticed by the tests that run their line",
        "seed": seed,
        "mutants": mutants,
        "tests_at_most_s": longest,
        "made_by": f"velotyre validate mutation --seed {seed} --mutants {mutants}",
        "by_part": {part: dict(Counter(r["end"] for r in rows if r["file"].startswith(part))) for part in PARTS},
        "all": dict(Counter(row["end"] for row in rows)),
        "survivors": [row["name"] for row in rows if row["end"] in ("survived", "no test runs it")],
    }


def _copy(top: Path, tree: Path) -> Path:
    ignored = shutil.ignore_patterns("__pycache__", ".git", "*.egg-info", "out")
    for name in dict.fromkeys([part.split("/")[0] for part in PARTS] + list(AROUND)):
        source = top / name
        if source.is_dir():
            shutil.copytree(source, tree / name, ignore=ignored, symlinks=True)
        else:
            tree.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, tree / name)
    return tree


def _judge_all(
    drawn: list[Mutant], trees: list[Path], tests: LineTests, kept: Path, longest: float
) -> list[dict[str, Any]]:
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    done = {row["name"] for row in rows}
    left = [mutant for mutant in drawn if mutant.name not in done]
    todo = iter(sorted(left, key=lambda mutant: mutant.file.endswith(COMPILED)))  # a minute each: last
    with ThreadPoolExecutor(len(trees)) as pool:
        for part in pool.map(lambda tree: list(_judged(todo, tree, tests, kept, longest)), trees):
            rows += part
    judged = {row["name"]: row for row in rows}
    return [judged[mutant.name] for mutant in drawn]  # in their order, whichever thread was first


def _judged(
    todo: Iterator[Mutant], tree: Path, tests: LineTests, kept: Path, longest: float
) -> Iterator[dict[str, Any]]:
    for mutant in todo:
        row = judge(mutant, tree, tests, longest)
        with kept.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(row) + "\n")
        yield row


def judge(mutant: Mutant, tree: Path, tests: LineTests, longest: float) -> dict[str, Any]:
    """Put one fault into a ``tree``, run tests, and take it out again.

    Parameters
    ----------
    mutant : Mutant
    tree : Path
        A source tree of its own.
    tests : LineTests
    longest : float
        Time of the chosen tests at most, s.

    Returns
    -------
    dict
        ``end`` is "killed", "killed by time", "survived" or "no test runs it".
    """
    chosen: list[str] = []
    taken = 0.0
    compiled = mutant.file.endswith(COMPILED)
    if compiled:
        known = tests.of_places(callers(tree, PARTS, mutant.file))
    else:
        known = tests.of_lines(mutant.file, mutant.line, mutant.end_line)
    for name in known:
        taken += tests.seconds.get(name, 0.0)
        if chosen and taken > longest:
            break
        chosen.append(name)
    row = {"name": mutant.name, "file": mutant.file, "line": mutant.line, "tests": len(chosen), "of_tests": len(known)}
    if not chosen:
        return {**row, "end": "no test runs it"}
    path = tree / mutant.file
    sound = path.read_text(encoding="utf-8")
    try:
        write_text(path, mutant.applied(sound))
        code = _pytest(tree, chosen, min(taken, longest), compiled=compiled)
    finally:
        write_text(path, sound)
    return {**row, "end": "killed by time" if code is None else "survived" if code == _PASSED else "killed"}


def _pytest(tree: Path, chosen: list[str], seconds: float, *, compiled: bool) -> int | None:
    """Exit code of the tests; None where they do not end."""
    names = tree / "chosen.txt"
    write_text(names, "\n".join(chosen) + "\n")
    with tempfile.TemporaryDirectory() as fresh:
        cache = fresh if compiled else str(tree / "compiled")
        around = {**os.environ, "PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": cache}
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", f"@{names}"]
        try:
            ran = subprocess.run(
                command, cwd=tree, env=around, capture_output=True, check=False,
                timeout=4 * seconds + _SPARE + _COMPILING * compiled,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return None
    return ran.returncode
