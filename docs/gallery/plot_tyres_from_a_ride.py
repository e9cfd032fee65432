"""
What a ride tells about the tyres
=================================

Two SYNTHETIC rides of 100 s, with three gyroscopes: what the measurement file states before them, and what a fit of
their spectra adds. The rides were computed outside velotyre by Kane's equations, so that the true values are known.
All values before the rides and their uncertainties are assumed. The hinge of the front frame is stated at its true
place with an uncertainty of 5 mm, as if it had been measured at standstill.

The interval of the rear cornering stiffness misses the true value. Intervals from rides are too narrow;
:doc:`/from_a_ride` states how often they hold, and how to measure.
"""

import shutil
import tempfile
from pathlib import Path

from matplotlib import pyplot as plt

from studies.diagnosis import draw_density, label_density, read_measurement
from studies.inference import RULES, compare_nuisances, fit

RIDES = Path("../examples/measurements/ride_spectra")  # from docs/gallery, where the gallery is run
MEASUREMENT = """kind = "ride_spectra"
bicycle = "rigid_rider"

[uncertainty]
xB = 0.005
zB = 0.005

[effects.relaxation_length]
cornering_stiffness = { rear = "7945(1192)", front = "4278(642)" }
relaxation_length = { rear = "0.104(0.016)", front = "0.104(0.016)" }

[effects.front_compliance]
stiffness = "6500(1300)"
damping = "30(6)"
joint_x = "0.753(0.005)"
joint_z = "-0.867(0.005)"

[ride_spectra]
rides = [{ file = "ride_6.csv", speed_m_s = 6.0 }, { file = "ride_9.csv", speed_m_s = 9.0 }]
"""
TRUE = {  # SI, as the measurement file of the rides states them; label; factor to the unit that is shown
    "relaxation_length.cornering_stiffness.rear": (7106.0, "Cornering stiffness, rear", 1, "N/rad"),
    "relaxation_length.cornering_stiffness.front": (4310.0, "Cornering stiffness, front", 1, "N/rad"),
    "relaxation_length.relaxation_length.rear": (0.093, "Relaxation length, rear", 1000, "mm"),
    "relaxation_length.relaxation_length.front": (0.080, "Relaxation length, front", 1000, "mm"),
    "front_compliance.stiffness": (5348.0, "Front-frame stiffness", 1, "N m/rad"),
}

with tempfile.TemporaryDirectory() as folder:
    shutil.copytree(RIDES, folder, dirs_exist_ok=True)
    file = Path(folder) / "MEASUREMENT.toml"
    file.write_text(MEASUREMENT, encoding="utf-8")
    rides = read_measurement(file).prepare()
after = fit(rides, ())
estimates = {estimate.name: estimate for estimate in compare_nuisances(after, after)}

# %%
# Estimates before and after the rides, as shares of the true values. A 95 % interval reaches 1.96 standard
# uncertainties to each side. A number after ± is one standard uncertainty.

BEFORE, HOLDS, MISSES = "before the rides (assumed)", "after, holds the true value", "after, misses it"
COLOURS = {BEFORE: "0.6", HOLDS: "C0", MISSES: "C3"}


def draw_interval(axes, row, value, sd, true, title):
    share = 100 / true
    axes.errorbar(share * value, row, xerr=1.96 * share * sd, fmt="o", ms=4, lw=3, color=COLOURS[title], label=title)


figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
missed = []
for row, (name, (true, label, factor, unit)) in enumerate(TRUE.items()):
    estimate = estimates[name]
    outcome = HOLDS if abs(estimate.value - true) <= 1.96 * estimate.sd else MISSES
    if outcome == MISSES:
        missed.append(label)
    draw_interval(axes, row - 0.15, estimate.prior, estimate.prior_sd, true, BEFORE)
    draw_interval(axes, row + 0.15, estimate.value, estimate.sd, true, outcome)
    shown = f"{factor * estimate.value:.0f} ± {factor * estimate.sd:.0f} {unit}\ntrue {factor * true:.0f} {unit}"
    axes.text(181, row, shown, va="center", fontsize=8)
axes.axvline(100, color="0.2", lw=0.8, label="true value")
axes.set_yticks(range(len(TRUE)), [label for _, label, _, _ in TRUE.values()])
axes.set_ylim(len(TRUE) - 0.5, -0.5)
axes.set(xlim=(55, 180), xlabel="Estimate with 95 % interval, % of the true value")
handles, titles = axes.get_legend_handles_labels()
by_title = dict(zip(titles, handles, strict=True))
figure.legend(by_title.values(), by_title.keys(), loc="outside lower center", ncols=4, fontsize=8, frameon=False)
figure.suptitle("SYNTHETIC rides of 100 s at 6 and 9 m/s, hands on, three gyroscopes", fontsize=10)
plt.show()
print(f"{len(TRUE) - len(missed)} of {len(TRUE)} intervals hold the true value. Missed: {', '.join(missed) or 'none'}.")
print(f"Goodness of fit: p = {after.goodness:.3f}; below {RULES.poor_fit:g} the model does not fit the rides.")

# %%
# Square roots of the spectral densities of the steer rate: measured, and of the model before and after the fit. Each
# model has the disturbances and the rider that suit it best. The peak at 6 Hz is wobble.

models = {"before the fit": rides.nominal, "after the fit": after.theta}
spectra = {title: rides.settle((), theta, anew=True).fitted.spectra for title, theta in models.items()}
figure, axes = plt.subplots(1, 2, figsize=(8, 3.8), sharey=True, layout="constrained")
for number, (axis, ride) in enumerate(zip(axes, rides.rides.spectra, strict=True)):
    draw_density(axis, ride, "steer_rate_rad_s", {title: values[number] for title, values in spectra.items()})
    axis.set(title=f"{ride.speed:g} m/s", xlabel="Frequency, Hz")
axes[0].set_ylabel(label_density("steer_rate_rad_s").replace("steer", "Steer"))
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
figure.suptitle("SYNTHETIC rides: spectra of the steer rate", fontsize=10)
plt.show()
