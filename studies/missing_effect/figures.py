"""The figures of a diagnosis: gap map, before and after, posterior, similarity, held-out scores."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.inference.fit import Fit
from studies.inference.forward import Rows
from studies.inference.judge import Diagnosis
from studies.missing_effect.rig.figures import CAPTION, draw_recordings
from studies.missing_effect.rig.recordings_forward import RigRecordingsForward
from studies.reporting.plotting import GREY, drawing, look

MOST_BARS = 12
MOST_SERIES = 8
MOST_LETTERS = 40  # of the names of the conditions below one panel
NAMES = ("nominal", "nuisance_only", "final")
TITLES = {"nominal": "base model", "nuisance_only": "parameters adjusted", "final": "with what was named"}


def draw_all(diagnosis: Diagnosis, folder: Path) -> dict[str, str]:
    """Draw every figure; returns name -> caption."""
    figures = {
        "gap": (_gap_map, "Where the gap is: (measured − computed) / sd; noise alone stays within ±2 (rms 1)."),
        "before_after": (
            _before_after,
            CAPTION
            if isinstance(diagnosis.forward, RigRecordingsForward)
            else "Measured values with 95 % intervals, and the models.",
        ),
        "posterior": (_posterior, "Probability of each hypothesis, relative to this library."),
        "similarity": (_similarity, "|cosine| of what two effects do to the data, parameters marginalised."),
        "held_out": (_held_out, "χ²/n on data left out of the fit; 1 is noise alone."),
    }
    captions = {}
    for name, (draw, caption) in figures.items():
        if draw(diagnosis, folder / name):
            captions[name] = caption
    return captions


def residuals(diagnosis: Diagnosis) -> dict[str, NDArray[np.float64]]:
    """Whitened residuals of the three models."""
    return {
        "nominal": diagnosis.nominal, "nuisance_only": diagnosis.hypotheses.null.residual,
        "final": diagnosis.final.residual,
    }  # fmt: skip


def _shown(diagnosis: Diagnosis) -> tuple[str, ...]:
    return NAMES if diagnosis.final is not diagnosis.hypotheses.null else NAMES[:2]


def _series(diagnosis: Diagnosis) -> list[str]:
    return list(dict.fromkeys(diagnosis.forward.rows.series))


def _grid(figure: Any, count: int) -> Any:
    columns = 1 if count == 1 else 2
    axes = figure.subplots(-(-count // columns), columns, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.remove()
    return axes[:count]


def _gap_map(diagnosis: Diagnosis, target: Path) -> bool:
    names, rows = _series(diagnosis), diagnosis.forward.rows
    if len(names) > MOST_SERIES and not rows.condition and not rows.axes:
        return _gap_by_channel(diagnosis, target)
    series = np.array(rows.series)
    if rows.axes:  # recordings: those with the largest gap
        names = sorted(names, key=lambda name: -float((diagnosis.nominal[series == name] ** 2).mean()))[:MOST_SERIES]
    with drawing(target, width=8, height=1.2 + 2.3 * -(-len(names) // 2)) as figure:
        for axis, name in zip(_grid(figure, len(names)), names, strict=True):
            here = series == name
            axis.axhspan(-2, 2, color="0.92", zorder=0)
            for k, model in enumerate(_shown(diagnosis)):
                style = {**look(k).plot, "linestyle": "none", "markersize": 4}
                axis.plot(rows.speed[here], residuals(diagnosis)[model][here], label=TITLES[model], **style)
            axis.set(title=name.rsplit(", ", 1)[0] if rows.condition else name, ylabel="gap / sd")
            _label_conditions(axis, rows, name)
        handles, labels = axis.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return True


def _gap_by_channel(diagnosis: Diagnosis, target: Path) -> bool:
    """Root mean square of the residuals of each channel over speed: for histories, with too many samples to show."""
    rows = diagnosis.forward.rows
    channel = np.array([where.split(",")[0] for where in rows.where])
    names = list(dict.fromkeys(channel.tolist()))
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    with drawing(target, width=8, height=1.2 + 2.3 * -(-len(names) // 2)) as figure:
        for axis, name in zip(_grid(figure, len(names)), names, strict=True):
            axis.axhline(1, color="k", linestyle=":", linewidth=1)
            speeds = np.unique(rows.speed[channel == name])
            for k, model in enumerate(_shown(diagnosis)):
                squares = residuals(diagnosis)[model] ** 2
                rms = [float(np.sqrt(squares[(channel == name) & (rows.speed == v)].mean())) for v in speeds]
                axis.plot(speeds, rms, label=TITLES[model], **look(k).plot)
            axis.set(title=name, xlabel="speed, m/s", ylabel="rms gap / sd", yscale="log")
            axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0)))
            axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.yaxis.set_minor_formatter(NullFormatter())
        handles, labels = axis.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return True


def _before_after(diagnosis: Diagnosis, target: Path) -> bool:
    if isinstance(diagnosis.forward, RigRecordingsForward):
        none = np.array([u.centre for u in diagnosis.forward.nuisances])
        null, final = diagnosis.hypotheses.null, diagnosis.final
        models = ((), none), (null.candidates, null.theta), (final.candidates, final.theta)
        return draw_recordings(diagnosis.forward, dict(zip(_shown(diagnosis), models, strict=False)), TITLES, target)
    shown = diagnosis.forward.compared(diagnosis.nominal)
    names = _series(diagnosis)
    rows = diagnosis.forward.rows
    series, (measured, sd) = np.array(rows.series), shown
    if sd is None:
        return False
    with drawing(target, width=8, height=1.2 + 2.5 * -(-len(names) // 2)) as figure:
        for axis, name in zip(_grid(figure, len(names)), names, strict=True):
            here = np.flatnonzero(series == name)
            here = here[np.argsort(rows.speed[here])]
            axis.errorbar(
                rows.speed[here], measured[here], 1.96 * sd[here], fmt="o", color="k", ecolor=GREY, markersize=3,
                elinewidth=0.8, label="measured, 95 %",
            )  # fmt: skip
            for k, model in enumerate(_shown(diagnosis)):
                computed = measured[here] - sd[here] * residuals(diagnosis)[model][here]
                style = {"linestyle": "none", "markersize": 4} if rows.condition else {"marker": ""}
                axis.plot(rows.speed[here], computed, **{**look(k).plot, **style}, label=TITLES[model])
            axis.set(title=name.rsplit(",", 1)[0], ylabel=_axis_label(name))
            _label_conditions(axis, rows, name)
        handles, labels = axis.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return True


def _label_conditions(axis: Any, rows: Rows, series: str) -> None:
    if not rows.condition:
        axis.set_xlabel(rows.axes.get(series, "speed, m/s"))
        return
    crowded = sum(map(len, rows.condition)) > MOST_LETTERS
    turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
    axis.set_xticks(range(len(rows.condition)), rows.condition, fontsize=8, **turned)
    axis.set_xlim(-0.5, len(rows.condition) - 0.5)
    axis.grid(visible=False, axis="x")


def _axis_label(series: str) -> str:
    what, part = series.rsplit(", ", 1)
    if part not in ("real", "imaginary"):
        return part  # a unit
    if "over" in what:
        return f"{part} part"
    return "real part, 1/s" if part == "real" else "imaginary part, rad/s"


def _posterior(diagnosis: Diagnosis, target: Path) -> bool:
    shares = list(diagnosis.verdict.posterior.items())[:MOST_BARS][::-1]
    with drawing(target, width=7, height=1 + 0.3 * len(shares)) as figure:
        axis = figure.subplots()
        bars = axis.barh([name for name, _ in shares], [p for _, p in shares], color=look(0).colour)
        axis.bar_label(bars, [f"{p:.3g}" for _, p in shares], padding=3, fontsize=8)
        axis.set(xlim=(0, 1.12), xlabel="posterior probability")
        axis.grid(visible=False, axis="y")
    return True


def _similarity(diagnosis: Diagnosis, target: Path) -> bool:
    names, cosines = diagnosis.similar
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


def _held_out(diagnosis: Diagnosis, target: Path) -> bool:
    if not all(score.possible for score in diagnosis.held_out.values()):
        return False
    from matplotlib.ticker import StrMethodFormatter

    n = len(diagnosis.nominal)
    values = {"nominal": float(diagnosis.nominal @ diagnosis.nominal) / n}
    values |= {name: diagnosis.held_out[name].chi2 / n for name in _shown(diagnosis)[1:]}
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


def explains(found: Fit) -> str:
    """Name of a hypothesis in words."""
    return "parameters only" if not found.candidates else found.name.replace("+", " and ")
