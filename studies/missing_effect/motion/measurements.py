"""What was measured of a bicycle's motion, one class for each kind of data, with the base model and its uncertainty."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from bicycle.effect import registry
from bicycle.identification.recording import Run
from bicycle.model import Model
from studies.inference.fit import Fit
from studies.inference.parameter import Candidate
from studies.missing_effect.gap_figures import BEFORE_AFTER, GAP
from studies.missing_effect.interface import Figure
from studies.missing_effect.motion.bicycle_forward import BicycleForward
from studies.missing_effect.motion.candidates import find_candidates, physical
from studies.missing_effect.motion.canonical_forward import CanonicalForward, assumed, sensor_candidates
from studies.missing_effect.motion.canonical_table import CanonicalTable
from studies.missing_effect.motion.history_forward import HistoryForward, history_candidates
from studies.missing_effect.motion.modal_forward import ModalForward, measurement_candidates
from studies.missing_effect.motion.modal_table import ModalPoint
from studies.missing_effect.motion.nuisances import nuisances
from studies.missing_effect.motion.trace_figure import TRACES
from tyre.base.errors import InputError, unknown


@dataclass(frozen=True, kw_only=True)
class BicycleMeasurement(ABC):
    """What the measurements of a bicycle share.

    Attributes
    ----------
    name : str
        The file's name.
    model : Model
        The base model: bicycle and the effects it is known to have.
    uncertainty : mapping
        1-sigma by ``key`` or ``effect.parameter``, SI.
    known : mapping
        ``effect -> {parameter: value}`` of candidates, SI.
    description, source : str
    notes : tuple of str
        What was assumed or left out in reading; shown in the report.
    """

    name: str
    model: Model
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    known: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    description: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()

    @abstractmethod
    def sensors(self) -> tuple[Candidate, ...]:
        """What may be wrong with the measurement itself."""

    def assumptions(self) -> tuple[str, ...]:
        """What is assumed of this kind of data, in words."""
        return ()

    @abstractmethod
    def forward(self, *, without: tuple[str, ...] = ()) -> BicycleForward:
        """The forward model; effects in ``without`` are not tried.

        Raises
        ------
        InputError
            An effect in ``without`` that does not exist.
        """

    def figures(self) -> dict[str, Figure]:
        """Gap, and measured values with the models."""
        return {"gap": GAP, "before_after": BEFORE_AFTER}

    def on(self, model: Model) -> Self:
        """The same measurement with another base ``model``."""
        return replace(self, model=model)

    def model_with(self, final: Fit) -> Model | None:
        """The base model with the effects of ``final``, bicycle parameters as they were; None where it is not valid."""
        model = self.model
        try:
            for c in sorted(final.candidates, key=lambda c: c.replaces is None):
                if c.effect is not None:
                    model = model.with_effect(physical(c, final.theta[final.columns(c)].tolist()))
        except InputError:
            return None
        return model

    def _library(self, without: tuple[str, ...]) -> dict[str, Any]:
        """Fields of :class:`BicycleForward`."""
        sensors = self.sensors()
        known = {*registry(), *(c.identifier for c in sensors)}
        for name in without:
            if name not in known:
                raise InputError(f"--without: {unknown('effect', name, known)}")
        floating, said = nuisances(self.model, self.uncertainty)
        candidates, refused = find_candidates(self.model, self.known, without)
        sensors = tuple(c for c in sensors if c.identifier not in without)
        return {
            "base": self.model, "nuisances": floating, "candidates": (*candidates, *sensors), "refused": refused,
            "notes": (*self.notes, *self.assumptions(), *said),
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ModalMeasurement(BicycleMeasurement):
    """Eigenvalues and shape ratios of modes at several speeds: ``points`` in the order of the table."""

    points: tuple[ModalPoint, ...]

    def sensors(self) -> tuple[Candidate, ...]:
        """Speed, and gain and delay of the sensors of the ratios."""
        return measurement_candidates(tuple(dict.fromkeys(name for p in self._sorted for name in p.ratios)))

    def forward(self, *, without: tuple[str, ...] = ()) -> ModalForward:
        """See :meth:`BicycleMeasurement.forward`; ``without`` names effects that are not tried."""
        return ModalForward(points=self._sorted, **self._library(without))

    @property
    def _sorted(self) -> tuple[ModalPoint, ...]:
        return tuple(sorted(self.points, key=lambda p: (p.mode, p.speed)))


@dataclass(frozen=True, kw_only=True)
class HistoryMeasurement(BicycleMeasurement):
    """Time histories: ``runs`` with the same channels; ``noise_sd`` by channel in its unit, where given."""

    runs: tuple[Run, ...]
    noise_sd: Mapping[str, float] = field(default_factory=dict)

    def sensors(self) -> tuple[Candidate, ...]:
        """Speed, gain and delay of each channel and torque, a bias in each run."""
        return history_candidates(self.runs[0])

    def forward(self, *, without: tuple[str, ...] = ()) -> HistoryForward:
        """See :meth:`BicycleMeasurement.forward`; ``without`` names effects that are not tried."""
        return HistoryForward.of_runs(self.runs, self.noise_sd, **self._library(without))

    def figures(self) -> dict[str, Figure]:
        """The gap, and some runs in time."""
        return {"gap": GAP, "before_after": TRACES}


@dataclass(frozen=True, kw_only=True)
class CanonicalMeasurement(BicycleMeasurement):
    """Identified coefficients of the canonical equations: the table ``coefficients``."""

    coefficients: CanonicalTable

    def sensors(self) -> tuple[Candidate, ...]:
        """Speed, and gain and delay of each signal."""
        return sensor_candidates()

    def assumptions(self) -> tuple[str, ...]:
        """How the identification is imitated."""
        return assumed(self.model, self.coefficients)

    def forward(self, *, without: tuple[str, ...] = ()) -> CanonicalForward:
        """See :meth:`BicycleMeasurement.forward`; ``without`` names effects that are not tried."""
        return CanonicalForward.of_table(self.coefficients, without, **self._library(without))
