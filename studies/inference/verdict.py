"""The verdict and the record of how it came about."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from studies.inference.identifiability import Separation


@dataclass(frozen=True)
class Named:
    """An effect with its fitted parameters.

    Attributes
    ----------
    identifier : str
    parameters : mapping
        Name -> (value, sd), in the units of ``units``.
    units : mapping
        Name -> unit, SI; ``1`` of a pure number.
    signature : str
        What the effect does to the data, in words.
    """

    identifier: str
    parameters: Mapping[str, tuple[float, float]]
    units: Mapping[str, str] = field(default_factory=dict)
    signature: str = ""


@dataclass(frozen=True)
class AcceptanceCheck:
    """A rule that must hold before an effect is named: what was asked, the figure, whether it holds."""

    what: str
    figure: str
    passed: bool


@dataclass(frozen=True)
class Mimic:
    """A term without a cause that would take the place of what is unexplained: its value and the chi^2 it leaves."""

    what: str
    value: float
    chi2: float


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
    separating_measurements : tuple of Separation
        What would tell the class apart, best first.
    goodness_of_fit_p : float
        Of the final model.
    checks : tuple of AcceptanceCheck
        The rules of acceptance.
    mimics : tuple of Mimic
        What would take the place of the rest.
    refused : mapping
        Effects that were not tried, and why.
    warnings : tuple of str
        What was assumed, and what the reader must know.
    sentence : str
        The verdict in one true sentence.
    reasons : mapping
        Member of the class -> why it cannot be told apart.
    refused_leaders : tuple of (str, float, str)
        A hypothesis more probable than what is named, its probability, the rule it fails.
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
    checks: tuple[AcceptanceCheck, ...] = ()
    mimics: tuple[Mimic, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    sentence: str = ""
    reasons: Mapping[str, str] = field(default_factory=dict)
    refused_leaders: tuple[tuple[str, float, str], ...] = ()

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
            "mimics": [{"what": m.what, "value": m.value, "chi2": m.chi2} for m in self.mimics],
            "not_tried": dict(self.refused),
            "warnings": list(self.warnings),
        }
