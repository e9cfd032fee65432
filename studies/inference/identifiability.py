"""Which effects the data cannot tell apart, and which further measurement would."""

from dataclasses import dataclass

import numpy as np

from studies.inference.arrays import Array
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit
from studies.inference.forward import Forward, ProposedMeasurement
from studies.inference.held_back import of_unusual_size

ALIKE_COSINE = 0.95  # of marginalised directions
HOPELESS_ODDS = 1e4  # beyond which a look-alike is out, however parallel, unless it explains as much
AS_MUCH = 6.0  # of the objective (chi^2 and prior): odds of 20 by the fit alone, whatever the volume of the prior
MOST_PROBABLE = "the most probable"  # how that of the leader begins, where none with as many effects is ahead
MORE_PROBABLE = "more probable"  # how the reason begins of a member that is ahead of the leader
BENCH_SD = 0.1  # of a bench test, in prior scales (5 % of the upper end of the typical range)


@dataclass(frozen=True)
class Separation:
    """A further measurement and its gain: the smallest predicted distance of the leader to a rival, in sd."""

    what: str
    gain: float


def direction(forward: Forward, hypothesis: Fit) -> Array:
    """How the effects of ``hypothesis`` move the residuals (n,) of ``forward``, nuisances held."""
    nuisances = hypothesis.theta[: hypothesis.effect_columns.start]
    without, _ = forward.residual((), nuisances)
    moved = without - hypothesis.residual
    if float(moved @ moved) > 1e-6:
        return np.asarray(moved)
    scale = np.array([u.scale * u.size for u in hypothesis.unknowns[hypothesis.effect_columns]])
    return np.asarray(-hypothesis.jacobian[:, hypothesis.effect_columns] @ scale)


def similarity(forward: Forward, null: Fit, fits: list[Fit]) -> Array:
    """Cosines of the directions of ``fits``, in the metric that is left when the nuisances are marginalised.

    Parameters
    ----------
    forward : Forward
    null : Fit
        Nuisances only.
    fits : list of Fit

    Returns
    -------
    ndarray, shape (fits, fits)
    """
    sd = np.array([u.scale for u in null.unknowns])
    n = null.jacobian * sd
    inner = np.eye(n.shape[1]) + n.T @ n
    moves = np.stack([direction(forward, f) for f in fits])
    projected = moves @ n
    gram = moves @ moves.T - projected @ np.linalg.solve(inner, projected.T)
    size = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
    return np.clip(gram / np.outer(size, size), -1.0, 1.0)


def equivalents(forward: Forward, known: Hypotheses, leader: Fit) -> dict[Fit, str]:
    """The leader and what cannot be told from it, with the reason of each.

    Odds below 20, or directions alike and odds not hopeless: of an unusual size only where the leader is of one, too,
    and with all of its sizes. One that may as well rest on its bound makes the effect a smaller one under another
    name: arms without inertia and stiffness are a damper.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
        Those with as many effects as the leader are compared.
    leader : Fit
    """
    peers = [f for f in known.best(len(leader.candidates)) if f is not leader and f.admissible]
    best = leader.objective
    peers = [f for f in peers if known.odds(leader, f) < HOPELESS_ODDS or f.objective - best < AS_MUCH]
    cosines = similarity(forward, known.null, [leader, *peers])[0, 1:]
    ahead = [f for f in peers if known.odds(leader, f) < 1]
    led = f"{MOST_PROBABLE} of a size that occurs" if ahead else MOST_PROBABLE
    members = {leader: "where the search ended" if any(f.physical for f in ahead) else led}
    for f, cosine in zip(peers, cosines, strict=True):
        odds = known.odds(leader, f)
        unusual = f", of an unusual size ({', '.join(f.implausible())})" if f.implausible() else ""
        if odds < CLEAR_ODDS:
            told = f"odds of only {odds:.2g} : 1 against it{unusual}"
            members[f] = told if odds >= 1 else _ahead(forward, f, known.odds(f, leader))
        elif cosine > ALIKE_COSINE and (f.physical or not leader.physical) and not _idle(f):
            same = f"does the same to the data (cosine {cosine:.3f}), whatever the odds"
            members[f] = f"{same} ({odds:.2g} : 1 against it){unusual}"
    return members


