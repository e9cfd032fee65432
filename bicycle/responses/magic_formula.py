"""Time-domain simulation with Magic Formula tyres: the yardstick of the linear model.

Masses, gyroscopic couplings, springs and geometry are those of the linear model
(:mod:`bicycle.responses.magic_formula_model`). The tyre is written down here, not taken from
:class:`bicycle.effects.relaxation_length.RelaxationLength`:

    lambda d(alpha')/dt = -s - v (alpha' - F_camber / C),     F = load [D sin{C atan[...alpha' + ...]} + Sv]

The relaxation acts on the slip (Pacejka, Tire and Vehicle Dynamics, ch. 5), so the force never exceeds the friction;
camber thrust enters as the slip that gives the same force. In all, x' = A x + P F(G x) + B u with only F nonlinear.
Lean and steer stay small in the geometry; a lagged aligning_moment stays linear; loads are those of steady riding.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from bicycle.effect import WHEELS
from bicycle.responses.inputs import InputHistory
from bicycle.responses.linear import PATH, Response, check_names, check_time, initial_state, input_grid
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.magic_formula.side_force import normalised_side_force, normalised_side_force_slope

NEWTON_STEPS = 50


@dataclass(frozen=True)
class MagicTyre:
    """Magic Formula of one tyre; its cornering stiffness comes from the model, B = C_Fy / (C D load).

    Attributes
    ----------
    friction : float
        Peak of the side force over the load, D.
    shape_factor, curvature_factor : float
        C and E, dimensionless.
    offset : float
        Sv: side force over load at zero slip (ply steer).
    """

    friction: float = 0.8
    shape_factor: float = 1.3
    curvature_factor: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        for name, low, high in (
            ("friction", 0.0, 3.0), ("shape_factor", 0.0, 2.0), ("curvature_factor", -100.0, 1.0),
            ("offset", -1.0, 1.0),
        ):  # fmt: skip
            value = getattr(self, name)
            if not low <= value <= high or value == low == 0.0:
                excluded = " (0 excluded)" if low == 0.0 else ""
                raise InputError(f"{name} = {value:g} is outside {low:g} .. {high:g}{excluded}")


@dataclass(frozen=True)
class MagicFormulaModel:
    """x' = A x + P F(G x) + B u at one speed; outputs C x and the side forces.

    ``states`` end with ``rear_transient_slip`` and ``front_transient_slip`` (rad) where the tyre has a relaxation
    length. ``cornering_stiffness`` (2,) in N/rad, ``loads`` (2,) in N, rear first.
    """

    speed: float
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_matrix: Array  # (n, n), without side forces
    force_matrix: Array  # (n, 2)
    slip_matrix: Array  # (2, n): effective slip angle, rad
    slip_input: Array  # (2, inputs)
    input_matrix: Array  # (n, inputs)
    output_matrix: Array  # (outputs without side forces, n)
    cornering_stiffness: Array
    loads: Array
    tyres: tuple[MagicTyre, MagicTyre]
    units: Mapping[str, str]  # of states, inputs and outputs

    def side_forces(self, slip: Array) -> Array:
        """Side force (..., 2) in N at effective slip angles (..., 2) in rad.

        Parameters
        ----------
        slip : ndarray, shape (..., 2)
            Effective slip angles, rad, rear first.
        """
        curve = normalised_side_force(slip, **self._coefficients, vertical_shift=self._of("offset"))
        return np.asarray(self.loads * curve)

    def local_stiffness(self, slip: Array) -> Array:
        """Slope of the side force (..., 2), N/rad.

        Parameters
        ----------
        slip : ndarray, shape (..., 2)
            Effective slip angles, rad, rear first.
        """
        return np.asarray(self.loads * normalised_side_force_slope(slip, **self._coefficients))

    def rate(self, state: Array, inputs: Array) -> Array:
        """dx/dt (n,).

        Parameters
        ----------
        state, inputs : ndarrays, shapes (n,) and (inputs,), SI
        """
        force = self.side_forces(self.slip_matrix @ state + self.slip_input @ inputs)
        return np.asarray(self.state_matrix @ state + self.force_matrix @ force + self.input_matrix @ inputs)

    def jacobian(self, state: Array, inputs: Array) -> Array:
        """d(dx/dt)/dx (n, n).

        Parameters
        ----------
        state, inputs : ndarrays, shapes (n,) and (inputs,), SI
        """
        slope = self.local_stiffness(self.slip_matrix @ state + self.slip_input @ inputs)
        return np.asarray(self.state_matrix + (self.force_matrix * slope) @ self.slip_matrix)

    def trim(self, inputs: Mapping[str, float] | None = None) -> dict[str, float]:
        """Steady motion (state -> value) under constant inputs and tyre offsets, by Newton's method.

        Parameters
        ----------
        inputs : mapping of str to float, optional
            Constant inputs, SI.

        Raises
        ------
        InputError
            There is none within the friction, or the method does not find it.
        """
        check_names("input", dict(inputs or {}), self.inputs)
        u = np.array([(inputs or {}).get(name, 0.0) for name in self.inputs])
        x = np.zeros(len(self.states))
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(NEWTON_STEPS):
                try:
                    change = np.linalg.solve(self.jacobian(x, u), self.rate(x, u))
                except np.linalg.LinAlgError:
                    break
                x = x - change
                if np.abs(change).max() <= 1e-13 * np.abs(x).max() or not np.abs(x).max() < 1e6:
                    break
        if not np.abs(self.rate(x, u)).max() <= 1e-9 * max(1.0, np.abs(self.state_matrix).max() * np.abs(x).max()):
            raise InputError(f"no steady motion found at {self.speed:g} m/s; take smaller offsets or inputs")
        return dict(zip(self.states, x.tolist(), strict=True))

    def simulate(
        self, *, time: ArrayLike, initial: Mapping[str, float] | None = None,
        inputs: Mapping[str, InputHistory] | None = None, tolerance: float = 1e-10,
    ) -> Response:  # fmt: skip
        """Time history, integrated by DOP853 from jump to jump or bend of the inputs; arguments as in :func:`respond`.

        ``tolerance`` is relative, and absolute for 1 rad, 1 rad/s ... times a hundredth.

        Raises
        ------
        InputError
            An unknown state or input, times that do not increase, or a motion that the solver cannot follow.
        """
        given = dict(inputs or {})
        check_names("input", given, self.inputs)
        t, x = check_time(time), np.concatenate([initial_state(self.states, initial, self.units), np.zeros(len(PATH))])
        spread = np.zeros((len(self.inputs), len(given)))
        spread[[self.inputs.index(name) for name in given], range(len(given))] = 1.0
        grid, begin, end = input_grid(t, given)
        heading = self.output_matrix[[self.outputs.index(name) for name in ("yaw_rate", "rear_lateral_velocity")]]

        reached = float(grid[0])

        def rate(at: float, y: Array, since: float, first: Array, slope: Array) -> Array:
            nonlocal reached
            reached = at
            u = first + slope * (at - since)
            yaw_rate, lateral_velocity = heading @ y[:-2]
            return np.concatenate([self.rate(y[:-2], u), [yaw_rate, lateral_velocity + self.speed * y[-2]]])

        origin = self.jacobian(np.zeros(len(self.states)), np.zeros(len(self.inputs)))
        longest = 1 / np.abs(np.linalg.eigvals(origin)).max()  # between longer steps the interpolant is rough
        moving = (begin[:-1] != end).any(1)
        bends = moving[:-1] | moving[1:] if len(moving) else moving
        bends = bends & np.isin(grid[1:-1], np.concatenate([[], *(h.time for h in given.values())]))
        jumps = np.flatnonzero((begin[1:-1] != end[:-1]).any(1) | bends) + 1
        states = x[None, :]
        for first, last in zip([0, *jumps], [*jumps, len(grid) - 1], strict=True):
            if first == last:
                continue
            slope = (end[last - 1] - begin[first]) / (grid[last] - grid[first])
            with np.errstate(over="ignore", invalid="ignore"):
                found = solve_ivp(
                    rate, (grid[first], grid[last]), states[-1], "DOP853", grid[first : last + 1],
                    args=(grid[first], spread @ begin[first], spread @ slope), rtol=tolerance, atol=tolerance / 100,
                    max_step=longest,
                )  # fmt: skip
            if not found.success or not np.isfinite(found.y).all():
                lost = found.t[~np.isfinite(found.y).all(0)]
                stops = float(lost[0]) if lost.size else reached
                raise InputError(
                    f"the simulation at {self.speed:g} m/s stops at {stops:.3g} s: {found.message} "
                    "The bicycle has probably fallen; take less time or a smaller input"
                )
            states = np.vstack([states, found.y.T[1:]])
        at = np.searchsorted(grid, t)
        states, shown = states[at], begin[at]
        forces = self.side_forces(states[:, :-2] @ self.slip_matrix.T + shown @ (self.slip_input @ spread).T)
        named = dict(zip(self.outputs, (states[:, :-2] @ self.output_matrix.T).T, strict=True))
        named |= {f"{wheel}_side_force": forces[:, k] for k, wheel in enumerate(WHEELS)}
        named |= dict(zip(PATH, states[:, -2:].T, strict=True))
        return Response(t, self.speed, named, dict(zip(given, shown.T, strict=True)), self.units)

    def _of(self, name: str) -> Array:
        return np.array([getattr(tyre, name) for tyre in self.tyres])

    @cached_property
    def _coefficients(self) -> dict[str, Array]:
        peak, shape = self._of("friction"), self._of("shape_factor")
        factor = self.cornering_stiffness / (self.loads * peak * shape)
        return {
            "stiffness_factor": factor, "shape_factor": shape, "peak_factor": peak,
            "curvature_factor": self._of("curvature_factor"),
        }  # fmt: skip
