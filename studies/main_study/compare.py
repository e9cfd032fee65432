"""Comparisons of the main study: causes of a change, what the answer hinges on, contact models, random bicycles.

A world is varied one thing at a time, or drawn at random; the result is always where wobble is unstable and its least
damping.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect_registry import effect_class
from bicycle.model.eigen import damping_ratio, frequency_hz
from bicycle.model.model_family import ModelFamily
from bicycle.model.state_space import LinearModel
from bicycle.motion.limit_cycles import find_limit_cycles
from bicycle.motion.nonlinear import MagicTyre
from bicycle.stability.critical import CriticalSpeed, CrossingIdentity, critical_speeds, identified
from bicycle.stability.named_modes import modes
from bicycle.stability.sensitivity import critical_speed_sensitivities
from studies.main_study import result as world
from studies.main_study.cases import TyreCase, tyre_cases
from studies.main_study.result import FRICTION, TRAIL, TWIST, WOBBLE, LeastDamped, Result, Span
from studies.main_study.settings import CONTACT_LENGTH, LAW, LIMITS, Front, Settings, Setup
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
    changes: tuple[Change, ...]  # of critical speeds and of damping ratios at the report speed

    def change(self, of: str | CrossingIdentity, quantity: str = CRITICAL) -> Change | None:
        """Change of a mode's damping ratio or of a critical speed; None if it is not there at both pressures."""
        return next((c for c in self.changes if (c.of, c.quantity) == (of, quantity)), None)


def decompose(settings: Settings, higher: Result, lower: Result) -> Decomposition:
    """Split the changes from the higher to the lower pressure into the parts of C and of the relaxation length."""
    before, after, setup = higher.case.contact, lower.case.contact, higher.case.on(higher.setup)
    only_stiffness, only_length = before.copy(), before.copy()
    only_stiffness[0::2] = after[0::2]
    only_length[1::2] = after[1::2]
    speeds = [named_speeds(higher.crossings), named_speeds(lower.crossings)]
    models = (world.model(settings, setup, contact).linear_model() for contact in (only_stiffness, only_length))
    speeds += [named_speeds(critical_speeds(linear, max_speed=settings.max_speed)) for linear in models]
    changes = []
    for which, start in speeds[0].items():
        if all(which in corner for corner in speeds):
            end, stiffness, length = (corner[which] for corner in speeds[1:])
            change = Change(which, CRITICAL, start, end, stiffness - start, length - start)
            if change.of_one_crossing:
                changes.append(change)
    at_lower, at_higher = world.oscillations(lower.modes), world.oscillations(higher.modes)
    ends = (_follow_roots(settings, setup, before, to, at_higher) for to in (after, only_stiffness, only_length))
    for (mode, eigenvalue), *roots in zip(at_higher.items(), *ends, strict=True):
        if mode in at_lower and abs(roots[0] - at_lower[mode]) < 1e-6 * abs(roots[0]):  # else another root has the name
            ratios = [float(damping_ratio(value)) for value in (eigenvalue, *roots)]
            changes.append(Change(mode, DAMPING, ratios[0], ratios[1], ratios[2] - ratios[0], ratios[3] - ratios[0]))
    return Decomposition(higher.case, lower.case, higher.setup, tuple(changes))


def named_speeds(crossings: Iterable[CriticalSpeed]) -> dict[CrossingIdentity, float]:
    """Name critical speeds (m/s) by mode, direction and occurrence; an edge of unstable wobble counts as wobble's."""
    every = identified(crossing.named(WOBBLE) if world.is_wobble(crossing) else crossing for crossing in crossings)
    return {which: float(crossing.speed) for which, crossing in every.items()}


def _follow_roots(
    settings: Settings, setup: Setup, start: Array, end: Array, eigenvalues: Mapping[str, complex]
) -> list[complex]:
    """Follow oscillations at the report speed from the tyre numbers ``start`` (4,) to ``end`` (4,)."""
    roots = list(eigenvalues.values())
    if not roots:
        return []
    for share in np.linspace(0, 1, 17)[1:]:
        linear = world.model(settings, setup, start + share * (end - start)).linear_model()
        roots = [world.nearest_root(linear, settings.report_speed, root) for root in roots]
    return roots


@dataclass(frozen=True, eq=False)
class End:
    """Wobble at one end of a range: the value of the end, where it is unstable, and its least damping when ridden."""

    what: str  # value with its unit, or name of the choice
    span: Span | None  # None: stable up to the highest speed
    least: LeastDamped | None  # None: no oscillation of wobble where it is ridden


