"""Upper limits (95 %) of effects that were not named: what could still be there, the final hypothesis being right.

Laplace: the size of an effect is normal about its optimum, cut off at its bounds. Where the data push a one-sided size
against zero, that optimum lies beyond the bound, and what is left is the tail of the normal distribution.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq
from scipy.special import log_ndtr, ndtr, ndtri_exp

from studies.inference.arrays import Array
from studies.inference.checks import goodness_of_fit
from studies.inference.evidence import Hypotheses
from studies.inference.fit import Fit, prior
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate, UncertainParameter

LEVEL = 0.95
PRIOR_LIMIT = 1.959964  # 95 % of a size by its prior alone, one-sided or not, in prior scales
SAME_AS_PRIOR = 0.95  # of that, from which on the data say nothing
POOR_FIT = 0.01  # p below which the sd are widened by the misfit
STEPS = 2  # of Gauss and Newton where no fit is known


@dataclass(frozen=True)
class UpperLimit:
    """How large an effect could still be.

    Attributes
    ----------
    identifier, parameter, unit : str
    values : mapping of str to float
        The limit in ``unit`` by the parameter's name, by wheel where they differ.
    least : bool
        The limit is a lower one: the effect vanishes as the parameter grows (a stiffness).
    two_sided : bool
        The limit is one of the size without its sign.
    limited : bool
        False where the prior alone is as narrow: the data say nothing.
    share : float
        The limit in units of the prior's own.
    """

    identifier: str
    parameter: str
    unit: str
    values: Mapping[str, float] = field(default_factory=dict)
    least: bool = False
    two_sided: bool = False
    limited: bool = True
    share: float = 1.0


def upper_limits(forward: Forward, known: Hypotheses, final: Fit) -> tuple[UpperLimit, ...]:
    """95 % limits of each candidate beside the final hypothesis, those that the data limit most first.

    Where the final hypothesis does not fit (p < 0.01) the noise is taken larger, so that it does.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
        Its fits are used where they add one candidate to the final one.
    final : Fit
    """
    widened = widening(forward, final)
    fitted = {f.identifiers: f for f in known.fits}
    found = []
    for candidate in forward.candidates:
        sizes = [k for k, u in enumerate(candidate.unknowns) if u.size]
        joined = (*final.candidates, candidate)
        if not sizes or candidate.identifier in final.identifiers or not forward.compatible(joined):
            continue
        f = fitted.get(final.identifiers | {candidate.identifier})
        mean, covariance = _gaussian(forward, f, widened) if f is not None else _beside(forward, final, joined, widened)
        first = len(mean) - len(candidate.unknowns) if f is None else f.columns(candidate).start
        for k in sizes:
            m, variance = float(mean[first + k]), float(covariance[first + k, first + k])
            if math.isfinite(m) and math.isfinite(variance) and variance > 0:
                found.append(_limit(candidate, candidate.unknowns[k], m, math.sqrt(variance)))
    return tuple(sorted(found, key=lambda limit: limit.share))


def widening(forward: Forward, final: Fit) -> float:
    """Factor on the noise with which the final fit would fit as well as can be asked; 1 where it does (p > 0.01).

    Parameters
    ----------
    forward : Forward
    final : Fit
    """
    if goodness_of_fit(forward, final) > POOR_FIT:
        return 1.0
    return max(1.0, math.sqrt(final.objective / len(final.residual)))


def _gaussian(forward: Forward, f: Fit, widened: float) -> tuple[Array, Array]:
    """Mean (p,) and covariance (p, p) of the coordinates, the optimum of a bound fit where its slope points."""
    return _step(f.unknowns, f.candidates, f.theta, f.residual, f.jacobian, widened)


def _beside(
    forward: Forward, final: Fit, joined: tuple[Candidate, ...], widened: float
) -> tuple[Array, Array]:  # fmt: skip
    """The same for a candidate that joins the final fit as its last, by steps of Gauss and Newton."""
    unknowns = (*final.unknowns, *joined[-1].unknowns)
    lowest, highest = (np.array([getattr(u, name) for u in unknowns]) for name in ("lowest", "highest"))
    theta = np.concatenate([final.theta, joined[-1].first_starts[0]])
    mean, covariance = theta, np.full((len(theta),) * 2, np.nan)
    for _ in range(STEPS):
        residual, jacobian = forward.residual(joined, theta)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            break
        mean, covariance = _step(unknowns, joined, theta, residual, jacobian, widened)
        theta = np.clip(mean, lowest, highest)
    return mean, covariance


def _step(
    unknowns: tuple[UncertainParameter, ...], candidates: tuple[Candidate, ...], theta: Array, residual: Array,
    jacobian: Array, widened: float,
) -> tuple[Array, Array]:  # fmt: skip
    centre, sd = prior(unknowns, candidates, 1.0)
    scaled, r, z = jacobian * sd / widened, residual / widened, (theta - centre) / sd
    hessian = scaled.T @ scaled + np.eye(len(z))
    inverse = np.linalg.pinv(hessian, hermitian=True)
    return theta - sd * (inverse @ (scaled.T @ r + z)), inverse * np.outer(sd, sd)


def _limit(candidate: Candidate, u: UncertainParameter, mean: float, sd: float) -> UpperLimit:
    if u.one_sided:
        farthest = tail_limit((mean - u.lowest) / sd) * sd + u.lowest - u.centre
    else:
        farthest = size_limit((mean - u.centre) / sd) * sd
    edge = u.centre + farthest
    labels = {u.name: 1.0}
    if len(set(u.sets.values())) > 1:
        names = u.labels or tuple(u.sets)
        labels = {f"{u.name}.{name}": float(f) for name, f in zip(names, u.sets.values(), strict=True)}
    value = float(u.value(np.asarray(edge)))
    share = farthest / (PRIOR_LIMIT * u.scale)
    return UpperLimit(
        candidate.identifier, u.name, u.unit, {name: factor * value for name, factor in labels.items()},
        least=u.power == -1, two_sided=not u.one_sided, limited=share < SAME_AS_PRIOR, share=share,
    )  # fmt: skip


def tail_limit(mean: float) -> float:
    """What 95 % of a unit normal of this ``mean`` (a number without unit), cut off below zero, lies below."""
    # P(x > L) = ndtr(mean - L) is 5 % of P(x > 0) = ndtr(mean); logarithms, for the mean may lie far below zero
    return mean - float(ndtri_exp(math.log(1 - LEVEL) + float(log_ndtr(mean))))


def size_limit(mean: float) -> float:
    """What 95 % of the size of a unit normal of this ``mean`` (a number without unit) lies below."""
    offset = abs(mean)
    return float(brentq(lambda x: float(ndtr(x - offset) - ndtr(-x - offset)) - LEVEL, 0.0, offset + 10.0))
