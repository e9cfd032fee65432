"""Upper limits (95 %) of effects that were not named: what could still be there, the final hypothesis being right.

Laplace: the size of an effect is normal about its optimum, cut off at its bounds. If the data push a one-sided size
against zero, that optimum lies beyond the bound, and the posterior is the tail of the normal distribution.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import log_ndtr, ndtr, ndtri, ndtri_exp

from studies.inference.fit import Fit, prior, spread
from studies.inference.kind import Kind
from studies.inference.parameter import Array, Candidate, UncertainParameter
from studies.inference.rules import RULES
from studies.inference.search import Hypotheses


@dataclass(frozen=True)
class UpperLimit:
    """Largest size that an effect could still have."""

    identifier: str  # of the candidate
    parameter: str  # name of its size
    unit: str  # of the limit; 1 if none
    # the limit in unit by the parameter's name, by wheel if they differ
    values: Mapping[str, float] = field(default_factory=dict)
    least: bool = False  # the limit is a lower one: the effect vanishes as the parameter grows (a stiffness)
    two_sided: bool = False  # the limit is one of the size without its sign
    limited: bool = True  # false if the prior alone is as narrow: the data show nothing
    share: float = 1.0  # the limit divided by the limit of the prior alone

    @property
    def by_wheel(self) -> list[tuple[str, float]]:
        """Wheel (empty if there is one limit for all) and limit, in unit."""
        return [(name.partition(".")[2], limit) for name, limit in self.values.items()]


def upper_limits(kind: Kind, hypotheses: Hypotheses, final: Fit) -> tuple[UpperLimit, ...]:
    """95 % limits of the sizes of each candidate that the ``final`` fit does not have, the narrowest first."""
    noise = final.noise_factor
    fitted = {f.identifiers: f for f in hypotheses.fits}
    limits = []
    for candidate in kind.candidates:
        sizes = [k for k, u in enumerate(candidate.unknowns) if u.size]
        joined = (*final.candidates, candidate)
        if not sizes or candidate.identifier in final.identifiers or not kind.compatible(joined):
            continue
        f = fitted.get(final.identifiers | {candidate.identifier})
        if f is not None:
            mean, covariance = _laplace(f.unknowns, f.candidates, f.theta, (f.residual, f.jacobian), noise)
            first = f.columns(candidate).start
        else:
            mean, covariance = _add_candidate(kind, final, joined, noise)
            first = len(mean) - len(candidate.unknowns)
        for k in sizes:
            m, variance = float(mean[first + k]), float(covariance[first + k, first + k])
            if math.isfinite(m) and math.isfinite(variance) and variance > 0:
                limits.append(_limit(candidate, candidate.unknowns[k], m, math.sqrt(variance)))
    return tuple(sorted(limits, key=lambda limit: limit.share))


def _add_candidate(kind: Kind, final: Fit, joined: tuple[Candidate, ...], noise: float) -> tuple[Array, Array]:
    """Mean (p,) and covariance (p, p) once the last of ``joined`` is added to ``final``, by 1 or 2 Gauss-Newton steps.

    ``noise`` is a factor on the sd of the noise; NaN in the covariance if residuals are not finite.
    """
    unknowns = (*final.unknowns, *joined[-1].unknowns)
    lowest = np.array([u.lowest for u in unknowns])
    highest = np.array([u.highest for u in unknowns])
    theta = np.concatenate([final.theta, joined[-1].first_starts[0]])
    mean, covariance = theta, np.full((len(theta),) * 2, np.nan)
    for _ in range(1 if kind.costly else 2):
        residual, jacobian = kind.residual(joined, theta)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            break
        mean, covariance = _laplace(unknowns, joined, theta, (residual, jacobian), noise)
        theta = np.clip(mean, lowest, highest)
    return mean, covariance


def _laplace(
    unknowns: tuple[UncertainParameter, ...],
    candidates: tuple[Candidate, ...],
    theta: Array,
    linear: tuple[Array, Array],
    noise: float,
) -> tuple[Array, Array]:
    """Mean (p,) and covariance (p, p) of the coordinates by one Gauss-Newton step from ``theta``, bounds ignored.

    ``linear`` are residual (n,) and jacobian (n, p) at ``theta`` (p,), ``noise`` a factor on the sd of the noise.
    """
    centre, sd = prior(unknowns, candidates)
    residual, jacobian = linear[0] / noise, linear[1] * sd / noise
    z = (theta - centre) / sd
    inverse, _ = spread(jacobian)
    return theta - sd * (inverse @ (jacobian.T @ residual + z)), inverse * np.outer(sd, sd)


def _limit(candidate: Candidate, u: UncertainParameter, mean: float, sd: float) -> UpperLimit:
    """95 % limit of the size ``u`` of a ``candidate`` whose coordinate is normal about ``mean`` with ``sd``."""
    if u.one_sided:
        farthest = tail_limit((mean - u.lowest) / sd) * sd + u.lowest - u.centre
    else:
        farthest = size_limit((mean - u.centre) / sd) * sd
    value = float(u.value(u.centre + farthest))
    by_prior = float(ndtri((1 + RULES.level) / 2)) * u.scale  # of a size by its prior alone, one-sided or not
    share = farthest / by_prior
    return UpperLimit(
        candidate.identifier,
        u.name,
        u.unit,
        {name: factor * value for name, factor in u.factors.items()},
        least=u.power == -1,
        two_sided=not u.one_sided,
        limited=share < RULES.same_as_prior,
        share=share,
    )


def tail_limit(mean: float) -> float:
    """95 % limit of a unit normal of this ``mean`` (no unit), cut off below zero."""
    # P(x > L) = ndtr(mean - L) is 5 % of P(x > 0) = ndtr(mean); logarithms, for the mean may lie far below zero
    return mean - float(ndtri_exp(math.log(1 - RULES.level) + float(log_ndtr(mean))))


def size_limit(mean: float) -> float:
    """95 % limit of the size of a unit normal of this ``mean`` (no unit)."""
    offset = abs(mean)
    if offset > 10.0:  # the other side is empty
        return offset + float(ndtri(RULES.level))
    low, high = 0.0, offset + 10
    for _ in range(60):  # halved until nothing is left; to import scipy.optimize takes longer
        middle = (low + high) / 2
        if ndtr(middle - offset) - ndtr(-middle - offset) < RULES.level:
            low = middle
        else:
            high = middle
    return high
