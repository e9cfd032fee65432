"""Comparisons of the main study: causes of a change, one-at-a-time sensitivity, contact models, amplitude.

The parameters of a case are varied one at a time; each result is the wobble range and the minimum damping ratio.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bicycle.effects.effect_registry import effect_class
from bicycle.model.eigen import damping_ratio
from bicycle.motion.limit_cycles import find_limit_cycles
from bicycle.motion.nonlinear import MagicTyre
from bicycle.stability.critical import CriticalSpeed, CrossingIdentity, by_identity, critical_speeds
from bicycle.stability.named_modes import modes
from bicycle.stability.sensitivity import critical_speed_sensitivities
from studies.main_study import result as solution
from studies.main_study.cases import TyreCase, tyre_cases
from studies.main_study.least_bump import least_bump
from studies.main_study.result import WOBBLE, LeastDamped, Result, Span
from studies.main_study.samples import EFFECTS
from studies.main_study.settings import ASSUMED, CONTACT_LENGTH, LAW, LIMITS, Settings, Setup
from studies.model_space.lasting_motions import Extent, Trace, curves_of, extent, traces_of
from studies.uncertainty import assumed_sd, by_group, counted_as_exact
from studies.uncertainty.propagation import Quantity
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.maps.contact_patch import half_length_under_load, string_trail

DAMPING, CRITICAL = "damping_ratio", "critical_speed_m_s"


@dataclass(frozen=True)
class Change:
    """Change of one quantity between two pressures, split by varying one pair of tyre numbers and holding the other."""

    of: str | CrossingIdentity  # name of the mode, or the critical speed
    quantity: str  # DAMPING (a ratio) or CRITICAL (m/s), in which the four numbers are
    before: float  # at the higher pressure
    after: float  # at the lower pressure
    stiffness_part: float  # change if the cornering stiffness alone went to its value at the lower pressure
    length_part: float  # change if the relaxation length alone did

    @property
    def total(self) -> float:
        """After minus before."""
        return self.after - self.before

    @property
    def interaction(self) -> float:
        """Remainder of the total: neither part explains it alone."""
        return self.total - self.stiffness_part - self.length_part

    @property
    def of_one_crossing(self) -> bool:
        """False if the interaction is most of it: a band went, and another crossing has its name."""
        explained = abs(self.stiffness_part) + abs(self.length_part)
        return abs(self.interaction) <= max(explained, 0.01)  # m/s: below it nothing is explained


@dataclass(frozen=True, eq=False)
class Decomposition:
    """All changes of one tyre in one setup, from pressure ``higher`` to ``lower``."""

    higher: TyreCase
    lower: TyreCase
    setup: Setup  # case in which both were computed
    changes: tuple[Change, ...]  # of critical speeds and of damping ratios at the report speed

    def change(self, of: str | CrossingIdentity, quantity: str = CRITICAL) -> Change | None:
        """Change of a mode's damping ratio or of a critical speed; None if it is not there at both pressures."""
        return next((c for c in self.changes if (c.of, c.quantity) == (of, quantity)), None)


def decompose(settings: Settings, higher: Result, lower: Result) -> Decomposition:
    """Split the changes from the higher to the lower pressure into the parts of C and of the relaxation length."""
    before, after, setup = higher.case.contact, lower.case.contact, higher.case.apply_to(higher.setup)
    only_stiffness, only_length = before.copy(), before.copy()
    only_stiffness[0::2] = after[0::2]
    only_length[1::2] = after[1::2]
    speeds = [named_speeds(higher.crossings), named_speeds(lower.crossings)]
    models = (solution.model(settings, setup, contact).linear_model() for contact in (only_stiffness, only_length))
    speeds += [named_speeds(critical_speeds(linear, max_speed=settings.max_speed)) for linear in models]
    changes = []
    for identity, start in speeds[0].items():
        if all(identity in corner for corner in speeds):
            end, stiffness, length = (corner[identity] for corner in speeds[1:])
            change = Change(identity, CRITICAL, start, end, stiffness - start, length - start)
            if change.of_one_crossing:
                changes.append(change)
    at_lower, at_higher = solution.oscillations(lower.modes), solution.oscillations(higher.modes)
    ends = (_follow_roots(settings, setup, before, to, at_higher) for to in (after, only_stiffness, only_length))
    for (mode, eigenvalue), *roots in zip(at_higher.items(), *ends, strict=True):
        if mode in at_lower and abs(roots[0] - at_lower[mode]) < 1e-6 * abs(roots[0]):  # else another root has the name
            ratios = [float(damping_ratio(value)) for value in (eigenvalue, *roots)]
            changes.append(Change(mode, DAMPING, ratios[0], ratios[1], ratios[2] - ratios[0], ratios[3] - ratios[0]))
    return Decomposition(higher.case, lower.case, higher.setup, tuple(changes))


