"""Relaxation length by three routes, against closed forms and simulated recordings of known length."""

from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad, solve_ivp

from tests.shared.refusals import refuses
from tyre.fits import (
    agreement,
    dahl_friction,
    first_order_lag,
    fit_slip_step,
    is_slip_step,
    mean_length,
    mean_of_steps,
    relaxation_from_stiffness,
    relaxation_from_two_rates,
)
from tyre.measured import Calibration, Estimate, combine_uncertainties
from tyre.recordings import Condition, RigRun
from tyre.rig import Noise, PlySteer, Protocol, RigTyre, simulate_step, simulate_sweep

C, K = 6300.0, 60e3
TYRE = RigTyre(cornering_stiffness=C, lateral_stiffness=K, peak_force=420.0)
FLAT = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="flat", speed=0.5, temperature=20.0)


LINEAR = 1e5  # N: the force is a thousandth of the load, so the curve is a straight line


def analytic_step(*, length=0.12, speed=0.5, noise=0.0, slip=0.017, seed=0):
    """F = F0 + C slip (1 - exp(-v t / length)), Dell'Orto et al. eq. (2) with its erratum."""
    time = np.arange(0.0, 4.0, 0.001)
    rolled = np.maximum(time - 1.0, 0.0) * speed
    force = 3.0 + C * slip * (1.0 - np.exp(-rolled / length))
    rng = np.random.default_rng(seed)
    return RigRun(
        condition=FLAT, axes="SAE", time=time, slip_angle=np.where(time > 1.0, slip, 0.0),
        lateral_force=force + noise * rng.standard_normal(time.size), vertical_load=np.full(time.size, LINEAR),
        speed=np.full(time.size, speed), kind="slip_step",
    )  # fmt: skip


def test_a_step_late_in_the_record_is_one():
    """The slip after the step is that of the end, though most of the record lies before it."""
    run, wait = analytic_step(length=0.06), np.arange(0.0, 6.0, 0.001)
    before = {"slip_angle": 0.0, "lateral_force": 3.0, "vertical_load": LINEAR, "speed": 0.5}
    longer = {name: np.concatenate([np.full(wait.size, at), getattr(run, name)]) for name, at in before.items()}
    late = replace(run, time=np.concatenate([wait, run.time + 6.0]), **longer)
    assert fit_slip_step(late).relaxation_length.value == pytest.approx(0.06, rel=0.01)


@pytest.mark.parametrize(("length", "slip"), [(0.06, 0.017), (0.12, -0.01), (0.25, 0.017)])
def test_analytic_step_gives_its_length(length, slip):
    fit = fit_slip_step(analytic_step(length=length, slip=slip))
    assert fit.relaxation_length.value == pytest.approx(length, rel=0.01)
    assert fit.distance_to_63 == pytest.approx(length, abs=0.004)
    assert fit.force_change == pytest.approx(C * slip, rel=5e-3)


def curved_step(*, length, slip, load=450.0, friction=0.95, shape=1.4, curvature=0.0, seed=0):
    """Slip lags, dy/dx = (slip - y) / length; the force is the Magic Formula of y, with white noise of 1 N."""
    b, run = C / (shape * friction * load), analytic_step(slip=slip)
    rolled = np.maximum(run.time - 1.0005, 0.0) * 0.5  # the recorded slip rises between two samples
    y = solve_ivp(lambda x, y: (slip - y) / length, (0.0, rolled[-1]), [0.0], t_eval=rolled[1001:], rtol=1e-8).y[0]
    u = b * np.concatenate([np.zeros(1001), y])
    force = friction * load * np.sin(shape * np.arctan(u - curvature * (u - np.arctan(u))))
    noise = np.random.default_rng(seed).standard_normal(force.size)
    return replace(run, lateral_force=3.0 + force + noise, vertical_load=np.full(force.size, load))


@pytest.mark.parametrize("slip", [0.5, 1.0, -2.0])
def test_the_force_follows_the_curve_at_the_lagged_slip(slip):
    """A lag of the force, which is the same at small slip, would give 0.6 %, 2.3 % and 9 % too little here."""
    fit = fit_slip_step(curved_step(length=0.11, slip=np.deg2rad(slip)))
    assert fit.relaxation_length.value == pytest.approx(0.11, abs=max(2.5 * fit.fit_sd, 2e-4))
    assert fit.fit_sd < 0.006 * 0.11
    deficit = 1 - 427.5 * np.sin(1.4 * np.arctan(C / 598.5 * np.deg2rad(slip))) / (C * np.deg2rad(slip))
    assert fit.deficit == pytest.approx(deficit, rel=0.05)


