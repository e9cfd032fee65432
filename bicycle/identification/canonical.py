"""Identify canonical coefficients as Moore (2012) did: least squares of the roll and of the steer equation."""

from dataclasses import dataclass

import numpy as np

from bicycle.model.model import Model
from tyre.ground.arrays import Array, Complex


@dataclass(frozen=True)
class Canonical:
    """The matrices of the canonical equations (2, 2) and H (2,), SI, order lean, steer."""

    mass: Array  # M (2, 2), kg m^2
    c1: Array  # C1 (2, 2), kg m: N m per (m/s) (rad/s)
    k0: Array  # K0 (2, 2), kg m: stiffness over gravity
    k2: Array  # K2 (2, 2), kg: N m/rad per (m/s)^2
    force: Array  # H (2,), m: lean and steer torque per lateral force
    gravity: float  # m/s^2

    @classmethod
    def of_whipple(cls, model: Model) -> "Canonical":
        """Take the matrices of the bicycle of ``model``, without its effects."""
        linear = Model(model.bicycle).linear_model()
        matrices, g = linear.ranges[0].matrices, model.bicycle["g"]
        rate = [linear.states.index(name) for name in ("lean_rate", "steer_rate")]
        angle = [linear.states.index(name) for name in ("lean", "steer")]
        constant, first, second = (-matrices.dynamics.coefficient(power)[rate] for power in (0, 1, 2))
        force = matrices.input_matrix[0][rate, linear.inputs.index("lateral_force")]
        return cls(
            matrices.mass[np.ix_(rate, rate)], first[:, rate], constant[:, angle] / g, second[:, angle], force, g
        )

    @property
    def free(self) -> Array:
        """The coefficients that an identification leaves free (9,): of the roll row, the steer row and H of steer."""
        m, c1, k0, k2 = self.mass, self.c1, self.k0, self.k2
        return np.array([m[0, 1], c1[0, 1], k0[0, 1], m[1, 1], c1[1, 0], c1[1, 1], k0[1, 1], k2[1, 1], self.force[1]])


@dataclass(frozen=True)
class Motion:
    """Complex amplitudes of recorded signals (K, speeds, frequencies, motions); ``s`` = i omega and ``v`` broadcast."""

    lean: Complex  # rad
    steer: Complex  # rad
    torque: Complex  # steer torque, N m
    force: Complex  # lateral force, N
    s: Complex  # 1/s
    v: Array  # m/s


def identify(motion: Motion, fixed: Canonical) -> Array:
    """The nine coefficients (K, 9) of :attr:`Canonical.free`, by least squares of roll, then steer equation."""
    phi, delta, s, v, g = motion.lean, motion.steer, motion.s, motion.v, fixed.gravity
    m, c1, k0, k2 = fixed.mass, fixed.c1, fixed.k0, fixed.k2
    explained = (m[0, 0] * s**2 + v * c1[0, 0] * s + g * k0[0, 0] + v**2 * k2[0, 0]) * phi + v**2 * k2[0, 1] * delta
    roll = _least_squares([s**2 * delta, v * s * delta, g * delta], fixed.force[0] * motion.force - explained)
    m_dp, k0_dp = (roll[:, k, None, None, None] for k in (0, 2))
    explained = (m_dp * s**2 + g * k0_dp + v**2 * k2[1, 0]) * phi
    columns = [s**2 * delta, v * s * phi, v * s * delta, g * delta, v**2 * delta, -motion.force]
    return np.hstack([roll, _least_squares(columns, motion.torque - explained)])


def _least_squares(columns: list[Complex], right: Complex) -> Array:
    """Real coefficients (K, columns) of complex rows."""

    def rows(value: Complex) -> Array:
        flat = np.broadcast_to(value, right.shape).reshape(len(right), -1)
        return np.concatenate([flat.real, flat.imag], axis=1)

    q, r = np.linalg.qr(np.stack([rows(column) for column in columns], -1))
    return np.asarray(np.linalg.solve(r, np.swapaxes(q, 1, 2) @ rows(right)[..., None])[..., 0])
