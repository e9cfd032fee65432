"""Numbers as a person types them: in the unit that is asked for, or with another of the same quantity behind them.

``80psi`` where bar are asked for, ``25 km/h`` for m/s, ``45kg`` for the load in N that it weighs.
"""

import re
from collections.abc import Sequence

from tyre.ground.errors import InputError, read_number
from tyre.ground.units import factor_to_si, find_unit, quantity_of

TYPED = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*((?![eE][+-]?\d)[A-Za-z°].*?)\s*", re.DOTALL)
WEIGHT = {"kg": "kgf", "lb": "lbf", "lbs": "lbf"}  # a mass typed as a load -> unit of its weight


def typed_number(text: str, unit: str) -> float:
    """Read one number into ``unit``; ValueError of what is none, InputError of a unit of something else."""
    numbers = typed_numbers([text], unit)
    if not numbers:
        raise ValueError(text)
    return numbers[0]


def typed_numbers(texts: Sequence[str], unit: str, *, alike: bool = True) -> list[float]:
    """Read numbers into ``unit``, each with its own unit, or all with that behind the last: 10, 20, 30 km/h.

    Numbers that are not ``alike``, such as coordinates, have a unit each or none: of 0.9, -80 cm the first may be in m.
    Empty if one of them is no number; InputError of a unit of something else.
    """
    parts = [TYPED.fullmatch(text) for text in texts]
    units = [part[2] if part else "" for part in parts]
    if any(units if not alike else units[:-1]) and not all(units):
        last = "the last number alone, or behind " if alike else ""
        raise InputError(f"{', '.join(texts)}: write the unit behind {last}each")
    if units and not any(units[:-1]):
        units = [units[-1]] * len(units)
    try:
        numbers = [read_number(part[1] if part else text) for part, text in zip(parts, texts, strict=True)]
    except ValueError:
        return []
    return [
        number * factor(behind, unit, where=text) if behind else number
        for number, behind, text in zip(numbers, units, texts, strict=True)
    ]


def factor(typed: str, unit: str, *, where: str) -> float:
    """What a number in the ``typed`` unit is multiplied by to be in ``unit``; InputError of another quantity."""
    if unit in ("", "1"):
        raise InputError(f"{where}: give the number without a unit")
    if typed.strip() == unit:
        return 1.0
    quantity = quantity_of(unit)
    if not quantity:
        return float(factor_to_si(typed, unit, where=where))
    if quantity == "force":
        typed = WEIGHT.get(typed.strip().casefold(), typed)
    return find_unit(typed, quantity, where=where).factor / find_unit(unit, quantity, where=where).factor
