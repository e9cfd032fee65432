"""Search of hypotheses: the null, each effect alone, then the best enlarged by one effect at a time, and back again.

A fit may stop in a local optimum. So, where no effect explains the data, the best are fitted from other starts; the
most probable hypotheses are fitted until they converge, and one effect fewer also from where the larger one ended.
Only what is far behind an explanation of the data stays where it stopped.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.inference.evidence import held_out, whiteness
from studies.inference.fit import (
    GUIDE,
    ROUGH,
    THOROUGH,
    Fit,
    default_starts,
    fit,
    lowest_explaining,
    negligible_decrease,
)
from studies.inference.kind import Kind
from studies.inference.parameter import Array, Candidate, hypothesis_name
from studies.inference.rules import RULES
from studies.inference.starts import null_from, preview_objective, select_starts, transfer_coordinates
from studies.inference.verdict import Reason

Progress = Callable[[str], None]
"""Called with the name of each hypothesis before it is fitted."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Fits to the data of a ``kind``: the ``null``, with nuisances only, and ``fits`` with effects, singles first."""

    null: Fit
    fits: tuple[Fit, ...]
    kind: Kind

    def log_posterior(self, hypothesis: Fit) -> float:
        """Log evidence of a ``hypothesis`` plus its log prior, without the constant that all share.

        The null has 1/2, sets of k effects have 1/2^k together, shared by the products of their weights; an effect of a
        rare size costs the factor RULES.seldom more.
        """
        k = len(hypothesis.candidates)
        if not k:
            return hypothesis.log_evidence + math.log(0.5)
        log_share = sum(math.log(c.weight) for c in hypothesis.candidates) - math.log(self._sum_of_weight_products(k))
        seldom = sum(any(u.widened > 1 for u in c.unknowns) for c in hypothesis.candidates)
        return (
            hypothesis.log_evidence
            + math.log(0.5)
            + log_share
            - (k - 1) * math.log(2)
            + seldom * math.log(RULES.seldom)
        )

    def _sum_of_weight_products(self, effects: int) -> float:
        """Product of prior weights of ``effects`` candidates, summed over such sets of the library; 1 if that is 0."""
        sums = np.zeros(effects + 1)
        sums[0] = 1.0
        for candidate in self.kind.library:
            sums[1:] += candidate.weight * sums[:-1]
        return float(sums[effects]) or 1.0

    @property
    def probabilities(self) -> list[tuple[Fit, float]]:
        """Each hypothesis with its posterior probability (their sum is 1), most probable first.

        The null has 1 if the evidence of all is not finite.
        """
        hypotheses = (self.null, *self.fits)
        logs = np.array([self.log_posterior(hypothesis) for hypothesis in hypotheses])
        if not np.isfinite(logs).any():
            logs = np.where(np.arange(len(logs)) == 0, 0.0, -np.inf)
        weight = np.exp(logs - logs.max())
        probability = weight / weight.sum()
        return [(hypotheses[k], float(probability[k])) for k in np.argsort(-probability, kind="stable")]

    @property
    def posterior(self) -> dict[str, float]:
        """Posterior probability by the name of the hypothesis, most probable first."""
        return {hypothesis.name: probability for hypothesis, probability in self.probabilities}

    @property
    def p_nothing(self) -> float:
        """P(nothing is missing): posterior probability of the null, 0 to 1."""
        return next(probability for hypothesis, probability in self.probabilities if hypothesis is self.null)

    def rank(self, effects: int | None = None) -> list[Fit]:
        """Sort the fits with effects (only those with this number of ``effects``, if given), most probable first."""
        fits = [f for f in self.fits if effects is None or len(f.candidates) == effects]
        return sorted(fits, key=lambda f: -self.log_posterior(f))

    def find_extensions(self, hypothesis: Fit) -> list[Fit]:
        """Find physical fits with all effects of a ``hypothesis`` and more, which it does not clearly beat, best first.

        Physical ones converged inside their bounds, to sizes that usually occur; it clearly beats those against which
        its odds are RULES.clear_odds or more.
        """
        more = [f for f in self.rank() if hypothesis.identifiers < f.identifiers and f.physical]
        return [f for f in more if self.odds(hypothesis, f) < RULES.clear_odds]

    def find_likelier_extensions(self, hypothesis: Fit) -> list[Fit]:
        """Find those extensions whose odds against the ``hypothesis`` exceed RULES.likelier_odds, best first."""
        return [f for f in self.find_extensions(hypothesis) if self.odds(f, hypothesis) > RULES.likelier_odds]

    def odds(self, first: Fit, second: Fit) -> float:
        """Posterior odds of ``first`` to ``second``; infinite if only the second is impossible, 1 if both are."""
        first_log, second_log = self.log_posterior(first), self.log_posterior(second)
        if math.isinf(second_log):
            return math.inf if math.isfinite(first_log) else 1.0
        return math.exp(min(first_log - second_log, 700.0))

    def find(self, identifiers: frozenset[str]) -> Fit | None:
        """The fit whose effects have exactly these ``identifiers`` (the null has none); None if it was not fitted."""
        return next((f for f in (self.null, *self.fits) if f.identifiers == identifiers), None)

    def replace_fits(self, better: Sequence[Fit]) -> "Hypotheses":
        """Copy with the ``better`` fits in the place of those of the same effects; fits of other effects are added."""
        fits = {f.identifiers: f for f in (self.null, *self.fits)} | {f.identifiers: f for f in better}
        null = fits.pop(frozenset())
        return Hypotheses(null, tuple(sorted(fits.values(), key=lambda f: len(f.candidates))), self.kind)

    def adopt_better(self, others: Iterable[Fit]) -> "Hypotheses":
        """Copy with those of the ``others`` that have no fit of the same effects yet, or a clearly lower objective."""
        better = []
        for other in others:
            old = self.find(other.identifiers)
            if old is None or other.objective < old.objective - negligible_decrease(old.objective):
                better.append(other)
        return self.replace_fits(better) if better else self

    @property
    def required_decrease(self) -> float:
        """Decrease of the objective (-2 ln p) that a first step must promise before an effect is added and fitted.

        Of a costly kind, it is the decrease that clear odds need.
        """
        if not self.kind.costly:
            return RULES.worth_a_fit
        rivals = max(1, len(self.kind.library))  # an empty library may still meet terms that others make possible
        return 2 * math.log(RULES.clear_odds * 2 * rivals)

    @property
    def any_fits_data(self) -> bool:
        """True if the null or any other hypothesis explains the data (p of chi^2 above RULES.poor_fit)."""
        return any(f.fits_data for f in (self.null, *self.fits))

    def drop_hopeless(self, fits: Iterable[Fit]) -> list[Fit]:
        """Drop ``fits`` whose log posterior is RULES.behind or more below that of the best that explains the data.

        Only those of no finite evidence are dropped if no effects explain the data.
        """
        explaining = [self.log_posterior(f) for f in self.fits if f.admissible and f.fits_data]
        lowest = max(explaining, default=-math.inf) - RULES.behind
        return [f for f in fits if self.log_posterior(f) > lowest]

    def refit_with_wider_priors(self, leaders: Sequence[Fit]) -> "Hypotheses":
        """Hypotheses of null and ``leaders`` alone, refitted with RULES.wider times the prior sd of nuisances."""
        reached = lowest_explaining((self.null, *self.fits))
        fits = [
            fit(self.kind, f.candidates, starts=[f.theta], nuisance_scale=RULES.wider, reached=reached)
            for f in (self.null, *leaders)
        ]
        return Hypotheses(fits[0], tuple(fits[1:]), self.kind)


