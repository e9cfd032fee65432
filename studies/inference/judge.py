"""From a kind to a verdict: the rules that a leading hypothesis must meet, and what is named."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain, combinations, takewhile

import numpy as np
from scipy.special import chdtrc

from studies.inference.acceptance import AcceptanceCheck
from studies.inference.evidence import HeldOut, held_out, left_over, whiteness, within_uncertainty
from studies.inference.fit import Fit, Moved, compare_nuisances, default_starts, fit, lowest_explaining, prior
from studies.inference.kind import Kind, Proposal
from studies.inference.parameter import Array, Candidate
from studies.inference.rules import RULES
from studies.inference.search import (
    Hypotheses,
    Progress,
    beats_null,
    fit_singles,
    reason_against,
    refine_on_all_data,
    refit_all,
    search,
)
from studies.inference.starts import transfer_coordinates
from studies.inference.verdict import Judged, Mimic, Named, Reason, Separation, Verdict

Checks = tuple[AcceptanceCheck, ...]


@dataclass(frozen=True, eq=False)
class Acceptance:
    """Decision about the leading hypothesis, and its grounds."""

    verdict: str  # as :class:`studies.inference.verdict.Verdict`
    final: Fit  # the leader if it is named, else the null
    held_out: Mapping[str, HeldOut]  # nuisance_only and final
    leader: Fit | None = None  # what was judged, named or not
    # what cannot be distinguished from the leader, itself first, and why; empty if nothing is named
    members: Mapping[Fit, Reason] = field(default_factory=dict)
    checks: Checks = ()  # answers to the rules that were asked, in their order


def accept(hypotheses: Hypotheses, leader: Fit | None) -> Acceptance:
    """Name the ``leader`` if all rules hold; it is None if nothing is more probable than anything."""
    null_score = held_out(hypotheses.kind, hypotheses.null)
    if leader is None:
        if hypotheses.p_nothing > RULES.even or not hypotheses.fits:
            check = AcceptanceCheck("nothing_unlikely", f"{hypotheses.p_nothing:.3g}", False)
            return _name_nothing(hypotheses, null_score, (check,))
        leader = max(hypotheses.fits, key=lambda f: (f.admissible, hypotheses.log_posterior(f)))
    members, wide = _class_of(hypotheses, leader)
    score = held_out(hypotheses.kind, leader)
    rules = check_rules(hypotheses, leader, (score, null_score), wide)
    checks = tuple(check for group in rules.values() for check in group)
    met = {group: all(check.passed for check in group_checks) for group, group_checks in rules.items()}
    scores = {"nuisance_only": null_score, "final": score}
    alike = len({f.family for f in members}) == 1
    if all(met.values()):
        return Acceptance("named" if alike else "class", leader, scores, leader, members, checks)
    shares = (share for f, share in hypotheses.probabilities if f in members and f.family == leader.family)
    probable = sum(shares) > RULES.even
    explained, sure = met["any name"] and met["fit"], met["partial name"]
    single = len(leader.candidates) == 1  # several at once imitate much: only their size may be doubted
    if explained and met["no reservation"] and (sure or single) and (probable or not hypotheses.null.fits_data):
        return Acceptance("tentative", leader, scores, leader, members, checks)
    share = RULES.partial_share if leader.goodness >= RULES.far else RULES.far_share
    closes = null_score.gap > 0 and score.gap <= min(share * null_score.gap, RULES.partial_rest)
    # beside something unknown, one of several is a guess
    if met["any name"] and sure and met["usual size"] and alike and closes and not explained:
        return Acceptance("partial", leader, scores, leader, members, checks)
    return _name_nothing(hypotheses, null_score, checks, leader)


def _name_nothing(hypotheses: Hypotheses, score: HeldOut, checks: Checks, leader: Fit | None = None) -> Acceptance:
    """Name nothing: "none" if the null fits the data and is probable, else "unknown"."""
    scores = {"nuisance_only": score, "final": score}
    if hypotheses.null.fits_data and hypotheses.p_nothing > RULES.even:
        return Acceptance("none", hypotheses.null, scores, leader, checks=checks)
    return Acceptance("unknown", hypotheses.null, scores, leader, checks=checks)


def _mimics(kind: Kind, hypothesis: Fit) -> tuple[Mimic, ...]:
    """The five empirical terms that lower the objective of ``hypothesis`` most, by a tenth at least."""
    terms = []
    for term in kind.empirical_terms():
        if not kind.compatible((*hypothesis.candidates, term)):
            continue
        start = np.concatenate([hypothesis.theta, term.starts[0]])
        trial = fit(kind, (*hypothesis.candidates, term), starts=[start])
        if trial.objective < RULES.mimic_share * hypothesis.objective and trial.chi2 < hypothesis.chi2:
            u = term.unknowns[0]
            terms.append(Mimic(f"{term.identifier} ({u.unit})", float(trial.theta[-1]), trial.chi2))
    return tuple(sorted(terms, key=lambda mimic: mimic.chi2)[:5])


def _class_of(hypotheses: Hypotheses, leader: Fit) -> tuple[dict[Fit, Reason], Hypotheses]:
    """Members of the leader's class, each with its reason, and the leading hypotheses refitted with wider nuisances."""
    members = equivalents(hypotheses, leader)
    for f in hypotheses.find_likelier_extensions(leader)[:1]:
        odds = hypotheses.odds(f, leader)
        members[f] = Reason("one more", odds=odds)
        if odds > RULES.clear_odds:
            members[f] = Reason("ahead", odds=odds, why=reason_against(hypotheses, f, leader))
    rivals = hypotheses.rank(len(leader.candidates))[: 2 if hypotheses.kind.costly else 6]
    peers = list(dict.fromkeys([*members, *rivals]))
    wide = hypotheses.refit_with_wider_priors([f for f in peers if f.converged or f is leader])
    best = wide.rank()[0]
    if wide.p_nothing < RULES.nothing:  # else the reservation says it
        for f in wide.rank():
            original = hypotheses.find(f.identifiers)
            odds = wide.odds(best, f)
            if original is not None and original not in members and f.physical and odds < RULES.clear_odds:
                # no name may hang on the priors
                members[original] = Reason("leads wide") if f is best else Reason("close wide", odds=odds)
    return members, wide


