"""A physical effect: its parameters, its modes and what it adds to a model."""

import inspect
import math
import re
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from textwrap import fill
from typing import Any, ClassVar

from bicycle.equations.declarations import Mode
from bicycle.equations.lateral import ModelBuilder
from bicycle.parameters.bicycle import bodies
from bicycle.parameters.parameter_covariance import WHEELS
from tyre.ground.door import library
from tyre.ground.errors import InputError, is_number, refuse_unknown, shown
from tyre.measured.plausible import Doubt, doubt, suspicion

sp = library("sympy")

ANY = (-math.inf, math.inf)
"""Bounds of a parameter of either sign."""


@dataclass(frozen=True)
class Parameter:
    """A physical parameter of an effect, declared once as an attribute of its class: ``stiffness = Parameter(...)``.

    On the class the attribute is the declaration; in a model's effect it is the value, and inside ``apply`` a symbol.

    Attributes
    ----------
    unit, description : str
        SI unit (``1`` where there is none), one phrase.
    bounds : (float, float)
        Physically possible values, ends included, by default not negative; anything else is refused.
    typical : (float, float)
        Range that occurs on bicycles, declared here alone: sliders, sweeps, priors of a diagnosis, default standard
        deviations and the samples of the main study use it, and what lies outside is warned about.
    evidence : str
        Where the typical range comes from, as far as known: what was measured, or that it is assumed.
    default : float or str, optional
        Value when none is given; a string names the bicycle parameter it equals. None: it must be given.
    neutral : float, optional
        Value at which the effect vanishes (may be infinite).
    least : float
        Smallest size that is worth a name in a diagnosis, as a distance from ``neutral``; of a stiffness whose effect
        vanishes at infinity (as slip does with the cornering stiffness), the one above which it does not matter. 0:
        any.
    smallest : float
        Smallest size on any real bicycle, counted alike: a diagnosis that finds less does not name the effect. 0: any.
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
    chosen : bool
        It was chosen, not measured, as the speed at which a fitted gain holds: it is exact.
    """

    unit: str
    description: str
    _: KW_ONLY
    bounds: tuple[float, float] = (0.0, math.inf)
    typical: tuple[float, float]
    evidence: str = ""
    default: float | str | None = None
    neutral: float | None = None
    least: float = 0.0
    smallest: float = 0.0
    per_wheel: bool = False
    tyre: str = ""
    tyre_beside: str = ""
    without_cause: bool = False
    chosen: bool = False
    name: str = field(default="", init=False)

    def __set_name__(self, owner: type, name: str) -> None:
        object.__setattr__(self, "name", name)

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        if instance is None:
            return self
        raise AttributeError(f"{type(instance).__name__}.{self.name} equals {self.default!r} of the bicycle")

    def entries(self) -> tuple[str, ...]:
        """``name``, or ``name.rear`` and ``name.front``."""
        return tuple(f"{self.name}.{wheel}" for wheel in WHEELS) if self.per_wheel else (self.name,)

    def doubt(self, key: str, value: float, reach: float = 1.0) -> Doubt | None:
        """Doubt about a ``value`` (SI) of ``key`` beyond ``usual_range``, not default or neutral; ``reach``: factor."""
        if self.without_cause:
            return None
        return doubt(key, value, unit=self.unit, typical=self.usual_range(reach), usual=(self.default, self.neutral))

    def usual_range(self, reach: float = 1.0) -> tuple[float, float]:
        """Give ``typical``, its ends ``reach`` (a factor) times as far from zero, its root times as near."""
        low, high = self.typical
        root_reach = math.sqrt(reach)
        return min(reach * low, low / root_reach), max(reach * high, high / root_reach)

    @property
    def by_factors(self) -> bool:
        """True if the values that occur differ by more than a factor of three: their logarithm is normal then."""
        low, high = self.typical
        return self.bounds[0] >= 0 < low and high > 3 * low

    @property
    def spread(self) -> float:
        """One standard deviation of what occurs, of its logarithm if ``by_factors``: ``typical`` spans four."""
        low, high = self.typical
        return math.log(high / low) / 4 if self.by_factors else (high - low) / 4

    def assumed_sd(self, value: float) -> float | None:
        """One standard deviation (SI) of a ``value`` that was not measured; None where ``typical`` says none.

        It is relative to the value where all that occurs has one sign, and ``spread`` of a place, an angle or a share.
        A gain of either sign has none.
        """
        low, high = self.typical
        either_sign, between = low < 0 < high, math.isfinite(self.bounds[1] - self.bounds[0])
        size = self.neutral is not None
        if self.without_cause or math.isinf(high - low) or (size and either_sign):
            return None
        if self.by_factors:
            return self._limit_sd(self.spread * abs(value), value)
        if either_sign or (between and not size):
            return self._limit_sd(self.spread, value)
        return self._limit_sd(self.spread * abs(2 * value / (low + high)), value)

    def _limit_sd(self, sd: float, value: float) -> float:
        """Give ``sd``, at most half of what numbers between two ``bounds`` can have about a mean ``value``."""
        low, high = self.bounds
        bounded = math.isfinite(high - low) and low < value < high
        return min(sd, math.sqrt((value - low) * (high - value)) / 2) if bounded else sd

    def numbers(self, value: Any, where: str) -> dict[str, float]:
        """Checked numbers of a ``value`` by ``name[.wheel]``, rear first; ``where`` begins an error."""
        if isinstance(value, PerWheel):
            value = {"rear": value.rear, "front": value.front}
        if not self.per_wheel and isinstance(value, Mapping):
            raise InputError(f"{where}: {self.name} is one number for the bicycle, not a table of rear and front")
        by_wheel = value if isinstance(value, Mapping) else dict.fromkeys(WHEELS, value)
        if set(by_wheel) != set(WHEELS):
            keys = ", ".join(map(str, by_wheel)) or "none"
            raise InputError(f"{where}: {self.name} has the keys {keys}; give rear and front, or one number")
        low, high = self.bounds
        unit = "" if self.unit == "1" else f" {self.unit}"
        numbers = dict(zip(self.entries(), (by_wheel[wheel] for wheel in WHEELS), strict=self.per_wheel))
        for key, number in numbers.items():
            if not is_number(number) or math.isnan(number):
                raise InputError(f"{where}: {key} = {shown(number)} must be a number{unit}")
            if not (low <= number <= high) or (math.isinf(number) and number != self.neutral):
                why = "" if math.isinf(number) else suspicion(number, unit=self.unit, typical=self.typical)
                raise InputError(f"{where}: {key} = {number:g}{unit} is outside {low:g} .. {high:g}{unit}{why}")
        return {key: float(number) for key, number in numbers.items()}


