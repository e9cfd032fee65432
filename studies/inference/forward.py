"""What the search knows of the world: a forward model that turns unknowns into whitened residuals."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from studies.inference.arrays import Array
from studies.inference.parameter import Candidate, UncertainParameter


@dataclass(frozen=True)
class Series:
    """How the residuals of one series are shown.

    Attributes
    ----------
    channel : str
        What was measured; several series may be of one channel.
    quantity : str
        Its values with their unit, for the axis of measured values.
    axis : str
        What they stand over (:attr:`Rows.abscissa`) with its unit; empty where that is common to all.
    """

    channel: str
    quantity: str = ""
    axis: str = ""


@dataclass(frozen=True)
class Rows:
    """Where the residuals come from, one entry for each.

    Attributes
    ----------
    where : tuple of str
        In words, for the report.
    abscissa : ndarray, shape (n,)
        What the residuals of a series stand over: a speed, an angle, the number of a condition.
    series : tuple of str
        Residuals of one series follow each other: an eigenvalue's part along speed, a channel in time.
    fold : ndarray of int, shape (n,)
        Held-out fold.
    inputs : ndarray, shape (n, inputs), optional
        Known inputs at each row, whitened alike.
    condition : tuple of str
        Names of the conditions 0, 1 ... in ``abscissa``, where that is a number of a condition.
    shown : mapping of str to Series
        How each series is shown; one that is not named is its own channel.
    axis : str
        Label of the abscissa with its unit.
    """

    where: tuple[str, ...]
    abscissa: Array
    series: tuple[str, ...]
    fold: NDArray[np.intp]
    inputs: Array | None = None
    condition: tuple[str, ...] = ()
    shown: Mapping[str, Series] = field(default_factory=dict)
    axis: str = ""

    def show(self, series: str) -> Series:
        """How the series called ``series`` is shown."""
        return self.shown.get(series, Series(series))

    @property
    def channels(self) -> NDArray[np.str_]:
        """Channel of each row (n,)."""
        return np.array([self.show(name).channel for name in self.series])

    @property
    def one_axis(self) -> bool:
        """Whether all rows stand over one continuous quantity."""
        return not self.condition and not any(series.axis for series in self.shown.values())


@dataclass(frozen=True, eq=False)
class ProposedMeasurement:
    """A feasible further measurement: what, in words, and the sd (m,) of its numbers.

    A forward model adds, in a class of its own, what it needs to predict it.
    """

    what: str
    sd: Array


class Residual(Protocol):
    """Anything with whitened residuals: a fit."""

    @property
    def residual(self) -> Array:
        """(n,)."""


class Forward(Protocol):
    """A forward model with composable effects; :class:`ForwardModel` answers what most need not ask.

    Its methods take ``candidates``, those that join the base model, and ``theta`` (p,), the coordinates of the
    nuisances and then of the unknowns of these candidates, in their order.
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
    def library(self) -> tuple[Candidate, ...]:
        """What shares the prior: the candidates, or more where only some are tried again."""

    @property
    def refused(self) -> Mapping[str, str]:
        """Effects that cannot be tried, and why."""

    @property
    def rows(self) -> Rows:
        """Where the residuals come from."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed."""

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """(measured - computed) / sd with ``candidates`` at ``theta`` (p,).

        Its shape is (n,); that of its derivative (n, p), or (n, 0) without ``slopes``.
        """

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Of the covariance of what was marginalised inside (initial states), with ``candidates`` at ``theta`` (p,)."""

    def marginalised(self, candidates: tuple[Candidate, ...], theta: Array, white: Array) -> Array:
        """What marginalising inside leaves of ``white`` noise (n, draws), with ``candidates`` at ``theta`` (p,)."""

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Feasible further measurements."""

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """What a ``proposal`` would give with ``candidates`` at ``theta`` (p,), in its sd (m,), and slopes (m, p)."""

    def loose(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array] | None:
        """How what was marginalised inside moves a ``proposal``, in its sd; None where it does not.

        First (m, p), what is to be added to the slopes, as it follows ``theta`` (p,); then (m, k), for 1 sd of each
        direction in which the data leave it open at ``theta``.
        """

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Whether these ``candidates`` make a model together."""

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Further candidates that only these ``candidates`` make possible (camber thrust once there is a tyre)."""

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Terms without a physical cause that can mimic an unknown one."""

    def directions(self) -> tuple[Candidate, ...]:
        """Those of one size and either sign, in whose directions what a hypothesis leaves is judged."""

    @property
    def varied(self) -> bool:
        """Whether the conditions differ enough for a name: two speeds, two loads, two inputs."""

    def easier(self) -> tuple["Forward", ...]:
        """Problems of the same unknowns with fewer local optima, from the easiest; a fit is guided by them to this."""

    def refined(self, best: Residual) -> "Forward":
        """The same with its noise estimated from the residual of the ``best`` fit; itself where the noise is known."""


class ForwardModel:
    """The answers of a forward model that marginalises nothing, knows its noise and proposes nothing.

    What is left to say: ``nuisances``, ``candidates``, ``rows`` and ``residual``.
    """

    thorough = True
    refused: Mapping[str, str] = {}
    notes: tuple[str, ...] = ()

    @property
    def varied(self) -> bool:
        """They do."""
        return True

    @property
    def library(self) -> tuple[Candidate, ...]:
        """The candidates."""
        return self.candidates  # type: ignore[attr-defined]

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Zero, whatever ``candidates`` at ``theta`` (p,): nothing is marginalised."""
        return 0.0

    def marginalised(self, candidates: tuple[Candidate, ...], theta: Array, white: Array) -> Array:
        """All of ``white`` (n, draws), whatever ``candidates`` at ``theta`` (p,): nothing is marginalised."""
        return white

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """None."""
        return ()

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """Never asked, at no ``theta`` (p,), where there is no ``proposal``; see :meth:`Forward.predict`."""
        raise NotImplementedError

    def loose(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array] | None:
        """None, whatever ``candidates`` at ``theta`` (p,): a ``proposal`` is a measurement of its own."""
        return None

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Any ``candidates`` go together."""
        return True

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """``candidates`` make no others possible."""
        return ()

    def phenomenological(self) -> tuple[Candidate, ...]:
        """None."""
        return ()

    def directions(self) -> tuple[Candidate, ...]:
        """None."""
        return ()

    def easier(self) -> tuple[Forward, ...]:
        """None."""
        return ()

    def refined(self, best: Residual) -> Self:
        """Itself, whatever the residual of ``best``."""
        return self
