"""Units in the names of columns and keys: ``slip_angle_deg``."""

from tyre.channels.units import Unit, find_unit


def split_unit(name: str, quantities: dict[str, str], *, where: str) -> tuple[str, Unit] | None:
    """Split a column or key such as ``slip_angle_deg`` into its base name and unit.

    Parameters
    ----------
    name : str
        Column name or sidecar key.
    quantities : dict of str to str
        Base names and their quantity, for example ``{"slip_angle": "angle"}``.
    where : str
        File, for the error message.

    Returns
    -------
    tuple of str and Unit, or None
        None when no base name fits.

    Raises
    ------
    InputError
        When the base is known but its unit is missing or unknown.
    """
    for base in sorted(quantities, key=len, reverse=True):
        if name == base or name.startswith(base + "_"):
            return base, find_unit(name[len(base) + 1 :], quantities[base], where=f"{where}, {name!r}")
    return None