@dataclass(frozen=True, eq=False)
class Hinge:
    """One thing that is varied, at both ends of its range."""

    what: str  # name in words
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
    linear = world.model(settings, setup, contact).linear_model()
    span = world.wobble_span(linear, critical_speeds(linear, max_speed=settings.fastest), settings.fastest)
    return End(what, span, world.least_damped_wobble(modes(linear, settings.speeds)))


def hinges(settings: Settings, cases: Sequence[TyreCase], focus: TyreCase) -> tuple[Hinge, ...]:
    """Vary everything that is assumed or chosen one at a time around the reference world, the largest change first."""
    found = []
    for what, ends in _variations(settings, cases, focus):
        try:
            low, high = (wobble(*end, value) for value, end in ends.items())
        except InputError:
            continue  # an end that makes no model tells nothing
        found.append(Hinge(what, low, high))
    return tuple(sorted(found, key=lambda one: -one.size))


Ends = dict[str, tuple[Settings, Setup, Array]]  # value -> study, world and tyre of the end


def _variations(settings: Settings, cases: Sequence[TyreCase], focus: TyreCase) -> Iterator[tuple[str, Ends]]:
    """Yield the thing that is varied, and both of its ends."""
    base, ranges = focus.on(settings.reference), settings.ranges

    def ends(what: str, values: Iterable[Any], unit: str, front: Front | None = None) -> tuple[str, Ends]:
        worlds = [{what: v} if front is None else {"front": replace(front, **{what: v})} for v in values]
        return WORDS[what], {
            f"{v:g} {unit}".strip(): (settings, replace(base, **own), focus.contact)
            for v, own in zip(values, worlds, strict=True)
        }

    yield (
        "hands",
        {
            "off the bar": (settings, base, focus.contact),
            "on the bar": (settings, replace(base, arms=settings.arms), focus.contact),
        },
    )
    if front := base.front:
        yield (
            "front",
            {
                "flexible": (settings, base, focus.contact),
                "rigid": (settings, replace(base, front=None), focus.contact),
            },
        )
        yield ends("stiffness", ranges.stiffness, "N m/rad", front)
        yield ends("damping", ranges.damping, "N m s/rad", front)
        yield ends("joint_height", [round(front.joint_height + shift, 3) for shift in ranges.hinge], "m", front)
        if ranges.friction[1] > 0:
            yield ends("friction", [front.friction + more for more in ranges.friction], "N m s/rad", front)
    for what, unit in (("camber_share", "× load"), ("trail", "m"), ("twisting", "N m/rad")):
        given = EFFECTS[what] in settings.further or (what == "trail" and world.has_moment(settings))
        if not given and getattr(base, what) == getattr(settings, what):  # the tyre's file says nothing of it
            yield ends(what, getattr(ranges, what), unit)
    measured = sorted((one for one in cases if one.pressures_bar), key=lambda one: one.pressure_bar)
    if len(measured) > 1:
        yield (
            "pressure",
            {one.condition: (settings, one.on(settings.reference), one.contact) for one in (measured[0], measured[-1])},
        )
    seated: Ends = {
        own.bicycle.name.rpartition("_")[2]: (own, case.on(own.reference), case.contact)
        for own in (replace(settings, bicycle=bicycle) for bicycle in settings.postures)
        for case in tyre_cases(own).found
        if (case.name, case.condition) == (focus.name, focus.condition)
    }
    if len(seated) > 1:
        yield "posture of the rider", {name: seated[name] for name in (next(iter(seated)), next(reversed(seated)))}


WORDS = {
    "stiffness": "stiffness of the front", "damping": "damping of the front", "joint_height": "height of its hinge",
    "friction": "friction of the steering", "camber_share": "camber thrust", "trail": "trail of the tyres",
    "twisting": "twisting torque",
}  # fmt: skip
EFFECTS = {"camber_share": "camber_thrust", "trail": TRAIL, "twisting": TWIST}


@dataclass(frozen=True, eq=False)
class ContactModels:
    """Wobble of one case in the reference world with three models of the contact.

    A single lag; the lag with the trail of the string; a string in contact over twice ``half_length`` (m, rear and
    front). The last two differ by the lag alone.
    """

    case: TyreCase
    half_length: tuple[float, float]
    trail: tuple[float, float]  # m, of the string, rear and front
    estimated: bool  # ``half_length`` from load, pressure and width; False: the default of the effect
    lag: End  # single lag without trail
    trailing: End  # single lag with the trail of the string
    string: End  # string in contact over its length


