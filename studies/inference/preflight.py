"""Other readings of the data, in other units or of another sign, judged by the parameters alone before any search."""

import math
from dataclasses import dataclass

from studies.inference.fit import GUIDE, fit
from studies.inference.kind import Kind
from studies.inference.parameter import Candidate
from studies.inference.rules import RULES

FEW = (4, 4)
"""Most iterations of a fit to data that are dear to compute."""


@dataclass(frozen=True)
class Misread:
    """A reading in which the data fit far better: sums of squares per data point as stated, and so read."""

    readings: tuple[str, ...]  # those that do about as well, the best first
    before: float  # objective per data point, as stated
    after: float  # the same, in the best reading


def preflight(kind: Kind) -> Misread | None:
    """Reading of the data of a ``kind`` by which chi^2 collapses though only parameters move; None if there is none."""
    kind = kind.simplify()
    count = len(kind.rows.places)
    before = _objective_of_short_fit(kind)
    if before < RULES.misread * count:
        return None
    objectives = {reading: _objective_of_short_fit(reread, reached=before) for reading, reread in kind.misreadings()}
    best = min(objectives.values(), default=before)
    if before < RULES.collapse * best:
        return None
    if best > RULES.misread * count and any(
        _objective_of_short_fit(kind, effect) < best for effect in kind.library if not effect.absorbs
    ):
        return None  # the reading does not fit, and an effect explains the data as stated better
    readings = sorted((value, reading) for reading, value in objectives.items() if value < RULES.as_well * best)
    return Misread(tuple(reading for _, reading in readings), before / count, best / count)


def _objective_of_short_fit(kind: Kind, *effect: Candidate, reached: float = math.inf) -> float:
    """Sum of squares, prior included, after a short fit; with an ``effect`` where one is given."""
    return fit(kind, effect, turns=GUIDE if kind.thorough else FEW, reached=reached).objective
