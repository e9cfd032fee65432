"""Numbers with their standard deviation and unit, in the notations in which measurements are written.

``0.375``, ``0.375 +/- 0.026``, ``0.375 ± 7 %``, ``0.375(26)``, ``(3.75 ± 0.26)e-1``; a unit may follow: ``18(2) deg``.
Numbers are taken digit by digit: 1.020(3) has exactly the float 0.003.
"""

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from fractions import Fraction
from importlib.resources.abc import Traversable
from pathlib import Path

from tyre.ground.errors import InputError, shown, unknown
from tyre.ground.files import read_text
from tyre.ground.units import factor_to_si

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
# notations that are not read, and what is wrong with them
MISTAKES = (
    (r"[+-]?\d+,\d+([±(].*)?", "has a decimal comma; write a point"),
    (r".*,.*", "holds several numbers; give their mean"),
    (r".*\d[eE][+-]?\d+\(.*", "has its exponent before the brackets; write 3.75(26)e-1"),
)
LONGEST = 200  # characters of a number with its standard deviation and unit
NOTATIONS = "0.375, 0.375+/-0.026, 0.375(26) or 0.375 +/- 7 %"


@dataclass(frozen=True)
class MeasuredNumber:
    """A number in SI units and its standard deviation, None if none is written."""

    value: float  # SI
    sd: float | None = None  # SI, one standard deviation


def measured_number(text: str, *, where: str, key: str, si: str = "", unit: str = "") -> MeasuredNumber:
    """Read one number into the unit ``si``; ``unit`` is meant if none is written behind it."""
    if len(text) > LONGEST:
        raise InputError(f"{where}: {key} = {text.strip()[:20]!r}... has {len(text)} characters; give fewer digits")
    plain = text.strip().replace("−", "-").replace("+/-", "±").replace("+-", "±")
    match = next((candidate for form in _FORMS if (candidate := form.fullmatch(plain))), None)
    if match is None:
        otherwise = f"is not a finite number; write for example {NOTATIONS}"
        bare = plain.replace(" ", "")
        why = next((words for form, words in MISTAKES if re.fullmatch(form, bare, re.DOTALL)), otherwise)
        raise InputError(f"{where}: {key} = {text.strip()[:60]!r} {why}")
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


def number_text(value: float, sd: float | None) -> str:
    """Write a number as ``value+/-sd``, which :func:`measured_number` reads back to the last digit."""
    return repr(float(value)) + ("" if sd is None else f"+/-{float(sd)!r}")


def _fraction(text: str, where: str, key: str) -> Fraction:
    if abs(int(text.lower().partition("e")[2] or 0)) > 400:  # an exact power that large is slow, and no float
        raise InputError(f"{where}: {key} = {text!r} is not a finite number")
    return Fraction(text)


def _float(number: Fraction, where: str, key: str, *, negative_zero: bool = False) -> float:
    try:
        value = float(number)
    except OverflowError:
        value = math.inf
    if math.isinf(value):
        raise InputError(f"{where}: {key} is not a finite number")
    return -0.0 if value == 0 and negative_zero else value


def with_sd(value: float, sd: float, *, places: int = 3) -> str:
    """``-1.052 ± 0.031``: a ``value`` with its ``sd`` in any unit, with ``places`` or as many as show two digits."""
    places = max(places, 1 - math.floor(math.log10(sd))) if math.isfinite(sd) and sd > 0 else places
    return f"{value:.{places}f} ± {sd:.{places}f}"


LINE = re.compile(r"([^:=]*)([:=]?)(.*)")


def read_key_values(
    path: Path | Traversable, allowed: Collection[str], *, kind: str, others: bool = False
) -> tuple[dict[str, float], dict[str, float]]:
    """Read the numbers of a file and their sd by key (a ``kind``); ``others``: other lines are passed over."""
    values: dict[str, float] = {}
    sd: dict[str, float] = {}
    for where, key, text in key_value_lines(path, allowed if others else None):
        if key not in allowed:
            raise InputError(f"{where}: {unknown(kind, key, allowed)}")
        if key in values:
            raise InputError(f"{where}: {key} is given twice; keep one")
        number = measured_number(text, where=where, key=key)
        values[key] = number.value
        if number.sd is not None:
            sd[key] = number.sd
    return values, sd


def key_value_lines(path: Path | Traversable, only: Collection[str] | None = None) -> Iterator[tuple[str, str, str]]:
    """Give place, key and text of the value of every line, or of ``only`` some keys; # begins a comment."""
    for row, line in enumerate(read_text(path, fallback="latin-1").splitlines(), 1):
        text = (line.replace("%", "#") if path.name.endswith(".m") else line).partition("#")[0].strip()
        key, separator, value = (part.strip() for part in LINE.match(text).groups())  # type: ignore[union-attr]
        if not text or (only is not None and key not in only):
            continue
        where = f"{path}, line {row}"
        if not separator:
            raise InputError(f"{where}: {shown(text)} is no 'key : value'")
        yield where, key, value
