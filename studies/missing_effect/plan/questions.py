"""What a diagnosis leaves open: pairs of hypotheses that are to be told apart, sizes that could still be there."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from studies.inference.acceptance import LEFT_OVER
from studies.inference.checks import with_wider_nuisances
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit, fit
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.leading import leading_two
from studies.missing_effect.plan.separation import Judged
from tyre.base.errors import InputError, unknown

MOST_HYPOTHESES = 5
LEAST_SHARE = 0.25  # of the probability of all that is open, below which a pair is no question
NOTHING = "nothing missing"
ONE_SIDED, TWO_SIDED = 1.644854, 1.959964  # of a normal distribution, 95 %


@dataclass(frozen=True)
class PairQuestion:
    """Which of two hypotheses (indices) is true?"""

    first: int
    second: int
    words: str


@dataclass(frozen=True, eq=False)
class LimitQuestion:
    """Is an effect smaller than what would matter?

    Attributes
    ----------
    place : int
        Index of its fit (the final hypothesis with the effect) among all that are predicted.
    column : int
        Of its size among the coordinates.
    unknown : UncertainParameter
    factor : float
        Parameter over value.
    target : float
        In the unit of the parameter.
    words : str
    """

    place: int
    column: int
    unknown: UncertainParameter
    factor: float
    target: float
    words: str

    def limit(self, sd: float) -> float:
        """Expected 95 % limit of the parameter, where the effect is absent; ``sd`` in the unit of the coordinate."""
        edge = self.unknown.centre + (ONE_SIDED if self.unknown.one_sided else TWO_SIDED) * sd
        return self.factor * float(self.unknown.value(np.asarray(edge)))

    def met(self, sd: float) -> bool:
        """Whether that limit is good enough; ``sd`` in the unit of the coordinate."""
        return self.limit(sd) >= self.target if self.unknown.power == -1 else self.limit(sd) <= self.target


@dataclass(frozen=True, eq=False)
class Open:
    """All that is open.

    Attributes
    ----------
    judged : Judged
        Hypotheses with doubled uncertainty of the bicycle's parameters: a name must hold there, too.
    pairs : tuple of PairQuestion
    limits : tuple of LimitQuestion
    fits : tuple of Fit
        The judged ones, then those of the limits.
    null : int
        Index of the fit with parameters only.
    """

    judged: Judged
    pairs: tuple[PairQuestion, ...]
    limits: tuple[LimitQuestion, ...]
    fits: tuple[Fit, ...]
    null: int


def opened(diagnosis: Diagnosis, limits: Mapping[str, float]) -> Open:
    """What is open after a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
    limits : mapping of str to float
        Sizes that would matter, by ``effect`` or ``effect.parameter``, SI.

    Raises
    ------
    InputError
        A size of an effect that was not tried, or that is named already.
    """
    able, known = chosen(diagnosis), diagnosis.hypotheses
    wide = with_wider_nuisances(diagnosis.forward, known, [f for f in able if f.candidates])
    fits = [wide.find(f.identifiers) or wide.null for f in able]
    judged = Judged(tuple(fits), np.array([wide.log_posterior(f) for f in fits]))
    share = np.exp(judged.log_posterior - judged.log_posterior.max())
    share /= share.sum()
    pairs = tuple(
        PairQuestion(i, j, f"{called(fits[i])} or {called(fits[j])}")
        for i, j in combinations(range(len(fits)), 2)
        if share[i] + share[j] >= LEAST_SHARE
    )
    every, found = list(fits), []
    for key, target in limits.items():
        candidate, u, factor = _size(diagnosis, key)
        f = _beside(diagnosis, candidate)
        column = f.columns(candidate).start + candidate.unknowns.index(u)
        side = "at least" if u.power == -1 else "at most"
        words = f"{candidate.identifier}: {key.partition('.')[2] or u.name} {side} {target:g} {u.unit}"
        found.append(LimitQuestion(len(every), column, u, factor, target, words))
        every.append(f)
    if wide.null not in every:
        every.append(wide.null)
    return Open(judged, pairs, tuple(found), tuple(every), every.index(wide.null))


def chosen(diagnosis: Diagnosis) -> list[Fit]:
    """Hypotheses of a ``diagnosis`` that are open, the leading one first; one alone where nothing is."""
    known, verdict = diagnosis.hypotheses, diagnosis.verdict
    if verdict.verdict == "unknown":
        return list(leading_two(diagnosis)) or [known.null]
    by_name = {f.name: f for f in (known.null, *known.fits)}
    members = [by_name[name] for name in verdict.equivalent] or [known.null]
    leader = members[0]
    rivals = [f for f in (known.null, *known.best()) if f not in members and _possible(known, f, leader)]
    reserved = any(not c.passed and c.what != LEFT_OVER for c in verdict.checks)
    if verdict.verdict == "tentative" and reserved and known.null not in rivals:
        rivals = [known.null, *rivals]  # its name may rest on the stated uncertainties
    return [*members[: MOST_HYPOTHESES - 1], *rivals][:MOST_HYPOTHESES]


def _possible(known: Hypotheses, f: Fit, leader: Fit) -> bool:
    """Whether a hypothesis is too probable to be left aside; one that holds the leader is a matter of a limit."""
    within = bool(leader.candidates) and leader.identifiers < f.identifiers
    return (not f.candidates or f.physical) and not within and known.odds(leader, f) < CLEAR_ODDS


def called(fit: Fit) -> str:
    """A hypothesis in words."""
    return fit.name.replace("+", " + ") if fit.candidates else NOTHING


def _size(diagnosis: Diagnosis, key: str) -> tuple[Candidate, UncertainParameter, float]:
    sizes: dict[str, tuple[Candidate, UncertainParameter, float]] = {}
    for c in diagnosis.forward.candidates:
        own = [u for u in c.unknowns if u.size]
        for u in own:
            factors = u.sets.values()
            labels = u.labels or tuple(u.sets)
            if len(set(factors)) <= 1:
                names = {f"{c.identifier}.{u.name}": 1.0}
            else:
                names = {f"{c.identifier}.{u.name}.{label}": x for label, x in zip(labels, factors, strict=True)}
            if len(own) == 1 and len(names) == 1:
                names[c.identifier] = 1.0
            sizes |= {name: (c, u, factor) for name, factor in names.items()}
    if key not in sizes:
        raise InputError(f"[limits]: {unknown('size of an effect that was tried', key, sizes)}")
    found = sizes[key]
    if found[0].identifier in diagnosis.final.identifiers:
        raise InputError(f"[limits]: {key}: {found[0].identifier} is named already; its size is in the report")
    return found


def _beside(diagnosis: Diagnosis, candidate: Candidate) -> Fit:
    """The final hypothesis with a candidate more."""
    final = diagnosis.final
    found = diagnosis.hypotheses.find(final.identifiers | {candidate.identifier})
    if found is not None:
        return found
    starts = [np.concatenate([final.theta, start]) for start in candidate.first_starts]
    return fit(diagnosis.forward, (*final.candidates, candidate), starts=starts)
