"""Bicycle on tyres that saturate as x' = A(v) x + B n(H x), and the harmonic balance of its periodic motions.

The curves n are those of both wheels (and those of the moments of their trails) over the lagged slips, and dry friction
of the steering over its rate. Harmonic balance solves for the signals y = H x alone: with their harmonics Y_k and those
of the curves N_k(Y),

    Y_k = H (i k omega - A)^-1 B N_k,    k = 1, 3, 5, ...,

for a motion after half a period is its own mirror image. Curves are evaluated in time (Cameron and Griffin 1989,
J. Appl. Mech. 56, 149).
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.model import Model
from bicycle.motion.nonlinear import CurveTyre, MagicFormulaModel, MagicTyre, magic_formula_model
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

Complex = NDArray[np.complex128]
Tyre = MagicTyre | CurveTyre

STICKS = 0.05  # rad/s of the bar, at which the smoothed dry friction has 76 % of its torque
SHARP = 512  # phases over half a period at which it is evaluated
RATE_TIME = 0.02  # s: the rate of the bar times this is a signal of the size of a slip


@lru_cache
def half_period(count: int, least: int = 0) -> tuple[Array, Array, Complex]:
    """Odd orders (count,), phases over half a period and exp(i order phase) of a series of ``count`` terms.

    The phases are at ``least`` so many, and twice as many as such a series needs: curves make higher harmonics.
    """
    orders = np.arange(1.0, 2 * count, 2)
    samples = max(4 * count, least)
    phase = np.pi * np.arange(samples) / samples
    return orders, phase, np.asarray(np.exp(1j * np.outer(phase, orders)))


class Cycle(NamedTuple):
    """A periodic motion at one speed."""

    speed: float  # m/s
    angular_frequency: float  # rad/s
    slips: Complex  # (orders, signals), rad
    states: Complex  # (orders, n): x(t) = Re sum over k of states_k exp(i k omega t)

    @property
    def orders(self) -> Array:
        """Odd orders k of the harmonics."""
        return half_period(len(self.slips))[0]

    @property
    def frequency_hz(self) -> float:
        """Frequency, Hz."""
        return self.angular_frequency / (2 * np.pi)

    @property
    def period(self) -> float:
        """Period, s."""
        return 1 / self.frequency_hz

    @property
    def tail(self) -> float:
        """Largest share that the last three harmonics have in a slip of the tyres."""
        sizes = np.abs(self.slips[:, : self.slips.shape[1] // 2 * 2])
        return float((sizes[-3:].max(0) / np.maximum(sizes.max(0), 1e-300)).max())


def peak(harmonics: Complex) -> float:
    """Largest value over a period of an odd signal with these ``harmonics`` (orders,), exact between the samples."""
    orders, phase, _ = half_period(len(harmonics))

    def at(phase: Array, derivative: int = 0) -> Array:
        terms = (1j * orders) ** derivative * harmonics
        return np.asarray((np.exp(1j * np.multiply.outer(phase, orders)) @ terms).real)

    sampled = np.abs(at(phase))
    where = np.array(phase[sampled.argmax()])
    for _ in range(3):  # Newton's method on the slope
        where = where - at(where, 1) / at(where, 2)
    return float(max(abs(at(where)), sampled.max()))


@dataclass(frozen=True)
class SlipSystem:
    """x' = A(v) x + B n(y), y = H x: the model at every speed."""

    at_one_speed: MagicFormulaModel  # gives tyres and matrices that do not change with the speed
    dynamics: SpeedPolynomial  # A(v) (n, n), without lateral forces
    entry: Array  # B (n, curves)
    signals: Array  # H (signals, n): slips and, where apart, slips that stand for camber
    friction: float | None = None  # N m at the bar; with it the last curve and signal are those of the steering

    @classmethod
    def of(cls, model: Model, *, rear: Tyre | None, front: Tyre | None) -> "SlipSystem":
        """Fit A as a parabola in the speed through three models, and check it at a fourth."""
        for tyre in (rear, front):
            if tyre is not None and tyre.offset:
                raise InputError(f"offset = {tyre.offset:g}: periodic motions are of tyres without ply steer; give 0")
        v = np.array([4.0, 8.0, 16.0, 12.0])
        models = [magic_formula_model(model, speed=speed, rear=rear, front=front) for speed in v.tolist()]
        matrices = np.stack([linear.state_matrix for linear in models])
        n = matrices.shape[-1]
        parts = np.linalg.solve(np.vander(v[:3], 3, increasing=True), matrices[:3].reshape(3, -1)).reshape(3, n, n)
        dynamics = SpeedPolynomial(dict(enumerate(parts)))
        agrees = [np.allclose(dynamics(v[3]), matrices[3], rtol=1e-9, atol=1e-9 * np.abs(matrices[3]).max())]
        for name in ("loads", "force_matrix", "trail_matrix", "slip_matrix", "camber_matrix"):
            first = getattr(models[0], name)
            agrees += [np.allclose(getattr(linear, name), first, rtol=1e-9, atol=1e-12) for linear in models]
        if not all(agrees):
            raise InputError(
                "periodic motions are of models whose wheel loads and slips do not change with the speed and whose "
                "equations do not switch; leave out drag, side_slip and controllers that switch"
            )
        return cls._from_matrices(models[0], dynamics)

    @classmethod
    def at(cls, model: Model, speed: float, *, rear: Tyre | None, front: Tyre | None) -> "SlipSystem":
        """Take the model at one ``speed`` (m/s) alone."""
        at_speed = magic_formula_model(model, speed=speed, rear=rear, front=front)
        return cls._from_matrices(at_speed, SpeedPolynomial({0: at_speed.state_matrix}))

    @classmethod
    def _from_matrices(cls, at_speed: MagicFormulaModel, dynamics: SpeedPolynomial) -> "SlipSystem":
        entry = (
            np.hstack([at_speed.force_matrix, at_speed.trail_matrix])
            if at_speed.trail_matrix.any()
            else at_speed.force_matrix
        )
        signals = (
            np.vstack([at_speed.slip_matrix, at_speed.camber_matrix])
            if at_speed.camber_matrix.any()
            else at_speed.slip_matrix
        )
        return cls(at_speed, dynamics, entry, signals)

    def with_friction(self, torque: float) -> "SlipSystem":
        """Return the system with dry friction of the steering, -``torque`` (N m) tanh(rate / 0.05 rad/s)."""
        if self.friction is not None:
            return replace(self, friction=torque)
        at_speed = self.at_one_speed
        if "steer_torque" not in at_speed.inputs:
            raise InputError("dry_friction: this model has no steer_torque")
        column = at_speed.input_matrix[:, [at_speed.inputs.index("steer_torque")]]
        entry = np.hstack([self.entry, column])
        signals = np.vstack([self.signals, RATE_TIME * self.row("steer_rate")])
        return replace(self, entry=entry, signals=signals, friction=torque)

    def curves(self, y: Array) -> Array:
        """Lateral forces, those at the trail (N), and dry friction (N m), (..., curves) at signals (..., signals)."""
        columns = [
            getattr(self.at_one_speed.tyres[k], of)(*self._slip_and_camber(y, k))
            for of in self._kinds
            for k in range(2)
        ]
        if self.friction is not None:
            columns.append(-self.friction * np.tanh(y[..., -1] / (RATE_TIME * STICKS)))
        return np.stack(columns, -1)

    def slopes(self, y: Array) -> Array:
        """Slopes (..., curves, signals) of the curves, N/rad."""
        slopes = np.zeros((*y.shape[:-1], self.entry.shape[1], y.shape[-1]))
        for row, of in enumerate(self._kinds):
            for k, tyre in enumerate(self.at_one_speed.tyres):
                slip_and_camber = self._slip_and_camber(y, k)
                for column in range(k, self._tyre_signals, 2):
                    slopes[..., 2 * row + k, column] = tyre.slope(of, *slip_and_camber, by_camber=column >= 2)
        if self.friction is not None:
            unit = RATE_TIME * STICKS
            slopes[..., -1, -1] = -self.friction / unit / np.cosh(np.clip(y[..., -1] / unit, -300, 300)) ** 2
        return slopes

    @property
    def _phases(self) -> int:
        return 0 if self.friction is None else SHARP

    @property
    def _tyre_signals(self) -> int:
        return len(self.signals) - (self.friction is not None)

    @property
    def _kinds(self) -> tuple[str, ...]:
        return ("force", "by_trail")[: self.entry.shape[1] // 2]

    def _slip_and_camber(self, y: Array, wheel: int) -> tuple[Array, Array]:
        return y[..., wheel], (y[..., 2 + wheel] if self._tyre_signals > 2 else np.zeros(()))

    def row(self, output: str) -> Array:
        """Row (n,) of the output matrix: its product with the states is the ``output`` of the model."""
        at_speed = self.at_one_speed
        return np.asarray(at_speed.output_matrix[at_speed.outputs.index(output)])

    def amplitude(self, cycle: Cycle, output: str) -> float:
        """Largest value of an ``output`` over the period of a ``cycle``, in its unit."""
        return peak(cycle.states @ self.row(output))

    def linear(self, speed: float, *, sticking: bool = False) -> Array:
        """State matrix (n, n) of small motions at a ``speed`` in m/s, without dry friction unless ``sticking``."""
        slope = self.slopes(np.zeros(len(self.signals)))
        if self.friction is not None and not sticking:
            slope[-1] = 0.0
        return np.asarray(self.dynamics(speed) + self.entry @ slope @ self.signals)

    def response(self, slips: Complex, omega: float, speed: float) -> tuple[Complex, Complex, Array, Complex]:
        """Return the residual (orders, signals), states (orders, n), signals in time and (i k omega - A)^-1."""
        orders, phase, waves = half_period(len(slips), self._phases)
        y = (waves @ slips).real
        forces = 2 / len(phase) * waves.conj().T @ self.curves(y)
        n = self.dynamics.shape[-1]
        pencil = 1j * omega * orders[:, None, None] * np.eye(n) - self.dynamics(speed)
        inverse = np.asarray(np.linalg.inv(pencil), complex)
        states = (inverse @ (self.entry @ forces[..., None]))[..., 0]
        return slips - states @ self.signals.T, states, y, inverse

    def balance(self, slips: Complex, omega: float, speed: float) -> tuple[Complex, Array, Complex]:
        """Return the residual (orders, signals), its jacobian and the states (orders, n).

        The jacobian is by the slips, in the order (order, signal, real and imaginary part), by omega and by the speed.
        """
        residual, states, y, inverse = self.response(slips, omega, speed)
        gain = self.signals @ inverse @ self.entry
        # a slope is even: products with its harmonics 2 l make the jacobian, without a product in time
        even = np.fft.fft(self.slopes(y), axis=0) / len(y)
        count = len(slips)
        k = np.arange(count)
        less, more = even[k[:, None] - k], even[(k[:, None] + k + 1) % len(y)]
        change = np.stack([less + more, 1j * (less - more)], -1).transpose(0, 2, 1, 3, 4)
        by_slips = -gain @ change.reshape(count, self.entry.shape[1], -1)
        identity = np.eye(slips.size).reshape(*slips.shape, -1, 1) * np.array([1, 1j])
        by_slips += identity.reshape(*slips.shape, -1)
        changes = np.stack([-1j * (2 * k[:, None] + 1) * states, states @ self.dynamics.derivative(speed).T], -1)
        by_rest = -self.signals @ (inverse @ changes)
        jacobian = np.concatenate([by_slips, by_rest], -1).reshape(slips.size, -1)
        return residual, np.vstack([jacobian.real, jacobian.imag]), states

    def multipliers(self, cycle: Cycle, steps: int | None = None) -> Complex:
        """Floquet multipliers (n,) of half a period and the mirror image; their squares are those of the period."""
        steps = steps or len(half_period(len(cycle.slips), self._phases)[1])
        nodes = 0.5 + np.sqrt(3) / 6 * np.array([-1.0, 1.0])  # two-point Gauss collocation, of fourth order
        weights = np.array([[0.25, nodes[0] - 0.25], [nodes[1] - 0.25, 0.25]])
        at = np.pi * (np.arange(steps)[:, None] + nodes) / steps
        y = (np.exp(1j * at[..., None] * cycle.orders) @ cycle.slips).real
        rates = self.dynamics(cycle.speed) + self.entry @ self.slopes(y) @ self.signals
        n, h = rates.shape[-1], cycle.period / 2 / steps
        stages = np.eye(2 * n) - h * np.einsum("ij,siab->siajb", weights, rates).reshape(steps, 2 * n, 2 * n)
        slopes = np.linalg.solve(stages, rates.reshape(steps, 2 * n, n))
        whole = np.eye(n)
        for step in np.eye(n) + h / 2 * (slopes[:, :n] + slopes[:, n:]):
            whole = step @ whole
        return np.linalg.eigvals(-whole).astype(complex)