def fit_hypothesis(
    kind: Kind,
    candidates: tuple[Candidate, ...],
    starts: Sequence[Array],
    *,
    turns: tuple[int, int] = THOROUGH,
    reached: float = math.inf,
) -> Fit:
    """Fit a hypothesis from ``starts`` (p,), with a wider prior of one effect's sizes where that is more probable.

    The wider prior, for rare sizes, is tried if exactly one effect ended beyond the usual sizes.
    ``turns`` are the limits of iterations, as of :func:`_iteration_limits`; ``reached`` is as of :func:`fit`.
    """
    usual_fit = fit(kind, candidates, starts=starts, turns=turns, reached=reached)
    beyond = {name.split(".")[0] for name in usual_fit.sizes_beyond_usual()}
    usual = [c for c in candidates if c.identifier in beyond and all(u.widened == 1 for u in c.unknowns)]
    if len(beyond) != 1 or not usual or not math.isfinite(usual_fit.objective):
        return usual_fit
    wider = tuple(c.with_wider_prior() if c in usual else c for c in candidates)
    wide_fit = fit(kind, wider, starts=[usual_fit.theta], turns=turns)
    more_probable = wide_fit.log_evidence + math.log(RULES.seldom) > usual_fit.log_evidence
    return wide_fit if wide_fit.sizes_beyond_usual() and more_probable else usual_fit


