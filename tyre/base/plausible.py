"""Whether a number can be meant as it is written: a slip of units is told from an unusual bicycle.

Every parameter declares a ``typical`` range. Outside of it a value is doubted, with the unit it may have been given in.
More than a factor of :data:`ABSURD` beyond it, it is refused where numbers enter from files and commands: a millimetre
for a metre is a factor of 1000, a degree for a radian 57. Zero and infinity say that something is absent or rigid; no
slip of units makes them, so they are never doubted.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from tyre.base.errors import InputError

SMALLEST, LARGEST = 1e-12, 1e12
"""Sizes beyond which a number is none that was measured of a tyre, in any unit; what is made of them stays a number."""
ABSURD = 30.0
WAY_OUT = "allow_unusual"
"""Key at the top of a model or bicycle file that lets absurd values pass (with a warning)."""

PER_DEGREE = 180 / math.pi
SLIPS = MappingProxyType(
    {
        "m": ((1e-3, "millimetres"), (1e-2, "centimetres")),
        "m^2": ((1e-4, "cm^2"), (1e-6, "mm^2")),
        "rad": ((1 / PER_DEGREE, "degrees"),),
        "kg": ((1e-3, "grams"),),
        "kg m^2": ((1e-4, "kg cm^2"), (1e-6, "kg mm^2"), (1e-7, "g cm^2"), (1e-9, "g mm^2")),
        "kg/m^3": ((1e3, "g/cm^3"),),
        "m/s": ((1 / 3.6, "km/h"),),
        "m/s^2": ((1e-2, "cm/s^2"), (1e-3, "mm/s^2")),
        "N/m": ((1e3, "N/mm"),),
        "1": ((1e-2, "per cent"),),
    }
)
"""Unit -> what a value may have been given in, with the factor to the unit; those per radian also per degree."""
RARE_SLIPS = MappingProxyType({"m": ((0.0254, "inches"),), "m/s^2": ((0.3048, "ft/s^2"),)})
"""The same, where none of the others explains the value."""


@dataclass(frozen=True)
class Doubt:
    """A value ``key`` outside its typical range: what says so, what may explain it, and whether it is far beyond."""

    key: str
    outside: str
    why: str  # `` (millimetres?)``; empty where nothing explains it
    absurd: bool

    @property
    def text(self) -> str:
        """The whole line."""
        return self.outside + self.why

    @property
    def explained(self) -> bool:
        """Whether a slip of units or of the sign explains it."""
        return bool(self.why)


def doubt(
    key: str,
    value: float,
    *,
    unit: str,
    typical: tuple[float, float],
    usual: Sequence[object] = (),
    slips: Sequence[tuple[float, str]] = (),
) -> Doubt | None:
    """Judge one value; None where it is typical, zero, infinite or usual.

    Parameters
    ----------
    key : str
        Its name in the message.
    value : float
        In ``unit``.
    unit : str
        SI, as parameters declare it; ``1`` for none.
    typical : tuple of float
        Lowest and highest usual value, in ``unit``.
    usual : sequence
        Further values that are never doubted: defaults, neutral values.
    slips : sequence of (float, str)
        Further units it may be in, each with the factor to ``unit``.
    """
    if value in (0.0, *usual) or not math.isfinite(value):
        return None
    low, high = typical if typical[1] > 0 else (-typical[1], -typical[0])
    size = value if typical[1] > 0 else -value
    if low * (1 - 1e-9 * math.copysign(1, low)) <= size <= high * (1 + 1e-9):
        return None
    why = suspicion(value, unit=unit, typical=typical, further=slips)
    far = abs(size) > ABSURD * max(abs(low), high) or (low > 0 and abs(size) < low / ABSURD)
    name = "" if unit == "1" else f" {unit}"
    outside = f"{key} = {value:g}{name} is {'far ' * far}outside the usual {typical[0]:g} .. {typical[1]:g}{name}"
    return Doubt(key, outside, why, far)


def suspicion(
    value: float, *, unit: str, typical: tuple[float, float], further: Sequence[tuple[float, str]] = ()
) -> str:
    """A unit in which a value would be typical, as `` (millimetres?)``, or a wrong sign; empty where none fits.

    Parameters
    ----------
    value : float
        In ``unit``.
    unit : str
        SI, as parameters declare it.
    typical : tuple of float
        Lowest and highest usual value, in ``unit``.
    further : sequence of (float, str)
        Units of this value alone, each with the factor to ``unit``; considered where the usual ones do not explain it.
    """
    if typical[0] <= -value <= typical[1] and not typical[0] <= value <= typical[1]:
        return " (wrong sign?)"
    twice = (1 / PER_DEGREE, "converted from degrees twice")
    per_degree = ((PER_DEGREE, unit.replace("/rad", "/deg")), twice) if unit.endswith("/rad") else ()
    low, high = typical
    for slips in ((*SLIPS.get(unit, ()), *per_degree), (*RARE_SLIPS.get(unit, ()), *further)):
        fitting = [(factor * value, word) for factor, word in slips if low <= factor * value <= high]
        if fitting:
            _, word = min(fitting, key=lambda pair: abs(math.log(abs(pair[0]) / _middle(typical))))
            return f" ({word}?)"
    return ""


def _middle(typical: tuple[float, float]) -> float:
    """A size that stands for the range: the geometric mean, or half the larger end where the range holds zero."""
    low, high = typical
    return math.sqrt(low * high) if low * high > 0 else max(abs(low), abs(high)) / 2


def refuse_absurd(doubts: Iterable[Doubt], *, where: str, remedy: str = "") -> None:
    """Refuse the first of ``doubts`` that is far beyond its typical range; ``where`` is the file that may allow it.

    Parameters
    ----------
    doubts : iterable of Doubt
    where : str
        ``model file``.
    remedy : str
        A further way out, for the message.

    Raises
    ------
    InputError
        Naming key, value, range, the unit it may be in, and the way out.
    """
    others = f"{remedy}, " if remedy else ""
    for found in doubts:
        if found.absurd:
            raise InputError(
                f"{found.text}; give it in SI units, {others}or write {WAY_OUT} = true at the top of the {where} "
                "if it is meant so"
            )
