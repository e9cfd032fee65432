"""From a diagnosis and prices to the cheapest further measurements that settle what is open."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from studies.inference.identifiability import ALIKE_COSINE
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.leading import Standing, settled, standing
from studies.missing_effect.plan.costs import Costs
from studies.missing_effect.plan.offer import Answer, Offer
from studies.missing_effect.plan.offers import check, offers_of
from studies.missing_effect.plan.questions import NOTHING, LimitQuestion, called, opened
from studies.missing_effect.plan.search import Found, cheapest, richest
from studies.missing_effect.reporting.words import percent
from tyre.base.parallel import one_blas_thread

HALF = 0.5  # probability below which a question that cannot be settled is given up
NEARLY = 0.9  # of the probability that everything together gives, where that does not suffice
REFUSED = "What is to be told apart fits but fails a rule: what tells it apart does not by itself name it."
ALL_OF_IT = math.inf  # a probability that no answer has: it must be met


@dataclass(frozen=True)
class Step:
    """One line of a plan: ``count`` times ``what``, at a price (all of them); ``afterwards``: how a test is entered."""

    what: str
    count: int
    price: float
    speed: float | None = None
    afterwards: str = ""


@dataclass(frozen=True)
class Settled:
    """A question and how far it is settled: now, by the plan, and by everything that can be measured.

    ``why`` says in words why it cannot be settled, where it cannot; ``leads`` which of two hypotheses does now.
    """

    words: str
    now: Answer
    then: Answer
    at_most: Answer
    limit: bool
    why: str = ""
    leads: str = ""


@dataclass(frozen=True, eq=False)
class Plan:
    """What to measure next.

    Attributes
    ----------
    steps : tuple of Step
        Empty where nothing is to be done.
    channels : tuple of str
        That are bought.
    cost : float
    questions : tuple of Settled
    curve : tuple of (float, float)
        Cost and the probability that every question which can be settled is, the best for its cost.
    proven : bool
        No cheaper plan exists.
    costs : Costs
    notes : tuple of str
    verdict : str
        The word of the diagnosis so far.
    standing : Standing, optional
        Where nothing is open: what comes nearest to the verdict.
    """

    steps: tuple[Step, ...]
    channels: tuple[str, ...]
    cost: float
    questions: tuple[Settled, ...]
    curve: tuple[tuple[float, float], ...]
    proven: bool
    costs: Costs
    notes: tuple[str, ...] = ()
    verdict: str = ""
    standing: Standing | None = None

    @property
    def complete(self) -> bool:
        """Whether it settles all that can be settled."""
        return all(q.then.met for q in self.questions if q.at_most.met)

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""

        def told(answer: Answer, *, limit: bool) -> dict[str, Any]:
            if limit:
                return {"limit": answer.limit, "met": answer.met}
            return {"probability": answer.probability, "expected_log_odds": answer.log_odds, "cosine": answer.cosine,
                    "met": answer.met}  # fmt: skip

        return {
            "steps": [
                {"what": s.what, "count": s.count, "price": s.price, "speed_m_s": s.speed, "afterwards": s.afterwards}
                for s in self.steps
            ],
            "channels": list(self.channels), "cost": self.cost, "currency": self.costs.currency,
            "goal": {"odds": self.costs.odds, "probability": self.costs.probability}, "complete": self.complete,
            "cheapest_proven": self.proven,
            "questions": [
                {"question": q.words, "why_not": q.why, "leads": q.leads,
                 **{name: told(getattr(q, name), limit=q.limit) for name in ("now", "then", "at_most")}}
                for q in self.questions
            ],
            "curve": [{"cost": cost, "probability": p} for cost, p in self.curve],
            "nearest_rival": None if self.standing is None else asdict(self.standing),
            "notes": list(self.notes),
        }  # fmt: skip


@one_blas_thread()
def plan(diagnosis: Diagnosis, costs: Costs) -> Plan:
    """The cheapest further measurements that settle what a ``diagnosis`` leaves open, at these ``costs``.

    Raises
    ------
    InputError
        Another kind of data; a channel, bench test or size that does not belong to the measurement.
    """
    forward = check(diagnosis.forward, diagnosis.measurement.name, costs)
    what = opened(diagnosis, costs.limits)
    offers, notes = offers_of(forward, what, costs)
    full = offers[-1]  # with all channels
    nothing = (0,) * len(full.items)
    now, most = full.answers(nothing), full.answers(full.everything)
    wanted = _wanted(now, most)
    asked = [k for k in range(len(now)) if not now[k].met]
    if not asked:
        notes.clear()  # where nothing is open they are about what nobody would do
    found = Found(full, nothing, 0.0)
    runs = costs.most_runs if costs.most_runs is not None else sum(item.most for item in full.items)
    budget = costs.budget if costs.budget is not None else float("inf")
    if wanted:
        found = cheapest(offers, wanted, runs, budget)
        if found.offer is None:
            found = richest(offers, wanted, runs, budget)
            notes.append("the budget or the number of runs does not suffice for all; the plan gets as far as they do")
    assert found.offer is not None
    then = found.offer.answers(found.counts)
    questions = tuple(
        Settled(_words(full, k), now[k], then[k], most[k], isinstance(full.questions[k], LimitQuestion),
                "" if most[k].met else _why(full, k, most[k]), _leads(full, k))
        for k in asked
    )  # fmt: skip
    if diagnosis.verdict.verdict == "unknown":
        notes.append(f"the verdict is unknown. {settled(diagnosis) or REFUSED}")
    curve = _front(offers, wanted)
    return Plan(
        _steps(found), _bought(found), found.cost, questions, curve, found.proven, costs, tuple(notes),
        diagnosis.verdict.verdict, None if questions else standing(diagnosis),
    )  # fmt: skip


def _wanted(now: Sequence[Answer], most: Sequence[Answer]) -> dict[int, float]:
    """Questions that measurements can settle, or nearly, the hardest first, with the probability that is enough."""
    found = {}
    for k in sorted(range(len(now)), key=lambda k: most[k].probability):
        if now[k].met:
            continue
        if most[k].met:
            found[k] = ALL_OF_IT
        elif worth_taking(most[k]):
            near = NEARLY * most[k].probability
            if now[k].probability < near:
                found[k] = near
    return found


def worth_taking(most: Answer) -> bool:
    """Whether a question that everything together does not settle, by ``most``, is taken nearly as far as that goes."""
    return math.isnan(most.limit) and most.probability >= HALF


def _leads(offer: Offer, place: int) -> str:
    """Which of two hypotheses is more probable now; empty of a limit."""
    question, logs = offer.questions[place], offer.open.judged.log_posterior
    if isinstance(question, LimitQuestion):
        return ""
    ahead = max(question.first, question.second, key=lambda k: logs[k])
    return called(offer.open.judged.fits[ahead])


def _words(offer: Offer, place: int) -> str:
    return offer.questions[place].words


def _why(offer: Offer, place: int, most: Answer) -> str:
    """Why a question cannot be settled by everything that is offered."""
    question = offer.questions[place]
    if isinstance(question, LimitQuestion):
        return f"everything together would leave a limit of {most.limit:.3g}"
    if most.cosine > ALIKE_COSINE:
        return (
            f"both do the same to all that is offered (cosine {most.cosine:.3f}); only something that tells them apart "
            "by itself would: a bench test, a look at the bicycle"
        )
    small = "the effect may be too small to be seen" if NOTHING in question.words else "what they do differs too little"
    return f"everything together would settle it with a probability of {percent(most.probability)}: {small}"


def _steps(found: Found) -> tuple[Step, ...]:
    assert found.offer is not None
    return tuple(
        Step(item.what, n, item.price(n), item.speed, item.afterwards)
        for item, n in zip(found.offer.items, found.counts, strict=True) if n
    )  # fmt: skip


def _bought(found: Found) -> tuple[str, ...]:
    assert found.offer is not None
    return found.offer.channels if any(step.speed is not None for step in _steps(found)) else ()


def _front(offers: Sequence[Offer], wanted: Mapping[int, float]) -> tuple[tuple[float, float], ...]:
    """Cost and worst probability of the plans that were looked at and that no cheaper one equals."""
    if not wanted:
        return ()
    front: list[tuple[float, float]] = []
    for cost, p in sorted(
        (point for offer in offers for point in offer.looked_at(wanted)), key=lambda point: (point[0], -point[1])
    ):
        if not front or p > front[-1][1]:
            front.append((cost, p))
    return tuple(front)
