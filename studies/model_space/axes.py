"""Numbers of a model file that are run or varied: name, unit and how far each may go."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from bicycle.effects.effect_registry import effect_class
from bicycle.effects.sprung_joint import STAND_INS
from bicycle.model.model import Model
from bicycle.model.wheel_tyres import MOST_BAR
from bicycle.parameters.bicycle import ALIASES, BOUNDS, UNITS, UNUSED, canonical, of_kind
from bicycle.parameters.parameter_covariance import WHEELS, ParameterKey, entries_of
from tyre.ground.errors import InputError, unknown
from tyre.ground.number_with_unit import typed_number, typed_numbers

SPEED = "speed"
OF_THE_TYRE = {"pressure_bar": "bar", "load_N": "N"}
CONDITION_BOUNDS = {"speed_m_s": (0.0, math.inf), "pressure_bar": (0.0, MOST_BAR), "load_N": (0.0, math.inf)}
OTHER_UNITS = {SPEED: "m/s", "speed_m_s": "m/s", **OF_THE_TYRE}
Value = TypeVar("Value")


@dataclass(frozen=True)
class Axis:
    """A number that runs: its key, the unit of its values, and its lowest and highest possible value."""

    key: str  # parameter, condition of a tyre, or the speed
    unit: str  # as in tables; "1": a plain number
    wheels: tuple[str, ...] = ()  # of a tyre's condition the wheels that it is of; else empty
    bounds: tuple[float, float] = (-math.inf, math.inf)  # in ``unit``

    @property
    def condition(self) -> str:
        """``pressure_bar`` or ``load_N`` of a tyre's condition, else empty."""
        return ParameterKey.parse(self.key).name if self.wheels else ""

    @property
    def said(self) -> str:
        """``front_compliance.stiffness`` -> "front compliance stiffness"; of a contact law the parameter alone."""
        key = ParameterKey.parse(self.key)
        law = key.name in ("cornering_stiffness", "relaxation_length")
        parts = ("" if law else key.effect, key.name.removesuffix("_bar").removesuffix("_N"), key.wheel)
        return " ".join(dict.fromkeys(part for part in parts if part)).replace("_", " ")

    @property
    def title(self) -> str:
        """Name in figures, with the unit; a short key of the bicycle stays as it is."""
        short = len(self.key) <= 4 and "." not in self.key
        name = self.said if short else self.said[0].upper() + self.said[1:]
        return name if self.unit == "1" else f"{name}, {self.unit}"

    @property
    def column(self) -> str:
        """Name of a column with its values, the unit behind it."""
        unit = self.unit.replace("/", "_").replace(" ", "_").replace("^", "")
        name = self.key.replace(".", "_")
        return name if self.unit == "1" or name.endswith(f"_{unit}") else f"{name}_{unit}"


def effect_parameter(key: str) -> Any:
    """The declaration of ``effect.name[.wheel]``."""
    key_parts = ParameterKey.parse(key)
    by_name = {p.name: p for p in effect_class(key_parts.effect).parameters}
    if key_parts.name not in by_name:
        _refuse_stand_in(key_parts)
        raise InputError(unknown("parameter", key, [f"{key_parts.effect}.{name}" for name in by_name]))
    return by_name[key_parts.name]


def _refuse_stand_in(key: ParameterKey) -> None:
    """Refuse a damping ratio or a height above the hub, which a file may give but no command varies."""
    if key.effect and key.name in STAND_INS:
        _, names = STAND_INS[key.name]
        instead = " and ".join(f"{key.effect}.{name}" for name in names)
        raise InputError(f"{key} cannot be varied: it stands for {instead}; vary that")


def unit_of(key: str) -> str:
    """Unit of a parameter, the speed or a tyre's condition; empty for a name and what is no number of a model."""
    key_parts = ParameterKey.parse(key)
    return str(effect_parameter(key).unit) if key_parts.effect else {**UNITS, **OTHER_UNITS}.get(key_parts.name, "")


def bounds_of(model: Model, name: str) -> tuple[float, float]:
    """Physically possible values of a number, as bicycle, effect or the tyre's condition declare."""
    key = ParameterKey.parse(name)
    for effect in model.effects:
        for parameter in effect.parameters:
            if (effect.identifier, parameter.name) == (key.effect, key.name):
                return parameter.bounds
    return BOUNDS[name] if name in BOUNDS else CONDITION_BOUNDS[key.name]


