"""What an effect is: declared parameters, what it needs of the model, and ``apply``; and which effects there are."""

import inspect
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

import sympy as sp

from bicycle.derivation.builder import ModelBuilder
from bicycle.derivation.declarations import Mode
from bicycle.effect_declaration import check_declaration
from bicycle.effect_files import Origin, classes_of_file, installed_classes, packaged_classes
from bicycle.effect_parameter import WHEELS, Parameter, PerWheel, PerWheelValue, checked_numbers
from bicycle.effect_signature import docstring, signature
from tyre.base.errors import InputError, unknown
from tyre.base.plausible import Doubt

__all__ = [
    "WHEELS", "Effect", "Mode", "Parameter", "PerWheel", "PerWheelValue", "effect_class", "load_effects",
    "outside_effects", "packaged_effects", "register", "registry",
]  # fmt: skip


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

    def __init__(self, **given: Any) -> None:
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


def registry() -> Mapping[str, type[Effect]]:
    """Every effect there is by identifier, sorted: packaged, of installed packages, and registered.

    Raises
    ------
    InputError
        An installed package whose effects cannot be had.
    """
    return _known(tuple(_outside.values()))


@cache
def packaged_effects() -> Mapping[str, type[Effect]]:
    """The effects of ``bicycle.effects`` by identifier, sorted."""
    found: Iterable[type[Effect]] = packaged_classes(Effect)
    return MappingProxyType(dict(sorted((effect.identifier, effect) for effect in found)))


@cache
def _known(outside: tuple[type[Effect], ...]) -> Mapping[str, type[Effect]]:
    return MappingProxyType(dict(sorted([*_installed().items(), *((effect.identifier, effect) for effect in outside)])))


@cache
def _installed() -> Mapping[str, type[Effect]]:
    """Packaged effects and those of installed packages, which are looked up when first asked for."""
    found = dict(packaged_effects())
    for effect, where in installed_classes(Effect):
        check_declaration(effect, found, where)
        found[effect.identifier] = effect
    return found


def effect_class(identifier: str) -> type[Effect]:
    """Look an effect up by identifier; InputError lists the known ones."""
    if identifier in packaged_effects():
        return packaged_effects()[identifier]
    known = registry()
    if identifier not in known:
        raise InputError(
            f"{unknown('effect', identifier, known)}; one of your own needs --effects FILE or load_effects"
        )
    return known[identifier]


_outside: dict[str, type[Effect]] = {}  # registered in this process, by identifier


def register(effect: type[Effect], *, where: str = "") -> type[Effect]:
    """Make an effect from outside the package known everywhere; of use as a decorator.

    Parameters
    ----------
    effect : subclass of Effect
    where : str
        What an error calls its place, by default its module.

    Returns
    -------
    type
        The effect itself.

    Raises
    ------
    InputError
        Its identifier is taken by another effect, or the declaration is wrong or incomplete.
    """
    known = registry()
    if known.get(getattr(effect, "identifier", "")) is not effect:
        check_declaration(effect, known, where or f"{effect.__module__}.{effect.__qualname__}")
        _outside[effect.identifier] = effect
    return effect


def load_effects(path: str | Path) -> tuple[type[Effect], ...]:
    """Register every effect that a Python file defines; read again, a changed file takes the place of the former one.

    Parameters
    ----------
    path : str or Path
        The file; effects in it are called as the file unless they state an ``identifier``.

    Returns
    -------
    tuple of type
        The effects.

    Raises
    ------
    InputError
        No such file, no Python, no effect in it, an identifier that is taken, or a wrong declaration.
    """
    file, classes = Path(path), classes_of_file(Path(path), Effect)
    for identifier in [name for name, effect in _outside.items() if Origin.of(effect).file == file.resolve()]:
        if _outside[identifier] not in classes:
            del _outside[identifier]
    for effect in classes:
        register(effect, where=str(file))
    return classes


@contextmanager
def outside_effects(paths: Iterable[str | Path]) -> Iterator[None]:
    """Effects of files (:func:`load_effects`) that are known until the end of the block."""
    before = dict(_outside)
    try:
        for path in paths:
            load_effects(path)
        yield
    finally:
        _outside.clear()
        _outside.update(before)


def outside_origins() -> tuple[Origin, ...]:
    """Where the registered effects come from: what another process needs to :func:`take_over`."""
    return tuple(Origin.of(effect) for effect in _outside.values())


def take_over(origins: Iterable[Origin]) -> None:
    """Register in this process what another one knows.

    Parameters
    ----------
    origins : iterable of Origin
        Of :func:`outside_origins` there.

    Raises
    ------
    InputError
        A file that this process cannot read, as :func:`load_effects`.
    """
    for origin in origins:
        if origin.file is not None:
            load_effects(origin.file)
        else:
            register(origin.found())
