"""Effects that the base model lacks as candidates, empirical terms, and the nuisances of the base model.

Prior of a parameter that measures the size of an effect: normal about its neutral value, the upper end of its typical
range being two sigma, cut off at its bounds. A neutral value at infinity makes the reciprocal (a compliance) the
coordinate. Other parameters ("shape"): normal over the typical range as +-2 sigma, in the logarithm if the range spans
more than a factor of three. Both wheels share one value; a stiffness in N/rad is proportional to the static load.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bicycle.effects.effect import WHEELS, Effect, Parameter, effect_of
from bicycle.effects.effect_registry import registry
from bicycle.model.default_sd import ASSUMED, standard_deviations
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from bicycle.parameters.bicycle import LIGHTEST_RIDDEN, POSITIVE, UNITS, UNUSED
from bicycle.parameters.parameter_covariance import ParameterKey, entries_of
from bicycle.parameters.possible_inertia import FRAMES, bounds_beside, inertia_coordinates, is_rod
from studies.diagnosis.family import TORQUES, feedback_key
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.ground.errors import InputError, is_number, shown, unknown

LEFT_OUT = "excluded by request"
NO_CAUSE = "an empirical term, never a name: it is fitted to the remainder after the verdict"
SINGULAR = 1e-2  # smallest coordinate if zero is singular, in prior scales; of the bicycle, in its value


def find_candidates(
    model: Model,
    stated_values: Mapping[str, Mapping[str, Any]],
    without: tuple[str, ...] = (),
    also: tuple[str, ...] = (),
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Candidates for a base model, and why the other effects cannot be tried."""
    present = {effect.identifier for effect in model.effects}
    candidates, reasons = [], {}
    for identifier, effect in registry().items():
        if identifier in present:
            continue
        requested = identifier in (*also, *stated_values)
        if not effect.nameable and requested and identifier not in without:
            raise InputError(f"{identifier}: {NO_CAUSE}; it cannot be a candidate; remove it")
        replaced = next((e for e in model.effects if e.slot is not None and e.slot == effect.slot), None)
        why = LEFT_OUT if identifier in without else _refusal(model, effect, replaced, requested=requested)
        if why:
            reasons[identifier] = why
            continue
        try:
            candidates.append(_candidate(model, effect, stated_values.get(identifier, {}), replaced))
        except InputError as error:
            reasons[identifier] = str(error)
    return tuple(candidates), reasons


def nobody_rides(model: Model) -> str:
    """Reason why a rider can do nothing here; empty if one may sit on the bicycle."""
    mass = model.bicycle["mB"]
    return f"no rider: mB = {mass:g} kg is less than {LIGHTEST_RIDDEN:g} kg" if mass < LIGHTEST_RIDDEN else ""


def _refusal(model: Model, effect: type[Effect], replaced: Effect | None, *, requested: bool) -> str | None:
    """Reason why an ``effect`` is not tried on this ``model`` in place of the ``replaced`` one; None if it is."""
    if not effect.nameable:
        return NO_CAUSE
    if (effect.powered or effect.on_request) and not requested:
        return f"{effect.on_request or 'a motor'}: tried on request, --with {effect.identifier}"
    if replaced is not None and len(effect.parameters) <= len(replaced.parameters):
        return f"{replaced.identifier} of the base model replaces it already"
    if effect.needs_rider and (why := nobody_rides(model)):
        return why
    needs = set(effect.requires) - {need for base_effect in model.effects for need in base_effect.provides}
    law = next(e for e in model.effects if e.slot == "contact law")
    return f"needs a {', '.join(needs)}, which {law.identifier} does not give" if needs else None


