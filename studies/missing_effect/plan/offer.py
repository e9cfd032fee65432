"""What can be measured with one set of channels, and how far any number of repeats of it would get."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from studies.inference.evidence import CLEAR_ODDS
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.identifiability import ALIKE_COSINE, HOPELESS_ODDS, direction
from studies.missing_effect.plan.questions import LimitQuestion, Open, PairQuestion
from studies.missing_effect.plan.separation import Alike, Block, Terms, log_likelihood
from tyre.base.arrays import Array

Counts = tuple[int, ...]


@dataclass(frozen=True)
class Item:
    """What can be done so often: a run at a speed (m/s), or a bench test (once).

    Attributes
    ----------
    what : str
    setup, each : float
        Price of the first besides that of each.
    most : int
    blocks : tuple of Block
        What one gives.
    speed : float, optional
        m/s; of a run.
    afterwards : str
        How the result of a bench test is entered.
    """

    what: str
    setup: float
    each: float
    most: int
    blocks: tuple[Block, ...]
    speed: float | None = None
    afterwards: str = ""

    def price(self, count: int) -> float:
        """Of so many: a ``count``, without unit."""
        return self.setup + count * self.each if count else 0.0


@dataclass(frozen=True)
class Answer:
    """How far a question is settled.

    Attributes
    ----------
    probability : float
        That the odds which settle it are reached, by the less favourable of its two answers; of a limit 1 or its
        nearness to the target.
    log_odds : float
        Expected logarithm of the odds of what is true, by the less favourable answer; NaN of a limit.
    cosine : float
        Between what the two do to all data; NaN of a limit.
    limit : float
        Expected, in the unit of the parameter; NaN of a pair.
    met : bool
    """

    probability: float
    met: bool
    log_odds: float = math.nan
    cosine: float = math.nan
    limit: float = math.nan

    @property
    def merit(self) -> float:
        """Grows towards the goal, where the probability is still zero, too."""
        if self.met:
            return 2.0
        return self.probability + (0.0 if math.isnan(self.log_odds) else 0.2 * math.tanh(self.log_odds / 3))


@dataclass(frozen=True, eq=False)
class Offer:
    """One set of ``channels`` (its price is ``entry``), what can be done with it, and what is to be settled.

    ``fewest``: number of runs below which none can be read, where there are any.
    """

    forward: Forward
    open: Open
    channels: tuple[str, ...]
    entry: float
    items: tuple[Item, ...]
    odds: float = CLEAR_ODDS
    probability: float = 0.9
    fewest: int = 0
    _terms: dict[tuple[int, int, int], Terms] = field(default_factory=dict)
    _answers: dict[tuple[Counts, int], Answer] = field(default_factory=dict)
    _alike_of: dict[Counts, Alike] = field(default_factory=dict)

    @property
    def questions(self) -> tuple[PairQuestion | LimitQuestion, ...]:
        """Pairs, then limits."""
        return (*self.open.pairs, *self.open.limits)

    def cost(self, counts: Counts) -> float:
        """Of a plan by its ``counts`` of items, without unit; channels are bought where anything is ridden."""
        runs = any(n for n, item in zip(counts, self.items, strict=True) if item.speed is not None)
        return self.entry * runs + sum(item.price(n) for n, item in zip(counts, self.items, strict=True))

    def readable(self, counts: Counts) -> bool:
        """Whether there are runs enough to be read, or none, in ``counts`` (without unit)."""
        runs = sum(n for n, item in zip(counts, self.items, strict=True) if item.speed is not None)
        return runs == 0 or runs >= self.fewest

    @property
    def everything(self) -> Counts:
        """Every item as often as it can be done."""
        return tuple(item.most for item in self.items)

    def answers(self, counts: Counts) -> tuple[Answer, ...]:
        """To every question, if a plan of these ``counts`` (without unit) is carried out."""
        return tuple(self.answer(counts, place) for place in range(len(self.questions)))

    def answer(self, counts: Counts, place: int) -> Answer:
        """The same to one question by its index ``place``; ``counts`` without unit."""
        if (counts, place) not in self._answers:
            used = [(k, b, n) for k, (item, n) in enumerate(zip(self.items, counts, strict=True)) if n
                    for b in range(len(item.blocks))]  # fmt: skip
            q = self.questions[place]
            if isinstance(q, LimitQuestion):
                self._answers[counts, place] = self._limit(q, used)
            else:
                if counts not in self._alike_of:
                    self._alike_of[counts] = self._alike(used)
                self._answers[counts, place] = self._pair(q, used, self._alike_of[counts])
        return self._answers[counts, place]

    def looked_at(self, places: Collection[int]) -> list[tuple[float, float]]:
        """Cost and worst probability of the plans whose answers to the questions ``places`` (indices) are all known."""
        plans = {counts for counts, _ in self._answers}
        return [
            (self.cost(counts), min(self._answers[counts, place].probability for place in places))
            for counts in plans
            if all((counts, place) in self._answers for place in places)
        ]

    # ------------------------------------------------------------------ inside

    @cached_property
    def _blocks(self) -> list[tuple[int, int, Block]]:
        return [(k, b, block) for k, item in enumerate(self.items) for b, block in enumerate(item.blocks)]

    @cached_property
    def _number(self) -> dict[tuple[int, int], int]:
        return {(k, b): n for n, (k, b, _) in enumerate(self._blocks)}

    def _of(self, number: int, true: int, judge: int) -> Terms:
        key = (number, true, judge)
        if key not in self._terms:
            self._terms[key] = self.open.judged.terms(self._blocks[number][2], true, judge)
        return self._terms[key]

    def _pair(self, q: PairQuestion, used: Sequence[tuple[int, int, int]], alike: Alike) -> Answer:
        judged, numbers = self.open.judged, [self._number[k, b] for k, b, _ in used]
        repeats = [n for *_, n in used]
        now = float(judged.log_posterior[q.first] - judged.log_posterior[q.second])
        cosine = alike.cosine(q.first, q.second)
        effects = [len(judged.fits[k].candidates) for k in (q.first, q.second)]
        # that nothing is missing is never proven, for an effect may be as small as it likes: it has to lead
        goals = [0.0 if not n else math.log(self.odds) for n in effects]
        same = min(effects) > 0 and effects[0] == effects[1] and cosine > ALIKE_COSINE
        if same:
            goals = [math.log(HOPELESS_ODDS)] * 2
        reached, odds = [], []
        for true, other, before, goal in ((q.first, q.second, now, goals[0]), (q.second, q.first, -now, goals[1])):
            after = np.full(1, before)
            if used:
                mine = log_likelihood([self._of(n, true, true) for n in numbers], repeats)
                after = before + mine - log_likelihood([self._of(n, true, other) for n in numbers], repeats)
            reached.append(float(np.mean(after >= goal)))
            odds.append(float(np.mean(after)))
        return Answer(min(reached), min(reached) >= self.probability, min(odds), cosine)

    def _limit(self, q: LimitQuestion, used: Sequence[tuple[int, int, int]]) -> Answer:
        fit = self.open.fits[q.place]
        information = np.linalg.pinv(fit.covariance, hermitian=True)
        for k, b, n in used:
            information = information + n * self._information(self._number[k, b], q.place)
        sd = math.sqrt(np.linalg.pinv(information, hermitian=True)[q.column, q.column])
        limit = q.limit(sd)
        near = limit / q.target if q.unknown.power == -1 else q.target / limit
        return Answer(min(1.0, near), q.met(sd), limit=limit)

    def _information(self, number: int, place: int) -> Array:
        expected = self._blocks[number][2].expected[place]
        slopes = expected.whiten(expected.slopes)
        return np.asarray(slopes.T @ slopes)

    def _alike(self, used: Sequence[tuple[int, int, int]]) -> Alike:
        return self._measured.plus({self._moves[self._number[k, b]]: n for k, b, n in used})

    @cached_property
    def _measured(self) -> Alike:
        null, fits = self.open.fits[self.open.null], self.open.judged.fits
        moves = [direction(self.forward, f) if f.candidates else np.zeros(len(null.residual)) for f in fits]
        return Alike.of(np.stack(moves, 1), null.jacobian * _sd(null))

    @cached_property
    def _moves(self) -> list[Alike]:
        found = []
        null = self.open.fits[self.open.null]
        for *_, block in self._blocks:
            base = block.expected[self.open.null]
            moves = np.stack([block.expected[k].truth - block.expected[k].without
                              for k in range(len(self.open.judged.fits))], 1)  # fmt: skip
            found.append(Alike.of(base.whiten(moves), base.whiten(base.slopes) * _sd(null)))
        return found


def _sd(null: Fit) -> Array:
    return np.array([u.scale for u in null.unknowns])
