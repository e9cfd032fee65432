"""Predicted separation of hypotheses against the normal distributions that it stands for, drawn and by formula."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from studies.inference import UncertainParameter
from studies.inference.fit import Fit
from studies.inference.parameter import Candidate
from studies.missing_effect.plan import separation
from studies.missing_effect.plan.offer import Item, Offer
from studies.missing_effect.plan.questions import LimitQuestion, Open, PairQuestion
from studies.missing_effect.plan.search import Search, cheapest, richest
from studies.missing_effect.plan.separation import Alike, Block, Expected, Judged, log_likelihood

NUISANCE = UncertainParameter("mass", "kg", {"mass": 1.0}, 0.0, 1.0)


def hypothesis(name, size, sd, *, nuisance_sd=0.5):
    """One nuisance and perhaps one effect, known to an sd."""
    u = UncertainParameter("size", "1", {name: 1.0}, 0.0, 10.0, size=True)
    candidates = (Candidate(name, (u,)),) if name else ()
    unknowns = (NUISANCE, u) if name else (NUISANCE,)
    spread = np.diag([nuisance_sd**2, sd**2] if name else [nuisance_sd**2])
    theta = np.array([0.0, size] if name else [0.0])
    return Fit(candidates, unknowns, theta, spread, np.zeros(1), np.zeros((1, len(theta))), 0.0, 0.0)


def block(rng, fits, *, m=3, seed=1, scale=1.0):
    """Linear: each unknown moves m numbers its own way, the nuisance alike in all."""
    common, expected = rng.normal(size=(m, 1)), []
    for fit in fits:
        slopes = np.hstack([common, scale * rng.normal(size=(m, len(fit.theta) - 1))])
        mean = slopes @ fit.theta
        expected.append(Expected(mean, mean, slopes, slopes[:, :1] @ fit.theta[:1]))
    return Block(tuple(expected), seed)


def test_the_likelihood_is_that_of_the_normal_distribution_of_all_repeats():
    """ln p of stacked data by the covariance of the whole, scipy; with a block whose noise is wider by its starts."""
    rng = np.random.default_rng(3)
    fits = [hypothesis("a", 1.0, 0.3), hypothesis("b", -0.5, 0.2)]
    judged = Judged(tuple(fits), np.zeros(2))
    one = block(rng, fits)
    inner = rng.normal(size=(3, 2))
    a = np.eye(3) + inner @ inner.T
    values, vectors = np.linalg.eigh(a)
    half = vectors @ np.diag(values**-0.5) @ vectors.T
    wide = tuple(
        Expected(e.truth, e.truth - 0.7, e.slopes, e.without, lambda x: half @ x, float(np.log(values).sum()))
        for e in one.expected
    )
    blocks = [block(rng, fits, seed=2), Block(wide, 7)]
    found = log_likelihood([judged.terms(b, 0, 1) for b in blocks], [1, 1])
    true, judge = fits
    for k in range(0, separation.DRAWS, 37):
        y, mean, g, noise = [], [], [], np.zeros((6, 6))
        for place, b in enumerate(blocks):
            e = np.random.default_rng([b.seed, 1]).standard_normal((3, separation.DRAWS))[:, k]
            here = b.expected[0]
            y.append(here.truth + here.slopes @ judged.roots[0] @ judged.draws[0][:, k] + e)
            mean.append(b.expected[1].model)
            g.append(b.expected[1].slopes)
            noise[3 * place : 3 * place + 3, 3 * place : 3 * place + 3] = a if place else np.eye(3)
        j = np.vstack(g)
        exact = multivariate_normal(np.concatenate(mean), noise + j @ judge.covariance @ j.T)
        assert found[k] == pytest.approx(exact.logpdf(np.concatenate(y)) + 3 * math.log(2 * math.pi), rel=1e-9)
    assert len(true.theta) == 2


def pair(distance, before=0.0, *, odds=20.0):
    """Two hypotheses that a run tells apart by some sd, nothing else being unknown; both have an effect."""
    fits = [hypothesis("a", 1.0, 1e-6, nuisance_sd=1e-9), hypothesis("b", 1.0, 1e-6, nuisance_sd=1e-9)]
    slopes = [np.array([[0.0, distance], [0.0, 0.0]]), np.array([[0.0, 0.0], [0.0, 1e-3]])]
    expected = tuple(Expected(s @ f.theta, s @ f.theta, s, 0 * s[:, 0]) for s, f in zip(slopes, fits, strict=True))
    what = Open(Judged(tuple(fits), np.array([before, 0.0])), (PairQuestion(0, 1, "a or b"),), (), (*fits,), 0)
    return expected, what, odds


class Flat:
    """A forward model whose data so far say nothing."""

    def residual(self, candidates, theta, *, slopes=True):
        return np.zeros(1), np.zeros((1, len(theta)))


@pytest.mark.parametrize(("distance", "count", "before"), [(2.0, 1, 0.0), (2.0, 3, 0.0), (1.0, 6, 1.5)])
def test_two_points_in_white_noise_are_told_apart_as_by_the_formula(distance, count, before):
    """ln odds of the true one are normal with mean D^2/2 and variance D^2, D the distance in sd of the mean."""
    expected, what, odds = pair(distance, before)
    offer = Offer(Flat(), what, (), 0.0, (Item("runs", 0.0, 1.0, 9, (Block(expected, 5),), 5.0),), odds, 0.9)
    found = offer.answer((count,), 0)
    d = distance * math.sqrt(count)
    exact = norm.sf((math.log(odds) + abs(before) - d**2 / 2) / d)  # of the less probable one
    assert found.probability == pytest.approx(exact, abs=0.06)  # 400 draws
    assert found.log_odds == pytest.approx(d**2 / 2 - abs(before), rel=0.1)


def test_more_of_the_same_never_separates_what_does_the_same():
    fits = [hypothesis("a", 1.0, 0.4), hypothesis("b", 1.0, 0.4)]
    slopes = np.array([[1.0, 2.0], [0.5, -1.0]])
    mean = slopes @ fits[0].theta
    twin = Expected(mean, mean, slopes, 0 * mean)
    what = Open(Judged(tuple(fits), np.zeros(2)), (PairQuestion(0, 1, "a or b"),), (), tuple(fits), 0)
    offer = Offer(Flat(), what, (), 0.0, (Item("runs", 0.0, 1.0, 20, (Block((twin, twin), 5),), 5.0),))
    found = offer.answer((20,), 0)
    assert found.probability == 0
    assert found.cosine == pytest.approx(1.0)
    assert not found.met


def test_what_has_one_direction_needs_higher_odds():
    """A diagnosis keeps look-alikes (cosine above 0.95) in a class until their odds exceed 10^4."""
    fits = [hypothesis("a", 1.0, 1e-6, nuisance_sd=1e-9), hypothesis("b", 1.0, 1e-6, nuisance_sd=1e-9)]
    for turn, asked in ((0.1, 1e4), (1.2, 20.0)):
        slopes = [np.array([[0.0, 30.0], [0.0, 0.0]]),
                  np.array([[0.0, 30.0 * math.cos(turn)], [0.0, 30.0 * math.sin(turn)]])]  # fmt: skip
        expected = tuple(Expected(s[:, 1], s[:, 1], s, 0 * s[:, 1]) for s in slopes)
        expected += (Expected(np.zeros(2), np.zeros(2), np.zeros((2, 1)), np.zeros(2)),)
        null = hypothesis("", 0.0, 0.0, nuisance_sd=1e-9)
        what = Open(Judged(tuple(fits), np.zeros(2)), (PairQuestion(0, 1, "a or b"),), (), (*fits, null), 2)
        offer = Offer(Flat(), what, (), 0.0, (Item("runs", 0.0, 1.0, 9, (Block(expected, 5),), 5.0),))
        found = offer.answer((1,), 0)
        d = 2 * 30.0 * math.sin(turn / 2)
        assert found.cosine == pytest.approx(math.cos(turn), abs=1e-6)
        assert found.probability == pytest.approx(norm.sf((math.log(asked) - d**2 / 2) / d), abs=0.06)


def test_cosines_are_those_of_what_the_nuisances_leave():
    rng = np.random.default_rng(8)
    moves, nuisances = rng.normal(size=(12, 2)), rng.normal(size=(12, 3))
    found = Alike.of(moves[:6], nuisances[:6]).plus({Alike.of(moves[6:], nuisances[6:]): 1}).cosine(0, 1)
    metric = np.linalg.inv(np.eye(12) + nuisances @ nuisances.T)
    gram = moves.T @ metric @ moves
    assert found == pytest.approx(gram[0, 1] / math.sqrt(gram[0, 0] * gram[1, 1]), rel=1e-9)


def test_the_cosine_of_a_plan_is_that_of_what_the_effects_alone_change():
    """Of truth less what the nuisance makes by itself, in the metric of noise and of the nuisance in its prior sd."""
    rng = np.random.default_rng(5)
    mass = UncertainParameter("mass", "kg", {"mass": 1.0}, 0.0, 0.3)
    null = replace(hypothesis("", 0.0, 0.0), unknowns=(mass,))
    fits = [hypothesis("a", 1.0, 0.3), hypothesis("b", 1.0, 0.3)]
    changes, common, without = rng.normal(size=(2, 6)), rng.normal(size=6), rng.normal(size=6)
    sd = np.array([0.5, 0.5, 1.0, 1.0, 2.0, 2.0])
    slopes = [np.stack([common, change], 1) for change in changes]
    expected = [
        Expected(without + change, without + change, slope, without, lambda x: (x.T / sd).T)
        for change, slope in zip(changes, slopes, strict=True)
    ]
    expected.append(Expected(without, without, common[:, None], without, lambda x: (x.T / sd).T))
    what = Open(Judged(tuple(fits), np.zeros(2)), (PairQuestion(0, 1, "a or b"),), (), (*fits, null), 2)
    offer = Offer(Flat(), what, (), 0.0, (Item("runs", 0.0, 1.0, 9, (Block(tuple(expected), 5),), 5.0),))
    for count in (1, 3):
        metric = np.linalg.inv(np.diag(sd**2) / count + 0.3**2 * np.outer(common, common))
        gram = changes @ metric @ changes.T
        cosine = gram[0, 1] / math.sqrt(gram[0, 0] * gram[1, 1])
        assert offer.answer((count,), 0).cosine == pytest.approx(cosine, rel=1e-9)


def test_a_limit_falls_with_the_information():
    """sd^-2 = prior^-2 + n / noise^2; 95 % of a one-sided normal is 1.645 sd, of its size 1.960 sd."""
    for one_sided, factor in ((True, 1.6449), (False, 1.9600)):
        u = UncertainParameter("size", "1", {"a": 1.0}, 0.0, 10.0, 0.0 if one_sided else -9.0, 9.0, size=True)
        fit = Fit(
            (Candidate("a", (u,)),), (u,), np.zeros(1), np.array([[4.0]]), np.zeros(1), np.zeros((1, 1)), 0.0, 0.0
        )
        mean = np.zeros(1)
        expected = Expected(mean, mean, np.array([[1 / 0.5]]), mean)
        question = LimitQuestion(0, 0, u, 1.0, 0.5, "a below 0.5")
        what = Open(Judged((fit,), np.zeros(1)), (), (question,), (fit,), 0)
        offer = Offer(Flat(), what, (), 0.0, (Item("runs", 0.0, 1.0, 9, (Block((expected,), 5),), 5.0),))
        for n in (0, 1, 4):
            answer = offer.answer((n,), 0)
            limit = factor / math.sqrt(1 / 4 + n / 0.25)
            assert answer.limit == pytest.approx(limit, rel=1e-3)
            assert answer.met is (limit <= 0.5)


@pytest.fixture(scope="module")
def market():
    """Three speeds of unequal worth and price, a channel that doubles the distance, a bench test."""
    offers = []
    for entry, factor in ((0.0, 1.0), (25.0, 2.0)):
        items = []
        for number, (distance, setup, each) in enumerate(((1.0, 5.0, 3.0), (1.6, 20.0, 6.0), (0.4, 0.0, 1.0))):
            expected, what, odds = pair(factor * distance)
            items.append(Item(f"runs at {number}", setup, each, 5, (Block(expected, number),), float(number)))
        expected, what, odds = pair(3.0)
        items.append(Item("bench", 0.0, 70.0, 1, (Block(expected, 9),)))
        offers.append(Offer(Flat(), what, ("steer_rad",) if entry else (), entry, tuple(items), odds, 0.9))
    return offers


def test_the_cheapest_plan_is_that_of_all_plans(market):
    found = cheapest(market, {0: 2.0}, 99, math.inf)
    every = [
        offer.cost(counts) for offer in market for counts in product(range(6), range(6), range(6), (0, 1))
        if offer.answer(counts, 0).met
    ]  # fmt: skip
    assert found.proven
    assert found.cost == pytest.approx(min(every))
    assert found.offer.answer(found.counts, 0).met


def test_where_no_single_step_gains_the_search_begins_from_all_of_it(market, monkeypatch):
    free = cheapest(market, {0: 2.0}, 99, math.inf)
    monkeypatch.setattr(Search, "greedy", lambda self, offer: (0,) * len(offer.items))
    for most_runs in (99, sum(free.counts[:3])):  # all of it is too much in the second
        found = cheapest(market, {0: 2.0}, most_runs, math.inf)
        assert (found.cost, found.proven) == (pytest.approx(free.cost), True)


def test_runs_that_no_reader_would_take_are_not_planned(market):
    """A table of modes with a new channel needs three rows."""
    few = [replace(offer, fewest=4) for offer in market]
    found = cheapest(few, {0: 2.0}, 99, math.inf)
    assert sum(found.counts[:3]) in (0, *range(4, 16))
    assert [few[0].readable(counts) for counts in ((0, 0, 0, 1), (1, 1, 1, 0), (1, 2, 1, 0))] == [True, False, True]


def test_bounds_on_runs_and_money_are_kept(market):
    free = cheapest(market, {0: 2.0}, 99, math.inf)
    runs = sum(free.counts[:3])
    fewer = cheapest(market, {0: 2.0}, runs - 1, math.inf)
    assert fewer.offer is None or (sum(fewer.counts[:3]) < runs and fewer.cost >= free.cost)
    assert cheapest(market, {0: 2.0}, 99, free.cost - 1).offer is None
    part = richest(market, {0: 2.0}, 99, free.cost - 1)
    assert part.cost <= free.cost - 1
    assert 0 < part.offer.answer(part.counts, 0).probability < 0.9
