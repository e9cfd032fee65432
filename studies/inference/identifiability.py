"""Which effects the data cannot tell apart, and which further measurement would."""

from dataclasses import dataclass

import numpy as np

from studies.inference.arrays import Array
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit
from studies.inference.forward import Forward

ALIKE = 0.95  # |cos| of marginalised directions
HOPELESS = 1e4  # odds beyond which a look-alike is out, however parallel
BENCH = 0.1  # sd of a bench test, in prior scales (5 % of the upper end of the typical range)


@dataclass(frozen=True)
class Separation:
    """A further measurement and its gain: the smallest predicted distance of the leader to a rival, in sd."""

    what: str
    gain: float


def direction(forward: Forward, null: Fit, found: Fit) -> Array:
    """How the effect moves the residuals (n,), nuisances held."""
    nuisances = found.theta[: found.effect_columns.start]
    without, _ = forward.residual((), nuisances)
    moved = without - found.residual
    if float(moved @ moved) > 1e-6:
        return np.asarray(moved)
    scale = np.array([u.scale * u.size for u in found.unknowns[found.effect_columns]])
    return np.asarray(-found.jacobian[:, found.effect_columns] @ scale)


def similarity(forward: Forward, null: Fit, fits: list[Fit]) -> Array:
    """Cosines of the directions, in the metric that is left when the nuisances are marginalised."""
    sd = np.array([u.scale for u in null.unknowns])
    n = null.jacobian * sd
    inner = np.eye(n.shape[1]) + n.T @ n
    moves = np.stack([direction(forward, null, f) for f in fits])
    projected = moves @ n
    gram = moves @ moves.T - projected @ np.linalg.solve(inner, projected.T)
    size = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
    return np.clip(gram / np.outer(size, size), -1.0, 1.0)


def equivalents(forward: Forward, known: Hypotheses, leader: Fit) -> list[Fit]:
    """The leader and what cannot be told from it: odds below 20, or directions alike and odds not hopeless."""
    peers = [f for f in known.best(len(leader.candidates)) if f is not leader and f.physical]
    peers = [f for f in peers if known.odds(leader, f) < HOPELESS]
    cosines = similarity(forward, known.null, [leader, *peers])[0, 1:]
    return [
        leader,
        *(f for f, c in zip(peers, cosines, strict=True) if known.odds(leader, f) < CLEAR_ODDS or c > ALIKE),
    ]


def separating(forward: Forward, members: list[Fit]) -> list[Separation]:
    """Feasible measurements that would separate the leader from its rivals, best first."""
    leader, *rivals = members
    found = []
    for extra in forward.extras():
        predicted = [forward.predict(extra, f.candidates, f.theta) for f in members]
        mine, slope = predicted[0]
        if not all(np.isfinite(p).all() and np.isfinite(s).all() for p, s in predicted):
            continue
        gains = []
        for rival, (other, other_slope) in zip(rivals, predicted[1:], strict=True):
            spread = (
                np.eye(len(mine))
                + (slope @ leader.covariance @ slope.T + other_slope @ rival.covariance @ other_slope.T) / 2
            )
            gap = mine - other
            gains.append(float(np.sqrt(gap @ np.linalg.solve(spread, gap))))
        found.append(Separation(extra.what, min(gains)))
    for f in members:
        for candidate in f.candidates:
            u = next((u for u in candidate.unknowns if u.size), None)
            if u is None or any(candidate.identifier in other.name.split("+") for other in members if other is not f):
                continue
            column = f.columns(candidate).start + candidate.unknowns.index(u)
            spread = np.hypot(BENCH * u.scale, np.sqrt(f.covariance[column, column]))
            gain = float(abs(f.theta[column] - u.centre) / spread)
            found.append(Separation(f"bench test of {candidate.identifier} ({u.name}, {u.unit})", gain))
    return sorted(found, key=lambda s: -s.gain)
