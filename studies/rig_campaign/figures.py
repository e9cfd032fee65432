"""Figures of a campaign: carpet plot, stiffnesses over load, flat against drum, single recordings, repeats."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from studies.reporting.plotting import settle
from tyre.fits.campaign import Campaign, points_of
from tyre.fits.condition import ConditionResult, RecordingSummary, keep_upright
from tyre.fits.sweep_curve import magic_formula
from tyre.ground.files import replacing, slugs
from tyre.ground.units import PASCAL_PER_BAR
from tyre.recordings.recording import Channel

COLOURS = ("#08306b", "#c0392b", "#e8a33d", "#2a7f62", "#7d5ba6", "#555555")  # dark to light, told apart in grey
MARKERS = ("o", "s", "^", "D", "v", "P")
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
Pair = tuple[ConditionResult, ConditionResult]


def save_figures(campaign: Campaign, folder: Path, *, every_recording: bool = False) -> list[Path]:
    """Draw all figures that the data of a campaign allow as PNG into ``folder``, which is made if missing."""
    sweeps = [item for c in campaign.conditions for item in c.sweeps]
    pulls = [item for c in campaign.conditions for item in c.pulls]
    with mpl.rc_context({"font.size": 9.0, "axes.grid": True, "grid.alpha": 0.3, "figure.dpi": 130}):
        drawn: dict[str, Figure] = {}
        for tyre, stem in slugs(sorted({c.tyre for c in campaign.conditions})).items():
            of_tyre = [c for c in keep_upright(campaign.conditions) if c.tyre == tyre]
            for surface in sorted({c.surface for c in of_tyre}, reverse=True):
                chosen = [c for c in of_tyre if c.surface == surface and c.sweeps]
                drawn |= {f"carpet_{stem}_{surface}": carpet(chosen)} if chosen else {}
                leaning = [c for c in campaign.conditions if (c.tyre, c.surface) == (tyre, surface)]
                if any(c.camber_stiffness for c in leaning):
                    drawn[f"camber_{stem}_{surface}"] = over_camber(leaning)
            drawn[f"stiffness_{stem}"] = stiffness_over_load(of_tyre)
            pairs = surface_pairs(of_tyre)
            drawn |= {f"flat_drum_{stem}": flat_against_drum(campaign, tyre, pairs)} if pairs else {}
        for name, items in (("residuals_worst_sweep", sweeps), ("pull_worst", pulls)):
            worst = min(items, key=lambda item: (item.r_squared, item.file), default=None)
            drawn |= {name: residuals(worst)} if worst and points_of(worst) else {}
        if campaign.sweep_repeatability.measured or campaign.pull_repeatability.measured:
            drawn["repeatability"] = repeats(campaign)
        if every_recording:
            of_file = {item.file: item for item in (*sweeps, *pulls)}
            drawn |= {f"residuals/{stem}": residuals(of_file[file]) for file, stem in slugs(of_file).items()}
        return [_save(figure, folder / f"{name}.png") for name, figure in drawn.items()]


def _save(figure: Figure, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    settle(figure)
    with replacing(path) as part:
        figure.savefig(part)
    return path


def _empty_figure(rows: int, columns: int, *, width: float, height: float, **shared: Any) -> tuple[Figure, list[Any]]:
    """Make a figure without a window, in inches, and its panels in one list."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **shared).flat)


def _add_title(figure: Figure, text: str, source: ConditionResult | RecordingSummary, legend: Any = None) -> Figure:
    """Put a title above a figure, and below it the legend of one of its panels, if that has any."""
    handles, labels = legend.get_legend_handles_labels() if legend else ([], [])
    if handles:
        columns = min(int(figure.get_figwidth() / 1.6), len(labels))  # inches an entry takes
        figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8)
    note = "\nSYNTHETIC: from the rig simulator, not measured" if source.synthetic else ""
    figure.suptitle(text + note, fontsize=10)
    return figure


def _style(number: int) -> dict[str, Any]:
    """Colour, marker and line of series number ``number``; after six they repeat."""
    return {"color": COLOURS[number % 6], "marker": MARKERS[number % 6], "ls": DASHES[number % 6]}


def _loads_pressures(conditions: Sequence[ConditionResult]) -> tuple[list[float], list[float]]:
    return sorted({c.load for c in conditions}), sorted({c.pressure for c in conditions})


