"""Which hypotheses are fitted: nothing, singles, then the best enlarged by one effect at a time, and back again.

A fit may stop in a local optimum. It is found out by comparing nested hypotheses: a hypothesis with one effect more
can never fit worse, and one effect less is also tried from where the larger one ended.
"""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from studies.inference.arrays import Array
from studies.inference.checks import goodness_of_fit, held_out, whiteness
from studies.inference.evidence import CLEAR_ODDS, SELDOM, Hypotheses
from studies.inference.fit import Fit, default_starts, fit, outlook
from studies.inference.forward import Forward
from studies.inference.minimise import GUIDE, ROUGH, THOROUGH, distinct, small
from studies.inference.parameter import Candidate, together
from studies.inference.starts import enlarged, promising

BEAM = 2  # hypotheses that are expanded
MOST_EFFECTS = 3
MOST_TRIED = 4  # candidates that are fitted beside a parent
WORTH_A_FIT = 4.0  # promised decrease of the objective below which they are not
NOTHING = 0.05  # P(nothing is missing) above which nothing is named
POOR_FIT = 0.01  # p below which a model does not fit
MANY = 3  # effects at once, each of which must stand alone
LOUD = 1.3  # objective a row beyond which every hypothesis is tried again
RETRIED = 5  # poor fits that are tried from other starts
POLISHED = 8  # most probable fits that must converge
HOPELESS = 2.0  # times the best objective, beyond which a fit is not polished
Progress = Callable[[str], None]
"""Called with the name of each hypothesis before it is fitted."""


def singles(forward: Forward, progress: Progress) -> Hypotheses:
    """Fit nothing and each candidate of ``forward`` alone; ``progress`` is told of each."""
    progress("parameters only")
    null = fit(forward, patient=True)
    fits = []
    for candidate in forward.candidates:
        progress(candidate.identifier)
        nominal = default_starts(forward, (candidate,))
        starts = [*(np.concatenate([null.theta, start]) for start in candidate.first_starts)]
        if forward.thorough:
            starts += nominal[1:]
        else:
            starts = promising(forward, (candidate,), [*starts, *nominal[: len(starts)]], len(starts))
        fits.append(_fitted(forward, (candidate,), starts, turns=_turns(forward)))
    known = Hypotheses(null, tuple(fits), forward.library)
    return _retried(forward, _none_worse(forward, known))


def again(forward: Forward, known: Hypotheses, progress: Progress) -> Hypotheses:
    """The same hypotheses fitted to a ``forward`` model that changed a little (its noise), from where they ended.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    progress : callable
        Told of each fit.
    """
    progress("parameters only")
    found = [fit(forward, starts=[known.null.theta])]
    for f in known.fits:
        progress(f.name)
        found.append(_fitted(forward, f.candidates, [f.theta], turns=_turns(forward)))
    return _none_worse(forward, Hypotheses(found[0], tuple(found[1:]), known.library))


def search(forward: Forward, known: Hypotheses, progress: Progress) -> tuple[Hypotheses, Fit | None]:
    """The best hypothesis, enlarged by one effect at a time as long as evidence and held-out score clearly gain.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
        Singles.
    progress : callable
        Told of each fit.
    """
    known = polished(forward, known)
    if not known.fits or known.nothing >= NOTHING:
        return known, None
    leader = first(forward, known, known.best(1))
    for _ in range(MOST_EFFECTS - 1):
        size = len(leader.candidates)
        parents = list(dict.fromkeys([leader, *_preferred(forward, known.best(size))]))[:BEAM]
        known = polished(forward, expand(forward, known, parents, progress))
        leader = known.find(leader.identifiers) or leader
        other = first(forward, known, known.best(size))
        if known.odds(other, leader) > CLEAR_ODDS:  # a larger one has shown the way to a better optimum
            leader = other
        larger = _preferred(forward, known.best(size + 1))
        if not larger or known.odds(larger[0], leader) < CLEAR_ODDS:
            break
        if held_out(forward, larger[0]).log_score <= held_out(forward, leader).log_score:
            break
        leader = larger[0]
    return _each_alone(forward, known, leader)