def check_rules(
    hypotheses: Hypotheses, leader: Fit, scores: tuple[HeldOut, HeldOut], wide: Hypotheses
) -> dict[str, Checks]:
    """Check the rules of any name, of a partial name too, of a name without reservation, and of the fit."""
    kind, (score, null_score) = hypotheses.kind, scores
    term = _find_better_term(hypotheses, leader)
    errors = [c.family for c in leader.candidates if c.mistake and c.family]
    any_name = [
        AcceptanceCheck("varied", "yes" if kind.varied else "one", kind.varied),
        AcceptanceCheck("converged", "yes" if leader.converged else "no", leader.converged),
        _check_none("in_bounds", leader.sizes_at_bound()),
        _check_none("matters", leader.effects_too_small()),
        _check_none("occurs", leader.sizes_below_smallest()),
        _check_none("beats_terms", [term] if term else []),
        # of an error that is named twice the true law is neither of the two
        _check_none("one_law", {family for family in errors if errors.count(family) > 1}),
        _check_none("exceeds_sd", leader.effects_within_sd()),
        AcceptanceCheck("one_seldom", f"{leader.seldom_count}", leader.seldom_count < 2),
    ]

    gain = score.log_score - null_score.log_score
    gain_words = f"{gain:+.1f}" if score.possible else "one run: none to hold out"
    wide_words = f"P(nothing) {wide.p_nothing:.3g}, then {wide.rank()[0].name}"
    survives = wide.p_nothing < RULES.nothing
    if hypotheses.p_nothing < RULES.remote and not survives:
        doubled = f"P(nothing missing) is {wide.p_nothing:.2g} with doubled parameter uncertainties"
    else:
        doubled = ""
    partial_name = [
        AcceptanceCheck("nothing_unlikely", f"{hypotheses.p_nothing:.3g}", hypotheses.p_nothing < RULES.nothing),
        AcceptanceCheck("predicts", gain_words, gain > 0),
        AcceptanceCheck("wide_priors", wide_words, survives or hypotheses.p_nothing < RULES.remote, remark=doubled),
    ]
    if len(leader.candidates) >= RULES.many:  # so many at once fit much
        nothing = null_score.log_score
        weak = [c.identifier for c in leader.candidates if not beats_null(hypotheses, c, nothing)]
        weak_words = f"not {', '.join(weak)}" if weak else "yes"
        partial_name.append(AcceptanceCheck("each_alone", weak_words, not weak, culprit=", ".join(weak)))

    shift_p = within_uncertainty(leader)
    white_p = whiteness(kind, leader)
    no_reservation = [AcceptanceCheck("parameters", f"{shift_p:.2g}", shift_p > RULES.poor_fit)]
    remainder_check = _check_what_is_left(kind, leader)
    if remainder_check is not None:
        no_reservation.append(remainder_check)

    return {
        "any name": tuple(any_name),
        "partial name": tuple(partial_name),
        "usual size": (_check_none("usual_size", leader.sizes_beyond_usual()),),
        "no reservation": tuple(no_reservation),
        "fit": (
            AcceptanceCheck("fits", f"{leader.goodness:.3g}", leader.goodness > RULES.poor_fit),
            AcceptanceCheck("white", f"{white_p:.3g}", white_p > RULES.poor_fit),
        ),
    }


