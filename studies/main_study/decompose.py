"""What causes a change between two pressures: the relaxation length, the cornering stiffness, or both together."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bicycle.critical.critical_speeds import critical_speeds
from studies.main_study.assemble import build
from studies.main_study.bands import WOBBLE, wobble_edges
from studies.main_study.cases import TyreCase
from studies.main_study.settings import Settings, Setup
from studies.main_study.solve import Result, damping_ratio, nearest, oscillations
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
    ``critical_speed_m_s``; ``name`` says which.
    """

    name: str
    quantity: str
    before: float
    after: float
    stiffness_part: float
    length_part: float

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

    def change(self, name: str, quantity: str = CRITICAL) -> Change | None:
        """The change of one quantity; None where it does not exist at both pressures and in between.

        Parameters
        ----------
        name : str
            Of a mode, or of a critical speed as :func:`named_speeds` calls it.
        quantity : str, optional
        """
        return next((c for c in self.changes if (c.name, c.quantity) == (name, quantity)), None)


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
    for name, start in speeds[0].items():
        if all(name in corner for corner in speeds):
            end, stiffness, length = (corner[name] for corner in speeds[1:])
            change = Change(name, CRITICAL, start, end, stiffness - start, length - start)
            if change.of_one_crossing:
                changes.append(change)
    at_lower = oscillations(lower.modes, -1)
    for mode, eigenvalue in oscillations(higher.modes, -1).items():
        roots = [follow(settings, setup, before, to, eigenvalue) for to in (after, only_stiffness, only_length)]
        if mode in at_lower and abs(roots[0] - at_lower[mode]) < SAME * abs(roots[0]):  # else another root has the name
            ratios = [damping_ratio(value) for value in (eigenvalue, *roots)]
            changes.append(Change(mode, DAMPING, ratios[0], ratios[1], ratios[2] - ratios[0], ratios[3] - ratios[0]))
    return Decomposition(higher.case, lower.case, setup, tuple(changes))


def named_speeds(crossings: Iterable[Any]) -> dict[str, float]:
    """Speeds (m/s) of ``crossings``, named by mode, direction and, where a mode crosses several times, a number."""
    values: dict[str, float] = {}
    every = list(crossings)
    wobbles = [id(edge) for edge in wobble_edges(every)]
    for crossing in every:
        mode = WOBBLE if id(crossing) in wobbles else crossing.mode
        name = f"{mode} {'unstable' if crossing.direction == 'destabilising' else 'stable'} above"
        number = 1 + sum(key.startswith(name) for key in values)
        values[name if number == 1 else f"{name} ({number})"] = float(crossing.speed)
    return values


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
