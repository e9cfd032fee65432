"""Scatter between recordings of one tyre."""

from dataclasses import dataclass, replace

import numpy as np

from tyre.recordings.recording import Condition
from tyre.rig.effect import RigEffect, declared
from tyre.rig.regression import RigParameter
from tyre.rig.tyre import RigTyre

SD = RigParameter("sd", "1", (0.0, 0.02), (0.0, 0.5))


@dataclass(frozen=True)
class Remounting(RigEffect):
    """Repeatability: every recording sees a remounted tyre, C and K off by a relative standard deviation ``sd``."""

    sd: float = declared(SD, 0.005)

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        c, k = 1.0 + self.sd * rng.standard_normal(2)
        return replace(
            tyre, cornering_stiffness=c * tyre.cornering_stiffness, lateral_stiffness=k * tyre.lateral_stiffness
        )
