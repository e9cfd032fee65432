"""A declared parameter of an effect, and values that differ between the wheels."""

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

from bicycle.parameter_key import WHEELS
from tyre.base.errors import InputError, is_number, shown
from tyre.base.plausible import Doubt, doubt, suspicion


@dataclass(frozen=True)
class Parameter:
    """A physical parameter of an effect, declared once as an attribute of its class: ``stiffness = Parameter(...)``.

    On the class the attribute is the declaration; in a model's effect it is the value, and inside ``apply`` a symbol.

    Attributes
    ----------
    unit, description : str
        SI unit (``1`` where there is none), one phrase.
    bounds : (float, float)
        Physically possible values, ends included; anything else is refused.
    typical : (float, float)
        Range that occurs on bicycles: sliders, sweeps and prior widths use it, and what lies outside is warned about.
    default : float or str, optional
        Value when none is given; a string names the bicycle parameter it equals. None: it must be given.
    neutral : float, optional
        Value at which the effect vanishes (may be infinite).
    least : float
        Smallest size that is worth a name in a diagnosis, as a distance from ``neutral``; of a stiffness whose effect
        vanishes at infinity (as slip does with the cornering stiffness), the one above which it does not matter. 0:
        any.
    per_wheel : bool
        One value for each wheel, written ``{rear = .., front = ..}`` or one number for both.
    name : str
        Key of model files: the attribute's name.
    tyre : str
        What of :class:`tyre.TyreProperties` it is: a model file takes it from its tyre with ``name = "tyre"``.
    tyre_beside : str
        Effect without which the tyre's value would not mean this parameter.
    without_cause : bool
        It stands for what is not known: ``typical`` scales its sliders and priors, and no size is doubted.
    """

    unit: str
    description: str
    _: KW_ONLY
    bounds: tuple[float, float]
    typical: tuple[float, float]
    default: float | str | None = None
    neutral: float | None = None
    least: float = 0.0
    per_wheel: bool = False
    tyre: str = ""
    tyre_beside: str = ""
    without_cause: bool = False
    name: str = field(default="", init=False)

    def __set_name__(self, owner: type, name: str) -> None:
        object.__setattr__(self, "name", name)

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        if instance is None:
            return self
        raise AttributeError(f"{type(instance).__name__}.{self.name} equals {self.default!r} of the bicycle")

    def check_ranges(self, identifier: str) -> None:
        """Refuse ranges that are none; ``identifier`` is the effect's, for the words of the InputError.

        Parameters
        ----------
        identifier : str
        """
        for what, pair in (("bounds", self.bounds), ("typical", self.typical)):
            if not (isinstance(pair, tuple) and len(pair) == 2 and all(map(is_number, pair)) and pair[0] < pair[1]):
                raise InputError(
                    f"effect {identifier!r}: {self.name}: {what} = {shown(pair)} must be two numbers (low, high)"
                )

    def entries(self) -> tuple[str, ...]:
        """``name``, or ``name.rear`` and ``name.front``."""
        return tuple(f"{self.name}.{wheel}" for wheel in WHEELS) if self.per_wheel else (self.name,)

    def doubt(self, key: str, value: float) -> Doubt | None:
        """Whether a value (SI), called ``key`` in the words, is outside ``typical``; defaults and neutral never are.

        Parameters
        ----------
        key : str
            What the words call the value.
        value : float
            In the parameter's unit.
        """
        if self.without_cause:
            return None
        return doubt(key, value, unit=self.unit, typical=self.typical, usual=(self.default, self.neutral))


@dataclass(frozen=True)
class PerWheel:
    """A rear and a front value; indexed by a wheel of the model or by ``rear`` / ``front``."""

    rear: Any
    front: Any

    def __getitem__(self, wheel: Any) -> Any:
        name = wheel if isinstance(wheel, str) else wheel.name
        return {"rear": self.rear, "front": self.front}[name]


PerWheelValue = float | Mapping[str, float] | PerWheel
"""What a parameter per wheel may be given as: one number for both wheels, or rear and front."""


def checked_numbers(parameter: Parameter, value: Any, identifier: str) -> dict[str, float]:
    """Numbers of a parameter by ``name[.wheel]``, rear first.

    Parameters
    ----------
    parameter : Parameter
    value : float, mapping or PerWheel
        As given, in the parameter's unit.
    identifier : str
        Of the effect, for the words of an error.

    Raises
    ------
    InputError
        Not a number, a table where one number is meant, a wheel that is missing, or a value out of bounds.
    """
    where = f"effect {identifier!r}: {parameter.name}"
    if parameter.per_wheel:
        if isinstance(value, PerWheel):
            value = {"rear": value.rear, "front": value.front}
        if not isinstance(value, Mapping):
            value = {"rear": value, "front": value}
        if set(value) != set(WHEELS):
            raise InputError(
                f"{where} has the keys {', '.join(map(str, value)) or 'none'}; give rear and front, or one number"
            )
        numbers = {f"{parameter.name}.{wheel}": value[wheel] for wheel in WHEELS}
    else:
        if isinstance(value, Mapping):
            raise InputError(f"{where} is one number for the bicycle, not a table of rear and front")
        numbers = {parameter.name: value}
    low, high = parameter.bounds
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    for key, number in numbers.items():
        if not is_number(number) or math.isnan(number):
            raise InputError(f"effect {identifier!r}: {key} = {shown(number)} must be a number{unit}")
        if not (low <= number <= high) or (math.isinf(number) and number != parameter.neutral):
            why = "" if math.isinf(number) else suspicion(number, unit=parameter.unit, typical=parameter.typical)
            raise InputError(
                f"effect {identifier!r}: {key} = {number:g}{unit} is outside {low:g} .. {high:g}{unit}{why}"
            )
    return {key: float(number) for key, number in numbers.items()}