def _check_none(rule: str, culprits: Collection[str]) -> AcceptanceCheck:
    """Check a rule that holds if there are no ``culprits`` (names of effects or their sizes)."""
    return AcceptanceCheck(rule, ", ".join(culprits) or "yes", not culprits)


def _find_better_term(hypotheses: Hypotheses, leader: Fit) -> str:
    """Name of the empirical term that in the place of some effects beats the ``leader`` in odds; "" if none does.

    All such terms together have the prior probability of one effect of the library: the best of eight fits noise
    better than one does (modal_timid: a spring of 1.06 N m/rad lost to one of them). Much data are checked in a part.
    """
    kind = hypotheses.kind.thin(RULES.thinned)
    terms = kind.directions()
    fits = [leader if kind is hypotheses.kind else fit(kind, leader.candidates, starts=[leader.theta])]
    reached = lowest_explaining(fits)
    for remaining in chain(*(combinations(leader.candidates, n) for n in range(len(leader.candidates)))):
        if all(c.mistake for c in leader.candidates if c not in remaining):
            continue
        for term in terms:
            if kind.compatible((*remaining, term)):
                start = transfer_coordinates(leader, (*remaining, term))
                fits.append(fit(kind, (*remaining, term), starts=[start], reached=reached))
    best = max(fits, key=hypotheses.log_posterior)
    if best is fits[0] or hypotheses.odds(best, fits[0]) <= RULES.likelier_odds * len(terms):
        return ""
    return best.candidates[-1].identifier


def _check_what_is_left(kind: Kind, leader: Fit) -> AcceptanceCheck | None:
    """Check that empirical terms explain nothing of the residuals; None if there is no such term."""
    rough = [c.identifier for c in leader.candidates if c.approximate]
    if rough:
        return AcceptanceCheck("nothing_left", f"not checked: {' and '.join(rough)} is an approximate model", True)
    score_test = left_over(kind, leader)
    if score_test is None:
        return None
    p, term = score_test
    if p > RULES.poor_fit:
        return AcceptanceCheck("nothing_left", f"{p:.2g}", True)
    return AcceptanceCheck("nothing_left", f"{p:.2g}, mostly {term}", False, culprit=_describe_term(term))


