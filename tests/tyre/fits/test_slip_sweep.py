"""Slip sweep to cornering stiffness: against recordings made here or by the simulator, with known truth."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.shared.refusals import refuses
from tyre.fits import fit_slip_sweep, interpolate_slip, lagged_magic_formula, slip_reversals, solve_least_squares
from tyre.recordings import Condition, RigRun
from tyre.rig import Dropouts, LoadCellDrift, Noise, PlySteer, Protocol, RigTyre, simulate_sweep

C, K, V = 6300.0, 60e3, 9.3 / 3.6
TYRE = RigTyre(cornering_stiffness=C, lateral_stiffness=K, peak_force=420.0, curvature=-0.3)
FLAT = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="flat", speed=V, temperature=20.0)


def sweep(*effects, seed=0, rate=1.0, cycles=3, axes="adapted SAE", **protocol):
    driven = Protocol(slip_rate=np.deg2rad(rate), cycles=cycles, **protocol)
    rng = np.random.default_rng(seed)
    return simulate_sweep(tyre=TYRE, condition=FLAT, protocol=driven, effects=effects, rng=rng, axes=axes)


def lagged(steady, step):
    """Step dF/ds = F_steady - F, the way s in relaxation lengths."""
    force, decay = np.empty_like(steady), np.exp(-step)
    force[0] = steady[0]
    for k in range(1, steady.size):
        force[k] = decay * force[k - 1] + (1 - decay) * 0.5 * (steady[k] + steady[k - 1])
    return force


def own_sweep(*, stiffness, saturation, length, offset, rate):
    """A sweep made without the package: F = a tanh(C slip / a), lagged."""
    step = 1e-3
    time = np.arange(0.0, 2 * 16.0 / rate, step)
    slip = np.deg2rad(4.0) * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time * rate / 16.0))
    force = lagged(saturation * np.tanh(stiffness * slip / saturation) + offset, step * V / length)
    thin = slice(None, None, 5)
    return RigRun(
        condition=FLAT, axes="adapted SAE", time=time[thin], slip_angle=slip[thin], lateral_force=force[thin],
        vertical_load=np.full(time[thin].size, 400.0),
    )  # fmt: skip


def with_force(change):
    """A sweep without noise, its lateral force (n,) changed by ``change(force, time)``."""
    run = sweep()
    return replace(run, lateral_force=change(run.lateral_force, run.time - run.time[0]))


@pytest.mark.parametrize("rate", [1.0, 2.0, 4.0])
def test_noise_free_sweep_gives_back_the_truth(rate):
    fit = fit_slip_sweep(sweep(PlySteer(force=8.0, slip=0.002), rate=rate))
    assert fit.cornering_stiffness.value == pytest.approx(C, rel=2e-4)
    assert fit.parameters["vertical_shift"] == pytest.approx(8.0, abs=0.1)
    assert fit.parameters["horizontal_shift"] == pytest.approx(0.002, abs=2e-5)
    assert fit.apparent_relaxation_length == pytest.approx(C / K, rel=1e-3)
    assert fit.r_squared > 0.99999


@pytest.mark.parametrize(("rate", "length"), [(1.0, 0.06), (1.0, 0.2), (3.0, 0.12)])
def test_a_curve_of_another_form_gives_its_slope(rate, length):
    run = own_sweep(stiffness=5500.0, saturation=420.0, length=length, offset=-6.0, rate=rate)
    fit = fit_slip_sweep(run)
    assert fit.cornering_stiffness.value == pytest.approx(5500.0, rel=3e-3)
    assert fit.apparent_relaxation_length == pytest.approx(length, rel=0.02)
    assert fit.steady_force(np.array([0.0]))[0] == pytest.approx(-6.0, abs=0.3)


def test_a_wandering_load_does_not_bend_the_curve_and_a_noisy_one_changes_nothing():
    steady = own_sweep(stiffness=5500.0, saturation=420.0, length=0.1, offset=0.0, rate=1.0)
    noise = 3.0 * np.random.default_rng(5).standard_normal(steady.time.size)
    for frequency in (0.13, 0.29, 0.61):
        load = 400.0 * (1 + 0.02 * np.sin(2 * np.pi * frequency * steady.time + 1))
        run = replace(steady, lateral_force=steady.lateral_force * load / 400.0, vertical_load=load + noise)
        found = fit_slip_sweep(run).cornering_stiffness.value
        assert found == pytest.approx(5500.0, rel=1e-3), frequency  # 2.5e-3 to 2e-2 without
    noisy = fit_slip_sweep(replace(steady, vertical_load=400.0 + 5 * noise)).cornering_stiffness.value
    assert noisy == pytest.approx(fit_slip_sweep(steady).cornering_stiffness.value, rel=2e-4)


def test_without_lag_correction_a_fast_sweep_is_biased():
    """Low: one curve for both branches is their mean, and a curve that bends is less steep h either side of zero."""
    without = fit_slip_sweep(sweep(rate=2.0), lag_correction=False).cornering_stiffness.value
    assert -0.01 < without / C - 1 < -1e-3  # h = 0.08 deg; a brush weighed in would be 9 % high


def test_one_branch_needs_the_relaxation_length_for_its_offset():
    run = sweep(rate=1.0)
    turns = slip_reversals(run)
    one = slice(int(turns[1]), int(turns[2]))
    names = ("time", "slip_angle", "lateral_force", "vertical_load", "aligning_moment", "speed", "temperature")
    branch = replace(run, **{name: getattr(run, name)[one] for name in names})
    zero = np.array([0.0])
    left_in = fit_slip_sweep(branch)
    assert any("only one direction of sweep" in note for note in left_in.notes)
    # half the branch gap, C rate length / v; the branch falls, so the force lies above
    assert left_in.steady_force(zero)[0] == pytest.approx(C * np.deg2rad(1.0) * (C / K) / V, rel=0.02)
    assert abs(fit_slip_sweep(branch, relaxation_length=C / K).steady_force(zero)[0]) < 0.02


def test_two_rates_in_one_recording_tell_play_from_lag():
    # triangles at 1 and then at 4 deg/s; the steering hangs behind by 1 mrad whatever the rate
    play, step = 1e-3, 0.005
    phase = np.concatenate([np.arange(0.0, 8.0, step / 4.0), np.arange(8.0, 24.0, step)])
    slip = np.deg2rad(4.0) * (np.abs((phase + 3.0) % 4.0 - 2.0) - 1.0)
    direction = np.where((phase + 1.0) % 4.0 < 2.0, 1.0, -1.0)
    force = lagged(420.0 * np.tanh(C * (slip - play * direction) / 420.0), step * V / 0.11)
    fit = fit_slip_sweep(RigRun(FLAT, "ISO", step * np.arange(slip.size), slip, force, np.full(slip.size, 400.0)))
    assert fit.cornering_stiffness.value == pytest.approx(C, rel=4e-3)
    assert fit.parameters["hysteresis"] == pytest.approx(play, rel=0.05)
    assert fit.apparent_relaxation_length == pytest.approx(0.11, rel=0.03)
    # the branches lie apart by twice the lag at their mean rate and twice the play
    assert fit.rate == pytest.approx(np.mean(np.abs(fit.blocks.rate[fit.blocks.settled])))
    assert fit.half_gap == pytest.approx(0.11 / V * fit.rate + play, rel=0.03)


def test_fit_uncertainty_matches_the_scatter_of_repeats():
    fits = [fit_slip_sweep(sweep(Noise(), LoadCellDrift(), seed=seed)) for seed in range(16)]
    scatter = np.std([fit.cornering_stiffness.value for fit in fits], ddof=1)
    claimed = np.sqrt(np.mean([fit.fit_sd**2 for fit in fits]))
    # 15 degrees of freedom: the ratio lies within 0.64..1.35 in 95 % of cases, 0.55..1.5 in 99.5 %
    slopes = np.std([fit.curve_slope for fit in fits], ddof=1)
    assert 0.55 < slopes / np.sqrt(np.mean([fit.curve_slope_sd**2 for fit in fits])) < 1.5
    # A needless law with a brush weighs 1 / sqrt(466 blocks) = 5 %. Its slope is k = 3 times less sure, and lies off by
    # sqrt(k^2 - 1) of that sd: the claim is sqrt(1 + 0.05 * 2 (k^2 - 1)) = 1.35 times wider, and scatters no more.
    widened = [fit.fit_sd / fit.curve_slope_sd for fit in fits]
    assert 1.1 < np.median(widened) < 1.6
    assert 0.55 / 1.35 < scatter / claimed < 1.5
    gaps = [fit.half_gap for fit in fits]
    assert np.mean(gaps) == pytest.approx(C / K / V * fits[0].rate, rel=0.03)
    assert 0.55 < np.std(gaps, ddof=1) / np.sqrt(np.mean([fit.half_gap_sd**2 for fit in fits])) < 1.5


LAWS = {  # force over its largest, of C slip over the largest force; none is a Magic Formula as the fit has it
    "arctangent": lambda x: 2 / np.pi * np.arctan(np.pi / 2 * x),
    "tanh": np.tanh,
    "brush": lambda x: np.sign(x) * (1 - (1 - np.minimum(np.abs(x) / 3, 1)) ** 3),
}


@pytest.mark.parametrize("law", LAWS)
def test_the_interval_holds_the_slope_of_whatever_law_the_tyre_has(law):
    """An arctangent was read as a brush, 9 % too steep, by 16 sd: a brush has fewer numbers, which is no evidence."""
    quiet, errors = sweep(), []
    steady = 420.0 * LAWS[law](C * quiet.slip_angle / 420.0)
    force = lagged(steady, (quiet.time[1] - quiet.time[0]) * K * V / C)
    for seed in (100, 102, 104, 107):
        noisy = sweep(Noise(), LoadCellDrift(), seed=seed)
        fit = fit_slip_sweep(replace(noisy, lateral_force=noisy.lateral_force - quiet.lateral_force + force))
        errors.append((fit.cornering_stiffness.value - C) / fit.fit_sd)
        assert fit.fit_sd < 0.04 * C
    assert np.sqrt(np.mean(np.square(errors))) < 1.9  # chi^2 of 4: 0.995 of cases


def test_spikes_and_dropouts_hardly_matter():
    clean = fit_slip_sweep(sweep(Noise(), seed=4))
    assert all(not clean.parameters_sd[name] < 0.05 * abs(clean.parameters[name]) for name in ("shape", "curvature"))
    assert clean.fit_sd / clean.cornering_stiffness.value < 0.02
    assert clean.branches == 7  # up from zero, six full strokes less the last quarter, back to zero
    assert clean.rate == pytest.approx(np.deg2rad(1.0), rel=0.01)
    spiky = fit_slip_sweep(sweep(Noise(), Dropouts(share=2e-3, spike=200.0), seed=4))
    assert spiky.cornering_stiffness.value == pytest.approx(clean.cornering_stiffness.value, abs=2 * clean.fit_sd)
    assert any("samples without lateral force rejected" in note for note in spiky.notes)


def test_varying_speed_is_followed_by_distance():
    run = sweep(cycles=2)
    wobble = V * (1.0 + 0.05 * np.sin(2 * np.pi * run.time / 7.0))
    # the same force history happens at the same travelled distance, so stretch the clock
    time = np.concatenate([[0.0], np.cumsum(np.diff(run.time) * V / (0.5 * (wobble[1:] + wobble[:-1])))])
    fit = fit_slip_sweep(replace(run, time=time, speed=wobble))
    assert fit.cornering_stiffness.value == pytest.approx(C, rel=1e-3)
    assert fit.apparent_relaxation_length == pytest.approx(C / K, rel=0.02)


@pytest.fixture(scope="module")
def as_it_is():
    """A sweep and its fit, with which those of other tyres are compared."""
    run = sweep(PlySteer(force=5.0), Noise(), seed=6, cycles=2)
    return run, fit_slip_sweep(run)


@settings(max_examples=4)
@given(factor=st.floats(0.3, 3.0), mirrored=st.booleans())
def test_scaling_and_mirroring_the_tyre(as_it_is, factor, mirrored):
    run, plain = as_it_is
    sign = -1.0 if mirrored else 1.0
    changed = replace(run, slip_angle=sign * run.slip_angle, lateral_force=sign * factor * run.lateral_force)
    other = fit_slip_sweep(changed)
    assert other.cornering_stiffness.value == pytest.approx(factor * plain.cornering_stiffness.value, rel=1e-6)
    assert other.parameters["lag"] == pytest.approx(plain.parameters["lag"], rel=1e-3)


@pytest.mark.parametrize(("change", "words"), [
    (lambda run: {"lateral_force": -run.lateral_force}, "lateral force falls with slip .* check axes"),
    (lambda run: {"time": run.time[::-1]}, "time does not increase"),
    (lambda run: {"slip_angle": 0.05 * run.slip_angle}, "spans 0.40 deg; a sweep of at least 1 deg"),
    (lambda run: {"lateral_force": np.where(run.time < 12.0, np.nan, run.lateral_force)},
     "of the lateral force is missing"),
    (lambda run: {"slip_angle": np.where(run.time < 12.0, np.nan, run.slip_angle)}, "of the channel is missing"),
    (lambda run: {"slip_angle": run.slip_angle + 0.3}, "does not cross zero slip"),
    (lambda run: {"speed": 0.0 * run.speed}, "needs a speed above 0"),
    (lambda run: {"lateral_force": 300.0 * np.sign(run.slip_angle)}, "far from the slope near zero slip"),
])  # fmt: skip
def test_recordings_that_are_no_sweep_are_refused(change, words):
    run = sweep(cycles=2)
    refuses(words, fit_slip_sweep, replace(run, **change(run)))


def test_a_sweep_that_is_over_before_the_lag_has_settled_is_refused():
    run = sweep(rate=60.0, cycles=1)
    refuses("are left after the lag has settled; sweep more slowly", fit_slip_sweep, run)


def test_too_few_samples_and_missing_speed_are_refused():
    run = sweep(cycles=2)
    names = ("time", "slip_angle", "lateral_force", "vertical_load", "aligning_moment", "speed", "temperature")
    refuses("10 samples are too few", fit_slip_sweep, replace(run, **{name: getattr(run, name)[:10] for name in names}))
    silent = replace(run, speed=None, condition=replace(FLAT, speed=None))
    refuses("a known relaxation length needs the speed", fit_slip_sweep, silent, relaxation_length=0.1)
    assert fit_slip_sweep(silent).apparent_relaxation_length is None


# NIST StRD nonlinear regression, https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml: data, start, certified
MISRA1A = (
    [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0],
    [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78],
)
DANWOOD = ([1.309, 1.471, 1.490, 1.565, 1.611, 1.680], [2.138, 3.421, 3.597, 4.340, 4.882, 5.660])


@pytest.mark.parametrize(("data", "model", "slope", "start", "certified", "squares"), [
    (MISRA1A, lambda b, x: b[0] * (1.0 - np.exp(-b[1] * x)),
     lambda b, x: np.column_stack([1.0 - np.exp(-b[1] * x), b[0] * x * np.exp(-b[1] * x)]),
     (500.0, 1e-4), (2.3894212918e2, 5.5015643181e-4), 1.2455138894e-1),
    (DANWOOD, lambda b, x: b[0] * x ** b[1],
     lambda b, x: np.column_stack([x ** b[1], b[0] * x ** b[1] * np.log(x)]),
     (1.0, 5.0), (7.6886226176e-1, 3.8604055871), 4.3173084083e-3),
], ids=["Misra1a", "DanWood"])  # fmt: skip
def test_engine_reaches_the_certified_digits_of_nist(data, model, slope, start, certified, squares):
    x, y = map(np.array, data)
    found = solve_least_squares(lambda b: (model(b, x) - y, slope(b, x)), np.array(start))
    np.testing.assert_allclose(found.x, certified, rtol=1e-8)
    assert 2.0 * found.cost == pytest.approx(squares, rel=1e-10)


def test_a_force_that_drifts_leaves_no_residual():
    """The drift that was fitted is taken off, not added: 20 N over the recording, 2 % of which would be left."""
    fit = fit_slip_sweep(with_force(lambda f, t: f + 20.0 * t / t[-1]))
    assert fit.parameters["drift"] == pytest.approx(20.0, rel=0.05)
    assert fit.residual_sd < 0.5
    assert fit.r_squared > 0.9999


@pytest.mark.parametrize("offset", [0.0, 500.0])
def test_r_squared_is_what_noise_leaves_of_the_scatter_about_the_mean(offset):
    """1 - s^2 / var(F) of white noise s, whatever the mean of the force."""
    noise = 60.0
    rng = np.random.default_rng(2)
    clean = with_force(lambda f, t: f)
    run = with_force(lambda f, t: f + offset + noise * rng.standard_normal(f.size))
    expected = 1 - noise**2 / (np.var(clean.lateral_force) + noise**2)
    fit = fit_slip_sweep(run)
    assert fit.r_squared == pytest.approx(expected, abs=0.004)
    assert fit.residual_sd == pytest.approx(noise, rel=0.05)
    assert any(note.startswith(f"R^2 = {fit.r_squared:.4f} is low") for note in fit.notes) == (fit.r_squared < 0.98)
    assert fit.r_squared < 0.98


def test_derivatives_of_the_force_are_those_of_the_force():
    """Central differences; one that is wrong by a percent lets a search crawl and stop where rounding leaves it."""
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.uniform(0.05, 0.15, 60))
    history = interpolate_slip(time, np.deg2rad(5.0) * np.sin(time) + 1e-3 * rng.standard_normal(60))
    at = {
        "cornering_stiffness": C, "peak": 420.0, "shape": 1.3, "curvature": -0.4, "horizontal_shift": 0.002,
        "lag": 0.043, "hysteresis": 0.001,
    }  # fmt: skip

    def force(**changed):
        direction = np.sign(np.cos(time))
        return lagged_magic_formula(time=time[3:], history=history, direction=direction[3:], **at | changed)

    for number, (name, value) in enumerate(at.items()):
        h = 1e-5 * value
        by_difference = (force(**{name: value + h})[0] - force(**{name: value - h})[0]) / (2 * h)
        np.testing.assert_allclose(
            force()[1][number], by_difference, rtol=1e-5, atol=1e-6 * np.abs(by_difference).max(), err_msg=name
        )


@pytest.mark.parametrize("draw", [12, 13, 14])
def test_rounding_of_the_force_moves_no_number_of_the_fit(draw):
    """Another BLAS kernel rounds otherwise: degrees of freedom differed by 3e-6 for it, then by 5e-8."""
    run = sweep(Noise(), LoadCellDrift(), seed=12, rate=2.0)
    rounded = np.random.default_rng(draw).choice([1 - 2e-16, 1.0, 1 + 2.3e-16], run.lateral_force.size)
    fit, again = fit_slip_sweep(run), fit_slip_sweep(replace(run, lateral_force=run.lateral_force * rounded))
    assert fit.cornering_stiffness.value == pytest.approx(again.cornering_stiffness.value, rel=1e-12)
    assert fit.cornering_stiffness.dof == pytest.approx(again.cornering_stiffness.dof, rel=3e-9)
    assert fit.fit_sd == pytest.approx(again.fit_sd, rel=3e-9)


def test_run_and_fit_print_a_few_lines_with_their_numbers_and_units():
    run = sweep(Noise())
    fit = fit_slip_sweep(run)
    lines = str(fit).splitlines()
    c = fit.cornering_stiffness.scaled(np.pi / 180)
    assert lines[0].startswith(
        f"<SlipSweepFit at {fit.load:.4g} N: {fit.samples} samples, branches: {fit.branches}, R^2"
    )
    value, sd = lines[1].removeprefix(" cornering stiffness ").removesuffix(" N/deg").split(" ± ")
    assert (float(value), float(sd)) == pytest.approx((c.value, c.sd), abs=0.05 * c.sd)
    value, sd = lines[2].removeprefix(" apparent relaxation length ").partition(" mm at ")[0].split(" ± ")
    assert float(value) == pytest.approx(1e3 * fit.apparent_relaxation_length, abs=0.05)
    assert float(sd) == pytest.approx(1e3 * fit.parameters_sd["lag"] * fit.speed, abs=0.05)
    assert lines[-1].endswith(f"; notes: {len(fit.notes)}>")
    assert len(lines) <= 4
    assert str(run).startswith(f"<RigRun slip_sweep: Synthetic on flat, 400 N, 5.5 bar; {run.time.size} samples over ")
    assert f" slip angle {np.degrees(run.slip_angle.min()):.4g} to " in str(run)
