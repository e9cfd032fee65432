"""The plan as files: ``plan.md``, ``plan.json`` and the figure."""

from collections.abc import Sequence
from pathlib import Path

from studies.missing_effect.plan import words
from studies.missing_effect.plan.figure import draw
from studies.missing_effect.plan.plan import Plan
from studies.reporting.markdown_text import cells, plain
from studies.reporting.output import write_json
from tyre.base.files import write_text

CAPTION = "Price against the probability that the hardest question is settled"
EXPLAINED = """\
Probabilities say how often the question would be settled, by the less favourable of its two answers: odds of
{odds:g} : 1 for the true one (10000 : 1 where both have the same direction in the data, cosine above 0.95), the stated
uncertainties of the bicycle doubled, because a name must hold there. That nothing is missing counts as settled where it
leads, for an effect may be as small as it likes. Odds now are those of the answer that leads. Expected odds are those
of the true answer, by the less favourable of the two: where the answer that does not lead is true, they begin below
1 : 1, so they may be smaller than the odds now and yet be a gain. They are the exponential of the mean logarithm. All
are taken as normal about their fits (Laplace): these numbers are predictions, not promises.
"""


def write_plan(plan: Plan, folder: Path, name: str, verdict: str) -> None:
    """Write the ``plan`` of the measurement ``name`` with its ``verdict`` in words into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = draw(plan, folder / "plan")
    write_text(folder / "plan.md", page(plan, name, verdict, drawn=drawn))
    write_json(plan.to_dict(), str(folder / "plan.json"))


def page(plan: Plan, name: str, verdict: str, *, drawn: bool) -> str:
    """The ``plan`` of the measurement ``name`` as Markdown; ``verdict`` in words, ``drawn``: there is a figure."""
    parts = [
        f"# What to measure next: {plain(name)}",
        f"**{plain(words.headline(plan))}**",
        f"So far: {plain(verdict)}",
    ]
    if plan.steps:
        total = ["**together**", "", f"**{plan.costs.money(plan.cost)}**"]
        parts += ["## What to do", _table(words.STEPS, [*words.step_rows(plan), total]), plain(words.proof(plan))]
    if words.afterwards(plan):
        tables = "\n".join(f"- {line}" for line in words.afterwards(plan))  # to be copied, so not escaped
        parts += ["## What to do with the result", tables]
    if plan.questions:
        parts += ["## What it settles", _table(words.QUESTIONS, words.question_rows(plan)),
                  EXPLAINED.format(odds=plan.costs.odds).strip()]  # fmt: skip
    if words.hopeless(plan):
        parts += ["## What nothing on offer settles", "\n".join(f"- {plain(line)}" for line in words.hopeless(plan))]
    if drawn:
        parts += [
            "## Price and separation",
            f"![{CAPTION}](plan.png)",
        ]
    if plan.notes:
        parts += ["## Notes", "\n".join(f"- {plain(note)}" for note in plan.notes)]
    return "\n\n".join(filter(None, parts)) + "\n"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {cells(line)} |" for line in lines)
