"""What a sweep is: plain data that travels to any worker, and its fingerprint."""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from importlib.metadata import version
from typing import Any

from bicycle.effect import effect_class, packaged_effects
from bicycle.effect.files import Origin
from bicycle.eigenvalues.solvers import default_solver
from bicycle.files.model_file import build_model
from bicycle.files.wheel_tyres import MOST_BAR
from bicycle.model import Model
from bicycle.parameter_key import ParameterKey
from bicycle.parameters import BOUNDS
from studies.sweeps.made_of import source_digests, tyre_digest
from tyre.base.errors import InputError

SPEED = "speed_m_s"
TYRE_UNITS = {"pressure_bar": "bar", "load_N": "N", "tyre": "", "surface": ""}
CONDITION_BOUNDS = {SPEED: (0.0, math.inf), "pressure_bar": (0.0, MOST_BAR), "load_N": (0.0, math.inf)}
BY_SPEED = {
    "eigenvalues": "1/s", "largest_growth_rate": "1/s", "smallest_damping_ratio": "1", "modes": "1/s",
    "frequencies": "Hz", "damping_ratios": "1", "sensitivities": "1/s per SI unit of the parameter",
}  # fmt: skip
OUTPUTS = BY_SPEED | {"critical_speeds": "m/s", "parameters": "SI unit of the parameter"}

MOST_NAMES = 12  # of numbers measured together, beyond which they are counted


@dataclass(frozen=True)
class Axis:
    """A parameter and its grid values: numbers, or names for ``tyre`` and ``surface``."""

    name: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Normal:
    """Jointly normal parameters: ``factor`` times its transpose is their covariance."""

    names: tuple[str, ...]
    mean: tuple[float, ...]
    factor: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Uniform:
    """A parameter spread evenly between ``low`` and ``high``."""

    name: str
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Sweep:
    """Everything a chunk needs to know; plain data that travels to any worker.

    An item is one bicycle: a cell of the grid (without speed) and a sample; items are numbered in C order, samples
    fastest. A point is an item at a speed. ``model`` is the content of a model file with the bicycle as numbers;
    ``quantiles`` None means that every sample is kept, otherwise samples are reduced. ``bicycles`` are the parameters
    of those along the axis ``bicycle``, by name, and ``bicycle_sd`` the standard deviations sampled around them.
    """

    model: Mapping[str, Any]
    axes: tuple[Axis, ...]
    speeds: tuple[float, ...]
    samples: int
    seed: int
    normals: tuple[Normal, ...]
    uniforms: tuple[Uniform, ...]
    tyre_covariance: bool
    relative_cornering_stiffness_sd: float
    outputs: tuple[str, ...]
    max_speed: float
    quantiles: tuple[float, ...] | None
    points_per_part: int
    bicycles: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    bicycle_sd: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the grid axes, then of the samples."""
        return (*(len(axis.values) for axis in self.axes), self.samples)

    @property
    def items(self) -> int:
        """Number of bicycles."""
        return math.prod(self.shape)

    @property
    def points_per_item(self) -> int:
        """Number of speeds, at least 1."""
        return max(len(self.speeds), 1)

    @property
    def random(self) -> bool:
        """Whether anything is sampled."""
        return bool(self.normals or self.uniforms or self.tyre_covariance or self.bicycle_sd)

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of all that is varied, without the speed grid."""
        joint = tuple(name for normal in self.normals for name in normal.names)
        return (*(axis.name for axis in self.axes), *joint, *(u.name for u in self.uniforms))

    @property
    def nominal(self) -> Model:
        """The model of the file, before anything is varied."""
        return build_model(self.model)

    @cached_property
    def fingerprint(self) -> str:
        """Same fingerprint, same numbers to the last bit; the size of the parts does not matter."""
        return _digest(self.made_of)

    @cached_property
    def made_of(self) -> dict[str, str]:
        """What makes the numbers: digests of the sweep, the tyres, effects and source, and the versions of software."""
        content = asdict(replace(self, points_per_part=0))
        bicycles = {key: content.pop(key) for key in ("bicycles", "bicycle_sd")}
        found = {"the model": _digest(content.pop("model")), "the sweep": _digest(content)}
        found |= {"the table of bicycles": _digest(bicycles)} if self.bicycles else {}
        found |= {f"the tyre {name}": tyre_digest(name) for name in self._tyres}
        found |= {f"the effect {origin.name}": origin.digest for origin in self.outside_effects}
        return found | dict(source_digests()) | software()

    @cached_property
    def outside_effects(self) -> tuple[Origin, ...]:
        """Where those of its effects stand that are not of the package; goes along to the workers."""
        kinds = [effect_class(name) for name in self.model.get("effects", {}) if name not in packaged_effects()]
        return tuple(Origin.of(kind) for kind in kinds)

    @property
    def _tyres(self) -> list[str]:
        """Names and files of the measured tyres."""
        tyres = [table.get("tyre") for table in self.model.get("effects", {}).values()]
        named = [name for tyre in tyres for name in (tyre.values() if isinstance(tyre, Mapping) else [tyre])]
        named += [value for axis in self.axes if ParameterKey.parse(axis.name).name == "tyre" for value in axis.values]
        return sorted({name for name in named if isinstance(name, str)})


class ImpossibleItem(InputError):
    """A cell of the grid that cannot be computed: the sweep has to be changed."""

    def __init__(self, where: str, why: str) -> None:
        super().__init__(where, why)
        self.where, self.why = where, why

    def __str__(self) -> str:
        return f"sweep at {self.where}: {self.why}; leave it out of the sweep"


def bounds_of(model: Model, name: str) -> tuple[float, float]:
    """Physically possible values of what is called ``name``, as bicycle, effect or the tyre's condition declare."""
    key = ParameterKey.parse(name)
    for effect in model.effects:
        for parameter in effect.parameters:
            if (effect.identifier, parameter.name) == (key.effect, key.name):
                return parameter.bounds
    return BOUNDS[name] if name in BOUNDS else CONDITION_BOUNDS[key.name]


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def software() -> dict[str, str]:
    """What computes: the solver and the versions that could change a last digit."""
    names = ["velotyre", "numpy", "scipy", "sympy", *(["numba"] if default_solver().__name__ == "compiled" else [])]
    return {"eigenvalue_solver": default_solver().__name__} | {name: version(name) for name in names}


def together(names: tuple[str, ...]) -> str:
    """What is measured together: its ``names``, or how many there are."""
    return ", ".join(names) if len(names) <= MOST_NAMES else f"{names[0]} and {len(names) - 1} parameters with it"
