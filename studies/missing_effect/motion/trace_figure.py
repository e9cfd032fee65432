"""Measured against computed time histories: the runs with the largest gap."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.inference.judge import Judgement
from studies.missing_effect.gap_figures import legend_above
from studies.missing_effect.interface import Figure
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.reporting.words import titles
from studies.reporting.plotting import GREY, drawing, look
from tyre.base.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_RUNS = 4
ROOM = 0.15  # of the measured range, beyond it: what leaves is told in numbers


def missed_most(judgement: Judgement) -> tuple[dict[str, list[Array]], list[int]]:
    """What the models leave of the runs, and which runs the base model misses most.

    Parameters
    ----------
    judgement : Judgement
        Of time histories.

    Returns
    -------
    missed : dict of str to list of ndarray, shape (samples, channels)
        Measured less computed, of each model and run, SI.
    shown : list of int
        Runs, at most :data:`MOST_RUNS`.
    """
    forward, null, final = judgement.forward, judgement.hypotheses.null, judgement.final
    assert isinstance(forward, HistoryForward)
    nominal = np.array([u.centre for u in forward.nuisances])
    models = {
        "nominal": ((), nominal), "nuisance_only": ((), null.theta), "final": (final.candidates, final.theta),
    }  # fmt: skip
    missed = {title: forward.unexplained(*models[model]) for model, title in titles(judgement).items()}
    sd = np.array([noise.sd for noise in forward.noise.values()])
    gap = [float(np.mean((e / sd) ** 2)) for e in next(iter(missed.values()))]
    return missed, sorted(np.argsort(np.nan_to_num(gap, nan=np.inf))[::-1][:MOST_RUNS].tolist())


def draw_traces(judgement: Judgement, target: Path) -> bool:
    """Every channel of the runs that the base model misses most, into the file ``target`` without its ending.

    Parameters
    ----------
    judgement : Judgement
        Of time histories.
    target : Path
    """
    forward = judgement.forward
    assert isinstance(forward, HistoryForward)
    missed, shown = missed_most(judgement)
    channels = tuple(forward.noise)
    with drawing(target, width=1 + 3.2 * len(channels), height=1.0 + 1.9 * len(shown)) as figure:
        axes = figure.subplots(len(shown), len(channels), squeeze=False)
        for row, (line, k) in enumerate(zip(axes, shown, strict=True)):
            run = forward.runs[k]
            for c, (axis, name) in enumerate(zip(line, channels, strict=True)):
                seen = run.channels[name]
                axis.plot(run.time, seen, color=GREY, linestyle="none", marker=".", markersize=3, label="measured")
                for number, (title, rest) in enumerate(missed.items()):
                    style = {**look(number).plot, "marker": "", "linewidth": 1.3}
                    axis.plot(run.time, seen - rest[k][:, c], label=title, **style)
                room = ROOM * (float(np.ptp(seen)) or 1.0)
                low, high = seen.min() - room, seen.max() + room
                axis.set_ylim(low, high)
                _say_what_is_cut(axis, {title: seen - rest[k][:, c] for title, rest in missed.items()}, low, high)
                axis.set_title(f"{run.name}, {run.speed:.3g} m/s" if not c else "")
                axis.set_ylabel(name)
                if row == len(shown) - 1:
                    axis.set_xlabel("time, s")
        legend_above(figure, axes[0, 0], columns=4)
    return True


def _say_what_is_cut(axis: "Axes", computed: Mapping[str, Array], low: float, high: float) -> None:
    """How far lines go that leave the frame, which is that of what was measured."""
    lines = [
        f"{title}: {y.min():.2g} .. {y.max():.2g}" for title, y in computed.items() if y.min() < low or y.max() > high
    ]
    if lines:
        said = "beyond the frame:\n" + "\n".join(lines)
        axis.annotate(said, (0.02, 0.03), xycoords="axes fraction", fontsize="x-small", color=GREY, va="bottom")


TRACES: Figure = (
    draw_traces,
    f"Measured and computed signals of the runs that the base model misses most (at most {MOST_RUNS}); the computed "
    "ones start where they fit best.",
)
