"""What effects that add a mass have in common: both wheels must stay on the ground."""

from collections.abc import Mapping

from bicycle.parameters import bodies
from tyre.base.errors import InputError


def check_wheel_loads(identifier: str, bicycle: Mapping[str, float], *, mass: float, x: float) -> None:
    """Refuse a mass that lifts a wheel at rest.

    Parameters
    ----------
    identifier : str
        Of the effect, for the words of the error.
    bicycle : mapping of str to float
        Its parameters, SI.
    mass : float
        kg.
    x : float
        Of its centre, m ahead of the rear contact.

    Raises
    ------
    InputError
        A wheel would bear no load.
    """
    parts = bodies(bicycle)
    front = sum(body.mass * body.x for body in parts) + mass * x
    rear = (sum(body.mass for body in parts) + mass) * bicycle["w"] - front
    for wheel, moment, word in (("rear", rear, "less"), ("front", front, "more")):
        if moment <= 0:
            raise InputError(
                f"effect {identifier!r}: {mass:g} kg at x = {x:g} m lift the {wheel} wheel; give less mass or {word} x"
            )
