"""The rules that a hypothesis must meet before it is named: what each asks, and what is said if it does not hold.

A rule is known by its identifier. Its words stand here only; numbers in them come from :data:`RULES` when they are
printed, so verdict.json, terminal and page always state the limit that was applied.
"""

from dataclasses import dataclass

from studies.inference.rules import RULES


@dataclass(frozen=True)
class Rule:
    """Words of a rule; ``{name}`` in them is a number of :class:`studies.inference.rules.Rules`."""

    question: str  # as verdict.json and the list of rules in the report print it
    complaint: str  # clause of a sentence if the rule is not met; {culprit} is what the check found


ACCEPTANCE_RULES = {
    # any name
    "varied": Rule("two speeds, loads or inputs", "all data are of one speed, load or input"),
    "converged": Rule("the fit converged", "its fit did not converge"),
    "in_bounds": Rule("inside its bounds, physical sign", "at a bound or of an unphysical sign: {culprit}"),
    "matters": Rule("large enough to matter", "too small to matter: {culprit}"),
    "occurs": Rule("no smaller than what occurs", "smaller than on any real bicycle: {culprit}"),
    "beats_terms": Rule("more probable than terms without a cause", "more probable is a {culprit} of no known cause"),
    "one_law": Rule("one law of each error", "{culprit} that follows no law of the library"),
    "exceeds_sd": Rule("larger than its standard deviation", "of a size that its uncertainty exceeds: {culprit}"),
    "one_seldom": Rule("at most one of a size that seldom occurs", "{culprit} effects have sizes that seldom occur"),
    # a partial name too
    "nothing_unlikely": Rule("P(nothing is missing) < {nothing:g}", "possibly nothing is missing"),
    "predicts": Rule("held-out log score improves", "data left out gain nothing by it"),
    "wide_priors": Rule(
        "P(nothing is missing) < {remote:g}, or < {nothing:g} with the uncertainty of the parameters doubled",
        "possibly nothing is missing if the uncertainty of the parameters is doubled",
    ),
    "each_alone": Rule("each of three effects stands alone", "not clearly better than nothing by itself: {culprit}"),
    "usual_size": Rule("a size that occurs", "sizes that seldom occur: {culprit}"),
    # no reservation
    "parameters": Rule(
        "parameters within their uncertainty, p > {poor_fit:g}",
        "the parameters move farther than their uncertainty allows",
    ),
    "nothing_left": Rule(
        "nothing left for terms without a cause, p > {poor_fit:g}", "what it leaves still follows {culprit}"
    ),
    # the fit
    "fits": Rule("goodness of fit p > {poor_fit:g}", "it leaves more than noise"),
    "white": Rule("residuals white, p > {poor_fit:g}", "what it leaves is not white noise"),
}


@dataclass(frozen=True)
class AcceptanceCheck:
    """Answer to one rule about one hypothesis."""

    rule: str  # key of ACCEPTANCE_RULES
    figure: str  # what was found, as the list of rules prints it
    passed: bool  # the rule holds
    culprit: str = ""  # what the complaint names; the figure if empty
    remark: str = ""  # what is said though the rule holds

    @property
    def what(self) -> str:
        """The rule in words, with its limit."""
        return ACCEPTANCE_RULES[self.rule].question.format_map(vars(RULES))

    @property
    def complaint(self) -> str:
        """Words of a sentence that says that the rule is not met."""
        words = vars(RULES) | {"culprit": self.culprit or self.figure}
        return ACCEPTANCE_RULES[self.rule].complaint.format_map(words)
