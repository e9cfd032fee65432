"""Every registered effect that the base model does not contain, as candidates with unknowns from its declaration.

Prior of a parameter that measures the size of an effect: normal about its neutral value, the upper end of its typical
range being two sigma, cut off at its bounds. A neutral value at infinity makes the reciprocal (a compliance) the
coordinate. Other parameters ("shape"): normal over the typical range as +-2 sigma, in the logarithm where the range
spans more than a factor of three. Both wheels share one value; a stiffness in N/rad goes with the static load.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bicycle.effect import WHEELS, Effect, Parameter, registry
from bicycle.effect.numbers import effect_of
from bicycle.model import Model
from bicycle.model_family import ModelFamily
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.base.errors import InputError

RIDDEN = 30.0  # kg of a rear frame that may hold a rider
SMALLER = (1.0, 0.7, 0.5, 0.35)  # shares of the typical mass and inertia of a moving body that are tried
LEFT_OUT = "left out by request"
NO_CAUSE = "no cause that could be named: it is fitted to what remains, after the verdict"
SINGULAR = 1e-2  # smallest coordinate, in prior scales, where zero is singular


def find_candidates(
    model: Model, known: Mapping[str, Mapping[str, Any]], without: tuple[str, ...] = (), also: tuple[str, ...] = ()
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Candidates for a base model, and why the other effects cannot be tried.

    Parameters
    ----------
    model : Model
    known : mapping
        ``identifier -> {parameter: value}``: what is known of a candidate and needs no fit (a hinge's place).
    without : tuple of str
        Identifiers that are not tried.
    also : tuple of str
        Identifiers of powered effects that are tried; so are those that are ``known``, were it nothing of them.

    Raises
    ------
    InputError
        What is asked for stands for no cause (the residual torque), so it can never be named.
    """
    present = {effect.identifier: effect for effect in model.effects}
    law = next(effect for effect in model.effects if effect.slot == "contact law")
    found, refused = [], {}
    for identifier, effect in registry().items():
        if identifier in present:
            continue
        if identifier in without:
            refused[identifier] = LEFT_OUT
            continue
        if not effect.nameable:
            if identifier in (*also, *known):
                raise InputError(f"{identifier}: {NO_CAUSE}; it cannot be a candidate, take it out")
            refused[identifier] = NO_CAUSE
            continue
        if effect.powered and identifier not in (*also, *known):
            refused[identifier] = f"a motor: tried on request, --with {identifier}"
            continue
        replaced = next((e for e in model.effects if e.slot is not None and e.slot == effect.slot), None)
        if replaced is not None and len(effect.parameters) <= len(replaced.parameters):
            refused[identifier] = f"{replaced.identifier} of the base model already takes its place"
            continue
        if effect.needs_rider and model.bicycle["mB"] < RIDDEN:
            refused[identifier] = f"nobody rides: mB = {model.bicycle['mB']:g} kg is less than {RIDDEN:g} kg"
            continue
        needs = set(effect.requires) - {thing for other in model.effects for thing in other.provides}
        if needs:
            refused[identifier] = f"needs a {', '.join(needs)}, which {law.identifier} does not give"
            continue
        try:
            found.append(candidate(model, effect, known.get(identifier, {}), replaced))
        except InputError as error:
            refused[identifier] = str(error)
    return tuple(found), refused


def candidate(
    model: Model, effect: type[Effect], known: Mapping[str, Any], replaced: Effect | None = None
) -> Candidate:
    """One effect as a candidate.

    Parameters
    ----------
    model : Model
        The base model.
    effect : type of Effect
    known : mapping
        Its parameters that need no fit, SI.
    replaced : Effect, optional
        The effect of the base model whose place it takes.

    Raises
    ------
    InputError
        The effect makes no sense on this bicycle (its own check), or a known parameter is not one of its own.
    """
    given, instance = _instance(model, effect, known)
    values = instance.values(model.bicycle.values)
    ties: dict[str, str] = {}
    unknowns: list[UncertainParameter] = []
    shared = {p.name for p in replaced.parameters} if replaced is not None else set()
    for p in effect.parameters:
        keys = [f"{effect.identifier}.{entry}" for entry in p.entries()]
        if p.name in shared and replaced is not None:
            ties |= {key: key.replace(effect.identifier, replaced.identifier, 1) for key in keys}
        elif isinstance(p.default, str) and p.name not in known:
            ties |= {key: str(p.default) for key in keys}
        elif p.name not in known:
            floating = _unknown(p, _factors(p, keys, model), given.get(p.name), limit=bool(shared))
            unknowns += [replace(u, labels=WHEELS) if p.per_wheel else u for u in floating]
    sizes = [u for u in unknowns if u.size]
    if len(sizes) > 1 and _vanishes_with(model, effect, values, sizes[0]):
        unknowns = [u for u in unknowns if not u.size or u is sizes[0]]  # the others only scale it
    return Candidate(
        effect.identifier, tuple(unknowns), effect, values, ties,
        replaced.identifier if replaced is not None else None, effect.signature,
    )  # fmt: skip