def _describe_term(term: str) -> str:
    """An empirical term as a sentence names it: "steer torque from lean" is one proportional to lean."""
    if " from " in term:
        return "a " + term.replace(" from ", " proportional to ")
    return term or "an empirical term"


HELD = 1e-6  # of the prior sd: a parameter that does not move
OPEN = ("unknown", "partial", "tentative")
REFINED = 3  # times that the noise is estimated, while another hypothesis takes the lead with it
NEGLIGIBLE = 1e-3  # posterior of a pair that is not worth a line


@dataclass(frozen=True, eq=False, kw_only=True)
class Judgement:
    """A verdict with everything a report shows."""

    kind: Kind  # with its noise as it was estimated
    verdict: Verdict  # what is missing, in numbers and words
    hypotheses: Hypotheses  # all that were fitted
    final: Fit  # with what was named; the null if nothing was
    alone: Fit | None = None  # the named effects with nothing else moved
    nominal: Array  # (n,), whitened residual of the base model as it stands
    held_out: dict[str, HeldOut]  # nuisance_only and final
    quick: bool = False  # by single effects and BIC, nothing held out


def judge(kind: Kind, *, progress: Progress | None = None) -> Judgement:
    """Search the candidates of a ``kind``, accept or refuse the leader, and return the verdict with all it rests on."""
    hypotheses, acceptance = decide(kind, progress)
    kind = hypotheses.kind
    nominal, _ = kind.residual((), np.array([u.centre for u in kind.nuisances]))
    return Judgement(
        kind=kind,
        verdict=verdict_of(hypotheses, acceptance, nominal),
        hypotheses=hypotheses,
        final=acceptance.final,
        nominal=nominal,
        held_out=dict(acceptance.held_out),
    )


def decide(kind: Kind, progress: Progress | None = None) -> tuple[Hypotheses, Acceptance]:
    """Search, and accept or refuse what leads."""
    if not len(kind.rows.places):
        raise ValueError("no data: rows.places is empty; give at least one residual")
    names = [candidate.identifier for candidate in kind.candidates]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{names.count(name)} candidates are called {name!r}; give each an identifier of its own")
    advance = progress or (lambda step: None)
    thinned = kind.thin(RULES.thinned)
    hypotheses, leader, acceptance = _search_plain_first(thinned, advance)
    if thinned is not kind:  # much data are searched in a part, and the leaders refined on all
        searched = {c.identifier for c in hypotheses.kind.candidates}
        whole = kind.with_candidates(tuple(c for c in kind.candidates if c.identifier in searched))
        hypotheses, leader = refine_on_all_data(whole, hypotheses, leader, advance)
        acceptance = accept(hypotheses, leader)
    return hypotheses, acceptance


def _search_plain_first(kind: Kind, advance: Progress) -> tuple[Hypotheses, Fit | None, Acceptance]:
    """Search and accept, with candidates that absorb much only if nothing else explains the data."""
    absorbing = tuple(c for c in kind.candidates if c.absorbs)
    plain = kind.with_candidates(tuple(c for c in kind.candidates if not c.absorbs)) if absorbing else kind
    hypotheses, leader = _settle_noise_and_search(fit_singles(plain, advance), advance)
    acceptance = accept(hypotheses, leader)
    if absorbing and acceptance.verdict in OPEN:
        more = fit_singles(hypotheses.kind.with_candidates(absorbing), advance)
        combined = Hypotheses(
            hypotheses.null, (*hypotheses.fits, *more.fits), hypotheses.kind.with_candidates(kind.candidates)
        )
        extended, extended_leader = _settle_noise_and_search(combined, advance)
        better = accept(extended, extended_leader)
        rival = extended.find(leader.identifiers) if leader else None
        beaten = extended_leader and rival and extended.odds(extended_leader, rival) > RULES.clear_odds
        if better.verdict not in OPEN or (better.verdict == "unknown" and beaten):
            return extended, extended_leader, better
    return hypotheses, leader, acceptance


