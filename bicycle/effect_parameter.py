"""A declared parameter of an effect, and values that differ between the wheels."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bicycle.parameter_key import WHEELS
from tyre.base.plausible import Doubt, doubt


@dataclass(frozen=True)
class Parameter:
    """A physical parameter of an effect.

    Attributes
    ----------
    name, unit, description : str
        Key of model files, SI unit, one phrase.
    bounds : (float, float)
        Physically possible values, ends included; anything else is refused.
    typical : (float, float)
        Range that occurs on bicycles: sliders, sweeps and prior widths use it, and what lies outside is warned about.
    default : float or str, optional
        Value when none is given; a string names the bicycle parameter it equals. None: it must be given.
    neutral : float, optional
        Value at which the effect vanishes (may be infinite).
    per_wheel : bool
        One value for each wheel, written ``{rear = .., front = ..}`` or one number for both.
    tyre : str
        What of :class:`tyre.TyreProperties` it is: a model file takes it from its tyre with ``name = "tyre"``.
    tyre_beside : str
        Effect without which the tyre's value would not mean this parameter.
    """

    name: str
    unit: str
    description: str
    bounds: tuple[float, float]
    typical: tuple[float, float]
    default: float | str | None = None
    neutral: float | None = None
    per_wheel: bool = False
    tyre: str = ""
    tyre_beside: str = ""

    def entries(self) -> tuple[str, ...]:
        """``name``, or ``name.rear`` and ``name.front``."""
        return tuple(f"{self.name}.{wheel}" for wheel in WHEELS) if self.per_wheel else (self.name,)

    def doubt(self, key: str, value: float) -> Doubt | None:
        """Whether a value (SI), called ``key`` in the words, is outside ``typical``; defaults and neutral never are."""
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
