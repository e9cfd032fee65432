"""Axis conventions of recordings, and the signs that bring each into adapted SAE.

===============  ==========================  ==========================  =========  =========
convention       axes                        slip angle                  camber     load
===============  ==========================  ==========================  =========  =========
``adapted SAE``  x forward, y right, z down  -vy/vx: force grows         > 0 right  > 0
``ISO``          x forward, y left, z up     vy/vx: the same slip        > 0 right  > 0
``SAE``          x forward, y right, z down  vy/vx: force falls          > 0 right  Fz < 0
===============  ==========================  ==========================  =========  =========

vx, vy: velocity of the contact centre in the axes of the row. ISO: ISO 8855, the W-axes of TYDEX and the sign
convention of .tir files; SAE: SAE J670e; adapted SAE: Pacejka, Tire and Vehicle Dynamics, 3rd ed., Appendix 1.
"""

from dataclasses import dataclass

from tyre.base.errors import InputError, hint


@dataclass(frozen=True)
class Signs:
    """Factors +1 or -1 between a convention and adapted SAE; they are their own inverse.

    ``lateral`` holds for side force and lateral displacement alike, since both point along y; ``vertical_force`` is
    the sign of the vertical force of a loaded tyre.
    """

    slip_angle: float
    lateral: float
    aligning_moment: float
    inclination: float
    vertical_force: float


_SIGNS = {
    "ISO": Signs(slip_angle=1.0, lateral=-1.0, aligning_moment=-1.0, inclination=1.0, vertical_force=1.0),
    "SAE": Signs(slip_angle=-1.0, lateral=1.0, aligning_moment=1.0, inclination=1.0, vertical_force=-1.0),
    "adapted SAE": Signs(slip_angle=1.0, lateral=1.0, aligning_moment=1.0, inclination=1.0, vertical_force=1.0),
}
CONVENTIONS = tuple(_SIGNS)


def signs(axes: str, *, where: str = "axes") -> Signs:
    """Signs of a declared convention.

    Parameters
    ----------
    axes : str
        ``ISO``, ``SAE`` or ``adapted SAE``.
    where : str
        File and key, for the error message.

    Returns
    -------
    Signs

    Raises
    ------
    InputError
        For any other name.
    """
    if axes in _SIGNS:
        return _SIGNS[axes]
    raise InputError(f"{where}: axes = {axes!r} is not one of {', '.join(CONVENTIONS)}{hint(axes, CONVENTIONS)}")


def slope_grows(axes: str) -> bool:
    """Whether the side force of a sound tyre grows with slip in the raw numbers of the convention ``axes``."""
    convention = signs(axes)
    return convention.slip_angle * convention.lateral > 0.0
