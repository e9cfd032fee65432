"""Periodic motions of a bicycle on tyres that saturate: how large a wobble or weave gets, and what becomes of it.

Branches are followed from the critical speeds (`continuation`), each motion by harmonic balance (`slip_system`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bicycle.model.model import Model
from bicycle.motion.continuation import (
    FEWEST,
    TAIL,
    UNIT_SPEED,
    Balance,
    Branch,
    Point,
    Rest,
    follow,
    follow_both_ways,
    same,
)
from bicycle.motion.nonlinear import CurveTyre
from bicycle.motion.slip_system import (
    RATE_TIME,
    STICKS,
    Complex,
    Cycle,
    MagicTyre,
    SlipSystem,
    Tyre,
    half_period,
    peak,
)
from bicycle.stability.critical import CriticalSpeed, critical_speeds
from tyre.ground.errors import InputError

__all__ = ["Branch", "Cycle", "LimitCycles", "Onset", "find_limit_cycles", "find_onsets"]

LIMITS = {"steer": np.radians(20.0), "lean": np.radians(10.0)}  # up to which linear geometry is taken to hold
SLOWEST = 1.0  # Hz; what the left out geometry decides is slower: weave at 0.3 to 0.6 Hz
HEIGHT = 0.8  # m above the road on the steer axis, near a head tube
SADDLE = (0.21, -0.96)  # m: of a Pista with the seat of data/bicycles/pista_charlie_drops.toml
GRAVITY = 9.80665  # m/s^2 in one g
BAND = (-1.0, 1.0)  # added to E, of which a tyre without whole curves says nothing
BEYOND = 1.5  # times the limits: where a branch is given up
SLIDES = 3.0  # times the rate at which smoothed friction sets in: below, a motion is not given


@dataclass(frozen=True)
class Onset:
    """Behaviour near a critical speed: supercritical, subcritical or not determined."""

    critical: CriticalSpeed  # oscillatory, where the motion begins
    bend: float  # a' = growth a + bend a^3 of the steer amplitude a, 1/(s rad^2): the first Lyapunov coefficient
    band: tuple[float, float]  # its least and largest value over the band of E, in which it is linear

    @property
    def kind(self) -> str:
        """``supercritical``, ``subcritical``, or ``not determined``: slow, or its sign depends on the curves' E."""
        if self.critical.frequency_hz < SLOWEST or self.band[0] <= 0 <= self.band[1]:
            return "not determined"
        return "supercritical" if self.bend < 0 else "subcritical"


