"""Score verdicts against sealed truths: detection, names, intervals, gaps, with Wilson 95 % intervals."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from statistics import median
from typing import Any

from bicycle.parameters import ParameterKey
from tests.validation.cases import share, share_of

Rows = Sequence[Mapping[str, Any]]

LARGEST_CLASS = 3  # a class of more counts as wrong
SAYS_MISSING = ("named", "class", "partial")
TENTATIVE = "tentative"  # a hypothesis with a reservation: scored in rows of its own

CALLED: Mapping[str, tuple[str, ...]] = {
    "luggage_rear": ("luggage",),
    "luggage_bar": ("handlebar_bag",),
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


def summary(records: Rows) -> dict[str, Any]:
    """Shares by cell of ``records`` with intervals, power against noise, intervals by parameter, confusion matrices."""
    cells: dict[str, list[Mapping[str, Any]]] = {}
    for record in sorted(records, key=lambda record: record["cell"]):
        cells.setdefault(record["cell"], []).append(record)
    told = {cell: [row for row in rows if row["verdict"]] for cell, rows in cells.items()}
    ones = {cell: rows for cell, rows in told.items() if cell.endswith("-one")}
    return {
        "cells": {cell: _cell(rows, told[cell]) for cell, rows in cells.items()},
        "power": {cell: {"all": _power(rows)} | _by_hidden(rows, _power) for cell, rows in ones.items()},
        "truth_inside_95": {cell: _by_parameter(rows) for cell, rows in ones.items()},
        "confusion": {cell: _by_hidden(rows, _confusion) for cell, rows in told.items()},
    }


def _cell(every: Rows, rows: Rows) -> dict[str, Any]:
    """Figures of a cell: ``every`` case counts for crashes, those with a verdict (``rows``) for the rest."""
    made = [row for row in every if row.get("made", True)]
    scores = [judge(row["verdict"], row["truth"]) for row in rows]
    rivals = [judge(row["baseline"], row["truth"]) for row in rows if row.get("baseline")]
    told, rivals_told = ([s for s in some if s["says"]] for some in (scores, rivals))
    gaps = [s["gap"] for s in told if s["gap"] is not None]

    def inside(of: Rows) -> dict[str, Any]:
        return share(sum(s["covered"] for s in of), sum(s["judged"] for s in of))

    whole = ("detected", "right", "tentative", "any_name", "misnamed")
    return {
        "cases": len(rows), "left_out": len(every) - len(made),
        "crashed": share_of([not row["verdict"] for row in made]),
        **{name: share_of(scores, name) for name in whole},
        "something_named": share_of(scores, "says"),
        "some_false_name": share_of(scores, "some_false"),
        "right_when_named": share_of(told, "right"),
        "tentative_right": share_of([s for s in scores if s["tentative"]], "tentative_right"),
        "right_or_tentative_right": share_of([s["right"] or s["tentative_right"] for s in scores]),
        "truth_inside_95": inside(scores),
        "truth_inside_95_when_right": inside([s for s in told if s["right"]]),
        "truth_inside_95_in_class": inside([s for s in scores if s["class_right"]]),
        "baseline_named": share_of(rivals, "says"),
        "baseline_right": share_of(rivals, "right"),
        "baseline_right_when_named": share_of(rivals_told, "right"),
        "baseline_misnamed": share_of(rivals, "misnamed"),
        "median_gap_left": median(gaps) if gaps else None,
        "median_class_size": median(s["class_size"] for s in told) if told else None,
        "median_seconds": median(row["seconds"] for row in rows) if rows else None,
    }  # fmt: skip


def _by_hidden(rows: Rows, count: Callable[[Rows], Any]) -> dict[str, Any]:
    hidden: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        hidden.setdefault("+".join(sorted(row["truth"]["effects"])) or "nothing", []).append(row)
    return {name: count(some) for name, some in sorted(hidden.items())}


def _power(rows: Rows) -> dict[str, Any]:
    """Share in which something is named, by noise level."""
    says: dict[float, list[bool]] = {}
    for row in sorted(rows, key=lambda row: row["truth"]["noise"]):
        says.setdefault(row["truth"]["noise"], []).append(row["verdict"]["verdict"] in SAYS_MISSING)
    return {f"{level:g}": share_of(hits) for level, hits in says.items()}


def _by_parameter(rows: Rows) -> dict[str, Any]:
    """Share of 95 % intervals that hold the truth, by effect and parameter."""
    found: dict[str, list[bool]] = {}
    for row in rows:
        for effect, key, inside in _intervals(row["verdict"], row["truth"]):
            found.setdefault(f"{effect}.{key}", []).append(inside)
    return {name: share_of(hits) for name, hits in sorted(found.items())}


def _confusion(rows: Rows) -> dict[str, int]:
    """How often each answer was given, most frequent first."""
    answers = Counter(f"{row['verdict']['verdict']}: {_names(row)}" for row in rows)
    return dict(answers.most_common())


def _names(row: Mapping[str, Any]) -> str:
    hidden = set(row["truth"]["effects"])
    members = [translated(name.split("+"), hidden) for name in row["verdict"]["class"]]
    return " or ".join("+".join(sorted(member)) for member in members) or "-"
