"""Wrong calibration of the sensors."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import PullTerms, RigParameter, SweepTerms, Term, needs_pull, needs_sweep

RANGE = (-0.05, 0.05)
FORCE, SLIP = RigParameter("force", "1", RANGE), RigParameter("slip", "1", RANGE)
DISPLACEMENT = RigParameter("displacement", "1", RANGE)
SCALE = RigParameter("scale", "1", RANGE, least=0.002)  # of any one of them


def _force(terms: SweepTerms | PullTerms, *, scale: Array) -> None:
    terms.add(force_gain=scale)


def _slip(terms: SweepTerms, *, scale: Array) -> None:
    terms.add(slip_gain=scale)


def _load(terms: SweepTerms, *, scale: Array) -> None:
    terms.add(load_gain=scale)


def _displacement(terms: PullTerms, *, scale: Array) -> None:
    terms.add(displacement_gain=scale)


@dataclass(frozen=True)
class SensorGain(RigEffect):
    """Wrong calibration: relative errors of the force, slip-angle and displacement readings, constant in a campaign.

    A wrong gain of the load cell shows in a fit as the stiffness of another load.
    """

    force: float = declared(FORCE, 0.0)
    slip: float = declared(SLIP, 0.0)
    displacement: float = declared(DISPLACEMENT, 0.0)

    terms = (
        Term("force_scale", "gain of the force cell", (SCALE,), sweep=_force, pull=_force),
        Term("slip_scale", "gain of the slip-angle sensor", (SCALE,), sweep=_slip, needs=needs_sweep),
        Term("load_scale", "gain of the load cell", (SCALE,), sweep=_load, needs=needs_sweep),
        Term("displacement_scale", "gain of the displacement gauges", (SCALE,), pull=_displacement, needs=needs_pull),
    )

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] *= 1.0 + self.force
        channels["slip_angle"] *= 1.0 + self.slip

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] *= 1.0 + self.force
        channels["plate_displacement"] *= 1.0 + self.displacement
        channels["rim_displacement"] *= 1.0 + self.displacement
