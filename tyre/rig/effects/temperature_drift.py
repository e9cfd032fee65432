"""A tyre that warms along a recording."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import RigParameter, SweepTerms, Term, needs_sweep

RISE = RigParameter("rise", "K", (0.0, 20.0))
PER_KELVIN = RigParameter("per_kelvin", "1/K", (-0.01, 0.01))
CHANGE = RigParameter("change", "1", (-0.02, 0.02), least=0.001)


def _sweep(terms: SweepTerms, *, change: Array) -> None:
    terms.add(warming=change)


@dataclass(frozen=True)
class TemperatureDrift(RigEffect):
    """The tyre warms by ``rise`` (K) along a rolling recording and its force changes by ``per_kelvin`` (1/K).

    The force is right at the condition's temperature, which is reached in the middle of the recording. A fit sees the
    relative ``change`` from begin to end.
    """

    rise: float = declared(RISE, 3.0)
    per_kelvin: float = declared(PER_KELVIN, -0.002)

    terms = (
        Term(
            "temperature_drift", "the side force grows or falls along the recording as the tyre warms",
            (CHANGE,), sweep=_sweep, needs=needs_sweep,
        ),
    )  # fmt: skip

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        time = channels["time"]
        warming = self.rise * ((time - time[0]) / (time[-1] - time[0]) - 0.5)
        channels["side_force"] *= 1.0 + self.per_kelvin * warming
        channels["temperature"] = channels["temperature"] + warming