@dataclass(frozen=True)
class PerWheel:
    """A rear and a front value; indexed by a wheel of the model or by ``rear`` / ``front``."""

    rear: Any
    front: Any

    def __getitem__(self, wheel: Any) -> Any:
        return {"rear": self.rear, "front": self.front}[wheel if isinstance(wheel, str) else wheel.name]


PerWheelValue = float | Mapping[str, float] | PerWheel
"""Value of a parameter per wheel: one number for both wheels, or rear and front."""


@dataclass(frozen=True)
class Tied:
    """Default of a parameter that equals one of the bicycle, as a signature shows it."""

    key: str  # of a bicycle's parameter

    def __repr__(self) -> str:
        return f"<{self.key} of the bicycle>"


def signature(parameters: Sequence[Parameter]) -> inspect.Signature:
    """Keyword-only signature; required parameters come first."""
    ordered = sorted(parameters, key=lambda p: p.default is not None)
    empty = inspect.Parameter.empty
    return inspect.Signature(
        [
            inspect.Parameter(
                p.name,
                inspect.Parameter.KEYWORD_ONLY,
                annotation=PerWheelValue if p.per_wheel else float,
                default=empty if p.default is None else Tied(p.default) if isinstance(p.default, str) else p.default,
            )
            for p in ordered
        ]
    )


def docstring(description: str, parameters: Sequence[Parameter], source: str) -> str:
    """The effect in words, then every parameter with unit, default, typical and allowed values (numpydoc)."""
    lines = [description]
    if parameters:
        lines += ["", "Parameters", "----------"]
    for p in parameters:
        shape, unit = "float or {rear, front}" if p.per_wheel else "float", "dimensionless" if p.unit == "1" else p.unit
        of = " of the bicycle" if isinstance(p.default, str) else ""
        default = p.default if of or p.default is None else f"{p.default:g}"
        lines += [f"{p.name} : {shape}, {unit}" + ("" if default is None else f", default {default}{of}")]
        lines += [fill(sentence(p), 112, initial_indent="    ", subsequent_indent="    ")]
    if source and source not in " ".join(description.split()):
        lines += ["", "Notes", "-----", fill(f"Source: {source}.", 112)]
    return "\n".join(lines)