def named_speeds(crossings: Iterable[CriticalSpeed]) -> dict[CrossingIdentity, float]:
    """Name critical speeds (m/s) by mode, direction and occurrence; onset and end of unstable wobble are of wobble."""
    named = by_identity(crossing.rename(WOBBLE) if solution.is_wobble(crossing) else crossing for crossing in crossings)
    return {identity: float(crossing.speed) for identity, crossing in named.items()}


def _follow_roots(
    settings: Settings, setup: Setup, start: Array, end: Array, eigenvalues: Mapping[str, complex]
) -> list[complex]:
    """Follow oscillations at the report speed from the tyre numbers ``start`` (4,) to ``end`` (4,)."""
    roots = list(eigenvalues.values())
    if not roots:
        return []
    for share in np.linspace(0, 1, 17)[1:]:
        linear = solution.model(settings, setup, start + share * (end - start)).linear_model()
        roots = [solution.nearest_root(linear, settings.report_speed, root) for root in roots]
    return roots


@dataclass(frozen=True, eq=False)
class End:
    """Wobble at one end of a range: the value, the unstable range, and the minimum damping ratio at ridden speeds."""

    what: str  # value with its unit, or name of the choice
    span: Span | None  # None: stable up to the highest speed
    least: LeastDamped | None  # None: wobble does not oscillate at ridden speeds


@dataclass(frozen=True, eq=False)
class Hinge:
    """One parameter or choice that is varied, at both ends of its range."""

    what: str  # name in words
    low: End  # wobble at the first end of the range, or with the first choice
    high: End  # at the other

    @property
    def size(self) -> float:
        """Change of the minimum damping ratio; infinite if wobble oscillates at one end only."""
        if self.low.least is None or self.high.least is None:
            return 0.0 if self.low.least is self.high.least else float("inf")
        return abs(self.high.least.damping_ratio - self.low.least.damping_ratio)

    @property
    def comparable(self) -> bool:
        """False if wobble oscillates at one end only."""
        return bool(np.isfinite(self.size))


class Variant(NamedTuple):
    """Study, setup and tyre of one model."""

    settings: Settings  # study with its bicycle
    setup: Setup  # case on the tyre
    contact: Array  # (4,), N/rad and m: cornering stiffness and relaxation length, rear then front

    def vary(self, **changes: Any) -> "Variant":
        """Change fields of the case."""
        return self._replace(setup=replace(self.setup, **changes))

    def wobble(self, label: str = "") -> End:
        """Find where its wobble is unstable and how it is damped; ``label`` names it."""
        linear = solution.model(self.settings, self.setup, self.contact).linear_model()
        fastest, hands_on = self.settings.fastest, self.setup.arms is not None
        critical = critical_speeds(linear, max_speed=fastest)
        span = solution.wobble_span(linear, critical, hands_on=hands_on, limit=fastest)
        return End(label, span, solution.least_damped_wobble(modes(linear, self.settings.speeds)))


def in_reference_setup(settings: Settings, case: TyreCase) -> Variant:
    """Put the bicycle on the tyres of ``case``, hands off and with the flexible front frame if there is one."""
    return Variant(settings, case.apply_to(settings.reference), case.contact)


Ends = dict[str, Variant]  # value -> what has it


