"""Comparisons of the main study: causes of a change, what the answer hinges on, contact length, posture, random fronts.

A world is varied one thing at a time, or drawn at random; the result is always where wobble is unstable and its least
damping.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.critical import CriticalSpeed, CrossingIdentity, critical_speeds, identified
from bicycle.effect_registry import effect_class
from bicycle.eigen import damping_ratio
from bicycle.model_family import ModelFamily
from bicycle.named_modes import modes
from bicycle.parameters import Bicycle
from bicycle.sensitivity import critical_speed_sensitivities
from studies.main_study.cases import TyreCase, tyre_cases
from studies.main_study.result import (
    CAMBER,
    FRICTION,
    WOBBLE,
    LeastDamped,
    Result,
    Span,
    beside,
    draws,
    is_wobble,
    least_damped,
    model,
    nearest,
    oscillations,
    uncertainty,
    wobble_span,
)
from studies.main_study.settings import CONTACT_LENGTH, LIMITS, Settings, Setup
from studies.uncertainty import assumed, by_group, counted_as_exact
from studies.uncertainty.propagation import Quantity
from tyre.arrays import Array
from tyre.contact_patch import half_length_under_load
from tyre.errors import InputError

DAMPING, CRITICAL = "damping_ratio", "critical_speed_m_s"


@dataclass(frozen=True)
class Change:
    """Change of one quantity between two pressures, split by varying one pair of tyre numbers and holding the other."""

    of: str | CrossingIdentity
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
        """Part that neither explains alone."""
        return self.total - self.stiffness_part - self.length_part

    @property
    def of_one_crossing(self) -> bool:
        """False if the interaction is most of it: a band went, and another crossing has its name."""
        alone = abs(self.stiffness_part) + abs(self.length_part)
        return abs(self.interaction) <= max(alone, 0.01)  # m/s: below it nothing is explained


@dataclass(frozen=True, eq=False)
class Decomposition:
    """All changes of one tyre in one setup, from pressure ``higher`` to ``lower``."""

    higher: TyreCase
    lower: TyreCase
    setup: Setup
    changes: tuple[Change, ...]

    def change(self, of: str | CrossingIdentity, quantity: str = CRITICAL) -> Change | None:
        """Change of a mode's damping ratio or of a critical speed; None if it is not there at both pressures."""
        return next((c for c in self.changes if (c.of, c.quantity) == (of, quantity)), None)


def decompose(settings: Settings, higher: Result, lower: Result) -> Decomposition:
    """Split the changes from the higher to the lower pressure into the parts of C and of the relaxation length."""
    before, after, setup = higher.case.contact, lower.case.contact, higher.setup
    only_stiffness, only_length = before.copy(), before.copy()
    only_stiffness[0::2] = after[0::2]
    only_length[1::2] = after[1::2]
    speeds = [named_speeds(higher.crossings), named_speeds(lower.crossings)]
    for contact in (only_stiffness, only_length):
        linear = model(settings, setup, contact).linear_model()
        speeds.append(named_speeds(critical_speeds(linear, max_speed=settings.max_speed)))
    changes = []
    for which, start in speeds[0].items():
        if all(which in corner for corner in speeds):
            end, stiffness, length = (corner[which] for corner in speeds[1:])
            change = Change(which, CRITICAL, start, end, stiffness - start, length - start)
            if change.of_one_crossing:
                changes.append(change)
    at_lower = oscillations(lower.modes, -1)
    for mode, eigenvalue in oscillations(higher.modes, -1).items():
        roots = [_follow_root(settings, setup, before, to, eigenvalue) for to in (after, only_stiffness, only_length)]
        if mode in at_lower and abs(roots[0] - at_lower[mode]) < 1e-6 * abs(roots[0]):  # else another root has the name
            ratios = [float(damping_ratio(value)) for value in (eigenvalue, *roots)]
            changes.append(Change(mode, DAMPING, ratios[0], ratios[1], ratios[2] - ratios[0], ratios[3] - ratios[0]))
    return Decomposition(higher.case, lower.case, setup, tuple(changes))


