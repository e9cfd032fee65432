"""The verdict and the record of how it came about."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from studies.inference.identifiability import Separation


@dataclass(frozen=True)
class Named:
    """An effect with its fitted parameters: name -> (value, sd), SI."""

    identifier: str
    parameters: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Check:
    """One acceptance rule: what was asked, the figure, whether it holds."""

    what: str
    figure: str
    passed: bool


@dataclass(frozen=True)
class Verdict:
    """What is missing, relative to the library that was tried.

    Attributes
    ----------
    verdict : str
        ``none``, ``named``, ``class``, ``partial`` (something named, a gap remains) or ``unknown``.
    effects : tuple of Named
        The leading effect or effects; empty for ``none`` and ``unknown``.
    equivalent : tuple of str
        Hypotheses that the data cannot tell apart, the leader first.
    posterior : mapping
        Probability of each hypothesis.
    chi2 : mapping
        ``n``, ``nominal``, ``nuisance_only``, ``final``.
    held_out_gap : mapping
        sqrt(max(0, chi^2/n - 1)) on held-out data over that of the nominal model; None where that has no gap.
    worst : tuple of (str, float)
        Where the gap of the final model is, and its share of chi^2.
    """

    verdict: str
    effects: tuple[Named, ...]
    equivalent: tuple[str, ...]
    posterior: Mapping[str, float]
    chi2: Mapping[str, float]
    held_out_gap: Mapping[str, float | None]
    worst: tuple[tuple[str, float], ...]
    separating_measurements: tuple[Separation, ...]
    goodness_of_fit_p: float
    checks: tuple[Check, ...] = ()
    mimics: tuple[tuple[str, float, float], ...] = ()  # term, value, chi^2
    refused: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The JSON of ``velotyre diagnose``."""
        return {
            "verdict": self.verdict,
            "effects": [
                {
                    "identifier": e.identifier,
                    "parameters": {name: {"value": value, "sd": sd} for name, (value, sd) in e.parameters.items()},
                }
                for e in self.effects
            ],
            "class": list(self.equivalent),
            "posterior": dict(self.posterior),
            "chi2": dict(self.chi2),
            "held_out_gap": dict(self.held_out_gap),
            "worst": [{"where": where, "share": share} for where, share in self.worst],
            "separating_measurements": [{"what": s.what, "gain": s.gain} for s in self.separating_measurements],
            "goodness_of_fit_p": self.goodness_of_fit_p,
            "checks": [{"what": c.what, "figure": c.figure, "passed": c.passed} for c in self.checks],
            "mimics": [{"what": what, "value": value, "chi2": chi2} for what, value, chi2 in self.mimics],
            "not_tried": dict(self.refused),
            "warnings": list(self.warnings),
        }
