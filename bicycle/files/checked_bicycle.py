"""A bicycle made of a file's numbers: refused where these are in other units than meant."""

from collections.abc import Iterable, Mapping
from typing import Any

from bicycle.parameters import TYPICAL, UNITS, Bicycle, doubts_about
from tyre.base.errors import InputError, is_number
from tyre.base.plausible import WAY_OUT, Doubt, refuse_absurd

LENGTHS = (("millimetres", "mm", 1e-3), ("centimetres", "cm", 1e-2), ("inches", "in", 0.0254))
SEVERAL = 3  # lengths in one other unit: not a slip of one of them
NAME_THE_UNIT = "write its unit behind the number (lam = 18.3 deg; TOML: in quotes) or in a table units (TOML, YAML)"


def checked_bicycle(
    name: str, values: Mapping[str, Any], sd: Mapping[str, Any] | None = None, *further: Any, where: str,
    allow_unusual: bool,
) -> Bicycle:  # fmt: skip
    """A bicycle whose numbers come from a file: in wrong units it is refused (``further`` as of :class:`Bicycle`).

    Parameters
    ----------
    name : str
    values, sd : mapping
        Meijaard's keys; SI, lam in rad.
    *further : object
        The remaining fields of :class:`Bicycle`, in their order.
    where : str
        What the message calls the file that may allow unusual values.
    allow_unusual : bool
        Take values far outside what bicycles have.
    """
    sd = sd or {}
    doubts = doubts_about(values)
    if not allow_unusual:
        _refuse_another_unit(values, doubts, where=where)
        refuse_absurd(doubts, where=where, remedy=NAME_THE_UNIT)
        for doubt in _spreads_in_doubt(sd, TYPICAL):
            raise InputError(
                f"{doubt}; {NAME_THE_UNIT}, or write {WAY_OUT} = true at the top of the {where} if it is meant so"
            )
    try:
        return Bicycle(name, values, sd, *further)
    except InputError as error:  # a centre of mass in cm is a wheel without load: name the cause too
        causes = [one.text for one in doubts if one.explained and f"{one.key} = " not in str(error)]
        remedy = [NAME_THE_UNIT] if any(one.explained for one in doubts) else []
        raise InputError("; ".join([str(error), *causes[:1], *remedy])) from error


def _refuse_another_unit(values: Mapping[str, Any], doubts: Iterable[Doubt], *, where: str) -> None:
    """Refuse a file whose doubtful lengths, and there are several, are all usual in one other unit."""
    lengths = [one for one in doubts if UNITS[one.key] == "m"]
    for word, unit, metres in LENGTHS if len(lengths) >= SEVERAL else ():
        usual = ((one.key, *TYPICAL[one.key]) for one in lengths)
        if all(low <= metres * values[key] <= high for key, low, high in usual):
            raise InputError(
                f'{lengths[0].outside} ({word}?); give it in SI units, write length = "{unit}" in a table units (TOML, '
                f"YAML), as {len(lengths)} lengths look like {word}, or write {WAY_OUT} = true at the top of the "
                f"{where} if it is meant so"
            )


def _spreads_in_doubt(sd: Mapping[str, Any], typical: Mapping[str, tuple[float, float]]) -> Iterable[str]:
    """Standard deviations that exceed the whole range of usual values: they are in another unit."""
    for key, spread in sd.items():
        low, high = typical.get(key, (0.0, float("inf")))
        if is_number(spread) and spread > high - low:
            guess = {"m": " (millimetres?)", "rad": " (degrees?)", "kg": " (grams?)"}.get(UNITS[key], "")
            yield (
                f"the standard deviation of {key} is {spread:g} {UNITS[key]}, more than its usual values "
                f"{low:g} .. {high:g} {UNITS[key]} differ{guess}"
            )