def test_a_curve_that_is_not_known_is_in_the_interval_and_sweeps_make_it_known():
    other = {"friction": 1.3, "shape": 1.3, "curvature": -1.0}
    fit = fit_slip_step(curved_step(length=0.11, slip=np.deg2rad(1.0), **other))
    assert fit.relaxation_length.value > 0.111
    assert fit.relaxation_length.covers(0.11)
    step = Summary(fit.relaxation_length.value, fit.fit_sd, {
        "slip_before_rad": fit.slip[0], "slip_after_rad": fit.slip[1], "curve_sd_m": fit.curve_sd, "dof": fit.fit_dof,
        "deficit": fit.deficit, "length_by_deficit": fit.length_by_deficit})  # fmt: skip
    sweep = Summary(C, 10.0, {"curve_slope_N_per_rad": C, "peak_N": 1.3 * 450.0, "shape": 1.3, "curvature": -1.0})
    told, untold = (mean_of_steps([step], sweeps, repeatability=1e-6) for sweeps in ([sweep], []))
    assert told.value == pytest.approx(0.11, abs=0.0004)
    assert told.sd < 0.5 * untold.sd
    assert untold.sd == pytest.approx(fit.relaxation_length.sd, rel=1e-6)


@dataclass(frozen=True)
class Summary:
    value: float
    fit_sd: float
    details: dict[str, float]


def test_a_slow_step_does_not_lengthen_the_result():
    protocol = Protocol(step_rise=0.3, step_distance=1.5)
    run = simulate_step(tyre=TYRE, condition=FLAT, protocol=protocol, effects=[], rng=np.random.default_rng(0))
    assert fit_slip_step(run).relaxation_length.value == pytest.approx(C / K, rel=0.01)


def test_speed_may_change_during_a_step():
    run = analytic_step(length=0.12)
    assert run.speed is not None
    speed = 0.5 * (1.0 + 0.3 * np.sin(3.0 * run.time))
    time = np.concatenate([[0.0], np.cumsum(np.diff(run.time) * 0.5 / (0.5 * (speed[1:] + speed[:-1])))])
    assert fit_slip_step(replace(run, time=time, speed=speed)).relaxation_length.value == pytest.approx(0.12, rel=0.02)


def test_a_load_that_swings_with_the_wheel_is_not_taken_for_lag():
    """A swing of 4 % once a turn of 2.1 m: the length comes out 3 % too short where the load is not recorded."""
    run = curved_step(length=0.11, slip=np.deg2rad(1.0))
    swing = 1.0 + 0.04 * np.sin(2 * np.pi * 0.5 * run.time / 2.1 - 0.5)
    pressed = replace(run, lateral_force=3.0 + (run.lateral_force - 3.0) * swing, vertical_load=450.0 * swing)
    steady = replace(pressed, vertical_load=np.full(run.time.size, 450.0))
    known, unknown = (fit_slip_step(one).relaxation_length.value for one in (pressed, steady))
    assert known == pytest.approx(0.11, rel=0.015)
    assert unknown < 0.98 * 0.11


def test_noisy_steps_scatter_as_claimed():
    effects = [PlySteer(), Noise(white=2.0, correlated=2.0)]
    fits = [
        fit_slip_step(
            simulate_step(
                tyre=TYRE, condition=FLAT, protocol=Protocol(), effects=effects, rng=np.random.default_rng(seed)
            )
        )
        for seed in range(30)
    ]
    values = np.array([fit.relaxation_length.value for fit in fits])
    claimed = np.sqrt(np.mean([fit.relaxation_length.sd**2 for fit in fits]))
    assert abs(values.mean() - C / K) < 4 * values.std() / np.sqrt(30)
    assert 0.65 < values.std(ddof=1) / claimed < 1.4


def test_steps_are_told_from_sweeps():
    step = analytic_step()
    assert is_slip_step(step)
    assert is_slip_step(replace(step, kind="slip_sweep"))
    sweep = simulate_sweep(
        tyre=TYRE, condition=FLAT, protocol=Protocol(cycles=1), effects=[], rng=np.random.default_rng(0)
    )
    assert not is_slip_step(sweep)
    twice = np.where(step.time % 2.0 > 1.0, 0.017, 0.0) * (step.time < 3.5)  # out and back, and again
    assert np.count_nonzero(np.diff(twice)) == 4
    assert not is_slip_step(replace(step, slip_angle=twice, kind="slip_sweep"))


