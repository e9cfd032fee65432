"""The blind test's report: targets against what was measured, power against noise, and who was taken for whom."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tyre.files import write_text

Summary = Mapping[str, Any]
SYNTHETIC = "All cases are synthetic; intervals are Wilson's at 95 %."
NONE: tuple[str, ...] = ("modal-none", "history-none", "eigenvalues-none")
TIGHT = ("modal-none-tight", "history-none-tight", "")
ONE = ("modal-one", "history-one", "eigenvalues-one")
LOUD = ("", "loud-one", "")
PAIR = ("modal-pair", "", "")
OUTSIDE = ("modal-outside", "history-outside", "")
WRONG = ("modal-wrong-bicycle", "history-wrong-bicycle", "")
CAUSES = ("modal-causes", "history-causes", "eigenvalues-offset")
SENSOR = ("", "history-wrong-sensor", "")
UNUSUAL = ("modal-unusual", "history-unusual", "")
OPPOSED = ("modal-opposed", "history-opposed", "")
ONE_SPEED = ("", "one-speed", "")
TARGETS: tuple[tuple[str, str, tuple[str, ...], str], ...] = (
    ("nothing hidden: an effect named", "<= 2 %", NONE, "something_named"),
    ("the same, tentative", "", NONE, "tentative"),
    ("priors of the bicycle 1.5 x too tight: an effect named", "<= 2 %", TIGHT, "something_named"),
    ("the same, tentative", "", TIGHT, "tentative"),
    ("one effect: detected", ">= 80 %", ONE, "detected"),
    ("of these named (class and partial included)", "", ONE, "something_named"),
    ("named right when named", ">= 90 %", ONE, "right_when_named"),
    ("truth inside the 95 % interval", "93-98 %", ONE, "truth_inside_95"),
    ("the same in a class that holds it", "", ONE, "truth_inside_95_in_class"),
    ("tentative", "", ONE, "tentative"),
    ("right when tentative", "", ONE, "tentative_right"),
    ("held-out gap left, median", "<= 20 %", ONE, "median_gap_left"),
    ("class size, median", "", ONE, "median_class_size"),
    ("one effect, loud and growing: answered", ">= 95 %", LOUD, "something_named"),
    ("right when answered", ">= 97 %", LOUD, "right_when_named"),
    ("truth inside the 95 % interval", "", LOUD, "truth_inside_95"),
    ("two effects: exact pair, or a class of at most three with it", ">= 65 %", PAIR, "right"),
    ("two effects: a false effect named", "<= 15 %", PAIR, "some_false_name"),
    ("two effects: truth inside the 95 % interval", "", PAIR, "truth_inside_95"),
    ("the same where the pair is right", "", PAIR, "truth_inside_95_when_right"),
    ("effect not in the library: named or class", "<= 10 %", OUTSIDE, "misnamed"),
    ("the same, `partial` included", "<= 20 %", OUTSIDE, "some_false_name"),
    ("the same, tentative", "", OUTSIDE, "tentative"),
    ("file of another bicycle: named or class", "<= 10 %", WRONG, "misnamed"),
    ("the same, `partial` included", "<= 20 %", WRONG, "some_false_name"),
    ("luggage, geometry, speed, friction, filters: right", "", CAUSES, "right_or_tentative_right"),
    ("the same: something else named", "<= 20 %", CAUSES, "some_false_name"),
    ("gain, delay, bias of a sensor: right", "", SENSOR, "right_or_tentative_right"),
    ("the same: something else named", "<= 20 %", SENSOR, "some_false_name"),
    ("unusual size: named, or in a tentative or class", ">= 85 %", UNUSUAL, "right_or_tentative_right"),
    ("effects that hide each other: the pair, or a class with it", ">= 60 %", OPPOSED, "right"),
    ("the same: truth inside the 95 % interval", ">= 85 %", OPPOSED, "truth_inside_95"),
    ("one speed: any name, tentative too", "0", ONE_SPEED, "any_name"),
    ("sparse regression (baseline), nothing hidden: an effect named", "", NONE, "baseline_named"),
    ("sparse regression, one effect: right", "", ONE, "baseline_right"),
    ("right when named", "", ONE, "baseline_right_when_named"),
    ("sparse regression, one effect, loud: right", "", LOUD, "baseline_right"),
    ("sparse regression, not in the library: named", "", OUTSIDE, "baseline_misnamed"),
)
"""Row, target of the plan, cells (modal data, histories, eigenvalues only), figure of the cell."""

KINDS = ("modal", "histories", "eigenvalues only")
ANSWERS = ("right alone", "in a class", "in a partial", "in a tentative", "unknown", "none", "something else")


def report(found: Summary) -> str:
    """Markdown of a summary of :func:`tests.validation.blind.score.summary`."""
    return (
        "\n\n".join([SYNTHETIC, targets(found), accounts(found), power(found), confusion(found), intervals(found)])
        + "\n"
    )


def targets(found: Summary) -> str:
    """The targets and what was measured: modal data, histories, eigenvalues without shapes side by side."""
    cells, rows = found["cells"], []
    for what, target, names, key in TARGETS:
        values = [_number(cells[name][key]) if name in cells else "-" for name in names]
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


def draw_power(found: Summary, target: Path) -> None:
    """Share of detected single effects over the noise, with intervals, as ``target``."""
    from studies.reporting import drawing, look

    with drawing(target, width=5, height=3) as figure:
        axis = figure.subplots()
        for k, (cell, table) in enumerate(found["power"].items()):
            levels = [float(level) * (1 + 0.02 * (2 * k - 1)) for level in table["all"]]
            shares = list(table["all"].values())
            low = [s["share"] - s["low"] for s in shares]
            high = [s["high"] - s["share"] for s in shares]
            label = f"{TITLES[cell]} ({sum(s['of'] for s in shares)} cases)"
            axis.errorbar(levels, [s["share"] for s in shares], [low, high], capsize=3, label=label, **look(k).plot)
        ticks = sorted({float(level) for table in found["power"].values() for level in table["all"]})
        axis.set_xscale("log")
        axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.minorticks_off()
        axis.set(
            xlabel="noise, relative to the middle level", ylabel="share in which something is named", ylim=(0, 1.02)
        )
        axis.set_title("One hidden effect (synthetic)")
        axis.legend(loc="lower left")


TITLES = {
    "modal-one": "modal data",
    "history-one": "histories",
    "eigenvalues-one": "eigenvalues only",
    "loud-one": "loud histories",
}


def write_report(found: Summary, folder: Path) -> None:
    """Write report.md and power.png/.svg into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    text = report(found)
    if found["power"]:
        draw_power(found, folder / "power")
        text += "\n![Share named over noise](power.png)\n"
    write_text(folder / "report.md", f"# Blind test of the missing-effect search\n\n{text}")


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
