"""Bode diagrams: measured gain and phase with their intervals, and the models."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.inference.judge import Judgement
from studies.missing_effect.forced.forward import FrequencyForward
from studies.missing_effect.forced.table import spoken, unit_of
from studies.missing_effect.gap_figures import legend_above, residuals
from studies.missing_effect.interface import Figure
from studies.reporting.plotting import GREY, drawing, look
from tyre.base.arrays import Array, Complex

MOST_PAIRS, MOST_SPEEDS = 3, 3
SURE = 0.9  # share of the gain beyond which its interval leaves the phase unknown


def draw_bode(judgement: Judgement, target: Path) -> bool:
    """Gain and phase of the responses that the base model misses most, into the file ``target`` without its ending.

    Parameters
    ----------
    judgement : Judgement
        Of frequency responses.
    target : Path
    """
    forward = judgement.forward
    assert isinstance(forward, FrequencyForward)
    points = forward.points
    pairs = _largest(judgement, [(p.input, p.output) for p in points], MOST_PAIRS)
    speeds = sorted(_largest(judgement, [p.speed for p in points], MOST_SPEEDS))
    value, sd = np.array([p.value for p in points]), np.array([p.sd for p in points])
    models = {
        title: value - sd * (gap[::2] + 1j * gap[1::2]) for title, gap in residuals(judgement).items()
    }  # fmt: skip
    shown = [
        [np.array([(p.input, p.output) == pair and p.speed == v for p in points]) for v in speeds] for pair in pairs
    ]
    hertz = np.array([p.frequency for p in points])
    with drawing(target, width=1.2 + 3.0 * max(len(speeds), 2), height=1.0 + 3.3 * len(pairs)) as figure:
        axes = figure.subplots(2 * len(pairs), len(speeds), squeeze=False, sharex=True)
        for row, (pair, line) in enumerate(zip(pairs, shown, strict=True)):
            first = next(p for p in points if (p.input, p.output) == pair)
            for column, (v, here) in enumerate(zip(speeds, line, strict=True)):
                gain, phase = axes[2 * row : 2 * row + 2, column]
                _draw(gain, phase, hertz[here], value[here], sd[here], {t: h[here] for t, h in models.items()})
                title = f"{spoken(pair[0])} to {spoken(pair[1])}, {v:g} m/s"
                gain.set_title(title if here.any() else f"{title}: not measured")
                if not column:
                    gain.set_ylabel(f"gain, {unit_of(first)}")
                    phase.set_ylabel("phase, deg")
        for axis in axes[-1]:
            axis.set_xlabel("frequency, Hz")
            _label(axis.xaxis)
        full = next(axes[2 * r, c] for r, line in enumerate(shown) for c, here in enumerate(line) if here.any())
        legend_above(figure, full, columns=4)
    return True


def _largest(judgement: Judgement, labels: list[Any], most: int) -> list[Any]:
    """The labels with the largest gap a number of the base model, in their first order."""
    gap = (judgement.nominal**2).reshape(-1, 2).sum(1)
    names = list(dict.fromkeys(labels))
    size = {name: gap[[label == name for label in labels]].mean() for name in names}
    kept = sorted(names, key=lambda name: -size[name])[:most]
    return [name for name in names if name in kept]


def _draw(gain: Any, phase: Any, hertz: Array, value: Complex, sd: Array, models: dict[str, Complex]) -> None:
    gain.set(xscale="log", yscale="log")
    _label(gain.yaxis)
    if not len(hertz):
        return
    seen = np.rad2deg(np.unwrap(np.angle(value)))
    size = np.abs(value)
    sure = 1.96 * sd < SURE * size
    style = {"fmt": "o", "color": "k", "ecolor": GREY, "markersize": 3, "elinewidth": 0.8}
    low = np.minimum(1.96 * sd, SURE * size)  # a logarithmic axis has no zero
    gain.errorbar(hertz, size, [low, 1.96 * sd], **style, label="measured, 95 %")
    phase.errorbar(hertz[sure], seen[sure], np.rad2deg(np.arcsin(1.96 * sd[sure] / size[sure])), **style)
    for k, (title, computed) in enumerate(models.items()):
        line = {**look(k).plot, "marker": ""}
        gain.plot(hertz, np.abs(computed), **line, label=title)
        phase.plot(hertz, np.rad2deg(_unwrapped(computed, np.deg2rad(seen))), **line)


def _unwrapped(computed: Complex, near: Array) -> Array:
    """Phase (n,) of what was computed, rad, without jumps, on the turn of the measured one ``near`` (n,) it."""
    phase = np.unwrap(np.angle(computed))
    return np.asarray(phase + 2 * np.pi * np.round(np.median(near - phase) / (2 * np.pi)))


def _label(axis: Any) -> None:
    """Plain numbers at 1, 2 and 5 of every decade."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


BODE: Figure = (
    draw_bode,
    f"Gain and phase, measured with 95 % intervals, and the models; at most {MOST_PAIRS} responses and {MOST_SPEEDS} "
    "speeds, those that the base model misses most. Where the interval of a gain reaches down to zero its phase is not "
    "known and not shown.",
)
