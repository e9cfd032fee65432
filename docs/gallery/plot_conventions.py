"""
Sign conventions
================

Axes and positive directions, drawn on the benchmark bicycle of Meijaard et al. (2007).
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Circle

from bicycle import load_bicycle

bicycle = load_bicycle("benchmark")
w, c, tilt = (bicycle[key] for key in ("w", "c", "lam"))
figure, (side, top) = plt.subplots(
    1, 2, figsize=(11, 4.2), gridspec_kw={"width_ratios": (1.15, 1)}, layout="constrained"
)


def arrow(axes, start, end, label, shift, colour="0.1"):
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8})
    axes.text(end[0] + shift[0], end[1] + shift[1], label, color=colour, ha="center", va="center", fontsize=11)


for x, radius in ((0.0, bicycle["rR"]), (w, bicycle["rF"])):
    side.add_patch(Circle((x, -radius), radius, fill=False, lw=2, color="0.55"))
side.axhline(0, color="0.3", lw=1)
foot, length = w + c, 1.05
head = (foot - length * np.sin(tilt), -length * np.cos(tilt))
side.plot([foot, head[0]], [0, head[1]], "--", color="#123a6b")
side.plot([0, 0.42, head[0] + 0.03, 0], [-bicycle["rR"], -0.3, -0.86, -bicycle["rR"]], color="0.55", lw=2)
side.plot([w, head[0] + 0.02], [-bicycle["rF"], -0.86], color="0.55", lw=2)
arrow(side, (0, 0), (0.42, 0), "x", (0.05, -0.05))
arrow(side, (0, 0), (0, 0.3), "z", (-0.06, 0.0))
side.text(-0.1, 0.1, "y into the page", ha="right", fontsize=9)
arrow(
    side,
    foot_point := (foot, 0.0),
    (foot + 0.10 * np.sin(tilt) + 0.06, 0.28),
    r"steer $\delta > 0$: right",
    (0.0, 0.06),
    "#123a6b",
)
side.annotate("", (w, 0.12), (0, 0.12), arrowprops={"arrowstyle": "<->", "color": "0.4"})
side.text(w / 2, 0.18, "wheelbase w", ha="center", va="center", color="0.3", fontsize=9)
side.annotate("", (foot, -0.04), (w, -0.04), arrowprops={"arrowstyle": "-", "color": "0.3", "lw": 3})
side.annotate(
    "trail c",
    ((foot + w) / 2, -0.03),
    (foot + 0.3, -0.13),
    color="0.3",
    fontsize=9,
    arrowprops={"arrowstyle": "-", "color": "0.3"},
)
side.text(
    head[0] - 0.03,
    head[1] - 0.06,
    r"steer axis, tilt $\lambda_s$ from the vertical",
    color="#123a6b",
    fontsize=9,
    ha="center",
)
side.set(xlim=(-0.75, 1.65), ylim=(0.45, -1.2), title="Side view from the right", xlabel="x (m)", ylabel="z (m)")

steer = 0.35
top.plot([-0.3, 0.3], [0, 0], lw=7, color="0.6", solid_capstyle="round")
front = np.array([np.cos(steer), np.sin(steer)]) * 0.33
top.plot([w - front[0], w + front[0]], [-front[1], front[1]], lw=7, color="0.6", solid_capstyle="round")
top.plot([0, w], [0, 0], color="0.55", lw=2)
arrow(top, (0, 0), (0.55, 0), "x", (0.0, -0.06))
arrow(top, (0, 0), (0, 0.45), "y", (-0.07, 0.0))
arrow(top, (w, 0), (w - 0.42 * np.sin(steer), 0.42 * np.cos(steer)), r"$F_y > 0$", (0.0, 0.06), "#c8462f")
velocity = np.array([np.cos(0.1), np.sin(0.1)]) * 0.55
arrow(top, (w, 0), (w + velocity[0], velocity[1]), "velocity of\nthe contact", (0.1, -0.14), "#3b7d4f")
angles = np.linspace(0.1, steer, 20)
top.plot(w + 0.48 * np.cos(angles), 0.48 * np.sin(angles), color="#c8462f")
top.text(w + 0.58, 0.2, r"$\alpha > 0$", color="#c8462f", fontsize=11)
turn = np.linspace(-0.35, 0.75, 30)
top.plot(-0.42 + 0.25 * np.cos(turn), 0.02 + 0.25 * np.sin(turn), color="#123a6b")
tail, tip = ((-0.42 + 0.25 * np.cos(a), 0.02 + 0.25 * np.sin(a)) for a in (0.7, 0.85))
top.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": "#123a6b"})
top.text(-0.45, 0.36, r"yaw $\psi > 0$", color="#123a6b", fontsize=11, ha="center")
top.set(xlim=(-0.85, 1.95), ylim=(0.7, -0.5), title="Top view (z into the page)", xlabel="x (m)", ylabel="y (m)")
for axes in (side, top):
    axes.set_aspect("equal")
    axes.grid(False)
plt.show()