def _sweep_curve(summary: RecordingSummary, slip: Channel, *, offsets: bool = True) -> Channel:
    """Fitted steady lateral force (N) of one sweep over ``slip`` (rad), with Sh and Sv or through the origin."""
    details = summary.details
    force, _ = magic_formula(
        slip=slip + (details["Sh_rad"] if offsets else 0.0),
        cornering_stiffness=details["curve_slope_N_per_rad"],
        peak=details["peak_N"],
        shape=details["shape"],
        curvature=details["curvature"],
    )
    return force + (details["Sv_N"] if offsets else 0.0)


def carpet(conditions: Sequence[ConditionResult], shift: float = 1.5) -> Figure:
    """Draw lateral force over slip and load of one tyre on one surface, one panel per pressure."""
    loads, pressures = _loads_pressures(conditions)
    figure, axes = _empty_figure(1, len(pressures), width=max(6.4, 2.9 * len(pressures)), height=4.2, sharey=True)
    points = [points_of(item) for c in conditions for item in c.sweeps]
    reach = max(
        np.rad2deg(np.abs(curve_points["slip_rad"]).max()) + 0.1 if curve_points else 4.0 for curve_points in points
    )
    slips = np.arange(0.0, min(4.0, reach) + 1e-6)
    fine = np.linspace(0.0, slips[-1], 60)
    top = 0.0
    for panel, pressure in zip(axes, pressures, strict=True):
        nodes = []
        for number, load in enumerate(loads):
            at_condition = [c for c in conditions if c.load == load and c.pressure == pressure]
            if not at_condition:
                continue
            force, at_slips = (
                np.mean(
                    [_sweep_curve(item, np.deg2rad(slip), offsets=False) for item in at_condition[0].sweeps], axis=0
                )
                for slip in (fine, slips)
            )
            panel.plot(fine + shift * number, force, **_style(number) | {"marker": "", "lw": 1.8}, label=f"{load:g} N")
            nodes.append((slips + shift * number, at_slips))
            top = max(top, float(force.max()))
        for index, slip in enumerate(slips):
            line = np.array([(x[index], y[index]) for x, y in nodes])
            panel.plot(line[:, 0], line[:, 1], color="0.45", lw=0.8, marker=".", ms=4)
            if slip > 0.0:
                panel.annotate(f"{slip:g}°", line[-1], (4, -3), textcoords="offset points", fontsize=7.5, color="0.25")
        panel.set(
            xlim=(-0.3, slips[-1] + shift * (len(loads) - 1) + 0.9),
            xticks=[],
            xlabel="Slip angle, shifted by load",
            title=f"{pressure / PASCAL_PER_BAR:g} bar",
        )
    axes[0].set(ylabel="Lateral force without offsets, N", ylim=(0.0, 1.12 * top))
    axes[0].legend(title="Vertical load", loc="upper left", fontsize=8)
    first = conditions[0]
    return _add_title(
        figure, f"{first.tyre}, {first.surface}: lateral force over slip (grey: constant slip) and load", first
    )


def stiffness_over_load(conditions: Sequence[ConditionResult]) -> Figure:
    """Draw C_alpha, K_y and sigma of one tyre over load, a line per pressure and surface, 95 % intervals."""
    figure, axes = _empty_figure(1, 3, width=10.5, height=4.4)
    quantities = (
        ("cornering_stiffness", "Cornering stiffness C_α, N/deg", np.pi / 180.0),
        ("lateral_stiffness", "Lateral stiffness K_y, N/mm", 1e-3),
        ("relaxation_length", "Relaxation length σ, mm", 1e3),
    )
    loads, pressures = _loads_pressures(conditions)
    surfaces, span = sorted({c.surface for c in conditions}, reverse=True), loads[-1] - loads[0] or 40.0
    for panel, (name, label, factor) in zip(axes, quantities, strict=True):
        for (row, surface), (number, pressure) in product(enumerate(surfaces), enumerate(pressures)):
            of_line = [c for c in conditions if (c.surface, c.pressure) == (surface, pressure) and getattr(c, name)]
            of_line = [c for c in of_line if name != "lateral_stiffness" or not c.borrowed_stiffness]
            of_line.sort(key=lambda c: c.load)
            if not of_line:
                continue
            # neighbouring lines are moved aside a little, so that their intervals do not hide each other
            x = np.array([c.load for c in of_line]) + span * 0.012 * (number + 3 * row - len(pressures) / 2.0)
            values = [getattr(c, name) for c in of_line]
            look = _style(number) | ({"ls": "-"} if surface == "flat" else {"ls": "--", "mfc": "white"})
            panel.errorbar(
                x,
                [factor * e.value for e in values],
                [factor * (e.ci95[1] - e.value) for e in values],
                **look,
                capsize=2.5,
                lw=1.2,
                ms=5,
                label=f"{pressure / PASCAL_PER_BAR:g} bar, {surface}",
            )
        panel.set(xlabel="Vertical load, N", ylabel=label)
        if len(loads) == 1:  # ticks of what was moved aside would be crowded hundredths of a newton
            panel.set(xticks=loads, xlim=(loads[0] - span / 2, loads[0] + span / 2))
    return _add_title(figure, f"{conditions[0].tyre}: values with 95 % intervals", conditions[0], legend=axes[0])


