"""The optimum of the search for a missing effect against fits from many random starts, on loud time histories.

Each case is of the cell ``loud-one`` of the blind test (synthetic: 8 free runs, noise 2 % of the motion, some
growing, one effect hidden). The most probable hypothesis of the search and the one that was hidden are fitted again
from random starts, nuisances by their prior and sizes anywhere from neutral to what seldom occurs, every other start by
way of short pieces of the runs. The search has reached the optimum where none of these ends clearly lower.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.cases import KeptCases, Row, attempted

CELL = "loud-one"
SAME, RELATIVE = 0.1, 2e-5  # of the objective -2 ln(posterior density): 0.05 in ln evidence; what no fit resolves


def run(*, out: Path, seed: int, cases: int = 200, starts: int = 20, workers: int = 2) -> dict[str, Any]:
    """Compare; ``missed`` lists hypotheses of which a random start found a clearly lower objective."""
    wanted = [(seed + k, starts) for k in range(cases)]
    kept = KeptCases(out / "search_optimum_cases.jsonl", ("seed", "starts"))
    each = kept.computed(wanted, one_case, workers=workers, what="optimum")
    rows = [{"seed": case["seed"], **row} for case in each for row in case["compared"]]
    missed = [r for r in rows if not r["reached"]]
    broken = [{"seed": case["seed"], "error": case["error"]} for case in each if case["error"]]
    wrong = {r["seed"] for r in (*missed, *broken)}
    return {
        "fits_compared": len(rows), "cases_with_every_optimum_reached": cases - len(wrong),
        "share": 1 - len(wrong) / cases, "missed": missed, "errors": broken,
        "random_starts_that_reached_it": float(np.mean([r["share_of_starts"] for r in rows])) if rows else None,
    }  # fmt: skip


def one_case(seed: int, starts: int) -> Row:
    """One case: objectives of the search and of the best random start for its leader and for what was hidden."""
    return attempted({"seed": seed, "starts": starts, "compared": []}, partial(_compared, seed, starts))


def _compared(seed: int, starts: int, folder: Path, row: Row) -> None:
    from studies.diagnosis import read_measurement
    from studies.inference import judge
    from tests.validation.blind.cells import make
    from tyre.ground import one_blas_thread

    with one_blas_thread():
        truth, without = make(CELL, seed, folder)
        judgement = judge(read_measurement(folder / "MEASUREMENT.toml").prepare(without=without))
        known = judgement.hypotheses
        hidden = known.find(frozenset(truth.effects))
        leader = max((known.null, *known.fits), key=known.log_posterior)
        generator = np.random.default_rng([seed, starts])
        chosen = {f.identifiers: f for f in (leader, hidden) if f is not None}
        row["compared"] = [against_random(judgement.kind, f, generator, starts) for f in chosen.values()]


def against_random(kind: Any, found: Any, generator: np.random.Generator, starts: int) -> dict[str, Any]:
    """A fit against those from random starts: both objectives, and whether the fit is no higher than the lowest."""
    from studies.inference import fit

    ends = []
    for k in range(starts):
        start = random_start(found.unknowns, generator)
        ends.append(fit(kind, found.candidates, starts=[start], patient=k % 2 == 0).objective)
    allowed = SAME + RELATIVE * found.objective
    lowest = float(min(ends))
    return {
        "hypothesis": found.name, "search": found.objective,
        "random": lowest if np.isfinite(lowest) else None, "reached": bool(found.objective <= lowest + allowed),
        "share_of_starts": float(np.mean([end <= found.objective + allowed for end in ends])),
    }  # fmt: skip


def random_start(unknowns: tuple[Any, ...], generator: np.random.Generator) -> Any:
    """Coordinates (p,): nuisances by their prior, sizes evenly over three of its standard deviations, within bounds."""
    found = []
    for u in unknowns:
        z = generator.uniform(0 if u.one_sided else -3, 3) if u.size else generator.normal()
        found.append(float(np.clip(u.centre + u.scale * z, u.lowest, u.highest)))
    return np.array(found)
