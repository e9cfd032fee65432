"""What an effect is: declared parameters, what it needs of the model, and ``apply``."""

import importlib
import inspect
import math
import pkgutil
from collections.abc import Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar

import sympy as sp

from bicycle.derivation.builder import ModelBuilder
from bicycle.effect_parameter import WHEELS, Parameter, PerWheel, PerWheelValue
from bicycle.effect_signature import docstring, signature
from tyre.base.errors import InputError, is_number, refuse_unknown, shown
from tyre.base.plausible import Doubt, suspicion

__all__ = ["WHEELS", "Effect", "Parameter", "PerWheel", "PerWheelValue", "effect_class", "registry"]


class Effect:
    """A physical effect beyond the rigid bicycle: subclass it in one file of ``bicycle/effects`` and it is found.

    Attributes
    ----------
    parameters : tuple of Parameter
    slot : str, optional
        Effects with the same slot exclude each other (``contact law``).
    requires, provides : tuple of str
        Needs that another effect must provide, for example ``tyre force``; ``why`` explains a missing one.
    source, signature : str
        Literature, and what one sees in the modes when the effect is there.
    description : str
        The docstring as it was written; ``help()`` shows it with the parameters, their units and ranges below.

    ``self.<parameter>`` is a number in a model's effect and a symbol inside ``apply``.
    """

    identifier: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    slot: ClassVar[str | None] = None
    requires: ClassVar[tuple[str, ...]] = ()
    provides: ClassVar[tuple[str, ...]] = ()
    why: ClassVar[str] = ""
    source: ClassVar[str] = ""
    signature: ClassVar[str] = ""
    description: ClassVar[str] = ""

    def __init_subclass__(cls) -> None:
        if "identifier" not in cls.__dict__:
            cls.identifier = cls.__module__.rsplit(".", 1)[-1]
        cls.description = inspect.cleandoc(cls.__doc__ or "")
        cls.__doc__ = docstring(cls.description, cls.parameters, cls.source)
        cls.__signature__ = signature(cls.parameters, PerWheelValue)  # type: ignore[attr-defined]

    def __init__(self, **given: Any) -> None:
        """Check and store the parameters; see ``parameters`` of the class for names, units and bounds."""
        self._given: dict[str, float] = {}
        known = {parameter.name: parameter for parameter in self.parameters}
        refuse_unknown("parameter", given, known, where=f"effect {self.identifier!r}")
        for parameter in self.parameters:
            value = given.get(parameter.name, parameter.default)
            if value is None:
                raise InputError(
                    f"effect {self.identifier!r}: missing parameter {parameter.name!r} ({parameter.description}, "
                    f"{parameter.unit}{', one value or {rear, front}' if parameter.per_wheel else ''})"
                )
            if isinstance(value, str) and parameter.name not in given:
                continue  # equals a bicycle parameter, filled in when the bicycle is known
            self._store(parameter, value)

    def _store(self, parameter: Parameter, value: Any) -> None:
        where = f"effect {self.identifier!r}: {parameter.name}"
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
        for key, number in numbers.items():
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            if not is_number(number) or math.isnan(number):
                raise InputError(f"effect {self.identifier!r}: {key} = {shown(number)} must be a number{unit}")
            if not (low <= number <= high) or (math.isinf(number) and number != parameter.neutral):
                why = "" if math.isinf(number) else suspicion(number, unit=parameter.unit, typical=parameter.typical)
                raise InputError(
                    f"effect {self.identifier!r}: {key} = {number:g}{unit} is outside {low:g} .. {high:g}{unit}{why}"
                )
            self._given[key] = float(number)
        if parameter.per_wheel:
            setattr(self, parameter.name, PerWheel(*(float(value[wheel]) for wheel in WHEELS)))
        else:
            setattr(self, parameter.name, float(value))

    def values(self, bicycle: Mapping[str, float]) -> dict[str, float]:
        """Every parameter as ``identifier.name[.wheel]`` -> SI value; defaults tied to the bicycle are filled in."""
        filled = {}
        for parameter in self.parameters:
            for key in parameter.entries():
                tied = str(parameter.default)
                filled[f"{self.identifier}.{key}"] = self._given[key] if key in self._given else bicycle[tied]
        return filled

    def doubts(self) -> dict[str, Doubt]:
        """What is outside its typical range, by ``name[.wheel]``; two wheels of one value are one doubt, ``name``."""
        found: dict[str, Doubt | None] = {}
        for parameter in self.parameters:
            given = {key: self._given[key] for key in parameter.entries() if key in self._given}
            if parameter.per_wheel and len(set(given.values())) == 1:
                given = {parameter.name: next(iter(given.values()))}
            found |= {key: parameter.doubt(f"{self.identifier}.{key}", value) for key, value in given.items()}
        return {key: one for key, one in found.items() if one}

    def __eq__(self, other: object) -> bool:
        """Whether the other is the same effect with the same values."""
        if type(self) is not type(other):
            return NotImplemented
        return self._given == other._given

    def __hash__(self) -> int:
        return hash((type(self), frozenset(self._given.items())))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self._shown())})"

    def _shown(self) -> Iterator[str]:
        """What the effect was made with, as it is written; one number where both wheels have the same."""
        for name in (p.name for p in self.parameters if hasattr(self, p.name)):
            value = getattr(self, name)
            if isinstance(value, PerWheel):
                value = value.rear if value.rear == value.front else {"rear": value.rear, "front": value.front}
            yield f"{name}={value!r}"

    @classmethod
    def symbolic(cls) -> "Effect":
        """The same effect with a symbol for every parameter, as ``apply`` needs it."""
        twin = cls.__new__(cls)
        for parameter in cls.parameters:
            symbols = [sp.Symbol(f"{cls.identifier}.{key}", real=True) for key in parameter.entries()]
            setattr(twin, parameter.name, PerWheel(*symbols) if parameter.per_wheel else symbols[0])
        return twin

    def check(self, bicycle: Mapping[str, float]) -> None:
        """Refuse values that make no sense beside the bicycle's and the other effects' (overridden where needed)."""

    def apply(self, model: ModelBuilder) -> None:
        """Add the effect to the symbolic model."""
        raise NotImplementedError


@cache
def registry() -> Mapping[str, type[Effect]]:
    """Every effect of ``bicycle.effects`` by identifier, sorted."""
    package = importlib.import_module("bicycle.effects")
    found: dict[str, type[Effect]] = {}
    for module in pkgutil.iter_modules(package.__path__):
        found.update((effect.identifier, effect) for effect in _effects_of(f"{package.__name__}.{module.name}"))
    return MappingProxyType(dict(sorted(found.items())))


def _effects_of(module_name: str) -> Iterator[type[Effect]]:
    module = importlib.import_module(module_name)
    for thing in vars(module).values():
        if isinstance(thing, type) and issubclass(thing, Effect) and thing.__module__ == module_name:
            yield thing


def effect_class(identifier: str) -> type[Effect]:
    """Look an effect up by identifier; InputError lists the known ones."""
    known = registry()
    refuse_unknown("effect", [identifier], known)
    return known[identifier]
