"""The cheapest plan: greedy, then pruned and exchanged, then branch and bound over what could be cheaper.

More data never tell less on average, so a node of the tree is cut where even all that its rest of the money can buy,
each item by itself, does not settle what is open.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from studies.missing_effect.plan.offer import Answer, Counts, Offer

MOST_NODES = 1500  # of the tree, of all sets of channels together
CHEAPER = 1e-9


@dataclass
class Found:
    """The best plan so far: which offer, how often each item; ``proven`` where no cheaper one can be."""

    offer: Offer | None = None
    counts: Counts = ()
    cost: float = float("inf")
    proven: bool = True
    nodes: int = 0

    def take(self, offer: Offer, counts: Counts) -> None:
        """Keep a plan of ``counts`` (without unit) if it is cheaper."""
        if offer.cost(counts) < self.cost - CHEAPER:
            self.offer, self.counts, self.cost = offer, counts, offer.cost(counts)


@dataclass(frozen=True, eq=False)
class Search:
    """Plans that settle some questions.

    Attributes
    ----------
    wanted : mapping of int to float
        Index of each question that is to be settled, the hardest first, and the probability that is enough.
    most_runs : int
        In all.
    budget : float
        Price that a plan may have; infinite for any.
    found : Found
    """

    wanted: Mapping[int, float]
    most_runs: int
    budget: float
    found: Found

    def met(self, offer: Offer, counts: Counts) -> bool:
        """Whether all wanted questions are settled by ``counts`` (without unit)."""
        return offer.readable(counts) and all(enough(offer.answer(counts, q), p) for q, p in self.wanted.items())

    def merit(self, offer: Offer, counts: Counts) -> float:
        """Grows towards that; ``counts`` without unit."""
        answers = [offer.answer(counts, q) for q in self.wanted]
        return sum(2.0 if enough(a, p) else a.merit for a, p in zip(answers, self.wanted.values(), strict=True))

    def allowed(self, offer: Offer, counts: Counts) -> bool:
        """Whether there are not too many runs in ``counts`` (without unit)."""
        runs = sum(n for n, item in zip(counts, offer.items, strict=True) if item.speed is not None)
        return runs <= self.most_runs

    def greedy(self, offer: Offer) -> Counts:
        """What gains most for its price, until all is met or nothing gains or can be paid."""
        counts: Counts = (0,) * len(offer.items)
        while not self.met(offer, counts):
            here, best, gain = self.merit(offer, counts), counts, 0.0
            for k, item in enumerate(offer.items):
                for step in {1, min(3, item.most)}:
                    trial = _with(counts, k, counts[k] + step)
                    price = offer.cost(trial)
                    if trial[k] > item.most or not self.allowed(offer, trial) or price > self.budget:
                        continue
                    more = (self.merit(offer, trial) - here) / max(price - offer.cost(counts), 1e-6)
                    if more > gain:
                        best, gain = trial, more
            if best == counts:
                return counts
            counts = best
        return counts

    def improved(self, offer: Offer, counts: Counts) -> Counts:
        """The same without what is needless, and with dearer items exchanged for cheaper ones."""
        while True:
            cost = offer.cost(counts)
            trials = [trial for trial in _neighbours(offer, counts) if offer.cost(trial) < cost - CHEAPER]
            for trial in sorted(trials, key=offer.cost):
                if self.allowed(offer, trial) and self.met(offer, trial):
                    counts = trial
                    break
            else:
                return counts

    def bounded(self, offer: Offer) -> None:
        """Branch and bound below the cost of the best plan."""
        self._branch(offer, (), sorted(range(len(offer.items)), key=lambda k: -offer.items[k].price(1)))

    def _branch(self, offer: Offer, chosen: Counts, order: list[int]) -> None:
        found = self.found
        if found.nodes >= MOST_NODES:
            found.proven = False
            return
        counts = _placed(chosen, order)
        cost, limit = offer.cost(counts), min(found.cost, self.budget + CHEAPER)
        if cost >= limit - CHEAPER or not self.allowed(offer, counts):
            return
        rest = order[len(chosen) :]
        most = list(counts)
        for k in rest:
            item = offer.items[k]
            left = limit - CHEAPER - cost - item.setup
            if item.speed is not None and not any(counts):
                left -= offer.entry
            most[k] = max(0, item.most if left >= item.most * item.each else int(left / item.each))
        found.nodes += 1
        if not self.met(offer, tuple(most)):
            return
        if not rest:
            found.take(offer, counts)
            return
        for n in range(most[rest[0]] + 1):
            self._branch(offer, (*chosen, n), order)


def enough(answer: Answer, probability: float) -> bool:
    """Whether an ``answer`` settles a question as well as is wanted: by this ``probability``, 0 to 1, or its limit."""
    return answer.met or answer.probability >= probability


def cheapest(offers: Sequence[Offer], wanted: Mapping[int, float], most_runs: int, budget: float) -> Found:
    """The cheapest plan that settles the ``wanted`` questions; without an offer where none does.

    Parameters
    ----------
    offers : sequence of Offer
        One for each set of channels.
    wanted : mapping of int to float
        Index of each question and the probability that is enough.
    most_runs : int
        Number of runs in all.
    budget : float
        Price that must not be exceeded, no unit but that of the prices.
    """
    found = Found()
    search = Search(wanted, most_runs, budget, found)
    able = [offer for offer in sorted(offers, key=lambda o: o.entry) if search.met(offer, offer.everything)]
    for offer in able:
        for counts in (search.greedy(offer), offer.everything):  # all of it where no single step gains
            if search.allowed(offer, counts) and offer.cost(counts) <= budget and search.met(offer, counts):
                found.take(offer, search.improved(offer, counts))
                break
    for offer in able:
        search.bounded(offer)
    return found


def richest(offers: Sequence[Offer], wanted: Mapping[int, float], most_runs: int, budget: float) -> Found:
    """The plan that gets farthest within a ``budget`` (a price), where none gets there; arguments as :func:`cheapest`.

    Parameters
    ----------
    offers : sequence of Offer
    wanted : mapping of int to float
        Index of each question and the probability that is enough.
    most_runs : int
        Number of runs in all.
    budget : float
        Price that must not be exceeded.
    """
    found, best = Found(proven=False), -float("inf")
    search = Search(wanted, most_runs, budget, found)
    for offer in offers:
        counts = search.greedy(offer)
        merit = search.merit(offer, counts)
        if offer.cost(counts) <= budget and merit > best:
            found.offer, found.counts, found.cost, best = offer, counts, offer.cost(counts), merit
    return found


def _with(counts: Counts, place: int, count: int) -> Counts:
    return (*counts[:place], count, *counts[place + 1 :])


def _placed(chosen: Counts, order: list[int]) -> Counts:
    counts = [0] * len(order)
    for k, n in zip(order, chosen, strict=False):
        counts[k] = n
    return tuple(counts)


def _neighbours(offer: Offer, counts: Counts) -> list[Counts]:
    """One less or none of an item; the same with up to as many of another one more."""
    less = {_with(counts, k, n) for k, old in enumerate(counts) if old for n in (old - 1, 0)}
    found = set(less)
    for trial in less:
        for k, item in enumerate(offer.items):
            for step in (1, 2, 3):
                if trial[k] + step <= item.most:
                    found.add(_with(trial, k, trial[k] + step))
    found.discard(counts)
    return list(found)
