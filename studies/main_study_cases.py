"""What the main study varies: measured tyres at the bicycle's wheel loads, camber thrust, and the front assembly."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bicycle.bicycle_file import load_bicycle
from bicycle.effect import effect_class
from bicycle.linear_model import LinearModel
from bicycle.model import Model
from bicycle.parameters import Bicycle
from tyre import TyreMap, TyreProperties, available_tyres

Array = NDArray[np.float64]
PASCAL_PER_BAR = 1e5
CONTACT = ("cornering stiffness rear", "relaxation length rear", "cornering stiffness front", "relaxation length front")


@dataclass(frozen=True)
class Front:
    """An assumed flexible front: hinge across the steer axis at ``joint_height`` (m), SI units."""

    stiffness: float = 5000.0
    damping: float = 20.0
    joint_height: float = 0.65

    def joint_x(self, bicycle: Bicycle) -> float:
        """Where the steer axis passes the height of the hinge, m before the rear contact."""
        v = bicycle.values
        return v["w"] + v["c"] - self.joint_height * math.tan(v["lam"])


@dataclass(frozen=True)
class Settings:
    """One main study. ``camber_shares``: camber stiffness over static load of each wheel, 1/rad; 0 leaves it out.

    ``report_speed`` (m/s) is where damping ratios are compared; critical speeds are searched up to ``max_speed``.
    """

    bicycle: Bicycle
    speeds: Array = field(default_factory=lambda: np.linspace(0, 30, 121))
    camber_shares: tuple[float, ...] = (0.0, 0.8)
    front: Front = field(default_factory=Front)
    report_speed: float = 15.0
    max_speed: float = 60.0

    @classmethod
    def of(cls, bicycle: str) -> "Settings":
        """The study of a packaged bicycle or a bicycle file."""
        return cls(load_bicycle(bicycle))

    @property
    def setups(self) -> tuple["Setup", ...]:
        """Rigid and flexible front, each with every camber thrust."""
        return tuple(Setup(front, share) for front, share in product((None, self.front), self.camber_shares))


@dataclass(frozen=True)
class Setup:
    """What is beside the tyre: a flexible front (None: rigid) and the camber stiffness over load (1/rad)."""

    front: Front | None
    camber_share: float

    @property
    def front_name(self) -> str:
        """``rigid`` or ``flexible``."""
        return "flexible" if self.front else "rigid"

    @property
    def label(self) -> str:
        """In words, with what is assumed."""
        front = "flexible front (assumed)" if self.front else "rigid front"
        share = self.camber_share
        return f"{front}, " + (f"camber thrust {share:g} × load (assumed)" if share else "no camber thrust")


@dataclass(frozen=True, eq=False)
class TyreCase:
    """A measured tyre on both wheels at their static loads.

    ``contact`` (4,) is cornering stiffness (N/rad) and relaxation length (m), rear then front; ``covariance`` (4, 4) is
    theirs, with what the two wheels share.
    """

    rear: TyreProperties
    front: TyreProperties
    contact: Array
    covariance: Array

    @property
    def tyre(self) -> str:
        """Name of the tyre."""
        return self.rear.tyre

    @property
    def surface(self) -> str:
        """``flat`` or ``drum``."""
        return self.rear.surface

    @property
    def pressure_bar(self) -> float:
        """Inflation pressure, bar."""
        return round(self.rear.pressure / PASCAL_PER_BAR, 6)

    @property
    def name(self) -> str:
        """Tyre and surface."""
        return f"{self.tyre} {self.surface}"

    @property
    def extrapolated(self) -> bool:
        """True where a wheel load or the pressure is outside the measured range."""
        return not (self.rear.inside and self.front.inside)


def tyre_cases(bicycle: Bicycle) -> list[TyreCase]:
    """Every measured tyre, surface and pressure at the bicycle's wheel loads."""
    cases = []
    for tyre, surfaces in available_tyres().items():
        for surface in surfaces:
            measured = TyreMap.load(tyre, surface=surface)
            for pressure in measured.pressures:
                (rear, front), joint = measured.joint([(load, float(pressure)) for load in bicycle.static_loads])
                used = [0, 2, 3, 5]
                contact = joint_mean(rear, front)
                cases.append(TyreCase(rear, front, contact, joint[np.ix_(used, used)]))
    return cases


def joint_mean(rear: TyreProperties, front: TyreProperties) -> Array:
    """Cornering stiffness and relaxation length of both wheels, shape (4,), in the order of ``CONTACT``."""
    return np.array([value for p in (rear, front) for value in (p.cornering_stiffness, p.relaxation_length)])


def build(bicycle: Bicycle, setup: Setup, contact: Sequence[float] | Array) -> LinearModel:
    """The linear model of a bicycle on tyres with the four numbers of ``contact``."""
    rear_stiffness, rear_length, front_stiffness, front_length = (float(value) for value in contact)
    rear_load, front_load = bicycle.static_loads
    effects = [
        effect_class("relaxation_length")(
            cornering_stiffness={"rear": rear_stiffness, "front": front_stiffness},
            relaxation_length={"rear": rear_length, "front": front_length},
        ),
        effect_class("camber_thrust")(
            camber_stiffness={"rear": setup.camber_share * rear_load, "front": setup.camber_share * front_load}
        ),
    ]
    if setup.front:
        effects.append(
            effect_class("front_compliance")(
                stiffness=setup.front.stiffness, damping=setup.front.damping,
                joint_x=setup.front.joint_x(bicycle), joint_z=-setup.front.joint_height,
            )
        )  # fmt: skip
    return Model(bicycle, tuple(effects)).linear_model()
