"""Equations of a bicycle that stands still with its front wheel in the air, for many bicycles at a time.

M q'' + C q' + (K + W) q = Q for q = [y, yaw, lean, joints...]: lateral displacement (m) of the rear frame at the rear
contact, its yaw and lean, the angles of all joints (rad). M, C and K are those of the model itself: the bodies, joints,
springs and dampers that its effects give to :class:`bicycle.equations.lateral.ModelBuilder`. W is the stiffness of the
weight, -g sum m d2z/dq2 (Meijaard et al. 2007, appendix B), without the load of a wheel that bears none. The rows and
columns of what is held are to be taken out.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bicycle.equations.evaluation import compile_expressions
from bicycle.equations.lateral import ModelBuilder
from bicycle.equations.symbolic_polynomial import SymbolicPolynomial
from bicycle.parameters import rigid_bodies
from bicycle.parameters.bicycle import UNITS
from tyre.ground.arrays import Array
from tyre.ground.door import library

sp = library("sympy")

FRAME = ("y", "yaw", "lean")
"""Coordinates of the rear frame."""
BODIES = {"wheel": "front wheel", "fork": "front frame", "frame": "rear frame", "rear wheel": "rear wheel"}
"""What a point may belong to, and the body of the model."""


@dataclass(frozen=True)
class HeldMatrices:
    """Numbers of k bicycles for the n :attr:`HeldFrame.coordinates`."""

    mass: Array  # (k, n, n)
    damping: Array  # (k, n, n)
    stiffness: Array  # (k, n, n), of the springs
    weight: Array  # (k, n, n), stiffness of the weight of an upright bicycle
    rows: Mapping[str, Array]  # key of BODIES -> (k, 3, n): displacement of a point (x, z) is (1, x, z) @ rows

    def displacement(self, body: str, x: Array, z: Array) -> Array:
        """Lateral displacement (k, n) of points ``x``, ``z`` (k,), m, of a ``body`` per coordinate."""
        point = np.stack(np.broadcast_arrays(np.ones_like(x), x, z), -1)
        return np.asarray(np.einsum("kp,kpn->kn", point, self.rows[body]))


class HeldFrame:
    """Matrices of all bicycles with some effects as functions of their parameters."""

    def __init__(self, effects: Sequence[type[Any]]) -> None:
        """Derive the equations of ``effects``: classes of those that add joints, springs or dampers."""
        builder = ModelBuilder()
        for effect in effects:
            effect.symbolic().apply(builder)
        joints, angles = builder.joints(), builder.coordinates()
        self.coordinates = (*FRAME[:2], *(coordinate.name for coordinate in angles))
        n = len(self.coordinates)
        symbols = [*builder.bicycle.values(), *_parameters(effects)]
        self.parameters = (*UNITS, *(str(symbol) for symbol in symbols[len(UNITS) :]))

        mass = rigid_bodies.mass_matrix(builder.bodies, joints)
        for coordinate, inertia in builder.extra_inertia:
            place = 2 + angles.index(coordinate)
            mass[place, place] += inertia
        weight = np.zeros((n, n), object)
        for body in builder.bodies:
            heights = rigid_bodies.height_hessian(joints, body.name, body.x, body.z)
            weight[2:, 2:] -= builder.gravity * body.mass * heights
        damping, stiffness = _springs(builder, n)
        x, z = sp.symbols("point_x point_z")
        tables = {"mass": mass, "damping": damping, "stiffness": stiffness, "weight": weight}
        for key, name in BODIES.items():
            row = rigid_bodies.displacement_row(joints, name, x, z)
            tables[key] = np.array([[_part(entry, place, x, z) for entry in row] for place in range(3)], object)
        self._shapes = {name: np.shape(table) for name, table in tables.items()}
        self._places = [(name, place) for name, table in tables.items() for place in np.argwhere(table != 0).tolist()]
        entries = [tables[name][tuple(place)] for name, place in self._places]
        self._function: Callable[..., Any] = compile_expressions(symbols, entries)

    def __call__(self, values: Mapping[str, Any]) -> HeldMatrices:
        """Evaluate the matrices at ``values`` () or (k,), SI, of every one of :attr:`parameters`."""
        numbers = [np.atleast_1d(np.asarray(values[name], float)) for name in self.parameters]
        count = max(len(number) for number in numbers)
        tables = {name: np.zeros((count, *shape)) for name, shape in self._shapes.items()}
        for (name, (row, column)), entry in zip(self._places, self._function(*numbers), strict=True):
            tables[name][:, row, column] = entry
        rows = {key: tables.pop(key) for key in BODIES}
        return HeldMatrices(**tables, rows=rows)


@cache
def held_equations(effects: tuple[type[Any], ...]) -> HeldFrame:
    """The equations of a set of effects: derived at the first call, then kept in memory."""
    return HeldFrame(effects)


def _parameters(effects: Sequence[type[Any]]) -> list[Any]:
    """Symbols of the parameters of ``effects``, named ``effect.parameter``."""
    names = (f"{e.identifier}.{entry}" for e in effects for p in e.parameters for entry in p.entries())
    return [sp.Symbol(name, real=True) for name in names]


def _springs(builder: ModelBuilder, n: int) -> tuple[Any, Any]:
    """Damping and stiffness (n, n) of the torques that act between joints."""
    angles = builder.coordinates()
    damping, stiffness = np.zeros((n, n), object), np.zeros((n, n), object)
    for coordinate, torque in builder.coordinate_forces:
        variables = [*(c.angle for c in angles), *(c.rate for c in angles)]
        slopes = SymbolicPolynomial.of_linear([torque], variables, builder.speed).constant
        place = 2 + angles.index(coordinate)
        for k in range(len(angles)):
            stiffness[place, 2 + k] -= slopes[0, k]
            damping[place, 2 + k] -= slopes[0, len(angles) + k]
    return damping, stiffness


def _part(entry: Any, place: int, x: Any, z: Any) -> Any:
    """Part of a displacement that does not depend on the point (``place`` 0), or its slope in x (1) or z (2)."""
    if place == 0:
        return sp.sympify(entry).subs({x: 0, z: 0})
    return sp.diff(sp.sympify(entry), (x, z)[place - 1])
