"""The gap of rig recordings in newtons: measured minus base model over slip or displacement, branch by branch."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.inference.judge import Judgement
from studies.missing_effect.gap_figures import legend_above, panels
from studies.missing_effect.reporting.words import titles
from studies.missing_effect.rig.recordings_forward import RigRecordingsForward
from studies.reporting.plotting import GREY, drawing, look
from tyre.base.arrays import Array

MOST_RECORDINGS = 8  # drawn
CAPTION = (
    "Measured side force minus that of the base model, N: filled with rising slip or displacement, open with falling. "
    "Lines: what the adjusted parameters and the named effects say the difference should be."
)


def draw_recordings(judgement: Judgement, target: Path) -> bool:
    """One panel a recording, of a ``judgement`` of rig recordings, into the file ``target`` without its ending."""
    forward, null, final = judgement.forward, judgement.hypotheses.null, judgement.final
    assert isinstance(forward, RigRecordingsForward)
    nominal = np.array([u.centre for u in forward.nuisances])
    models = {
        "nominal": ((), nominal), "nuisance_only": ((), null.theta), "final": (final.candidates, final.theta),
    }  # fmt: skip
    computed = {title: forward.forces(*models[model]) for model, title in titles(judgement).items()}
    base = next(iter(computed.values()))
    shown: list[tuple[str, Array, Array, Array, str]] = [
        (s.name, np.rad2deg(s.slip), s.force, s.direction, "slip angle, deg") for s in forward.sweeps
    ]
    for p in forward.pulls:
        way = np.sign(np.gradient(p.displacement))
        shown.append((p.name, 1e3 * p.displacement, p.force, way, "displacement, mm"))
    shown = shown[:MOST_RECORDINGS]
    with drawing(target, width=8, height=1.2 + 2.6 * -(-len(shown) // 2)) as figure:
        axes = panels(figure, len(shown))
        for axis, (name, x, force, way, label) in zip(axes, shown, strict=False):
            _panel(axis, x, force - base[name], way)
            for k, (title, found) in enumerate(list(computed.items())[1:], 1):
                for sense in (1, -1):
                    _line(axis, x, found[name] - base[name], way * sense > 0, k, title if sense > 0 else "_")
            axis.axhline(0, color="k", linewidth=0.8)
            axis.set(title=name, xlabel=label, ylabel="side force minus base model, N")
        legend_above(figure, axes[0], columns=2)
    return True


def _panel(axis: Any, x: Array, gap: Array, way: Array) -> None:
    style = {"linestyle": "none", "marker": "o", "markersize": 3, "color": GREY}
    axis.plot(x[way > 0], gap[way > 0], **style, label="measured, rising")
    axis.plot(x[way <= 0], gap[way <= 0], **style, markerfacecolor="w", label="measured, falling")


def _line(axis: Any, x: Array, gap: Array, here: NDArray[np.bool_], k: int, title: str) -> None:
    """Mean of the cycles in bins of x, so that a line stays a line."""
    if not here.any():
        return
    edges = np.linspace(x.min(), x.max() + 1e-12, 41)
    number = np.digitize(x[here], edges)
    bins = np.unique(number)
    axis.plot(
        [x[here][number == b].mean() for b in bins], [gap[here][number == b].mean() for b in bins],
        **{**look(k).plot, "marker": ""}, label=title,
    )  # fmt: skip
