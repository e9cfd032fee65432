"""A force that is recorded late."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import RigParameter, SweepTerms, Term, needs_sweep

DELAY = RigParameter("delay", "s", (-0.01, 0.01), least=5e-4)


def _sweep(terms: SweepTerms, *, delay: Array) -> None:
    terms.add(delay=delay)


@dataclass(frozen=True)
class ChannelDelay(RigEffect):
    """The side force of a rolling recording is written down ``delay`` (s) after the slip angle, as a filter does it."""

    delay: float = declared(DELAY, 0.01)

    terms = (
        Term(
            "channel_delay", "the force is recorded later than the slip angle",
            (DELAY,), sweep=_sweep, needs=needs_sweep,
        ),
    )  # fmt: skip

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        time = channels["time"]
        channels["side_force"] = np.interp(time - self.delay, time, channels["side_force"])
