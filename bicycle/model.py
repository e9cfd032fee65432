"""A model = a bicycle and a set of effects; ``linear_model`` puts the numbers in."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.derivation.declarations import State
from bicycle.derivation.evaluation import Evaluator, evaluator
from bicycle.effect import Effect, effect_class
from bicycle.linear_model import LinearModel, SpeedRange
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.parameter_key import entries_of
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError

DEFAULT_CONTACT = "no_slip"


@dataclass(frozen=True)
class Model:
    """A bicycle with effects; ``sd`` holds one standard deviation of effect parameters where a measurement gave it.

    ``assumed_sd`` are those of its keys whose deviation the source does not state and a default stands for.
    ``covariance`` says what those of them have in common that were measured together, as the numbers of one tyre.

    ``effects`` is one effect or several. Without a contact law the wheels roll without slip (the Whipple bicycle).
    Models with the same bicycle, effects and standard deviations are equal.

    Raises
    ------
    InputError
        Two effects exclude each other, one needs what no other provides, or they are not given as one argument.
    """

    bicycle: Bicycle
    effects: tuple[Effect, ...] = ()
    notes: tuple[str, ...] = field(default=(), compare=False)
    sd: Mapping[str, float] = field(default_factory=dict)
    assumed_sd: tuple[str, ...] = ()
    covariance: ParameterCovariance = field(default_factory=ParameterCovariance)

    if TYPE_CHECKING:  # what a call may give, where the fields say what is kept

        def __init__(
            self, bicycle: Bicycle, effects: Effect | Iterable[Effect] = (), notes: Iterable[str] = (),
            sd: Mapping[str, float] = ..., assumed_sd: Iterable[str] = (),
            covariance: ParameterCovariance = ...,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        if any(isinstance(other, Effect) for other in (self.notes, self.sd, self.assumed_sd, self.covariance)):
            raise InputError("effects were given one after the other; give them as one: Model(bicycle, [one, other])")
        effects = (self.effects,) if isinstance(self.effects, Effect) else tuple(self.effects)
        if not any(effect.slot == "contact law" for effect in effects):
            effects = (effect_class(DEFAULT_CONTACT)(), *effects)
        check_compatible(effects)
        object.__setattr__(self, "effects", tuple(sorted(effects, key=lambda effect: effect.identifier)))
        for effect in effects:
            effect.check(self.parameters)

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
            if not hasattr(effect, parameter.name)
            for key in parameter.entries()
        }

    @property
    def evaluator(self) -> Evaluator:
        """The function that turns parameters into matrices, shared by all models with these effects."""
        return evaluator(tuple(type(effect) for effect in self.effects))

    def with_effect(self, effect: Effect) -> "Model":
        """The same model with one more ``effect``; a contact law takes the place of the one there was."""
        kept = tuple(
            other
            for other in self.effects
            if type(other) is not type(effect) and (effect.slot is None or other.slot != effect.slot)
        )
        return Model(self.bicycle, (*kept, effect), self.notes, self.sd, self.assumed_sd, self.covariance)

    def linear_model(self) -> LinearModel:
        """Build the numeric model.

        Raises
        ------
        InputError
            The mass matrix is not positive definite.
        """
        return linear_model(self.evaluator, self.parameters, self)


def as_linear(model: "Model | LinearModel") -> LinearModel:
    """The linear model of a ``model``, or a linear model as it is: what functions of the dynamics take."""
    return model.linear_model() if isinstance(model, Model) else model


def linear_model(evaluate: Evaluator, values: Mapping[str, float], model: Model) -> LinearModel:
    """Numbers for one parameter set; a model whose equations switch at a speed gets one range on each side.

    Parameters
    ----------
    evaluate : Evaluator
        Of the effects of the model.
    values : mapping of str to float
        Every parameter, SI.
    model : Model
        Names the bicycle and gives notes and warnings.

    Raises
    ------
    InputError
        The mass matrix is not positive definite.
    """
    switches = evaluate.switch_speeds(values)
    borders = sorted({0.0, *(speed for speed in switches if speed > 0), math.inf})
    ranges = []
    for lower, upper in pairwise(borders):
        indicators = tuple(float(upper <= speed) for speed in switches)
        ranges.append(SpeedRange(lower, upper, evaluate(values, indicators)))
    first = ranges[0].matrices
    symmetric = (first.mass + first.mass.T) / 2
    smallest = np.linalg.eigvalsh(symmetric)[0]
    if smallest <= 0:
        raise InputError(
            f"bicycle {model.bicycle.name!r} with {', '.join(e.identifier for e in model.effects)}: the mass matrix is "
            f"not positive definite (smallest eigenvalue {smallest:.4g}); check masses and moments of inertia"
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
        warnings=(
            *model.bicycle.warnings,
            *_doubts(model),
            *model.notes,
            *_lift_off(evaluate.lift_off_speed(values)),
        ),
    )


def _doubts(model: Model) -> tuple[str, ...]:
    """Values of effects outside their typical range; of measured ones (with an sd) those that a slip would explain.

    A measured tyre at the loads of a child or of an empty bicycle is softer than a typical one.
    """
    return tuple(
        found.text
        for effect in model.effects
        for key, found in effect.doubts().items()
        if found.explained or not entries_of(f"{effect.identifier}.{key}", model.sd)
    )


def _lift_off(speed: float) -> tuple[str, ...]:
    if math.isinf(speed):
        return ()
    return (
        f"the front wheel lifts off the ground above {speed:.2f} m/s, where drag outweighs its load; "
        "no result holds there",
    )


def check_compatible(effects: tuple[Effect, ...]) -> None:
    """Refuse ``effects`` with double-booked slots, repeated ones and unmet needs, naming both sides."""
    slots: dict[str, Effect] = {}
    provided = {thing for effect in effects for thing in effect.provides}
    for number, effect in enumerate(effects):
        if any(type(effect) is type(other) for other in effects[:number]):
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
    """Scale of each state: forces and moments in units of the nearest power of two to the weight, all else in SI.

    Parameters
    ----------
    states : iterable of State
        Those of a model, n of them.
    weight : float
        Of the bicycle, N.

    Returns
    -------
    ndarray, shape (n,)
    """
    force_unit = 2.0 ** round(math.log2(weight))
    return np.array([force_unit if state.forcelike else 1.0 for state in states])
