"""Linear standard deviations of the main study checked by Monte Carlo, where they are most in doubt."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.main_study.bands import WOBBLE
from studies.main_study.settings import Settings, Setup
from studies.main_study.solve import Result
from studies.main_study.spread import uncertainty
from studies.uncertainty.quantity import Quantity
from tyre.base.errors import InputError

CHECKED_MODE = WOBBLE
FAR = 0.05  # two standard deviations further apart than this, relative to the linear one, are said to differ


@dataclass(frozen=True, eq=False)
class Check:
    """Frequency, damping ratio and critical speeds of wobble of one result, linear and of random bicycles.

    ``failure`` says why there are none, where the check could not be made.
    """

    result: Result
    quantities: tuple[Quantity, ...]
    failure: str = ""


def chosen(results: Sequence[Result]) -> list[Result]:
    """The results to check: the most doubtful one of the tyre in question, of the other tyres, of each other setup."""
    first, subject = results[0].setup, results[0].case.name
    groups: dict[tuple[Setup, bool], list[Result]] = {}
    for result in results:
        groups.setdefault((result.setup, result.setup == first and result.case.name == subject), []).append(result)
    return [max(group, key=doubt) for group in groups.values()]


def doubt(result: Result) -> float:
    """How far a speed at which wobble changes its stability moves in one standard deviation, relative to it."""
    return max((c.sd / c.speed for c in result.wobble_edges), default=0.0)


def check(settings: Settings, result: Result) -> Check:
    """Compare both ways for one result."""
    found = uncertainty(settings, result.case, result.setup).quantities(
        np.array([settings.report_speed]), max_speed=settings.max_speed,
        samples=settings.samples, seed=settings.seed, only=[CHECKED_MODE], matched=True,
    )  # fmt: skip
    return Check(result, tuple(found))


def safe_check(settings: Settings, result: Result) -> Check:
    """The same; a check that cannot be made says why and costs nothing else."""
    try:
        return check(settings, result)
    except InputError as error:
        return Check(result, (), str(error))


def excess(quantity: Quantity) -> float:
    """How much larger the standard deviation of the draws is than the linear one, relative to it."""
    return quantity.sampled_sd / quantity.linear_sd - 1


def differs(quantity: Quantity) -> bool:
    """Whether the two are far apart, or some draws have lost the quantity."""
    return bool(quantity.lost) or not abs(excess(quantity)) <= FAR
