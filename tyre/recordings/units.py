"""Units as rigs print them, and their factors to SI (temperature stays in degrees Celsius)."""

import math
from dataclasses import dataclass

from tyre.base.errors import InputError, hint
from tyre.base.units import PASCAL_PER_BAR

_DEGREE = math.pi / 180.0
_POUND_FORCE = 4.4482216152605
_INCH = 0.0254

# quantity -> spelling -> factor to SI; spellings are compared after _plain()
_UNITS: dict[str, dict[str, float]] = {
    "angle": {"rad": 1.0, "radian": 1.0, "radians": 1.0, "mrad": 1e-3, "deg": _DEGREE, "degree": _DEGREE,
              "degrees": _DEGREE},
    "force": {"n": 1.0, "newton": 1.0, "kn": 1e3, "lbf": _POUND_FORCE, "pound_force": _POUND_FORCE},
    "moment": {"nm": 1.0, "knm": 1e3, "nmm": 1e-3},
    "length": {"m": 1.0, "meter": 1.0, "metre": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "inch": _INCH, "in": _INCH},
    "pressure": {"pa": 1.0, "hpa": 1e2, "kpa": 1e3, "mpa": 1e6, "bar": PASCAL_PER_BAR, "psi": _POUND_FORCE / _INCH**2},
    "speed": {"m/s": 1.0, "km/h": 1 / 3.6, "kmh": 1 / 3.6, "kph": 1 / 3.6, "mph": 0.44704},
    "time": {"s": 1.0, "sec": 1.0, "second": 1.0, "ms": 1e-3, "min": 60.0},
    "temperature": {"c": 1.0, "degc": 1.0, "k": 1.0, "degf": 5 / 9, "f": 5 / 9},
}  # fmt: skip
_TEMPERATURE_OFFSET = {"k": -273.15, "degf": -160 / 9, "f": -160 / 9}


@dataclass(frozen=True)
class Unit:
    """A unit: value in SI = ``factor`` * printed value + ``offset`` (the offset is for temperatures alone)."""

    factor: float
    offset: float = 0.0


def _plain(text: str) -> str:
    """Spelling without the typography in which labs differ: case, blanks, dots, degree sign, km_h for km/h."""
    plain = text.strip().casefold().replace("°", "deg")
    for sign in " .*·":
        plain = plain.replace(sign, "")
    return {"km_h": "km/h", "m_s": "m/s"}.get(plain, plain)


def find_unit(text: str, quantity: str, *, where: str) -> Unit:
    """Look up a printed unit of a known quantity.

    Parameters
    ----------
    text : str
        The unit as printed: ``deg``, ``kN``, ``km/h``, ``km_h`` (in column names), ``deg C`` ...
    quantity : str
        ``angle``, ``force``, ``moment``, ``length``, ``pressure``, ``speed``, ``time`` or ``temperature``.
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
