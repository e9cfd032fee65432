"""What moved, what could still be there and whether the verdict stands, on lines whose posterior is known."""

import dataclasses
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from studies import inference

PLACES = np.repeat(np.arange(1.0, 7.0), 4)
POWERS = {"linear": 1, "square": 2, "other": 1, "stiff": 1, "shift": 0}
WEAK = 2  # seed of a growth that is named by a hair
LEVEL_OF_LINE = inference.UncertainParameter("level", "m", {"level": 1.0}, 2.0, 0.5)


def growth(name, *, scale=1.0, lowest=0.0, **more):
    return inference.Candidate(
        name, (inference.UncertainParameter("rate", "m/s", {name: 1.0}, 0.0, scale, lowest, size=True, **more),)
    )


@dataclass(frozen=True, eq=False)
class Line(inference.Kind):
    """Readings level + rate t, sd 1, at six times; a candidate's name says which power of t it goes with."""

    readings: np.ndarray
    candidates: tuple
    nuisances: tuple = (LEVEL_OF_LINE,)

    @property
    def rows(self):
        series = tuple("ab"[k % 2] for k in range(24))
        fold = (PLACES - 1).astype(int)
        return inference.Rows(tuple(f"{t:g} s" for t in PLACES), PLACES, series, fold, axis="time, s")

    def residual(self, candidates, theta, *, slopes=True):
        columns = [np.ones(24), *(PLACES ** POWERS[c.identifier] / 6 for c in candidates)]
        jacobian = np.stack(columns, 1)
        return self.readings - jacobian @ theta, -jacobian if slopes else np.empty((24, 0))


def line(rate, *candidates, seed=0, noise=1.0):
    rng = np.random.default_rng(seed)
    return Line(1.5 + rate * PLACES / 6 + noise * rng.standard_normal(24), candidates)


def by_grid(forward, scale, lowest):
    """95 % limit of the size by adding up the posterior on a grid of level and rate."""
    level, rate = np.linspace(-2, 5, 1401), np.linspace(lowest, 8, 1601)
    chi2 = ((level - 2.0) / 0.5)[:, None] ** 2 + (rate / scale)[None] ** 2
    for y, t in zip(forward.readings, PLACES, strict=True):
        chi2 = chi2 + (y - level[:, None] - rate[None] * t / 6) ** 2
    density = np.exp(-(chi2 - chi2.min()) / 2).sum(0)
    below = cumulative_trapezoid(density, rate, initial=0)
    if lowest == 0:
        return float(np.interp(0.95, below / below[-1], rate))
    both = np.interp(np.abs(rate), rate, below) - np.interp(-np.abs(rate), rate, below)
    return float(np.interp(0.95, both[rate >= 0] / below[-1], rate[rate >= 0]))


def limits_of(forward):
    """Limits beside nothing, of candidates of which no fit is known."""
    null = inference.fit(forward)
    return inference.upper_limits(forward, inference.Hypotheses(null, (), forward), null)


def test_a_level_moves_as_the_weighted_mean_says():
    forward = line(0.0)
    null = inference.fit(forward)
    (found,) = inference.compare_nuisances(null, null)
    weight = 24 + 1 / 0.5**2
    mean = (forward.readings.sum() + 2.0 / 0.5**2) / weight
    assert (found.name, found.unit, found.prior, found.prior_sd) == ("level", "m", 2.0, 0.5)
    assert found.value == pytest.approx(mean, rel=1e-6)
    assert found.sd == pytest.approx(weight**-0.5, rel=1e-6)
    assert found.shift == found.alone == pytest.approx((mean - 2.0) / 0.5, rel=1e-5)


def test_what_moved_most_in_the_final_fit_comes_first():
    other = dataclasses.replace(LEVEL_OF_LINE, name="other", sets={"other": 1.0}, centre=0.0, scale=1.0)

    class Two(Line):
        def residual(self, candidates, theta, *, slopes=True):
            r, j = super().residual(candidates, np.delete(theta, 1), slopes=slopes)
            swing = np.where(PLACES > 3, 1.0, -1.0)
            return r - swing * theta[1], np.insert(j, 1, -swing, axis=1) if slopes else j

    forward = Two(2.0 + 1.5 * np.where(PLACES > 3, 1.0, -1.0), (), (LEVEL_OF_LINE, other))
    assert [m.name for m in inference.compare_nuisances(inference.fit(forward), inference.fit(forward))] == [
        "other",
        "level",
    ]


