"""A sweep as plain data that travels to any worker, and what makes its numbers."""

import hashlib
import inspect
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bicycle.effects.effect_registry import Origin, effect_class, packaged_effects
from bicycle.model.eigen import KERNEL
from bicycle.model.model import Model
from bicycle.model.model_file import build_model
from bicycle.parameters.parameter_covariance import ParameterKey
from studies.model_space.outputs import OUTPUTS, Output
from tyre.ground.errors import InputError
from tyre.maps.find_tyre import is_file_name, read_tyre

SPEED, BICYCLE = "speed_m_s", "bicycle"  # names of grid axes: the speed, and the bicycles of a table
SAMPLE = "sample"  # dimension of the random draws

TYRE_UNITS = {"pressure_bar": "bar", "load_N": "N", "tyre": "", "surface": ""}


@dataclass(frozen=True)
class GridAxis:
    """A parameter and its grid values: numbers, or names for ``tyre`` and ``surface``."""

    name: str  # parameter, condition of a tyre, ``speed_m_s`` or ``bicycle``
    values: tuple[Any, ...]  # SI, bar for pressures; names of tyres, surfaces and bicycles


@dataclass(frozen=True)
class Normal:
    """Jointly normal parameters: ``factor`` times its transpose is their covariance."""

    names: tuple[str, ...]  # p parameters
    mean: tuple[float, ...]  # (p,), SI
    # p rows of as many numbers as there are draws, SI for one standard deviation of each
    factor: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Uniform:
    """A parameter spread evenly between ``low`` and ``high``."""

    name: str  # parameter
    low: float  # SI
    high: float  # SI


@dataclass(frozen=True, eq=False)
class Sweep:
    """Everything a worker needs to know; plain data."""

    model: Mapping[str, Any]  # content of the model file, with absolute paths
    axes: tuple[GridAxis, ...]  # grid of bicycles, the speeds not among them
    speeds: tuple[float, ...]  # m/s, rising; empty: each bicycle at its own, or none is needed
    samples: int  # random draws in each cell of the grid
    seed: int  # of all draws
    normals: tuple[Normal, ...]  # groups that are independent of each other
    uniforms: tuple[Uniform, ...]  # independent of each other and of the normals
    tyre_covariance: bool  # True: tyres are drawn from the covariance of their measurement
    relative_cornering_stiffness_sd: float  # share of the value, for a tyre that states none; 0: none is assumed
    outputs: tuple[str, ...]  # names in OUTPUTS
    max_speed: float  # m/s, up to which critical speeds are searched
    quantiles: tuple[float, ...] | None  # 0 to 1, over the samples, kept in place of them; None: every sample is kept
    points_per_part: int  # bicycles times speeds that a worker computes before it writes
    # bicycle of the grid -> parameter -> value, SI
    bicycles: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    # bicycle of the grid -> parameter -> standard deviation to be drawn, SI
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
        """True if anything is sampled."""
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

    def outputs_from(self, *sources: str) -> list[Output]:
        """Outputs asked for, computed from some sources."""
        return [OUTPUTS[name] for name in self.outputs if OUTPUTS[name].source in sources]

    @cached_property
    def fingerprint(self) -> str:
        """Digest of all that makes the numbers; the size of the parts does not matter."""
        return _digest(self.made_of)

    @cached_property
    def made_of(self) -> dict[str, str]:
        """Digests of the sweep and of the user's files, effects and outputs, and the versions of the packages."""
        content = asdict(replace(self, points_per_part=0))
        bicycles = {key: content.pop(key) for key in ("bicycles", "bicycle_sd")}
        made_of = {"the model": _digest(content.pop("model")), "the sweep": _digest(content)}
        if self.bicycles:
            made_of["the table of bicycles"] = _digest(bicycles)
        made_of |= {f"the tyre {name}": tyre_digest(Path(name)) for name in sorted(self._tyre_files)}
        made_of |= {f"the effect {origin.name}": origin.digest for origin in self.outside_effects}
        for name in self.outside_outputs:
            made_of[f"the output {name}"] = _digest(inspect.getsource(OUTPUTS[name].function))
        return made_of | dict(software())

    @property
    def _tyre_files(self) -> set[str]:
        """The user's files of tyres; packaged tyres belong to the version of velotyre."""
        tyres: list[Any] = []
        for table in self.model.get("effects", {}).values():
            tyre = table.get("tyre")
            tyres += tyre.values() if isinstance(tyre, Mapping) else [tyre]
        for axis in self.axes:
            tyres += axis.values if ParameterKey.parse(axis.name).name == "tyre" else []
        return {tyre for tyre in tyres if tyre and is_file_name(tyre)}

    @cached_property
    def outside_effects(self) -> tuple[Origin, ...]:
        """Origins of effects that are not of the package; they go along to the workers."""
        classes = [effect_class(name) for name in self.model.get("effects", {}) if name not in packaged_effects()]
        return tuple(Origin.from_class(kind) for kind in classes)

    @cached_property
    def outside_outputs(self) -> dict[str, str]:
        """Modules that declare outputs of one's own, by output; they go along to the workers."""
        homes = {name: OUTPUTS[name].function.__module__ for name in self.outputs}
        return {name: home for name, home in homes.items() if home.split(".")[0] not in ("bicycle", "studies")}


class ImpossibleItem(InputError):
    """A cell of the grid that cannot be computed: the sweep has to be changed."""

    def __init__(self, where: str, why: str) -> None:
        super().__init__(where, why)
        self.where, self.why = where, why

    def __str__(self) -> str:
        return f"sweep at {self.where}: {self.why}; leave it out of the sweep"


def name_group(names: tuple[str, ...]) -> str:
    """Numbers measured together: their ``names``, or how many there are beyond a dozen."""
    return ", ".join(names) if len(names) <= 12 else f"{len(names)} correlated parameters ({names[0]}, …)"


def tyre_digest(file: Path) -> str:
    """SHA-256 of the ``file`` of a tyre, of a table with what is stated of it."""
    read_tyre(file)  # complains of a file that is missing or bad
    digest = hashlib.sha256()
    for part in sorted({file, file.with_suffix(".csv"), file.with_suffix(".toml")}):
        if part.is_file():
            digest.update(f"{part.name}\0".encode() + part.read_bytes() + b"\0")
    return digest.hexdigest()


def differences(before: object, current: Mapping[str, str]) -> str:
    """Names of what has changed since an earlier run, versions with both numbers."""
    if not isinstance(before, Mapping):
        return "unknown, as its record cannot be read"
    changed = []
    for name in dict.fromkeys((*current, *before)):
        old, new = before.get(name, "not used"), current.get(name, "not used")
        if old != new:
            changed.append(name if name.startswith("the ") else f"{name} ({old} before, {new} now)")
    return ", ".join(changed)


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@cache
def software() -> Mapping[str, str]:
    """Versions of the packages that make the numbers, and the solver of eigenvalues."""
    return {name: version(name) for name in ("velotyre", "numpy", "scipy", "sympy")} | {"eigenvalues": KERNEL}
