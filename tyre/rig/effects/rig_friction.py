"""Friction of the rig in a pull test."""

import math
from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.fits.friction import dahl_friction
from tyre.rig.effect import Channels, RigEffect, declared
from tyre.rig.regression import PullTerms, RigParameter, Term, needs_pull

BUILT_UP, SPREAD = 5e-5, math.exp(1.4)  # m over which friction builds up in the middle, and the factor to its ends
FORCE = RigParameter("force", "N", (0.0, 3.0), (0.0, math.inf))
FRICTION = RigParameter("friction", "N", (0.0, 3.0), (0.0, 30.0), least=0.05)
PRESLIDING = RigParameter("presliding", "m", (BUILT_UP / SPREAD, BUILT_UP * SPREAD), (1e-9, 1.0), size=False)


def _pull(terms: PullTerms, *, friction: Array, presliding: Array) -> None:
    terms.add(force=friction[:, None] * dahl_friction(terms.displacement, presliding=presliding))


@dataclass(frozen=True)
class RigFriction(RigEffect):
    """Friction of the rig in the pull test: a loop of +-``force`` (N), developed over ``presliding`` (m) by Dahl's law.

    See :mod:`tyre.fits.friction`. At the origin it shows as stiction. Less than 0.05 N is not worth a name.
    """

    force: float = declared(FORCE, 2.0)
    presliding: float = declared(PRESLIDING, 4e-5)

    terms = (
        Term(
            "rig_friction", "friction of the rig adds to the force of a pull, against the motion",
            (FRICTION, PRESLIDING), pull=_pull, needs=needs_pull,
        ),
    )  # fmt: skip

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        deflection = channels["plate_displacement"] - channels["rim_displacement"]
        channels["side_force"] += self.force * dahl_friction(deflection, presliding=self.presliding, start=0.0)
