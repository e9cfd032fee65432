"""Whether one part of joint data contradicts the rest: what each says of their common unknowns."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from studies.inference.account import factors
from studies.inference.fit import Fit, fit
from studies.inference.joint import JointForward, Part

DOUBTFUL = 0.01  # p below which a part contradicts the rest
BLIND = 1e-6  # sd of the rest, in noise, below which a part cannot speak of a direction
SEEN = 0.9  # of the prior sd: above it, what a number of an effect is said to be is its prior


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
        """In standard deviations of the difference."""
        return (self.own - self.rest) / float(np.hypot(self.own_sd, self.rest_sd))


@dataclass(frozen=True)
class PartAgainstRest:
    """One part of joint data against the others.

    Attributes
    ----------
    part : str
    p : float
        P(a larger disagreement | one model is true of all).
    sd : float
        The largest disagreement along one direction of the unknowns, in sd.
    effects : tuple of Compared
        Numbers of the effects of the hypothesis that the part and the rest can both see.
    unseen : tuple of str
        Numbers of effects that act on both, of which the part or the rest tells little more than the prior.
    """

    part: str
    p: float
    sd: float
    effects: tuple[Compared, ...]
    unseen: tuple[str, ...] = ()

    @property
    def contradicts(self) -> bool:
        """Whether the part and the rest are unlikely to be of one model."""
        return self.p < DOUBTFUL


def parts_against_rest(forward: JointForward, joint: Fit) -> tuple[PartAgainstRest, ...]:
    """Each part of ``forward`` against all others, about the hypothesis ``joint`` that was fitted to all.

    Parameters
    ----------
    forward : JointForward
    joint : Fit
    """
    return tuple(
        PartAgainstRest(part.name, *disagreement(joint, rows), *_effects(forward, joint, number))
        for number, (part, rows) in enumerate(zip(forward.parts, forward.slices(), strict=True))
    )


def disagreement(joint: Fit, rows: slice) -> tuple[float, float]:
    """P value and size (sd) of the largest disagreement of some ``rows`` with the others, linear about a ``joint`` fit.

    The others alone, with the prior, have their optimum at delta = A^-1 J' r from that of all, where J and r are the
    derivatives and residuals of these rows and A^-1 the covariance without them. What these rows then leave along
    the singular vectors of J A^(-1/2) is independent, of variance 1 + s^2, where s is the singular value: one by one
    they are tested, the largest by the probability that none of as many is larger (Sidak 1967, J. Am. Stat. Ass. 62).
    In posterior sd the others count as knowing each direction at least 1e-9 as well as the best: less is rounding.

    Parameters
    ----------
    joint : Fit
    rows : slice
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
    seen = s > BLIND
    delta = root @ (root.T @ (j.T @ r))
    apart = (left.T @ (r + j @ delta))[seen] / np.sqrt(1 + s[seen] ** 2)
    if not len(apart):
        return 1.0, 0.0
    largest = float(np.abs(apart).max())
    return float(-np.expm1(len(apart) * np.log1p(-2 * norm.sf(largest)))), largest


def _effects(forward: JointForward, joint: Fit, number: int) -> tuple[tuple[Compared, ...], tuple[str, ...]]:
    """Numbers of the effects by the part alone and by the others, where both see them; and the names of the rest."""
    own = _alone(forward.parts[number : number + 1], joint)
    rest = _alone(forward.parts[:number] + forward.parts[number + 1 :], joint)
    both = [name for name in own if name in rest]
    seen = [name for name in both if own[name].seen and rest[name].seen]
    compared = (
        Compared(name, own[name].unit, own[name].value, own[name].sd, rest[name].value, rest[name].sd) for name in seen
    )
    return tuple(compared), tuple(name for name in both if name not in seen)


@dataclass(frozen=True)
class _Told:
    """A number of an effect by some of the parts, and whether they tell it much better than its prior."""

    unit: str
    value: float
    sd: float
    seen: bool


def _alone(parts: tuple[Part, ...], joint: Fit) -> dict[str, _Told]:
    """Each number of the effects of a ``joint`` hypothesis by some of the parts, by wheel where they differ."""
    some = JointForward(parts)
    kept = tuple(c for c in joint.candidates if some.concerns(c))
    column = {u.name: k for k, u in enumerate(joint.unknowns[: joint.effect_columns.start])}
    begin = np.concatenate([
        joint.theta[[column[u.name] for u in some.nuisances]], *(joint.theta[joint.columns(c)] for c in kept)
    ])  # fmt: skip
    found = fit(some, kept, starts=[begin])
    spread = np.sqrt(found.covariance.diagonal())
    return {
        f"{c.identifier}.{name}": _Told(
            u.unit, factor * float(u.value(x)), factor * float(sd * u.slope(float(x))), bool(sd < SEEN * u.scale)
        )
        for c in kept
        for u, x, sd in zip(c.unknowns, found.theta[found.columns(c)], spread[found.columns(c)], strict=True)
        for name, factor in factors(u).items()
    }
