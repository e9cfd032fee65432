"""What the forward models of the bicycle share: the base model, its nuisances and its candidates."""

from dataclasses import dataclass, field

from bicycle.model import Model, check_compatible
from studies.missing_effect.candidates import find_candidates, physical
from studies.missing_effect.family import Family
from studies.missing_effect.mimics import feedback_terms, reversed_signs
from studies.missing_effect.unknown import Candidate, Unknown
from tyre.errors import InputError


def error(name: str, unit: str, key: str, scale: float) -> Unknown:
    """An error of the measurement: zero with standard deviation ``scale``."""
    return Unknown(name, unit, {key: 1.0}, 0.0, scale, -10 * scale, 10 * scale, size=True)


@dataclass(frozen=True, kw_only=True)
class BicycleForward:
    """Base model, floating parameters, candidates, why others are not tried, and notes for the report."""

    base: Model
    nuisances: tuple[Unknown, ...]
    candidates: tuple[Candidate, ...]
    refused: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def family(self, candidates: tuple[Candidate, ...]) -> Family:
        """The base model with candidates."""
        return Family(self.base, self.nuisances, candidates)

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Whether these candidates make a model together."""
        gone = {c.replaces for c in candidates}
        kinds = [e for e in self.base.effects if e.identifier not in gone]
        kinds += [c.effect.__new__(c.effect) for c in candidates if c.effect is not None]
        try:
            check_compatible(tuple(kinds))
        except InputError:
            return False
        return True

    def further(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Candidates that these make possible."""
        if all(c.effect is None or not c.effect.provides for c in candidates):
            return ()
        model = self.base
        for c in candidates:
            if c.effect is not None:
                model = model.with_effect(physical(c, list(c.starts[1])))
        return tuple(c for c in find_candidates(model, {})[0] if c.identifier in self.refused and c.replaces is None)

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Steer torque proportional to lean, steer and their rates, and effects with the unphysical sign."""
        return (*feedback_terms(), *reversed_signs(self.candidates))
