"""One kind of measurement: data with standard deviations, the physics that predicts them, and what may be wrong."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from studies.inference.parameter import Array, Candidate, UncertainParameter, central_differences, stencil
from studies.inference.rules import RULES

if TYPE_CHECKING:
    from studies.inference.fit import Fit
    from studies.inference.joint import Part
    from studies.inference.judge import Judgement

Candidates = tuple[Candidate, ...]
Prediction = tuple[Array, Array]
"""Values (m,) and their derivatives (m, p)."""

Figure = tuple[Callable[["Judgement", Path], bool], str]
"""Draws into a file without its ending, False if there is nothing to draw; and the caption."""


@dataclass(frozen=True)
class Series:
    """Display of the residuals of one series."""

    channel: str  # several series may be of one channel
    quantity: str = ""  # measured values with their unit, for an axis
    axis: str = ""  # its abscissa with the unit; empty if common to all
    shown: str = ""  # the quantity with its unit as readers know it, such as "frequency, Hz"; empty if ``quantity`` is
    factor: float = 1.0  # from the unit of the values to that of ``shown``
    logarithm: bool = False  # the values are natural logarithms

    @property
    def label(self) -> str:
        """Label of an axis of shown values."""
        return self.shown or self.quantity


@dataclass(frozen=True)
class Rows:
    """Place, series and fold of each of the n residuals: where it was measured, and when it is held out."""

    places: tuple[str, ...]  # (n,), place in words, for the report
    abscissa: Array  # (n,), a speed, an angle, the number of a condition; its unit is in ``axis``
    # (n,), residuals of one series follow each other: an eigenvalue's part along speed, a channel in time
    series: tuple[str, ...]
    fold: NDArray[np.intp]  # (n,), number of the held-out fold
    inputs: Array | None = None  # (n, inputs), measured inputs at each row, whitened as the residuals are
    condition: tuple[str, ...] = ()  # names of the conditions 0, 1 ... if the abscissa is a number of a condition
    # display of each series; one that is not named is its own channel
    displays: Mapping[str, Series] = field(default_factory=dict)
    axis: str = ""  # label of the abscissa with its unit

    def show(self, series: str) -> Series:
        """Display of a ``series``: as declared, or under its own name without a quantity."""
        return self.displays.get(series, Series(series))

    @property
    def channels(self) -> NDArray[np.str_]:
        """Channel of each row (n,)."""
        return np.array([self.show(name).channel for name in self.series])

    @property
    def one_axis(self) -> bool:
        """True if all rows have one continuous quantity as abscissa, named with its unit in ``axis``."""
        return bool(self.axis) and not self.condition and not any(series.axis for series in self.displays.values())


@dataclass(frozen=True, eq=False)
class Proposal:
    """A feasible further measurement of m numbers."""

    what: str  # in words, for the report
    sd: Array  # (m,), standard deviation of each number, in its unit
    predict: Callable[[Candidates, Array], Prediction]  # values (m,) and derivatives (m, p) at coordinates (p,)
    # effects of unknowns inside the kind (initial states) on the values, in units of the sd: derivatives (m, p) through
    # those that follow the coordinates (p,), and effects (m, k) of 1 sd of each that stays free
    inner: Callable[[Candidates, Array], Prediction] | None = None

    def predict_white(self, candidates: Candidates, theta: Array) -> Prediction:
        """Predicted values (m,) and their derivatives (m, p) at coordinates ``theta`` (p,), both in units of the sd."""
        value, slope = self.predict(candidates, theta)
        return value / self.sd, slope / self.sd[:, None]


class Kind:
    """Base class of a kind of measurement: data of n numbers, a prediction, and candidates that may be missing."""

    top: ClassVar[dict[str, type["Kind"]]] = {}  # kinds that a measurement file may have
    part: ClassVar[dict[str, type["Kind"]]] = {}  # kinds that a part of joint data may have
    kind: ClassVar[str] = ""
    table: ClassVar[str] = ""  # the table that it is read from
    keys: ClassVar[Any] = None  # schema of that table; None if it is checked by the kind itself
    columns: ClassVar[tuple[str, ...]] = ()  # columns of the table of data that it names, for the documentation
    missing: ClassVar[str] = ""  # advice for a file without that table
    whole: ClassVar[bool] = False  # read from the whole file: it has parts
    of_bicycle: ClassVar[bool] = False  # read with a base model
    thorough: bool = True  # cheap enough to begin each fit from several starts

    name: str = ""
    description: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()  # assumptions, for the report
    nuisances: tuple[UncertainParameter, ...]
    candidates: Candidates
    refused: Mapping[str, str] = {}  # effects that cannot be tried, and why
    model: Any = None  # base model of a bicycle
    uncertainty: Mapping[str, float] = {}  # stated 1-sigma of its parameters, SI
    parts: tuple["Part", ...] = ()

    def __init_subclass__(cls, *, kind: str = "", table: str = "", top: bool = True, part: bool = False) -> None:
        super().__init_subclass__()
        if kind:
            cls.kind, cls.table = kind, table or kind
            if top:
                Kind.top[kind] = cls
            if part:
                Kind.part[kind] = cls

    # ---- reading ----

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "Kind":
        """Build it from its table ``content``, with files in ``folder`` and the fields ``common`` to all kinds."""
        raise NotImplementedError(f"{cls.__name__} cannot be read from a file")

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> "Kind":
        """Copy with nuisances and candidates filled in, ``without`` some effects and ``also`` with some motors."""
        return self

    def with_model(self, model: Any) -> "Kind":
        """Copy with another base ``model``; InputError if the kind has no bicycle."""
        raise NotImplementedError(f"{self.name} has no bicycle model")

    def mistakes(self) -> Candidates:
        """Candidates: errors of the measurement itself, and causes that only this kind of data can show."""
        return ()

    def names(self) -> set[str]:
        """Identifiers of everything that may be tried or left out."""
        return {c.identifier for c in self.mistakes()}

    @property
    def excludes(self) -> tuple[str, ...]:
        """Identifiers of effects that no part of joint data may try if this kind is among the parts."""
        return ()

    # ---- data and physics ----

    rows: Rows
    data: Any  # measured values (n,) and their standard deviations (n,), each in its unit

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        """Computed values (n,), in the units of the data, of the model with ``candidates`` at ``theta`` (p,)."""
        raise NotImplementedError

    def unknowns(self, candidates: Candidates) -> tuple[UncertainParameter, ...]:
        """Unknowns (p) in the order of the coordinates: the nuisances, then those of the candidates."""
        return (*self.nuisances, *(u for c in candidates for u in c.unknowns))

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> Prediction:
        """Computed values (n,) and their derivatives (n, p), by central differences unless a kind overrides it."""
        batch, steps = stencil(self.unknowns(candidates), theta)
        computed = np.stack([self.predict(candidates, point) for point in batch])
        return computed[0], central_differences(computed, steps)

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        """(measured - computed) / sd (n,) and its derivative (n, p), or (n, 0) without ``slopes``."""
        measured, sd = self.data
        if not slopes:
            return (measured - self.predict(candidates, theta)) / sd, np.empty((len(sd), 0))
        computed, slope = self.value_and_jacobian(candidates, theta)
        return (measured - computed) / sd, -slope / sd[:, None]

    def misfit(self, candidates: Candidates, theta: Array) -> float:
        """Chi^2 of the data at ``theta`` (p,): the sum of the squares of the residuals."""
        residual, _ = self.residual(candidates, theta, slopes=False)
        return float(residual @ residual)

    def log_determinant(self, candidates: Candidates, theta: Array) -> float:
        """Log determinant that the evidence needs for unknowns marginalised inside the kind, such as initial states."""
        return 0.0

    def marginalise_noise(self, candidates: Candidates, theta: Array, white: Array) -> Array:
        """Residuals (n, draws) of ``white`` noise (n, draws) once the unknowns inside the kind are fitted to it."""
        return white

    def marginalised_sizes(
        self, candidates: Candidates, theta: Array, name: str
    ) -> Mapping[str, tuple[float, float, str]]:
        """Value, sd and unit of each number that is marginalised inside for the candidate called ``name``, by name."""
        return {}

    # ---- search ----

    @property
    def library(self) -> Candidates:
        """Candidates among which the prior probability is shared, also those that are not tried again."""
        return self.candidates

    @property
    def varied(self) -> bool:
        """True if the conditions differ enough for a name: two speeds, two loads, two inputs."""
        return True

    def with_candidates(self: Self, candidates: Candidates) -> Self:
        """Copy that tries these ``candidates`` only; the kind must be a dataclass with a field ``candidates``."""
        trimmed: Self = replace(self, candidates=candidates)  # type: ignore[type-var]
        return trimmed

    def compatible(self, candidates: Candidates) -> bool:
        """True if these ``candidates`` can be in one model."""
        return True

    def concerns(self, candidate: Candidate) -> bool:
        """True if a ``candidate`` of joint data may act on this kind's data."""
        return True

    def enabled_by(self, candidates: Candidates) -> Candidates:
        """Further candidates that only these make possible (camber thrust once there is a tyre)."""
        return ()

    def empirical_terms(self) -> Candidates:
        """Empirical terms that can mimic an unknown effect, each as a candidate."""
        return ()

    def directions(self) -> Candidates:
        """Terms of one size and either sign as candidates: residuals of a hypothesis are tested for each of them."""
        return ()

    def easier_problems(self) -> tuple["Kind", ...]:
        """Problems of the same unknowns with fewer local optima, the easiest first."""
        return ()

    @property
    def costly(self) -> bool:
        """True if the data are so many that the search begins in a part of them."""
        return len(self.rows.places) > 2 * RULES.thinned

    def thin(self, most: int) -> "Kind":
        """Copy with about ``most`` of the data if there are more than twice as many; else itself."""
        return self

    def simplify(self) -> "Kind":
        """Problem for a first look: few data, with few local optima."""
        return (self.easier_problems() or (self,))[-1]

    def misreadings(self) -> Iterator[tuple[str, "Kind"]]:
        """Pairs of a unit or sign in which the data may be meant, in words, and the kind with the data read so."""
        yield from ()

    def estimate_noise(self, best: Any) -> "Kind":
        """Copy whose noise is estimated from ``best.residual`` (n,); itself if the noise is stated."""
        return self

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Feasible further measurements."""
        return ()

    # ---- report ----

    @property
    def speeds(self) -> Array:
        """Measured speeds, m/s; empty without motion."""
        return np.zeros(0)

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of its recorded runs."""
        return ()

    def figures(self) -> dict[str, Figure]:
        """Figures by name (``gap``, ``before_after``), each a function that draws it and a caption."""
        return {}

    def doubts(self, judgement: "Judgement", torque: "Fit | None" = None) -> tuple[str, ...]:
        """Sentences about statements of the data that are surely wrong, given the fit of a residual ``torque``."""
        return ()

    def find_mispairings(self, judgement: "Judgement") -> tuple[str, ...]:
        """Sentences about data that are compared with another mode or channel than their name says."""
        return ()

    def bicycles(self, final: "Fit") -> dict[str, tuple["Kind", "Fit"]]:
        """Each bicycle ("" the first) with the kind that has its base model, and the fit in its own names."""
        return {"": (self, final)} if self.model is not None else {}

    def corrected_model(self, final: "Fit") -> Any:
        """Base model with the effects of the ``final`` fit, None without one; InputError if they cannot be combined."""
        return None

    def held_out_data(self) -> "Kind | None":
        """Data that are predicted and never fitted, as the same kind with the same noise; None if there are none."""
        return None

    def residuals_by_channel(self, candidates: Candidates, theta: Array) -> dict[str, Array]:
        """Measured minus computed values (m,) of each channel, in its unit, at ``theta`` (p,)."""
        gap = self.residual(candidates, theta, slopes=False)[0] * self.data[1]
        channels = self.rows.channels
        return {name: gap[channels == name] for name in dict.fromkeys(channels.tolist())}

    def measured_by_channel(self) -> dict[str, Array]:
        """Measured values (m,) of each channel, in its unit, in the order of :meth:`residuals_by_channel`."""
        measured, channels = self.data[0], self.rows.channels
        return {name: measured[channels == name] for name in dict.fromkeys(channels.tolist())}

    def channel_noise_sd(self, residuals: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
        """Noise of each channel if estimated: the sd that is used and the sd from sample to sample, in its unit."""
        return {}

    # ---- parts ----

    def split_parts(self) -> Iterator[tuple[str, "Kind", "Kind"]]:
        """Triples, one for each part: its name, its kind, and joint data of this part alone."""
        yield "", self, self

    def select_parts(self, names: Sequence[str]) -> "Kind":
        """Copy with only the parts of these ``names``."""
        return self

    def slices(self) -> list[slice]:
        """Slice of the rows of each part."""
        return [slice(0, len(self.rows.places))]

    def restrict_to_part(self, number: int, candidates: Candidates) -> tuple[Candidates, NDArray[np.intp]]:
        """Candidates that act on part ``number``, and the indices (q,) of its coordinates among those of the whole."""
        return candidates, np.arange(len(self.unknowns(candidates)))

    def view_part(self: Self, judgement: "Judgement", number: int) -> "Judgement":
        """The ``judgement`` restricted to the part with this ``number``."""
        return judgement
