"""Does a model with an unmodelled torque predict what it was not fitted to? SYNTHETIC blind cases.

Cells ``modal-outside`` and ``history-outside`` of the blind test hide something that the library does not hold, and
keep further speeds back. Where the verdict leaves more than noise, the unmodelled torque is fitted, and the corrected
model is written as a file and read again. Counted is its gap sqrt(max(0, chi^2/n - 1)) on the speeds kept back, against
that of the stated model and of the model with its parameters adjusted.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from bicycle.model import Model, read_model
from studies.diagnosis import Diagnosis, Residual, diagnose, fit_residual, model_text, read_measurement
from studies.inference import HeldOut
from tests.validation.blind.cells import make
from tests.validation.blind.generator import HELD_OUT
from tests.validation.cases import KeptCases, Row, attempted
from tyre.ground import InputError, write_text

KEPT_BACK = {"modal-outside": 6, "history-outside": 3}  # speeds
LEAST_GAP = 1.0  # of the stated model on what was kept back, below which there is nothing to close
FIRST = 40000  # seeds of cases begin at FIRST times the seed


def run(*, out: Path, seed: int, cases: int = 100, histories: int = 20, workers: int = 1) -> dict[str, Any]:
    """Make, diagnose and correct a number of modal ``cases`` and of ``histories``, and count."""
    wanted = [("modal-outside", FIRST * seed + k) for k in range(cases)]
    wanted += [("history-outside", FIRST * seed + k) for k in range(histories)]
    kept = KeptCases(out / "unmodelled_torque_cases.jsonl", ("cell", "seed"))
    rows = kept.computed(wanted, one_case, workers=workers, what="unmodelled torque")
    return {"cells": {cell: summary([r for r in rows if r["cell"] == cell]) for cell in KEPT_BACK}}


def one_case(cell: str, seed: int) -> Row:
    """Make, diagnose and correct a case of a ``cell`` with its ``seed``."""
    return attempted({"cell": cell, "seed": seed}, partial(_fitted, cell, seed))


def _fitted(cell: str, seed: int, folder: Path, row: Row) -> None:
    truth, without = make(cell, seed, folder, held_out=KEPT_BACK[cell])
    row |= {"hidden": sorted(truth.effects), "noise": truth.noise}
    found = diagnose(read_measurement(folder / "MEASUREMENT.toml"), without=without)
    row |= {"verdict": found.verdict.verdict, "named": found.final.name, "left_open": found.verdict.leaves_more}
    if row["left_open"]:
        row |= corrected(found, folder)


def corrected(found: Diagnosis, folder: Path) -> dict[str, Any]:
    """Predict with the corrected models of a diagnosis what was kept back in the ``folder`` of the case."""
    models, refused = {}, ""
    try:
        residual: Residual | None = fit_residual(found)
    except InputError as error:
        residual, refused = None, str(error)
    for name, kept in (("adjusted", None), ("corrected", residual)):
        file = folder / f"{name}.toml"
        try:
            write_text(file, model_text(found, kept))
        except InputError as error:  # the fit has moved the parameters to where no bicycle is
            refused = refused or f"{name}: {error}"
            continue
        models[name] = read_model(file)
    gaps: dict[str, float | None] = {"stated": None, "adjusted": None, "corrected": None}
    if (folder / HELD_OUT).exists():
        measured: Any = read_measurement(folder / HELD_OUT / "MEASUREMENT.toml")
        gaps |= {name: prediction_gap(measured, m) for name, m in {"stated": measured.model, **models}.items()}
    return {"fitted": residual is not None and "corrected" in models, "refused": refused, "gaps": gaps}


def prediction_gap(measured: Any, model: Model) -> float:
    """Return sqrt(max(0, chi^2/n - 1)) of a ``model`` as it stands on what was ``measured``, no unit."""
    kind = measured.with_model(model).prepare()
    residual, _ = kind.residual((), np.array([u.centre for u in kind.nuisances]), slopes=False)
    return HeldOut(0.0, residual).gap


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Count the cases ``rows`` of one cell."""
    opened = [r for r in rows if not r["error"] and r["left_open"]]
    fitted = [r for r in opened if r["fitted"]]
    judged = [r for r in fitted if (r["gaps"]["stated"] or 0.0) >= LEAST_GAP]
    return {
        "cases": len(rows), "errors": len([r for r in rows if r["error"]]), "left_open": len(opened),
        "fitted": len(fitted), "gap_judged": len(judged),
        "held_out_gap_left": _ratios(judged, "stated"), "against_parameters_only": _ratios(judged, "adjusted"),
    }  # fmt: skip


def _ratios(rows: Sequence[Mapping[str, Any]], against: str) -> dict[str, Any]:
    shares = sorted(r["gaps"]["corrected"] / r["gaps"][against] for r in rows if r["gaps"][against])
    if not shares:
        return {"of": 0}
    low, high = np.quantile(shares, [0.25, 0.75])
    return {"of": len(shares), "median": round(median(shares), 3), "quartiles": [round(low, 3), round(high, 3)]}
