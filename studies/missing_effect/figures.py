"""The figures of a diagnosis: those of its kind of data, posterior, similarity, held-out scores."""

from pathlib import Path

import numpy as np

from studies.inference.fit import Fit
from studies.inference.judge import Judgement
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.gap_figures import TITLES, shown_models
from studies.missing_effect.interface import Figure
from studies.reporting.plotting import drawing, look

MOST_BARS = 12


def draw_all(diagnosis: Diagnosis, folder: Path) -> dict[str, str]:
    """Draw every figure of a ``diagnosis`` into ``folder``; returns name -> caption of those that there are."""
    figures: dict[str, Figure] = {
        **diagnosis.measurement.figures(),
        "posterior": (_posterior, "Probability of each hypothesis, relative to this library."),
        "similarity": (_similarity, "|cosine| of what two effects do to the data, parameters marginalised."),
        "held_out": (_held_out, "χ²/n on data left out of the fit; 1 is noise alone."),
    }
    captions = {}
    for name, (draw, caption) in figures.items():
        if draw(diagnosis, folder / name):
            captions[name] = caption
    return captions


def _posterior(judgement: Judgement, target: Path) -> bool:
    shares = list(judgement.verdict.posterior.items())[:MOST_BARS][::-1]
    with drawing(target, width=7, height=1 + 0.3 * len(shares)) as figure:
        axis = figure.subplots()
        bars = axis.barh([name for name, _ in shares], [p for _, p in shares], color=look(0).colour)
        axis.bar_label(bars, [f"{p:.3g}" for _, p in shares], padding=3, fontsize=8)
        axis.set(xlim=(0, 1.12), xlabel="posterior probability")
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
    from matplotlib.ticker import StrMethodFormatter

    n = len(judgement.nominal)
    values = {"nominal": float(judgement.nominal @ judgement.nominal) / n}
    values |= {name: judgement.held_out[name].chi2 / n for name in shown_models(judgement)[1:]}
    with drawing(target, width=6, height=2.2) as figure:
        axis = figure.subplots()
        names = [TITLES[name] for name in values][::-1]
        bars = axis.barh(names, list(values.values())[::-1], color=[look(k).colour for k in range(len(names))][::-1])
        axis.bar_label(bars, [f"{value:.3g}" for value in list(values.values())[::-1]], padding=3, fontsize=8)
        axis.axvline(1, color="k", linestyle=":", linewidth=1)
        axis.set(xscale="log", xlabel="χ²/n on held-out data", xlim=(0.3, 3 * max(values.values()) + 1))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.grid(visible=False, axis="y")
    return True


def explains(hypothesis: Fit) -> str:
    """Name of a ``hypothesis`` in words."""
    return " and ".join(c.identifier for c in hypothesis.candidates) or "parameters only"
