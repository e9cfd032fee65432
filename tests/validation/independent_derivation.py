"""Eigenvalues of random models against Kane's equations with exact rotations, linearised by complex steps.

Every effect of :data:`EFFECTS` alone, and random ones together, on packaged bicycles with every parameter off by up to
15 % and effects anywhere in their typical range (synthetic); on relaxing tyres and without slip. The error of an
eigenvalue is relative to max(|lambda|, 1/s), that of the side wind's input column to its largest entry.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from bicycle import Model, available_bicycles, effect_class, load_bicycle
from tests.validation.kane_bicycle import KaneBicycle
from tests.validation.random_models import random_effect
from tyre.errors import InputError

EFFECTS = (
    "aerodynamic_drag", "longitudinal", "fork_bending", "rear_compliance", "rotating_mass", "overturning_moment",
    "front_compliance", "rider_lean", "crown_radius", "camber_thrust", "pneumatic_trail",
)  # fmt: skip
OF_TYRES = ("camber_thrust", "pneumatic_trail")
TARGET = 1e-9


def run(*, out: Path, seed: int, bicycles: int = 30) -> dict[str, Any]:
    """Compare a number of ``bicycles`` with every effect alone, and as many with random ones, each at its speed."""
    rng = np.random.default_rng(seed)
    found: dict[str, list[float]] = {}
    for _ in range(bicycles):
        for held in (False, True):
            usable = [name for name in EFFECTS if not (held and name in OF_TYRES)]
            together = [name for name in usable if rng.random() < 0.6]
            for what, chosen in (*((name, [name]) for name in usable), ("together", together)):
                error = largest_error(draw(rng, chosen, held=held), float(rng.uniform(2.0, 25.0)))
                found.setdefault(f"{what}, {'no slip' if held else 'relaxing tyres'}", []).append(error)
    return {
        "target": TARGET,
        "models": sum(map(len, found.values())),
        "largest_error": max(map(max, found.values())),
        "by_effect": {what: {"models": len(e), "largest_error": max(e)} for what, e in sorted(found.items())},
    }


def draw(rng: np.random.Generator, effects: list[str], *, held: bool) -> Model:
    """A random bicycle with these effects, whose wheels keep to the road."""
    while True:
        base = load_bicycle(str(rng.choice(available_bicycles())))
        changes = {key: value * rng.uniform(0.85, 1.15) for key, value in base.values.items() if key != "g"}
        law = [] if held else ["relaxation_length"]
        try:
            model = Model(base.replace(**changes), [random_effect(effect_class(e), rng) for e in (*law, *effects)])
            model.linear_model()
            return model
        except InputError:
            continue


def largest_error(model: Model, speed: float) -> float:
    """Largest relative error of eigenvalues and of the side wind's column at a speed (m/s)."""
    kane = KaneBicycle(model.parameters, [effect.identifier for effect in model.effects], speed)
    names, matrix, wind = kane.state_matrix()
    linear = model.linear_model()
    expected, values = linear.eigenvalues(speed), np.linalg.eigvals(matrix)
    errors = []
    if len(values) > len(expected):  # the slips that are held: two roots of zero
        values = values[np.argsort(np.abs(values))]
        errors, values = [float(np.abs(values[:2]).max())], values[2:]
    distance = np.abs(expected[:, None] - values) / np.maximum(np.abs(values), 1)
    errors.append(float(distance[linear_sum_assignment(distance)].max()))
    if "side_wind" in linear.inputs and set(names) == set(linear.states):
        column = linear.matrices_at(speed)[1][[linear.states.index(n) for n in names], linear.inputs.index("side_wind")]
        errors.append(float(np.abs(column - wind).max() / np.abs(wind).max()))
    return max(errors)
