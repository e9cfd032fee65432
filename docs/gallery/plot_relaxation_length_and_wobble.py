"""
Relaxation length and wobble
============================

With front-frame compliance wobble of the benchmark bicycle is unstable between two speeds. This range is exact, not on
a speed grid. It widens with the relaxation length of the tyres, shown over the measured range of racing tyres. The
compliance is assumed.
"""

import numpy as np
from matplotlib import pyplot as plt

from bicycle import Model, effect_class, load_bicycle
from bicycle.stability import critical_speeds

lengths = np.linspace(0.05, 0.2, 31)
per_degree = 180 / np.pi
stiffness = {"rear": 110 * per_degree, "front": 105 * per_degree}  # N/deg, as Tyre1 at its larger loads
front = effect_class("front_compliance")(stiffness=3000.0, damping=15.0, joint_x=0.8, joint_z=-0.85)

crossings = []
for length in lengths:
    tyre = effect_class("relaxation_length")(cornering_stiffness=stiffness, relaxation_length=float(length))
    model = Model(load_bicycle("benchmark"), (tyre, front)).linear_model()
    crossings += [(length, c) for c in critical_speeds(model, max_speed=25.0) if c.mode in ("wobble", "weave")]

figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
for mode, direction, style in (
    ("wobble", "destabilising", "C3^"),
    ("wobble", "stabilising", "C3v"),
    ("weave", "stabilising", "C0v"),
    ("weave", "destabilising", "C0^"),
):
    chosen = [(1e3 * length, c.speed) for length, c in crossings if (c.mode, c.direction) == (mode, direction)]
    if chosen:
        axes.plot(*zip(*chosen, strict=True), style, ms=4, label=f"{mode}: {direction} with increasing speed")
axes.set(xlabel="Relaxation length of both tyres, mm", ylabel="Critical speed, m/s", ylim=(0, 25))
axes.legend(frameon=False, loc="upper left", ncols=2, fontsize=8)
plt.show()
