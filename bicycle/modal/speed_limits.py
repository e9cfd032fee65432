"""What can be computed with confidence: the speeds that are tracked, and how stiff a model may be.

All limits are in units of sqrt(g w) (a speed, about 3 m/s) and sqrt(g/w) (a rate, about 3 1/s), so that they mean the
same in any system of units.
"""

import math

import numpy as np

from bicycle.eigenvalues.solvers import lapack
from bicycle.linear_model import LinearModel
from bicycle.modal.naming import speed_unit
from tyre.base.arrays import Array
from tyre.base.errors import InputError

FASTEST_SPEED = 320.0  # of sqrt(g w), about 1000 m/s
SLOWEST_SPEED = 1e-4  # of sqrt(g w), about 0.3 mm/s: slip without relaxation divides by the speed
FASTEST_RATE = 1e8  # of sqrt(g/w): with roots faster than that, slow ones have no digits left
REFERENCE_SPEED = 1.5  # of sqrt(g w): stiffness is judged there


def check_trackable(model: LinearModel, speeds: Array, name: str = "speed", *, stiffness: bool = True) -> None:
    """Refuse speeds (m/s) so high or low, and models so stiff, that modes cannot be computed.

    Parameters
    ----------
    model : LinearModel
    speeds : ndarray, shape (m,)
        m/s.
    name : str, optional
        What the message calls them.
    stiffness : bool
        Whether the model is judged too; kernels see by themselves whether it is too stiff.

    Raises
    ------
    InputError
        Naming the first such speed and the range allowed, or the most extreme parameter of the model.
    """
    unit = speed_unit(model)
    low = SLOWEST_SPEED * unit if model.singular_at_rest else 0.0
    high = FASTEST_SPEED * unit
    bad = speeds[(speeds < low) | (speeds > high)]
    if bad.size:
        why = "; slip without relaxation is singular at rest" if low and bad[0] < low else ""
        raise InputError(
            f"{name} = {bad[0]:g} m/s is not allowed{why}: modes are tracked from {low:.3g} to {high:.0f} m/s "
            f"({FASTEST_SPEED:g} sqrt(g w)); give a {name} in this range"
        )
    if stiffness:
        _check_stiffness(model, REFERENCE_SPEED * unit)


def _check_stiffness(model: LinearModel, speed: float) -> None:
    most = FASTEST_RATE * math.sqrt(model.parameters["g"] / model.parameters["w"])
    try:
        with np.errstate(all="ignore"):
            fastest = float(np.abs(model.eigenvalues(speed, solver=lapack)).max(initial=0.0))  # one: not worth a kernel
    except (np.linalg.LinAlgError, ValueError):  # entries that are not finite
        fastest = math.inf
    if not fastest <= most:
        name, value = max(model.parameters.items(), key=lambda item: abs(math.log10(abs(item[1]) or 1.0)))
        raise InputError(
            f"the model is too stiff to be computed: its fastest root is {fastest:.3g} 1/s at {speed:.3g} m/s, at most "
            f"{most:.3g} 1/s is allowed; its most extreme parameter is {name} = {value:g}: give a value nearer to 1"
        )