def _candidate(
    model: Model, effect: type[Effect], stated_values: Mapping[str, Any], replaced: Effect | None
) -> Candidate:
    """One effect as a candidate, in the place of the ``replaced`` one; InputError if this bicycle cannot have it."""
    typical, instance = _instance(model, effect, stated_values)
    values = instance.values(model.bicycle.values)
    ties: dict[str, str] = {}
    unknowns: list[UncertainParameter] = []
    shared = {p.name for p in replaced.parameters} if replaced is not None else set()
    loads = np.array(model.bicycle.static_loads)
    for p in effect.parameters:
        keys = [f"{effect.identifier}.{entry}" for entry in p.entries()]
        if p.name in shared and replaced is not None:
            ties |= {key: key.replace(effect.identifier, replaced.identifier, 1) for key in keys}
        elif isinstance(p.default, str) and p.name not in stated_values:
            ties |= {key: str(p.default) for key in keys}
        elif p.name not in stated_values:
            by_load = p.unit == "N/rad" and p.per_wheel
            sets = dict(zip(keys, loads / loads.mean(), strict=True)) if by_load else dict.fromkeys(keys, 1.0)
            if (u := _unknown(p, sets, typical.get(p.name), limit=bool(shared))) is not None:
                unknowns.append(replace(u, labels=WHEELS) if p.per_wheel else u)
    sizes = [u for u in unknowns if u.size]
    if len(sizes) > 1 and _vanishes_with(model, effect, values, sizes[0]):
        unknowns = [u for u in unknowns if not u.size or u is sizes[0]]  # the others only scale it
    return Candidate(
        effect.identifier,
        tuple(unknowns),
        effect,
        values,
        ties,
        replaced.identifier if replaced else None,
        effect.signature,
        effect.title,
        family=effect.family,
    )


def check_known(effect: type[Effect], stated_values: Mapping[str, Any]) -> None:
    """Refuse ``stated_values`` values that an ``effect`` cannot have."""
    middle = {p.name: _middle(p) for p in effect.parameters if p.name not in stated_values}
    effect(**{name: value for name, value in middle.items() if value is not None}, **stated_values)


def _instance(model: Model, effect: type[Effect], stated_values: Mapping[str, Any]) -> tuple[dict[str, Any], Effect]:
    """The effect in the middle of its typical ranges; a body that the bicycle cannot hold is made smaller."""
    middle = {p.name: stated_values.get(p.name, _middle(p)) for p in effect.parameters}
    typical = {name: value for name, value in middle.items() if value is not None}
    units = {p.name: p.unit for p in effect.parameters}
    heavy = [name for name in typical if units[name] in ("kg", "kg m^2") and name not in stated_values]
    for share in (1.0, 0.7, 0.5, 0.35):
        sizes = {name: share * value if name in heavy else value for name, value in typical.items()}
        try:
            instance = effect(**sizes)
            instance.check(model.parameters)
            break
        except InputError:
            if share == 0.35 or not heavy:
                raise
    return sizes, instance


def _middle(p: Parameter) -> float | None:
    """Middle of the typical range; None if a default is declared."""
    if p.default is not None:
        return None
    low, high = p.typical
    return math.sqrt(low * high) if p.by_factors else (low + high) / 2


def _unknown(p: Parameter, sets: dict[str, float], middle: float | None, *, limit: bool) -> UncertainParameter | None:
    """Unknown of a parameter with its prior; None if its typical range allows no fit."""
    low, high = p.typical
    if math.isinf(low) or math.isinf(high) or low == high:
        return None
    if p.neutral is not None and math.isinf(p.neutral):
        return compliance(p, sets)
    if p.neutral is not None or limit:
        scale, neutral = 0.5 * max(abs(low), abs(high)), p.neutral or 0.0
        lowest = SINGULAR * scale if limit else p.bounds[0]
        return UncertainParameter(
            p.name, p.unit, sets, neutral, scale, lowest, p.bounds[1], size=True, least=p.least, smallest=p.smallest
        )
    if p.by_factors:
        centre = math.log(middle or math.sqrt(low * high))
        return UncertainParameter(p.name, p.unit, sets, centre, p.spread, power=0)
    centre = next(x for x in (middle, p.default, (low + high) / 2) if isinstance(x, int | float))
    return UncertainParameter(p.name, p.unit, sets, centre, p.spread, *p.bounds)


