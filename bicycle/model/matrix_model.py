"""A bicycle given by its canonical matrices: M q'' + v C1 q' + (g K0 + v^2 K2) q = f, q = (lean, steer).

Such matrices (Meijaard et al. 2007; JBike6 writes them) hold what wheels without slip need to know and no more: there
is no mass, wheel load or place on which a tyre or an effect could act.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.equations.declarations import Declarations, State
from bicycle.equations.evaluation import Matrices
from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.files.matrix_file import matrix_content
from bicycle.model.state_space import LinearModel, SpeedRange
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, is_number, refuse_unknown, shown

NAMES = ("M", "C1", "K0", "K2")
ALIASES = {"M0": "M"}
GRAVITY = 9.81  # m/s^2, where a file states none
WHEELBASE = (0.2, 5.0)  # m, of the matrices' own wheelbase over the cosine of the steer axis tilt
NOTE = "matrices M, C1, K0, K2 are of wheels that roll without slip; no tyre or effect can be put on them"


def read_matrices(path: str | Path) -> LinearModel:
    """Read the model of a file of canonical matrices.

    Parameters
    ----------
    path : str or Path
        TOML with ``M``, ``C1``, ``K0``, ``K2`` (two rows each, lean first, SI) and, if it is not 9.81, ``g``; or
        MATLAB assignments such as ``M0 = [80.8, 2.3; 2.3, 0.3];``. With ``g = 1`` K0 is the whole stiffness at rest.

    Raises
    ------
    InputError
        No such file, a matrix that is missing or is not one, or matrices that are not of a bicycle.
    """
    content = matrix_content(Path(path))
    values = {ALIASES.get(key, key): value for key, value in content.items()}
    keys = (*NAMES, "g", "description")
    if Path(path).suffix.lower() == ".toml":
        refuse_unknown("key", values, keys, where=str(path))
    unused = sorted(set(values) - set(keys))
    for name in NAMES:
        if name not in values:
            raise InputError(f"{path}: {name} is missing; give M, C1, K0 and K2, two rows of two numbers each")
    matrices = {name: _matrix(values[name], f"{path}: {name}") for name in NAMES}
    gravity = values.get("g", GRAVITY)
    if not is_number(gravity) or not gravity > 0:
        raise InputError(f"{path}: g = {shown(gravity)} must be a number above 0 (m/s^2; 1 if K0 holds it)")
    model = linear_model_of(matrices, float(gravity), where=str(path))
    return replace(model, warnings=(*model.warnings, f"not used: {', '.join(unused)}")) if unused else model


def linear_model_of(matrices: Mapping[str, Array], gravity: float, *, where: str) -> LinearModel:
    """Build the model of canonical ``matrices`` (2, 2), SI, by name, with ``gravity`` in m/s^2."""
    for name in ("M", "K0"):
        matrix = matrices[name]
        if abs(matrix[0, 1] - matrix[1, 0]) > 1e-6 * np.abs(matrix).max():
            raise InputError(f"{where}: {name} is not symmetric ({matrix[0, 1]:g} and {matrix[1, 0]:g}); check both")
    mass = matrices["M"]
    if np.linalg.eigvalsh(mass)[0] <= 0:
        raise InputError(f"{where}: M is not positive definite; check its four numbers (lean first, then steer)")
    wheelbase = _wheelbase(matrices, gravity, where)

    joint_rates, angles = slice(0, 2), slice(2, 4)  # of the states
    dynamics = {power: np.zeros((4, 4)) for power in (0, 1, 2)}
    dynamics[0][angles, joint_rates] = np.eye(2)
    dynamics[0][joint_rates, angles] = -gravity * matrices["K0"]
    dynamics[1][joint_rates, joint_rates] = -matrices["C1"]
    dynamics[2][joint_rates, angles] = -matrices["K2"]
    whole_mass = np.eye(4)
    whole_mass[joint_rates, joint_rates] = mass
    entry = np.zeros((4, 2))
    shown_states = np.eye(4)
    entry[joint_rates] = np.eye(2)
    unknown_loads = np.full(2, np.nan)
    at_all_speeds = Matrices(
        whole_mass,
        SpeedPolynomial(dynamics, shape=(4, 4)),
        SpeedPolynomial({0: entry}, shape=(4, 2)),
        SpeedPolynomial({0: shown_states}, shape=(4, 4)),
        SpeedPolynomial({}, shape=(4, 2)),
        unknown_loads,
    )
    roles = {"lean_rate": "lean", "steer_rate": "steer", "lean": "lean", "steer": "steer"}
    states = tuple(State(name, "rad/s" if name.endswith("_rate") else "rad", role) for name, role in roles.items())
    inputs = ("lean_torque", "steer_torque")
    units = {state.name: state.unit for state in states} | dict.fromkeys(inputs, "N m")
    return LinearModel(
        states=tuple(roles),
        inputs=inputs,
        outputs=tuple(roles),
        ranges=(SpeedRange(0.0, np.inf, at_all_speeds),),
        scale=np.ones(4),
        parameters={"g": GRAVITY, "w": wheelbase},
        static_loads=(np.nan, np.nan),
        warnings=(NOTE,),
        declared=Declarations(states, units=units),
    )


def _wheelbase(matrices: Mapping[str, Array], gravity: float, where: str) -> float:
    """Wheelbase over the cosine of the tilt (m), to which K0 and K2 belong; modes are named on its scale of speed."""
    weight, centrifugal = -gravity * matrices["K0"][0, 0], matrices["K2"][0, 1]
    wheelbase = weight / GRAVITY / centrifugal if centrifugal else np.inf
    low, high = WHEELBASE
    if not low < wheelbase < high:
        raise InputError(
            f"{where}: K0 and K2 belong to a wheelbase of {wheelbase:.3g} m (-g K0[1, 1] / 9.81 / K2[1, 2]); it must "
            f"be {low:g} to {high:g} m, so check signs and units, or give g = 1 if K0 holds g already"
        )
    return float(wheelbase)


def _matrix(rows: Any, where: str) -> Array:
    matrix_shown = f"{where} = {shown(rows)}"
    if not isinstance(rows, list) or [len(row) if isinstance(row, list) else 0 for row in rows] != [2, 2]:
        raise InputError(f"{matrix_shown} must be two rows of two numbers, lean first")
    for number in (number for row in rows for number in row):
        if not is_number(number) or not np.isfinite(number):
            raise InputError(f"{matrix_shown} holds {shown(number)}, which must be a finite number")
    return np.array(rows, float)
