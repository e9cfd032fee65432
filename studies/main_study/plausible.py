"""The outer error bar: unstable wobble of random bicycles whose unmeasured parts are drawn from what is plausible."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.model_family import ModelFamily
from studies.main_study.assemble import CAMBER, FRICTION, beside
from studies.main_study.bands import wobble_span
from studies.main_study.cases import TyreCase
from studies.main_study.settings import Front, Settings, Setup
from studies.main_study.spread import draws, uncertainty
from tyre.base.arrays import Array
from tyre.base.errors import InputError

LIKELY = (0.05, 0.95)  # quantiles that an outer error bar joins
FEWEST = 10  # bicycles that wobble: of fewer it joins all
DRAWN = ("stiffness", "damping", "hinge", "friction", "camber_share", "arm_inertia", "arm_stiffness", "arm_damping")


@dataclass(frozen=True, eq=False)
class Plausible:
    """Onset and end (m/s) of unstable wobble of each random bicycle (n,); NaN where it has none, the fastest speed of
    the study where it does not end.

    ``computed`` (n,) is False where a draw made no bicycle. The front of number k is the same for every tyre and
    pressure, and so is the bicycle; the tyre is drawn anew.
    """

    case: TyreCase
    setup: Setup
    onset: Array
    end: Array
    computed: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Bicycles that were computed."""
        return int(self.computed.sum())

    @property
    def without(self) -> int:
        """Bicycles that do not wobble at any speed looked at."""
        return int((np.isnan(self.onset) & self.computed).sum())

    def likely(self, edge: str) -> tuple[float, float] | None:
        """What nine of ten bicycles with unstable wobble have as ``edge``, ``onset`` or ``end``, m/s; None without any.

        Of fewer than ``FEWEST`` it is what all have.
        """
        there = getattr(self, edge)[~np.isnan(self.onset)]
        if not len(there):
            return None
        low, high = np.quantile(there, LIKELY if len(there) >= FEWEST else (0, 1))
        return float(low), float(high)


def plausible(settings: Settings, case: TyreCase, setup: Setup) -> Plausible:
    """Draw bicycles, tyres and what nobody measured (a Sobol sequence over the ranges), and find their wobble."""
    count = settings.fronts
    onset, end = np.full((2, count), np.nan)
    computed = np.zeros(count, bool)
    uncertain = uncertainty(settings, case, setup)
    family = ModelFamily(uncertain.nominal)
    drawn = shares(settings)
    for k, values in enumerate(draws(settings, case, uncertain, count)):
        if values is None:
            continue
        try:
            numbers = values | changed(settings, setup, drawn, k, values)
            linear = family.linear_model(numbers)
            span = wobble_span(linear, critical_speeds(linear, max_speed=settings.fastest), settings.fastest)
        except InputError:  # a draw that makes no model is counted, and said where the count is shown
            continue
        computed[k] = True
        if span:
            onset[k], end[k] = span.low, min(span.high, settings.fastest)
    return Plausible(case, setup, onset, end, computed)


def shares(settings: Settings) -> Mapping[str, Array]:
    """Numbers (fronts,) of each quantity that is drawn, the same for every case."""
    from scipy.stats import qmc

    size = 2 ** int(np.ceil(np.log2(max(settings.fronts, 2))))
    # "rng" is the newer name, of scipy 1.15
    u = qmc.Sobol(len(DRAWN), seed=np.random.default_rng(settings.seed)).random(size)[: settings.fronts]
    ranges = settings.ranges
    return {name: spread_over(getattr(ranges, name), u[:, k]) for k, name in enumerate(DRAWN)}


def spread_over(ends: tuple[float, float], u: Array) -> Array:
    """Numbers between two ``ends`` (any unit) for ``u`` (n,), 0 to 1; even in the logarithm if both are positive."""
    low, high = ends
    return np.asarray(low * (high / low) ** u if low > 0 else low + (high - low) * u)


def changed(
    settings: Settings, setup: Setup, drawn: Mapping[str, Array], k: int, values: Mapping[str, float]
) -> dict[str, float]:
    """Parameters of the effects beside the tyre for draw number ``k`` of ``drawn``, on a bicycle with SI ``values``."""
    found: dict[str, float] = {}
    if "camber_thrust" in settings.further:
        found |= {key: values[key] * float(drawn["camber_share"][k]) for key in CAMBER}
    else:
        found |= {key: values[key] * float(drawn["camber_share"][k]) / setup.camber_share for key in CAMBER}
    if setup.front:
        front = another_front(setup.front, drawn, k)
        found |= {"front_compliance.stiffness": front.stiffness, "front_compliance.damping": front.damping}
        found |= {"front_compliance.joint_z": -front.joint_height}
        found |= {"front_compliance.joint_x": float(front.hinge_x(values))}
        friction = beside(settings, replace(setup, front=front))[FRICTION]["damping"]
        found |= {f"{FRICTION}.damping": float(friction)}
    if setup.arms:
        found |= {f"rider_arms.{name}": float(drawn[f"arm_{name}"][k]) for name in ("inertia", "stiffness", "damping")}
    return found


def another_front(front: Front, drawn: Mapping[str, Array], k: int) -> Front:
    """A front of the plausible ones: number ``k`` of ``drawn``.

    The hinge moves along the steer axis, or upwards where it was given.
    """
    return replace(
        front, stiffness=float(drawn["stiffness"][k]), damping=float(drawn["damping"][k]),
        joint_height=front.joint_height + float(drawn["hinge"][k]),
        friction=front.friction + float(drawn["friction"][k]),
    )  # fmt: skip
