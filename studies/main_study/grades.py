"""Grades of an answer: which share of the parameter samples must agree before it is given.

The first rule that holds gives the grade. ``GRADE_RULES`` is printed by ``velotyre run --rule``; the study
``tests/validation/answer_grades.py`` counts how often each grade is right.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from tyre.ground.arrays import Array


class Grade(StrEnum):
    """Answer to "does it?": the values in JSON."""

    YES = "yes"
    PROBABLY = "probably"
    NO = "no"  # as sure as yes, the other way
    PROBABLY_NOT = "probably_not"
    LITTLE_DIFFERENCE = "little_difference"
    DEPENDS = "depends"  # on one assumption that nobody measured
    INCONCLUSIVE = "inconclusive"

    @property
    def definite(self) -> bool:
        """True of yes and no."""
        return self in (Grade.YES, Grade.NO)

    @property
    def words(self) -> str:
        """The grade as words."""
        return self.value.replace("_", " ")


@dataclass(frozen=True)
class AgreementRule:
    """Shares of the samples that give a grade."""

    grade: Grade  # where the samples agree with the question
    opposite: Grade  # where they agree with its contrary
    agree: float  # lowest share of the samples that go one way
    oppose: float  # highest share that go the other way


@dataclass(frozen=True)
class GradeRules:
    """Numbers of the rules, in the order in which they are tried."""

    # tried in this order, before the two shares below
    agreement: tuple[AgreementRule, ...] = (
        AgreementRule(Grade.YES, Grade.NO, agree=0.90, oppose=0.02),
        AgreementRule(Grade.PROBABLY, Grade.PROBABLY_NOT, agree=2 / 3, oppose=0.05),
    )
    little: float = 0.10  # highest share either way of little difference
    split: float = 0.50  # lowest difference of the shares between the halves of an assumption


GRADE_RULES = GradeRules()


@dataclass(frozen=True)
class Split:
    """Assumption that splits the samples: what share goes one way below and above its median."""

    name: str  # of the assumption, as in ``Ranges``
    below: float  # share of the samples below the median that go this way
    above: float  # share of those above it
    direction: int  # 1: the way of the question, -1: the other

    @property
    def difference(self) -> float:
        """Difference of the two shares."""
        return abs(self.above - self.below)


@dataclass(frozen=True)
class GradedAnswer:
    """Grade and the counts behind it."""

    grade: Grade  # of the first rule that holds
    for_it: int  # samples that go the way of the question
    against: int  # samples that go the other way
    count: int  # samples that were computed
    split: Split | None = None  # assumption on which the answer depends

    @property
    def neither(self) -> int:
        """Number of samples that go neither way."""
        return self.count - self.for_it - self.against


def grade_samples(votes: Array, assumed: Mapping[str, Array], *, either: bool = False) -> GradedAnswer:
    """Give the grade of ``votes`` (n,): 1 for the question, -1 against it, 0 neither.

    ``assumed`` holds the numbers (n,) of each assumption that was not measured. With ``either`` each sample says yes or
    no, so the share of the other way is what is left and is not asked.
    """
    votes = np.asarray(votes)
    forward, backward = votes > 0, votes < 0
    counts = int(forward.sum()), int(backward.sum()), len(votes)
    if not len(votes):
        return GradedAnswer(Grade.INCONCLUSIVE, *counts)

    for rule in GRADE_RULES.agreement:
        for grade, way, contrary in ((rule.grade, forward, backward), (rule.opposite, backward, forward)):
            if way.mean() >= rule.agree and (either or contrary.mean() <= rule.oppose):
                return GradedAnswer(grade, *counts)
    if not either and max(forward.mean(), backward.mean()) <= GRADE_RULES.little:
        return GradedAnswer(Grade.LITTLE_DIFFERENCE, *counts)

    splits = []
    for name, numbers in assumed.items():
        splits += [_split(name, numbers, forward, 1), _split(name, numbers, backward, -1)]
    widest = max(splits, key=lambda split: split.difference, default=None)
    if widest and widest.difference >= GRADE_RULES.split:
        return GradedAnswer(Grade.DEPENDS, *counts, widest)
    return GradedAnswer(Grade.INCONCLUSIVE, *counts)


def _split(name: str, numbers: Array, way: NDArray[np.bool_], direction: int) -> Split:
    """Compare the samples below and above the median of an assumption."""
    above = numbers > np.median(numbers)
    if above.all() or not above.any():
        return Split(name, 0.0, 0.0, direction)
    return Split(name, float(way[~above].mean()), float(way[above].mean()), direction)