@pytest.mark.parametrize(("change", "words"), [
    (lambda run: {"slip_angle": 0.0 * run.slip_angle}, "changes by 0.000 deg; a step of 0.1 deg"),
    (lambda run: {"lateral_force": -run.lateral_force}, "lateral force falls with slip"),
    (lambda run: {"speed": 0.0 * run.time}, "must roll forward throughout"),
    (lambda run: {"speed": None, "condition": replace(FLAT, speed=None)}, "needs the speed"),
    (lambda run: {"lateral_force": np.where(run.time < 3.97, np.nan, run.lateral_force)}, "too few for a slip step"),
    (lambda run: {"lateral_force": 3.0 + 30.0 * np.maximum(run.time - 1.0, 0.0)}, "at least three relaxation lengths"),
])  # fmt: skip
def test_unusable_steps_are_refused(change, words):
    run = analytic_step()
    refuses(words, fit_slip_step, replace(run, **change(run)))


def test_ratio_and_covariance_against_monte_carlo():
    calibration = Calibration(force=0.01, slip=0.006, displacement=0.004)
    length, covariance = relaxation_from_stiffness(
        cornering_stiffness=Estimate(C, 0.008 * C), lateral_stiffness=Estimate(K, 0.005 * K), calibration=calibration
    )
    rng = np.random.default_rng(0)
    n = 200_000
    force = rng.normal(0.0, 0.01, n)
    c = C * (1 + rng.normal(0.0, 0.008, n)) * (1 + force) * (1 + rng.normal(0.0, 0.006, n))
    k = K * (1 + rng.normal(0.0, 0.005, n)) * (1 + force) * (1 + rng.normal(0.0, 0.004, n))
    drawn = np.cov(np.stack([c, k, c / k]))
    np.testing.assert_allclose(covariance, drawn, rtol=0.05)
    assert length.value == pytest.approx(C / K)
    assert length.sd == pytest.approx(np.sqrt(drawn[2, 2]), rel=0.02)


@dataclass(frozen=True)
class Gap:
    rate: float
    half_gap: float
    half_gap_sd: float = 1e-5
    speed: float | None = 2.5


def test_two_rates_separate_lag_from_friction_of_the_steering():
    # h = h0 + rate length / v with h0 = 4e-4 rad and length 0.11 m, by hand
    gaps = [Gap(rate, 4e-4 + rate * 0.11 / 2.5) for rate in (0.0175, 0.07, 0.0175, 0.07)]
    estimate = relaxation_from_two_rates(gaps)
    assert estimate is not None
    assert estimate.value == pytest.approx(0.11, rel=1e-9)
    # slope of a straight line: sd = sigma / sqrt(sum (x - mean)^2), x = rate / v
    assert estimate.sd == pytest.approx(1e-5 / (0.0525 / 2.5), rel=1e-9)
    assert relaxation_from_two_rates(gaps[:1]) is None
    assert relaxation_from_two_rates([gaps[0], gaps[2]]) is None
    assert relaxation_from_two_rates([replace(gap, speed=None) for gap in gaps]) is None


def test_agreement_is_a_chi_squared_test():
    routes = {"a": Estimate(0.100, 0.002), "b": Estimate(0.106, 0.004), "c": Estimate(0.099, 0.003)}
    result = agreement(routes)
    assert result is not None
    value, weight = np.array([0.1, 0.106, 0.099]), 1 / np.array([0.002, 0.004, 0.003]) ** 2
    mean = np.sum(value * weight) / np.sum(weight)
    chi2 = np.sum((value - mean) ** 2 * weight)
    assert (result.chi2, result.p_value) == pytest.approx((chi2, stats.chi2.sf(chi2, 2)), rel=1e-6)
    assert "agree (chi^2" in result.sentence
    far = agreement({"a": Estimate(0.1, 0.001), "b": Estimate(0.13, 0.001)})
    assert far is not None
    assert far.p_value < 1e-6
    assert "disagree" in far.sentence
    assert agreement({"a": Estimate(0.1, 0.001)}) is None


def test_a_chance_disagreement_of_one_condition_in_nine_is_none():
    # chi^2 with 1 dof of two routes z apart (in sd of their difference) is z^2; p = 0.047 is z = 1.986
    apart = stats.norm.isf(0.047 / 2) * np.hypot(0.001, 0.001)
    alone = agreement({"a": Estimate(0.1, 0.001), "b": Estimate(0.1 + apart, 0.001)})
    assert alone.p_value == pytest.approx(0.047, rel=1e-6)
    assert not alone.agree
    among = replace(alone, tests=9)
    assert (1 - among.limit) ** 9 == pytest.approx(0.95)  # all nine agree in 95 % of campaigns without a cause
    assert among.agree
    assert "agree (chi^2 = 3.95, 1 dof, p = 0.047)" in among.sentence


