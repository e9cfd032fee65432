"""What an effect is: declared parameters, what it needs of the model, and ``apply``."""

import inspect
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import sympy as sp

from bicycle.derivation.builder import ModelBuilder
from bicycle.derivation.declarations import Mode
from bicycle.effect.parameter import Parameter, PerWheel, PerWheelValue, checked_numbers
from bicycle.effect.signature import docstring, signature
from tyre.base.errors import InputError, unknown
from tyre.base.plausible import Doubt


class Effect:
    """A physical effect beyond the rigid bicycle: a subclass in a file of its own, given by :func:`load_effects`,
    ``velotyre --effects FILE`` or the entry points ``velotyre.effects`` of a package; those of ``bicycle/effects`` are
    found.

    Attributes
    ----------
    identifier : str
        Key of model files: the name of the effect's file, unless it is given.
    parameters : tuple of Parameter
        Those declared as attributes, in their order.
    modes : tuple of Mode
        Modes of vibration that the effect brings, each marked by the role of a joint or state that it adds.
    slot : str, optional
        Effects with the same slot exclude each other (``contact law``).
    requires, provides : tuple of str
        Needs that another effect must provide, for example ``tyre force``; ``why`` explains a missing one.
    source, signature : str
        Literature, and what one sees in the modes when the effect is there.
    powered : bool
        Whether a motor does it: the diagnosis tries it on request only, for no bicycle has one unknown to its owner.
    nameable : bool
        Whether it is a cause that a diagnosis may name; what stands for an unknown one is never tried.
    needs_rider : bool
        Whether it is of a rider: the diagnosis does not try it on a bicycle without one.
    acts_through : str
        Input of the model through which it acts, ``steer_torque`` for hands: a sensor of that input measures the effect
        with it.
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
    modes: ClassVar[tuple[Mode, ...]] = ()
    powered: ClassVar[bool] = False
    nameable: ClassVar[bool] = True
    needs_rider: ClassVar[bool] = False
    acts_through: ClassVar[str] = ""

    def __init_subclass__(cls) -> None:
        if "identifier" not in cls.__dict__:
            cls.identifier = cls.__module__.rsplit(".", 1)[-1]
        if "parameters" in cls.__dict__:
            raise InputError(
                f"effect {cls.identifier!r}: declare each parameter as an attribute of the class, "
                "stiffness = Parameter(unit, meaning, ...), not in a tuple"
            )
        declared = {name: thing for kind in reversed(cls.__mro__) for name, thing in vars(kind).items()}
        cls.parameters = tuple(thing for thing in declared.values() if isinstance(thing, Parameter))
        for parameter in cls.parameters:
            parameter.check_ranges(cls.identifier)
        cls.description = inspect.cleandoc(cls.__doc__ or "")
        cls.__doc__ = docstring(cls.description, cls.parameters, cls.source)
        cls.__signature__ = signature(cls.parameters, PerWheelValue)  # type: ignore[attr-defined]

    def __init__(self, /, **given: Any) -> None:
        """Check and store the parameters; see ``parameters`` of the class for names, units and bounds."""
        self._given: dict[str, float] = {}
        known = {parameter.name: parameter for parameter in self.parameters}
        for name in given:
            if name not in known:
                raise InputError(f"effect {self.identifier!r}: {unknown('parameter', name, known)}")
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
        numbers = checked_numbers(parameter, value, self.identifier)
        self._given |= numbers
        setattr(self, parameter.name, PerWheel(*numbers.values()) if parameter.per_wheel else numbers[parameter.name])

    def values(self, bicycle: Mapping[str, float]) -> dict[str, float]:
        """Every parameter as ``identifier.name[.wheel]`` -> SI value; defaults tied to the bicycle are filled in.

        Parameters
        ----------
        bicycle : mapping of str to float
            Parameters of the bicycle, SI.
        """
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
        """Refuse values that make no sense beside the bicycle's and the other effects' (overridden where needed).

        Parameters
        ----------
        bicycle : mapping of str to float
            Parameters of the bicycle and of every effect, SI.
        """

    def apply(self, model: ModelBuilder) -> None:
        """Add the effect to the symbolic model.

        Parameters
        ----------
        model : ModelBuilder
            The open model, which the effect extends through its methods.
        """
        raise NotImplementedError
