"""Periodic motions of a bicycle on tyres that saturate: how large a wobble or weave gets, and what becomes of it.

The model is x' = A(v) x + B n(H x): one curve a wheel (and one for the moment of a trail) over the lagged slips H x.
Harmonic balance solves for the slips alone: with their harmonics Y_k and those of the curves N_k(Y),

    Y_k = H (i k omega - A)^-1 B N_k,    k = 1, 3, 5, ...,

for a motion after half a period is its own mirror image. Curves are evaluated in time (Cameron and Griffin 1989,
J. Appl. Mech. 56, 149). The solutions are followed by pseudo-arclength (Keller 1977) from the critical speeds.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from bicycle.critical import CriticalSpeed, critical_speeds
from bicycle.model import Model
from bicycle.nonlinear import CurveTyre, MagicFormulaModel, MagicTyre, magic_formula_model
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.arrays import Array
from tyre.errors import InputError

__all__ = ["Branch", "Cycle", "LimitCycles", "Onset", "find_limit_cycles"]

Complex = NDArray[np.complex128]
Tyre = MagicTyre | CurveTyre

ORDERS = np.arange(1, 32, 2)
PHASE = np.pi * np.arange(64) / 64  # over half a period; the 33rd harmonic is the first that is left out
WAVES = np.exp(1j * np.outer(PHASE, ORDERS))
LIMITS = {"steer": np.radians(20.0), "lean": np.radians(10.0)}  # up to which linear geometry is taken to hold
SLOWEST = 1.0  # Hz; what the left out geometry decides is slower: weave at 0.3 to 0.6 Hz
HEIGHT = 0.8  # m above the road on the steer axis, near a head tube
BAND = (-1.0, 1.0)  # added to E, of which a tyre without whole curves says nothing
BEYOND = 1.5  # times the limits: where a branch is given up
STRAIGHT = 0.95  # cosine between the tangents at both ends of a step
SHORTEST, LONGEST, MOST_POINTS = 1e-4, 1.5, 600  # steps of a branch
TURNING = 1e-5  # share of the speed in the tangent: the speed turns there
REST = 1e-9  # rad of slip: no motion
UNIT_SLIP, UNIT_SPEED = 0.02, 2.0  # rad and m/s that count as one in the length of a branch


class Cycle(NamedTuple):
    """A periodic motion at one speed."""

    speed: float  # m/s
    angular_frequency: float  # rad/s
    slips: Complex  # (orders, signals), rad
    states: Complex  # (orders, n): x(t) = Re sum over k of states_k exp(i k omega t)

    @property
    def frequency_hz(self) -> float:
        """Frequency, Hz."""
        return self.angular_frequency / (2 * np.pi)

    @property
    def period(self) -> float:
        """Period, s."""
        return 1 / self.frequency_hz


def peak(harmonics: Complex) -> float:
    """Largest value over a period of an odd signal with these ``harmonics`` (orders,), exact between the samples."""

    def at(phase: Array, derivative: int = 0) -> Array:
        terms = (1j * ORDERS) ** derivative * harmonics
        return np.asarray((np.exp(1j * np.multiply.outer(phase, ORDERS)) @ terms).real)

    where = np.array(PHASE[np.abs(at(PHASE)).argmax()])
    for _ in range(3):  # Newton's method on the slope
        where = where - at(where, 1) / at(where, 2)
    return float(max(abs(at(where)), np.abs(at(PHASE)).max()))


@dataclass(frozen=True)
class SlipSystem:
    """x' = A(v) x + B n(y), y = H x, where n are the curves of both wheels: the model at every speed."""

    at_one_speed: MagicFormulaModel
    dynamics: SpeedPolynomial
    entry: Array  # B (n, curves)
    signals: Array  # H (signals, n): slips and, where apart, slips that stand for camber

    @classmethod
    def of(cls, model: Model, *, rear: Tyre | None, front: Tyre | None) -> "SlipSystem":
        """Fit A as a parabola in the speed through three models, and check it at a fourth."""
        for tyre in (rear, front):
            if tyre is not None and tyre.offset:
                raise InputError(f"offset = {tyre.offset:g}: periodic motions are of tyres without ply steer; give 0")
        v = np.array([4.0, 8.0, 16.0, 12.0])
        found = [magic_formula_model(model, speed=one, rear=rear, front=front) for one in v.tolist()]
        matrices = np.stack([one.state_matrix for one in found])
        n = matrices.shape[-1]
        parts = np.linalg.solve(np.vander(v[:3], 3, increasing=True), matrices[:3].reshape(3, -1)).reshape(3, n, n)
        dynamics = SpeedPolynomial(dict(enumerate(parts)))
        same = [np.allclose(dynamics(v[3]), matrices[3], rtol=1e-9, atol=1e-9 * np.abs(matrices[3]).max())]
        for name in ("loads", "force_matrix", "trail_matrix", "slip_matrix", "camber_matrix"):
            first = getattr(found[0], name)
            same += [np.allclose(getattr(one, name), first, rtol=1e-9, atol=1e-12) for one in found]
        if not all(same):
            raise InputError(
                "periodic motions are of models whose wheel loads and slips do not change with the speed and whose "
                "equations do not switch; leave out drag, side_slip and controllers that switch"
            )
        one = found[0]
        entry = np.hstack([one.force_matrix, one.trail_matrix]) if one.trail_matrix.any() else one.force_matrix
        signals = np.vstack([one.slip_matrix, one.camber_matrix]) if one.camber_matrix.any() else one.slip_matrix
        return cls(one, dynamics, entry, signals)

    def curves(self, y: Array) -> Array:
        """Side forces, and those at the trail, (..., curves) in N at signals (..., signals)."""
        return np.concatenate(
            [
                np.stack([getattr(tyre, what)(*self._seen(y, k)) for k, tyre in enumerate(self.at_one_speed.tyres)], -1)
                for what in self._kinds
            ],
            -1,
        )

    def slopes(self, y: Array) -> Array:
        """Slopes (..., curves, signals) of the curves, N/rad."""
        found = np.zeros((*y.shape[:-1], self.entry.shape[1], y.shape[-1]))
        for row, what in enumerate(self._kinds):
            for k, tyre in enumerate(self.at_one_speed.tyres):
                seen = self._seen(y, k)
                for column in range(k, y.shape[-1], 2):
                    found[..., 2 * row + k, column] = tyre.slope(what, *seen, by_camber=column >= 2)
        return found

    @property
    def _kinds(self) -> tuple[str, ...]:
        return ("force", "by_trail")[: self.entry.shape[1] // 2]

    def _seen(self, y: Array, wheel: int) -> tuple[Array, Array]:
        slip = y[..., wheel]
        return slip, (y[..., 2 + wheel] if y.shape[-1] > 2 else np.zeros_like(slip))

    def row(self, output: str) -> Array:
        """Row (n,) that makes an ``output`` of the model of the states."""
        one = self.at_one_speed
        return np.asarray(one.output_matrix[one.outputs.index(output)])

    def amplitude(self, cycle: "Cycle", output: str) -> float:
        """Largest value of an ``output`` over the period of a ``cycle``, in its unit."""
        return peak(cycle.states @ self.row(output))

    def linear(self, speed: float) -> Array:
        """State matrix (n, n) of small motions at a ``speed`` in m/s."""
        slope = self.slopes(np.zeros(len(self.signals)))
        return np.asarray(self.dynamics(speed) + self.entry @ slope @ self.signals)

    def balance(self, slips: Complex, omega: float, speed: float) -> tuple[Complex, Array, Complex]:
        """Residual (orders, signals), its jacobian to (real slips, imaginary slips, omega, speed), and the states."""
        n, orders, count = self.dynamics.shape[-1], len(ORDERS), len(self.signals)
        y = (WAVES @ slips).real
        forces = 2 / len(PHASE) * (WAVES.conj().T @ self.curves(y))
        a = self.dynamics(speed)
        inverse = np.linalg.inv(1j * omega * ORDERS[:, None, None] * np.eye(n) - a)
        response = inverse @ self.entry
        states = (response @ forces[..., None])[..., 0]
        gain = self.signals @ response
        residual = slips - (gain @ forces[..., None])[..., 0]
        spread = np.concatenate([WAVES.real, -WAVES.imag], 1)  # of the unknowns, over time
        slopes = self.slopes(y)
        bent = (slopes[..., None] * spread[:, None, None, :]).reshape(len(PHASE), -1)
        change = 2 / len(PHASE) * (WAVES.conj().T @ bent).reshape(orders, slopes.shape[1], count * 2 * orders)
        own = np.eye(orders * count).reshape(orders, count, orders, count)
        unknown = np.stack([own, 1j * own], 2).transpose(0, 1, 4, 2, 3).reshape(orders, count, -1)
        by_slips = unknown - gain @ change
        # the unknowns stand as (signal, part, order)
        moved = np.stack([-1j * ORDERS[:, None] * states, states @ self.dynamics.derivative(speed).T], -1)
        by_rest = -self.signals @ (inverse @ moved)
        jacobian = np.concatenate([by_slips, by_rest], -1).reshape(orders * count, -1)
        return residual, np.vstack([jacobian.real, jacobian.imag]), states


class Point(NamedTuple):
    """A solution on a branch: the unknowns (real and imaginary slips, omega, speed), the tangent, the cycle."""

    unknowns: Array
    tangent: Array
    cycle: Cycle


@dataclass(frozen=True)
class Balance:
    """Newton's method on the balance with a phase and one more condition, in unknowns of comparable size."""

    system: SlipSystem
    size: Array  # what counts as one, of each unknown

    @classmethod
    def near(cls, system: SlipSystem, omega: float) -> "Balance":
        slips = np.full(2 * len(ORDERS) * len(system.signals), UNIT_SLIP)
        return cls(system, np.array([*slips, omega, UNIT_SPEED]))

    def unpack(self, unknowns: Array) -> tuple[Complex, float, float]:
        """Slips (orders, signals), omega and speed of ``unknowns``."""
        full = unknowns * self.size
        parts = full[:-2].reshape(len(self.system.signals), 2, len(ORDERS))
        return (parts[:, 0] + 1j * parts[:, 1]).T, float(full[-2]), float(full[-1])

    def pack(self, slips: Complex, omega: float, speed: float) -> Array:
        """Unknowns of ``slips`` (orders, signals), ``omega`` and ``speed``."""
        parts = np.stack([slips.real.T, slips.imag.T], 1).ravel()
        return np.array([*parts, omega, speed]) / self.size

    def correct(self, guess: Array, along: Array, phase: Array) -> Point | None:
        """Solve with along . (u - guess) = 0 and phase . u = 0; None where Newton's method does not get there."""
        u, zero = guess, np.zeros(len(guess))
        for _ in range(9):
            slips, omega, speed = self.unpack(u)
            if not (omega > 0 and speed > 0):
                return None
            residual, jacobian, states = self.system.balance(slips, omega, speed)
            whole = np.vstack([jacobian * self.size, phase, along])
            right = np.array([*residual.real.ravel(), *residual.imag.ravel(), phase @ u, along @ (u - guess)])
            try:
                step, tangent = np.linalg.solve(whole, np.column_stack([right, [*zero[:-1], 1.0]])).T
            except np.linalg.LinAlgError:
                return None
            u = u - step
            if np.abs(step).max() < 1e-9:  # the next step would be far below rounding
                slips, omega, speed = self.unpack(u)
                return Point(u, tangent / np.linalg.norm(tangent), Cycle(speed, omega, slips, states))
        return None

    def phase(self, slips: Complex) -> Array:
        """Row that holds the first harmonic in phase with that of ``slips``."""
        turned = np.zeros_like(slips)
        turned[0] = 1j * slips[0]
        row = self.pack(turned, 0.0, 0.0)
        return np.asarray(row / np.linalg.norm(row))


@dataclass(frozen=True)
class Onset:
    """Behaviour beside a critical speed: a motion that grows gently, one that jumps, or not determined."""

    critical: CriticalSpeed
    bend: float  # a' = growth a + bend a^3 of the steer amplitude a, 1/(s rad^2): the first Lyapunov coefficient
    band: tuple[float, float]  # its least and largest value over the band of E

    @property
    def kind(self) -> str:
        """``grows gently``, ``jumps``, or ``not determined``: slow, or its sign hangs on the curves' E."""
        if self.critical.frequency_hz < SLOWEST or self.band[0] <= 0 <= self.band[1]:
            return "not determined"
        return "grows gently" if self.bend < 0 else "jumps"


@dataclass(frozen=True)
class Branch:
    """Periodic motions that come from one critical speed, in the order in which they were followed."""

    mode: str
    begin: CriticalSpeed
    end: CriticalSpeed | None
    reason: str  # why it ends: critical speed, geometry, speed, slow, lost
    points: tuple[Point, ...]
    folds: tuple[Cycle, ...]
    balance: Balance = field(repr=False)

    def at(self, speed: float) -> list[Cycle]:
        """Cycles at a ``speed`` in m/s, as many as the branch has there."""
        fixed = np.zeros(len(self.balance.size))
        fixed[-1] = 1.0
        found = []
        for one, other in pairwise(self.points):
            ends = sorted((one.cycle.speed, other.cycle.speed))
            if ends[0] <= speed < ends[1]:
                share = (speed - one.cycle.speed) / (other.cycle.speed - one.cycle.speed)
                folds = [abs(end.tangent[-1]) < TURNING and bool(end.cycle.slips.any()) for end in (one, other)]
                if folds[0]:  # from a fold on it goes like a square root
                    share = np.sqrt(share)
                elif folds[1]:
                    share = 1 - np.sqrt(1 - share)
                guess = one.unknowns + share * (other.unknowns - one.unknowns)
                if not any(folds):  # beside rest the square of the amplitude goes with the speed
                    squares = [end.unknowns[:-2] @ end.unknowns[:-2] for end in (one, other)]
                    size = np.sqrt((1 - share) * squares[0] + share * squares[1])
                    guess[:-2] *= size / max(np.linalg.norm(guess[:-2]), REST)
                guess[-1] = speed / self.balance.size[-1]
                phase = self.balance.phase(self.balance.unpack(guess)[0])
                point = self.balance.correct(guess, fixed, phase)
                if point is not None and np.abs(point.cycle.slips[0]).max() > REST:
                    found.append(point.cycle)
        return found


@dataclass(frozen=True)
class LimitCycles:
    """Periodic motions of a model over the speed.

    Attributes
    ----------
    model : Model
    system : SlipSystem
    onsets : tuple of Onset
        The oscillatory critical speeds and how the motion begins there.
    branches : tuple of Branch
    """

    model: Model
    system: SlipSystem = field(repr=False)
    onsets: tuple[Onset, ...]
    branches: tuple[Branch, ...]

    def amplitude(self, cycle: Cycle, output: str = "steer") -> float:
        """Largest value of an ``output`` of the model over the period of a ``cycle``, in its unit (rad, rad/s, m/s)."""
        return self.system.amplitude(cycle, output)

    def acceleration(self, cycle: Cycle, point: tuple[float, float] | None = None) -> float:
        """Largest lateral acceleration in m/s^2 of a ``point`` (x, z) of the rear frame in m, z down.

        By default the point lies on the steer axis 0.8 m above the road. Gravity has no share in it.
        """
        values = self.model.parameters
        x, z = point or (values["w"] + values["c"] - HEIGHT * np.tan(values["lam"]), -HEIGHT)
        sideways, yaw, lean = (
            cycle.states @ self.system.row(name) for name in ("rear_lateral_velocity", "yaw_rate", "lean_rate")
        )
        change = 1j * cycle.angular_frequency * ORDERS
        return peak(change * (sideways + x * yaw - z * lean) + cycle.speed * yaw)

    def within_geometry(self, cycle: Cycle) -> bool:
        """True up to 20 degrees at the bar and 10 degrees of lean: linear geometry is taken to hold there."""
        return all(self.amplitude(cycle, name) <= limit for name, limit in LIMITS.items())

    def growth(self, cycle: Cycle) -> tuple[float, bool]:
        """Growth in 1/s of what leaves the ``cycle`` fastest (<= 0: nothing does), and True if it leans over steadily.

        The motion over half a period and its mirror image make a map with the multiplier 1 along the cycle. A steady
        lean keeps its side where the cycle changes sides: its multiplier is negative.
        """
        multipliers = self.multipliers(cycle)
        others = np.delete(multipliers, np.abs(multipliers - 1).argmin())
        fastest = others[np.abs(others).argmax()]
        out = others[np.abs(others) > 1]
        steady = bool(((out.real < 0) & (np.abs(out.imag) < 1e-9)).all())
        return float(np.log(np.abs(fastest)) * 2 / cycle.period), steady

    def multipliers(self, cycle: Cycle, steps: int = 64) -> Complex:
        """Floquet multipliers (n,) of half a period and the mirror image; their squares are those of the period."""
        nodes = 0.5 + np.sqrt(3) / 6 * np.array([-1.0, 1.0])  # two-point Gauss collocation, of fourth order
        weights = np.array([[0.25, nodes[0] - 0.25], [nodes[1] - 0.25, 0.25]])
        at = np.pi * (np.arange(steps)[:, None] + nodes) / steps
        y = (np.exp(1j * at[..., None] * ORDERS) @ cycle.slips).real
        rates = self.system.dynamics(cycle.speed) + self.system.entry @ self.system.slopes(y) @ self.system.signals
        n, h = rates.shape[-1], cycle.period / 2 / steps
        stages = np.eye(2 * n) - h * np.einsum("ij,siab->siajb", weights, rates).reshape(steps, 2 * n, 2 * n)
        slopes = np.linalg.solve(stages, rates.reshape(steps, 2 * n, n))
        whole = np.eye(n)
        for step in np.eye(n) + h / 2 * (slopes[:, :n] + slopes[:, n:]):
            whole = step @ whole
        return np.linalg.eigvals(-whole).astype(complex)

    def stability(self, cycle: Cycle) -> str:
        """``yes``, ``falls slowly`` (only a steady lean grows, below 1 1/s) or ``no``."""
        rate, steady = self.growth(cycle)
        if rate <= 1e-6:
            return "yes"
        return "falls slowly" if steady and rate < 1.0 else "no"

    def at(self, speed: float) -> list[tuple[str, Cycle]]:
        """Cycles at a ``speed`` in m/s with the name of their mode."""
        return [(branch.mode, cycle) for branch in self.branches for cycle in branch.at(speed)]

    def frame(self, speeds: ArrayLike, point: tuple[float, float] | None = None) -> Any:
        """Tabulate the cycles at ``speeds`` (m/s), a row each; the acceleration is that of a ``point`` (x, z) in m."""
        import pandas as pd

        rows = [
            (
                speed, mode, self.stability(cycle), np.degrees(self.amplitude(cycle)), cycle.frequency_hz,
                self.acceleration(cycle, point), np.degrees(self.amplitude(cycle, "lean")), self.within_geometry(cycle),
            )
            for speed in np.atleast_1d(np.asarray(speeds, float)).tolist()
            for mode, cycle in self.at(speed)
        ]  # fmt: skip
        return pd.DataFrame(rows, columns=COLUMNS)


COLUMNS = (
    "speed_m_s", "mode", "stable", "steer_amplitude_deg", "frequency_Hz", "acceleration_m_s2", "lean_amplitude_deg",
    "within_geometry",
)  # fmt: skip


def find_limit_cycles(
    model: Model, *, rear: Tyre | None = None, front: Tyre | None = None, max_speed: float = 60.0
) -> LimitCycles:
    """Follow the periodic motions of a model from each critical speed (up to ``max_speed``, m/s) of a mode that swings.

    Raises
    ------
    InputError
        The contact law has no such tyre, or wheel loads or equations change with the speed in other ways.
    """
    system = SlipSystem.of(model, rear=rear, front=front)
    critical = [one for one in critical_speeds(model, max_speed) if one.oscillatory]
    nearby = [SlipSystem.of(model, rear=_bent(rear, by), front=_bent(front, by)) for by in BAND]
    bends = [[bend_of(each, one) for each in (system, *nearby)] for one in critical]
    onsets = [Onset(one, own[0], (min(own), max(own))) for one, own in zip(critical, bends, strict=True)]
    branches: list[Branch] = []
    for one in critical:
        if one.frequency_hz >= SLOWEST and not any(branch.end is one for branch in branches):
            branches.append(_follow(system, one, critical, max_speed))
    return LimitCycles(model, system, tuple(onsets), tuple(branches))


def _bent(tyre: Tyre | None, by: float) -> Tyre:
    if isinstance(tyre, CurveTyre):
        return tyre
    given = tyre or MagicTyre()
    return replace(given, curvature_factor=min(1.0, given.curvature_factor + by))


def critical_mode(system: SlipSystem, critical: CriticalSpeed) -> tuple[Complex, Complex]:
    """Right and left eigenvector of the root on the axis, with left . right = 1 and 1 rad at the bar."""
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
    y = small * (np.exp(1j * PHASE)[:, None] * mode).real
    straight = y @ system.slopes(np.zeros(len(system.signals))).T
    cubic = 2 / len(PHASE) * np.exp(-1j * PHASE) @ (system.curves(y) - straight)
    return float((left @ system.entry @ cubic).real / small**3)


def _follow(system: SlipSystem, begin: CriticalSpeed, critical: Iterable[CriticalSpeed], max_speed: float) -> Branch:
    """Follow a branch by pseudo-arclength until it comes to rest at a critical speed or leaves what the model holds."""
    balance = Balance.near(system, begin.angular_frequency)
    slips = np.zeros((len(ORDERS), len(system.signals)), complex)
    at_rest = Cycle(begin.speed, begin.angular_frequency, slips, np.zeros((len(ORDERS), len(system.entry)), complex))
    first = slips.copy()
    first[0] = system.signals @ critical_mode(system, begin)[0]
    tangent, phase = balance.pack(first, 0.0, 0.0), balance.phase(first)
    points = [
        Point(balance.pack(slips, at_rest.angular_frequency, at_rest.speed), tangent / np.linalg.norm(tangent), at_rest)
    ]
    folds, step, end, reason = [], 0.1, None, "lost"
    while len(points) < MOST_POINTS and step > SHORTEST:
        last = points[-1]

        def ahead(length: float, last: Point = last, phase: Array = phase) -> Point | None:
            return balance.correct(last.unknowns + length * last.tangent, last.tangent, phase)

        def turning(length: float, last: Point = last, ahead: Any = ahead) -> float:
            return float((ahead(length) or last).tangent[-1])

        point = ahead(step)
        if point is None or point.tangent @ last.tangent < STRAIGHT or np.abs(point.cycle.slips).max() < REST:
            step /= 2
            continue
        cycle = point.cycle
        if (cycle.slips[0] * last.cycle.slips[0].conj()).real.sum() < 0:  # through rest, to the mirror image
            end = min(critical, key=lambda one: abs(one.speed - cycle.speed) + abs(one.speed - last.cycle.speed))
            reason = "critical speed"
            still = Cycle(end.speed, end.angular_frequency, slips, at_rest.states)
            points.append(Point(balance.pack(slips, end.angular_frequency, end.speed), 0 * last.tangent, still))
            break
        if point.tangent[-1] * last.tangent[-1] < 0 and len(points) > 1:
            fold = ahead(brentq(turning, 0.0, step, xtol=1e-6))
            if fold is not None:
                points.append(fold)
                folds.append(fold.cycle)
        points.append(point)
        if any(system.amplitude(cycle, name) > BEYOND * limit for name, limit in LIMITS.items()):
            reason = "geometry"
            break
        if cycle.speed > max_speed or cycle.frequency_hz < SLOWEST:
            reason = "speed" if cycle.speed > max_speed else "slow"
            break
        phase, step = balance.phase(cycle.slips), min(1.5 * step, LONGEST)
    return Branch(begin.mode, begin, end, reason, tuple(points), tuple(folds), balance)
