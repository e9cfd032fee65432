"""Samples that are lost, and spikes: a reader and the fits must stand them."""

from dataclasses import dataclass

import numpy as np

from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import RigParameter

SHARE = RigParameter("share", "1", (0.0, 0.01), (0.0, 1.0))
SPIKE = RigParameter("spike", "N", (0.0, 500.0))


@dataclass(frozen=True)
class Dropouts(RigEffect):
    """A ``share`` of the rolling force samples is lost (NaN), and as many are spikes of ``spike`` (N)."""

    share: float = declared(SHARE, 1e-3)
    spike: float = declared(SPIKE, 150.0)

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        n = channels["side_force"].size
        channels["side_force"][rng.random(n) < self.share] = np.nan
        hit = rng.random(n) < self.share
        channels["side_force"][hit] += self.spike * rng.choice([-1.0, 1.0], hit.sum())
