"""Do the 95 % intervals of `velotyre modal` hold the truth? SYNTHETIC decays of systems of known eigenvalues.

The decays come from the exact discretisation of linear systems with several modes, not from the functions that are
fitted. Counted, cell by cell: how often the interval of the real part, the imaginary part and the mode-shape ratio
(steer over roll rate) hold the truth, how many runs are refused, how many are widened because their start moves and in
how many a break is claimed, and the error beside that of the eigensystem realization algorithm of python-control on the
same samples (which is given the best of its roots, and has no intervals). The same once more for decays of one kind in
sets of ten, as `velotyre modal` is given the runs of one test, and where it is told whether the ground drives the
motion. Two cells are of repeats that scatter about a law in speed.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.identification.driven_together import together
from bicycle.identification.free_decay import Decay, identify_modes
from bicycle.identification.repeats import repeats
from bicycle.identification.run import Run
from studies.validations._decay_generator import Cell, Made, make
from tyre.base.arrays import Array

CELLS = {
    "white noise": Cell(),
    "coloured noise": Cell(colour=0.05),
    "offset, 1.1 to 1.4 cycles": Cell(cycles=(1.1, 1.4), offset=0.3),
    "coloured noise and offset, 1.1 to 1.6 cycles": Cell(cycles=(1.1, 1.6), colour=0.03, offset=0.2),
    "slow mode and offset, 1.8 to 3 cycles": Cell(cycles=(1.8, 3.0), slow=0.3, offset=0.2),
    "capsize that dies out, 1.0 to 1.4 cycles": Cell(
        cycles=(1.0, 1.4), noise=0.005, slow=1.0, slow_rate=(1.0, 5.0), damping=(-0.2, 0.1), offset=0.1
    ),
    "start transient (fast mode)": Cell(cycles=(2.0, 3.0), fast=0.4, offset=0.1),
    "weave and wobble": Cell(second=0.4, offset=0.1),
    "driven by the ground": Cell(driven=0.1, noise=0.05),
    "driven faintly by the ground": Cell(driven=0.03, noise=0.05),
    "driven by the ground, 15 to 25 cycles": Cell(cycles=(15, 25), damping=(0.005, 0.03), driven=0.1, noise=0.05),
    "noise half as large as the motion": Cell(noise=0.5),
}
TARGET = (93.0, 97.0)
PARTS = ("real", "imaginary", "ratio")
ERA_ORDER = 4
SET = 10  # decays that are weighed together
KINDS = {"": "coverage_percent", "_set": "coverage_in_sets_percent", "_told": "coverage_where_driving_is_told_percent"}


def run(*, out: Path, seed: int, draws: int = 400, workers: int = 2) -> dict[str, Any]:
    """Count the intervals that hold the truth.

    Parameters
    ----------
    out : Path
        Not used: the result is returned.
    seed : int
        Of the random numbers.
    draws : int
        Number of decays in each cell.
    workers : int
        Number of processes; the result does not depend on it.
    """
    from tyre.base.parallel import worker_pool
    from tyre.base.progress import progress_bar

    tasks = [
        (name, seed, range(first, min(first + SET, draws))) for name in CELLS for first in range(0, draws, SET)
    ]  # fmt: skip
    with worker_pool(workers) as pool:
        sets = list(progress_bar(pool.map(of_one_test, tasks), total=len(tasks), desc="sets of decays"))
    cells = {
        name: summary([row for (cell, *_), rows in zip(tasks, sets, strict=True) if cell == name for row in rows])
        for name in CELLS
    }
    return {
        "synthetic": True,
        "what": "stochastic linear systems, exactly discretised -> velotyre modal; coverage of 95 % intervals",
        "seed": seed, "draws_per_cell": draws, "target_percent": list(TARGET),
        "made_by": f"velotyre validate free-decays --seed {seed} --draws {draws}",
        "standard_error_percent": round(100 * math.sqrt(0.95 * 0.05 / draws), 2),
        "cells": cells,
        "repeats": {
            "scatter alone": scattered(seed, draws, outlier=False), "one outlier": scattered(seed, draws, outlier=True),
        },
        "in_each_set": SET,
        **{kind.replace("coverage", "beyond_target").replace("_percent", ""): _beyond(cells, kind)
           for kind in KINDS.values()},
    }  # fmt: skip


def _beyond(cells: dict[str, dict[str, Any]], which: str) -> list[str]:
    """Cell and part of the eigenvalue where a share is not in the target."""
    return [
        f"{name}: {part}" for name, cell in cells.items() for part in PARTS[:2]
        if not TARGET[0] <= cell[which][part] <= TARGET[1]
    ]  # fmt: skip


def of_one_test(task: tuple[str, int, Sequence[int]]) -> list[dict[str, float]]:
    """Make and identify some decays of a kind; ``task`` is the cell's name, the seed and the numbers of the draws."""
    name, seed, numbers = task
    cell = CELLS[name]
    made = [make(cell, np.random.default_rng([seed, list(CELLS).index(name), number])) for number in numbers]

    def fit(place: int, known: bool | Array | None) -> Sequence[Decay]:  # noqa: FBT001 (as identify_modes takes it)
        return identify_modes(made[place].run, len(made[place].roots), driven=known)

    places = range(len(made))
    alone = [fit(place, None) for place in places]
    others, _ = together(alone, fit)
    told = [fit(place, cell.driven > 0) for place in places]
    return [
        _counted(made[place], alone[place][0], {"_set": others[place][0], "_told": told[place][0]}) for place in places
    ]


