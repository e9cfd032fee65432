"""Units as files and laboratories write them: one table of symbols and their exact factors to SI.

``factor_to_si`` reads products and powers (``kN/rad``, ``kg cm^2``), ``find_unit`` what laboratories print.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

from tyre.ground.errors import InputError, hint

PASCAL_PER_BAR = 1e5
GRAVITY = 9.80665
"""Standard acceleration of gravity, m/s^2 (ISO 80000-3)."""

_POUND_FORCE, _INCH, _GRAVITY = Fraction("4.4482216152605"), Fraction("0.0254"), Fraction("9.80665")
_PI = Fraction(math.pi)
_FORCE, _PRESSURE = (1, 1, -2, 0), (1, -1, -2, 0)

# symbol -> factor to SI, powers of (kg, m, s, rad); exact fractions, so that 1020 mm is 1.02 m to the last digit
SYMBOLS: dict[str, tuple[Fraction, tuple[int, int, int, int]]] = {
    "kg": (Fraction(1), (1, 0, 0, 0)),
    "g": (Fraction(1, 1000), (1, 0, 0, 0)),
    "lb": (Fraction("0.45359237"), (1, 0, 0, 0)),
    "m": (Fraction(1), (0, 1, 0, 0)),
    "cm": (Fraction(1, 100), (0, 1, 0, 0)),
    "mm": (Fraction(1, 1000), (0, 1, 0, 0)),
    "in": (_INCH, (0, 1, 0, 0)),
    "inch": (_INCH, (0, 1, 0, 0)),
    "ft": (12 * _INCH, (0, 1, 0, 0)),
    "s": (Fraction(1), (0, 0, 1, 0)),
    "ms": (Fraction(1, 1000), (0, 0, 1, 0)),
    "rad": (Fraction(1), (0, 0, 0, 1)),
    "mrad": (Fraction(1, 1000), (0, 0, 0, 1)),
    "deg": (_PI / 180, (0, 0, 0, 1)),
    "N": (Fraction(1), _FORCE),
    "kN": (Fraction(1000), _FORCE),
    "lbf": (_POUND_FORCE, _FORCE),
    "Pa": (Fraction(1), _PRESSURE),
    "hPa": (Fraction(100), _PRESSURE),
    "kPa": (Fraction(1000), _PRESSURE),
    "MPa": (Fraction(10**6), _PRESSURE),
    "bar": (Fraction(10**5), _PRESSURE),
    "psi": (_POUND_FORCE / _INCH**2, _PRESSURE),
}
# symbols that only laboratories' files hold: in names of columns of ours they could be other words
_PRINTED = SYMBOLS | {
    "km": (Fraction(1000), (0, 1, 0, 0)),
    "um": (Fraction(1, 10**6), (0, 1, 0, 0)),
    "us": (Fraction(1, 10**6), (0, 0, 1, 0)),
    "ns": (Fraction(1, 10**9), (0, 0, 1, 0)),
    "min": (Fraction(60), (0, 0, 1, 0)),
    "h": (Fraction(3600), (0, 0, 1, 0)),
    "d": (Fraction(86_400), (0, 0, 1, 0)),
    "rev": (2 * _PI, (0, 0, 0, 1)),
    "mph": (Fraction("0.44704"), (0, 1, -1, 0)),
    "gn": (_GRAVITY, (0, 1, -2, 0)),
    "mgn": (_GRAVITY / 1000, (0, 1, -2, 0)),
    "daN": (Fraction(10), _FORCE),
    "kgf": (_GRAVITY, _FORCE),
    "kp": (_GRAVITY, _FORCE),
    "mbar": (Fraction(100), _PRESSURE),
    "atm": (Fraction(101_325), _PRESSURE),
}
SPELLINGS = {
    "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "newton": "N", "meter": "m",
    "metre": "m", "metres": "m", "meters": "m", "millimetre": "mm", "millimeter": "mm", "kpa": "kPa",
    "PSI": "psi", "Bar": "bar",
}  # fmt: skip
# quantity -> SI unit, spellings (``spelling=unit`` if that is not itself a unit); compared without case and blanks.
# Left out on purpose: those in which small and capital letters differ by a factor of 1e9 (mN, MN; mNm, MNm)
_QUANTITIES: dict[str, tuple[str, str]] = {
    "angle": ("rad", "rad radian radians mrad deg degree degrees"),
    "angular rate": ("rad/s", "rad/s mrad/s deg/s dps=deg/s rpm=rev/min 1/min=rev/min rev/min rev/s"),
    "angular acceleration": ("rad/s^2", "rad/s^2 deg/s^2"),
    "acceleration": ("m/s^2", "m/s^2 cm/s^2 mm/s^2 g=gn mg=mgn ft/s^2"),
    "force": ("N", "N newton kN daN kgf kp lbf pound_force=lbf"),
    "moment": ("N m", "N*m n-m=N*m kN*m N*cm N*mm lbf*ft lbf*in kgf*m kgf*cm kgf*mm kp*m kp*cm"),
    "length": ("m", "m meter metre mm cm km um inch in ft"),
    "pressure": ("Pa", "Pa hPa kPa MPa mbar bar psi atm kgf/cm^2 kp/cm^2"),
    "speed": ("m/s", "m/s km/h kmh=km/h kph=km/h mph mm/s cm/s ft/s"),
    "time": ("s", "s sec=s second=s seconds=s ms msec=ms us ns min h d day=d days=d"),
    "temperature": ("degC", "c degC k degF f"),
}
SI = {quantity: si for quantity, (si, _) in _QUANTITIES.items()}
"""Quantity -> the unit that channels are converted to (temperature stays in degrees Celsius)."""

_EXAMPLES = {
    "m": "m, cm, mm, in", "rad": "rad, deg, mrad", "kg": "kg, g, lb", "kg m^2": "kg m^2, kg cm^2, g mm^2",
    "m/s^2": "m/s^2, cm/s^2", "N": "N, kN, lbf", "Pa": "Pa, kPa, bar, psi", "N/rad": "N/rad, N/deg, kN/rad",
    "N/m": "N/m, N/mm, kN/m", "N m/rad": "N m/rad, N m/deg", "N s/m": "N s/m",
}  # fmt: skip


@dataclass(frozen=True)
class Unit:
    """A unit: value in SI = ``factor`` * printed value + ``offset`` (the offset is for temperatures alone)."""

    factor: float
    offset: float = 0.0


def factor_to_si(unit: str, si: str, *, where: str) -> Fraction:
    """Find what a number in ``unit`` is multiplied by to be in the SI unit ``si``; another quantity is refused."""
    parsed, target = _parse_unit(unit), _parse_unit(si)
    assert target is not None
    if parsed is None or parsed[1] != target[1]:
        problem = "is not a unit that is known" if parsed is None else f"is no unit of what is given in {si}"
        powers = target[1]
        fitting = (words for name, words in _EXAMPLES.items() if (_parse_unit(name) or target)[1] == powers)
        allowed = next(fitting, si)
        raise InputError(f"{where}: {unit!r} {problem}; write for example {allowed}{hint(unit, allowed.split(', '))}")
    return parsed[0] / target[0]


def is_unit(text: str) -> bool:
    """True if ``text`` is a unit that is known, of whatever quantity."""
    return _parse_unit(text) is not None


def is_si(text: str) -> bool:
    """True if ``text`` is a known SI unit without prefixes: ``N m/rad``, ``kg``, ``1/s``, ``1`` for none."""
    if text == "1":
        return True
    parsed = _parse_unit(f"rad/{text[2:]}" if text.startswith("1/") else text)
    return parsed is not None and parsed[0] == 1


@cache
def _parse_unit(text: str, *, printed: bool = False) -> tuple[Fraction, tuple[int, ...]] | None:
    """Factor and powers of (kg, m, s, rad) of a unit; None if it is none."""
    symbols = _PRINTED if printed else SYMBOLS
    plain = text.strip().replace("_per_", "/").replace("²", "^2").replace("**", "^").replace("_", " ")
    factor, powers = Fraction(1), [0, 0, 0, 0]
    for place, product in enumerate(plain.split("/")):
        sign = -1 if place else 1
        parts = re.split(r"[\s*·.]+", product.strip().strip("()"))
        for part in parts:
            match = re.fullmatch(r"([A-Za-z°]+)(?:\^?(-?\d))?", part)
            word = SPELLINGS.get(match[1], match[1]) if match else ""
            if match is None or word not in symbols:
                return None
            power = sign * int(match[2] or 1)
            factor *= symbols[word][0] ** power
            powers = [have + power * exponent for have, exponent in zip(powers, symbols[word][1], strict=True)]
    return factor, tuple(powers)


def _plain_notation(text: str) -> str:
    """Spelling without the typography in which labs differ: case, blanks, dots, degree sign, km_h for km/h."""
    plain = text.strip().strip("[]()").casefold().replace("°", "deg").replace("²", "2").replace("μ", "u")
    for sign in " .*·⋅^":
        plain = plain.replace(sign, "")
    plain = plain.replace("/sec", "/s").replace("degree/", "deg/").replace("degrees/", "deg/")
    return {
        "km_h": "km/h",
        "m_s": "m/s",
        "rad_s": "rad/s",
        "deg_s": "deg/s",
        "m_s2": "m/s2",
        "rads-1": "rad/s",
        "degs-1": "deg/s",
        "ms-2": "m/s2",
    }.get(plain, plain)


@cache
def _spellings(quantity: str) -> dict[str, Unit]:
    """Unit of every spelling of a quantity."""
    units = {}
    for spelling in _QUANTITIES[quantity][1].split():
        name, _, unit = spelling.partition("=")
        if quantity == "temperature":
            celsius, kelvin, fahrenheit = Unit(1.0), Unit(1.0, -273.15), Unit(5 / 9, -160 / 9)
            units[_plain_notation(name)] = {"c": celsius, "degC": celsius, "k": kelvin}.get(name, fahrenheit)
        else:
            parsed = _parse_unit(unit or name, printed=True)
            assert parsed is not None
            units[_plain_notation(name)] = Unit(float(parsed[0]))
    return units


def find_unit(text: str, quantity: str, *, where: str) -> Unit:
    """Look up a printed unit (``deg``, ``kN``, ``km_h``, ``deg C``) of a quantity of :data:`SI`; refuse any other."""
    units = _spellings(quantity)
    plain = _plain_notation(text)
    if plain in units:
        return units[plain]
    problem = f"unit {text.strip()!r} is not a unit of {quantity}" if plain else f"no unit of {quantity} is given"
    raise InputError(f"{where}: {problem} (known: {', '.join(units)}){hint(plain, units)}")


def says_nothing(text: str) -> bool:
    """True if a file writes no unit: a dash, ``counts``."""
    return text.strip().casefold() in ("", "-", "1", "none", "n/a", "[]", "[-]", "counts", "raw", "unknown")


def quantity_of(text: str) -> str:
    """Name the quantity that a printed unit measures; empty for no unit known here."""
    plain = _plain_notation(text)
    return next((quantity for quantity in _QUANTITIES if plain in _spellings(quantity)), "")


def unit_in_name(name: str, quantities: Mapping[str, str], *, where: str) -> tuple[str, Unit] | None:
    """Split a column or key such as ``slip_angle_deg`` into its base name and unit; None for other base names."""
    for base in sorted(quantities, key=len, reverse=True):
        if name == base or name.startswith(base + "_"):
            return base, find_unit(name[len(base) + 1 :], quantities[base], where=f"{where}, {name!r}")
    return None
