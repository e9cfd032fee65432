"""Parameter samples of the main study: bicycle, tyres and assumed values are drawn, and the wobble of each is found."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect_registry import effect_class
from bicycle.effects.sprung_joint import SprungJoint
from bicycle.model.eigen import frequency_hz
from bicycle.model.model_family import ModelFamily
from bicycle.model.state_space import LinearModel
from bicycle.parameters.front_hinge import critical_damping
from bicycle.stability.critical import critical_speeds
from studies.main_study import result as solution
from studies.main_study.cases import TyreCase
from studies.main_study.result import FRICTION, TRAIL, TWIST
from studies.main_study.settings import LIMITS, OF_ARMS, SADDLE, Settings, Setup
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

EFFECTS = {"trail": TRAIL, "twisting": TWIST, "camber_share": "camber_thrust"}


@dataclass(frozen=True, eq=False)
class Samples:
    """First and last speed (m/s) of wobble of each sample (n,), NaN without wobble; and its growth rate.

    ``growth`` (n, speeds), 1/s, is the largest real part of the oscillations of wobble's frequencies.
    """

    case: TyreCase  # around which the tyres are sampled
    setup: Setup  # case around which the assumed values are sampled
    onset: Array  # (n,), m/s; NaN: stable up to the highest speed, or not computed
    end: Array  # (n,), m/s, at most the highest speed; NaN likewise
    computed: NDArray[np.bool_]  # (n,), False: an impossible sample
    growth: Array  # (n, speeds), 1/s; NaN without such an oscillation
    speeds: Array  # (speeds,), m/s, of the growth

    @property
    def count(self) -> int:
        """Number of samples that were computed."""
        return int(self.computed.sum())

    @property
    def range(self) -> Array:
        """Length of the wobble range of each sample, m/s (n,)."""
        return np.nan_to_num(self.end - self.onset, nan=0.0)

    @property
    def peak(self) -> Array:
        """Fastest growth of each sample at ridden speeds, 1/s (n,); minus infinity without such an oscillation."""
        low, high = LIMITS.ridden
        ridden = (self.speeds >= low) & (self.speeds <= high)
        return np.asarray(np.nan_to_num(self.growth[:, ridden], nan=-np.inf).max(axis=1))

    @property
    def wobbling_share(self) -> float:
        """Share of the computed samples that wobble at ridden speeds."""
        return float(self.wobbles_ridden[self.computed].mean())

    @property
    def wobbles_ridden(self) -> NDArray[np.bool_]:
        """Whether each sample wobbles at ridden speeds (n,)."""
        return (self.onset <= LIMITS.ridden[1]) & (self.end >= LIMITS.ridden[0])

    @property
    def stable_count(self) -> int:
        """Number of samples in which wobble is stable at all speeds studied."""
        return int((np.isnan(self.onset) & self.computed).sum())

    def interval(self, edge: str) -> tuple[float, float] | None:
        """Interval of ``onset`` or ``end`` (m/s) of 90 % of the samples with unstable wobble; of all if few."""
        speeds = getattr(self, edge)[~np.isnan(self.onset)]
        if not len(speeds):
            return None
        low, high = np.quantile(speeds, LIMITS.likely if len(speeds) >= LIMITS.fewest else (0, 1))
        return float(low), float(high)


def sample_bicycles(settings: Settings, case: TyreCase, setup: Setup) -> Samples:
    """Sample bicycle, tyres and assumed values (a Sobol sequence over the ranges), and find the wobble of each."""
    count, speeds = settings.fronts, growth_speeds(settings)
    onset, end = np.full((2, count), np.nan)
    computed = np.zeros(count, bool)
    growth = np.full((count, len(speeds)), np.nan)
    uncertain = solution.uncertainty(settings, case, setup)
    family = ModelFamily(uncertain.nominal)
    drawn = front_draws(settings)
    for k, values in enumerate(solution.draws(settings, case, uncertain, count)):
        if values is None:
            continue
        try:
            linear = family.linear_model(values | front_values(settings, case.apply_to(setup), drawn, k, values))
            critical = critical_speeds(linear, max_speed=settings.fastest)
            span = solution.wobble_span(linear, critical, hands_on=setup.arms is not None, limit=settings.fastest)
            growth[k] = wobble_growth(linear, speeds)
        except InputError:  # an impossible sample is counted, and reported with the count
            continue
        computed[k] = True
        if span:
            onset[k], end[k] = span.low, min(span.high, settings.fastest)
    return Samples(case, setup, onset, end, computed, growth, speeds)


def growth_speeds(settings: Settings) -> Array:
    """Choose the speeds (30,), m/s, at which the growth rate of the samples is drawn."""
    return np.linspace(1.0, settings.fastest, 30)


def wobble_growth(linear: LinearModel, speeds: Array) -> Array:
    """Find the largest real part (1/s) of oscillations of wobble's frequencies at ``speeds`` (n,); NaN without one."""
    values = linear.eigenvalues(speeds)
    hertz = frequency_hz(values)
    largest = np.where((hertz >= LIMITS.wobble_hz) & (hertz < LIMITS.tyres_hz), values.real, -np.inf).max(axis=1)
    return np.where(np.isfinite(largest), largest, np.nan)


