"""Whether the leading hypothesis is named: the rules that must hold, and what is said where they do not."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from studies.inference.checks import HeldOut, goodness_of_fit, held_out, whiteness, with_wider_nuisances
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit, fit
from studies.inference.forward import Forward
from studies.inference.identifiability import equivalents
from studies.inference.verdict import AcceptanceCheck, Mimic

NOTHING = 0.05  # P(nothing is missing) above which nothing is named
POOR_FIT = 0.01  # p below which a model does not fit
PARTIAL_SHARE = 0.5  # of the nuisance-only held-out gap that a partial name must close
PARTIAL_REST = 2.0  # held-out gap (in sd) beyond which a name would be a guess
LIKELIER_ODDS = 3.0  # beyond which a hypothesis with one effect more than the leader joins its class, though not clear
MOST_LEADERS = 6  # that are refitted with wider nuisances
MOST_MIMICS = 5
MIMIC_SHARE = 0.9  # of the objective that a term must leave at most


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
    members : tuple of Fit
        What cannot be told from the leader, itself first; empty where nothing is named.
    checks : tuple of AcceptanceCheck
    mimics : tuple of Mimic
        Phenomenological terms that would lower chi^2, where something remains unexplained.
    """

    verdict: str
    final: Fit
    held_out: Mapping[str, HeldOut]
    members: tuple[Fit, ...] = ()
    checks: tuple[AcceptanceCheck, ...] = ()
    mimics: tuple[Mimic, ...] = ()


@dataclass(frozen=True, eq=False)
class _Leader:
    """The leading hypothesis with the figures that its checks need."""

    fit: Fit
    score: HeldOut
    members: tuple[Fit, ...]
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
        return _nothing_named(forward, known, null_score, (check,))
    led = _studied(forward, known, leader)
    vital, fitting = _vital(known, led, null_score), _fitting(forward, leader)
    checks = (*vital, *fitting)
    scores = {"nuisance_only": null_score, "final": led.score}
    if all(c.passed for c in checks):
        return Acceptance("named" if len(led.members) == 1 else "class", leader, scores, led.members, checks)
    closes = led.score.gap <= min(PARTIAL_SHARE * null_score.gap, PARTIAL_REST)
    if all(c.passed for c in vital) and closes:
        return Acceptance("partial", leader, scores, led.members, checks, mimics(forward, leader))
    return _nothing_named(forward, known, null_score, checks)


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
        if trial.objective < MIMIC_SHARE * hypothesis.objective:
            u = term.unknowns[0]
            terms.append(Mimic(f"{term.identifier} ({u.unit})", float(trial.theta[-1]), trial.chi2))
    return tuple(sorted(terms, key=lambda mimic: mimic.chi2)[:MOST_MIMICS])


def _nothing_named(
    forward: Forward, known: Hypotheses, score: HeldOut, checks: tuple[AcceptanceCheck, ...]
) -> Acceptance:
    scores = {"nuisance_only": score, "final": score}
    if goodness_of_fit(forward, known.null) > POOR_FIT:
        return Acceptance("none", known.null, scores, checks=checks)
    return Acceptance("unknown", known.null, scores, checks=checks, mimics=mimics(forward, known.null))


def _studied(forward: Forward, known: Hypotheses, leader: Fit) -> _Leader:
    members = equivalents(forward, known, leader)
    members += likelier(known, leader)[:1]
    peers = list(dict.fromkeys([*members, *known.best(len(leader.candidates))[:MOST_LEADERS]]))
    wide = with_wider_nuisances(forward, known, peers)
    first = wide.best()[0]
    shaky = [f.identifiers for f in wide.best() if wide.odds(first, f) < CLEAR_ODDS and f.physical]
    members += [f for f in peers if f.identifiers in shaky and f not in members]  # no name may hang on the priors
    return _Leader(leader, held_out(forward, leader), tuple(members), wide)


def _vital(known: Hypotheses, led: _Leader, null_score: HeldOut) -> tuple[AcceptanceCheck, ...]:
    """What must hold for a name, a partial one too."""
    gain = led.score.log_score - null_score.log_score
    bounds, sizes, wide = led.fit.at_bound(), led.fit.implausible(), led.wide
    return (
        AcceptanceCheck("P(nothing is missing) < 0.05", f"{known.nothing:.3g}", known.nothing < NOTHING),
        AcceptanceCheck(
            "held-out log score improves", f"{gain:+.1f}" if led.score.possible else "one run: none to hold out",
            gain > 0,
        ),
        AcceptanceCheck(
            "survives doubling the uncertainty of the parameters",
            f"P(nothing) {wide.nothing:.3g}, then {wide.best()[0].name}", wide.nothing < NOTHING,
        ),
        AcceptanceCheck("inside its bounds, physical sign", ", ".join(bounds) or "yes", not bounds),
        AcceptanceCheck("a size that occurs", ", ".join(sizes) or "yes", not sizes),
    )  # fmt: skip


def _fitting(forward: Forward, leader: Fit) -> tuple[AcceptanceCheck, ...]:
    p, white = goodness_of_fit(forward, leader), whiteness(forward, leader.residual)
    return (
        AcceptanceCheck("goodness of fit p > 0.01", f"{p:.3g}", p > POOR_FIT),
        AcceptanceCheck("residuals white, p > 0.01", f"{white:.3g}", white > POOR_FIT),
    )
