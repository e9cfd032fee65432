"""What is marked in a chart: the model as it stands, and tyres and pressures that were measured."""

import math
from dataclasses import dataclass

from bicycle.parameter_key import WHEELS, ParameterKey
from studies.model_axes.axis import Axis
from studies.model_axes.model_space import ModelSpace
from studies.stability_charts.plane import Plane
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.find_tyre import read_tyre
from tyre.maps.find_table import available_tyres
from tyre.properties import TyreProperties
from tyre.tyre_source import TyreSource, out_of_reach

MODEL, PRESSURE, LOAD, TYRE = "model", "measured pressure", "measured load", "measured tyre"
OF_A_TYRE = ("cornering_stiffness", "relaxation_length")
"""Parameters of contact laws that are properties of a tyre."""


@dataclass(frozen=True)
class Mark:
    """A point, or a line where one coordinate is NaN, in the units of the axes; ``kind`` begins with one above."""

    kind: str
    label: str
    x: float
    y: float


def marks(plane: Plane) -> list[Mark]:
    """Everything to be marked that lies within the ranges of a chart.

    Parameters
    ----------
    plane : Plane
    """
    space, base = plane.space, plane.space.base.tolist()
    found = [Mark(MODEL, "the model as it stands", *base)]
    for i, axis in enumerate(space.axes):
        for kind, label, value in _conditions(space, axis):
            found.append(_placed(kind, label, i, value, base[1 - i]))
    found += _tyres(space, base)
    return [mark for mark in dict.fromkeys(found) if _shown(plane, mark)]


def _placed(kind: str, label: str, i: int, value: float, other: float) -> Mark:
    return Mark(kind, label, value, other) if i == 0 else Mark(kind, label, other, value)


def _shown(plane: Plane, mark: Mark) -> bool:
    given = [(span, value) for span, value in zip(plane.spans, (mark.x, mark.y), strict=True) if not math.isnan(value)]
    return bool(given) and all(span.low <= value <= span.high for span, value in given)


def _conditions(space: ModelSpace, axis: Axis) -> list[tuple[str, str, float]]:
    """Kind, label and value of the conditions at which the tyres of an axis were measured."""
    if not axis.wheels or space.tyres is None:
        return []
    found = []
    for source in {space.tyres.sources[wheel].label: space.tyres.sources[wheel] for wheel in axis.wheels}.values():
        if source.synthetic:
            continue
        if axis.condition == "pressure_bar":
            found += [(PRESSURE, f"{source.tyre} {p / PASCAL_PER_BAR:g} bar", p / PASCAL_PER_BAR)
                      for p in source.pressures.tolist()]  # fmt: skip
        else:
            found += [(LOAD, f"{source.tyre} {n:g} N", n) for n in source.loads.tolist()]
    return found


def _tyres(space: ModelSpace, base: list[float]) -> list[Mark]:
    """Packaged and named tyres at the wheel load of an axis that is one of their properties."""
    keys = [ParameterKey.parse(axis.key) for axis in space.axes]
    own = [key.name if key.effect and key.name in OF_A_TYRE else "" for key in keys]
    if not any(own) or (all(own) and keys[0].wheel != keys[1].wheel):
        return []
    wheel = next(key.wheel for key, name in zip(keys, own, strict=True) if name) or WHEELS[1]
    load = dict(zip(WHEELS, space.model.bicycle.static_loads, strict=True))[wheel]
    found = []
    for source in _sources(space):
        for pressure in source.pressures.tolist():
            if source.synthetic or out_of_reach(source, load=load, pressure=pressure):
                continue
            held = source.at(load=load, pressure=pressure)
            place = [_value(held, name, value) for name, value in zip(own, base, strict=True)]
            if place[0] is not None and place[1] is not None:
                label = f"{source.tyre} {pressure / PASCAL_PER_BAR:g} bar"
                found.append(Mark(f"{TYRE}, {wheel} wheel's load", label, place[0], place[1]))
    return found


def _value(held: TyreProperties, name: str, other: float) -> float | None:
    value = getattr(held, name) if name else other
    return None if value is None or (name and math.isnan(value)) else float(value)


def _sources(space: ModelSpace) -> list[TyreSource]:
    sources = [] if space.tyres is None else list(space.tyres.sources.values())
    for name in available_tyres():
        try:
            sources.append(read_tyre(name, surface="flat"))
        except InputError:  # not measured on a flat surface
            continue
    return list({source.label: source for source in sources}.values())
