"""Which hypotheses are fitted: nothing, singles, then the best enlarged by one effect at a time, and back again.

A fit may stop in a local optimum. It is found out by comparing nested hypotheses: a hypothesis with one effect more
can never fit worse, and one effect less is also tried from where the larger one ended. Only what is far behind an
explanation of the data is left where it stopped.
"""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from studies.inference.arrays import Array
from studies.inference.attempts import POOR_FIT, bettered, fitted, hopeful, laddered, polished, retried, turns_of
from studies.inference.checks import goodness_of_fit, held_out, whiteness
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit, default_starts, fit, outlook
from studies.inference.forward import Forward
from studies.inference.minimise import ROUGH, distinct, small
from studies.inference.parameter import Candidate, together
from studies.inference.starts import enlarged, promising

BEAM = 2  # hypotheses that are expanded
MOST_EFFECTS = 3
MOST_TRIED = 4  # candidates that are fitted beside a parent
WORTH_A_FIT = 4.0  # promised decrease of the objective below which they are not
CLOSED = 0.5  # of the gap to the best parent, which a first step must promise to close where the gap is hopeless
NOTHING = 0.05  # P(nothing is missing) above which nothing is named
MANY = 3  # effects at once, each of which must stand alone
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
        fits.append(fitted(forward, (candidate,), starts, turns=turns_of(forward)))
    known = Hypotheses(null, tuple(fits), forward.library)
    return retried(forward, _none_worse(forward, known))


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
    null = fit(forward, starts=[known.null.theta])
    found = []
    for f in known.fits:
        progress(f.name)
        moved = np.concatenate([null.theta, f.theta[f.effect_columns]])  # what adds little moves as the null did
        start = promising(forward, f.candidates, [f.theta, moved], 1)
        found.append(fitted(forward, f.candidates, start, turns=turns_of(forward)))
    return _none_worse(forward, Hypotheses(null, tuple(found), known.library))


def search(forward: Forward, known: Hypotheses, progress: Progress) -> tuple[Forward, Hypotheses, Fit | None]:
    """The best hypothesis, enlarged by one effect at a time as long as evidence and held-out score clearly gain.

    Returns the forward model too: its noise is estimated anew where a hypothesis larger than the leader asks for it.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
        Singles.
    progress : callable
        Told of each fit.
    """
    known = laddered(forward, polished(forward, known))
    if not known.fits or known.nothing >= NOTHING:
        return forward, known, None
    leader = first(forward, known, known.best(1))
    for _ in range(MOST_EFFECTS - 1):
        size = len(leader.candidates)
        parents = list(dict.fromkeys([leader, *_preferred(forward, known.best(size))]))[:BEAM]
        parents += [f for f in known.best(size)[:1] if f.admissible and f not in parents]  # of an unusual size
        known = polished(forward, expand(forward, known, parents, progress))
        forward, known = _heard(forward, known, leader, progress)
        leader = known.find(leader.identifiers) or leader
        other = first(forward, known, known.best(size))
        if known.odds(other, leader) > CLEAR_ODDS:  # a larger one has shown the way to a better optimum
            leader = other
        larger = _preferred(forward, known.best(size + 1))
        if not larger or known.odds(larger[0], leader) < CLEAR_ODDS:
            break
        if held_out(forward, larger[0]).log_score <= held_out(forward, leader).log_score:
            break
        known, leader = exchanged(forward, known, larger[0], progress)
    return forward, *pruned(forward, known, leader)


def exchanged(forward: Forward, known: Hypotheses, leader: Fit, progress: Progress) -> tuple[Hypotheses, Fit]:
    """The ``leader`` with an effect in the place of one that excludes it, where parameters only went astray; or itself.

    From parameters far astray an effect by itself may find no way to its minimum. What excludes one of the leader's
    never joins it, and what begins with it is not tried: a trail in the place of a contact that has one, too.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    leader : Fit
        Of two effects or more.
    progress : callable
        Told of each fit.
    """
    if known.null.converged:
        return known, leader
    lost = [f.candidates[0] for f in known.best(1) if not f.converged and f.candidates[0].unknowns]
    centre, found = np.array([u.centre for u in forward.nuisances]), []
    for gone in leader.candidates:
        rest = tuple(c for c in leader.candidates if c is not gone)
        sizes = [leader.theta[leader.columns(c)] for c in rest]
        for c in lost:
            joined = (*rest, c)
            old = known.find(frozenset(one.identifier for one in joined))
            if (old is not None and old.converged) or c.identifier in leader.identifiers:
                continue
            if forward.compatible((*leader.candidates, c)) or not forward.compatible(joined):
                continue
            progress(together(joined))
            typical = c.starts[1:] or c.starts  # a small one shrinks to nothing
            begins = (leader.theta[: len(centre)], centre)
            starts = [np.concatenate([x, *sizes, size]) for x in begins for size in typical]
            found.append(fitted(forward, joined, promising(forward, joined, starts)))
    known = bettered(known, found)
    other = first(forward, known, known.best(len(leader.candidates)))
    return known, other if known.odds(other, leader) > CLEAR_ODDS else leader


