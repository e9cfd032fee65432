"""Eigenvalues of effects together against Kane's equations with exact rotations, linearised by complex steps.

Every effect alone, every pair and random triples, each on every contact law that it can stand on: packaged bicycles
with every parameter off by up to 15 %, effects anywhere in their typical range (synthetic), any speed from 2 to 25 m/s.
An effect that needs another brings it. The error of an eigenvalue is relative to max(|lambda|, 1/s), that of the side
wind's input column to its largest entry. Of every pair two things more are asked, on one contact law, for which nothing
but the package is needed. The order in which effects are added changes no root. An effect at its neutral value leaves
the roots of the other one alone, beside those that it brings itself.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from bicycle.effects import WHEELS, packaged_effects
from bicycle.equations import Evaluator, derive
from bicycle.files import available_bicycles, load_bicycle
from bicycle.model import LinearModel, Model, check_compatible, linear_model
from tests.validation.kane_bicycle import KaneBicycle
from tests.validation.random_models import random_effect
from tyre.ground import InputError

EFFECTS = packaged_effects()
LAWS = ("relaxation_length", "side_slip", "no_slip")
OTHERS = tuple(name for name, effect in EFFECTS.items() if effect.slot != "contact law")
TARGETS = {
    "alone": 1e-9, "pairs": 1e-9, "triples": 1e-9, "order": 1e-10, "neutral": 1e-9, "neutral_limits": 1e-6,
}  # fmt: skip
HINGES = ("front_compliance", "rear_compliance", "fork_bending", "rider_lean", "rider_saddle", "rider_saddle_roll")
CARRIERS = {"rider_control": "rider torque", "rider_saddle": "seated rider"}  # effect -> what others need of it
OFF = {"rider_path": ("heading", "position"), "rider_steer_memory": ("gain",)}
VANISHING: dict[str, Callable[[float], dict[str, float]]] = {
    "rider_hands": lambda size: {"mass": size, "stiffness": 0.0, "damping": 0.0},
    "contact_length": lambda size: {f"half_length.{wheel}": size for wheel in WHEELS},
    "steer_motor": lambda size: {"share": 1.0, "lag": size},
    "rider_delay": lambda size: {"delay": size},
}
"""Values of an effect that vanishes in a limit only, as a size goes to 0: roots are drawn on to 0 by a parabola."""
SIZES = (4e-5, 2e-5, 1e-5)


def run(*, out: Path, seed: int, alone: int = 5, triples: int = 300) -> dict[str, Any]:
    """Compare every effect on ``alone`` bicycles, every pair on one, and a number of ``triples``."""
    rng = np.random.default_rng(seed)
    errors: dict[str, dict[str, float]] = {kind: {} for kind in TARGETS}
    refused: dict[str, str] = {}
    for name in OTHERS:
        for law in laws_of([name]):
            errors["alone"][f"{name}, {law}"] = max(worst_error(rng, [law, name]) for _ in range(alone))
    for pair in combinations(OTHERS, 2):
        reason = refusal(pair)
        if reason:
            refused[" + ".join(pair)] = reason
        laws = [] if reason else laws_of(pair)
        asked_on = str(rng.choice(laws)) if laws else ""  # order and neutral values once a pair
        for law in laws:
            key, model = f"{' + '.join(pair)}, {law}", draw(rng, [law, *pair])
            speed = draw_speed(rng)
            errors["pairs"][key] = largest_error(model, speed)
            if law != asked_on:
                continue
            errors["order"][key] = order_error(model, speed)
            for name in pair:
                if name in CARRIERS and any(CARRIERS[name] in EFFECTS[other].requires for other in pair):
                    continue  # muscles give what the other one tells them; the seat carries what rolls on it
                kind = "neutral_limits" if name in VANISHING else "neutral"
                errors[kind][f"{key}, {name} neutral"] = neutral_error(model, name, speed)
    while len(errors["triples"]) < triples:
        chosen = sorted(rng.choice(OTHERS, 3, replace=False).tolist())
        laws = [] if refusal(chosen) else laws_of(chosen)
        if laws:
            law = str(rng.choice(laws))
            errors["triples"][f"{' + '.join(chosen)}, {law}"] = worst_error(rng, [law, *chosen])
    return {kind: summary(by_set, TARGETS[kind]) for kind, by_set in errors.items()} | {"refused_pairs": refused}


def summary(errors: dict[str, float], target: float) -> dict[str, Any]:
    """Count the sets of effects, and show the largest error and the sets that miss the target."""
    worst = max(errors, key=lambda key: errors[key])
    missed = {key: error for key, error in errors.items() if not error < target}
    return {
        "models": len(errors), "target": target, "largest_error": errors[worst], "largest_of": worst, "missed": missed,
    }  # fmt: skip


def refusal(names: Iterable[str]) -> str:
    """Reason why effects cannot be combined on any contact law; empty if they can."""
    reasons = []
    for law in LAWS:
        try:
            check_compatible(
                tuple(random_effect(EFFECTS[name], np.random.default_rng(0)) for name in whole(law, names))
            )
        except InputError as error:
            reasons.append(str(error))
    return reasons[0] if len(reasons) == len(LAWS) else ""


def laws_of(names: Sequence[str]) -> list[str]:
    """Contact laws on which effects can stand."""
    needs = {need for name in whole("", names)[1:] for need in EFFECTS[name].requires}
    others = {thing for name in whole("", names)[1:] for thing in EFFECTS[name].provides}
    return [law for law in LAWS if needs <= others | set(EFFECTS[law].provides)]


def whole(law: str, names: Iterable[str]) -> list[str]:
    """A contact law, effects, and those that they need beside it."""
    sources = {"motor command": "steer_assist", "rider torque": "rider_control", "seated rider": "rider_saddle"}
    needed = [sources[need] for name in names for need in EFFECTS[name].requires if need in sources]
    return list(dict.fromkeys([law, *names, *needed]))


def draw(rng: np.random.Generator, names: Sequence[str]) -> Model:
    """A random bicycle with a contact law and effects, whose wheels keep to the road."""
    law, *others = names
    while True:
        base = load_bicycle(str(rng.choice(available_bicycles())))
        changes = {key: value * rng.uniform(0.85, 1.15) for key, value in base.values.items() if key != "g"}
        try:
            model = Model(base.replace(**changes), [random_effect(EFFECTS[name], rng) for name in whole(law, others)])
            model.linear_model()
            return model
        except InputError:
            continue


def draw_speed(rng: np.random.Generator) -> float:
    """A speed, m/s."""
    return float(rng.uniform(2.0, 25.0))


def worst_error(rng: np.random.Generator, names: Sequence[str]) -> float:
    """Largest error of a random model with a contact law and effects at a random speed."""
    return largest_error(draw(rng, names), draw_speed(rng))


def largest_error(model: Model, speed: float) -> float:
    """Largest relative error of eigenvalues and of the side wind's column at a speed (m/s)."""
    kane = KaneBicycle(model.parameters, [effect.identifier for effect in model.effects], speed)
    names, matrix, wind = kane.state_matrix()
    linear = model.linear_model()
    assert set(names) == set(linear.states)
    error = distance(linear.eigenvalues(speed), np.linalg.eigvals(matrix))
    if "side_wind" in linear.inputs and np.abs(wind).max() > 0:
        column = linear.matrices_at(speed)[1][[linear.states.index(n) for n in names], linear.inputs.index("side_wind")]
        error = max(error, float(np.abs(column - wind).max() / np.abs(wind).max()))
    return error


