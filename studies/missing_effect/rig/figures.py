"""The gap of rig recordings in newtons: measured minus base model over slip or displacement, branch by branch."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.inference.parameter import Candidate
from studies.missing_effect.rig.recordings_forward import RigRecordingsForward
from studies.reporting.plotting import GREY, drawing, look
from tyre.base.arrays import Array

MOST = 8  # recordings drawn
CAPTION = (
    "Measured side force minus that of the base model, N: filled with rising slip or displacement, open with falling. "
    "Lines: what the adjusted parameters and the named effects say the difference should be."
)


def draw_recordings(
    forward: RigRecordingsForward, models: Mapping[str, tuple[tuple[Candidate, ...], Array]],
    titles: Mapping[str, str], target: Path,
) -> bool:  # fmt: skip
    """One panel a recording; ``models`` are hypotheses with their coordinates, the base model first."""
    computed = {titles[name]: forward.forces(*model) for name, model in models.items()}
    base = next(iter(computed.values()))
    shown: list[tuple[str, Array, Array, Array, str]] = [
        (s.name, np.rad2deg(s.slip), s.force, s.direction, "slip angle, deg") for s in forward.sweeps
    ]
    for p in forward.pulls:
        way = np.sign(np.gradient(p.displacement))
        shown.append((p.name, 1e3 * p.displacement, p.force, way, "displacement, mm"))
    shown = shown[:MOST]
    rows = -(-len(shown) // 2)
    with drawing(target, width=8, height=1.2 + 2.6 * rows) as figure:
        axes = figure.subplots(rows, 1 if len(shown) == 1 else 2, squeeze=False).ravel()
        for spare in axes[len(shown) :]:
            spare.remove()
        for axis, (name, x, force, way, label) in zip(axes, shown, strict=False):
            _panel(axis, x, force - base[name], way)
            for k, (title, found) in enumerate(list(computed.items())[1:], 1):
                for sense in (1, -1):
                    _line(axis, x, found[name] - base[name], way * sense > 0, k, title if sense > 0 else "_")
            axis.axhline(0, color="k", linewidth=0.8)
            axis.set(title=name, xlabel=label, ylabel="side force minus base model, N")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
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
