"""Parts of joint data against each other: which contradicts the rest, and which is the odd one if nothing fits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from studies.inference.fit import Fit, fit
from studies.inference.judge import judge
from studies.inference.kind import Kind
from studies.inference.rules import RULES
from studies.inference.verdict import Verdict


@dataclass(frozen=True)
class Compared:
    """A number of an effect by one part alone and by the rest: values, 1 sd, and their difference in sd."""

    name: str
    unit: str
    own: float
    own_sd: float
    rest: float
    rest_sd: float

    @property
    def difference(self) -> float:
        """Difference in its standard deviations."""
        return (self.own - self.rest) / float(np.hypot(self.own_sd, self.rest_sd))


@dataclass(frozen=True)
class PartAgainstRest:
    """One part of joint data against the others."""

    part: str
    p: float  # P(a larger disagreement | one model is true of all)
    sd: float  # the largest disagreement along one direction of the unknowns, in sd
    effects: tuple[Compared, ...]  # numbers of the effects of the hypothesis that the part and the rest can both see
    # numbers of effects that act on both, of which the part or the rest tells little more than the prior
    unseen: tuple[str, ...] = ()

    @property
    def contradicts(self) -> bool:
        """The part and the rest are unlikely to be of one model."""
        return self.p < RULES.doubtful


def parts_against_rest(kind: Kind, joint: Fit) -> tuple[PartAgainstRest, ...]:
    """Each part of ``kind`` against all others, about the hypothesis ``joint`` that was fitted to all."""
    found, names = [], [part.name for part in kind.parts]
    for name, rows in zip(names, kind.slices(), strict=True) if names else ():
        own, rest = (
            _alone(kind.select_parts(some), joint) for some in ([name], [other for other in names if other != name])
        )
        both = [effect for effect in own if effect in rest]
        seen = [effect for effect in both if own[effect][-1] and rest[effect][-1]]
        compared = (Compared(effect, *own[effect][:3], *rest[effect][1:3]) for effect in seen)
        unseen = tuple(effect for effect in both if effect not in seen)
        found.append(PartAgainstRest(name, *disagreement(joint, rows), tuple(compared), unseen))
    return tuple(found)


def disagreement(joint: Fit, rows: slice) -> tuple[float, float]:
    """P value and size (sd) of the largest disagreement of some ``rows`` with the others, linear about a ``joint``
    fit.

    The others alone, with the prior, have their optimum at delta = A^-1 J' r from that of all, where J and r are the
    derivatives and residuals of these rows and A^-1 the covariance without them. What these rows then leave along the
    singular vectors of J A^(-1/2) is independent, of variance 1 + s^2, where s is the singular value: one by one they
    are tested, the largest by the probability that none of as many is larger (Sidak 1967, J. Am. Stat. Ass. 62). In
    posterior sd the others count as knowing each direction at least 1e-9 as well as the best: less is rounding.
    """
    j, r = joint.jacobian[rows], joint.residual[rows]
    if not (np.isfinite(j).all() and np.isfinite(r).all()):
        return 1.0, 0.0
    sd = np.sqrt(joint.covariance.diagonal())
    j = j * sd
    information = np.linalg.inv(joint.covariance / np.outer(sd, sd)) - j.T @ j
    size, axes = np.linalg.eigh((information + information.T) / 2)
    root = axes / np.sqrt(np.maximum(size, 1e-9 * size[-1]))  # A^(-1/2), of what the others and the prior know
    left, s, _ = np.linalg.svd(j @ root, full_matrices=False)
    seen = s > 1e-6  # sd of the rest, in noise: below it the rows cannot speak of a direction
    delta = root @ (root.T @ (j.T @ r))
    apart = (left.T @ (r + j @ delta))[seen] / np.sqrt(1 + s[seen] ** 2)
    if not len(apart):
        return 1.0, 0.0
    largest = float(np.abs(apart).max())
    return float(-np.expm1(len(apart) * np.log1p(-2 * ndtr(-largest)))), largest


def _alone(some: Kind, joint: Fit) -> dict[str, tuple[str, float, float, bool]]:
    """Unit, value and sd of each number of the effects of a ``joint`` hypothesis by some of the parts."""
    kept = tuple(c for c in joint.candidates if some.concerns(c))
    column = {u.name: k for k, u in enumerate(joint.nuisances)}
    sizes = (joint.theta[joint.columns(c)] for c in kept)
    begin = np.concatenate([joint.theta[[column[u.name] for u in some.nuisances]], *sizes])
    found = fit(some, kept, starts=[begin])
    spread = np.sqrt(found.covariance.diagonal())
    told = {}
    for c in kept:
        for (u, x), sd in zip(found.values(c), spread[found.columns(c)], strict=True):
            seen = bool(sd < RULES.seen * u.scale)
            for name, factor in u.factors.items():
                sized = factor * float(u.value(x)), factor * float(sd * u.slope(float(x)))
                told[f"{c.identifier}.{name}"] = (u.unit, *sized, seen)
    return told


@dataclass(frozen=True)
class WithoutOne:
    """Verdict of the others without one part."""

    part: str  # what is left out
    rest: Verdict  # verdict of the others
    alone: Verdict | None = None  # verdict of the part by itself, if it is the odd one
    final: Fit | None = None  # the model of the others: with what was named

    @property
    def clear(self) -> bool:
        """Everything else fits, with a verdict that has no reservation."""
        return self.rest.verdict in ("none", "named", "class") and fits(self.rest)


def fits(verdict: Verdict) -> bool:
    """The final model of a ``verdict`` fits its data by the rule of acceptance."""
    return verdict.goodness_of_fit_p > RULES.poor_fit


def without_each(kind: Kind, names: Sequence[str], *, single_out: bool) -> dict[str, WithoutOne]:
    """Verdict of the others without each of some parts, the part first without which the others fit best."""
    every, found = [part.name for part in kind.parts], []
    for name in every if len(every) > 1 else ():
        if name in names:
            judged = judge(kind.select_parts([other for other in every if other != name]))
            found.append(WithoutOne(name, judged.verdict, final=judged.final))
    ranked = {one.part: one for one in sorted(found, key=_order)}
    if single_out:
        ranked |= {
            name: replace(one, alone=_by_itself(kind, ranked, name)) for name, one in ranked.items() if one.clear
        }
    return ranked


def _order(one: WithoutOne) -> tuple[bool, float, float]:
    """Clear verdicts first, then by p and, if that is too small to be one, by what is left a number."""
    chi2 = one.rest.chi2
    return not one.clear, -one.rest.goodness_of_fit_p, (chi2["final"] + chi2["penalty"]) / chi2["n"]


def _by_itself(kind: Kind, known: Mapping[str, WithoutOne], name: str) -> Verdict:
    """Verdict of one part; of two parts it is what is left without the other."""
    others = [part.name for part in kind.parts if part.name != name]
    if len(others) == 1 and others[0] in known:
        return known[others[0]].rest
    return judge(kind.select_parts([name])).verdict
