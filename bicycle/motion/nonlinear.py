"""Motion with tyres that follow the Magic Formula, on linear geometry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bicycle.effects.effect import WHEELS, Effect
from bicycle.effects.effect_registry import registry
from bicycle.equations.declarations import Wheel
from bicycle.equations.lateral import ModelBuilder
from bicycle.model.inputs import InputHistory
from bicycle.model.model import Model
from bicycle.motion.responses import PATH, Response, check_time, initial_state, input_grid, units_of
from tyre.ground.arrays import Array
from tyre.ground.door import library
from tyre.ground.errors import InputError, refuse_unknown
from tyre.laws.formula_tyre import FormulaTyre
from tyre.laws.magic_formula import normalised_lateral_force, normalised_lateral_force_slope

sp = library("sympy")

PROBES = {
    "slip velocity": "m",
    "lagged camber force": "N s",
    "direct camber force": "N s",
    "series compliance": "m s",
    "load transfer": "N^2 s",
}
"""Quantity that a tyre would see, as the rate of a state -> unit of that state."""
LAGS = "relaxing contact"  # what a contact law with a relaxation length provides


class OpenContact(Effect):
    """Contacts whose lateral force is a free state; the rates of probes are what a tyre would see."""

    identifier: ClassVar[str] = "open_contact"
    slot = "contact law"
    provides = ("contact force", "tyre force", "lagged force")
    holds_contact = False

    def apply(self, model: ModelBuilder) -> None:
        """Become the contact law."""
        model.set_contact_law(self)

    def lateral_force(self, model: ModelBuilder, wheel: Wheel) -> Any:
        """Return the free lateral force."""
        force = model.add_state(f"{wheel.name}_lateral_force", unit="N", role=wheel.name)
        model.set_rate(force, sp.S.Zero)
        quantities = (
            wheel.slip_velocity,
            wheel.lagged_camber_force,
            wheel.direct_camber_force,
            wheel.series_compliance * force,
            sp.sympify(model.load_transfer) * force,
        )
        for (name, unit), quantity in zip(PROBES.items(), quantities, strict=True):
            model.set_rate(model.add_state(f"{wheel.name} {name}", unit=unit), quantity)
        return force


def takes_magic_tyres(law: type[Effect]) -> bool:
    """True of a contact law whose lateral force is linear in slip, at once or after one relaxation length."""
    lags = LAGS in law.provides
    needed = {"cornering_stiffness", "relaxation_length"} if lags else {"cornering_stiffness"}
    one_lag = lags or "lagged force" not in law.provides
    return "tyre force" in law.provides and one_lag and needed <= {parameter.name for parameter in law.parameters}


@dataclass(frozen=True)
class MagicTyre:
    """Magic Formula of one tyre; its cornering stiffness comes from the model, B = C_alpha / (C D load)."""

    peak_factor: float = 0.8  # peak of the lateral force over the load, D
    shape_factor: float = 1.3  # C
    curvature_factor: float = 0.0  # E
    offset: float = 0.0  # sv: lateral force over load at zero slip (ply steer)

    def __post_init__(self) -> None:
        limits = ((0.0, 3.0), (0.0, 2.0), (-100.0, 1.0), (-1.0, 1.0))
        for (name, value), (low, high) in zip(vars(self).items(), limits, strict=True):
            if not low <= value <= high or value == low == 0.0:
                excluded = " (0 excluded)" if low == 0.0 else ""
                raise InputError(f"{name} = {value:g} is outside {low:g} .. {high:g}{excluded}")

    def under(self, load: float, stiffness: float) -> "TyreUnderLoad":
        """Return the tyre at a wheel with this load (N) and cornering stiffness (N/rad)."""
        coefficients = {
            "stiffness_factor": stiffness / (load * self.peak_factor * self.shape_factor),
            "peak_factor": self.peak_factor,
            "shape_factor": self.shape_factor,
            "curvature_factor": self.curvature_factor,
        }

        def force(slip: Array, camber: Array) -> Array:
            return load * normalised_lateral_force(slip + camber, **coefficients, vertical_shift=self.offset)

        def slope(slip: Array, camber: Array) -> Array:
            return np.asarray(load * normalised_lateral_force_slope(slip + camber, **coefficients))

        grip = stiffness / (3 * self.peak_factor * load)
        return TyreUnderLoad(force, lambda s, e: force(s, e) * falling_trail(grip * (s + e)), slope, apart=False)


def falling_trail(sliding: Array) -> Array:
    """Trail over that at zero slip, from the reduced slip C slip / (3 mu load), which is 1 where a brush slides whole.

    It is smooth and halves where that of a brush with parabolic pressure does, (1 - z)^3 = (1 - z + z^2/3) / 2 at
    z = 0.28 (Pacejka, Tire and Vehicle Dynamics, 3rd ed., section 3.2.1); where all slides, 7 % are left.
    """
    return np.asarray(1 / (1 + (sliding / 0.28) ** 2))


@dataclass(frozen=True)
class CurveTyre:
    """The full curves of a tyre file at one pressure, without ply steer: the mean of the tyre and its mirror image."""

    source: FormulaTyre  # lateral force and aligning moment over slip, camber, load and pressure
    pressure: float  # Pa
    offset: float = 0.0  # lateral force over load at zero slip (ply steer)

    def under(self, load: float, stiffness: float) -> "TyreUnderLoad":
        """Return the tyre at a wheel with this load (N), its slip scaled to this cornering stiffness (N/rad)."""
        at, step = {"load": load, "pressure": self.pressure}, 1e-6

        def mean(curve: Any, slip: Array, camber: Array) -> Array:
            as_is, mirrored = (curve(slip_angle=sign * slip, camber=sign * camber, **at) for sign in (1.0, -1.0))
            return np.asarray((as_is - mirrored) / 2)

        def slopes(curve: Any) -> tuple[float, float]:
            zero = np.zeros(2)
            small = np.array([step, -step])
            by_slip, by_camber = mean(curve, small, zero), mean(curve, zero, small)
            return float(by_slip[0]) / step, float(by_camber[0]) / step

        c, c_camber = slopes(self.source.lateral_force)
        # camber comes as the slip that gives the same force; a model without camber thrust sees none
        lean = 0.0 if c_camber == 0.0 else stiffness / c_camber
        scale = stiffness / c

        def force(slip: Array, camber: Array) -> Array:
            return mean(self.source.lateral_force, scale * slip, lean * camber) + self.offset * load

        try:
            moment, moment_camber = slopes(self.source.aligning_moment)
        except InputError:  # not held: that of a brush, which slides at the peak of the curve
            peak = np.abs(force(np.radians(np.arange(1.0, 21.0)), np.zeros(20))).max()
            grip = stiffness / (3 * peak)
            return TyreUnderLoad(force, lambda s, e: force(s, e) * falling_trail(grip * (s + e)))
        trail = -moment / c
        residual = moment_camber + trail * c_camber  # what an effect twisting_torque brings

        def by_trail(slip: Array, camber: Array) -> Array:
            whole = mean(self.source.aligning_moment, scale * slip, lean * camber)
            return np.asarray((residual * lean * camber - whole) / trail + self.offset * load)

        return TyreUnderLoad(force, by_trail)


@dataclass(frozen=True)
class TyreUnderLoad:
    """Lateral force (N) of a tyre from its lagged slip and the slip that stands for camber, both rad."""

    force: Callable[[Array, Array], Array]
    by_trail: Callable[[Array, Array], Array]  # aligning moment over the trail of small slip, > 0 like the force
    known_slope: Callable[[Array, Array], Array] | None = None  # of the force
    apart: bool = True  # the force is no function of the sum of the two

    def slope(self, of: str, slip: Array, camber: Array, *, by_camber: bool = False) -> Array:
        """Slope of ``force`` or ``by_trail`` over slip or camber, N/rad."""
        if of == "force" and self.known_slope is not None:
            return self.known_slope(slip, camber)
        curve, step = getattr(self, of), 1e-6
        if by_camber:
            return np.asarray((curve(slip, camber + step) - curve(slip, camber - step)) / (2 * step))
        return np.asarray((curve(slip + step, camber) - curve(slip - step, camber)) / (2 * step))


@dataclass(frozen=True)
class MagicFormulaModel:
    """x' = A x + P F + T F_t + B u at one speed; outputs C x and the lateral forces.

    F are the lateral forces at the lagged slip, F_t those that make the aligning moment of the trail of small slip.
    """

    speed: float  # m/s
    states: tuple[str, ...]  # names, (n,)
    inputs: tuple[str, ...]  # names, as in the linear model
    outputs: tuple[str, ...]  # names, without the lateral forces
    state_matrix: Array  # (n, n), without lateral forces
    force_matrix: Array  # (n, 2)
    trail_matrix: Array  # (n, 2)
    slip_matrix: Array  # (2, n): effective slip angle, rad
    camber_matrix: Array  # (2, n): slip that stands for camber, where it is apart
    slip_input: Array  # (2, inputs)
    input_matrix: Array  # (n, inputs)
    output_matrix: Array  # (outputs without lateral forces, n)
    loads: Array  # (2,), N, > 0: rear and front wheel at this speed
    tyres: tuple[TyreUnderLoad, TyreUnderLoad]  # rear and front
    units: Mapping[str, str]  # of states, inputs and outputs

    def lateral_forces(self, slip: Array, camber: Array | None = None) -> Array:
        """Lateral force (..., 2) in N at effective slip angles (..., 2) and slips that stand for camber, in rad."""
        return self._stack_wheels("force", slip, camber)

    def _stack_wheels(self, quantity: str, slip: Array, camber: Array | None) -> Array:
        lean = np.zeros_like(slip) if camber is None else camber
        return np.stack([getattr(tyre, quantity)(slip[..., k], lean[..., k]) for k, tyre in enumerate(self.tyres)], -1)

    def rate(self, state: Array, inputs: Array) -> Array:
        """dx/dt (n,), SI, at ``state`` (n,) and ``inputs`` (inputs,)."""
        slip, camber = self.slip_matrix @ state + self.slip_input @ inputs, self.camber_matrix @ state
        force = self.force_matrix @ self.lateral_forces(slip, camber) + self.input_matrix @ inputs
        if self.trail_matrix.any():
            force = force + self.trail_matrix @ self._stack_wheels("by_trail", slip, camber)
        return np.asarray(self.state_matrix @ state + force)

    def jacobian(self, state: Array, inputs: Array) -> Array:
        """d(dx/dt)/dx (n, n), SI, at ``state`` (n,) and ``inputs`` (inputs,)."""
        slip, camber = self.slip_matrix @ state + self.slip_input @ inputs, self.camber_matrix @ state
        jacobian = self.state_matrix.copy()
        for of, matrix in (("force", self.force_matrix), ("by_trail", self.trail_matrix)):
            for by_camber, motion_matrix in ((False, self.slip_matrix), (True, self.camber_matrix)):
                if matrix.any() and motion_matrix.any():
                    slope = [
                        tyre.slope(of, slip[k], camber[k], by_camber=by_camber) for k, tyre in enumerate(self.tyres)
                    ]
                    jacobian += (matrix * np.array(slope)) @ motion_matrix
        return jacobian

    def trim(self, inputs: Mapping[str, float] | None = None) -> dict[str, float]:
        """Steady motion (state -> value, SI) under constant ``inputs`` (SI) and tyre offsets, by Newton's method."""
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
        self,
        *,
        time: ArrayLike,
        initial: Mapping[str, float] | None = None,
        inputs: Mapping[str, InputHistory] | None = None,
        tolerance: float = 1e-10,
    ) -> Response:
        """Time history by DOP853 from jump to jump of the inputs; arguments as in :func:`respond`."""
        from scipy.integrate import solve_ivp  # a tenth of a second that critical speeds can do without

        input_histories = dict(inputs or {})
        refuse_unknown("input", input_histories, self.inputs)
        t = check_time(time)
        x = np.concatenate([initial_state(self.states, initial, self.units), np.zeros(len(PATH))])
        spread = np.zeros((len(self.inputs), len(input_histories)))
        spread[[self.inputs.index(name) for name in input_histories], range(len(input_histories))] = 1.0
        grid, begin, end = input_grid(t, input_histories)
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
        bends = bends & np.isin(grid[1:-1], np.concatenate([[], *(h.time for h in input_histories.values())]))
        jumps = np.flatnonzero((begin[1:-1] != end[:-1]).any(1) | bends) + 1
        states = x[None, :]
        for first, last in zip([0, *jumps], [*jumps, len(grid) - 1], strict=True):
            if first == last:
                continue
            slope = (end[last - 1] - begin[first]) / (grid[last] - grid[first])
            with np.errstate(over="ignore", invalid="ignore"):
                solution = solve_ivp(
                    rate,
                    (grid[first], grid[last]),
                    states[-1],
                    "DOP853",
                    grid[first : last + 1],
                    args=(grid[first], spread @ begin[first], spread @ slope),
                    rtol=tolerance,
                    atol=tolerance / 100,
                    max_step=longest,
                )
            if not solution.success or not np.isfinite(solution.y).all():
                lost = np.asarray(solution.t)[~np.isfinite(solution.y).all(0)]  # lists if the first step fails
                stops = float(lost[0]) if lost.size else reached
                raise InputError(
                    f"the simulation at {self.speed:g} m/s stops at {stops:.3g} s: {solution.message} "
                    "The bicycle has probably fallen; take less time or a smaller input"
                )
            states = np.vstack([states, solution.y.T[1:]])
        at = np.searchsorted(grid, t)
        states, input_values = states[at], begin[at]
        slip = states[:, :-2] @ self.slip_matrix.T + input_values @ (self.slip_input @ spread).T
        forces = self.lateral_forces(slip, states[:, :-2] @ self.camber_matrix.T)
        named = dict(zip(self.outputs, (states[:, :-2] @ self.output_matrix.T).T, strict=True))
        named |= {f"{wheel}_lateral_force": forces[:, k] for k, wheel in enumerate(WHEELS)}
        named |= dict(zip(PATH, states[:, -2:].T, strict=True))
        return Response(t, self.speed, named, dict(zip(input_histories, input_values.T, strict=True)), self.units)


