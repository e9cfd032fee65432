"""Unknowns of a fit with their priors, and the candidate effects made of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from studies.inference.rules import RULES

Array = NDArray[np.float64]


class Coupling(Protocol):
    """Values of some unknowns that depend on the coordinates of all of them, as the inertias of a body do."""

    def values(self, coordinates: Array) -> Array:
        """Values (m, K) at ``coordinates`` (m, K)."""


@dataclass(frozen=True)
class UncertainParameter:
    """A free number with a normal prior in a coordinate in which the problem is smooth."""

    name: str  # as reported: ``stiffness`` of a candidate, ``IBxx`` of the bicycle
    unit: str  # as reported: ``stiffness`` of a candidate, ``IBxx`` of the bicycle
    sets: Mapping[str, float]  # parameters it sets and their factors: ``parameter = factor * value``
    centre: float  # prior mean and standard deviation of the coordinate
    scale: float  # prior mean and standard deviation of the coordinate
    lowest: float = -math.inf  # bounds of the coordinate
    highest: float = math.inf  # bounds of the coordinate
    # the value is the coordinate (1), its reciprocal (-1; a compliance) or its exponential (0), as in Box & Cox
    power: int = 1
    size: bool = False  # it measures the size of the effect: the effect is absent at ``centre``
    # names of the parameters in ``sets``, in their order, if each is reported by itself (``rear``, ``front``)
    labels: tuple[str, ...] = ()
    widened: float = 1.0  # factor by which the scale exceeds the declared one, by which an unusual size is judged
    least: float = 0.0  # smallest size |coordinate - centre| that is worth a name
    smallest: float = 0.0  # smallest size that occurs where the effect is there at all
    # the value is the exponential less one: a wrong factor, which is as probable as its reciprocal
    relative: bool = False
    assumed: bool = False  # nobody stated its scale: it is a documented default
    # what makes the value of this coordinate and those of others, all with power 1; equal to the coordinate at centre
    coupling: Coupling | None = field(default=None, compare=False)
    place: int = 0  # of the coordinate among those of the coupling

    def __post_init__(self) -> None:
        if not self.least >= 0:
            raise ValueError(f"{self.name}: least = {self.least:g} must be 0 or more; it is a size")
        if not self.scale > 0:
            raise ValueError(f"{self.name}: scale = {self.scale:g} must be above 0; omit what does not vary")
        if not self.lowest < self.highest:
            raise ValueError(f"{self.name}: nothing lies between the bounds {self.lowest:g} and {self.highest:g}")
        if self.relative and self.power != 0:
            raise ValueError(f"{self.name}: power = {self.power} must be 0; a relative value is made of an exponential")

    def value(self, coordinate: Any) -> Any:
        """Physical value of a ``coordinate``, a number or an array of any shape."""
        if self.power == 0:
            return np.expm1(coordinate) if self.relative else np.exp(coordinate)
        return np.asarray(coordinate) ** self.power

    def slope(self, coordinate: float) -> float:
        """Size of d(value)/d(coordinate)."""
        return math.exp(coordinate) if self.power == 0 else abs(self.power * coordinate ** (self.power - 1))

    def step(self, coordinate: float) -> float:
        """Step of a central difference, on the allowed side of a singular zero; the error is about 1e-9."""
        return 1e-3 * (min(self.scale, coordinate) if self.lowest > 0 else self.scale)

    @property
    def one_sided(self) -> bool:
        """The effect has one physical sign."""
        return self.size and self.lowest >= self.centre

    @property
    def factors(self) -> dict[str, float]:
        """Factors on the value of the numbers it is reported as: one, or each labelled one if they differ."""
        if len(set(self.sets.values())) <= 1:
            return {self.name: 1.0}
        labels = self.labels or tuple(self.sets)
        return {f"{self.name}.{label}": float(f) for label, f in zip(labels, self.sets.values(), strict=True)}

    def clip(self, coordinate: float) -> float:
        """``coordinate`` moved to the nearest bound if it lies beyond."""
        return min(max(coordinate, self.lowest), self.highest)


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that may be missing."""

    identifier: str  # its name in hypotheses, files and reports
    unknowns: tuple[UncertainParameter, ...]  # fitted when it joins a hypothesis; may be empty
    effect: Any = None  # for the forward model alone: what is built in
    fixed: Mapping[str, float] = field(default_factory=dict)  # its parameters that are not fitted
    ties: Mapping[str, str] = field(default_factory=dict)  # its parameters that equal another one
    replaces: str | None = None  # the effect it takes the place of
    signature: str = ""  # what it does to the data, in words, for the report
    title: str = ""  # plain name beside the identifier
    # prior probability relative to an ordinary candidate: less for a mistake that a careful laboratory rarely makes
    weight: float = 1.0
    family: str = ""  # what it is one answer with, in words: effects that are one physics in data of this kind
    # its model leaves more of the data than noise where it is the cause, which is not held against it
    approximate: bool = False
    # it has a course of its own in each run, which can stand for much that it is not: tried where nothing else explains
    absorbs: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.weight < math.inf:
            raise ValueError(f"{self.identifier}: weight = {self.weight:g} must be above 0 and finite")

    @property
    def mistake(self) -> bool:
        """It is an error of a sensor or of a file, which has a weight below one."""
        return self.weight < 1

    @property
    def soft(self) -> bool:
        """It is a compliance, gone where it is rigid."""
        return any(u.size and u.power == -1 for u in self.unknowns)

    def with_wider_prior(self) -> "Candidate":
        """Copy with a wider prior of the sizes, for rare sizes."""
        wide = RULES.unusual
        unknowns = (replace(u, scale=wide * u.scale, widened=wide * u.widened) if u.size else u for u in self.unknowns)
        return replace(self, unknowns=tuple(unknowns))

    @cached_property
    def starts(self) -> tuple[Array, ...]:
        """Coordinates from which fits begin: small and typical sizes, of either sign if both are physical."""
        points: list[Array] = []
        for share in (0.05, 0.7, -0.05, -0.7):
            start = self._coordinates_at(share)
            unclipped = np.array([u.centre + share * u.scale * u.size for u in self.unknowns])
            if share > 0 or (self.unknowns and (start == unclipped).all()):
                points.append(start)
        return tuple(points)

    @property
    def first_starts(self) -> tuple[Array, ...]:
        """Starts of a fit that can afford few: a small size; a compliance also at a typical one."""
        return self.starts[: 2 if self.soft else 1]

    @property
    def ladder(self) -> tuple[Array, ...]:
        """Coordinates of softer and softer joints, each of which may lead to another minimum; empty if not soft."""
        return tuple(self._coordinates_at(share) for share in (0.02, 0.07, 0.2, 0.7)) if self.soft else ()

    @property
    def neutral(self) -> Array:
        """Coordinates at which it is absent, or as near to that as its bounds allow."""
        return self._coordinates_at(0.0)

    def _coordinates_at(self, share: float) -> Array:
        """Coordinates with sizes of a ``share`` of their prior sd, within their bounds."""
        return np.array([u.clip(u.centre + share * u.scale * u.size) for u in self.unknowns])


