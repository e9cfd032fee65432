"""Score verdicts against sealed truths: detection, names, intervals, gaps, with Wilson 95 % intervals."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import Any

from bicycle.parameter_key import ParameterKey

LARGEST_CLASS = 3  # a class of more counts as wrong
SAYS_MISSING = ("named", "class", "partial")


def judge(verdict: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    """What one case adds to the tables: its ``verdict`` as JSON against its ``truth``.

    ``right``: the class has at most three members and holds exactly what was hidden. ``covered``: the 95 % intervals
    of the named parameters hold the true values. ``misnamed``: named or a class, with nothing of what was hidden.
    ``some_false``: the leading hypothesis, a partial one too, has something that was not hidden, no member is right.
    """
    hidden = set(truth["effects"])
    members = [set(name.split("+")) for name in verdict["class"]]
    says = verdict["verdict"] in SAYS_MISSING
    named = {e["identifier"] for e in verdict["effects"]}
    covered = [inside for _, _, inside in _intervals(verdict, truth)]
    gap = verdict["held_out_gap"]
    return {
        "detected": says or verdict["verdict"] == "unknown",
        "says": says,
        "right": says and hidden in members and len(members) <= LARGEST_CLASS,
        "misnamed": verdict["verdict"] in ("named", "class") and not any(member & hidden for member in members),
        "some_false": says and bool(named - hidden) and hidden not in members,
        "class_size": len(members),
        "covered": sum(covered), "judged": len(covered),
        "gap": gap["final"] if gap["nominal"] is not None and says else None,
    }  # fmt: skip


def _intervals(verdict: Mapping[str, Any], truth: Mapping[str, Any]) -> list[tuple[str, str, bool]]:
    """Effect, parameter, and whether its 95 % interval holds the truth, of what was hidden and named."""
    found = []
    for effect in verdict["effects"]:
        true = truth["effects"].get(effect["identifier"], {})
        for key, number in effect["parameters"].items():
            own = ParameterKey.parse(key)
            value = true.get(own.name)
            value = value.get(own.wheel) if isinstance(value, Mapping) else value
            if value is not None:
                found.append((effect["identifier"], own.name, abs(number["value"] - value) < 1.96 * number["sd"]))
    return found


def wilson(hits: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's interval of the share of a number ``hits`` in a number ``total`` (Wilson 1927, J. Am. Stat. Assoc. 22).

    ``z`` is the quantile of the normal distribution: 1.96 for 95 %.
    """
    if not total:
        return 0.0, 1.0
    share, extra = hits / total, z * z / total
    middle = (share + extra / 2) / (1 + extra)
    half = z * math.sqrt(share * (1 - share) / total + extra / (4 * total)) / (1 + extra)
    return max(0.0, middle - half), min(1.0, middle + half)


def summary(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares by cell of ``records`` with intervals, power against noise, intervals by parameter, confusion matrices."""
    cells: dict[str, list[Mapping[str, Any]]] = {}
    for record in records:
        cells.setdefault(record["cell"], []).append(record)
    ones = {cell: rows for cell, rows in sorted(cells.items()) if cell.endswith("-one")}
    return {
        "cells": {cell: _cell(rows) for cell, rows in sorted(cells.items())},
        "power": {cell: {"all": _power(rows)} | _by_hidden(rows, _power) for cell, rows in ones.items()},
        "truth_inside_95": {cell: _by_parameter(rows) for cell, rows in ones.items()},
        "confusion": {cell: _by_hidden(rows, _confusion) for cell, rows in sorted(cells.items())},
    }


def _cell(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    scores = [judge(row["verdict"], row["truth"]) for row in rows]
    told = [s for s in scores if s["says"]]
    gaps = [s["gap"] for s in told if s["gap"] is not None]
    right = [s for s in told if s["right"]]
    return {
        "cases": len(rows),
        "something_named": _share(len(told), len(rows)),
        "detected": _share(sum(s["detected"] for s in scores), len(rows)),
        "right": _share(sum(s["right"] for s in scores), len(rows)),
        "right_when_named": _share(sum(s["right"] for s in told), len(told)),
        "misnamed": _share(sum(s["misnamed"] for s in scores), len(rows)),
        "some_false_name": _share(sum(s["some_false"] for s in scores), len(rows)),
        "truth_inside_95": _share(sum(s["covered"] for s in scores), sum(s["judged"] for s in scores)),
        "truth_inside_95_when_right": _share(sum(s["covered"] for s in right), sum(s["judged"] for s in right)),
        "median_gap_left": median(gaps) if gaps else None,
        "median_class_size": median(s["class_size"] for s in told) if told else None,
        "median_seconds": median(row["seconds"] for row in rows),
    }


def _by_hidden(
    rows: Sequence[Mapping[str, Any]], count: Callable[[Sequence[Mapping[str, Any]]], Any]
) -> dict[str, Any]:
    hidden: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        hidden.setdefault("+".join(sorted(row["truth"]["effects"])) or "nothing", []).append(row)
    return {name: count(some) for name, some in sorted(hidden.items())}


def _power(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Share in which something is named, by noise level."""
    levels = sorted({row["truth"]["noise"] for row in rows})
    says = {
        level: [r["verdict"]["verdict"] in SAYS_MISSING for r in rows if r["truth"]["noise"] == level]
        for level in levels
    }
    return {f"{level:g}": _share(sum(hits), len(hits)) for level, hits in says.items()}


def _by_parameter(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Share of 95 % intervals that hold the truth, by effect and parameter."""
    found: dict[str, list[bool]] = {}
    for row in rows:
        for effect, key, inside in _intervals(row["verdict"], row["truth"]):
            found.setdefault(f"{effect}.{key}", []).append(inside)
    return {name: _share(sum(hits), len(hits)) for name, hits in sorted(found.items())}


def _confusion(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How often each answer was given, most frequent first."""
    answers = Counter(f"{row['verdict']['verdict']}: {_said(row['verdict'])}" for row in rows)
    return dict(answers.most_common())


def _said(verdict: Mapping[str, Any]) -> str:
    return " or ".join("+".join(sorted(name.split("+"))) for name in verdict["class"]) or "-"


def _share(hits: int, total: int) -> dict[str, Any]:
    low, high = wilson(hits, total)
    return {"hits": hits, "of": total, "share": hits / total if total else None, "low": low, "high": high}
