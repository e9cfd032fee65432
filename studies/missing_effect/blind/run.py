"""The blind test: make cases, diagnose them without knowing, then open the truths and score. Resumable, parallel.

Each case has a seed of its own; the result file is one JSON object a line, appended as cases end, so an interrupted
test goes on where it stopped. A case that raises is a line too, with its error, and counts as a crash.
"""

import json
import tempfile
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.effect.workers import model_workers
from studies.missing_effect.blind.baseline import baseline
from studies.missing_effect.blind.cells import make
from studies.missing_effect.blind.score import judge
from tyre.base.errors import InputError

BEGIN = '{"cell": '  # of every record
KEPT = ("verdict", "effects", "class", "chi2", "held_out_gap", "goodness_of_fit_p")


def run_case(cell: str, seed: int) -> dict[str, Any]:
    """Make, diagnose and score one case of a ``cell`` with its ``seed``; what raises is kept as ``error``."""
    record: dict[str, Any] = {
        "cell": cell, "seed": seed, "truth": None, "verdict": None, "score": None, "baseline": None, "seconds": None,
        "made": False, "error": None,
    }  # fmt: skip
    try:
        with tempfile.TemporaryDirectory() as name:
            truth, without = make(cell, seed, Path(name))
            sealed = {"effects": dict(truth.effects), "noise": truth.noise}
            record |= {"truth": sealed, "made": True, "baseline": _baseline(Path(name), without)}
            started = time.perf_counter()
            try:
                verdict = _diagnosed(Path(name) / "MEASUREMENT.toml", without)
            finally:
                record["seconds"] = round(time.perf_counter() - started, 2)
            record |= {"verdict": verdict, "score": judge(verdict, sealed)}
    except Exception as error:  # whatever it is: it is counted, and the test goes on
        where = traceback.extract_tb(error.__traceback__)[-1]
        record["error"] = f"{type(error).__name__}: {error} ({Path(where.filename).name}, line {where.lineno})"
    return record


def _baseline(folder: Path, without: tuple[str, ...]) -> dict[str, Any] | None:
    """The baseline is no part of the test: what it raises must not count as a crash of the search."""
    try:
        return baseline(folder, without)
    except (ArithmeticError, ValueError, KeyError, np.linalg.LinAlgError):
        return None


def _diagnosed(file: Path, without: tuple[str, ...]) -> dict[str, Any]:
    from studies.missing_effect.diagnose import diagnose
    from studies.missing_effect.measurement import read_measurement

    verdict = diagnose(read_measurement(file), without=without).verdict.to_dict()
    return {key: verdict[key] for key in KEPT} | {"nothing": verdict["posterior"].get("none")}


def read_results(path: Path) -> list[dict[str, Any]]:
    """Results so far in the file ``path``; InputError where it is something else."""
    if not path.exists():
        return []
    try:
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
        if lines and _is_half(lines[-1]):
            lines.pop()
        records = [json.loads(line) for line in lines if line.strip()]
        if not all({"cell", "seed", "score"} <= set(record) for record in records):
            raise ValueError("not results of a blind test")
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: not a result file of blind-test ({error}); give another --out") from error
    return records


def _is_half(line: str) -> bool:
    """Whether a line is the beginning of a record, and no more: the file of somebody else is not touched."""
    return not line.endswith("\n") and bool(line) and (line.startswith(BEGIN) or BEGIN.startswith(line))


def _forget_half_line(path: Path) -> None:
    """Cut off what a killed run, or a full disk, left of a line: its case is computed again."""
    if not path.exists():
        return
    content = path.read_bytes()
    kept = content.rfind(b"\n") + 1
    if _is_half(content[kept:].decode("utf-8", "replace")):
        with path.open("rb+") as file:
            file.truncate(kept)


def blind_test(path: Path, *, cases: int, seed: int, cells: tuple[str, ...], workers: int) -> Iterator[dict[str, Any]]:
    """Run what the file does not hold yet; yields and appends each result.

    Parameters
    ----------
    path : Path
        Results, one JSON object a line.
    cases : int
        Number of cases of each cell.
    seed : int
        Of the first case; the others follow.
    cells : tuple of str
        Of :data:`studies.missing_effect.blind.cells.CELLS`.
    workers : int
        Number of processes.
    """
    done = {(record["cell"], record["seed"]) for record in read_results(path)}
    todo = [(cell, seed + k) for k in range(cases) for cell in cells if (cell, seed + k) not in done]
    from tyre.base.progress import progress_bar

    _forget_half_line(path)
    with (
        path.open("a", encoding="utf-8") as file,
        model_workers(workers) as pool,
        progress_bar(total=len(todo), desc="blind test", unit=" cases") as bar,
    ):
        waiting = {pool.submit(run_case, *job) for job in todo}
        for future in as_completed(waiting):
            record = future.result()
            file.write(json.dumps(record) + "\n")
            file.flush()
            bar.update()
            yield record
