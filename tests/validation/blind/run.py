"""The blind test: make cases, diagnose them without knowing, then open the truths and score. Resumable, parallel.

Each case has a seed of its own; the result file is one JSON object a line, appended as cases end, so an interrupted
test goes on where it stopped. A case that raises is a line too, with its error, and counts as a crash.
"""

import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.blind.baseline import baseline
from tests.validation.blind.cells import make
from tests.validation.blind.score import judge
from tests.validation.cases import KeptCases, Row, attempted

KEPT = ("verdict", "effects", "class", "chi2", "held_out_gap", "goodness_of_fit_p")
EMPTY = {"truth": None, "verdict": None, "score": None, "baseline": None, "seconds": None, "made": False}


def run_case(cell: str, seed: int) -> Row:
    """Make, diagnose and score one case of a ``cell`` with its ``seed``."""
    return attempted({"cell": cell, "seed": seed, **EMPTY}, partial(_judged, cell, seed))


def _judged(cell: str, seed: int, folder: Path, row: Row) -> None:
    truth, without = make(cell, seed, folder)
    sealed = {"effects": dict(truth.effects), "noise": truth.noise}
    row |= {"truth": sealed, "made": True, "baseline": _baseline(folder, without)}
    started = time.perf_counter()
    try:
        row["verdict"] = _diagnosed(folder / "MEASUREMENT.toml", without)
    finally:
        row["seconds"] = round(time.perf_counter() - started, 2)
    row["score"] = judge(row["verdict"], sealed)


def _baseline(folder: Path, without: tuple[str, ...]) -> dict[str, Any] | None:
    """Ask the baseline, which is no part of the test: what it raises must not count as a crash of the search."""
    try:
        return baseline(folder, without)
    except (ArithmeticError, ValueError, KeyError, np.linalg.LinAlgError):
        return None


def _diagnosed(file: Path, without: tuple[str, ...]) -> dict[str, Any]:
    from studies.diagnosis import diagnose, read_measurement

    verdict = diagnose(read_measurement(file), without=without).verdict.to_dict()
    return {key: verdict[key] for key in KEPT} | {"nothing": verdict["posterior"].get("none")}


def results_in(path: Path) -> KeptCases:
    """The file of results ``path``."""
    return KeptCases(path, ("cell", "seed"))


def blind_test(path: Path, *, cases: int, seed: int, cells: tuple[str, ...], workers: int) -> list[dict[str, Any]]:
    """Results of all cases asked for; what the file does not hold yet is run, and appended as it ends."""
    jobs = [(cell, seed + k) for k in range(cases) for cell in cells]
    return results_in(path).computed(jobs, run_case, workers=workers, what="blind test")
