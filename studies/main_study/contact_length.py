"""How much the single lag matters: the same tyres as a string in contact over a length, beside the single lag."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bicycle.effect import effect_class
from studies.main_study.cases import TyreCase
from studies.main_study.hinges import End, wobble
from studies.main_study.settings import CONTACT_LENGTH, Settings
from tyre.base.errors import InputError
from tyre.contact_patch import half_length_under_load

WIDEST = 0.9  # of the relaxation length, which contains the half length


@dataclass(frozen=True, eq=False)
class ContactLength:
    """Wobble of one case in the reference world: with the single lag, and with a contact of ``half_length`` (m).

    ``half_length`` is of rear and front wheel; ``estimated`` is whether load, pressure and width of the tyre gave it
    (an upper end, for the casing carries nothing there), else it is the effect's default.
    """

    case: TyreCase
    half_length: tuple[float, float]
    estimated: bool
    lag: End
    string: End


def contact_lengths(settings: Settings, cases: Sequence[TyreCase]) -> tuple[ContactLength, ...]:
    """Compare every case with the default contact, then with its own; none where a model file excludes it."""
    if CONTACT_LENGTH in settings.further:  # every world has it
        return ()
    found = []
    for estimated in (False, True):
        for case in cases:
            half = loaded(settings, case) if estimated else default(case)
            if half is None:
                continue
            longer = replace(settings.reference, contact_half_length=half)
            try:
                lag, string = (wobble(settings, setup, case.contact) for setup in (settings.reference, longer))
            except InputError:  # the file has an aligning moment of its own: there is nothing to compare
                return ()
            found.append(ContactLength(case, half, estimated, lag, string))
    return tuple(found)


def default(case: TyreCase) -> tuple[float, float]:
    """Half the length of the contact (m) of rear and front wheel as the effect assumes it."""
    assumed = next(p.default for p in effect_class(CONTACT_LENGTH).parameters if p.name == "half_length")
    assert isinstance(assumed, float)
    return shortened(case, assumed, assumed)


def loaded(settings: Settings, case: TyreCase) -> tuple[float, float] | None:
    """The same from load, pressure and width; None where they are not known."""
    if not case.properties or case.width is None:
        return None
    rear, front = (
        half_length_under_load(load=p.load, pressure=p.pressure, wheel_radius=radius, tyre_width=case.width)
        for p, radius in zip(case.properties, (settings.bicycle["rR"], settings.bicycle["rF"]), strict=True)
    )
    return shortened(case, rear, front)


def shortened(case: TyreCase, rear: float, front: float) -> tuple[float, float]:
    """Half lengths that the relaxation lengths can contain, of those wanted at ``rear`` and ``front``, m."""
    return min(rear, WIDEST * float(case.contact[1])), min(front, WIDEST * float(case.contact[3]))
