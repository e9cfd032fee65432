"""Tornado figure: what one standard deviation of each parameter does to the growth rate of a mode."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bicycle.default_sd import ASSUMED
from bicycle.eigenvalues.oscillation import frequency_hz
from studies.sensitivity.ranking import Change, Ranking


def draw_tornado(ranking: Ranking, target: Path, *, top: int = 15) -> None:
    """Bars of the change of the growth rate for plus (dark) and minus (hatched) one standard deviation.

    Parameters
    ----------
    ranking : Ranking
    target : Path
        Without ending.
    top : int, optional
        Number of parameters shown.
    """
    from studies.reporting.plotting import LOOKS, drawing

    shown = ranking.changes[:top][::-1]
    growth, rows = np.array([change.growth for change in shown]), np.arange(len(shown))
    z, note = ranking.eigenvalue, "; two real roots meet, their mean" if ranking.meeting else ""
    with drawing(target, width=7.6, height=1.9 + 0.28 * len(shown)) as figure:
        axes = figure.subplots()
        axes.barh(rows, growth, color=LOOKS[0].colour, label="+1 standard deviation")
        axes.barh(rows, -growth, color="white", edgecolor=LOOKS[2].colour, hatch="////", label="−1 standard deviation")
        axes.axvline(0, color="black", linewidth=0.8)
        axes.set_yticks(rows, [_label(change) for change in shown])
        axes.tick_params(axis="y", length=0)
        axes.margins(y=0.02)
        axes.grid(axis="y", visible=False)
        axes.set_xlabel("change of the growth rate, 1/s (> 0: less stable)", fontsize=8.5)
        figure.suptitle(
            f"What moves {ranking.mode} at {ranking.speed:g} m/s\n"
            f"growth rate {z.real:.3g} 1/s, {abs(frequency_hz(z)):.2f} Hz{note}",
            fontsize=10, weight="bold",
        )  # fmt: skip
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        axes.set_xlabel("\n".join([axes.get_xlabel(), *footnotes(shown)]), fontsize=8.5)


def footnotes(shown: Sequence[Change]) -> list[str]:
    """What the star behind a standard deviation means, where one occurs."""
    return ["* not stated by any source: the default is assumed"] if any(map(_star, shown)) else []


def _star(change: Change) -> str:
    return "*" if change.origin == ASSUMED else ""


def _label(change: Change) -> str:
    unit = change.unit.replace("^2", "²").replace("^3", "³")
    return f"{change.parameter}  (sd {change.sd:.3g}{'' if unit == '1' else ' ' + unit}{_star(change)})"