def _settle_noise_and_search(hypotheses: Hypotheses, advance: Progress) -> tuple[Hypotheses, Fit | None]:
    """Estimate the noise and refit until no other hypothesis takes the lead, then search; hypotheses and leader."""
    for _ in range(REFINED):
        best = hypotheses.rank()[0] if hypotheses.fits else hypotheses.null
        better = hypotheses.kind.estimate_noise(best)
        if better is hypotheses.kind:
            break
        hypotheses = refit_all(better, hypotheses, advance)
        if not hypotheses.fits or hypotheses.rank()[0].identifiers == best.identifiers:
            break
    return search(hypotheses, advance)


def fit_effect_alone(judgement: Judgement) -> Fit | None:
    """Fit the sizes of the named effects, nuisances fixed; None if nothing is named or there are no nuisances."""
    final, nominal = judgement.final, [u.centre for u in judgement.kind.nuisances]
    if not (final.candidates and nominal):
        return None
    starts = [
        np.array([*nominal, *final.theta[final.effect_columns]]),
        *default_starts(judgement.kind, final.candidates),
    ]
    return fit(judgement.kind, final.candidates, starts=starts[:2], nuisance_scale=HELD)


def verdict_of(hypotheses: Hypotheses, acceptance: Acceptance, nominal: Array) -> Verdict:
    """The verdict of an ``acceptance``; ``nominal`` (n,) is the whitened residual of the base model as it stands."""
    final, members = acceptance.final, list(acceptance.members)
    scale = HeldOut(0.0, nominal).gap
    gaps = {name: (s.gap / scale if scale > 0 and s.possible else None) for name, s in acceptance.held_out.items()}
    # A significant misfit counts as noise, as in the model file.
    variance = final.noise_factor**2 * averaged_variance(hypotheses, final)
    effects = tuple(
        _add_marginalised_sizes(hypotheses.kind, final, describe_effect(final, c, variance)) for c in final.candidates
    )
    real = [any(not c.mistake for c in f.candidates) for f in members]
    converged = sorted((f for f in hypotheses.rank() if f.converged), key=lambda f: not f.fits_data)
    is_named = acceptance.verdict not in ("none", "unknown")
    open_ = acceptance.verdict == "partial" or (acceptance.verdict == "unknown" and not final.fits_data)
    more_probable = takewhile(lambda pair: pair[0] is not final, hypotheses.probabilities)
    judged = [
        None if f is None or is_named else Judged(f.name, f.chi2, f.goodness)
        for f in (acceptance.leader, next(iter(converged), None))
    ]
    return Verdict(
        verdict=acceptance.verdict,
        effects=effects,
        equivalent=tuple(f.name for f in members),
        posterior={f.name: p for f, p in hypotheses.probabilities if p > NEGLIGIBLE or len(f.candidates) < 2},
        chi2={
            "n": len(nominal),
            "nominal": float(nominal @ nominal),
            "nuisance_only": hypotheses.null.chi2,
            "final": final.chi2,
            "penalty": final.penalty,
        },
        held_out_gap={"nominal": 1.0 if scale > 0 else None, **gaps},
        separating_measurements=tuple(rank_measurements(hypotheses.kind, members)) if len(members) > 1 else (),
        goodness_of_fit_p=final.goodness,
        alone_p=hypotheses.null.goodness,
        checks=acceptance.checks,
        mimics=_mimics(hypotheses.kind, final) if open_ else (),
        refused=hypotheses.kind.refused,
        warnings=(*hypotheses.kind.notes, *_warnings(hypotheses, acceptance, discrepant=scale > 0)),
        reasons={f.name: why for f, why in acceptance.members.items()},
        refused_leaders=tuple((f.name, p, rule_against(hypotheses, acceptance, f)) for f, p in more_probable),
        judged=judged[0],
        nearest=judged[1],
        titles={
            c.identifier: c.title
            for f in (*members, *filter(None, (acceptance.leader, *converged[:1])))
            for c in f.candidates
            if c.title
        },
        members="effects" if all(real) else "both" if any(real) else "mistakes",
        absorbed=_absorbing_parameters(hypotheses.null, nominal) if acceptance.verdict == "none" else (),
    )


