"""The verdict with its reasons: what was decided, and why other hypotheses were not named."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from scipy.special import chdtrc

from studies.inference.acceptance import AcceptanceCheck
from studies.inference.fit import Moved

WORDS = {
    # members of a class
    "leads": "the most probable",
    "search ended": "the most probable that meets the rules, with this number of effects",
    "close": "odds {odds:.2g} : 1 against it{unusual}",
    "alike": "same effect on the data (cosine {cosine:.3f}; odds {odds:.2g} : 1 against it){unusual}",
    "ahead": "more probable than the leading hypothesis ({odds:.2g} : 1), but {why}",
    "one more": "one more effect, odds {odds:.0f} : 1 for it: too low to add it",
    "leads wide": "the most probable with doubled parameter uncertainties",
    "close wide": "odds {odds:.0f} : 1 against it with doubled parameter uncertainties",
    # hypotheses that are refused
    "fails": "rules not met: {rules}",
    "not converged": "its fit did not converge, so it is not judged",
    "at bound": "at a bound or of an unphysical sign: {sizes}",
    "too small": "too small to matter: {names}",
    "two unusual": "more than one rare size ({sizes})",
    "unusual misfit": "of a rare size ({sizes}), and it does not fit",
    "unusual not white": "of a rare size ({sizes}), and its residuals are not white noise",
    "nothing": "by the data alone nothing is missing",
    "misfit": "it does not fit",
    "not clear": "odds below {limit:g} : 1",
    "elsewhere": "the search adds an effect only with clear odds and a better held-out score",
}


NOTHING = "none"  # name of the hypothesis without an effect
FAR_AHEAD = 1000.0  # times as probable as what is named: a refused hypothesis is worth a sentence


class Reason:
    """A reason: ``key`` of :data:`WORDS` and the ``numbers`` (also names, other reasons) in it."""

    def __init__(self, key: str, **numbers: Any) -> None:
        self.key, self.numbers = key, numbers

    def __str__(self) -> str:
        return WORDS[self.key].format(**self.numbers)

    def __repr__(self) -> str:
        return f"Reason({self.key!r}, {self.numbers!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Reason) and (self.key, self.numbers) == (other.key, other.numbers)

    def __hash__(self) -> int:
        return hash(str(self))


@dataclass(frozen=True)
class Separation:
    """A further measurement and its gain: the smallest predicted distance of the leader to an alternative, in sd."""

    what: str  # the measurement, in words
    gain: float  # sd


@dataclass(frozen=True)
class Named:
    """An effect with its fitted parameters."""

    identifier: str  # of the candidate
    parameters: Mapping[str, tuple[float, float]]  # name -> (value, sd), in the units of units
    units: Mapping[str, str] = field(default_factory=dict)  # name -> unit, SI; 1 for a pure number
    signature: str = ""  # what the effect does to the data, in words
    mistake: bool = False  # it is an error of the measurement or its file
    title: str = ""  # plain name
    family: str = ""  # what it is one answer with, in words

    @property
    def clear_sizes(self) -> list[tuple[str, float, float, str]]:
        """Name, value, sd and unit of each parameter that exceeds its sd, in the order of the effect."""
        return [
            (name, value, sd, self.units.get(name, "1"))
            for name, (value, sd) in self.parameters.items()
            if sd < abs(value)
        ]


@dataclass(frozen=True)
class Mimic:
    """An empirical term that reproduces what is unexplained: its value and the chi^2 with it."""

    what: str  # the term, in words
    value: float  # of its size, in its unit
    chi2: float  # with it, of all data


@dataclass(frozen=True)
class Judged:
    """A hypothesis that is not named: its chi^2 and goodness of fit."""

    name: str  # identifiers joined by +
    chi2: float  # of all data
    p: float  # P(chi^2 larger)


@dataclass(frozen=True)
class Verdict:
    """Verdict on missing effects, relative to the library that was tried."""

    # none, named, class, partial (something named, a significant misfit remains), tentative (an effect explains the
    # data, with a reservation) or unknown
    verdict: str
    effects: tuple[Named, ...]  # the leading effect or effects; empty for none and unknown
    equivalent: tuple[str, ...]  # hypotheses that the data cannot distinguish, the leader first
    posterior: Mapping[str, float]  # probability of each hypothesis, most probable first
    chi2: Mapping[str, float]  # n, nominal, nuisance_only, final, penalty
    # sqrt(max(0, chi^2/n - 1)) on held-out data over that of the nominal model; None if that has no gap
    held_out_gap: Mapping[str, float | None]
    separating_measurements: tuple[Separation, ...]  # measurements that distinguish the class, best first
    goodness_of_fit_p: float  # P(chi^2 larger) of the final model
    alone_p: float = 0.0  # the same of the base model with re-estimated parameters
    checks: tuple[AcceptanceCheck, ...] = ()  # the rules of acceptance
    mimics: tuple[Mimic, ...] = ()  # empirical terms that reproduce the remainder
    refused: Mapping[str, str] = field(default_factory=dict)  # effects that were not tried, and why
    warnings: tuple[str, ...] = ()  # assumptions and notes
    # member of the class -> why it cannot be distinguished from the leader
    reasons: Mapping[str, Reason] = field(default_factory=dict)
    # hypothesis more probable than what is named, its probability, the rule that it fails
    refused_leaders: tuple[tuple[str, float, Reason], ...] = ()
    judged: Judged | None = None  # what was judged, if nothing is named
    nearest: Judged | None = None  # then the most probable hypothesis that converged, of those that fit if one does
    titles: Mapping[str, str] = field(default_factory=dict)  # plain name of each effect that a sentence may name
    # if nothing is missing: parameters whose shifts closed the base model's discrepancy, the largest first
    absorbed: tuple[Moved, ...] = ()
    members: str = (
        "effects"  # what the class holds: effects, errors of the measurement or its file ("mistakes"), or both
    )

    @property
    def probability(self) -> float:
        """Probability of what the verdict names, all members of the class together, or that nothing is missing."""
        return sum(self.posterior.get(name, 0.0) for name in self.equivalent or (NOTHING,))

    @property
    def nominal_p(self) -> float:
        """P(chi^2 larger) of the base model as stated."""
        return float(chdtrc(self.chi2["n"], self.chi2["nominal"]))

    @property
    def failed(self) -> tuple[AcceptanceCheck, ...]:
        """The rules that do not hold."""
        return tuple(c for c in self.checks if not c.passed)

    @property
    def complaints(self) -> list[str]:
        """Clauses on the rules that do not hold; none on wider priors where nothing may be missing without them."""
        implied = "wide_priors" if any(c.rule == "nothing_unlikely" for c in self.failed) else ""
        return [c.complaint for c in self.failed if c.rule != implied]

    @property
    def missing(self) -> list[Named]:
        """Effects of the bicycle or the tyre that are named."""
        return [effect for effect in self.effects if not effect.mistake]

    @property
    def mistakes(self) -> list[Named]:
        """Errors of the ride, the measurement or its file that are named."""
        return [effect for effect in self.effects if effect.mistake]

    @property
    def rivals(self) -> tuple[str, ...]:
        """Hypotheses that the data cannot distinguish from the leader."""
        return self.equivalent[1:]

    @property
    def refused_far_ahead(self) -> tuple[str, Reason] | None:
        """Refused hypothesis that is far more probable than what is named, or than nothing, and why it is refused."""
        leader = self.equivalent[0] if self.equivalent else NOTHING
        least = FAR_AHEAD * self.posterior.get(leader, 0.0)
        return next(((name, why) for name, share, why in self.refused_leaders if share > least), None)

    @property
    def closest(self) -> Judged | None:
        """Hypothesis, or that of no effect, that comes closest to explaining the data if nothing is named."""
        return self.nearest or self.judged

    @property
    def look_alike(self) -> Judged | None:
        """Closest hypothesis with an effect if nothing is named; None if it has none."""
        return self.closest if self.closest is not None and self.closest.name != NOTHING else None

    @property
    def look_alike_is_judged(self) -> bool:
        """The closest alternative is what was judged, so the rules that do not hold are its own."""
        return self.look_alike is not None and self.judged is not None and self.look_alike.name == self.judged.name

    @property
    def look_alike_refusal(self) -> Reason | None:
        """Why the closest alternative is refused though more probable than what is named; None if it is not."""
        if self.look_alike is None:
            return None
        return next((why for name, _, why in self.refused_leaders if name == self.look_alike.name), None)

    @property
    def leaves_more(self) -> bool:
        """The residuals exceed noise, or after a tentative name empirical terms still explain some of them."""
        terms_explain_more = any(c.rule == "nothing_left" for c in self.failed)
        return self.verdict in ("unknown", "partial") or (self.verdict == "tentative" and terms_explain_more)

    def to_dict(self) -> dict[str, Any]:
        """The verdict for JSON, without its sentence."""
        return {
            "verdict": self.verdict,
            "effects": [
                {
                    "identifier": e.identifier,
                    "family": e.family,
                    "parameters": {name: {"value": value, "sd": sd} for name, (value, sd) in e.parameters.items()},
                }
                for e in self.effects
            ],
            "class": list(self.equivalent),
            "reasons": {name: str(why) for name, why in self.reasons.items()},
            "refused_leaders": [
                {"hypothesis": name, "probability": p, "rule": str(rule)} for name, p, rule in self.refused_leaders
            ],
            "posterior": dict(self.posterior),
            "chi2": {name: x if math.isfinite(x) else None for name, x in self.chi2.items()},
            "held_out_gap": dict(self.held_out_gap),
            "separating_measurements": [asdict(s) for s in self.separating_measurements],
            "checks": [{"what": c.what, "figure": c.figure, "passed": c.passed} for c in self.checks],
            "mimics": [asdict(m) for m in self.mimics],
            "goodness_of_fit_p": self.goodness_of_fit_p,
            "not_tried": dict(self.refused),
            "warnings": list(self.warnings),
        }
