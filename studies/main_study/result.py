"""Modes, damping ratios, critical speeds and unstable wobble of one tyre condition in one case, each with its sd.

Wobble is the oscillation that mode tracking names so: the front frame turning about the steer axis. Frequency alone
does not distinguish it from weave; it decides only if tracking gives both names.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bicycle.effects.effect import WHEELS
from bicycle.effects.effect_registry import effect_class
from bicycle.model.eigen import angular_frequency, damping_ratio, frequency_hz
from bicycle.model.model import Model
from bicycle.model.state_space import LinearModel
from bicycle.parameters.bicycle import UNITS, bodies, static_loads
from bicycle.parameters.parameter_covariance import ParameterKey
from bicycle.stability.critical import ACriticalSpeed, CriticalSpeed, critical_speeds
from bicycle.stability.named_modes import Modes, modes
from bicycle.stability.propagation import critical_speed_gradients, mode_gradients, standard_deviation
from studies.main_study.cases import CONTACT, TyreCase
from studies.main_study.settings import CONTACT_LENGTH, LAW, LIMITS, SADDLE, PerWheel, Settings, Setup
from studies.uncertainty.propagation import Uncertainty
from tyre.ground.arrays import Array, Complex

WOBBLE, WEAVE = "wobble", "weave"
SLOW, FAST = "slow", "fast"  # growth of wobble
GRID = 0.25  # m/s, between the speeds at which the growth of wobble is computed
COMPARED = (WOBBLE, WEAVE)
CAMBER = tuple(f"camber_thrust.camber_stiffness.{wheel}" for wheel in WHEELS)
FRICTION = "steer_damper"
TRAIL, TWIST = "pneumatic_trail", "twisting_torque"
# effects whose numbers the samples vary: they are treated as exact in a standard uncertainty
PLAUSIBLE = ("front_compliance", "rider_arms", SADDLE, FRICTION, "camber_thrust", TRAIL, TWIST)
BODY = ("mass", "x", "z", "Ixx", "Izz", "Ixz")  # parameters of the rider on the saddle


def model(settings: Settings, setup: Setup, contact: Sequence[float] | Array) -> Model:
    """Put a bicycle on tyres with the four numbers of ``contact`` (N/rad and m, rear then front)."""
    rear_stiffness, rear_length, front_stiffness, front_length = (float(value) for value in contact)
    law = {
        "cornering_stiffness": {"rear": rear_stiffness, "front": front_stiffness},
        "relaxation_length": {"rear": rear_length, "front": front_length},
    }
    effects = {**effect_tables(settings, setup), LAW: law}
    return Model(settings.bicycle, tuple(effect_class(name)(**table) for name, table in effects.items()))


def effect_tables(settings: Settings, setup: Setup) -> dict[str, dict[str, Any]]:
    """Make the tables of all effects but the contact law (SI); what the user gave comes before what is assumed."""
    p, front, arms = settings.bicycle.values, setup.front, setup.arms
    camber = {wheel: float(value) for wheel, value in zip(WHEELS, _camber_stiffness(setup, p), strict=True)}
    tables: dict[str, dict[str, Any]] = {"camber_thrust": {"camber_stiffness": camber}}
    if np.any(setup.trail) and not setup.contact_half_length and not settings.has_moment:
        tables[TRAIL] = {"trail": _by_wheel(setup.trail)}
    if np.any(setup.twisting):
        tables[TWIST] = {"twisting_stiffness": _by_wheel(setup.twisting)}
    tables |= {name: dict(table) for name, table in settings.further.items()}
    if arms:
        tables["rider_arms"] = {"inertia": arms.inertia, "stiffness": arms.stiffness, "damping": arms.damping}
    if front:
        compliance = {
            "stiffness": front.stiffness,
            "damping": float(front.damping(p)),
            "joint_x": float(front.hinge_x(p)),
            "joint_z": -front.joint_height,
        }
        if front.axis_tilt is not None:
            compliance["axis_tilt"] = front.axis_tilt
        tables["front_compliance"] = compliance
    if setup.friction and FRICTION not in settings.further:
        tables[FRICTION] = {"damping": setup.friction}
    if setup.contact_half_length:
        tables[CONTACT_LENGTH] = {"half_length": dict(zip(WHEELS, setup.contact_half_length, strict=True))}
    return tables


def _by_wheel(value: PerWheel) -> dict[str, float]:
    """Give a number for both wheels, or one for each, by wheel."""
    return dict(zip(WHEELS, np.broadcast_to(value, 2).tolist(), strict=True))


def follow(settings: Settings, setup: Setup, p: Mapping[str, Any]) -> dict[str, Any]:
    """Compute the assumed parameters (SI) that depend on the bicycle ``p``: camber stiffness, place and damping."""
    dependent: dict[str, Any] = {}
    if "camber_thrust" not in settings.further:
        dependent |= zip(CAMBER, _camber_stiffness(setup, p), strict=True)
    if setup.front and setup.front.joint_x is None:
        dependent["front_compliance.joint_x"] = setup.front.hinge_x(p)
    if setup.front and (not setup.front.from_file or "damping_ratio" in setup.front.defaults):
        dependent["front_compliance.damping"] = setup.front.damping(p)
    if _states_rider(settings):
        dependent |= _follow_rider(settings, p)
    return dependent


def _states_rider(settings: Settings) -> bool:
    """True if the model file states the body of the rider on the saddle."""
    return settings.further.get(SADDLE, {}).keys() >= set(BODY)


def _follow_rider(settings: Settings, p: Mapping[str, Any]) -> dict[str, Any]:
    """Body of the rider on the saddle (SI) if the bicycle ``p`` differs from the nominal one by its rider alone."""
    nominal, body = settings.bicycle, settings.further[SADDLE]
    frame_mass = nominal["mB"] - body["mass"]
    frame = {axis: (nominal["mB"] * nominal[f"{axis}B"] - body["mass"] * body[axis]) / frame_mass for axis in "xz"}
    mass = p["mB"] - frame_mass
    centre = {axis: (p["mB"] * p[f"{axis}B"] - frame_mass * frame[axis]) / mass for axis in "xz"}

    def moment(first: str, second: str) -> Any:
        """Second moment of the mass of the whole at ``p`` less that of the frame, about the body's mass centre."""
        at_frame = (frame[first] - centre[first]) * (frame[second] - centre[second])
        at_whole = (p[f"{first}B"] - centre[first]) * (p[f"{second}B"] - centre[second])
        return p["mB"] * at_whole - frame_mass * at_frame

    def of_frame(entry: str, first: str, second: str, sign: int) -> float:
        """Inertia of the frame without rider about its mass centre."""
        whole = nominal["mB"] * (nominal[f"{first}B"] - frame[first]) * (nominal[f"{second}B"] - frame[second])
        rider = body["mass"] * (body[first] - frame[first]) * (body[second] - frame[second])
        return float(nominal[f"IB{entry}"] - body[f"I{entry}"] + sign * (whole - rider))

    inertias = {}
    for entry, first, second, sign in (("xx", "z", "z", 1), ("zz", "x", "x", 1), ("xz", "x", "z", -1)):
        inertia = p[f"IB{entry}"] - of_frame(entry, first, second, sign) + sign * moment(first, second)
        inertias[f"I{entry}"] = inertia
    body_at_p = {"mass": mass, "mass_share": 1.0, "inertia_share": 1.0} | centre | inertias
    return {f"{SADDLE}.{name}": value for name, value in body_at_p.items()}


