"""What the answer hinges on: one thing changed at a time, from one end of its range to the other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.modal.named_modes import modes
from studies.main_study.assemble import build
from studies.main_study.bands import Span, wobble_span
from studies.main_study.cases import TyreCase
from studies.main_study.settings import Settings, Setup
from studies.main_study.solve import LeastDamped, least_damped
from tyre.base.arrays import Array
from tyre.base.errors import InputError


@dataclass(frozen=True, eq=False)
class End:
    """Wobble at one end of a range: in words, where it is unstable, and its least damping where ridden."""

    what: str
    span: Span | None
    least: LeastDamped | None


@dataclass(frozen=True, eq=False)
class Hinge:
    """One thing that is varied, at both ends of its range."""

    what: str
    low: End
    high: End

    @property
    def size(self) -> float:
        """Change of the least damping ratio; infinite where wobble is an oscillation at one end only."""
        if self.low.least is None or self.high.least is None:
            return 0.0 if self.low.least is self.high.least else float("inf")
        return abs(self.high.least.damping_ratio - self.low.least.damping_ratio)


def hinges(settings: Settings, cases: Sequence[TyreCase], case: TyreCase) -> tuple[Hinge, ...]:
    """Everything that is assumed or chosen, varied one at a time around the reference world, the largest first.

    ``cases`` are those of the tyre in question, ``case`` the one that is varied.
    """
    found = []
    for what, ends in variations(settings, cases, case):
        try:
            low, high = (wobble(settings, setup, contact, words) for words, setup, contact in ends)
        except InputError:
            continue  # an end that makes no model says nothing about what matters
        found.append(Hinge(what, low, high))
    return tuple(sorted(found, key=lambda one: -one.size))


def wobble(settings: Settings, setup: Setup, contact: Array, words: str = "") -> End:
    """Wobble of one model.

    Parameters
    ----------
    settings : Settings
    setup : Setup
    contact : ndarray, shape (4,)
        Tyre numbers in the order of :data:`studies.main_study.cases.CONTACT`.
    words : str, optional
        What is said of the end of a range.

    Raises
    ------
    InputError
        It makes no model.
    """
    linear = build(settings, setup, contact)
    edges = critical_speeds(linear, max_speed=settings.fastest)
    span = wobble_span(linear, edges, settings.fastest)
    return End(words, span, least_damped(modes(linear, settings.speeds)))


def variations(
    settings: Settings, cases: Sequence[TyreCase], case: TyreCase
) -> Iterator[tuple[str, list[tuple[str, Setup, Array]]]]:
    """What is varied, and both ends: in words, as a setup and a tyre."""
    base, ranges, contact = settings.reference, settings.ranges, case.contact
    front = base.front
    yield "hands", [("off the bar", base, contact), ("on the bar", replace(base, arms=settings.arms), contact)]
    yield "front", [("flexible", base, contact), ("rigid", replace(base, front=None), contact)]
    if front:
        for name, unit in (("stiffness", "N m/rad"), ("damping", "N m s/rad")):
            values = getattr(ranges, name)
            fronts = [replace(front, **{name: value}) for value in values]
            yield (
                f"{name} of the front",
                [
                    (f"{value:g} {unit}", replace(base, front=one), contact)
                    for value, one in zip(values, fronts, strict=True)
                ],
            )
        yield "height of its hinge", [
            (f"{front.joint_height + shift:.2f} m",
             replace(base, front=replace(front, joint_height=front.joint_height + shift)), contact)
            for shift in ranges.hinge
        ]  # fmt: skip
        if ranges.friction[1] > 0:
            yield (
                "friction of the steering",
                [
                    (
                        f"{value:g} N m s/rad",
                        replace(base, front=replace(front, friction=front.friction + value)),
                        contact,
                    )
                    for value in ranges.friction
                ],
            )
    if "camber_thrust" not in settings.further:
        yield (
            "camber thrust",
            [(f"{share:g} × load", replace(base, camber_share=share), contact) for share in ranges.camber_share],
        )
    measured = sorted((one for one in cases if one.pressures_bar), key=lambda one: one.pressure_bar)
    if len(measured) > 1:
        yield "pressure", [(one.condition, base, one.contact) for one in (measured[0], measured[-1])]
