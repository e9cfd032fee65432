"""One kind of measurement: data with standard deviations, the physics that predicts them, and what may be wrong."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class Rows:
    """Places of the residuals, one entry for each."""

    where: tuple[str, ...]  # place, for the report
    abscissa: Array  # (n,), A speed, an angle, the number of a condition
    # residuals of one series follow each other: an eigenvalue's part along speed, a channel in time
    series: tuple[str, ...]
    fold: NDArray[np.intp]  # (n,), held-out fold
    inputs: Array | None = None  # (n, inputs), known inputs at each row, whitened alike
    condition: tuple[str, ...] = ()  # names of the conditions 0, 1 ... if the abscissa is a number of a condition
    # display of each series; one that is not named is its own channel
    shown: Mapping[str, Series] = field(default_factory=dict)
    axis: str = ""  # label of the abscissa with its unit

    def show(self, series: str) -> Series:
        """Display of the series called ``series``."""
        return self.shown.get(series, Series(series))

    @property
    def channels(self) -> NDArray[np.str_]:
        """Channel of each row (n,)."""
        return np.array([self.show(name).channel for name in self.series])

    @property
    def one_axis(self) -> bool:
        """True if all rows stand over one continuous quantity, which is named."""
        return bool(self.axis) and not self.condition and not any(series.axis for series in self.shown.values())


@dataclass(frozen=True, eq=False)
class Proposal:
    """A feasible further measurement: its name, the sd (m,) of its numbers, and its own prediction."""

    what: str
    sd: Array
    predict: Callable[[Candidates, Array], Prediction]
    loose: Callable[[Candidates, Array], Prediction] | None = None

    def predict_white(self, candidates: Candidates, theta: Array) -> Prediction:
        """Predicted values and derivatives in units of the sd."""
        value, slope = self.predict(candidates, theta)
        return value / self.sd, slope / self.sd[:, None]


class Kind:
    """One kind of measurement."""

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
            for known, wanted in ((Kind.top, top), (Kind.part, part)):
                if wanted:
                    known[kind] = cls

    # ---- reading ----

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "Kind":
        """Read its table, whose files lie in ``folder``; ``common`` are the fields that all kinds share."""
        raise NotImplementedError(f"{cls.__name__} cannot be read from a file")

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> "Kind":
        """Prepare nuisances and candidates, ``without`` some effects and ``also`` with some motors."""
        return self

    def with_model(self, model: Any) -> "Kind":
        """Take another base ``model``; InputError for a tyre."""
        raise NotImplementedError(f"{self.name} has no bicycle model")

    def mistakes(self) -> Candidates:
        """Possible mistakes of the measurement itself, and causes that only this kind of data can show."""
        return ()

    def names(self) -> set[str]:
        """Names of everything that may be tried or left out."""
        return {c.identifier for c in self.mistakes()}

    @property
    def excludes(self) -> tuple[str, ...]:
        """Effects that no part of joint data may try beside this one."""
        return ()

    # ---- data and physics ----

    rows: Rows
    data: Any  # measured values and their sd, (n,) each

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        """Computed values (n,)."""
        raise NotImplementedError

    def unknowns(self, candidates: Candidates) -> tuple[UncertainParameter, ...]:
        """Nuisances, then the unknowns of the candidates."""
        return (*self.nuisances, *(u for c in candidates for u in c.unknowns))

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> Prediction:
        """Computed values (n,) and their derivatives (n, p): central differences unless a kind knows better."""
        batch, steps = stencil(self.unknowns(candidates), theta)
        every = np.stack([self.predict(candidates, one) for one in batch])
        return every[0], central_differences(every, steps)

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        """(measured - computed) / sd (n,) and its derivative (n, p), or (n, 0) without ``slopes``."""
        measured, sd = self.data
        if not slopes:
            return (measured - self.predict(candidates, theta)) / sd, np.empty((len(sd), 0))
        computed, slope = self.value_and_jacobian(candidates, theta)
        return (measured - computed) / sd, -slope / sd[:, None]

    def misfit(self, candidates: Candidates, theta: Array) -> float:
        """chi^2."""
        residual, _ = self.residual(candidates, theta, slopes=False)
        return float(residual @ residual)

    def log_determinant(self, candidates: Candidates, theta: Array) -> float:
        """ln det of the covariance of whatever was marginalised inside (initial states)."""
        return 0.0

    def marginalise_noise(self, candidates: Candidates, theta: Array, white: Array) -> Array:
        """White noise (n, draws) after the marginalisation inside."""
        return white

    def marginalised_sizes(
        self, candidates: Candidates, theta: Array, name: str
    ) -> Mapping[str, tuple[float, float, str]]:
        """Value, sd and unit, by name, of what is marginalised inside for the candidate called ``name``."""
        return {}

    # ---- search ----

    @property
    def library(self) -> Candidates:
        """Candidates that share the prior, also those that are not tried again."""
        return self.candidates

    @property
    def varied(self) -> bool:
        """True if the conditions differ enough for a name: two speeds, two loads, two inputs."""
        return True

    def with_candidates(self: Self, candidates: Candidates) -> Self:
        """Try these ``candidates`` only."""
        found = copy(self)
        object.__setattr__(found, "candidates", candidates)
        return found

    def compatible(self, candidates: Candidates) -> bool:
        """True if these candidates make a model together."""
        return True

    def concerns(self, candidate: Candidate) -> bool:
        """True if a candidate of a larger whole may act here."""
        return True

    def enabled_by(self, candidates: Candidates) -> Candidates:
        """Further candidates that only these make possible (camber thrust once there is a tyre)."""
        return ()

    def empirical_terms(self) -> Candidates:
        """Terms without a physical cause that can mimic an unknown one."""
        return ()

    def directions(self) -> Candidates:
        """Terms of one size and either sign, by which the remainder of a hypothesis is judged."""
        return ()

    def easier_problems(self) -> tuple["Kind", ...]:
        """Problems of the same unknowns with fewer local optima, from the easiest."""
        return ()

    @property
    def costly(self) -> bool:
        """True if a fit is dear: the data are so many that the search begins in a part of them."""
        return len(self.rows.where) > 2 * RULES.thinned

    def thin(self, most: int) -> "Kind":
        """About ``most`` numbers of data that are more than twice as many; or itself."""
        return self

    def simplify(self) -> "Kind":
        """Data for a first look, with few local optima: few of many, if they are dear to compute."""
        return (self.easier_problems() or (self,))[-1]

    def misreadings(self) -> Iterator[tuple[str, "Kind"]]:
        """Each unit and sign in which the data may have been meant, in words, and the data read so."""
        yield from ()

    def estimate_noise(self, best: Any) -> "Kind":
        """Estimate the noise from ``best.residual``; itself if the noise is known."""
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
        """Names of its runs."""
        return ()

    def figures(self) -> dict[str, Figure]:
        """Figures by name: ``gap``, ``before_after``."""
        return {}

    def doubts(self, judgement: "Judgement", torque: "Fit | None" = None) -> tuple[str, ...]:
        """Statements of the data that are surely wrong, in words."""
        return ()

    def find_mispairings(self, judgement: "Judgement") -> tuple[str, ...]:
        """Data that a model is compared with at another place than their name says, in words."""
        return ()

    def bicycles(self, final: "Fit") -> dict[str, tuple["Kind", "Fit"]]:
        """Each bicycle ("" the first) with the kind that has its base model, and the fit in its own names."""
        return {"": (self, final)} if self.model is not None else {}

    def corrected_model(self, final: "Fit") -> Any:
        """The base model with the effects of the ``final`` fit; InputError if they make none."""
        return None

    def held_out_data(self) -> "Kind | None":
        """Data that are predicted and never fitted, as the same kind with the same noise."""
        return None

    def residuals_by_channel(self, candidates: Candidates, theta: Array) -> dict[str, Array]:
        """Measured minus computed values by channel, in its unit."""
        gap = self.residual(candidates, theta, slopes=False)[0] * self.data[1]
        return {str(name): gap[self.rows.channels == name] for name in dict.fromkeys(self.rows.channels.tolist())}

    def channel_noise_sd(self, left: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
        """Channels whose noise is estimated: the sd that is taken, and that from sample to sample."""
        return {}

    # ---- parts ----

    def split_parts(self) -> Iterator[tuple[str, "Kind", "Kind"]]:
        """Each part: its name, its kind, and the same as a whole."""
        yield "", self, self

    def select_parts(self, names: Sequence[str]) -> "Kind":
        """The parts with these names."""
        return self

    def slices(self) -> list[slice]:
        """Rows of each part."""
        return [slice(0, len(self.rows.where))]

    def restrict_to_part(self, number: int, candidates: Candidates) -> tuple[Candidates, NDArray[np.intp]]:
        """Candidates that act on a part, and the places of its coordinates among those of the whole."""
        return candidates, np.arange(len(self.unknowns(candidates)))

    def view_part(self: Self, judgement: "Judgement", number: int) -> "Judgement":
        """Restrict a judgement to one part."""
        return judgement
