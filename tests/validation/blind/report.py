"""The blind test's report: targets against what was measured, power against noise, and who was taken for whom."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tyre.ground import write_text

Summary = Mapping[str, Any]
SYNTHETIC = "All cases are synthetic; intervals are Wilson's at 95 %."
COLUMNS: Mapping[str, tuple[str, str, str]] = {
    "none": ("modal-none", "history-none", "eigenvalues-none"),
    "tight": ("modal-none-tight", "history-none-tight", ""),
    "one": ("modal-one", "history-one", "eigenvalues-one"),
    "loud": ("", "loud-one", ""),
    "pair": ("modal-pair", "", ""),
    "outside": ("modal-outside", "history-outside", ""),
    "wrong": ("modal-wrong-bicycle", "history-wrong-bicycle", ""),
    "causes": ("modal-causes", "history-causes", "eigenvalues-offset"),
    "sensor": ("", "history-wrong-sensor", ""),
    "unusual": ("modal-unusual", "history-unusual", ""),
    "opposed": ("modal-opposed", "history-opposed", ""),
    "one speed": ("", "one-speed", ""),
}
"""Row of the table of targets -> its cells."""

TARGETS = (
    ("nothing hidden: an effect named", "<= 2 %", "none", "something_named"),
    ("the same, tentative", "", "none", "tentative"),
    ("priors of the bicycle 1.5 x too tight: an effect named", "<= 2 %", "tight", "something_named"),
    ("the same, tentative", "", "tight", "tentative"),
    ("one effect: detected", ">= 80 %", "one", "detected"),
    ("of these named (class and partial included)", "", "one", "something_named"),
    ("named right when named", ">= 90 %", "one", "right_when_named"),
    ("truth inside the 95 % interval", "93-98 %", "one", "truth_inside_95"),
    ("the same in a class that holds it", "", "one", "truth_inside_95_in_class"),
    ("tentative", "", "one", "tentative"),
    ("right when tentative", "", "one", "tentative_right"),
    ("held-out gap left, median", "<= 20 %", "one", "median_gap_left"),
    ("class size, median", "", "one", "median_class_size"),
    ("one effect, loud and growing: answered", ">= 95 %", "loud", "something_named"),
    ("right when answered", ">= 97 %", "loud", "right_when_named"),
    ("truth inside the 95 % interval", "", "loud", "truth_inside_95"),
    ("two effects: exact pair, or a class of at most three with it", ">= 65 %", "pair", "right"),
    ("two effects: a false effect named", "<= 15 %", "pair", "some_false_name"),
    ("two effects: truth inside the 95 % interval", "", "pair", "truth_inside_95"),
    ("the same where the pair is right", "", "pair", "truth_inside_95_when_right"),
    ("effect not in the library: named or class", "<= 10 %", "outside", "misnamed"),
    ("the same, `partial` included", "<= 20 %", "outside", "some_false_name"),
    ("the same, tentative", "", "outside", "tentative"),
    ("file of another bicycle: named or class", "<= 10 %", "wrong", "misnamed"),
    ("the same, `partial` included", "<= 20 %", "wrong", "some_false_name"),
    ("luggage, geometry, speed, friction, filters: right", "", "causes", "right_or_tentative_right"),
    ("the same: something else named", "<= 20 %", "causes", "some_false_name"),
    ("gain, delay, bias of a sensor: right", "", "sensor", "right_or_tentative_right"),
    ("the same: something else named", "<= 20 %", "sensor", "some_false_name"),
    ("unusual size: named, or in a tentative or class", ">= 85 %", "unusual", "right_or_tentative_right"),
    ("effects that hide each other: the pair, or a class with it", ">= 60 %", "opposed", "right"),
    ("the same: truth inside the 95 % interval", ">= 85 %", "opposed", "truth_inside_95"),
    ("one speed: any name, tentative too", "0", "one speed", "any_name"),
    ("plain least squares (baseline), nothing hidden: an effect named", "", "none", "baseline_named"),
    ("plain least squares, one effect: right", "", "one", "baseline_right"),
    ("right when named", "", "one", "baseline_right_when_named"),
    ("plain least squares, one effect, loud: right", "", "loud", "baseline_right"),
    ("plain least squares, not in the library: named", "", "outside", "baseline_misnamed"),
)
"""Row, target of the plan, cells, figure of the cell."""

KINDS = ("modal", "histories", "eigenvalues only")
ANSWERS = ("right alone", "in a class", "in a partial", "in a tentative", "unknown", "none", "something else")


def targets(found: Summary) -> str:
    """The targets and what was measured: modal data, histories, eigenvalues without shapes side by side."""
    cells, rows = found["cells"], []
    for what, target, kind, key in TARGETS:
        values = [_number(cells[name][key]) if name in cells else "-" for name in COLUMNS[kind]]
        if any(value != "-" for value in values):
            rows.append([what, target, *values])
    return _table(rows, ["", "target", *KINDS])


def accounts(found: Summary) -> str:
    """Cases, crashes, cases that could not be made, and seconds, by cell."""
    rows = [
        [name, str(c["cases"]), _number(c["crashed"]), str(c["left_out"] or "0"), _number(c["median_seconds"])]
        for name, c in found["cells"].items()
    ]
    return _table(rows, ["cell", "cases", "crashed", "left out", "seconds, median"])


def power(found: Summary) -> str:
    """Share in which something is named, by hidden effect and noise."""
    rows = []
    levels = sorted({level for table in found["power"].values() for level in table["all"]}, key=float)
    for cell, table in found["power"].items():
        for hidden, shares in table.items():
            rows.append([cell, hidden, *(_count(shares[level]) if level in shares else "-" for level in levels)])
    heads = [f"noise x {level}" for level in levels]
    return "Something named, by what was hidden and the noise:\n\n" + _table(rows, ["cell", "hidden", *heads])


def confusion(found: Summary) -> str:
    """What was answered for what was hidden."""
    rows = []
    for cell, table in found["confusion"].items():
        for hidden, answers in table.items():
            counts, others = dict.fromkeys(ANSWERS, 0), []
            for answer, count in answers.items():
                kind = _kind(answer, hidden)
                counts[kind] += count
                if kind == ANSWERS[-1]:
                    others.append(f"{answer.replace(': ', ' ')} ({count})")
            rows.append([cell, hidden, *(counts[kind] or "" for kind in ANSWERS), "; ".join(others[:1])])
    head = "What was answered for what was hidden (`something else`: the most frequent is shown):"
    return f"{head}\n\n" + _table(rows, ["cell", "hidden", *ANSWERS, "which"])


def intervals(found: Summary) -> str:
    """How many 95 % intervals hold the truth, by parameter."""
    rows = [[cell, name, _number(s)] for cell, table in found["truth_inside_95"].items() for name, s in table.items()]
    return "Truth inside the 95 % interval:\n\n" + _table(rows, ["cell", "parameter", "inside"])


def write_report(found: Summary, folder: Path) -> None:
    """Write report.md, Markdown of a summary of :func:`tests.validation.blind.score.summary`, into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = ["# Blind test of the missing-effect search", SYNTHETIC]
    parts += [part(found) for part in (targets, accounts, power, confusion, intervals)]
    write_text(folder / "report.md", "\n\n".join(parts) + "\n")


def _kind(answer: str, hidden: str) -> str:
    verdict, names = answer.split(": ", 1)
    if verdict in ("none", "unknown"):
        return verdict
    if hidden not in names.split(" or "):
        return ANSWERS[-1]
    return {"named": ANSWERS[0], "class": ANSWERS[1], "partial": ANSWERS[2], "tentative": ANSWERS[3]}[verdict]


def _number(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{_count(value)}, {value['share']:.0%} ({value['low']:.0%}-{value['high']:.0%})" if value["of"] else "-"
    if value is None:
        return "-"
    return f"{value:.0%}" if isinstance(value, float) and value < 1 else f"{value:g}"


def _count(share: Mapping[str, Any]) -> str:
    return f"{share['hits']} of {share['of']}"


def _table(rows: Sequence[Sequence[Any]], headers: Sequence[str]) -> str:
    from tabulate import tabulate

    return str(tabulate(rows, headers=headers, tablefmt="github", disable_numparse=True))
