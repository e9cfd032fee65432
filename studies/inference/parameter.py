"""What a fit may move: an unknown with its prior, and the candidate effects made of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from studies.inference.arrays import Array

UNUSUAL = 5.0  # times the prior sd of a size: one that seldom occurs
STEP = 1e-3  # of the prior scale: central differences of the (smooth) matrices, error about 1e-9
LADDER = (0.02, 0.07, 0.2, 0.7)
"""Of the prior sd of a softness: where further fits of a soft joint begin."""


@dataclass(frozen=True)
class UncertainParameter:
    """A free number with a normal prior in a coordinate in which the problem is smooth.

    Attributes
    ----------
    name, unit : str
        As reported: ``stiffness`` of a candidate, ``IBxx`` of the bicycle.
    sets : mapping of str to float
        Parameters it sets and their factors: ``parameter = factor * value``.
    centre, scale : float
        Prior mean and standard deviation of the coordinate.
    lowest, highest : float
        Bounds of the coordinate.
    power : int
        The value is the coordinate (1), its reciprocal (-1; a compliance) or its exponential (0), as in Box & Cox.
    size : bool
        It measures the size of the effect: the effect is absent at ``centre``.
    widened : float
        Factor by which the scale exceeds the declared one: what occurs is judged by the latter.
    labels : tuple of str
        Of the parameters in ``sets``, in their order, where each is reported by itself (``rear``, ``front``).
    least : float
        Smallest size |coordinate - centre| that is worth a name: less makes no difference that anyone would repair.
    relative : bool
        The value is what the exponential exceeds one by: of a wrong factor, which is as probable as its reciprocal.

    Raises
    ------
    ValueError
        A least size below zero, a scale that is not positive, or bounds that leave nothing between them.
    """

    name: str
    unit: str
    sets: Mapping[str, float]
    centre: float
    scale: float
    lowest: float = -math.inf
    highest: float = math.inf
    power: int = 1
    size: bool = False
    labels: tuple[str, ...] = ()
    widened: float = 1.0
    least: float = 0.0
    relative: bool = False

    def __post_init__(self) -> None:
        if not self.least >= 0:
            raise ValueError(f"{self.name}: least = {self.least:g} must be 0 or more; it is a size")
        if not self.scale > 0:
            raise ValueError(f"{self.name}: scale = {self.scale:g} must be above 0; leave out what does not float")
        if not self.lowest < self.highest:
            raise ValueError(f"{self.name}: nothing lies between the bounds {self.lowest:g} and {self.highest:g}")
        if self.relative and self.power != 0:
            raise ValueError(f"{self.name}: power = {self.power} must be 0; a relative value is made of an exponential")

    def value(self, coordinate: Array) -> Array:
        """Physical value (same shape) of ``coordinate``, an array of any shape."""
        if self.power == 0:
            return np.expm1(coordinate) if self.relative else np.exp(coordinate)
        return coordinate**self.power

    def slope(self, coordinate: float) -> float:
        """Size of d(value)/d(coordinate) at ``coordinate``, a scalar in its own unit."""
        return math.exp(coordinate) if self.power == 0 else abs(self.power * coordinate ** (self.power - 1))

    def step(self, coordinate: float) -> float:
        """Step of a central difference about the scalar ``coordinate``, on the allowed side of a singular zero."""
        return STEP * (min(self.scale, coordinate) if self.lowest > 0 else self.scale)

    @property
    def one_sided(self) -> bool:
        """The effect has one physical sign."""
        return self.size and self.lowest >= self.centre


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that may be missing.

    Attributes
    ----------
    identifier : str
    unknowns : tuple of UncertainParameter
        What is fitted when it joins a hypothesis; may be empty.
    effect : object, optional
        For the forward model alone, the search never looks at it: what is built in. None where the effect sits in the
        measurement and not in what was measured.
    fixed : mapping of str to float
        Its parameters that are not fitted.
    ties : mapping of str to str
        Its parameters that equal another one.
    replaces : str, optional
        The effect it takes the place of.
    signature : str
        What it does to the data, in words, for the report.
    weight : float
        Prior probability relative to an ordinary candidate: less for a mistake that a careful laboratory rarely makes.
    approximate : bool
        Its model leaves more of the data than noise where it is the cause: what is left over is not held against it.

    Raises
    ------
    ValueError
        A weight that is not positive and finite.
    """

    identifier: str
    unknowns: tuple[UncertainParameter, ...]
    effect: Any = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    ties: Mapping[str, str] = field(default_factory=dict)
    replaces: str | None = None
    signature: str = ""
    weight: float = 1.0
    approximate: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.weight < math.inf:
            raise ValueError(f"{self.identifier}: weight = {self.weight:g} must be above 0 and finite")

    @property
    def mistake(self) -> bool:
        """Not a thing that is there, but a mistake of a sensor or of a file: its weight is below one."""
        return self.weight < 1

    def unusual(self) -> "Candidate":
        """The same with sizes that seldom occur: prior sd of the sizes wider by :data:`UNUSUAL`."""
        unknowns = tuple(
            replace(u, scale=UNUSUAL * u.scale, widened=UNUSUAL * u.widened) if u.size else u for u in self.unknowns
        )
        return replace(self, unknowns=unknowns)

    @cached_property
    def starts(self) -> tuple[Array, ...]:
        """Coordinates from which fits begin: small and typical sizes, of either sign where both are physical."""
        found: list[Array] = []
        for share in (0.05, 0.7, -0.05, -0.7):
            start, inside = self._sized(share)
            if share > 0 or (self.unknowns and inside):
                found.append(start)
        return tuple(found)

    @property
    def ladder(self) -> tuple[Array, ...]:
        """Coordinates (p,) of softer and softer joints, of anything else none: each may lead to another minimum."""
        return tuple(self._sized(share)[0] for share in LADDER) if self.soft else ()

    @property
    def soft(self) -> bool:
        """Whether it is a compliance, gone where it is rigid."""
        return any(u.size and u.power == -1 for u in self.unknowns)

    def _sized(self, share: float) -> tuple[Array, bool]:
        """Coordinates (p,) with sizes of a ``share`` of their prior sd, and whether the bounds leave them so."""
        start = np.array([u.centre + share * u.scale * u.size for u in self.unknowns])
        clipped = np.array([min(max(x, u.lowest), u.highest) for x, u in zip(start, self.unknowns, strict=True)])
        return clipped, bool((clipped == start).all())

    @property
    def neutral(self) -> Array:
        """Coordinates (p,) at which it is absent, or as near to that as its bounds allow."""
        return np.array([min(max(u.centre, u.lowest), u.highest) for u in self.unknowns])

    @property
    def first_starts(self) -> tuple[Array, ...]:
        """Where a fit begins that can afford few starts: a small size; a compliance also at a typical one.

        Soft joints have minima of their own: a slightly soft one and a soft one differ in kind (an extra mode).
        """
        return self.starts[: 2 if self.soft else 1]


def together(candidates: tuple[Candidate, ...]) -> str:
    """Name of a hypothesis that consists of ``candidates``: ``a+b``, or ``none``."""
    return "+".join(candidate.identifier for candidate in candidates) or "none"


def stencil(unknowns: Sequence[UncertainParameter], theta: Array) -> tuple[Array, Array]:
    """Where to compute for central differences.

    Parameters
    ----------
    unknowns : sequence of UncertainParameter
    theta : ndarray, shape (p,)
        Their coordinates.

    Returns
    -------
    batch : ndarray, shape (2 p + 1, p)
        theta, theta + h_k, theta - h_k.
    steps : ndarray, shape (p,)
        h.
    """
    steps = np.array([u.step(x) for u, x in zip(unknowns, theta, strict=True)])
    shift = np.diag(steps)
    return np.vstack([theta[None], theta + shift, theta - shift]), steps


def central_differences(computed: Array, steps: Array) -> Array:
    """Derivatives (n, p) from what was ``computed`` (2 p + 1, n) at a :func:`stencil` of ``steps`` (p,)."""
    p = len(steps)
    return np.asarray(((computed[1 : p + 1] - computed[p + 1 :]) / (2 * steps[:, None])).T)