@dataclass(frozen=True)
class LimitCycles:
    """Periodic motions of a model over the speed.

    Attributes
    ----------
    model : Model
    system : SlipSystem
    onsets : tuple of Onset
        The oscillatory critical speeds and the bifurcation there; none with dry friction, which locks the steering.
    branches : tuple of Branch
    rear, front : MagicTyre, CurveTyre or None
        Curves of the tyres as they were given.
    max_speed : float
        m/s, up to which motions were followed.
    """

    model: Model
    system: SlipSystem = field(repr=False)
    onsets: tuple[Onset, ...] = ()
    branches: tuple[Branch, ...] = ()
    rear: Tyre | None = None
    front: Tyre | None = None
    max_speed: float = 60.0

    def __repr__(self) -> str:
        onsets = [f"{one.critical.mode} at {one.critical.speed:.4g} m/s ({one.kind})" for one in self.onsets]
        return (
            f"<LimitCycles up to {self.max_speed:g} m/s: branches: {len(self.branches)}\n"
            f" onsets: {', '.join(onsets) or 'none'}>"
        )

    @property
    def dry_friction(self) -> float:
        """Dry friction of the steering, N m."""
        return self.system.friction or 0.0

    def amplitude(self, cycle: Cycle, output: str = "steer") -> float:
        """Largest value of an ``output`` of the model over the period of a ``cycle``, in its unit (rad, rad/s, m/s)."""
        return self.system.amplitude(cycle, output)

    def _at_point(self, cycle: Cycle, point: tuple[float, float]) -> tuple[Complex, Complex, Complex]:
        """Harmonics of the lateral velocity of a ``point`` along the frame (m/s), of the yaw rate, and i k omega."""
        names = ("rear_lateral_velocity", "yaw_rate", "lean_rate")
        sideways, yaw, lean = (cycle.states @ self.system.row(name) for name in names)
        return sideways + point[0] * yaw - point[1] * lean, yaw, np.asarray(1j * cycle.angular_frequency * cycle.orders)

    def acceleration(self, cycle: Cycle, point: tuple[float, float] | None = None) -> float:
        """Largest lateral acceleration in m/s^2 of a ``point`` (x, z) of the rear frame in m, z down.

        By default the point lies on the steer axis 0.8 m above the road. Gravity has no share in it.
        """
        values = self.model.parameters
        place = point or (values["w"] + values["c"] - HEIGHT * np.tan(values["lam"]), -HEIGHT)
        velocity, yaw, change = self._at_point(cycle, place)
        return peak(change * velocity + cycle.speed * yaw)

    def displacement(self, cycle: Cycle, point: tuple[float, float] = SADDLE) -> float:
        """Largest displacement in m of a ``point`` (x, z) of the rear frame to the side of the straight path.

        By default the point is where a saddle is, 0.21 m before and 0.96 m above the contact of the rear wheel.
        """
        velocity, yaw, change = self._at_point(cycle, point)
        return peak((velocity + cycle.speed * yaw / change) / change)

    def beyond(self, cycle: Cycle) -> tuple[str, ...]:
        """Angles among ``steer`` and ``lean`` beyond the limits of linear geometry, 20 and 10 degrees."""
        return tuple(name for name, limit in LIMITS.items() if self.amplitude(cycle, name) > limit)

    def within_geometry(self, cycle: Cycle) -> bool:
        """True up to 20 degrees of steer and 10 of lean: linear geometry is taken to hold there."""
        return not self.beyond(cycle)

    def resolved(self, cycle: Cycle) -> bool:
        """True if the harmonics suffice: the last ones have no share in any slip."""
        return cycle.tail < TAIL

    def growth(self, cycle: Cycle) -> tuple[float, bool]:
        """Growth in 1/s of what leaves the ``cycle`` fastest (<= 0: nothing does), and True if it leans over steadily.

        The motion over half a period and its mirror image make a map with the multiplier 1 along the cycle. A steady
        lean keeps its side where the cycle changes sides: its multiplier is negative.
        """
        multipliers = self.multipliers(cycle)
        other_multipliers = np.delete(multipliers, np.abs(multipliers - 1).argmin())
        fastest = other_multipliers[np.abs(other_multipliers).argmax()]
        growing = other_multipliers[np.abs(other_multipliers) > 1]
        steady = bool(((growing.real < 0) & (np.abs(growing.imag) < 1e-9)).all())
        return float(np.log(np.abs(fastest)) * 2 / cycle.period), steady

    def multipliers(self, cycle: Cycle, steps: int | None = None) -> Complex:
        """Floquet multipliers (n,) of half a period and the mirror image; their squares are those of the period."""
        return self.system.multipliers(cycle, steps)

    def stability(self, cycle: Cycle) -> str:
        """``yes``, ``falls slowly`` (only a steady lean grows, below 1 1/s) or ``no``."""
        rate, steady = self.growth(cycle)
        if rate <= 1e-6:
            return "yes"
        return "falls slowly" if steady and rate < 1.0 else "no"

    def at(self, speed: float) -> list[tuple[str, Cycle]]:
        """Cycles at a ``speed`` in m/s with the name of their mode."""
        return [(branch.mode, cycle) for branch in self.branches for cycle in branch.at(speed)]

    def row(self, mode: str, cycle: Cycle, point: tuple[float, float] | None = None) -> dict[str, Any]:
        """Row of the table of a ``cycle``: column -> value."""
        acceleration = self.acceleration(cycle, point)
        values = (
            cycle.speed,
            mode,
            self.stability(cycle),
            np.degrees(self.amplitude(cycle)),
            cycle.frequency_hz,
            acceleration,
            np.degrees(self.amplitude(cycle, "lean")),
            self.within_geometry(cycle),
            acceleration / GRAVITY,
            1e3 * self.displacement(cycle),
            " ".join(self.beyond(cycle)),
            self.resolved(cycle),
        )
        return dict(zip(COLUMNS, values, strict=True))

    def frame(self, speeds: ArrayLike, point: tuple[float, float] | None = None) -> Any:
        """Tabulate the cycles at ``speeds`` (m/s), a row each; the acceleration is that of a ``point`` (x, z) in m."""
        import pandas as pd

        rows = [
            self.row(mode, cycle, point)
            for speed in np.atleast_1d(np.asarray(speeds, float)).tolist()
            for mode, cycle in self.at(speed)
        ]
        return pd.DataFrame(rows, columns=COLUMNS)


