"""Is a gap credited to its cause? SYNTHETIC blind cases with one hidden effect of a usual size.

Cells ``modal-one`` and ``history-one`` of the blind test. Each verdict has its ``gap``: chi^2 of the stated model,
with the effect alone and nothing else moved, with the parameters adjusted, and without the effect. Counted: how often
the effect alone closes 90 % of the gap, as chi^2 beyond noise and as its root, which is what a picture of it shows; and
how far the bicycle would have to be another one without it. The bicycle is the stated one, or with ``--spread 100`` off
by its stated uncertainty (%), which then is a part of the gap.
"""

from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from studies.diagnosis import diagnose, find, read_measurement, record
from tests.validation.blind.cells import make
from tests.validation.blind.score import judge
from tests.validation.cases import KeptCases, Row, attempted, share_of

CELLS = ("modal-one", "history-one")
CLOSED = 0.9  # of the gap, asked of the effect alone


def run(*, out: Path, seed: int, cases: int = 15, spread: int = 0, workers: int = 2) -> dict[str, Any]:
    """Make and diagnose a number of ``cases`` of each cell."""
    wanted = [(cell, seed + k, spread) for cell in CELLS for k in range(cases)]
    rows = KeptCases(out / "credit_cases.jsonl", ("cell", "seed", "spread")).computed(
        wanted, one_case, workers=workers, what="credit"
    )
    return {cell: summary([row for row in rows if row["cell"] == cell]) for cell in CELLS}


def one_case(cell: str, seed: int, spread: int) -> Row:
    """Make and diagnose a case of a ``cell`` with its ``seed``, the bicycle off by a ``spread`` (%) of its sd."""
    return attempted({"cell": cell, "seed": seed, "spread": spread}, partial(_credited, cell, seed, spread))


def _credited(cell: str, seed: int, spread: int, folder: Path, row: Row) -> None:
    truth, without = make(cell, seed, folder, spread=spread / 100)
    found = diagnose(read_measurement(folder / "MEASUREMENT.toml"), without=without)
    score = judge(found.verdict.to_dict(), {"effects": truth.effects})
    row |= {"hidden": sorted(truth.effects), "noise": truth.noise, "verdict": found.verdict.verdict}
    row |= {"right": bool(score["right"] or score["tentative_right"]), "gap": record(found, find(found)).get("gap")}


def closed(gap: dict[str, Any]) -> tuple[float, float] | None:
    """Share of a ``gap`` that the effect alone closes, of chi^2 beyond noise and of its root; None without a gap."""
    base, alone, noise = gap["base"], gap["effect_alone"], gap["noise"]
    if base is None or alone is None or base <= noise:
        return None
    left = max(0.0, alone - noise) / (base - noise)
    return 1 - left, 1 - left**0.5


def summary(rows: list[Row]) -> dict[str, Any]:
    """Count the cases ``rows`` of one cell; what is right is counted apart."""
    sound = [row for row in rows if not row["error"]]
    told = [(row, shares) for row in sound if row["gap"] and (shares := closed(row["gap"]))]
    right = [shares for row, shares in told if row["right"]]
    moved = [row["gap"]["without_effect_moved_sd"] for row, _ in told]
    return {
        "cases": len(rows), "errors": [row["error"] for row in rows if row["error"]], "told": len(told),
        "closed_by_the_effect_alone": {
            "chi2": share_of([shares[0] >= CLOSED for _, shares in told]),
            "root": share_of([shares[1] >= CLOSED for _, shares in told]),
            "chi2_where_right": share_of([shares[0] >= CLOSED for shares in right]),
            "median_chi2": median(shares[0] for _, shares in told) if told else None,
        },
        "median_moved_sd_without_the_effect": median(moved) if moved else None,
    }  # fmt: skip
