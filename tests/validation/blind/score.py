"""Score verdicts against sealed truths: detection, names, intervals, gaps, with Wilson 95 % intervals."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from statistics import median
from typing import Any

from bicycle.parameter_covariance import ParameterKey

LARGEST_CLASS = 3  # a class of more counts as wrong
SAYS_MISSING = ("named", "class", "partial")
TENTATIVE = "tentative"  # a hypothesis with a reservation: scored in rows of its own

CALLED: Mapping[str, tuple[str, ...]] = {
    "luggage_rear": ("luggage",),
    "luggage_bar": ("bar_bag",),
    **{f"{c}_low_pass": (f"{c}_lowpass",) for c in ("roll_rate", "steer", "yaw_rate")},
    **{f"{c}_drift": ("drift",) for c in ("roll_rate", "steer", "yaw_rate")},
    **{f"{c}_bias": ("bias", "drift") for c in ("roll_rate", "steer", "yaw_rate")},
}
"""Name of a hidden cause -> what a search may call it; what is not listed has the same name on both sides."""


def judge(verdict: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    """What one case adds to the tables: its ``verdict`` as JSON against its ``truth``."""
    hidden = set(truth["effects"])
    members = [translated(name.split("+"), hidden) for name in verdict["class"]]
    says, tentative = verdict["verdict"] in SAYS_MISSING, verdict["verdict"] == TENTATIVE
    named = translated((e["identifier"] for e in verdict["effects"]), hidden)
    covered = [inside for _, _, inside in _intervals(verdict, truth)]
    holds = hidden in members and len(members) <= LARGEST_CLASS
    gap = verdict["held_out_gap"]
    return {
        "detected": says or tentative or verdict["verdict"] == "unknown",
        "says": says,
        "right": says and holds,
        "tentative": tentative,
        "tentative_right": tentative and holds,
        "class_right": verdict["verdict"] == "class" and holds,
        "any_name": says or tentative,
        "misnamed": verdict["verdict"] in ("named", "class") and not any(member & hidden for member in members),
        "some_false": says and bool(named - hidden) and hidden not in members,
        "class_size": len(members),
        "covered": sum(covered), "judged": len(covered),
        "gap": gap["final"] if gap["nominal"] is not None and says else None,
    }  # fmt: skip


def translated(names: Iterable[str], hidden: set[str]) -> set[str]:
    """Identifiers ``names`` of a search in the words of the truth, where they mean what was ``hidden``."""
    return {next((cause for cause in sorted(hidden) if name in CALLED.get(cause, ())), name) for name in names}


def _intervals(verdict: Mapping[str, Any], truth: Mapping[str, Any]) -> list[tuple[str, str, bool]]:
    """Effect, parameter, and whether its 95 % interval holds the truth, of what was hidden and named."""
    found = []
    hidden = set(truth["effects"])
    for effect in verdict["effects"]:
        (cause,) = translated([effect["identifier"]], hidden)
        true = truth["effects"].get(cause, {})
        for key, number in effect["parameters"].items():
            own = ParameterKey.parse(key)
            value = true.get(own.name)
            value = value.get(own.wheel) if isinstance(value, Mapping) else value
            if value is not None:
                found.append((effect["identifier"], own.name, abs(number["value"] - value) < 1.96 * number["sd"]))
    return found


def wilson(hits: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """Return Wilson's interval of the share ``hits`` of ``total`` (Wilson 1927, J. Am. Stat. Assoc. 22)."""
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
    told = {cell: [row for row in rows if row["verdict"]] for cell, rows in sorted(cells.items())}
    ones = {cell: rows for cell, rows in told.items() if cell.endswith("-one")}
    return {
        "cells": {cell: _cell(rows, told[cell]) for cell, rows in sorted(cells.items())},
        "power": {cell: {"all": _power(rows)} | _by_hidden(rows, _power) for cell, rows in ones.items()},
        "truth_inside_95": {cell: _by_parameter(rows) for cell, rows in ones.items()},
        "confusion": {cell: _by_hidden(rows, _confusion) for cell, rows in told.items()},
    }


def _cell(every: Sequence[Mapping[str, Any]], rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures of a cell: ``every`` case counts for crashes, those with a verdict (``rows``) for the rest."""
    scores = [judge(row["verdict"], row["truth"]) for row in rows]
    told = [s for s in scores if s["says"]]
    gaps = [s["gap"] for s in told if s["gap"] is not None]
    right = [s for s in told if s["right"]]
    classes = [s for s in scores if s["class_right"]]
    tentative = [s for s in scores if s["tentative"]]
    guesses = [judge(row["baseline"], row["truth"]) for row in rows if row.get("baseline")]
    guessed = [s for s in guesses if s["says"]]
    made = [row for row in every if row.get("made", True)]

    def some(key: str, of: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        return _share(sum(s[key] for s in of), len(of))

    def inside(of: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        return _share(sum(s["covered"] for s in of), sum(s["judged"] for s in of))

    return {
        "cases": len(rows),
        "left_out": len(every) - len(made),
        "crashed": _share(sum(not row["verdict"] for row in made), len(made)),
        "something_named": _share(len(told), len(rows)),
        "detected": some("detected", scores),
        "right": some("right", scores),
        "right_when_named": some("right", told),
        "tentative": _share(len(tentative), len(rows)),
        "tentative_right": some("tentative_right", tentative),
        "right_or_tentative_right": _share(sum(s["right"] or s["tentative_right"] for s in scores), len(scores)),
        "any_name": some("any_name", scores),
        "misnamed": some("misnamed", scores),
        "some_false_name": some("some_false", scores),
        "truth_inside_95": inside(scores),
        "truth_inside_95_when_right": inside(right),
        "truth_inside_95_in_class": inside(classes),
        "baseline_named": _share(len(guessed), len(guesses)),
        "baseline_right": some("right", guesses),
        "baseline_right_when_named": some("right", guessed),
        "baseline_misnamed": some("misnamed", guesses),
        "median_gap_left": median(gaps) if gaps else None,
        "median_class_size": median(s["class_size"] for s in told) if told else None,
        "median_seconds": median(row["seconds"] for row in rows) if rows else None,
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
    answers = Counter(
        f"{row['verdict']['verdict']}: {_said(row['verdict'], set(row['truth']['effects']))}" for row in rows
    )
    return dict(answers.most_common())


def _said(verdict: Mapping[str, Any], hidden: set[str]) -> str:
    return " or ".join("+".join(sorted(translated(name.split("+"), hidden))) for name in verdict["class"]) or "-"


def _share(hits: int, total: int) -> dict[str, Any]:
    low, high = wilson(hits, total)
    return {"hits": hits, "of": total, "share": hits / total if total else None, "low": low, "high": high}