def _camber_stiffness(setup: Setup, p: Mapping[str, Any]) -> tuple[Any, Any]:
    """Compute camber stiffness (N/rad), rear and front: the share of the wheel load that a case assumes."""
    rear, front = static_loads(bodies(p), p["w"], p["g"])
    share = np.broadcast_to(setup.camber_share, 2)
    return share[0] * rear, share[1] * front


def uncertainty(settings: Settings, case: TyreCase, setup: Setup) -> Uncertainty:
    """Make the model of a case with the covariance of all that is uncertain about tyre and bicycle."""
    setup = case.apply_to(setup)
    content: dict[str, Any] = {
        "bicycle": {key: settings.bicycle[key] for key in UNITS},
        "effects": {LAW: dict(case.table), **effect_tables(settings, setup)},
    }
    if _states_rider(settings):  # a body that follows the bicycle is possible in every sample
        rider = {key: value for key, value in settings.further[SADDLE].items() if key not in BODY}
        content["effects"][SADDLE] = rider
    parameters = model(settings, setup, case.contact).parameters
    measured = [name for name in settings.measured.names if name in parameters]
    if measured:
        content["covariance"] = {"parameters": measured, "matrix": settings.measured.among(measured).tolist()}

    # What the samples vary is treated as exact here, unless it was measured or follows from the bicycle.
    known = {*measured, *follow(settings, setup, settings.bicycle.values)}
    exact = {key: 0.0 for key in parameters if ParameterKey.parse(key).effect in PLAUSIBLE and key not in known}
    return Uncertainty(
        content,
        sd=exact,
        defaults=True,
        bicycle_sd=settings.bicycle.sd,
        follow=lambda p: follow(settings, setup, p),
        bicycle_covariance=settings.bicycle.covariance,
    )


