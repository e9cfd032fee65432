"""Names and critical speeds of random models in batches against the full track of each model, which is the judge.

At speeds drawn at random every root must have the same names, and every critical speed the same speed (1e-9 m/s), mode,
direction and frequency. Bicycles of which a batch is not sure are counted by reason; the judge answers for them. All
models are random (synthetic): sets of effects, and of each set several bicycles; every other one has effects up to a
hundred times too large or too small. Batches in plain numpy name only.
"""

import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.critical.pencil import crossings_by_pencil
from bicycle.eigenvalues.solvers import Solver, compiled, default_solver, lapack
from bicycle.linear_model import LinearModel
from bicycle.modal.batch import name_of, name_roots
from bicycle.modal.block import Block
from bicycle.modal.named_modes import Modes, modes
from studies.validations._random_models import random_model, relative
from studies.validations.critical_speeds import LAWS, WILD
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError

CHUNK = 200  # models drawn and compared together, from a seed of their own
RELATIVES = 20  # models with the same effects
SPEEDS = (0.5, 40.0, 60)  # slowest, fastest (m/s) and number
SAME_SPEED = 1e-9  # m/s
SAME_ROOT = 1e-6  # of the largest: a root is the same one
SWITCHES = "equations that switch at a speed"


def run(*, out: Path, seed: int, models: int = 1000, minutes: int = 0, numpy: bool = False) -> dict[str, Any]:
    """Compare random models; ``different`` lists those that a batch answers otherwise than the judge.

    Parameters
    ----------
    out : Path
        Folder for tables; unused.
    seed : int
        Of the random numbers.
    models : int
        Number of models.
    minutes : int
        Number of minutes (min) after which it stops, with the models compared until then; 0: never.
    numpy : bool
        Compare batches in plain numpy, which are those without numba, instead of compiled ones.
    """
    from tyre.base.progress import progress_bar

    end = time.monotonic() + 60 * minutes if minutes else np.inf
    solver = lapack if numpy else default_solver()
    result: dict[str, Any] = {"seed": seed, "path": solver.__name__, "models": 0, "speeds_each": SPEEDS[2], "named": 0}
    result |= {
        "with_critical_speeds": 0,
        "critical_speeds": 0,
        "not_sure_of_names": Counter(),
        "not_sure_of_critical_speeds": Counter(),
    }
    result |= {"refused": 0, "different": []}
    for number in progress_bar(range(-(-models // CHUNK)), desc="chunks"):
        if time.monotonic() > end:
            break
        count = min(CHUNK, models - number * CHUNK)
        _compare(np.random.default_rng((seed, number)), count, number * CHUNK, solver, result)
        result["models"] += count
    return result | {key: dict(sorted(result[key].items())) for key in result if key.startswith("not_sure")}


def _compare(
    generator: np.random.Generator, count: int, first: int, solver: Solver, result: dict[str, Any]
) -> None:  # fmt: skip
    """Draw ``count`` models and compare them kind by kind."""
    kinds, drawn = defaultdict(list), None
    speeds = np.sort(generator.uniform(*SPEEDS))
    for number in range(count):
        decades = WILD if number % 2 else 0.0
        drawn = relative(drawn, generator, decades=decades) if drawn and number % RELATIVES else None
        drawn = drawn or random_model(generator, contact_laws=LAWS, share=0.25, decades=decades)
        model = drawn.linear_model()
        kinds[model.effects, len(model.ranges), tuple(sorted(model.coefficients[0]))].append((first + number, model))
    for (_, ranges, _), found in kinds.items():
        if ranges > 1:
            for which in ("not_sure_of_names", "not_sure_of_critical_speeds"):
                result[which][SWITCHES] += len(found)
        else:
            block = Block.of_models([model for _, model in found])
            _compare_names(found, block, speeds, solver, result)
            if solver is compiled:
                _compare_crossings(found, block, result)


def _compare_names(
    found: Sequence[tuple[int, LinearModel]], block: Block, speeds: Array, solver: Solver, result: dict[str, Any]
) -> None:  # fmt: skip
    named = name_roots(block, np.tile(speeds, (len(found), 1)), solver=solver)
    result["not_sure_of_names"].update(named.unsure)
    for k, (number, model) in enumerate(found):
        if not named.status[k]:
            result["named"] += 1
            names = {int(bits): name_of(int(bits), named.names) for bits in np.unique(named.bits[k])}
            called = [[names[int(b)] for b in row] for row in named.bits[k]]
            wrong = differing_names(modes(model, speeds), named.values[k], called)
            where = {"model": number, "effects": list(model.effects)}
            result["different"] += [{**where, "at_m_s": [float(v) for v in speeds[wrong]]}] if wrong else []


def _compare_crossings(found: Sequence[tuple[int, LinearModel]], block: Block, result: dict[str, Any]) -> None:
    from bicycle.critical.batch import critical_speeds_of

    crossings = critical_speeds_of(block, SPEEDS[1])
    result["not_sure_of_critical_speeds"].update(crossings.unsure)
    for k, (number, model) in enumerate(found):
        if not crossings.status[k]:
            try:
                judged = crossings_by_pencil(model, SPEEDS[1])
            except InputError:
                result["refused"] += 1
                continue
            result["with_critical_speeds"] += 1
            result["critical_speeds"] += len(judged)
            if not same_crossings(crossings.of(k), judged):
                said = [[repr(c) for c in every] for every in (crossings.of(k), judged)]
                where = {"model": number, "effects": list(model.effects)}
                result["different"].append({**where, "batch": said[0], "judge": said[1]})


def differing_names(judged: Modes, values: Complex, names: Sequence[Sequence[str]]) -> list[int]:
    """Indices of the speeds at which roots (m, n) in 1/s have other ``names`` (m, n) than judged.

    Parameters
    ----------
    judged : Modes
    values : complex ndarray, shape (m, n)
        1/s.
    names : sequence of sequences of str
        Of each root at each speed.
    """
    wrong = []
    for k, (row, called) in enumerate(zip(values, names, strict=True)):
        for name in {*judged.branches, *called}:
            mine = [z for z, own in zip(row, called, strict=True) if own == name and z.imag >= 0]
            theirs = judged.branches[name][k] if name in judged.branches else np.empty(0, complex)
            theirs = theirs[~np.isnan(theirs)]
            far = (
                np.sort_complex(np.array(mine, complex)) - np.sort_complex(theirs)
                if len(mine) == len(theirs)
                else np.inf
            )
            if np.any(np.abs(far) > SAME_ROOT * np.abs(row).max()):
                wrong.append(k)
                break
    return wrong


def same_crossings(ours: Sequence[CriticalSpeed], judged: Sequence[CriticalSpeed]) -> bool:
    """Whether two lists of critical speeds are the same, ``ours`` and those ``judged``."""
    return len(ours) == len(judged) and all(
        abs(a.speed - b.speed) <= SAME_SPEED and (a.mode, a.kind, a.direction) == (b.mode, b.kind, b.direction)
        and abs(a.frequency_hz - b.frequency_hz) <= SAME_ROOT * (1 + b.frequency_hz)
        for a, b in zip(ours, judged, strict=True)
    )  # fmt: skip