def first(forward: Forward, known: Hypotheses, fits: Sequence[Fit]) -> Fit:
    """The most probable of ``fits`` that may be named; the most probable of all where none may."""
    return (_preferred(forward, fits) or list(fits))[0]


def _preferred(forward: Forward, fits: Iterable[Fit]) -> list[Fit]:
    """Fits that may be named, in their order: of a size that occurs, or an unusual one that explains the data."""
    return [f for f in fits if f.admissible and (f.physical or (f.unusual == 1 and _fits(forward, f)))]


def _fits(forward: Forward, hypothesis: Fit) -> bool:
    """In sum, and with nothing but noise left over."""
    return goodness_of_fit(forward, hypothesis) > POOR_FIT and whiteness(forward, hypothesis) > POOR_FIT


def expand(forward: Forward, known: Hypotheses, parents: Iterable[Fit], progress: Progress) -> Hypotheses:
    """Add one more candidate to each parent: those whose first step promises most.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
        What is fitted already and not fitted again.
    parents : iterable of Fit
    progress : callable
        Told of each fit.
    """
    done = {f.identifiers for f in known.fits}
    found: list[Fit] = []
    for parent in parents:
        hopeful: list[tuple[float, int, Candidate]] = []
        for candidate in (*forward.candidates, *forward.enabled_by(parent.candidates)):
            names = parent.identifiers | {candidate.identifier}
            if names in done or len(names) == len(parent.candidates):
                continue
            if forward.compatible((*parent.candidates, candidate)):
                hopeful.append((outlook(forward, parent, candidate), len(hopeful), candidate))
        for promised, _, candidate in sorted(hopeful)[:MOST_TRIED]:
            if not promised < parent.objective - WORTH_A_FIT and candidate.unknowns:
                continue
            done.add(parent.identifiers | {candidate.identifier})
            joined = (*parent.candidates, candidate)
            progress(together(joined))
            found.append(_fitted(forward, joined, _joined_starts(forward, known, parent, candidate)))
    return _smaller(forward, _none_worse(forward, known.replaced(found), found), found)


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
        if not leading:
            break
        known = known.replaced([_fitted(forward, f.candidates, [f.theta]) for f in leading])
    return known


def _turns(forward: Forward) -> tuple[int, int]:
    return THOROUGH if forward.thorough else ROUGH


def _fitted(
    forward: Forward, candidates: tuple[Candidate, ...], starts: Sequence[Array], *, turns: tuple[int, int] = THOROUGH
) -> Fit:
    """A fit; an effect that ended beyond what occurs is fitted again with the prior of sizes that seldom occur.

    One effect only: several of them together mimic anything.
    """
    found = fit(forward, candidates, starts=starts, turns=turns)
    beyond = {name.split(".")[0] for name in found.implausible()}
    usual = [c for c in candidates if c.identifier in beyond and all(u.widened == 1 for u in c.unknowns)]
    if len(beyond) != 1 or not usual or not math.isfinite(found.objective):
        return found
    wider = tuple(c.unusual() if c in usual else c for c in candidates)
    seldom = fit(forward, wider, starts=[found.theta], turns=turns)
    return seldom if seldom.implausible() and seldom.log_evidence + math.log(SELDOM) > found.log_evidence else found


def _joined_starts(forward: Forward, known: Hypotheses, parent: Fit, candidate: Candidate) -> list[Array]:
    """From the parent with a small size of the candidate, and from what the candidate was fitted to by itself."""
    starts = [np.concatenate([parent.theta, start]) for start in candidate.first_starts]
    alone = known.find(frozenset({candidate.identifier}))
    if alone is not None and math.isfinite(alone.objective):
        own = alone.theta[alone.effect_columns]
        starts.append(np.concatenate([parent.theta, own]))
        nuisances = alone.theta[: alone.effect_columns.start]
        starts.append(np.concatenate([nuisances, parent.theta[parent.effect_columns], own]))
    return promising(forward, (*parent.candidates, candidate), starts)


