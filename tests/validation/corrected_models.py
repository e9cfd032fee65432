"""Is the corrected model of a diagnosis known as well as it says? SYNTHETIC blind cases.

Cells ``modal-none``, ``modal-one`` and ``history-one`` of the blind test: a bicycle within its stated uncertainty, and
one with an effect of the library hidden, made by other equations. The corrected model is written as a file and read
again. Counted: how often the true speed above which the weave is stable, from the equations of the hidden machine, lies
within 1.96 standard deviations (its [covariance], to first order) of the model's own, where the verdict leaves no more
than noise; and how the standard deviation compares with the one that would be assumed without the data.
"""

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from bicycle.model import SECTION, Model, build_model, read_model
from bicycle.stability import OSCILLATORY, critical_speed_estimates, critical_speeds
from studies.diagnosis import diagnose, model_text, read_measurement
from tests.validation.blind.cells import make
from tests.validation.cases import KeptCases, Row, attempted, share
from tyre.ground import write_text

CELLS = ("modal-none", "modal-one", "history-one")
TOP = 30.0  # m/s, to which critical speeds are looked for
WITHIN = 1.96  # standard deviations
INSIDE, OUTSIDE, NONE, OPEN, UNSTABLE = "inside", "outside", "no_crossing", "left_open", "no_true_speed"
"""What became of a case: the first two are claims; the model has no such speed; more than noise is left; nor has it."""
FIRST = 40000  # seeds of cases begin at FIRST times the seed


def run(*, out: Path, seed: int, cases: int = 100, histories: int = 40, workers: int = 1) -> dict[str, Any]:
    """Make, diagnose and correct cases, and count."""
    many = {cell: histories if cell.startswith("history") else cases for cell in CELLS}
    wanted = [(cell, FIRST * seed + k) for cell in CELLS for k in range(many[cell])]
    kept = KeptCases(out / "corrected_models_cases.jsonl", ("cell", "seed"))
    rows = kept.computed(wanted, one_case, workers=workers, what="corrected models")
    return {"cells": {cell: summary([r for r in rows if r["cell"] == cell]) for cell in CELLS}}


def one_case(cell: str, seed: int) -> Row:
    """Make, diagnose and correct a case of a ``cell`` with its ``seed``."""
    return attempted({"cell": cell, "seed": seed}, partial(_corrected, cell, seed))


def _corrected(cell: str, seed: int, folder: Path, row: Row) -> None:
    truth, without = make(cell, seed, folder, held_out=1)  # so that the true speed is told
    found = diagnose(read_measurement(folder / "MEASUREMENT.toml"), without=without)
    row |= {"hidden": sorted(truth.effects), "verdict": found.verdict.verdict, "named": found.final.name}
    row |= {"left_open": found.verdict.leaves_more, "true": truth.weave}
    file = folder / "corrected.toml"
    write_text(file, model_text(found))
    plain = {key: value for key, value in tomllib.loads(file.read_text()).items() if key != SECTION}
    row |= {"weave": weave_of(read_model(file)), "assumed": weave_of(build_model(plain))}


def weave_of(model: Model) -> dict[str, float] | None:
    """Find the last speed above which the weave of a ``model`` is stable, and its sd, m/s; None where there is none."""
    wanted = ("weave", OSCILLATORY, False)
    found = [one for one in critical_speeds(model, TOP) if (one.mode, one.kind, one.destabilising) == wanted]
    if not found:
        return None
    (estimate,) = critical_speed_estimates(model, found[-1:], assume=not model.covariance.names)
    return {"value": estimate.value, "sd": estimate.sd}


def outcome(row: Mapping[str, Any]) -> str:
    """Classify the case ``row``."""
    for key, value in (("left_open", OPEN), ("true", UNSTABLE), ("weave", NONE)):
        if row[key] is None or row[key] is True:
            return value
    near = abs(row["weave"]["value"] - row["true"]) <= WITHIN * row["weave"]["sd"]
    return INSIDE if near else OUTSIDE


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Count the cases ``rows`` of one cell."""
    sound = [r for r in rows if not r["error"]]
    count = Counter(outcome(r) for r in sound)
    told = [r for r in sound if outcome(r) in (INSIDE, OUTSIDE)]
    return {
        "cases": len(rows), "errors": len(rows) - len(sound), "inside_95": share(count[INSIDE], len(told)),
        "nothing_claimed": {why: count[why] for why in (NONE, OPEN, UNSTABLE)},
        "median_sd_m_s": median(r["weave"]["sd"] for r in told) if told else None,
        "median_sd_assumed_m_s": median(r["assumed"]["sd"] for r in told if r["assumed"]) if told else None,
    }  # fmt: skip
