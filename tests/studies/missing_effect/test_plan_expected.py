"""What hypotheses expect of further runs: published eigenvalues, and the residual of a run that is there already."""

import math

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.identification.run import Run
from bicycle.model import Model
from bicycle.responses.inputs import pulse
from bicycle.responses.linear import respond
from studies.inference.fit import Fit, fit
from studies.inference.identifiability import BENCH_SD
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.motion.measurements import HistoryMeasurement, ModalMeasurement
from studies.missing_effect.motion.modal_table import ModalPoint
from studies.missing_effect.plan.costs import Bench, Costs
from studies.missing_effect.plan.expected import bench_test, history_run, modal_run

BENCHMARK = Model(load_bicycle("benchmark"))
WEAVE = {5.0: -0.775341882195845 + 4.46486771378823j, 8.0: -2.693486835810972 + 8.460379713969305j}
"""1/s; Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463, table 2."""


@pytest.fixture(scope="module")
def modal():
    points = tuple(ModalPoint(v, "weave", root, (0.05, 0.1), {}) for v, root in WEAVE.items())
    forward = ModalMeasurement(name="m", model=BENCHMARK, points=points).forward()
    damper = next(c for c in forward.candidates if c.identifier == "steer_damper")
    null = fit(forward)
    return forward, (null, fit(forward, (damper,), starts=[np.concatenate([null.theta, [1.0]])]))


def test_a_run_of_modes_is_the_published_eigenvalue_in_sd_of_one_run(modal):
    forward, (null, _) = modal
    nominal = np.array([u.centre for u in forward.nuisances])
    here = type(null)((), null.unknowns, nominal, null.covariance, null.residual, null.jacobian, 0.0, 0.0)
    ((one,),) = modal_run(forward, [here], 8.0, (), Costs(sd={"imag_rad_s": 0.2}))
    assert one.truth == pytest.approx([WEAVE[8.0].real / 0.05, WEAVE[8.0].imag / 0.2], rel=1e-9)
    ((far,),) = modal_run(forward, [here], 5.0, ("steer_over_lean", "yaw_over_lean"), Costs())
    assert far.truth[:2] == pytest.approx([WEAVE[5.0].real / 0.05, WEAVE[5.0].imag / 0.1], rel=1e-9)
    assert len(far.truth) == 6
    assert far.slopes.shape == (6, len(nominal))


def test_slopes_are_those_of_the_expected_numbers_and_nothing_is_left_without_the_effect(modal):
    forward, (_, damped) = modal
    ((one,),) = modal_run(forward, [damped], 6.0, (), Costs())
    step, moved = 1e-4, []
    for sign in (1, -1):
        theta = damped.theta.copy()
        theta[-1] += sign * step
        there = type(damped)(damped.candidates, damped.unknowns, theta, damped.covariance, damped.residual,
                             damped.jacobian, 0.0, 0.0)  # fmt: skip
        moved.append(modal_run(forward, [there], 6.0, (), Costs())[0][0].truth)
    assert one.slopes[:, -1] == pytest.approx((moved[0] - moved[1]) / (2 * step), rel=1e-4)
    plain = type(damped)((), damped.unknowns[:-1], damped.theta[:-1], damped.covariance[:-1, :-1], damped.residual,
                         damped.jacobian[:, :-1], 0.0, 0.0)  # fmt: skip
    ((without,),) = modal_run(forward, [plain], 6.0, (), Costs())
    assert one.without == pytest.approx(without.truth)


def test_a_mode_that_no_free_decay_shows_is_not_planned(modal):
    forward, fits = modal
    assert modal_run(forward, fits, 0.5, (), Costs()) == []


