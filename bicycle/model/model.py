"""A bicycle with effects."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect import WHEELS, Effect
from bicycle.effects.effect_registry import effect_class
from bicycle.equations.declarations import State
from bicycle.equations.evaluation import Evaluator, evaluator
from bicycle.files.bicycle_files import load_bicycle
from bicycle.model.state_space import LinearModel, SpeedRange
from bicycle.parameters.bicycle import BOUNDS, POSITIVE, UNITS, Bicycle, bodies, of_kind, static_loads
from bicycle.parameters.parameter_covariance import ParameterCovariance, entries_of
from tyre.ground.errors import InputError

Reasons = dict[str, NDArray[np.bool_]]


def impossible_bicycles(p: Mapping[str, Any]) -> Reasons:
    """Conditions that some of the bicycles break, in words -> which ones do."""
    with np.errstate(all="ignore"):
        broken: dict[str, Any] = {"a number that is not finite": ~np.isfinite(sum(np.abs(p[key]) for key in UNITS))}
        for key, (low, high) in BOUNDS.items():
            value, strict = np.asarray(p[key]), key in POSITIVE or key == "lam"
            if np.isfinite(low):
                broken[f"{key} {'<=' if strict else '<'} {low:.4g}"] = value <= low if strict else value < low
            if np.isfinite(high):
                broken[f"{key} >= {high:.4g}"] = value >= high
        for part in "BH":
            xx, zz, xz = (p[f"I{part}{axes}"] for axes in ("xx", "zz", "xz"))
            broken[f"I{part}xx I{part}zz < I{part}xz^2"] = xx * zz < xz**2
        for wheel, load in zip(WHEELS, static_loads(bodies(p), p["w"], p["g"]), strict=True):
            broken[f"the {wheel} wheel bears no load"] = ~((np.asarray(load) > 0) & (np.asarray(load) < np.inf))
    shape = np.broadcast_shapes(*(np.shape(mask) for mask in broken.values()))
    return {why: np.broadcast_to(mask, shape) for why, mask in broken.items() if np.any(mask)}


DEFAULT_CONTACT = "no_slip"


@dataclass(frozen=True)
class Model:
    """A bicycle with effects; ``sd`` holds one standard deviation of effect parameters where a measurement gave it.

    ``assumed_sd`` are those of its keys whose deviation the source does not state and a default stands for.
    ``covariance`` says what those of them have in common that were measured together, as the numbers of one tyre.
    With ``unusual`` values far from the typical ones are meant: no warning.

    ``effects`` is one effect or several. Without a contact law the wheels roll without slip (the Whipple bicycle).
    Models with the same bicycle, effects and standard deviations are equal.

    Raises
    ------
    InputError
        Two effects exclude each other, one needs what no other provides, or they are not given as one argument.
    """

    bicycle: Bicycle  # rigid, without the effects
    effects: tuple[Effect, ...] = ()
    notes: tuple[str, ...] = field(default=(), compare=False)  # to show with its warnings: on its tyres and effects
    sd: Mapping[str, float] = field(default_factory=dict)
    assumed_sd: tuple[str, ...] = ()
    covariance: ParameterCovariance = field(default_factory=ParameterCovariance)
    unusual: bool = field(default=False, compare=False, kw_only=True)

    if TYPE_CHECKING:  # what a call may give, where the fields say what is kept

        def __init__(
            self,
            bicycle: Bicycle | str,
            effects: Effect | Iterable[Effect] = (),
            notes: Iterable[str] = (),
            sd: Mapping[str, float] = ...,
            assumed_sd: Iterable[str] = (),
            covariance: ParameterCovariance = ...,
            *,
            unusual: bool = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if isinstance(self.bicycle, str):
            object.__setattr__(self, "bicycle", load_bicycle(self.bicycle))
        if any(isinstance(other, Effect) for other in (self.notes, self.sd, self.assumed_sd, self.covariance)):
            raise InputError("effects were given one after the other; give them as one: Model(bicycle, [one, other])")
        effects = (self.effects,) if isinstance(self.effects, Effect) else tuple(self.effects)
        if not any(effect.slot == "contact law" for effect in effects):
            effects = (effect_class(DEFAULT_CONTACT)(), *effects)
        check_compatible(effects)
        object.__setattr__(self, "effects", tuple(sorted(effects, key=lambda effect: effect.identifier)))
        for effect in effects:
            effect.check(self.parameters)
            if self.bicycle.without_slip and not getattr(effect, "holds_contact", True):
                where = f"bicycle {self.bicycle.name!r} with {effect.identifier}"
                raise InputError(f"{where}: {self.bicycle.without_slip[0]}; or take no_slip")
        of_bicycle = self.bicycle.covariance
        if not set(of_bicycle.names) <= set(self.covariance.names):
            object.__setattr__(self, "covariance", self.covariance.and_also(of_bicycle))

    def __hash__(self) -> int:  # a mapping does not hash
        return hash((self.bicycle, self.effects, frozenset(self.sd.items()), self.covariance))

    def __repr__(self) -> str:
        return f"<Model of {self.bicycle!r}\n with {', '.join(map(repr, self.effects))}>"

    @property
    def parameters(self) -> dict[str, float]:
        """Every bicycle and effect parameter (SI), ``effect.name[.wheel]``."""
        values = dict(self.bicycle.values)
        for effect in self.effects:
            values |= effect.values(self.bicycle.values)
        return values

    @property
    def tied(self) -> dict[str, str]:
        """Effect parameters that were not given and equal a bicycle parameter: name -> bicycle key."""
        return {
            f"{effect.identifier}.{key}": str(parameter.default)
            for effect in self.effects
            for parameter in effect.parameters
            if not hasattr(effect, parameter.name) and isinstance(parameter.default, str)
            for key in parameter.entries()
        }

    @property
    def evaluator(self) -> Evaluator:
        """The function that turns parameters into matrices, shared by all models with these effects."""
        return evaluator(tuple(type(effect) for effect in self.effects))

    def with_effect(self, effect: Effect) -> "Model":
        """A model with one more ``effect``; a contact law takes the place of the one there was."""
        kept_effects = [
            e for e in self.effects if type(e) is not type(effect) and (e.slot is None or e.slot != effect.slot)
        ]
        return replace(self, effects=(*kept_effects, effect))

    def linear_model(self) -> LinearModel:
        """The numeric model, built at the first call.

        Raises
        ------
        InputError
            The mass matrix is not positive definite.
        """
        return self._linear

    @cached_property
    def _linear(self) -> LinearModel:
        """The numeric model."""
        return linear_model(self.evaluator, self.parameters, self)


def as_linear(model: "Model | LinearModel") -> LinearModel:
    """The linear model of a ``model``, or a linear model as it is: what functions of the dynamics take."""
    return model.linear_model() if isinstance(model, Model) else model


def linear_model(evaluate: Evaluator, values: Mapping[str, float], model: Model) -> LinearModel:
    """Numbers for one parameter set; a model whose equations switch at a speed gets one range on each side."""
    switches = evaluate.switch_speeds(values)
    borders = sorted({0.0, *(speed for speed in switches if speed > 0), math.inf})
    ranges = []
    for lower, upper in pairwise(borders):
        indicators = tuple(float(upper <= speed) for speed in switches)
        ranges.append(SpeedRange(lower, upper, evaluate(values, indicators)))
    first = ranges[0].matrices
    smallest = np.linalg.eigvalsh((first.mass + first.mass.T) / 2)[0]
    if smallest <= 0:
        raise InputError(
            f"bicycle {model.bicycle.name!r} with {', '.join(e.identifier for e in model.effects)}: the mass matrix is "
            f"not positive definite (smallest eigenvalue {smallest:.4g}); check masses and moments of inertia"
        )
    # values of effects outside their typical range; of measured ones (with an sd) those that a slip would explain
    warnings = [*model.bicycle.warnings]
    if not model.unusual:
        for effect in model.effects:
            for key, doubt in effect.doubts(of_kind(model.bicycle.kind)[1]).items():
                if doubt.explained or not entries_of(f"{effect.identifier}.{key}", model.sd):
                    warnings.append(doubt.text)
    warnings += model.notes
    if any(effect.moves_load for effect in model.effects):
        evaluate.check_loads(values)
    check_weight(evaluate, values, model)
    lift_off = evaluate.lift_off_speed(values)
    if not math.isinf(lift_off):
        warnings.append(
            f"the front wheel lifts off the ground above {lift_off:.2f} m/s, where drag outweighs its load; "
            "no result holds there"
        )
    symbolic = evaluate.symbolic
    rear, front = (float(load) for load in first.static_loads)
    return LinearModel(
        states=symbolic.states,
        inputs=symbolic.inputs,
        outputs=symbolic.outputs,
        ranges=tuple(ranges),
        scale=state_scale(symbolic.declared.states, rear + front),
        declared=symbolic.declared,
        parameters=dict(values),
        static_loads=(rear, front),
        effects=tuple(effect.identifier for effect in model.effects),
        warnings=tuple(warnings),
    )


def check_weight(evaluate: Evaluator, values: Mapping[str, float], model: Model) -> None:
    """Refuse masses of effects that together lift a wheel on which the bicycle itself stands."""
    if model.bicycle.without_slip:
        return
    effects = ", ".join(effect.identifier for effect in model.effects)
    for wheel, load in zip(WHEELS, evaluate.wheel_loads(values), strict=False):
        if not load > 0:
            raise InputError(
                f"bicycle {model.bicycle.name!r} with {effects}: the load of the {wheel} wheel is {load:.4g} N; "
                "give less mass, or one nearer to the middle of the wheels"
            )


def check_compatible(effects: tuple[Effect, ...]) -> None:
    """Refuse ``effects`` with double-booked slots, repeated ones and unmet needs, naming both sides."""
    slots: dict[str, Effect] = {}
    provided = {provision for effect in effects for provision in effect.provides}
    for number, effect in enumerate(effects):
        if any(type(effect) is type(earlier) for earlier in effects[:number]):
            raise InputError(f"effect {effect.identifier!r} is given twice")
        if effect.slot is not None and effect.slot in slots:
            raise InputError(
                f"effects {slots[effect.slot].identifier!r} and {effect.identifier!r} exclude each other: "
                f"both are the {effect.slot} of the model; keep one"
            )
        if effect.slot is not None:
            slots[effect.slot] = effect
        for need in effect.requires:
            if need not in provided:
                raise InputError(
                    f"effect {effect.identifier!r} needs a {need}, which no other effect gives: {effect.why}"
                )


def state_scale(states: Iterable[State], weight: float) -> Any:
    """Scale of each state: forces and moments in units of the nearest power of two to the weight, the others in SI."""
    force_unit = 2.0 ** round(math.log2(weight))
    return np.array([force_unit if state.forcelike else 1.0 for state in states])
