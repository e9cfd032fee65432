"""A load cell whose zero walks: every fit has it among what floats, so it is no candidate."""

from dataclasses import dataclass

import numpy as np

from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import RigParameter

RATE = RigParameter("rate", "N/min", (-5.0, 5.0))


@dataclass(frozen=True)
class LoadCellDrift(RigEffect):
    """The zero of the side-force cell walks by ``rate`` (N per minute)."""

    rate: float = declared(RATE, 2.0)

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] += self.rate / 60.0 * (channels["time"] - channels["time"][0])

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] += self.rate / 60.0 * (channels["time"] - channels["time"][0])
