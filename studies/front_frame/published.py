"""Hinge of a front frame from the stiffness that a magazine or a laboratory publishes.

Frame and fork tilt one after the other: with the stiffnesses k_h, k_f and heights d_h, d_f of their hinges

    1/k = 1/k_h + 1/k_f,    d = k (d_h/k_h + d_f/k_f),

k_h in proportion to the published stiffness of the head tube, k_f a power of that of the fork. One reading at the
ground gives k as a power of it. The coefficients are those of beam models (data/front_frame/figure_map.toml).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bicycle.parameters.bicycle import Bicycle
from bicycle.parameters.front_hinge import hinge_at
from bicycle.parameters.parameter_covariance import MODEL_FILE, ParameterCovariance
from studies.main_study.settings import LIMITS, assumed_front
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import data_root, read_toml
from tyre.ground.units import GRAVITY

NORMAL_95 = 1.959964  # standard deviations of a normal number within which 95 % lie
BEYOND = 2.0  # a figure so many times above or below all frames of the map is refused: it is in another unit
EFFECT = "front_compliance"
UNCERTAIN = tuple(f"{EFFECT}.{name}" for name in ("stiffness", "joint_x", "joint_z"))


@dataclass(frozen=True)
class PublishedFigures:
    """What was published of one bicycle, as it is printed; None for what was not."""

    head_tube_N_m_per_deg: float | None = None  # N m/deg, dropouts clamped, head tube supported in its middle
    fork_N_per_mm: float | None = None  # N/mm, lateral force at the dropouts, steerer clamped
    ground_deflection_mm: float | None = None  # mm, at the ground, dropouts clamped, head tube supported
    weight_kg: float | None = None  # kg, whose weight was hung there

    def __post_init__(self) -> None:
        ground = (self.ground_deflection_mm, self.weight_kg)
        for name, value in vars(self).items():
            if value is not None and not (math.isfinite(value) and value > 0):
                raise InputError(f"{name} = {value:g} must be above 0")
        if (ground[0] is None) != (ground[1] is None):
            raise InputError("a deflection at the ground needs the weight that was hung there; give both")
        if self.fork_N_per_mm is not None and self.head_tube_N_m_per_deg is None:
            raise InputError("the fork alone says little; give the stiffness of the head tube with it")
        if (self.head_tube_N_m_per_deg is None) == (ground[0] is None):
            raise InputError(
                "give either the stiffness of the head tube, with or without that of the fork, or a deflection at the "
                "ground with its weight"
            )

    @property
    def ground_N_per_mm(self) -> float | None:
        """Stiffness at the ground, N/mm."""
        if self.ground_deflection_mm is None or self.weight_kg is None:
            return None
        return self.weight_kg * GRAVITY / self.ground_deflection_mm

    @property
    def method(self) -> str:
        """Which figures there are: pair, head_tube or ground."""
        if self.head_tube_N_m_per_deg is None:
            return "ground"
        return "head_tube" if self.fork_N_per_mm is None else "pair"

    @property
    def sizes(self) -> dict[str, float]:
        """Figures by the names of the map: head_tube N m/deg, fork N/mm, ground N/mm."""
        figures = {
            "head_tube": self.head_tube_N_m_per_deg,
            "fork": self.fork_N_per_mm,
            "ground": self.ground_N_per_mm,
        }
        return {name: value for name, value in figures.items() if value is not None}


@dataclass(frozen=True)
class FrontHinge:
    """A hinge in place of a flexible front frame, and how well it is known."""

    stiffness: float  # N m/rad
    height: float  # m above the front hub, along the steer axis
    covariance: Array  # (2, 2), of the logarithm of the stiffness and of the height, m
    method: str  # pair, head_tube or ground
    notes: tuple[str, ...] = ()  # figures outside the frames of the map

    @property
    def relative_sd(self) -> float:
        """Standard uncertainty of the logarithm of the stiffness."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def height_sd(self) -> float:
        """Standard uncertainty of the height, m."""
        return math.sqrt(self.covariance[1, 1])

    @property
    def correlation(self) -> float:
        """Correlation of stiffness and height."""
        return float(self.covariance[0, 1]) / (self.relative_sd * self.height_sd)

    @property
    def stiffness_interval(self) -> tuple[float, float]:
        """95 % coverage interval of the stiffness, N m/rad."""
        factor = math.exp(NORMAL_95 * self.relative_sd)
        return self.stiffness / factor, self.stiffness * factor

    @property
    def height_interval(self) -> tuple[float, float]:
        """95 % coverage interval of the height, m."""
        return self.height - NORMAL_95 * self.height_sd, self.height + NORMAL_95 * self.height_sd

    def effect_numbers(self, bicycle: Bicycle) -> dict[str, float]:
        """Numbers (SI) of the effect front_compliance on a ``bicycle``; its damping is unknown and left out."""
        if assumed_front(bicycle) is None:
            lengths = (("wheelbase", bicycle["w"], LIMITS.wheelbase), ("front wheel", bicycle["rF"], LIMITS.wheel))
            wrong = [f"{name} {value:.3g} m" for name, value, (low, high) in lengths if not low <= value <= high]
            raise InputError(
                f"bicycle {bicycle.name}: {', '.join(wrong)}; published figures are those of racing frames, wheelbase "
                f"{LIMITS.wheelbase[0]:g} to {LIMITS.wheelbase[1]:g} m, radius of the front wheel {LIMITS.wheel[0]:g} "
                f"to {LIMITS.wheel[1]:g} m: leave them out"
            )
        joint_x, joint_z = hinge_at(bicycle.values, self.height)
        return {"stiffness": self.stiffness, "joint_x": joint_x, "joint_z": joint_z}

    def effect_factor(self, bicycle: Bicycle) -> Array:
        """Factor L (3, 2) of the covariance L L' (SI) of the numbers ``UNCERTAIN`` on a ``bicycle``.

        Two numbers are uncertain, the stiffness and the height above the hub; the hinge moves along the steer axis.
        """
        tilt = bicycle["lam"]
        slopes = np.array([[self.stiffness, 0.0], [0.0, -math.sin(tilt)], [0.0, -math.cos(tilt)]])
        return slopes @ np.linalg.cholesky(self.covariance)

    def effect_covariance(self, bicycle: Bicycle) -> ParameterCovariance:
        """Covariance (SI) of stiffness and place of the effect front_compliance on a ``bicycle``."""
        factor = self.effect_factor(bicycle)
        return ParameterCovariance(UNCERTAIN, factor @ factor.T, origin=MODEL_FILE)


