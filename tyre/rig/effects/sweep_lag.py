"""The lag of a rolling tyre: the simulated tyre has one of its own (:class:`tyre.rig.tyre.RigTyre`)."""

from dataclasses import dataclass

from tyre.base.arrays import Array
from tyre.rig.effect import RigEffect
from tyre.rig.regression import Recorded, RigParameter, SweepTerms, Term, needs_sweep

LENGTH = RigParameter("relaxation_length", "m", (0.0, 0.2), (0.0, 2.0), least=0.005)


def _needs(recorded: Recorded) -> str:
    if not recorded.speeds and recorded.sweeps:
        return "the rolling speed is not recorded; give speed_km_h in the sidecar"
    return needs_sweep(recorded)


def _sweep(terms: SweepTerms, *, relaxation_length: Array) -> None:
    terms.add(relaxation_length=relaxation_length)


@dataclass(frozen=True)
class SweepLag(RigEffect):
    """The force follows slip over the relaxation length, (length / v) dF/dt + F = F_steady (Dell'Orto et al., eq. 1).

    Where the reference knows the length, the effect is there or not, and its size is no question.
    """

    terms = (
        Term(
            "sweep_lag", "the side force of a rolling tyre follows slip over the relaxation length",
            (LENGTH,), sweep=_sweep, needs=_needs,
        ),
    )  # fmt: skip