def named_speeds(crossings: Iterable[CriticalSpeed]) -> dict[CrossingIdentity, float]:
    """Critical speeds (m/s) by what tells them apart; an edge of unstable wobble counts as wobble's."""
    every = identified(crossing.named(WOBBLE) if is_wobble(crossing) else crossing for crossing in crossings)
    return {which: float(crossing.speed) for which, crossing in every.items()}


def _follow_root(settings: Settings, setup: Setup, start: Array, end: Array, eigenvalue: complex) -> complex:
    """Follow an oscillation at the report speed from the tyre numbers ``start`` (4,) to ``end`` (4,)."""
    for share in np.linspace(0, 1, 17)[1:]:
        linear = model(settings, setup, start + share * (end - start)).linear_model()
        eigenvalue = nearest(linear, settings.report_speed, eigenvalue)
    return eigenvalue


@dataclass(frozen=True, eq=False)
class End:
    """Wobble at one end of a range: the value of the end, where it is unstable, and its least damping when ridden."""

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
        """Change of the least damping ratio; infinite if wobble is an oscillation at one end only."""
        if self.low.least is None or self.high.least is None:
            return 0.0 if self.low.least is self.high.least else float("inf")
        return abs(self.high.least.damping_ratio - self.low.least.damping_ratio)


def wobble(settings: Settings, setup: Setup, contact: Array, what: str = "") -> End:
    """Compute the wobble of one model; ``contact`` (4,) holds its tyre numbers."""
    linear = model(settings, setup, contact).linear_model()
    edges = critical_speeds(linear, max_speed=settings.fastest)
    span = wobble_span(linear, edges, settings.fastest)
    return End(what, span, least_damped(modes(linear, settings.speeds)))


def hinges(settings: Settings, cases: Sequence[TyreCase], case: TyreCase) -> tuple[Hinge, ...]:
    """Vary everything that is assumed or chosen one at a time around the reference world, the largest change first."""
    found = []
    for what, ends in _variations(settings, cases, case):
        try:
            low, high = (wobble(settings, setup, contact, value) for value, setup, contact in ends)
        except InputError:
            continue  # an end that makes no model tells nothing
        found.append(Hinge(what, low, high))
    return tuple(sorted(found, key=lambda one: -one.size))


def _variations(
    settings: Settings, cases: Sequence[TyreCase], case: TyreCase
) -> Iterator[tuple[str, list[tuple[str, Setup, Array]]]]:
    """Yield the thing that is varied, and both ends: value, setup and tyre."""
    base, ranges, contact, front = settings.reference, settings.ranges, case.contact, settings.reference.front
    assert front is not None  # of the reference world
    yield "hands", [("off the bar", base, contact), ("on the bar", replace(base, arms=settings.arms), contact)]
    yield "front", [("flexible", base, contact), ("rigid", replace(base, front=None), contact)]
    heights = [front.joint_height + shift for shift in ranges.hinge]
    fronts: dict[str, list[tuple[str, dict[str, Any]]]] = {
        "stiffness of the front": [(f"{v:g} N m/rad", {"stiffness": v}) for v in ranges.stiffness],
        "damping of the front": [(f"{v:g} N m s/rad", {"damping": v}) for v in ranges.damping],
        "height of its hinge": [(f"{v:.2f} m", {"joint_height": v}) for v in heights],
    }
    if ranges.friction[1] > 0:
        fronts["friction of the steering"] = [
            (f"{v:g} N m s/rad", {"friction": front.friction + v}) for v in ranges.friction
        ]
    for what, ends in fronts.items():
        yield what, [(value, replace(base, front=replace(front, **new)), contact) for value, new in ends]
    if "camber_thrust" not in settings.further:
        shares = ranges.camber_share
        yield "camber thrust", [(f"{v:g} × load", replace(base, camber_share=v), contact) for v in shares]
    measured = sorted((one for one in cases if one.pressures_bar), key=lambda one: one.pressure_bar)
    if len(measured) > 1:
        yield "pressure", [(one.condition, base, one.contact) for one in (measured[0], measured[-1])]


@dataclass(frozen=True, eq=False)
class ContactLength:
    """Wobble of one case in the reference world: with the single lag, and with a contact of ``half_length`` (m)."""

    case: TyreCase
    half_length: tuple[float, float]
    estimated: bool
    lag: End
    string: End


