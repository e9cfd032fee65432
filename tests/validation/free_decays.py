"""Do the 95 % intervals of `velotyre modal` hold the truth? SYNTHETIC decays of systems of known eigenvalues.

The decays come from the exact discretisation of linear systems with several modes, not from the functions that are
fitted. Counted by cell: how often the intervals of real part, imaginary part and mode-shape ratio (steer over roll
rate) hold the truth, how many runs are refused, and the error beside that of the eigensystem realization algorithm of
python-control on the same samples. Counted too are repeats: numbers that scatter about a law in speed, and runs that
the ground drives, four at each of three speeds.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.identification import Decay, Run, identify_modes, repeats
from studies.motion import judge_decays
from tests.validation.decay_generator import Cell, Made, make

CELLS = {
    "white noise": Cell(),
    "coloured noise": Cell(colour=0.05),
    "offset, 1.1 to 1.4 cycles": Cell(cycles=(1.1, 1.4), offset=0.3),
    "slow mode and offset, 1.8 to 3 cycles": Cell(cycles=(1.8, 3.0), slow=0.3, offset=0.2),
    "start transient (fast mode)": Cell(cycles=(2.0, 3.0), fast=0.4, offset=0.1),
    "weave and wobble": Cell(second=0.4, offset=0.1),
    "driven by the ground": Cell(driven=0.1, noise=0.05),
    "driven faintly by the ground": Cell(driven=0.03, noise=0.05),
}
TARGET = (93.0, 97.0)
PARTS = ("real", "imaginary", "ratio")


def run(*, out: Path, seed: int, draws: int = 400, workers: int = 2) -> dict[str, Any]:
    """Count the intervals that hold the truth in a number of ``draws`` of each cell, in ``workers`` processes."""
    from tyre.ground import progress_bar, worker_pool

    tasks = [(name, seed, number) for name in CELLS for number in range(draws)]
    sets = [(seed, number) for number in range(max(draws // 4, 1))]
    if workers == 1:
        rows = [one_decay(task) for task in progress_bar(tasks, desc="decays")]
        driven = [driven_set(task) for task in progress_bar(sets, desc="sets")]
    else:
        with worker_pool(workers) as pool:
            rows = list(progress_bar(pool.map(one_decay, tasks, chunksize=10), total=len(tasks), desc="decays"))
            driven = list(progress_bar(pool.map(driven_set, sets), total=len(sets), desc="sets"))
    return {
        "target_percent": list(TARGET),
        "standard_error_percent": round(100 * math.sqrt(0.95 * 0.05 / draws), 2),
        "cells": {n: summary([r for t, r in zip(tasks, rows, strict=True) if t[0] == n]) for n in CELLS},
        "repeats": {
            "scatter alone": scattered(seed, draws, outlier=False), "one outlier": scattered(seed, draws, outlier=True),
            "driven by the ground, four at each of three speeds": set_summary([row for rows in driven for row in rows]),
        },
    }  # fmt: skip


def one_decay(task: tuple[str, int, int]) -> dict[str, float]:
    """Make and identify one decay; ``task`` is the cell's name, the seed and the number of the draw."""
    name, seed, number = task
    made = make(CELLS[name], np.random.default_rng([seed, list(CELLS).index(name), number]))
    found, truth = identify_modes(made.run, len(made.roots))[0], made.roots[0]
    row = {"refused": float(bool(found.rejected)), "era": abs(by_realization(made.run, truth) - truth) / abs(truth)}
    if found.rejected:
        return row
    error, sd = abs(found.eigenvalue - truth) / abs(truth), math.hypot(*found.sd) / abs(truth)
    return row | _inside(found, made) | {"error": error, "sd": sd}


def driven_set(task: tuple[int, int]) -> list[dict[str, float]]:
    """Make runs that the ground drives, four at each of three speeds, and judge them as one command does."""
    seed, number = task
    cell, decays, roots = CELLS["driven by the ground"], [], []
    for speed in (4.0, 5.0, 6.0):
        root = make(cell, np.random.default_rng([seed, 98, number, int(speed)])).roots[0]
        for repeat in range(4):
            made = make(cell, np.random.default_rng([seed, 98, number, int(speed), repeat]), root=root, speed=speed)
            decays.append(("weave", identify_modes(made.run, 1)[0]))
            roots.append(root)
    rows = []
    for one, root in zip(judge_decays(decays), roots, strict=True):
        error, sd = one.decay.eigenvalue - root, one.decay.sd
        inside = {"real": float(abs(error.real) < 1.96 * sd[0]), "imaginary": float(abs(error.imag) < 1.96 * sd[1])}
        rows.append({"refused": float(bool(one.rejected))} | inside)
    return rows


def set_summary(rows: list[dict[str, float]]) -> dict[str, Any]:
    """Give the share (%) of the intervals of runs in sets that hold the truth."""
    used = [row for row in rows if not row["refused"]]
    shares = {part: round(100 * float(np.mean([row[part] for row in used])), 1) for part in PARTS[:2]} if used else None
    return {"runs": len(rows), "refused": len(rows) - len(used), "coverage_percent": shares}


def _inside(found: Decay, made: Made) -> dict[str, float]:
    """Tell which intervals hold the truth; of a ratio, which share of its two parts."""
    error = found.eigenvalue - made.roots[0]
    value, sd = found.ratios["steer_over_lean"]
    miss = value - made.ratio
    return {
        "real": float(abs(error.real) < 1.96 * found.sd[0]), "imaginary": float(abs(error.imag) < 1.96 * found.sd[1]),
        "ratio": float(abs(miss.real) < 1.96 * sd) / 2 + float(abs(miss.imag) < 1.96 * sd) / 2,
    }  # fmt: skip


def summary(rows: list[dict[str, float]]) -> dict[str, Any]:
    """Give shares and medians (%) of the ``rows`` of a cell."""
    used = [row for row in rows if not row["refused"]]

    def middle(part: str) -> float | None:
        return round(100 * float(np.median([row[part] for row in used])), 2) if used else None

    coverage = {part: round(100 * float(np.mean([row[part] for row in used])), 1) for part in PARTS} if used else None
    return {
        "refused": len(rows) - len(used), "coverage_percent": coverage,
        "median_sd_percent": middle("sd"), "median_error_percent": middle("error"),
        "median_error_of_realization_percent": middle("era"),
    }  # fmt: skip


def by_realization(run: Run, truth: complex) -> complex:
    """Find the root nearest the ``truth`` of a realization of a ``run``, 1/s (Juang & Pappa 1985)."""
    import control

    signals = np.stack(list(run.channels.values()))[:, None, :]
    size = signals.shape[2] // 2 - 1
    system, _ = control.eigensys_realization(signals, 4, size, size)
    roots = np.log(np.linalg.eigvals(system.A).astype(complex)) / run.step
    return complex(roots[int(np.argmin(np.abs(roots - truth)))])


def scattered(seed: int, draws: int, *, outlier: bool) -> dict[str, Any]:
    """Count the coverage of a law in speed by nine runs whose eigenvalue scatters, of which one may be an outlier."""
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
