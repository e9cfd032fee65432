"""Names of modes by judges that share nothing with their rules, and critical speeds against a dense scan.

Wobble: the pair that a small steer damper moves most. Weave and capsize: the slowest pair and the slowest real root of
lean and steer, and that with the largest lean among the angles, wherever the two judges agree. Bicycles are random
ones around packaged bicycles, on random tyres. Critical speeds of random models are compared as in the study
critical-speeds, models that are too stiff left aside.
"""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import LinearModel, Model, critical_speeds, modes
from tests.bicycle.stability.test_naming_judges import HINGE, built, judged, random_bicycles
from tests.validation.critical_speeds import LAWS, WILD, off_axis, unexplained
from tests.validation.random_models import random_model
from tyre.ground import InputError

SETS: dict[str, dict[str, Any]] = {"eight_states": {}, "flexible_front": {"front_compliance": HINGE}}
SPEEDS = np.linspace(3.0, 30.0, 19)  # m/s
FASTEST = 40.0  # m/s


def run(*, out: Path, seed: int, bicycles: int = 60, models: int = 1000) -> dict[str, Any]:
    """Judge the names of ``bicycles`` a set of effects, and check the critical speeds of ``models``."""
    from tyre.ground import progress_bar

    result: dict[str, Any] = {"seed": seed, "bicycles_a_set": bicycles, "models": models, "sets": {}}
    for number, (name, effects) in enumerate(SETS.items()):
        wobble = judged(seed + number, bicycles, SPEEDS, **effects)
        shapes = Counter[str]()
        for bicycle, table in random_bicycles(seed + 100 + number, bicycles, **effects):
            shapes.update(by_shape(built(bicycle, **table)))
        result["sets"][name] = {key.replace(" ", "_"): count for key, count in sorted((dict(wobble) | shapes).items())}
    generator, refused, wrong, crossings = np.random.default_rng(seed), 0, [], 0
    for number in progress_bar(range(models), desc="models"):
        decades = WILD if number % 2 else 0.0
        model = random_model(generator, contact_laws=LAWS, share=0.25, decades=decades).linear_model()
        try:
            found = critical_speeds(model, FASTEST)
        except InputError:
            refused += 1
            continue
        crossings += len(found)
        wrong += [{"model": number, "between_m_s": between} for between in unexplained(model, found)]
        wrong += [{"model": number, "off_axis_m_s": c.speed} for c in found if off_axis(model, c)]
    return result | {"crossings": crossings, "too_stiff": refused, "lost_or_spurious": wrong}


def by_shape(model: Model) -> Counter[str]:
    """How often two judges agree on weave and on capsize, and how often these are named so, in doubt or otherwise."""
    linear, told = model.linear_model(), Counter[str]()
    found = modes(linear, SPEEDS)
    for k, speed in enumerate(SPEEDS):
        values, lean = lean_shares(linear, speed)
        size = np.abs(values)
        for mode, own in (("weave", values.imag > 1e-9 * size.max()), ("capsize", values.imag == 0)):
            if not own.any():
                continue
            slowest, leaning = (np.where(own, x, -np.inf).argmax() for x in (-size, lean))
            if slowest != leaning:
                continue
            rows = [(name, z) for name, branch in found.branches.items() for z in branch[k] if not np.isnan(z)]
            name = min(rows, key=lambda row: abs(row[1] - values[slowest]))[0].split("+")
            told[f"{mode} points"] += 1
            told[f"{mode} agree"] += name[0] == mode
            told[f"{mode} otherwise"] += mode not in name
    return told


def lean_shares(model: LinearModel, speed: float) -> tuple[Any, Any]:
    """Eigenvalues (n,) at a speed and the share of lean among lean, steer and yaw in each, from the physical states."""
    values, vectors = np.linalg.eig(model.matrices_at(speed)[0])
    values = values.astype(complex)
    lean, steer = (np.abs(vectors[model.states.index(name)]) for name in ("lean", "steer"))
    yaw = np.abs(vectors[model.states.index("yaw_rate")]) / np.maximum(np.abs(values), 1e-300)
    return values, lean / (lean + steer + yaw)
