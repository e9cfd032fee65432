"""Whether the leading hypothesis is named: the rules that must hold, and what is said where they do not."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from studies.inference.attempts import POOR_FIT
from studies.inference.checks import (
    HeldOut,
    goodness_of_fit,
    held_out,
    left_over,
    whiteness,
    with_wider_nuisances,
    within_uncertainty,
)
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit, fit
from studies.inference.forward import Forward
from studies.inference.held_back import held_back
from studies.inference.identifiability import MORE_PROBABLE, MOST_PROBABLE, equivalents
from studies.inference.search import MANY, NOTHING, beats_nothing
from studies.inference.verdict import AcceptanceCheck, Mimic, Verdict

PARTIAL_SHARE = 0.5  # of the nuisance-only held-out gap that a partial name must close
PARTIAL_REST = 2.0  # held-out gap (in sd) beyond which a name would be a guess
FAR = 1e-4  # p of the fit below which partial names come mostly from causes that the library lacks (blind test)
FAR_SHARE = 0.1  # of the nuisance-only held-out gap that it may leave then
LIKELIER_ODDS = 3.0  # beyond which a hypothesis with one effect more than the leader joins its class, though not clear
EVEN = 0.5  # P(nothing is missing) above which a poor fit of nothing alone names nothing
MOST_LEADERS = 6  # that are refitted with wider nuisances
MOST_MIMICS = 5
LEFT_OVER = "nothing left for terms without a cause, p > 0.01"
MIMIC_SHARE = 0.9  # of the objective that a term must leave at most
OPEN = ("unknown", "partial")
"""Verdicts that leave a significant gap. A tentative one may leave more than noise, see :func:`leaves_more`."""


@dataclass(frozen=True, eq=False)
class Acceptance:
    """What was decided about the leading hypothesis, and on what grounds.

    Attributes
    ----------
    verdict : str
        As :class:`studies.inference.verdict.Verdict`.
    final : Fit
        The leader where it is named, else the null.
    held_out : mapping
        ``nuisance_only`` and ``final``.
    leader : Fit, optional
        What was judged, named or not.
    members : tuple of Fit
        What cannot be told from the leader, itself first; empty where nothing is named.
    reasons : mapping
        Name of a member -> why it cannot be told from the leader.
    reservations : tuple of str
        On what a tentative name rests.
    checks : tuple of AcceptanceCheck
    mimics : tuple of Mimic
        Phenomenological terms that would lower chi^2, where something remains unexplained.
    """

    verdict: str
    final: Fit
    held_out: Mapping[str, HeldOut]
    leader: Fit | None = None
    members: tuple[Fit, ...] = ()
    reasons: Mapping[str, str] = field(default_factory=dict)
    reservations: tuple[str, ...] = ()
    checks: tuple[AcceptanceCheck, ...] = ()
    mimics: tuple[Mimic, ...] = ()


@dataclass(frozen=True, eq=False)
class _Leader:
    """The leading hypothesis with the figures that its checks need."""

    fit: Fit
    score: HeldOut
    members: dict[Fit, str]  # with the reason of each
    wide: Hypotheses  # with wider nuisances


def accept(forward: Forward, known: Hypotheses, leader: Fit | None) -> Acceptance:
    """Name the leader if all rules hold.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    leader : Fit, optional
        None where nothing is more probable than anything.
    """
    null_score = held_out(forward, known.null)
    if leader is None:
        check = AcceptanceCheck("P(nothing is missing) < 0.05", f"{known.nothing:.3g}", False)
        if known.nothing >= EVEN or not known.fits:
            return _nothing_named(forward, known, null_score, (check,))
        leader = max(known.fits, key=lambda f: (f.admissible, known.log_posterior(f)))
    led = _studied(forward, known, leader)
    vital = _vital(forward, led)
    reserved = (*_reserved(known, led, null_score), *_each_alone(forward, known, led, null_score))
    fitting, unreserved = _fitting(forward, leader), (_within(leader), *_left_over(forward, leader))
    checks = (*vital, *reserved, *unreserved, *fitting)
    scores = {"nuisance_only": null_score, "final": led.score}
    members, explains = tuple(led.members), all(c.passed for c in (*vital, *fitting))
    reasons = {f.name: why for f, why in led.members.items()}
    doubts = tuple(f"{c.what}: {c.figure}" for c in (*reserved, *unreserved) if not c.passed)
    if explains and not doubts:
        word = "named" if len(members) == 1 else "class"
        return Acceptance(word, leader, scores, leader, members, reasons, (), checks)
    unlikely = led.score.log_score <= null_score.log_score or known.nothing >= NOTHING
    if explains and not (unlikely and goodness_of_fit(forward, known.null) > POOR_FIT):
        return Acceptance("tentative", leader, scores, leader, members, reasons, doubts, checks)
    if all(c.passed for c in (*vital, *reserved)) and _closes(goodness_of_fit(forward, leader), led.score, null_score):
        rest = mimics(forward, leader)
        return Acceptance("partial", leader, scores, leader, members, reasons, (), checks, rest)
    return _nothing_named(forward, known, null_score, checks, leader)


def leaves_more(verdict: Verdict) -> bool:
    """Whether a ``verdict`` leaves more than noise: a significant gap or, where a name is tentative, what terms without
    a cause would still explain.
    """
    left = any(c.what == LEFT_OVER and not c.passed for c in verdict.checks)
    return verdict.verdict in OPEN or (verdict.verdict == "tentative" and left)


def _closes(p: float, score: HeldOut, null_score: HeldOut) -> bool:
    """Whether enough of the gap is closed for a name beside a rest: half of it, nine tenths where the fit is poor."""
    share = PARTIAL_SHARE if p >= FAR else FAR_SHARE
    return score.gap <= min(share * null_score.gap, PARTIAL_REST)


def likelier(known: Hypotheses, hypothesis: Fit) -> list[Fit]:
    """Larger fits among ``known`` that are more probable than ``hypothesis``, though not clearly."""
    return [f for f in known.larger(hypothesis) if known.odds(f, hypothesis) > LIKELIER_ODDS]


def mimics(forward: Forward, hypothesis: Fit) -> tuple[Mimic, ...]:
    """Terms without a cause of ``forward`` that lower the objective of ``hypothesis`` by a tenth, best first."""
    terms = []
    for term in forward.phenomenological():
        if not forward.compatible((*hypothesis.candidates, term)):
            continue
        start = np.concatenate([hypothesis.theta, term.starts[0]])
        trial = fit(forward, (*hypothesis.candidates, term), starts=[start])
        if trial.objective < MIMIC_SHARE * hypothesis.objective and trial.chi2 < hypothesis.chi2:
            u = term.unknowns[0]
            terms.append(Mimic(f"{term.identifier} ({u.unit})", float(trial.theta[-1]), trial.chi2))
    return tuple(sorted(terms, key=lambda mimic: mimic.chi2)[:MOST_MIMICS])


def _nothing_named(
    forward: Forward, known: Hypotheses, score: HeldOut, checks: tuple[AcceptanceCheck, ...], leader: Fit | None = None
) -> Acceptance:
    scores = {"nuisance_only": score, "final": score}
    if goodness_of_fit(forward, known.null) > POOR_FIT:
        return Acceptance("none", known.null, scores, leader, checks=checks)
    return Acceptance("unknown", known.null, scores, leader, checks=checks, mimics=mimics(forward, known.null))


def _studied(forward: Forward, known: Hypotheses, leader: Fit) -> _Leader:
    members = equivalents(forward, known, leader)
    members[leader] += _among(known, leader) if members[leader].startswith(MOST_PROBABLE) else ""
    for f in likelier(known, leader)[:1]:
        odds = known.odds(f, leader)
        members[f] = f"one effect more, odds {odds:.0f} : 1 for it: too few to add it"
        if odds > CLEAR_ODDS:
            why = held_back(forward, known, f, leader)
            members[f] = f"{MORE_PROBABLE} than what leads ({odds:.2g} : 1), of one effect more, but {why}"
    peers = list(dict.fromkeys([*members, *known.best(len(leader.candidates))[:MOST_LEADERS]]))
    wide = with_wider_nuisances(forward, known, [f for f in peers if f.converged or f is leader])
    best = wide.best()[0]
    for f in wide.best() if wide.nothing < NOTHING else ():  # else the reservation says it
        own = known.find(f.identifiers)
        if own is not None and own not in members and f.physical and wide.odds(best, f) < CLEAR_ODDS:
            odds = wide.odds(best, f)  # no name may hang on the priors
            members[own] = "with doubled uncertainty of the parameters " + (
                "it is the most probable" if f is best else f"the odds against it are {odds:.0f} : 1"
            )
    return _Leader(leader, held_out(forward, leader), members, wide)


def _among(known: Hypotheses, leader: Fit) -> str:
    """Among which hypotheses a leader is the most probable, where not among all."""
    ahead = [f for f in (known.null, *known.fits) if known.odds(f, leader) > 1 and f is not leader]
    effects = len(leader.candidates)
    if any(len(f.candidates) != effects for f in ahead):
        return f" of those with {effects} effect{'s' if effects > 1 else ''}"
    return " of those that may be named" if any(not f.admissible for f in ahead) else ""


def _vital(forward: Forward, led: _Leader) -> tuple[AcceptanceCheck, ...]:
    """What must hold for any name."""
    bounds, small, unusual = led.fit.at_bound(), led.fit.negligible(), led.fit.unusual
    return (
        AcceptanceCheck("two speeds, loads or inputs", "yes" if forward.varied else "one", forward.varied),
        AcceptanceCheck("the fit converged", "yes" if led.fit.converged else "no", led.fit.converged),
        AcceptanceCheck("inside its bounds, physical sign", ", ".join(bounds) or "yes", not bounds),
        AcceptanceCheck("large enough to matter", ", ".join(small) or "yes", not small),
        AcceptanceCheck("at most one of a size that seldom occurs", f"{unusual}", unusual < 2),
    )


def _reserved(known: Hypotheses, led: _Leader, null_score: HeldOut) -> tuple[AcceptanceCheck, ...]:
    """What must hold for a name without reservation."""
    gain = led.score.log_score - null_score.log_score
    sizes, wide = led.fit.implausible(), led.wide
    doubled = f"P(nothing) {wide.nothing:.3g}, then {wide.best()[0].name}"
    return (
        AcceptanceCheck("P(nothing is missing) < 0.05", f"{known.nothing:.3g}", known.nothing < NOTHING),
        AcceptanceCheck(
            "held-out log score improves", f"{gain:+.1f}" if led.score.possible else "one run: none to hold out",
            gain > 0,
        ),
        AcceptanceCheck("survives doubling the uncertainty of the parameters", doubled, wide.nothing < NOTHING),
        AcceptanceCheck("a size that occurs", ", ".join(sizes) or "yes", not sizes),
    )  # fmt: skip


def _each_alone(forward: Forward, known: Hypotheses, led: _Leader, null_score: HeldOut) -> tuple[AcceptanceCheck, ...]:
    """Three effects at once fit much: each must also beat nothing by itself, in odds and on held-out data."""
    if len(led.fit.candidates) < MANY:
        return ()
    nothing = null_score.log_score
    weak = [c.identifier for c in led.fit.candidates if not beats_nothing(forward, known, c, nothing)]
    return (
        AcceptanceCheck("each of three effects stands alone", f"not {', '.join(weak)}" if weak else "yes", not weak),
    )


def _within(leader: Fit) -> AcceptanceCheck:
    """Must hold for a name without reservation, and not for a partial one: else the bicycle may be another one."""
    p = within_uncertainty(leader)
    return AcceptanceCheck("parameters within their uncertainty, p > 0.01", f"{p:.2g}", p > POOR_FIT)


def _left_over(forward: Forward, leader: Fit) -> tuple[AcceptanceCheck, ...]:
    """Likewise: else it may be something like the leader that is missing."""
    rough = [c.identifier for c in leader.candidates if c.approximate]
    if rough:
        return (AcceptanceCheck(LEFT_OVER, f"not asked: {' and '.join(rough)} is modelled roughly", True),)
    left = left_over(forward, leader)
    if left is None:
        return ()
    p, most = left
    return (AcceptanceCheck(LEFT_OVER, f"{p:.2g}" + ("" if p > POOR_FIT else f", mostly {most}"), p > POOR_FIT),)


def _fitting(forward: Forward, leader: Fit) -> tuple[AcceptanceCheck, ...]:
    p, white = goodness_of_fit(forward, leader), whiteness(forward, leader)
    return (
        AcceptanceCheck("goodness of fit p > 0.01", f"{p:.3g}", p > POOR_FIT),
        AcceptanceCheck("residuals white, p > 0.01", f"{white:.3g}", white > POOR_FIT),
    )
