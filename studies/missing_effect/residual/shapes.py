"""What a residual torque looks like: shares by term, likeness to the effects of the library and to errors of sensors.

The torque of an effect on a given motion exp(s t) is the difference of the torques that hold this motion with it and
without it, T = G(s)^-1 q with G from steer and lean torque to lean and steer. So effects with states of their own, as
tyres, have one too. Torques are compared over all samples of the motion seen (:mod:`.seen`): the share of the power of
the residual torque that an effect of the best size has is the squared cosine of the two.

A newton metre of lean torque does far less than one of steer torque, so the two are not added as they are: each counts
by what a newton metre of it changes of the predicted numbers, over their noise (:attr:`Shape.counts`).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate
from studies.missing_effect.motion.candidates import find_candidates
from studies.missing_effect.motion.family import Family
from studies.missing_effect.residual.fitting import Residual, base_of
from studies.missing_effect.residual.linear import linearised
from studies.missing_effect.residual.seen import Seen
from studies.missing_effect.residual.terms import PAIRS, STATES, TORQUES, Pair, keys, unknown
from tyre.base.arrays import Array, Complex

OFF_THE_ROOT = 1e-6  # relative; at a root of the model a motion needs no torque, and the inverse is not computed


@dataclass(frozen=True)
class Likeness:
    """How far a candidate does the same.

    Attributes
    ----------
    identifier : str
    share : float
        Of the power of the torque, or of what it does to the data, 0 to 1.
    reversed : bool
        With the sign that nature does not give.
    """

    identifier: str
    share: float
    reversed: bool = False


@dataclass(frozen=True)
class Shape:
    """What a residual torque looks like.

    Attributes
    ----------
    shares : dict
        Share of the power by pair of torque and state; they add up to 1, one that takes away from others is negative.
        Empty where the torque has no power on the motion seen.
    library : tuple of Likeness
        Effects by their torque on the motion seen, likest first.
    errors : tuple of Likeness
        Errors of the measurement by what they do to the data, parameters marginalised; likest first.
    counts : float
        As how many newton metres of lean torque one of steer torque counts in ``shares`` and ``library``: so much more
        does it change the predicted numbers (root mean square, on the motion seen).
    """

    shares: dict[Pair, float]
    library: tuple[Likeness, ...]
    errors: tuple[Likeness, ...]
    counts: float = 1.0


def shape_of(forward: Forward, residual: Residual, motion: Seen) -> Shape:
    """Compare the ``residual`` torque of a ``forward`` model on a ``motion`` with what there is.

    Parameters
    ----------
    forward : Forward
    residual : Residual
    motion : Seen
    """
    errors = tuple(sorted(_errors(forward, residual), key=lambda one: -one.share))
    gains, _ = residual.gains_at(motion.speed)
    counts = steer_counts(forward, residual, motion)
    weights = np.array([counts, 1.0])
    parts = gains * motion.state[:, None] * weights[:, None]  # (k, 2, 4)
    torque = parts.sum(2)
    power = float((np.abs(torque) ** 2).sum())
    if not 0 < power < np.inf:  # held at zero by the fit, or in states that did not move
        return Shape({}, (), errors, counts)
    each = np.einsum("kij,ki->ij", parts, torque.conj()).real.ravel() / power
    library = _library(forward, residual, motion, (torque, weights))
    return Shape(
        {pair: float(share) for pair, share in zip(PAIRS, each, strict=True) if share},
        tuple(sorted(library, key=lambda one: -one.share)), errors, counts,
    )  # fmt: skip


def steer_counts(forward: Forward, residual: Residual, motion: Seen) -> float:
    """How much more a newton metre of steer torque changes the predicted numbers than one of lean torque.

    Of each torque from each state by itself, the same at all speeds and about the fit: the change of the predicted
    numbers over their noise, by the torque on the motion seen; root mean square over the states that move.

    Parameters
    ----------
    forward : Forward
    residual : Residual
    motion : Seen

    Returns
    -------
    float
        No unit; 0 where a steer torque changes nothing (a prescribed steer angle), 1 where the ratio is not finite.
    """
    linear, first = linearised(forward, residual.fit, residual.scale), len(residual.beside.theta)
    places = {key: first + k for k, key in enumerate(keys(dict.fromkeys(PAIRS, residual.scale.most)))}
    moved = {}
    for pair in PAIRS:
        column = linear.jacobian[:, places[pair, 0]] / unknown(pair, 0).scale
        moved[pair] = float(column @ column)
    square = dict(zip(STATES, (motion.rms**2).tolist(), strict=True))
    steer, lean = (sum(moved[t, s] / square[s] for s in STATES if square[s] > 0) for t in TORQUES)
    found = np.sqrt(steer / lean) if lean > 0 else np.inf
    return float(found) if np.isfinite(found) else 1.0


def _library(forward: Forward, residual: Residual, motion: Seen, weighed: tuple[Complex, Array]) -> Iterator[Likeness]:
    """Effects by their torque, beside that of the residual and the weights that both have."""
    torque, weights = weighed
    beside, base = residual.beside, base_of(forward)
    nuisances = residual.fit.theta[: len(base.nuisances)] if base is forward else None
    named = beside.candidates
    theta = beside.theta if nuisances is None else np.concatenate([nuisances, beside.theta[len(nuisances) :]])
    if base is not forward:  # of joint data: the base model as it stands
        named, theta = (), np.array([u.centre for u in base.nuisances])
    without = _held(base.family(named), theta, motion)
    for c in find_candidates(base.base, {})[0]:  # those that were left out of the search as well
        if c.identifier in residual.fit.identifiers or not base.compatible((*named, c)):
            continue
        there = np.concatenate([theta, c.starts[0]])
        like = (without - _held(base.family((*named, c)), there, motion)) * weights
        square = float((np.abs(like) ** 2).sum())
        if not np.isfinite(square) or square == 0:
            continue
        inner = float((like.conj() * torque).real.sum())
        share = inner**2 / (square * float((np.abs(torque) ** 2).sum()))
        yield Likeness(c.identifier, min(1.0, share), inner < 0)  # rounding


def _held(family: Family, theta: Array, motion: Seen) -> Complex:
    """Steer and lean torque (k, 2) that hold a motion in a model."""
    names, speeds = family.symbolic, np.unique(motion.speed)
    system, at = family(theta[None], speeds), np.searchsorted(speeds, motion.speed)
    root = motion.root * (1 + OFF_THE_ROOT)
    pencil = root[:, None, None] * system.mass[0][at] - system.dynamics[0][at]
    columns = [names.inputs.index(f"{torque}_torque") for torque in ("steer", "lean")]
    rows = [names.outputs.index(name) for name in ("lean", "steer")]
    gain = system.output[0][at][:, rows] @ np.linalg.solve(pencil, system.input[0][at][:, :, columns] + 0j)
    return np.asarray(np.linalg.solve(gain, motion.angle[..., None])[..., 0])


def _errors(forward: Forward, residual: Residual) -> Iterator[Likeness]:
    """Errors of the measurement, by the share of what the torque does to the data that they do as well."""
    found, beside = residual.fit, residual.beside
    without, _ = forward.residual(beside.candidates, found.theta[: len(beside.theta)], slopes=False)
    moved = without - found.residual
    metric = _Marginal(found)
    for c in forward.candidates:
        if c.effect is not None or not c.unknowns or c.identifier in beside.identifiers:
            continue
        if not forward.compatible((*beside.candidates, c)):
            continue
        _, slope = forward.residual((*beside.candidates, c), np.concatenate([beside.theta, c.starts[0]]))
        own = -slope[:, len(beside.theta) :]
        share, sign = metric.share(own, moved)
        yield Likeness(c.identifier, share, _one_sided(c) and sign < 0)


def _one_sided(c: Candidate) -> bool:
    return len(c.unknowns) == 1 and c.unknowns[0].one_sided


class _Marginal:
    """The metric that is left in the data when what floats anyway is marginalised."""

    def __init__(self, found: Fit) -> None:
        first = found.columns(found.candidates[-1]).start
        sd = np.array([u.scale for u in found.unknowns[:first]])
        self._floating = found.jacobian[:, :first] * sd
        self._inner = np.eye(first) + self._floating.T @ self._floating

    def product(self, a: Array, b: Array) -> Array:
        """a' (I + F F')^-1 b, of (n, p) and (n, q)."""
        return np.asarray(a.T @ b - (a.T @ self._floating) @ np.linalg.solve(self._inner, self._floating.T @ b))

    def share(self, directions: Array, moved: Array) -> tuple[float, float]:
        """Share of ``moved`` (n,) within ``directions`` (n, q), and the sign of the first."""
        gram, inner = self.product(directions, directions), self.product(directions, moved[:, None])[:, 0]
        size, *_ = np.linalg.lstsq(gram, inner)
        whole = float(self.product(moved[:, None], moved[:, None])[0, 0])
        if not np.isfinite(whole) or whole <= 0:
            return 0.0, 1.0
        return min(1.0, max(0.0, float(inner @ size) / whole)), float(size[0])
