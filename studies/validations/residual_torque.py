"""Does a model with a residual torque predict what it was not fitted to? SYNTHETIC blind cases.

Cells ``modal-outside`` and ``history-outside`` of the blind test: something is hidden that the library does not hold.
Of each case further speeds are kept back. Where the verdict leaves more than noise (unknown, partial, some tentative
ones) the residual torque is fitted, the corrected model is written as a file and read again. Counted: the gap
sqrt(max(0, chi^2/n - 1)) of that file on the speeds kept back, against that of the stated model and of the model with
its parameters adjusted; and what the report says of the true speed above which the weave is stable, from the equations
of the hidden machine: that it is inside an interval of 95 % with two limits, or with one, outside all of them, or
nothing.

Cases are kept in ``residual_torque_cases.jsonl`` in the folder of the result, so an interrupted run goes on.
"""

import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from bicycle.critical.critical_speed import OSCILLATORY
from bicycle.files.model_file import read_model
from bicycle.model import Model
from studies.inference.acceptance import leaves_more
from studies.inference.checks import HeldOut
from studies.missing_effect.blind.cells import make
from studies.missing_effect.blind.generator import HELD_OUT
from studies.missing_effect.blind.kept import KeptCases, what_was_raised
from studies.missing_effect.blind.score import wilson
from studies.missing_effect.diagnose import Diagnosis, diagnose
from studies.missing_effect.measurement import read_measurement
from studies.missing_effect.reporting.corrected_model import model_text
from studies.missing_effect.residual.claims import Claims, claims
from studies.missing_effect.residual.fitting import Residual, fit_residual
from tyre.base.errors import InputError
from tyre.base.files import write_text

KEPT_BACK = {"modal-outside": 6, "history-outside": 3}  # speeds
INSIDE, BOUND, OUTSIDE = "inside", "inside_one_limit", "outside"
NO_MODEL, WITHHELD, BEYOND, OPEN_ENDED = "no_corrected_model", "withheld", "not_looked_for", "not_told"
"""What the report says of a true speed: the first three are claims, the others none."""
LEAST_GAP = 1.0  # of the stated model on what was kept back, below which there is nothing to close
FIRST = 40000  # seeds of cases begin at FIRST times the seed


def run(*, out: Path, seed: int, cases: int = 100, histories: int = 20, workers: int = 1) -> dict[str, Any]:
    """Make, diagnose and correct cases, and count.

    Parameters
    ----------
    out : Path
        Where the cases are kept.
    seed : int
        Of the first case; the others follow.
    cases, histories : int
        Number of modal cases and of cases of time histories.
    workers : int
        Number of processes.

    Returns
    -------
    dict
        Counts by cell, and every case.
    """
    first = FIRST * seed
    wanted = [("modal-outside", first + k) for k in range(cases)]
    wanted += [("history-outside", first + k) for k in range(histories)]
    wanted.sort(key=lambda job: (job[1] - first) / {"modal-outside": cases, "history-outside": histories}[job[0]])
    kept = KeptCases(out / "residual_torque_cases.jsonl", ("cell", "seed"), also=("error",))
    rows = kept.computed(wanted, one_case, workers=workers, what="residual torque")
    return {
        "synthetic": True,
        "what": "residual torque of blind cases outside the library: prediction of speeds kept back",
        "seed": seed,
        "made_by": f"velotyre validate residual-torque --seed {seed} --cases {cases} --histories {histories}",
        "targets": {"held_out_gap_left_median": 0.25, "weave_inside_95": 0.9},
        "cells": {cell: summary([r for r in rows if r["cell"] == cell]) for cell in KEPT_BACK},
        "cases": rows,
    }


def one_case(cell: str, seed: int) -> dict[str, Any]:
    """Make, diagnose and correct a case of a ``cell`` with its ``seed``; what raises is kept as ``error``."""
    row: dict[str, Any] = {"cell": cell, "seed": seed, "error": None}
    try:
        with tempfile.TemporaryDirectory() as name:
            truth, without = make(cell, seed, Path(name), held_out=KEPT_BACK[cell])
            row |= {"hidden": sorted(truth.effects), "noise": truth.noise}
            found = diagnose(read_measurement(Path(name) / "MEASUREMENT.toml"), without=without)
            row |= {"verdict": found.verdict.verdict, "named": found.final.name}
            row["left_open"] = leaves_more(found.verdict)
            if row["left_open"]:
                row |= corrected(found, Path(name), truth.weave)
    except Exception as error:  # whatever it is: it is counted, and the run goes on
        row["error"] = what_was_raised(error)
    return row


