"""
My bicycle, measured in half an hour
====================================

How the band of wobble onset narrows with each measurement: front frame, steering friction, hands. The numbers and their
uncertainties are assumed, as a half-hour test gives them; they are not of a real bicycle. :doc:`/front_frame` says how
to measure.
"""

import tempfile
from pathlib import Path

from matplotlib import pyplot as plt

from studies.main_study import sample_bicycles, settings_of, tyre_cases

FRONT = """[effects.front_compliance]
stiffness = "5000(80)"
damping_ratio = "0.25(0.013)"
joint_x = 0.864
joint_z = "-0.65(0.004)"
"""
FRICTION = '[effects.steer_damper]\ndamping = "0.15(0.02)"\n'
HANDS = '[effects.rider_arms]\ninertia = "0.1(0.009)"\nstiffness = "5(0.5)"\ndamping = "1(0.09)"\n'
steps = {
    "nothing measured": "",
    "front frame": FRONT,
    "front frame,\nsteering friction": FRONT + FRICTION,
    "front frame,\nsteering friction, hands": FRONT + FRICTION + HANDS,
}

figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
for row, effects in enumerate(steps.values()):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mine.toml"
        file.write_text(f'bicycle = "pista_charlie_drops"\n{effects}', encoding="utf-8")
        settings = settings_of(str(file), tyre="Tyre1", pressures="5.5")
    case = tyre_cases(settings).studied[0]
    for offset, colour, hands, setup in zip((-0.17, 0.17), ("C0", "C3"), ("off", "on"), settings.setups, strict=False):
        samples = sample_bicycles(settings, case, setup)
        band = samples.interval("onset")
        share = f"{100 * samples.wobbling_share:.0f} % wobble, hands {hands}"
        if band and band[1] > band[0]:
            axes.barh(row + offset, band[1] - band[0], left=band[0], height=0.3, color=colour)
            share = f"{band[0]:.1f} to {band[1]:.1f} m/s; {share}"
        axes.text(20.3, row + offset, share, va="center", fontsize=8, color=colour)
axes.set_yticks(range(len(steps)), list(steps))
axes.set_ylim(len(steps) - 0.5, -0.5)
axes.set(xlim=(3, 20), xlabel="Onset of wobble (growth of 0.5 1/s), m/s: 90 % of the samples that wobble")
figure.suptitle("Pista, rider in the drops, Tyre1 at 5.5 bar; hands relaxed; measurements assumed", fontsize=10)
plt.show()
