"""An effect from flat numbers."""

from collections.abc import Collection, Mapping
from typing import Any

from bicycle.effect.base import Effect
from bicycle.effect.parameter import PerWheel


def effect_of(kind: type[Effect], values: Mapping[str, float], names: Collection[str] | None = None) -> Effect:
    """An effect from flat numbers.

    Parameters
    ----------
    kind : effect class
    values : mapping of str to float
        ``identifier.name[.wheel]`` -> number, SI; more of them do not matter.
    names : collection of str, optional
        Parameters to be given; the others take their defaults. All of them when not given.

    Raises
    ------
    InputError
        A number that the effect does not allow.
    """
    table: dict[str, Any] = {}
    for parameter in kind.parameters:
        if names is None or parameter.name in names:
            numbers = [float(values[f"{kind.identifier}.{entry}"]) for entry in parameter.entries()]
            table[parameter.name] = PerWheel(*numbers) if parameter.per_wheel else numbers[0]
    return kind(**table)