def _heard(forward: Forward, known: Hypotheses, leader: Fit, progress: Progress) -> tuple[Forward, Hypotheses]:
    """With the noise as a larger hypothesis leaves it that is clearly better than the leader.

    What the leader leaves may be the missing effect: taken for noise, it hides that the larger one explains the data.
    """
    best = known.best()[0]
    if len(best.candidates) <= len(leader.candidates) or known.odds(best, leader) < CLEAR_ODDS:
        return forward, known
    better = forward.refined(best)
    return (forward, known) if better is forward else (better, again(better, known, progress))


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
    parents = list(parents)
    nearest = min((parent.objective for parent in parents), default=math.inf)
    for parent in parents:
        first_steps: list[tuple[float, int, Candidate]] = []
        far = not hopeful(forward, known, [parent])
        enough = parent.objective - max(WORTH_A_FIT, CLOSED * (parent.objective - nearest) if far else 0.0)
        for candidate in (*forward.candidates, *forward.enabled_by(parent.candidates)):
            names = parent.identifiers | {candidate.identifier}
            if names in done or len(names) == len(parent.candidates):
                continue
            if forward.compatible((*parent.candidates, candidate)):
                first_steps.append((outlook(forward, parent, candidate), len(first_steps), candidate))
        for promised, _, candidate in sorted(first_steps)[:MOST_TRIED]:
            if not promised < enough and candidate.unknowns:
                continue
            done.add(parent.identifiers | {candidate.identifier})
            joined = (*parent.candidates, candidate)
            progress(together(joined))
            found.append(fitted(forward, joined, _joined_starts(forward, known, parent, candidate)))
    return _smaller(forward, _none_worse(forward, known.replaced(found), found), found)


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
    """Each hopeful hypothesis (each ``new`` one) at least as good as those it contains: again from theirs if not."""
    better: list[Fit] = []
    for f in hopeful(forward, known, known.fits if new is None else new):
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
    parts: list[Fit] = []
    for f in sorted(larger, key=lambda f: -known.log_posterior(f))[:BEAM]:
        for gone in f.candidates:
            rest = tuple(c for c in f.candidates if c is not gone)
            old = known.find(frozenset(c.identifier for c in rest))
            if old is None or goodness_of_fit(forward, old) <= POOR_FIT:
                parts.append(fitted(forward, rest, [enlarged(f, rest)]))
    return bettered(known, parts)


def pruned(forward: Forward, known: Hypotheses, leader: Fit) -> tuple[Hypotheses, Fit]:
    """The leader without what does not stand by its own odds and its own held-out gain.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
        Those with one effect less are among them, or are fitted; where they fit poorly, again from the leader's end.
    leader : Fit
    """
    nothing = held_out(forward, known.null).log_score if len(leader.candidates) >= MANY else math.nan
    while len(leader.candidates) > 1:
        score, weak = held_out(forward, leader).log_score, []
        for gone in leader.candidates:
            known, part = _without(forward, known, leader, gone)
            odds = known.odds(leader, part)
            alone = len(leader.candidates) < MANY or beats_nothing(forward, known, gone, nothing)
            if odds < CLEAR_ODDS or held_out(forward, part).log_score >= score or not alone:
                weak.append((odds, part))
        if not weak:
            break
        leader = min(weak, key=lambda item: item[0])[1]
    return known, leader


def _without(forward: Forward, known: Hypotheses, leader: Fit, gone: Candidate) -> tuple[Hypotheses, Fit]:
    """The leader's hypothesis without one effect, at the best end known: a poor one may be a minimum of its own."""
    rest = tuple(c for c in leader.candidates if c is not gone)
    part = known.find(frozenset(c.identifier for c in rest))
    if part is not None and part.converged and goodness_of_fit(forward, part) > POOR_FIT:
        return known, part
    trial = fitted(forward, rest, [enlarged(leader, rest)])
    known = known.replaced([trial]) if part is None or not part.converged else bettered(known, [trial])
    return known, known.find(trial.identifiers) or trial


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
