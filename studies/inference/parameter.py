"""What a fit may move: an unknown with its prior, and the candidate effects made of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bicycle.effect import Effect
from studies.inference.arrays import Array

STEP = 1e-3  # of the prior scale: central differences of the (smooth) matrices, error about 1e-9


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

    def value(self, coordinate: Array) -> Array:
        """Physical value of a coordinate."""
        return np.exp(coordinate) if self.power == 0 else coordinate**self.power

    def slope(self, coordinate: float) -> float:
        """Size of d(value)/d(coordinate)."""
        return math.exp(coordinate) if self.power == 0 else abs(self.power * coordinate ** (self.power - 1))

    def step(self, coordinate: float) -> float:
        """Step of a central difference that stays on the allowed side of a singular zero."""
        return STEP * (min(self.scale, coordinate) if self.lowest > 0 else self.scale)

    @property
    def one_sided(self) -> bool:
        """The effect has one physical sign."""
        return self.size and self.lowest >= self.centre


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that may be missing.

    ``effect`` is None where it sits in the measurement, not in the bicycle. ``fixed`` are parameters that are not
    fitted, ``ties`` parameters that equal another one, ``replaces`` the effect it takes the place of.
    """

    identifier: str
    unknowns: tuple[UncertainParameter, ...]
    effect: type[Effect] | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    ties: Mapping[str, str] = field(default_factory=dict)
    replaces: str | None = None
    notes: tuple[str, ...] = ()

    @cached_property
    def starts(self) -> tuple[Array, ...]:
        """Coordinates from which fits begin: small and typical sizes, of either sign where both are physical."""
        found: list[Array] = []
        for share in (0.05, 0.7, -0.05, -0.7):
            start = np.array([u.centre + share * u.scale * u.size for u in self.unknowns])
            clipped = np.array([min(max(x, u.lowest), u.highest) for x, u in zip(start, self.unknowns, strict=True)])
            if share > 0 or (self.unknowns and (clipped == start).all()):
                found.append(clipped)
        return tuple(found)

    @property
    def first_starts(self) -> tuple[Array, ...]:
        """Where a fit begins that can afford few starts: a small size; a compliance also at a typical one.

        Soft joints have minima of their own: a slightly soft one and a soft one differ in kind (an extra mode).
        """
        soft = any(u.size and u.power == -1 for u in self.unknowns)
        return self.starts[: 2 if soft else 1]


def together(candidates: tuple[Candidate, ...]) -> str:
    """Name of a hypothesis: ``a+b``, or ``none``."""
    return "+".join(candidate.identifier for candidate in candidates) or "none"
