"""
Wobble of Sharp's motorcycle
============================

Compliance reverses the dependence of wobble damping on speed. With rigid frames the damping of the motorcycle of Sharp
(1994) decreases from 11 m/s on; with front-frame and rear-frame compliance it is lowest near 20 m/s. Hands on the
handlebar increase the damping of wobble and decrease that of weave. Tyres are at static loads, without air drag.
"""

import numpy as np
from matplotlib import pyplot as plt

from bicycle import Model
from bicycle.model import read_model
from bicycle.stability import modes

speeds = np.linspace(10.0, 53.5, 88)
free, held = read_model("sharp1994"), read_model("sharp1994_hands_on")
stiff = [effect for effect in free.effects if not effect.identifier.endswith("_compliance")]
cases = {
    "rigid, hands off": (Model(free.bicycle, stiff), "C0-"),
    "flexible, hands off": (free, "C3-"),
    "flexible, hands on": (held, "C3--"),
}

figure, panels = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", sharex=True)
for name, (model, style) in cases.items():
    found = modes(model, speeds).to_dict()
    for axes, mode in zip(panels, ("wobble", "weave"), strict=True):
        axes.plot(speeds, [values[0][0] for values in found[mode]], style, label=name)
for axes, mode, low in zip(panels, ("wobble", "weave"), (-11, -11), strict=True):
    axes.axhline(0, color="0.6", lw=0.8)
    axes.set(title=mode, xlabel="Speed, m/s", ylabel="Real part, 1/s", xlim=(10, 53.5), ylim=(low, 1))
panels[0].legend(frameon=False, fontsize=8)
plt.show()
