"""What is uncertain about a case of the main study: a covariance of model parameters, and random bicycles."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bicycle.parameter_key import ParameterKey
from studies.main_study.assemble import CAMBER, FRICTION, content, follow, model
from studies.main_study.cases import CONTACT, TyreCase
from studies.main_study.settings import Settings, Setup
from studies.uncertainty.propagation import Uncertainty
from tyre.base.arrays import Array

VARIED_APART = ("front_compliance", "rider_arms", FRICTION, ParameterKey.parse(CAMBER[0]).effect)
"""Effects whose numbers the plausible fronts vary: they count as exact in a standard deviation."""


def varied_apart(key: str) -> bool:
    """Whether the parameter ``key`` belongs to an effect that the plausible fronts vary."""
    return ParameterKey.parse(key).effect in VARIED_APART


class Spread(NamedTuple):
    """Parameters of the model (p,) and their covariance (p, p), SI."""

    names: tuple[str, ...]
    covariance: Array


def tyre_spread(case: TyreCase) -> Spread:
    """What the tyre data leave uncertain."""
    return Spread(CONTACT, case.covariance)


def spread(settings: Settings, case: TyreCase, setup: Setup) -> Spread:
    """The tyre data and the bicycle."""
    return Spread(*uncertainty(settings, case, setup).covariance())


def within(names: Sequence[str], part: Spread) -> Array:
    """The covariance of ``part`` among the parameters ``names``; the others count as exact."""
    found = np.zeros((len(names), len(names)))
    at = [names.index(name) for name in part.names]
    found[np.ix_(at, at)] = part.covariance
    return found


def uncertainty(settings: Settings, case: TyreCase, setup: Setup) -> Uncertainty:
    """The model of a case with all that is uncertain about tyre and bicycle.

    What the bicycle's file does not state has the defaults of :mod:`bicycle.default_sd`. Masses and lengths of the
    bicycle move the wheel loads, and these the tyre and the camber thrust; the hinge of an assumed flexible front stays
    on the steer axis. What is assumed beside the tyre is varied in ``plausible``.
    """
    followers = follow(settings, setup, settings.bicycle.values)
    parameters = model(settings, setup, case.contact).parameters
    exact = {key: 0.0 for key in parameters if varied_apart(key) and key not in followers}
    return Uncertainty(
        content(settings, setup, case.table), sd=exact, defaults=True, bicycle_sd=settings.bicycle.sd,
        follow=lambda p: follow(settings, setup, p),
    )  # fmt: skip


def draws(settings: Settings, case: TyreCase, uncertain: Uncertainty, count: int) -> Iterator[dict[str, float] | None]:
    """Parameters of a number ``count`` of random bicycles; None for one that is no bicycle.

    The tyre's numbers differ from case to case.
    """
    mine = uncertain.draw(count, settings.seed)
    own = uncertain.draw(count, 1 + settings.seed + sum(map(ord, case.name + case.condition)))
    z = np.where([name.startswith("tyre ") for name in uncertain.names], own, mine)
    points = uncertain.points(z)
    for k, refused in enumerate(points.refused.mask):
        yield None if refused else {key: points.value(key, k) for key in points.values}