def corrected(found: Diagnosis, folder: Path, weave: float | None) -> dict[str, Any]:
    """What the corrected model of a diagnosis predicts.

    Parameters
    ----------
    found : Diagnosis
    folder : Path
        Of the case, with what was kept back.
    weave : float, optional
        True critical speed of the weave, m/s.
    """
    try:
        residual: Residual | None = fit_residual(found)
        refused = ""
    except InputError as error:
        residual, refused = None, str(error)
    models = {}
    for name, kept in (("adjusted", None), ("corrected", residual)):
        file = folder / f"{name}.toml"
        try:
            write_text(file, model_text(found, kept))
        except InputError as error:  # the fit has moved the parameters to where no bicycle is
            refused = refused or f"{name}: {error}"
            continue
        models[name] = read_model(file)
    fitted = residual is not None and "corrected" in models
    gaps: dict[str, float | None] = {"stated": None, "adjusted": None, "corrected": None}
    if (folder / HELD_OUT).exists():
        measured = read_measurement(folder / HELD_OUT / "MEASUREMENT.toml")
        every = {"stated": measured.model, **models}  # type: ignore[attr-defined]
        gaps |= {name: prediction_gap(measured, model) for name, model in every.items()}
    said = claims(residual, models["corrected"]) if residual and fitted else None
    return {
        "fitted": fitted, "refused": refused, "kept": list(residual.kept) if residual else [],
        "misfit": residual.misfit if residual else None, "gaps": gaps,
        "weave": {"true": weave} | weave_said(said, weave),
        "speeds": list(residual.scale.ends) if residual else None,
    }  # fmt: skip


def prediction_gap(measured: Any, model: Model) -> float:
    """sqrt(max(0, chi^2/n - 1)) of a ``model`` as it stands on what was ``measured``, no unit."""
    forward = measured.on(model).forward()
    residual, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]), slopes=False)
    return HeldOut(0.0, residual).gap


def weave_said(said: Claims | None, true: float | None) -> dict[str, Any]:
    """What the report says of the weave, and whether it is right.

    Parameters
    ----------
    said : Claims, optional
        Of the corrected model, where there is one.
    true : float, optional
        Speed at which the weave becomes stable, m/s.

    Returns
    -------
    dict
        ``looked_for`` and ``intervals``, m/s, with null for no limit, or null; ``outcome``, null without a true speed.
    """
    if said is None:
        return {"looked_for": None, "intervals": None, "outcome": None if true is None else NO_MODEL}
    of_weave = [
        one.interval for one in said.found if (one.interval.mode, one.interval.kind) == ("weave", OSCILLATORY)
    ]  # fmt: skip
    limits = [[end if np.isfinite(end) else None for end in (one.low, one.high)] for one in of_weave]
    outcome = None
    if true is not None:
        holding = next((ends for one, ends in zip(of_weave, limits, strict=True) if one.holds(true)), None)
        if said.withheld:
            outcome = WITHHELD
        elif not said.slowest <= true <= said.fastest:
            outcome = BEYOND
        elif holding is None:
            outcome = OUTSIDE
        else:
            outcome = {0: INSIDE, 1: BOUND, 2: OPEN_ENDED}[holding.count(None)]
    return {
        "looked_for": [said.slowest, said.fastest], "intervals": None if said.withheld else limits, "outcome": outcome,
    }  # fmt: skip


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Counts of the cases ``rows`` of one cell."""
    opened = [r for r in rows if not r["error"] and r["left_open"]]
    fitted = [r for r in opened if r["fitted"]]
    judged = [r for r in fitted if (r["gaps"]["stated"] or 0.0) >= LEAST_GAP]
    told = [r for r in opened if r["weave"]["true"] is not None]
    near = [r for r in told if r["speeds"] and r["speeds"][0] <= r["weave"]["true"] <= r["speeds"][1]]
    return {
        "cases": len(rows), "errors": sum(bool(r["error"]) for r in rows), "left_open": len(opened),
        "fitted": len(fitted), "gap_judged": len(judged),
        "held_out_gap_left": _ratios(judged, "stated"), "against_parameters_only": _ratios(judged, "adjusted"),
        "weave_inside_95": _inside(told), "weave_inside_95_within_measured_speeds": _inside(near),
    }  # fmt: skip


def _ratios(rows: Sequence[Mapping[str, Any]], against: str) -> dict[str, Any]:
    shares = sorted(r["gaps"]["corrected"] / r["gaps"][against] for r in rows if r["gaps"][against])
    if not shares:
        return {"of": 0}
    low, high = np.quantile(shares, [0.25, 0.75])
    return {
        "of": len(shares), "median": round(median(shares), 3), "quartiles": [round(low, 3), round(high, 3)],
        "at_most_a_quarter": sum(s <= 0.25 for s in shares),
    }  # fmt: skip


def _inside(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Share of the claims that are right, with the cases without one; and how wide those with two limits are."""
    count = Counter(r["weave"]["outcome"] for r in rows)
    hits, claimed = count[INSIDE] + count[BOUND], count[INSIDE] + count[BOUND] + count[OUTSIDE]
    low, high = wilson(hits, claimed)
    widths = [
        end - start
        for r in rows if r["weave"]["outcome"] == INSIDE
        for start, end in r["weave"]["intervals"]
        if start is not None and end is not None and start <= r["weave"]["true"] <= end
    ]  # fmt: skip
    return {
        "hits": hits, "of": claimed, "share": hits / claimed if claimed else None, "low": low, "high": high,
        "hits_with_one_limit": count[BOUND], "nothing_claimed": len(rows) - claimed,
        "why": {why: count[why] for why in (NO_MODEL, WITHHELD, BEYOND, OPEN_ENDED)},
        "median_width_m_s": median(widths) if widths else None,
    }  # fmt: skip