def front_draws(settings: Settings) -> Mapping[str, Array]:
    """Sample each quantity (number of samples,), in the units of the ranges; the same for every case."""
    from scipy.stats import qmc

    ranges = settings.ranges.drawn
    size = 2 ** int(np.ceil(np.log2(max(settings.fronts, 2))))
    # "rng" is the newer name, of scipy 1.15
    u = qmc.Sobol(len(ranges), seed=np.random.default_rng(settings.seed)).random(size)[: settings.fronts]
    return {
        name: np.asarray(low * (high / low) ** share if low > 0 else low + (high - low) * share)
        for share, (name, (low, high)) in zip(u.T, ranges.items(), strict=True)
    }


def saddle_values(table: Mapping[str, Any], new: Mapping[str, float], values: Mapping[str, float]) -> dict[str, float]:
    """Stiffness and damping (SI) of the seated rider on the saddle of a sample, if the ``table`` has none of its own.

    ``new`` holds what was drawn, ``values`` the parameters of the sampled bicycle.
    """
    parameters = {}
    if "saddle_stiffness" in new:
        parameters[f"{SADDLE}.stiffness"] = new["saddle_stiffness"]
    if "saddle_damping_ratio" in new:
        sampled = {name.partition(".")[2]: value for name, value in values.items() if name.startswith(f"{SADDLE}.")}
        seated = effect_class(SADDLE)(**table)
        assert isinstance(seated, SprungJoint)
        inertia = seated.carried_inertia({**values, **sampled})
        stiffness = parameters.get(f"{SADDLE}.stiffness", sampled["stiffness"])
        parameters[f"{SADDLE}.damping"] = float(new["saddle_damping_ratio"] * critical_damping(stiffness, inertia))
    return parameters


def front_values(
    settings: Settings, setup: Setup, drawn: Mapping[str, Array], k: int, values: Mapping[str, float]
) -> dict[str, float]:
    """Compute parameters (SI) of effects but the contact law, for draw ``k`` of ``drawn`` on a bicycle of ``values``.

    Pneumatic trail and twisting torque of a tyre file or model file stay, and what was measured stays as ``values`` has
    it.
    """
    new = {name: float(numbers[k]) for name, numbers in drawn.items()}
    parameters: dict[str, float] = {}
    for name, effect in EFFECTS.items():
        keys = [key for key in values if key.startswith(f"{effect}.") and "lag_share" not in key]
        in_model_file = effect in settings.further
        nominal = getattr(settings, name)
        if in_model_file and name == "camber_share":
            parameters |= {key: values[key] * new[name] for key in keys}
        elif not in_model_file and getattr(setup, name) == nominal and nominal:
            parameters |= {key: values[key] * new[name] / nominal for key in keys}
    if setup.front:
        measured = "front_compliance.stiffness" in settings.measured.names
        front = replace(
            setup.front,
            stiffness=values["front_compliance.stiffness"] if measured else new["stiffness"],
            damping_ratio=new["damping_ratio"],
            joint_height=setup.front.joint_height + new["hinge"],
        )
        parameters |= {
            "front_compliance.stiffness": front.stiffness,
            "front_compliance.damping": float(front.damping(values)),
            "front_compliance.joint_z": -front.joint_height,
            "front_compliance.joint_x": float(front.hinge_x(values)),
        }
    if saddle := settings.further.get(SADDLE):
        parameters |= saddle_values(saddle, new, values)
    if setup.friction:
        parameters[f"{FRICTION}.damping"] = new["friction"]
    if setup.arms:
        parameters |= {f"rider_arms.{name}": getattr(setup.arms, name) * new[f"arm_{name}"] for name in OF_ARMS}
    return {key: value for key, value in parameters.items() if key not in settings.measured.names}