def test_a_bench_test_reads_the_size_where_there_is_one_and_zero_elsewhere(modal):
    _, (null, damped) = modal
    size = damped.theta[-1]
    absent, there = bench_test([null, damped], "steer_damper", Bench(1.0, 0.25))
    assert (absent.truth[0], there.truth[0]) == pytest.approx((0.0, size / 0.25))
    assert there.slopes[0, -1] == pytest.approx(4.0)
    assert not absent.slopes.any()
    usual = bench_test([damped], "steer_damper.damping", Bench(1.0))[0]
    assert usual.slopes[0, -1] == pytest.approx(1 / (BENCH_SD * damped.unknowns[-1].scale))
    trail = bench_test([null, damped], "c", Bench(1.0, 0.001))
    place = [u.name for u in null.unknowns].index("c")
    assert [e.slopes[0, place] for e in trail] == pytest.approx([1000.0, 1000.0])
    assert bench_test([null, damped], "steer_spring", Bench(1.0)) is None


@pytest.mark.parametrize(("power", "coordinate", "value"), [(0, math.log(4.0), 4.0), (-1, 0.25, 4.0)])
def test_the_sd_of_a_bench_test_is_that_of_the_value_whatever_the_coordinate(power, coordinate, value):
    """A value one sd of the test away is one unit away in what is expected, from either side."""
    u = UncertainParameter("stiffness", "N/m", {"a.stiffness": 1.0}, 1.0, 0.5, power=power, size=True)
    found = Fit((Candidate("a", (u,)),), (u,), np.array([coordinate]), np.eye(1), np.zeros(1), np.zeros((1, 1)), 0, 0)
    (one,) = bench_test([found], "a", Bench(1.0, 0.01))
    ends = [math.log(end) if power == 0 else 1 / end for end in (value - 0.005, value + 0.005)]
    assert abs(one.slopes[0, 0] * (ends[1] - ends[0])) == pytest.approx(1.0, rel=1e-4)


@pytest.fixture(scope="module")
def history():
    rng, time, runs = np.random.default_rng(2), np.arange(0, 1.5, 0.02), []
    push = {"steer_torque": pulse(1.0, start=0.2, duration=0.3)}
    for v in (5.0, 6.0):
        moved = respond(BENCHMARK, speed=v, time=time, initial={"lean_rate": 0.1}, inputs=push)
        seen = moved.outputs["lean_rate"] + 0.01 * rng.normal(size=len(time))
        runs.append(
            Run(f"run{v}", v, time, {"roll_rate_rad_s": seen}, {"steer_torque_N_m": moved.inputs["steer_torque"]})
        )
    runs = tuple(runs)
    forward = HistoryMeasurement(name="h", model=BENCHMARK, runs=runs, noise_sd={"roll_rate_rad_s": 0.01}).forward()
    return forward, fit(forward)


def test_a_run_that_is_there_already_is_seen_as_the_engine_sees_it(history):
    """Measured minus model, starts integrated out, is the residual of the run; so are slopes and determinant."""
    forward, null = history
    ((one,),) = history_run(forward, [null], 6.0, (), Costs())
    run = forward.runs[1]
    data = forward.noise["roll_rate_rad_s"].whiten(run.channels["roll_rate_rad_s"])
    residual, slopes = forward.residual((), null.theta)
    half = len(run.time)
    assert one.whiten((data - one.model)[:, None])[:, 0] == pytest.approx(residual[half:], abs=1e-9)
    size = np.abs(slopes[half:]).max(0)
    assert np.abs(one.whiten(one.slopes) + slopes[half:]).max(0) / size == pytest.approx(0 * size, abs=1e-3)
    both = [history_run(forward, [null], v, (), Costs())[0][0].log_det for v in (5.0, 6.0)]
    assert sum(both) == pytest.approx(forward.log_determinant((), null.theta), rel=1e-9)


def test_a_further_channel_adds_samples_and_a_falling_bicycle_ends_the_run(history):
    forward, null = history
    ((one,),) = history_run(forward, [null], 6.0, ("steer_rad",), Costs(sd={"steer_rad": 0.001}))
    assert len(one.truth) == 2 * 75
    ((fine,),) = history_run(forward, [null], 6.0, ("steer_rad",), Costs(sd={"steer_rad": 0.0005}))
    assert fine.truth[75:] == pytest.approx(2 * one.truth[75:])
    assert history_run(forward, [null], 0.3, (), Costs()) == [] or (
        len(history_run(forward, [null], 0.3, (), Costs())[0][0].truth) < 75
    )