def _absorbing_parameters(null: Fit, nominal: Array) -> tuple[Moved, ...]:
    """Parameters that closed the discrepancy of a base model with a significant residual (n,), largest shift first."""
    if chdtrc(len(nominal), float(nominal @ nominal)) > RULES.poor_fit:
        return ()
    went = compare_nuisances(null, null)
    return went[:1] + tuple(m for m in went[1:] if abs(m.shift) > RULES.told_shift)


def rule_against(hypotheses: Hypotheses, acceptance: Acceptance, f: Fit) -> Reason:
    """Why a hypothesis that is more probable than what is named is not named: one reason, wherever it is listed."""
    if f is acceptance.leader:
        return Reason("fails", rules="; ".join(c.what for c in acceptance.checks if not c.passed))
    if f in acceptance.members:
        return acceptance.members[f]
    return reason_against(hypotheses, f, acceptance.final if acceptance.final.candidates else acceptance.leader)


def _warnings(hypotheses: Hypotheses, acceptance: Acceptance, *, discrepant: bool) -> list[str]:
    """Warnings for the report; ``discrepant``: the base model has a discrepancy beyond noise."""
    warnings, final = [], acceptance.final
    if not discrepant:
        warnings.append("the base model has no discrepancy beyond noise")
    if not acceptance.held_out["final"].possible:
        warnings.append("one run: nothing can be held out, so a name is at best tentative; record more runs or speeds")
    if final.candidates:
        warnings += [check.remark for check in acceptance.checks if check.remark]
    if acceptance.verdict == "unknown" and not any(f.fits_data for f in hypotheses.fits):
        warnings.append("no hypothesis of the library explains the data")
    stuck = [
        f.name
        for f in (hypotheses.null, *hypotheses.rank())
        if not f.converged and hypotheses.posterior[f.name] > NEGLIGIBLE
    ]
    if stuck:
        warnings.append(f"not judged, as the fit did not converge: {', '.join(stuck)}")
    lost = []
    for f in hypotheses.rank():
        if not math.isfinite(f.objective):
            rows = np.flatnonzero(~np.isfinite(f.residual))
            first = f", the first in {hypotheses.kind.rows.series[int(rows[0])]}" if len(rows) else ""
            lost.append(f"{f.name} (no finite number for {len(rows)} of {len(f.residual)}{first})")
    if lost:
        warnings.append(f"not judged, as not computable: {', '.join(lost)}")
    extensions = []
    if final.candidates:
        for f in hypotheses.find_extensions(final):
            odds = min(hypotheses.odds(f, final), 1000.0)  # more needs no figure
            share = f"{odds:.0f} : 1" if odds >= 1.5 else f"1 : {1 / odds:.0f}"
            extensions.append(
                f"{'+'.join(c.identifier for c in f.candidates if c.identifier not in final.identifiers)} ({share})"
            )
    if extensions:
        warnings.append(
            f"in addition to {final.name} not ruled out, with odds: {', '.join(extensions)}; they change its values "
            "(see Hypotheses)"
        )
    return warnings