def over_camber(conditions: Sequence[ConditionResult]) -> Figure:
    """Draw lateral force and aligning moment at zero slip over camber, a line per load and pressure."""
    quantities = (
        ("force_at_zero{}_N", "Lateral force at zero slip, N"),
        ("moment_at_zero{}_N_m", "Aligning moment at zero slip, N m"),
    )
    measured = [q for q in quantities if any(q[0].format("") in item.details for c in conditions for item in c.sweeps)]
    figure, axes = _empty_figure(1, len(measured), width=4.6 * len(measured) + 0.4, height=4.4)
    loads, pressures = _loads_pressures(conditions)
    for panel, (name, label) in zip(axes, measured, strict=True):
        for load, pressure in product(loads, pressures):
            of_line = [c for c in conditions if (c.load, c.pressure) == (load, pressure) and c.camber_stiffness]
            rows = [(c, i.details) for c in of_line for i in c.sweeps if name.format("") in i.details]
            if rows:
                x, y, sd = np.array(
                    [(d.get("camber_rad", c.camber), d[name.format("")], d[name.format("_sd")]) for c, d in rows]
                ).T
                x = np.rad2deg(x)
                number, row = loads.index(load) % 6, pressures.index(pressure) % 6
                panel.errorbar(
                    x,
                    y,
                    1.96 * sd,
                    color=COLOURS[number],
                    marker=MARKERS[row],
                    ls="none",
                    ms=5,
                    capsize=2,
                    label=f"{load:g} N, {pressure / PASCAL_PER_BAR:g} bar",
                )
                ends = np.array([x.min(), x.max()])
                panel.plot(ends, np.polyval(np.polyfit(x, y, 1), ends), color=COLOURS[number], ls=DASHES[row], lw=1.0)
        panel.set(xlabel="Camber, deg", ylabel=label)
    title = f"{conditions[0].tyre}, {conditions[0].surface}: at zero slip over camber"
    return _add_title(figure, title, conditions[0], legend=axes[0])


def flat_against_drum(campaign: Campaign, tyre: str, pairs: Sequence[Pair]) -> Figure:
    """Draw the ratio of flat to drum cornering stiffness over load, with the fitted (1 + R/R_drum)^n."""
    figure, (panel,) = _empty_figure(1, 1, width=6.4, height=4.2)
    pressures = sorted({flat.pressure for flat, _ in pairs})
    span = float(np.ptp([flat.load for flat, _ in pairs])) or 40.0
    common = campaign.settings.calibration  # of both surfaces; it cancels in the ratio
    shared = common.force**2 + common.slip**2
    for number, pressure in enumerate(pressures):
        x, ratios, half = [], [], []
        for flat, drum in sorted(pairs, key=lambda pair: pair[0].load):
            a, b = flat.cornering_stiffness, drum.cornering_stiffness
            if flat.pressure == pressure and a and b:
                relative = sum(max((e.sd / e.value) ** 2 - shared, 0.0) for e in (a, b))
                x.append(flat.load + 0.012 * span * (number - len(pressures) / 2.0))
                ratios.append(a.value / b.value)
                half.append(1.96 * ratios[-1] * float(np.sqrt(relative)))
        panel.errorbar(x, ratios, half, capsize=3, label=f"{pressure / PASCAL_PER_BAR:g} bar", **_style(number))
    for exponent in (curvature for curvature in campaign.curvature if curvature.tyre == tyre):
        sd = f" ± {exponent.exponent.sd:.2f}" if np.isfinite(exponent.exponent.sd) else ""
        text = f"mean: (1 + R/R_d)^n, n = {exponent.exponent.value:.2f}{sd}"
        panel.axhline(exponent.ratio, color="0.4", lw=1.0, ls=(0, (1, 2)), label=text)
    panel.set(xlabel="Vertical load, N", ylabel="C_α on flat / on drum")
    return _add_title(
        figure, f"{tyre}: flat track and drum compared (reported, not applied)", pairs[0][0], legend=panel
    )


