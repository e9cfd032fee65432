"""Noise of the channels: every fit has it, so it is no candidate."""

from dataclasses import dataclass

import numpy as np

from tyre.fits.noise import draw_ar1
from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import RigParameter

POSITIVE = (0.0, np.inf)


@dataclass(frozen=True)
class Noise(RigEffect):
    """White and first-order autoregressive noise of the rolling channels, white noise of the force in a pull test.

    ``white`` and ``correlated`` in N (standard deviations), ``correlation_time`` in s, ``slip`` in rad, ``load``,
    ``moment`` in N m, ``pull`` in N.
    """

    white: float = declared(RigParameter("white", "N", (0.0, 10.0), POSITIVE), 3.0)
    correlated: float = declared(RigParameter("correlated", "N", (0.0, 10.0), POSITIVE), 2.0)
    correlation_time: float = declared(
        RigParameter("correlation_time", "s", (0.05, 5.0), (1e-6, np.inf), size=False), 0.3
    )
    slip: float = declared(RigParameter("slip", "rad", (0.0, 1e-3), POSITIVE), 2e-4)
    load: float = declared(RigParameter("load", "N", (0.0, 10.0), POSITIVE), 3.0)
    moment: float = declared(RigParameter("moment", "N m", (0.0, 0.5), POSITIVE), 0.1)
    pull: float = declared(RigParameter("pull", "N", (0.0, 1.0), POSITIVE), 0.3)

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        n = channels["time"].size
        step = (channels["time"][-1] - channels["time"][0]) / (n - 1)
        correlated = draw_ar1(n, memory=float(np.exp(-step / self.correlation_time)), rng=rng)
        channels["side_force"] += self.white * rng.standard_normal(n) + self.correlated * correlated
        channels["slip_angle"] += self.slip * rng.standard_normal(n)
        channels["vertical_load"] += self.load * rng.standard_normal(n)
        channels["aligning_moment"] += self.moment * rng.standard_normal(n)

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] += self.pull * rng.standard_normal(channels["side_force"].size)
