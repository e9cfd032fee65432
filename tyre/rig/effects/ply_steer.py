"""Offsets of the side-force curve, as ply-steer and conicity of the tyre give."""

from dataclasses import dataclass, replace

import numpy as np

from tyre.base.arrays import Array
from tyre.recordings.recording import Condition
from tyre.rig.effect import RigEffect, declared
from tyre.rig.regression import RigParameter, SweepTerms, Term, needs_sweep
from tyre.rig.tyre import RigTyre

FORCE = RigParameter("force", "N", (-24.0, 24.0), least=0.2)
SLIP = RigParameter("slip", "rad", (-3e-3, 3e-3), least=2e-5)


def _turn(terms: SweepTerms, *, slip: Array) -> None:
    terms.add(slip_offset=slip)


def _push(terms: SweepTerms, *, force: Array) -> None:
    terms.add(side_force=force)


@dataclass(frozen=True)
class PlySteer(RigEffect):
    """Offsets of the side-force curve: ``force`` (Sv, N) and ``slip`` (Sh, rad), as ply-steer and conicity give."""

    force: float = declared(FORCE, 8.0)
    slip: float = declared(SLIP, 0.0)

    terms = (
        Term(
            "ply_steer", "the side force vanishes at another slip angle than zero (or the zero of the angle is off)",
            (SLIP,), sweep=_turn, needs=needs_sweep,
        ),
        Term(
            "conicity", "a side force at zero slip (or the zero of the force cell is off)",
            (FORCE,), sweep=_push, needs=needs_sweep,
        ),
    )  # fmt: skip

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        return replace(tyre, offset_force=self.force, offset_slip=self.slip)
