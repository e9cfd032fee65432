"""A force cell whose gain differs between push and pull."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import Recorded, RigParameter, SweepTerms, Term, needs_sweep

DIFFERENCE = RigParameter("difference", "1", (-0.05, 0.05), (-0.5, 0.5), least=0.002)


def _needs(recorded: Recorded) -> str:
    if recorded.sweeps and not recorded.both_signs:
        return "every sweep has slip angles of one sign, where it is another gain of the force cell"
    return needs_sweep(recorded)


def _sweep(terms: SweepTerms, *, difference: Array) -> None:
    terms.add(gain_by_sign=difference)


@dataclass(frozen=True)
class ForceGainBySign(RigEffect):
    """A side force to the right is read 1 + ``difference``/2 times, one to the left 1 - ``difference``/2 times.

    As a cell with another calibration in push than in pull does it, or an amplifier that nears its end. A pull test has
    one sign: there it is a matter of gain.
    """

    difference: float = declared(DIFFERENCE, 0.02)

    terms = (
        Term(
            "force_gain_by_sign", "the force cell has one gain for forces to the right and another to the left",
            (DIFFERENCE,), sweep=_sweep, needs=_needs,
        ),
    )  # fmt: skip

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        force = channels["side_force"]
        force *= np.where(force > 0, 1 + self.difference / 2, 1 - self.difference / 2)
