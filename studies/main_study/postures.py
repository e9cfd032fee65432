"""Does the posture matter: the same frame and rider upright, on the hoods and in the drops."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bicycle.parameters import Bicycle
from studies.main_study.cases import TyreCase, tyre_cases
from studies.main_study.hinges import End, wobble
from studies.main_study.settings import Settings
from tyre.base.errors import InputError


@dataclass(frozen=True, eq=False)
class Posture:
    """A rider's posture as a bicycle, and its wobble in the reference world; None where the tyre says nothing."""

    bicycle: Bicycle
    end: End | None
    extrapolated: bool


def postures(settings: Settings, focus: TyreCase) -> tuple[Posture, ...]:
    """Wobble in each posture, on the tyre in focus at the wheel loads of that posture."""
    found = []
    for bicycle in settings.postures:
        own = replace(settings, bicycle=bicycle)
        try:
            case = same_condition(tyre_cases(own).found, focus)
            found.append(Posture(bicycle, wobble(own, own.reference, case.contact), case.extrapolated))
        except InputError:
            found.append(Posture(bicycle, None, True))
    return tuple(found)


def same_condition(cases: Sequence[TyreCase], focus: TyreCase) -> TyreCase:
    """The case of the same tyre and pressure.

    Raises
    ------
    InputError
        It cannot be evaluated at these wheel loads.
    """
    for case in cases:
        if (case.name, case.condition) == (focus.name, focus.condition):
            return case
    raise InputError(f"{focus.name} says nothing at {focus.condition} and these wheel loads")