# ---------------------------------------------------------------------- one effect at a time


def fit_singles(kind: Kind, progress: Progress) -> Hypotheses:
    """Fit the null and each candidate of ``kind`` alone; where none explains the data, the best are retried.

    ``progress`` is called with the name of each.
    """
    progress("parameters only")
    null = fit(kind, patient=True)
    fits: list[Fit] = []
    for candidate in kind.candidates:
        progress(candidate.identifier)
        nominal = default_starts(kind, (candidate,))
        starts = [*(np.concatenate([null.theta, start]) for start in candidate.first_starts)]
        if kind.thorough:
            starts += nominal[1:]
        else:
            starts = select_starts(kind, (candidate,), [*starts, *nominal[: len(starts)]], len(starts))
        reached = lowest_explaining([null, *fits])
        fits.append(fit_hypothesis(kind, (candidate,), starts, turns=_iteration_limits(kind), reached=reached))
    return _retry_poor_fits(Hypotheses(null_from(null, fits, kind), tuple(fits), kind))


def refit_all(kind: Kind, hypotheses: Hypotheses, progress: Progress) -> Hypotheses:
    """Refit all hypotheses to a ``kind`` that changed a little (its noise), from where they ended."""
    progress("parameters only")
    null = fit(kind, starts=[hypotheses.null.theta])
    refits = []
    for f in hypotheses.fits:
        progress(f.name)
        moved = np.concatenate([null.theta, f.theta[f.effect_columns]])  # what adds little moves as the null did
        start = select_starts(kind, f.candidates, [f.theta, moved], 1)
        refits.append(fit_hypothesis(kind, f.candidates, start, turns=_iteration_limits(kind)))
    return Hypotheses(null, tuple(refits), kind)


def _iteration_limits(kind: Kind) -> tuple[int, int]:
    """Most iterations of a fit to a ``kind``, and the number after which a fit that is still poor is given up."""
    return THOROUGH if kind.thorough else ROUGH


def _retry_poor_fits(hypotheses: Hypotheses) -> Hypotheses:
    """Refit the best hypotheses from other starts, until one explains the data; unchanged if one does already."""
    if not hypotheses.fits or hypotheses.any_fits_data:
        return hypotheses

    # 1. From where an easier problem leads, if all are far off; else from where a patient fit of the best leads.
    order = sorted(hypotheses.fits, key=lambda f: f.objective)
    easier = hypotheses.kind.easier_problems()
    if easier and order[0].objective > RULES.loud * len(hypotheses.kind.rows.places):
        guides = _fit_easier_problem(easier[0], hypotheses)
    else:
        guides = [fit(hypotheses.kind, f.candidates, patient=True, turns=ROUGH) for f in order[: RULES.retried]]
    hypotheses = hypotheses.adopt_better(
        [fit_hypothesis(hypotheses.kind, guide.candidates, [guide.theta], turns=ROUGH) for guide in guides]
    )
    if hypotheses.any_fits_data:
        return hypotheses

    # 2. From where they stopped short, with more iterations.
    unconverged = [f for f in hypotheses.fits if not f.converged and math.isfinite(f.objective)]
    hypotheses = hypotheses.adopt_better(
        [fit_hypothesis(hypotheses.kind, f.candidates, [f.theta]) for f in unconverged]
    )
    if hypotheses.any_fits_data:
        return hypotheses

    # 3. From a size of the usual order, where a size ended at its bound.
    typical_starts = {
        f: default_starts(hypotheses.kind, f.candidates)[1:2] for f in hypotheses.fits if f.sizes_at_bound()
    }
    return hypotheses.adopt_better(
        [
            fit_hypothesis(hypotheses.kind, f.candidates, starts, turns=ROUGH)
            for f, starts in typical_starts.items()
            if starts
        ]
    )


