"""The engine: from a forward model to a verdict. It knows neither bicycles nor rigs."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.inference.arrays import Array
from studies.inference.checks import HeldOut, goodness_of_fit, held_out, whiteness, with_wider_nuisances
from studies.inference.evidence import BEAM, CLEAR_ODDS, MOST_EFFECTS, Advance, Hypotheses, expand, singles
from studies.inference.fit import Fit, fit
from studies.inference.forward import Forward
from studies.inference.identifiability import equivalents, separating, similarity
from studies.inference.parameter import Candidate
from studies.inference.verdict import Check, Named, Verdict

NOTHING = 0.05
POOR_FIT = 0.01
PARTIAL_SHARE = 0.5  # of the nuisance-only held-out gap that a partial name must close
NEGLIGIBLE = 1e-3  # posterior of a pair that is not worth a line
PARTIAL_REST = 2.0  # held-out gap (in sd) beyond which a name would be a guess
MANY = 1000.0  # odds that need no figure
LIKELIER = 3.0  # odds beyond which a hypothesis with one effect more than the leader joins its class, though not clear
LEADERS = 6  # that are refitted with wider nuisances


@dataclass(frozen=True)
class Subject:
    """What is diagnosed, for the report."""

    name: str
    description: str = ""
    source: str = ""


@dataclass(frozen=True)
class Diagnosis:
    """A verdict with everything a report shows."""

    subject: Subject
    forward: Forward
    verdict: Verdict
    hypotheses: Hypotheses
    final: Fit
    nominal: Array  # whitened residual of the base model as it stands
    held_out: dict[str, HeldOut]
    similar: tuple[tuple[str, ...], Array]
    model: Any = None  # the base model with what was named, where it is a bicycle's


def judge(forward: Forward, subject: Subject, *, progress: bool = False) -> Diagnosis:
    """Search, accept or refuse, and say what was found; a progress bar on standard error if asked for."""
    from tyre.base.progress import progress_bar

    with progress_bar(desc="diagnose", unit=" fits", show=progress, leave=False) as bar:

        def advance(what: str) -> None:
            bar.set_postfix_str(what, refresh=False)
            bar.update()

        known = singles(forward, advance)
        better = forward.refined(known.best()[0] if known.fits else known.null)
        if better is not forward:
            forward = better
            known = singles(forward, advance)
        known, leader = _search(forward, known, advance)
        accepted = _accept(forward, known, leader, advance)
    return _complete(forward, subject, *accepted)


def _search(forward: Forward, known: Hypotheses, advance: Advance) -> tuple[Hypotheses, Fit | None]:
    """The best hypothesis, enlarged by one effect at a time as long as evidence and held-out score clearly gain."""
    if not known.fits or known.nothing >= NOTHING:
        return known, None
    leader = _physical(known.best(1))[0]
    for _ in range(MOST_EFFECTS - 1):
        size = len(leader.candidates)
        known = expand(forward, known, _physical(known.best(size))[:BEAM], advance)
        larger = [f for f in known.best(size + 1) if f.physical]
        if not larger or known.odds(larger[0], leader) < CLEAR_ODDS:
            break
        if held_out(forward, larger[0]).log_score <= held_out(forward, leader).log_score:
            break
        leader = larger[0]
    return known, leader


def _physical(fits: list[Fit]) -> list[Fit]:
    """Those inside their bounds and of a size that occurs; all where none is."""
    return [f for f in fits if f.physical] or fits


Judged = tuple[Hypotheses, Fit, str, list[Fit], list[Check], dict[str, HeldOut], list[tuple[str, float, float]]]


def _accept(forward: Forward, known: Hypotheses, leader: Fit | None, advance: Advance) -> Judged:
    null = known.null
    scores = {"nuisance_only": held_out(forward, null)}
    null_good = goodness_of_fit(forward, null) > POOR_FIT
    checks: list[Check] = []
    if leader is None:
        checks.append(Check("P(nothing is missing) < 0.05", f"{known.nothing:.3g}", False))
        verdict = "none" if null_good else "unknown"
        return known, null, verdict, [], checks, scores, [] if null_good else _mimics(forward, null)
    members = equivalents(forward, known, leader)
    members += _likelier(known, leader)[:1]
    scores["final"] = held_out(forward, leader)
    peers = list(dict.fromkeys([*members, *known.best(len(leader.candidates))[:LEADERS]]))
    wide = with_wider_nuisances(forward, known, peers)
    shaky = [f.name for f in wide.best() if wide.odds(wide.best()[0], f) < CLEAR_ODDS and f.physical]
    members += [f for f in peers if f.name in shaky and f not in members]  # the name must not hang on the priors
    then = wide.best()[0].name
    gain = scores["final"].log_score - scores["nuisance_only"].log_score
    p, white = goodness_of_fit(forward, leader), whiteness(forward, leader.residual)
    bounds = leader.at_bound()
    vital = [
        Check("P(nothing is missing) < 0.05", f"{known.nothing:.3g}", known.nothing < NOTHING),
        Check(
            "held-out log score improves", f"{gain:+.1f}" if scores["final"].possible else "one run: none to hold out",
            gain > 0,
        ),
        Check(
            "survives doubling the uncertainty of the parameters", f"P(nothing) {wide.nothing:.3g}, then {then}",
            wide.nothing < NOTHING,
        ),
        Check("inside its bounds, physical sign", ", ".join(bounds) or "yes", not bounds),
        Check("a size that occurs", ", ".join(leader.implausible()) or "yes", not leader.implausible()),
    ]  # fmt: skip
    fitting = [
        Check("goodness of fit p > 0.01", f"{p:.3g}", p > POOR_FIT),
        Check("residuals white, p > 0.01", f"{white:.3g}", white > POOR_FIT),
    ]
    checks = [*vital, *fitting]
    if all(c.passed for c in checks):
        return known, leader, "named" if len(members) == 1 else "class", members, checks, scores, []
    closes = _gap(scores["final"]) <= min(PARTIAL_SHARE * _gap(scores["nuisance_only"]), PARTIAL_REST)
    if all(c.passed for c in vital) and closes:
        return known, leader, "partial", members, checks, scores, _mimics(forward, leader)
    scores.pop("final")
    verdict = "none" if null_good else "unknown"
    return known, null, verdict, [], checks, scores, [] if null_good else _mimics(forward, null)


def _gap(score: HeldOut) -> float:
    return float(np.sqrt(max(0.0, score.chi2 / len(score.residual) - 1)))


def _mimics(forward: Forward, found: Fit) -> list[tuple[str, float, float]]:
    """Phenomenological terms that would lower chi^2 by a tenth or more, best first."""
    result = []
    for term in forward.phenomenological():
        if not forward.compatible((*found.candidates, term)):
            continue
        trial = fit(forward, (*found.candidates, term), starts=[np.concatenate([found.theta, term.starts[0]])])
        if trial.objective < 0.9 * found.objective:
            u = term.unknowns[0]
            result.append((f"{term.identifier} ({u.unit})", float(trial.theta[-1]), trial.chi2))
    return sorted(result, key=lambda r: r[2])[:5]


def _complete(
    forward: Forward, subject: Subject, known: Hypotheses, final: Fit, verdict: str, members: list[Fit],
    checks: list[Check], scores: dict[str, HeldOut], mimics: list[tuple[str, float, float]],
) -> Diagnosis:  # fmt: skip
    nominal, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]))
    n = len(nominal)
    scores.setdefault("final", scores["nuisance_only"])
    scale = _gap(HeldOut(0.0, nominal))
    gaps = {name: (_gap(s) / scale if scale > 0 and s.possible else None) for name, s in scores.items()}
    shares: dict[str, float] = {}
    for where, r in zip(forward.rows.where, final.residual, strict=True):
        shares[where] = shares.get(where, 0.0) + float(r**2) / max(final.chi2, 1e-300)
    fits = _physical(known.best(1))[:10]
    warnings = list(forward.notes)
    if scale == 0:
        warnings.append("the nominal model has no gap beyond the noise: there is nothing to close")
    if not scores["final"].possible:
        warnings.append("one run: nothing can be held out, so nothing is named; record further runs or speeds")
    if verdict == "unknown":
        warnings.append("something is missing that the library does not explain")
    larger = known.larger(final) if final.candidates else []
    if larger:
        warnings.append(_beside(known, final, larger))
    variance = _widened(known, final)
    result = Verdict(
        verdict=verdict,
        effects=tuple(named(final, c, variance) for c in final.candidates),
        equivalent=tuple(f.name for f in members),
        posterior={name: p for name, p in known.posterior.items() if p > NEGLIGIBLE or "+" not in name},
        chi2={"n": n, "nominal": float(nominal @ nominal), "nuisance_only": known.null.chi2, "final": final.chi2},
        held_out_gap={"nominal": 1.0 if scale > 0 else None, **gaps},
        worst=tuple(sorted(shares.items(), key=lambda item: -item[1])[:5]),
        separating_measurements=tuple(separating(forward, members)) if len(members) > 1 else (),
        goodness_of_fit_p=goodness_of_fit(forward, final),
        checks=tuple(checks), mimics=tuple(mimics), refused=forward.refused, warnings=tuple(warnings),
    )  # fmt: skip
    alike = similarity(forward, known.null, fits) if fits else np.zeros((0, 0))
    return Diagnosis(
        subject, forward, result, known, final, nominal, scores, (tuple(f.name for f in fits), alike)
    )  # fmt: skip


def _beside(known: Hypotheses, final: Fit, larger: list[Fit]) -> str:
    """What more cannot be ruled out, in words."""
    own = {c.identifier for c in final.candidates}
    told = []
    for f in larger:
        odds = known.odds(f, final)
        share = f"{odds:.0f} : 1" if odds >= 1.5 else f"1 : {1 / odds:.0f}"
        more = "+".join(c.identifier for c in f.candidates if c.identifier not in own)
        told.append(f"{more} ({share if odds < MANY else f'over {MANY:.0f} : 1'})")
    return (
        f"beside {final.name} cannot be ruled out, with odds: {', '.join(told)}; its numbers would change, see the "
        "hypotheses that were tried"
    )


def _likelier(known: Hypotheses, leader: Fit) -> list[Fit]:
    return [f for f in known.larger(leader) if known.odds(f, leader) > LIKELIER]


def _widened(known: Hypotheses, final: Fit) -> Array:
    """Variance of the effects' coordinates about the final fit, averaged over it and what joins its class with it.

    Hoeting et al. (1999), Statistical Science 14, 382-417: sum of w (variance + squared difference), w the posterior.
    """
    larger = _likelier(known, final)
    weights = np.array([1.0, *(known.odds(f, final) for f in larger)])
    total = np.zeros(len(final.theta))
    for weight, f in zip(weights / weights.sum(), (final, *larger), strict=True):
        for c in final.candidates:
            own, there = final.columns(c), f.columns(c)
            total[own] += weight * (f.covariance.diagonal()[there] + (f.theta[there] - final.theta[own]) ** 2)
    return total


def named(found: Fit, candidate: Candidate, variance: Array) -> Named:
    """A candidate with its fitted values and sd from the variance (p,), each wheel by itself where they differ."""
    columns = found.columns(candidate)
    parameters = {}
    for i, u in zip(range(columns.start, columns.stop), found.unknowns[columns], strict=True):
        x, sd = float(found.theta[i]), float(np.sqrt(variance[i]))
        value, spread = float(u.value(np.asarray(x))), u.slope(x) * sd
        if len(set(u.sets.values())) <= 1:
            parameters[u.name] = (value, spread)
        else:
            for key, factor in u.sets.items():
                parameters[f"{u.name}.{key.rsplit('.', 1)[-1]}"] = (float(factor) * value, float(factor) * spread)
    return Named(candidate.identifier, parameters)