def draws(settings: Settings, case: TyreCase, uncertain: Uncertainty, count: int) -> Iterator[dict[str, float] | None]:
    """Yield the parameters (SI) of ``count`` samples; None for an impossible sample.

    All conditions share the samples of the bicycle. The tyre's errors are in part common to its pressures, which one
    rig measured (:attr:`Settings.common_error`), and in part those of the condition.
    """
    sampled = uncertain.draw(count, settings.seed)
    of_tyre = np.flatnonzero([name.startswith("tyre ") for name in uncertain.names])
    if len(of_tyre):
        rig = np.random.default_rng([settings.seed, *case.name.encode()])
        condition = np.random.default_rng([settings.seed, *(case.name + case.condition).encode()])
        common = settings.common_error
        errors = math.sqrt(common) * rig.standard_normal((count, len(CONTACT)))
        errors += math.sqrt(1 - common) * condition.standard_normal((count, len(CONTACT)))
        sampled[:, of_tyre] = errors @ _towards_relative_errors(uncertain, case, of_tyre)
    points = uncertain.points(sampled)
    for k, impossible in enumerate(points.refused.mask):
        yield None if impossible else {key: points.value(key, k) for key in points.values}


def _towards_relative_errors(uncertain: Uncertainty, case: TyreCase, of_tyre: NDArray[np.intp]) -> Array:
    """Rotation (4, n) from errors of the numbers of the contact to the n standard normal numbers of the tyre.

    The n numbers are principal axes, whose signs mean nothing. So that the same four errors mean the same relative
    change of stiffness and length at every pressure, they are applied by the symmetric root of the covariance.
    """
    slopes = np.array([uncertain.jacobian[key][of_tyre] for key in CONTACT]) / case.contact[:, None]
    left, _, right = np.linalg.svd(slopes, full_matrices=False)
    return np.asarray(left @ right)


@dataclass(frozen=True)
class UncertainCriticalSpeed(CriticalSpeed):
    """Critical speed with standard uncertainties (m/s): of tyre data and bicycle, and of the tyre data alone."""

    sd: float  # m/s, of tyre data and bicycle
    tyre_sd: float  # m/s, of the tyre data alone


@dataclass(frozen=True)
class Band:
    """Speeds in which a mode is unstable; None: onset or end outside the speeds studied."""

    start: UncertainCriticalSpeed | None  # where the mode becomes unstable
    end: UncertainCriticalSpeed | None  # where it becomes stable again, at a higher speed


@dataclass(frozen=True)
class Span:
    """Speeds, m/s, from the first to the last at which wobble grows by at least :attr:`Limits.growth`.

    It lies at speeds at which the bicycle can be ridden, see :func:`wobble_span`.
    """

    low: float  # m/s
    high: float  # m/s; infinite: wobble grows beyond the limit
    limit: float  # m/s, highest speed studied
    eigenvalue: complex  # 1/s, of wobble where it grows fastest, upper half plane
    fastest_at: float  # m/s, speed of that growth

    @property
    def growth(self) -> float:
        """Fastest growth, 1/s."""
        return self.eigenvalue.real

    @property
    def frequency_hz(self) -> float:
        """Frequency where it grows fastest, Hz."""
        return float(frequency_hz(self.eigenvalue))

    @property
    def endless(self) -> bool:
        """True if it extends beyond the speeds studied."""
        return self.high > self.limit

    @property
    def grade(self) -> str:
        """SLOW or FAST."""
        return FAST if self.growth >= LIMITS.fast_growth else SLOW