def hinges(settings: Settings, cases: Sequence[TyreCase], focus: TyreCase) -> tuple[Hinge, ...]:
    """Vary all that is assumed or chosen one at a time around the reference case, the largest change first."""
    hinges = []
    for name, ends in _variations(settings, cases, focus):
        try:
            low, high = (variant.wobble(value) for value, variant in ends.items())
        except InputError:
            continue  # an end without a model has no result
        hinges.append(Hinge(name, low, high))
    return tuple(sorted(hinges, key=lambda hinge: -hinge.size))


def _variations(settings: Settings, cases: Sequence[TyreCase], focus: TyreCase) -> Iterator[tuple[str, Ends]]:
    """Yield the name of what is varied, and both of its ends."""
    base = in_reference_setup(settings, focus)
    ranges = settings.ranges
    yield "hands off/on", {"off": base, "on": base.vary(arms=settings.arms)}
    if len(settings.grips) > 1:
        yield "arms relaxed/tense", {arms.grip: base.vary(arms=arms) for arms in settings.grips}
    if front := base.setup.front:
        yield "front frame flexible/rigid", {"flexible": base, "rigid": base.vary(front=None)}
        front_ranges = [
            ("stiffness", ranges.stiffness, "N m/rad"),
            ("damping_ratio", ranges.damping_ratio, "of critical"),
            ("joint_height", [round(front.joint_height + shift, 3) for shift in ranges.hinge], "m"),
        ]
        for name, values, unit in front_ranges:
            ends: Ends = {}
            for value in values:
                change: dict[str, Any] = {name: value}
                ends[f"{value:g} {unit}"] = base.vary(front=replace(front, **change))
            yield WORDS[name], ends
    if ranges.friction[1] > 0:
        yield WORDS["friction"], {f"{value:g} N m s/rad": base.vary(friction=value) for value in ranges.friction}
    assumed = assumed_of_tyre(settings, base.setup)
    for name, unit in (("camber_share", "× load"), ("trail", "m"), ("twisting", "N m/rad")):
        if name in assumed:
            values = getattr(ranges, name)
            yield WORDS[name], {f"{v:g} {unit}": base.vary(**{name: v}) for v in values}
    by_pressure = sorted((case for case in cases if case.pressures_bar), key=lambda case: case.pressure_bar)
    if len(by_pressure) > 1:
        lowest, highest = (in_reference_setup(settings, case) for case in (by_pressure[0], by_pressure[-1]))
        yield "pressure", {by_pressure[0].condition: lowest, by_pressure[-1].condition: highest}
    postures = _postures(settings, focus)
    if len(postures) > 1:
        first, last = next(iter(postures)), next(reversed(postures))
        yield "rider posture", {first: postures[first], last: postures[last]}


def assumed_of_tyre(settings: Settings, setup: Setup) -> tuple[str, ...]:
    """Name what neither the model file nor the file of the tyre in ``setup`` states: trail, twisting, camber_share."""
    names = []
    for name, effect in EFFECTS.items():
        in_model_file = effect in settings.further or (name == "trail" and settings.has_moment)
        in_tyre_file = getattr(setup, name) != getattr(settings, name)
        if not in_model_file and not in_tyre_file:
            names.append(name)
    return tuple(names)


def _postures(settings: Settings, focus: TyreCase) -> Ends:
    """Put the tyre in focus under the same bicycle in every posture of its rider, by posture."""
    ends: Ends = {}
    for bicycle in settings.postures:
        seated = replace(settings, bicycle=bicycle)
        for case in tyre_cases(seated).studied:
            if (case.name, case.condition) == (focus.name, focus.condition):
                posture = bicycle.name.rpartition("_")[2]
                ends[posture] = in_reference_setup(seated, case)
    return ends


