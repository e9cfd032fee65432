"""Figures of a diagnosis: the gap, measured values with the models, posterior, similarity, held-out scores."""

from collections.abc import Mapping
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from studies.diagnosis.labels import BASE, fate, probability, said, titles
from studies.inference.judge import Judgement
from studies.inference.kind import Candidates, Figure, Rows
from studies.reporting.plotting import GREY, drawing, look
from tyre.arrays import Array, Complex

MOST_SERIES = 8  # panels; of more, the residuals are summed by channel
MEASURED: dict[str, Any] = {"fmt": "o", "color": "k", "ecolor": GREY, "markersize": 3, "elinewidth": 0.8}


def draw_all(diagnosis: Judgement, folder: Path) -> dict[str, str]:
    """Draw every figure of a ``diagnosis`` into ``folder``; returns name -> caption of those that there are."""
    captions = {}
    for name, (draw, caption) in {**diagnosis.kind.figures(), **OF_ALL}.items():
        if draw(diagnosis, folder / name):
            captions[name] = caption
    return captions


def residuals(judgement: Judgement) -> dict[str, Array]:
    """Whitened residuals (n,) of the models of a ``judgement`` that differ, by title."""
    every = {
        "nominal": judgement.nominal, "nuisance_only": judgement.hypotheses.null.residual,
        "final": judgement.final.residual,
    }  # fmt: skip
    return {title: every[model] for model, title in titles(judgement).items()}


def models_of(judgement: Judgement) -> dict[str, tuple[Candidates, Array]]:
    """Candidates and coordinates of the models of a ``judgement`` that differ, by title."""
    null, final = judgement.hypotheses.null, judgement.final
    nominal = np.array([u.centre for u in judgement.kind.nuisances])
    every = {"nominal": ((), nominal), "nuisance_only": ((), null.theta), "final": (final.candidates, final.theta)}
    return {title: every[model] for model, title in titles(judgement).items()}


