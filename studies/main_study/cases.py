"""What the main study varies: measured tyres at the bicycle's wheel loads, camber thrust, and the front assembly."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.bicycle_file import load_bicycle
from bicycle.effect import effect_class
from bicycle.linear_model import LinearModel
from bicycle.model import Model
from bicycle.parameters import UNITS, Bicycle, bodies, static_loads
from tyre import TyreMap, TyreProperties, available_tyres
from tyre.errors import InputError
from tyre.maps.table_io import is_file_name

Array = NDArray[np.float64]
PASCAL_PER_BAR = 1e5
CONTACT = tuple(
    f"relaxation_length.{name}.{wheel}"
    for wheel in ("rear", "front")
    for name in ("cornering_stiffness", "relaxation_length")
)
"""Parameters of the model that a :class:`TyreCase` gives, in its order."""


@dataclass(frozen=True)
class Front:
    """An assumed flexible front: hinge across the steer axis at ``joint_height`` (m), SI units."""

    stiffness: float = 5000.0
    damping: float = 20.0
    joint_height: float = 0.65

    def joint_x(self, p: Mapping[str, Any]) -> Any:
        """Where the steer axis of a parameter set passes the height of the hinge, m before the rear contact."""
        return p["w"] + p["c"] - self.joint_height * np.tan(p["lam"])


@dataclass(frozen=True)
class Settings:
    """One main study. ``camber_shares``: camber stiffness over static load of each wheel, 1/rad; 0 leaves it out.

    ``tyres`` are files of tyre tables that are studied beside the packaged tyres. ``report_speed`` (m/s) is where
    frequencies and damping ratios are compared; critical speeds are searched up to ``max_speed``. ``samples`` bicycles
    with random numbers of ``seed`` check the linear standard deviations.
    """

    bicycle: Bicycle
    speeds: Array = field(default_factory=lambda: np.linspace(0, 30, 121))
    camber_shares: tuple[float, ...] = (0.0, 0.8)
    front: Front = field(default_factory=Front)
    report_speed: float = 15.0
    max_speed: float = 60.0
    samples: int = 1000
    seed: int = 0
    tyres: tuple[str, ...] = ()

    @classmethod
    def of(cls, bicycle: str, tyres: Sequence[str] = ()) -> "Settings":
        """The study of a packaged bicycle or a bicycle file."""
        return cls(load_bicycle(bicycle), tyres=tuple(tyres))

    @property
    def stated_sd(self) -> dict[str, float]:
        """Standard deviations (SI) that the bicycle states for parameters of the lateral motion."""
        return {key: value for key, value in self.bicycle.sd.items() if value > 0 and key in UNITS}

    @property
    def uncertain(self) -> str:
        """What the standard deviations of this study are of."""
        return "tyre data and bicycle parameters" if self.stated_sd else "the tyre data"

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
    theirs, with what the two wheels share. ``source`` is the tyre's name or file, as in a model file.
    """

    rear: TyreProperties
    front: TyreProperties
    contact: Array
    covariance: Array
    source: str
    synthetic: bool = False

    @property
    def tyre(self) -> str:
        """Name of the tyre, and whether its values are synthetic."""
        said = "synthetic" in self.rear.tyre.lower()
        return self.rear.tyre + (" (synthetic)" if self.synthetic and not said else "")

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


def tyre_cases(bicycle: Bicycle, files: Sequence[str] = ()) -> list[TyreCase]:
    """Every measured tyre, packaged or in a file, on every surface and at every pressure, at the wheel loads.

    Raises
    ------
    InputError
        A file that cannot be read or is no tyre table, or two tables with the same name and surface.
    """
    maps = [(name, TyreMap.load(name, surface=on)) for name, surfaces in available_tyres().items() for on in surfaces]
    for file in files:
        if not is_file_name(file):
            raise InputError(f"tyre {file!r} is no file of a tyre table (.csv); the packaged tyres are studied anyway")
        measured = TyreMap.of(Path(file).resolve().as_posix())
        if any((one.tyre, one.surface) == (measured.tyre, measured.surface) for _, one in maps):
            raise InputError(
                f"{file}: there is another {measured.tyre} {measured.surface}; rename the tyre in its .toml"
            )
        maps.append((Path(file).resolve().as_posix(), measured))
    cases = []
    for source, measured in maps:
        for pressure in measured.pressures:
            (rear, front), joint = measured.joint([(load, float(pressure)) for load in bicycle.static_loads])
            used = np.ix_([0, 2, 3, 5], [0, 2, 3, 5])
            contact = joint_mean(rear, front)
            cases.append(TyreCase(rear, front, contact, joint[used], source, measured.measured.synthetic))
    return cases


def joint_mean(rear: TyreProperties, front: TyreProperties) -> Array:
    """Cornering stiffness and relaxation length of both wheels, shape (4,), in the order of ``CONTACT``."""
    return np.array([value for p in (rear, front) for value in (p.cornering_stiffness, p.relaxation_length)])


def model(bicycle: Bicycle, setup: Setup, contact: Sequence[float] | Array) -> Model:
    """A bicycle on tyres with the four numbers of ``contact``."""
    rear_stiffness, rear_length, front_stiffness, front_length = (float(value) for value in contact)
    tyre = effect_class("relaxation_length")(
        cornering_stiffness={"rear": rear_stiffness, "front": front_stiffness},
        relaxation_length={"rear": rear_length, "front": front_length},
    )
    return Model(bicycle, (tyre, *(effect_class(name)(**table) for name, table in beside(bicycle, setup).items())))


def beside(bicycle: Bicycle, setup: Setup) -> dict[str, dict[str, Any]]:
    """The effects beside the tyre, as tables of a model file."""
    rear, front = camber_stiffness(setup, bicycle.values)
    tables: dict[str, dict[str, Any]] = {
        "camber_thrust": {"camber_stiffness": {"rear": float(rear), "front": float(front)}}
    }
    if setup.front:
        tables["front_compliance"] = {
            "stiffness": setup.front.stiffness, "damping": setup.front.damping,
            "joint_x": float(setup.front.joint_x(bicycle.values)), "joint_z": -setup.front.joint_height,
        }  # fmt: skip
    return tables


def camber_stiffness(setup: Setup, p: Mapping[str, Any]) -> tuple[Any, Any]:
    """Camber stiffness (N/rad) of rear and front wheel of a parameter set."""
    rear, front = static_loads(bodies(p), p["w"], p["g"])
    return setup.camber_share * rear, setup.camber_share * front


def build(bicycle: Bicycle, setup: Setup, contact: Sequence[float] | Array) -> LinearModel:
    """The linear model of :func:`model`."""
    return model(bicycle, setup, contact).linear_model()