@pytest.mark.parametrize("rate", [-1.5, 0.0, 1.0])
@pytest.mark.parametrize("lowest", [0.0, -8.0])
def test_limits_are_those_of_the_posterior_added_up(rate, lowest):
    candidate = growth("linear", lowest=lowest)
    forward = line(rate, candidate, seed=3)
    null = inference.fit(forward)
    (found,) = inference.upper_limits(
        forward, inference.Hypotheses(null, (inference.fit(forward, (candidate,)),), forward), null
    )
    assert found.values["rate"] == pytest.approx(by_grid(forward, 1.0, lowest), rel=5e-3)
    assert (found.two_sided, found.least) == (lowest < 0, False)
    (stepped,) = limits_of(forward)
    assert stepped.values["rate"] == pytest.approx(found.values["rate"], rel=1e-3)


def test_a_limit_no_narrower_than_the_prior_is_none():
    (found,) = limits_of(line(0.0, growth("linear", scale=0.02)))
    assert not found.limited
    (tight,) = limits_of(line(0.0, growth("linear", scale=50.0)))
    assert tight.limited
    assert tight.share < 0.1


def test_a_compliance_is_limited_from_below_by_wheel():
    u = inference.UncertainParameter("stiffness", "N/m", {"r": 1.2, "f": 0.8}, 0.0, 1.0, 1e-4, power=-1, size=True,
                           labels=("rear", "front"))  # fmt: skip
    forward = line(0.0, inference.Candidate("stiff", (u,)), seed=3)
    (found,) = limits_of(forward)
    assert found.least
    edge = by_grid(forward, 1.0, 0.0)
    assert found.values["stiffness.rear"] == pytest.approx(1.2 / edge, rel=0.01)
    assert found.values["stiffness.front"] == pytest.approx(0.8 / edge, rel=0.01)


def test_a_model_that_does_not_fit_limits_less():
    (narrow,), (wide,) = (limits_of(line(0.0, growth("linear"), noise=noise)) for noise in (1.0, 4.0))
    assert wide.share > 1.3 * narrow.share


def test_the_named_effect_and_what_does_not_go_with_it_have_no_limit():
    first, second = growth("linear"), growth("square")
    forward = line(4.0, first, second)
    final = inference.fit(forward, (first,))
    known = inference.Hypotheses(inference.fit(forward), (final,), forward)
    assert [u.identifier for u in inference.upper_limits(forward, known, final)] == ["square"]

    class Alone(Line):
        def compatible(self, candidates):
            return len(candidates) < 2

    assert inference.upper_limits(Alone(forward.readings, forward.candidates), known, final) == ()


def test_limits_of_plain_normals():
    """Tables: 95 % of |x| is 1.960, and of a normal far above zero 1.645 beyond its mean."""
    assert inference.tail_limit(0.0) == pytest.approx(1.960, abs=5e-4)
    assert inference.size_limit(0.0) == pytest.approx(1.960, abs=5e-4)
    assert inference.tail_limit(8.0) == pytest.approx(9.645, abs=5e-4)
    assert inference.size_limit(-8.0) == pytest.approx(9.645, abs=5e-4)
    assert inference.tail_limit(-50.0) == pytest.approx(-np.log(0.05) / 50, rel=2e-3)  # an exponential tail


# ---- stability


def whole(forward, **settings):
    return inference.Variant(
        "as it is", forward, forward.candidates, np.ones(len(forward.rows.places), bool), **settings
    )


STRONG = line(9.0, growth("linear", scale=3.0), growth("shift", scale=1.0), seed=5)


def test_a_variant_that_changes_nothing_says_the_same():
    plain, seen = inference.judge(STRONG), inference.judge(whole(STRONG))
    assert seen.verdict.equivalent == plain.verdict.equivalent == ("linear",)
    assert seen.hypotheses.p_nothing == pytest.approx(plain.hypotheses.p_nothing, rel=1e-9)


def test_noise_priors_and_rows_are_those_of_the_variant():
    forward = line(2.0, growth("linear"))
    theta = np.array([2.0, 1.0])
    residual, slope = forward.residual(forward.candidates, theta)
    kept = PLACES != 3
    v = inference.Variant("less", forward, forward.candidates, kept, noise=2.0, prior=0.5)
    seen, slopes = v.residual(forward.candidates, theta)
    np.testing.assert_allclose(seen, residual[kept] / 2)
    np.testing.assert_allclose(slopes, slope[kept] / 2)
    assert v.nuisances[0].scale == 0.25
    assert v.candidates[0].unknowns[0].scale == 1.0
    assert len(v.rows.places) == len(v.rows.series) == len(v.rows.fold) == 20
    assert 3.0 not in v.rows.abscissa


