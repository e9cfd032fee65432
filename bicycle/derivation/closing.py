"""Closing a model: from rows that are linear in the motion to the symbolic matrices E, F(v), B(v), C(v), D(v)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from bicycle.derivation.declarations import Declarations, Mode, State
from bicycle.derivation.symbolic_polynomial import SymbolicPolynomial
from bicycle.parameters import UNITS

Expression = Any  # sympy.Expr; the library carries no types


@dataclass(frozen=True)
class SymbolicModel:
    """E x' = F(v) x + B(v) u, y = C(v) x + D(v) u, symbolic; :mod:`bicycle.derivation.evaluation` gives numbers."""

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    mass: Any
    dynamics: SymbolicPolynomial
    input_matrix: SymbolicPolynomial
    output_matrix: SymbolicPolynomial
    feedthrough: SymbolicPolynomial
    static_loads: tuple[Expression, Expression]
    load_transfer: Expression
    switches: Mapping[Expression, Expression]
    declared: Declarations


@dataclass(frozen=True)
class OpenModel:
    """Rows of the equations, linear in ``motion`` and ``inputs``.

    ``mass`` times the first rates is ``right``; then follow the rates of the angles and of the extra states.
    ``speed`` is the symbol v; ``static_loads``, ``load_transfer`` and ``switches`` as in :class:`SymbolicModel`.
    ``states`` are those of the motion by name, ``modes`` what the effects bring, ``units`` those of inputs and outputs.
    """

    mass: Any
    right: Any
    angle_rates: Any
    extra_rates: Any
    motion: Sequence[Expression]
    inputs: Sequence[Expression]
    outputs: Mapping[str, Expression]
    speed: Expression
    static_loads: tuple[Expression, Expression]
    load_transfer: Expression
    switches: Mapping[Expression, Expression]
    states: Mapping[str, State]
    modes: Sequence[Mode]
    units: Mapping[str, str]


def assemble(rows: OpenModel) -> SymbolicModel:
    """Matrices of rows as they stand.

    Parameters
    ----------
    rows : OpenModel
    """
    states = tuple(rows.states[str(state)] for state in rows.motion)
    n_fast, n = len(rows.right), len(rows.motion)
    e = sp.eye(n)
    e[:n_fast, :n_fast] = rows.mass
    right = sp.Matrix([*rows.right, *rows.angle_rates, *rows.extra_rates])
    shown = sp.Matrix(list(rows.outputs.values()))
    return SymbolicModel(
        states=tuple(state.name for state in states),
        inputs=tuple(map(str, rows.inputs)),
        outputs=tuple(rows.outputs),
        parameters=_parameters(rows.switches, right, e),
        mass=e,
        dynamics=SymbolicPolynomial.of_linear(right, rows.motion, rows.speed),
        input_matrix=SymbolicPolynomial.of_linear(right, rows.inputs, rows.speed),
        output_matrix=SymbolicPolynomial.of_linear(shown, rows.motion, rows.speed),
        feedthrough=SymbolicPolynomial.of_linear(shown, rows.inputs, rows.speed),
        static_loads=rows.static_loads,
        load_transfer=rows.load_transfer,
        switches=rows.switches,
        declared=Declarations(states, tuple(rows.modes), {**rows.units, **{s.name: s.unit for s in states}}),
    )


def hold_contacts(rows: OpenModel, slip_velocities: Sequence[Expression], side_forces: Sequence[Expression]) -> Any:
    """Eliminate V, r and the two side forces: slip velocities zero, test space orthogonal to the force ports.

    Parameters
    ----------
    rows : OpenModel
        Whose motion begins with V and r, the rates and the angles of the joints.
    slip_velocities : two expressions
        Of rear and front contact in terms of the motion, m/s.
    side_forces : two symbols
        What holds them, N; the rows are linear in them.

    Returns
    -------
    SymbolicModel
    """
    eliminated = list(rows.motion[:2])
    n_joints = len(rows.right) - 2
    rates, reduced = rows.motion[2 : 2 + n_joints], rows.motion[2:]
    angles = rows.motion[2 + n_joints : 2 + 2 * n_joints]
    slips = sp.Matrix(list(slip_velocities))
    lead = slips.jacobian(eliminated)
    followed = -lead.inv() * slips.subs(dict.fromkeys(eliminated, 0))  # V and r in terms of rates and angles
    held = dict(zip(eliminated, followed, strict=True))
    follow_rate, follow_angle = followed.jacobian(rates), followed.jacobian(angles)

    ports = rows.right.jacobian(list(side_forces))
    test = sp.Matrix.vstack(-(ports[2:, :] * ports[:2, :].inv()).T, sp.eye(n_joints))
    trial = sp.Matrix.vstack(follow_rate, sp.eye(n_joints))
    free = rows.right.subs(dict.fromkeys(side_forces, 0)).subs(held)
    free -= rows.mass[:, :2] * follow_angle * sp.Matrix(rates)  # follow_angle carries one power of v
    reduced_rows = replace(
        rows,
        mass=test.T * rows.mass * trial,
        right=test.T * free,
        angle_rates=sp.Matrix(rates),
        extra_rates=rows.extra_rates.subs(held),
        motion=reduced,
        outputs={name: expression.subs(held) for name, expression in rows.outputs.items()},
    )
    return assemble(reduced_rows)


def _parameters(switches: Mapping[Expression, Expression], *matrices: Any) -> tuple[str, ...]:
    """Bicycle keys, then the effect parameters that occur, by name."""
    found = set().union(*(matrix.free_symbols for matrix in matrices))
    found |= set().union(*(sp.sympify(speed).free_symbols for speed in switches.values()))
    return (*UNITS, *sorted(str(symbol) for symbol in found if "." in str(symbol)))
