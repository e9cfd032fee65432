"""The verdict in numbers and words, from what was decided about the leading hypothesis."""

import math

import numpy as np

from studies.inference.acceptance import Acceptance, likelier
from studies.inference.arrays import Array
from studies.inference.attempts import POOR_FIT
from studies.inference.checks import HeldOut, goodness_of_fit
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.held_back import held_back, of_unusual_size
from studies.inference.identifiability import separating
from studies.inference.parameter import Candidate, UncertainParameter
from studies.inference.sentence import printed, sentence
from studies.inference.verdict import Named, Verdict

NEGLIGIBLE = 1e-3  # posterior of a pair that is not worth a line
MANY_ODDS = 1000.0  # that need no figure
MOST_PLACES = 5  # where the gap is largest


def account(forward: Forward, known: Hypotheses, acceptance: Acceptance, nominal: Array) -> Verdict:
    """The verdict.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    acceptance : Acceptance
    nominal : ndarray, shape (n,)
        Whitened residual of the base model as it stands.
    """
    final = acceptance.final
    scale = HeldOut(0.0, nominal).gap
    gaps = {name: (s.gap / scale if scale > 0 and s.possible else None) for name, s in acceptance.held_out.items()}
    variance = widened(known, final)
    if acceptance.verdict == "partial":  # the misfit counts as noise: Birge (1932), Phys. Rev. 40, 207-227
        variance = variance * max(1.0, final.objective / len(nominal))
    effects = tuple(named(final, c, variance) for c in final.candidates)
    refused = _refused(forward, known, acceptance)
    rules = {name: rule for name, _, rule in refused}
    return Verdict(
        verdict=acceptance.verdict,
        effects=effects,
        equivalent=tuple(f.name for f in acceptance.members),
        posterior={f.name: p for f, p in known.probabilities if p > NEGLIGIBLE or len(f.candidates) < 2},
        chi2={
            "n": len(nominal), "nominal": float(nominal @ nominal), "nuisance_only": known.null.chi2,
            "final": final.chi2, "penalty": final.penalty,
        },
        held_out_gap={"nominal": 1.0 if scale > 0 else None, **gaps},
        worst=_worst(forward, final),
        separating_measurements=(
            tuple(separating(forward, list(acceptance.members))) if len(acceptance.members) > 1 else ()
        ),
        goodness_of_fit_p=goodness_of_fit(forward, final),
        checks=acceptance.checks, mimics=acceptance.mimics, refused=forward.refused,
        warnings=(*forward.notes, *_warnings(forward, known, acceptance, gap=scale > 0)),
        sentence=sentence(forward, known, acceptance, effects, rules), reasons=acceptance.reasons,
        refused_leaders=refused,
    )  # fmt: skip


def _refused(forward: Forward, known: Hypotheses, acceptance: Acceptance) -> tuple[tuple[str, float, str], ...]:
    """Hypotheses more probable than what is named, and the rule that each fails."""
    found, taken = [], acceptance.final
    for f, share in known.probabilities:
        if f is taken:
            break
        found.append((f.name, share, _rule(forward, known, acceptance, f)))
    return tuple(found)


def _rule(forward: Forward, known: Hypotheses, acceptance: Acceptance, f: Fit) -> str:
    if f is not acceptance.leader and f.name in acceptance.reasons:
        return acceptance.reasons[f.name]  # one reason, wherever it is listed
    if f is acceptance.leader:
        failed = [c.what for c in acceptance.checks if not c.passed]
        return f"does not hold: {'; '.join(failed)}"
    if not f.converged:
        return "its fit did not converge: it is not judged"
    if f.at_bound():
        return f"at a bound or of an unphysical sign: {', '.join(f.at_bound())}"
    if f.negligible():
        return f"too small to matter: {', '.join(f.negligible())}"
    if f.implausible() and goodness_of_fit(forward, f) <= POOR_FIT:
        return f"of a size that does not occur ({', '.join(f.implausible())}), and it does not fit"
    if not f.candidates:
        return "nothing is missing, if the data alone decide"
    if not acceptance.final.candidates:
        p, judged = goodness_of_fit(forward, f), acceptance.leader
        if p <= POOR_FIT or judged is None:
            return f"it does not fit (p {printed(p)})"
        if unlikely := of_unusual_size(forward, f):
            return unlikely
        if (odds := known.odds(f, judged)) > 1:
            why = held_back(forward, known, f, judged)
            return f"{odds:.2g} times as probable as {judged.name}, which was judged, but {why}"
        return f"not what was judged: {judged.name} was, which fails a rule"
    if acceptance.final.identifiers < f.identifiers:
        odds = known.odds(f, acceptance.final)
        more = "one effect more" if len(f.candidates) == len(acceptance.final.candidates) + 1 else "more effects"
        if odds <= CLEAR_ODDS:
            return f"{more}, and not clearly more probable ({odds:.2g} : 1)"
        return f"{more}, {odds:.2g} times as probable, but {held_back(forward, known, f, acceptance.final)}"
    return f"more probable, but {held_back(forward, known, f, acceptance.final)}"


