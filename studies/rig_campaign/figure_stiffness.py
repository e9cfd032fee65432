"""Stiffnesses over load, and flat track against drum."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.rig_campaign.figure_style import COLOURS, DASHES, MARKERS, empty_figure, titled
from tyre.campaigns.campaign import Campaign
from tyre.campaigns.condition import ConditionResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def stiffness_over_load(conditions: Sequence[ConditionResult]) -> "Figure":
    """C_Fy, K_y and relaxation length of one tyre over load, one line per pressure and surface, 95 % intervals.

    Parameters
    ----------
    conditions : sequence of ConditionResult
        Of one tyre.
    """
    figure, axes = empty_figure(1, 3, width=10.5, height=4.4)
    quantities = (
        ("cornering_stiffness", "cornering stiffness (N/deg)", np.pi / 180.0),
        ("lateral_stiffness", "lateral stiffness (N/mm)", 1e-3),
        ("relaxation_length", "relaxation length (mm)", 1e3),
    )
    pressures = sorted({c.pressure for c in conditions})
    surfaces = sorted({c.surface for c in conditions}, reverse=True)
    loads = sorted({c.load for c in conditions})
    span = loads[-1] - loads[0] or 40.0
    for panel, (name, label, factor) in zip(axes, quantities, strict=True):
        for row, surface in enumerate(surfaces):
            for number, pressure in enumerate(pressures):
                measured = sorted(
                    (c.load, getattr(c, name))
                    for c in conditions
                    if c.surface == surface
                    and c.pressure == pressure
                    and getattr(c, name) is not None
                    and not (name == "lateral_stiffness" and c.borrowed_stiffness)
                )
                if not measured:
                    continue
                # neighbouring lines are moved aside a little, so that their intervals do not hide each other
                x = np.array([load for load, _ in measured]) + span * 0.012 * (number + 3 * row - len(pressures) / 2.0)
                y = factor * np.array([e.value for _, e in measured])
                half = factor * np.array([e.ci95[1] - e.value for _, e in measured])
                panel.errorbar(
                    x,
                    y,
                    half,
                    color=COLOURS[number % 6],
                    marker=MARKERS[number % 6],
                    ls="-" if surface == "flat" else "--",
                    mfc=COLOURS[number % 6] if surface == "flat" else "white",
                    capsize=2.5,
                    lw=1.2,
                    ms=5,
                    label=f"{pressure / 1e5:g} bar, {surface}",
                )
        panel.set_xlabel("vertical load (N)")
        panel.set_ylabel(label)
        if len(loads) == 1:  # ticks of what was moved aside would be crowded hundredths of a newton
            panel.set(xticks=loads, xlim=(loads[0] - span / 2, loads[0] + span / 2))
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=min(6, len(labels)), fontsize=8)
    return titled(figure, f"{conditions[0].tyre}: values with 95 % intervals", conditions[0])


def flat_against_drum(
    campaign: Campaign, tyre: str, pairs: Sequence[tuple[ConditionResult, ConditionResult]]
) -> "Figure":
    """Ratio of flat to drum cornering stiffness over load, with the fitted (1 + R/R_drum)^n.

    Parameters
    ----------
    campaign : Campaign
    tyre : str
    pairs : sequence of (ConditionResult, ConditionResult)
        Conditions on the flat track and on the drum.
    """
    figure, axes = empty_figure(1, 1, width=6.4, height=4.2)
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
            color=COLOURS[number % 6],
            marker=MARKERS[number % 6],
            ls=DASHES[number % 6],
            capsize=3,
            label=f"{pressure / 1e5:g} bar",
        )
    for exponent in campaign.curvature:
        if exponent.tyre == tyre:
            sd = f" ± {exponent.exponent.sd:.2f}" if np.isfinite(exponent.exponent.sd) else ""
            text = f"mean: (1 + R/R_d)^n, n = {exponent.exponent.value:.2f}{sd}"
            panel.axhline(exponent.ratio, color="0.4", lw=1.0, ls=(0, (1, 2)), label=text)
    panel.set_xlabel("vertical load (N)")
    panel.set_ylabel("cornering stiffness, flat over drum")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    return titled(figure, f"{tyre}: flat track against drum (reported, not applied)", pairs[0][0])


def surface_pairs(conditions: Sequence[ConditionResult]) -> list[tuple[ConditionResult, ConditionResult]]:
    """Conditions measured on both surfaces, flat and drum.

    Parameters
    ----------
    conditions : sequence of ConditionResult
        Of one tyre.
    """
    drums = {(c.load, c.pressure): c for c in conditions if c.surface == "drum" and c.cornering_stiffness}
    return [
        (c, drums[c.load, c.pressure])
        for c in conditions
        if c.surface == "flat" and c.cornering_stiffness and (c.load, c.pressure) in drums
    ]
