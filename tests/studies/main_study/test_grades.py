"""The grade of an answer is that of the first rule that holds of the shares of the samples."""

import numpy as np
import pytest

from studies.main_study import grade_samples

EVEN = {"stiffness": np.tile([1.0, 2.0], 50)}  # takes no side of votes in order


def votes(widening, narrowing, count=100):
    return np.repeat([1, -1, 0], [widening, narrowing, count - widening - narrowing])


@pytest.mark.parametrize(("widening", "narrowing", "grade"), [
    (90, 2, "yes"), (90, 3, "probably"), (89, 2, "probably"), (67, 5, "probably"), (67, 6, "inconclusive"),
    (66, 0, "inconclusive"), (2, 90, "no"), (5, 67, "probably_not"), (10, 10, "little_difference"),
    (0, 0, "little_difference"), (11, 0, "inconclusive"), (0, 11, "inconclusive"), (100, 0, "yes"),
])  # fmt: skip
def test_the_shares_of_a_change(widening, narrowing, grade):
    graded = grade_samples(votes(widening, narrowing), EVEN)
    assert graded.grade == grade
    assert (graded.for_it, graded.against, graded.neither) == (widening, narrowing, 100 - widening - narrowing)
    assert graded.split is None


@pytest.mark.parametrize(("wobbling", "grade"), [
    (90, "yes"), (89, "probably"), (67, "probably"), (66, "inconclusive"), (34, "inconclusive"), (33, "probably_not"),
    (11, "probably_not"), (10, "no"), (0, "no"),
])  # fmt: skip
def test_the_share_that_wobbles(wobbling, grade):
    assert grade_samples(votes(wobbling, 100 - wobbling), EVEN, either=True).grade == grade


@pytest.mark.parametrize(("moving", "grade"), [(13, "depends"), (12, "inconclusive")])  # of the 25 above the median
@pytest.mark.parametrize("direction", [1, -1])
def test_an_assumption_that_splits_the_samples_is_named(moving, grade, direction):
    number = np.arange(50.0)
    moves = np.where((number >= 25) & (number < 25 + moving), direction, 0)
    graded = grade_samples(moves, {"damping": np.tile([3.0, 4.0], 25), "stiffness": number})
    assert graded.grade == grade
    if grade == "depends":
        assert (graded.split.name, graded.split.direction) == ("stiffness", direction)
        assert (graded.split.below, graded.split.above) == (0.0, pytest.approx(0.52))


def test_an_assumption_of_one_value_splits_nothing():
    assert grade_samples(votes(50, 0), {"stiffness": np.full(100, 5.0)}).grade == "inconclusive"


def test_no_sample_gives_no_answer():
    assert grade_samples(np.zeros(0), {}).grade == "inconclusive"
