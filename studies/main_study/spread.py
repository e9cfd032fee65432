"""What is uncertain about a case of the main study: a covariance of model parameters, and random bicycles."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from bicycle.parameters import UNITS
from studies.main_study.cases import CONTACT, Array, Settings, Setup, TyreCase, beside, camber_stiffness
from studies.uncertainty.propagation import Uncertainty

CAMBER = ("camber_thrust.camber_stiffness.rear", "camber_thrust.camber_stiffness.front")


class Spread(NamedTuple):
    """Parameters of the model (p,) and their covariance (p, p), SI."""

    names: tuple[str, ...]
    covariance: Array


def tyre_spread(case: TyreCase) -> Spread:
    """What the tyre data leave uncertain."""
    return Spread(CONTACT, case.covariance)


def spread(settings: Settings, case: TyreCase, setup: Setup) -> Spread:
    """The tyre data and the parameters of the bicycle whose standard deviation is stated."""
    return Spread(*uncertainty(settings, case, setup).covariance()) if settings.stated_sd else tyre_spread(case)


def uncertainty(settings: Settings, case: TyreCase, setup: Setup) -> Uncertainty:
    """The model of a case with all that is uncertain about it.

    Masses and lengths of the bicycle move the wheel loads, and these the tyre and the camber thrust; the hinge of a
    flexible front stays on the steer axis.
    """
    tyre = {"tyre": case.source, "surface": case.surface, "pressure_bar": case.pressure_bar}
    content = {
        "bicycle": {key: settings.bicycle[key] for key in UNITS},
        "effects": {"relaxation_length": tyre, **beside(settings.bicycle, setup)},
    }

    def follow(p: Mapping[str, Any]) -> dict[str, Any]:
        found = dict(zip(CAMBER, camber_stiffness(setup, p), strict=True))
        return found | ({"front_compliance.joint_x": setup.front.joint_x(p)} if setup.front else {})

    return Uncertainty(content, sd=settings.stated_sd, follow=follow)