@dataclass(frozen=True)
class FigureMap:
    """Coefficients of the map from figures to the hinge, computed from beam models."""

    source: str  # what computed it
    frames: int  # number of beam models
    figure_sd: float  # relative standard uncertainty of a published figure, assumed
    model_sd: float  # standard uncertainty of ln stiffness that the beam models themselves add, assumed
    model_height_sd_m: float  # likewise of the height
    ranges: Mapping[str, tuple[float, float]]  # of the figures of these frames
    wheel_radius_m: tuple[float, float]  # of their front wheels
    frame: Mapping[str, float]  # factor and height_m of the frame's hinge
    fork: Mapping[str, float]  # of the fork's hinge: at figure, stiffness and height there; power, slope of the height
    ground: Mapping[str, float]  # of the hinge of both: at figure, stiffness there, power; height_m
    scatter: Mapping[str, Sequence[float]]  # method -> variance of ln k, covariance, variance of the height (m)

    def hinge(self, method: str, sizes: Mapping[str, float]) -> tuple[float, float]:
        """Stiffness (N m/rad) and height (m) of the hinge by figures of ``sizes``, names of the map."""
        if method == "ground":
            return _power(self.ground, sizes["ground"]), self.ground["height_m"]
        frame_stiffness = self.frame["factor"] * math.degrees(sizes["head_tube"])
        fork = sizes.get("fork", math.sqrt(math.prod(self.ranges["fork"])))
        fork_stiffness = _power(self.fork, fork)
        fork_height = self.fork["height_m"] + self.fork["height_slope_m"] * math.log(fork / self.fork["at"])
        stiffness = 1 / (1 / frame_stiffness + 1 / fork_stiffness)
        height = stiffness * (self.frame["height_m"] / frame_stiffness + fork_height / fork_stiffness)
        return stiffness, height

    def covariance(self, method: str, sizes: Mapping[str, float]) -> Array:
        """Covariance (2, 2) of ln stiffness and height (m): of the frames, the beam models and the figures."""
        log_variance, mixed, height_variance = self.scatter[method]
        spread = np.array([[log_variance, mixed], [mixed, height_variance]])
        spread += np.diag([self.model_sd**2, self.model_height_sd_m**2])
        step = 1e-4
        for name, value in sizes.items():
            ends = [self.hinge(method, {**sizes, name: value * math.exp(side * step)}) for side in (-1, 1)]
            (low_k, low_d), (high_k, high_d) = ends
            slope = np.array([math.log(high_k / low_k), high_d - low_d]) / (2 * step)
            spread += self.figure_sd**2 * np.outer(slope, slope)
        return spread