def _worst(forward: Forward, final: Fit) -> tuple[tuple[str, float], ...]:
    shares: dict[str, float] = {}
    for where, r in zip(forward.rows.where, final.residual, strict=True):
        shares[where] = shares.get(where, 0.0) + float(r**2) / max(final.chi2, 1e-300)
    return tuple(sorted(shares.items(), key=lambda item: -item[1])[:MOST_PLACES])


def _warnings(forward: Forward, known: Hypotheses, acceptance: Acceptance, *, gap: bool) -> list[str]:
    warnings, final = [], acceptance.final
    if not gap:
        warnings.append("the nominal model has no gap beyond the noise: there is nothing to close")
    if not acceptance.held_out["final"].possible:
        warnings.append("one run: nothing can be held out, so nothing is named; record further runs or speeds")
    if acceptance.verdict == "unknown" and all(goodness_of_fit(forward, f) <= POOR_FIT for f in known.fits):
        warnings.append("something is missing that the library does not explain")
    stuck = [f.name for f in (known.null, *known.best()) if not f.converged and known.posterior[f.name] > NEGLIGIBLE]
    poor = [f"{f.name} ({_fell(forward, f)})" for f in known.best() if not math.isfinite(f.objective)]
    if stuck:
        warnings.append(f"did not converge and are not judged: {', '.join(stuck)}")
    if poor:
        warnings.append(f"could not be computed and are not judged: {', '.join(poor)}")
    larger = known.larger(final) if final.candidates else []
    if larger:
        warnings.append(_beside(known, final, larger))
    return warnings


def _fell(forward: Forward, f: Fit) -> str:
    """Where what a hypothesis predicts is no number."""
    lost = np.flatnonzero(~np.isfinite(f.residual))
    if not len(lost):
        return "its evidence is no finite number"
    first, n = int(lost[0]), len(f.residual)
    return f"no finite number for {len(lost)} of {n}, the first in {forward.rows.series[first]}"


def _beside(known: Hypotheses, final: Fit, larger: list[Fit]) -> str:
    """What more cannot be ruled out, in words."""
    told = []
    for f in larger:
        odds = known.odds(f, final)
        share = f"{odds:.0f} : 1" if odds >= 1.5 else f"1 : {1 / odds:.0f}"
        more = "+".join(c.identifier for c in f.candidates if c.identifier not in final.identifiers)
        told.append(f"{more} ({share if odds < MANY_ODDS else f'over {MANY_ODDS:.0f} : 1'})")
    return (
        f"beside {final.name} cannot be ruled out, with odds: {', '.join(told)}; its numbers would change, see the "
        "hypotheses that were tried"
    )


def widened(known: Hypotheses, final: Fit) -> Array:
    """Variance of the effects' coordinates about the final fit, averaged over it and what joins its class with it.

    Hoeting et al. (1999), Statistical Science 14, 382-417: sum of w (variance + squared difference), w the posterior.
    """
    larger = likelier(known, final)
    weights = np.array([1.0, *(known.odds(f, final) for f in larger)])
    total = np.zeros(len(final.theta))
    for weight, f in zip(weights / weights.sum(), (final, *larger), strict=True):
        for c in final.candidates:
            own, there = final.columns(c), f.columns(c)
            total[own] += weight * (f.covariance.diagonal()[there] + (f.theta[there] - final.theta[own]) ** 2)
    return total


def named(hypothesis: Fit, candidate: Candidate, variance: Array) -> Named:
    """A candidate with its fitted values, each labelled parameter by itself where they differ.

    Parameters
    ----------
    hypothesis : Fit
    candidate : Candidate
        One of its own.
    variance : ndarray, shape (p,)
        Of the coordinates of the fit.
    """
    columns = hypothesis.columns(candidate)
    parameters, units = {}, {}
    for i, u in zip(range(columns.start, columns.stop), hypothesis.unknowns[columns], strict=True):
        x, sd = float(hypothesis.theta[i]), float(np.sqrt(variance[i]))
        value, spread = float(u.value(np.asarray(x))), u.slope(x) * sd
        for name, factor in factors(u).items():
            parameters[name] = (factor * value, factor * spread)
            units[name] = u.unit
    return Named(candidate.identifier, parameters, units, candidate.signature)


def factors(u: UncertainParameter) -> dict[str, float]:
    """Numbers that an unknown is reported as, and their factors on its value: each labelled one where they differ."""
    if len(set(u.sets.values())) <= 1:
        return {u.name: 1.0}
    labels = u.labels or tuple(u.sets)
    return {f"{u.name}.{label}": float(factor) for label, factor in zip(labels, u.sets.values(), strict=True)}
