"""Figures of a diagnosis: misfit of each model in bars, measured values with the models."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import chdtri

from studies.diagnosis.labels import BASE, titles
from studies.diagnosis.story import Story
from studies.inference.judge import Judgement
from studies.inference.kind import Candidates, Figure, Rows
from studies.reporting.plotting import GREY, drawing, legend_columns, look
from tyre.ground.arrays import Array, Complex

MEASURED: dict[str, Any] = {"fmt": "o", "color": "k", "ecolor": GREY, "markersize": 3, "elinewidth": 0.8}


def residuals(judgement: Judgement) -> dict[str, Array]:
    """Whitened residuals (n,) of the models of a ``judgement`` that differ, by title."""
    by_model: dict[str, Any] = {
        "nominal": judgement.nominal,
        "nuisance_only": judgement.hypotheses.null.residual,
        "effect_alone": judgement.alone and judgement.alone.residual,
        "final": judgement.final.residual,
    }
    return {title: by_model[model] for model, title in titles_of_drawn_models(judgement).items()}


def models_of(judgement: Judgement) -> dict[str, tuple[Candidates, Array]]:
    """Candidates and coordinates of the models of a ``judgement`` that differ, by title."""
    fits = {"nuisance_only": judgement.hypotheses.null, "effect_alone": judgement.alone, "final": judgement.final}
    by_model = {model: (f.candidates, f.theta) for model, f in fits.items() if f is not None}
    by_model["nominal"] = (), np.array([u.centre for u in judgement.kind.nuisances])
    return {title: by_model[model] for model, title in titles_of_drawn_models(judgement).items()}


def titles_of_drawn_models(judgement: Judgement) -> dict[str, str]:
    """Models that are drawn against the measurement: base, effect alone, effect with adjusted parameters."""
    all_titles = titles(judgement)
    return {
        model: title for model, title in all_titles.items() if model != "nuisance_only" or "final" not in all_titles
    }


# ---- the story ----


def draw_story(story: Story, names: Mapping[str, str], target: Path) -> bool:
    """Bars of chi^2 per data point of each step, on all data and on held-out data, with the band of noise."""
    rows = [("all data", story.gap)]
    if story.held_out is not None:
        rows.append(("held-out runs" if story.unseen else "held-out data", story.held_out))
    steps = list(story.gap.steps)
    with drawing(target, width=8, height=1.3 + 0.45 * len(steps)) as figure:
        axis = figure.subplots()
        for k, (data_name, gap) in enumerate(rows):
            values = {step: value / gap.noise for step, value in gap.steps.items()}
            places = [steps.index(step) + 0.38 * k - 0.19 for step in values]
            bars = axis.barh(places, list(values.values()), 0.34, label=data_name, color=look(k).colour, left=0.0)
            axis.bar_label(bars, [f"{x:.3g}" for x in values.values()], padding=3, fontsize=8)
        low, high = chdtri(story.gap.noise, (0.975, 0.025)) / story.gap.noise
        axis.axvspan(low, high, color="0.85", zorder=0, label="noise, 95 %")
        numbers = [value / gap.noise for _, gap in rows for value in gap.steps.values()]
        least = max(0.5 * min(numbers), 1e-3)  # the shortest bar has its number too
        axis.set_yticks(range(len(steps)), [names[step] for step in steps])
        axis.set(xscale="log", xlim=(min(0.3, least), 4 * max(*numbers, 1.0)), xlabel="χ² per data point")
        plain_ticks(axis.xaxis, 1.0)
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        legend_above(figure, axis, columns=3)
    return True


STORY = (
    "Misfit (χ² per data point) of each model on all data and, where data could be held out, on those; noise has 1 "
    "(grey: 95 %)."
)


def panels(figure: Any, count: int) -> Any:
    """A number ``count`` of axes in two columns of a matplotlib ``figure``."""
    columns = 1 if count == 1 else 2
    axes = figure.subplots(-(-count // columns), columns, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.remove()
    return axes[:count]


def legend_above(figure: Any, axis: Any, *, columns: int) -> None:
    """One legend for a ``figure``, of the curves of one ``axis``."""
    handles, labels = axis.get_legend_handles_labels()
    fit = legend_columns(labels, width=figure.get_figwidth())
    figure.legend(handles, labels, loc="outside upper center", ncols=min(columns, fit))


def plain_ticks(axis: Any, *places: float) -> None:
    """Plain numbers at these places of every decade of a logarithmic ``axis``."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=places))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())  # its labels overlap on a short axis


# ---- measured values and models ----


