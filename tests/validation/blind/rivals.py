"""Three other ways to name a missing effect in modal data, for the benchmark; none of them knows the engine.

All see the same responses: the residuals of the stated bicycle, its uncertainty in their covariance, with each effect
of the baseline's table over a grid of its sizes.
"""

import csv
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import logsumexp

from tests.validation.blind.baseline import TABLE, Over, read, residuals
from tyre.ground import Array

SIGNED = ("speed_offset", "wrong_tilt", "wrong_trail", "twisting_torque")
ANSWER = {"verdict": "none", "class": [], "effects": [], "held_out_gap": {"nominal": None, "final": None}}
CLEAR = 20.0  # odds
ALIKE = 0.9  # cosine
Responses = Mapping[str, tuple[Array, list[Array]]]
"""Effect -> grid (g,) of its sizes in those of the table, and residuals (g, n) along each size, the others at 1."""


def responses(over: Over, names: list[str]) -> Responses:
    """Tabulate the residuals; an effect that makes no bicycle is left out."""
    found = {}
    for name in names:
        count = len(TABLE[name][1])
        grid = np.linspace(-4, 4, 11) if name in SIGNED else np.linspace(0, 4, 9)
        if count > 1 or name == "relaxation_length":
            grid = np.geomspace(0.25, 4, 7)  # never zero: a stiffness, a length
        with suppress(ArithmeticError, ValueError, np.linalg.LinAlgError), np.errstate(all="ignore"):
            tables = []
            for k in range(count):
                sizes = np.ones((len(grid), count))
                sizes[:, k] = grid
                tables.append(np.array([over(name, x) for x in sizes]))
            if all(np.isfinite(table).all() for table in tables):
                found[name] = grid, tables
    return found


