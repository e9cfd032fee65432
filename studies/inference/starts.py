"""Starts of the fit of a hypothesis: those that promise most by one evaluation or one Gauss-Newton step."""

import math
from collections.abc import Sequence

import numpy as np

from studies.inference.fit import Fit, fit, prior, spread
from studies.inference.kind import Kind
from studies.inference.parameter import Array, Candidate

WORTH_A_FIT = 1.0
"""Decrease of the objective that shows another optimum: a search ends closer than that to its own."""


def preview_objective(kind: Kind, parent: Fit, candidate: Candidate) -> float:
    """Objective (-2 ln p) that one Gauss-Newton step promises for a ``parent`` with a ``candidate`` more.

    The lowest of all first starts of the candidate; infinite where nothing is finite.
    """
    joined = (*parent.candidates, candidate)
    centre, sd = prior((*parent.unknowns, *candidate.unknowns), joined)
    promised = []
    for start in candidate.first_starts:
        theta = np.concatenate([parent.theta, start])
        residual, jacobian = kind.residual(joined, theta)
        z, scaled = (theta - centre) / sd, jacobian * sd
        gradient = scaled.T @ residual + z
        value = float(residual @ residual + z @ z - gradient @ spread(scaled)[0] @ gradient)
        promised.append(value if math.isfinite(value) else math.inf)
    return min(promised)


def select_starts(kind: Kind, candidates: tuple[Candidate, ...], starts: Sequence[Array], most: int = 2) -> list[Array]:
    """Select the ``starts`` (p,) of the lowest objective, without a fit, at most ``most`` of them, lowest first."""
    centre, sd = prior((*kind.nuisances, *(u for c in candidates for u in c.unknowns)), candidates)
    values = []
    for theta in starts:
        residual, _ = kind.residual(candidates, theta, slopes=False)
        z = (theta - centre) / sd
        value = float(residual @ residual + z @ z)
        values.append(value if math.isfinite(value) else math.inf)
    return [starts[k] for k in np.argsort(values, kind="stable")[:most]]


def transfer_coordinates(part: Fit, candidates: Sequence[Candidate]) -> Array:
    """Coordinates (p,) for ``candidates`` from a fit ``part``: an effect that is not in it has its smallest start."""
    theta = [part.theta[: part.effect_columns.start]]
    for c in candidates:
        lacking = c.starts[0]
        theta.append(part.theta[part.columns(c)] if c.identifier in part.identifiers else np.asarray(lacking))
    return np.concatenate(theta)


def null_from(null: Fit, fits: Sequence[Fit], kind: Kind) -> Fit:
    """The ``null``, or what the parameters of the best of the ``fits`` lead to without its effect, if that is lower.

    A search may end at another optimum; an effect must not get the credit of a better one.
    """
    best = min((f for f in fits if f.converged), key=lambda f: f.objective, default=null)
    if best.objective > null.objective - WORTH_A_FIT:
        return null
    again = fit(kind, starts=[best.theta[: best.effect_columns.start]])
    return again if again.objective < null.objective - WORTH_A_FIT else null