def averaged_variance(hypotheses: Hypotheses, final: Fit) -> Array:
    """Variance of the effects' coordinates about the final fit, averaged over it and what joins its class with it.

    Hoeting et al. (1999), Statistical Science 14, 382-417: sum of w (variance + squared difference), w the posterior.
    """
    larger = hypotheses.find_likelier_extensions(final)
    # the odds of a fit that failed are endless
    weights = np.minimum([1.0, *(hypotheses.odds(f, final) for f in larger)], 1e300)
    total = np.zeros(len(final.theta))
    for weight, f in zip(weights / weights.sum(), (final, *larger), strict=True):
        for c in final.candidates:
            columns = final.columns(c)
            columns_in_f = f.columns(c)
            total[columns] += weight * (
                f.covariance.diagonal()[columns_in_f] + (f.theta[columns_in_f] - final.theta[columns]) ** 2
            )
    return total


def describe_effect(hypothesis: Fit, candidate: Candidate, variance: Array) -> Named:
    """Describe a ``candidate`` with its values and sd in their units; ``variance`` (p,) is of all coordinates."""
    parameters, units = {}, {}
    spread = np.sqrt(variance[hypothesis.columns(candidate)])
    for (u, x), sd in zip(hypothesis.values(candidate), spread, strict=True):
        value = float(u.value(float(x)))
        value_sd = u.slope(float(x)) * float(sd)
        for name, factor in u.factors.items():
            parameters[name] = (factor * value, factor * value_sd)
            units[name] = u.unit
    return Named(
        candidate.identifier,
        parameters,
        units,
        candidate.signature,
        candidate.mistake,
        candidate.title,
        candidate.family,
    )


def _add_marginalised_sizes(kind: Kind, hypothesis: Fit, effect: Named) -> Named:
    """Copy of ``effect`` with sizes that were marginalised, no coordinates of the fit, such as a bias of each run."""
    parameters, units = dict(effect.parameters), dict(effect.units)
    for name, (value, sd, unit) in kind.marginalised_sizes(
        hypothesis.candidates, hypothesis.theta, effect.identifier
    ).items():
        parameters[name] = (value, hypothesis.noise_factor * sd)
        units[name] = unit
    return replace(effect, parameters=parameters, units=units)


# ---------------------------------------------------------------------- what can be distinguished


def similarity(kind: Kind, null: Fit, fits: list[Fit]) -> Array:
    """Cosines of what ``fits`` do to the data, in the metric that is left when the nuisances are marginalised."""
    n = null.jacobian * prior(null.unknowns, ())[1]
    inner = np.eye(n.shape[1]) + n.T @ n
    moves = np.stack([_direction(kind, f) for f in fits])
    projected = moves @ n
    gram = moves @ moves.T - projected @ np.linalg.solve(inner, projected.T)
    size = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
    return np.clip(gram / np.outer(size, size), -1.0, 1.0)


def _direction(kind: Kind, hypothesis: Fit) -> Array:
    """Change of the whitened residuals (n,) by the effects of a ``hypothesis``, its nuisances held."""
    null_residual, _ = kind.residual((), hypothesis.theta[: hypothesis.effect_columns.start])
    change = null_residual - hypothesis.residual
    if float(change @ change) > 1e-6:
        return np.asarray(change)
    scale = np.array([u.scale * u.size for u in hypothesis.unknowns[hypothesis.effect_columns]])
    return np.asarray(-hypothesis.jacobian[:, hypothesis.effect_columns] @ scale)


def equivalents(hypotheses: Hypotheses, leader: Fit) -> dict[Fit, Reason]:
    """Leader and the hypotheses with as many effects that the data cannot distinguish from it, each with its reason."""
    peers = [f for f in hypotheses.rank(len(leader.candidates)) if f is not leader and f.admissible]
    close_objective = leader.objective + RULES.as_much
    peers = [f for f in peers if hypotheses.odds(leader, f) < RULES.hopeless_odds or f.objective < close_objective]
    cosines = similarity(hypotheses.kind, hypotheses.null, [leader, *peers])[0, 1:]
    first = all(hypotheses.odds(f, leader) <= 1 for f in (hypotheses.null, *hypotheses.fits) if f is not leader)
    members = {leader: Reason("leads" if first else "search ended")}
    for f, cosine in zip(peers, cosines, strict=True):
        odds = hypotheses.odds(leader, f)
        unusual = f", of a rare size ({', '.join(f.sizes_beyond_usual())})" if f.sizes_beyond_usual() else ""
        if odds < 1:
            members[f] = Reason("ahead", odds=hypotheses.odds(f, leader), why=reason_against(hypotheses, f, leader))
        elif odds < RULES.clear_odds:
            members[f] = Reason("close", odds=odds, unusual=unusual)
        elif cosine > RULES.alike_cosine and (f.physical or not leader.physical) and not _has_unneeded_size(f):
            members[f] = Reason("alike", cosine=cosine, odds=odds, unusual=unusual)
    return members