def hypothesis_name(candidates: Sequence[Candidate]) -> str:
    """Name of a hypothesis of ``candidates``: ``a+b``, or ``none``."""
    return "+".join(candidate.identifier for candidate in candidates) or "none"


def couplings(unknowns: Sequence[UncertainParameter]) -> list[tuple[Coupling, list[int]]]:
    """Couplings among the ``unknowns``, each with the columns of its coordinates in their order."""
    columns: dict[int, list[int]] = {}
    by_id: dict[int, Coupling] = {}
    for column in sorted(range(len(unknowns)), key=lambda column: unknowns[column].place):
        coupling = unknowns[column].coupling
        if coupling is not None:
            by_id[id(coupling)] = coupling
            columns.setdefault(id(coupling), []).append(column)
    return [(coupling, columns[key]) for key, coupling in by_id.items()]


def values_of(unknowns: Sequence[UncertainParameter], theta: Array) -> Array:
    """Physical values (p, K) at coordinates ``theta`` (p, K)."""
    values = np.array([u.value(x) for u, x in zip(unknowns, theta, strict=True)], dtype=float).reshape(np.shape(theta))
    for coupling, columns in couplings(unknowns):
        values[columns] = coupling.values(theta[columns])
    return values


def slopes_of(unknowns: Sequence[UncertainParameter], theta: Array) -> Array:
    """Derivatives (p, p) of the physical values along the coordinates at ``theta`` (p,)."""
    signs = np.array([-1.0 if u.power < 0 else 1.0 for u in unknowns])
    slopes = np.diag(signs * np.array([u.slope(float(x)) for u, x in zip(unknowns, theta, strict=True)]))
    for coupling, columns in couplings(unknowns):
        batch, steps = stencil([unknowns[column] for column in columns], theta[columns])
        slopes[np.ix_(columns, columns)] = central_differences(coupling.values(batch.T).T, steps)
    return slopes


def stencil(unknowns: Sequence[UncertainParameter], theta: Array) -> tuple[Array, Array]:
    """Points of central differences."""
    steps = np.array([u.step(x) for u, x in zip(unknowns, theta, strict=True)])
    shift = np.diag(steps)
    return np.vstack([theta[None], theta + shift, theta - shift]), steps


def central_differences(computed: Array, steps: Array) -> Array:
    """Derivatives (n, p) from values ``computed`` (2 p + 1, n) at a :func:`stencil` of ``steps`` (p,)."""
    p = len(steps)
    return np.asarray(((computed[1 : p + 1] - computed[p + 1 :]) / (2 * steps[:, None])).T)