def wobble_edges(edges: Iterable[ACriticalSpeed]) -> list[ACriticalSpeed]:
    """Select the critical speeds at which wobble becomes unstable or stable, rising."""
    return sorted((edge for edge in edges if is_wobble(edge)), key=lambda edge: edge.speed)


def is_wobble(edge: CriticalSpeed) -> bool:
    """Return True if wobble becomes unstable or stable at a critical speed."""
    if not edge.oscillatory or WOBBLE not in edge.mode.split("+") or edge.frequency_hz >= LIMITS.tyres_hz:
        return False
    return edge.mode == WOBBLE or edge.frequency_hz >= LIMITS.wobble_hz


@dataclass(frozen=True, eq=False)
class Branch:
    """Unstable wobble of one band of speeds, followed along speed."""

    linear: LinearModel
    speeds: Array  # (n,), m/s, rising
    roots: Complex  # (n,), 1/s, upper half plane

    def edge(self, before: int) -> float:
        """Find the speed (m/s) after that number ``before`` at which the growth is that of wobble."""
        slow, fast = (float(speed) for speed in self.speeds[before : before + 2])
        start, end = self.roots[before : before + 2]

        def excess(speed: float) -> float:
            between = start + (end - start) * (speed - slow) / (fast - slow)
            return nearest_root(self.linear, speed, between).real - LIMITS.growth

        return float(brentq(excess, slow, fast, xtol=1e-6))


def wobble_span(linear: LinearModel, edges: Iterable[CriticalSpeed], *, hands_on: bool, limit: float) -> Span | None:
    """Find the speeds up to ``limit`` (m/s) at which wobble grows by :attr:`Limits.growth` or more; None without any.

    ``edges`` are the critical speeds of the model; the name at a crossing is that of the motion beyond it. Hands on
    wobble counts from the slowest ridden speed; hands off from :attr:`Limits.hands_off`, or the weave speed if that is
    higher.
    """
    edges = list(edges)
    slowest = LIMITS.ridden[0] if hands_on else max(LIMITS.hands_off, _weave_speed(edges))
    lows, highs, peaks = [], [], []  # m/s, m/s, and (growth, speed, frequency)
    for branch in unstable_wobble(linear, edges, limit):
        growth = np.where(branch.speeds >= slowest, branch.roots.real, -np.inf)
        wobbles = np.flatnonzero(growth >= LIMITS.growth)
        if not len(wobbles):
            continue
        first, last, peak = int(wobbles[0]), int(wobbles[-1]), int(np.argmax(growth))
        low, high = float(branch.speeds[first]), float(branch.speeds[last])
        if first:
            low = branch.edge(first - 1) if branch.roots[first - 1].real < LIMITS.growth else slowest
        if last + 1 < len(growth):
            high = branch.edge(last)
        lows.append(max(low, slowest))
        highs.append(high if high < limit else math.inf)
        peaks.append((complex(branch.roots[peak]), float(branch.speeds[peak])))
    if not peaks:
        return None
    eigenvalue, speed = max(peaks, key=lambda peak: peak[0].real)
    return Span(min(lows), max(highs), limit, eigenvalue, speed)


def _weave_speed(edges: Iterable[CriticalSpeed]) -> float:
    """Speed (m/s) from which weave is stable; 0 if it becomes stable nowhere."""
    stable_above = [edge.speed for edge in edges if edge.mode == WEAVE and edge.oscillatory and not edge.destabilising]
    return float(min(stable_above, default=0.0))


