"""The blind test: make cases, diagnose them without knowing, then open the truths and score. Resumable, parallel.

Each case has a seed of its own; the result file is one JSON object a line, appended as cases end, so an interrupted
test goes on where it stopped. A case that raises is a line too, with its error, and counts as a crash.
"""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.blind.baseline import baseline
from tests.validation.blind.cells import make
from tests.validation.blind.score import judge
from tests.validation.cases import KeptCases, what_was_raised

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
        record["error"] = what_was_raised(error)
    return record


def _baseline(folder: Path, without: tuple[str, ...]) -> dict[str, Any] | None:
    """The baseline is no part of the test: what it raises must not count as a crash of the search."""
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
    return KeptCases(path, ("cell", "seed"), also=("score",), what="a result file of the blind test")


def blind_test(path: Path, *, cases: int, seed: int, cells: tuple[str, ...], workers: int) -> list[dict[str, Any]]:
    """Results of all cases asked for; what the file does not hold yet is run, and appended as it ends."""
    jobs = [(cell, seed + k) for k in range(cases) for cell in cells]
    return results_in(path).computed(jobs, run_case, workers=workers, what="blind test")
