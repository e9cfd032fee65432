"""Units in words, such as ``mm``, ``N/deg``, ``kN/rad`` or ``kg cm^2``: their factor to the SI unit that is meant."""

import math
import re
from fractions import Fraction
from functools import cache

from tyre.base.errors import InputError, hint

_POUND_FORCE, _INCH = Fraction("4.4482216152605"), Fraction("0.0254")
_DEGREE = Fraction(math.pi) / 180

# symbol -> factor to SI, powers of (kg, m, s, rad); exact fractions, so that 1020 mm is 1.02 m to the last digit
SYMBOLS: dict[str, tuple[Fraction, tuple[int, int, int, int]]] = {
    "kg": (Fraction(1), (1, 0, 0, 0)), "g": (Fraction(1, 1000), (1, 0, 0, 0)),
    "lb": (Fraction("0.45359237"), (1, 0, 0, 0)),
    "m": (Fraction(1), (0, 1, 0, 0)), "cm": (Fraction(1, 100), (0, 1, 0, 0)), "mm": (Fraction(1, 1000), (0, 1, 0, 0)),
    "in": (_INCH, (0, 1, 0, 0)), "inch": (_INCH, (0, 1, 0, 0)), "ft": (12 * _INCH, (0, 1, 0, 0)),
    "s": (Fraction(1), (0, 0, 1, 0)), "ms": (Fraction(1, 1000), (0, 0, 1, 0)),
    "rad": (Fraction(1), (0, 0, 0, 1)), "mrad": (Fraction(1, 1000), (0, 0, 0, 1)), "deg": (_DEGREE, (0, 0, 0, 1)),
    "N": (Fraction(1), (1, 1, -2, 0)), "kN": (Fraction(1000), (1, 1, -2, 0)), "lbf": (_POUND_FORCE, (1, 1, -2, 0)),
    "Pa": (Fraction(1), (1, -1, -2, 0)), "hPa": (Fraction(100), (1, -1, -2, 0)),
    "kPa": (Fraction(1000), (1, -1, -2, 0)), "MPa": (Fraction(10**6), (1, -1, -2, 0)),
    "bar": (Fraction(10**5), (1, -1, -2, 0)), "psi": (_POUND_FORCE / _INCH**2, (1, -1, -2, 0)),
}  # fmt: skip
SPELLINGS = {
    "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "newton": "N", "meter": "m",
    "metre": "m", "metres": "m", "meters": "m", "millimetre": "mm", "millimeter": "mm", "kpa": "kPa",
    "PSI": "psi", "Bar": "bar",
}  # fmt: skip
_PART = re.compile(r"([A-Za-z°]+)(?:\^?(-?\d))?")
_EXAMPLES = {
    "m": "m, cm, mm, in", "rad": "rad, deg, mrad", "kg": "kg, g, lb", "kg m^2": "kg m^2, kg cm^2, g mm^2",
    "m/s^2": "m/s^2, cm/s^2", "N": "N, kN, lbf", "Pa": "Pa, kPa, bar, psi", "N/rad": "N/rad, N/deg, kN/rad",
    "N/m": "N/m, N/mm, kN/m", "N m/rad": "N m/rad, N m/deg", "N s/m": "N s/m",
}  # fmt: skip


def factor_to_si(unit: str, si: str, *, where: str) -> Fraction:
    """What a number in ``unit`` is multiplied by to be in the SI unit ``si``.

    Parameters
    ----------
    unit : str
        As written: ``N/deg``, ``kN/rad``, ``kg*cm^2``, ``N_per_mm`` (in names of columns).
    si : str
        Unit of the quantity: ``N/rad``.
    where : str
        File and place, for the message.

    Returns
    -------
    Fraction

    Raises
    ------
    InputError
        No unit that is known, or one of another quantity.
    """
    found = _parsed(unit)
    target = _parsed(si)
    assert target is not None
    if found is None or found[1] != target[1]:
        problem = "is not a unit that is known" if found is None else f"is no unit of what is given in {si}"
        allowed = next((words for one, words in _EXAMPLES.items() if _parsed(one)[1:] == target[1:]), si)  # type: ignore[index]
        raise InputError(f"{where}: {unit!r} {problem}; write for example {allowed}{hint(unit, allowed.split(', '))}")
    return found[0] / target[0]


def is_unit(text: str) -> bool:
    """Whether ``text`` is a unit that is known, of whatever quantity."""
    return _parsed(text) is not None


def is_si(text: str) -> bool:
    """Whether ``text`` is an SI unit that is known, without prefixes: ``N m/rad``, ``kg``, ``1/s``, ``1`` for none."""
    if text == "1":
        return True
    found = _parsed(f"rad/{text[2:]}" if text.startswith("1/") else text)
    return found is not None and found[0] == 1


@cache
def _parsed(text: str) -> tuple[Fraction, tuple[int, ...]] | None:
    """Factor and powers of (kg, m, s, rad) of a unit; None where it is none."""
    plain = text.strip().replace("_per_", "/").replace("²", "^2").replace("**", "^").replace("_", " ")
    factor, powers = Fraction(1), [0, 0, 0, 0]
    for place, product in enumerate(plain.split("/")):
        sign, parts = (-1 if place else 1), re.split(r"[\s*·.]+", product.strip().strip("()"))
        for part in parts:
            match = _PART.fullmatch(part)
            if match is None:
                return None
            word = SPELLINGS.get(match[1], match[1])
            if word not in SYMBOLS:
                return None
            power = sign * int(match[2] or 1)
            factor *= SYMBOLS[word][0] ** power
            powers = [have + power * one for have, one in zip(powers, SYMBOLS[word][1], strict=True)]
    return factor, tuple(powers)