def axis_keys(model: Model) -> list[str]:
    """Keys of a model that can be an axis, besides the speed and the condition of its tyres."""
    keys = dict.fromkeys(str(ParameterKey.parse(entry).whole) for entry in model.parameters)
    return [key for key in keys if key not in UNUSED]


def axis_of(model: Model, key: str) -> Axis:
    """The axis that a key stands for in a model; InputError if the model has no such number."""
    key = canonical(key)
    if key == SPEED:
        return Axis(SPEED, "m/s", (), (0.0, math.inf))
    key_parts = ParameterKey.parse(key)
    if key_parts.name in OF_THE_TYRE and not key_parts.effect:
        return Axis(
            key, unit_of(key), (key_parts.wheel,) if key_parts.wheel else WHEELS, CONDITION_BOUNDS[key_parts.name]
        )
    if not entries_of(key, set(model.parameters) - set(UNUSED)):
        _refuse_stand_in(key_parts)
        missing = key_parts.effect and key_parts.effect not in {effect.identifier for effect in model.effects}
        hint = (
            f"the model has no effect {key_parts.effect}: add [effects.{key_parts.effect}] to its file; "
            if missing
            else ""
        )
        raise InputError(hint + unknown("parameter", key, {SPEED, *OF_THE_TYRE, *ALIASES, *axis_keys(model)}))
    if key in model.tied:
        raise InputError(f"{key} was not given and equals {model.tied[key]} of the bicycle; give it a number first")
    return Axis(key, unit_of(key), (), bounds_of(model, key))


def typical_range(model: Model, axis: Axis) -> tuple[float, float]:
    """Usual values of an axis of the bicycle or of an effect, in its unit, as far as they are possible."""
    if axis.key in UNITS:
        base = model.parameters[axis.key]
        low, high = of_kind(model.bicycle.kind)[0][axis.key]
        span = 0.5 * abs(base) or 0.25 * (high - low)
        typical = base - span, base + span
    else:
        typical = effect_parameter(axis.key).usual_range(of_kind(model.bicycle.kind)[1])
    return max(typical[0], axis.bounds[0]), min(typical[1], axis.bounds[1])


def base_value(model: Model, axis: Axis, conditions: dict[str, float]) -> float:
    """Value in the model as it stands; NaN of the speed and where rear and front differ."""
    if axis.key == SPEED:
        return math.nan
    entries = entries_of(axis.key, model.parameters)
    values = [conditions[wheel] for wheel in axis.wheels] or [model.parameters[entry] for entry in entries]
    return values[0] if np.ptp(values) == 0 else math.nan


def numbers_by_name(
    texts: Sequence[str], option: str, like: str, what: str = "number", *, own_unit: bool = True
) -> dict[str, float]:
    """Numbers >= 0 from texts ``NAME=VALUE`` of an option, with an example and the kind of number for messages.

    They are in the unit of NAME where they are of its own kind, and may then have another unit behind them.
    """

    def checked(text: str, value: str) -> float:
        number = typed_number(value, unit_of(canonical(text.partition("=")[0])) if own_unit else "")
        if number < 0:
            raise InputError(f"{option} {text}: the {what} must be finite and >= 0")
        return number

    return _by_name(texts, option, f"NAME=VALUE, for example {option} {like} (SI units), finite", checked)


def ranges_by_name(texts: Sequence[str], option: str = "--limits") -> dict[str, tuple[float, float]]:
    """Ranges that rise from texts ``NAME=LOW:HIGH`` of an option."""

    def checked(text: str, value: str) -> tuple[float, float]:
        low, high = typed_numbers(value.split(":"), unit_of(canonical(text.partition("=")[0])))
        if low >= high:
            raise InputError(f"{option} {text}: the range must be finite, LOW below HIGH")
        return low, high

    return _by_name(texts, option, f"NAME=LOW:HIGH, for example {option} c=0.03:0.1", checked)


def _by_name(texts: Sequence[str], option: str, form: str, checked: Callable[[str, str], Value]) -> dict[str, Value]:
    numbers: dict[str, Value] = {}
    for text in texts:
        name, _, value = text.partition("=")
        name = canonical(name)
        try:
            number = checked(text, value)
        except InputError:
            raise
        except ValueError:
            raise InputError(f"{option} {text}: give {form}") from None
        if name in numbers:
            raise InputError(f"{option} {name} is given twice; keep one")
        numbers[name] = number
    return numbers
