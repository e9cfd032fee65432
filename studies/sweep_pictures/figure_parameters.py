"""Against the parameters: outputs over each that was varied, stable and unstable, and the shares of their variance."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.reporting.output import write_csv
from studies.reporting.plotting import drawing
from studies.sweep_pictures.shares import Share
from studies.sweep_pictures.stored import Stored, wrapped
from studies.sweep_pictures.targets import Stability, Target
from studies.sweep_pictures.varied import Varied
from tyre.base.arrays import Array

MOST_POINTS = 4000
MOST_COLUMNS, MOST_ROWS = 6, 5
STABLE, UNSTABLE, PLAIN = "#5f9ed1", "#c8462f", "#123a6b"


def draw_pairs(
    stored: Stored, target: Path, varied: Sequence[Varied], outputs: Sequence[Target], stable: Stability | None,
    *, ranked: bool = False,
) -> str:  # fmt: skip
    """A panel for each output and parameter, a point a bicycle; returns what is to be seen.

    Parameters
    ----------
    stored : Stored
    target : Path
        Without ending; the numbers go to ``.csv``.
    varied : sequence of Varied
        In the order of the columns.
    outputs : sequence of Target
        In the order of the rows.
    stable : Stability or None
        Colours the points.
    ranked : bool
        The parameters stand in the order of their shares of the variance.
    """
    shown, rows = list(varied)[:MOST_COLUMNS], list(outputs)[:MOST_ROWS]
    shape = stored.possible.shape
    places = np.flatnonzero(stored.possible)
    if len(places) > MOST_POINTS:
        places = np.sort(np.random.default_rng(0).choice(places, MOST_POINTS, replace=False))
    unstable = None if stable is None else np.broadcast_to(stable.unstable, shape).ravel()[places]
    columns: dict[str, Any] = {}
    width = max(1.5 + 1.9 * len(shown), 6.5)
    with drawing(target, width=width, height=1.2 + 1.75 * len(rows)) as canvas:
        grid = canvas.subplots(len(rows), len(shown), sharex="col", sharey="row", squeeze=False)
        for column, one in enumerate(shown):
            x, ticks = _places(one, shape, places)
            columns[one.label] = np.broadcast_to(one.values, shape).ravel()[places]
            for line, output in enumerate(rows):
                y = output.values.ravel()[places]
                columns[output.label] = y
                _points(grid[line, column], x, y, unstable)
                if column == 0:
                    grid[line, column].set_ylabel(wrapped(output.label, 22), fontsize=8)
            if ticks:
                grid[-1, column].set_xticks(range(len(ticks)), ticks, rotation=90 if len(ticks) > 3 else 20, fontsize=7)
            grid[-1, column].set_xlabel(wrapped(one.label, 24), fontsize=8)
        for line, output in enumerate(rows):
            lost = int((~np.isfinite(output.values[stored.possible])).sum())
            if lost:
                words = f"{lost} of {int(stored.possible.sum())} have none (crosses at the foot)"
                grid[line, 0].annotate(words, (0, 1.02), xycoords="axes fraction", fontsize=7, color="0.35")
        handles = _legend(grid[0, 0], stable)
        if handles:
            canvas.legend(handles=handles, loc="outside lower center", ncols=2)
        title = f"Outputs over the varied parameters, {stored.whose}"
        title += f"; a random {len(places)} of them drawn" if len(places) < stored.possible.sum() else ""
        if len(varied) > len(shown):
            words = f"the {len(shown)} parameters with the largest shares of {len(varied)}"
            title += f"\n{words if ranked else f'the first {len(shown)} of {len(varied)} parameters'}"
        if len(outputs) > len(rows):
            title += f"\nthe first {len(rows)} of {len(outputs)} outputs"
        canvas.suptitle(stored.title(title, width - 0.4), x=0.01, ha="left", fontsize=9.5)
    if unstable is not None:
        columns["unstable"] = unstable.astype(int)
    write_csv(pd.DataFrame(columns), target.with_name(f"{target.name}.csv"))
    return title.replace("\n", "; ")


def _places(one: Varied, shape: tuple[int, ...], places: Any) -> tuple[Array, list[str]]:
    values = np.broadcast_to(one.values, shape).ravel()[places]
    if not one.named:
        return np.asarray(values, float), []
    names, place = np.unique(values, return_inverse=True)
    return place.astype(float), [Path(str(name)).name for name in names]


def _points(axes: Any, x: Array, y: Array, unstable: Any) -> None:
    size = 14 if len(x) < 300 else 5 if len(x) < 2000 else 3
    known = np.isfinite(y)
    groups = [(known, PLAIN)] if unstable is None else [(known & ~unstable, STABLE), (known & unstable, UNSTABLE)]
    for chosen, colour in groups:
        axes.scatter(x[chosen], y[chosen], s=size, color=colour, linewidths=0, alpha=0.75, rasterized=len(x) > 1000)
    if not known.all():
        axes.plot(
            x[~known], np.full((~known).sum(), 0.03), "x", color="0.45", markersize=3, markeredgewidth=0.7,
            transform=axes.get_xaxis_transform(), alpha=0.7, rasterized=len(x) > 1000,
        )  # fmt: skip
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=4)
    axes.ticklabel_format(axis="y", useOffset=False) if known.any() else None


def _legend(axes: Any, stable: Stability | None) -> list[Any]:
    if stable is None:
        return []
    share = float(np.mean(stable.unstable[np.isfinite(stable.growth)]))
    words = f"{stable.words} ({100 * share:.3g} % unstable{', computed anew' if stable.anew else ''})"
    style: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 5}
    return [
        axes.plot([], [], color=STABLE, label=f"stable {stable.words}", **style)[0],
        axes.plot([], [], color=UNSTABLE, label=f"unstable {words}", **style)[0],
    ]


def draw_shares(stored: Stored, target: Path, found: Mapping[str, Sequence[Share]], remarks: Mapping[str, str]) -> str:
    """Bars of the first-order indices of each parameter, with a mark for the total one; returns what is to be seen.

    Parameters
    ----------
    stored : Stored
    target : Path
        Without ending; the numbers go to ``.csv``.
    found : mapping of str to sequence of Share
        By label of the output.
    remarks : mapping of str to str
        What must be said beside, likewise.
    """
    shown = dict(list(found.items())[: 2 * MOST_ROWS])
    columns = 1 if len(shown) == 1 else 2
    lines = -(-len(shown) // columns)
    most = max(len(one) for one in shown.values())
    how = "bars: first-order share of the variance"
    how += ", lines: 95 % interval (bootstrap)" if stored.samples > 1 else ", each combination counting the same"
    if any(np.isfinite(share.total) for one in shown.values() for share in one):
        how += ", rings: total share"
    title = stored.title(f"Which parameter matters, {stored.whose}\n{how}", 5.2 * columns + 0.2)
    texts = dict.fromkeys(remarks[label] for label in shown if remarks.get(label))
    numbers = {text: k for k, text in enumerate(texts, 1)}
    notes = "\n".join(wrapped(f"note {k}: {text}", 66 * columns) for text, k in numbers.items())
    height = lines * (0.26 * most + 1.25) + 1.0 + 0.16 * len(notes.splitlines())
    with drawing(target, width=5.2 * columns + 0.6, height=height) as canvas:
        grid = canvas.subplots(lines, columns, squeeze=False)
        for axes in list(grid.flat)[len(shown) :]:
            axes.set_visible(False)
        for axes, (label, every) in zip(grid.flat, shown.items(), strict=False):
            _share_bars(axes, every)
            note = f" (note {numbers[remarks[label]]})" if remarks.get(label) else ""
            axes.set_title(f"{label}\nsum of the bars {sum(one.first for one in every):.2f}{note}", fontsize=8.5)
        canvas.suptitle(title, x=0.01, ha="left", fontsize=9.5)
        if notes:
            canvas.supxlabel(notes, x=0.01, ha="left", fontsize=8)
    rows = [
        {"output": label, "parameter": one.name, "first_order": one.first, "half_width_95": one.half_width,
         "total": one.total, "sum_first_order": sum(other.first for other in every), "remark": remarks.get(label, "")}
        for label, every in found.items() for one in every
    ]  # fmt: skip
    write_csv(pd.DataFrame(rows), target.with_name(f"{target.name}.csv"))
    return f"Shares of the variance of {len(found)} output{'s' * (len(found) > 1)}, {stored.whose}"


def _share_bars(axes: Any, every: Sequence[Share]) -> None:
    ordered = sorted(every, key=lambda one: one.first)
    place = np.arange(len(ordered))
    width = [max(one.first, 0.0) for one in ordered]
    axes.barh(place, width, color="#5f9ed1", height=0.65)
    spread = [one.half_width for one in ordered]
    if any(spread):
        axes.errorbar([one.first for one in ordered], place, xerr=spread, fmt="none", ecolor="0.2", elinewidth=1)
    totals = [one.total for one in ordered]
    if np.isfinite(totals).any():
        axes.plot(totals, place, "o", markerfacecolor="none", color="#c8462f")
    axes.axvline(0, color="0.2", linewidth=0.8)
    axes.set_yticks(place, [one.name for one in ordered], fontsize=7.5)
    largest = max([a + b for a, b in zip(width, spread, strict=True)] + [t for t in totals if np.isfinite(t)])
    axes.set_xlim(-0.1, max(1.02, 1.05 * largest))
    axes.set_xlabel("Share of the variance", fontsize=8)