def compliance(p: Parameter, sets: Mapping[str, float]) -> UncertainParameter:
    """Unknown of a stiffness by its compliance: half that of the softest typical one is one sigma."""
    scale, least = 0.5 / p.typical[0], 1 / p.least if p.least else 0.0
    return UncertainParameter(
        p.name, p.unit, sets, 0.0, scale, SINGULAR * scale, math.inf, power=-1, size=True, least=least
    )


def _vanishes_with(model: Model, effect: type[Effect], values: dict[str, float], size: UncertainParameter) -> bool:
    """True if the equations lose the effect at the neutral value of this one parameter, the others as they are."""
    evaluate = ModelFamily(model, further=(effect,)).evaluate
    parent = model.linear_model().ranges[0].matrices
    at_neutral = {**model.parameters, **values, **dict.fromkeys(size.sets, size.centre)}
    with np.errstate(divide="ignore", invalid="ignore"):  # where the neutral value is singular nothing vanishes
        reduced = evaluate(at_neutral, tuple(1.0 for _ in evaluate.symbolic.switches))
    if reduced.mass.shape != parent.mass.shape:
        return False
    pairs = [(reduced.mass, parent.mass)]
    pairs += [(matrix, parent.dynamics.get(power, 0 * matrix)) for power, matrix in reduced.dynamics.items()]
    return all(np.allclose(a, b, rtol=1e-9, atol=1e-9) for a, b in pairs)


def physical(candidate: Candidate, coordinates: Sequence[float]) -> Effect:
    """The effect of a ``candidate`` at its own ``coordinates``, for :meth:`Model.with_effect`."""
    values = dict(candidate.fixed)
    for u, x in zip(candidate.unknowns, coordinates, strict=True):
        values |= {key: factor * float(u.value(np.asarray(x))) for key, factor in u.sets.items()}
    return effect_of(candidate.effect, values)


# ---- terms without a cause: never named, they say in which direction to look ----


def feedback_terms() -> tuple[Candidate, ...]:
    """Steer and lean torque proportional to lean, steer and their rates, one candidate each."""
    terms = []
    declared = {p.name: p for effect in registry().values() if not effect.nameable for p in effect.parameters}
    for state in ("steer", "steer_rate", "lean", "lean_rate"):
        for torque in TORQUES:
            axis = torque.removesuffix("_torque")
            size = declared[f"{axis}_from_{state}"]
            scale = size.typical[1] / 2  # the upper end of the typical range is two sigma
            gain = UncertainParameter("gain", size.unit, {feedback_key(state, torque): 1.0}, 0.0, scale, size=True)
            terms.append(Candidate(f"{axis} torque from {state.replace('_', ' ')}", (gain,)))
    return tuple(terms)