WORDS = {
    "stiffness": "front-frame stiffness", "damping_ratio": "front-frame damping ratio",
    "joint_height": "front-frame joint height",
    "friction": "steering friction", "camber_share": "camber stiffness", "trail": "pneumatic trail",
    "twisting": "twisting torque",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class ContactModels:
    """Wobble on one tyre condition in the reference case, with three models of the contact.

    A single lag; the lag with the pneumatic trail of the string; a string in contact over twice ``half_length`` (m,
    rear and front). The last two differ only in the lag.
    """

    case: TyreCase  # of the tyre in question
    half_length: tuple[float, float]  # m, rear and front
    trail: tuple[float, float]  # m, of the string, rear and front
    estimated: bool  # ``half_length`` from load, pressure and width; False: the default of the effect
    lag: End  # single lag without trail
    trailing: End  # single lag with the trail of the string
    string: End  # string in contact over its length

    @property
    def contact_length(self) -> tuple[float, float]:
        """Length of the contact, m, rear and front."""
        rear, front = self.half_length
        return 2 * rear, 2 * front

    @property
    def oscillate(self) -> bool:
        """True if wobble oscillates in all three models."""
        return all(end.least for end in (self.lag, self.trailing, self.string))

    @property
    def trail_effect(self) -> float | None:
        """Change of the minimum damping ratio by the pneumatic trail; None if wobble does not oscillate in a model."""
        return _change_of_least(self.lag, self.trailing)

    @property
    def lag_effect(self) -> float | None:
        """Change of the minimum damping ratio by a single lag in place of the string's; None likewise."""
        return _change_of_least(self.string, self.trailing)


def _change_of_least(before: End, after: End) -> float | None:
    """Subtract the minimum damping ratios of two ends; None if wobble does not oscillate at one."""
    return after.least.damping_ratio - before.least.damping_ratio if before.least and after.least else None


def contact_models(settings: Settings, cases: Sequence[TyreCase]) -> tuple[ContactModels, ...]:
    """Compare every condition with the default contact, then with its own; none if a model file gives it."""
    if settings.has_moment:
        return ()
    default = next(p.default for p in effect_class(CONTACT_LENGTH).parameters if p.name == "half_length")
    comparisons = [_compare_contact(settings, case, np.array([default, default]), estimated=False) for case in cases]
    radii = (settings.bicycle["rR"], settings.bicycle["rF"])
    for case in cases:
        if case.properties and case.width is not None:
            half_lengths = [
                half_length_under_load(load=p.load, pressure=p.pressure, wheel_radius=radius, tyre_width=case.width)
                for p, radius in zip(case.properties, radii, strict=True)
            ]
            comparisons.append(_compare_contact(settings, case, np.array(half_lengths), estimated=True))
    return tuple(comparisons)


def _compare_contact(settings: Settings, case: TyreCase, half_length: Array, *, estimated: bool) -> ContactModels:
    """Compare lag, lag with trail and string for contact over twice ``half_length`` (2,), m, rear and front.

    The half length is at most :attr:`Limits.widest` of the relaxation length, which contains it.
    """
    relaxation_length = case.contact[1::2]
    half_length = np.minimum(half_length, LIMITS.widest * relaxation_length)
    trail = tuple(string_trail(half_length=half_length, relaxation_length=relaxation_length).tolist())
    rear, front = half_length.tolist()
    base = in_reference_setup(settings, case)
    return ContactModels(
        case,
        (rear, front),
        trail,
        estimated,
        lag=base.vary(trail=0.0).wobble(),
        trailing=base.vary(trail=trail).wobble(),
        string=base.vary(contact_half_length=(rear, front)).wobble(),
    )


@dataclass(frozen=True, eq=False)
class Amplitude:
    """Periodic motions on saturating tyres in the reference case; ``refused`` holds the reason if there are none."""

    case: TyreCase  # of the tyre in question
    traces: tuple[Trace, ...] = ()  # amplitude (degrees) and frequency (Hz) along each branch
    wobble: Extent | None = None  # its range and maximum amplitude; None: no sustained wobble at these speeds
    peak_factor: float | None = None  # assumed; None: the tyre file holds full curves
    # rad, of the steer angle: from here on wobble grows against the dry friction of a headset; None: it does not
    least_bump: float | None = None
    refused: str = ""  # reason; empty: they could be followed

    @property
    def jumps(self) -> bool:
        """True if there are periodic motions of wobble, stable or not: an impulse may start one."""
        return any(WOBBLE in trace.mode.split("+") for trace in self.traces)


def amplitude(settings: Settings, case: TyreCase, setup: Setup) -> Amplitude:
    """Follow the periodic motions of one case; find its maximum wobble amplitude, and the bump that just starts it."""
    curves = curves_of({"effects": {LAW: dict(case.table)}})
    built = solution.model(settings, case.apply_to(setup), case.contact)
    span = Variant(settings, case.apply_to(setup), case.contact).wobble().span
    bump = least_bump(built, span, ASSUMED["dry_friction"].usual) if span else None
    try:
        cycles = find_limit_cycles(
            built, rear=curves.get("rear"), front=curves.get("front"), max_speed=settings.max_speed
        )
    except InputError as error:
        return Amplitude(case, least_bump=bump, refused=str(error))
    traces = tuple(traces_of(cycles))
    peak_factor = None if curves else MagicTyre().peak_factor
    return Amplitude(case, traces, extent(traces, up_to=settings.fastest), peak_factor, bump)


@dataclass(frozen=True, eq=False)
class Sources:
    """Sources of the uncertainty of one tyre condition in the reference case."""

    # of each critical speed's variance (sum 1), by what is uncertain
    shares: Mapping[CrossingIdentity, Mapping[str, float]]
    exact: Mapping[str, str]  # parameter -> why it is treated as exact
    assumed: Mapping[str, tuple[float, float]]  # parameter -> value and assumed standard deviation, SI

    @property
    def large_groups(self) -> list[str]:
        """Sources that print as one percent or more of some variance."""
        largest: dict[str, float] = {}
        for share_of in self.shares.values():
            for group, share in share_of.items():
                largest[group] = max(share, largest.get(group, 0.0))
        return [group for group, share in largest.items() if share >= 0.005]

    @property
    def large_shares(self) -> dict[CrossingIdentity, list[float]]:
        """Share of each of the ``large_groups`` in the variance of each critical speed."""
        table = {}
        for identity, share_of in self.shares.items():
            table[identity] = [share_of.get(group, 0.0) for group in self.large_groups]
        return table

    @property
    def exact_by_reason(self) -> dict[str, list[str]]:
        """Parameters that are treated as exact, by the reason."""
        parameters: dict[str, list[str]] = {}
        for key, why in self.exact.items():
            parameters.setdefault(why, []).append(key)
        return parameters


def sources(settings: Settings, case: TyreCase) -> Sources:
    """Compute the share of each source in the variance of the critical speeds of a case."""
    uncertain = solution.uncertainty(settings, case, settings.reference)
    crossings = uncertain.crossings(settings.fastest)
    slopes = critical_speed_sensitivities(uncertain.nominal, list(crossings.values())) if crossings else {}
    shares = {}
    for k, identity in enumerate(crossings):
        gradient = uncertain.gradient({key: slopes_of_key[k] for key, slopes_of_key in slopes.items()})
        shares[identity] = by_group(uncertain.shares(gradient))
    values = uncertain.nominal.parameters
    assumed_sds = {key: (values[key], sd) for key, sd in assumed_sd(uncertain).items()}
    return Sources(shares, counted_as_exact(uncertain), assumed_sds)


@dataclass(frozen=True, eq=False)
class Check:
    """Frequency, damping ratio and critical speeds of wobble of one result, linear and sampled."""

    result: Result  # whose quantities are checked
    quantities: tuple[Quantity, ...]  # each with its linear sd and its samples
    failure: str = ""  # reason; empty: it could be computed


def check(settings: Settings, result: Result) -> Check:
    """Compare linear and sampled standard deviations of one result; a failed check stops nothing else."""
    try:
        quantities = solution.uncertainty(settings, result.case, result.setup).quantities(
            np.array([settings.report_speed]),
            max_speed=settings.max_speed,
            samples=settings.samples,
            seed=settings.seed,
            only=[WOBBLE],
            matched=True,
        )
        return Check(result, tuple(quantities))
    except InputError as error:
        return Check(result, (), str(error))