COLUMNS = (
    "speed_m_s", "mode", "stable", "steer_amplitude_deg", "frequency_Hz", "acceleration_m_s2", "lean_amplitude_deg",
    "within_geometry", "acceleration_g", "saddle_displacement_mm", "beyond_geometry", "resolved",
)  # fmt: skip


def find_limit_cycles(
    model: Model,
    *,
    rear: Tyre | None = None,
    front: Tyre | None = None,
    max_speed: float = 60.0,
    dry_friction: float = 0.0,
) -> LimitCycles:
    """Follow the periodic motions of a model from each critical speed (to ``max_speed``, m/s) of an oscillatory mode.

    Dry friction (N m) holds the steering at rest: no critical speed is left, and branches close. They are
    found by homotopy from those without friction.

    Raises
    ------
    InputError
        The contact law has no such tyre, wheel loads or equations change with the speed in other ways, or the friction
        is negative.
    """
    if not (np.isfinite(dry_friction) and dry_friction >= 0):
        raise InputError(f"dry_friction = {dry_friction:g} N m is not allowed; give a finite torque >= 0")
    system = SlipSystem.of(model, rear=rear, front=front)
    critical = [crossing for crossing in critical_speeds(model, max_speed) if crossing.oscillatory]
    rests = [Rest(crossing.speed, crossing) for crossing in critical if crossing.frequency_hz >= SLOWEST]
    at = [Balance(system, rest.critical.angular_frequency, UNIT_SPEED) for rest in rests]
    branches = branches_from(rests, at, max_speed)
    if dry_friction:
        closed = _with_friction(system, branches, dry_friction, max_speed)
        return LimitCycles(model, system.with_friction(dry_friction), (), closed, rear, front, max_speed)
    onsets = find_onsets(model, critical, rear=rear, front=front)
    return LimitCycles(model, system, onsets, tuple(branches), rear, front, max_speed)


def find_onsets(
    model: Model, critical: Sequence[CriticalSpeed], *, rear: Tyre | None = None, front: Tyre | None = None
) -> tuple[Onset, ...]:
    """Find how the motion begins at each oscillatory one of the ``critical`` speeds, over the band of the curves' E."""
    tyres = [(rear, front), *((with_curvature(rear, by), with_curvature(front, by)) for by in BAND)]
    systems = [SlipSystem.of(model, rear=rear_tyre, front=front_tyre) for rear_tyre, front_tyre in tyres]
    bends = {
        crossing: [bend_of(system, crossing) for system in systems] for crossing in critical if crossing.oscillatory
    }
    return tuple(
        Onset(crossing, coefficients[0], (min(coefficients), max(coefficients)))
        for crossing, coefficients in bends.items()
    )


def branches_from(rests: Sequence[Rest], at: Sequence[Balance], max_speed: float = np.inf) -> list[Branch]:
    """Branches that begin at ``rests``, each once, with the balance ``at`` each."""
    branches: list[Branch] = []
    for rest, balance in zip(rests, at, strict=True):
        if not any(branch.end is rest.critical for branch in branches):
            system, mode = balance.system, rest.critical.mode
            begin = balance.point_at_rest(rest, system.signals @ critical_mode(system, rest.critical)[0])
            branches.append(follow(balance, begin, leaver(system, max_speed), mode, rest.critical, rests))
    return branches


