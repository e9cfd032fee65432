"""The figures of a diagnosis: those of its kind of data, posterior, similarity, held-out scores."""

from pathlib import Path
from textwrap import fill

import numpy as np

from studies.inference.judge import Judgement
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.interface import Figure
from studies.missing_effect.reporting.tables import fate
from studies.missing_effect.reporting.words import BASE, probability, said, titles
from studies.reporting.plotting import GREY, drawing, look

MOST_BARS = 12
LEAST = 1e-6  # probability that is drawn
LETTERS = 46  # of a reason beside a bar
WIDE = 100  # ratio of the ends of an axis from which powers of ten are labels enough
LINE = 44  # letters in a line there: beside a bar that ends at 1 there is room for so many


def draw_all(diagnosis: Diagnosis, folder: Path) -> dict[str, str]:
    """Draw every figure of a ``diagnosis`` into ``folder``; returns name -> caption of those that there are."""
    figures: dict[str, Figure] = {
        **diagnosis.measurement.figures(),
        "posterior": (
            _posterior,
            "Probability of each hypothesis, relative to this library, on a logarithmic axis down to one in a million. "
            "Dark: named or explaining the data; light: cannot be told from it; hatched: refused, with the rule it "
            "fails.",
        ),
        "similarity": (_similarity, "|cosine| of what two effects do to the data, parameters marginalised."),
        "held_out": (_held_out, "χ²/n on data left out of the fit; 1 is noise alone."),
    }
    captions = {}
    for name, (draw, caption) in figures.items():
        if draw(diagnosis, folder / name):
            captions[name] = caption
    return captions


def _posterior(judgement: Judgement, target: Path) -> bool:
    posterior, fates = judgement.hypotheses.posterior, fate(judgement)
    every = list(posterior)
    wanted = {judgement.final.name, *judgement.verdict.equivalent}
    named = [*every[:MOST_BARS], *(name for name in every[MOST_BARS:] if name in wanted)][::-1]
    width = 8 + 0.08 * max(0, max(len(said(name)) for name in named) - 30)  # inches; long names leave room for labels
    with drawing(target, width=width, height=1 + 0.32 * len(named)) as figure:
        axis = figure.subplots()
        for place, name in enumerate(named):
            share, what = posterior[name], fates.get(name, "")
            style = {"color": GREY, "alpha": 0.6}
            if what.startswith("refused"):
                style = {"color": "w", "edgecolor": GREY, "hatch": "////"}
            elif name == judgement.final.name and judgement.verdict.verdict != "unknown":
                style = {"color": look(0).colour}
            elif what:
                style = {"color": look(1).colour}
            axis.barh(place, max(share, LEAST), **style)
            reason = what if len(what) < LETTERS else f"{what[:LETTERS]}..."
            text = f" {probability(share)}{f'  ({reason})' if reason else ''}"
            axis.text(max(share, LEAST), place, fill(text, LINE, subsequent_indent=" "), va="center", fontsize=8)
        axis.set_yticks(range(len(named)), [said(name) for name in named])
        axis.set(xscale="log", xlim=(LEAST, 1e4), xlabel="posterior probability")
        axis.set_xticks([1e-6, 1e-4, 1e-2, 1], ["0.000001", "0.0001", "0.01", "1"])
        axis.grid(visible=False, axis="y")
    return True


def _similarity(judgement: Judgement, target: Path) -> bool:
    names, cosines = judgement.similar
    if len(names) < 2:
        return False
    with drawing(target, width=2.6 + 0.5 * len(names), height=1.9 + 0.5 * len(names)) as figure:
        axis = figure.subplots()
        image = axis.imshow(np.abs(cosines), vmin=0, vmax=1, cmap="Greys")
        axis.set_xticks(range(len(names)), names, rotation=45, ha="right", rotation_mode="anchor")
        axis.set_yticks(range(len(names)), names)
        axis.grid(visible=False)
        for i, j in np.ndindex(*cosines.shape):
            value = abs(cosines[i, j])
            axis.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=7, color="w" if value > 0.6 else "k")
        figure.colorbar(image, label="|cosine|", shrink=0.8)
    return True


def _held_out(judgement: Judgement, target: Path) -> bool:
    if not all(score.possible for score in judgement.held_out.values()):
        return False
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    n = len(judgement.nominal)
    values = {BASE: float(judgement.nominal @ judgement.nominal) / n}
    models = list(titles(judgement).items())[1:]
    values |= {title: judgement.held_out[model].chi2 / n for model, title in models}
    with drawing(target, width=6, height=1.3 + 0.3 * len(values)) as figure:
        axis = figure.subplots()
        names = list(values)[::-1]
        bars = axis.barh(names, list(values.values())[::-1], color=[look(k).colour for k in range(len(names))][::-1])
        axis.bar_label(bars, [f"{value:.3g}" for value in list(values.values())[::-1]], padding=3, fontsize=8)
        axis.axvline(1, color="k", linestyle=":", linewidth=1)
        low, high = min(0.3, 0.5 * min(values.values())), 3 * max(values.values()) + 1
        axis.set(xscale="log", xlabel="χ²/n on held-out data", xlim=(low, high))
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < WIDE * low else (1.0,)))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.xaxis.set_minor_formatter(NullFormatter())  # its labels overlap where the axis is short
        axis.grid(visible=False, axis="y")
    return True