def reversed_signs(candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
    """The one-sided effects of a single parameter among ``candidates``, with the opposite sign only."""
    reversed_candidates = []
    for c in candidates:
        if c.effect is None or c.replaces or len(c.unknowns) != 1:
            continue
        u = c.unknowns[0]
        if u.one_sided and u.power == 1:
            u = replace(u, lowest=-math.inf, highest=u.centre)
            reversed_candidates.append(replace(c, identifier=f"{c.identifier} with the wrong sign", unknowns=(u,)))
    return tuple(reversed_candidates)


# ---- nuisances ----


def nuisances(model: Model, stated_sd: Mapping[str, float]) -> tuple[tuple[UncertainParameter, ...], tuple[str, ...]]:
    """Unknowns of the base model that float in every fit, with prior sd, and notes on the defaults that were taken."""
    values = model.parameters
    _check(stated_sd, values, model)
    # A model under test is its author's claim: with the spread of all tyres its stiffnesses explain a missing camber
    # thrust (relaxation_length 40 % for 10 %), and what was named tentatively becomes "none".
    deviations = standard_deviations(model, stated_sd, typical=False)
    followers: dict[str, list[str]] = {}
    for follower, leader in model.tied.items():
        followers.setdefault(leader, []).extend([] if follower in deviations else [follower])
    assumed = [key for key, deviation in deviations.items() if deviation.origin == ASSUMED]
    notes: tuple[str, ...] = ()
    if assumed:
        notes = (f"no uncertainty given for {', '.join(assumed)}: documented defaults are used (standard uncertainty)",)
    together = [key for key in model.covariance.names if key in deviations and deviations[key].sd > 0]
    correlations = model.covariance.among(together)
    if (correlations != np.diag(np.diag(correlations))).any():
        notes += (
            f"{', '.join(together)}: their sd are used, their stated correlations are not; each is fitted as known by "
            "itself",
        )
    floating = {key: deviation.sd for key, deviation in deviations.items() if deviation.sd > 0}
    rod_keys = [key for keys in FRAMES if is_rod(values, keys) for key in keys if floating.pop(key, 0.0)]
    if rod_keys:
        notes += (f"{', '.join(rod_keys)} stay as stated: without a second principal inertia the frame is a rod",)
    inertias = inertia_coordinates(values, floating)
    places = {} if inertias is None else {key: place for place, key in enumerate(inertias.keys)}
    unknowns = []
    for key, sd in floating.items():
        parsed = ParameterKey.parse(key)
        effects = (effect for effect in model.effects if effect.identifier == parsed.effect)
        declared = next((p for effect in effects for p in effect.parameters if p.name == parsed.name), None)
        unit = declared.unit if declared else UNITS.get(key, "")
        sets = dict.fromkeys((key, *followers.get(key, ())), 1.0)
        u = UncertainParameter(key, unit, sets, values[key], sd, assumed=deviations[key].origin == ASSUMED)
        if inertias is not None and key in places:
            lowest = float(inertias.lowest[places[key]])
            unknowns.append(replace(u, lowest=lowest, coupling=inertias, place=places[key]))
        else:  # no lag becomes a lead, and no mass negative
            lowest, highest = declared.bounds if declared else bounds_beside(key, values)
            if key in POSITIVE:  # the equations divide by it
                lowest = SINGULAR * values[key]
            unknowns.append(replace(u, lowest=lowest, highest=highest))
    return tuple(unknowns), notes


def _check(stated_sd: Mapping[str, float], values: Mapping[str, float], model: Model) -> None:
    """Refuse stated standard deviations (SI, by parameter) that the base ``model`` cannot have."""
    present = {effect.identifier for effect in model.effects}
    for key, sd in stated_sd.items():
        absent, _, name = key.partition(".")
        if name and absent in registry() and absent not in present:
            raise InputError(
                f"[uncertainty]: unknown parameter {key!r}: the base model has no {absent}; if it is there, write "
                f"[effects.{absent}] {name.partition('.')[0]} = VALUE next to [uncertainty] {key} = {shown(sd)}, and "
                f"take [candidates.{absent}] out, whose values are taken as exact; otherwise take {key} out of "
                "[uncertainty]"
            )
        if key in UNUSED:
            raise InputError(f"[uncertainty]: {key} does not affect lateral motion; remove it")
        entries = entries_of(key, values)
        if not entries:
            raise InputError(f"[uncertainty]: {unknown('parameter', key, set(values) - set(UNUSED))}")
        if not is_number(sd) or not 0 <= sd < math.inf:
            raise InputError(
                f"[uncertainty]: {key} = {shown(sd)} must be a standard deviation >= 0 in SI units (0 fixes it)"
            )
        least = max(1e-9 * max(abs(values[entry]) for entry in entries), 1e-12)  # less is lost in rounding
        if 0 < sd < least:
            raise InputError(
                f"[uncertainty]: {key} = {sd:g} is below {least:.2g}, a billionth of its value, which no "
                "measurement reaches; give its standard deviation, or 0, which fixes it"
            )
