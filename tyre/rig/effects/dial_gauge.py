"""Gauges that are read off in steps."""

from dataclasses import dataclass

import numpy as np

from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import RigParameter

RESOLUTION = RigParameter("resolution", "m", (1e-6, 1e-4), (1e-12, 1.0), size=False)


@dataclass(frozen=True)
class DialGauge(RigEffect):
    """Displacements are read off to the nearest ``resolution`` (m)."""

    resolution: float = declared(RESOLUTION, 1e-5)

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        for name in ("plate_displacement", "rim_displacement"):
            channels[name] = np.round(channels[name] / self.resolution) * self.resolution