def test_the_prior_of_the_library_stays_where_fewer_candidates_are_tried():
    first, others = growth("linear"), tuple(growth(name) for name in ("square", "other"))
    forward = line(1.0, first, *others)
    few = inference.Variant("few", forward, (first,), np.ones(24, bool))

    def odds(model):
        null, one = inference.fit(model), inference.fit(model, (first,))
        return inference.Hypotheses(null, (one,), model).odds(one, null)

    assert odds(few) == pytest.approx(odds(forward), rel=1e-9)


def test_every_variant_is_named_after_what_it_changes():
    forward = line(1.0, growth("linear"))
    assert [v.what for v in inference.variants(forward, forward.candidates)] == [
        "noise sd x 0.8", "noise sd x 1.3", "parameter uncertainties x 0.5", "parameter uncertainties x 2",
        *(f"without time {t} s" for t in range(1, 7)), "without a", "without b",
    ]  # fmt: skip
    without_nuisances = dataclasses.replace(forward, nuisances=())
    assert not any("parameters" in v.what for v in inference.variants(without_nuisances, ()))


def test_the_same_places_of_two_parts_are_told_apart():
    forward = inference.Joint(tuple(inference.Part(name, line(1.0, growth("linear"))) for name in ("walk", "run")))
    named = [v.what for v in inference.variants(forward, ())]
    assert len(set(named)) == len(named)
    assert [what for what in named if "time 3 s" in what] == [
        "without time 3 s (walk: a, walk: b)", "without time 3 s (run: a, run: b)",
    ]  # fmt: skip


def test_a_strong_growth_stands_and_a_weak_one_does_not():
    told: list[str] = []
    found = inference.stability(inference.judge(STRONG), progress=told.append)
    assert told == [one.what for one in found.outcomes]
    by_name = {one.what: one for one in found.outcomes}
    assert by_name["noise sd x 1.3"].same
    assert by_name["parameter uncertainties x 2"].names == ("linear",)
    assert (found.tried, found.library) == (("linear", "shift"), 2)
    weak = inference.judge(line(2.0, growth("linear", scale=3.0), growth("shift", scale=1.0), seed=WEAK))
    assert weak.verdict.equivalent[:1] == ("linear",)
    after = inference.stability(weak)
    assert any(not one.same for one in after.outcomes)
    assert after.holds == sum(one.same for one in after.outcomes) < len(after.outcomes)


def test_the_candidates_of_the_leading_hypotheses_are_tried_again():
    assert {c.identifier for c in inference.leading(inference.judge(STRONG))} == {"linear", "shift"}


def test_a_leader_from_the_class_is_the_same_and_another_word_is_not():
    judgement = inference.judge(line(4.0, growth("linear"), growth("other")))
    assert set(judgement.verdict.equivalent) == {"linear", "other"}
    swapped = [
        inference.Outcome("a", "class", ("other", "linear"), 0.0), inference.Outcome("b", "named", ("linear",), 0.0),
        inference.Outcome("c", "none", (), 0.9), inference.Outcome("d", "class", ("square",), 0.0),
    ]  # fmt: skip
    found = inference.stability(judgement, run=lambda _, __: swapped)
    assert [one.same for one in found.outcomes] == [True, False, False, False]
    assert found.holds == 1
    assert found.to_dict()["variants"][0]["names"] == ["other", "linear"]


def test_the_order_of_effects_in_a_name_does_not_count():
    judgement = inference.judge(STRONG)
    pair = dataclasses.replace(judgement.verdict, equivalent=("linear+shift",))
    turned = [
        inference.Outcome("a", pair.verdict, ("shift+linear",), 0.0),
        inference.Outcome("b", "partial", ("shift+linear",), 0.0),
    ]
    found = inference.stability(dataclasses.replace(judgement, verdict=pair), run=lambda _, __: turned)
    assert [one.same for one in found.outcomes] == [True, False]


def test_an_outcome_is_the_verdict_in_short():
    forward = line(0.0, growth("linear"))
    found, verdict = inference.outcome(whole(forward)), inference.judge(forward).verdict
    assert isinstance(verdict, inference.Verdict)
    assert (found.verdict, found.names) == ("none", ())
    assert found.nothing == pytest.approx(verdict.posterior["none"])
