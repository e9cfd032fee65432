"""Who names a missing effect best? SYNTHETIC modal cases with public truths, five ways to answer, and a scorer.

Cases are made by seed: a folder each with MEASUREMENT.toml and modes.csv, their truths in truths.json. Answers of
others are a JSON object, case -> {"verdict": "none", "named", "class" or "unknown", "class": [names]}, effects of one
hypothesis joined by +; ``--answers FILE`` scores them beside velotyre, the baseline and three rivals.
"""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from tests.validation.blind.cells import make
from tests.validation.blind.rivals import ANSWER, asked
from tests.validation.blind.run import blind_test
from tests.validation.blind.score import judge
from tests.validation.cases import KeptCases, Row, attempted, share
from tyre.ground import InputError, refuse_unknown, write_text

CELLS = ("modal-none", "modal-one", "modal-outside")
VELOTYRE, BASELINE = "velotyre", "least squares and BIC"
Answers = Mapping[str, Mapping[str, Any]]


def run(*, out: Path, seed: int, cases: int = 12, answers: str = "", workers: int = 1) -> dict[str, Any]:
    """Make a number of ``cases`` of each cell, ask everybody, and score; ``answers`` is a file of others."""
    own = blind_test(out / "blind_test_cases.jsonl", cases=cases, seed=seed, cells=CELLS, workers=workers)
    jobs = [(row["cell"], row["seed"]) for row in own if row["verdict"]]
    rivals = KeptCases(out / "benchmark_cases.jsonl", ("cell", "seed")).computed(
        jobs, partial(one_case, cases=str(out / "cases")), workers=workers, what="rivals"
    )
    truths = {called(row): row["truth"] for row in own if row["verdict"]}
    write_text(out / "cases" / "truths.json", json.dumps(truths, indent=1) + "\n")
    told: dict[str, dict[str, Any]] = {VELOTYRE: {}, BASELINE: {}}
    for row in own:
        if row["verdict"]:
            told[VELOTYRE][called(row)] = row["verdict"]
            told[BASELINE][called(row)] = row["baseline"] or ANSWER
    for row in rivals:
        for name, answer in (row["answers"] or {}).items():
            told.setdefault(name, {})[called(row)] = answer
    if answers:
        told[Path(answers).stem] = read_answers(Path(answers))
    found = {name: scored(some, truths) for name, some in told.items()}
    write_text(out / "benchmark.md", table(found))
    return {"cases": len(truths), "errors": [row["error"] for row in rivals if row["error"]], "scores": found}


def read_answers(file: Path) -> dict[str, Any]:
    """Answers by case in a JSON ``file``."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: no answers as JSON: {error}") from error
    if not isinstance(found, dict):
        raise InputError(f"{file}: must be an object, case -> answer")
    return found


def called(row: Row) -> str:
    """Name of a case."""
    return f"{row['cell']}_{row['seed']}"


def one_case(cell: str, seed: int, cases: str) -> Row:
    """Answers of the rivals to the case of a ``cell`` and ``seed``, whose files are kept in the folder ``cases``."""
    return attempted({"cell": cell, "seed": seed, "answers": None}, partial(_asked, cell, seed, Path(cases)))


def _asked(cell: str, seed: int, cases: Path, _: Path, row: Row) -> None:
    folder = cases / called(row)
    without = make(cell, seed, folder)[1]
    row["answers"] = asked(folder, without)


def scored(answers: Answers, truths: Answers) -> dict[str, Any]:
    """Shares, by cell, of ``answers`` by case against the ``truths``; a case without an answer is not known."""
    refuse_unknown("case", answers, truths, where="answers")
    cells: dict[str, list[dict[str, Any]]] = {}
    for case, truth in truths.items():
        answer = answers.get(case, {"verdict": "unknown"})
        if not isinstance(answer, Mapping) or "verdict" not in answer:
            raise InputError(f"answers: {case} must be an object with a verdict and, for a name, its class")
        cells.setdefault(case.rpartition("_")[0], []).append(judge({**ANSWER, **answer}, truth))
    return {
        cell: {
            "right": share(sum(s["right"] or s["tentative_right"] for s in some), len(some)),
            "named_or_class_wrong": share(sum(s["misnamed"] for s in some), len(some)),
            "any_name": share(sum(s["any_name"] for s in some), len(some)),
        }
        for cell, some in cells.items()
    }


COLUMNS = {
    "nothing hidden: any name": ("modal-none", "any_name"), "one effect: right": ("modal-one", "right"),
    "wrong": ("modal-one", "named_or_class_wrong"), "outside the library: any name": ("modal-outside", "any_name"),
}  # fmt: skip


def table(found: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """The scores as a table of Markdown: hits, cases and Wilson's interval at 95 %."""
    from tabulate import tabulate

    rows = []
    for name, cells in found.items():
        shares = [cells[cell][key] if cell in cells else None for cell, key in COLUMNS.values()]
        rows.append([name, *("-" if s is None else f"{s['hits']}/{s['of']}, {_interval(s)}" for s in shares)])
    return str(tabulate(rows, ["", *COLUMNS], tablefmt="github", disable_numparse=True)) + "\n"


def _interval(one: Mapping[str, float]) -> str:
    return f"{100 * one['low']:.0f}-{100 * one['high']:.0f} %"
