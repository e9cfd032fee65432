"""Play between the wheel and the sensor of its angle."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import Recorded, RigParameter, SweepTerms, Term, needs_sweep

HALF_GAP = RigParameter("half_gap", "rad", (0.0, 1e-3), (0.0, 0.02), least=1e-5)


def _needs(recorded: Recorded) -> str:
    if not recorded.both_branches and recorded.sweeps:
        return "one branch alone: the same as ply_steer"
    return needs_sweep(recorded)


def _sweep(terms: SweepTerms, *, half_gap: Array) -> None:
    terms.add(half_gap=half_gap)


@dataclass(frozen=True)
class SteeringPlay(RigEffect):
    """The sensor is ahead of the wheel by ``half_gap`` (rad) in whichever direction it turns.

    In a slip step the sensor stays ahead after it has come to rest.
    """

    half_gap: float = declared(HALF_GAP, 5e-4)

    terms = (
        Term(
            "steering_play", "the slip of the wheel stays behind that of the sensor by the same angle at any rate",
            (HALF_GAP,), sweep=_sweep, needs=_needs,
        ),
    )  # fmt: skip

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        steps = np.sign(np.diff(channels["slip_angle"], prepend=0.0))
        last = np.maximum.accumulate(np.where(steps != 0, np.arange(len(steps)), 0))
        channels["slip_angle"] = channels["slip_angle"] + self.half_gap * steps[last]
