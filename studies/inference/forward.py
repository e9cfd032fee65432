"""What the engine knows of the world: a forward model that turns unknowns into whitened residuals."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from studies.inference.arrays import Array
from studies.inference.parameter import Candidate, UncertainParameter


@dataclass(frozen=True)
class Rows:
    """Where the residuals come from, one entry for each: where, condition (speed), series and held-out fold."""

    where: tuple[str, ...]
    speed: Array
    series: tuple[str, ...]  # residuals of one series follow each other: eigenvalue part along speed, channel in time
    fold: NDArray[np.intp]
    inputs: Array | None = None  # (n, inputs), known inputs at each row, whitened alike
    condition: tuple[str, ...] = ()  # where the condition is no speed: names of the conditions 0, 1 ... in ``speed``
    axes: Mapping[str, str] = field(default_factory=dict)  # of a series whose ``speed`` is another quantity: its label


@dataclass(frozen=True)
class Extra:
    """A feasible further measurement: what, the sd of its numbers, and the speed (m/s) where a new one is driven."""

    what: str
    sd: Array
    speed: float | None = None


class Residual(Protocol):
    """Anything with whitened residuals: a fit."""

    @property
    def residual(self) -> Array:
        """(n,)."""


class Forward(Protocol):
    """A forward model with composable effects.

    ``residual`` gives (measured - computed) / sd (n,) and its derivative with respect to the coordinates of the
    nuisances and of the unknowns of ``candidates`` (n, p).
    """

    @property
    def thorough(self) -> bool:
        """Cheap enough to begin each fit from several starts."""

    @property
    def nuisances(self) -> tuple[UncertainParameter, ...]:
        """What floats in every fit."""

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """What may be missing."""

    @property
    def refused(self) -> dict[str, str]:
        """Effects that cannot be tried, and why."""

    @property
    def rows(self) -> Rows:
        """Where the residuals come from."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed."""

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Whitened residual (n,) and derivative (n, p), (n, 0) without ``slopes``."""

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Of the covariance of what was marginalised inside (initial states); part of the evidence."""

    def extras(self) -> tuple[Extra, ...]:
        """Feasible further measurements."""

    def predict(self, extra: Extra, candidates: tuple[Candidate, ...], theta: Array) -> tuple[Array, Array]:
        """Whitened prediction of a further measurement (m,) and its derivative (m, p)."""

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Whether these candidates make a model together."""

    def further(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Candidates that only these make possible (camber thrust once there is a tyre)."""

    def compared(self, residual: Array) -> tuple[Array, Array | None]:
        """Measured values and their sd, to be drawn over speed; sd is None where that makes no sense."""

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Terms without a physical cause that can mimic an unknown one."""

    def refined(self, best: Residual) -> "Forward":
        """The same with its noise estimated from the residual of a good fit; itself where the noise is known."""
