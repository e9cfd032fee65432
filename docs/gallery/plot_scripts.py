"""
The library in a script
=======================

A root locus with python-control, a sweep over two parameters, and a published benchmark as a test.
"""

import control
import numpy as np
from matplotlib import pyplot as plt

import velotyre as vt

# %%
# Which gain from lean rate to steer torque stabilises weave at 3 m/s? The loop is closed outside velotyre.

plant = vt.Model("benchmark").linear_model().to_control(3.0)
loop = control.root_locus_map(plant["lean_rate", "steer_torque"], gains=-np.linspace(0, 10, 101))
stable = (loop.loci.real < 0).all(axis=1)

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
gains = np.repeat(np.abs(loop.gains)[:, None], loop.loci.shape[1], axis=1)
points = axes.scatter(loop.loci.real, loop.loci.imag, c=gains, s=8)
axes.axvline(0, color="0.2", lw=0.8)
axes.set(xlim=(-12, 6), xlabel="Real part, 1/s", ylabel="Imaginary part, rad/s")
figure.colorbar(points, label="Steer torque per lean rate, N m s/rad")
lowest = np.abs(loop.gains)[stable].min()
axes.set_title(f"Benchmark at 3 m/s: stable from {lowest:.1f} N m s/rad", fontsize=10)
plt.show()

# %%
# The weave speed over trail and wheelbase: arrays of parameters give labelled arrays.

found = vt.critical_speeds("benchmark", trail=np.linspace(0.05, 0.1, 11), wheelbase=[1.0, 1.05])
weave = found.sel(crossing_mode="weave", as_speed_grows="stabilising", occurrence=1)

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
lines = weave.plot.line(x="c", ax=axes, add_legend=False)
axes.legend(lines, [f"wheelbase {w:g} m" for w in weave.w.values])
axes.set(xlabel="Trail, m", ylabel="Weave speed, m/s", title="")
plt.show()

# %%
# Meijaard et al. (2007), table 2, in a test.

weave, capsize = vt.critical_speeds("benchmark")
np.testing.assert_allclose([weave.speed, capsize.speed], [4.29238253634111, 6.02426201538837], rtol=1e-12)
print(f"weave {weave.speed:.6f} m/s, capsize {capsize.speed:.6f} m/s")