def contact_models(settings: Settings, cases: Iterable[TyreCase]) -> tuple[ContactModels, ...]:
    """Compare every case with the default contact, then with its own; none if a model file says what the contact is."""
    if world.has_moment(settings):
        return ()
    assumed = next(p.default for p in effect_class(CONTACT_LENGTH).parameters if p.name == "half_length")
    radii = (settings.bicycle["rR"], settings.bicycle["rF"])
    found = []
    for estimated in (False, True):
        for case in cases:
            wanted: Any = [assumed, assumed]
            if estimated:
                if not case.properties or case.width is None:
                    continue
                wanted = [
                    half_length_under_load(load=p.load, pressure=p.pressure, wheel_radius=r, tyre_width=case.width)
                    for p, r in zip(case.properties, radii, strict=True)
                ]
            half = np.minimum(wanted, LIMITS.widest * case.contact[1::2])
            trail = string_trail(half_length=half, relaxation_length=case.contact[1::2])
            base = case.on(settings.reference)
            rear, front = half.tolist()
            worlds = (
                replace(base, trail=0.0),
                replace(base, trail=tuple(trail.tolist())),
                replace(base, contact_half_length=(rear, front)),
            )
            ends = [wobble(settings, one, case.contact) for one in worlds]
            found.append(ContactModels(case, (rear, front), tuple(trail.tolist()), estimated, *ends))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Amplitude:
    """Periodic motions of one case in the reference world on tyres that saturate; ``refused`` says why not."""

    case: TyreCase
    traces: tuple[Trace, ...] = ()
    wobble: Extent | None = None
    peak_factor: float | None = None  # assumed; None: the tyre file holds whole curves
    refused: str = ""  # reason; empty: they could be followed

    @property
    def jumps(self) -> bool:
        """True if there are motions of wobble, lasting or not: a kick may start one."""
        return any(WOBBLE in one.mode.split("+") for one in self.traces)


def amplitude(settings: Settings, case: TyreCase, setup: Setup) -> Amplitude:
    """Follow the periodic motions of one case, and how large its wobble gets at the speeds looked at."""
    curves = curves_of({"effects": {LAW: dict(case.table)}})
    try:
        found = find_limit_cycles(
            world.model(settings, case.on(setup), case.contact),
            rear=curves.get("rear"),
            front=curves.get("front"),
            max_speed=settings.max_speed,
        )
    except InputError as error:
        return Amplitude(case, refused=str(error))
    traces = tuple(traces_of(found))
    return Amplitude(case, traces, extent(traces, up_to=settings.fastest), None if curves else MagicTyre().friction)


@dataclass(frozen=True, eq=False)
class Sources:
    """Sources of the uncertainty of one case in the reference world."""

    # of each critical speed's variance (sum 1), by what is uncertain
    shares: Mapping[CrossingIdentity, Mapping[str, float]]
    exact: Mapping[str, str]  # parameter -> why no standard deviation of it counts
    assumed: Mapping[str, tuple[float, float]]  # parameter -> value and assumed standard deviation, SI


def sources(settings: Settings, case: TyreCase) -> Sources:
    """Compute the share of each source in the variance of the critical speeds of a case."""
    uncertain = world.uncertainty(settings, case, settings.reference)
    crossings = uncertain.crossings(settings.fastest)
    slopes = critical_speed_sensitivities(uncertain.nominal, list(crossings.values())) if crossings else {}
    shares = {
        which: by_group(uncertain.shares(uncertain.gradient({key: one[k] for key, one in slopes.items()})))
        for k, which in enumerate(crossings)
    }
    values = uncertain.nominal.parameters
    taken = {key: (values[key], sd) for key, sd in assumed_sd(uncertain).items()}
    return Sources(shares, counted_as_exact(uncertain), taken)


@dataclass(frozen=True, eq=False)
class Check:
    """Frequency, damping ratio and critical speeds of wobble of one result, linear and of random bicycles."""

    result: Result
    quantities: tuple[Quantity, ...]
    failure: str = ""  # reason; empty: it could be computed


def check(settings: Settings, result: Result) -> Check:
    """Compare linear and sampled standard deviations of one result; a check that fails costs nothing else."""
    try:
        return Check(
            result,
            tuple(
                world.uncertainty(settings, result.case, result.setup).quantities(
                    np.array([settings.report_speed]),
                    max_speed=settings.max_speed,
                    samples=settings.samples,
                    seed=settings.seed,
                    only=[WOBBLE],
                    matched=True,
                )
            ),
        )
    except InputError as error:
        return Check(result, (), str(error))


