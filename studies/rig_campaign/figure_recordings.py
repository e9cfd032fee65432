"""Single recordings: residuals of a sweep, loop of a pull test, scatter of repeats."""

from typing import TYPE_CHECKING, Any

import numpy as np

from studies.rig_campaign.figure_style import COLOURS, empty_figure, sweep_curve, titled
from tyre.campaigns.campaign import Campaign
from tyre.campaigns.recording import points_of
from tyre.campaigns.summary import RecordingSummary

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def sweep_residuals(summary: RecordingSummary) -> "Figure":
    """Measured block means and residuals of one sweep over slip, up and down branches apart.

    Parameters
    ----------
    summary : RecordingSummary
        Of a slip sweep, with points in the cache.
    """
    figure, axes = empty_figure(2, 1, width=6.8, height=5.6, sharex=True)
    points = points_of(summary)
    slip, rising = np.rad2deg(points["slip_rad"]), points["rate_rad_s"] > 0.0
    for chosen, marker, colour, label in ((rising, "^", COLOURS[0], "up"), (~rising, "v", COLOURS[2], "down")):
        style: dict[str, Any] = {"ls": "none", "marker": marker, "ms": 3.5, "color": colour, "label": f"{label} branch"}
        axes[0].plot(slip[chosen], points["force_N"][chosen], **style)
        axes[1].plot(slip[chosen], points["residual_N"][chosen], **style)
    fine = np.linspace(slip.min(), slip.max(), 200)
    axes[0].plot(fine, sweep_curve(summary, np.deg2rad(fine)), color="k", lw=1.2, label="steady curve (lag removed)")
    axes[0].set_ylabel("side force (N)")
    axes[0].legend(fontsize=8)
    axes[1].axhline(0.0, color="k", lw=0.8)
    axes[1].set_ylabel("measured - fitted with lag (N)")
    axes[1].set_xlabel("slip angle (deg)")
    text = f"{summary.file}: R² = {summary.r_squared:.5f}, C = {np.deg2rad(summary.value):.2f} N/deg"
    return titled(figure, text, summary)


def pull_loop(summary: RecordingSummary) -> "Figure":
    """Force over deflection of one pull test with the fitted friction loop, and its residuals.

    Parameters
    ----------
    summary : RecordingSummary
        With points in the cache.
    """
    figure, axes = empty_figure(2, 1, width=6.8, height=5.6, sharex=True)
    points = points_of(summary)
    x = 1e3 * points["deflection_m"]
    axes[0].plot(x, points["force_N"], ls="none", marker="o", mfc="white", color=COLOURS[0], ms=4, label="read")
    axes[0].plot(x, points["fitted_N"], color=COLOURS[1], lw=1.0, label="loop of one slope and Dahl friction")
    axes[0].set_ylabel("side force (N)")
    axes[0].legend(fontsize=8)
    axes[1].plot(x, points["force_N"] - points["fitted_N"], ls="none", marker="o", color=COLOURS[0], ms=4)
    axes[1].axhline(0.0, color="k", lw=0.8)
    axes[1].set_ylabel("read - fitted (N)")
    axes[1].set_xlabel("tyre deflection, plate - rim (mm)")
    friction = summary.details["friction_N"]
    text = f"{summary.file}: K = {1e-3 * summary.value:.2f} N/mm, friction ±{friction:.2f} N"
    return titled(figure, text, summary)


def repeats(campaign: Campaign) -> "Figure":
    """Deviation of every recording from the mean of its condition, with the pooled standard deviation.

    Parameters
    ----------
    campaign : Campaign
    """
    from matplotlib.ticker import MaxNLocator

    figure, axes = empty_figure(1, 2, width=9.0, height=3.9, sharey=True)
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
                f"{title}\nsd {100 * pooled.sd:.2f} %, {pooled.repeats:.0f} degrees of freedom of repeats", fontsize=9
            )
        else:
            panel.set_title(f"{title}\nno repeats", fontsize=9)
        panel.set_xlabel("condition, in the order of the report")
        panel.axhline(0.0, color="k", lw=0.8)
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[0].set_ylabel("deviation from the condition's mean (%)")
    return titled(figure, "Repeatability (filled: flat, open: drum; grey: ± one sd)", campaign.conditions[0])
