"""Figures over the varied parameters: outputs of each bicycle, and the shares of parameters in their variance."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.reporting.plotting import drawing
from studies.sweep import variance_shares
from studies.sweep import varied as compared
from studies.sweep.figure_files import Drawn, wrap_lines
from studies.sweep.stored import Stored
from studies.sweep.varied import Stability, Varied
from tyre.ground.arrays import Array

MOST_POINTS, MOST_COLUMNS, MOST_LINES = 4000, 6, 5  # bicycles, parameters and outputs in the figure of pairs
STABLE, UNSTABLE, PLAIN = "#5f9ed1", "#c8462f", "#123a6b"


def draw_over_parameters(drawn: Drawn, at_speed: Stability | None) -> None:
    """Draw outputs over the varied parameters, stable and unstable bicycles apart, and shares of the variance."""
    stored = drawn.stored
    sampled, drawn.lacking["again"] = compared.sampled_parameters(stored)
    varied = [*compared.grid_parameters(stored), *sampled]
    if not varied:
        drawn.lacking["varied"] = True
        return
    stable = at_speed or compared.stability(stored, None)
    outputs = compared.targets(stored, stable)
    if stable is None:
        drawn.lacking["stability"] = True
    if not outputs:
        return
    tables, remarks, overlaps = _compute_shares(stored, varied, outputs, whole=not drawn.lacking["again"])
    if len(varied) == 1:
        drawn.lacking["others"] = varied[0].name
    elif not tables:
        drawn.lacking["shares"] = (variance_shares.LEAST, variance_shares.LEAST_OF_A_GRID)
    rank = np.max([table["first_order"] for table in tables.values()], axis=0) if tables else np.zeros(len(varied))
    _draw_pairs(drawn, [varied[k] for k in np.argsort(-rank, kind="stable")], outputs, stable, ranked=bool(tables))
    if tables and len(varied) > 1:
        _draw_shares(drawn, tables, remarks)
        drawn.lacking["split"] = list(overlaps)


def _compute_shares(
    stored: Stored, varied: list[Varied], outputs: dict[str, Array], *, whole: bool
) -> tuple[dict[str, pd.DataFrame], dict[str, str], dict[str, None]]:
    """Shares by label of the output, remarks on them, and among these the different ones on correlations."""
    tables, remarks, overlaps = dict[str, pd.DataFrame](), dict[str, str](), dict[str, None]()
    correlations = variance_shares.stated_correlations(stored.sweep.normals)
    stated_pairs = {pair[:2] for pair in correlations}
    possible = int(stored.possible.sum())
    for label, values in outputs.items():
        y = np.where(stored.possible, values, np.nan)
        table = variance_shares.shares(y, varied)
        if table.empty:
            continue
        has = np.isfinite(y)
        parts = [f"of the {has.sum()} of {possible} bicycles that have it"] if has.sum() < possible else []
        parts += [] if whole else ["the sampled parameters are missing"]
        pairs = correlations + [
            pair for pair in variance_shares.find_correlated(varied, has) if pair[:2] not in stated_pairs
        ]
        if pairs:
            words = ", ".join(f"{a} and {b} ({r:+.2f})" for a, b, r in pairs[:3])
            parts.append(f"correlated: {words}; their shares overlap and have no unique split")
            overlaps[parts[-1]] = None
        tables[label], remarks[label] = table, "; ".join(parts)
    return tables, remarks, overlaps


def _draw_pairs(
    drawn: Drawn, varied: list[Varied], outputs: dict[str, Array], stable: Stability | None, *, ranked: bool
) -> None:
    """Draw a panel for each output (rows) and parameter (columns), a point a bicycle; the numbers go to ``.csv``."""
    stored = drawn.stored
    drawn_parameters, rows = varied[:MOST_COLUMNS], list(outputs.items())[:MOST_LINES]
    shape, possible = stored.possible.shape, int(stored.possible.sum())
    places = np.flatnonzero(stored.possible)
    if len(places) > MOST_POINTS:
        places = np.sort(np.random.default_rng(0).choice(places, MOST_POINTS, replace=False))
    unstable = None if stable is None else np.broadcast_to(stable.growth > 0, shape).ravel()[places]
    columns: dict[str, Any] = {}
    width = max(1.5 + 1.9 * len(drawn_parameters), 6.5)
    with drawing(drawn.folder / "pairs", width=width, height=1.2 + 1.75 * len(rows)) as canvas:
        grid = canvas.subplots(len(rows), len(drawn_parameters), sharex="col", sharey="row", squeeze=False)
        for column, parameter in enumerate(drawn_parameters):
            columns[parameter.label] = np.broadcast_to(parameter.values, shape).ravel()[places]
            x, ticks = _numbers(parameter, columns[parameter.label])
            for axes, (label, values) in zip(grid[:, column], rows, strict=True):
                y = columns[label] = values.ravel()[places]
                _draw_points(axes, x, y, unstable)
            if ticks:
                grid[-1, column].set_xticks(range(len(ticks)), ticks, rotation=90 if len(ticks) > 3 else 20, fontsize=7)
            grid[-1, column].set_xlabel(wrap_lines(parameter.label, 24), fontsize=8)
        for axes, (label, values) in zip(grid[:, 0], rows, strict=True):
            axes.set_ylabel(wrap_lines(label, 22), fontsize=8)
            lost = int((~np.isfinite(values[stored.possible])).sum())
            words = f"{lost} of {possible} have none (crosses at the foot)" if lost else ""
            axes.annotate(words, (0, 1.02), xycoords="axes fraction", fontsize=7, color="0.35")
        if stable is not None:
            canvas.legend(handles=_legend(grid[0, 0], stable), loc="outside lower center", ncols=2)
        fewer = f"; a random {len(places)} of them drawn" if len(places) < possible else ""
        title = [f"Outputs over the varied parameters, {stored.whose}{fewer}"]
        if len(varied) > len(drawn_parameters):
            largest = f"the {len(drawn_parameters)} parameters with the largest shares of {len(varied)}"
            title.append(largest if ranked else f"the first {len(drawn_parameters)} of {len(varied)} parameters")
        if len(outputs) > len(rows):
            title.append(f"the first {len(rows)} of {len(outputs)} outputs")
        drawn.title(canvas, "pairs", "\n".join(title), width - 0.4)
        drawn.figures["pairs"] = "; ".join(title)
    if unstable is not None:
        columns["unstable"] = unstable.astype(int)
    drawn.table("pairs", columns)


def _numbers(parameter: Varied, values: Any) -> tuple[Array, list[str]]:
    """Places along an axis, and the ticks of names."""
    if not parameter.named:
        return np.asarray(values, float), []
    names, place = np.unique(values, return_inverse=True)
    return place.astype(float), [Path(str(name)).name for name in names]


def _draw_points(axes: Any, x: Array, y: Array, unstable: Any) -> None:
    size = 14 if len(x) < 300 else 5 if len(x) < 2000 else 3
    finite, many = np.isfinite(y), len(x) > 1000
    groups = [(finite, PLAIN)] if unstable is None else [(finite & ~unstable, STABLE), (finite & unstable, UNSTABLE)]
    for chosen, colour in groups:
        axes.scatter(x[chosen], y[chosen], s=size, color=colour, linewidths=0, alpha=0.75, rasterized=many)
    if not finite.all():
        axes.plot(
            x[~finite],
            np.full((~finite).sum(), 0.03),
            "x",
            color="0.45",
            markersize=3,
            markeredgewidth=0.7,
            transform=axes.get_xaxis_transform(),
            alpha=0.7,
            rasterized=many,
        )
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=4)
    if finite.any():
        axes.ticklabel_format(axis="y", useOffset=False)


def _legend(axes: Any, stable: Stability) -> list[Any]:
    share = 100 * float(np.mean(stable.growth[np.isfinite(stable.growth)] > 0))
    anew = ", recomputed" if stable.anew else ""
    style: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 5}
    labels = {STABLE: f"stable {stable.where}", UNSTABLE: f"unstable {stable.where} ({share:.3g} % unstable{anew})"}
    return [axes.plot([], [], color=colour, label=label, **style)[0] for colour, label in labels.items()]


def _draw_shares(drawn: Drawn, shares: dict[str, pd.DataFrame], remarks: dict[str, str]) -> None:
    """Draw bars of the first-order indices by label of the output, a mark for the total one; numbers in ``.csv``."""
    name, whose = "variance_shares", drawn.stored.whose
    drawn_shares = dict(list(shares.items())[: 2 * MOST_LINES])
    columns = 1 if len(drawn_shares) == 1 else 2
    lines, most = -(-len(drawn_shares) // columns), max(map(len, drawn_shares.values()))
    rings = any(table["total"].notna().any() for table in drawn_shares.values())
    how = "lines: 95 % interval (bootstrap)" if drawn.stored.samples > 1 else "each combination counting the same"
    title = f"Which parameter matters, {whose}\nbars: first-order share of the variance, {how}"
    title += ", rings: total share" if rings else ""
    numbers = {
        text: k for k, text in enumerate(dict.fromkeys(remarks[label] for label in drawn_shares if remarks[label]), 1)
    }
    notes = "\n".join(wrap_lines(f"note {k}: {text}", 66 * columns) for text, k in numbers.items())
    height = lines * (0.26 * most + 1.25) + 1.0 + 0.16 * len(notes.splitlines())
    with drawing(drawn.folder / name, width=5.2 * columns + 0.6, height=height) as canvas:
        grid = canvas.subplots(lines, columns, squeeze=False)
        for axes in list(grid.flat)[len(drawn_shares) :]:
            axes.set_visible(False)
        for axes, (label, table) in zip(grid.flat, drawn_shares.items(), strict=False):
            _draw_share_bars(axes, table)
            note = f" (note {numbers[remarks[label]]})" if remarks[label] else ""
            axes.set_title(f"{label}\nsum of the bars {table['first_order'].sum():.2f}{note}", fontsize=8.5)
        drawn.title(canvas, name, title, 5.2 * columns + 0.2)
        drawn.figures[name] = f"Shares of the variance of {len(shares)} outputs, {whose}"
        if notes:
            canvas.supxlabel(notes, x=0.01, ha="left", fontsize=8)
    tables = [
        table.assign(output=label, sum_first_order=table["first_order"].sum(), remark=remarks[label])
        for label, table in shares.items()
    ]
    order = ["output", "parameter", "first_order", "half_width_95", "total", "sum_first_order", "remark"]
    drawn.table(name, [table[order] for table in tables])


def _draw_share_bars(axes: Any, table: pd.DataFrame) -> None:
    ordered, place = table.sort_values("first_order", kind="stable"), np.arange(len(table))
    width, spread, totals = ordered["first_order"].clip(lower=0), ordered["half_width_95"], ordered["total"]
    axes.barh(place, width, color=STABLE, height=0.65)
    if spread.any():
        axes.errorbar(ordered["first_order"], place, xerr=spread, fmt="none", ecolor="0.2", elinewidth=1)
    axes.plot(totals, place, "o", markerfacecolor="none", color=UNSTABLE)
    axes.axvline(0, color="0.2", linewidth=0.8)
    axes.set_yticks(place, ordered["parameter"], fontsize=7.5)
    axes.set_xlim(-0.1, max(1.02, 1.05 * np.nanmax([*(width + spread), *totals])))
    axes.set_xlabel("Share of the variance", fontsize=8)