def _power(law: Mapping[str, float], figure: float) -> float:
    """Stiffness (N m/rad) by a power law through its value at the figure ``at``."""
    return law["stiffness_N_m_per_rad"] * (figure / law["at"]) ** law["power"]


@cache
def read_map() -> FigureMap:
    """Read the packaged map."""
    file = data_root().joinpath("front_frame", "figure_map.toml")
    return map_of(read_toml(file, "map of published figures"))


def map_of(content: Mapping[str, Any]) -> FigureMap:
    """Make a map of the ``content`` of its file."""
    ranges = {name: (ends[0], ends[1]) for name, ends in content["ranges"].items()}
    return FigureMap(**{**content, "ranges": ranges, "wheel_radius_m": tuple(content["wheel_radius_m"])})


UNITS = {"head_tube": "N m/deg", "fork": "N/mm", "ground": "N/mm"}
PLAIN = {"head_tube": "head tube", "fork": "fork", "ground": "stiffness at the ground"}


def map_figures(figures: PublishedFigures, figure_map: FigureMap) -> FrontHinge:
    """Compute the hinge of published ``figures`` by a ``figure_map``; figures outside its frames are noted."""
    notes = []
    for name, value in figures.sizes.items():
        low, high = figure_map.ranges[name]
        outside = f"{PLAIN[name]} {value:.4g} {UNITS[name]} is outside {low:.3g} to {high:.3g} {UNITS[name]}"
        if not low / BEYOND <= value <= high * BEYOND:
            raise InputError(f"{outside} of the frames that the map was computed for; check the unit")
        if not low <= value <= high:
            notes.append(f"{outside} of the frames that the map was computed for: extrapolated")
    stiffness, height = figure_map.hinge(figures.method, figures.sizes)
    covariance = figure_map.covariance(figures.method, figures.sizes)
    return FrontHinge(stiffness, height, covariance, figures.method, tuple(notes))


def front_frame(
    *,
    head_tube_N_m_per_deg: float | None = None,
    fork_N_per_mm: float | None = None,
    ground_deflection_mm: float | None = None,
    weight_kg: float | None = None,
) -> FrontHinge:
    """Estimate the hinge of a front frame from published figures; damping does not follow from them.

    >>> front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=45).method
    'pair'

    Parameters
    ----------
    head_tube_N_m_per_deg : float, N m/deg
        Stiffness of the head tube as TOUR measures it: rear dropouts clamped, head tube supported in its middle.
    fork_N_per_mm : float, N/mm
        Lateral stiffness of the fork at the dropouts, steerer clamped. Without it a fork of usual stiffness is assumed.
    ground_deflection_mm, weight_kg : float, mm and kg
        Deflection of frame and fork where the wheel meets the ground, as RoadBIKE measures it, and the weight.

    Returns
    -------
    FrontHinge
        Stiffness (N m/rad), height above the hub (m) and covariance.

    Raises
    ------
    InputError
        Figures that do not go together, or that no racing frame has.
    """
    figures = PublishedFigures(head_tube_N_m_per_deg, fork_N_per_mm, ground_deflection_mm, weight_kg)
    return map_figures(figures, read_map())