def partners(some: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The partners of ``some`` eigenvalues among ``others``, by the least distance relative to max(|z|, 1/s)."""
    apart = np.abs(some[:, None] - others) / np.maximum(np.abs(some), 1)[:, None]
    return others[linear_sum_assignment(apart)[1]]


def distance(some: np.ndarray, others: np.ndarray) -> float:
    """Largest distance of ``some`` eigenvalues from their partners among ``others``, relative to max(|z|, 1/s)."""
    return float((np.abs(some - partners(some, others)) / np.maximum(np.abs(some), 1)).max())


def order_error(model: Model, speed: float) -> float:
    """Change of the roots if the effects are added to the equations the other way round."""
    kinds = [type(effect) for effect in model.effects]
    turned = linear_model(Evaluator(derive(tuple(reversed(kinds)))), model.parameters, model)
    return distance(model.linear_model().eigenvalues(speed), turned.eigenvalues(speed))


def neutral_error(model: Model, name: str, speed: float) -> float:
    """Change of the roots of a model without an effect when the effect is added at its neutral value.

    A hinge of infinite stiffness is one whose angle and rate are struck out of the equations.
    """
    given = EFFECTS[name].provides
    without = [e for e in model.effects if e.identifier != name and not set(e.requires) & set(given)]
    roots = Model(model.bicycle, without).linear_model().eigenvalues(speed)

    def with_values(values: dict[str, float]) -> LinearModel:
        changed = {f"{name}.{key}": value for key, value in values.items()}
        return linear_model(model.evaluator, model.parameters | changed, model)

    if name in HINGES:
        return distance(roots, locked(model.linear_model(), name, speed))
    if name in VANISHING:
        nearly = [partners(roots, with_values(VANISHING[name](size)).eigenvalues(speed)) for size in SIZES]
        limit = np.linalg.solve(np.vander(SIZES, increasing=True), np.array(nearly))[0]
        return float((np.abs(limit - roots) / np.maximum(np.abs(roots), 1)).max())
    declared = [p for p in EFFECTS[name].parameters if p.neutral is not None]
    neutral = {entry: p.neutral for p in declared for entry in p.entries()} | dict.fromkeys(OFF.get(name, ()), 0.0)
    return distance(roots, with_values(neutral).eigenvalues(speed))


def locked(model: LinearModel, hinge: str, speed: float) -> np.ndarray:
    """Eigenvalues of a model one of whose hinges does not move."""
    kept = [k for k, state in enumerate(model.states) if state not in (hinge, f"{hinge}_rate")]
    place = next(k for k, part in enumerate(model.ranges) if part.lower < speed <= part.upper)
    matrices = model.ranges[place].matrices
    mass, dynamics = (part[np.ix_(kept, kept)] for part in (matrices.mass, matrices.dynamics(speed)))
    return np.linalg.eigvals(np.linalg.solve(mass, dynamics))
