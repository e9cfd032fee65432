"""
Which parameters change wobble most
===================================

Derivatives of the wobble eigenvalue with respect to every parameter, per 5 % of the parameter, from left and right
eigenvectors.
"""

import numpy as np
from matplotlib import pyplot as plt

from bicycle import Model, effect_class, load_bicycle
from bicycle.stability import modes, sensitivities

speed = 8.0
model = Model(
    load_bicycle("benchmark"),
    (
        effect_class("relaxation_length")(cornering_stiffness=6200.0, relaxation_length=0.12),
        effect_class("front_compliance")(stiffness=3000.0, damping=15.0, joint_x=0.8, joint_z=-0.85),
    ),
)
root = modes(model.linear_model(), [speed]).branches["wobble"][0, 0]
found = sensitivities(model, [speed])
row = int(np.abs(found.eigenvalues[0] - root).argmin())
share = {
    key: found.derivatives[0, row, column].real * 0.05 * abs(model.parameters[key])
    for column, key in enumerate(found.parameters)
    if key != "g"
}
largest = sorted(share.items(), key=lambda item: -abs(item[1]))[:12][::-1]

figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
axes.barh(
    [key for key, _ in largest], [value for _, value in largest], color=["C3" if v > 0 else "C0" for _, v in largest]
)
axes.axvline(0, color="0.2", lw=0.8)
axes.set_xlabel("Change of the real part of wobble, 1/s,\nper 5 % increase of the parameter; right: less stable")
figure.suptitle(
    f"Benchmark, front-frame compliance, {speed:g} m/s (wobble {root.imag / 2 / np.pi:.1f} Hz)", fontsize=10
)
plt.show()
