"""Is the corrected model of a diagnosis known as well as it says? SYNTHETIC blind cases.

Cells ``modal-none``, ``modal-one`` and ``history-one`` of the blind test: a bicycle within its stated uncertainty, and
one with an effect of the library hidden, made by other equations. The corrected model is written as a file and read
again. Counted: how often the true speed above which the weave is stable, from the equations of the hidden machine, lies
within 1.96 standard deviations (its [covariance], to first order) of the model's own, where the verdict leaves no more
than noise; and how the standard deviation compares with the one that would be assumed without the data.

Cases are kept in ``corrected_models_cases.jsonl`` in the folder of the result, so an interrupted run goes on.
"""

import tempfile
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from bicycle.critical import OSCILLATORY, critical_speeds
from bicycle.model import Model
from bicycle.model_file import SECTION, build_model, read_model
from bicycle.propagation import critical_speed_estimates
from studies.diagnosis import diagnose, model_text, read_measurement
from tests.validation.blind.cells import make
from tests.validation.blind.score import wilson
from tests.validation.cases import KeptCases, what_was_raised
from tyre.files import write_text

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
    kept = KeptCases(out / "corrected_models_cases.jsonl", ("cell", "seed"), also=("error",))
    rows = kept.computed(wanted, one_case, workers=workers, what="corrected models")
    return {
        "synthetic": True,
        "what": "true speed above which the weave is stable, against the corrected model and its covariance",
        "seed": seed,
        "made_by": f"python -m tests.validation corrected-models --seed {seed} --cases {cases} --histories {histories}",
        "cells": {cell: summary([r for r in rows if r["cell"] == cell]) for cell in CELLS},
    }


def one_case(cell: str, seed: int) -> dict[str, Any]:
    """Make, diagnose and correct a case of a ``cell`` with its ``seed``; what raises is kept as ``error``."""
    row: dict[str, Any] = {"cell": cell, "seed": seed, "error": None}
    try:
        with tempfile.TemporaryDirectory() as name:
            truth, without = make(cell, seed, Path(name), held_out=1)  # so that the true speed is told
            measurement = read_measurement(Path(name) / "MEASUREMENT.toml")
            found = diagnose(measurement, without=without)
            row |= {"hidden": sorted(truth.effects), "verdict": found.verdict.verdict, "named": found.final.name}
            row |= {"left_open": found.verdict.leaves_more, "true": truth.weave}
            file = Path(name) / "corrected.toml"
            write_text(file, model_text(found))
            model = read_model(file)
            row |= {"weave": weave_of(model), "assumed": weave_of(assumed(file))}
    except Exception as error:  # whatever it is: it is counted, and the run goes on
        row["error"] = what_was_raised(error)
    return row


def assumed(file: Path) -> Model:
    """The model of a ``file`` without the covariance that it states."""
    content = tomllib.loads(file.read_text(encoding="utf-8"))
    return build_model({key: value for key, value in content.items() if key != SECTION})


def weave_of(model: Model) -> dict[str, float] | None:
    """The last speed above which the weave of a ``model`` is stable, and its sd, m/s; None where there is none."""
    found = [
        one for one in critical_speeds(model, TOP)
        if (one.mode, one.kind, one.destabilising) == ("weave", OSCILLATORY, False)
    ]  # fmt: skip
    if not found:
        return None
    (estimate,) = critical_speed_estimates(model, found[-1:], assume=not model.covariance.names)
    return {"value": estimate.value, "sd": estimate.sd}


def outcome(row: Mapping[str, Any]) -> str:
    """What became of the case ``row``."""
    if row["left_open"]:
        return OPEN
    if row["true"] is None:
        return UNSTABLE
    if row["weave"] is None:
        return NONE
    near = abs(row["weave"]["value"] - row["true"]) <= WITHIN * row["weave"]["sd"]
    return INSIDE if near else OUTSIDE


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Counts of the cases ``rows`` of one cell."""
    sound = [r for r in rows if not r["error"]]
    count = Counter(outcome(r) for r in sound)
    claimed = count[INSIDE] + count[OUTSIDE]
    low, high = wilson(count[INSIDE], claimed)
    told = [r for r in sound if outcome(r) in (INSIDE, OUTSIDE)]
    return {
        "cases": len(rows), "errors": len(rows) - len(sound),
        "inside_95": {
            "hits": count[INSIDE], "of": claimed, "share": count[INSIDE] / claimed if claimed else None,
            "low": low, "high": high,
        },
        "nothing_claimed": {why: count[why] for why in (NONE, OPEN, UNSTABLE)},
        "median_sd_m_s": median(r["weave"]["sd"] for r in told) if told else None,
        "median_sd_assumed_m_s": median(r["assumed"]["sd"] for r in told if r["assumed"]) if told else None,
    }  # fmt: skip
