"""Score verdicts against sealed truths: detection, names, intervals, gaps, with Wilson 95 % intervals."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

LARGEST_CLASS = 3  # a class of more counts as wrong
SAYS_MISSING = ("named", "class", "partial")


def judge(verdict: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    """What one case adds to the tables.

    ``right``: the class has at most three members and holds exactly what was hidden. ``covered``: the 95 % intervals
    of the named parameters hold the true values. ``false``: something is named, wholly or in part,
    that was not hidden; ``misnamed``: without saying that a gap remains.
    """
    hidden = set(truth["effects"])
    members = [set(name.split("+")) for name in verdict["class"]]
    says = verdict["verdict"] in SAYS_MISSING
    named = {e["identifier"] for e in verdict["effects"]}
    covered = [
        abs(number["value"] - true) < 1.96 * number["sd"]
        for e in verdict["effects"] if e["identifier"] in hidden
        for number, true in _pairs(e, truth["effects"][e["identifier"]])
    ]  # fmt: skip
    gap = verdict["held_out_gap"]
    return {
        "detected": says or verdict["verdict"] == "unknown",
        "says": says,
        "right": says and hidden in members and len(members) <= LARGEST_CLASS,
        "false": says and not any(member & hidden for member in members),
        "misnamed": verdict["verdict"] in ("named", "class") and not any(member & hidden for member in members),
        "some_false": says and bool(named - hidden) and hidden not in members,
        "class_size": len(members),
        "covered": sum(covered), "judged": len(covered),
        "gap": gap["final"] if gap["nominal"] is not None and says else None,
    }  # fmt: skip


def _pairs(effect: Mapping[str, Any], truth: Mapping[str, Any]) -> list[tuple[Mapping[str, float], float]]:
    found = []
    for key, number in effect["parameters"].items():
        name, _, wheel = key.partition(".")
        if name in truth:
            true = truth[name]
            found.append((number, true[wheel] if isinstance(true, Mapping) and wheel else true))
    return [(number, true) for number, true in found if not isinstance(true, Mapping)]


def wilson(hits: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's 95 % interval of a share (Wilson 1927, J. Am. Stat. Assoc. 22)."""
    if not total:
        return 0.0, 1.0
    share, extra = hits / total, z * z / total
    middle = (share + extra / 2) / (1 + extra)
    half = z * math.sqrt(share * (1 - share) / total + extra / (4 * total)) / (1 + extra)
    return max(0.0, middle - half), min(1.0, middle + half)


def summary(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares by cell with intervals, and the confusion matrix."""
    cells: dict[str, list[Mapping[str, Any]]] = {}
    for record in records:
        cells.setdefault(record["cell"], []).append(record)
    table = {}
    for cell, rows in sorted(cells.items()):
        scores = [judge(row["verdict"], row["truth"]) for row in rows]
        told = [s for s in scores if s["says"]]
        gaps = [s["gap"] for s in told if s["gap"] is not None]
        judged = sum(s["judged"] for s in scores)
        table[cell] = {
            "cases": len(rows),
            "something_named": _share(len(told), len(rows)),
            "detected": _share(sum(s["detected"] for s in scores), len(rows)),
            "right_when_named": _share(sum(s["right"] for s in told), len(told)),
            "false_name": _share(sum(s["false"] for s in scores), len(rows)),
            "misnamed": _share(sum(s["misnamed"] for s in scores), len(rows)),
            "some_false_name": _share(sum(s["some_false"] for s in scores), len(rows)),
            "truth_inside_95": _share(sum(s["covered"] for s in scores), judged),
            "median_gap_left": median(gaps) if gaps else None,
            "median_class_size": median(s["class_size"] for s in told) if told else None,
            "median_seconds": median(row["seconds"] for row in rows),
        }
    confusion: dict[str, Counter[str]] = {}
    for record in records:
        hidden = "+".join(sorted(record["truth"]["effects"])) or "nothing"
        confusion.setdefault(hidden, Counter())[f"{record['verdict']['verdict']}: {_said(record['verdict'])}"] += 1
    power: dict[str, list[bool]] = {}
    for record in records:
        if record["cell"].endswith("-one"):
            power.setdefault(f"{record['cell']}, noise x {record['truth']['noise']:g}", []).append(
                record["verdict"]["verdict"] in SAYS_MISSING
            )
    return {
        "cells": table,
        "power": {name: _share(sum(hits), len(hits)) for name, hits in sorted(power.items())},
        "confusion": {hidden: dict(counter.most_common()) for hidden, counter in sorted(confusion.items())},
    }


def _said(verdict: Mapping[str, Any]) -> str:
    return " or ".join("+".join(sorted(name.split("+"))) for name in verdict["class"]) or "-"


def _share(hits: int, total: int) -> dict[str, Any]:
    low, high = wilson(hits, total)
    return {"hits": hits, "of": total, "share": hits / total if total else None, "low": low, "high": high}