def sentence(p: Parameter) -> str:
    """Meaning, ranges, the value at which the effect vanishes and the size below which it does not matter."""
    parts = [f"{p.description[:1].upper()}{p.description[1:]}"]
    ranges = [f"{low:g} .. {high:g}" if (low, high) != ANY else "any" for low, high in (p.typical, p.bounds)]
    evidence = f" ({p.evidence})" if p.evidence else ""
    parts.append(f"typical {ranges[0]}{evidence}, allowed {ranges[1]}")
    if p.neutral is not None:
        parts.append(f"the effect vanishes at {p.neutral:g}")
        parts += [f"negligible {'above' if p.neutral == math.inf else 'below'} {p.least:g}"] if p.least else []
    return "; ".join(parts) + "."


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
    on_request : str
        Reason why the diagnosis tries it on request only; empty if it always does.
    nameable : bool
        Whether it is a cause that a diagnosis may name; what stands for an unknown one is never tried.
    moves_load : bool
        Whether it moves load between the wheels at rest: measured tyres are taken at the loads that it leaves.
    needs_rider : bool
        Whether it is of a rider: the diagnosis does not try it on a bicycle without one.
    acts_through : str
        Input of the model through which it acts, ``steer_torque`` for hands: a sensor of that input measures the effect
        with it.
    rank : int
        Place in the order in which effects are applied: one that carries bodies of others comes before them.
    family : str
        Physics that the effect shares with others in most data, with its article (``an aligning moment of the tyre``):
        a diagnosis that cannot distinguish members of one family names the family.
    title : str
        Plain name, the first words of the docstring of the effect's file, unless it is given.
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
    family: ClassVar[str] = ""
    title: ClassVar[str] = ""
    description: ClassVar[str] = ""
    modes: ClassVar[tuple[Mode, ...]] = ()
    powered: ClassVar[bool] = False
    on_request: ClassVar[str] = ""
    nameable: ClassVar[bool] = True
    moves_load: ClassVar[bool] = False
    needs_rider: ClassVar[bool] = False
    acts_through: ClassVar[str] = ""
    rank: ClassVar[int] = 100

    def __init_subclass__(cls) -> None:
        if "identifier" not in cls.__dict__:
            cls.identifier = cls.__module__.rsplit(".", 1)[-1]
        if "parameters" in cls.__dict__:
            raise InputError(
                f"effect {cls.identifier!r}: declare each parameter as an attribute of the class, "
                "stiffness = Parameter(unit, meaning, ...), not in a tuple"
            )
        declared = {name: value for kind in reversed(cls.__mro__) for name, value in vars(kind).items()}
        cls.parameters = tuple(value for value in declared.values() if isinstance(value, Parameter))
        for p in cls.parameters:
            for key, pair in (("bounds", p.bounds), ("typical", p.typical)):
                if not (isinstance(pair, tuple) and len(pair) == 2 and all(map(is_number, pair)) and pair[0] < pair[1]):
                    where = f"effect {cls.identifier!r}: {p.name}: {key}"
                    raise InputError(f"{where} = {shown(pair)} must be two numbers (low, high)")
        cls.description = inspect.cleandoc(cls.__doc__ or "")
        if "title" not in cls.__dict__ and cls.__module__.endswith(cls.identifier):
            first = re.split(r"[.:\n]", getattr(sys.modules.get(cls.__module__), "__doc__", None) or "", maxsplit=1)[0]
            cls.title = first[:1].lower() + first[1:]
        cls.__doc__ = docstring(cls.description, cls.parameters, cls.source)
        cls.__signature__ = signature(cls.parameters)  # type: ignore[attr-defined]

    def __init__(self, /, **values: Any) -> None:
        """Check and store the parameters; see ``parameters`` of the class for names, units and bounds."""
        self._given: dict[str, float] = {}
        where = f"effect {self.identifier!r}"
        refuse_unknown("parameter", values, [p.name for p in self.parameters], where=where)
        for p in self.parameters:
            value = values.get(p.name, p.default)
            if value is None:
                shape = ", one value or {rear, front}" if p.per_wheel else ""
                raise InputError(f"{where}: missing parameter {p.name!r} ({p.description}, {p.unit}{shape})")
            if isinstance(value, str) and p.name not in values:
                continue  # equals a bicycle parameter, filled in when the bicycle is known
            numbers = p.numbers(value, where)
            self._given |= numbers
            setattr(self, p.name, PerWheel(*numbers.values()) if p.per_wheel else numbers[p.name])

    def values(self, bicycle: Mapping[str, float]) -> dict[str, float]:
        """Every parameter as ``identifier.name[.wheel]``, SI; values of the ``bicycle`` (SI) fill tied defaults."""
        return {
            f"{self.identifier}.{key}": self._given[key] if key in self._given else bicycle[str(parameter.default)]
            for parameter in self.parameters
            for key in parameter.entries()
        }

    @property
    def stand_ins(self) -> dict[str, float]:
        """Numbers that were given in place of parameters, SI; only some effects take them."""
        return {}

    @property
    def table(self) -> dict[str, Any]:
        """Numbers that were given, SI, as the table of a model file holds them."""
        written: dict[str, Any] = {}
        for p in self.parameters:
            if not hasattr(self, p.name):
                continue
            value = getattr(self, p.name)
            written[p.name] = {"rear": value.rear, "front": value.front} if p.per_wheel else float(value)
        return written

    def doubts(self, reach: float = 1.0) -> dict[str, Doubt]:
        """Values outside what is usual, by ``name[.wheel]``, equal wheels by ``name``; ``reach``: factor of it."""
        doubts: dict[str, Doubt | None] = {}
        for parameter in self.parameters:
            values = {key: self._given[key] for key in parameter.entries() if key in self._given}
            if parameter.per_wheel and len(set(values.values())) == 1:
                values = {parameter.name: next(iter(values.values()))}
            doubts |= {key: parameter.doubt(f"{self.identifier}.{key}", value, reach) for key, value in values.items()}
        return {key: doubt for key, doubt in doubts.items() if doubt}

    def __eq__(self, other: object) -> bool:
        return self._given == other._given if type(self) is type(other) else NotImplemented

    def __hash__(self) -> int:
        return hash((type(self), frozenset(self._given.items())))

    def __repr__(self) -> str:
        values = {p.name: getattr(self, p.name) for p in self.parameters if hasattr(self, p.name)}
        for name, value in values.items():
            if isinstance(value, PerWheel):
                values[name] = value.rear if value.rear == value.front else {"rear": value.rear, "front": value.front}
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in values.items())})"

    @classmethod
    def symbolic(cls) -> "Effect":
        """An effect of this kind with a symbol for every parameter, as ``apply`` needs it."""
        twin = cls.__new__(cls)
        for parameter in cls.parameters:
            symbols = [sp.Symbol(f"{cls.identifier}.{key}", real=True) for key in parameter.entries()]
            setattr(twin, parameter.name, PerWheel(*symbols) if parameter.per_wheel else symbols[0])
        return twin

    def check(self, bicycle: Mapping[str, float]) -> None:
        """Refuse values that contradict those of the ``bicycle`` and of the other effects (SI)."""

    def apply(self, model: ModelBuilder) -> None:
        """Add the effect to the symbolic ``model`` through its methods."""
        raise NotImplementedError


class PointMass(Effect):
    """An effect that is a further ``mass`` (kg) at ``x`` (m ahead of the rear contact), fixed to the bicycle."""

    mass: Any
    x: Any

    def check(self, bicycle: Mapping[str, float]) -> None:
        parts = bodies(bicycle)
        front = sum(body.mass * body.x for body in parts) + self.mass * self.x
        rear = (sum(body.mass for body in parts) + self.mass) * bicycle["w"] - front
        for wheel, moment, word in (("rear", rear, "less"), ("front", front, "more")):
            if moment <= 0:
                raise InputError(
                    f"effect {self.identifier!r}: {self.mass:g} kg at x = {self.x:g} m lift the {wheel} wheel; "
                    f"give less mass or {word} x"
                )


def effect_of(kind: type[Effect], values: Mapping[str, float], names: Collection[str] | None = None) -> Effect:
    """An effect from flat numbers."""
    table = {
        p.name: PerWheel(*numbers) if p.per_wheel else numbers[0]
        for p in kind.parameters
        if names is None or p.name in names
        for numbers in [[float(values[f"{kind.identifier}.{entry}"]) for entry in p.entries()]]
    }
    return kind(**table)