def draw_before_after(judgement: Judgement, target: Path) -> bool:
    """Measured values with 95 % intervals and the models."""
    rows = judgement.kind.rows
    names = list(dict.fromkeys(rows.series))
    series = np.array(rows.series)
    measured, sd = judgement.kind.data
    with drawing(target, width=8, height=1.2 + 2.5 * -(-len(names) // 2)) as figure:
        for axis, name in zip(panels(figure, len(names)), names, strict=True):
            indices = np.flatnonzero(series == name)
            indices = indices[np.argsort(rows.abscissa[indices])]
            display = rows.show(name)
            shown = display.factor * measured[indices]
            spread = display.factor * sd[indices]
            axis.errorbar(rows.abscissa[indices], shown, 1.96 * spread, **MEASURED, label="measured, 95 %")
            for k, (title, residual) in enumerate(residuals(judgement).items()):
                computed = shown - spread * residual[indices]
                style = {"linestyle": "none", "markersize": 4} if rows.condition else {"marker": ""}
                axis.plot(rows.abscissa[indices], computed, **{**look(k).plot, **style}, label=title)
            axis.set(title=display.channel, ylabel=display.label)
            _label_abscissa(axis, rows, name)
        legend_above(figure, axis, columns=4)
    return True


def _label_abscissa(axis: Any, rows: Rows, series: str) -> None:
    """Label the abscissa of an ``axis`` with its quantity, or with the names of the conditions."""
    if not rows.condition:
        label = rows.show(series).axis or rows.axis
        axis.set_xlabel(label)
        if label and ", " not in label:  # counted, without a unit
            axis.locator_params(axis="x", integer=True)
        return
    crowded = sum(map(len, rows.condition)) > 40  # letters
    turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
    axis.set_xticks(range(len(rows.condition)), rows.condition, fontsize=8, **turned)
    axis.set_xlim(-0.5, len(rows.condition) - 0.5)
    axis.grid(visible=False, axis="x")


BEFORE_AFTER: Figure = (draw_before_after, "Measured values with 95 % intervals, and the models.")

# ---- time histories ----


def find_worst_runs(judgement: Judgement) -> tuple[dict[str, list[Array]], list[int]]:
    """Measured less computed signals of each model and run (samples, channels), and the four runs missed most."""
    kind: Any = judgement.kind
    missed = {title: kind.residual_signals(*model) for title, model in models_of(judgement).items()}
    final = judgement.final
    base = kind.family(())
    with_it = kind.family(judgement.final.candidates)
    if BASE in missed and final.candidates and base.symbolic.declared.states == with_it.symbolic.declared.states:
        starts = kind.initial_states(final.candidates, final.theta)
        channels = tuple(kind.noise)
        computed = kind.replay_of(channels)(base, np.array([[u.centre for u in kind.nuisances]]), starts)[0]
        missed[BASE] = [
            np.stack([run.channels[c] - y[: len(run.time)] for c, y in zip(channels, signals, strict=True)], 1)
            for run, signals in zip(kind.runs, computed, strict=True)
        ]
    sd = np.array([noise.sd for noise in kind.noise.values()])
    gap = [float(np.mean((e / sd) ** 2)) for e in next(iter(missed.values()))]
    return missed, sorted(np.argsort(np.nan_to_num(gap, nan=np.inf))[::-1][:4].tolist())


def draw_traces(judgement: Judgement, target: Path) -> bool:
    """Every channel of the runs that the base model misses most."""
    kind: Any = judgement.kind
    missed, worst_runs = find_worst_runs(judgement)
    channels = tuple(kind.noise)
    with drawing(target, width=1 + 3.2 * len(channels), height=1.0 + 1.9 * len(worst_runs)) as figure:
        axes = figure.subplots(len(worst_runs), len(channels), squeeze=False)
        for row, (line, k) in enumerate(zip(axes, worst_runs, strict=True)):
            run = kind.runs[k]
            for c, (axis, name) in enumerate(zip(line, channels, strict=True)):
                measured = run.channels[name]
                computed = {title: measured - gaps[k][:, c] for title, gaps in missed.items()}
                axis.plot(run.time, measured, color=GREY, linestyle="none", marker=".", markersize=3, label="measured")
                for number, (title, y) in enumerate(computed.items()):
                    axis.plot(run.time, y, label=title, **{**look(number).plot, "marker": "", "linewidth": 1.3})
                _frame(axis, measured, computed)
                axis.set_title(f"{run.name}, {run.speed:.3g} m/s" if not c else "")
                axis.set_ylabel(name)
                if row == len(worst_runs) - 1:
                    axis.set_xlabel("time, s")
        legend_above(figure, axes[0, 0], columns=4)
    return True


def _frame(axis: Any, measured: Array, computed: Mapping[str, Array]) -> None:
    """Frame the measured values, and state the range of lines that leave the frame."""
    room = 0.15 * (float(np.ptp(measured)) or 1.0)
    low, high = measured.min() - room, measured.max() + room
    axis.set_ylim(low, high)
    lines = [
        f"{title}: {y.min():.2g} .. {y.max():.2g}" for title, y in computed.items() if y.min() < low or y.max() > high
    ]
    if lines:
        text, behind = "\n".join(["outside the axis:", *lines]), {"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1}
        place = {"xycoords": "axes fraction", "va": "bottom", "bbox": behind}
        axis.annotate(text, (0.02, 0.03), fontsize="x-small", color=GREY, **place)


TRACES: Figure = (
    draw_traces,
    "Measured and computed signals of the runs with the largest misfit of the base model (at most 4). Fitted models "
    "start from their best-fitting state, the base model from that of the last of them (or its own, if states differ).",
)

# ---- frequency responses ----


def draw_bode(judgement: Judgement, target: Path) -> bool:
    """Gain and phase of three responses at three speeds, those that the base model misses most."""
    kind: Any = judgement.kind
    points = kind.points
    pairs = _find_largest(judgement, [(p.input, p.output) for p in points])
    speeds = sorted(_find_largest(judgement, [p.speed for p in points]))
    value, sd = np.array([p.value for p in points]), np.array([p.sd for p in points])
    models = {title: value - sd * (gap[::2] + 1j * gap[1::2]) for title, gap in residuals(judgement).items()}
    hertz = np.array([p.frequency for p in points])
    with drawing(target, width=1.2 + 3.0 * max(len(speeds), 2), height=1.0 + 3.3 * len(pairs)) as figure:
        axes = figure.subplots(2 * len(pairs), len(speeds), squeeze=False, sharex=True)
        full = None
        for row, pair in enumerate(pairs):
            first = next(p for p in points if (p.input, p.output) == pair)
            for place, v in enumerate(speeds):
                mask = np.array([(p.input, p.output) == pair and p.speed == v for p in points])
                gain, phase = axes[2 * row : 2 * row + 2, place]
                _draw_response(gain, phase, hertz[mask], value[mask], sd[mask], {t: h[mask] for t, h in models.items()})
                title = f"{first.channel}, {v:g} m/s"
                gain.set_title(title if mask.any() else f"{title}: not measured")
                full = gain if full is None and mask.any() else full
                if not place:
                    gain.set_ylabel(f"gain, {first.unit}")
                    phase.set_ylabel("phase, deg")
        for axis in axes[-1]:
            axis.set_xlabel("frequency, Hz")
            plain_ticks(axis.xaxis, 1.0, 2.0, 5.0)
        legend_above(figure, full, columns=4)
    return True


def _find_largest(judgement: Judgement, labels: list[Any]) -> list[Any]:
    """The three labels with the largest misfit per data point of the base model, in their first order."""
    squares = (judgement.nominal**2).reshape(-1, 2).sum(1)
    names = list(dict.fromkeys(labels))
    size = {name: squares[[label == name for label in labels]].mean() for name in names}
    largest = sorted(names, key=lambda name: -size[name])[:3]
    return [name for name in names if name in largest]


def _draw_response(gain: Any, phase: Any, hertz: Array, value: Complex, sd: Array, models: dict[str, Complex]) -> None:
    """Draw gain and phase of one response: measured ``value`` and ``sd`` (n,) at ``hertz`` (n,) Hz, and ``models``."""
    gain.set(xscale="log", yscale="log")
    plain_ticks(gain.yaxis, 1.0, 2.0, 5.0)
    if not len(hertz):
        return
    measured_phase = np.unwrap(np.angle(value))
    size = np.abs(value)
    most = 0.9 * size  # a logarithmic axis has no zero; beyond it the interval leaves the phase unknown
    sure = 1.96 * sd < most
    gain.errorbar(hertz, size, [np.minimum(1.96 * sd, most), 1.96 * sd], **MEASURED, label="measured, 95 %")
    interval = np.rad2deg(np.arcsin(1.96 * sd[sure] / size[sure]))
    phase.errorbar(hertz[sure], np.rad2deg(measured_phase[sure]), interval, **MEASURED)
    for k, (title, computed) in enumerate(models.items()):
        line = {**look(k).plot, "marker": ""}
        gain.plot(hertz, np.abs(computed), **line, label=title)
        turned = np.unwrap(np.angle(computed))
        turns = np.round(np.median(measured_phase - turned) / (2 * np.pi))
        turned += 2 * np.pi * turns  # on the turn of the measured one
        phase.plot(hertz, np.rad2deg(turned), **line)


BODE: Figure = (
    draw_bode,
    "Gain and phase, measured with 95 % intervals, and the models; the 3 responses and 3 speeds with the largest "
    "misfit of the base model. A phase is shown where the interval of its gain excludes zero.",
)
