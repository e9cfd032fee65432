"""Closing a model: from rows that are linear in the motion to the symbolic matrices E, F(v), B(v), C(v), D(v)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from bicycle.derivation.declarations import Declarations, Mode, State
from bicycle.derivation.symbolic_polynomial import SymbolicPolynomial
from bicycle.parameters import UNITS
from tyre.base.errors import InputError

Expression = Any  # sympy.Expr; the library carries no types
POWERS = (-1, 0, 1, 2)


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
    """Rows of the equations: a column for each of ``motion``, then for each of ``inputs``.

    ``mass`` times the first rates is ``right``; then follow the ``angle_rates`` and the ``extra_rates`` of the states
    that effects add. ``outputs`` are named, their rows are ``shown``. ``static_loads``, ``load_transfer`` and
    ``switches`` are as in :class:`SymbolicModel`; ``states`` are those of the motion by name, ``modes`` what the
    effects bring, ``units`` those of inputs and outputs.
    """

    mass: SymbolicPolynomial
    right: SymbolicPolynomial
    angle_rates: SymbolicPolynomial
    extra_rates: SymbolicPolynomial
    shown: SymbolicPolynomial
    motion: Sequence[Expression]
    inputs: Sequence[Expression]
    outputs: Sequence[str]
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

    Raises
    ------
    InputError
        A row holds another power of the speed than the model has.
    """
    states = tuple(rows.states[str(state)] for state in rows.motion)
    rates = rows.right.above(rows.angle_rates).above(rows.extra_rates)
    n = len(states)
    _check_powers(rates, [f"the rate of the state {state.name!r}" for state in states])
    _check_powers(rows.shown, [f"the output {name!r}" for name in rows.outputs])
    mass = sp.eye(n)
    mass[: rows.mass.shape[0], : rows.mass.shape[0]] = rows.mass.constant
    of_motion, of_inputs = slice(0, n), slice(n, None)
    return SymbolicModel(
        states=tuple(state.name for state in states),
        inputs=tuple(map(str, rows.inputs)),
        outputs=tuple(rows.outputs),
        parameters=_parameters(rows.switches, mass, *rates.coefficients.values()),
        mass=mass,
        dynamics=rates.columns(of_motion),
        input_matrix=rates.columns(of_inputs),
        output_matrix=rows.shown.columns(of_motion),
        feedthrough=rows.shown.columns(of_inputs),
        static_loads=rows.static_loads,
        load_transfer=rows.load_transfer,
        switches=rows.switches,
        declared=Declarations(states, tuple(rows.modes), {**rows.units, **{s.name: s.unit for s in states}}),
    )


def hold_contacts(rows: OpenModel, slip_velocities: SymbolicPolynomial) -> OpenModel:
    """Eliminate V, r and the side forces f: slip velocities zero, test space orthogonal to the force ports.

    The rows are M u' = R x + P f with u = [V, r, rates w of the joints], the slip velocities S x = 0. These give
    [V, r] = -S_Vr^-1 S_y y in terms of all other motion and inputs y, hence x = X y and u' = T w' + D w (angles change
    at the rates w). With W^t P = 0 the forces are gone: W^t M T w' = W^t (R X y - M D w).

    Parameters
    ----------
    rows : OpenModel
        Whose motion begins with V and r, the rates and the angles of the joints, and whose last two inputs are the
        side forces that hold the contacts, N.
    slip_velocities : SymbolicPolynomial
        Rows of rear and front contact, m/s.

    Returns
    -------
    OpenModel
        Without V, r and the side forces.
    """
    joints, width = rows.mass.shape[0] - 2, rows.right.shape[1] - 2
    rates, angles, kept, forces = slice(0, joints), slice(joints, 2 * joints), slice(0, width), slice(width, None)
    _check_forces(rows, forces)
    slips = slip_velocities.columns(kept)
    lead = slips.columns(slice(0, 2)).constant
    followed = -lead.inv() @ slips.columns(slice(2, None))  # V and r in terms of all that remains
    held = followed.above(SymbolicPolynomial.of_matrix(sp.eye(width - 2)))

    ports = rows.right.columns(forces).constant
    test = sp.Matrix.vstack(-(ports[2:, :] * ports[:2, :].inv()).T, sp.eye(joints))
    trial = sp.Matrix.vstack(followed.columns(rates).constant, sp.eye(joints))
    drift = rows.mass.columns(slice(0, 2)) @ followed.columns(angles)
    free = rows.right.columns(kept) @ held - drift.placed(rates.start, width - 2)
    return replace(
        rows,
        mass=test.T @ rows.mass @ trial,
        right=test.T @ free,
        angle_rates=rows.angle_rates.columns(kept) @ held,
        extra_rates=rows.extra_rates.columns(kept) @ held,
        shown=rows.shown.columns(kept) @ held,
        motion=rows.motion[2:],
        inputs=rows.inputs[:-2],
    )


def _check_forces(rows: OpenModel, forces: slice) -> None:
    """Refuse what the elimination of the side forces cannot do."""
    if set(rows.right.columns(forces).coefficients) != {0}:
        raise InputError("an effect takes a side force times a power of the speed; with held contacts it must not")
    for states in rows.extra_rates.columns(forces).coefficients.values():
        state = rows.motion[-rows.extra_rates.shape[0] :][next(states.iter_items())[0][0]]
        raise InputError(
            f"the rate of the state {str(state)!r} depends on a side force, of which held contacts know nothing; "
            "give its effect requires = ('tyre force',)"
        )


def _check_powers(rows: SymbolicPolynomial, names: Sequence[str]) -> None:
    for power in sorted(rows.coefficients.keys() - set(POWERS)):
        row = next(rows.coefficients[power].iter_items())[0][0]
        raise InputError(f"an effect makes {names[row]} depend on speed^{power}; equations hold v^-1 to v^2 only")


def _parameters(switches: Mapping[Expression, Expression], *matrices: Any) -> tuple[str, ...]:
    """Bicycle keys, then the effect parameters that occur, by name."""
    found = set().union(*(matrix.free_symbols for matrix in matrices))
    found |= set().union(*(sp.sympify(speed).free_symbols for speed in switches.values()))
    return (*UNITS, *sorted(str(symbol) for symbol in found if "." in str(symbol)))
