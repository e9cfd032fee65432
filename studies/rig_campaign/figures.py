"""Figures of a campaign: carpet plot, stiffnesses over load, flat against drum, residuals, repeats."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tyre.base.files import slug
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.campaign import Campaign
from tyre.campaigns.condition import ConditionResult
from tyre.campaigns.recording import points_of
from tyre.campaigns.summary import RecordingSummary
from tyre.fits.estimate import Estimate
from tyre.fits.sweep_curve import magic_formula
from tyre.recordings.recording import Channel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = ("#08306b", "#c0392b", "#e8a33d", "#2a7f62", "#7d5ba6", "#555555")  # dark to light, told apart in grey
_MARKERS = ("o", "s", "^", "D", "v", "P")
_DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
_LOAD_SHIFT = 1.5  # deg by which the carpet moves per load
_SLIPS = (0.0, 1.0, 2.0, 3.0, 4.0)


def save_figures(campaign: Campaign, folder: Path, *, every_recording: bool = False) -> list[Path]:
    """Draw all figures of a campaign that its data allow.

    Parameters
    ----------
    campaign : Campaign
    folder : Path
        Made if missing.
    every_recording : bool
        Also draw the residuals of every sweep and pull test, in ``residuals/``, not only of the worst.

    Returns
    -------
    list of Path
        PNG files.
    """
    import matplotlib

    folder.mkdir(parents=True, exist_ok=True)
    drawn: list[tuple[str, Figure]] = []
    with matplotlib.rc_context({"font.size": 9.0, "axes.grid": True, "grid.alpha": 0.3, "figure.dpi": 130}):
        for tyre in sorted({c.tyre for c in campaign.conditions}):
            mine = [c for c in campaign.conditions if c.tyre == tyre]
            for surface in sorted({c.surface for c in mine}, reverse=True):
                chosen = [c for c in mine if c.surface == surface and c.sweeps]
                if chosen:
                    drawn.append((f"carpet_{slug(tyre)}_{surface}", carpet(chosen)))
            drawn.append((f"stiffness_{slug(tyre)}", stiffness_over_load(mine)))
            pairs = _surface_pairs(mine)
            if pairs:
                drawn.append((f"flat_drum_{slug(tyre)}", flat_against_drum(campaign, tyre, pairs)))
        sweeps = [item for c in campaign.conditions for item in c.sweeps]
        if sweeps:
            worst = min(sweeps, key=lambda item: (item.r_squared, item.file))
            if points_of(worst):
                drawn.append(("residuals_worst_sweep", sweep_residuals(worst)))
        pulls = [item for c in campaign.conditions for item in c.pulls]
        if pulls:
            worst = min(pulls, key=lambda item: (item.r_squared, item.file))
            if points_of(worst):
                drawn.append(("pull_worst", pull_loop(worst)))
        if campaign.sweep_repeatability.measured or campaign.pull_repeatability.measured:
            drawn.append(("repeatability", repeats(campaign)))
        paths = []
        for name, figure in drawn:
            path = folder / f"{name}.png"
            figure.savefig(path)
            paths.append(path)
        if every_recording:
            (folder / "residuals").mkdir(exist_ok=True)
            for item in {item.file: item for item in (*sweeps, *pulls)}.values():
                figure = sweep_residuals(item) if item.kind == "slip_sweep" else pull_loop(item)
                path = folder / "residuals" / f"{slug(item.file)}.png"
                figure.savefig(path)
                paths.append(path)
    return paths


def carpet(conditions: Sequence[ConditionResult]) -> "Figure":
    """Carpet plot of one tyre on one surface: side force over slip and load, one panel per pressure.

    Parameters
    ----------
    conditions : sequence of ConditionResult
        With slip sweeps.

    Returns
    -------
    matplotlib.figure.Figure
    """
    pressures = sorted({c.pressure for c in conditions})
    loads = sorted({c.load for c in conditions})
    figure, axes = _figure(1, len(pressures), width=max(6.4, 2.9 * len(pressures)), height=4.2, sharey=True)
    reach = min(4.0, max(_reach(item) for c in conditions for item in c.sweeps))
    slips = np.array([slip for slip in _SLIPS if slip <= reach + 1e-6])
    fine = np.deg2rad(np.linspace(0.0, slips[-1], 60))
    top = 0.0
    for panel, pressure in zip(axes, pressures, strict=True):
        nodes = []
        for number, load in enumerate(loads):
            here = [c for c in conditions if c.load == load and c.pressure == pressure]
            if not here:
                continue
            shift = _LOAD_SHIFT * number
            colour, dash = _COLOURS[number % 6], _DASHES[number % 6]
            curve = _mean_curve(here[0], fine)
            panel.plot(np.rad2deg(fine) + shift, curve, color=colour, ls=dash, lw=1.8, label=f"{load:g} N")
            nodes.append((slips + shift, _mean_curve(here[0], np.deg2rad(slips))))
            top = max(top, float(curve.max()))
        for index, slip in enumerate(slips):
            line = np.array([(x[index], y[index]) for x, y in nodes])
            panel.plot(line[:, 0], line[:, 1], color="0.45", lw=0.8, marker=".", ms=4)
            if slip > 0.0:
                label: dict[str, Any] = {
                    "xytext": (4, -3),
                    "textcoords": "offset points",
                    "fontsize": 7.5,
                    "color": "0.25",
                }
                panel.annotate(f"{slip:g}°", line[-1], **label)
        panel.set_title(f"{pressure / PASCAL_PER_BAR:g} bar", fontsize=10)
        panel.set_xlim(-0.3, slips[-1] + _LOAD_SHIFT * (len(loads) - 1) + 0.9)
        panel.set_xticks([])
        panel.set_xlabel("slip angle, shifted by load")
    axes[0].set_ylabel("side force without offsets (N)")
    axes[0].set_ylim(0.0, 1.12 * top)
    axes[0].legend(title="vertical load", loc="upper left", fontsize=8)
    first = conditions[0]
    return _titled(figure, f"{first.tyre}, {first.surface}: side force over slip (grey: constant slip) and load", first)


def stiffness_over_load(conditions: Sequence[ConditionResult]) -> "Figure":
    """C_Fy, K_y and relaxation length of one tyre over load, one line per pressure and surface, 95 % intervals."""
    figure, axes = _figure(1, 3, width=10.5, height=4.4)
    quantities = (
        ("cornering_stiffness", "cornering stiffness (N/deg)", np.pi / 180.0),
        ("lateral_stiffness", "lateral stiffness (N/mm)", 1e-3),
        ("relaxation_length", "relaxation length (mm)", 1e3),
    )
    pressures = sorted({c.pressure for c in conditions})
    surfaces = sorted({c.surface for c in conditions}, reverse=True)
    span = float(np.ptp([c.load for c in conditions])) or 40.0
    for panel, (name, label, factor) in zip(axes, quantities, strict=True):
        for row, surface in enumerate(surfaces):
            for number, pressure in enumerate(pressures):
                found = sorted(
                    (c.load, getattr(c, name))
                    for c in conditions
                    if c.surface == surface
                    and c.pressure == pressure
                    and getattr(c, name) is not None
                    and not (name == "lateral_stiffness" and c.borrowed_stiffness)
                )
                if not found:
                    continue
                # neighbouring lines are moved aside a little, so that their intervals do not hide each other
                x = np.array([load for load, _ in found]) + span * 0.012 * (number + 3 * row - len(pressures) / 2.0)
                y = factor * np.array([e.value for _, e in found])
                half = factor * np.array([e.ci95[1] - e.value for _, e in found])
                panel.errorbar(
                    x,
                    y,
                    half,
                    color=_COLOURS[number % 6],
                    marker=_MARKERS[number % 6],
                    ls="-" if surface == "flat" else "--",
                    mfc=_COLOURS[number % 6] if surface == "flat" else "white",
                    capsize=2.5,
                    lw=1.2,
                    ms=5,
                    label=f"{pressure / PASCAL_PER_BAR:g} bar, {surface}",
                )
        panel.set_xlabel("vertical load (N)")
        panel.set_ylabel(label)
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=min(6, len(labels)), fontsize=8)
    return _titled(figure, f"{conditions[0].tyre}: values with 95 % intervals", conditions[0])


def flat_against_drum(
    campaign: Campaign, tyre: str, pairs: Sequence[tuple[ConditionResult, ConditionResult]]
) -> "Figure":
    """Ratio of flat to drum cornering stiffness over load, with the fitted (1 + R/R_drum)^n.

    ``pairs`` are the conditions of ``tyre`` measured on both.
    """
    figure, axes = _figure(1, 1, width=6.4, height=4.2)
    panel = axes[0]
    pressures = sorted({flat.pressure for flat, _ in pairs})
    span = float(np.ptp([flat.load for flat, _ in pairs])) or 40.0
    for number, pressure in enumerate(pressures):
        chosen = sorted((p for p in pairs if p[0].pressure == pressure), key=lambda p: p[0].load)
        ratio, half = [], []
        for flat, drum in chosen:
            a, b = flat.cornering_stiffness, drum.cornering_stiffness
            assert a is not None
            assert b is not None
            ratio.append(a.value / b.value)
            # the rig's calibration is common to both surfaces and cancels in the ratio
            common = campaign.settings.calibration
            shared = common.force**2 + common.slip**2
            relative = [max((e.sd / e.value) ** 2 - shared, 0.0) for e in (a, b)]
            half.append(1.96 * ratio[-1] * float(np.sqrt(sum(relative))))
        panel.errorbar(
            [flat.load + 0.012 * span * (number - len(pressures) / 2.0) for flat, _ in chosen],
            ratio,
            half,
            color=_COLOURS[number % 6],
            marker=_MARKERS[number % 6],
            ls=_DASHES[number % 6],
            capsize=3,
            label=f"{pressure / PASCAL_PER_BAR:g} bar",
        )
    for exponent in campaign.curvature:
        if exponent.tyre == tyre:
            sd = f" $\\pm$ {exponent.exponent.sd:.2f}" if np.isfinite(exponent.exponent.sd) else ""
            text = f"mean: $(1 + R/R_d)^n$, n = {exponent.exponent.value:.2f}{sd}"
            panel.axhline(exponent.ratio, color="0.4", lw=1.0, ls=(0, (1, 2)), label=text)
    panel.set_xlabel("vertical load (N)")
    panel.set_ylabel("cornering stiffness, flat over drum")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    return _titled(figure, f"{tyre}: flat track against drum (reported, not applied)", pairs[0][0])


def sweep_residuals(summary: RecordingSummary) -> "Figure":
    """Measured block means and residuals of one sweep over slip, up and down branches apart."""
    figure, axes = _figure(2, 1, width=6.8, height=5.6, sharex=True)
    points = points_of(summary)
    slip, rising = np.rad2deg(points["slip_rad"]), points["rate_rad_s"] > 0.0
    for chosen, marker, colour, label in ((rising, "^", _COLOURS[0], "up"), (~rising, "v", _COLOURS[2], "down")):
        style: dict[str, Any] = {"ls": "none", "marker": marker, "ms": 3.5, "color": colour, "label": f"{label} branch"}
        axes[0].plot(slip[chosen], points["force_N"][chosen], **style)
        axes[1].plot(slip[chosen], points["residual_N"][chosen], **style)
    fine = np.linspace(slip.min(), slip.max(), 200)
    axes[0].plot(fine, _curve(summary, np.deg2rad(fine)), color="k", lw=1.2, label="steady curve (lag removed)")
    axes[0].set_ylabel("side force (N)")
    axes[0].legend(fontsize=8)
    axes[1].axhline(0.0, color="k", lw=0.8)
    axes[1].set_ylabel("measured - fitted with lag (N)")
    axes[1].set_xlabel("slip angle (deg)")
    text = f"{summary.file}: R² = {summary.r_squared:.5f}, C = {np.deg2rad(summary.value):.2f} N/deg"
    return _titled(figure, text, summary)


def pull_loop(summary: RecordingSummary) -> "Figure":
    """Force over deflection of one pull test with the fitted friction loop, and its residuals."""
    figure, axes = _figure(2, 1, width=6.8, height=5.6, sharex=True)
    points = points_of(summary)
    x = 1e3 * points["deflection_m"]
    axes[0].plot(x, points["force_N"], ls="none", marker="o", mfc="white", color=_COLOURS[0], ms=4, label="read")
    axes[0].plot(x, points["fitted_N"], color=_COLOURS[1], lw=1.0, label="loop of one slope and Dahl friction")
    axes[0].set_ylabel("side force (N)")
    axes[0].legend(fontsize=8)
    axes[1].plot(x, points["force_N"] - points["fitted_N"], ls="none", marker="o", color=_COLOURS[0], ms=4)
    axes[1].axhline(0.0, color="k", lw=0.8)
    axes[1].set_ylabel("read - fitted (N)")
    axes[1].set_xlabel("tyre deflection, plate - rim (mm)")
    friction = summary.details["friction_N"]
    text = f"{summary.file}: K = {1e-3 * summary.value:.2f} N/mm, friction ±{friction:.2f} N"
    return _titled(figure, text, summary)


def repeats(campaign: Campaign) -> "Figure":
    """Deviation of every recording from the mean of its condition, with the pooled standard deviation."""
    from matplotlib.ticker import MaxNLocator

    figure, axes = _figure(1, 2, width=9.0, height=3.9, sharey=True)
    kinds = (
        ("slip sweeps: cornering stiffness", campaign.sweep_repeatability, "sweeps"),
        ("pull tests: lateral stiffness", campaign.pull_repeatability, "pulls"),
    )
    for panel, (title, pooled, name) in zip(axes, kinds, strict=True):
        number = 0
        for condition in campaign.conditions:
            items = getattr(condition, name)
            if len(items) < 2 or (name == "pulls" and condition.borrowed_stiffness):
                continue
            number += 1
            values = np.array([item.value for item in items])
            deviation = 100.0 * (values / values.mean() - 1.0)
            flat = condition.surface == "flat"
            panel.plot(
                np.full(values.size, number), deviation, "o" if flat else "s", mfc="k" if flat else "w", mec="k", ms=4
            )
        if pooled.measured:
            panel.axhspan(-100 * pooled.sd, 100 * pooled.sd, color="0.85", zorder=0)
            panel.set_title(
                f"{title}\npooled sd {100 * pooled.sd:.2f} %, {pooled.dof:.0f} degrees of freedom", fontsize=9
            )
        else:
            panel.set_title(f"{title}\nno repeats", fontsize=9)
        panel.set_xlabel("condition, in the order of the report")
        panel.axhline(0.0, color="k", lw=0.8)
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[0].set_ylabel("deviation from the condition's mean (%)")
    return _titled(figure, "Repeatability (filled: flat, open: drum; grey: ± one sd)", campaign.conditions[0])


def _curve(summary: RecordingSummary, slip: Channel, *, offsets: bool = True) -> Channel:
    details = summary.details
    force, _ = magic_formula(
        slip=slip + (details["Sh_rad"] if offsets else 0.0),
        cornering_stiffness=summary.value,
        peak=details["peak_N"],
        shape=details["shape"],
        curvature=details["curvature"],
    )
    return force + (details["Sv_N"] if offsets else 0.0)


def _mean_curve(condition: ConditionResult, slip: Channel) -> Channel:
    return np.mean([_curve(item, slip, offsets=False) for item in condition.sweeps], axis=0)


def _reach(summary: RecordingSummary) -> float:
    points = points_of(summary)
    return float(np.rad2deg(np.max(np.abs(points["slip_rad"])))) + 0.1 if points else 4.0


def _surface_pairs(conditions: Sequence[ConditionResult]) -> list[tuple[ConditionResult, ConditionResult]]:
    drums = {(c.load, c.pressure): c for c in conditions if c.surface == "drum" and c.cornering_stiffness}
    return [
        (c, drums[c.load, c.pressure])
        for c in conditions
        if c.surface == "flat" and c.cornering_stiffness and (c.load, c.pressure) in drums
    ]


def _figure(
    rows: int, columns: int, *, width: float, height: float, sharex: bool = False, sharey: bool = False
) -> "tuple[Figure, list[Axes]]":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, list(axes.flat)


def _titled(figure: "Figure", text: str, what: ConditionResult | RecordingSummary | Estimate) -> "Figure":
    synthetic = getattr(what, "synthetic", False)
    figure.suptitle(f"{text}\nSYNTHETIC: from the rig simulator, not measured" if synthetic else text, fontsize=10)
    return figure
