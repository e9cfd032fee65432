"""Which hypotheses a diagnosis leaves to be told apart; what to measure next is about these, with prices or without."""

from dataclasses import dataclass

from studies.inference.attempts import POOR_FIT
from studies.inference.checks import goodness_of_fit
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit
from studies.inference.identifiability import HOPELESS_ODDS
from studies.inference.judge import Judgement
from studies.inference.search import NOTHING
from studies.missing_effect.reporting.words import explains, number

DOUBLING = "survives doubling"
AGAINST_NOTHING = ("P(nothing", "held-out", DOUBLING, "each of three")  # how rules begin by which it may be nothing
CLEAR = ("named", "none")  # verdicts that leave no hypothesis to be decided on
NO_EFFECT = "that nothing is missing"
ODDS = f"{HOPELESS_ODDS:.0f} : 1"


@dataclass(frozen=True)
class Standing:
    """A verdict that stands, and what comes nearest to it: names in words, and the odds against that."""

    leader: str
    rival: str
    odds: float

    def __str__(self) -> str:
        return f"{self.leader} stands at odds of {number(self.odds, 2)} : 1 against its nearest rival, {self.rival}"


def standing(judgement: Judgement) -> Standing | None:
    """How firmly a ``judgement`` stands, above 20 : 1; None where it is open, or nothing is within 10000 : 1."""
    leading = leading_two(judgement)
    if judgement.verdict.verdict not in CLEAR or len(leading) < 2 or leading[0] is not judgement.final:
        return None
    leader, rival = leading
    odds = judgement.hypotheses.odds(leader, rival)
    name, other = (explains(f) if f.candidates else NO_EFFECT for f in (leader, rival))
    return Standing(name, other, odds) if odds >= CLEAR_ODDS else None


def leading_two(judgement: Judgement) -> tuple[Fit, ...]:
    """What leads and its rival; fewer than two where nothing is to be told apart (:func:`settled` says why).

    A name that is tentative because nothing may be missing is to be told from nothing. Else the rival is the most
    probable hypothesis that could be it: within 10000 : 1, inside its bounds, large enough to matter. Where nothing is
    named, these are the two most probable: that nothing is missing among them, or, where the base model does not fit,
    of those that fit, whatever rule they fail.

    Parameters
    ----------
    judgement : Judgement

    Returns
    -------
    tuple of Fit
        Two, one or, where the verdict is ``unknown`` and nothing fits, none.
    """
    known, final, word = judgement.hypotheses, judgement.final, judgement.verdict.verdict
    able = _able(judgement) if word == "unknown" else [f for f in _ranked(known) if f.admissible]
    if word == "none" and len(able) < 2:
        able = [f for f in _ranked(known) if f.converged]  # data that limit no size leave it open whether there is one
    if word in ("none", "unknown"):
        return tuple(f for f in able[:2] if known.odds(able[0], f) < HOPELESS_ODDS)
    if word == "tentative" and may_be_nothing(judgement):
        return (final, known.null)
    return (final, *[f for f in able if f is not final and known.odds(final, f) < HOPELESS_ODDS][:1])


def may_be_nothing(judgement: Judgement) -> bool:
    """Whether a rule fails by which nothing may be missing instead of what leads."""
    return judgement.hypotheses.nothing >= NOTHING or _fails(judgement, AGAINST_NOTHING)


def doubled(judgement: Judgement) -> bool:
    """Whether it is with doubled uncertainty of the parameters that a tentative name may be nothing."""
    return judgement.verdict.verdict == "tentative" and _fails(judgement, (DOUBLING,))


def _fails(judgement: Judgement, rules: tuple[str, ...]) -> bool:
    return any(c.what.startswith(rules) for c in judgement.verdict.checks if not c.passed)


def settled(judgement: Judgement) -> str:
    """Why no two hypotheses are to be told apart; empty where some are."""
    word, leading = judgement.verdict.verdict, leading_two(judgement)
    if len(judgement.verdict.equivalent) > 1 or len(leading) > 1:
        return ""
    if not leading:
        return (
            "No hypothesis of the library fits, so there are no two to be told apart: look at the gap, the units and "
            "the sensors first."
        )
    who = explains(leading[0])
    if word == "unknown":
        others = len(_able(judgement)) > 1
        alone = f"it has odds above {ODDS} against every other that fits" if others else "no other hypothesis fits"
        return (
            f"There are no two hypotheses to be told apart: {who} would fit, but is not named, and {alone}; see the "
            "rules that do not hold."
        )
    none = f"no other hypothesis inside its bounds and large enough to matter is within odds of {ODDS}"
    limits = "for what could still be there beside it see the upper limits of the report"
    if word in ("named", "none"):
        return f"Nothing is open: {none} of {who}; {limits}."
    return f"There are no two hypotheses to be told apart: {none} of {who}; see the rules that do not hold."


def _ranked(known: Hypotheses) -> list[Fit]:
    """Nothing and all hypotheses, most probable first; all may be too improbable for a number, not for a logarithm."""
    return sorted((known.null, *known.fits), key=lambda f: -known.log_posterior(f))


def _able(judgement: Judgement) -> list[Fit]:
    """Those that fit with sizes that matter, even at a bound."""
    fits = [f for f in _ranked(judgement.hypotheses) if f.converged and not f.negligible()]
    return [f for f in fits if goodness_of_fit(judgement.forward, f) > POOR_FIT]
