"""The blind test's report: targets against what was measured, power against noise, and who was taken for whom."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

Summary = Mapping[str, Any]
SYNTHETIC = "All cases are synthetic; intervals are Wilson's at 95 %."
TARGETS: tuple[tuple[str, str, str, str], ...] = (
    ("nothing hidden: an effect named", "<= 5 %", "none", "something_named"),
    ("the same, priors of the bicycle 1.5 x too tight", "<= 10 %", "none-tight", "something_named"),
    ("one effect, 3 channels: detected", ">= 80 %", "one", "detected"),
    ("of these named (class and partial included)", "", "one", "something_named"),
    ("named right when named", ">= 90 %", "one", "right_when_named"),
    ("truth inside the 95 % interval", "93-98 %", "one", "truth_inside_95"),
    ("held-out gap left, median", "<= 20 %", "one", "median_gap_left"),
    ("class size, median", "", "one", "median_class_size"),
    ("two effects: exact pair, or a class of at most three with it", ">= 65 %", "pair", "right"),
    ("two effects: a false effect named", "<= 15 %", "pair", "some_false_name"),
    ("two effects: truth inside the 95 % interval", "", "pair", "truth_inside_95"),
    ("the same where the pair is right", "", "pair", "truth_inside_95_when_right"),
    ("effect not in the library: named or class", "<= 20 %", "outside", "misnamed"),
    ("the same, `partial` included", "", "outside", "some_false_name"),
)
"""Row, target of the plan, cell without its kind, figure of the cell."""

ANSWERS = ("right alone", "in a class", "in a partial", "unknown", "none", "something else")


def report(found: Summary) -> str:
    """Markdown of a summary of :func:`studies.missing_effect.blind.score.summary`."""
    return "\n\n".join([SYNTHETIC, targets(found), power(found), confusion(found), intervals(found)]) + "\n"


def targets(found: Summary) -> str:
    """The targets and what was measured, modal data and histories side by side."""
    cells, rows = found["cells"], []
    for what, target, cell, key in TARGETS:
        values = [_number(cells[kind + cell][key]) if kind + cell in cells else "-" for kind in ("modal-", "history-")]
        if values != ["-", "-"]:
            rows.append([what, target, *values])
    return _table(rows, ["", "target", "modal", "histories"])


def power(found: Summary) -> str:
    """Share in which something is named, by hidden effect and noise."""
    rows = []
    for cell, table in found["power"].items():
        levels = list(table["all"])
        for hidden, shares in table.items():
            rows.append([cell, hidden, *(_count(shares[level]) if level in shares else "-" for level in levels)])
    heads = [f"noise x {level}" for level in (levels if rows else ())]
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
    from studies.reporting.plotting import drawing, look

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


TITLES = {"modal-one": "modal data", "history-one": "histories"}


def write_report(found: Summary, folder: Path) -> None:
    """Write report.md and power.png/.svg into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    text = report(found)
    if found["power"]:
        draw_power(found, folder / "power")
        text += "\n![Share named over noise](power.png)\n"
    (folder / "report.md").write_text(f"# Blind test of the missing-effect search\n\n{text}", encoding="utf-8")


def _kind(answer: str, hidden: str) -> str:
    verdict, names = answer.split(": ", 1)
    if verdict in ("none", "unknown"):
        return verdict
    if hidden not in names.split(" or "):
        return ANSWERS[-1]
    return {"named": ANSWERS[0], "class": ANSWERS[1], "partial": ANSWERS[2]}[verdict]


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