def leaver(system: SlipSystem, max_speed: float = np.inf) -> Callable[[Point], str]:
    """A function of a point: the reason for which a branch ends there (geometry, speed, slow, sticks), or empty."""

    def leaves(point: Point) -> str:
        cycle = point.cycle
        if any(system.amplitude(cycle, name) > BEYOND * limit for name, limit in LIMITS.items()):
            return "geometry"
        if cycle.speed > max_speed or cycle.frequency_hz < SLOWEST:
            return "speed" if cycle.speed > max_speed else "slow"
        sliding = system.friction is None or abs(cycle.slips[0, -1]) > SLIDES * STICKS * RATE_TIME
        return "" if sliding else "sticks"

    return leaves


def with_curvature(tyre: Tyre | None, by: float) -> Tyre:
    """Tyre with its curvature factor E changed ``by`` a number, to at most 1; full curves stay as they are."""
    if isinstance(tyre, CurveTyre):
        return tyre
    formula = tyre or MagicTyre()
    return replace(formula, curvature_factor=min(1.0, formula.curvature_factor + by))


def critical_mode(system: SlipSystem, critical: CriticalSpeed) -> tuple[Complex, Complex]:
    """Right and left eigenvector (n,) of the root on the axis, with left . right = 1 and 1 rad of steer."""
    values, vectors = np.linalg.eig(system.linear(critical.speed))
    place = int(np.abs(values - 1j * critical.angular_frequency).argmin())
    scale = system.row("steer") @ vectors
    return vectors[:, place] / scale[place], np.linalg.inv(vectors)[place] * scale[place]


def bend_of(system: SlipSystem, critical: CriticalSpeed) -> float:
    """First Lyapunov coefficient at a critical speed, 1/(s rad^2) of the steer amplitude.

    The curves are odd, so that no quadratic term bends the centre manifold: the cubic term alone counts (Kuznetsov,
    Elements of Applied Bifurcation Theory, section 5.4).
    """
    right, left = critical_mode(system, critical)
    mode = system.signals @ right
    small = 1e-4 / np.abs(mode).max()
    _, phase, waves = half_period(FEWEST)
    y = small * (waves[:, :1] * mode).real
    straight = y @ system.slopes(np.zeros(len(system.signals))).T
    cubic = 2 / len(phase) * waves[:, 0].conj() @ (system.curves(y) - straight)
    return float((left @ system.entry @ cubic).real / small**3)


def _with_friction(system: SlipSystem, branches: list[Branch], torque: float, max_speed: float) -> tuple[Branch, ...]:
    """Branches with dry friction of a ``torque`` (N m), each from one motion of a branch without."""
    followed: list[Branch] = []
    rubbing = system.with_friction(torque)
    for branch in branches:
        moving = [point.cycle for point in branch.points if point.cycle.slips.any()]
        moving.sort(key=lambda cycle: -system.amplitude(cycle, "steer"))
        for cycle in moving[:: max(1, len(moving) // 4)]:  # the largest motion bears the most friction, as a rule
            start = under_friction(system, cycle, torque, branch)
            if start is None:
                continue
            if any(
                same(start, known_cycle)
                for followed_branch in followed
                for known_cycle in followed_branch.at(cycle.speed)
            ):
                break
            balance = Balance(rubbing, start.angular_frequency, UNIT_SPEED)
            point = balance.start(start, cycle.speed)
            if point is None:
                continue
            leaves = leaver(rubbing, max_speed)
            followed.append(follow_both_ways(balance, point, leaves, branch.mode, branch.begin))
            break
    return tuple(followed)


def under_friction(system: SlipSystem, cycle: Cycle, torque: float, branch: Branch) -> Cycle | None:
    """Follow a ``cycle`` of a ``branch`` at its speed to dry friction of a ``torque``; None if it ends before."""
    rubs = system.with_friction(0.0)
    balance = Balance(
        rubs, cycle.angular_frequency, torque / 2, (0.0, torque), lambda t: (rubs.with_friction(t), cycle.speed)
    )
    begin = balance.start(cycle._replace(slips=cycle.states @ rubs.signals.T), 0.0)
    if begin is None:
        return None
    last = follow(balance, begin, leaver(rubs), branch.mode, branch.begin).points[-1]
    return last.cycle if last.number == torque else None
