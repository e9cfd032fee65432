"""How often is the search for a missing effect right? SYNTHETIC cases whose truth it cannot see.

Tables (report.md) are written beside the result.
"""

from pathlib import Path
from typing import Any

from tests.validation.blind.cells import CELLS
from tests.validation.blind.report import write_report
from tests.validation.blind.run import blind_test, results_in
from tests.validation.blind.score import summary
from tyre.ground import InputError, unknown


def run(*, out: Path, seed: int, cases: int = 20, cells: str = "", workers: int = 2) -> dict[str, Any]:
    """Make, diagnose and score a number of ``cases`` of each of some ``cells`` (separated by commas; empty: all)."""
    wanted = tuple(cells.split(",")) if cells else CELLS
    for cell in wanted:
        if cell not in CELLS:
            raise InputError(unknown("cell", cell, CELLS))
    path = out / "blind_test_cases.jsonl"
    blind_test(path, cases=cases, seed=seed, cells=wanted, workers=workers)
    found = summary(results_in(path).read())
    write_report(found, out)
    return {"cells": {cell: {key: _pair(value) for key, value in own.items()} for cell, own in found["cells"].items()}}


def _pair(value: Any) -> Any:
    """Hits and number of cases of a share: the summary is kept small."""
    return [value["hits"], value["of"]] if isinstance(value, dict) else value
