"""Closing a model: from rows that are linear in the motion to the symbolic matrices E, F(v), B(v), C(v), D(v)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sympy as sp

from bicycle.derivation.speed_polynomial import SpeedPolynomial
from bicycle.parameters import UNITS

if TYPE_CHECKING:
    from bicycle.derivation.builder import ModelBuilder

Expression = Any  # sympy.Expr; the library carries no types


@dataclass(frozen=True)
class SymbolicModel:
    """E x' = F(v) x + B(v) u, y = C(v) x + D(v) u, symbolic; :mod:`bicycle.derivation.evaluation` gives numbers."""

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    mass: Any
    dynamics: SpeedPolynomial
    input_matrix: SpeedPolynomial
    output_matrix: SpeedPolynomial
    feedthrough: SpeedPolynomial
    static_loads: tuple[Expression, Expression]
    load_transfer: Expression
    switches: dict[Expression, Expression]


def assemble(
    model: "ModelBuilder", mass: Any, right: Any, angle_rates: Any, extra_rates: Any,
    motion: list[Expression], inputs: list[Expression], outputs: dict[str, Expression],
) -> SymbolicModel:  # fmt: skip
    n_fast, n = len(right), len(motion)
    e = sp.eye(n)
    e[:n_fast, :n_fast] = mass
    rows = sp.Matrix([*right, *angle_rates, *extra_rates])
    shown = sp.Matrix(list(outputs.values()))
    return SymbolicModel(
        states=tuple(map(str, motion)),
        inputs=tuple(map(str, inputs)),
        outputs=tuple(outputs),
        parameters=_parameters(model, rows, e),
        mass=e,
        dynamics=SpeedPolynomial.of_linear(rows, motion, model.speed),
        input_matrix=SpeedPolynomial.of_linear(rows, inputs, model.speed),
        output_matrix=SpeedPolynomial.of_linear(shown, motion, model.speed),
        feedthrough=SpeedPolynomial.of_linear(shown, inputs, model.speed),
        static_loads=tuple(model._loads.values()),  # type: ignore[arg-type]
        load_transfer=model.load_transfer,
        switches=model.switches,
    )


def hold_contacts(
    model: "ModelBuilder", mass: Any, right: Any, extra_rates: Any, motion: list[Expression],
    inputs: list[Expression], outputs: dict[str, Expression], meaning: dict[Expression, Expression],
) -> SymbolicModel:  # fmt: skip
    """Eliminate V, r and the two constraint forces: slip velocity zero, test space orthogonal to the force ports."""
    eliminated = [model.lateral_velocity, model.yaw_rate]
    n_joints = len(right) - 2
    rates, reduced = motion[2 : 2 + n_joints], motion[2:]
    angles = motion[2 + n_joints : 2 + 2 * n_joints]
    slips = sp.Matrix([meaning[wheel.slip_velocity] for wheel in model.wheels])
    lead = slips.jacobian(eliminated)
    followed = -lead.inv() * slips.subs(dict.fromkeys(eliminated, 0))  # V and r in terms of rates and angles
    held = dict(zip(eliminated, followed, strict=True))
    follow_rate, follow_angle = followed.jacobian(rates), followed.jacobian(angles)

    force_symbols = [wheel.side_force for wheel in model.wheels]
    ports = right.jacobian(force_symbols)
    test = sp.Matrix.vstack(-(ports[2:, :] * ports[:2, :].inv()).T, sp.eye(n_joints))
    trial = sp.Matrix.vstack(follow_rate, sp.eye(n_joints))
    free = right.subs(dict.fromkeys(force_symbols, 0)).subs(held)
    free -= mass[:, :2] * follow_angle * sp.Matrix(rates)  # follow_angle carries one power of v
    shown = {name: expression.subs(held) for name, expression in outputs.items()}
    return assemble(
        model, test.T * mass * trial, test.T * free, sp.Matrix(rates), extra_rates.subs(held), reduced, inputs, shown
    )


def _parameters(model: "ModelBuilder", *matrices: Any) -> tuple[str, ...]:
    """Bicycle keys, then the effect parameters that occur, by name."""
    found = set().union(*(matrix.free_symbols for matrix in matrices))
    found |= set().union(*(sp.sympify(speed).free_symbols for speed in model.switches.values()))
    return (*UNITS, *sorted(str(symbol) for symbol in found if "." in str(symbol)))
