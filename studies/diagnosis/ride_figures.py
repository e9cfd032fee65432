"""Figure of the spectra of rides: measured densities with their scatter, and those of the models."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import chdtri

from bicycle.identification.tapered_spectra import RideSpectrum
from studies.diagnosis.figures import legend_above, models_of, plain_ticks
from studies.inference.judge import Judgement
from studies.inference.kind import Figure
from studies.reporting.plotting import GREY, drawing, look
from tyre.ground.arrays import Complex

MOST_RIDES = 3


def draw_density(axis: Any, ride: RideSpectrum, name: str, models: Mapping[str, Complex]) -> None:
    """Draw the root of the density of the channel ``name`` with its 95 % interval, and those of ``models``.

    ``models`` holds spectra (b, C, C) of all channels at the bands of the ``ride``, by the title of their line.
    """
    channel = ride.channels.index(name)
    low, high = (2 * ride.averages / chdtri(2 * ride.averages, p) for p in (0.025, 0.975))
    density = ride.values[:, channel, channel].real
    band = np.sqrt(density * low), np.sqrt(density * high)
    axis.fill_between(ride.hertz, *band, color=GREY, alpha=0.4, linewidth=0, label="measured, 95 %")
    for k, (title, spectra) in enumerate(models.items()):
        line = {**look(k).plot, "marker": ""}
        axis.plot(ride.hertz, np.sqrt(spectra[:, channel, channel].real), **line, label=title)
    axis.set(xscale="log", yscale="log")
    plain_ticks(axis.xaxis, 1.0, 2.0, 5.0)
    plain_ticks(axis.yaxis, 1.0, 3.0)


def label_density(name: str) -> str:
    """Quantity and unit of the root of the density of the channel ``name``."""
    quantity, _, _ = name.partition("_rad")
    unit = {"steer_rad": "rad", "lean_rad": "rad", "steer_torque_N_m": "N m"}.get(name, "rad/s")
    return f"{quantity.removesuffix('_N_m').replace('_', ' ')}, {unit} / \u221aHz"


def draw_densities(judgement: Judgement, target: Path) -> bool:
    """Roots of the densities of each channel over frequency, at most three rides."""
    kind: Any = judgement.kind
    rides = kind.rides.spectra
    shown = sorted({0, len(rides) // 2, len(rides) - 1})[:MOST_RIDES]
    models = {title: kind.settle(*model, anew=True).fitted.spectra for title, model in models_of(judgement).items()}
    channels = kind.channels
    with drawing(target, width=1.2 + 3.2 * max(len(shown), 2), height=1.2 + 2.3 * len(channels)) as figure:
        axes = figure.subplots(len(channels), len(shown), squeeze=False, sharex=True)
        for column, number in enumerate(shown):
            ride = rides[number]
            of_ride = {title: spectra[number] for title, spectra in models.items()}
            for row, name in enumerate(channels):
                axis = axes[row, column]
                draw_density(axis, ride, name, of_ride)
                if not row:
                    axis.set_title(f"{ride.speed:.3g} m/s")
                if not column:
                    axis.set_ylabel(label_density(name))
        for axis in axes[-1]:
            axis.set_xlabel("frequency, Hz")
        legend_above(figure, axes[0, 0], columns=4)
    return True


DENSITIES: Figure = (
    draw_densities,
    "Roots of the spectral densities of each channel, measured with their 95 % interval, and of the models with the "
    "disturbances that suit each best.",
)
