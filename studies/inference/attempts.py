"""How a hypothesis is fitted, and when it is tried again: from other starts, by way of easier problems, to its end."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from studies.inference.arrays import Array
from studies.inference.checks import goodness_of_fit
from studies.inference.evidence import SELDOM, Hypotheses
from studies.inference.fit import Fit, default_starts, fit, outlook
from studies.inference.forward import Forward
from studies.inference.minimise import GUIDE, ROUGH, THOROUGH, small
from studies.inference.parameter import Candidate

POOR_FIT = 0.01  # p below which a model does not fit
LOUD = 1.3  # objective a row beyond which every hypothesis is tried again
RETRIED = 5  # poor fits that are tried from other starts
POLISHED = 8  # most probable fits that must converge
IMPROVED = 8.0  # decrease of the objective below which further starts of a soft joint are not worth their time
HOPELESS = 2.0  # times the best objective, beyond which a fit is not polished
BEHIND = 100.0  # in log posterior, behind one that explains the data: beyond it a fit is not tried again


def fitted(
    forward: Forward, candidates: tuple[Candidate, ...], starts: Sequence[Array], *, turns: tuple[int, int] = THOROUGH
) -> Fit:
    """A fit; an effect that ended beyond what occurs is fitted again with the prior of sizes that seldom occur.

    One effect only: several of them together mimic anything.

    Parameters
    ----------
    forward : Forward
    candidates : tuple of Candidate
    starts : sequence of ndarray, shape (p,)
        Coordinates.
    turns : tuple of int, shape (2,)
        Most iterations, as :func:`studies.inference.minimise.minimise` takes them.
    """
    found = fit(forward, candidates, starts=starts, turns=turns)
    beyond = {name.split(".")[0] for name in found.implausible()}
    usual = [c for c in candidates if c.identifier in beyond and all(u.widened == 1 for u in c.unknowns)]
    if len(beyond) != 1 or not usual or not math.isfinite(found.objective):
        return found
    wider = tuple(c.unusual() if c in usual else c for c in candidates)
    seldom = fit(forward, wider, starts=[found.theta], turns=turns)
    return seldom if seldom.implausible() and seldom.log_evidence + math.log(SELDOM) > found.log_evidence else found


def turns_of(forward: Forward) -> tuple[int, int]:
    """How many iterations a first look at a hypothesis takes at most, as dear as ``forward`` is."""
    return THOROUGH if forward.thorough else ROUGH


def polished(forward: Forward, known: Hypotheses) -> Hypotheses:
    """The most probable hypotheses fitted until they converge; what does not is said, and never judged.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    """
    for _ in range(2):
        best = min(f.objective for f in (known.null, *known.fits))
        leading = [f for f, _ in known.probabilities[:POLISHED] if not f.converged and f.objective < HOPELESS * best]
        leading = hopeful(forward, known, leading)
        if not leading:
            break
        known = known.replaced([fitted(forward, f.candidates, [f.theta]) for f in leading])
    return known


def hopeful(forward: Forward, known: Hypotheses, fits: Iterable[Fit]) -> list[Fit]:
    """Those of the ``fits`` that are not far behind one that explains the data: the others are left as they are.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    fits : iterable of Fit
    """
    explain = [f for f in known.fits if f.admissible and goodness_of_fit(forward, f) > POOR_FIT]
    reached = max((known.log_posterior(f) for f in explain), default=-math.inf)
    return [f for f in fits if known.log_posterior(f) > reached - BEHIND]


def laddered(forward: Forward, known: Hypotheses) -> Hypotheses:
    """Soft joints that improve the fit, fitted from several softnesses as well: a loose body resonates in each.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    """
    better = [f for f in known.fits if len(f.candidates) == 1 and f.objective < known.null.objective - IMPROVED]
    ladders = {f: [np.concatenate([known.null.theta, start]) for start in f.candidates[0].ladder] for f in better}
    return bettered(known, [fitted(forward, f.candidates, starts) for f, starts in ladders.items() if starts])


def retried(forward: Forward, known: Hypotheses) -> Hypotheses:
    """Where no single hypothesis fits: the best of them from other starts, guided by easier problems.

    Where none fits then either, those that were given up as poor are fitted to their end: a way may be long and lead.
    Then those that ended at a bound, from typical sizes: from a small one, beside parameters that went far astray to
    make up for it, an effect that is there may shrink to nothing.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    """
    if not known.fits or _some_fits(forward, known):
        return known
    order = sorted(known.fits, key=lambda f: f.objective)
    easier = forward.easier()
    if easier and order[0].objective > LOUD * len(forward.rows.where):
        ways = _guided(easier[0], known)
    else:
        ways = [fit(forward, f.candidates, patient=True, turns=ROUGH) for f in order[:RETRIED]]
    known = bettered(known, [fitted(forward, way.candidates, [way.theta], turns=ROUGH) for way in ways])
    if _some_fits(forward, known):
        return known
    given_up = [f for f in known.fits if not f.converged and math.isfinite(f.objective)]
    known = bettered(known, [fitted(forward, f.candidates, [f.theta]) for f in given_up])
    if _some_fits(forward, known):
        return known
    typical = {f: default_starts(forward, f.candidates)[1:2] for f in known.fits if f.at_bound()}
    return bettered(
        known, [fitted(forward, f.candidates, starts, turns=ROUGH) for f, starts in typical.items() if starts]
    )


def _some_fits(forward: Forward, known: Hypotheses) -> bool:
    return any(goodness_of_fit(forward, f) > POOR_FIT for f in (known.null, *known.fits))


def bettered(known: Hypotheses, others: Iterable[Fit]) -> Hypotheses:
    """With those of the ``others`` that are clearly better than what is ``known`` of the same effects."""
    better = []
    for other in others:
        old = known.find(other.identifiers)
        if old is None or other.objective < old.objective - small(old.objective):
            better.append(other)
    return known.replaced(better) if better else known


def _guided(easier: Forward, known: Hypotheses) -> list[Fit]:
    """Single hypotheses fitted to an ``easier`` problem, those whose first step promises most there."""
    null = fit(easier, turns=GUIDE)
    promised = {f: outlook(easier, null, f.candidates[0]) for f in known.fits if f.candidates[0].unknowns}
    order = sorted(promised, key=lambda f: promised[f])
    soft = [f for f in order[RETRIED:] if len(f.candidates[0].first_starts) > 1]  # their first step says little
    return [fit(easier, f.candidates, turns=GUIDE) for f in (*order[:RETRIED], *soft)]