def _counted(made: Made, found: Decay, more: Mapping[str, Decay]) -> dict[str, float]:
    """What is counted of a decay that is ``found`` alone, and with ``more`` known of what drives it."""
    truth = made.roots[0]
    era = by_realization(made.run, truth)
    row = {"refused": float(bool(found.rejected)), "era": abs(era - truth) / abs(truth)}
    for kind, decay in more.items():
        if not decay.rejected:
            row |= {part + kind: inside for part, inside in _inside(decay, made).items()}
    if found.rejected:
        return row
    moved = found.movement is not None and found.movement.what != ""
    return row | _inside(found, made) | {
        "error": abs(found.eigenvalue - truth) / abs(truth), "sd": math.hypot(*found.sd) / abs(truth),
        "widened": float(moved), "broken": float(found.broken is not None),
    }  # fmt: skip


def _inside(found: Decay, made: Made) -> dict[str, float]:
    """Whether the intervals hold the truth; of a ratio, which share of its two parts."""
    error = found.eigenvalue - made.roots[0]
    value, sd = found.ratios["steer_over_lean"]
    miss = value - made.ratio
    return {
        "real": float(abs(error.real) < 1.96 * found.sd[0]), "imaginary": float(abs(error.imag) < 1.96 * found.sd[1]),
        "ratio": float(abs(miss.real) < 1.96 * sd) / 2 + float(abs(miss.imag) < 1.96 * sd) / 2,
    }  # fmt: skip


def summary(rows: list[dict[str, float]]) -> dict[str, Any]:
    """Shares and medians of the ``rows`` of a cell, as :func:`of_one_test` gives them."""
    used = [row for row in rows if not row["refused"]]

    def share(part: str) -> float:
        return round(100 * float(np.mean([row[part] for row in rows if part in row])), 1)

    def middle(part: str) -> float:
        return round(100 * float(np.median([row[part] for row in used])), 2)

    return {
        "refused": len(rows) - len(used), "widened_for_start": sum(row["widened"] > 0 for row in used),
        "break_claimed": sum(row["broken"] > 0 for row in used),
        **{name: {part: share(part + kind) for part in PARTS} for kind, name in KINDS.items()},
        "median_sd_percent": middle("sd"), "median_error_percent": middle("error"),
        "median_error_of_realization_percent": middle("era"),
    }  # fmt: skip


def by_realization(run: Run, truth: complex) -> complex:
    """The root nearest the ``truth`` of a realization of a ``run``, 1/s (Juang & Pappa 1985), by python-control."""
    import control

    signals = np.stack(list(run.channels.values()))[:, None, :]
    size = signals.shape[2] // 2 - 1
    system, _ = control.eigensys_realization(signals, ERA_ORDER, size, size)
    roots = np.log(np.linalg.eigvals(system.A).astype(complex)) / run.step
    return complex(roots[int(np.argmin(np.abs(roots - truth)))])


def scattered(seed: int, draws: int, *, outlier: bool) -> dict[str, Any]:
    """Coverage of a law in speed by runs whose eigenvalue scatters, of which one may be an outlier.

    Three speeds, three runs at each within 2 %; each run's sd is a fifth of the scatter.

    Parameters
    ----------
    seed, draws : int
        As :func:`run`; the number of sets of nine runs.
    outlier : bool
        One of the nine is eight times the scatter away.
    """
    generator = np.random.default_rng([seed, 99, int(outlier)])
    held, of_outlier = [], []
    for _ in range(draws):
        speeds = np.repeat([4.0, 5.0, 6.0], 3) * generator.uniform(0.99, 1.01, 9)
        truth = -0.2 - 0.4 * (speeds - 4) + 0.05 * (speeds - 4) ** 2
        values = truth + generator.normal(0, 0.25, 9) + generator.normal(0, 0.05, 9)
        wrong = int(generator.integers(9)) if outlier else -1
        if outlier:
            values[wrong] += generator.choice([-1, 1]) * 2.0
        inside = np.abs(values - truth) < 1.96 * repeats(speeds, values, np.full(9, 0.05)).sd
        held += [bool(x) for k, x in enumerate(inside) if k != wrong]
        of_outlier += [bool(inside[wrong])] if outlier else []
    result = {"runs": len(held), "coverage_percent": round(100 * float(np.mean(held)), 1)}
    return result | ({"coverage_of_the_outlier_percent": round(100 * float(np.mean(of_outlier)), 1)} if outlier else {})
