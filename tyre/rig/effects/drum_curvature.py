"""Cornering stiffness on a drum."""

from dataclasses import dataclass, replace

import numpy as np

from tyre.base.arrays import Array
from tyre.drum import flat_over_drum
from tyre.recordings.recording import Condition
from tyre.rig.effect import RigEffect, declared
from tyre.rig.regression import Recorded, RigParameter, SweepTerms, Term, needs_sweep
from tyre.rig.tyre import RigTyre

EXPONENT = RigParameter("exponent", "1", (0.0, 1.2), (0.0, 3.0), least=0.02)
WHEEL_RADIUS = RigParameter("wheel_radius", "m", (0.3, 0.36), (0.05, 1.0), size=False)


def _needs(recorded: Recorded) -> str:
    if not recorded.other_track and recorded.sweeps:
        return "recordings and reference are of the same curvature of track"
    return needs_sweep(recorded)


def _sweep(terms: SweepTerms, *, exponent: Array) -> None:
    terms.add(log_stiffness=-exponent * terms.track_curvature)


@dataclass(frozen=True)
class DrumCurvature(RigEffect):
    """Cornering stiffness falls on a drum: C_drum = C_flat / (1 + R / R_drum)^exponent.

    Empirical form of physics.md section 3; lateral stiffness unchanged, so the relaxation length falls alike.
    """

    exponent: float = declared(EXPONENT, 0.6)
    wheel_radius: float = declared(WHEEL_RADIUS, 0.34)

    terms = (
        Term(
            "drum_curvature",
            "cornering stiffness on a drum of radius Rd is that of a flat track over (1 + R / Rd)^exponent",
            (EXPONENT,), sweep=_sweep, needs=_needs,
        ),
    )  # fmt: skip

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        if condition.surface != "drum" or condition.drum_radius is None:
            return tyre
        ratio = flat_over_drum(
            exponent=self.exponent, wheel_radius=self.wheel_radius, drum_radius=condition.drum_radius
        )
        return replace(tyre, cornering_stiffness=tyre.cornering_stiffness / float(ratio))