def surface_pairs(conditions: Sequence[ConditionResult]) -> list[Pair]:
    """Pair the conditions of one tyre that were measured on both surfaces, flat and drum."""
    drums = {(c.load, c.pressure): c for c in conditions if c.surface == "drum" and c.cornering_stiffness}
    flats = [c for c in conditions if c.surface == "flat" and c.cornering_stiffness]
    return [(c, drums[c.load, c.pressure]) for c in flats if (c.load, c.pressure) in drums]


def residuals(summary: RecordingSummary) -> Figure:
    """Draw the points of one sweep or lateral stiffness test with the fitted curve, and below them the residuals."""
    points, figure_title = points_of(summary), f"{summary.file}: "
    figure, (upper, lower) = _empty_figure(2, 1, width=6.8, height=5.6, sharex=True)
    if summary.kind == "slip_sweep":
        x, rising, residual = np.rad2deg(points["slip_rad"]), points["rate_rad_s"] > 0.0, points["residual_N"]
        groups: tuple[Any, ...] = ((rising, "^", COLOURS[0], "up branch"), (~rising, "v", COLOURS[2], "down branch"))
        if not points["rate_rad_s"].any():  # settled points
            groups = ((np.ones(x.size, bool), "o", COLOURS[0], "steady point"),)
        fine = np.linspace(x.min(), x.max(), 200)
        curve, label = (fine, _sweep_curve(summary, np.deg2rad(fine))), "steady curve"
        figure_title += f"R² = {summary.r_squared:.5f}, C_α = {np.deg2rad(summary.value):.2f} N/deg"
        lower.set(ylabel="Residual with lag, N", xlabel="Slip angle, deg")
    else:
        x, residual = 1e3 * points["deflection_m"], points["force_N"] - points["fitted_N"]
        groups = ((np.ones(x.size, bool), "o", COLOURS[0], "reading"),)
        curve, label = (x, points["fitted_N"]), "fit with Dahl friction"
        figure_title += f"K_y = {1e-3 * summary.value:.2f} N/mm, friction ±{summary.details['friction_N']:.2f} N"
        lower.set(ylabel="Residual, N", xlabel="Tyre deflection, plate - rim, mm")
    for chosen, marker, colour, name in groups:
        for panel, y in ((upper, points["force_N"]), (lower, residual)):
            panel.plot(x[chosen], y[chosen], ls="none", marker=marker, color=colour, ms=3.5, label=name)
    upper.plot(*curve, color=COLOURS[1], lw=1.2, label=label)
    upper.set_ylabel("Lateral force, N")
    upper.legend(fontsize=8)
    lower.axhline(0.0, color="k", lw=0.8)
    return _add_title(figure, figure_title, summary)


def repeats(campaign: Campaign) -> Figure:
    """Draw the deviation of every recording from the mean of its condition, with the pooled standard deviation."""
    figure, axes = _empty_figure(1, 2, width=9.0, height=3.9, sharey=True)
    kinds = (
        ("slip sweeps: cornering stiffness", campaign.sweep_repeatability, "sweeps"),
        ("lateral stiffness tests: lateral stiffness", campaign.pull_repeatability, "pulls"),
    )
    for panel, (title, pooled, name) in zip(axes, kinds, strict=True):
        number = 0
        for condition in campaign.conditions:
            values = np.array([item.value for item in getattr(condition, name)])
            if len(values) > 1 and not (name == "pulls" and condition.borrowed_stiffness):
                number += 1
                deviation = 100.0 * (values / values.mean() - 1.0)
                marker, face = ("o", "k") if condition.surface == "flat" else ("s", "w")
                panel.plot(np.full(values.size, number), deviation, marker, mfc=face, mec="k", ms=4)
        note = "no repeats"
        if pooled.measured:
            panel.axhspan(-100 * pooled.sd, 100 * pooled.sd, color="0.85", zorder=0)
            note = f"sd {100 * pooled.sd:.2f} %, {pooled.repeats:.0f} degrees of freedom of repeats"
        panel.set_title(f"{title}\n{note}", fontsize=9)
        panel.set_xlabel("Condition, in the order of the report")
        panel.axhline(0.0, color="k", lw=0.8)
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[0].set_ylabel("Deviation from the mean of the condition, %")
    return _add_title(figure, "Repeatability (filled: flat, open: drum; grey: ± one sd)", campaign.conditions[0])
