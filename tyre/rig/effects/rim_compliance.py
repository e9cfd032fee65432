"""A rim and a fixture that give way."""

import math
from dataclasses import dataclass, replace

import numpy as np

from tyre.base.arrays import Array
from tyre.recordings.recording import Condition
from tyre.rig.effect import RigEffect, declared
from tyre.rig.regression import PullTerms, RigParameter, SweepTerms, Term, needs_pull
from tyre.rig.tyre import RigTyre

STIFFNESS = RigParameter("stiffness", "N/m", (5e4, math.inf), (1e3, math.inf), size=False)
COMPLIANCE = RigParameter("compliance", "m/N", (0.0, 2e-5), (0.0, 2e-4), least=1e-7)


def _add(terms: SweepTerms | PullTerms, *, compliance: Array) -> None:
    terms.add(compliance=compliance)


@dataclass(frozen=True)
class RimCompliance(RigEffect):
    """A rim of lateral ``stiffness`` (N/m; default: a stiff laboratory rim) in series with the tyre.

    It moves by F / stiffness in the pull test, and lengthens the relaxation of the rolling wheel to
    C (1/K_y + 1/K_rim).
    """

    stiffness: float = declared(STIFFNESS, 6e6)

    terms = (
        Term(
            "rim_compliance", "rim and fixture move by compliance times force, in series with the tyre",
            (COMPLIANCE,), sweep=_add, pull=_add, needs=needs_pull,
        ),
    )  # fmt: skip

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        return replace(tyre, rim_stiffness=self.stiffness)
