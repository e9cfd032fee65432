"""The blind test: make cases, diagnose them without knowing, then open the truths and score. Resumable, parallel.

Each case has a seed of its own; the result file is one JSON object a line, appended as cases end, so an interrupted
test goes on where it stopped. The median noise level is 1; cases take 0.5, 1 or 2 for the power curve.
"""

import json
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.effect.workers import model_workers
from studies.missing_effect.blind.generator import HIDDEN, Truth, modal_case
from studies.missing_effect.blind.histories import history_case
from studies.missing_effect.blind.score import judge
from tyre.base.errors import InputError

CELLS = ("modal-none", "modal-one", "modal-none-tight", "modal-pair", "modal-outside", "history-none", "history-one")
PAIRS = (("steer_damper", "steer_spring"), ("steer_damper", "pneumatic_trail"), ("steer_spring", "pneumatic_trail"))
NOISE = (0.5, 1.0, 2.0)
FEWER_RUNS = 4


def make(cell: str, seed: int, folder: Path) -> tuple[Truth, tuple[str, ...]]:
    """Write a case of ``cell`` and ``seed`` into ``folder``; its truth and the effects taken out of the library."""
    rng = np.random.default_rng([seed, CELLS.index(cell)])
    names = list(HIDDEN)
    one = (str(rng.choice(names)),)
    noise = float(rng.choice(NOISE))
    if cell == "modal-pair":
        pair = PAIRS[int(rng.integers(len(PAIRS)))]
        return modal_case(folder, hidden=pair, rng=rng, noise=noise, points=16, cell=cell), ()
    if cell in ("modal-one", "modal-outside"):
        truth = modal_case(folder, hidden=one, rng=rng, noise=noise, cell=cell)
        return truth, one if cell == "modal-outside" else ()
    if cell.startswith("modal-none"):
        return modal_case(
            folder, hidden=(), rng=rng, noise=noise, cell=cell, too_tight=1.5 if "tight" in cell else 1.0
        ), ()
    hidden = one if cell == "history-one" else ()
    nonlinear = bool(rng.random() < 0.3) and one[0] not in ("relaxation_length", "camber_thrust")
    settings: dict[str, Any] = {"noise": noise, "nonlinear": nonlinear, "runs": FEWER_RUNS, "duration": 3.0}
    return history_case(folder, hidden=hidden, rng=rng, cell=cell, **settings), ()


def run_case(cell: str, seed: int) -> dict[str, Any]:
    """Make, diagnose and score one case of a ``cell`` with its ``seed``."""
    from studies.missing_effect.diagnose import diagnose
    from studies.missing_effect.measurement import read_measurement

    with tempfile.TemporaryDirectory() as name:
        truth, without = make(cell, seed, Path(name))
        started = time.perf_counter()
        verdict = diagnose(read_measurement(Path(name) / "MEASUREMENT.toml"), without=without).verdict.to_dict()
    sealed = {"effects": dict(truth.effects), "noise": truth.noise}
    kept = {key: verdict[key] for key in ("verdict", "effects", "class", "chi2", "held_out_gap", "goodness_of_fit_p")}
    kept["nothing"] = verdict["posterior"]["none"]
    return {
        "cell": cell, "seed": seed, "truth": sealed, "verdict": kept, "score": judge(verdict, sealed),
        "seconds": round(time.perf_counter() - started, 2),
    }  # fmt: skip


def read_results(path: Path) -> list[dict[str, Any]]:
    """Results so far in the file ``path``; InputError where it is something else."""
    if not path.exists():
        return []
    try:
        records = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
        if not all({"cell", "seed", "score"} <= set(record) for record in records):
            raise ValueError("not results of a blind test")
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: not a result file of blind-test ({error}); give another --out") from error
    return records


def blind_test(path: Path, *, cases: int, seed: int, cells: tuple[str, ...], workers: int) -> Iterator[dict[str, Any]]:
    """Run what the file does not hold yet; yields and appends each result.

    Parameters
    ----------
    path : Path
        Results, one JSON object a line.
    cases : int
        Of each cell.
    seed : int
        Of the first case; the others follow.
    cells : tuple of str
        Of :data:`CELLS`.
    workers : int
        Processes.
    """
    done = {(record["cell"], record["seed"]) for record in read_results(path)}
    todo = [(cell, seed + k) for k in range(cases) for cell in cells if (cell, seed + k) not in done]
    from tyre.base.progress import progress_bar

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
