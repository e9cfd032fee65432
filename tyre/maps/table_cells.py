"""One cell of a measured tyre table: a number within what its column may hold."""

import math

from tyre.base.errors import InputError


def cell_value(where: str, column: str, cell: str, *, optional: bool) -> float:
    """The number of a cell.

    Parameters
    ----------
    where : str
        File and row, for messages.
    column : str
        Its name says what is allowed: standard deviations (``_sd_``) and degrees of freedom (``_dof``, infinite too)
        are positive, a correlation is from -1 to 1, other numbers are positive.
    cell : str
    optional : bool
        The cell may be empty, which is NaN, and the number of either sign.

    Raises
    ------
    InputError
        No number, or one that the column cannot hold.
    """
    if optional and not cell.strip():
        return math.nan
    try:
        value = float(cell)
    except ValueError as error:
        raise InputError(f"{where}: {column} is '{cell}', which is not a number.") from error
    if column.endswith("_dof"):
        good, allowed = value > 0, "> 0 (inf where the standard deviation is known well)"
    elif "_sd_" in column:
        good, allowed = math.isfinite(value) and value >= 0, "finite and >= 0"
    elif column.endswith("_correlation"):
        good, allowed = -1 <= value <= 1, "from -1 to 1"
    elif optional:
        good, allowed = math.isfinite(value), "finite, or empty where it was not measured"
    else:
        good, allowed = math.isfinite(value) and value > 0, "finite and > 0"
    if not good:
        raise InputError(f"{where}: {column} is {cell}; it must be {allowed}.")
    return value
