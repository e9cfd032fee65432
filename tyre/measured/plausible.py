"""Slips of units are distinguished from unusual bicycles and tyres by the typical range of every parameter.

The bands of a tyre reach beyond the published values (Dell'Orto et al., tables 2 to 9, and the Schwalbe 28 x 1.75 of
mechmotum/bicycle-kickplate-model; see data/SOURCES.md): fat, cargo and hand-cycle tyres exist.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import GRAVITY

SMALLEST, LARGEST = 1e-12, 1e12
"""Sizes beyond which a number is none that was measured of a tyre, in any unit; what is made of them stays a number."""
ABSURD = 30.0
WAY_OUT = "allow_unusual"
"""Key at the top of a model or bicycle file that lets absurd values pass (with a warning)."""

PER_DEGREE = 180 / math.pi
SLIPS = MappingProxyType({
    "m": ((1e-3, "millimetres"), (1e-2, "centimetres")), "m^2": ((1e-4, "cm^2"), (1e-6, "mm^2")),
    "rad": ((1 / PER_DEGREE, "degrees"),), "kg": ((1e-3, "grams"),), "kg/m^3": ((1e3, "g/cm^3"),),
    "kg m^2": ((1e-4, "kg cm^2"), (1e-6, "kg mm^2"), (1e-7, "g cm^2"), (1e-9, "g mm^2")), "N/m": ((1e3, "N/mm"),),
    "m/s": ((1 / 3.6, "km/h"),), "m/s^2": ((1e-2, "cm/s^2"), (1e-3, "mm/s^2")), "1": ((1e-2, "per cent"),),
})  # fmt: skip
"""Unit -> what a value may have been given in, with the factor to the unit; those per radian also per degree."""
RARE_SLIPS = MappingProxyType({"m": ((0.0254, "inches"),), "m/s^2": ((0.3048, "ft/s^2"),)})
"""The same, where none of the others explains the value."""


@dataclass(frozen=True)
class Doubt:
    """A value ``key`` outside its typical range: the words, what may explain it, and if it is far beyond."""

    key: str  # name of the value in its file
    outside: str  # words: the value and its usual range
    why: str  # `` (millimetres?)``; empty where nothing explains it
    absurd: bool  # True if it is beyond the range by a factor of :data:`ABSURD`

    @property
    def text(self) -> str:
        """The whole line."""
        return self.outside + self.why

    @property
    def explained(self) -> bool:
        """True if a slip of units or of the sign explains it."""
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
    """Judge one value in ``unit``; None if it is typical, zero, infinite or usual."""
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
    """Name a unit in which a value would be typical, as `` (millimetres?)``, or a wrong sign; '' if none fits."""
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
    """Geometric mean of a range, or half the larger end of one that holds zero."""
    low, high = typical
    return math.sqrt(low * high) if low * high > 0 else max(abs(low), abs(high)) / 2


def refuse_absurd(doubts: Iterable[Doubt], *, where: str) -> None:
    """Refuse the first doubt that is far beyond its typical range; ``where`` is the file that may allow it."""
    for doubt in doubts:
        if doubt.absurd:
            raise InputError(
                f"{doubt.text}; give it in SI units, or write {WAY_OUT} = true at the top of the {where} if it is "
                "meant so"
            )


POUND = 0.45359237 * GRAVITY  # N in a pound-force


@dataclass(frozen=True)
class Band:
    """A quantity of a tyre and the values that are usual."""

    words: str  # its name in messages
    unit: str  # SI
    typical: tuple[float, float]  # lowest and highest usual value
    published: tuple[float, float]  # lowest and highest value of the sources
    # units that it may be in by mistake, beside :data:`SLIPS`, each with its factor to ``unit``
    slips: tuple[tuple[float, str], ...] = ()


_FORCES = (
    (1 / GRAVITY, "load in kg"), (GRAVITY, "lateral force in kg"), (1e-3, "load in kN"), (1e3, "lateral force in kN"),
    (1 / POUND, "load in lbf"), (POUND, "lateral force in lbf"),
)  # fmt: skip
_PULLS = (GRAVITY, "force in kg"), (POUND, "force in lbf"), (1e3, "N/mm or force in kN"), (1 / 25.4, "N/inch")
BANDS: Mapping[str, Band] = {
    "cornering_stiffness_per_load": Band("cornering stiffness over load", "1/rad", (4.0, 40.0), (10.2, 18.0), _FORCES),
    "lateral_stiffness": Band("lateral stiffness", "N/m", (8e3, 3e5), (31.6e3, 75.4e3), _PULLS),
    "relaxation_length": Band("relaxation length", "m", (0.015, 0.6), (0.061, 0.199)),
    "pneumatic_trail": Band("pneumatic trail", "m", (-0.02, 0.1), (0.012, 0.021)),
    # of sweeps whose slip reaches 1 to 15 degrees
    "largest_force_per_load": Band("largest lateral force over load", "N/N", (0.01, 1.8), (0.0, 1.2), _FORCES),
}


# quantities beside the stiffnesses that effects take from 0 on: their words and SI unit
NOT_NEGATIVE: Mapping[str, tuple[str, str]] = {
    "camber_stiffness": ("camber stiffness", "N/rad"), "pneumatic_trail": ("pneumatic trail", "m"),
    "twisting_stiffness": ("twisting stiffness", "N m/rad"),
    "overturning_stiffness": ("overturning stiffness", "N m/rad"),
}  # fmt: skip


def doubts(values: Mapping[str, float | None], *, at: str = "") -> tuple[Doubt, ...]:
    """Return a doubt for every unusual value of a tyre."""
    unusual = []
    for name, band in BANDS.items():
        value = values.get(name)
        if value is not None and np.isfinite(value):
            unusual_value = doubt(band.words + at, float(value), unit=band.unit, typical=band.typical, slips=band.slips)
            unusual += [unusual_value] if unusual_value else []
    return tuple(unusual)


def table_doubts(
    load: Array, values: Mapping[str, Array], *, where: str, places: Sequence[str] = ()
) -> tuple[str, ...]:
    """Return one note a quantity that is unusual at some of many conditions; refuse the impossible."""
    columns = {name: np.asarray(value, float) for name, value in values.items() if name in BANDS}
    if "cornering_stiffness" in values:
        columns["cornering_stiffness_per_load"] = np.asarray(values["cornering_stiffness"]) / load
    notes = []
    for name, column in columns.items():
        unusual = [
            (unusual_value, place)
            for place, (value, force) in enumerate(zip(column, load, strict=True))
            for unusual_value in doubts({name: float(value)}, at=f" at {force:g} N")
        ]
        for unusual_value, place in unusual:
            if unusual_value.absurd:
                row = f", {places[place]}" if len(places) else ""
                raise InputError(f"{where}{row}: {unusual_value.text}; no tyre has that, correct the value or its unit")
        if unusual:
            notes.append(f"{unusual[0][0].text}{_and_more(len(unusual))}")
    return tuple(notes)


def negative_quantities(load: Array, values: Mapping[str, Array]) -> tuple[str, ...]:
    """Return one note a quantity that is negative at some of many conditions, though no effect takes it so."""
    notes = []
    for name, (words, unit) in NOT_NEGATIVE.items():
        negative = np.flatnonzero(np.asarray(values.get(name, ())) < 0)
        if negative.size:
            value, force = np.asarray(values[name])[negative[0]], load[negative[0]]
            notes.append(
                f"{words} is negative, {value:.4g} {unit} at {force:g} N{_and_more(negative.size)}: no effect takes "
                "it; is its sign in the source that of the other quantities?"
            )
    return tuple(notes)


def _and_more(count: int) -> str:
    if count == 1:
        return ""
    return f" (and {count - 1} more condition{'s' if count > 2 else ''})"
