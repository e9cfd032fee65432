"""Units as laboratories print them, and their factors to SI (temperature stays in degrees Celsius)."""

import math
from dataclasses import dataclass

from tyre.base.errors import InputError, hint
from tyre.base.units import PASCAL_PER_BAR

_DEGREE = math.pi / 180.0
_POUND_FORCE = 4.4482216152605
_INCH = 0.0254
GRAVITY = 9.80665
"""Standard acceleration of gravity, m/s^2 (ISO 80000-3)."""

# quantity -> spelling -> factor to SI; spellings are compared after _plain(). Those in which small and capital letters
# differ by a factor of 1e9 (mN, MN; mNm, MNm) are left out on purpose.
_UNITS: dict[str, dict[str, float]] = {
    "angle": {"rad": 1.0, "radian": 1.0, "radians": 1.0, "mrad": 1e-3, "deg": _DEGREE, "degree": _DEGREE,
              "degrees": _DEGREE},
    "angular rate": {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": _DEGREE, "dps": _DEGREE, "rpm": math.pi / 30,
                     "1/min": math.pi / 30, "rev/min": math.pi / 30, "rev/s": 2 * math.pi},
    "angular acceleration": {"rad/s2": 1.0, "deg/s2": _DEGREE},
    "acceleration": {"m/s2": 1.0, "cm/s2": 1e-2, "mm/s2": 1e-3, "g": GRAVITY, "mg": 1e-3 * GRAVITY, "ft/s2": 0.3048},
    "force": {"n": 1.0, "newton": 1.0, "kn": 1e3, "dan": 10.0, "kgf": GRAVITY, "kp": GRAVITY, "lbf": _POUND_FORCE,
              "pound_force": _POUND_FORCE},
    "moment": {"nm": 1.0, "n-m": 1.0, "knm": 1e3, "ncm": 1e-2, "nmm": 1e-3, "lbfft": 12 * _INCH * _POUND_FORCE,
               "lbfin": _INCH * _POUND_FORCE, "kgfm": GRAVITY, "kgfcm": 1e-2 * GRAVITY, "kgfmm": 1e-3 * GRAVITY,
               "kpm": GRAVITY, "kpcm": 1e-2 * GRAVITY},
    "length": {"m": 1.0, "meter": 1.0, "metre": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "um": 1e-6, "inch": _INCH,
               "in": _INCH, "ft": 12 * _INCH},
    "pressure": {"pa": 1.0, "hpa": 1e2, "kpa": 1e3, "mpa": 1e6, "mbar": 1e2, "bar": PASCAL_PER_BAR,
                 "psi": _POUND_FORCE / _INCH**2, "atm": 101_325.0, "kgf/cm2": 1e4 * GRAVITY, "kp/cm2": 1e4 * GRAVITY},
    "speed": {"m/s": 1.0, "km/h": 1 / 3.6, "kmh": 1 / 3.6, "kph": 1 / 3.6, "mph": 0.44704, "mm/s": 1e-3, "cm/s": 1e-2,
              "ft/s": 0.3048},
    "time": {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "ns": 1e-9,
             "min": 60.0, "h": 3600.0},
    "temperature": {"c": 1.0, "degc": 1.0, "k": 1.0, "degf": 5 / 9, "f": 5 / 9},
}  # fmt: skip
QUANTITIES = tuple(_UNITS)
SI = dict(zip(QUANTITIES, ("rad", "rad/s", "rad/s^2", "m/s^2", "N", "N m", "m", "Pa", "m/s", "s", "degC"), strict=True))
"""Quantity -> the unit that channels are converted to."""

_TEMPERATURE_OFFSET = {"k": -273.15, "degf": -160 / 9, "f": -160 / 9}


@dataclass(frozen=True)
class Unit:
    """A unit: value in SI = ``factor`` * printed value + ``offset`` (the offset is for temperatures alone)."""

    factor: float
    offset: float = 0.0


def _plain(text: str) -> str:
    """Spelling without the typography in which labs differ: case, blanks, dots, degree sign, km_h for km/h."""
    plain = text.strip().strip("[]()").casefold().replace("°", "deg").replace("²", "2").replace("μ", "u")
    for sign in " .*·⋅^":
        plain = plain.replace(sign, "")
    plain = plain.replace("/sec", "/s").replace("degree/", "deg/").replace("degrees/", "deg/")
    return {"km_h": "km/h", "m_s": "m/s", "rad_s": "rad/s", "deg_s": "deg/s", "m_s2": "m/s2", "rads-1": "rad/s",
            "degs-1": "deg/s", "ms-2": "m/s2"}.get(plain, plain)  # fmt: skip


def find_unit(text: str, quantity: str, *, where: str) -> Unit:
    """Look up a printed unit of a known quantity.

    Parameters
    ----------
    text : str
        The unit as printed: ``deg``, ``kN``, ``km/h``, ``km_h`` (in column names), ``deg C`` ...
    quantity : str
        One of :data:`QUANTITIES`.
    where : str
        File and column, for the error message.

    Returns
    -------
    Unit
        Factor and offset to SI (temperature: degrees Celsius).

    Raises
    ------
    InputError
        When the unit is empty or is no unit of that quantity.
    """
    known = _UNITS[quantity]
    plain = _plain(text)
    if plain in known:
        return Unit(known[plain], _TEMPERATURE_OFFSET.get(plain, 0.0) if quantity == "temperature" else 0.0)
    problem = f"unit {text.strip()!r} is not a unit of {quantity}" if plain else f"no unit of {quantity} is given"
    raise InputError(f"{where}: {problem} (known: {', '.join(known)}){hint(plain, known)}")


def says_nothing(text: str) -> bool:
    """Whether what a file writes for a unit (``text``) is none: a dash, ``counts``."""
    return text.strip().casefold() in ("", "-", "1", "none", "n/a", "[]", "[-]", "counts", "raw", "unknown")


def quantity_of(text: str) -> str:
    """The quantity that a printed unit measures; empty where ``text`` is no unit known here.

    Parameters
    ----------
    text : str
        The unit as printed.
    """
    plain = _plain(text)
    return next((quantity for quantity, known in _UNITS.items() if plain in known), "")