def _idle(f: Fit) -> bool:
    """Whether an effect of several sizes has one within its sd of a bound, so that the data ask for no such size."""
    for candidate in f.candidates:
        place, sizes = f.columns(candidate).start, [k for k, u in enumerate(candidate.unknowns) if u.size]
        for k in sizes if len(sizes) > 1 else ():
            u, x = candidate.unknowns[k], float(f.theta[place + k])
            if min(x - u.lowest, u.highest - x) < np.sqrt(f.covariance[place + k, place + k]):
                return True
    return False


def _ahead(forward: Forward, f: Fit, odds: float) -> str:
    """Why one that is more probable than the leader is not in its place; ``odds`` for it, which are finite."""
    told = f"{MORE_PROBABLE} than what leads ({odds:.2g} : 1), but "
    if unusual := of_unusual_size(forward, f):
        return told + ("not named, as " if f.unusual > 1 else "") + unusual
    if odds <= CLEAR_ODDS:
        return f"{told}not clearly so (above {CLEAR_ODDS:g} : 1)"
    return f"{told}not where the search ended, which keeps the effects that stand by their own odds and held-out gain"


def separating(forward: Forward, members: list[Fit]) -> list[Separation]:
    """Measurements that ``forward`` proposes and that separate the first of ``members`` from the others."""
    return sorted([*_proposed(forward, members), *_bench_tests(members)], key=lambda s: -s.gain)


def _proposed(forward: Forward, members: list[Fit]) -> list[Separation]:
    """What the forward model proposes, where it can be predicted."""
    separations = []
    for proposal in forward.proposed():
        predicted = [_open(forward, proposal, f) for f in members]
        if not all(np.isfinite(p).all() and np.isfinite(s).all() for p, s in predicted):
            continue
        (mine, loose), *others = predicted
        gains = [_distance(mine - other, np.hstack([loose, its]) / np.sqrt(2)) for other, its in others]
        separations.append(Separation(proposal.what, min(gains)))
    return separations


def _open(forward: Forward, proposal: ProposedMeasurement, f: Fit) -> tuple[Array, Array]:
    """What ``f`` predicts of a ``proposal`` (m,), and what 1 sd of all that its data leave open does to it (m, k)."""
    mean, slope = forward.predict(proposal, f.candidates, f.theta)
    if not (np.isfinite(mean).all() and np.isfinite(slope).all()):
        return mean, slope
    loose = forward.loose(proposal, f.candidates, f.theta)
    values, vectors = np.linalg.eigh((f.covariance + f.covariance.T) / 2)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return mean, slope @ root if loose is None else np.hstack([(slope + loose[0]) @ root, loose[1]])


def _distance(gap: Array, open_: Array) -> float:
    """Of a ``gap`` (m,) in the noise (1) and what moves it by 1 sd each (m, k): gap' (1 + open open')^-1 gap, root."""
    pull = open_.T @ gap
    left = gap - open_ @ np.linalg.solve(np.eye(len(pull)) + open_.T @ open_, pull)
    return float(np.sqrt(max(0.0, float(gap @ left))))


def _bench_tests(members: list[Fit]) -> list[Separation]:
    """The size of an effect (a mistake) that one member has and the others have not, measured by itself."""
    separations = []
    for f in members:
        for candidate in f.candidates:
            u = next((u for u in candidate.unknowns if u.size), None)
            if u is None or any(candidate.identifier in other.identifiers for other in members if other is not f):
                continue
            column = f.columns(candidate).start + candidate.unknowns.index(u)
            spread = np.hypot(BENCH_SD * u.scale, np.sqrt(f.covariance[column, column]))
            gain = float(abs(f.theta[column] - u.centre) / spread)
            size = u.name if u.unit == "1" else f"{u.name}, {u.unit}"
            kind = "calibration" if candidate.mistake else "bench test"
            separations.append(Separation(f"{kind} of {candidate.identifier} ({size})", gain))
    return separations