def check_known(effect: type[Effect], known: Mapping[str, Any]) -> None:
    """Refuse ``known`` values of an ``effect`` that it cannot have.

    Raises
    ------
    InputError
        Not a number, or out of the bounds that the effect declares.
    """
    needed = {p.name: _middle(p) for p in effect.parameters if p.name not in known}
    effect(**{name: value for name, value in needed.items() if value is not None}, **known)


def _instance(model: Model, effect: type[Effect], known: Mapping[str, Any]) -> tuple[dict[str, Any], Effect]:
    """The effect in the middle of its typical ranges; a body that the bicycle cannot hold is made smaller."""
    middle = {p.name: known.get(p.name, _middle(p)) for p in effect.parameters}
    given = {name: value for name, value in middle.items() if value is not None}
    heavy = [
        p.name for p in effect.parameters if p.unit in ("kg", "kg m^2") and p.name in given and p.name not in known
    ]
    for smaller in SMALLER:
        found = {name: smaller * value if name in heavy else value for name, value in given.items()}
        try:
            instance = effect(**found)
            instance.check(model.parameters)
        except InputError:
            if not heavy or smaller == SMALLER[-1]:
                raise
            continue
        return found, instance
    raise AssertionError("the loop above returns or raises")


def _middle(p: Parameter) -> float | None:
    if p.default is not None:
        return None  # the declared default
    low, high = p.typical
    return math.sqrt(low * high) if _wide(p) else (low + high) / 2


def _wide(p: Parameter) -> bool:
    low, high = p.typical
    return p.bounds[0] >= 0 < low and high > 3 * low


def _factors(p: Parameter, keys: list[str], model: Model) -> dict[str, float]:
    if p.unit != "N/rad" or not p.per_wheel:
        return dict.fromkeys(keys, 1.0)
    loads = np.array(model.bicycle.static_loads)
    return dict(zip(keys, loads / loads.mean(), strict=True))


def _unknown(
    p: Parameter, sets: dict[str, float], middle: float | None, *, limit: bool
) -> Iterator[UncertainParameter]:
    low, high = p.typical
    if math.isinf(low) or math.isinf(high) or low == high:
        return
    if p.neutral is not None and math.isinf(p.neutral):
        scale, least = 0.5 / low, least_coordinate(p, reciprocal=True)
        yield UncertainParameter(
            p.name, p.unit, sets, 0.0, scale, SINGULAR * scale, math.inf, power=-1, size=True, least=least
        )
    elif p.neutral is not None or limit:
        scale, neutral = 0.5 * max(abs(low), abs(high)), p.neutral or 0.0
        lowest = SINGULAR * scale if limit else p.bounds[0]
        least = least_coordinate(p, reciprocal=False)
        yield UncertainParameter(p.name, p.unit, sets, neutral, scale, lowest, p.bounds[1], size=True, least=least)
    elif _wide(p):
        yield UncertainParameter(
            p.name, p.unit, sets, math.log(middle or math.sqrt(low * high)), math.log(high / low) / 4, power=0
        )
    else:
        centre = next(x for x in (middle, p.default, (low + high) / 2) if isinstance(x, int | float))
        yield UncertainParameter(p.name, p.unit, sets, centre, (high - low) / 4, *p.bounds)


def least_coordinate(p: Parameter, *, reciprocal: bool) -> float:
    """The least size of a parameter in its coordinate: itself, or the compliance of a stiffness (``reciprocal``)."""
    if reciprocal:
        return 1 / p.least if p.least else 0.0
    return p.least


def _vanishes_with(model: Model, effect: type[Effect], values: dict[str, float], size: UncertainParameter) -> bool:
    """Whether the equations lose the effect where this one parameter is neutral, the others at their defaults."""
    evaluate = ModelFamily(model, further=(effect,)).evaluate
    parent = model.linear_model().ranges[0].matrices
    at_neutral = {**model.parameters, **values, **dict.fromkeys(size.sets, size.centre)}
    indicators = tuple(1.0 for _ in evaluate.symbolic.switches)
    found = evaluate(at_neutral, indicators)
    if found.mass.shape != parent.mass.shape:
        return False
    pairs = [(found.mass, parent.mass)]
    pairs += [(matrix, parent.dynamics.get(power, 0 * matrix)) for power, matrix in found.dynamics.items()]
    return all(np.allclose(a, b, rtol=1e-9, atol=1e-9) for a, b in pairs)


def physical(candidate: Candidate, coordinates: Sequence[float]) -> Effect:
    """The effect of a ``candidate`` at ``coordinates`` (its own, in their order), for :meth:`Model.with_effect`."""
    assert candidate.effect is not None
    values = dict(candidate.fixed)
    for u, x in zip(candidate.unknowns, coordinates, strict=True):
        values |= {key: factor * float(u.value(np.asarray(x))) for key, factor in u.sets.items()}
    return effect_of(candidate.effect, values)
