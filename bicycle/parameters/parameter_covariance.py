"""Names of the parameters of a model, and their covariance."""

from collections.abc import Collection, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground import schema
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown, shown
from tyre.measured.properties import JointCovariance

WHEELS = ("rear", "front")
TABLE, FILE, MODEL_FILE = "tyre table", "bicycle file", "model file"  # where a covariance is stated


@dataclass(frozen=True)
class ParameterKey:
    """The key of one parameter, or of both wheels' values of it."""

    effect: str  # identifier of the effect; empty for a parameter of the bicycle or a condition of its tyres
    name: str  # name of the parameter
    wheel: str = ""  # ``rear`` or ``front``; empty for one number, or for both wheels together

    def __post_init__(self) -> None:
        plain = all("." not in part for part in (self.effect, self.name))
        if not plain or not self.name or self.name in WHEELS or self.wheel not in ("", *WHEELS):
            raise InputError(
                f"parameter {shown(str(self))}: write a key of the bicycle, effect.name or effect.name.wheel, "
                f"with {' or '.join(WHEELS)} for the wheel"
            )

    @classmethod
    def parse(cls, text: "str | ParameterKey") -> "ParameterKey":
        """The key that a ``text`` such as effect.name.wheel writes."""
        if isinstance(text, ParameterKey):
            return text
        head, _, last = text.rpartition(".")
        without_wheel, wheel = (head, last) if head and last in WHEELS else (text, "")
        effect, dot, name = without_wheel.rpartition(".")
        if dot and not effect:
            raise InputError(f"parameter {shown(text)}: the name of the effect before the dot is missing")
        return cls(effect, name, wheel)

    def __str__(self) -> str:
        return ".".join(part for part in (self.effect, self.name, self.wheel) if part)

    @property
    def entry(self) -> str:
        """``name`` or ``name.wheel``, as the effect itself calls it."""
        return ".".join(part for part in (self.name, self.wheel) if part)

    @property
    def whole(self) -> "ParameterKey":
        """The key without the wheel: of both wheels' values together."""
        return replace(self, wheel="")

    def at_wheel(self, wheel: str) -> "ParameterKey":
        """The key of one wheel's value."""
        return replace(self, wheel=wheel)


def entries_of(key: str, names: Container[str]) -> tuple[str, ...]:
    """Which of the parameters among ``names`` a key stands for."""
    if key in names:
        return (key,)
    return tuple(entry for entry in (f"{key}.{wheel}" for wheel in WHEELS) if entry in names)


@dataclass(frozen=True, eq=False)
class ParameterCovariance(JointCovariance):
    """Covariance of parameters, ``effect.name[.wheel]`` or bicycle keys, and where it comes from."""

    origin: str = TABLE  # what states it: TABLE, FILE or MODEL_FILE
    of_file: tuple[str, ...] = ()  # names that the model file states, whatever states the others

    def origin_of(self, name: str) -> str:
        """What states the uncertainty of one parameter."""
        return MODEL_FILE if name in self.of_file else self.origin

    def with_file(self, other: "ParameterCovariance") -> "ParameterCovariance":
        """This and what the model file states of other parameters."""
        return replace(self.and_also(other), of_file=(*self.of_file, *other.names))


def checked_covariance(names: Sequence[str], covariance: ArrayLike) -> Array:
    """The ``covariance`` (SI) of parameters ``names`` (p,) as an array (p, p), refused unless it can be one."""
    if not names:
        raise InputError("no parameter is uncertain: give at least one name with its covariance")
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise InputError(f"{twice} is given twice; keep one")
    spread, size = np.asarray(covariance, float), len(names)
    if spread.shape != (size, size) or not np.isfinite(spread).all():
        raise InputError(f"covariance of {', '.join(names)} must be {size} x {size} finite numbers")
    sd = np.sqrt(np.maximum(np.diag(spread), 0.0))
    scale = np.where(sd > 0, sd, 1.0)
    with np.errstate(all="ignore"):  # variances near the end of what a float holds
        correlation = spread / np.outer(scale, scale)
    symmetric = np.isfinite(correlation).all() and np.allclose(correlation, correlation.T, rtol=0, atol=1e-9)
    if not symmetric or np.linalg.eigvalsh(correlation)[0] < -1e-9:
        raise InputError(f"covariance of {', '.join(names)} must be symmetric without negative eigenvalues")
    return spread


COVARIANCE = schema.table(
    {
        schema.needed("parameters"): schema.list_of(schema.text(), "must be a list of names of parameters", least=1),
        schema.maybe("matrix"): schema.anything,
        schema.maybe("factor"): schema.anything,
    }
)


def read_covariance(
    table: Mapping[str, Any], parameters: Collection[str], *, where: str, origin: str = FILE
) -> ParameterCovariance:
    """Joint covariance S (SI) of parameters among ``parameters``: its matrix, or a factor L with S = L L'."""
    content = schema.read(COVARIANCE, table, where=where)
    names, keys = content["parameters"], [key for key in ("matrix", "factor") if key in content]
    refuse_unknown("parameter", names, parameters, where=where)
    if len(keys) != 1:
        raise InputError(f"{where}: give one of matrix and factor")
    columns = len(names) if keys == ["matrix"] else None
    row = schema.list_of(
        schema.number(),
        f"must be {columns} finite numbers" if columns else "must be finite numbers",
        least=columns or 1,
        most=columns or schema.MOST,
    )
    says = f"must be {len(names)} rows of as many numbers"
    rows = schema.read(
        schema.list_of(row, says, least=len(names), most=len(names)), content[keys[0]], where=where, section=keys[0]
    )
    if len({len(numbers) for numbers in rows}) > 1:
        raise InputError(f"{where}: factor {says}")
    matrix = np.array(rows, float)
    try:
        spread = checked_covariance(names, matrix @ matrix.T if keys == ["factor"] else matrix)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    return ParameterCovariance(tuple(names), spread, origin=origin)
