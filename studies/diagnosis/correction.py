"""Correction of the base model by a diagnosis, effects added and parameters moved: behind its words and model file."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from studies.diagnosis.diagnose import Diagnosis
from studies.diagnosis.mistakes import GEOMETRY
from studies.diagnosis.residual import EFFECT, TORQUE, Residual
from studies.inference import OF, Candidate, Fit, Moved, Named, averaged_variance, compare_nuisances, describe_effect
from tyre.ground.arrays import Array


@dataclass(frozen=True, eq=False)
class Correction:
    """The base model of one bicycle with its parameters adjusted, with what was named and with the torque that is kept.

    Sentences (What, Shown, Added), ``verdict.json`` and the model file take their numbers from here.
    """

    fit: Fit  # of this bicycle alone, in its own names
    # (p + q, p + q), of its p coordinates, then of the q terms of the torque that are held at zero; as loud as the fit
    covariance: Array
    torque: Residual | None = None  # what could not be named; kept of the bicycle at the top alone

    @property
    def added(self) -> tuple[str, ...]:
        """Names of what the model file holds beyond the base model."""
        return tuple(_name_in_file(c) for c in self.fit.candidates if _fits_in_file(c))

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of what was found and no model file can hold: errors of sensors, dry friction."""
        return tuple(c.identifier for c in self.fit.candidates if not _fits_in_file(c))

    @property
    def effects(self) -> tuple[Named, ...]:
        """Everything added with its values and sd, as the model file has them."""
        size = len(self.fit.theta)
        variance = self.covariance.diagonal()[:size]
        return tuple(
            replace(describe_effect(self.fit, c, variance), identifier=_name_in_file(c))
            for c in self.fit.candidates
            if _fits_in_file(c)
        )

    @property
    def named_beside(self) -> tuple[Named, ...]:
        """Effects that were named, with their values if an unmodelled torque is fitted as well; empty if none is."""
        return tuple(e for e in self.effects if e.identifier != EFFECT) if self.torque is not None else ()

    @property
    def terms(self) -> Mapping[str, tuple[float, float, str]]:
        """Each term of the torque that exceeds its sd, the clearest first: value, sd and unit."""
        torques = (e for e in self.effects if e.identifier == EFFECT)
        terms = {name: (*values, e.units[name]) for e in torques for name, values in e.parameters.items()}
        clear = [name for name, (value, sd, _) in terms.items() if sd < abs(value)]
        return {name: terms[name] for name in sorted(clear, key=lambda name: -abs(terms[name][0]) / terms[name][1])}

    @property
    def clearest_terms(self) -> list[tuple[str, float, float, str]]:
        """Name, value, sd and unit of the three clearest of these terms."""
        return [(name, *values) for name, values in self.terms.items()][:3]

    @property
    def moved(self) -> tuple[Moved, ...]:
        """Parameters with their values as stated and as fitted, the farthest moved (in prior sd) first."""
        return compare_nuisances(self.fit, self.fit)

    @property
    def farthest(self) -> Moved | None:
        """The parameter that went farthest; None if all are exact."""
        return next(iter(self.moved), None)


def correction(diagnosis: Diagnosis, residual: Residual | None = None, bicycle: str = "") -> Correction:
    """Correction of one ``bicycle`` ("" the one at the top, which alone has a ``residual`` torque)."""
    whole = _final_fit_as_stated(diagnosis) if residual is None else residual.fit
    bicycles = diagnosis.kind.bicycles(whole)
    _, fit = bicycles.get(bicycle, (diagnosis.kind, whole))
    if residual is None:
        return Correction(fit, fit.covariance)
    if bicycle:  # the torque acts on that at the top, but all are of one fit
        return Correction(fit, whole.misfit * fit.covariance)
    place = {id(u): k for k, u in enumerate(whole.unknowns)}  # names repeat: every body has a mass
    unchosen = range(len(whole.theta), len(residual.covariance))
    columns = [*(place[id(u)] for u in fit.unknowns), *unchosen]
    return Correction(fit, residual.covariance[np.ix_(columns, columns)], residual)


def _final_fit_as_stated(diagnosis: Diagnosis) -> Fit:
    """The final fit with the covariance that the verdict states: averaged over its class, a poor fit as noise."""
    final = diagnosis.final
    averaged = averaged_variance(diagnosis.hypotheses, final)
    fitted = final.covariance.diagonal()
    wider = np.sqrt(np.divide(averaged, fitted, out=np.ones_like(fitted), where=(averaged > fitted) & (fitted > 0)))
    return replace(final, covariance=final.noise_factor**2 * final.covariance * np.outer(wider, wider))


def _name_in_file(candidate: Candidate) -> str:
    return EFFECT if candidate.identifier.startswith(TORQUE) else candidate.identifier


def _fits_in_file(candidate: Candidate) -> bool:
    """An effect of the bicycle, or a geometry that the file states wrongly."""
    return candidate.effect is not None or candidate.identifier.rpartition(OF)[2] in GEOMETRY
