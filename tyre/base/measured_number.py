"""One number with its standard deviation and unit, in the notations in which measurements are written.

``0.375``, ``0.375 +/- 0.026``, ``0.375 ± 0.026``, ``0.375 ± 7 %``, ``0.375(26)`` (the digits in brackets are the last
ones of the number), ``0.375(0.026)``, ``(3.75 ± 0.26)e-1``, ``3.75(26)e-1``; a unit may follow, ``18.3(2) deg``.
One standard deviation is meant. Numbers are taken digit by digit: 1.020(3) has exactly the float 0.003.
"""

import math
import re
from dataclasses import dataclass
from fractions import Fraction

from tyre.base.errors import InputError
from tyre.base.unit_words import factor_to_si

_PLAIN = r"[+-]?(?:\d+\.?\d*|\.\d+)"
_EXPONENT = r"(?:[eE][+-]?\d+)"
_NUMBER = rf"{_PLAIN}{_EXPONENT}?"
_UNIT = r"(?P<unit>[A-Za-z°][\w°²^*/·. ]*)?"
_FORMS = tuple(
    re.compile(form + r"\s*" + _UNIT)
    for form in (
        rf"(?P<value>{_NUMBER})",
        rf"(?P<value>{_NUMBER})\s*±\s*(?P<sd>{_NUMBER})\s*(?P<percent>%)?",
        rf"\(\s*(?P<value>{_NUMBER})\s*±\s*(?P<sd>{_NUMBER})\s*\)(?P<power>{_EXPONENT})?",
        rf"(?P<value>{_PLAIN})\((?P<digits>\d+|\d*\.\d+)\)(?P<power>{_EXPONENT})?",
    )
)
NOTATIONS = "0.375, 0.375+/-0.026, 0.375(26) or 0.375 +/- 7 %"


@dataclass(frozen=True)
class MeasuredNumber:
    """A number in SI units and its standard deviation, None where none is written."""

    value: float
    sd: float | None = None


def measured_number(text: str, *, where: str, key: str, si: str = "", unit: str = "") -> MeasuredNumber:
    """Read one number.

    Parameters
    ----------
    text : str
        As written.
    where : str
        File and line, for the message.
    key : str
        What it is the value of.
    si : str
        Its SI unit, into which another one written behind it is converted; without, it must have none.
    unit : str
        The unit it is in where none is written behind it; by default ``si``.

    Returns
    -------
    MeasuredNumber

    Raises
    ------
    InputError
        Not one of the notations, a unit that does not fit, or a number too large for a float.
    """
    plain = text.strip().replace("−", "-").replace("+/-", "±").replace("+-", "±")
    match = next((found for form in _FORMS if (found := form.fullmatch(plain))), None)
    if match is None:
        raise InputError(f"{where}: {key} = {text.strip()[:60]!r} {_why_not(plain)}")
    parts = match.groupdict()
    power = Fraction(10) ** int((parts.get("power") or "e0")[1:])
    value = _fraction(parts["value"], where, key) * power
    sd: Fraction | None = None
    if parts.get("digits"):
        sd = Fraction(parts["digits"]) * power
        if "." not in parts["digits"]:
            sd /= 10 ** len(parts["value"].partition(".")[2])
    elif parts.get("sd"):
        sd = _fraction(parts["sd"], where, key) * power
        sd = sd * abs(value) / 100 if parts.get("percent") else sd
    if sd is not None and sd < 0:
        raise InputError(f"{where}: the standard deviation of {key} is {float(sd):g}; it must be >= 0")
    written = (parts.get("unit") or unit).strip()
    if written and not si:
        raise InputError(f"{where}: {key} = {text.strip()!r}: give the number without a unit")
    factor = factor_to_si(written, si, where=f"{where}, {key}") if written else Fraction(1)
    return MeasuredNumber(
        _float(value * factor, where, key, negative_zero=parts["value"].startswith("-")),
        None if sd is None else _float(sd * factor, where, key),
    )


def written(value: float, sd: float | None) -> str:
    """A number as ``value+/-sd``, which :func:`measured_number` reads back to the last digit.

    Parameters
    ----------
    value, sd : float
        In the same unit; None: no standard deviation is known.
    """
    return repr(float(value)) + ("" if sd is None else f"+/-{float(sd)!r}")


def _why_not(plain: str) -> str:
    if re.fullmatch(r"[+-]?\d+,\d+([±(].*)?", plain.replace(" ", "")):
        return "has a decimal comma; write a point"
    if "," in plain:
        return "holds several numbers; give their mean"
    if re.search(r"\d[eE][+-]?\d+\(", plain):
        return "has its exponent before the brackets; write 3.75(26)e-1"
    return f"is not a finite number; write for example {NOTATIONS}"


def _fraction(text: str, where: str, key: str) -> Fraction:
    if abs(int(text.lower().partition("e")[2] or 0)) > 400:  # an exact power that large is slow, and no float
        raise InputError(f"{where}: {key} = {text!r} is not a finite number")
    return Fraction(text)


def _float(number: Fraction, where: str, key: str, *, negative_zero: bool = False) -> float:
    try:
        found = float(number)
    except OverflowError:
        found = math.inf
    if math.isinf(found):
        raise InputError(f"{where}: {key} is not a finite number")
    return -0.0 if found == 0 and negative_zero else found
