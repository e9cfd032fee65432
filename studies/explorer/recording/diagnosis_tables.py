"""The posterior, the parameters moved and the tables of a diagnosis, for the page of recordings."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from studies.explorer.recording.bars import bars
from studies.inference.judge import Judgement
from studies.inference.moved import Moved
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.figures import LEAST, LETTERS, MOST_BARS
from studies.missing_effect.reporting import tables
from studies.missing_effect.reporting.words import ADJUSTED, probability, said, titles

MOST_MOVED = 15  # parameters that are drawn; the table has all


def posterior_figure(judgement: Judgement) -> dict[str, Any]:
    """Probability of each hypothesis.

    Parameters
    ----------
    judgement : Judgement
    """
    posterior, fates = judgement.hypotheses.posterior, tables.fate(judgement)
    wanted = {judgement.final.name, *judgement.verdict.equivalent}
    names = [name for k, name in enumerate(posterior) if k < MOST_BARS or name in wanted]
    reasons = {name: f" ({what if len(what) < LETTERS else f'{what[:LETTERS]}…'})" for name, what in fates.items()}
    told = [f"{probability(posterior[name])}{reasons.get(name, '')}" for name in names]
    rows = [[said(name), share, fates.get(name, "")] for name, share in posterior.items()]
    return bars(
        "posterior", "Probability of the hypotheses", "Probability of each hypothesis",
        [said(name) for name in names], [max(posterior[name], LEAST) for name in names], told,
        rows={"columns": ["hypothesis", "probability", "what became of it"], "rows": rows},
        hatched=[fates.get(name, "").startswith("refused") for name in names], logarithmic=True,
        below="posterior probability",
        note="Relative to this library, down to one in a million. Hatched: refused; the table has the "
        "rule in full.",
    )  # fmt: skip


def moved_figure(judgement: Judgement, found: tuple[Moved, ...]) -> dict[str, Any]:
    """How far each parameter went, in prior standard deviations.

    Parameters
    ----------
    judgement : Judgement
    found : tuple of Moved
    """
    final = list(titles(judgement).values())[-1]
    alone = judgement.final is judgement.hypotheses.null
    shown = found[:MOST_MOVED]
    columns = ["parameter", "unit", "stated", "sd", "fitted", "sd of it", f"moved in sd, {ADJUSTED}"]
    columns += [] if alone else [f"moved in sd, {final}"]
    rows = [[m.name, m.unit, m.prior, m.prior_sd, m.value, m.sd, m.alone, *([] if alone else [m.shift])] for m in found]
    rest = f"{len(found) - len(shown)} more moved less; the table has them. " if len(found) > len(shown) else ""
    return bars(
        "moved", "Parameters moved", f"How far parameters moved, {final}",
        [m.name for m in shown], [m.shift for m in shown], [f"{m.shift:+.2f} sd" for m in shown],
        rows={"columns": columns, "rows": rows}, below="prior standard deviations",
        note=f"{rest}What moves beyond ±2 is doubtful by itself.",
    )  # fmt: skip


def report_tables(diagnosis: Diagnosis) -> Iterator[dict[str, Any]]:
    """Tables of the report: ``words``, ``columns`` and ``rows``.

    Parameters
    ----------
    diagnosis : Diagnosis
    """
    yield {"words": "What is named", "columns": ["effect", "parameter", "value", "1 sd", "what it does"],
           "rows": tables.named(diagnosis)}  # fmt: skip
    yield {"words": "Gap by place: χ²", "columns": ["where", "numbers", *titles(diagnosis).values()],
           "rows": tables.by_place(diagnosis)}  # fmt: skip
    names, cosines = diagnosis.similar
    yield {"words": "How alike effects are: |cosine|", "columns": ["effect", *names],
           "rows": [[name, *row] for name, row in zip(names, np.abs(cosines).tolist(), strict=True)]}  # fmt: skip
    yield {"words": "Data left out of the fit: χ²/n", "columns": ["model", "χ²/n"], "rows": _held_out(diagnosis)}
    yield {"words": "Hypotheses that were tried", "columns": ["hypothesis", "P", "χ²", "sizes", "what became of it"],
           "rows": tables.tried(diagnosis)}  # fmt: skip
    yield {"words": "Effects that were not tried", "columns": ["effect", "why"],
           "rows": [[name, why] for name, why in diagnosis.verdict.refused.items()]}  # fmt: skip
    yield {
        "words": "Assumptions and remarks",
        "columns": ["what"],
        "rows": [[" ".join(w.split())] for w in diagnosis.verdict.warnings],
    }


def _held_out(judgement: Judgement) -> list[list[Any]]:
    if not all(score.possible for score in judgement.held_out.values()):
        return []
    n = len(judgement.nominal)
    first, *others = titles(judgement).items()
    base = float(judgement.nominal @ judgement.nominal) / n
    return [[first[1], base], *([title, judgement.held_out[model].chi2 / n] for model, title in others)]
