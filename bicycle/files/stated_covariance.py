"""What a model file states of the uncertainty of its numbers: ``[covariance]``, as a diagnosis writes it."""

from collections.abc import Mapping
from typing import Any

from bicycle.default_sd import MODEL_FILE
from bicycle.model import Model
from bicycle.parameter_covariance import ParameterCovariance, checked_covariance
from bicycle.parameters import UNUSED
from tyre.base import schema
from tyre.base.checks import anything, list_of, number, text
from tyre.base.errors import InputError, unknown

SECTION = "covariance"
TABLE = schema.table(
    {
        schema.needed("parameters"): list_of(text(), "must be a list of names of parameters", least=1),
        schema.needed("matrix"): anything,
    }
)


def stated_covariance(model: Model, given: Mapping[str, Any]) -> ParameterCovariance:
    """The covariance that a model file states.

    Parameters
    ----------
    model : Model
        Of the file.
    given : mapping
        The table: ``parameters``, keys of the bicycle or ``effect.name[.wheel]``, and ``matrix``, SI.

    Raises
    ------
    InputError
        A name that is no parameter, follows another or has a standard deviation already; a matrix that is no
        covariance; a measured tyre beside it, which has a covariance of its own.
    """
    content = schema.read(TABLE, given, section=SECTION)
    names = content["parameters"]
    row = list_of(number(), f"must be {len(names)} finite numbers", least=len(names), most=len(names))
    square = list_of(row, f"must be {len(names)} rows of as many numbers", least=len(names), most=len(names))
    rows = schema.read(square, content["matrix"], where=f"[{SECTION}]", section="matrix")
    known = {key for key in model.parameters if key not in UNUSED}
    for name in names:
        if name in model.tied:
            raise InputError(
                f"[{SECTION}]: {name} equals {model.tied[name]} of the bicycle and follows it; take it out"
            )
        if name not in known:
            raise InputError(f"[{SECTION}]: {unknown('parameter', name, known)}")
        if name in model.bicycle.sd:
            raise InputError(f"[{SECTION}]: the bicycle states an sd of {name} already; keep one of them")
    if model.sd:
        raise InputError(f"[{SECTION}]: a measured tyre brings a covariance of its own; give its numbers instead")
    try:
        return ParameterCovariance(tuple(names), checked_covariance(names, rows), origin=MODEL_FILE)
    except InputError as error:
        raise InputError(f"[{SECTION}]: {error}") from error