def _fit_easier_problem(easier: Kind, hypotheses: Hypotheses) -> list[Fit]:
    """Fit single effects to an ``easier`` problem: those whose first step promises most there, and all soft joints.

    Returns fits to the easier problem, whose coordinates are starts for the full one.
    """
    null = fit(easier, turns=GUIDE)
    promised = {
        f: preview_objective(easier, null, f.candidates[0]) for f in hypotheses.fits if f.candidates[0].unknowns
    }
    order = sorted(promised, key=lambda f: promised[f])
    most = RULES.retried
    soft = [f for f in order[most:] if len(f.candidates[0].first_starts) > 1]  # their first step says little
    return [fit(easier, f.candidates, turns=GUIDE) for f in (*order[:most], *soft)]


def _converge_leaders(hypotheses: Hypotheses) -> Hypotheses:
    """Refit the most probable hypotheses that did not converge, from where they ended, with more iterations.

    Needed by test_search::test_the_most_probable_effect_is_fitted_until_it_converges.
    """
    for _ in range(2):  # a refit may put others among the most probable
        best = min(f.objective for f in (hypotheses.null, *hypotheses.fits))
        unfinished = [f for f, _ in hypotheses.probabilities[: RULES.polished] if not f.converged]
        unfinished = hypotheses.drop_hopeless([f for f in unfinished if f.objective < RULES.hopeless * best])
        if not unfinished:
            break
        hypotheses = hypotheses.replace_fits(
            [fit_hypothesis(hypotheses.kind, f.candidates, [f.theta]) for f in unfinished]
        )
    return hypotheses


def _retry_soft_joints(hypotheses: Hypotheses) -> Hypotheses:
    """Refit each soft joint that alone fits better than the null from several softnesses: each has its resonance.

    Hypotheses of a costly kind stay as they are.
    Needed by test_on_a_spring::test_the_softness_is_found_though_a_slight_and_a_typical_one_lead_elsewhere.
    """
    if hypotheses.kind.costly:  # much data: the search on a part of them has found the softness
        return hypotheses
    objective_limit = hypotheses.null.objective - RULES.improved
    reached = lowest_explaining((hypotheses.null, *hypotheses.fits))
    refits = []
    for f in hypotheses.fits:
        ladder = f.candidates[0].ladder
        if len(f.candidates) == 1 and ladder and f.objective < objective_limit:
            starts = [np.concatenate([hypotheses.null.theta, softness]) for softness in ladder]
            close = f.objective <= RULES.poor * reached  # it may be the closest alternative, whose misfit is reported
            limit = math.inf if close else reached
            refits.append(fit_hypothesis(hypotheses.kind, f.candidates, starts, reached=limit))
    return hypotheses.adopt_better(refits)


# ---------------------------------------------------------------------- several effects


def search(hypotheses: Hypotheses, progress: Progress) -> tuple[Hypotheses, Fit | None]:
    """Enlarge the best hypothesis by one effect at a time while odds clearly gain, then drop those not needed.

    The noise is estimated again where a larger hypothesis explains some of it. Returns all hypotheses and their leader,
    None if P(nothing is missing) is RULES.nothing or more.
    """
    hypotheses = _retry_soft_joints(_converge_leaders(hypotheses))
    if not hypotheses.fits or hypotheses.p_nothing >= RULES.nothing:
        return hypotheses, None
    leader = _choose_leader(hypotheses.kind, hypotheses.rank(1))
    for _ in range(RULES.most_effects - 1):
        # 1. Fit the best hypotheses of this size with one effect more.
        size = len(leader.candidates)
        parents = _choose_parents(hypotheses, leader)
        hypotheses = _converge_leaders(expand(hypotheses, parents, progress))

        # 2. What a clearly better, larger one explains is no noise: fit all again with the noise that it leaves.
        hypotheses = _adopt_noise(hypotheses, leader, progress)
        leader = hypotheses.find(leader.identifiers) or leader

        # 3. Stop unless one effect more is clearly more probable.
        larger = _filter_nameable(hypotheses.kind, hypotheses.rank(size + 1))
        if not larger or hypotheses.odds(larger[0], leader) < RULES.clear_odds:
            break

        # 4. An effect whose own fit went astray may be imitated by one of the leader's that excludes it.
        #    Needed by test_search::test_an_effect_that_was_lost_alone_takes_the_place_of_one_that_imitates_it.
        hypotheses, leader = exchange_effect(hypotheses, larger[0], progress)

    # 5. Fitted together, each must still be needed next to the others, by odds and by the held-out score. Needed by
    #    test_search::test_no_effect_is_kept_because_the_rest_stopped_in_a_minimum_of_its_own.
    return drop_unsupported(hypotheses, leader)