def contact_lengths(settings: Settings, cases: Sequence[TyreCase]) -> tuple[ContactLength, ...]:
    """Compare every case with the default contact, then with its own; none if a model file excludes it."""
    if CONTACT_LENGTH in settings.further:  # every world has it
        return ()
    assumed = next(p.default for p in effect_class(CONTACT_LENGTH).parameters if p.name == "half_length")
    assert isinstance(assumed, float)
    radii = (settings.bicycle["rR"], settings.bicycle["rF"])
    found = []
    for estimated in (False, True):
        for case in cases:
            wanted = [assumed, assumed]
            if estimated:
                if not case.properties or case.width is None:
                    continue
                wanted = [
                    half_length_under_load(load=p.load, pressure=p.pressure, wheel_radius=r, tyre_width=case.width)
                    for p, r in zip(case.properties, radii, strict=True)
                ]
            rear, front = np.minimum(wanted, LIMITS.widest * case.contact[1::2]).tolist()
            longer = replace(settings.reference, contact_half_length=(rear, front))
            try:
                lag, string = (wobble(settings, setup, case.contact) for setup in (settings.reference, longer))
            except InputError:  # the file has an aligning moment of its own: there is nothing to compare
                return ()
            found.append(ContactLength(case, (rear, front), estimated, lag, string))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Posture:
    """A rider's posture as a bicycle, and its wobble in the reference world; None if the tyre says nothing."""

    bicycle: Bicycle
    end: End | None
    extrapolated: bool


def postures(settings: Settings, focus: TyreCase) -> tuple[Posture, ...]:
    """Compute the wobble in each posture, on the tyre in focus at the wheel loads of that posture."""
    found = []
    for bicycle in settings.postures:
        own, end, extrapolated = replace(settings, bicycle=bicycle), None, True
        try:
            for case in tyre_cases(own).found:
                if (case.name, case.condition) == (focus.name, focus.condition):
                    end, extrapolated = wobble(own, own.reference, case.contact), case.extrapolated
        except InputError:
            pass
        found.append(Posture(bicycle, end, extrapolated))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Sources:
    """Sources of the uncertainty of one case in the reference world."""

    shares: Mapping[CrossingIdentity, Mapping[str, float]]
    exact: Mapping[str, str]
    assumed: Mapping[str, tuple[float, float]]


def sources(settings: Settings, case: TyreCase) -> Sources:
    """Find out where the uncertainty of a case comes from."""
    uncertain = uncertainty(settings, case, settings.reference)
    crossings = uncertain.crossings(settings.fastest)
    slopes = critical_speed_sensitivities(uncertain.nominal, list(crossings.values())) if crossings else {}
    shares = {}
    for k, which in enumerate(crossings):
        gradient = uncertain.gradient({key: one[k] for key, one in slopes.items()})
        shares[which] = by_group(uncertain.shares(gradient))
    values = uncertain.nominal.parameters
    taken = {key: (values[key], sd) for key, sd in assumed(uncertain).items()}
    return Sources(shares, counted_as_exact(uncertain), taken)


@dataclass(frozen=True, eq=False)
class Check:
    """Frequency, damping ratio and critical speeds of wobble of one result, linear and of random bicycles."""

    result: Result
    quantities: tuple[Quantity, ...]
    failure: str = ""


def chosen(results: Sequence[Result]) -> list[Result]:
    """Pick the results to check: the most doubtful one of the tyre in question, of the others, of each other setup."""
    first, subject = results[0].setup, results[0].case.name
    groups: dict[tuple[Setup, bool], list[Result]] = {}
    for result in results:
        groups.setdefault((result.setup, result.setup == first and result.case.name == subject), []).append(result)
    return [max(group, key=doubt) for group in groups.values()]


def doubt(result: Result) -> float:
    """Largest relative standard deviation of a speed at which wobble changes its stability."""
    return max((c.sd / c.speed for c in result.wobble_edges), default=0.0)