def _has_unneeded_size(f: Fit) -> bool:
    """True if an effect of several sizes has one within 1 sd of a bound: the data ask for no such size."""
    for candidate in f.candidates:
        place = f.columns(candidate).start
        sizes = [k for k, u in enumerate(candidate.unknowns) if u.size]
        if len(sizes) > 1:
            for k in sizes:
                u, x = candidate.unknowns[k], float(f.theta[place + k])
                if min(x - u.lowest, u.highest - x) < np.sqrt(f.covariance[place + k, place + k]):
                    return True
    return False


def rank_measurements(kind: Kind, members: list[Fit]) -> list[Separation]:
    """Measurements that ``kind`` proposes and that separate the first of ``members`` from the others, best first."""
    separations = []
    for proposal in kind.propose_measurements():
        predicted = [_predict(proposal, f) for f in members]
        if not all(np.isfinite(p).all() and np.isfinite(s).all() for p, s in predicted):
            continue
        (leader_values, leader_spread), *rivals = predicted
        gains = [
            _distance(leader_values - rival_values, np.hstack([leader_spread, rival_spread]) / np.sqrt(2))
            for rival_values, rival_spread in rivals
        ]
        separations.append(Separation(proposal.what, min(gains)))
    return sorted([*separations, *_bench_tests(members)], key=lambda s: -s.gain)


def _predict(proposal: Proposal, f: Fit) -> tuple[Array, Array]:
    """Prediction of ``f`` for a ``proposal`` (m,), and what 1 sd of all that its data leave open does to it (m, k)."""
    mean, slope = proposal.predict_white(f.candidates, f.theta)
    if not (np.isfinite(mean).all() and np.isfinite(slope).all()):
        return mean, slope
    inner = proposal.inner and proposal.inner(f.candidates, f.theta)
    values, vectors = np.linalg.eigh((f.covariance + f.covariance.T) / 2)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return mean, slope @ root if inner is None else np.hstack([(slope + inner[0]) @ root, inner[1]])


def _distance(change: Array, spread: Array) -> float:
    """Root of d' (1 + S S')^-1 d: d the ``change`` (m,) in sd of noise, S the ``spread`` (m, k) of it by 1 sd."""
    projected = spread.T @ change
    remainder = change - spread @ np.linalg.solve(np.eye(len(projected)) + spread.T @ spread, projected)
    return float(np.sqrt(max(0.0, float(change @ remainder))))


def _bench_tests(members: list[Fit]) -> list[Separation]:
    """The size of an effect or measurement error that one member has and the others have not, measured separately."""
    separations = []
    for f in members:
        for candidate in f.candidates:
            u = next((u for u in candidate.unknowns if u.size), None)
            if u is None or any(candidate.identifier in rival.identifiers for rival in members if rival is not f):
                continue
            column = f.columns(candidate).start + candidate.unknowns.index(u)
            sd = np.hypot(RULES.bench_sd * u.scale, np.sqrt(f.covariance[column, column]))
            gain = float(abs(f.theta[column] - u.centre) / sd)
            size = u.name if u.unit == "1" else f"{u.name}, {u.unit}"
            measurement = f"{candidate.title or candidate.identifier}, measured separately ({size})"
            separations.append(Separation(measurement, gain))
    return separations
