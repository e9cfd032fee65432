"""What was measured of a bicycle's motion, one class for each kind of data, with the base model and its uncertainty."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from bicycle.effect import registry
from bicycle.identification.recording import Run
from bicycle.model import Model
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate
from studies.missing_effect.gap_figures import BEFORE_AFTER, GAP
from studies.missing_effect.interface import Figure
from studies.missing_effect.motion.candidates import find_candidates, physical
from studies.missing_effect.motion.canonical_forward import CanonicalForward, assumed, sensor_candidates
from studies.missing_effect.motion.canonical_table import CanonicalTable
from studies.missing_effect.motion.history_candidates import histories_refused, history_candidates
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.modal_forward import ModalForward
from studies.missing_effect.motion.modal_table import ModalPoint
from studies.missing_effect.motion.nuisances import nuisances
from studies.missing_effect.motion.ratio_sensors import measurement_candidates
from studies.missing_effect.motion.sensor_errors import geometry_errors, one_speed, wrong_geometry
from studies.missing_effect.motion.trace_figure import TRACES
from studies.missing_effect.motion.tyre_part import TyreForward, TyreNumbers, pressure_in_words
from tyre.base.errors import InputError, refuse_unknown

DRY = {"steer_friction": "needs time histories: dry friction is not linear in the motion, so no mode has it"}


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
        """What may be wrong with the measurement itself, and what only this kind of data can show."""

    @abstractmethod
    def impossible(self) -> dict[str, str]:
        """What cannot be tried with this measurement though others may show it, and why."""

    def assumptions(self) -> tuple[str, ...]:
        """What is assumed of this kind of data, in words."""
        return ()

    @abstractmethod
    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Forward:
        """The forward model; effects in ``without`` are not tried, motors in ``also`` are.

        Raises
        ------
        InputError
            An effect in ``without`` or ``also`` that does not exist, or that is in both.
        """

    def unfitted(self, forward: Forward) -> Forward | None:
        """Data that are predicted and never fitted, as a model like the ``forward`` one; None where there are none."""
        return None

    def figures(self) -> dict[str, Figure]:
        """Gap, and measured values with the models."""
        return {"gap": GAP, "before_after": BEFORE_AFTER}

    def on(self, model: Model) -> Self:
        """The same measurement with another base ``model``."""
        return replace(self, model=model)

    def model_with(self, final: Fit) -> Model | None:
        """The base model with what ``final`` adds: effects, and a geometry that the file states wrongly.

        All other parameters of the bicycle are as they were; None where it is not valid.
        """
        try:
            return self.with_named(final)
        except InputError:
            return None

    def with_named(self, final: Fit) -> Model:
        """The same of the bicycle of this measurement.

        Parameters
        ----------
        final : Fit

        Raises
        ------
        InputError
            The values of what is added make no effect, bicycle or combination: says which.
        """
        model = self.model
        bicycle, wrong = model.bicycle, wrong_geometry(final)
        if wrong:  # what follows the geometry still does
            moved = {key: bicycle[key] + by for key, by in wrong.items() if key in bicycle.values}
            model = Model(bicycle.replace(**moved), model.effects)
        for c in sorted(final.candidates, key=lambda c: c.replaces is None):
            if c.effect is not None:
                model = model.with_effect(physical(c, final.theta[final.columns(c)].tolist()))
        return model

    def names(self) -> set[str]:
        """Of everything that may be tried or left out."""
        floating, _ = nuisances(self.model, self.uncertainty)
        geometry, narrow = geometry_errors(self.model, floating)
        mistakes = (*self.sensors(), *geometry)
        return {*registry(), *(c.identifier for c in mistakes), *self.impossible(), *narrow}

    def _library(self, without: tuple[str, ...], also: tuple[str, ...]) -> dict[str, Any]:
        """Fields of :class:`.BicycleForward`."""
        floating, said = nuisances(self.model, self.uncertainty)
        geometry, narrow = geometry_errors(self.model, floating)
        mistakes = (*self.sensors(), *geometry)
        refused = {**self.impossible(), **narrow}
        known = self.names()
        for option, names in (("--without", without), ("--with", also)):
            refuse_unknown("effect", names, known, where=option)
        for name in set(without) & set(also):
            raise InputError(f"--without and --with both name {name!r}; give one of them")
        candidates, others = find_candidates(self.model, self.known, without, also)
        mistakes = tuple(c for c in mistakes if c.identifier not in without)
        return {
            "base": self.model, "nuisances": floating, "candidates": (*candidates, *mistakes),
            "refused": others | refused, "notes": (*self.notes, *self.assumptions(), *said),
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ModalMeasurement(BicycleMeasurement):
    """Eigenvalues and shape ratios of modes at several speeds: ``points`` in the order of the table."""

    points: tuple[ModalPoint, ...]

    def sensors(self) -> tuple[Candidate, ...]:
        """Speed, and gain, delay and low-pass of the sensors of the ratios."""
        ratios = dict.fromkeys(name for p in self._sorted for name in p.ratios)
        return measurement_candidates(tuple(ratios), [p.speed for p in self._sorted])

    def impossible(self) -> dict[str, str]:
        """Dry friction, and an offset of a single speed."""
        return DRY | one_speed([p.speed for p in self.points])

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> ModalForward:
        """See :meth:`BicycleMeasurement.forward` for ``without`` and ``also``."""
        return ModalForward(points=self._sorted, **self._library(without, also))

    @property
    def _sorted(self) -> tuple[ModalPoint, ...]:
        return tuple(sorted(self.points, key=lambda p: (p.mode, p.settings, p.speed)))


@dataclass(frozen=True, kw_only=True)
class HistoryMeasurement(BicycleMeasurement):
    """Time histories: ``runs`` with the same channels; ``noise_sd`` by channel in its unit, where given.

    Runs that are held out are never fitted: :meth:`unfitted` predicts them.
    """

    runs: tuple[Run, ...]
    noise_sd: Mapping[str, float] = field(default_factory=dict)

    def sensors(self) -> tuple[Candidate, ...]:
        """Speed, gain, delay and low-pass of the signals, a bias or drift in each run; dry friction of the steering."""
        return history_candidates(self.runs)

    def impossible(self) -> dict[str, str]:
        """Friction without a steer angle, and an offset of a single speed."""
        return histories_refused(self.runs)

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> HistoryForward:
        """See :meth:`BicycleMeasurement.forward` for ``without`` and ``also``."""
        fitted = tuple(run for run in self.runs if not run.held_out)
        return HistoryForward.of_runs(fitted, self.noise_sd, **self._library(without, also))

    def unfitted(self, forward: Forward) -> Forward | None:
        """The ``forward`` model of the runs that are held out; None where there are none."""
        runs = tuple(run for run in self.runs if run.held_out)
        return replace(forward, runs=runs) if runs and isinstance(forward, HistoryForward) else None

    def figures(self) -> dict[str, Figure]:
        """The gap, and some runs in time."""
        return {"gap": GAP, "before_after": TRACES}


@dataclass(frozen=True, kw_only=True)
class TyreMeasurement(BicycleMeasurement):
    """What a rig says of the tyres of the bicycle: ``numbers`` with their covariance. A part of a joint measurement."""

    numbers: TyreNumbers

    def sensors(self) -> tuple[Candidate, ...]:
        """None: the calibration of the rig is in its covariance."""
        return ()

    def impossible(self) -> dict[str, str]:
        """What only motion shows."""
        return DRY | {"speed_offset": "needs motion at several speeds"}

    def assumptions(self) -> tuple[str, ...]:
        """At which condition."""
        return (pressure_in_words(self.numbers),)

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> TyreForward:
        """See :meth:`BicycleMeasurement.forward` for ``without`` and ``also``."""
        return TyreForward(numbers=self.numbers, **self._library(without, also))


@dataclass(frozen=True, kw_only=True)
class CanonicalMeasurement(BicycleMeasurement):
    """Identified coefficients of the canonical equations: the table ``coefficients``."""

    coefficients: CanonicalTable

    def sensors(self) -> tuple[Candidate, ...]:
        """Speed, and gain and delay of each signal."""
        return sensor_candidates(self.coefficients.speeds)

    def impossible(self) -> dict[str, str]:
        """Dry friction; at the speeds of an identification, of which there are two or more, an offset can be told."""
        return DRY

    def assumptions(self) -> tuple[str, ...]:
        """How the identification is imitated."""
        return assumed(self.model, self.coefficients)

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> CanonicalForward:
        """See :meth:`BicycleMeasurement.forward` for ``without`` and ``also``."""
        return CanonicalForward.of_table(self.coefficients, without, **self._library(without, also))