def panels(figure: Any, count: int) -> Any:
    """A number ``count`` of axes in two columns of a matplotlib ``figure``."""
    columns = 1 if count == 1 else 2
    axes = figure.subplots(-(-count // columns), columns, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.remove()
    return axes[:count]


def legend_above(figure: Any, axis: Any, *, columns: int) -> None:
    """One legend for a whole ``figure``, of the curves of one ``axis``."""
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=columns)


def plain_ticks(axis: Any, *places: float) -> None:
    """Plain numbers at these places of every decade of a logarithmic ``axis``."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=places))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())  # its labels overlap on a short axis


# ---- the gap ----


def shown_series(judgement: Judgement) -> list[str]:
    """Series whose residuals are shown one by one; empty if they are summed by channel."""
    rows = judgement.kind.rows
    names = list(dict.fromkeys(rows.series))
    series = np.array(rows.series)
    samples = max(int(np.unique(rows.abscissa[series == name], return_counts=True)[1].max()) for name in names)
    if rows.one_axis and (len(names) > MOST_SERIES or samples > 10):  # more rows at one place are samples
        return []
    if not rows.condition and not rows.one_axis:  # recordings: those with the largest gap
        names = sorted(names, key=lambda name: -float((judgement.nominal[series == name] ** 2).mean()))[:MOST_SERIES]
    return names


def rms_by_channel(judgement: Judgement) -> dict[str, tuple[list[float], dict[str, list[float]]]]:
    """Channel -> places on the abscissa, and the rms there of the residual of each model."""
    rows, found = judgement.kind.rows, {}
    channel = rows.channels
    for name in dict.fromkeys(channel.tolist()):
        places = np.unique(rows.abscissa[channel == name]).tolist()
        here = [(channel == name) & (rows.abscissa == x) for x in places]
        rms = {
            title: [float(np.sqrt((gap[inside] ** 2).mean())) for inside in here]
            for title, gap in residuals(judgement).items()
        }
        found[name] = (places, rms)
    return found


def draw_gap(judgement: Judgement, target: Path) -> bool:
    """Residuals of each series, or the rms of each channel over speed if there are too many samples to show."""
    rows = judgement.kind.rows
    names, series = shown_series(judgement), np.array(rows.series)
    channels = {} if names else rms_by_channel(judgement)
    with drawing(target, width=8, height=1.2 + 2.3 * -(-len(names or channels) // 2)) as figure:
        for axis, name in zip(panels(figure, len(names or channels)), names or channels, strict=True):
            if names:
                here = series == name
                axis.axhspan(-2, 2, color="0.92", zorder=0)
                for k, (title, gap) in enumerate(residuals(judgement).items()):
                    style = {**look(k).plot, "linestyle": "none", "markersize": 4}
                    axis.plot(rows.abscissa[here], gap[here], label=title, **style)
                axis.set(title=name, ylabel="gap / sd")
                _label_abscissa(axis, rows, name)
                continue
            places, values = channels[name]
            axis.axhline(1, color="k", linestyle=":", linewidth=1)
            for k, (title, rms) in enumerate(values.items()):
                axis.plot(places, rms, label=title, **look(k).plot)
            axis.set(title=name, xlabel=rows.axis, ylabel="rms gap / sd", yscale="log")
            plain_ticks(axis.yaxis, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
        legend_above(figure, axis, columns=3)
    return True


def draw_before_after(judgement: Judgement, target: Path) -> bool:
    """Measured values with 95 % intervals and the models."""
    rows = judgement.kind.rows
    names, series = list(dict.fromkeys(rows.series)), np.array(rows.series)
    measured, sd = judgement.kind.data
    with drawing(target, width=8, height=1.2 + 2.5 * -(-len(names) // 2)) as figure:
        for axis, name in zip(panels(figure, len(names)), names, strict=True):
            here = np.flatnonzero(series == name)
            here = here[np.argsort(rows.abscissa[here])]
            axis.errorbar(rows.abscissa[here], measured[here], 1.96 * sd[here], **MEASURED, label="measured, 95 %")
            for k, (title, gap) in enumerate(residuals(judgement).items()):
                computed = measured[here] - sd[here] * gap[here]
                style = {"linestyle": "none", "markersize": 4} if rows.condition else {"marker": ""}
                axis.plot(rows.abscissa[here], computed, **{**look(k).plot, **style}, label=title)
            axis.set(title=rows.show(name).channel, ylabel=rows.show(name).quantity)
            _label_abscissa(axis, rows, name)
        legend_above(figure, axis, columns=4)
    return True


def _label_abscissa(axis: Any, rows: Rows, series: str) -> None:
    if not rows.condition:
        axis.set_xlabel(rows.show(series).axis or rows.axis)
        return
    crowded = sum(map(len, rows.condition)) > 40  # letters
    turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
    axis.set_xticks(range(len(rows.condition)), rows.condition, fontsize=8, **turned)
    axis.set_xlim(-0.5, len(rows.condition) - 0.5)
    axis.grid(visible=False, axis="x")


GAP: Figure = (
    draw_gap,
    "Where the gap is: (measured − computed) / sd. Noise alone stays within the grey band (±2); where a panel has the "
    "root mean square of many samples in its place, near the dotted line (1).",
)
BEFORE_AFTER: Figure = (draw_before_after, "Measured values with 95 % intervals, and the models.")

# ---- time histories ----


def missed_most(judgement: Judgement) -> tuple[dict[str, list[Array]], list[int]]:
    """Measured less computed signals of each model and run (samples, channels), and the four runs missed most."""
    kind: Any = judgement.kind
    missed = {title: kind.left(*model) for title, model in models_of(judgement).items()}
    sd = np.array([noise.sd for noise in kind.noise.values()])
    gap = [float(np.mean((e / sd) ** 2)) for e in next(iter(missed.values()))]
    return missed, sorted(np.argsort(np.nan_to_num(gap, nan=np.inf))[::-1][:4].tolist())


def draw_traces(judgement: Judgement, target: Path) -> bool:
    """Every channel of the runs that the base model misses most."""
    kind: Any = judgement.kind
    missed, shown = missed_most(judgement)
    channels = tuple(kind.noise)
    with drawing(target, width=1 + 3.2 * len(channels), height=1.0 + 1.9 * len(shown)) as figure:
        axes = figure.subplots(len(shown), len(channels), squeeze=False)
        for row, (line, k) in enumerate(zip(axes, shown, strict=True)):
            run = kind.runs[k]
            for c, (axis, name) in enumerate(zip(line, channels, strict=True)):
                seen = run.channels[name]
                computed = {title: seen - rest[k][:, c] for title, rest in missed.items()}
                axis.plot(run.time, seen, color=GREY, linestyle="none", marker=".", markersize=3, label="measured")
                for number, (title, y) in enumerate(computed.items()):
                    axis.plot(run.time, y, label=title, **{**look(number).plot, "marker": "", "linewidth": 1.3})
                _frame(axis, seen, computed)
                axis.set_title(f"{run.name}, {run.speed:.3g} m/s" if not c else "")
                axis.set_ylabel(name)
                if row == len(shown) - 1:
                    axis.set_xlabel("time, s")
        legend_above(figure, axes[0, 0], columns=4)
    return True


def _frame(axis: Any, seen: Array, computed: Mapping[str, Array]) -> None:
    """Frame the measured values, and tell in numbers how far lines go that leave it."""
    room = 0.15 * (float(np.ptp(seen)) or 1.0)
    low, high = seen.min() - room, seen.max() + room
    axis.set_ylim(low, high)
    lines = [
        f"{title}: {y.min():.2g} .. {y.max():.2g}" for title, y in computed.items() if y.min() < low or y.max() > high
    ]
    if lines:
        text = "\n".join(["beyond the frame:", *lines])
        axis.annotate(text, (0.02, 0.03), xycoords="axes fraction", fontsize="x-small", color=GREY, va="bottom")


TRACES: Figure = (
    draw_traces,
    "Measured and computed signals of the runs that the base model misses most (at most 4); the computed ones start "
    "where they fit best.",
)

# ---- frequency responses ----


def draw_bode(judgement: Judgement, target: Path) -> bool:
    """Gain and phase of three responses at three speeds, those that the base model misses most."""
    kind: Any = judgement.kind
    points = kind.points
    pairs = _largest(judgement, [(p.input, p.output) for p in points])
    speeds = sorted(_largest(judgement, [p.speed for p in points]))
    value, sd = np.array([p.value for p in points]), np.array([p.sd for p in points])
    models = {title: value - sd * (gap[::2] + 1j * gap[1::2]) for title, gap in residuals(judgement).items()}
    hertz = np.array([p.frequency for p in points])
    with drawing(target, width=1.2 + 3.0 * max(len(speeds), 2), height=1.0 + 3.3 * len(pairs)) as figure:
        axes = figure.subplots(2 * len(pairs), len(speeds), squeeze=False, sharex=True)
        full = None
        for row, pair in enumerate(pairs):
            first = next(p for p in points if (p.input, p.output) == pair)
            for place, v in enumerate(speeds):
                here = np.array([(p.input, p.output) == pair and p.speed == v for p in points])
                gain, phase = axes[2 * row : 2 * row + 2, place]
                _draw_response(gain, phase, hertz[here], value[here], sd[here], {t: h[here] for t, h in models.items()})
                title = f"{first.channel}, {v:g} m/s"
                gain.set_title(title if here.any() else f"{title}: not measured")
                full = gain if full is None and here.any() else full
                if not place:
                    gain.set_ylabel(f"gain, {first.unit}")
                    phase.set_ylabel("phase, deg")
        for axis in axes[-1]:
            axis.set_xlabel("frequency, Hz")
            plain_ticks(axis.xaxis, 1.0, 2.0, 5.0)
        legend_above(figure, full, columns=4)
    return True


def _largest(judgement: Judgement, labels: list[Any]) -> list[Any]:
    """The three labels with the largest gap a number of the base model, in their first order."""
    gap = (judgement.nominal**2).reshape(-1, 2).sum(1)
    names = list(dict.fromkeys(labels))
    size = {name: gap[[label == name for label in labels]].mean() for name in names}
    kept = sorted(names, key=lambda name: -size[name])[:3]
    return [name for name in names if name in kept]


def _draw_response(gain: Any, phase: Any, hertz: Array, value: Complex, sd: Array, models: dict[str, Complex]) -> None:
    gain.set(xscale="log", yscale="log")
    plain_ticks(gain.yaxis, 1.0, 2.0, 5.0)
    if not len(hertz):
        return
    seen, size = np.unwrap(np.angle(value)), np.abs(value)
    most = 0.9 * size  # a logarithmic axis has no zero; beyond it the interval leaves the phase unknown
    sure = 1.96 * sd < most
    gain.errorbar(hertz, size, [np.minimum(1.96 * sd, most), 1.96 * sd], **MEASURED, label="measured, 95 %")
    interval = np.rad2deg(np.arcsin(1.96 * sd[sure] / size[sure]))
    phase.errorbar(hertz[sure], np.rad2deg(seen[sure]), interval, **MEASURED)
    for k, (title, computed) in enumerate(models.items()):
        line = {**look(k).plot, "marker": ""}
        gain.plot(hertz, np.abs(computed), **line, label=title)
        turned = np.unwrap(np.angle(computed))
        turned += 2 * np.pi * np.round(np.median(seen - turned) / (2 * np.pi))  # on the turn of the measured one
        phase.plot(hertz, np.rad2deg(turned), **line)


BODE: Figure = (
    draw_bode,
    "Gain and phase, measured with 95 % intervals, and the models; at most 3 responses and 3 speeds, those that the "
    "base model misses most. Where the interval of a gain reaches down to zero its phase is not known and not shown.",
)

# ---- hypotheses ----

LEAST, MOST_BARS = 1e-6, 12  # probability that is drawn


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
            reason = what if len(what) < 46 else f"{what[:46]}..."
            text = f" {probability(share)}{f'  ({reason})' if reason else ''}"
            axis.text(max(share, LEAST), place, fill(text, 44, subsequent_indent=" "), va="center", fontsize=8)
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
    n = len(judgement.nominal)
    values = {BASE: float(judgement.nominal @ judgement.nominal) / n}
    values |= {title: judgement.held_out[model].chi2 / n for model, title in list(titles(judgement).items())[1:]}
    with drawing(target, width=6, height=1.3 + 0.3 * len(values)) as figure:
        axis = figure.subplots()
        colours = [look(k).colour for k in range(len(values))]
        bars = axis.barh(list(values)[::-1], list(values.values())[::-1], color=colours[::-1])
        axis.bar_label(bars, [f"{value:.3g}" for value in list(values.values())[::-1]], padding=3, fontsize=8)
        axis.axvline(1, color="k", linestyle=":", linewidth=1)
        low, high = min(0.3, 0.5 * min(values.values())), 3 * max(values.values()) + 1
        axis.set(xscale="log", xlabel="χ²/n on held-out data", xlim=(low, high))
        plain_ticks(axis.xaxis, *((1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
        axis.grid(visible=False, axis="y")
    return True


OF_ALL: dict[str, Figure] = {
    "posterior": (
        _posterior,
        "Probability of each hypothesis, relative to this library, on a logarithmic axis down to one in a million. "
        "Dark: named or explaining the data; light: cannot be told from it; hatched: refused, with the rule it fails.",
    ),
    "similarity": (_similarity, "|cosine| of what two effects do to the data, parameters marginalised."),
    "held_out": (_held_out, "χ²/n on data left out of the fit; 1 is noise alone."),
}
