"""Where fits begin: the most promising of several starts, and a part with what it lacks at its neutral values."""

import math
from collections.abc import Sequence

import numpy as np

from studies.inference.arrays import Array
from studies.inference.fit import Fit, prior
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate

STARTS_RUN = 2  # of those with the lowest objective


def promising(
    forward: Forward, candidates: tuple[Candidate, ...], starts: Sequence[Array], most: int = STARTS_RUN
) -> list[Array]:
    """The ``starts`` (p,) of the lowest objective with ``candidates``, a number ``most`` of them."""
    centre, sd = prior((*forward.nuisances, *(u for c in candidates for u in c.unknowns)), candidates, 1.0)
    values = []
    for theta in starts:
        residual, _ = forward.residual(candidates, theta, slopes=False)
        z = (theta - centre) / sd
        value = float(residual @ residual + z @ z)
        values.append(value if math.isfinite(value) else math.inf)
    return [starts[k] for k in np.argsort(values, kind="stable")[:most]]


def enlarged(part: Fit, candidates: Sequence[Candidate], *, neutral: bool = False) -> Array:
    """Coordinates (p,) of a ``part`` for other ``candidates``: what it lacks at its smallest start or ``neutral``."""
    theta = [part.theta[: part.effect_columns.start]]
    for c in candidates:
        lacking = c.neutral if neutral else c.starts[0]
        theta.append(part.theta[part.columns(c)] if c.identifier in part.identifiers else np.asarray(lacking))
    return np.concatenate(theta)