@dataclass(frozen=True, eq=False)
class Plausible:
    """Onset and end (m/s) of unstable wobble of each random bicycle (n,), NaN if it has none; and its growth.

    ``growth`` (n, speeds), 1/s, is the largest real part of the oscillations of wobble's frequencies.
    """

    case: TyreCase
    setup: Setup
    onset: Array  # (n,), m/s; NaN: stable up to the highest speed, or not computed
    end: Array  # (n,), m/s, at most the highest speed; NaN likewise
    computed: NDArray[np.bool_]  # (n,), False: the draw makes no model
    growth: Array  # (n, speeds), 1/s; NaN without such an oscillation

    @property
    def count(self) -> int:
        """Number of bicycles that were computed."""
        return int(self.computed.sum())

    @property
    def unstable(self) -> Array:
        """Length of the unstable speeds of each, m/s (n,)."""
        return np.nan_to_num(self.end - self.onset, nan=0.0)

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
    count, speeds = settings.fronts, growth_speeds(settings)
    onset, end = np.full((2, count), np.nan)
    computed, growth = np.zeros(count, bool), np.full((count, len(speeds)), np.nan)
    uncertain = world.uncertainty(settings, case, setup)
    family = ModelFamily(uncertain.nominal)
    drawn = front_draws(settings)
    for k, values in enumerate(world.draws(settings, case, uncertain, count)):
        if values is None:
            continue
        try:
            linear = family.linear_model(values | front_values(settings, case.on(setup), drawn, k, values))
            span = world.wobble_span(linear, critical_speeds(linear, max_speed=settings.fastest), settings.fastest)
            growth[k] = wobble_growth(linear, speeds)
        except InputError:  # a draw that makes no model is counted, and told beside the count
            continue
        computed[k] = True
        if span:
            onset[k], end[k] = span.low, min(span.high, settings.fastest)
    return Plausible(case, setup, onset, end, computed, growth)


def growth_speeds(settings: Settings) -> Array:
    """Choose the speeds (30,), m/s, at which the growth of the plausible bicycles is drawn."""
    return np.linspace(1.0, settings.fastest, 30)


def wobble_growth(linear: LinearModel, speeds: Array) -> Array:
    """Find the largest real part (1/s) of oscillations of wobble's frequencies at ``speeds`` (n,); NaN without one."""
    values = linear.eigenvalues(speeds)
    hertz = frequency_hz(values)
    found = np.where((hertz >= LIMITS.wobble_hz) & (hertz < LIMITS.tyres_hz), values.real, -np.inf).max(axis=1)
    return np.where(np.isfinite(found), found, np.nan)


def front_draws(settings: Settings) -> Mapping[str, Array]:
    """Draw numbers (fronts,), in the units of the ranges, of each quantity; the same for every case."""
    from scipy.stats import qmc

    ranges = vars(settings.ranges)
    size = 2 ** int(np.ceil(np.log2(max(settings.fronts, 2))))
    # "rng" is the newer name, of scipy 1.15
    u = qmc.Sobol(len(ranges), seed=np.random.default_rng(settings.seed)).random(size)[: settings.fronts]
    return {
        name: np.asarray(low * (high / low) ** share if low > 0 else low + (high - low) * share)
        for share, (name, (low, high)) in zip(u.T, ranges.items(), strict=True)
    }


def front_values(
    settings: Settings, setup: Setup, drawn: Mapping[str, Array], k: int, values: Mapping[str, float]
) -> dict[str, float]:
    """Compute parameters (SI) of effects but the contact law, for draw ``k`` of ``drawn`` on a bicycle of ``values``.

    What the file of the tyre or the model holds of trail and twisting torque stays.
    """
    new = {name: float(numbers[k]) for name, numbers in drawn.items()}
    found: dict[str, float] = {}
    for name, effect in EFFECTS.items():
        keys = [key for key in values if key.startswith(f"{effect}.") and "lag_share" not in key]
        given, nominal = effect in settings.further, getattr(settings, name)
        if given and name == "camber_share":
            found |= {key: values[key] * new[name] for key in keys}
        elif not given and getattr(setup, name) == nominal and nominal:
            found |= {key: values[key] * new[name] / nominal for key in keys}
    if setup.front:
        front = replace(
            setup.front,
            stiffness=new["stiffness"],
            damping=new["damping"],
            joint_height=setup.front.joint_height + new["hinge"],
            friction=setup.front.friction + new["friction"],
        )
        found |= {
            "front_compliance.stiffness": front.stiffness,
            "front_compliance.damping": front.damping,
            "front_compliance.joint_z": -front.joint_height,
            "front_compliance.joint_x": float(front.hinge_x(values)),
            f"{FRICTION}.damping": float(
                world.effect_tables(settings, replace(setup, front=front))[FRICTION]["damping"]
            ),
        }
    if setup.arms:
        found |= {f"rider_arms.{name}": new[f"arm_{name}"] for name in ("inertia", "stiffness", "damping")}
    return found