def _choose_parents(hypotheses: Hypotheses, leader: Fit) -> list[Fit]:
    """Choose fits to enlarge, all of as many effects: the leader, its best nameable alternatives, the most probable."""
    same_size = hypotheses.rank(len(leader.candidates))
    nameable = _filter_nameable(hypotheses.kind, same_size)
    parents = list(dict.fromkeys([leader, *nameable]))[: RULES.beam]
    # The most probable may have a size that seldom occurs because it stands for two effects. Needed by test_search::
    # test_the_most_probable_effect_is_enlarged_where_its_size_seldom_occurs_and_it_does_not_fit_alone.
    if same_size[0].admissible and same_size[0] not in parents:
        parents.append(same_size[0])
    return parents


def refine_on_all_data(
    kind: Kind, preliminary: Hypotheses, leader: Fit | None, progress: Progress
) -> tuple[Hypotheses, Fit | None]:
    """Refit the ``leader`` and its alternatives, and the noise, to all data of a ``kind``, and search on from there.

    ``preliminary`` hypotheses and leader were fitted to a part of the data. Returns all hypotheses and their leader,
    None if P(nothing is missing) is RULES.nothing or more.
    """
    best = leader or next(iter(preliminary.rank()), preliminary.null)
    residual, _ = kind.residual(best.candidates, best.theta, slopes=False)
    for _ in range(2):  # the noise is what the best leaves: where it ended in few data, then where it ends in all
        kind = kind.estimate_noise(replace(best, residual=residual))
        progress(f"{best.name}, on all data")
        best = fit(kind, best.candidates, starts=[best.theta])
        residual = best.residual

    # Rivals: what was not far behind on a part of the data, and the best with effects less.
    lowest = preliminary.log_posterior(preliminary.find(best.identifiers) or preliminary.null) - RULES.behind
    rivals = [f for f, _ in preliminary.probabilities[: RULES.polished] if preliminary.log_posterior(f) > lowest]
    rivals += [f for f in preliminary.fits if f.identifiers < best.identifiers]
    fits = {best.identifiers: best}
    for f in (preliminary.null, *rivals):
        if f.identifiers not in fits:
            progress(f"{f.name}, on all data")
            fits[f.identifiers] = fit(kind, f.candidates, starts=[f.theta], turns=ROUGH)
    null = fits.pop(frozenset())
    hypotheses = Hypotheses(null, tuple(sorted(fits.values(), key=lambda f: len(f.candidates))), kind)

    # All data may show a single effect that few do not; if it leads, the noise is what it leaves.
    hypotheses = expand(hypotheses, hypotheses.drop_hopeless([null]), progress)
    first = next(iter(hypotheses.rank()), best)
    if first.identifiers != best.identifiers:
        hypotheses = refit_all(kind.estimate_noise(first), hypotheses, progress)
    return search(hypotheses, progress)


def exchange_effect(hypotheses: Hypotheses, leader: Fit, progress: Progress) -> tuple[Hypotheses, Fit]:
    """Exchange an effect of the leader for one it excludes, whose fit alone did not converge, if clearly better.

    Tried only if the null did not converge either. Returns all hypotheses and the leader, old or new.
    """
    if hypotheses.null.converged:
        return hypotheses, leader
    kind = hypotheses.kind
    unconverged = [f.candidates[0] for f in hypotheses.rank(1) if not f.converged and f.candidates[0].unknowns]
    centre = np.array([u.centre for u in kind.nuisances])
    exchanges = []
    for dropped in leader.candidates:
        remaining = tuple(c for c in leader.candidates if c is not dropped)
        sizes = [leader.theta[leader.columns(c)] for c in remaining]
        for replacement in unconverged:
            exchanged = (*remaining, replacement)
            earlier = hypotheses.find(frozenset(candidate.identifier for candidate in exchanged))
            if (earlier is not None and earlier.converged) or replacement.identifier in leader.identifiers:
                continue

            # Only the effect that is dropped excludes its replacement: what fits beside it is tried by :func:`expand`.
            if kind.compatible((*leader.candidates, replacement)) or not kind.compatible(exchanged):
                continue

            # From the nuisances where the leader ended, and from their prior mean.
            progress(hypothesis_name(exchanged))
            typical_sizes = replacement.starts[1:] or replacement.starts  # a small one shrinks to nothing
            nuisances = (leader.theta[: len(centre)], centre)
            starts = [np.concatenate([x, *sizes, size]) for x in nuisances for size in typical_sizes]
            exchanges.append(fit_hypothesis(kind, exchanged, select_starts(kind, exchanged, starts)))

    hypotheses = hypotheses.adopt_better(exchanges)
    rival = _choose_leader(kind, hypotheses.rank(len(leader.candidates)))
    return hypotheses, rival if hypotheses.odds(rival, leader) > RULES.clear_odds else leader


