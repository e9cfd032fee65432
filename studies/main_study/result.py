"""Modes, damping ratios, critical speeds and unstable wobble of one tyre condition in one case, each with its sd.

Wobble is the oscillation that mode tracking names so: the front frame turning about the steer axis. Frequency alone
does not distinguish it from weave; it decides only if tracking gives both names.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

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
from studies.main_study.settings import CONTACT_LENGTH, LAW, LIMITS, PerWheel, Settings, Setup
from studies.uncertainty.propagation import Uncertainty
from tyre.ground.arrays import Array

WOBBLE, WEAVE = "wobble", "weave"
COMPARED = (WOBBLE, WEAVE)
CAMBER = tuple(f"camber_thrust.camber_stiffness.{wheel}" for wheel in WHEELS)
FRICTION = "steer_damper"
TRAIL, TWIST = "pneumatic_trail", "twisting_torque"
# effects whose numbers the samples vary: they are treated as exact in a standard uncertainty
PLAUSIBLE = ("front_compliance", "rider_arms", FRICTION, "camber_thrust", TRAIL, TWIST)


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
            "damping": front.damping,
            "joint_x": float(front.hinge_x(p)),
            "joint_z": -front.joint_height,
        }
        if front.axis_tilt is not None:
            compliance["axis_tilt"] = front.axis_tilt
        tables["front_compliance"] = compliance
        damper = settings.further.get(FRICTION, {})
        damping = 0.0
        if FRICTION in settings.further:
            default = next(p.default for p in effect_class(FRICTION).parameters if p.name == "damping")
            damping = float(damper.get("damping", default))
        tables[FRICTION] = {**damper, "damping": damping + front.friction}
    if setup.contact_half_length:
        tables[CONTACT_LENGTH] = {"half_length": dict(zip(WHEELS, setup.contact_half_length, strict=True))}
    return tables


def _by_wheel(value: PerWheel) -> dict[str, float]:
    """Give a number for both wheels, or one for each, by wheel."""
    return dict(zip(WHEELS, np.broadcast_to(value, 2).tolist(), strict=True))


def follow(settings: Settings, setup: Setup, p: Mapping[str, Any]) -> dict[str, Any]:
    """Compute the assumed parameters (SI) that depend on the bicycle ``p``: camber stiffness, place of the joint."""
    dependent: dict[str, Any] = {}
    if "camber_thrust" not in settings.further:
        dependent |= zip(CAMBER, _camber_stiffness(setup, p), strict=True)
    if setup.front and setup.front.joint_x is None:
        dependent["front_compliance.joint_x"] = setup.front.hinge_x(p)
    return dependent


def _camber_stiffness(setup: Setup, p: Mapping[str, Any]) -> tuple[Any, Any]:
    """Compute camber stiffness (N/rad), rear and front: the share of the wheel load that a case assumes."""
    rear, front = static_loads(bodies(p), p["w"], p["g"])
    share = np.broadcast_to(setup.camber_share, 2)
    return share[0] * rear, share[1] * front


def uncertainty(settings: Settings, case: TyreCase, setup: Setup) -> Uncertainty:
    """Make the model of a case with the covariance of all that is uncertain about tyre and bicycle."""
    setup = case.apply_to(setup)
    content = {
        "bicycle": {key: settings.bicycle[key] for key in UNITS},
        "effects": {LAW: dict(case.table), **effect_tables(settings, setup)},
    }

    # What the samples vary is treated as exact here, unless it follows from the bicycle.
    followers = follow(settings, setup, settings.bicycle.values)
    parameters = model(settings, setup, case.contact).parameters
    exact = {key: 0.0 for key in parameters if ParameterKey.parse(key).effect in PLAUSIBLE and key not in followers}
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

    All conditions share the samples of the bicycle; each has its own samples of the tyres.
    """
    bicycles = uncertain.draw(count, settings.seed)
    tyres = uncertain.draw(count, 1 + settings.seed + sum(map(ord, case.name + case.condition)))
    points = uncertain.points(np.where([name.startswith("tyre ") for name in uncertain.names], tyres, bicycles))
    for k, impossible in enumerate(points.refused.mask):
        yield None if impossible else {key: points.value(key, k) for key in points.values}


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
    """Unstable wobble from its first onset to its last end, m/s; from 0 at rest on, to infinity beyond ``limit``."""

    low: float  # m/s; 0: unstable from rest on
    high: float  # m/s; infinite: unstable beyond the limit
    limit: float  # m/s, highest speed studied

    @property
    def endless(self) -> bool:
        """True if it extends beyond the speeds studied."""
        return self.high > self.limit


def wobble_edges(edges: Iterable[ACriticalSpeed]) -> list[ACriticalSpeed]:
    """Select the critical speeds at which wobble becomes unstable or stable, rising."""
    return sorted((edge for edge in edges if is_wobble(edge)), key=lambda edge: edge.speed)


def is_wobble(edge: CriticalSpeed) -> bool:
    """Return True if wobble becomes unstable or stable at a critical speed."""
    if not edge.oscillatory or WOBBLE not in edge.mode.split("+") or edge.frequency_hz >= LIMITS.tyres_hz:
        return False
    return edge.mode == WOBBLE or edge.frequency_hz >= LIMITS.wobble_hz


def wobble_span(linear: LinearModel, edges: Iterable[CriticalSpeed], limit: float) -> Span | None:
    """Find unstable wobble up to ``limit`` (m/s), from its first onset to its last end; None if there is none."""
    within = [edge for edge in wobble_edges(edges) if edge.speed <= limit]
    if not within:
        for speed in (1e-3 * limit, limit):  # not at rest, where a bicycle without damping is neutral
            values = linear.eigenvalues(speed)
            hertz = frequency_hz(values)
            if not ((values.real > 0) & (hertz >= LIMITS.wobble_hz) & (hertz < LIMITS.tyres_hz)).any():
                return None
        return Span(0.0, math.inf, limit)
    first, last = within[0], within[-1]
    low = float(first.speed) if first.destabilising else 0.0
    return Span(low, math.inf if last.destabilising else float(last.speed), limit)


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

    def bands(self, limit: float) -> list[Band]:
        """Bands of unstable wobble that start up to ``limit`` (m/s); one without edges if unstable throughout."""
        bands = unstable_bands(self.wobble_edges)
        if not bands and self.span(limit):
            return [Band(None, None)]
        return [band for band in bands if not band.start or band.start.speed <= limit]

    @property
    def wobble_edges(self) -> list[UncertainCriticalSpeed]:
        """Critical speeds at which wobble becomes unstable or stable, rising."""
        return wobble_edges(self.crossings)

    def span(self, limit: float) -> Span | None:
        """Find unstable wobble at speeds up to ``limit`` (m/s), from first onset to last end; None without any."""
        return wobble_span(self.modes.model, self.crossings, limit)


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
    return Result(case, setup, modes_along_speed, crossings, frequency, damping, least)


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