def unstable_wobble(linear: LinearModel, edges: Iterable[CriticalSpeed], limit: float) -> Iterator[Branch]:
    """Follow wobble through each band of speeds up to ``limit`` (m/s) in which it is unstable."""
    within = [edge for edge in wobble_edges(edges) if edge.speed < limit]
    if not within and (root := _unstable_throughout(linear, limit)):
        yield _follow(linear, np.array([limit, 1e-3 * limit]), root)
    onset: CriticalSpeed | None = None
    for edge in within:
        root = complex(0.0, edge.angular_frequency)
        if edge.destabilising:
            onset = edge
        elif onset:
            yield _follow(linear, np.array([onset.speed, edge.speed]), complex(0.0, onset.angular_frequency))
            onset = None
        elif edge is within[0]:
            yield _follow(linear, np.array([edge.speed, 1e-3 * limit]), root)
    if onset:
        yield _follow(linear, np.array([onset.speed, limit]), complex(0.0, onset.angular_frequency))


def _unstable_throughout(linear: LinearModel, limit: float) -> complex | None:
    """Root of wobble (1/s) at ``limit`` (m/s) if it grows from rest to there; None if not.

    Not at rest itself, where a bicycle without damping is neutral.
    """
    values = linear.eigenvalues(np.array([1e-3 * limit, limit]))
    hertz = frequency_hz(values)
    growing = (values.real > 0) & (hertz >= LIMITS.wobble_hz) & (hertz < LIMITS.tyres_hz)
    if not growing.any(axis=1).all():
        return None
    return complex(values[1][growing[1]][0])


def _follow(linear: LinearModel, ends: Array, root: complex) -> Branch:
    """Follow a ``root`` (1/s) at the first of two ``ends`` (m/s) to the other."""
    speeds = np.linspace(ends[0], ends[1], max(3, math.ceil(abs(ends[1] - ends[0]) / GRID) + 1))
    roots: list[complex] = []
    for values in linear.eigenvalues(speeds):
        expected = 2 * roots[-1] - roots[-2] if len(roots) > 1 else root
        root = complex(values[int(np.argmin(np.abs(values - expected)))])
        roots.append(root)
    rising = slice(None, None, 1 if ends[0] < ends[1] else -1)
    return Branch(linear, speeds[rising], np.array(roots)[rising])


def unstable_bands(crossings: Sequence[UncertainCriticalSpeed]) -> list[Band]:
    """Pair the crossings of one mode into bands of instability."""
    bands: list[Band] = []
    start: UncertainCriticalSpeed | None = None
    for crossing in sorted(crossings, key=lambda c: c.speed):
        if crossing.destabilising:
            start = crossing
        elif start or not bands:
            bands.append(Band(start, crossing))
            start = None
    return [*bands, Band(start, None)] if start else bands


@dataclass(frozen=True)
class Uncertain:
    """A number, its standard uncertainty, and that of the tyre data alone."""

    value: float  # in the unit of the quantity, as both sds
    sd: float  # of tyre data and bicycle
    tyre_sd: float  # of the tyre data alone


@dataclass(frozen=True)
class LeastDamped:
    """Wobble of minimum damping ratio at ridden speeds: eigenvalue (1/s) and speed (m/s)."""

    eigenvalue: complex  # 1/s, upper half plane
    speed: float  # m/s

    @property
    def damping_ratio(self) -> float:
        """Damping ratio, negative if unstable."""
        return float(damping_ratio(self.eigenvalue))


@dataclass(frozen=True, eq=False)
class Result:
    """One tyre case in one setup; the last speed of ``modes`` is the report speed, added to the study's."""

    case: TyreCase  # tyre, surface and pressures
    setup: Setup  # case: hands and front frame
    modes: Modes  # along the study's speeds, m/s
    crossings: tuple[UncertainCriticalSpeed, ...]  # up to the highest speed of the search, rising
    frequency: dict[str, Uncertain]  # mode -> Hz at the report speed; missing if it is no oscillation
    damping: dict[str, Uncertain]  # mode -> damping ratio, likewise
    least: LeastDamped | None  # None: wobble does not oscillate at ridden speeds
    wobble: Span | None  # up to the highest speed studied; None: no wobble that a rider meets

    def bands(self, limit: float) -> list[Band]:
        """Bands of unstable wobble that start up to ``limit`` (m/s); one without edges if unstable throughout."""
        bands = unstable_bands(self.wobble_edges)
        if not bands and _unstable_throughout(self.modes.model, limit):
            return [Band(None, None)]
        return [band for band in bands if not band.start or band.start.speed <= limit]

    @property
    def wobble_edges(self) -> list[UncertainCriticalSpeed]:
        """Critical speeds at which wobble becomes unstable or stable, rising."""
        return wobble_edges(self.crossings)


