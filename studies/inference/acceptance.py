"""The rules that a hypothesis must meet before it is named: what each requires, and the clause if it does not hold.

A rule is known by its identifier. Its words are here only; numbers in them come from :data:`RULES` when they are
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
    "varied": Rule("at least two speeds, loads or inputs", "all data are of one speed, load or input"),
    "converged": Rule("the fit converged", "its fit did not converge"),
    "in_bounds": Rule("inside its bounds, physical sign", "at a bound or of an unphysical sign: {culprit}"),
    "matters": Rule("large enough to matter", "too small to matter: {culprit}"),
    "occurs": Rule("not below the range of real bicycles", "smaller than on any real bicycle: {culprit}"),
    "beats_terms": Rule("more probable than empirical terms", "an empirical {culprit} is more probable"),
    "one_law": Rule("one law per measurement error", "{culprit} that follows no law of the library"),
    "exceeds_sd": Rule("larger than its standard uncertainty", "smaller than its standard uncertainty: {culprit}"),
    "one_seldom": Rule("at most one effect of a rare size", "{culprit} effects have rare sizes"),
    # a partial name too
    "nothing_unlikely": Rule("P(nothing missing) < {nothing:g}", "P(nothing missing) = {culprit}, limit {nothing:g}"),
    "predicts": Rule("held-out log score improves", "the held-out log score does not improve"),
    "wide_priors": Rule(
        "P(nothing missing) < {remote:g}, or < {nothing:g} with doubled parameter uncertainties",
        "P(nothing missing) exceeds {nothing:g} with doubled parameter uncertainties",
    ),
    "each_alone": Rule("each of three effects is supported alone", "not supported alone: {culprit}"),
    "usual_size": Rule("a usual size", "of a rare size: {culprit}"),
    # no reservation
    "parameters": Rule(
        "parameters within their uncertainty, p > {poor_fit:g}",
        "parameter shifts exceed their uncertainty (p = {culprit})",
    ),
    "nothing_left": Rule("residuals without empirical terms, p > {poor_fit:g}", "residuals still follow {culprit}"),
    # the fit
    "fits": Rule("goodness of fit p > {poor_fit:g}", "residuals exceed noise (p = {culprit})"),
    "white": Rule("residuals white, p > {poor_fit:g}", "residuals are not white noise (p = {culprit})"),
}


@dataclass(frozen=True)
class AcceptanceCheck:
    """Answer to one rule about one hypothesis."""

    rule: str  # key of ACCEPTANCE_RULES
    figure: str  # what was found, as the list of rules prints it
    passed: bool  # the rule holds
    culprit: str = ""  # what the complaint names; the figure if empty
    remark: str = ""  # a note though the rule holds

    @property
    def what(self) -> str:
        """The rule in words, with its limit."""
        return ACCEPTANCE_RULES[self.rule].question.format_map(vars(RULES))

    @property
    def complaint(self) -> str:
        """Clause of a sentence if the rule is not met."""
        words = vars(RULES) | {"culprit": self.culprit or self.figure}
        return ACCEPTANCE_RULES[self.rule].complaint.format_map(words)