def test_mean_length_and_combined_uncertainties():
    fits = [fit_slip_step(analytic_step(noise=4.0, seed=seed)).relaxation_length for seed in range(4)]
    mean = mean_length(fits)
    assert mean is not None
    assert mean.value == pytest.approx(np.mean([fit.value for fit in fits]))
    assert mean.dof == pytest.approx(11)  # 3 of the repeats, 8 of the stated repeatability
    single = mean_length(fits[:1], repeatability=0.05)
    assert single is not None
    assert single.sd > 0.05 * single.value
    assert mean_length([]) is None
    # JCGM 100:2008, annex G: 3 and 4 with 9 and infinite degrees of freedom
    sd, dof = combine_uncertainties([(3.0, 9.0), (4.0, np.inf)])
    assert (sd, dof) == pytest.approx((5.0, 5.0**4 / (3.0**4 / 9.0)))


def test_interval_uses_student_and_bad_calibration_is_refused():
    low, high = Estimate(10.0, 1.0, 4.0).ci95
    assert high - 10.0 == pytest.approx(2.776445, abs=1e-6)  # t(0.975, 4), any table
    assert low == pytest.approx(20.0 - high)
    refuses("calibration.slip = -0.1 must be a relative standard uncertainty from", Calibration, slip=-0.1)


def test_dahl_friction_solves_its_equation():
    """dT/dx = (1 - T sgn(dx)) / presliding over a path with two reversals (Dahl 1968)."""
    presliding, state, expected = 3e-5, 0.0, [0.0]
    path = np.array([0.0, 2e-5, 9e-5, 4e-5, -6e-5, -5e-5, 8e-5])
    for begin, end in pairwise(path):
        way = np.sign(end - begin)
        rate = lambda x, t, way=way: (1 - t * way) / presliding  # noqa: E731
        state = solve_ivp(rate, (begin, end), [state], rtol=1e-10, atol=1e-12).y[0, -1]
        expected.append(state)
    np.testing.assert_allclose(dahl_friction(path, presliding=presliding), expected, atol=1e-8)
    several = dahl_friction(path, presliding=np.array([1e-5, presliding]))
    np.testing.assert_allclose(several[1], expected, atol=1e-8)
    assert dahl_friction(path[1:], presliding=presliding, start=0.0)[0] == pytest.approx(expected[1])


def test_a_lag_solves_its_equation():
    """y' + y = u for a piecewise linear u, by the convolution integral; a steady input stays as it is."""
    step, rng = 0.3, np.random.default_rng(1)
    u = rng.standard_normal(12)
    x = step * np.arange(12)
    found = first_order_lag(u, step=step)
    for k in (1, 5, 11):
        integral = sum(quad(lambda s, k=k: np.exp(s - x[k]) * np.interp(s, x, u), x[j], x[j + 1])[0] for j in range(k))
        assert found[k] == pytest.approx(u[0] * np.exp(-x[k]) + integral, abs=1e-9)
    np.testing.assert_allclose(first_order_lag(np.full(9, 2.5), step=0.7), 2.5)
    assert first_order_lag(u, step=step, start=4.0)[0] == pytest.approx(4.0)
    later = first_order_lag(u, step=step, start=4.0) - found
    np.testing.assert_allclose(later, (4.0 - u[0]) * np.exp(-x), atol=1e-12)


@pytest.mark.parametrize("scatter", [0.1, 4.0])
def test_scatter_about_the_line_of_rates_widens_its_slope_and_never_narrows_it(scatter):
    """Against the weighted straight line of numpy, with and without the scale of its residuals."""
    pace, sd = np.array([0.02, 0.05, 0.08, 0.12]), 2e-4
    gap = 1e-3 + 0.14 * pace + scatter * sd * np.array([1.0, -1.0, -1.0, 1.0])
    numbers = zip(gap, pace, strict=True)
    sweeps = [SimpleNamespace(half_gap=g, half_gap_sd=sd, rate=2.5 * p, speed=2.5) for g, p in numbers]
    found = relaxation_from_two_rates(sweeps)
    line, covariance = np.polyfit(pace, gap, 1, w=np.full(4, 1 / sd), cov=True if scatter > 1 else "unscaled")
    assert (found.value, found.sd) == pytest.approx((line[0], np.sqrt(covariance[0, 0])), rel=1e-9)
    assert found.dof == 2.0