def _adopt_noise(hypotheses: Hypotheses, leader: Fit, progress: Progress) -> Hypotheses:
    """Fit all again with the noise of a larger hypothesis that is clearly better than the ``leader``, if there is one.

    Needed by test_search::test_what_a_second_effect_explains_is_not_taken_for_noise.
    """
    best = hypotheses.rank()[0]
    if len(best.candidates) <= len(leader.candidates) or hypotheses.odds(best, leader) < RULES.clear_odds:
        return hypotheses
    kind = hypotheses.kind.estimate_noise(best)
    return hypotheses if kind is hypotheses.kind else refit_all(kind, hypotheses, progress)


def _choose_leader(kind: Kind, fits: Sequence[Fit]) -> Fit:
    """The most probable of ``fits`` (most probable first) that may be named; of all if none may."""
    return next(iter(_filter_nameable(kind, fits)), fits[0])


def _filter_nameable(kind: Kind, fits: Iterable[Fit]) -> list[Fit]:
    """Keep admissible ``fits`` of usual sizes, or that explain the data with one effect of unusual size, in order."""
    return [f for f in fits if f.admissible and (f.physical or _explains_at_unusual_size(kind, f))]


def _explains_at_unusual_size(kind: Kind, f: Fit) -> bool:
    """True if exactly one effect of ``f`` has a rare size, it fits the data, and residuals are white."""
    return f.seldom_count == 1 and f.fits_data and whiteness(kind, f) > RULES.poor_fit


def expand(hypotheses: Hypotheses, parents: Iterable[Fit], progress: Progress) -> Hypotheses:
    """Copy of ``hypotheses`` with each parent enlarged by one candidate: by those whose first step promises most.

    These are RULES.most_tried for each parent (2 of a costly kind) at most, among those compatible with it and those
    that it makes possible.
    """
    kind = hypotheses.kind
    parents = list(parents)
    lowest = min((parent.objective for parent in parents), default=math.inf)
    tried = {f.identifiers for f in hypotheses.fits}
    enlarged: list[Fit] = []
    for parent in parents:
        # A first step must promise enough; of a parent far behind, also to close RULES.closed of its gap to the best.
        required = hypotheses.required_decrease
        if not hypotheses.drop_hopeless([parent]):
            required = max(required, RULES.closed * (parent.objective - lowest))
        objective_limit = parent.objective - required

        first_steps: list[tuple[float, int, Candidate]] = []  # promised objective, order, candidate
        for candidate in (*kind.candidates, *kind.enabled_by(parent.candidates)):
            names = parent.identifiers | {candidate.identifier}
            if names in tried or len(names) == len(parent.candidates):
                continue
            if kind.compatible((*parent.candidates, candidate)):
                first_steps.append((preview_objective(kind, parent, candidate), len(first_steps), candidate))

        for promised, _, candidate in sorted(first_steps)[: 2 if kind.costly else RULES.most_tried]:
            if not promised < objective_limit and candidate.unknowns:
                continue
            tried.add(parent.identifiers | {candidate.identifier})
            joined = (*parent.candidates, candidate)
            progress(hypothesis_name(joined))
            enlarged.append(fit_hypothesis(kind, joined, _select_enlarged_starts(hypotheses, parent, candidate)))
    return hypotheses.replace_fits(enlarged)