def solve(settings: Settings, case: TyreCase, setup: Setup) -> Result:
    """Compute modes, frequency and damping ratio at the report speed, and critical speeds, with their sds."""
    built = model(settings, case.apply_to(setup), case.contact)
    linear = built.linear_model()
    names, covariance = uncertainty(settings, case, setup).covariance()
    contact_places = [names.index(name) for name in CONTACT]
    tyre_covariance = np.zeros_like(covariance)
    tyre_covariance[np.ix_(contact_places, contact_places)] = case.covariance

    speeds = np.append(settings.speeds, settings.report_speed)
    modes_along_speed = modes(linear, speeds)
    roots = oscillations(modes_along_speed)
    hertz = {mode: float(frequency_hz(root)) for mode, root in roots.items()}
    ratios = {mode: float(damping_ratio(root)) for mode, root in roots.items()}
    gradients = mode_gradients(built, settings.report_speed, list(roots.values()), names)
    frequency = _add_sd(hertz, gradients[0], covariance, tyre_covariance)
    damping = _add_sd(ratios, gradients[1], covariance, tyre_covariance)

    critical = critical_speeds(linear, max_speed=settings.max_speed)
    slopes = critical_speed_gradients(built, critical, names)
    sds = standard_deviation(slopes, covariance).tolist()
    tyre_sds = standard_deviation(slopes, tyre_covariance).tolist()
    crossings = tuple(
        UncertainCriticalSpeed(**vars(crossing), sd=sd, tyre_sd=tyre_sd)
        for crossing, sd, tyre_sd in zip(critical, sds, tyre_sds, strict=True)
    )
    least = least_damped_wobble(modes_along_speed)
    wobble = wobble_span(linear, crossings, hands_on=setup.arms is not None, limit=settings.fastest)
    return Result(case, setup, modes_along_speed, crossings, frequency, damping, least, wobble)


def _add_sd(
    values: Mapping[str, float], gradients: Array, covariance: Array, tyre_covariance: Array
) -> dict[str, Uncertain]:
    """Give the value of each mode its standard uncertainties, from ``gradients`` (modes, p) in uncertain parameters."""
    sds = standard_deviation(gradients, covariance).tolist()
    tyre_sds = standard_deviation(gradients, tyre_covariance).tolist()
    rows = zip(values.items(), sds, tyre_sds, strict=True)
    return {mode: Uncertain(value, sd, tyre_sd) for (mode, value), sd, tyre_sd in rows}


def least_damped_wobble(modes_along_speed: Modes) -> LeastDamped | None:
    """Find the wobble of minimum damping ratio at ridden speeds; None if it does not oscillate there."""
    speeds = modes_along_speed.speeds
    ridden = (speeds >= LIMITS.ridden[0]) & (speeds <= LIMITS.ridden[1])
    oscillating = []
    for name, values in modes_along_speed.branches.items():
        if WOBBLE not in name.split("+"):
            continue
        slowest = 0.0 if name == WOBBLE else angular_frequency(LIMITS.wobble_hz)  # rad/s; slower may be weave
        for speed, root in zip(speeds[ridden], values[ridden, 0], strict=True):
            if root.imag > slowest:
                oscillating.append(LeastDamped(complex(root), float(speed)))
    return min(oscillating, key=lambda wobble: wobble.damping_ratio, default=None)


def oscillations(modes_along_speed: Modes) -> dict[str, complex]:
    """Select eigenvalues (1/s, upper half) of compared modes that oscillate at the last speed, the report speed."""
    values = {
        name: complex(modes_along_speed.branches[name][-1, 0])
        for name in COMPARED
        if name in modes_along_speed.branches
    }
    return {name: value for name, value in values.items() if value.imag > 0}


def nearest_root(linear: LinearModel, speed: float, eigenvalue: complex) -> complex:
    """Find the eigenvalue (1/s) of a model at a ``speed`` (m/s) that is nearest to ``eigenvalue`` (1/s)."""
    values = linear.eigenvalues(speed)
    return complex(values[int(np.argmin(np.abs(values - eigenvalue)))])