def magic_formula_model(
    model: Model, *, speed: float, rear: MagicTyre | CurveTyre | None = None, front: MagicTyre | CurveTyre | None = None
) -> MagicFormulaModel:
    """Put tyres with full curves under a model whose contact law is linear in the slip, with or without one lag.

    The slip lags, and lateral force and moment follow their curves at the lagged slip. The moment of a pneumatic trail
    falls with the slip: as the file of a `CurveTyre` says, else like that of a brush tyre.
    """
    law = _law(model)
    if moving_loads := [effect.identifier for effect in model.effects if effect.moves_load]:
        raise InputError(
            f"how much side grip forces along the wheels take is not known here; leave out {moving_loads[0]}"
        )

    def of_wheels(name: str) -> Array:
        return np.array([model.parameters[f"{law.identifier}.{name}.{wheel}"] for wheel in WHEELS])

    stiffness = of_wheels("cornering_stiffness")
    if (stiffness == 0).any():
        raise InputError("nonlinear tyres need a cornering_stiffness > 0 on both wheels")
    lags = LAGS in law.provides
    if not lags:
        model.linear_model().check_speeds(speed)  # slip without relaxation is singular at rest
    # the model with its contacts open: rows and columns of lateral forces and probes are taken apart from its states
    linear = model.with_effect(OpenContact()).linear_model()
    a, b, c = linear.matrices_at(speed)
    forces = [linear.states.index(f"{wheel}_lateral_force") for wheel in WHEELS]
    probe = {name: [linear.states.index(f"{wheel} {name}") for wheel in WHEELS] for name in PROBES}
    kept_states = [
        k for k, name in enumerate(linear.states) if k not in forces and k not in np.ravel(list(probe.values()))
    ]
    outputs = tuple(name for name in linear.outputs if not name.endswith("_lateral_force"))
    loads = np.array(linear.static_loads) + np.array([1.0, -1.0]) * a[probe["load transfer"], forces]
    if (loads <= 0).any():
        lifted = WHEELS[int(loads.argmin())]
        raise InputError(f"at {speed:g} m/s the drag lifts the {lifted} wheel off the road; ride slower")
    linear_effects = tuple(effect for effect in model.effects if not getattr(effect, "falls_with_slip", False))
    upright = a  # the state matrix without a trail that falls with slip
    if len(linear_effects) < len(model.effects):
        upright = Model(model.bicycle, linear_effects).with_effect(OpenContact()).linear_model().matrices_at(speed)[0]
    tyres = tuple(
        (tyre or MagicTyre()).under(float(load), float(c))
        for tyre, load, c in zip((rear, front), loads, stiffness, strict=True)
    )
    probe_rows = {name: a[np.ix_(rows, kept_states)] for name, rows in probe.items()}
    slip_velocity, slip_input = probe_rows["slip velocity"], b[probe["slip velocity"]]
    lagged, direct = (probe_rows[f"{name} camber force"] / stiffness[:, None] for name in ("lagged", "direct"))
    separate_camber = np.array([tyre.apart for tyre in tyres])[:, None]  # camber is no slip to these
    n, m = len(kept_states), len(linear.inputs)
    names = [f"{wheel}_transient_slip" for wheel in WHEELS] if lags else []
    if lags:  # a transient slip follows slip and lagged camber over the relaxation length, as a state
        compliance = a[probe["series compliance"], forces]  # m/N, in series with the tyre
        whole = (of_wheels("relaxation_length") + stiffness * compliance)[:, None]
        rates, rate_input = (speed * lagged * ~separate_camber - slip_velocity) / whole, -slip_input / whole
        if (separate_camber * lagged).any():  # and so does camber
            names += [f"{wheel}_transient_camber" for wheel in WHEELS]
            rates = np.vstack([rates, speed * lagged * separate_camber / whole])
            rate_input = np.vstack([rate_input, np.zeros((2, m))])
        extra = len(names)
        lag = np.hstack([rates, -np.diag(np.tile(speed / whole[:, 0], extra // 2))])
        slip = np.hstack([direct * ~separate_camber, np.eye(2, extra)])
        camber = np.hstack([direct * separate_camber, np.eye(2, extra, k=2)])
        slip_input = np.zeros((2, m))
    else:
        extra = 0
        lag = np.zeros((0, n))
        rate_input = np.zeros((0, m))
        camber = (direct + lagged) * separate_camber
        slip, slip_input = (direct + lagged) * ~separate_camber - slip_velocity / speed, -slip_input / speed
    rows = [linear.outputs.index(name) for name in outputs]
    force_matrix = np.vstack([upright[np.ix_(kept_states, forces)], np.zeros((extra, 2))])
    with_trail = np.vstack([a[np.ix_(kept_states, forces)], np.zeros((extra, 2))])
    return MagicFormulaModel(
        speed=float(speed),
        states=(*(linear.states[k] for k in kept_states), *names),
        inputs=linear.inputs,
        outputs=outputs,
        state_matrix=np.vstack([np.hstack([a[np.ix_(kept_states, kept_states)], np.zeros((n, extra))]), lag]),
        force_matrix=force_matrix,
        trail_matrix=np.where(np.isclose(with_trail, force_matrix, rtol=1e-13, atol=0), 0.0, with_trail - force_matrix),
        slip_matrix=slip,
        camber_matrix=camber,
        slip_input=slip_input,
        input_matrix=np.vstack([b[kept_states], rate_input]),
        output_matrix=np.hstack([c[np.ix_(rows, kept_states)], np.zeros((len(outputs), extra))]),
        loads=loads,
        tyres=(tyres[0], tyres[1]),
        units={**units_of(linear), **dict.fromkeys(names, "rad")},
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
    provided = {slot for effect in model.effects if effect is not law for slot in effect.provides}
    provided |= set(OpenContact.provides)
    for effect in model.effects:
        if set(effect.requires) - provided:
            raise InputError(
                f"nonlinear tyres touch the ground at a point; the effect {effect.identifier!r} is linear only: "
                "leave it out"
            )
    return law