def asked(folder: Path, without: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Answer of each rival for the measurement in a ``folder``, in the keys of a verdict."""
    misfit, content, names = read(folder, without)
    over = residuals(misfit, content, 0.0)
    y, known = over("none", np.zeros(0)), responses(over, names)
    columns = {name: y - at(known[name], np.ones(len(TABLE[name][1]))) for name in known}
    columns = {name: a for name, a in columns.items() if np.linalg.norm(a) > 0}
    with (folder / content["modal"]["table"]).open(encoding="utf-8") as file:
        rows = [(row["mode"], float(row["speed_m_s"])) for row in csv.DictReader(file)]
    return {
        "sparse regression": sparse(y, columns, known),
        "Gaussian process": process(y, columns, rows),
        "nested sampling": nested(y, known, np.random.default_rng(0)),
    }


def at(response: tuple[Array, list[Array]], x: Array) -> Array:
    """Residual at sizes ``x`` (k,), linear between those of the grid, each size by itself."""
    grid, tables = response
    one = np.searchsorted(grid, np.clip(x, grid[0], grid[-1]), side="right").clip(1, len(grid) - 1)
    share = (np.clip(x, grid[0], grid[-1]) - grid[one - 1]) / (grid[one] - grid[one - 1])
    parts = [(1 - s) * table[k - 1] + s * table[k] for table, k, s in zip(tables, one, share, strict=True)]
    if len(parts) == 1:
        return np.asarray(parts[0])
    k = int(np.argmin(np.abs(grid - 1.0)))
    return np.asarray(sum(parts) - (len(parts) - 1) * tables[0][k])


def named(names: list[str]) -> dict[str, Any]:
    """Answer of a class of ``names``, the best first."""
    best = [{"identifier": name, "parameters": {}} for name in names[0].split("+")]
    return ANSWER | {"verdict": "named" if len(names) == 1 else "class", "class": names, "effects": best}


def sparse(y: Array, columns: Mapping[str, Array], known: Responses) -> dict[str, Any]:
    """Lasso over linear responses (Tibshirani 1996, J. R. Stat. Soc. B 58); its supports refitted and chosen by BIC."""
    names = list(columns)
    size = np.array([np.linalg.norm(columns[name]) for name in names])
    a = np.array([columns[name] for name in names]).T / size
    lowest = np.array([-np.inf if name in SIGNED else 0.0 for name in names])
    gram, push, x = a.T @ a, a.T @ y, np.zeros(len(names))
    best, support, seen = float(y @ y), [], set()
    for level in np.abs(push).max() * np.geomspace(1, 1e-3, 25):
        for _ in range(50):
            for k in range(len(names)):
                pull = push[k] - gram[k] @ x + x[k]
                x[k] = max(lowest[k], np.sign(pull) * max(abs(pull) - level, 0.0))
        held = tuple(names[k] for k in np.flatnonzero(x))
        if 0 < len(held) <= 4 and held not in seen:
            seen.add(held)
            value = refitted(y, [known[name] for name in held])
            if value < best - 2:
                best, support = value, list(held)
    return named(["+".join(sorted(support))]) if support else ANSWER


def refitted(y: Array, held: list[tuple[Array, list[Array]]]) -> float:
    """BIC of some responses at once, each curved as it is tabulated."""
    ends = np.cumsum([0, *(len(tables) for _, tables in held)])

    def rest(x: Array) -> Array:
        parts = (y - at(one, x[a:b]) for one, a, b in zip(held, ends[:-1], ends[1:], strict=True))
        return np.asarray(y - sum(parts))

    low = np.concatenate([np.full(len(tables), grid[0]) for grid, tables in held])
    fit = least_squares(rest, np.maximum(np.ones(ends[-1]), low), bounds=(low, 4.0), max_nfev=30)
    return float(2 * fit.cost + ends[-1] * np.log(len(y)))


def process(y: Array, columns: Mapping[str, Array], rows: list[tuple[str, float]]) -> dict[str, Any]:
    """Discrepancy smooth in speed (Kennedy & O'Hagan 2001, J. R. Stat. Soc. B 63), named by the response it is like.

    Something is missing if the process beats none by BIC of its two settings, size and length.
    """
    width = len(y) // len(rows)
    label = [(mode, k) for mode, _ in rows for k in range(width)]
    speed = np.repeat([v for _, v in rows], width)
    same = np.array([[one == other for other in label] for one in label])
    best, mean = float(y @ y), None
    for length in (0.5, 1.0, 2.0, 4.0):
        kernel = same * np.exp(-((speed[:, None] - speed) ** 2) / (2 * length**2))
        values, axes = np.linalg.eigh(kernel)
        seen = axes.T @ y
        for size in 2.0 ** np.arange(-1, 8):
            variance = 1 + size**2 * np.maximum(values, 0.0)
            value = float((seen**2 / variance).sum() + np.log(variance).sum()) + 2 * np.log(len(y))
            if value < best - 2:
                best, mean = value, axes @ ((1 - 1 / variance) * seen)
    if mean is None:
        return ANSWER
    like = {name: float(mean @ a / (np.linalg.norm(mean) * np.linalg.norm(a))) for name, a in columns.items()}
    like = {name: abs(cosine) if name in SIGNED else cosine for name, cosine in like.items()}
    names = sorted((name for name in like if like[name] > ALIKE), key=lambda name: -like[name])
    return named(names) if names else ANSWER | {"verdict": "unknown"}


def nested(y: Array, known: Responses, rng: np.random.Generator) -> dict[str, Any]:
    """Evidence of each effect by nested sampling, half of the prior on nothing, odds of 20 for a name."""
    scores = {"none": -float(y @ y) / 2 + np.log(0.5)}
    for name, response in known.items():
        grid, tables = response
        low, high = grid[0], grid[-1]

        def likelihood(u: Array, low: float = low, high: float = high, response: Any = response) -> float:
            rest = at(response, low * (high / low) ** u if low > 0 else low + (high - low) * u)
            return -float(rest @ rest) / 2

        scores[name] = evidence(likelihood, len(tables), rng) + np.log(0.5 / len(known))
    best = max(scores, key=lambda name: scores[name])
    if best == "none" or scores["none"] > scores[best] - np.log(CLEAR):
        return ANSWER
    names = sorted((n for n in scores if scores[n] > scores[best] - np.log(CLEAR)), key=lambda name: -scores[name])
    return named(names)


def evidence(likelihood: Callable[[Array], float], size: int, rng: np.random.Generator, live: int = 80) -> float:
    """ln of the integral of a likelihood, given as its logarithm, over the unit cube of ``size`` dimensions.

    Skilling (2006), Bayesian Analysis 1, 833-859; new points are drawn in the box of the living ones, made wider by a
    fifth, as in Mukherjee, Parkinson & Liddle (2006), Astrophysical Journal 638, L51.
    """
    points = rng.random((live, size))
    values = np.array([likelihood(u) for u in points])
    found, volume = [], 0.0
    for _ in range(40 * live):
        worst = int(np.argmin(values))
        found.append(values[worst] + volume + np.log(-np.expm1(-1 / live)))
        volume -= 1 / live
        if values.max() + volume < logsumexp(found) - 5:
            break
        low, high = points.min(0), points.max(0)
        middle, half = (low + high) / 2, 0.6 * (high - low) + 1e-12
        for _ in range(200):
            u = np.clip(middle + half * rng.uniform(-1, 1, size), 0, 1)
            if (value := likelihood(u)) > values[worst]:
                points[worst], values[worst] = u, value
                break
        else:
            break
    return float(logsumexp([*found, logsumexp(values) - np.log(live) + volume]))
