"""Critical speeds of random models against a count of unstable eigenvalues at 4000 speeds.

Every change of the count from one speed to the next must be the sum of the crossings listed between them, no more and
no less, and every listed crossing must be a root on the imaginary axis (or a jump where the equations switch).
All models are random (synthetic); every other one has effects up to a hundred times too large or too small, which no
bicycle has but a search for the missing effect or a sweep may try.
"""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.model import LinearModel
from bicycle.stability import CriticalSpeed, critical_speeds
from tests.validation.random_models import random_model

LAWS = ("no_slip", "side_slip", "relaxation_length", "relaxation_length")
SLOWEST, FASTEST, SPEEDS = 0.3, 40.0, 4000  # m/s
WILD = 2.0  # powers of ten by which the effects of every other model are off
AT_REST = 1e-8  # of the largest root: what lies closer to the axis than this is rounding


def run(*, out: Path, seed: int, models: int = 1000) -> dict[str, Any]:
    """Check random models; ``unexplained`` and ``off_axis`` list what is wrong."""
    from tyre.ground import progress_bar

    generator = np.random.default_rng(seed)
    result: dict[str, Any] = {"speeds_each": SPEEDS, "crossings": 0, "orders": {}, "unexplained": [], "off_axis": []}
    for number in progress_bar(range(models), desc="models"):
        decades = WILD if number % 2 else 0.0
        model = random_model(generator, contact_laws=LAWS, share=0.25, decades=decades).linear_model()
        found = critical_speeds(model, FASTEST)
        result["crossings"] += len(found)
        result["orders"][str(model.order)] = result["orders"].get(str(model.order), 0) + 1
        where = {"model": number, "effects": list(model.effects)}
        result["unexplained"] += [{**where, "between_m_s": between} for between in unexplained(model, found)]
        result["off_axis"] += [{**where, "speed_m_s": c.speed} for c in found if off_axis(model, c)]
    return result


def unexplained(model: LinearModel, found: tuple[CriticalSpeed, ...]) -> list[tuple[float, float]]:
    """Neighbouring speeds between which the number of unstable roots changes otherwise than the crossings say."""
    speeds = np.linspace(SLOWEST, FASTEST, SPEEDS)
    values = np.linalg.eigvals(model.state_matrix(speeds))
    count = (values.real > 0).sum(1)
    at = np.array([c.speed for c in found])
    change = np.array([crossing.unstable_roots for crossing in found])
    listed = np.array([change[(at > a) & (at <= b)].sum() if found else 0 for a, b in pairwise(speeds)])
    wrong = np.flatnonzero(np.diff(count) != listed)
    smallest = np.abs(values.real).min(1) / np.abs(values).max(1)
    return [(float(speeds[k]), float(speeds[k + 1])) for k in wrong if min(smallest[k], smallest[k + 1]) > AT_REST]


def off_axis(model: LinearModel, crossing: CriticalSpeed) -> bool:
    """Whether no root lies on the imaginary axis at a listed crossing; a switch of the equations may jump across."""
    if any(crossing.speed == piece.upper for piece in model.ranges):
        return False
    values = model.eigenvalues(crossing.speed)
    return bool(np.abs(values - 2j * np.pi * crossing.frequency_hz).min() > 1e-9 * np.abs(values).max())
