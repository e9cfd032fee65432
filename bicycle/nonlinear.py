"""Motion with tyres that follow the Magic Formula, on linear geometry."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from bicycle.declarations import Wheel
from bicycle.effect import WHEELS, Effect
from bicycle.effect_registry import registry
from bicycle.equations import ModelBuilder
from bicycle.inputs import InputHistory
from bicycle.model import Model
from bicycle.responses import PATH, Response, check_time, initial_state, input_grid, units_of
from tyre.arrays import Array
from tyre.errors import InputError, refuse_unknown
from tyre.magic_formula import normalised_side_force, normalised_side_force_slope

PROBES = {
    "slip velocity": "m", "lagged camber force": "N s", "direct camber force": "N s", "series compliance": "m s",
    "load transfer": "N^2 s",
}  # fmt: skip
"""Quantity that a tyre would see, as the rate of a state -> unit of that state."""
LAGS = "relaxing contact"  # what a contact law with a relaxation length provides


class OpenContact(Effect):
    """Contacts whose side force is free: a state without a law, beside probes whose rates are what a tyre would see."""

    identifier: ClassVar[str] = "open_contact"
    slot = "contact law"
    provides = ("contact force", "tyre force", "lagged force")
    holds_contact = False

    def apply(self, model: ModelBuilder) -> None:
        """Become the contact law."""
        model.set_contact_law(self)

    def side_force(self, model: ModelBuilder, wheel: Wheel) -> Any:
        """Return the free side force."""
        force = model.add_state(f"{wheel.name}_side_force", unit="N", role=wheel.name)
        model.set_rate(force, sp.S.Zero)
        seen = (
            wheel.slip_velocity, wheel.lagged_camber_force, wheel.direct_camber_force,
            wheel.series_compliance * force, sp.sympify(model.load_transfer) * force,
        )  # fmt: skip
        for (name, unit), quantity in zip(PROBES.items(), seen, strict=True):
            model.set_rate(model.add_state(f"{wheel.name} {name}", unit=unit), quantity)
        return force


def takes_magic_tyres(law: type[Effect]) -> bool:
    """True of a contact law that is a slope at zero slip, at once or after one relaxation length."""
    lags = LAGS in law.provides
    needed = {"cornering_stiffness", "relaxation_length"} if lags else {"cornering_stiffness"}
    one_lag = lags or "lagged force" not in law.provides
    return "tyre force" in law.provides and one_lag and needed <= {parameter.name for parameter in law.parameters}


@dataclass(frozen=True)
class MagicTyre:
    """Magic Formula of one tyre; its cornering stiffness comes from the model, B = C_Fy / (C D load)."""

    friction: float = 0.8  # peak of the side force over the load, D
    shape_factor: float = 1.3  # C
    curvature_factor: float = 0.0  # E
    offset: float = 0.0  # sv: side force over load at zero slip (ply steer)

    def __post_init__(self) -> None:
        limits = {
            "friction": (0.0, 3.0),
            "shape_factor": (0.0, 2.0),
            "curvature_factor": (-100.0, 1.0),
            "offset": (-1.0, 1.0),
        }
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if not low <= value <= high or value == low == 0.0:
                excluded = " (0 excluded)" if low == 0.0 else ""
                raise InputError(f"{name} = {value:g} is outside {low:g} .. {high:g}{excluded}")


@dataclass(frozen=True)
class MagicFormulaModel:
    """x' = A x + P F(G x) + B u at one speed; outputs C x and the side forces."""

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
        """Side force (..., 2) in N at effective slip angles (..., 2) in rad."""
        curve = normalised_side_force(slip, **self._coefficients, vertical_shift=self._of("offset"))
        return np.asarray(self.loads * curve)

    def local_stiffness(self, slip: Array) -> Array:
        """Slope of the side force (..., 2), N/rad."""
        return np.asarray(self.loads * normalised_side_force_slope(slip, **self._coefficients))

    def rate(self, state: Array, inputs: Array) -> Array:
        """dx/dt (n,)."""
        force = self.side_forces(self.slip_matrix @ state + self.slip_input @ inputs)
        return np.asarray(self.state_matrix @ state + self.force_matrix @ force + self.input_matrix @ inputs)

    def jacobian(self, state: Array, inputs: Array) -> Array:
        """d(dx/dt)/dx (n, n)."""
        slope = self.local_stiffness(self.slip_matrix @ state + self.slip_input @ inputs)
        return np.asarray(self.state_matrix + (self.force_matrix * slope) @ self.slip_matrix)

    def trim(self, inputs: Mapping[str, float] | None = None) -> dict[str, float]:
        """Steady motion (state -> value) under constant inputs and tyre offsets, by Newton's method."""
        refuse_unknown("input", inputs or {}, self.inputs)
        u = np.array([(inputs or {}).get(name, 0.0) for name in self.inputs])
        x = np.zeros(len(self.states))
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(50):
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
        """Time history by DOP853 from jump to jump of the inputs; arguments as in :func:`respond`."""
        given = dict(inputs or {})
        refuse_unknown("input", given, self.inputs)
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


