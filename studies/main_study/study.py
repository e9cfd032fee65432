"""The main study: measured tyres at three pressures -> modes, critical speeds, and what causes their change.

No physics lives here: cases are made in ``cases``, solved in ``solve``.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bicycle.critical import critical_speeds
from studies.main_study.cases import Array, Front, Settings, Setup, TyreCase, build, tyre_cases
from studies.main_study.checks import Check, check, chosen
from studies.main_study.solve import COMPARED_MODES, Result, damping_ratio, nearest, oscillations, solve

Step = Callable[[str], None]
DAMPING = "damping_ratio"
CRITICAL = "critical_speed_m_s"
STEPS = 16  # on the way from one set of tyre numbers to another
SAME = 1e-6


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


@dataclass(frozen=True, eq=False)
class Decomposition:
    """All changes of one tyre in one setup, from pressure ``higher`` to ``lower``."""

    higher: TyreCase
    lower: TyreCase
    setup: Setup
    changes: tuple[Change, ...]

    def change(self, name: str, quantity: str = CRITICAL) -> Change | None:
        """The change of one quantity; None where it does not exist at both pressures and in between."""
        return next((c for c in self.changes if (c.name, c.quantity) == (name, quantity)), None)


@dataclass(frozen=True, eq=False)
class Alternative:
    """One tyre at two pressures with another assumed front: first onset and last end of unstable wobble, m/s."""

    what: str
    case: TyreCase
    front: Front
    onset: float | None
    end: float | None


@dataclass(frozen=True, eq=False)
class Study:
    """Everything the main study found."""

    settings: Settings
    cases: tuple[TyreCase, ...]
    results: tuple[Result, ...]
    decompositions: tuple[Decomposition, ...]
    alternatives: tuple[Alternative, ...]
    checks: tuple[Check, ...]

    @property
    def names(self) -> list[str]:
        """Tyres with their surfaces, in order."""
        return list(dict.fromkeys(case.name for case in self.cases))

    @property
    def pressures(self) -> list[float]:
        """All pressures, bar, ascending."""
        return sorted({case.pressure_bar for case in self.cases})

    def of(self, setup: Setup, name: str | None = None) -> list[Result]:
        """Results of one setup, of one tyre and surface if named, by rising pressure."""
        return [r for r in self.results if r.setup == setup and name in (None, r.case.name)]

    def decomposition(self, setup: Setup, name: str) -> Decomposition | None:
        """The decomposition of one tyre and surface; None where it was measured at one pressure only."""
        return next((d for d in self.decompositions if d.setup == setup and d.higher.name == name), None)


def run_study(settings: Settings, step: Step = lambda what: None) -> Study:
    """Compute the study; ``step`` is told of every piece of work done (see :func:`count_steps`)."""
    cases = tyre_cases(settings.bicycle, settings.tyres)
    results = []
    for setup in settings.setups:
        for case in cases:
            results.append(solve(settings, case, setup))
            step(f"{case.name}, {case.pressure_bar:g} bar")
    decompositions = []
    for setup in settings.setups:
        solved = {result.case: result for result in results if result.setup == setup}
        for higher, lower in pressure_ends(cases):
            decompositions.append(decompose(settings, solved[higher], solved[lower]))
            step(f"{higher.name}: what causes the change")
    alternatives = tuple(other_fronts(settings, *pressure_ends(cases)[0]))
    step("other fronts")
    checks = tuple(check(settings, result) for result in chosen(results))
    step("Monte Carlo")
    return Study(settings, tuple(cases), tuple(results), tuple(decompositions), alternatives, checks)


def count_steps(settings: Settings) -> int:
    """How often :func:`run_study` reports a step."""
    cases = tyre_cases(settings.bicycle, settings.tyres)
    return len(settings.setups) * (len(cases) + len(pressure_ends(cases))) + 2


def pressure_ends(cases: list[TyreCase]) -> list[tuple[TyreCase, TyreCase]]:
    """For each tyre and surface its case of highest and of lowest pressure."""
    ends = []
    for name in dict.fromkeys(case.name for case in cases):
        mine = sorted((case for case in cases if case.name == name), key=lambda case: case.pressure_bar)
        if len(mine) > 1:
            ends.append((mine[-1], mine[0]))
    return ends


def decompose(settings: Settings, higher: Result, lower: Result) -> Decomposition:
    """Split the changes from the higher to the lower pressure into the parts of C and of the relaxation length."""
    before, after, setup = higher.case.contact, lower.case.contact, higher.setup
    only_stiffness, only_length = before.copy(), before.copy()
    only_stiffness[0::2] = after[0::2]
    only_length[1::2] = after[1::2]
    speeds = [named_speeds(higher.crossings), named_speeds(lower.crossings)]
    for contact in (only_stiffness, only_length):
        model = build(settings.bicycle, setup, contact)
        speeds.append(named_speeds(critical_speeds(model, max_speed=settings.max_speed)))
    changes = []
    for name, start in speeds[0].items():
        if all(name in corner for corner in speeds):
            end, stiffness, length = (corner[name] for corner in speeds[1:])
            changes.append(Change(name, CRITICAL, start, end, stiffness - start, length - start))
    at_lower = oscillations(lower.modes, -1)
    for mode, eigenvalue in oscillations(higher.modes, -1).items():
        roots = [follow(settings, setup, before, to, eigenvalue) for to in (after, only_stiffness, only_length)]
        if mode in at_lower and abs(roots[0] - at_lower[mode]) < SAME * abs(roots[0]):  # else another root has the name
            ratios = [damping_ratio(value) for value in (eigenvalue, *roots)]
            changes.append(Change(mode, DAMPING, ratios[0], ratios[1], ratios[2] - ratios[0], ratios[3] - ratios[0]))
    return Decomposition(higher.case, lower.case, setup, tuple(changes))


def named_speeds(crossings: Iterable[Any]) -> dict[str, float]:
    """Critical speeds (m/s), named by mode, direction and, where a mode crosses several times, a number."""
    values: dict[str, float] = {}
    for crossing in crossings:
        name = f"{crossing.mode} {'unstable' if crossing.direction == 'destabilising' else 'stable'} above"
        number = 1 + sum(key.startswith(name) for key in values)
        values[name if number == 1 else f"{name} ({number})"] = float(crossing.speed)
    return values


def follow(settings: Settings, setup: Setup, start: Array, end: Array, eigenvalue: complex) -> complex:
    """What an eigenvalue (1/s, at the report speed) becomes as the tyre numbers go from ``start`` to ``end``."""
    for share in np.linspace(0, 1, STEPS + 1)[1:]:
        model = build(settings.bicycle, setup, start + share * (end - start))
        eigenvalue = nearest(model, settings.report_speed, eigenvalue)
    return eigenvalue


def other_fronts(settings: Settings, higher: TyreCase, lower: TyreCase) -> Iterator[Alternative]:
    """Unstable wobble with the front assumptions halved and doubled, for one tyre at two pressures."""
    front = settings.front
    variants = {"as assumed": front}
    for factor, word in ((0.5, "half"), (2.0, "twice")):
        variants[f"{word} the stiffness"] = replace(front, stiffness=factor * front.stiffness)
        variants[f"{word} the damping"] = replace(front, damping=factor * front.damping)
    for shift in (-0.1, 0.1):
        variants[f"hinge {abs(shift):g} m {'higher' if shift > 0 else 'lower'}"] = replace(
            front, joint_height=front.joint_height + shift
        )
    for what, variant in variants.items():
        for case in (higher, lower):
            setup = Setup(variant, settings.camber_shares[-1])
            model = build(settings.bicycle, setup, case.contact)
            wobble = [c for c in critical_speeds(model, max_speed=settings.max_speed) if c.mode == COMPARED_MODES[0]]
            starts = [float(c.speed) for c in wobble if c.direction == "destabilising"]
            ends = [float(c.speed) for c in wobble if c.direction != "destabilising"]
            yield Alternative(what, case, variant, min(starts, default=None), max(ends, default=None))
