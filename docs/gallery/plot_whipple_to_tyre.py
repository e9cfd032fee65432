"""
From knife edges to a measured tyre
===================================

The same bicycle with wheels that cannot slip and with a measured racing tyre (Dell'Orto et al., Tyre1, flat track,
5.5 bar, extrapolated to the benchmark's rear load): weave changes little, and a wobble mode exists. Between 10.1 and
11 m/s wobble and the vibration of the rear tyre veer: neither root is wobble alone, and the line has a gap.
"""

import numpy as np
from matplotlib import pyplot as plt

from bicycle import Model, load_bicycle
from bicycle.model import build_model
from bicycle.stability import modes

speeds = np.linspace(0.0, 12.0, 121)
whipple = Model(load_bicycle("benchmark")).linear_model()
tyre = {"tyre": "Tyre1", "surface": "flat", "pressure_bar": 5.5}
tyred = build_model({"bicycle": "benchmark", "effects": {"relaxation_length": tyre}}).linear_model()
print(*tyred.warnings, sep="\n")

figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained", sharex=True)
for model, name, style in ((whipple, "no slip", "--"), (tyred, "measured tyre", "-")):
    found = modes(model, speeds)
    for mode, colour in (("weave", "#123a6b"), ("wobble", "#c8462f")):
        if mode in found.to_dict():
            axes[0].plot(speeds, found.frequency(mode), style, color=colour, label=f"{mode}, {name}")
            axes[1].plot(speeds, found.damping_ratio(mode), style, color=colour)
axes[0].set(xlabel="Speed, m/s", ylabel="Frequency, Hz")
axes[1].set(xlabel="Speed, m/s", ylabel="Damping ratio", ylim=(-0.5, 1))
axes[1].axhline(0, color="0.3", lw=0.8)
axes[0].legend(frameon=False)
plt.show()