def magic_formula_model(
    model: Model, *, speed: float, rear: MagicTyre | None = None, front: MagicTyre | None = None
) -> MagicFormulaModel:
    """Put Magic Formula tyres under a model whose contact law is linear in the slip, with or without one lag."""
    law = _law(model)

    def of_wheels(name: str) -> Array:
        return np.array([model.parameters[f"{law.identifier}.{name}.{wheel}"] for wheel in WHEELS])

    stiffness = of_wheels("cornering_stiffness")
    if (stiffness == 0).any():
        raise InputError("nonlinear tyres need a cornering_stiffness > 0 on both wheels")
    lags = LAGS in law.provides
    if not lags:
        model.linear_model().check_speeds(speed)  # slip without relaxation is singular at rest
    # the model with its contacts open: rows and columns of side forces and probes are taken apart from its states
    linear = model.with_effect(OpenContact()).linear_model()
    a, b, c = linear.matrices_at(speed)
    forces = [linear.states.index(f"{wheel}_side_force") for wheel in WHEELS]
    probe = {name: [linear.states.index(f"{wheel} {name}") for wheel in WHEELS] for name in PROBES}
    kept = [k for k, name in enumerate(linear.states) if k not in forces and k not in np.ravel(list(probe.values()))]
    outputs = tuple(name for name in linear.outputs if not name.endswith("_side_force"))
    loads = np.array(linear.static_loads) + np.array([1.0, -1.0]) * a[probe["load transfer"], forces]
    if (loads <= 0).any():
        lifted = WHEELS[int(loads.argmin())]
        raise InputError(f"at {speed:g} m/s the drag lifts the {lifted} wheel off the road; ride slower")
    n, m, extra = len(kept), len(linear.inputs), 2 * lags
    seen = {name: a[np.ix_(rows, kept)] for name, rows in probe.items()}
    slip_velocity, slip_input = seen["slip velocity"], b[probe["slip velocity"]]
    lagged, direct = (seen[f"{name} camber force"] / stiffness[:, None] for name in ("lagged", "direct"))
    if lags:  # a transient slip follows slip and lagged camber over the relaxation length, as a state
        compliance = a[probe["series compliance"], forces]  # m/N, in series with the tyre
        whole = (of_wheels("relaxation_length") + stiffness * compliance)[:, None]
        lag = np.hstack([(speed * lagged - slip_velocity) / whole, np.diag(-speed / whole[:, 0])])
        lag_input = -slip_input / whole
        slip, slip_input = np.hstack([direct, np.eye(2)]), np.zeros((2, m))
    else:
        lag, lag_input = np.zeros((0, n)), np.zeros((0, m))
        slip, slip_input = direct + lagged - slip_velocity / speed, -slip_input / speed
    transient = tuple(f"{wheel}_transient_slip" for wheel in WHEELS)[:extra]
    rows = [linear.outputs.index(name) for name in outputs]
    return MagicFormulaModel(
        speed=float(speed),
        states=(*(linear.states[k] for k in kept), *transient),
        inputs=linear.inputs,
        outputs=outputs,
        state_matrix=np.vstack([np.hstack([a[np.ix_(kept, kept)], np.zeros((n, extra))]), lag]),
        force_matrix=np.vstack([a[np.ix_(kept, forces)], np.zeros((extra, 2))]),
        slip_matrix=slip,
        slip_input=slip_input,
        input_matrix=np.vstack([b[kept], lag_input]),
        output_matrix=np.hstack([c[np.ix_(rows, kept)], np.zeros((len(outputs), extra))]),
        cornering_stiffness=stiffness,
        loads=loads,
        tyres=(rear or MagicTyre(), front or MagicTyre()),
        units={**units_of(linear), **dict.fromkeys(transient, "rad")},
    )


def _law(model: Model) -> Effect:
    """The contact law of a model that takes Magic Formula tyres."""
    law = next(effect for effect in model.effects if effect.slot == "contact law")
    if not takes_magic_tyres(type(law)):
        laws = sorted(filter(takes_magic_tyres, registry().values()), key=lambda effect: len(effect.parameters))
        raise InputError(
            f"nonlinear tyres need the effect {' or '.join(effect.identifier for effect in laws)}; "
            f"this model rolls with {law.identifier!r}"
        )
    given = {thing for effect in model.effects if effect is not law for thing in effect.provides}
    given |= set(OpenContact.provides)
    for effect in model.effects:
        if set(effect.requires) - given:
            raise InputError(
                f"nonlinear tyres touch the ground at a point; the effect {effect.identifier!r} is linear only: "
                "leave it out"
            )
    return law