def check(settings: Settings, result: Result) -> Check:
    """Compare linear and sampled standard deviations of one result; a check that fails costs nothing else."""
    try:
        found = uncertainty(settings, result.case, result.setup).quantities(
            np.array([settings.report_speed]), max_speed=settings.max_speed,
            samples=settings.samples, seed=settings.seed, only=[WOBBLE], matched=True,
        )  # fmt: skip
    except InputError as error:
        return Check(result, (), str(error))
    return Check(result, tuple(found))


@dataclass(frozen=True, eq=False)
class Plausible:
    """Onset and end (m/s) of unstable wobble of each random bicycle (n,); NaN if it has none."""

    case: TyreCase
    setup: Setup
    onset: Array
    end: Array
    computed: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Number of bicycles that were computed."""
        return int(self.computed.sum())

    @property
    def without(self) -> int:
        """Number of bicycles that do not wobble at any speed looked at."""
        return int((np.isnan(self.onset) & self.computed).sum())

    def likely(self, edge: str) -> tuple[float, float] | None:
        """Interval of ``onset`` or ``end`` (m/s) of nine of ten bicycles with unstable wobble, of few of all."""
        there = getattr(self, edge)[~np.isnan(self.onset)]
        if not len(there):
            return None
        low, high = np.quantile(there, LIMITS.likely if len(there) >= LIMITS.fewest else (0, 1))
        return float(low), float(high)


def plausible(settings: Settings, case: TyreCase, setup: Setup) -> Plausible:
    """Draw bicycles, tyres and what nobody measured (a Sobol sequence over the ranges), and find their wobble."""
    count = settings.fronts
    onset, end = np.full((2, count), np.nan)
    computed = np.zeros(count, bool)
    uncertain = uncertainty(settings, case, setup)
    family = ModelFamily(uncertain.nominal)
    drawn = front_draws(settings)
    for k, values in enumerate(draws(settings, case, uncertain, count)):
        if values is None:
            continue
        try:
            linear = family.linear_model(values | front_values(settings, setup, drawn, k, values))
            span = wobble_span(linear, critical_speeds(linear, max_speed=settings.fastest), settings.fastest)
        except InputError:  # a draw that makes no model is counted, and told beside the count
            continue
        computed[k] = True
        if span:
            onset[k], end[k] = span.low, min(span.high, settings.fastest)
    return Plausible(case, setup, onset, end, computed)


def front_draws(settings: Settings) -> Mapping[str, Array]:
    """Numbers (fronts,) of each quantity that is drawn, the same for every case."""
    from scipy.stats import qmc

    ranges = vars(settings.ranges)
    size = 2 ** int(np.ceil(np.log2(max(settings.fronts, 2))))
    # "rng" is the newer name, of scipy 1.15
    u = qmc.Sobol(len(ranges), seed=np.random.default_rng(settings.seed)).random(size)[: settings.fronts]
    found = {}
    for k, (name, (low, high)) in enumerate(ranges.items()):
        found[name] = np.asarray(low * (high / low) ** u[:, k] if low > 0 else low + (high - low) * u[:, k])
    return found


def front_values(
    settings: Settings, setup: Setup, drawn: Mapping[str, Array], k: int, values: Mapping[str, float]
) -> dict[str, float]:
    """Parameters of the effects beside the tyre for draw number ``k`` of ``drawn``, on a bicycle with SI ``values``."""
    new = {name: float(numbers[k]) for name, numbers in drawn.items()}
    share = new["camber_share"] if "camber_thrust" in settings.further else new["camber_share"] / setup.camber_share
    found = {key: values[key] * share for key in CAMBER}
    if setup.front:
        front = replace(
            setup.front, stiffness=new["stiffness"], damping=new["damping"],
            joint_height=setup.front.joint_height + new["hinge"], friction=setup.front.friction + new["friction"],
        )  # fmt: skip
        found |= {"front_compliance.stiffness": front.stiffness, "front_compliance.damping": front.damping}
        found |= {"front_compliance.joint_z": -front.joint_height}
        found |= {"front_compliance.joint_x": float(front.hinge_x(values))}
        friction = beside(settings, replace(setup, front=front))[FRICTION]["damping"]
        found |= {f"{FRICTION}.damping": float(friction)}
    if setup.arms:
        found |= {f"rider_arms.{name}": new[f"arm_{name}"] for name in ("inertia", "stiffness", "damping")}
    return found