def _select_enlarged_starts(hypotheses: Hypotheses, parent: Fit, candidate: Candidate) -> list[Array]:
    """Select at most two starts (p,) of a parent with a ``candidate`` more: of a small size, or as fitted alone."""
    starts = [np.concatenate([parent.theta, start]) for start in candidate.first_starts]
    single = hypotheses.find(frozenset({candidate.identifier}))
    if single is not None and math.isfinite(single.objective):
        sizes = single.theta[single.effect_columns]
        starts.append(np.concatenate([parent.theta, sizes]))
        nuisances = single.theta[: single.effect_columns.start]
        starts.append(np.concatenate([nuisances, parent.theta[parent.effect_columns], sizes]))
    return select_starts(hypotheses.kind, (*parent.candidates, candidate), starts, 1 if hypotheses.kind.costly else 2)


def drop_unsupported(hypotheses: Hypotheses, leader: Fit) -> tuple[Hypotheses, Fit]:
    """Remove from the ``leader``, one by one, effects that its odds or its held-out score do not need.

    Of RULES.many effects or more, each must also beat the null alone. Returns all hypotheses, with those of one effect
    fewer that were fitted for it, and the leader that remains.
    """
    null_score = (
        held_out(hypotheses.kind, hypotheses.null).log_score if len(leader.candidates) >= RULES.many else math.nan
    )
    while len(leader.candidates) > 1:
        score = held_out(hypotheses.kind, leader).log_score
        weak = []  # odds for an effect, and the fit without it
        for dropped in leader.candidates:
            hypotheses, reduced = _find_without(hypotheses, leader, dropped)
            odds = hypotheses.odds(leader, reduced)
            stands_alone = len(leader.candidates) < RULES.many or beats_null(hypotheses, dropped, null_score)
            if odds < RULES.clear_odds or held_out(hypotheses.kind, reduced).log_score >= score or not stands_alone:
                weak.append((odds, reduced))
        if not weak:
            break
        leader = min(weak, key=lambda item: item[0])[1]
    return hypotheses, leader


def _find_without(hypotheses: Hypotheses, leader: Fit, dropped: Candidate) -> tuple[Hypotheses, Fit]:
    """Find the leader without the effect ``dropped``; it is fitted from there unless a fit explains the data already.

    Returns all hypotheses and this fit: an earlier one may have ended in a local minimum.
    """
    remaining = tuple(c for c in leader.candidates if c is not dropped)
    earlier = hypotheses.find(frozenset(c.identifier for c in remaining))
    if earlier is not None and earlier.converged and earlier.fits_data:
        return hypotheses, earlier
    trial = fit_hypothesis(hypotheses.kind, remaining, [transfer_coordinates(leader, remaining)])
    hypotheses = (
        hypotheses.replace_fits([trial])
        if earlier is None or not earlier.converged
        else hypotheses.adopt_better([trial])
    )
    return hypotheses, hypotheses.find(trial.identifiers) or trial


def beats_null(hypotheses: Hypotheses, candidate: Candidate, null_score: float) -> bool:
    """True if a ``candidate`` alone clearly beats the null in odds, and ``null_score`` in held-out log score."""
    single = hypotheses.find(frozenset({candidate.identifier}))
    if single is None or hypotheses.odds(single, hypotheses.null) < RULES.clear_odds:
        return False
    return held_out(hypotheses.kind, single).log_score > null_score


# ---------------------------------------------------------------------- why not in its place


def reason_against(hypotheses: Hypotheses, f: Fit, leader: Fit | None = None) -> Reason:
    """Reason why ``f`` does not lead, though more probable than the ``leader``: its first fault.

    Without a fault: the rule by which the search adds an effect. Odds are not compared without a leader.
    """
    sizes, misfit = ", ".join(f.sizes_beyond_usual()), not f.fits_data
    faults = {
        "not converged": not f.converged,
        "at bound": bool(f.sizes_at_bound()),
        "too small": bool(f.effects_too_small()),
        "two unusual": f.seldom_count > 1,
        "unusual misfit": bool(sizes) and misfit,
        "unusual not white": bool(sizes) and whiteness(hypotheses.kind, f) <= RULES.poor_fit,
        "nothing": not f.candidates,
        "misfit": misfit and not (leader and leader.candidates),
        "not clear": leader is not None and 1 < hypotheses.odds(f, leader) <= RULES.clear_odds,
    }
    key = next((key for key, at_fault in faults.items() if at_fault), "elsewhere")
    bounds, small = ", ".join(f.sizes_at_bound()), ", ".join(f.effects_too_small())
    return Reason(key, sizes=bounds if key == "at bound" else sizes, names=small, limit=RULES.clear_odds)
