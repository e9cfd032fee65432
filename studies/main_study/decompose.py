"""What causes a change between two pressures: the relaxation length, the cornering stiffness, or both together."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed, CrossingIdentity, identified
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.oscillation import damping_ratio
from studies.main_study.assemble import build
from studies.main_study.bands import WOBBLE, is_wobble
from studies.main_study.cases import TyreCase
from studies.main_study.settings import Settings, Setup
from studies.main_study.solve import Result, nearest, oscillations
from tyre.base.arrays import Array

DAMPING = "damping_ratio"
CRITICAL = "critical_speed_m_s"
STEPS = 16  # on the way from one set of tyre numbers to another
SAME = 1e-6
SMALLEST = 0.01  # m/s: below it nothing is said of what causes a change


@dataclass(frozen=True)
class Change:
    """Change of one quantity between two pressures, split by varying one pair of tyre numbers and holding the other.

    ``stiffness_part`` varies the cornering stiffness alone and ``length_part`` the relaxation length alone, both from
    the higher pressure; ``interaction`` is what is left of ``total``. ``quantity`` is ``damping_ratio`` or
    ``critical_speed_m_s``; ``of`` says of which mode, or which critical speed.
    """

    of: str | CrossingIdentity
    quantity: str
    before: float
    after: float
    stiffness_part: float
    length_part: float

    @property
    def name(self) -> str:
        """What changes, in words."""
        return str(self.of)

    @property
    def total(self) -> float:
        """After minus before."""
        return self.after - self.before

    @property
    def interaction(self) -> float:
        """What neither part explains alone."""
        return self.total - self.stiffness_part - self.length_part

    @property
    def of_one_crossing(self) -> bool:
        """False where what neither part explains is most of it: a band went, and another crossing has its name."""
        alone = abs(self.stiffness_part) + abs(self.length_part)
        return abs(self.interaction) <= max(alone, SMALLEST)


@dataclass(frozen=True, eq=False)
class Decomposition:
    """All changes of one tyre in one setup, from pressure ``higher`` to ``lower``."""

    higher: TyreCase
    lower: TyreCase
    setup: Setup
    changes: tuple[Change, ...]

    def change(self, of: str | CrossingIdentity, quantity: str = CRITICAL) -> Change | None:
        """The change of one quantity; None where it does not exist at both pressures and in between.

        Parameters
        ----------
        of : str or CrossingIdentity
            A mode, or a critical speed as :func:`named_speeds` tells it from others.
        quantity : str, optional
        """
        return next((c for c in self.changes if (c.of, c.quantity) == (of, quantity)), None)


def decompose(settings: Settings, higher: Result, lower: Result) -> Decomposition:
    """Split the changes from the higher to the lower pressure into the parts of C and of the relaxation length."""
    before, after, setup = higher.case.contact, lower.case.contact, higher.setup
    only_stiffness, only_length = before.copy(), before.copy()
    only_stiffness[0::2] = after[0::2]
    only_length[1::2] = after[1::2]
    speeds = [named_speeds(higher.crossings), named_speeds(lower.crossings)]
    for contact in (only_stiffness, only_length):
        speeds.append(named_speeds(critical_speeds(build(settings, setup, contact), max_speed=settings.max_speed)))
    changes = []
    for which, start in speeds[0].items():
        if all(which in corner for corner in speeds):
            end, stiffness, length = (corner[which] for corner in speeds[1:])
            change = Change(which, CRITICAL, start, end, stiffness - start, length - start)
            if change.of_one_crossing:
                changes.append(change)
    at_lower = oscillations(lower.modes, -1)
    for mode, eigenvalue in oscillations(higher.modes, -1).items():
        roots = [follow(settings, setup, before, to, eigenvalue) for to in (after, only_stiffness, only_length)]
        if mode in at_lower and abs(roots[0] - at_lower[mode]) < SAME * abs(roots[0]):  # else another root has the name
            ratios = [float(damping_ratio(value)) for value in (eigenvalue, *roots)]
            changes.append(Change(mode, DAMPING, ratios[0], ratios[1], ratios[2] - ratios[0], ratios[3] - ratios[0]))
    return Decomposition(higher.case, lower.case, setup, tuple(changes))


def named_speeds(crossings: Iterable[CriticalSpeed]) -> dict[CrossingIdentity, float]:
    """Critical speeds (m/s) by what tells them apart; what ends or begins unstable wobble counts as wobble's."""
    every = identified(crossing.named(WOBBLE) if is_wobble(crossing) else crossing for crossing in crossings)
    return {which: float(crossing.speed) for which, crossing in every.items()}


def follow(settings: Settings, setup: Setup, start: Array, end: Array, eigenvalue: complex) -> complex:
    """What an oscillation at the report speed becomes as the tyre's numbers change.

    Parameters
    ----------
    settings : Settings
    setup : Setup
    start, end : ndarray, shape (4,)
        Tyre numbers in the order of :data:`studies.main_study.cases.CONTACT`.
    eigenvalue : complex
        At the start, 1/s.
    """
    for share in np.linspace(0, 1, STEPS + 1)[1:]:
        eigenvalue = nearest(build(settings, setup, start + share * (end - start)), settings.report_speed, eigenvalue)
    return eigenvalue