def _none_worse(forward: Forward, known: Hypotheses, new: Sequence[Fit] | None = None) -> Hypotheses:
    """Each hypothesis (each ``new`` one) at least as good as those it contains: fitted again from theirs if not."""
    better: list[Fit] = []
    for f in known.fits if new is None else new:
        parts = [p for p in (known.null, *known.fits) if p.identifiers < f.identifiers]
        best = min(parts, key=lambda p: p.objective)
        if f.objective > best.objective + 2 * small(best.objective):
            begins = [enlarged(best, f.candidates), enlarged(best, f.candidates, neutral=True)]
            begins = distinct(begins, f.begins)
            other = fit(forward, f.candidates, starts=begins, turns=ROUGH) if begins else f
            better.append(other if other.objective < f.objective else f)
    return known.replaced(better) if better else known


def _smaller(forward: Forward, known: Hypotheses, larger: Sequence[Fit]) -> Hypotheses:
    """What the best ``larger`` hypotheses contain, fitted again from where they ended with one effect removed."""
    better: list[Fit] = []
    for f in sorted(larger, key=lambda f: -known.log_posterior(f))[:BEAM]:
        for gone in f.candidates:
            rest = tuple(c for c in f.candidates if c is not gone)
            old = known.find(frozenset(c.identifier for c in rest))
            if old is not None and goodness_of_fit(forward, old) > POOR_FIT:
                continue
            part = _fitted(forward, rest, [enlarged(f, rest)])
            if old is None or part.objective < old.objective - small(old.objective):
                better.append(part)
    return known.replaced(better) if better else known


def _retried(forward: Forward, known: Hypotheses) -> Hypotheses:
    """Where no single hypothesis fits: the best of them from other starts, guided by easier problems."""
    if not known.fits:
        return known
    if any(goodness_of_fit(forward, f) > POOR_FIT for f in (known.null, *known.fits)):
        return known
    order = sorted(known.fits, key=lambda f: f.objective)
    easier = forward.easier()
    if easier and order[0].objective > LOUD * len(forward.rows.where):
        ways = _guided(easier[0], known)
    else:
        ways = [fit(forward, f.candidates, patient=True, turns=ROUGH) for f in order[:RETRIED]]
    better = []
    for way in ways:
        old = known.find(way.identifiers)
        other = _fitted(forward, way.candidates, [way.theta], turns=ROUGH)
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


def _each_alone(forward: Forward, known: Hypotheses, leader: Fit) -> tuple[Hypotheses, Fit]:
    """The leader without what does not stand by its own odds and its own held-out gain."""
    nothing = held_out(forward, known.null).log_score if len(leader.candidates) >= MANY else math.nan
    while len(leader.candidates) > 1:
        score, weak = held_out(forward, leader).log_score, []
        for gone in leader.candidates:
            rest = tuple(c for c in leader.candidates if c is not gone)
            part = known.find(frozenset(c.identifier for c in rest))
            if part is None or not part.converged:
                part = _fitted(forward, rest, [enlarged(leader, rest)])
                known = known.replaced([part])
            odds = known.odds(leader, part)
            alone = len(leader.candidates) < MANY or beats_nothing(forward, known, gone, nothing)
            if odds < CLEAR_ODDS or held_out(forward, part).log_score >= score or not alone:
                weak.append((odds, part))
        if not weak:
            break
        leader = min(weak, key=lambda item: item[0])[1]
    return known, leader


def beats_nothing(forward: Forward, known: Hypotheses, candidate: Candidate, nothing: float) -> bool:
    """Whether a ``candidate`` by itself beats the null in odds and on held-out data.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    candidate : Candidate
    nothing : float
        Held-out log score of the null, no unit.
    """
    own = known.find(frozenset({candidate.identifier}))
    if own is None or known.odds(own, known.null) < CLEAR_ODDS:
        return False
    return held_out(forward, own).log_score > nothing
