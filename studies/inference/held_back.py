"""Why a hypothesis that is more probable than the leader is not in its place: the rule of the search that it fails."""

from collections.abc import Callable

from studies.inference.attempts import POOR_FIT
from studies.inference.checks import HeldOut, goodness_of_fit, held_out, whiteness
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.search import MANY, beats_nothing

Score = Callable[[Fit], HeldOut]
ELSEWHERE = "not where the search ended, which goes from the best with so many effects to one more"


def held_back(forward: Forward, known: Hypotheses, larger: Fit, leader: Fit) -> str:
    """The rule that keeps a ``larger`` hypothesis from the place of a ``leader``, which it may contain.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    larger : Fit
    leader : Fit
    """
    scores: dict[Fit, HeldOut] = {}

    def score(f: Fit) -> HeldOut:
        if f not in scores:
            scores[f] = held_out(forward, f)
        return scores[f]

    if unlikely := of_unusual_size(forward, larger):
        return unlikely
    if leader.identifiers < larger.identifiers:
        if known.odds(larger, leader) <= CLEAR_ODDS:
            return f"not clearly so (above {CLEAR_ODDS:g} : 1)"
        if not score(larger).possible:
            return "of one run nothing can be left out to show a gain"
        if not score(larger).log_score > score(leader).log_score:
            return "the data left out gain nothing by it"
    return _weak(forward, known, larger, score) or ELSEWHERE


def of_unusual_size(forward: Forward, larger: Fit) -> str:
    """That a hypothesis is of sizes that seldom occur, with which it is not preferred; empty where it may be.

    Parameters
    ----------
    forward : Forward
    larger : Fit
    """
    sizes = ", ".join(larger.implausible())
    if not sizes:
        return ""
    if larger.unusual > 1:
        return f"more than one of its sizes seldom occurs ({sizes})"
    rest = "it does not fit" if goodness_of_fit(forward, larger) <= POOR_FIT else ""
    rest = rest or ("what it leaves is not white noise" if whiteness(forward, larger) <= POOR_FIT else "")
    told = f"of a size that seldom occurs ({sizes}), which is named only where it explains the data, and {rest}"
    return f"{told} (p below {POOR_FIT:g})" if rest else ""


def _weak(forward: Forward, known: Hypotheses, larger: Fit, score: Score) -> str:
    """Which of the effects of a hypothesis does not stand, and by which rule; empty where each does."""
    whole = score(larger).log_score
    for c in larger.candidates:
        part = known.find(larger.identifiers - {c.identifier})
        if part is None:
            continue
        odds = known.odds(larger, part)
        if odds < CLEAR_ODDS:
            return f"{c.identifier} does not stand by its own odds ({odds:.2g} : 1; above {CLEAR_ODDS:g} : 1 is clear)"
        if not whole > score(part).log_score:
            return f"the data left out gain nothing by its {c.identifier}"
        if len(larger.candidates) >= MANY and not beats_nothing(forward, known, c, score(known.null).log_score):
            return f"{c.identifier}, one of three effects, is not clearly better than nothing by itself"
    return ""
