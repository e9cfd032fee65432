"""Figures of one recording: what was measured, the fit and its residuals."""

from typing import TYPE_CHECKING, Any

import numpy as np

from studies.rig_campaign.canvas import COLOURS, blank, fitted_curve, titled
from tyre.campaigns.recording import points_of
from tyre.campaigns.summary import RecordingSummary

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def sweep_residuals(summary: RecordingSummary) -> "Figure":
    """Measured block means and residuals of one sweep over slip, up and down branches apart."""
    figure, axes = blank(2, 1, width=6.8, height=5.6, sharex=True)
    points = points_of(summary)
    slip, rising = np.rad2deg(points["slip_rad"]), points["rate_rad_s"] > 0.0
    for chosen, marker, colour, label in ((rising, "^", COLOURS[0], "up"), (~rising, "v", COLOURS[2], "down")):
        style: dict[str, Any] = {"ls": "none", "marker": marker, "ms": 3.5, "color": colour, "label": f"{label} branch"}
        axes[0].plot(slip[chosen], points["force_N"][chosen], **style)
        axes[1].plot(slip[chosen], points["residual_N"][chosen], **style)
    fine = np.linspace(slip.min(), slip.max(), 200)
    axes[0].plot(fine, fitted_curve(summary, np.deg2rad(fine)), color="k", lw=1.2, label="steady curve (lag removed)")
    axes[0].set_ylabel("side force (N)")
    axes[0].legend(fontsize=8)
    axes[1].axhline(0.0, color="k", lw=0.8)
    axes[1].set_ylabel("measured - fitted with lag (N)")
    axes[1].set_xlabel("slip angle (deg)")
    text = f"{summary.file}: R² = {summary.r_squared:.5f}, C = {np.deg2rad(summary.value):.2f} N/deg"
    return titled(figure, text, summary)


def pull_loop(summary: RecordingSummary) -> "Figure":
    """Force over deflection of one pull test with the fitted friction loop, and its residuals."""
    figure, axes = blank(2, 1, width=6.8, height=5.6, sharex=True)
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
