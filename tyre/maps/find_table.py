"""The measured tables there are, and one of them by its tyre and surface."""

from importlib.resources.abc import Traversable

from tyre.base.errors import InputError, nearest
from tyre.maps.table_io import read_folder
from tyre.maps.tables import MeasuredTable, common_lateral_stiffness


def available_tyres(folder: Traversable | None = None) -> dict[str, tuple[str, ...]]:
    """Return the surfaces measured for each tyre of the packaged data, or of another folder of tyre tables.

    Parameters
    ----------
    folder : path, optional
        Default: the packaged tyres.

    Raises
    ------
    InputError
        A table of the folder that cannot be read.
    """
    surfaces: dict[str, tuple[str, ...]] = {}
    for table in read_folder(folder):
        surfaces[table.tyre] = (*surfaces.get(table.tyre, ()), table.surface)
    return {tyre: tuple(sorted(measured, reverse=True)) for tyre, measured in sorted(surfaces.items())}


def find_table(tyre: str, *, surface: str, folder: Traversable | None = None) -> MeasuredTable:
    """Return the table of a tyre on a surface, checked against those it shares pull tests with.

    Parameters
    ----------
    tyre, surface : str
        Name of the tyre; ``flat`` or ``drum``.
    folder : path, optional
        Default: the packaged tyres.

    Raises
    ------
    InputError
        No such tyre, or not measured on this surface; the message lists what there is.
    """
    tables = read_folder(folder)
    mine = [table for table in tables if table.tyre == tyre]
    if not mine:
        names = sorted({table.tyre for table in tables})
        near = nearest(tyre, names)
        hint = f" (did you mean '{near}'?)" if near else ""
        raise InputError(f"no tyre '{tyre}'{hint}; available are {', '.join(names) or 'none'}.")
    chosen = [table for table in mine if table.surface == surface]
    if not chosen:
        known = ", ".join(sorted((table.surface for table in mine), reverse=True))
        raise InputError(f"{tyre} was not measured on surface '{surface}', only on: {known}.")
    if len(chosen) > 1:
        raise InputError(f"{chosen[0].label} is defined by {len(chosen)} files; keep one.")
    across = [table for table in mine if "surface" in table.lateral_stiffness_shared_over]
    common_lateral_stiffness(across if chosen[0] in across else chosen)
    return chosen[0]
