"""Parts of joint data compared: which part contradicts the others, and which is the odd one if nothing fits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from studies.inference.fit import Fit, fit
from studies.inference.judge import judge
from studies.inference.kind import Kind
from studies.inference.rules import RULES
from studies.inference.verdict import Verdict


@dataclass(frozen=True)
class Compared:
    """A number of an effect as one part shows it and as all other parts show it."""

    name: str  # EFFECT.PARAMETER
    unit: str  # of the values and their sd; 1 if none
    own: float  # value by the part alone
    own_sd: float  # its posterior standard deviation
    rest: float  # value by all other parts
    rest_sd: float  # its posterior standard deviation

    @property
    def difference(self) -> float:
        """Value by the part less that by the other parts, in standard deviations of this difference."""
        return (self.own - self.rest) / float(np.hypot(self.own_sd, self.rest_sd))


@dataclass(frozen=True)
class PartAgainstRest:
    """One part of joint data against the others."""

    part: str  # name of the part
    p: float  # P(a larger disagreement | one model is true of all)
    sd: float  # the largest disagreement along one direction of the unknowns, in sd
    effects: tuple[Compared, ...]  # numbers of the effects of the hypothesis that the part and the rest can both see
    # names of numbers of which the part or the rest shows little more than the prior
    unseen: tuple[str, ...] = ()

    @property
    def contradicts(self) -> bool:
        """True if it is unlikely that one model is true of the part and of the others."""
        return self.p < RULES.doubtful


def parts_against_rest(kind: Kind, joint: Fit) -> tuple[PartAgainstRest, ...]:
    """Each part of ``kind`` compared with all others, by the hypothesis ``joint`` that was fitted to all; () of one."""
    names = [part.name for part in kind.parts]
    if not names:
        return ()
    comparisons = []
    for name, rows in zip(names, kind.slices(), strict=True):
        by_part = _fit_some_parts(kind.select_parts([name]), joint)
        by_others = _fit_some_parts(kind.select_parts([part_name for part_name in names if part_name != name]), joint)
        common = [number for number in by_part if number in by_others]
        shown_by_both = [number for number in common if by_part[number].narrowed and by_others[number].narrowed]
        compared = [
            Compared(
                number,
                by_part[number].unit,
                by_part[number].value,
                by_part[number].sd,
                by_others[number].value,
                by_others[number].sd,
            )
            for number in shown_by_both
        ]
        unseen = tuple(number for number in common if number not in shown_by_both)
        comparisons.append(PartAgainstRest(name, *disagreement(joint, rows), tuple(compared), unseen))
    return tuple(comparisons)


def disagreement(joint: Fit, rows: slice) -> tuple[float, float]:
    """P value and size (in sd) of the largest disagreement of some ``rows`` with the others, linear about ``joint``.

    The others alone, with the prior, have their optimum at delta = A^-1 J' r from that of all, where J and r are the
    derivatives and residuals of these rows and A^-1 the covariance without them. What these rows then leave along the
    singular vectors of J A^(-1/2) is independent, of variance 1 + s^2, where s is the singular value: one by one they
    are tested, the largest by the probability that none of as many is larger (Sidak 1967, J. Am. Stat. Ass. 62). In
    posterior sd the others are treated as knowing each direction at least 1e-9 as well as the best: less is rounding.
    """
    j, r = joint.jacobian[rows], joint.residual[rows]
    if not (np.isfinite(j).all() and np.isfinite(r).all()):
        return 1.0, 0.0
    sd = np.sqrt(joint.covariance.diagonal())
    j = j * sd
    information = np.linalg.inv(joint.covariance / np.outer(sd, sd)) - j.T @ j
    size, axes = np.linalg.eigh((information + information.T) / 2)
    root = axes / np.sqrt(np.maximum(size, 1e-9 * size[-1]))  # A^(-1/2), of what the others and the prior know
    directions, s, _ = np.linalg.svd(j @ root, full_matrices=False)
    visible = s > 1e-6  # sd of the others, in noise: below it the rows show nothing of a direction
    delta = root @ (root.T @ (j.T @ r))
    scores = (directions.T @ (r + j @ delta))[visible] / np.sqrt(1 + s[visible] ** 2)
    if not len(scores):
        return 1.0, 0.0
    largest = float(np.abs(scores).max())
    return float(-np.expm1(len(scores) * np.log1p(-2 * ndtr(-largest)))), largest


class _Number(NamedTuple):
    """A number of an effect as some parts show it."""

    unit: str  # of value and sd
    value: float  # most probable
    sd: float  # posterior standard deviation
    narrowed: bool  # the data narrow it: its sd is clearly below that of the prior


def _fit_some_parts(selection: Kind, joint: Fit) -> dict[str, _Number]:
    """Numbers, by EFFECT.PARAMETER, of the effects of ``joint`` that act on a ``selection`` of parts, fitted to it."""
    acting = tuple(c for c in joint.candidates if selection.concerns(c))
    column = {u.name: k for k, u in enumerate(joint.nuisances)}
    sizes = (joint.theta[joint.columns(c)] for c in acting)
    start = np.concatenate([joint.theta[[column[u.name] for u in selection.nuisances]], *sizes])
    fitted = fit(selection, acting, starts=[start])
    coordinate_sd = np.sqrt(fitted.covariance.diagonal())
    numbers = {}
    for c in acting:
        for (u, x), sd in zip(fitted.values(c), coordinate_sd[fitted.columns(c)], strict=True):
            for name, factor in u.factors.items():
                numbers[f"{c.identifier}.{name}"] = _Number(
                    u.unit,
                    value=factor * float(u.value(x)),
                    sd=factor * float(sd * u.slope(float(x))),
                    narrowed=bool(sd < RULES.seen * u.scale),
                )
    return numbers


@dataclass(frozen=True)
class WithoutOne:
    """Verdict of the others without one part."""

    part: str  # name of the part that is left out
    rest: Verdict  # verdict of the others
    alone: Verdict | None = None  # verdict of the part by itself, if it is the odd one
    final: Fit | None = None  # the model of the others: with what was named

    @property
    def clear(self) -> bool:
        """True if the others fit their data, with a verdict that has no reservation."""
        return self.rest.verdict in ("none", "named", "class") and fits(self.rest)


def fits(verdict: Verdict) -> bool:
    """True if the final model of a ``verdict`` fits its data by the rule of acceptance."""
    return verdict.goodness_of_fit_p > RULES.poor_fit


def without_each(kind: Kind, names: Sequence[str], *, single_out: bool) -> dict[str, WithoutOne]:
    """Verdict of the others without each part of ``names``, the part first without which the others fit best.

    With ``single_out`` a part without which all others fit is judged by itself as well.
    """
    parts = [part.name for part in kind.parts]
    if len(parts) < 2:
        return {}
    results = []
    for name in parts:
        if name in names:
            judgement = judge(kind.select_parts([part_name for part_name in parts if part_name != name]))
            results.append(WithoutOne(name, judgement.verdict, final=judgement.final))
    ranked = {result.part: result for result in sorted(results, key=_order)}
    if not single_out:
        return ranked
    return {
        name: replace(result, alone=_judge_by_itself(kind, ranked, name)) if result.clear else result
        for name, result in ranked.items()
    }


def _order(result: WithoutOne) -> tuple[bool, float, float]:
    """Key of sorting: clear verdicts first, then by p, then (if p is too small to be a number) by chi^2 per number."""
    chi2 = result.rest.chi2
    return not result.clear, -result.rest.goodness_of_fit_p, (chi2["final"] + chi2["penalty"]) / chi2["n"]


def _judge_by_itself(kind: Kind, ranked: Mapping[str, WithoutOne], name: str) -> Verdict:
    """Verdict of one part by itself; of two parts it is known from leaving out the other."""
    other_parts = [part.name for part in kind.parts if part.name != name]
    if len(other_parts) == 1 and other_parts[0] in ranked:
        return ranked[other_parts[0]].rest
    return judge(kind.select_parts([name])).verdict
