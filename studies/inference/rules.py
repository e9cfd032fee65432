"""The numbers that decide a verdict or a name, in one table with the source of each."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Rules:
    """Limits of the search and of the rules of acceptance; "counted" means fixed by counts on blind cases."""

    poor_fit: float = 0.01  # p below which a model does not fit its data; convention
    clear_odds: float = 20.0  # : 1, from which odds are clear; strong evidence of Kass & Raftery (1995)
    nothing: float = 0.05  # P(nothing is missing) above which nothing is named; convention
    remote: float = 0.01  # P(nothing) below which doubled uncertainties of the parameters are a note; convention
    even: float = 0.5  # the same, above which a poor fit of nothing alone names nothing; even odds
    # sizes of effects
    seldom: float = 0.05  # prior share of sizes that seldom occur; counted
    unusual: float = 5.0  # widening of the prior sd of a size that seldom occurs; counted
    most_scales: float = 3.0  # prior sd of a size that occurs: 1.5 times the upper end of the typical range
    # what a partial name must close
    partial_share: float = 0.5  # of the nuisance-only held-out gap it may leave at most; counted
    partial_rest: float = 2.0  # held-out gap, in sd, beyond which a name would be a guess; counted
    far: float = 1e-4  # p below which partial names come mostly from causes outside the library; counted
    far_share: float = 0.1  # of the gap that a name may leave then; counted
    told_shift: float = 0.5  # of its sd: how far a parameter went that a sentence or table names
    # what joins a class
    alike_cosine: float = 0.95  # of marginalised directions that count as one; counted
    hopeless_odds: float = 1e4  # : 1, beyond which a look-alike is out unless it explains as much
    as_much: float = 6.0  # of the objective: odds of 20 by the fit alone, 2 ln 20
    likelier_odds: float = 3.0  # : 1, from which one effect more joins the class; positive evidence, Kass & Raftery
    bench_sd: float = 0.1  # of a bench test, in prior scales: 5 % of the upper end of the typical range
    wider: float = 2.0  # factor on the sd of the nuisances that a name must survive; counted
    # terms without a cause
    mimic_share: float = 0.9  # of the objective that such a term must leave at most
    # parts of joint data
    doubtful: float = 0.01  # p below which a part contradicts the rest; convention
    seen: float = 0.9  # of the prior sd: above it a number is its prior
    # limits of absent effects
    level: float = 0.95  # of an upper limit; convention
    same_as_prior: float = 0.95  # of the prior's own limit, from which on the data say nothing
    # other readings of the data; counted on the search cases
    misread: float = 3.0  # sum of squares a number, with the parameters adjusted, from which others are tried
    collapse: float = 4.0  # factor by which it falls where a reading is the answer
    as_well: float = 1.5  # factor within which readings count as alike
    # much data
    thinned: int = 4000  # numbers in which hypotheses are searched where there are more than twice as many; counted
    block: float = 0.01  # s, over which their samples are averaged: 96.7 % of the information at 10 Hz stay
    quick: int = 1500  # the same of the quick search, for 2 s; counted
    bare: float = 2.0  # difference of BIC worth no more than a bare mention; Kass & Raftery (1995)
    # breadth of the search; counted against random starts
    most_effects: int = 3  # in a hypothesis
    many: int = 3  # effects at once, each of which must stand alone
    beam: int = 2  # hypotheses that are enlarged
    most_tried: int = 4  # candidates that are fitted beside a parent
    worth_a_fit: float = 4.0  # promised decrease of the objective below which they are not
    closed: float = 0.5  # of the gap to the best parent that a first step must promise where the gap is hopeless
    poor: float = 10.0  # times the objective of an explanation, beyond which a soft joint is not followed to its end
    loud: float = 1.3  # objective a row beyond which every hypothesis is tried again
    retried: int = 5  # poor fits that are tried from other starts
    polished: int = 8  # most probable fits that must converge
    improved: float = 8.0  # decrease of the objective below which further starts of a soft joint are not tried
    hopeless: float = 2.0  # times the best objective, beyond which a fit is not polished
    behind: float = 100.0  # log posterior behind an explanation, beyond which a fit is not tried again


RULES = Rules()
