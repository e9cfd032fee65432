"""A sweep as plain data that travels to any worker, and its fingerprint: equal fingerprints give equal numbers."""

import hashlib
import inspect
import json
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from importlib.metadata import version
from importlib.resources import files as files_of
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from bicycle.effects.effect_registry import Origin, effect_class, packaged_effects
from bicycle.model.eigen import KERNEL
from bicycle.model.model import Model
from bicycle.model.model_file import build_model
from bicycle.parameters.parameter_covariance import ParameterKey
from studies.model_space.outputs import OUTPUTS, Output
from tyre.ground.errors import InputError
from tyre.ground.files import data_root
from tyre.maps.find_tyre import is_file_name, read_tyre

SOURCES = (  # packages and modules whose source makes the numbers of a sweep
    "bicycle", "tyre", "studies.model_space.axes", "studies.model_space.lasting_motions",
    "studies.model_space.outputs", "studies.model_space.sampling",
    "studies.sweep.reduction", "studies.sweep.result", "studies.sweep.sampler", "studies.sweep.specification",
    "studies.sweep.worker",
)  # fmt: skip

SPEED, BICYCLE = "speed_m_s", "bicycle"  # names of grid axes: the speed, and the bicycles of a table

TYRE_UNITS = {"pressure_bar": "bar", "load_N": "N", "tyre": "", "surface": ""}


@dataclass(frozen=True)
class GridAxis:
    """A parameter and its grid values: numbers, or names for ``tyre`` and ``surface``."""

    name: str  # parameter, condition of a tyre, ``speed_m_s`` or ``bicycle``
    values: tuple[Any, ...]


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
    uniforms: tuple[Uniform, ...]
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

    def wanted(self, *sources: str) -> list[Output]:
        """Outputs asked for, computed from some sources."""
        return [OUTPUTS[name] for name in self.outputs if OUTPUTS[name].source in sources]

    @cached_property
    def fingerprint(self) -> str:
        """Digest of all that makes the numbers; the size of the parts does not matter."""
        return _digest(self.made_of)

    @cached_property
    def made_of(self) -> dict[str, str]:
        """Digests of the sweep, tyres, effects, outputs and source, and the versions of software."""
        content = asdict(replace(self, points_per_part=0))
        bicycles = {key: content.pop(key) for key in ("bicycles", "bicycle_sd")}
        found = {"the model": _digest(content.pop("model")), "the sweep": _digest(content)}
        found |= {"the table of bicycles": _digest(bicycles)} if self.bicycles else {}
        tyres = [table.get("tyre") for table in self.model.get("effects", {}).values()]
        named = [name for tyre in tyres for name in (tyre.values() if isinstance(tyre, Mapping) else [tyre]) if name]
        named += [value for axis in self.axes if ParameterKey.parse(axis.name).name == "tyre" for value in axis.values]
        found |= {f"the tyre {name}": tyre_digest(name) for name in sorted(set(named))}
        found |= {f"the effect {origin.name}": origin.digest for origin in self.outside_effects}
        for name in self.outside_outputs:
            found[f"the output {name}"] = _digest(inspect.getsource(OUTPUTS[name].function))
        return {**found, **source_digests(), **software()}

    @cached_property
    def outside_effects(self) -> tuple[Origin, ...]:
        """Origins of effects that are not of the package; they go along to the workers."""
        kinds = [effect_class(name) for name in self.model.get("effects", {}) if name not in packaged_effects()]
        return tuple(Origin.of(kind) for kind in kinds)

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


def together(names: tuple[str, ...]) -> str:
    """Numbers measured together: their ``names``, or how many there are beyond a dozen."""
    return ", ".join(names) if len(names) <= 12 else f"{names[0]} and {len(names) - 1} parameters with it"


@cache
def source_digests() -> Mapping[str, str]:
    """SHA-256 of each of the :data:`SOURCES`; line ends do not count."""
    found = {}
    for source in SOURCES:
        digest = hashlib.sha256()
        package, *inner = source.split(".")
        files = [(source, files_of(package).joinpath(*inner[:-1], f"{inner[-1]}.py"))] if inner else None
        for place, file in files or sorted(_below(files_of(package))):
            digest.update(f"{place}\0".encode() + file.read_bytes().replace(b"\r\n", b"\n") + b"\0")
        found[f"the source of {source}"] = digest.hexdigest()
    return found


def _below(folder: Traversable, above: str = "") -> Iterator[tuple[str, Traversable]]:
    for item in folder.iterdir():
        place = f"{above}/{item.name}"
        if item.is_dir() and item.name != "data":  # an installed package has the data inside, a checkout beside it
            yield from _below(item, place)
        elif item.name.endswith(".py"):
            yield place, item


def tyre_digest(tyre: str) -> str:
    """SHA-256 of the files that hold a tyre: its own, or a packaged one's tables of every surface."""
    digest, folder = hashlib.sha256(), list[Traversable]((data_root() / "tyres").iterdir())
    if is_file_name(tyre):
        own = Path(tyre)
        read_tyre(own)  # complains of a file that is missing or bad
        both = {own, *(own.with_suffix(suffix) for suffix in (".csv", ".toml"))}  # of a table
        files: list[Any] = sorted(one for one in both if one.is_file())
    else:
        sidecars = [file for file in folder if file.name.endswith(".toml")]
        own_ones = [one for one in sidecars if tomllib.loads(one.read_text(encoding="utf-8")).get("tyre") == tyre]
        stems = {one.name.removesuffix(".toml") for one in own_ones}
        files = sorted((one for one in folder if one.name.rpartition(".")[0] in stems), key=lambda one: one.name)
    for file in files:
        digest.update(f"{file.name}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()


def differences(before: object, now: Mapping[str, str]) -> str:
    """Names of what has changed since an earlier run, versions with both numbers."""
    if not isinstance(before, Mapping):
        return "nobody knows what, as no record of it can be read"
    found = []
    for name in dict.fromkeys((*now, *before)):
        old, new = before.get(name), now.get(name)
        if old != new:
            digest = name.startswith("the ") or (old is not None and new is not None and len(str(new)) == 64)
            found.append(name if digest else f"{name} ({old or 'not used'} before, {new or 'not used'} now)")
    return ", ".join(found)


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@cache
def software() -> Mapping[str, str]:
    """Solver and versions of what could change a last digit."""
    return {name: version(name) for name in ("velotyre", "numpy", "scipy", "sympy")} | {"eigenvalues": KERNEL}
