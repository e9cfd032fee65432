"""A plan in words: what is open, what to do, what it costs, what cannot be settled and why."""

import math
from collections.abc import Sequence

from studies.inference.acceptance import OPEN
from studies.inference.evidence import CLEAR_ODDS
from studies.missing_effect.leading import Standing
from studies.missing_effect.plan.offer import Answer
from studies.missing_effect.plan.plan import HALF, Plan, Settled, worth_taking
from studies.missing_effect.reporting.words import listed, number, percent

QUESTIONS = (
    "question", "now", "after the plan, by the less favourable answer", "after everything offered, likewise"
)  # fmt: skip
STEPS = ("what", "times", "price")


def headline(plan: Plan) -> str:
    """The ``plan`` in a sentence."""
    if not plan.questions and plan.verdict in OPEN:
        return (
            f"Nothing can be planned: the verdict is {plan.verdict}, so something in the data has no explanation yet, "
            "and there are no two hypotheses to be told apart."
        )
    if not plan.questions and plan.standing is not None:
        return _stands(plan.standing)
    if not plan.questions:
        return "Nothing is open: no further measurement is needed."
    if not plan.steps:
        return "Nothing that is offered would settle what is open."
    done = [f"{s.count} {_counted(s.what, s.count)}" for s in plan.steps]
    bought = f" with {listed(plan.channels)} added" if plan.channels else ""
    can = [q for q in plan.questions if q.at_most.met]
    goal = f"odds of {plan.costs.odds:g} : 1 with a probability of {percent(plan.costs.probability)}"
    if not plan.complete:
        end = "does not settle all that could be settled"
    elif len(can) < len(plan.questions):
        end = _in_part(plan.questions)
    else:
        what = "what is asked here, not what has no explanation yet" if plan.verdict in OPEN else "what is open"
        end = f"settles {what}{f' ({goal})' if any(not q.limit for q in can) else ''}"
    return f"{listed(done)}{bought}, for {plan.costs.money(plan.cost)}: {end}."


def _stands(standing: Standing) -> str:
    """That no question is open though another hypothesis is not hopeless, about which `diagnose` says more."""
    return (
        f"Nothing is open at odds of {CLEAR_ODDS:g} : 1, so no further measurement is needed: {standing}; `velotyre "
        "diagnose` says whether a measurement would make that surer."
    )


def _in_part(questions: Sequence[Settled]) -> str:
    """What a plan does where only some of the ``questions``, or none, can be settled."""
    rest = [q for q in questions if not q.at_most.met]
    left = [q for q in rest if not worth_taking(q.at_most)]
    can, taken, pairs = len(questions) - len(rest), len(rest) - len(left), not any(q.limit for q in left)
    if can:
        others = f"{taken} of the others" if left else "the others" if taken > 1 else "the other"
        end = f"settles {can} of {len(questions)} questions"
        end += f" and takes {others} as far as is worth its price" if taken else ""
    else:
        which = f"any of the {taken} questions" if taken > 1 else "one question" if left else "the question"
        be = "are" if taken > 1 else "is"
        end = f"is not sure to settle {which} that {be} open, but goes as far as is worth its price"
    if not left:
        return end
    whom = f"{len(left)} more" if taken else "the others" if len(left) > 1 else "the other"
    would = f"settle with a probability of less than {percent(HALF)}" if pairs else "not settle"
    return f"{end}; it is not aimed at {whom}, which all that is offered together would {would}"


def _counted(what: str, count: int) -> str:
    return what.replace("runs at", "run at", 1) if count == 1 else what


def question_rows(plan: Plan) -> list[list[str]]:
    """Rows of the table of what is open in a ``plan``, under :data:`QUESTIONS`."""
    return [[q.words, _now(q), _answer(q, q.then), _answer(q, q.at_most)] for q in plan.questions]


def _now(question: Settled) -> str:
    if question.limit:
        return _answer(question, question.now)
    return f"odds {_odds(abs(question.now.log_odds))} for {question.leads}"


def _answer(question: Settled, answer: Answer) -> str:
    if question.limit:
        return f"limit {number(answer.limit, 3)}"
    odds = "" if math.isnan(answer.log_odds) else f", expected odds {_odds(answer.log_odds)} for what is true"
    return f"{percent(answer.probability)}{odds}"


def _odds(log_odds: float) -> str:
    if abs(log_odds) > math.log(1e4):
        return "over 10000 : 1" if log_odds > 0 else "below 1 : 10000"
    return f"{math.exp(log_odds):.2g} : 1" if log_odds >= 0 else f"1 : {math.exp(-log_odds):.2g}"


def step_rows(plan: Plan) -> list[list[str]]:
    """Rows of the table of what to do by a ``plan``, under :data:`STEPS`, channels first."""
    money = plan.costs.money
    bought = [[f"channel {name}", "1", money(plan.costs.channels[name])] for name in plan.channels]
    return [*bought, *([s.what, f"{s.count}", money(s.price)] for s in plan.steps)]


def afterwards(plan: Plan) -> list[str]:
    """How the results of the bench tests of a ``plan`` are entered, and what that gives."""
    return [s.afterwards for s in plan.steps if s.afterwards]


def hopeless(plan: Plan) -> list[str]:
    """What no ``plan`` settles, and why."""
    return [f"{q.words}: {q.why}" for q in plan.questions if q.why]


def proof(plan: Plan) -> str:
    """Whether a cheaper ``plan`` could exist."""
    if not plan.steps or not plan.complete:
        return ""
    if plan.proven:
        return "No cheaper plan reaches the same, within the precision of the prediction."
    return "Found by exchange; a cheaper plan may exist."
