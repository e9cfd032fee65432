"""Cornering stiffness at a load that the reference does not have: a matter of the tyre, so nothing is simulated."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.rig.effect import RigEffect
from tyre.rig.regression import Recorded, RigParameter, SweepTerms, Term, needs_sweep

EXPONENT = RigParameter("exponent", "1", (-1.0, 1.0), (-1.0, 3.0), least=0.02)


def _needs(recorded: Recorded) -> str:
    if not recorded.other_loads and recorded.sweeps:
        return "the reference covers the loads of the recordings"
    return needs_sweep(recorded)


def _sweep(terms: SweepTerms, *, exponent: Array) -> None:
    terms.add(log_stiffness=exponent * np.log(terms.load_ratio))


@dataclass(frozen=True)
class LoadDependence(RigEffect):
    """Cornering stiffness grows with load as load^exponent from the reference's load."""

    terms = (
        Term(
            "load_dependence", "cornering stiffness grows with load as load^exponent from the reference's load",
            (EXPONENT,), sweep=_sweep, needs=_needs,
        ),
    )  # fmt: skip
